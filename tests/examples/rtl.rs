//! Prints the tables of the SystemVerilog module in `docs/simulator.md`: tiles drawn by Verilator and by the model, cycles
//! by cause, and the model's share of waiting Gaussians, calibrated without a group of tiles. FOLDER keeps Verilator's
//! build: `cargo run --profile checked -p gaurast-tests --example rtl -- FOLDER TILES [SCENE...]`.

#[path = "../gaussian/simulator/tiles.rs"]
#[allow(dead_code, reason = "the tests use more of it")]
mod tiles;

use std::path::Path;
use timing_studies::number::Format;
use timing_studies::rtl::{Memory, ModuleBench, Simulator};
use timing_studies::rtl_cycles::{Cycles, Setting, calibrated_sharing, mean_error};

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
            (name.to_string_lossy().into_owned(), tiles::View::open(Path::new(scene), [640, 360]))
        })
        .collect();
    let mut masked = Vec::new();
    for (name, format) in [("fp32", Format::SINGLE), ("fp16", Format::HALF)] {
        let bench = ModuleBench::build(Simulator::Verilator, Path::new(folder), format, &[])?;
        for setting in Setting::ALL {
            let mut sources = vec![(
                "generated".to_owned(),
                tiles::generated(format, setting.groups, setting.masked, count, setting.seed),
            )];
            let groups = setting.masked.then_some(setting.groups);
            for (scene, view) in &views {
                sources.push((scene.clone(), view.lists(format, groups, count, setting.seed)));
            }
            for (source, lists) in sources {
                let cycles = Cycles::of(&bench, setting, format, &lists, Memory::OF_PRESETS)?;
                let pairs = cycles.by_cause().map(|[ours, model]| format!("{ours:.0} / {model:.0}"));
                println!(
                    "| {source} | {name} | {} | {} | {} | {} |",
                    setting.name,
                    cycles.tiles,
                    cycles.different_pixels,
                    pairs.join(" | "),
                );
                if setting.masked {
                    masked.push((source, cycles));
                }
            }
        }
    }
    print_calibration(&masked);
    Ok(())
}

/// The error of the model's cycles for the tiles of each source, with the share of waiting Gaussians that is calibrated
/// on those of the others, and with two shares for comparison.
fn print_calibration(masked: &[(String, Cycles)]) {
    println!("\n| left out | share from the others | error | error with none | error with half |");
    println!("|---|---:|---:|---:|---:|");
    let mut sources: Vec<_> = masked.iter().map(|(source, _)| source).collect();
    sources.sort();
    sources.dedup();
    for source in sources {
        let groups = |of_it: bool| -> Vec<&Cycles> {
            let groups = masked.iter().filter(|(name, _)| (name == source) == of_it);
            groups.map(|(_, cycles)| cycles).collect()
        };
        let (these, others) = (groups(true), groups(false));
        let sharing = calibrated_sharing(&others);
        let errors = [sharing, 0.0, 0.5].map(|sharing| {
            let error = mean_error(&these, sharing) * 100.0;
            format!("{error:.1} %")
        });
        println!("| {source} | {sharing:.2} | {} |", errors.join(" | "));
    }
}
