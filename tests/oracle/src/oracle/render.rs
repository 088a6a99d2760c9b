//! Whole images: every Gaussian at every pixel, or only at the pixels that it can reach.

use std::collections::BTreeMap;
use std::ops::Range;

use rayon::prelude::*;

use super::error_model::PrecisionClass;
use super::own_axes::RayDepth;
use super::pixel::Pixel;
use super::project::project;
use super::rays;
use super::rules::FrontOfTies;
use super::splat::{Alpha, Splat};
use super::{OracleCamera, OracleOrder, OracleScene, OracleState, SkipCounts, SkipReason};

/// The margin, in px, that [`render_bounded`] adds around the ellipse on which alpha reaches its floor. It covers the
/// rounding of the bound itself.
const MARGIN: f64 = 2.0;

/// The reference picture of a draw: the binary64 image and all other outcomes of its undecidable pixels.
#[derive(Clone, Debug, PartialEq)]
pub struct Reference {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// The binary64 result, (C, 1 - T) premultiplied, row by row from the top.
    pub nominal: Vec<[f64; 4]>,
    /// The further outcomes of undecidable pixels, by index into `nominal`.
    pub alternatives: BTreeMap<usize, Vec<[f64; 4]>>,
    /// By how much each pixel's envelope is wider, per unit of the greatest colour: 0 with full precision.
    pub slack: Vec<f64>,
    /// Undecidable pixels where more decisions were met than are followed.
    pub exhausted: usize,
    /// Gaussians that were not drawn.
    pub skips: SkipCounts,
    /// Drawn Gaussians whose depth key could also be the next number.
    pub undecidable_keys: usize,
}

impl Reference {
    /// Every outcome of pixel `index`, the binary64 result first.
    pub fn outcomes(&self, index: usize) -> impl Iterator<Item = &[f64; 4]> {
        let alternatives = self.alternatives.get(&index).map_or(&[][..], Vec::as_slice);
        std::iter::once(&self.nominal[index]).chain(alternatives)
    }

    /// Least and greatest of each channel over all outcomes of pixel `index`.
    pub fn envelope(&self, index: usize) -> ([f64; 4], [f64; 4]) {
        let start = (self.nominal[index], self.nominal[index]);
        let (least, greatest) = self.outcomes(index).fold(start, |(least, greatest), rgba| {
            (std::array::from_fn(|c| least[c].min(rgba[c])), std::array::from_fn(|c| greatest[c].max(rgba[c])))
        });
        let slack = self.slack[index];
        (least.map(|c| c - slack), greatest.map(|c| c + slack))
    }

    /// Every outcome blended (`ONE`, `ONE_MINUS_SRC_ALPHA`) over `behind`, the pixels behind it.
    #[must_use]
    pub fn over(&self, behind: &[[f64; 4]]) -> Self {
        let blend =
            |index: usize, rgba: &[f64; 4]| std::array::from_fn(|c| rgba[c] + (1.0 - rgba[3]) * behind[index][c]);
        let alternatives = self.alternatives.iter();
        Self {
            nominal: (self.nominal.iter().enumerate()).map(|(index, rgba)| blend(index, rgba)).collect(),
            alternatives: alternatives
                .map(|(&index, outcomes)| {
                    let outcomes = outcomes.iter().map(|rgba| blend(index, rgba));
                    (index, outcomes.collect())
                })
                .collect(),
            ..self.clone()
        }
    }

    /// The binary64 image rounded to binary32.
    pub fn to_f32(&self) -> Vec<[f32; 4]> {
        self.nominal.iter().map(|rgba| rgba.map(|c| c as f32)).collect()
    }
}

/// Draws every Gaussian at every pixel: the definition itself, for small scenes.
pub fn render_literal(scene: &OracleScene, camera: &OracleCamera, state: &OracleState) -> Reference {
    let projected = Projected::new(scene, camera, state);
    if state.order == OracleOrder::PerPixel {
        return render_per_pixel(camera, state, &projected, |_, _| 0..camera.width);
    }
    let rows = (0..camera.height).map(|y| {
        let mut row = vec![Sorted::new(state); camera.width as usize];
        for (x, pixel) in (0..).zip(&mut row) {
            for splat in &projected.splats {
                pixel.add(splat, splat.alpha(x, y, state), state);
            }
        }
        row.into_iter().map(|pixel| pixel.finish(state)).collect()
    });
    let rows: Vec<Vec<Pixel>> = rows.collect();
    collect([camera.width, camera.height], &projected, || rows.iter().flatten())
}

/// Draws every Gaussian where its alpha can reach the floor, rows in parallel.
///
/// Gives the same bits as [`render_literal`]: the alphas that it skips are certainly below the floor.
pub fn render_bounded(scene: &OracleScene, camera: &OracleCamera, state: &OracleState) -> Reference {
    let projected = Projected::new(scene, camera, state);
    if state.order == OracleOrder::PerPixel {
        let bounds = bounds(&projected, state);
        return render_per_pixel(camera, state, &projected, |index, y| {
            if bounds[index].rows(camera.height).contains(&y) { bounds[index].columns(y, camera.width) } else { 0..0 }
        });
    }
    bounded(&projected, [camera.width, camera.height], state)
}

/// Draws projected Gaussians where their alphas can reach the floor.
pub(super) fn bounded(projected: &Projected, size: [u32; 2], state: &OracleState) -> Reference {
    let rows = bounded_pixels(projected, size, state);
    collect(size, projected, || rows.iter().flatten())
}

/// The bounds within which each splat's alpha can reach the floor.
fn bounds(projected: &Projected, state: &OracleState) -> Vec<Bound> {
    let splats = projected.splats.iter();
    splats.map(|splat| Bound::new(splat, state)).collect()
}

/// The rows of pixels that [`bounded`] draws.
pub(super) fn bounded_pixels(projected: &Projected, [width, height]: [u32; 2], state: &OracleState) -> Vec<Vec<Pixel>> {
    let bounds = bounds(projected, state);
    let mut members = vec![Vec::new(); height as usize];
    for (index, bound) in bounds.iter().enumerate() {
        for y in bound.rows(height) {
            members[y as usize].push(index);
        }
    }
    members
        .par_iter()
        .enumerate()
        .map(|(y, members)| {
            let y = y as u32;
            let mut row = vec![Sorted::new(state); width as usize];
            for &index in members {
                let splat = &projected.splats[index];
                for x in bounds[index].columns(y, width) {
                    let pixel = &mut row[x as usize];
                    if !pixel.is_finished() {
                        pixel.add(splat, splat.alpha(x, y, state), state);
                    }
                }
            }
            row.into_iter().map(|pixel| pixel.finish(state)).collect()
        })
        .collect()
}

/// A pixel to which Gaussians are added nearest first. Where keys have errors, it is composited in every order that they allow.
#[derive(Clone)]
struct Sorted<'a> {
    pixel: Pixel,
    /// The Gaussians that reach it, where keys have errors.
    reached: Option<Vec<(RayDepth, (&'a Splat, Alpha))>>,
}

impl<'a> Sorted<'a> {
    fn new(state: &OracleState) -> Self {
        let has_errors = state.rules.precision == PrecisionClass::Relaxed && state.order.has_keys();
        Self { pixel: Pixel::EMPTY, reached: has_errors.then(Vec::new) }
    }

    fn is_finished(&self) -> bool {
        self.pixel.is_finished()
    }

    /// Adds the next Gaussian.
    fn add(&mut self, splat: &'a Splat, alpha: Alpha, state: &OracleState) {
        let Some(reached) = &mut self.reached else {
            return self.pixel.add(splat, alpha, state);
        };
        if alpha.value + alpha.error >= f64::from(state.alpha_floor) {
            let depth = RayDepth { value: splat.key, error: splat.error.rounding().depth };
            reached.push((depth, (splat, alpha)));
        }
    }

    /// The pixel with all of them.
    fn finish(self, state: &OracleState) -> Pixel {
        let Some(reached) = self.reached else {
            return self.pixel;
        };
        rays::composite(
            &reached,
            |(a, _), (b, _)| a.has_key_of(b),
            |pixel, (splat, alpha)| pixel.add(splat, *alpha, state),
        )
    }
}

/// Draws in the per-pixel order: every Gaussian, by its index, in those columns of a row that it may reach.
fn render_per_pixel(
    camera: &OracleCamera,
    state: &OracleState,
    projected: &Projected,
    columns: impl Fn(usize, u32) -> Range<u32> + Sync,
) -> Reference {
    let row = |y: u32| {
        let mut row = vec![Vec::new(); camera.width as usize];
        for (index, splat) in projected.splats.iter().enumerate() {
            for x in columns(index, y) {
                let alpha = splat.alpha(x, y, state);
                if alpha.value + alpha.error >= f64::from(state.alpha_floor) {
                    let center = [f64::from(x) + 0.5, f64::from(y) + 0.5];
                    let depth = splat.own_axes.depth(camera, center);
                    row[x as usize].push((depth, (splat, alpha)));
                }
            }
        }
        row.into_iter().map(|reached| {
            rays::composite(&reached, |_, _| false, |pixel, (splat, alpha)| pixel.add(splat, *alpha, state))
        })
    };
    let pixels: Vec<Pixel> = (0..camera.height).into_par_iter().flat_map_iter(row).collect();
    collect([camera.width, camera.height], projected, || pixels.iter())
}

/// The Gaussians that are drawn, nearest first, and the counts of the others.
pub(super) struct Projected {
    pub(super) splats: Vec<Splat>,
    pub(super) skips: SkipCounts,
}

impl Projected {
    pub(super) fn new(scene: &OracleScene, camera: &OracleCamera, state: &OracleState) -> Self {
        Self::sort((0..scene.len()).map(|index| project(scene, camera, state, index)), state)
    }

    /// The drawable Gaussians of `all`, sorted. `all` is in primitive order.
    pub(super) fn sort(all: impl Iterator<Item = Result<Splat, SkipReason>>, state: &OracleState) -> Self {
        let mut skips = SkipCounts::default();
        let mut splats = Vec::new();
        for (index, one) in all.enumerate() {
            match one {
                Ok(splat) => splats.push(Splat { index, ..splat }),
                Err(reason) => skips.count(reason),
            }
        }
        if state.rules.front_of_ties == FrontOfTies::Last && state.order.has_keys() {
            splats.reverse();
        }
        // Stable, so that ties stay in primitive order.
        splats.sort_by(|a, b| a.key.total_cmp(&b.key));
        Self { splats, skips }
    }
}

pub(super) fn collect<'a, I: Iterator<Item = &'a Pixel>>(
    [width, height]: [u32; 2],
    projected: &Projected,
    pixels: impl Fn() -> I,
) -> Reference {
    Reference {
        width,
        height,
        nominal: pixels().map(Pixel::rgba).collect(),
        alternatives: pixels()
            .map(Pixel::alternatives)
            .enumerate()
            .filter(|(_, alternatives)| !alternatives.is_empty())
            .collect(),
        slack: pixels().map(Pixel::slack).collect(),
        exhausted: pixels().filter(|pixel| pixel.is_exhausted()).count(),
        skips: projected.skips,
        undecidable_keys: projected.splats.iter().filter(|splat| splat.key_undecidable).count(),
    }
}

/// The ellipse outside which a Gaussian's alpha is certainly below the floor.
pub(super) struct Bound {
    mean: [f64; 2],
    covariance: [f64; 3],
    determinant: f64,
    /// True if the picture repeats, so that the Gaussian has copies to the left and right.
    repeats: bool,
    /// The quadratic form on the ellipse; negative if there is no ellipse, infinite if the whole plane is inside.
    q: f64,
    /// For a disc: left, right, top and bottom, in place of the ellipse.
    rectangle: Option<[f64; 4]>,
}

impl Bound {
    pub(super) fn new(splat: &Splat, state: &OracleState) -> Self {
        // A pixel can only count if opacity exp(-q / 2) (1 + error) >= floor, hence q <= level + 2 ln(1 + error). The
        // error is at most 1, which bounds q; that q in turn bounds the error.
        let level = 2.0 * (splat.opacity / f64::from(state.alpha_floor)).ln();
        let furthest = (level + 2.0 * std::f64::consts::LN_2).max(0.0);
        let error = splat.error.alpha_up_to(furthest, splat.covariance, splat.determinant);
        let q = level + 2.0 * error.ln_1p();
        Self {
            mean: splat.mean,
            covariance: splat.covariance,
            determinant: splat.determinant,
            repeats: splat.period != f64::INFINITY,
            rectangle: splat.surfel.map(|surfel| surfel.bounds(furthest)),
            q: if splat.surfel.is_some() {
                level + 2.0 * std::f64::consts::LN_2
            } else if q.is_finite() {
                q + 1e-9 * (1.0 + q.abs())
            } else {
                q
            },
        }
    }

    /// Rows of pixels that the ellipse and its margin reach.
    pub(super) fn rows(&self, height: u32) -> Range<u32> {
        if self.q < 0.0 {
            return 0..0;
        }
        if let Some([_, _, top, bottom]) = self.rectangle {
            return self.pixels(0.5 * (top + bottom), 0.5 * (bottom - top), height);
        }
        self.pixels(self.mean[1], (self.q * self.covariance[2]).sqrt(), height)
    }

    /// Pixels of row `y` that the ellipse and its margin reach.
    pub(super) fn columns(&self, y: u32, width: u32) -> Range<u32> {
        if self.repeats {
            return 0..width;
        }
        if let Some([left, right, ..]) = self.rectangle {
            return self.pixels(0.5 * (left + right), 0.5 * (right - left), width);
        }
        let [_, xy, yy] = self.covariance;
        let dy = f64::from(y) + 0.5 - self.mean[1];
        let centre = self.mean[0] + xy / yy * dy;
        let left = (self.q - dy * dy / yy).max(0.0);
        self.pixels(centre, (self.determinant / yy * left).sqrt(), width)
    }

    /// The pixels within `reach` and the margin of `centre`, of `count` pixels.
    fn pixels(&self, centre: f64, reach: f64, count: u32) -> Range<u32> {
        let reach = reach + MARGIN + 1e-9 * (centre.abs() + reach);
        if reach.is_nan() {
            return 0..count;
        }
        // Conversions saturate, at 0 too.
        let first = (centre - reach).floor() as u32;
        let end = (centre + reach).ceil() as u32;
        first.min(count)..end.min(count)
    }
}
