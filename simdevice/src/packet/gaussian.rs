//! Sorted sets of Gaussians.

use crate::packet::{AttributeStream, IndexStream};
use crate::program::bindings::Bindings;
use crate::program::fragment::GaussianFragmentProgram;
use crate::state::gaussian::{Camera, GaussianState};
use crate::state::{Rect, Viewport};
use std::sync::Arc;

/// See [`Packet::GaussianBegin`].
#[derive(Clone, Debug, PartialEq)]
pub struct GaussianBegin {
    /// What the pipeline fixes.
    pub state: Arc<GaussianState>,
    /// The camera, which means nothing to what a vertex program projects. In a pass with views it is that of the first
    /// one, and of all without one of their own.
    pub camera: Camera,
    /// The cameras of the other views of the pass, in their order.
    pub further_cameras: Vec<Camera>,
    /// The viewport; its width and height are the W and H of the projection.
    pub viewport: Viewport,
    /// Pixels outside are not touched.
    pub scissor: Rect,
}

/// The functions that are applied to attributes as they are read, in binary64, rounded once to binary32.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Activations {
    /// Standard deviations are exponentials of what is stored.
    pub log_scale: bool,
    /// Opacities are `1 / (1 + exp(-x))` of what is stored.
    pub logit_opacity: bool,
}

/// The vertex attributes of fixed-function projection.
#[derive(Clone, Debug)]
pub struct GaussianAttributes {
    /// The mean in world units: x, y, z.
    pub position: AttributeStream,
    /// Standard deviations in world units along the rotated axes: x, y, z.
    pub scale: AttributeStream,
    /// The quaternion w, x, y, z; it need not be normalised.
    pub rotation: AttributeStream,
    /// Opacity.
    pub opacity: AttributeStream,
    /// `(degree + 1)^2` spherical harmonics coefficients of red, green and blue.
    pub spherical_harmonics: Vec<AttributeStream>,
    /// What standard deviations and opacities are of what is stored.
    pub activations: Activations,
    /// What is done to them, usually by instance.
    pub model: ModelAttributes,
}

/// The vertex attributes that place a copy of Gaussians in the world.
#[derive(Clone, Debug, Default)]
pub struct ModelAttributes {
    /// The rows of a 3x4 matrix from the Gaussians' space to the world, 4 components each; the identity without it.
    pub matrix: Option<Box<[AttributeStream; 3]>>,
    /// A factor of the opacity; 1 without it.
    pub opacity: Option<AttributeStream>,
}

impl ModelAttributes {
    /// Whether there is anything to be done.
    pub fn is_some(&self) -> bool {
        self.matrix.is_some() || self.opacity.is_some()
    }
}

/// See [`Packet::GaussianAppend`].
#[derive(Clone, Debug)]
pub struct GaussianAppend {
    /// Where the Gaussians are.
    pub attributes: GaussianAttributes,
    /// The index buffer that picks them; without one they are consecutive.
    pub indices: Option<IndexStream>,
    /// The first vertex, or the first index.
    pub first: u32,
    /// How many vertices or indices.
    pub count: u32,
    /// The first instance.
    pub first_instance: u32,
    /// How many instances.
    pub instance_count: u32,
}

/// See [`Packet::GaussianFragmentStage`](crate::Packet::GaussianFragmentStage). Blending and write masks are those of the
/// [`GaussianState`](super::GaussianState), one per attachment.
#[derive(Clone, Debug)]
pub struct GaussianFragmentStage {
    /// The program.
    pub program: Arc<GaussianFragmentProgram>,
    /// What it is bound to.
    pub bindings: Bindings,
    /// Whether every sample is shaded for itself.
    pub sample_shading: bool,
    /// Alpha makes coverage.
    pub alpha_to_coverage: bool,
    /// Alpha becomes 1 after that.
    pub alpha_to_one: bool,
}
