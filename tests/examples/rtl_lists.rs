//! Writes lists for the measurements of the SystemVerilog module (`power.sh`, `coverage.sh`) to a folder, as files of the bench:
//! `cargo run --profile checked -p gaurast-tests --example rtl_lists -- FOLDER [SCENE...]`. Without scenes all lists are generated.

#[path = "../gaussian/simulator/tiles.rs"]
#[allow(dead_code, reason = "the tests use more of it")]
mod tiles;

use simdevice::timing::work::Mode;
use std::path::Path;
use timing_studies::module::List;
use timing_studies::number::Format;
use timing_studies::rtl::{Memory, bench_input};
use timing_studies::rtl_cycles::Setting;

/// Tiles of each source for a measurement of power, of which each is drawn whole.
const TILES: usize = 2;
/// The most primitives of such a tile: with 16 groups each, 1,536 cycles.
const PRIMITIVES: usize = 96;
/// Generated lists for coverage, in each setting.
const FOR_COVERAGE: usize = 25;

fn main() -> std::io::Result<()> {
    let arguments: Vec<_> = std::env::args().skip(1).collect();
    let [folder, scenes @ ..] = arguments.as_slice() else {
        return Err(std::io::Error::other("FOLDER [SCENE...]"));
    };
    let folder = Path::new(folder);
    std::fs::create_dir_all(folder)?;
    let views: Vec<_> = scenes.iter().map(|scene| tiles::View::open(Path::new(scene), [640, 360])).collect();
    let whole = Setting::ALL[0];
    for (name, format) in [("fp32", Format::SINGLE), ("fp16", Format::HALF)] {
        let write = |kind: &str, lists: &[List], setting: Setting, memory: Memory| {
            let words = bench_input(format, lists, &setting.module(format), memory);
            let bytes: Vec<_> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
            std::fs::write(folder.join(format!("{name}-{kind}.lists")), bytes)
        };
        let generated = tiles::generated(format, whole.groups, false, 10, whole.seed);
        let (mut gaussians, mut triangles): (Vec<_>, Vec<_>) =
            generated.into_iter().partition(|list| list.mode == Mode::Gaussian);
        if !views.is_empty() {
            gaussians = views.iter().flat_map(|view| view.lists(format, None, TILES, whole.seed)).collect();
        }
        for list in gaussians.iter_mut().chain(&mut triangles) {
            list.primitives.truncate(PRIMITIVES);
        }
        write("gaussians", &gaussians, whole, Memory::OF_PRESETS)?;
        write("triangles", &triangles, whole, Memory::OF_PRESETS)?;
        for (index, setting) in Setting::ALL.into_iter().enumerate() {
            let mut lists = tiles::generated(format, setting.groups, setting.masked, FOR_COVERAGE, setting.seed);
            lists.extend(tiles::short(format, setting, FOR_COVERAGE));
            write(&format!("setting{index}"), &lists, setting, Memory::OF_PRESETS)?;
            let stalls = Memory { stalls: 1 + index as u32, ..Memory::OF_PRESETS };
            write(&format!("setting{index}-stalls"), &lists, setting, stalls)?;
        }
    }
    Ok(())
}
