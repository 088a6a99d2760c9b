//! What becomes of projected Gaussians: why some are skipped after all, which tiles the others reach, their colours and keys.
use super::fetch::{BATCH, COEFFICIENT_FLOATS, CoefficientReader};
use super::footprint::{Ellipse, Reach, Span};
use super::panorama;
use super::project::{LN_2, Projection, Source};
use super::rays::{self, RayDepth};
use super::scratch::Scratch;
use super::sort::ordered_bits;
use super::spherical_harmonics::{Bases, DIRECTIONS};
use super::splat::{Projected, Splat};
use super::surfel::{Placed, Surfel};
use crate::counters::Counter;
use crate::packet::{GaussianGeometry, GaussianOrder};
use crate::skips::Skip;
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
    fn surfel(
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

    /// Why a kept Gaussian is skipped after all, by what does not depend on tiles and colours.
    #[inline(always)]
    fn why_skipped(&self, at: usize, scratch: &Scratch) -> Option<Counter> {
        let z = scratch.depth[at] as f32;
        let determinant = scratch.flat.determinant[at];
        // What is not a number is nowhere.
        if z.is_nan() || z <= self.near {
            Some(Counter::SkippedNear)
        } else if z >= self.far {
            Some(Counter::SkippedFar)
        } else if self.geometry == GaussianGeometry::Volume
            && !(determinant > 0.0 && determinant.is_finite())
        {
            Some(Counter::SkippedDegenerate)
        } else {
            None
        }
    }

    /// Finds the kept Gaussians that reach a tile.
    #[inline(always)]
    pub(super) fn find_tiles(&self, scratch: &mut Scratch, out: &mut Projected) {
        let mut beside = self.skips.has(Skip::Ellipse).then_some(0);
        scratch.reached.clear();
        scratch.copies.clear();
        let is_flat = self.geometry == GaussianGeometry::Surfel;
        for at in 0..scratch.lanes.len().min(BATCH) {
            if let Some(reason) = self.why_skipped(at, scratch) {
                out.counters.add(reason, 1);
                continue;
            }
            if is_flat {
                match self.surfel(at, scratch, &mut out.spans).1 {
                    Some(reach) => scratch.reached.push((at, reach)),
                    None => out.counters.add(Counter::SkippedOffScreen, 1),
                }
                continue;
            }
            let flat = &*scratch.flat;
            let ellipse = Ellipse {
                mean: [flat.mean[0][at], flat.mean[1][at]],
                half: [flat.half[0][at], flat.half[1][at]],
                slope: flat.slope[at],
                narrowing: flat.narrowing[at],
                peak: flat.peak[at],
            };
            let mut reach = None;
            // The square root of a negative extent is not a number.
            if ellipse.half[1] >= 0.0 {
                reach = match self.period {
                    None => ellipse.reach(&self.visible, &mut out.spans, beside.as_mut()),
                    Some(period) => {
                        let (visible, copies) = (&self.visible, &mut scratch.copies);
                        panorama::reach(at, &ellipse, period, visible, copies, out, beside.as_mut())
                    }
                };
            }
            match reach {
                Some(reach) => scratch.reached.push((at, reach)),
                None => out.counters.add(Counter::SkippedOffScreen, 1),
            }
        }
        let beside = beside.unwrap_or_default();
        out.counters.add(Counter::TilesBesideEllipse, beside);
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
        self.find_tiles(scratch, out);
        let reader = CoefficientReader::new(&source.streams.spherical_harmonics);
        let mut coefficients = [[0.0; COEFFICIENT_FLOATS]; DIRECTIONS];
        let (mut directions, mut bases) = ([[0.0; DIRECTIONS]; 3], Bases::default());
        let mut copies = &*scratch.copies;
        for group in scratch.reached.chunks(DIRECTIONS) {
            // Reading several at a time overlaps the waits for memory.
            for (&(at, _), coefficients) in group.iter().zip(&mut coefficients) {
                let (lane, floats) = (scratch.lanes[at], reader.floats());
                match source.harmonics.of(lane, floats) {
                    Some(read) if floats > 0 => coefficients[..floats].copy_from_slice(read),
                    _ => reader.read(&source.batch, lane, coefficients),
                }
            }
            for (parts, lanes) in directions.iter_mut().zip(&scratch.flat.direction) {
                for (part, &(at, _)) in parts.iter_mut().zip(group) {
                    *part = lanes[at % BATCH] as f32;
                }
            }
            let degree = self.degree_in(source, &directions, out);
            bases.find(simd, degree, &directions);
            for (number, &(at, reach)) in group.iter().enumerate() {
                let at = at % BATCH;
                let flat = &*scratch.flat;
                let coefficients = &coefficients[number % DIRECTIONS];
                let Some(color) = bases.color(simd, degree, number, coefficients) else {
                    out.counters.add(Counter::SkippedNonFinite, 1);
                    continue;
                };
                let sequence = sequence(scratch.lanes[at]);
                out.keys.push([self.key(at, sequence, scratch), sequence]);
                let depth = self.center_depth(at, scratch);
                let wide = self
                    .period
                    .is_some_and(|period| 2.0 * flat.half[0][at] >= period);
                let splat = Splat::new(flat, at, color, depth);
                out.splats.push(Splat {
                    steep: wide || splat.steep,
                    wide,
                    ..splat
                });
                out.reaches.push(reach);
                if self.geometry == GaussianGeometry::Surfel {
                    let (surfel, _) = self.surfel(at, scratch, &mut Vec::new());
                    out.surfels.push(surfel);
                }
                if self.order == GaussianOrder::PerPixel {
                    out.ray_depths.push(self.ray_depth(at, scratch));
                }
                if let Some(period) = self.period {
                    panorama::copy_last(at, period, &mut copies, out);
                }
            }
        }
        let counters = &mut out.counters;
        counters.add(Counter::GaussiansDrawn, out.splats.len() as u64);
        if self.skips.has(Skip::Harmonics) {
            let unread = source.batch.len - scratch.reached.len();
            counters.add(Counter::HarmonicsUnread, unread as u64);
        }
    }
}
