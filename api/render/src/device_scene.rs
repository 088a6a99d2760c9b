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
    /// Copies of them in the device's own memory, which are drawn instead.
    pub(crate) resident: Option<[Buffer; BINDINGS]>,
    /// The triangles among the Gaussians, if there are any.
    pub(crate) mesh: Option<DeviceMesh>,
}

impl DeviceScene {
    /// The buffers that are drawn.
    pub(crate) fn vertices(&self) -> &[Buffer; BINDINGS] {
        self.resident.as_ref().unwrap_or(&self.buffers)
    }
}
