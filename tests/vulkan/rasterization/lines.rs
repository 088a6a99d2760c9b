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

/// lavapipe moves the ends of lines of even width by whole pixels, where half of one is left over; so these are left out.
#[gaurast_runner::test(needs = [GLSLANG, Need::Lavapipe])]
fn bresenham_lines_have_lavapipes_pixels() {
    for (width, samples) in [(1.0, 1), (1.0, 4), (3.0, 1)] {
        let lines = Lines { width, samples, ..Lines::of(Mode::BRESENHAM) };
        let vertices = in_cells(3, 256.0);
        let [ours, theirs] = [own(), lavapipe()].map(|gpu| cells(&lines.draw(gpu, &vertices)));
        assert!(ours.iter().filter(|pixels| pixels.len() > 3).count() > 230);
        let different: Vec<_> = ours.iter().zip(&theirs).filter(|(ours, theirs)| ours != theirs).collect();
        assert!(different.is_empty(), "{lines:?}: {} lines differ: {different:?}", different.len());
    }
}

/// A pixel that a Bresenham line and a rectangle share has the same values in both.
#[gaurast_runner::test(needs = [GLSLANG])]
fn bresenham_lines_have_the_values_of_rectangles() {
    let vertices = in_cells(4, 256.0);
    let [rectangles, lines] = [Mode::RECTANGULAR, Mode::BRESENHAM].map(|mode| Lines::of(mode).draw(own(), &vertices));
    let both: Vec<_> = rectangles.iter().zip(&lines).filter(|(a, b)| a[3] > 0.0 && b[3] > 0.0).collect();
    assert!(both.len() > 2000, "{} pixels", both.len());
    assert!(both.iter().all(|(a, b)| a == b));
}

#[gaurast_runner::test(needs = [GLSLANG, Need::Lavapipe])]
fn stippled_rectangles_have_lavapipes_pixels() {
    for stipple in [(1, 0xAAAA), (3, 0x0F35)] {
        let lines = Lines { stipple: Some(stipple), ..Lines::of(Mode::RECTANGULAR) };
        let vertices = in_cells(5, 256.0);
        let [ours, theirs] = [own(), lavapipe()].map(|gpu| lines.draw(gpu, &vertices));
        let count = ours.iter().filter(|pixel| pixel[3] > 0.0).count();
        let different = ours.iter().zip(&theirs).filter(|(a, b)| (a[3] > 0.0) != (b[3] > 0.0)).count();
        // lavapipe rounds the ends of units to 1/256 pixels.
        assert!(count > 1000 && different * 100 < count, "{lines:?}: {different} of {count} pixels differ");
    }
}

/// The pattern of a Bresenham line counts pixels from its beginning, of which each unit of length need not have one.
#[gaurast_runner::test(needs = [GLSLANG])]
fn stippled_bresenham_lines_count_pixels() {
    let vertices = in_cells(6, 256.0);
    let lines = Lines::of(Mode::BRESENHAM);
    let whole = cells(&lines.draw(own(), &vertices));
    for (factor, pattern) in [(1, 0xAAAA_u16), (3, 0x0F35), (2, 0x0001)] {
        let drawn = cells(&Lines { stipple: Some((factor, pattern)), ..lines }.draw(own(), &vertices));
        for ((whole, drawn), ends) in whole.iter().zip(&drawn).zip(vertices.as_chunks::<2>().0) {
            let by = [0, 1].map(|axis| ends[1].position[axis] - ends[0].position[axis]);
            let major = usize::from(by[1].abs() > by[0].abs());
            let mut along = whole.clone();
            along.sort_unstable_by_key(|pixel| if by[major] > 0.0 { pixel[major] } else { SIZE - pixel[major] });
            let is_on = |number: u32| pattern >> (number / factor % 16) & 1 == 1;
            let mut expected: Vec<_> =
                (0..).zip(along).filter(|(number, _)| is_on(*number)).map(|(_, pixel)| pixel).collect();
            expected.sort_unstable_by_key(|[x, y]| (*y, *x));
            assert_eq!(*drawn, expected, "{factor} {pattern:#x}");
        }
    }
}

/// A strip along a line is drawn as the line, and a list of its parts is not.
#[gaurast_runner::test(needs = [GLSLANG])]
fn patterns_go_on_along_strips() {
    let at = |x: f32| vertex([x, 20.625], [1.0; 4]);
    let places = [10.25, 31.0, 38.75, 38.75, 77.5, 201.25];
    let whole = [at(places[0]), at(places[5])];
    let strip = places.map(at);
    let list: Vec<Vertex> = places.windows(2).flat_map(|pair| [at(pair[0]), at(pair[1])]).collect();
    for mode in [Mode::RECTANGULAR, Mode::BRESENHAM, Mode::RECTANGULAR_SMOOTH] {
        let lines = Lines { stipple: Some((3, 0x0F35)), ..Lines::of(mode) };
        let expected = lines.draw(own(), &whole);
        let in_strip = Lines { topology: vk::PrimitiveTopology::LINE_STRIP, ..lines };
        let apart = lines.draw(own(), &list);
        assert!(expected != apart, "{mode:?}");
        if mode == Mode::RECTANGULAR_SMOOTH {
            // At an end within a pixel, each part has its share.
            continue;
        }
        assert!(expected == in_strip.draw(own(), &strip), "{mode:?}");
    }
}

/// Alpha times pixels is the area of the line, and lavapipe's within a hundredth.
#[gaurast_runner::test(needs = [GLSLANG, Need::Lavapipe])]
fn smooth_lines_cover_their_area() {
    for width in [1.0, 3.0] {
        let lines = Lines { width, ..Lines::of(Mode::RECTANGULAR_SMOOTH) };
        let vertices = in_cells(7, 256.0);
        let [ours, theirs] = [own(), lavapipe()].map(|gpu| lines.draw(gpu, &vertices));
        let sum = |pixels: &[[f32; 4]]| pixels.iter().map(|pixel| f64::from(pixel[3])).sum::<f64>();
        let length = |ends: &[Vertex; 2]| {
            let by = [0, 1].map(|axis| f64::from(ends[1].position[axis] - ends[0].position[axis]));
            0.5 * f64::from(SIZE) * (by[0] * by[0] + by[1] * by[1]).sqrt()
        };
        let area = f64::from(width) * vertices.as_chunks::<2>().0.iter().map(length).sum::<f64>();
        assert!((sum(&ours) - area).abs() < 0.003 * area, "{} {area}", sum(&ours));
        assert!((sum(&theirs) - area).abs() < 0.01 * area, "{} {area}", sum(&theirs));
        assert!(ours.iter().all(|pixel| (0.0..=1.0).contains(&pixel[3])));
    }
}

#[gaurast_runner::test]
fn all_modes_of_lines_are_supported() {
    let mut features = vk::PhysicalDeviceLineRasterizationFeaturesKHR::default();
    let mut all = vk::PhysicalDeviceFeatures2::default().push_next(&mut features);
    let gpu = own();
    // SAFETY: the physical device is the instance's.
    unsafe {
        gpu.instance().get_physical_device_features2(gpu.physical_device(), &mut all);
    }
    let supported = [
        features.rectangular_lines,
        features.bresenham_lines,
        features.smooth_lines,
        features.stippled_rectangular_lines,
        features.stippled_bresenham_lines,
        features.stippled_smooth_lines,
    ];
    assert_eq!(supported, [vk::TRUE; 6]);
}
