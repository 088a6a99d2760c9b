//! Converts a function's control-flow graph to a tree of constructs.
//!
//! SPIR-V's merge instructions delimit constructs. This module walks the blocks once, in the order of execution, and
//! turns each branch into one of three things: continuing in the same list, reaching the end of the construct, or a
//! jump (break or continue). Each block is put in the tree once; otherwise the function isn't structured.

use std::collections::{HashMap, HashSet};
use std::rc::Rc;

use isa::ir::MAX_NESTING;
use spirv::Op;

use crate::error::{Result, malformed, unsupported};
use crate::instruction::{Instruction, Operand};
use crate::module::Function;

/// A construct that can be left from within others: an index, unique in the function.
pub type Construct = usize;

/// A place where control flow joins: an index into [`Tree::edges`].
pub type MergePoint = usize;

/// The way in which an edge leaves its list of nodes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Jump {
    /// It reaches the end of the list, or goes on in it.
    None,
    /// It breaks out of a loop, a switch or a selection.
    Break(Construct),
    /// It continues a loop.
    Continue(Construct),
}

/// The jump with which a branch leaves a construct, and the merge point that it reaches.
#[derive(Clone, Copy, Debug)]
struct JumpTarget {
    jump: Jump,
    merge_point: MergePoint,
}

/// A branch from one block to another.
#[derive(Clone, Copy, Debug)]
pub struct Edge {
    pub from: usize,
    pub to: usize,
    pub jump: Jump,
    pub merge_point: Option<MergePoint>,
}

/// A case of a switch.
#[derive(Clone, Debug)]
pub struct Case {
    pub values: Vec<u64>,
    pub default: bool,
    pub body: Vec<Node>,
    pub fallthrough: bool,
    /// The merge point and the edge from the switch itself, if the case before falls through to this one.
    pub entry: Option<(MergePoint, Edge)>,
}

/// A node of the tree.
#[derive(Clone, Debug)]
pub enum Node {
    /// A block's instructions, without its terminator.
    Block(usize),
    Edge(Edge),
    If {
        block: usize,
        /// The condition; None if both branches go to `then`.
        condition: Option<u32>,
        /// The scope, if edges break out of it.
        scope: Option<Construct>,
        then: Vec<Node>,
        otherwise: Vec<Node>,
        merge_point: Option<MergePoint>,
        modified: Rc<[u32]>,
    },
    Switch {
        block: usize,
        selector: u32,
        construct: Construct,
        cases: Vec<Case>,
        merge_point: Option<MergePoint>,
        modified: Rc<[u32]>,
    },
    Loop {
        construct: Construct,
        body: Vec<Node>,
        continuing: Vec<Node>,
        /// The merge of the entry and the back edge.
        header: MergePoint,
        /// The merge of `continue`s; none if the loop's header is its continue target.
        continues: Option<MergePoint>,
        /// The merge of breaks.
        merge: MergePoint,
        modified: Rc<[u32]>,
    },
    /// A terminator that ends the invocation or the function.
    Exit(usize),
}

/// A function as a tree.
#[derive(Clone, Debug)]
pub struct Tree {
    pub nodes: Vec<Node>,
    /// For each [`MergePoint`], the number of edges that lead to it.
    pub edges: Vec<usize>,
    /// The number of blocks that return.
    pub returns: usize,
    /// True if one of them is within a construct.
    pub early_return: bool,
    /// Variables and pointer parameters that the function stores to.
    pub modified: Rc<[u32]>,
}

/// Builds the tree of a function. `stores` names, for each block, the variables that it stores to.
pub fn structurize(function: &Function, stores: &[Vec<u32>]) -> Result<Tree> {
    let mut structurizer = Structurizer {
        function,
        stores,
        index: HashMap::new(),
        frames: Vec::new(),
        edges: Vec::new(),
        constructs: 0,
        broken: HashSet::new(),
        visited: vec![false; function.blocks.len()],
        modified: vec![HashSet::new()],
        returns: 0,
        early_return: false,
        steps: 0,
        depth: 0,
    };
    for (index, block) in function.blocks.iter().enumerate() {
        if let Some(id) = block.label {
            structurizer.index.insert(id, index);
        }
    }
    if function.blocks.is_empty() {
        return malformed("the function has no body");
    }
    let mut nodes = Vec::new();
    structurizer.region(0, &mut nodes)?;
    Ok(Tree {
        nodes,
        modified: structurizer.end_modified(),
        edges: structurizer.edges,
        returns: structurizer.returns,
        early_return: structurizer.early_return,
    })
}

/// A construct around the block being walked.
enum Frame {
    Selection { construct: Construct, merge: usize, merge_point: MergePoint },
    Case { construct: Construct, merge: Option<(usize, MergePoint)>, next: Option<(usize, MergePoint)> },
    LoopBody { construct: Construct, merge: Option<(usize, MergePoint)>, continues: (usize, MergePoint) },
    LoopContinuing { construct: Construct, merge: Option<(usize, MergePoint)>, header: (usize, MergePoint) },
}

/// Walks a function's blocks.
struct Structurizer<'a> {
    function: &'a Function,
    stores: &'a [Vec<u32>],
    /// Blocks by the ids of their labels.
    index: HashMap<u32, usize>,
    frames: Vec<Frame>,
    edges: Vec<usize>,
    constructs: usize,
    /// Constructs that edges break out of.
    broken: HashSet<Construct>,
    visited: Vec<bool>,
    /// Variables that the open constructs store to, innermost last.
    modified: Vec<HashSet<u32>>,
    returns: usize,
    early_return: bool,
    /// Blocks visited while ordering cases.
    steps: usize,
    depth: usize,
}

impl Structurizer<'_> {
    fn add_merge_point(&mut self) -> MergePoint {
        self.edges.push(0);
        self.edges.len() - 1
    }

    fn add_construct(&mut self) -> Construct {
        self.constructs += 1;
        self.constructs - 1
    }

    fn begin_modified(&mut self) {
        self.modified.push(HashSet::new());
    }

    fn end_modified(&mut self) -> Rc<[u32]> {
        let ended = self.modified.pop().unwrap_or_default();
        if let Some(outer) = self.modified.last_mut() {
            outer.extend(&ended);
        }
        let mut sorted: Vec<u32> = ended.into_iter().collect();
        sorted.sort_unstable();
        sorted.into()
    }

    fn block_of(&self, label: u32) -> Result<usize> {
        match self.index.get(&label) {
            Some(index) => Ok(*index),
            None => malformed(format!("%{label} isn't a block of this function")),
        }
    }

    fn terminator(&self, block: usize) -> Result<&Instruction> {
        match self.function.blocks[block].instructions.last() {
            Some(last) => Ok(last),
            None => malformed("a block is empty"),
        }
    }

    /// The merge instruction before a block's terminator.
    fn merge(&self, block: usize) -> Option<&Instruction> {
        let instructions = &self.function.blocks[block].instructions;
        let before_last = instructions.len().checked_sub(2)?;
        let found = &instructions[before_last];
        matches!(found.opcode, Op::LoopMerge | Op::SelectionMerge).then_some(found)
    }

    /// Walks from a block to the end of its list.
    fn region(&mut self, start: usize, nodes: &mut Vec<Node>) -> Result<()> {
        self.depth += 1;
        if self.depth > MAX_NESTING {
            return unsupported("constructs are nested too deeply");
        }
        let mut at = Some(start);
        while let Some(block) = at {
            if std::mem::replace(&mut self.visited[block], true) {
                return malformed("the control flow isn't structured: a block is reached twice");
            }
            let merge = self.merge(block).filter(|it| it.opcode == Op::LoopMerge);
            at = match merge {
                Some(it) => {
                    let (merge, continues) = (self.block_of(it.id(0)?)?, self.block_of(it.id(1)?)?);
                    self.walk_loop(block, merge, continues, nodes)?
                }
                None => self.straight(block, nodes)?,
            };
        }
        self.depth -= 1;
        Ok(())
    }

    /// Adds a block and its terminator. Returns the block with which the same list goes on.
    fn straight(&mut self, block: usize, nodes: &mut Vec<Node>) -> Result<Option<usize>> {
        nodes.push(Node::Block(block));
        if let (Some(modified), Some(stores)) = (self.modified.last_mut(), self.stores.get(block)) {
            modified.extend(stores);
        }
        let terminator = self.terminator(block)?.clone();
        match terminator.opcode {
            Op::Branch => {
                let target = self.block_of(terminator.id(0)?)?;
                self.follow(block, target, nodes)
            }
            Op::BranchConditional => {
                let then = self.block_of(terminator.id(1)?)?;
                let otherwise = self.block_of(terminator.id(2)?)?;
                if then == otherwise && self.selection_merge(block)?.is_none() {
                    return self.follow(block, then, nodes);
                }
                self.conditional(block, terminator.id(0)?, then, otherwise, nodes)
            }
            Op::Switch => self.switch(block, &terminator, nodes),
            Op::Return | Op::ReturnValue => {
                self.returns += 1;
                self.early_return |= !self.frames.is_empty();
                nodes.push(Node::Exit(block));
                Ok(None)
            }
            Op::Kill | Op::TerminateInvocation | Op::Unreachable => {
                nodes.push(Node::Exit(block));
                Ok(None)
            }
            other => unsupported(format!("a block that ends with Op{other:?}")),
        }
    }

    /// The merge point at the end of the innermost construct, if the block is that end.
    fn end_of_construct(&self, to: usize) -> Option<MergePoint> {
        let (block, merge_point) = match self.frames.last()? {
            Frame::Selection { merge, merge_point, .. } => (*merge, *merge_point),
            Frame::Case { next: Some(next), .. } => *next,
            Frame::Case { merge: Some(merge), .. } => *merge,
            Frame::Case { .. } => return None,
            Frame::LoopBody { continues, .. } => *continues,
            Frame::LoopContinuing { header, .. } => *header,
        };
        (block == to).then_some(merge_point)
    }

    /// The jump to a block from anywhere within the enclosing constructs.
    fn jump(&self, to: usize) -> Option<JumpTarget> {
        let leave = |merge: &Option<(usize, MergePoint)>, construct: Construct| match *merge {
            Some((block, merge_point)) if block == to => Some(JumpTarget { jump: Jump::Break(construct), merge_point }),
            _ => None,
        };
        let innermost = self.frames.len().saturating_sub(1);
        let mut frames = self.frames.iter().enumerate().rev();
        frames.find_map(|(depth, frame)| match frame {
            // The innermost construct is left by reaching its end.
            Frame::Selection { .. } if depth == innermost => None,
            Frame::Selection { construct, merge, merge_point } => leave(&Some((*merge, *merge_point)), *construct),
            Frame::Case { construct, merge, .. } | Frame::LoopContinuing { construct, merge, .. } => {
                leave(merge, *construct)
            }
            Frame::LoopBody { construct, continues, .. } if continues.0 == to => {
                Some(JumpTarget { jump: Jump::Continue(*construct), merge_point: continues.1 })
            }
            Frame::LoopBody { construct, merge, .. } => leave(merge, *construct),
        })
    }

    /// Reports whether an enclosing construct ends at a block.
    fn is_target(&self, block: usize) -> bool {
        self.end_of_construct(block).is_some() || self.jump(block).is_some()
    }

    fn edge(&mut self, from: usize, to: usize, target: JumpTarget) -> Node {
        let JumpTarget { jump, merge_point } = target;
        self.edges[merge_point] += 1;
        if let Jump::Break(construct) = jump {
            self.broken.insert(construct);
        }
        let merge_point = Some(merge_point);
        Node::Edge(Edge { from, to, jump, merge_point })
    }

    /// Adds a branch at the end of a list.
    fn follow(&mut self, from: usize, to: usize, nodes: &mut Vec<Node>) -> Result<Option<usize>> {
        let end = self.end_of_construct(to).map(|merge_point| JumpTarget { jump: Jump::None, merge_point });
        if let Some(leaving) = end.or_else(|| self.jump(to)) {
            let edge = self.edge(from, to, leaving);
            nodes.push(edge);
            return Ok(None);
        }
        nodes.push(Node::Edge(Edge { from, to, jump: Jump::None, merge_point: None }));
        Ok(Some(to))
    }

    /// The nodes of a branch's arm.
    fn arm(&mut self, from: usize, to: usize) -> Result<Vec<Node>> {
        let mut nodes = Vec::new();
        if let Some(next) = self.follow(from, to, &mut nodes)? {
            self.region(next, &mut nodes)?;
        }
        Ok(nodes)
    }

    fn selection_merge(&self, block: usize) -> Result<Option<usize>> {
        match self.merge(block) {
            Some(it) if it.opcode == Op::SelectionMerge => Ok(Some(self.block_of(it.id(0)?)?)),
            _ => Ok(None),
        }
    }

    fn conditional(
        &mut self,
        block: usize,
        condition: u32,
        then: usize,
        otherwise: usize,
        nodes: &mut Vec<Node>,
    ) -> Result<Option<usize>> {
        let Some(merge) = self.selection_merge(block)? else {
            return self.conditional_exit(block, condition, then, otherwise, nodes);
        };
        // A merge block that also ends an outer construct belongs to that construct.
        let merge_point = (!self.is_target(merge)).then(|| self.add_merge_point());
        let construct = self.add_construct();
        if let Some(merge_point) = merge_point {
            self.frames.push(Frame::Selection { construct, merge, merge_point });
        }
        self.begin_modified();
        let condition = (then != otherwise).then_some(condition);
        let then = self.arm(block, then)?;
        let otherwise = match condition {
            Some(_) => self.arm(block, otherwise)?,
            None => Vec::new(),
        };
        if merge_point.is_some() {
            self.frames.pop();
        }
        nodes.push(Node::If {
            block,
            condition,
            scope: self.broken.contains(&construct).then_some(construct),
            then,
            otherwise,
            merge_point,
            modified: self.end_modified(),
        });
        Ok(merge_point.filter(|merge_point| self.edges[*merge_point] > 0).map(|_| merge))
    }

    /// Adds a conditional branch without a merge block: at least one of its targets leaves a construct.
    fn conditional_exit(
        &mut self,
        block: usize,
        condition: u32,
        then: usize,
        otherwise: usize,
        nodes: &mut Vec<Node>,
    ) -> Result<Option<usize>> {
        let node = |then, otherwise, modified| Node::If {
            block,
            condition: Some(condition),
            scope: None,
            then,
            otherwise,
            merge_point: None,
            modified,
        };
        let none: Rc<[u32]> = Rc::new([]);
        if let Some(leaving) = self.jump(then) {
            let edge = self.edge(block, then, leaving);
            nodes.push(node(vec![edge], Vec::new(), none));
            return self.follow(block, otherwise, nodes);
        }
        if let Some(leaving) = self.jump(otherwise) {
            let edge = self.edge(block, otherwise, leaving);
            nodes.push(node(Vec::new(), vec![edge], none));
            return self.follow(block, then, nodes);
        }
        // Either one arm ends here and the other contains the rest of the list, or the two never join again.
        self.begin_modified();
        let then = self.arm(block, then)?;
        let otherwise = self.arm(block, otherwise)?;
        let modified = self.end_modified();
        nodes.push(node(then, otherwise, modified));
        Ok(None)
    }

    fn walk_loop(
        &mut self,
        head: usize,
        merge: usize,
        continues: usize,
        nodes: &mut Vec<Node>,
    ) -> Result<Option<usize>> {
        let construct = self.add_construct();
        let (header, merge_join) = (self.add_merge_point(), self.add_merge_point());
        self.edges[header] += 1;
        let shared = continues == head;
        let continue_join = if shared { header } else { self.add_merge_point() };
        let leave = (!self.is_target(merge)).then_some((merge, merge_join));
        self.begin_modified();
        self.frames.push(Frame::LoopBody { construct, merge: leave, continues: (continues, continue_join) });
        let mut body = Vec::new();
        if let Some(next) = self.straight(head, &mut body)? {
            self.region(next, &mut body)?;
        }
        self.frames.pop();
        let mut continuing = Vec::new();
        if !shared && self.edges[continue_join] > 0 {
            self.frames.push(Frame::LoopContinuing { construct, merge: leave, header: (head, header) });
            self.region(continues, &mut continuing)?;
            self.frames.pop();
        }
        nodes.push(Node::Loop {
            construct,
            body,
            continuing,
            header,
            continues: (!shared).then_some(continue_join),
            merge: merge_join,
            modified: self.end_modified(),
        });
        Ok((self.edges[merge_join] > 0).then_some(merge))
    }

    fn switch(&mut self, block: usize, terminator: &Instruction, nodes: &mut Vec<Node>) -> Result<Option<usize>> {
        let Some(merge) = self.selection_merge(block)? else {
            return malformed("there is no merge block");
        };
        let construct = self.add_construct();
        let merge_point = (!self.is_target(merge)).then(|| self.add_merge_point());
        let leave = merge_point.map(|merge_point| (merge, merge_point));
        let mut cases = self.switch_targets(terminator)?;
        let order = self.order_cases(merge, &cases)?;
        self.begin_modified();
        let mut built = Vec::with_capacity(cases.len());
        let mut entry = None;
        for (position, (which, fallthrough)) in order.iter().enumerate() {
            let Target { block: target, values, default } = std::mem::take(&mut cases[*which]);
            let next = fallthrough.then(|| order.get(position + 1)).flatten();
            let next = next.map(|(next, _)| (cases[*next].block, self.add_merge_point()));
            self.frames.push(Frame::Case { construct, merge: leave, next });
            let mut body = Vec::new();
            if entry.is_some() {
                self.region(target, &mut body)?;
            } else {
                body = self.arm(block, target)?;
            }
            self.frames.pop();
            built.push(Case { values, default, body, fallthrough: next.is_some(), entry });
            entry = next.map(|(to, merge_point)| {
                self.edges[merge_point] += 1;
                let edge = Edge { from: block, to, jump: Jump::None, merge_point: Some(merge_point) };
                (merge_point, edge)
            });
        }
        nodes.push(Node::Switch {
            block,
            selector: terminator.id(0)?,
            construct,
            cases: built,
            merge_point,
            modified: self.end_modified(),
        });
        Ok(merge_point.filter(|merge_point| self.edges[*merge_point] > 0).map(|_| merge))
    }
}

/// The most blocks visited while ordering the cases of switches.
const MAX_STEPS: usize = 1 << 22;

/// A target of a switch.
#[derive(Default)]
struct Target {
    pub block: usize,
    pub values: Vec<u64>,
    pub default: bool,
}

impl Structurizer<'_> {
    /// The targets of a switch, each once.
    fn switch_targets(&self, terminator: &Instruction) -> Result<Vec<Target>> {
        let mut targets: Vec<Target> = Vec::new();
        let mut by_block = HashMap::new();
        let mut values = HashSet::new();
        let mut target = |block| -> usize {
            *by_block.entry(block).or_insert_with(|| {
                targets.push(Target { block, ..Target::default() });
                targets.len() - 1
            })
        };
        let default = target(self.block_of(terminator.id(1)?)?);
        let mut found = Vec::new();
        for pair in terminator.operands.get(2..).unwrap_or_default().chunks(2) {
            let (value, label) = match pair {
                [Operand::Literal(value), Operand::Id(label)] => (u64::from(*value), *label),
                [Operand::Literal64(value), Operand::Id(label)] => (*value, *label),
                _ => return malformed("a case isn't a number and a block"),
            };
            if !values.insert(value) {
                return malformed(format!("two cases for {value}"));
            }
            found.push((target(self.block_of(label)?), value));
        }
        targets[default].default = true;
        for (which, value) in found {
            targets[which].values.push(value);
        }
        Ok(targets)
    }

    /// The cases in an order in which each that falls through is followed by its target. The flag is true for those
    /// that do.
    fn order_cases(&mut self, merge: usize, cases: &[Target]) -> Result<Vec<(usize, bool)>> {
        let which: HashMap<usize, usize> = cases
            .iter()
            .enumerate()
            .filter(|(_, case)| case.block != merge)
            .map(|(index, case)| (case.block, index))
            .collect();
        let mut falls_into = vec![None; cases.len()];
        let mut fallen_into = vec![false; cases.len()];
        for (index, case) in cases.iter().enumerate() {
            if case.block == merge || self.is_target(case.block) {
                continue;
            }
            for next in self.reachable_cases(case.block, merge, &which)? {
                if falls_into[index].replace(next).is_some_and(|other| other != next)
                    || std::mem::replace(&mut fallen_into[next], true)
                {
                    return malformed("cases fall through to each other in no order");
                }
            }
        }
        let mut order = Vec::with_capacity(cases.len());
        for head in (0..cases.len()).filter(|case| !fallen_into[*case]) {
            let mut at = Some(head);
            while let Some(case) = at {
                at = falls_into[case];
                order.push((case, at.is_some()));
            }
        }
        if order.len() != cases.len() {
            return malformed("cases fall through to each other in a circle");
        }
        Ok(order)
    }

    /// The other cases that a case reaches without leaving the switch.
    fn reachable_cases(&mut self, start: usize, merge: usize, which: &HashMap<usize, usize>) -> Result<HashSet<usize>> {
        let mut found = HashSet::new();
        let mut seen = HashSet::from([start]);
        let mut waiting = vec![start];
        while let Some(block) = waiting.pop() {
            self.steps += 1;
            if self.steps > MAX_STEPS {
                return unsupported("too many blocks in switches");
            }
            let terminator = self.terminator(block)?.clone();
            for label in terminator.operands.iter().filter_map(Operand::id) {
                let Some(next) = self.index.get(&label).copied() else {
                    continue;
                };
                if next == merge || next == start || self.is_target(next) {
                    continue;
                }
                if let Some(case) = which.get(&next) {
                    found.insert(*case);
                } else if seen.insert(next) {
                    waiting.push(next);
                }
            }
        }
        Ok(found)
    }
}
