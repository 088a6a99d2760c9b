//! Walks a function's tree: constructs, the places where control flow joins, phis and calls.
//!
//! At a [merge point](MergePoint) that several edges reach, each variable that the construct stores to gets variables
//! of the IR, which every edge assigns; so do phis. If only one edge reaches it, the variables keep the registers that
//! they have at that edge.

use std::collections::{HashMap, VecDeque};
use std::rc::Rc;

use isa::ir::{Label, MAX_NESTING, Reg, Type};
use isa::op::Op as Ir;
use spirv::Op;

use super::emitter::Emitter;
use super::instruction;
use super::structurize::{Case, Construct, Edge, Jump, MergePoint, Node, Tree};
use super::translator::Translator;
use super::value::{Pointer, Value};
use super::variables;
use super::vertex_memory;
use crate::error::{Diagnostic, Error, Result, malformed, unsupported};
use crate::instruction::Instruction;
use crate::module::Block;

/// The instructions that an inlined function counts for at least. It bounds nested calls of empty functions.
const CALL_COST: usize = 16;

/// A function being inlined.
struct Call {
    function: usize,
    tree: Rc<Tree>,
    merge_points: HashMap<MergePoint, MergeVariables>,
    labels: HashMap<Construct, Label>,
    /// The scope that early returns leave.
    scope: Option<Label>,
    /// The merge of all returns: its variables, and the returned value.
    returns: MergeVariables,
    result: Option<Rc<[Reg]>>,
    /// Variables of the IR for the value, if several blocks return.
    result_variables: Option<Rc<[Reg]>>,
}

/// A merge point while its construct is open.
#[derive(Clone, Default)]
struct MergeVariables {
    /// The variables, each with the registers that the edges assign, or the registers at the only edge.
    variables: Vec<(usize, Rc<[Option<Reg>]>)>,
    assigns: bool,
}

/// A switch's selector and, for each case, the values that select it.
struct WordSelector {
    reg: Reg,
    values: Vec<Vec<u32>>,
}

/// The registers, before a construct, of the variables that it stores to.
type Saved = Vec<(usize, Vec<Option<Reg>>)>;

/// Walks an entry point's function and those that it calls.
pub struct ControlFlow<'a> {
    pub t: Translator<'a>,
    /// The IR variables of phis.
    phis: HashMap<u32, Rc<[Reg]>>,
    /// Functions being inlined, innermost last.
    calls: Vec<Call>,
    /// The nesting depth of the node being translated.
    depth: usize,
}

impl<'a> ControlFlow<'a> {
    /// The state at the beginning of a translation.
    pub fn new(t: Translator<'a>) -> Self {
        Self { t, phis: HashMap::new(), calls: Vec::new(), depth: 0 }
    }

    /// Translates the entry point's function and assigns the outputs at its end.
    pub fn run(&mut self, function: usize) -> Result<(), Error> {
        let definition = &self.t.module.sections.functions[function].definition;
        let locate = |diagnostic: Diagnostic| diagnostic.locate(definition.reference());
        vertex_memory::allocate(&mut self.t).map_err(locate)?;
        variables::global_variables(&mut self.t)?;
        if !self.t.module.sections.functions[function].parameters.is_empty() {
            return Err(locate(Diagnostic::Malformed("the entry point has parameters".into())));
        }
        self.inline(function).map_err(locate)?;
        variables::assign_outputs(&mut self.t).map_err(locate)
    }

    /// Translates `OpFunctionCall`.
    fn call(&mut self, instruction: &Instruction) -> Result<()> {
        let Some(function) = self.t.module.functions.get(&instruction.id(0)?).copied() else {
            return malformed("there is no such function");
        };
        let parameters = &self.t.module.sections.functions[function].parameters;
        let arguments = instruction.ids(1);
        if parameters.len() != arguments.len() {
            return malformed("the number of arguments is wrong");
        }
        for (parameter, argument) in parameters.iter().zip(arguments) {
            let (id, ty) = (parameter.result()?, parameter.ty()?);
            let value = self.t.value(argument)?;
            self.t.promoted.unbind(id);
            match &value {
                Value::Regs(regs) if regs.len() != self.t.globals.types.scalars(ty)? as usize => {
                    return malformed("an argument doesn't fit its parameter");
                }
                Value::Pointer(pointer) => {
                    if let Pointer::PromotedVariable { variable, .. } = **pointer {
                        self.t.promoted.bind(id, variable);
                    }
                }
                _ => {}
            }
            self.t.values.insert(id, value);
            self.t.types.insert(id, ty);
        }
        match self.inline(function)? {
            Some(regs) => self.t.define(instruction, regs.to_vec()),
            None => Ok(()),
        }
    }

    /// Translates a function's body in place. Returns the returned value.
    fn inline(&mut self, function: usize) -> Result<Option<Rc<[Reg]>>> {
        let Some(tree) = self.t.analysis.tree(function) else {
            return malformed("the function isn't structured");
        };
        self.t.emit.charge_budget(CALL_COST)?;
        self.declare_phis(function)?;
        let modified: Vec<u32> = tree.modified.iter().copied().filter(|root| self.outlives(function, *root)).collect();
        let returns = self.begin_merge(&modified, tree.returns)?;
        let scope = tree.early_return.then(|| self.t.emit.builder.begin_scope());
        self.calls.push(Call {
            function,
            tree: tree.clone(),
            merge_points: HashMap::new(),
            labels: HashMap::new(),
            scope,
            returns,
            result: None,
            result_variables: None,
        });
        self.emit_nodes(&tree.nodes)?;
        let Some(call) = self.calls.pop() else {
            return malformed("a function ends twice");
        };
        if scope.is_some() {
            self.t.emit.builder.end();
        }
        self.end_merge(&call.returns);
        Ok(call.result)
    }

    /// Tells if a variable that a function stores to exists outside it.
    fn outlives(&self, function: usize, root: u32) -> bool {
        let parameters = &self.t.module.sections.functions[function].parameters;
        self.t.globals.variables.contains_key(&root) || parameters.iter().any(|it| it.result_id == Some(root))
    }

    fn block(&self, index: usize) -> Result<&'a Block> {
        let function = self.calls.last().map_or(0, |call| call.function);
        match self.t.module.sections.functions[function].blocks.get(index) {
            Some(block) => Ok(block),
            None => malformed("there is no such block"),
        }
    }

    fn terminator(&self, index: usize) -> Result<&'a Instruction> {
        match self.block(index)?.instructions.last() {
            Some(last) => Ok(last),
            None => malformed("a block is empty"),
        }
    }

    fn call_mut(&mut self) -> Result<&mut Call> {
        match self.calls.last_mut() {
            Some(call) => Ok(call),
            None => malformed("an instruction outside functions"),
        }
    }

    fn emit_nodes(&mut self, nodes: &[Node]) -> Result<()> {
        // The nesting of inlined functions adds up.
        if self.depth >= MAX_NESTING {
            return unsupported("constructs are nested too deeply");
        }
        self.depth += 1;
        let done = nodes.iter().try_for_each(|node| self.emit_node(node));
        self.depth -= 1;
        done
    }

    fn emit_node(&mut self, node: &Node) -> Result<()> {
        match node {
            Node::Block(index) => self.instructions(*index),
            Node::Edge(edge) => self.emit_edge(edge),
            Node::Exit(index) => self.emit_exit(*index),
            Node::If { merge_point, scope, modified, .. } => {
                self.begin_merge_point(*merge_point, modified)?;
                match scope {
                    None => self.emit_if(node)?,
                    Some(construct) => {
                        let saved = self.save(modified)?;
                        let label = self.t.emit.builder.begin_scope();
                        self.call_mut()?.labels.insert(*construct, label);
                        self.emit_if(node)?;
                        self.t.emit.builder.end();
                        self.restore(&saved);
                    }
                }
                self.end_merge_point(*merge_point)
            }
            Node::Switch { block, selector, construct, cases, merge_point, modified } => {
                let terminator = self.terminator(*block)?;
                let selector = self.t.reg(*selector).map_err(|diagnostic| diagnostic.locate(terminator.reference()))?;
                self.emit_switch(selector, *construct, cases, *merge_point, modified)
            }
            Node::Loop { .. } => self.emit_loop(node),
        }
    }

    fn instructions(&mut self, index: usize) -> Result<()> {
        let Some((_, body)) = self.block(index)?.instructions.split_last() else {
            return malformed("a block is empty");
        };
        for instruction in body {
            if !matches!(instruction.opcode, Op::Phi | Op::LoopMerge | Op::SelectionMerge) {
                match instruction.opcode {
                    Op::FunctionCall => self.call(instruction),
                    _ => instruction::translate(&mut self.t, instruction),
                }
                .map_err(|diagnostic| diagnostic.locate(instruction.reference()))?;
                self.t.emit.charge_budget(0).map_err(|diagnostic| diagnostic.locate(instruction.reference()))?;
            }
        }
        Ok(())
    }

    /// The end of an invocation or a function.
    fn emit_exit(&mut self, index: usize) -> Result<()> {
        let terminator = self.terminator(index)?;
        match terminator.opcode {
            Op::Kill | Op::TerminateInvocation => {
                self.t.interface.discards = true;
                self.t.emit.builder.kill();
            }
            Op::Return | Op::ReturnValue => {
                let mut pairs = Vec::new();
                if terminator.opcode == Op::ReturnValue {
                    let regs = self
                        .t
                        .regs(terminator.id(0)?)
                        .map_err(|diagnostic| diagnostic.locate(terminator.reference()))?;
                    self.return_value(regs, &mut pairs)?;
                }
                let mut returns = std::mem::take(&mut self.call_mut()?.returns);
                self.assign_at_merge(&mut returns, &mut pairs)?;
                parallel_copy(&mut self.t.emit, pairs)?;
                self.call_mut()?.returns = returns;
                if let Some(scope) = self.call_mut()?.scope {
                    self.t.emit.builder.break_to(scope);
                }
            }
            // Never reached; if it is, nothing may follow.
            _ => self.t.emit.builder.ret(),
        }
        Ok(())
    }

    fn return_value(&mut self, regs: Rc<[Reg]>, pairs: &mut Vec<(Reg, Reg)>) -> Result<()> {
        if self.call_mut()?.tree.returns <= 1 {
            self.call_mut()?.result = Some(regs);
            return Ok(());
        }
        let variables = match self.call_mut()?.result_variables.clone() {
            Some(variables) => variables,
            None => {
                let types: Vec<_> = regs.iter().map(|reg| self.t.emit.builder.type_of(*reg)).collect();
                types.into_iter().map(|ty| self.t.emit.builder.variable(ty)).collect()
            }
        };
        if variables.len() != regs.len() {
            return malformed("the function returns values of different types");
        }
        pairs.extend(variables.iter().copied().zip(regs.iter().copied()));
        let call = self.call_mut()?;
        call.result_variables = Some(variables.clone());
        call.result = Some(variables);
        Ok(())
    }

    /// The branches of a selection.
    fn emit_if(&mut self, node: &Node) -> Result<()> {
        let Node::If { block, condition, then, otherwise, modified, .. } = node else {
            return Ok(());
        };
        let Some(condition) = condition else {
            return self.emit_nodes(then);
        };
        let terminator = self.terminator(*block)?;
        let condition = self.t.reg(*condition).map_err(|diagnostic| diagnostic.locate(terminator.reference()))?;
        match self.t.emit.known(condition) {
            // A specialization constant may decide a branch.
            Some(0) => self.emit_nodes(otherwise),
            Some(_) => self.emit_nodes(then),
            None => {
                let saved = self.save(modified)?;
                self.t.emit.builder.begin_if(condition);
                self.emit_nodes(then)?;
                self.restore(&saved);
                if !otherwise.is_empty() {
                    self.t.emit.builder.begin_else();
                    self.emit_nodes(otherwise)?;
                    self.restore(&saved);
                }
                self.t.emit.builder.end();
                Ok(())
            }
        }
    }

    fn emit_switch(
        &mut self,
        selector: Reg,
        construct: Construct,
        cases: &[Case],
        merge_point: Option<MergePoint>,
        modified: &[u32],
    ) -> Result<()> {
        self.begin_merge_point(merge_point, modified)?;
        for case in cases {
            if let Some((merge_point, edge)) = &case.entry {
                self.begin_merge_point(Some(*merge_point), modified)?;
                self.emit_edge(edge)?;
            }
        }
        let saved = self.save(modified)?;
        let selector = self.word_selector(selector, cases)?;
        let label = self.t.emit.builder.begin_switch(selector.reg);
        self.call_mut()?.labels.insert(construct, label);
        for (case, values) in cases.iter().zip(&selector.values) {
            self.t.emit.builder.begin_case(values, case.default);
            self.restore(&saved);
            if let Some((merge_point, _)) = case.entry {
                self.end_merge_point(Some(merge_point))?;
            }
            self.emit_nodes(&case.body)?;
            if case.fallthrough {
                self.t.emit.builder.fall_through();
            }
        }
        self.t.emit.builder.end();
        self.restore(&saved);
        self.end_merge_point(merge_point)
    }

    /// A selector of 32 bits, and the values of each case: those of a selector of 64 bits are numbered.
    fn word_selector(&mut self, selector: Reg, cases: &[Case]) -> Result<WordSelector> {
        let all = || cases.iter().map(|case| case.values.as_slice());
        if self.t.emit.builder.type_of(selector) != Type::B64 {
            let narrowed = |values: &[u64]| values.iter().map(|value| *value as u32).collect();
            return Ok(WordSelector { reg: selector, values: all().map(narrowed).collect() });
        }
        let mut reg = self.t.emit.u32(u32::MAX);
        let mut numbered = Vec::with_capacity(cases.len());
        let mut next = 0;
        for values in all() {
            self.t.emit.charge_budget(values.len())?;
            let first = next;
            for value in values {
                let value = self.t.emit.u64(*value);
                let this = self.t.emit.op(Ir::IEq64, &[selector, value]);
                let number = self.t.emit.u32(next);
                reg = self.t.emit.select(this, number, reg);
                next += 1;
            }
            numbered.push((first..next).collect());
        }
        Ok(WordSelector { reg, values: numbered })
    }

    fn emit_loop(&mut self, node: &Node) -> Result<()> {
        let Node::Loop { construct, body, continuing, header, continues, merge, modified } = node else {
            return Ok(());
        };
        self.begin_merge_point(Some(*header), modified)?;
        self.assign_at_merge_point(*header, Vec::new())?;
        self.begin_merge_point(Some(*merge), modified)?;
        self.begin_merge_point(*continues, modified)?;
        self.end_merge_point(Some(*header))?;
        let saved = self.save(modified)?;
        let label = self.t.emit.builder.begin_loop();
        self.call_mut()?.labels.insert(*construct, label);
        self.emit_nodes(body)?;
        if !continuing.is_empty() {
            self.t.emit.builder.begin_continuing();
            self.restore(&saved);
            self.end_merge_point(*continues)?;
            self.emit_nodes(continuing)?;
        }
        self.t.emit.builder.end();
        self.restore(&saved);
        self.end_merge_point(Some(*merge))
    }

    /// Translates a branch: assigns phis and variables, then leaves the construct if necessary.
    fn emit_edge(&mut self, edge: &Edge) -> Result<()> {
        let pairs = self.phi_pairs(edge)?;
        match edge.merge_point {
            Some(merge_point) => self.assign_at_merge_point(merge_point, pairs)?,
            None => parallel_copy(&mut self.t.emit, pairs)?,
        }
        let label = |construct, call: &Call| call.labels.get(&construct).copied();
        match edge.jump {
            Jump::None => {}
            Jump::Break(construct) => match label(construct, self.call_mut()?) {
                Some(label) => self.t.emit.builder.break_to(label),
                None => return malformed("a break out of nothing"),
            },
            Jump::Continue(construct) => match label(construct, self.call_mut()?) {
                Some(label) => self.t.emit.builder.continue_to(label),
                None => return malformed("a continue of nothing"),
            },
        }
        Ok(())
    }

    /// Creates variables of the IR for a function's phis.
    fn declare_phis(&mut self, function: usize) -> Result<()> {
        let blocks = &self.t.module.sections.functions[function].blocks;
        for instruction in blocks.iter().flat_map(|block| &block.instructions) {
            if instruction.opcode != Op::Phi {
                continue;
            }
            let scalars = self
                .t
                .globals
                .types
                .flatten(instruction.ty()?)
                .map_err(|diagnostic| diagnostic.locate(instruction.reference()))?;
            self.t.emit.charge_budget(scalars.len())?;
            let regs: Rc<[Reg]> =
                scalars.iter().map(|scalar| self.t.emit.builder.variable(scalar.register())).collect();
            self.phis.insert(instruction.result()?, regs.clone());
            self.t.define(instruction, regs.to_vec())?;
        }
        Ok(())
    }

    /// The assignments that an edge makes to the phis of its target.
    fn phi_pairs(&mut self, edge: &Edge) -> Result<Vec<(Reg, Reg)>> {
        let from = self.block(edge.from)?.label;
        let mut pairs = Vec::new();
        for instruction in &self.block(edge.to)?.instructions {
            if instruction.opcode != Op::Phi {
                break;
            }
            let ids = instruction.ids(0);
            let source = ids.chunks_exact(2).find(|pair| Some(pair[1]) == from);
            let Some(source) = source.map(|pair| pair[0]) else {
                let diagnostic = Diagnostic::Malformed("a predecessor is missing".into());
                return Err(diagnostic.locate(instruction.reference()).into());
            };
            let regs = self.t.regs(source).map_err(|diagnostic| diagnostic.locate(instruction.reference()))?;
            let Some(variables) = self.phis.get(&instruction.result()?) else {
                return malformed("a phi isn't declared");
            };
            if variables.len() != regs.len() {
                let diagnostic = Diagnostic::Malformed(format!("%{source} is of another type"));
                return Err(diagnostic.locate(instruction.reference()).into());
            }
            pairs.extend(variables.iter().copied().zip(regs.iter().copied()));
        }
        Ok(pairs)
    }

    fn promoted_of(&self, modified: &[u32]) -> Vec<usize> {
        let mut variables: Vec<usize> = modified.iter().filter_map(|root| self.t.promoted.find(*root)).collect();
        variables.sort_unstable();
        variables.dedup();
        variables
    }

    fn begin_merge(&mut self, modified: &[u32], edges: usize) -> Result<MergeVariables> {
        let mut merge = MergeVariables { variables: Vec::new(), assigns: edges > 1 };
        if edges == 0 {
            return Ok(merge);
        }
        for variable in self.promoted_of(modified) {
            let scalars = self.t.promoted.variables[variable].scalars.clone();
            self.t.emit.charge_budget(scalars.len())?;
            let regs = scalars
                .iter()
                .map(|scalar| {
                    let assigned = merge.assigns;
                    assigned.then(|| self.t.emit.builder.variable(scalar.register()))
                })
                .collect();
            merge.variables.push((variable, regs));
        }
        Ok(merge)
    }

    fn begin_merge_point(&mut self, merge_point: Option<MergePoint>, modified: &[u32]) -> Result<()> {
        if let Some(merge_point) = merge_point {
            let edges = self.call_mut()?.tree.edges[merge_point];
            let merge = self.begin_merge(modified, edges)?;
            self.call_mut()?.merge_points.insert(merge_point, merge);
        }
        Ok(())
    }

    /// Assigns the variables of a merge point, and these pairs, in parallel, at an edge that reaches it.
    fn assign_at_merge(&mut self, merge: &mut MergeVariables, pairs: &mut Vec<(Reg, Reg)>) -> Result<()> {
        for (variable, regs) in &mut merge.variables {
            if merge.assigns {
                for (index, assigned) in regs.iter().enumerate() {
                    let (emit, io) = (&mut self.t.emit, &mut self.t.io);
                    let now = self.t.promoted.read_scalar(emit, io, *variable, index)?;
                    pairs.extend(assigned.map(|assigned| (assigned, now)));
                }
            } else {
                *regs = self.t.promoted.variables[*variable].now.as_slice().into();
            }
        }
        Ok(())
    }

    fn assign_at_merge_point(&mut self, merge_point: MergePoint, mut pairs: Vec<(Reg, Reg)>) -> Result<()> {
        let Some(mut merge) = self.call_mut()?.merge_points.remove(&merge_point) else {
            return malformed("a branch to a construct that isn't open");
        };
        self.assign_at_merge(&mut merge, &mut pairs)?;
        self.call_mut()?.merge_points.insert(merge_point, merge);
        parallel_copy(&mut self.t.emit, pairs)
    }

    /// After the merge point, variables have the values that the edges assigned.
    fn end_merge(&mut self, merge: &MergeVariables) {
        for (variable, regs) in &merge.variables {
            self.t.promoted.variables[*variable].now = regs.to_vec();
        }
    }

    fn end_merge_point(&mut self, merge_point: Option<MergePoint>) -> Result<()> {
        if let Some(merge_point) = merge_point
            && let Some(merge) = self.call_mut()?.merge_points.get(&merge_point).cloned()
        {
            self.end_merge(&merge);
        }
        Ok(())
    }

    fn save(&mut self, modified: &[u32]) -> Result<Saved> {
        let variables = self.promoted_of(modified);
        let count = variables.iter().map(|variable| self.t.promoted.variables[*variable].now.len()).sum();
        self.t.emit.charge_budget(count)?;
        Ok(variables.into_iter().map(|variable| (variable, self.t.promoted.variables[variable].now.clone())).collect())
    }

    fn restore(&mut self, saved: &Saved) {
        for (variable, now) in saved {
            self.t.promoted.variables[*variable].now.clone_from(now);
        }
    }
}

/// Parallel assignments: every source is read before any destination is written.
fn parallel_copy(emit: &mut Emitter, mut pairs: Vec<(Reg, Reg)>) -> Result<()> {
    pairs.retain(|(dst, src)| dst != src);
    emit.charge_budget(pairs.len())?;
    let mut readers: HashMap<Reg, Vec<usize>> = HashMap::new();
    for (index, (_, src)) in pairs.iter().enumerate() {
        readers.entry(*src).or_default().push(index);
    }
    let mut waiting: HashMap<Reg, usize> = readers.iter().map(|(reg, readers)| (*reg, readers.len())).collect();
    let by_dst: HashMap<Reg, usize> = pairs.iter().enumerate().map(|(index, (dst, _))| (*dst, index)).collect();
    let mut done = vec![false; pairs.len()];
    let mut ready: VecDeque<usize> = (0..pairs.len()).filter(|index| !readers.contains_key(&pairs[*index].0)).collect();
    let mut next_cycle = 0;
    loop {
        while let Some(index) = ready.pop_front() {
            let (dst, src) = pairs[index];
            done[index] = true;
            emit.builder.assign(dst, src);
            if let Some(left) = waiting.get_mut(&src) {
                *left -= 1;
                if *left == 0
                    && let Some(freed) = by_dst.get(&src)
                    && !done[*freed]
                {
                    ready.push_back(*freed);
                }
            }
        }
        // Only cycles are left: a copy keeps one register's old value for its readers.
        while next_cycle < pairs.len() && done[next_cycle] {
            next_cycle += 1;
        }
        let Some((held, _)) = pairs.get(next_cycle).copied() else {
            return Ok(());
        };
        let copy = emit.builder.variable(emit.builder.type_of(held));
        emit.builder.assign(copy, held);
        for index in readers.remove(&held).unwrap_or_default() {
            pairs[index].1 = copy;
        }
        ready.push_back(next_cycle);
    }
}
