//! Sorted sets of Gaussians.

use crate::packet::{AttributeStream, IndexStream};
use crate::program::bindings::Bindings;
use crate::program::fragment::GaussianFragmentProgram;
use crate::state::gaussian::{Camera, GaussianState};
use crate::state::{Rect, Viewport};
use std::sync::Arc;

/// The beginning of a set: see [`Packet::GaussianBegin`](crate::Packet::GaussianBegin).
#[derive(Clone, Debug, PartialEq)]
pub struct GaussianBegin {
    /// The state that the pipeline fixes.
    pub state: Arc<GaussianState>,
    /// The camera. Gaussians that a vertex program projects do not use it. In a pass with views it is the camera of the
    /// first view, and of all views that have no camera of their own.
    pub camera: Camera,
    /// The cameras of the pass's views after the first, in their order.
    pub further_cameras: Vec<Camera>,
    /// The viewport. Its width and height are W and H of the projection.
    pub viewport: Viewport,
    /// The pixels that may be written.
    pub scissor: Rect,
}

/// The functions that are applied to attributes as they are read. They are computed in binary64 and rounded once to
/// binary32.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Activations {
    /// True if standard deviations are exponentials of the stored values.
    pub log_scale: bool,
    /// True if opacities are `1 / (1 + exp(-x))` of the stored values `x`.
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
    /// The opacity.
    pub opacity: AttributeStream,
    /// The `(degree + 1)^2` spherical harmonics coefficients of red, green and blue.
    pub spherical_harmonics: Vec<AttributeStream>,
    /// The functions from stored values to standard deviations and opacities.
    pub activations: Activations,
    /// The transform of the Gaussians, usually by instance.
    pub model: ModelAttributes,
}

/// The vertex attributes that place a copy of Gaussians in the world.
#[derive(Clone, Debug, Default)]
pub struct ModelAttributes {
    /// The rows of a 3x4 matrix from the Gaussians' space to the world, with 4 components each. `None` is the identity.
    pub matrix: Option<Box<[AttributeStream; 3]>>,
    /// The factor of the opacity. `None` is 1.
    pub opacity: Option<AttributeStream>,
}

impl ModelAttributes {
    /// True if there is a matrix or a factor.
    pub fn is_some(&self) -> bool {
        self.matrix.is_some() || self.opacity.is_some()
    }
}

/// Gaussians with attributes: see [`Packet::GaussianAppend`](crate::Packet::GaussianAppend).
#[derive(Clone, Debug)]
pub struct GaussianAppend {
    /// The attributes of the Gaussians.
    pub attributes: GaussianAttributes,
    /// The index buffer that selects vertices. Without one, vertices are consecutive.
    pub indices: Option<IndexStream>,
    /// The first vertex, or the first index.
    pub first: u32,
    /// The number of vertices or indices.
    pub count: u32,
    /// The first instance.
    pub first_instance: u32,
    /// The number of instances.
    pub instance_count: u32,
}

/// The fragment program of a set: see [`Packet::GaussianFragmentStage`](crate::Packet::GaussianFragmentStage). Blending
/// and write masks are those of [`GaussianState`], one per attachment.
#[derive(Clone, Debug)]
pub struct GaussianFragmentStage {
    /// The program.
    pub program: Arc<GaussianFragmentProgram>,
    /// The bindings of the program.
    pub bindings: Bindings,
    /// True if the program runs once for each sample.
    pub sample_shading: bool,
    /// True if the alpha of the fragment determines its coverage.
    pub alpha_to_coverage: bool,
    /// True if alpha is replaced by 1 after coverage was determined.
    pub alpha_to_one: bool,
}
