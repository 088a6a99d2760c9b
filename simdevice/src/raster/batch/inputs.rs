//! What a fragment program gets of a batch.

use super::{Batch, LANES, Quad, Record, Samples, offset};
use crate::limits::TILE_SIZE;
use crate::program::fragment::Interface;
use crate::program::interface::{FragmentInput, Interpolation, Sampling};
use crate::simd::bits_of;
use fearless_simd::{Simd, f32x4, f32x16, prelude::*};
use isa::exec::{Chunk, Machine};

impl Batch {
    /// A value of each lane's primitive.
    #[inline(always)]
    fn of_records<S: Simd>(
        &self,
        simd: S,
        chunk: usize,
        value: impl Fn(&Record) -> f32,
    ) -> f32x16<S> {
        if let Some(record) = self.common[chunk] {
            return f32x16::splat(simd, value(&self.records[usize::from(record)]));
        }
        let mut values = [0.0; 4];
        for (quad, out) in self.chunk_quads(chunk).iter().zip(&mut values) {
            *out = value(&self.records[usize::from(quad.record)]);
        }
        spread(simd, values)
    }

    /// A varying's value at corner 0 and differences to the other corners, of each lane's primitive.
    #[inline(always)]
    fn attribute<S: Simd>(
        &self,
        simd: S,
        chunk: usize,
        varying: usize,
        per_record: usize,
    ) -> [f32x16<S>; 3] {
        if let Some(record) = self.common[chunk] {
            let [a, b, c] = self.attributes[usize::from(record) * per_record + varying];
            return [
                f32x16::splat(simd, a),
                f32x16::splat(simd, b),
                f32x16::splat(simd, c),
            ];
        }
        let mut of_quads = [[0.0; 4]; 3];
        for (number, quad) in self.chunk_quads(chunk).iter().enumerate() {
            let [a, b, c] = self.attributes[usize::from(quad.record) * per_record + varying];
            of_quads[0][number] = a;
            of_quads[1][number] = b;
            of_quads[2][number] = c;
        }
        [
            spread(simd, of_quads[0]),
            spread(simd, of_quads[1]),
            spread(simd, of_quads[2]),
        ]
    }

    /// Sets a program's inputs. Returns whether perspective-correct ones needed no division.
    #[inline(always)]
    pub fn set_inputs<S: Simd>(
        &mut self,
        simd: S,
        interface: &Interface,
        samples: Samples,
        machine: &mut Machine,
    ) -> bool {
        let perspective = interface
            .varyings
            .iter()
            .any(|(_, interpolation)| *interpolation == Interpolation::Perspective);
        let divided = perspective && !self.affine;
        if divided {
            self.divide(simd);
        }
        let at_centers = samples.positions.len() == 1 || samples.each_shaded;
        for &(slot, kind, place) in &interface.inputs {
            let lanes = machine.input_mut(slot);
            let count = self.chunks().min(lanes.len());
            let lanes = &mut lanes[..count];
            match kind {
                FragmentInput::Varying {
                    interpolation,
                    sampling,
                    ..
                } if interpolation != Interpolation::Flat
                    && (at_centers || sampling != Sampling::Centroid) =>
                {
                    let barycentrics = match interpolation {
                        Interpolation::Perspective if divided => &self.perspective,
                        _ => &self.barycentrics,
                    };
                    self.interpolate(simd, place, interface.varyings.len(), barycentrics, lanes);
                }
                _ => {
                    for (chunk, lanes) in lanes.iter_mut().enumerate() {
                        let input = (kind, place);
                        *lanes = Chunk(self.input(simd, input, chunk, interface, samples));
                    }
                }
            }
        }
        perspective && !divided
    }

    /// A varying of chunks from the first on.
    #[inline(always)]
    fn interpolate<S: Simd>(
        &self,
        simd: S,
        place: usize,
        per_record: usize,
        [b1, b2]: &[[f32; LANES]; 2],
        out: &mut [Chunk],
    ) {
        let (b1, b2) = (b1.as_chunks::<16>().0, b2.as_chunks::<16>().0);
        for (chunk, ((out, b1), b2)) in out.iter_mut().zip(b1).zip(b2).enumerate() {
            let attribute = self.attribute(simd, chunk, place, per_record);
            let b1 = f32x16::simd_from(simd, *b1);
            let b2 = f32x16::simd_from(simd, *b2);
            *out = Chunk(bits_of(varying(attribute, [b1, b2])).into());
        }
    }

    /// Finds perspective-correct barycentrics.
    #[inline(always)]
    fn divide<S: Simd>(&mut self, simd: S) {
        for chunk in 0..self.chunks() {
            let [p1, p2] = self.perspective_at(simd, chunk, self.linear_at(simd, chunk));
            p1.store_slice(&mut self.perspective[0][16 * chunk..][..16]);
            p2.store_slice(&mut self.perspective[1][16 * chunk..][..16]);
        }
    }

    #[inline(always)]
    fn linear_at<S: Simd>(&self, simd: S, chunk: usize) -> [f32x16<S>; 3] {
        [
            f32x16::from_slice(simd, &self.barycentrics[0][16 * chunk..][..16]),
            f32x16::from_slice(simd, &self.barycentrics[1][16 * chunk..][..16]),
            f32x16::from_slice(simd, &self.inverse_w[16 * chunk..][..16]),
        ]
    }

    #[inline(always)]
    fn perspective_at<S: Simd>(
        &self,
        simd: S,
        chunk: usize,
        [b1, b2, inverse_w]: [f32x16<S>; 3],
    ) -> [f32x16<S>; 2] {
        let w1 = self.of_records(simd, chunk, |record| record.weights[0]);
        let w2 = self.of_records(simd, chunk, |record| record.weights[1]);
        divided(simd, [b1, b2], inverse_w, [w1, w2])
    }

    /// The barycentrics at a sample covered of each lane, the centre if all are.
    #[inline(always)]
    fn centroid_at<S: Simd>(
        &self,
        simd: S,
        chunk: usize,
        positions: &[[i32; 2]],
    ) -> [f32x16<S>; 3] {
        let (mut x, mut y) = ([0.0; 16], [0.0; 16]);
        for lane in 0..16 {
            let cover = self.chunk_quads(chunk)[lane / 4].cover >> (lane % 4) & 0x1111;
            if cover != 0 && cover != 0x1111 {
                let [at_x, at_y] = positions[cover.trailing_zeros() as usize / 4];
                (x[lane], y[lane]) = (offset(at_x), offset(at_y));
            }
        }
        let (x, y) = (f32x16::simd_from(simd, x), f32x16::simd_from(simd, y));
        let [b1, b2, inverse_w] = self.linear_at(simd, chunk);
        let slope = |corner: usize, axis: usize| {
            self.of_records(simd, chunk, |record| record.slopes[corner][axis])
        };
        [
            b1 + slope(0, 0) * x + slope(0, 1) * y,
            b2 + slope(1, 0) * x + slope(1, 1) * y,
            inverse_w
                + self.of_records(simd, chunk, |record| record.w_slopes[0]) * x
                + self.of_records(simd, chunk, |record| record.w_slopes[1]) * y,
        ]
    }

    /// The bits of an input for 16 lanes.
    #[inline(always)]
    fn input<S: Simd>(
        &self,
        simd: S,
        (kind, place): (FragmentInput, usize),
        chunk: usize,
        interface: &Interface,
        samples: Samples,
    ) -> [u32; 16] {
        match kind {
            FragmentInput::Varying { interpolation, .. } => {
                let attribute = self.attribute(simd, chunk, place, interface.varyings.len());
                // At the centres it is left to [`Batch::interpolate`].
                let linear = self.centroid_at(simd, chunk, samples.positions);
                let barycentrics = match interpolation {
                    Interpolation::Flat => return bits_of(attribute[0]).into(),
                    Interpolation::Linear => [linear[0], linear[1]],
                    Interpolation::Perspective => self.perspective_at(simd, chunk, linear),
                };
                bits_of(varying(attribute, barycentrics)).into()
            }
            FragmentInput::FragCoord(2) => {
                let depth = f32x16::from_slice(simd, &self.depth[16 * chunk..][..16]);
                bits_of(depth).into()
            }
            FragmentInput::FragCoord(3) => {
                let [.., inverse_w] = self.linear_at(simd, chunk);
                let scale = self.of_records(simd, chunk, |record| record.scale);
                bits_of(inverse_w * scale).into()
            }
            FragmentInput::PointCoord(axis) => {
                let [b1, b2, _] = self.linear_at(simd, chunk);
                let value = if axis == 0 { b1 + b2 } else { b2 };
                // Other primitives have none.
                let is_point = self.of_records(simd, chunk, |record| f32::from(record.is_point));
                bits_of(value * is_point).into()
            }
            _ => self.scalar_input(kind, chunk, samples),
        }
    }

    /// The column or row of a lane of a quad in the framebuffer.
    fn pixel(&self, quad: &Quad, lane: usize, axis: usize) -> u32 {
        let tile = u32::from(quad.tile);
        let tile = [tile % self.side, tile / self.side][axis];
        // See `tile::place`.
        let bits = (u32::from(quad.place) | lane as u32) >> axis;
        let within = bits & 1 | bits >> 1 & 2 | bits >> (2 + axis) & 12;
        self.corner[axis] + tile * TILE_SIZE + within
    }

    /// As [`Batch::input`], for inputs that follow from the quad.
    fn scalar_input(&self, kind: FragmentInput, chunk: usize, samples: Samples) -> [u32; 16] {
        let quads = self.chunk_quads(chunk);
        let mut lanes = [0; 16];
        for (number, lane) in lanes.iter_mut().enumerate() {
            let quad = &quads[number / 4];
            let record = &self.records[usize::from(quad.record)];
            let sample = usize::from(quad.sample);
            // Samples shaded for themselves are where they are.
            let within = if samples.each_shaded {
                samples.positions[sample].map(|at| at as f32 / 256.0)
            } else {
                [0.5; 2]
            };
            *lane = match kind {
                FragmentInput::FragCoord(axis) => {
                    let axis = axis.min(1);
                    let pixel = self.pixel(quad, number % 4, axis);
                    (pixel as f32 + within[axis]).to_bits()
                }
                FragmentInput::FrontFacing => {
                    if record.front {
                        u32::MAX
                    } else {
                        0
                    }
                }
                FragmentInput::PrimitiveId => record.id,
                FragmentInput::SampleId => sample as u32,
                FragmentInput::SamplePosition(axis) => within[axis.min(1)].to_bits(),
                FragmentInput::SampleMask => {
                    let cover = quad.cover >> (number % 4);
                    (0..4).map(|s| u32::from(cover >> (4 * s) & 1) << s).sum()
                }
                FragmentInput::Layer => record.layer.into(),
                FragmentInput::ViewportIndex => record.viewport.into(),
                FragmentInput::Varying { .. } | FragmentInput::PointCoord(_) => 0,
            };
        }
        lanes
    }
}

/// A varying where the barycentrics are these: its value at corner 0 and how much more it is at the others are given.
#[inline(always)]
pub fn varying<S: Simd>([a, da, db]: [f32x16<S>; 3], [b1, b2]: [f32x16<S>; 2]) -> f32x16<S> {
    db.mul_add(b2, da.mul_add(b1, a))
}

/// Perspective-correct barycentrics: those of the framebuffer, 1 / w there, and at the corners.
#[inline(always)]
pub fn divided<S: Simd>(
    simd: S,
    [b1, b2]: [f32x16<S>; 2],
    inverse_w: f32x16<S>,
    [w1, w2]: [f32x16<S>; 2],
) -> [f32x16<S>; 2] {
    let inverse = f32x16::splat(simd, 1.0) / inverse_w;
    [b1 * w1 * inverse, b2 * w2 * inverse]
}

/// A value of each quad for its lanes.
#[inline(always)]
fn spread<S: Simd>(simd: S, [a, b, c, d]: [f32; 4]) -> f32x16<S> {
    let low = f32x4::splat(simd, a).combine(f32x4::splat(simd, b));
    let high = f32x4::splat(simd, c).combine(f32x4::splat(simd, d));
    low.combine(high)
}
