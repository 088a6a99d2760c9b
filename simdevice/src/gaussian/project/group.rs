//! The projection of a group: from attributes to the rasterizer's nine numbers, with tiles, colours and keys. Spherical harmonics
//! are read only for Gaussians that reach a tile.

use super::color::{ColoredLane, color, normalize, normalize_wide, toward};
use super::covariance::to_screen;
use super::keys::find_keys;
use super::panorama;
use super::scratch::Scratch;
use super::surfel::surfel_of;
use super::tiles::find_tiles;
use crate::gaussian::lanes::{Bits, GROUP};
use crate::gaussian::read::group::{GroupAttributes, Sequence};
use crate::gaussian::spherical_harmonics::{Bases, COEFFICIENT_FLOATS, DIRECTIONS, MAX_COEFFICIENTS};
use crate::gaussian::splats::group::ProjectedGroup;
use crate::gaussian::splats::identity::Identity;
use crate::gaussian::splats::ray_depth::RayDepth;
use crate::gaussian::splats::splat::Splat;
use crate::gaussian::view::constants::ViewConstants;
use crate::state::gaussian::{CameraModel, GaussianGeometry, GaussianOrder, GaussianPrecision};
use crate::stats::counters::Counter;
use crate::stats::optimizations::Optimization;
use fearless_simd::Simd;

/// Projects the `kept` Gaussians of a group and appends the result to `projected`.
#[inline(always)]
pub(crate) fn project<S: Simd>(
    view: &ViewConstants,
    simd: S,
    group: &GroupAttributes<'_>,
    kept: &Bits,
    scratch: &mut Scratch,
    sequence: Sequence<'_>,
    projected: &mut ProjectedGroup,
) {
    // In simple modes lanes that were culled are projected, too: that is cheap, and the results are not used.
    let is_plain = view.model == CameraModel::Pinhole
        && view.lens.is_none()
        && view.geometry == GaussianGeometry::Volume
        && view.precision == GaussianPrecision::Float32
        && group.matrices.is_none()
        && !view.unscented;
    scratch.gather(group.attributes, kept, group.vertices.len, is_plain);
    if let Some(matrices) = group.matrices {
        scratch.gather_matrices(matrices);
    }
    to_screen(view, simd, group, scratch);
    emit(view, simd, group, scratch, sequence, projected);
}

/// Finds the tiles and colours of the kept Gaussians and appends those that reach a tile to `projected`.
#[inline(always)]
pub(crate) fn emit<S: Simd>(
    view: &ViewConstants,
    simd: S,
    group: &GroupAttributes<'_>,
    scratch: &mut Scratch,
    sequence: Sequence<'_>,
    projected: &mut ProjectedGroup,
) {
    projected.reserve(scratch.lanes.len());
    find_tiles(view, simd, scratch, projected);
    find_keys(view, sequence, scratch);
    let degree = view.sh_degree;
    let toward = toward(group, scratch);
    // Elements without a Gaussian have a direction too, so that they do not look like one without.
    let (mut directions, mut bases) = ([[1.0; DIRECTIONS]; 3], Bases::default());
    let mut read = [0.0; COEFFICIENT_FLOATS];
    let mut copies = &*scratch.copies;
    for batch in scratch.reached.chunks(DIRECTIONS) {
        for (parts, lanes) in directions.iter_mut().zip(toward) {
            for (part, &at) in parts.iter_mut().zip(batch) {
                *part = lanes[at % GROUP] as f32;
            }
        }
        if !normalize(simd, &mut directions) {
            normalize_wide(toward, batch, &mut directions);
        }
        bases.find(simd, degree, &directions);
        // All colours are computed first, so that their reads from memory overlap.
        let lanes = &*scratch.lanes;
        let colored = match degree {
            0 => color::<S, 1>(simd, group, lanes, batch, &bases, &mut read),
            1 => color::<S, 4>(simd, group, lanes, batch, &bases, &mut read),
            2 => color::<S, 9>(simd, group, lanes, batch, &bases, &mut read),
            3 => color::<S, 16>(simd, group, lanes, batch, &bases, &mut read),
            _ => color::<S, MAX_COEFFICIENTS>(simd, group, lanes, batch, &bases, &mut read),
        };
        let uncolored = batch.len() - colored.all().len();
        projected.counters.add(Counter::SkippedNonFinite, uncolored as u64);
        let Some(period) = view.period else {
            append(view, colored.all(), scratch, projected);
            continue;
        };
        for one in colored.all() {
            append(view, std::slice::from_ref(one), scratch, projected);
            panorama::copy_last(one.at, period, &mut copies, projected);
        }
    }
    let counters = &mut projected.counters;
    counters.add(Counter::GaussiansDrawn, projected.splats.len() as u64);
    if view.optimizations.has(Optimization::Harmonics) {
        let unread = group.vertices.len - scratch.reached.len();
        counters.add(Counter::HarmonicsUnread, unread as u64);
    }
}

/// Appends kept lanes and their colours to `projected`.
#[inline(always)]
fn append(view: &ViewConstants, lanes: &[ColoredLane], scratch: &Scratch, projected: &mut ProjectedGroup) {
    // Iterators of known length append without checking the capacity each time.
    let [keys, sequences] = &*scratch.keys;
    let keys = lanes.iter().map(|one| [keys[one.at], sequences[one.at]]);
    projected.keys.extend(keys);
    let splats = lanes.iter().map(
        #[inline(always)]
        |one| splat(view, one, scratch),
    );
    match view.period {
        None => projected.splats.extend(splats),
        Some(period) => projected.splats.extend(lanes.iter().zip(splats).map(|(one, splat)| {
            let wide = 2.0 * scratch.screen.ellipse(one.at).half[0] >= period;
            Splat { needs_f64: wide || splat.needs_f64, exceeds_period: wide, ..splat }
        })),
    }
    let reaches = lanes.iter().map(|one| scratch.reaches.get(one.at));
    projected.reaches.extend(reaches);
    if view.geometry == GaussianGeometry::Surfel {
        let surfels = lanes.iter().map(|one| surfel_of(view, one.at, scratch));
        projected.surfels.extend(surfels);
    }
    if view.order == GaussianOrder::PerPixel {
        let depths = lanes.iter().map(|one| ray_depth(view, one.at, scratch));
        projected.ray_depths.extend(depths);
    }
    if view.is_tracked {
        let identities = lanes.iter().map(|one| Identity::new(scratch.depth[one.at], sequences[one.at]));
        projected.identities.extend(identities);
    }
}

/// The splat of a coloured lane.
#[inline(always)]
fn splat(view: &ViewConstants, lane: &ColoredLane, scratch: &Scratch) -> Splat {
    let [red, green, blue, _] = lane.color;
    let depth = center_depth(view, lane.at, scratch);
    scratch.screen.splat(lane.at, [red, green, blue], depth)
}

/// A kept lane's depth in the encoding of the depth attachment.
#[inline(always)]
fn center_depth(view: &ViewConstants, at: usize, scratch: &Scratch) -> u32 {
    view.depth.map_or(0, |depth| depth.code(scratch.depth[at] as f32))
}

/// The inputs for a kept lane's depth along a pixel's ray.
fn ray_depth(view: &ViewConstants, at: usize, scratch: &Scratch) -> RayDepth {
    let [w, x, y, z] = &*scratch.rotation;
    let [sx, sy, sz] = &*scratch.scale;
    let [dx, dy, dz] = &*scratch.offset;
    RayDepth::new(&view.rotation, [w[at], x[at], y[at], z[at]], [sx[at], sy[at], sz[at]], [dx[at], dy[at], dz[at]])
}
