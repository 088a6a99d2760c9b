//! A mutant, the one that is active, and how often its code was reached.

use std::path::PathBuf;
use std::sync::atomic::{AtomicPtr, AtomicU64, Ordering};

use crate::table::MUTANTS;

/// The variable that names the active mutant. The layer reads it as an instance is created.
pub const MUTANT: &str = "GAURAST_MUTANT";

/// The variable with the path of a file. As an instance is destroyed, the layer writes to it how often the active
/// mutant's code was reached.
pub const REPORT: &str = "GAURAST_MUTANT_REPORT";

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

/// Makes the mutant active that the environment names.
pub(crate) fn choose() {
    let name = std::env::var(MUTANT).unwrap_or_default();
    let found = MUTANTS.iter().find(|mutant| mutant.name.eq_ignore_ascii_case(&name));
    if found.is_none() && !name.is_empty() {
        eprintln!("VK_LAYER_GAURAST_mutants: {MUTANT} is {name}, which is no mutant");
    }
    let chosen = found.map_or(std::ptr::null(), |mutant| std::ptr::from_ref::<Mutant>(mutant));
    ACTIVE.store(chosen.cast_mut(), Ordering::Relaxed);
    REACHED.store(0, Ordering::Relaxed);
}

/// Writes how often the active mutant's code was reached.
pub(crate) fn report() {
    let Some(path) = std::env::var_os(REPORT).map(PathBuf::from) else {
        return;
    };
    let reached = REACHED.load(Ordering::Relaxed);
    if let Err(error) = std::fs::write(&path, reached.to_string()) {
        eprintln!("VK_LAYER_GAURAST_mutants: {}: {error}", path.display());
    }
}
