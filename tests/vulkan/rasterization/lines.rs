//! The modes of lines: Bresenham's, smooth and stippled ones.

use ash::vk;
use gaurast_runner::Need;
use gaurast_testkit::devices::{lavapipe, own};
use gaurast_testkit::shader::GLSLANG;
use gaurast_testkit::shapes;
use gaurast_testkit::{Buffer, Gpu, Pass, Pipeline, PipelineOptions, Target, TargetOptions, Vertex};
use rand::Rng;
use vk::LineRasterizationModeKHR as Mode;

/// The side of the square target, and of the cell of each line, in pixels.
const SIZE: u32 = 512;
const CELL: u32 = 32;
/// The number of cells in a row.
const ROW: u32 = SIZE / CELL;

/// The state of lines.
#[derive(Clone, Copy, Debug)]
struct Lines {
    mode: Mode,
    width: f32,
    stipple: Option<(u32, u16)>,
    samples: u32,
    topology: vk::PrimitiveTopology,
}

impl Lines {
    const fn of(mode: Mode) -> Self {
        Self { mode, width: 1.0, stipple: None, samples: 1, topology: vk::PrimitiveTopology::LINE_LIST }
    }

    /// The colours of the target's pixels, or of its resolved ones.
    fn draw(&self, gpu: &Gpu, vertices: &[Vertex]) -> Vec<[f32; 4]> {
        let (factor, pattern) = self.stipple.unwrap_or((0, 0));
        let mut state = vk::PipelineRasterizationLineStateCreateInfoKHR::default()
            .line_rasterization_mode(self.mode)
            .stippled_line_enable(self.stipple.is_some())
            .line_stipple_factor(factor)
            .line_stipple_pattern(pattern);
        let mut raster = vk::PipelineRasterizationStateCreateInfo::default().line_width(self.width);
        raster.p_next = (&raw mut state).cast();
        let options = TargetOptions { size: [SIZE; 2], ..TargetOptions::of(vk::Format::R32G32B32A32_SFLOAT) };
        let options = if self.samples == 1 { options } else { options.multisampled() };
        let target = Target::new(gpu, &options);
        let options = PipelineOptions { topology: self.topology, raster, ..PipelineOptions::default() };
        let pipeline = Pipeline::new(gpu, &target, &options);
        let buffer = Buffer::of(gpu, vertices);
        gpu.run(|commands| {
            commands.pass(&target, &Pass::zeros(), || {
                commands.bind(&pipeline);
                commands.vertices(&buffer);
                commands.draw(0..vertices.len() as u32);
            });
        });
        let images = if self.samples == 1 { &target.colors } else { &target.resolved };
        bytemuck::pod_collect_to_vec(&images[0].read(vk::ImageAspectFlags::COLOR, 16))
    }
}

/// A vertex at a place in pixels.
fn vertex([x, y]: [f32; 2], color: [f32; 4]) -> Vertex {
    let clip = |at: f32| at / (SIZE as f32 / 2.0) - 1.0;
    Vertex { position: [clip(x), clip(y), 0.5, 1.0], color }
}

/// A line in the middle of each cell, with ends on a grid of `steps` to a pixel.
fn in_cells(seed: u64, steps: f32) -> Vec<Vertex> {
    let mut rng = shapes::rng(seed);
    let mut vertices = Vec::new();
    for cell in 0..ROW * ROW {
        let corner = [cell % ROW, cell / ROW].map(|at| (at * CELL) as f32);
        for color in [[1.0, 0.25, 0.0, 1.0], [0.0, 0.75, 1.0, 1.0]] {
            let place = corner.map(|at| at + (rng.random_range(6.0..26.0f32) * steps).round() / steps);
            vertices.push(vertex(place, color));
        }
    }
    vertices
}

/// The covered pixels of each cell.
fn cells(pixels: &[[f32; 4]]) -> Vec<Vec<[u32; 2]>> {
    let mut cells = vec![Vec::new(); (ROW * ROW) as usize];
    for (at, pixel) in (0..).zip(pixels) {
        let place: [u32; 2] = [at % SIZE, at / SIZE];
        if pixel[3] > 0.0 {
            cells[(place[1] / CELL * ROW + place[0] / CELL) as usize].push(place);
        }
    }
    cells
}

/// Lines whose ends are nowhere near a boundary have the same pixels on both devices.
#[gaurast_runner::test(needs = [GLSLANG, Need::Lavapipe])]
fn bresenham_lines_are_like_lavapipes() {
    for (width, samples) in [(1.0, 1), (1.0, 4), (4.0, 1)] {
        let lines = Lines { width, samples, ..Lines::of(Mode::BRESENHAM) };
        let vertices = in_cells(3, 256.0);
        let [ours, theirs] = [own(), lavapipe()].map(|gpu| cells(&lines.draw(gpu, &vertices)));
        let different = ours.iter().zip(&theirs).filter(|(ours, theirs)| ours != theirs).count();
        println!("{lines:?}: {different} of {} lines differ", ours.len());
        assert!(ours.iter().all(|pixels| !pixels.is_empty()));
    }
}

#[gaurast_runner::test(needs = [GLSLANG, Need::Lavapipe])]
fn stippled_lines_are_like_lavapipes() {
    for mode in [Mode::RECTANGULAR, Mode::BRESENHAM] {
        for stipple in [(1, 0xAAAA), (3, 0x0F35)] {
            for topology in [vk::PrimitiveTopology::LINE_LIST, vk::PrimitiveTopology::LINE_STRIP] {
                let lines = Lines { stipple: Some(stipple), topology, ..Lines::of(mode) };
                let vertices = in_cells(5, 256.0);
                let [ours, theirs] = [own(), lavapipe()].map(|gpu| lines.draw(gpu, &vertices));
                let count = |pixels: &[[f32; 4]]| pixels.iter().filter(|pixel| pixel[3] > 0.0).count();
                let both = ours.iter().zip(&theirs).filter(|(a, b)| (a[3] > 0.0) != (b[3] > 0.0)).count();
                println!("{lines:?}: {} {} pixels, {both} differ", count(&ours), count(&theirs));
            }
        }
    }
}

#[gaurast_runner::test(needs = [GLSLANG, Need::Lavapipe])]
fn smooth_lines_are_like_lavapipes() {
    for width in [1.0, 3.0] {
        let lines = Lines { width, ..Lines::of(Mode::RECTANGULAR_SMOOTH) };
        let vertices = in_cells(7, 256.0);
        let [ours, theirs] = [own(), lavapipe()].map(|gpu| lines.draw(gpu, &vertices));
        let sum = |pixels: &[[f32; 4]]| pixels.iter().map(|pixel| pixel[3]).sum::<f32>();
        println!("{lines:?}: {} {}", sum(&ours), sum(&theirs));
    }
}
