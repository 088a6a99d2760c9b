//! The list of workloads: one row for each kind of work that applications bring.

use std::path::Path;

use gaurast_bench::quads::QuadRenderer;
use gaurast_render::DeviceOptions;
use gaurast_testkit::Gpu;
use gaurast_workloads::kernels::{self, Context, Size};
use gaurast_workloads::triangles;

use super::workload::Workload;
use super::{fixed_costs, sampling};
use crate::workload::{self, Source};

/// The workloads of quads, by their scenes.
const QUADS: [&str; 4] =
    ["quads, synthetic 50k", "quads, captured-like 50k", "quads, playbot-125k.ply", "quads, skull.ply"];

/// The workloads that are neither quads nor scenes of triangles.
const OTHERS: [&str; 18] = [
    "a million points",
    "sampled, 16-bit floats",
    "sampled, one 32-bit float",
    "sampled, depth comparison",
    "sampled, cube",
    "stored, image to image",
    "mandelbrot",
    "matrix product",
    "prefix sum",
    "n-body",
    "blur",
    "radix sort",
    "subgroup operations",
    "20,000 draws",
    "2,000 descriptor sets",
    "10,000 dispatches",
    "500 image copies, timeline semaphores",
    "blits between formats",
];

/// The names of all workloads.
pub(super) fn names() -> impl Iterator<Item = &'static str> {
    QUADS.into_iter().chain(triangles::NAMES).chain(OTHERS)
}

/// Width and height of pictures of quads.
const SIZE: [u32; 2] = [1280, 720];

/// Gaussians of generated scenes.
const GAUSSIANS: usize = 50_000;

/// The alpha at which a quad ends.
const ALPHA_FLOOR: f32 = 1.0 / 255.0;

/// Prepares the workload of a name. A renderer of its own uses `threads` threads.
///
/// # Errors
/// The reason for which it cannot be prepared, such as a missing file.
///
/// # Panics
/// If the driver lacks what it needs.
pub(super) fn prepare(gpu: &Gpu, name: &str, threads: usize, data: Option<&Path>) -> Result<Workload, String> {
    if let Some(scene) = name.strip_prefix("quads, ") {
        return quads(gpu, scene, threads, data);
    }
    if triangles::NAMES.contains(&name) {
        let workload = triangles::Workload::new(gpu, name).map_err(|missing| missing.to_string())?;
        return Ok(Workload::of(move || workload.run()));
    }
    if let Some(kernel) = kernels::named(name, Size::Large) {
        let prepared = Context::of(gpu.clone()).prepare(&kernel).map_err(|error| error.to_string())?;
        return Ok(Workload::of(move || prepared.run().expect("the kernel runs")));
    }
    let other = fixed_costs::prepare(gpu, name).or_else(|| sampling::prepare(gpu, name));
    other.ok_or_else(|| format!("no workload is called \"{name}\""))
}

/// Whole frames of sorted, blended quads: the processor projects and sorts, and the device draws.
fn quads(gpu: &Gpu, name: &str, threads: usize, data: Option<&Path>) -> Result<Workload, String> {
    let source = match name {
        "synthetic 50k" => Source::Benchmark { count: GAUSSIANS },
        "captured-like 50k" => Source::Captured { count: GAUSSIANS, cameras: None },
        file => Source::File { path: data.ok_or("GAURAST_TEST_DATA names no folder")?.join("splats").join(file) },
    };
    let source = workload::Workload::new(source, SIZE);
    let scene = source.scene().map_err(|error| error.to_string())?;
    let camera = source.views(&scene, 1).map_err(|error| error.to_string())?.remove(0);
    let options = DeviceOptions { threads: threads as u32, ..DeviceOptions::default() };
    let is_own = gpu.gaussian().is_some();
    let renderer = if is_own {
        QuadRenderer::with_options(vulkan_gaurast::entry(), "", threads, &options)
    } else {
        QuadRenderer::through_the_loader("", threads)
    };
    let mut renderer = renderer.map_err(|error| error.to_string())?;
    Ok(Workload::of(move || {
        renderer.render(&scene, &camera, 3, ALPHA_FLOOR).expect("the frame is drawn");
    }))
}
