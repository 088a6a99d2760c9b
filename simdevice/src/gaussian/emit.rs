//! What becomes of projected Gaussians that reach tiles: their colours and keys.

use super::fetch::{BATCH, COEFFICIENT_FLOATS};
use super::footprint::{Reach, Span};
use super::panorama;
use super::project::{LN_2, Projection, Source};
use super::rays::{self, RayDepth};
use super::scratch::Scratch;
use super::sort::ordered_bits;
use super::spherical_harmonics::{Bases, DIRECTIONS, coefficient_count};
use super::splat::{Projected, Splat};
use super::surfel::{Placed, Surfel};
use crate::state::gaussian::{GaussianGeometry, GaussianOrder};
use crate::stats::counters::Counter;
use crate::stats::optimizations::Skip;
use fearless_simd::Simd;

impl Projection {
    /// A kept lane's depth as the attachment holds it.
    #[inline(always)]
    fn center_depth(&self, at: usize, scratch: &Scratch) -> u32 {
        self.depth
            .map_or(0, |depth| depth.code(scratch.depth[at] as f32))
    }

    /// What a kept lane is sorted by.
    #[inline(always)]
    fn key(&self, at: usize, sequence: u32, scratch: &Scratch) -> u32 {
        let depth = match self.order {
            GaussianOrder::ViewDepth => scratch.depth[at],
            GaussianOrder::RadialDistance => {
                let [x, y, z] = &*scratch.offset;
                (x[at] * x[at] + y[at] * y[at] + z[at] * z[at]).sqrt()
            }
            // Pixels sort later, and take the order of the draw for equal depths.
            GaussianOrder::Primitive | GaussianOrder::PerPixel => return sequence,
        };
        ordered_bits(depth as f32)
    }

    /// What a kept lane is sorted by at a pixel.
    fn ray_depth(&self, at: usize, scratch: &Scratch) -> RayDepth {
        let [w, x, y, z] = &*scratch.rotation;
        let [sx, sy, sz] = &*scratch.scale;
        let [dx, dy, dz] = &*scratch.offset;
        RayDepth::new(
            &self.rotation,
            [w[at], x[at], y[at], z[at]],
            [sx[at], sy[at], sz[at]],
            [dx[at], dy[at], dz[at]],
        )
    }

    /// A kept lane as a 2D Gaussian, and the tiles that it reaches, if there are any.
    pub(super) fn surfel(
        &self,
        at: usize,
        scratch: &Scratch,
        spans: &mut Vec<Span>,
    ) -> (Surfel, Option<Reach>) {
        let [w, x, y, z] = &*scratch.rotation;
        let axes = rays::axes([w[at], x[at], y[at], z[at]]);
        let r = &self.rotation;
        let placed = |axis: usize| {
            let [x, y, z] = axes[axis].map(|c| c * scratch.scale[axis][at]);
            [0, 1, 2].map(|row| x * r[3 * row] + y * r[3 * row + 1] + z * r[3 * row + 2])
        };
        let [x, y, z] = &*scratch.camera;
        let mut surfel = Surfel::new(&Placed {
            model: self.model,
            focal: self.focal,
            near: self.near.into(),
            axes: [placed(0), placed(1)],
            centre: [x[at], y[at], z[at]],
        });
        let flat = &*scratch.flat;
        // As wide as for volumes: see there.
        let room = flat.log2_opacity[at] - self.log2_floor;
        let extent = (room + room.abs() * 1e-5 + 1e-3) * (2.0 * LN_2);
        let mean = [flat.mean[0][at], flat.mean[1][at]];
        let reach = surfel.reach(mean, (extent, self.low_pass), &self.visible, spans);
        (surfel, reach)
    }

    /// The degree up to which spherical harmonics of a batch make a difference in some directions.
    #[inline(always)]
    fn degree_in(
        &self,
        source: &Source<'_>,
        directions: &[[f32; DIRECTIONS]; 3],
        out: &mut Projected,
    ) -> u32 {
        if source.degree >= self.sh_degree || !self.skips.has(Skip::Bands) {
            return self.sh_degree;
        }
        // Nothing makes zero of what is not a number.
        if directions.as_flattened().iter().any(|part| part.is_nan()) {
            return self.sh_degree;
        }
        out.counters.add(Counter::BandsOfZeros, DIRECTIONS as u64);
        source.degree
    }

    /// Finds the tiles and the colour of the kept Gaussians and appends what reaches a tile to `out`.
    #[inline(always)]
    pub(super) fn emit<S: Simd>(
        &self,
        simd: S,
        source: &Source<'_>,
        scratch: &mut Scratch,
        sequence: impl Fn(usize) -> u32,
        out: &mut Projected,
    ) {
        out.reserve(scratch.lanes.len());
        self.find_tiles(simd, scratch, out);
        let reader = &source.reader;
        let floats = reader.floats();
        let mut read = [0.0; COEFFICIENT_FLOATS];
        let (mut directions, mut bases) = ([[0.0; DIRECTIONS]; 3], Bases::default());
        let mut copies = &*scratch.copies;
        for group in scratch.reached.chunks(DIRECTIONS) {
            for (parts, lanes) in directions.iter_mut().zip(&scratch.flat.direction) {
                for (part, &at) in parts.iter_mut().zip(group) {
                    *part = lanes[at % BATCH] as f32;
                }
            }
            let degree = self.degree_in(source, &directions, out);
            bases.find(simd, degree, &directions);
            let needed = 3 * coefficient_count(degree) + 1;
            let is_whole = floats + 1 >= needed;
            // All colours come first: what they wait for memory overlaps then.
            let mut colored = Colored::default();
            for (number, &at) in group.iter().enumerate() {
                let lane = scratch.lanes[at % BATCH];
                let rest = source.harmonics.from(lane);
                let coefficients = if is_whole && rest.len() >= needed {
                    rest
                } else {
                    match rest.get(..floats) {
                        Some(last) if floats > 0 => read[..floats].copy_from_slice(last),
                        _ => reader.read(&source.batch, lane, &mut read),
                    }
                    &read
                };
                match bases.color(simd, degree, number, coefficients) {
                    Some(color) => colored.push(at, color),
                    None => out.counters.add(Counter::SkippedNonFinite, 1),
                }
            }
            let Some(period) = self.period else {
                self.append(colored.all(), scratch, &sequence, out);
                continue;
            };
            for one in colored.all() {
                self.append(std::slice::from_ref(one), scratch, &sequence, out);
                panorama::copy_last(one.at, period, &mut copies, out);
            }
        }
        let counters = &mut out.counters;
        counters.add(Counter::GaussiansDrawn, out.splats.len() as u64);
        if self.skips.has(Skip::Harmonics) {
            let unread = source.batch.len - scratch.reached.len();
            counters.add(Counter::HarmonicsUnread, unread as u64);
        }
    }

    /// Appends kept lanes and their colours to `out`.
    #[inline(always)]
    fn append(
        &self,
        lanes: &[ColoredLane],
        scratch: &Scratch,
        sequence: &impl Fn(usize) -> u32,
        out: &mut Projected,
    ) {
        // Iterators that know their lengths write without a look at the room that there is.
        out.keys.extend(lanes.iter().map(|one| {
            let sequence = sequence(scratch.lanes[one.at % BATCH]);
            [self.key(one.at, sequence, scratch), sequence]
        }));
        out.splats.extend(lanes.iter().map(|one| {
            let depth = self.center_depth(one.at, scratch);
            let wide = self
                .period
                .is_some_and(|period| 2.0 * scratch.flat.half[0][one.at] >= period);
            let splat = Splat::new(&scratch.flat, one.at, one.color, depth);
            Splat {
                steep: wide || splat.steep,
                wide,
                ..splat
            }
        }));
        let reaches = lanes.iter().map(|one| scratch.reaches.get(one.at));
        out.reaches.extend(reaches);
        if self.geometry == GaussianGeometry::Surfel {
            let surfels = lanes
                .iter()
                .map(|one| self.surfel(one.at, scratch, &mut Vec::new()).0);
            out.surfels.extend(surfels);
        }
        if self.order == GaussianOrder::PerPixel {
            let depths = lanes.iter().map(|one| self.ray_depth(one.at, scratch));
            out.ray_depths.extend(depths);
        }
    }
}

/// A kept lane and its colour.
#[derive(Clone, Copy, Debug, Default)]
struct ColoredLane {
    at: usize,
    color: [f32; 3],
}

/// Those of some directions.
#[derive(Default)]
struct Colored {
    lanes: [ColoredLane; DIRECTIONS],
    len: usize,
}

impl Colored {
    #[inline(always)]
    fn push(&mut self, at: usize, color: [f32; 3]) {
        self.lanes[self.len % DIRECTIONS] = ColoredLane {
            at: at % BATCH,
            color,
        };
        self.len += 1;
    }

    #[inline(always)]
    fn all(&self) -> &[ColoredLane] {
        &self.lanes[..self.len.min(DIRECTIONS)]
    }
}
