//! Cube maps: the face that a direction meets, and the texels across an edge.

use crate::simd::floats_of;
use fearless_simd::{Simd, f32x16, mask32x16, prelude::*, u32x16};
use isa::resources::LaneWords;

/// The point in which a direction meets the cube.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Hit {
    /// The face: +x, -x, +y, -y, +z, -z.
    pub face: u32,
    /// The direction's s coordinate on the face, not yet divided by `major`.
    pub sc: f32,
    /// The direction's t coordinate on the face, not yet divided by `major`.
    pub tc: f32,
    /// The magnitude of the coordinate along the face's axis.
    pub major: f32,
}

/// The vector's components along a face's own axes: s, t and outwards.
fn face_axes(face: u32, [x, y, z]: [f32; 3]) -> [f32; 3] {
    match face {
        0 => [-z, -y, x],
        1 => [z, -y, -x],
        2 => [x, z, y],
        3 => [x, -z, -y],
        4 => [x, -y, z],
        _ => [-x, -y, -z],
    }
}

/// The inverse of [`face_axes`].
fn from_face_axes(face: u32, [s, t, outwards]: [f32; 3]) -> [f32; 3] {
    match face {
        0 => [outwards, -t, -s],
        1 => [-outwards, -t, s],
        2 => [s, outwards, t],
        3 => [s, -outwards, -t],
        4 => [s, -t, outwards],
        _ => [-s, -t, -outwards],
    }
}

impl Hit {
    /// The point in which a direction meets the cube. Of equal components z takes precedence over y, and y over x.
    pub fn new(direction: [f32; 3]) -> Self {
        let [x, y, z] = direction;
        let (axis, component) = if z.abs() >= x.abs() && z.abs() >= y.abs() {
            (2, z)
        } else if y.abs() >= x.abs() {
            (1, y)
        } else {
            (0, x)
        };
        let face = 2 * axis + u32::from(component < 0.0);
        let [sc, tc, major] = face_axes(face, direction);
        Self { face, sc, tc, major }
    }

    /// The coordinates on the face, from 0 to 1.
    pub fn coordinates(&self) -> [f32; 2] {
        [0.5 * (self.sc / self.major) + 0.5, 0.5 * (self.tc / self.major) + 0.5]
    }

    /// The change of the coordinates on the face for a small change of the direction.
    pub fn derivative(&self, change: [f32; 3]) -> [f32; 2] {
        let [ds, dt, dm] = face_axes(self.face, change);
        let scale = 0.5 / (self.major * self.major);
        [scale * (self.major * ds - self.sc * dm), scale * (self.major * dt - self.tc * dm)]
    }
}

/// The results of [`Hit::new`] and [`Hit::coordinates`] for 16 directions: faces, and s and t from 0 to 1.
#[inline(always)]
pub(super) fn faces<S: Simd>(simd: S, direction: [LaneWords; 3]) -> (u32x16<S>, f32x16<S>, f32x16<S>) {
    let [x, y, z] = direction;
    let (x, y, z) = (u32x16::simd_from(simd, x), u32x16::simd_from(simd, y), u32x16::simd_from(simd, z));
    // Changing a sign is exact, also that of a NaN.
    let sign = u32x16::splat(simd, 1 << 31);
    let (far_x, far_y, far_z) = (floats_of(x & !sign), floats_of(y & !sign), floats_of(z & !sign));
    let along_z: mask32x16<S> = far_z.simd_ge(far_x) & far_z.simd_ge(far_y);
    let along_y: mask32x16<S> = far_y.simd_ge(far_x);
    let component = along_z.select(z, along_y.select(y, x));
    let is_negative: mask32x16<S> = floats_of(component).simd_lt(f32x16::splat(simd, 0.0));
    let zero = u32x16::splat(simd, 0);
    // The components are negated on faces of negative directions.
    let flip = is_negative.select(sign, zero);
    let other = flip ^ sign;
    let sc = floats_of(along_z.select(x ^ flip, along_y.select(x, z ^ other)));
    let tc = floats_of(along_z.select(y ^ sign, along_y.select(z ^ flip, y ^ sign)));
    let major = floats_of(component ^ flip);
    let axis = along_z.select(u32x16::splat(simd, 4), along_y.select(u32x16::splat(simd, 2), zero));
    let face = axis + is_negative.select(u32x16::splat(simd, 1), zero);
    (face, sc / major * 0.5 + 0.5, tc / major * 0.5 + 0.5)
}

/// The face and texel for (i, j), of which one coordinate is a texel outside of `face`, which has `size` texels per
/// side.
fn across_edge(face: u32, [i, j]: [i32; 2], size: u32) -> (u32, [u32; 2]) {
    // In units of half a texel from the face's centre, all texel centres are integers.
    let n = size as f32;
    let [s, t] = [i, j].map(|index| (2 * index + 1) as f32 - n);
    // The part outside folds over to the neighbouring face, where the texel's centre is half a texel from the edge.
    let around = if s.abs() > n { [n.copysign(s), t, n - 1.0] } else { [s, n.copysign(t), n - 1.0] };
    let hit = Hit::new(from_face_axes(face, around));
    let index = |c: f32| (((c + n - 1.0) * 0.5) as u32).min(size.saturating_sub(1));
    (hit.face, [index(hit.sc), index(hit.tc)])
}

/// The texels of a cube for texel (i, j) of a face, which may be outside of it by one: a single texel or, outside of a
/// corner, the three around the corner, of which the mean is taken. Returns the texels and their number.
pub(super) fn texels(face: u32, at: [i32; 2], size: u32) -> ([(u32, [u32; 2]); 3], usize) {
    let last = size as i32 - 1;
    let at = at.map(|index| index.clamp(-1, last + 1));
    let clamped = at.map(|index| index.clamp(0, last));
    let inside = (face, clamped.map(|index| index as u32));
    match (at[0] != clamped[0], at[1] != clamped[1]) {
        (false, false) => ([inside; 3], 1),
        (true, true) => {
            let beyond_s = across_edge(face, [at[0], clamped[1]], size);
            let beyond_t = across_edge(face, [clamped[0], at[1]], size);
            ([inside, beyond_s, beyond_t], 3)
        }
        _ => ([across_edge(face, at, size); 3], 1),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::token_of;
    use devmem::dispatch;
    use gaurast_runner::{Case, simd_levels};
    use rand::seq::IndexedRandom;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// A texel's centre as a point on the cube of half side `size`.
    fn center(face: u32, [i, j]: [u32; 2], size: u32) -> [f32; 3] {
        let n = size as f32;
        from_face_axes(face, [(2 * i + 1) as f32 - n, (2 * j + 1) as f32 - n, n])
    }

    #[gaurast_runner::test]
    fn every_direction_meets_the_face_of_its_greatest_component() {
        let faces = [
            ([1.0, 0.2, -0.3], 0, [0.3, -0.2]),
            ([-1.0, 0.2, -0.3], 1, [-0.3, -0.2]),
            ([0.2, 1.0, -0.3], 2, [0.2, -0.3]),
            ([0.2, -1.0, -0.3], 3, [0.2, 0.3]),
            ([0.2, -0.3, 1.0], 4, [0.2, 0.3]),
            ([0.2, -0.3, -1.0], 5, [-0.2, 0.3]),
        ];
        for (direction, face, [sc, tc]) in faces {
            let hit = Hit::new(direction);
            assert_eq!((hit.face, hit.sc, hit.tc, hit.major), (face, sc, tc, 1.0));
        }
        assert_eq!(Hit::new([1.0, 1.0, -1.0]).face, 5);
        assert_eq!(Hit::new([1.0, -1.0, 0.0]).face, 3);
    }

    #[gaurast_runner::test(each = simd_levels())]
    fn sixteen_directions_meet_what_each_meets(case: &Case) {
        let level = token_of(case);
        let mut rng = ChaCha8Rng::seed_from_u64(9);
        for round in 0..4000 {
            let direction: [LaneWords; 3] = [(); 3].map(|()| {
                std::array::from_fn(|_| match (round + rng.random_range(0..2)) % 8 {
                    0 => rng.random(),
                    1 => *[0.0, -0.0, 1.0, -1.0, f32::NAN, f32::INFINITY].choose(&mut rng).unwrap(),
                    _ => rng.random_range(-1.0..1.0_f32),
                })
                .map(f32::to_bits)
            });
            let (face, s, t): (LaneWords, [f32; 16], [f32; 16]) = dispatch!(level, simd => {
                let (face, s, t) = faces(simd, direction);
                (face.into(), s.into(), t.into())
            });
            for lane in 0..16 {
                let hit = Hit::new(direction.map(|lanes| f32::from_bits(lanes[lane])));
                assert_eq!(face[lane], hit.face, "{direction:?}");
                for (found, expected) in [s[lane], t[lane]].into_iter().zip(hit.coordinates()) {
                    let same = found.to_bits() == expected.to_bits() || found.is_nan() && expected.is_nan();
                    assert!(same, "{direction:?}, {lane}");
                }
            }
        }
    }

    #[gaurast_runner::test]
    fn texels_across_an_edge_touch_it() {
        for size in [1, 2, 5] {
            for face in 0..6 {
                for along in 0..size {
                    let last = size as i32;
                    let along_edge = along as i32;
                    let pairs = [
                        ([-1, along_edge], [0, along]),
                        ([last, along_edge], [size - 1, along]),
                        ([along_edge, -1], [along, 0]),
                        ([along_edge, last], [along, size - 1]),
                    ];
                    for (outside, inside) in pairs {
                        let ([(other, texel), ..], count) = texels(face, outside, size);
                        assert_eq!(count, 1);
                        assert_ne!(other, face);
                        let (a, b) = (center(face, inside, size), center(other, texel, size));
                        let distance: f32 = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum();
                        assert_eq!(distance, 2.0, "half a texel from the edge each");
                    }
                }
            }
        }
    }

    #[gaurast_runner::test]
    fn corners_are_shared_by_three_faces() {
        for face in 0..6 {
            let (around, count) = texels(face, [4, -1], 4);
            assert_eq!(count, 3);
            let corners = around.map(|(face, texel)| center(face, texel, 4));
            for axis in 0..3 {
                let signs = corners.map(|corner| corner[axis] > 0.0);
                assert!(signs.iter().all(|sign| *sign == signs[0]));
            }
            assert_ne!(around[1].0, around[2].0);
        }
    }

    #[gaurast_runner::test]
    fn derivatives_are_those_of_the_coordinates() {
        for direction in [[1.0, 0.3, -0.2], [0.1, -2.0, 0.5], [-0.3, 0.4, 0.9]] {
            for change in [[0.1, 0.0, 0.0], [0.02, -0.1, 0.3]] {
                let hit = Hit::new(direction);
                let h = 1e-3;
                let moved = Hit::new(std::array::from_fn(|c| direction[c] + h * change[c]));
                let derivative = hit.derivative(change);
                let (from, to) = (hit.coordinates(), moved.coordinates());
                for (derivative, (from, to)) in derivative.into_iter().zip(from.into_iter().zip(to)) {
                    assert!(((to - from) / h - derivative).abs() < 1e-3);
                }
            }
        }
    }
}
