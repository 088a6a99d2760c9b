//! Scenes in device memory.

use crate::mesh::DeviceMesh;
use crate::pipeline::{BINDINGS, GaussianPipeline};
use crate::resource::Buffer;
use crate::settings::Settings;

/// A scene in device memory, with its pipeline.
pub struct DeviceScene {
    /// The point to which its positions are relative.
    pub(crate) origin: [f64; 3],
    pub(crate) count: u32,
    pub(crate) strides: [u32; BINDINGS],
    pub(crate) stored_degree: u32,
    pub(crate) settings: Settings,
    pub(crate) pipeline: GaussianPipeline,
    /// A buffer for each of [`BINDINGS`].
    pub(crate) buffers: [Buffer; BINDINGS],
    /// The triangles among the Gaussians, if there are any.
    pub(crate) mesh: Option<DeviceMesh>,
}
