//! The camera of a fixed-function Gaussian draw, as a command's argument and as a uniform buffer.

use core::ffi::c_void;
use core::marker::PhantomData;

use ash::vk::{StructureType, TaggedStructure};

use super::enums::GaussianCameraModelGAURAST;
use crate::ash_compat::setters;

/// `VkGaussianCameraGAURAST`: a camera, for `vkCmdSetGaussianCameraGAURAST`.
///
/// A world-space point p has camera coordinates t = `rotation` (p - `eye`), with +x right, +y down
/// and +z forward in the picture. [`GaussianCameraModelGAURAST`] says how t becomes a pixel and what
/// its depth variable z is; pixel (0, 0) is the upper left corner of the area that the viewport
/// covers (whatever the sign of its height), and pixel centres lie at halves. A Gaussian is drawn
/// only if `near_plane` < z < `far_plane`.
///
/// The depth d = c0 + c1 / z (c0 + c1 z for an orthographic camera) is what the application's
/// projection matrix gives for the same point, before the viewport maps it to its range of depths.
///
/// [`from_view_projection`](Self::from_view_projection) and its siblings build it. The default
/// stands at the origin, looks along +z with an unrotated camera and depth 1 - 0.2 / z, and still
/// needs a focal length and a principal point.
#[repr(C)]
#[derive(Copy, Clone, Debug)]
#[must_use]
pub struct GaussianCameraGAURAST<'a> {
    /// The structure's type.
    pub s_type: StructureType,
    /// The next structure of the chain, or null.
    pub p_next: *const c_void,
    /// How camera coordinates become pixels.
    pub model: GaussianCameraModelGAURAST,
    /// The rotation from world to camera axes, row-major: the rows are the directions right, down
    /// and forward in world space. Orthonormal; it may mirror, for left-handed worlds.
    pub rotation: [f32; 9],
    /// The camera's position in world space; double, so that scenes far from the origin lose
    /// nothing.
    pub eye: [f64; 3],
    /// fx and fy; positive. Pixels, pixels per unit of length, or pixels per radian, by the model.
    pub focal_length: [f32; 2],
    /// cx and cy in pixels: where the point straight ahead appears.
    pub principal_point: [f32; 2],
    /// The least z, exclusive; greater than 0 unless the camera is orthographic. 0.2 by default.
    pub near_plane: f32,
    /// The greatest z, exclusive; greater than `near_plane`. Infinity by default.
    pub far_plane: f32,
    /// c0 and c1.
    pub depth_coefficients: [f32; 2],
    /// The lifetime of the `p_next` chain.
    pub _marker: PhantomData<&'a ()>,
}

impl Default for GaussianCameraGAURAST<'_> {
    #[inline]
    fn default() -> Self {
        Self {
            s_type: Self::STRUCTURE_TYPE,
            p_next: core::ptr::null(),
            model: GaussianCameraModelGAURAST::PINHOLE,
            rotation: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
            eye: [0.0; 3],
            focal_length: [0.0; 2],
            principal_point: [0.0; 2],
            near_plane: 0.2,
            far_plane: f32::INFINITY,
            depth_coefficients: [1.0, -0.2],
            _marker: PhantomData,
        }
    }
}

impl GaussianCameraGAURAST<'_> {
    setters! {
        model: GaussianCameraModelGAURAST,
        rotation: [f32; 9],
        eye: [f64; 3],
        focal_length: [f32; 2],
        principal_point: [f32; 2],
        near_plane: f32,
        far_plane: f32,
        depth_coefficients: [f32; 2],
    }
}

/// `VkGaussianCameraDataGAURAST`: the camera as a uniform buffer holds it, 112 bytes.
///
/// The meaning is that of [`GaussianCameraGAURAST`]. The layout is this one whatever block layout
/// the shaders use, and it equals the std140 and std430 layouts of
///
/// ```glsl
/// uniform GaussianCamera {
///     dvec3 eye;               // offset 0
///     int model;               // 24
///     int reserved;            // 28
///     vec4 rotation[3];        // 32, 48, 64: rows; w is ignored
///     vec2 focalLength;        // 80
///     vec2 principalPoint;     // 88
///     vec2 depthCoefficients;  // 96
///     float nearPlane;         // 104
///     float farPlane;          // 108
/// };
/// ```
///
/// A shader without 64-bit floats writes the eye as three pairs of words, low word first.
#[repr(C)]
#[derive(Copy, Clone, Debug, PartialEq)]
#[must_use]
pub struct GaussianCameraDataGAURAST {
    /// As [`GaussianCameraGAURAST::eye`].
    pub eye: [f64; 3],
    /// As [`GaussianCameraGAURAST::model`].
    pub model: GaussianCameraModelGAURAST,
    /// Zero.
    pub reserved: u32,
    /// As [`GaussianCameraGAURAST::rotation`], a row each; the fourth components are ignored.
    pub rotation: [[f32; 4]; 3],
    /// As [`GaussianCameraGAURAST::focal_length`].
    pub focal_length: [f32; 2],
    /// As [`GaussianCameraGAURAST::principal_point`].
    pub principal_point: [f32; 2],
    /// As [`GaussianCameraGAURAST::depth_coefficients`].
    pub depth_coefficients: [f32; 2],
    /// As [`GaussianCameraGAURAST::near_plane`].
    pub near_plane: f32,
    /// As [`GaussianCameraGAURAST::far_plane`].
    pub far_plane: f32,
}

impl From<&GaussianCameraGAURAST<'_>> for GaussianCameraDataGAURAST {
    fn from(camera: &GaussianCameraGAURAST<'_>) -> Self {
        let [xx, xy, xz, yx, yy, yz, zx, zy, zz] = camera.rotation;
        Self {
            eye: camera.eye,
            model: camera.model,
            reserved: 0,
            rotation: [[xx, xy, xz, 0.0], [yx, yy, yz, 0.0], [zx, zy, zz, 0.0]],
            focal_length: camera.focal_length,
            principal_point: camera.principal_point,
            depth_coefficients: camera.depth_coefficients,
            near_plane: camera.near_plane,
            far_plane: camera.far_plane,
        }
    }
}

impl Default for GaussianCameraDataGAURAST {
    #[inline]
    fn default() -> Self {
        Self::from(&GaussianCameraGAURAST::default())
    }
}
