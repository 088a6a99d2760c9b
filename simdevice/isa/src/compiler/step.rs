//! Steps: the linear form of a program, with jumps, that machines run.

use crate::ir::op::{Kind, Op};
use crate::ir::{Statement, Type};
use crate::kernels::registers::RegisterSlot;

/// The index of one of a machine's masks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MaskId(pub u16);

impl MaskId {
    /// The lanes that execute.
    pub const ACTIVE: Self = Self(0);
    /// The lanes whose writes to memory do nothing.
    pub const HELPER: Self = Self(1);
    /// The lanes that were killed or demoted.
    pub const KILLED: Self = Self(2);
    /// The lanes that are done. It is never read.
    pub const DONE: Self = Self(3);
    /// The lanes that were active when the batch began.
    pub const ENTRY: Self = Self(4);
    /// The first mask that constructs may use.
    pub const FIRST_FREE: u16 = 5;
}

/// An index into the steps.
pub type Target = u32;

/// One step of the machine. Masks are explicit; a jump is taken when a set of lanes is empty, or by a uniform
/// condition.
#[derive(Clone, Debug)]
pub enum Step {
    /// `dst = op(src...)` in all lanes.
    Compute { op: Op, dst: RegisterSlot, src: [RegisterSlot; 4] },
    /// `dst = op(src...)` in the active lanes, by way of `temporary` if not all lanes are active.
    ComputeAssign { op: Op, dst: RegisterSlot, temporary: RegisterSlot, src: [RegisterSlot; 4] },
    /// `dst = src` in all lanes.
    Copy { dst: RegisterSlot, src: RegisterSlot, ty: Type },
    /// `dst = src` in the active lanes (all lanes, if `dst` is uniform).
    Assign { dst: RegisterSlot, src: RegisterSlot, ty: Type },
    /// Any statement that reads other lanes or accesses memory.
    Other(Box<Statement>),
    /// The begin of a counted run: counts an execution and the active lanes.
    Count(u32),

    /// Jumps to the target.
    Jump(Target),
    /// Jumps to the target if a uniform condition is false.
    Unless { condition: RegisterSlot, target: Target },
    /// `other = active & !condition; active &= condition`; jumps to the target if no lane is left.
    If { condition: RegisterSlot, other: MaskId, target: Target },
    /// Exchanges `active` and `other`; jumps to the target if no lane is left.
    Else { other: MaskId, target: Target },
    /// `mask = {}`.
    Clear(MaskId),
    /// `active |= mask`; jumps to the target if that is empty.
    Join { mask: MaskId, target: Target },
    /// `into |= active; active = {}`; jumps to the target.
    Leave { into: MaskId, target: Target },
    /// Moves the active lanes whose condition equals `when` to `into`; jumps to the target if none is left.
    LeaveIf { condition: RegisterSlot, when: bool, into: MaskId, target: Target },
    /// Jumps to the loop's head if any lane is active; checks the watchdog.
    Repeat(Target),
    /// `entered = active; active = {}; unmatched =` the lanes of `entered` whose selector is none of `values`.
    Switch { selector: RegisterSlot, values: Box<[u32]>, entered: MaskId, unmatched: MaskId },
    /// Activates also the lanes of `entered` whose selector is one of `values`, and those of `unmatched` if given;
    /// jumps to the target if no lane is active.
    Case { selector: RegisterSlot, values: Box<[u32]>, entered: MaskId, unmatched: Option<MaskId>, target: Target },
    /// Kills the active lanes, which are done; jumps to the target.
    Kill(Target),
    /// Kills the active lanes and makes them helpers.
    Demote,
    /// The end of the program.
    End,
}

impl Step {
    /// Calls `visit` on the jump target, if there is one.
    pub fn target_mut(&mut self) -> Option<&mut Target> {
        match self {
            Self::Jump(target)
            | Self::Repeat(target)
            | Self::Kill(target)
            | Self::Unless { target, .. }
            | Self::If { target, .. }
            | Self::Else { target, .. }
            | Self::Join { target, .. }
            | Self::Leave { target, .. }
            | Self::LeaveIf { target, .. }
            | Self::Case { target, .. } => Some(target),
            _ => None,
        }
    }
}

/// The instructions of a counted run, by [`Kind`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RunCost {
    /// Instructions on varying registers, executed for all lanes.
    pub varying: [u32; Kind::COUNT],
    /// Instructions computed once for all lanes.
    pub uniform: [u32; Kind::COUNT],
}
