//! Writes traces of the work of four small generated scenes, which `gaurast simulate` reads: triangles.json,
//! gaussians.json, mixed.json (triangles, Gaussians and triangles again in one pass) and dispatches.json, in the folder
//! given or the current one.

#[path = "../tests/common/mod.rs"]
#[allow(dead_code, missing_docs, reason = "the tests use all of it and document none")]
mod common;
#[path = "../tests/common/scenes.rs"]
#[allow(missing_docs, reason = "the tests document none of it")]
mod scenes;

use std::path::PathBuf;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = PathBuf::from(std::env::args().nth(1).unwrap_or_else(|| ".".to_owned()));
    for (kind, name) in scenes::KINDS {
        let (config, recorder) = scenes::recording();
        scenes::draw(kind, &config, [&[], &[]]);
        let path = folder.join(format!("{name}.json"));
        std::fs::write(&path, timing::trace_file::to_bytes(&recorder.trace())?)?;
        println!("wrote {}", path.display());
    }
    Ok(())
}
