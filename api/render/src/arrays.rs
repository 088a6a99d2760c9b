//! Gaussians that an application has as arrays, such as another library's tensors, and draws anew each time.

use std::mem::MaybeUninit;

use bytemuck::Pod;
use gaurast_scene::{GaussianShape, MAX_SH_DEGREE, SH_C0};

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

    /// Returns true if `buffers` have the bits of these arrays.
    pub(crate) fn are_in(&self, [positions, shapes, harmonics]: &[Buffer; BINDINGS]) -> Result<bool, RenderError> {
        let (count, (_, stride)) = (self.positions.len(), self.harmonics());
        let bits = |floats: &[f32; 3]| floats.map(f32::to_bits);
        Ok(positions.look(count * 12, |held: &[u8]| held == bytemuck::cast_slice::<_, u8>(self.positions))?
            && shapes.look(count, |held: &[GaussianShape]| {
                self.shapes().zip(held).all(|(shape, held)| bytemuck::bytes_of(&shape) == bytemuck::bytes_of(held))
            })?
            && match self.colors {
                Colors::Harmonics { coefficients, .. } => harmonics
                    .look(count * stride * 12, |held: &[u8]| held == bytemuck::cast_slice::<_, u8>(coefficients))?,
                Colors::Channels { stride, first, low, values } => harmonics.look(count, |held: &[[f32; 3]]| {
                    constant_harmonics(values, stride, first, low).zip(held).all(|(a, b)| bits(&a) == bits(b))
                })?,
            })
    }
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
