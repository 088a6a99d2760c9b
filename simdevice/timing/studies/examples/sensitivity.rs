//! Writes SENSITIVITY.md and its plots: `sensitivity [FOLDER]`. The default folder is this crate's.

use std::error::Error;
use std::path::PathBuf;
use timing_studies::sensitivity;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args().nth(1);
    let folder = PathBuf::from(folder.unwrap_or_else(|| env!("CARGO_MANIFEST_DIR").to_owned()));
    std::fs::create_dir_all(folder.join("sensitivity"))?;
    std::fs::write(folder.join("SENSITIVITY.md"), sensitivity::markdown()?)?;
    for sweep in sensitivity::sweeps(&sensitivity::frame())? {
        let file = folder.join("sensitivity").join(format!("{}.svg", sweep.file));
        std::fs::write(file, sweep.svg())?;
    }
    Ok(())
}
