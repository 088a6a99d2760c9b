//! Gaussians that an application has as arrays, such as another library's tensors, and draws anew each time.

use std::mem::MaybeUninit;

use bytemuck::Pod;
use gaurast_scene::{GaussianShape, MAX_SH_DEGREE, SH_C0};
use twox_hash::XxHash3_128;

use crate::error::RenderError;
use crate::pipeline::BINDINGS;
use crate::resource::Buffer;

/// Gaussians as one array for each attribute, all of the same length.
#[derive(Clone, Copy, Debug)]
pub struct Arrays<'a> {
    /// Centres.
    pub positions: &'a [[f32; 3]],
    /// Standard deviations along the Gaussians' own axes.
    pub scales: &'a [[f32; 3]],
    /// Quaternions w, x, y, z, which need not be normalised.
    pub rotations: &'a [[f32; 4]],
    /// Opacities at the centres, 0 to 1.
    pub opacities: &'a [f32],
    /// Their colours.
    pub colors: Colors<'a>,
}

/// The colours of Gaussians.
#[derive(Clone, Copy, Debug)]
pub enum Colors<'a> {
    /// Spherical harmonics as [`Scene::sh`](gaurast_scene::Scene::sh) has them. Those of at most `degree` are drawn.
    Harmonics {
        /// The degree, at most [`MAX_SH_DEGREE`].
        degree: u32,
        /// The RGB triples of each Gaussian, at least (degree + 1)^2.
        stride: usize,
        /// The coefficients.
        coefficients: &'a [[f32; 3]],
    },
    /// Three channels of `values`, which has `stride` numbers for each Gaussian: those from `first` on, less `low`. A
    /// channel that `values` lacks is 0. The differences must not be negative.
    Channels {
        /// The numbers of a Gaussian.
        stride: usize,
        /// The first channel.
        first: usize,
        /// The least value of each channel.
        low: [f32; 3],
        /// The values.
        values: &'a [f32],
    },
}

impl Arrays<'_> {
    /// The stored degree and the RGB triples of each Gaussian.
    pub(crate) fn harmonics(&self) -> (u32, usize) {
        match self.colors {
            Colors::Harmonics { degree, stride, .. } => (degree, stride),
            Colors::Channels { .. } => (0, 1),
        }
    }

    /// Asserts that the arrays are of one length and have harmonics of their degree.
    pub(crate) fn check(&self) {
        let count = self.positions.len();
        let colors = match self.colors {
            Colors::Harmonics { degree, stride, coefficients } => {
                assert!(degree <= MAX_SH_DEGREE && stride >= (degree as usize + 1).pow(2), "harmonics of the degree");
                coefficients.len() == count * stride
            }
            Colors::Channels { stride, values, .. } => values.len() == count * stride,
        };
        let same = self.scales.len() == count && self.rotations.len() == count && self.opacities.len() == count;
        assert!(same && colors, "arrays of one length");
    }

    /// The scale, rotation and opacity of each Gaussian.
    fn shapes(&self) -> impl Iterator<Item = GaussianShape> {
        let attributes = self.scales.iter().zip(self.rotations).zip(self.opacities);
        attributes.map(|((scale, rotation), opacity)| GaussianShape {
            scale: *scale,
            rotation: *rotation,
            opacity: *opacity,
        })
    }

    /// Writes the arrays to buffers that have room for them.
    pub(crate) fn write_to(&self, buffers: &[Buffer; BINDINGS]) -> Result<(), RenderError> {
        let [positions, shapes, harmonics] = buffers;
        positions.write(bytemuck::cast_slice(self.positions))?;
        write_each(shapes, self.positions.len(), self.shapes())?;
        match self.colors {
            Colors::Harmonics { coefficients, .. } => harmonics.write(bytemuck::cast_slice(coefficients))?,
            Colors::Channels { stride, first, low, values } => {
                write_each(harmonics, self.positions.len(), constant_harmonics(values, stride, first, low))?;
            }
        }
        Ok(())
    }

    /// A hash of the arrays' bits and of which of them are drawn. Equal arrays have equal hashes, and others the same one by a
    /// chance of 2^-128. `threads` threads compute it.
    pub(crate) fn hash(&self, threads: usize) -> u128 {
        let colors: &[u8] = match self.colors {
            Colors::Harmonics { coefficients, .. } => bytemuck::cast_slice(coefficients),
            Colors::Channels { values, .. } => bytemuck::cast_slice(values),
        };
        let attributes: [&[u8]; 5] = [
            bytemuck::cast_slice(self.positions),
            bytemuck::cast_slice(self.scales),
            bytemuck::cast_slice(self.rotations),
            bytemuck::cast_slice(self.opacities),
            colors,
        ];
        let chosen = match self.colors {
            Colors::Harmonics { degree, stride, .. } => [0, u64::from(degree), stride as u64, 0, 0, 0],
            Colors::Channels { stride, first, low, .. } => {
                let [x, y, z] = low.map(|low| u64::from(low.to_bits()));
                [1, first as u64, stride as u64, x, y, z]
            }
        };
        let mut hashes = hashes_of_pieces(&attributes, threads);
        hashes.push(XxHash3_128::oneshot(bytemuck::cast_slice(&chosen)));
        XxHash3_128::oneshot(bytemuck::cast_slice(&hashes))
    }
}

/// The bytes that are hashed together. Threads that share memory read it no faster by smaller pieces.
const PIECE: usize = 1 << 20;

/// The hashes of the lengths of `arrays`, and of each piece of them in turn.
fn hashes_of_pieces(arrays: &[&[u8]], threads: usize) -> Vec<u128> {
    let mut hashes: Vec<u128> = arrays.iter().map(|array| array.len() as u128).collect();
    let pieces: Vec<&[u8]> = arrays.iter().flat_map(|array| array.chunks(PIECE)).collect();
    let of = |pieces: &[&[u8]]| pieces.iter().map(|piece| XxHash3_128::oneshot(piece)).collect::<Vec<_>>();
    let share = pieces.len().div_ceil(threads.max(1)).max(1);
    let (own, others) = pieces.split_at(share.min(pieces.len()));
    std::thread::scope(|scope| {
        let others: Vec<_> = others.chunks(share).map(|pieces| scope.spawn(move || of(pieces))).collect();
        hashes.extend(of(own));
        for other in others {
            hashes.extend(other.join().expect("hashing does not panic"));
        }
    });
    hashes
}

/// The constant harmonics whose colours are the channels.
fn constant_harmonics(values: &[f32], stride: usize, first: usize, low: [f32; 3]) -> impl Iterator<Item = [f32; 3]> {
    let scale = (1.0 / SH_C0) as f32;
    values.chunks_exact(stride).map(move |values| {
        let color = |channel: usize| values.get(first + channel).map_or(0.0, |value| value - low[channel]);
        [0, 1, 2].map(|channel| (color(channel) - 0.5) * scale)
    })
}

/// Writes `values` to a buffer of at least as many.
fn write_each<T: Pod>(buffer: &Buffer, count: usize, values: impl Iterator<Item = T>) -> Result<(), RenderError> {
    buffer.fill(count, |places: &mut [MaybeUninit<T>]| {
        for (place, value) in places.iter_mut().zip(values) {
            place.write(value);
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Arrays of so many Gaussians that their harmonics are hashed in three pieces.
    struct Owned {
        vectors: Vec<[f32; 3]>,
        rotations: Vec<[f32; 4]>,
        opacities: Vec<f32>,
        coefficients: Vec<[f32; 3]>,
    }

    impl Owned {
        const COUNT: usize = PIECE / 64;

        fn new() -> Self {
            Self {
                vectors: vec![[0.5; 3]; Self::COUNT],
                rotations: vec![[1.0, 0.0, 0.0, 0.0]; Self::COUNT],
                opacities: vec![0.25; Self::COUNT],
                coefficients: vec![[0.1; 3]; Self::COUNT * 16],
            }
        }

        fn hash(&self, threads: usize, degree: u32) -> u128 {
            let colors = Colors::Harmonics { degree, stride: 16, coefficients: &self.coefficients };
            self.with(colors).hash(threads)
        }

        fn with<'a>(&'a self, colors: Colors<'a>) -> Arrays<'a> {
            Arrays {
                positions: &self.vectors,
                scales: &self.vectors,
                rotations: &self.rotations,
                opacities: &self.opacities,
                colors,
            }
        }
    }

    #[test]
    fn the_hash_does_not_depend_on_threads() {
        let arrays = Owned::new();
        let one = arrays.hash(1, 3);
        for threads in [0, 2, 3, 7, 1000] {
            assert_eq!(arrays.hash(threads, 3), one, "{threads} threads");
        }
    }

    #[test]
    fn every_attribute_and_the_choice_of_colors_change_the_hash() {
        let mut arrays = Owned::new();
        let mut seen = vec![arrays.hash(2, 3), arrays.hash(2, 2)];
        // The least change that there is, at the last place of each array.
        arrays.vectors[Owned::COUNT - 1][2] = 0.5_f32.next_up();
        seen.push(arrays.hash(2, 3));
        arrays.rotations[Owned::COUNT - 1][3] = -0.0;
        seen.push(arrays.hash(2, 3));
        arrays.opacities[Owned::COUNT - 1] = 0.25_f32.next_up();
        seen.push(arrays.hash(2, 3));
        arrays.coefficients[Owned::COUNT * 16 - 1][2] = 0.1_f32.next_up();
        seen.push(arrays.hash(2, 3));
        for (first, low) in [(0, [0.0; 3]), (1, [0.0; 3]), (1, [0.0, 0.0, 1.0])] {
            let values = arrays.coefficients.as_flattened();
            seen.push(arrays.with(Colors::Channels { stride: 48, first, low, values }).hash(2));
        }
        let count = seen.len();
        seen.sort_unstable();
        seen.dedup();
        assert_eq!(seen.len(), count, "hashes of different arrays");
    }

    #[test]
    fn no_arrays_have_a_hash() {
        let colors = Colors::Harmonics { degree: 0, stride: 1, coefficients: &[] };
        let empty = Arrays { positions: &[], scales: &[], rotations: &[], opacities: &[], colors };
        assert_eq!(empty.hash(1), empty.hash(4));
    }
}
