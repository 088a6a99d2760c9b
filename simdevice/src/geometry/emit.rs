//! What set-up hands to the rasterizer: shapes in the framebuffer, their vertices' varyings, and their bins.

use super::bins::{Pixels, bin};
use super::clip::ClipVertex;
use super::primitive::{Primitive, PrimitiveKind};
use super::setup::{Current, Job, NONE, Origin, Place, cross};
use super::viewport::{ONE, Projected, snap_away, snap_length};
use crate::limits::{MAX_LINE_WIDTH, MAX_POINT_SIZE};
use crate::program::interface::Interpolation;
use crate::simd::{both, three};
use devmem::host;

/// Offsets of what snapping has not moved.
const UNMOVED: [[i16; 2]; 3] = [[0; 2]; 3];
/// The units of [`Primitive::offsets`] in a pixel.
const OFFSET_UNITS: f64 = 16_777_216.0;

/// A primitive's outline.
struct Shape {
    kind: PrimitiveKind,
    corners: [[i32; 2]; 3],
    /// As [`Primitive::offsets`].
    offsets: [[i16; 2]; 3],
    /// At the vertices.
    depth: [f32; 3],
    /// What it may cover.
    pixels: Pixels,
}

impl Job<'_> {
    #[inline(always)]
    pub(super) fn push_triangle(&mut self, current: &Current, places: [Place; 3], area: i64) {
        let [a, b, c] = places;
        let places = nearest_first(if area > 0 { [a, b, c] } else { [a, c, b] });
        let corners = three(places, |place| place.projected.snapped);
        let Some(pixels) = self.pixels(current, &corners) else {
            return;
        };
        if self.setup.state.samples == 1 && covers_nothing(&corners, pixels) {
            return;
        }
        let bias = self.bias(places);
        let shape = Shape {
            kind: PrimitiveKind::Triangle,
            corners,
            offsets: offsets(places),
            depth: three(places, |place| place.projected.depth + bias),
            pixels,
        };
        self.push(current, &shape, places);
    }

    pub(super) fn push_line(&mut self, current: &Current, from: Place, to: Place, bias: f32) {
        let (a, b) = (from.projected.window, to.projected.window);
        let (dx, dy) = (a[0] - b[0], a[1] - b[1]);
        let length = (dx * dx + dy * dy).sqrt();
        if length.is_nan() || length <= 0.0 {
            return;
        }
        let scale = 0.5 * self.setup.state.line_width.clamp(0.0, MAX_LINE_WIDTH) / length;
        let side = [snap_length(-dy * scale), snap_length(dx * scale)];
        let (a, b) = (a.map(snap_away), b.map(snap_away));
        let corners = [
            [a[0] - side[0], a[1] - side[1]],
            [a[0] + side[0], a[1] + side[1]],
            [b[0] + side[0], b[1] + side[1]],
        ];
        if cross(corners) <= 0 {
            return;
        }
        let last = [b[0] - side[0], b[1] - side[1]];
        let [c0, c1, c2] = corners;
        if let Some(pixels) = self.pixels(current, &[c0, c1, c2, last]) {
            let places = [from, from, to];
            let shape = Shape {
                kind: PrimitiveKind::Line,
                corners,
                offsets: UNMOVED,
                depth: places.map(|place| place.projected.depth + bias),
                pixels,
            };
            self.push(current, &shape, places);
        }
    }

    pub(super) fn push_point(&mut self, current: &Current, place: Place, size: f32, bias: f32) {
        let size = if size.is_nan() {
            1.0
        } else {
            size.clamp(0.0, MAX_POINT_SIZE)
        };
        let side = snap_length(size).max(ONE);
        let [x, y] = place.projected.window.map(|at| snap_away(at) - side / 2);
        let corners = [[x, y], [x + side, y], [x + side, y + side]];
        if let Some(pixels) = self.pixels(current, &corners) {
            let shape = Shape {
                kind: PrimitiveKind::Point,
                corners,
                offsets: UNMOVED,
                depth: [place.projected.depth + bias; 3],
                pixels,
            };
            self.push(current, &shape, [place; 3]);
        }
    }

    /// The pixels that may have a sample within the bounds of these corners, where they may be drawn to.
    #[inline(always)]
    fn pixels(&self, current: &Current, corners: &[[i32; 2]]) -> Option<Pixels> {
        // Where samples lie within a pixel: the least and the greatest coordinate.
        let (low, high) = if self.setup.state.samples == 1 {
            (128, 128)
        } else {
            (32, 224)
        };
        let region = &self.setup.regions[usize::from(current.viewport)];
        let along = |axis: usize, start: i32, length: u32| {
            let (mut least, mut greatest) = (i32::MAX, i32::MIN);
            for corner in corners {
                least = least.min(corner[axis]);
                greatest = greatest.max(corner[axis]);
            }
            // Right and bottom edges cover nothing.
            let first = (least - high + ONE - 1) >> 8;
            let last = (greatest - 1 - low) >> 8;
            let end = i64::from(start) + i64::from(length) - 1;
            let last = i64::from(last).min(end);
            [first.max(start), last as i32]
        };
        let pixels = Pixels {
            x: along(0, region.x, region.width),
            y: along(1, region.y, region.height),
        };
        (pixels.x[0] <= pixels.x[1] && pixels.y[0] <= pixels.y[1]).then_some(pixels)
    }

    #[inline(always)]
    fn push(&mut self, current: &Current, shape: &Shape, places: [Place; 3]) {
        let vertices = three(places, |place| self.number(place.origin));
        let provoking = self.number(Origin::Slot(current.provoking));
        let primitive = Primitive {
            corners: shape.corners,
            offsets: shape.offsets,
            depth: shape.depth,
            inverse_w: three(places, |place| place.projected.inverse_w),
            vertices,
            provoking,
            id: current.id,
            kind: shape.kind,
            front: current.front,
            viewport: current.viewport,
            layer: current.layer,
        };
        let number = self.out.primitives.len() as u32;
        bin(
            &self.setup.grid,
            &primitive,
            number,
            shape.pixels,
            &mut self.out.pairs,
        );
        host::push(&mut self.out.primitives, primitive);
    }

    /// The number of a vertex in the output, which it enters when it is first asked for.
    #[inline(always)]
    fn number(&mut self, origin: Origin) -> u32 {
        let slot = match origin {
            Origin::Slot(slot) => slot as usize,
            Origin::New { number } => return number,
        };
        if self.numbers[slot] == NONE {
            self.numbers[slot] = self.out.vertices;
            self.out.vertices += 1;
            let per_vertex = self.setup.outputs.varyings.len();
            let varyings = &self.shaded.varyings[slot * per_vertex..][..per_vertex];
            host::extend(&mut self.out.varyings, varyings);
        }
        self.numbers[slot]
    }

    /// Makes a vertex that clipping found, and puts its varyings into the output.
    pub(super) fn new_vertex(&mut self, current: &Current, vertex: &ClipVertex) -> Origin {
        let number = self.out.vertices;
        self.out.vertices += 1;
        let weights = vertex.weights;
        // Weights in the framebuffer are those in clip space times w, made to add up to 1 again.
        let mut linear = weights;
        for (weight, slot) in linear.iter_mut().zip(current.slots) {
            *weight *= f64::from(self.shaded.vertices[slot as usize].position[3]);
        }
        let sum: f64 = linear.iter().sum();
        let linear = linear.map(|weight| weight / sum);
        let interpolation = &self.setup.outputs.interpolation;
        let per_vertex = interpolation.len();
        let of =
            |slot: u32, varying: usize| self.shaded.varyings[slot as usize * per_vertex + varying];
        for (varying, interpolation) in interpolation.iter().enumerate() {
            let mix = |weights: [f64; 3]| {
                let part = |corner: usize| {
                    // A corner that has no part in it must not spoil it by being infinite.
                    if weights[corner] == 0.0 {
                        return 0.0;
                    }
                    let value = f32::from_bits(of(current.slots[corner], varying));
                    weights[corner] * f64::from(value)
                };
                ((part(0) + part(1) + part(2)) as f32).to_bits()
            };
            let value = match interpolation {
                Interpolation::Perspective => mix(weights),
                Interpolation::Linear => mix(linear),
                Interpolation::Flat => of(current.provoking, varying),
            };
            host::push(&mut self.out.varyings, value);
        }
        Origin::New { number }
    }
}

/// Turned so that no vertex is nearer than the first. What varies is found as its value there and what others add: a far
/// vertex may have a value so great that too little is left of the sum near the eye.
#[inline(always)]
fn nearest_first([a, b, c]: [Place<'_>; 3]) -> [Place<'_>; 3] {
    let [wa, wb, wc] = three([a, b, c], |place| place.projected.inverse_w);
    if wb > wa && wb >= wc {
        [b, c, a]
    } else if wc > wa && wc > wb {
        [c, a, b]
    } else {
        [a, b, c]
    }
}

/// Where a triangle's vertices were before snapping, from its corners.
#[inline(always)]
fn offsets(places: [Place; 3]) -> [[i16; 2]; 3] {
    let mut offsets = UNMOVED;
    for (offset, place) in offsets.iter_mut().zip(places) {
        let Projected {
            window, snapped, ..
        } = place.projected;
        for axis in 0..2 {
            let off = f64::from(window[axis]) - f64::from(snapped[axis]) / f64::from(ONE);
            offset[axis] = (off * OFFSET_UNITS) as i16;
        }
    }
    offsets
}

/// Whether a triangle, whose bounds hold at most four pixel centres, covers none of them. Larger ones aren't looked
/// at.
#[inline(always)]
fn covers_nothing(corners: &[[i32; 2]; 3], pixels: Pixels) -> bool {
    let span = |[first, last]: [i32; 2]| last - first;
    if span(pixels.x) > 1 || span(pixels.y) > 1 {
        return false;
    }
    let inside = |x: i32, y: i32| {
        let [x, y] = both([x, y], |pixel| i64::from(pixel) * 256 + 128);
        let mut inside = true;
        for (from, to) in [(0, 1), (1, 2), (2, 0)] {
            let [[ax, ay], [bx, by]] = both([corners[from], corners[to]], |corner| {
                both(corner, i64::from)
            });
            let (dx, dy) = (bx - ax, by - ay);
            let value = dx * (y - ay) - dy * (x - ax);
            // Points on an edge belong to it if it is a left or a top one.
            let owns = dy < 0 || (dy == 0 && dx > 0);
            inside &= value > 0 || (value == 0 && owns);
        }
        inside
    };
    for y in pixels.y[0]..=pixels.y[1] {
        for x in pixels.x[0]..=pixels.x[1] {
            if inside(x, y) {
                return false;
            }
        }
    }
    true
}
