//! From a function's control-flow graph to a tree of constructs.
//!
//! SPIR-V's merge instructions say where constructs begin and end; this module walks the blocks once, in the order of
//! execution, and turns each branch into one of three things: going on in the same list, reaching the end of the
//! construct, or a jump (break or continue). Each block lands in the tree once, or the function isn't structured.

use std::collections::{HashMap, HashSet};
use std::rc::Rc;

use isa::ir::MAX_NESTING;
use spirv::Op;

use super::super::error::{Result, malformed, unsupported};
use super::super::instruction::Instruction;
use super::super::module::Function;
use super::cases::Target;

/// A construct that can be left by a break: an index, unique in the function.
pub type Construct = usize;

/// A place where control flow comes together: an index into [`Tree::edges`].
pub type MergePoint = usize;

/// How an edge leaves its list of nodes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Jump {
    /// By reaching its end, or by going on.
    None,
    /// By breaking out of a loop or switch.
    Break(Construct),
    /// By continuing a loop.
    Continue(Construct),
}

/// A branch from one block to another.
#[derive(Clone, Copy, Debug)]
pub struct Edge {
    pub from: usize,
    pub to: usize,
    pub jump: Jump,
    pub join: Option<MergePoint>,
}

/// A case of a switch.
#[derive(Clone, Debug)]
pub struct Case {
    pub values: Vec<u32>,
    pub default: bool,
    pub body: Vec<Node>,
    pub fallthrough: bool,
    /// If the case before falls through to this one: where they meet, and the edge from the switch itself.
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
        condition: u32,
        then: Vec<Node>,
        otherwise: Vec<Node>,
        join: Option<MergePoint>,
        modified: Rc<[u32]>,
    },
    Switch {
        block: usize,
        selector: u32,
        construct: Construct,
        cases: Vec<Case>,
        join: Option<MergePoint>,
        modified: Rc<[u32]>,
    },
    Loop {
        construct: Construct,
        body: Vec<Node>,
        continuing: Vec<Node>,
        /// Where the entry and the back edge meet.
        header: MergePoint,
        /// Where `continue`s meet; none if the loop's header is its continue target.
        continues: Option<MergePoint>,
        /// Where breaks meet.
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
    /// How many blocks return.
    pub returns: usize,
    /// Whether one of them is within a construct.
    pub early_return: bool,
    /// Variables and pointer parameters that the function stores to.
    pub modified: Rc<[u32]>,
}

/// Builds the tree of a function. `stores` names, for each block, the variables that it stores to.
pub fn structure(function: &Function, stores: &[Vec<u32>]) -> Result<Tree> {
    let mut structurizer = Structurizer {
        function,
        stores,
        index: HashMap::new(),
        frames: Vec::new(),
        edges: Vec::new(),
        constructs: 0,
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
    Selection {
        merge: usize,
        join: MergePoint,
    },
    Case {
        construct: Construct,
        merge: Option<(usize, MergePoint)>,
        next: Option<(usize, MergePoint)>,
    },
    LoopBody {
        construct: Construct,
        merge: Option<(usize, MergePoint)>,
        continues: (usize, MergePoint),
    },
    LoopContinuing {
        construct: Construct,
        merge: Option<(usize, MergePoint)>,
        header: (usize, MergePoint),
    },
}

/// Walks a function's blocks.
pub struct Structurizer<'a> {
    function: &'a Function,
    stores: &'a [Vec<u32>],
    /// Blocks by the ids of their labels.
    pub index: HashMap<u32, usize>,
    frames: Vec<Frame>,
    edges: Vec<usize>,
    constructs: usize,
    visited: Vec<bool>,
    /// What the open constructs store to, innermost last.
    modified: Vec<HashSet<u32>>,
    returns: usize,
    early_return: bool,
    /// Blocks looked at while ordering cases.
    pub steps: usize,
    depth: usize,
}

impl Structurizer<'_> {
    fn join(&mut self) -> MergePoint {
        self.edges.push(0);
        self.edges.len() - 1
    }

    fn construct(&mut self) -> Construct {
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

    pub fn block_of(&self, label: u32) -> Result<usize> {
        match self.index.get(&label) {
            Some(index) => Ok(*index),
            None => malformed(format!("%{label} isn't a block of this function")),
        }
    }

    pub fn terminator(&self, block: usize) -> Result<&Instruction> {
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

    /// Walks from a block to the end of the list that it belongs to.
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

    /// A block and its terminator. Returns the block that the same list goes on with.
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
                if then == otherwise {
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

    /// The join at the end of the innermost construct, if that is where a block is.
    fn natural(&self, to: usize) -> Option<MergePoint> {
        let (block, join) = match self.frames.last()? {
            Frame::Selection { merge, join } => (*merge, *join),
            Frame::Case {
                next: Some(next), ..
            } => *next,
            Frame::Case {
                merge: Some(merge), ..
            } => *merge,
            Frame::Case { .. } => return None,
            Frame::LoopBody { continues, .. } => *continues,
            Frame::LoopContinuing { header, .. } => *header,
        };
        (block == to).then_some(join)
    }

    /// The jump that reaches a block from anywhere within the constructs around.
    fn jump(&self, to: usize) -> Option<(Jump, MergePoint)> {
        let leave = |merge: &Option<(usize, MergePoint)>, construct: Construct| match merge {
            Some((block, join)) if *block == to => Some((Jump::Break(construct), *join)),
            _ => None,
        };
        self.frames.iter().rev().find_map(|frame| match frame {
            Frame::Selection { .. } => None,
            Frame::Case {
                construct, merge, ..
            }
            | Frame::LoopContinuing {
                construct, merge, ..
            } => leave(merge, *construct),
            Frame::LoopBody {
                construct,
                continues,
                ..
            } if continues.0 == to => Some((Jump::Continue(*construct), continues.1)),
            Frame::LoopBody {
                construct, merge, ..
            } => leave(merge, *construct),
        })
    }

    /// Whether a block is where some construct around ends.
    pub fn is_target(&self, block: usize) -> bool {
        self.natural(block).is_some() || self.jump(block).is_some()
    }

    fn edge(&mut self, from: usize, to: usize, (jump, join): (Jump, MergePoint)) -> Node {
        self.edges[join] += 1;
        let join = Some(join);
        Node::Edge(Edge {
            from,
            to,
            jump,
            join,
        })
    }

    /// A branch at the end of a list.
    fn follow(&mut self, from: usize, to: usize, nodes: &mut Vec<Node>) -> Result<Option<usize>> {
        let end = self.natural(to).map(|join| (Jump::None, join));
        if let Some(leaving) = end.or_else(|| self.jump(to)) {
            let edge = self.edge(from, to, leaving);
            nodes.push(edge);
            return Ok(None);
        }
        nodes.push(Node::Edge(Edge {
            from,
            to,
            jump: Jump::None,
            join: None,
        }));
        Ok(Some(to))
    }

    /// The list of nodes that a branch leads to.
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
        // A merge block that ends an outer construct too is that construct's business.
        let join = (!self.is_target(merge)).then(|| self.join());
        if let Some(join) = join {
            self.frames.push(Frame::Selection { merge, join });
        }
        self.begin_modified();
        let then = self.arm(block, then)?;
        let otherwise = self.arm(block, otherwise)?;
        if join.is_some() {
            self.frames.pop();
        }
        nodes.push(Node::If {
            block,
            condition,
            then,
            otherwise,
            join,
            modified: self.end_modified(),
        });
        Ok(join.filter(|join| self.edges[*join] > 0).map(|_| merge))
    }

    /// A conditional branch without a merge block: at least one of its targets leaves a construct.
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
            condition,
            then,
            otherwise,
            join: None,
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
        if self.natural(then).is_none() && self.natural(otherwise).is_none() {
            return malformed("a conditional branch within a construct has no merge block");
        }
        // One arm ends here; the other takes along the rest of the list.
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
        let construct = self.construct();
        let (header, merge_join) = (self.join(), self.join());
        self.edges[header] += 1;
        let shared = continues == head;
        let continue_join = if shared { header } else { self.join() };
        let leave = (!self.is_target(merge)).then_some((merge, merge_join));
        self.begin_modified();
        self.frames.push(Frame::LoopBody {
            construct,
            merge: leave,
            continues: (continues, continue_join),
        });
        let mut body = Vec::new();
        if let Some(next) = self.straight(head, &mut body)? {
            self.region(next, &mut body)?;
        }
        self.frames.pop();
        let mut continuing = Vec::new();
        if !shared && self.edges[continue_join] > 0 {
            self.frames.push(Frame::LoopContinuing {
                construct,
                merge: leave,
                header: (head, header),
            });
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

    fn switch(
        &mut self,
        block: usize,
        terminator: &Instruction,
        nodes: &mut Vec<Node>,
    ) -> Result<Option<usize>> {
        let Some(merge) = self.selection_merge(block)? else {
            return malformed("there is no merge block");
        };
        let construct = self.construct();
        let join = (!self.is_target(merge)).then(|| self.join());
        let leave = join.map(|join| (merge, join));
        let mut cases = self.switch_targets(terminator)?;
        let order = self.order_cases(merge, &cases)?;
        self.begin_modified();
        let mut built = Vec::with_capacity(cases.len());
        let mut entry = None;
        for (position, (which, fallthrough)) in order.iter().enumerate() {
            let Target {
                block: target,
                values,
                default,
            } = std::mem::take(&mut cases[*which]);
            let next = fallthrough.then(|| order.get(position + 1)).flatten();
            let next = next.map(|(next, _)| (cases[*next].block, self.join()));
            self.frames.push(Frame::Case {
                construct,
                merge: leave,
                next,
            });
            let mut body = Vec::new();
            if entry.is_some() {
                self.region(target, &mut body)?;
            } else {
                body = self.arm(block, target)?;
            }
            self.frames.pop();
            built.push(Case {
                values,
                default,
                body,
                fallthrough: next.is_some(),
                entry,
            });
            entry = next.map(|(to, join)| {
                self.edges[join] += 1;
                let edge = Edge {
                    from: block,
                    to,
                    jump: Jump::None,
                    join: Some(join),
                };
                (join, edge)
            });
        }
        nodes.push(Node::Switch {
            block,
            selector: terminator.id(0)?,
            construct,
            cases: built,
            join,
            modified: self.end_modified(),
        });
        Ok(join.filter(|join| self.edges[*join] > 0).map(|_| merge))
    }
}
