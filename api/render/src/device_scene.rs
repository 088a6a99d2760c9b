//! Scenes in device memory.

use ash::vk;

use crate::encoded::EncodedVertices;
use crate::mesh::DeviceMesh;
use crate::pipeline::{BINDINGS, GaussianPipeline};
use crate::resource::Buffer;
use crate::settings::Settings;
use gaurast_scene::Camera;
use glam::{DMat3, DVec3};

/// A scene in device memory, with its pipeline.
pub struct DeviceScene {
    /// The point to which its positions are relative.
    pub(crate) origin: DVec3,
    /// The orthogonal matrix from the axes of its positions to those of cameras.
    pub(crate) turn: DMat3,
    pub(crate) count: u32,
    pub(crate) stored_degree: u32,
    pub(crate) settings: Settings,
    pub(crate) pipeline: GaussianPipeline,
    pub(crate) vertices: Vertices,
    /// The triangles among the Gaussians, if there are any.
    pub(crate) mesh: Option<DeviceMesh>,
}

/// The attributes of Gaussians in device memory.
pub(crate) enum Vertices {
    /// As numbers.
    Decoded(Box<DecodedVertices>),
    /// As the integers of a compressed scene.
    Encoded(Box<EncodedVertices>),
}

/// The attributes of Gaussians, as numbers.
pub(crate) struct DecodedVertices {
    pub(crate) strides: [u32; BINDINGS],
    /// A buffer for each of [`BINDINGS`].
    pub(crate) buffers: [Buffer; BINDINGS],
    /// Copies of them in the device's own memory, which are drawn instead.
    pub(crate) resident: Option<[Buffer; BINDINGS]>,
    /// The hash of the arrays that the buffers hold, if they are from arrays.
    pub(crate) hash: Option<u128>,
}

impl Vertices {
    /// The buffers that are drawn.
    pub(crate) fn buffers(&self) -> Vec<vk::Buffer> {
        let buffers = match self {
            Self::Decoded(vertices) => vertices.resident.as_ref().unwrap_or(&vertices.buffers),
            Self::Encoded(vertices) => &vertices.buffers[..],
        };
        buffers.iter().map(Buffer::handle).collect()
    }
}

impl DeviceScene {
    /// `camera` in the coordinates of the scene's positions.
    pub(crate) fn seen_by(&self, camera: &Camera) -> Camera {
        let back = self.turn.transpose();
        let eye = back * (DVec3::from_array(camera.eye) - self.origin);
        let rotation = camera.rotation.map(|axis| (back * DVec3::from_array(axis)).to_array());
        Camera { eye: eye.to_array(), rotation, ..camera.clone() }
    }
}
