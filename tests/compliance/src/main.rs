//! `gaurast-compliance FOLDER`: writes the scenes, the exact pictures and the manifest to a folder.

use std::path::PathBuf;
use std::process::ExitCode;

fn main() -> ExitCode {
    let Some(folder) = std::env::args_os().nth(1).map(PathBuf::from) else {
        eprintln!("gaurast-compliance FOLDER");
        return ExitCode::from(2);
    };
    match gaurast_compliance::write(&folder, &gaurast_compliance::cases()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("gaurast-compliance: {error}");
            ExitCode::FAILURE
        }
    }
}
