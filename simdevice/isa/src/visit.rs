//! Which registers a statement defines and uses. The one place that knows every statement's operands.

use super::ir::{Address, Binding, Block, ImageQuery, Lod, Reg, Space, Statement};

impl Statement {
    /// Calls `visit` on each register that the statement itself defines or assigns, not those within its blocks.
    pub fn for_each_definition(&mut self, visit: &mut dyn FnMut(&mut Reg)) {
        match self {
            Self::Compute { dst, .. }
            | Self::Assign { dst, .. }
            | Self::LaneIndex { dst }
            | Self::IsHelper { dst }
            | Self::BufferSize { dst, .. }
            | Self::Derivative { dst, .. } => visit(dst),
            Self::Load { dst, .. } | Self::Subgroup { dst, .. } | Self::ImageQuery { dst, .. } => {
                dst.iter_mut().for_each(visit);
            }
            Self::Atomic { dst, .. } => dst.iter_mut().for_each(visit),
            Self::ImageAtomic(atomic) => atomic.dst.iter_mut().for_each(visit),
            Self::Sample(sample) => sample.dst.iter_mut().flatten().for_each(visit),
            Self::ImageRead(read) => read.dst.iter_mut().flatten().for_each(visit),
            Self::Store { .. }
            | Self::ImageWrite(_)
            | Self::Barrier
            | Self::If { .. }
            | Self::Switch { .. }
            | Self::Loop { .. }
            | Self::Scope { .. }
            | Self::Break(_)
            | Self::Continue(_)
            | Self::Return
            | Self::Kill
            | Self::Demote => {}
        }
    }

    /// Calls `visit` on each register that the statement itself reads, not those within its blocks.
    pub fn for_each_use(&mut self, visit: &mut dyn FnMut(&mut Reg)) {
        match self {
            Self::Compute { src, .. } => src.iter_mut().for_each(visit),
            Self::Assign { src, .. } | Self::Derivative { src, .. } => visit(src),
            Self::Load { address, .. } => use_address(address, visit),
            Self::Store { src, address, .. } => {
                src.iter_mut().for_each(&mut *visit);
                use_address(address, visit);
            }
            Self::Atomic {
                address,
                value,
                comparator,
                ..
            } => {
                use_address(address, visit);
                visit(value);
                comparator.iter_mut().for_each(visit);
            }
            Self::BufferSize { buffer, .. } => use_binding(buffer, visit),
            Self::Sample(sample) => {
                use_binding(&mut sample.image, visit);
                use_binding(&mut sample.sampler, visit);
                sample.coordinate.iter_mut().for_each(&mut *visit);
                match &mut sample.lod {
                    Lod::Implicit { bias, minimum } => {
                        bias.iter_mut().for_each(&mut *visit);
                        minimum.iter_mut().for_each(&mut *visit);
                    }
                    Lod::Explicit(level) => visit(level),
                    Lod::Gradient { dx, dy, minimum } => {
                        dx.iter_mut().chain(dy).for_each(&mut *visit);
                        minimum.iter_mut().for_each(&mut *visit);
                    }
                }
                sample.offset.iter_mut().for_each(&mut *visit);
                sample.compare.iter_mut().for_each(visit);
            }
            Self::ImageRead(read) => {
                use_binding(&mut read.image, visit);
                read.coordinate.iter_mut().for_each(&mut *visit);
                read.level.iter_mut().for_each(&mut *visit);
                read.sample.iter_mut().for_each(visit);
            }
            Self::ImageWrite(write) => {
                use_binding(&mut write.image, visit);
                write.coordinate.iter_mut().for_each(&mut *visit);
                write.sample.iter_mut().for_each(&mut *visit);
                write.texel.iter_mut().for_each(visit);
            }
            Self::ImageAtomic(atomic) => {
                use_binding(&mut atomic.image, visit);
                atomic.coordinate.iter_mut().for_each(&mut *visit);
                atomic.sample.iter_mut().for_each(&mut *visit);
                visit(&mut atomic.value);
                atomic.comparator.iter_mut().for_each(visit);
            }
            Self::ImageQuery { image, query, .. } => {
                use_binding(image, visit);
                match query {
                    ImageQuery::Size { level } => level.iter_mut().for_each(visit),
                    ImageQuery::Levels | ImageQuery::Samples => {}
                    ImageQuery::Lod {
                        sampler,
                        coordinate,
                    } => {
                        use_binding(sampler, visit);
                        coordinate.iter_mut().for_each(visit);
                    }
                }
            }
            Self::Subgroup { src, index, .. } => {
                src.iter_mut().for_each(&mut *visit);
                index.iter_mut().for_each(visit);
            }
            Self::If { condition, .. } => visit(condition),
            Self::Switch { selector, .. } => visit(selector),
            Self::LaneIndex { .. }
            | Self::IsHelper { .. }
            | Self::Barrier
            | Self::Loop { .. }
            | Self::Scope { .. }
            | Self::Break(_)
            | Self::Continue(_)
            | Self::Return
            | Self::Kill
            | Self::Demote => {}
        }
    }

    /// The registers that the statement itself defines or assigns.
    pub fn definitions(&self) -> Vec<Reg> {
        let mut found = Vec::new();
        self.clone_head()
            .for_each_definition(&mut |reg| found.push(*reg));
        found
    }

    /// The registers that the statement itself reads.
    pub fn uses(&self) -> Vec<Reg> {
        let mut found = Vec::new();
        self.clone_head().for_each_use(&mut |reg| found.push(*reg));
        found
    }

    /// The blocks within, in order of execution.
    pub fn blocks(&self) -> Vec<&Block> {
        match self {
            Self::If {
                then, otherwise, ..
            } => vec![then, otherwise],
            Self::Switch { cases, .. } => cases.iter().map(|case| &case.body).collect(),
            Self::Loop {
                body, continuing, ..
            } => vec![body, continuing],
            Self::Scope { body, .. } => vec![body],
            _ => Vec::new(),
        }
    }

    /// The blocks within, in order of execution.
    pub fn blocks_mut(&mut self) -> Vec<&mut Block> {
        match self {
            Self::If {
                then, otherwise, ..
            } => vec![then, otherwise],
            Self::Switch { cases, .. } => cases.iter_mut().map(|case| &mut case.body).collect(),
            Self::Loop {
                body, continuing, ..
            } => vec![body, continuing],
            Self::Scope { body, .. } => vec![body],
            _ => Vec::new(),
        }
    }

    /// The statement without its blocks.
    fn clone_head(&self) -> Self {
        match self {
            Self::If { condition, .. } => Self::If {
                condition: *condition,
                then: Vec::new(),
                otherwise: Vec::new(),
            },
            Self::Switch {
                label, selector, ..
            } => Self::Switch {
                label: *label,
                selector: *selector,
                cases: Vec::new(),
            },
            Self::Loop { .. } | Self::Scope { .. } => Self::Barrier,
            other => other.clone(),
        }
    }
}

fn use_binding(binding: &mut Binding, visit: &mut dyn FnMut(&mut Reg)) {
    binding.index.iter_mut().for_each(visit);
}

fn use_address(address: &mut Address, visit: &mut dyn FnMut(&mut Reg)) {
    if let Space::Buffer(binding) = &mut address.space {
        use_binding(binding, visit);
    }
    address.base.iter_mut().for_each(visit);
}
