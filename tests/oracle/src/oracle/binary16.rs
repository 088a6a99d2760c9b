//! Steps 6 and 7 in binary16, as the specification defines `FLOAT16`: every result is rounded where the specification
//! says so.
//!
//! Given a Gaussian's mean, covariance, opacity and colour, the result is defined to the bit. But these inputs come
//! from arithmetic whose last digits are free. An input that is close to the midpoint of two binary16 numbers may be
//! rounded to either, and 2 to the power of the exponent is within [`OF_POWER`] units in the last place. The reference
//! follows all possibilities. A pixel's envelope is their range, which is a single point nearly everywhere.

use half::f16;
use rayon::prelude::*;

use super::panorama;
use super::render::Projected;
use super::splat::Splat;
use super::{OracleCamera, OracleGeometry, OracleOrder, OracleScene, OracleState, Reference};

/// The error that binary64 may have in an input of a pixel, relative to the terms of the input.
const SLACK: f64 = 1e-10;
/// The error bound of a power of two, in units in the last place.
const OF_POWER: f64 = 0.501;
/// The error of a colour after a few roundings to binary32, relative to the size of its terms.
const OF_COLOR: f64 = 24.0 / 16_777_216.0;
/// The greatest binary16 number, which is also the greatest colour.
const GREATEST: f64 = 65504.0;
/// Transmittances that a pixel may have at a time before the reference gives up.
const MAX_WAYS: usize = 64;

/// Rounds to binary32, then to binary16.
fn round(x: f64) -> f64 {
    // A zero is positive: its sign changes nothing.
    f64::from(f16::from_f32(x as f32)) + 0.0
}

/// The binary16 numbers that a value may have, the binary64 one first. NaN may be one of them.
#[derive(Clone, Copy, Debug)]
struct Few {
    values: [f64; 8],
    count: usize,
    /// True if there are more possible values than are kept.
    exhausted: bool,
}

impl Few {
    const NONE: Self = Self { values: [0.0; 8], count: 0, exhausted: false };

    fn one(value: f64) -> Self {
        let mut one = Self::NONE;
        one.add(value);
        one
    }

    /// The results of rounding the numbers within `slack` of `x`.
    fn near(x: f64, slack: f64) -> Self {
        let mut near = Self::one(round(x));
        if x.is_finite() {
            let (mut value, last) = (round(x - slack), round(x + slack));
            near.add(value);
            while value < last && !near.exhausted {
                value = next_up(value);
                near.add(value);
            }
        }
        near
    }

    fn add(&mut self, value: f64) {
        let same = |other: &f64| other.to_bits() == value.to_bits();
        if !self.all().iter().any(same) {
            match self.values.get_mut(self.count) {
                Some(slot) => {
                    *slot = value;
                    self.count += 1;
                }
                None => self.exhausted = true,
            }
        }
    }

    fn all(&self) -> &[f64] {
        &self.values[..self.count]
    }

    /// The possible rounded values of `f` of one of these.
    fn map(&self, f: impl Fn(f64) -> f64) -> Self {
        self.with(&Self::one(0.0), |x, _| f(x))
    }

    /// The possible rounded values of `f` of one of these and one of `other`.
    fn with(&self, other: &Self, f: impl Fn(f64, f64) -> f64) -> Self {
        let mut results = Self { exhausted: self.exhausted || other.exhausted, ..Self::NONE };
        for &a in self.all() {
            for &b in other.all() {
                results.add(round(f(a, b)));
            }
        }
        results
    }
}

/// The next binary16 number, which may be infinite.
fn next_up(x: f64) -> f64 {
    let bits = f16::from_f64(x).to_bits();
    let next = match bits {
        // Negative numbers go down, and the least of them is followed by zero.
        0x8001.. => bits - 1,
        _ => (bits & 0x7FFF) + 1,
    };
    f64::from(f16::from_bits(next)) + 0.0
}

/// The possible rounded values of the power of two.
fn exp2(exponent: f64) -> Few {
    let power = exponent.exp2();
    // Units are 2^-24 below 2^-14.
    let unit = (power.log2().floor().max(-14.0) - 10.0).exp2();
    Few::near(power, (OF_POWER - 0.5) * unit)
}

/// The sums of the absolute values of a colour's terms. No basis function is greater than 3.
fn magnitude(coefficients: &[[f32; 3]]) -> [f64; 3] {
    let sum = |c: usize| coefficients.iter().map(|k| f64::from(k[c]).abs()).sum::<f64>();
    [0, 1, 2].map(|c| 0.5 + 3.0 * sum(c))
}

/// A Gaussian after the rounding of a processing element's inputs.
struct Rounded<'a> {
    splat: &'a Splat,
    /// The possible error of the mean, in px.
    of_mean: [f64; 2],
    factor: [Few; 3],
    log2_opacity: Few,
    color: [[f64; 3]; 3],
}

impl<'a> Rounded<'a> {
    /// `magnitude` is the colour's, without cancellation.
    fn new(splat: &'a Splat, magnitude: [f64; 3]) -> Self {
        let [xx, xy, yy] = splat.covariance;
        let k = (2.0 * std::f64::consts::LN_2).sqrt().recip();
        let (f0, f2) = (k / xx.sqrt(), k * (xx / splat.determinant).sqrt());
        let f1 = -f2 * xy / xx;
        let log2_opacity = splat.opacity.log2();
        let color = |by: f64| {
            let moved = |c: usize| (splat.color[c] + by * OF_COLOR * magnitude[c]).max(0.0);
            let rounded = |c| round(c).clamp(-GREATEST, GREATEST);
            [0, 1, 2].map(moved).map(rounded)
        };
        Self {
            splat,
            of_mean: splat.mean.map(|mean| SLACK * (1.0 + mean.abs())),
            factor: [
                Few::near(f0, SLACK * f0),
                Few::near(f1, SLACK * f2 * (yy / xx).sqrt()),
                Few::near(f2, SLACK * f2),
            ],
            log2_opacity: Few::near(log2_opacity, SLACK * (1.0 + log2_opacity.abs())),
            color: [color(0.0), color(-1.0), color(1.0)],
        }
    }

    /// Step 6 at the centre of pixel (x, y); NaN contributes nothing.
    fn alpha(&self, x: u32, y: u32, ceiling: f64) -> Few {
        let d = [x, y].map(|at| f64::from(at) + 0.5);
        let d = [d[0] - self.splat.mean[0], d[1] - self.splat.mean[1]];
        let Some(dx) = panorama::nearest(d[0], self.splat.period) else {
            return Few::one(f64::NAN);
        };
        let near = |axis: usize, d: f64| Few::near(d, self.of_mean[axis] + SLACK * d.abs());
        let (dx, dy) = (near(0, dx), near(1, d[1]));
        let [f0, f1, f2] = &self.factor;
        let square = |x: f64| x * x;
        let u = dx.with(f0, |d, f| d * f).map(square);
        let (along, across) = (dx.with(f1, |d, f| d * f), dy.with(f2, |d, f| d * f));
        let v = along.with(&across, |a, b| a + b).map(square);
        let q = u.with(&v, |u, v| u + v);
        let exponents = self.log2_opacity.with(&q, |o, q| o - q);
        let mut alphas = Few { exhausted: exponents.exhausted, ..Few::NONE };
        for &exponent in exponents.all() {
            if exponent.is_nan() {
                alphas.add(f64::NAN);
                continue;
            }
            for power in exp2(exponent).all() {
                alphas.add(power.min(ceiling));
            }
        }
        alphas
    }
}

/// The state after the rounding of a processing element's inputs.
struct Thresholds {
    alpha_floor: f64,
    alpha_ceiling: f64,
    transmittance_floor: f64,
}

/// A transmittance that a pixel may have, and the least and greatest colour with it.
#[derive(Clone, Copy, Debug)]
struct Way {
    transmittance: f64,
    finished: bool,
    colors: [[f64; 3]; 2],
}

impl Way {
    const START: Self = Self { transmittance: 1.0, finished: false, colors: [[0.0; 3]; 2] };

    /// Step 7, with the least and the greatest colour that the Gaussian may have.
    fn behind(mut self, alpha: f64, colors: [[f64; 3]; 2], thresholds: &Thresholds) -> Self {
        // NaN is below every floor.
        if self.finished || alpha.is_nan() || alpha < thresholds.alpha_floor {
            return self;
        }
        let weight = round(self.transmittance * alpha);
        let rest = round(self.transmittance - weight);
        if rest < thresholds.transmittance_floor {
            self.finished = true;
            return self;
        }
        for (sums, color) in self.colors.iter_mut().zip(colors) {
            for (sum, c) in sums.iter_mut().zip(color) {
                *sum = round(*sum + round(weight * c));
            }
        }
        self.transmittance = rest;
        self
    }

    /// Widens its colours to those of another.
    fn take_colors_of(&mut self, other: &Self) {
        for c in 0..3 {
            self.colors[0][c] = self.colors[0][c].min(other.colors[0][c]);
            self.colors[1][c] = self.colors[1][c].max(other.colors[1][c]);
        }
    }

    /// Least and greatest (C, 1 - T).
    fn rgba(&self) -> [[f64; 4]; 2] {
        self.colors.map(|[r, g, b]| [r, g, b, 1.0 - self.transmittance])
    }
}

struct Pixel {
    nominal: Way,
    ways: Vec<Way>,
    exhausted: bool,
}

impl Pixel {
    fn new() -> Self {
        Self { nominal: Way::START, ways: vec![Way::START], exhausted: false }
    }

    fn is_finished(&self) -> bool {
        self.nominal.finished && self.ways.iter().all(|way| way.finished)
    }

    fn add(&mut self, alphas: &Few, [nominal, least, greatest]: [[f64; 3]; 3], to: &Thresholds) {
        self.exhausted |= alphas.exhausted;
        self.nominal = self.nominal.behind(alphas.values[0], [nominal; 2], to);
        let mut ways: Vec<Way> = Vec::with_capacity(self.ways.len());
        for way in &self.ways {
            for &alpha in alphas.all() {
                let way = way.behind(alpha, [least, greatest], to);
                let alike = |other: &Way| other.finished == way.finished && other.transmittance == way.transmittance;
                match ways.iter().position(alike) {
                    Some(at) => ways[at].take_colors_of(&way),
                    None if ways.len() < MAX_WAYS => ways.push(way),
                    None => self.exhausted = true,
                }
            }
        }
        self.ways = ways;
    }

    /// The corners of the envelope, or `None` if the envelope is the binary64 result alone.
    fn alternatives(&self) -> Option<Vec<[f64; 4]>> {
        let nominal = self.nominal.rgba()[0];
        let (mut least, mut greatest) = (nominal, nominal);
        for rgba in self.ways.iter().flat_map(Way::rgba) {
            for c in 0..4 {
                least[c] = least[c].min(rgba[c]);
                greatest[c] = greatest[c].max(rgba[c]);
            }
        }
        (least != greatest).then(|| vec![least, greatest])
    }
}

/// Draws every Gaussian at every pixel in binary16, rows in parallel: volumes, sorted once for all pixels.
///
/// The alternatives of a pixel are the least and the greatest of each channel.
///
/// # Panics
/// If the state asks for discs, or for the per-pixel order.
pub fn render_binary16(scene: &OracleScene, camera: &OracleCamera, state: &OracleState) -> Reference {
    assert_eq!(state.geometry, OracleGeometry::Volume);
    assert_ne!(state.order, OracleOrder::PerPixel);
    let projected = Projected::new(scene, camera, state);
    let rounded = |splat| Rounded::new(splat, magnitude(scene.coefficients(splat.index)));
    let splats: Vec<Rounded> = projected.splats.iter().map(rounded).collect();
    let thresholds = Thresholds {
        alpha_floor: round(state.alpha_floor.into()),
        alpha_ceiling: round(state.alpha_ceiling.into()),
        transmittance_floor: round(state.transmittance_floor.into()),
    };
    let pixel = |x: u32, y: u32| {
        let mut pixel = Pixel::new();
        for splat in &splats {
            if pixel.is_finished() {
                break;
            }
            let alphas = splat.alpha(x, y, thresholds.alpha_ceiling);
            pixel.add(&alphas, splat.color, &thresholds);
        }
        pixel
    };
    let count = camera.width * camera.height;
    let pixels: Vec<Pixel> =
        (0..count).into_par_iter().map(|index| pixel(index % camera.width, index / camera.width)).collect();
    let with_alternatives = pixels.iter().map(Pixel::alternatives).enumerate();
    Reference {
        width: camera.width,
        height: camera.height,
        nominal: pixels.iter().map(|pixel| pixel.nominal.rgba()[0]).collect(),
        alternatives: with_alternatives.filter_map(|(index, alternatives)| Some((index, alternatives?))).collect(),
        slack: vec![0.0; pixels.len()],
        exhausted: pixels.iter().filter(|pixel| pixel.exhausted).count(),
        skips: projected.skips,
        undecidable_keys: 0,
    }
}
