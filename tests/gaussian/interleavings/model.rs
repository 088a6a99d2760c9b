//! A binary64 model of an interleaving: the possible contents of each pixel after every step.

use super::sequence::{Area, DepthTest, Interleaving, Picture, SIZE, Step};
use gaurast_tests::oracle::sample_tests::compare;
use gaurast_tests::oracle::{OracleState, Stored, TestedReference, render_tested};
use gaurast_tests::triangles::edges::covers;

/// The allowed distance of a Gaussian draw from its envelope, in any channel.
const GAUSSIAN_SLACK: f64 = 5e-6;
/// The allowed error of binary32 blending of one fragment.
const BLEND_SLACK: f64 = 3e-7;

/// The possible contents of a pixel.
#[derive(Clone, Debug)]
struct Pixel {
    least: [f64; 4],
    greatest: [f64; 4],
    /// The allowed distance outside those colours.
    slack: f64,
    /// The bits of the possible depths.
    depths: Vec<u32>,
    /// True if more medians are possible than are followed.
    is_unknown: bool,
}

/// The state of an interleaving.
pub struct Model<'a> {
    interleaving: &'a Interleaving,
    pixels: Vec<Pixel>,
    /// The current colours of the triangles.
    colors: Vec<[f32; 4]>,
}

impl Pixel {
    fn set_color(&mut self, color: [f32; 4]) {
        let color = color.map(f64::from);
        (self.least, self.greatest, self.slack) = (color, color, 0.0);
    }

    /// Extends the possible contents to those of `other`.
    fn widen(&mut self, other: &Self) {
        for channel in 0..4 {
            self.least[channel] = self.least[channel].min(other.least[channel]);
            self.greatest[channel] = self.greatest[channel].max(other.greatest[channel]);
        }
        self.slack = self.slack.max(other.slack);
        self.depths.extend(&other.depths);
        self.tidy();
    }

    fn tidy(&mut self) {
        self.depths.sort_unstable();
        self.depths.dedup();
    }

    /// Blends a premultiplied colour over all possible contents.
    fn over(&mut self, color: [f64; 4]) {
        let rest = 1.0 - color[3];
        for (channel, color) in color.into_iter().enumerate() {
            self.least[channel] = color + rest * self.least[channel];
            self.greatest[channel] = color + rest * self.greatest[channel];
        }
    }
}

impl<'a> Model<'a> {
    pub fn new(interleaving: &'a Interleaving) -> Self {
        let nothing = Pixel { least: [0.0; 4], greatest: [0.0; 4], slack: 0.0, depths: vec![0], is_unknown: false };
        Self {
            interleaving,
            pixels: vec![nothing; (SIZE * SIZE) as usize],
            colors: interleaving.triangles.iter().map(|t| t.color).collect(),
        }
    }

    /// Executes all steps.
    pub fn play(&mut self) {
        for step in &self.interleaving.steps {
            self.step(step);
        }
    }

    fn step(&mut self, step: &Step) {
        const WHOLE: Area = [0, 0, SIZE, SIZE];
        match *step {
            Step::BeginPass(Some((color, depth))) => self.clear(Some(color), Some(depth), WHOLE),
            Step::BeginPass(None) | Step::EndPass | Step::Barrier => {}
            Step::Triangles { first, count, blends, test } => {
                for triangle in first..first + count {
                    self.triangle(triangle, blends, test);
                }
            }
            Step::Gaussians { scene, test } => self.gaussians(scene, test),
            Step::ClearAttachments { color, depth, area } => self.clear(color, depth, area),
            Step::Dispatch => {
                for channel in self.colors.as_flattened_mut() {
                    *channel = *channel * 0.5 + 0.25;
                }
            }
            Step::ClearImage(color) => self.clear(Some(color), None, WHOLE),
            Step::CopyThroughBuffer { from, to } => {
                let before = self.pixels.clone();
                let [x, y, width, height] = from;
                for (dx, dy) in (0..height).flat_map(|dy| (0..width).map(move |dx| (dx, dy))) {
                    let source = &before[((y + dy) * SIZE + x + dx) as usize];
                    let target = &mut self.pixels[((to[1] + dy) * SIZE + to[0] + dx) as usize];
                    let depths = std::mem::take(&mut target.depths);
                    let is_unknown = target.is_unknown || source.is_unknown;
                    *target = Pixel { depths, is_unknown, ..source.clone() };
                }
            }
            Step::CopyColor { from, to } => self.colors[to] = self.colors[from],
        }
    }

    fn clear(&mut self, color: Option<[f32; 4]>, depth: Option<f32>, [x, y, w, h]: Area) {
        for at in (y..y + h).flat_map(|y| (x..x + w).map(move |x| y * SIZE + x)) {
            let pixel = &mut self.pixels[at as usize];
            if let Some(color) = color {
                pixel.set_color(color);
            }
            if let Some(depth) = depth {
                pixel.depths = vec![depth.to_bits()];
            }
        }
    }

    fn triangle(&mut self, index: usize, blends: bool, test: DepthTest) {
        let triangle = &self.interleaving.triangles[index];
        let (color, depth) = (self.colors[index], triangle.depth.to_bits());
        for at in 0..SIZE * SIZE {
            let centre = [at % SIZE, at / SIZE].map(|pixel| 16 * pixel + 8);
            if !covers(&triangle.corners, SIZE, centre) {
                continue;
            }
            let pixel = &mut self.pixels[at as usize];
            let passes = |stored: &u32| test.is_none_or(|(op, _)| compare(op, depth, *stored));
            let mut passed = pixel.clone();
            passed.depths.retain(passes);
            let mut failed = pixel.clone();
            failed.depths.retain(|stored| !passes(stored));
            if passed.depths.is_empty() {
                continue;
            }
            if test.is_some_and(|(_, write)| write) {
                passed.depths = vec![depth];
            }
            if blends {
                passed.over(color.map(f64::from));
                passed.slack = passed.slack * (1.0 - f64::from(color[3])) + BLEND_SLACK;
            } else {
                passed.set_color(color);
            }
            if !failed.depths.is_empty() {
                passed.widen(&failed);
            }
            *pixel = passed;
        }
    }

    fn gaussians(&mut self, scene: usize, test: DepthTest) {
        let interleaving = self.interleaving;
        let scene = interleaving.scenes[scene].as_oracle();
        let tests = interleaving.tests(test);
        // One round for each of the depths that a pixel may hold.
        let rounds = self.pixels.iter().map(|pixel| pixel.depths.len()).max();
        let references: Vec<TestedReference> = (0..rounds.unwrap_or(1))
            .map(|round| {
                let depth = |pixel: &Pixel| pixel.depths[round % pixel.depths.len()];
                let stored = Stored { depth: self.pixels.iter().map(depth).collect(), stencil: Vec::new() };
                let state = OracleState::default();
                render_tested(&scene, &interleaving.camera, &state, &tests, &stored)
            })
            .collect();
        for (at, pixel) in self.pixels.iter_mut().enumerate() {
            let mut after: Option<Pixel> = None;
            for reference in &references[..pixel.depths.len()] {
                let is_touched = reference.color.outcomes(at).any(|rgba| *rgba != [0.0; 4]);
                for rgba in reference.color.outcomes(at) {
                    let mut outcome = pixel.clone();
                    outcome.over(*rgba);
                    if is_touched {
                        outcome.slack += GAUSSIAN_SLACK + BLEND_SLACK;
                    }
                    match &reference.depth[at] {
                        Some(depths) => outcome.depths = depths.iter().map(|codes| codes.nominal).collect(),
                        None => outcome.is_unknown = true,
                    }
                    match &mut after {
                        Some(after) => after.widen(&outcome),
                        None => after = Some(outcome),
                    }
                }
            }
            if let Some(mut after) = after {
                after.tidy();
                *pixel = after;
            }
        }
    }

    /// Compares a picture with the model. Returns the number of unknown pixels, and of pixels with several outcomes.
    pub fn judge(&self, seed: u64, picture: &Picture) -> (usize, usize) {
        let (mut unknown, mut open) = (0, 0);
        for (at, pixel) in self.pixels.iter().enumerate() {
            if pixel.is_unknown {
                unknown += 1;
                continue;
            }
            open += usize::from(pixel.depths.len() > 1 || pixel.least != pixel.greatest);
            for channel in 0..4 {
                let value = f64::from(picture.color[at][channel]);
                let outside = (pixel.least[channel] - value).max(value - pixel.greatest[channel]);
                // Copied values have no error of their own.
                let limit = pixel.slack.max(1e-12);
                assert!(
                    outside <= limit,
                    "interleaving {seed}, pixel {at}, channel {channel}: {value} is {outside:e} from {pixel:?}"
                );
            }
            let depth = picture.depth[at];
            assert!(
                pixel.depths.contains(&depth),
                "interleaving {seed}, pixel {at}: depth {depth:#x} is none of {:x?}",
                pixel.depths
            );
        }
        (unknown, open)
    }
}
