//! Cameras of sets.

use ash::vk;
use gaurast::vk::{GaussianCameraDistortionGAURAST as Distortion, GaussianCameraGAURAST};

/// A camera: `VkGaussianCameraDataGAURAST`.
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct Camera {
    pub(crate) eye: [f64; 3],
    pub(crate) model: i32,
    pub(crate) reserved: i32,
    pub(crate) rotation: [[f32; 4]; 3],
    pub(crate) focal_length: [f32; 2],
    pub(crate) principal_point: [f32; 2],
    pub(crate) depth_coefficients: [f32; 2],
    pub(crate) near_plane: f32,
    pub(crate) far_plane: f32,
    pub(crate) unused: [u32; 4],
}

/// A camera that a command has set, with its lens, if that distorts.
#[derive(Clone, Copy)]
pub(crate) struct SeenBy {
    pub(crate) camera: Camera,
    pub(crate) lens: Option<Distortion<'static>>,
}

impl SeenBy {
    /// Reports whether two are the same.
    pub(crate) fn is_same(&self, other: &Self) -> bool {
        let numbers =
            |seen: &Self| seen.lens.map(|lens| (lens.model.as_raw(), lens.radial, lens.tangential, lens.thin_prism));
        self.camera == other.camera && numbers(self) == numbers(other)
    }
}

/// The source of cameras.
#[derive(Clone)]
pub(crate) enum Cameras {
    Command(Vec<SeenBy>),
    /// A descriptor set with its dynamic offsets.
    Buffer(vk::DescriptorSet, Vec<u32>),
}

/// A camera as kernels read it.
pub(crate) fn camera_data(camera: &GaussianCameraGAURAST<'_>) -> Camera {
    let r = &camera.rotation;
    Camera {
        eye: camera.eye,
        model: camera.model.as_raw(),
        reserved: 0,
        rotation: [[r[0], r[1], r[2], 0.0], [r[3], r[4], r[5], 0.0], [r[6], r[7], r[8], 0.0]],
        focal_length: camera.focal_length,
        principal_point: camera.principal_point,
        depth_coefficients: camera.depth_coefficients,
        near_plane: camera.near_plane,
        far_plane: camera.far_plane,
        unused: [0; 4],
    }
}
