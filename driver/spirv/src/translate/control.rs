//! Walks a function's tree: constructs, the places where control flow comes together, phis and calls.
//!
//! At a [join](super::structure::MergePoint) that several edges reach, each variable that the construct stores to gets
//! variables of the IR, which every edge assigns; so do phis. If only one edge reaches it, what the edge brought is
//! what the variables are.

use std::collections::HashMap;
use std::rc::Rc;

use isa::ir::{Label, MAX_NESTING, Reg};
use spirv::Op;

use super::super::error::{Diagnostic, Error, Result, malformed, unsupported};
use super::super::instruction::Instruction;
use super::super::module::Block;
use super::structure::{Case, Construct, Edge, Jump, MergePoint, Node, Tree};
use super::{Translator, Value};

/// What inlining a function counts for, even if it is empty: nested calls multiply.
const CALL_COST: usize = 16;

/// A function being inlined.
pub struct Call {
    function: usize,
    tree: Rc<Tree>,
    joins: HashMap<MergePoint, MergeVariables>,
    labels: HashMap<Construct, Label>,
    /// The scope that early returns leave.
    scope: Option<Label>,
    /// Where returns meet: variables, and the value returned.
    returns: MergeVariables,
    result: Option<Rc<[Reg]>>,
    /// Variables of the IR for the value, if several blocks return.
    result_variables: Option<Rc<[Reg]>>,
}

/// A join while its construct is open.
#[derive(Clone, Default)]
struct MergeVariables {
    /// The variables concerned, each with the registers that the edges assign, or that the one edge brought.
    slots: Vec<(usize, Rc<[Option<Reg>]>)>,
    assigns: bool,
}

/// What the variables that a construct stores to held before.
type Saved = Vec<(usize, Vec<Option<Reg>>)>;

impl<'a> Translator<'a> {
    /// Translates the entry point's function and assigns the outputs at its end.
    pub fn run(&mut self, function: usize) -> Result<(), Error> {
        let definition = &self.module.sections.functions[function].definition;
        let place = |diagnostic: Diagnostic| diagnostic.locate(definition.reference());
        self.global_variables()?;
        if !self.module.sections.functions[function]
            .parameters
            .is_empty()
        {
            return Err(place(Diagnostic::Malformed(
                "the entry point has parameters".into(),
            )));
        }
        self.inline(function).map_err(place)?;
        self.assign_outputs().map_err(place)
    }

    /// `OpFunctionCall`.
    pub fn call(&mut self, it: &Instruction) -> Result<()> {
        let Some(function) = self.module.functions.get(&it.id(0)?).copied() else {
            return malformed("there is no such function");
        };
        let parameters = &self.module.sections.functions[function].parameters;
        let arguments = it.ids(1);
        if parameters.len() != arguments.len() {
            return malformed("the number of arguments is wrong");
        }
        for (parameter, argument) in parameters.iter().zip(arguments) {
            let (id, ty) = (parameter.result()?, parameter.ty()?);
            let value = self.value(argument)?;
            self.slot_of.remove(&id);
            match &value {
                Value::Regs(regs) if regs.len() != self.globals.types.scalars(ty)? as usize => {
                    return malformed("an argument doesn't fit its parameter");
                }
                Value::Pointer(pointer) => {
                    if let super::access::Pointer::PromotedVariable { slot, .. } = **pointer {
                        self.slot_of.insert(id, slot);
                    }
                }
                _ => {}
            }
            self.values.insert(id, value);
            self.types.insert(id, ty);
        }
        match self.inline(function)? {
            Some(regs) => self.define(it, regs.to_vec()),
            None => Ok(()),
        }
    }

    /// Translates a function's body here; returns what it returns.
    fn inline(&mut self, function: usize) -> Result<Option<Rc<[Reg]>>> {
        let Some(tree) = self.analysis.tree(function) else {
            return malformed("the function isn't structured");
        };
        self.charge_budget(CALL_COST)?;
        self.declare_phis(function)?;
        let modified: Vec<u32> = tree
            .modified
            .iter()
            .copied()
            .filter(|root| self.outlives(function, *root))
            .collect();
        let returns = self.open(&modified, tree.returns)?;
        let scope = tree.early_return.then(|| self.builder.begin_scope());
        self.calls.push(Call {
            function,
            tree: tree.clone(),
            joins: HashMap::new(),
            labels: HashMap::new(),
            scope,
            returns,
            result: None,
            result_variables: None,
        });
        self.nodes(&tree.nodes)?;
        let Some(call) = self.calls.pop() else {
            return malformed("a function ends twice");
        };
        if scope.is_some() {
            self.builder.end();
        }
        self.close(&call.returns);
        Ok(call.result)
    }

    /// Whether a variable that a function stores to exists outside it.
    fn outlives(&self, function: usize, root: u32) -> bool {
        let parameters = &self.module.sections.functions[function].parameters;
        self.globals.variables.contains_key(&root)
            || parameters.iter().any(|it| it.result_id == Some(root))
    }

    fn block(&self, index: usize) -> Result<&'a Block> {
        let function = self.calls.last().map_or(0, |call| call.function);
        match self.module.sections.functions[function].blocks.get(index) {
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

    fn nodes(&mut self, nodes: &[Node]) -> Result<()> {
        // Constructs of inlined functions add up.
        if self.depth >= MAX_NESTING {
            return unsupported("constructs are nested too deeply");
        }
        self.depth += 1;
        let done = nodes.iter().try_for_each(|node| self.node(node));
        self.depth -= 1;
        done
    }

    fn node(&mut self, node: &Node) -> Result<()> {
        match node {
            Node::Block(index) => self.instructions(*index),
            Node::Edge(edge) => self.edge(edge),
            Node::Exit(index) => self.exit(*index),
            Node::If {
                block,
                condition,
                then,
                otherwise,
                join,
                modified,
            } => {
                let placed = self.terminator(*block)?;
                let condition = self
                    .reg(*condition)
                    .map_err(|diagnostic| diagnostic.locate(placed.reference()))?;
                self.branch(condition, then, otherwise, *join, modified)
            }
            Node::Switch {
                block,
                selector,
                construct,
                cases,
                join,
                modified,
            } => {
                let placed = self.terminator(*block)?;
                let selector = self
                    .reg(*selector)
                    .map_err(|diagnostic| diagnostic.locate(placed.reference()))?;
                self.switch(selector, *construct, cases, *join, modified)
            }
            Node::Loop { .. } => self.repeat(node),
        }
    }

    fn instructions(&mut self, index: usize) -> Result<()> {
        let Some((_, body)) = self.block(index)?.instructions.split_last() else {
            return malformed("a block is empty");
        };
        for it in body {
            if !matches!(it.opcode, Op::Phi | Op::LoopMerge | Op::SelectionMerge) {
                self.instruction(it)
                    .map_err(|diagnostic| diagnostic.locate(it.reference()))?;
                self.charge_budget(0)
                    .map_err(|diagnostic| diagnostic.locate(it.reference()))?;
            }
        }
        Ok(())
    }

    /// The end of an invocation or a function.
    fn exit(&mut self, index: usize) -> Result<()> {
        let terminator = self.terminator(index)?;
        match terminator.opcode {
            Op::Kill | Op::TerminateInvocation => {
                self.interface.discards = true;
                self.builder.kill();
            }
            Op::Return | Op::ReturnValue => {
                let mut pairs = Vec::new();
                if terminator.opcode == Op::ReturnValue {
                    let regs = self
                        .regs(terminator.id(0)?)
                        .map_err(|diagnostic| diagnostic.locate(terminator.reference()))?;
                    self.return_value(regs, &mut pairs)?;
                }
                let mut returns = std::mem::take(&mut self.call_mut()?.returns);
                self.arrive(&mut returns, &mut pairs)?;
                self.assign(pairs)?;
                self.call_mut()?.returns = returns;
                if let Some(scope) = self.call_mut()?.scope {
                    self.builder.break_to(scope);
                }
            }
            // Never reached; if it is all the same, nothing may follow.
            _ => self.builder.ret(),
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
                let types: Vec<_> = regs.iter().map(|reg| self.builder.type_of(*reg)).collect();
                types
                    .into_iter()
                    .map(|ty| self.builder.variable(ty))
                    .collect()
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

    fn branch(
        &mut self,
        condition: Reg,
        then: &[Node],
        otherwise: &[Node],
        join: Option<MergePoint>,
        modified: &[u32],
    ) -> Result<()> {
        self.open_join(join, modified)?;
        match self.known(condition) {
            // Specialization may decide a branch.
            Some(0) => self.nodes(otherwise)?,
            Some(_) => self.nodes(then)?,
            None => {
                let saved = self.save(modified)?;
                self.builder.begin_if(condition);
                self.nodes(then)?;
                self.restore(&saved);
                if !otherwise.is_empty() {
                    self.builder.begin_else();
                    self.nodes(otherwise)?;
                    self.restore(&saved);
                }
                self.builder.end();
            }
        }
        self.close_join(join)
    }

    fn switch(
        &mut self,
        selector: Reg,
        construct: Construct,
        cases: &[Case],
        join: Option<MergePoint>,
        modified: &[u32],
    ) -> Result<()> {
        self.open_join(join, modified)?;
        for case in cases {
            if let Some((join, edge)) = &case.entry {
                self.open_join(Some(*join), modified)?;
                self.edge(edge)?;
            }
        }
        let saved = self.save(modified)?;
        let label = self.builder.begin_switch(selector);
        self.call_mut()?.labels.insert(construct, label);
        for case in cases {
            self.builder.begin_case(&case.values, case.default);
            self.restore(&saved);
            if let Some((join, _)) = case.entry {
                self.close_join(Some(join))?;
            }
            self.nodes(&case.body)?;
            if case.fallthrough {
                self.builder.fall_through();
            }
        }
        self.builder.end();
        self.restore(&saved);
        self.close_join(join)
    }

    fn repeat(&mut self, node: &Node) -> Result<()> {
        let Node::Loop {
            construct,
            body,
            continuing,
            header,
            continues,
            merge,
            modified,
        } = node
        else {
            return Ok(());
        };
        self.open_join(Some(*header), modified)?;
        self.arrive_at(*header, Vec::new())?;
        self.open_join(Some(*merge), modified)?;
        self.open_join(*continues, modified)?;
        self.close_join(Some(*header))?;
        let saved = self.save(modified)?;
        let label = self.builder.begin_loop();
        self.call_mut()?.labels.insert(*construct, label);
        self.nodes(body)?;
        if !continuing.is_empty() {
            self.builder.begin_continuing();
            self.restore(&saved);
            self.close_join(*continues)?;
            self.nodes(continuing)?;
        }
        self.builder.end();
        self.restore(&saved);
        self.close_join(Some(*merge))
    }

    /// A branch: assigns phis and variables, then leaves if it must.
    fn edge(&mut self, edge: &Edge) -> Result<()> {
        let pairs = self.phi_pairs(edge)?;
        match edge.join {
            Some(join) => self.arrive_at(join, pairs)?,
            None => self.assign(pairs)?,
        }
        let label = |construct, call: &Call| call.labels.get(&construct).copied();
        match edge.jump {
            Jump::None => {}
            Jump::Break(construct) => match label(construct, self.call_mut()?) {
                Some(label) => self.builder.break_to(label),
                None => return malformed("a break out of nothing"),
            },
            Jump::Continue(construct) => match label(construct, self.call_mut()?) {
                Some(label) => self.builder.continue_to(label),
                None => return malformed("a continue of nothing"),
            },
        }
        Ok(())
    }

    /// Makes variables of the IR for a function's phis.
    fn declare_phis(&mut self, function: usize) -> Result<()> {
        let blocks = &self.module.sections.functions[function].blocks;
        for it in blocks.iter().flat_map(|block| &block.instructions) {
            if it.opcode != Op::Phi {
                continue;
            }
            let scalars = self
                .globals
                .types
                .flatten(it.ty()?)
                .map_err(|diagnostic| diagnostic.locate(it.reference()))?;
            self.charge_budget(scalars.len())?;
            let regs: Rc<[Reg]> = scalars
                .iter()
                .map(|scalar| self.builder.variable(scalar.register()))
                .collect();
            self.phis.insert(it.result()?, regs.clone());
            self.define(it, regs.to_vec())?;
        }
        Ok(())
    }

    /// The assignments that an edge makes to the phis of its target.
    fn phi_pairs(&mut self, edge: &Edge) -> Result<Vec<(Reg, Reg)>> {
        let from = self.block(edge.from)?.label;
        let mut pairs = Vec::new();
        for it in &self.block(edge.to)?.instructions {
            if it.opcode != Op::Phi {
                break;
            }
            let ids = it.ids(0);
            let source = ids.chunks_exact(2).find(|pair| Some(pair[1]) == from);
            let Some(source) = source.map(|pair| pair[0]) else {
                let diagnostic = Diagnostic::Malformed("a predecessor is missing".into());
                return Err(diagnostic.locate(it.reference()).into());
            };
            let regs = self
                .regs(source)
                .map_err(|diagnostic| diagnostic.locate(it.reference()))?;
            let Some(variables) = self.phis.get(&it.result()?) else {
                return malformed("a phi isn't declared");
            };
            if variables.len() != regs.len() {
                let diagnostic = Diagnostic::Malformed(format!("%{source} is of another type"));
                return Err(diagnostic.locate(it.reference()).into());
            }
            pairs.extend(variables.iter().copied().zip(regs.iter().copied()));
        }
        Ok(pairs)
    }

    fn slots_of(&self, modified: &[u32]) -> Vec<usize> {
        let mut slots: Vec<usize> = modified
            .iter()
            .filter_map(|root| self.slot_of_root(*root))
            .collect();
        slots.sort_unstable();
        slots.dedup();
        slots
    }

    fn open(&mut self, modified: &[u32], edges: usize) -> Result<MergeVariables> {
        let mut meeting = MergeVariables {
            slots: Vec::new(),
            assigns: edges > 1,
        };
        if edges == 0 {
            return Ok(meeting);
        }
        for slot in self.slots_of(modified) {
            let scalars = self.slots[slot].scalars.clone();
            self.charge_budget(scalars.len())?;
            let regs = scalars
                .iter()
                .map(|scalar| {
                    let assigned = meeting.assigns;
                    assigned.then(|| self.builder.variable(scalar.register()))
                })
                .collect();
            meeting.slots.push((slot, regs));
        }
        Ok(meeting)
    }

    fn open_join(&mut self, join: Option<MergePoint>, modified: &[u32]) -> Result<()> {
        if let Some(join) = join {
            let edges = self.call_mut()?.tree.edges[join];
            let meeting = self.open(modified, edges)?;
            self.call_mut()?.joins.insert(join, meeting);
        }
        Ok(())
    }

    /// An edge reaches a join: assigns its variables (and these pairs) at once.
    fn arrive(&mut self, meeting: &mut MergeVariables, pairs: &mut Vec<(Reg, Reg)>) -> Result<()> {
        for (slot, regs) in &mut meeting.slots {
            if meeting.assigns {
                for (index, variable) in regs.iter().enumerate() {
                    let now = self.read_scalar(*slot, index)?;
                    pairs.extend(variable.map(|variable| (variable, now)));
                }
            } else {
                *regs = self.slots[*slot].now.as_slice().into();
            }
        }
        Ok(())
    }

    fn arrive_at(&mut self, join: MergePoint, mut pairs: Vec<(Reg, Reg)>) -> Result<()> {
        let Some(mut meeting) = self.call_mut()?.joins.remove(&join) else {
            return malformed("a branch to a construct that isn't open");
        };
        self.arrive(&mut meeting, &mut pairs)?;
        self.call_mut()?.joins.insert(join, meeting);
        self.assign(pairs)
    }

    /// From here on, variables are what the edges to the join made them.
    fn close(&mut self, meeting: &MergeVariables) {
        for (slot, regs) in &meeting.slots {
            self.slots[*slot].now = regs.to_vec();
        }
    }

    fn close_join(&mut self, join: Option<MergePoint>) -> Result<()> {
        if let Some(join) = join
            && let Some(meeting) = self.call_mut()?.joins.get(&join).cloned()
        {
            self.close(&meeting);
        }
        Ok(())
    }

    fn save(&mut self, modified: &[u32]) -> Result<Saved> {
        let slots = self.slots_of(modified);
        let count = slots.iter().map(|slot| self.slots[*slot].now.len()).sum();
        self.charge_budget(count)?;
        Ok(slots
            .into_iter()
            .map(|slot| (slot, self.slots[slot].now.clone()))
            .collect())
    }

    fn restore(&mut self, saved: &Saved) {
        for (slot, now) in saved {
            self.slots[*slot].now.clone_from(now);
        }
    }
}
