//! Prints the table of the SystemVerilog module in `docs/simulator.md`: tiles drawn by Verilator and by the model, and
//! cycles by cause. `cargo run --profile checked -p gaurast-tests --example rtl -- FOLDER TILES [SCENE...]`; FOLDER
//! keeps Verilator's build.

#[path = "../simulator/tiles.rs"]
#[allow(dead_code, reason = "the tests use more of it")]
mod tiles;

use std::path::Path;
use timing_studies::number::Format;
use timing_studies::rtl::ModuleBench;
use timing_studies::rtl_cycles::{Cycles, Setting};

fn main() -> std::io::Result<()> {
    let arguments: Vec<_> = std::env::args().skip(1).collect();
    let [folder, tiles, scenes @ ..] = arguments.as_slice() else {
        return Err(std::io::Error::other("FOLDER TILES [SCENE...]"));
    };
    let count: usize = tiles.parse().map_err(std::io::Error::other)?;
    println!(
        "| tiles | numbers | groups | count | differing pixels | cycles | busy | transmittance | memory | controller | modes |"
    );
    println!("|---|---|---|---:|---:|---:|---:|---:|---:|---:|---:|");
    let views: Vec<_> = scenes
        .iter()
        .map(|scene| {
            let name = Path::new(scene).file_stem().unwrap_or_default();
            (
                name.to_string_lossy().into_owned(),
                tiles::View::open(Path::new(scene), [640, 360]),
            )
        })
        .collect();
    for (name, format) in [("fp32", Format::SINGLE), ("fp16", Format::HALF)] {
        let bench = ModuleBench::build(Path::new(folder), format, &[])?;
        for setting in Setting::ALL {
            let mut sources = vec![(
                "generated".to_owned(),
                tiles::generated(format, setting.groups, setting.masked, count, setting.seed),
            )];
            let groups = setting.masked.then_some(setting.groups);
            for (scene, view) in &views {
                sources.push((
                    scene.clone(),
                    view.lists(format, groups, count, setting.seed),
                ));
            }
            for (source, lists) in sources {
                let cycles = Cycles::of(&bench, setting, format, &lists)?;
                let pairs = cycles
                    .by_cause()
                    .map(|[ours, model]| format!("{ours:.0} / {model:.0}"));
                println!(
                    "| {source} | {name} | {} | {} | {} | {} |",
                    setting.name,
                    cycles.tiles,
                    cycles.different_pixels,
                    pairs.join(" | "),
                );
            }
        }
    }
    Ok(())
}
