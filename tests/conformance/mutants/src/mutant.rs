//! A mutant, the one that is active, and how often its code was reached.

use std::sync::atomic::{AtomicPtr, AtomicU64, Ordering};

/// A wrong behaviour.
#[derive(Debug)]
pub struct Mutant {
    /// The name, in capitals; [`MUTANT`] has it in any case.
    pub name: &'static str,
    /// The chapter of the conformance cases that it must fail.
    pub chapter: &'static str,
    /// A sentence about what a driver with this behaviour does.
    pub text: &'static str,
}

static ACTIVE: AtomicPtr<Mutant> = AtomicPtr::new(std::ptr::null_mut());
static REACHED: AtomicU64 = AtomicU64::new(0);

impl Mutant {
    /// Returns true if this is the active mutant.
    pub(crate) fn is_active(&'static self) -> bool {
        std::ptr::eq(ACTIVE.load(Ordering::Relaxed), self)
    }

    /// Returns true if this is the active mutant and a behaviour `differs`. The code is reached then.
    pub(crate) fn strikes(&'static self, differs: bool) -> bool {
        let strikes = differs && self.is_active();
        if strikes {
            REACHED.fetch_add(1, Ordering::Relaxed);
        }
        strikes
    }

    /// Replaces a value by the wrong one, if this is the active mutant and they differ.
    pub(crate) fn replaces<T: PartialEq>(&'static self, value: &mut T, wrong: T) {
        if self.strikes(*value != wrong) {
            *value = wrong;
        }
    }

    /// Makes a value wrong, if this is the active mutant.
    pub(crate) fn changes<T: Copy + PartialEq>(&'static self, value: &mut T, wrong: impl FnOnce(T) -> T) {
        self.replaces(value, wrong(*value));
    }

    /// The value, or the wrong one if this is the active mutant.
    pub(crate) fn or<T: PartialEq>(&'static self, mut value: T, wrong: T) -> T {
        self.replaces(&mut value, wrong);
        value
    }
}

/// Makes a mutant active, or none, whose code was not reached yet.
pub(crate) fn activate(mutant: Option<&'static Mutant>) {
    let chosen = mutant.map_or(std::ptr::null(), std::ptr::from_ref);
    ACTIVE.store(chosen.cast_mut(), Ordering::Relaxed);
    REACHED.store(0, Ordering::Relaxed);
}

/// How often the active mutant's code was reached.
pub(crate) fn reached() -> u64 {
    REACHED.load(Ordering::Relaxed)
}
