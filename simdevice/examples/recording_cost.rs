//! Draws a scene some times, with its work recorded or not, for a count of instructions (see `timing/README.md`):
//! `recording_cost triangles|gaussians|mixed|hidden|dispatches on|off TIMES`, under
//! `valgrind --tool=callgrind --callgrind-out-file=/dev/null`. The difference of two counts of times is the draws' alone.

#[path = "../tests/common/mod.rs"]
#[allow(dead_code, missing_docs, reason = "the tests use all of it and document none")]
mod common;
#[path = "../tests/common/scenes.rs"]
#[allow(dead_code, missing_docs, reason = "the tests use all of it and document none")]
mod scenes;

use simdevice::runtime::SimdLevel;
use simdevice::{Config, Device};
use std::sync::Arc;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let mut next = || arguments.next().unwrap_or_default();
    let (name, on, times) = (next(), next(), next());
    let kind = scenes::KINDS.iter().find(|(_, known)| *known == name);
    let (kind, _) = kind.ok_or("there is no such scene")?;
    let (recording, recorder) = scenes::recording();
    let config = Config { threads: 1, simd: SimdLevel::Avx2, ..if on == "on" { recording } else { Config::default() } };
    let device = Arc::new(Device::new(&config)?);
    for _ in 0..times.parse()? {
        scenes::draw_on(&device, *kind, [&[], &[]]);
    }
    println!("{} frames recorded", recorder.trace().frames.len());
    Ok(())
}
