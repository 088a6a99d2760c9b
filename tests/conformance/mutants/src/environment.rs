//! The environment's choice of the active mutant, and the report on it.

use std::path::PathBuf;

use crate::mutant::{activate, reached};
use crate::table::MUTANTS;

/// The variable that names the active mutant. The layer reads it as an instance is created.
pub const MUTANT: &str = "GAURAST_MUTANT";

/// The variable with the path of a file. As an instance is destroyed, the layer writes to it how often the active
/// mutant's code was reached.
pub const REPORT: &str = "GAURAST_MUTANT_REPORT";

/// Makes the mutant active that the environment names.
pub(crate) fn choose() {
    let name = std::env::var(MUTANT).unwrap_or_default();
    let found = MUTANTS.iter().copied().find(|mutant| mutant.name.eq_ignore_ascii_case(&name));
    if found.is_none() && !name.is_empty() {
        eprintln!("VK_LAYER_GAURAST_mutants: {MUTANT} is {name}, which is no mutant");
    }
    activate(found);
}

/// Writes how often the active mutant's code was reached.
pub(crate) fn report() {
    let Some(path) = std::env::var_os(REPORT).map(PathBuf::from) else {
        return;
    };
    if let Err(error) = std::fs::write(&path, reached().to_string()) {
        eprintln!("VK_LAYER_GAURAST_mutants: {}: {error}", path.display());
    }
}
