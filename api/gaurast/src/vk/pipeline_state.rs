//! The state of a pipeline whose topology is the Gaussian list.

use core::ffi::c_void;
use core::marker::PhantomData;

use ash::vk::{StructureType, TaggedStructure};

use super::enums::*;
use crate::ash_compat::setters;

/// `VkGaussianAttributeLocationsGAURAST`: the vertex attributes that are a 3D Gaussian, by location.
///
/// Used with [`GaussianProjectionModeGAURAST::FIXED_FUNCTION`]. Any vertex format with at least as
/// many components as the attribute has will do, so half floats and normalised bytes compress;
/// further components are ignored. Attributes may be per vertex or per instance. The default has
/// every location unused.
#[repr(C)]
#[derive(Copy, Clone, Debug, PartialEq, Eq, Hash)]
#[must_use]
pub struct GaussianAttributeLocationsGAURAST {
    /// The mean p, 3 components, in world space (or model space, with a model matrix). Required.
    pub position: u32,
    /// The standard deviations along the Gaussian's own axes, 3 components, in units of length:
    /// linear, so exp of what trained files hold. Required. A 2D Gaussian reads the first two.
    pub scale: u32,
    /// The rotation from the Gaussian's own axes to those of `position`, a quaternion of 4
    /// components in the order w, x, y, z, as trained files hold it. It need not be normalised;
    /// the device normalises. Required.
    pub rotation: u32,
    /// The opacity, 1 component: linear, so the sigmoid of what trained files hold. Required.
    pub opacity: u32,
    /// The first of the (degree + 1)^2 consecutive locations of the spherical harmonics'
    /// coefficients, each 3 components (red, green, blue), in the order and with the signs of 3DGS.
    /// The colour is max(0, 0.5 + SH(direction from the eye) . k). Required.
    pub first_spherical_harmonics: u32,
    /// The first of 3 consecutive locations of 4 components each: the rows of a 3x4 matrix from
    /// model to world space, as in `VkTransformMatrixKHR`; usually per instance. What a Gaussian
    /// looks like turns with it; one whose matrix is singular is not drawn. Unused means the
    /// identity. Needs `gaussianInstancing`.
    pub first_model_matrix: u32,
    /// A factor of the opacity, 1 component, usually per instance. Unused means 1. Needs
    /// `gaussianInstancing`.
    pub model_opacity: u32,
}

impl Default for GaussianAttributeLocationsGAURAST {
    #[inline]
    fn default() -> Self {
        Self {
            position: GAUSSIAN_LOCATION_UNUSED_GAURAST,
            scale: GAUSSIAN_LOCATION_UNUSED_GAURAST,
            rotation: GAUSSIAN_LOCATION_UNUSED_GAURAST,
            opacity: GAUSSIAN_LOCATION_UNUSED_GAURAST,
            first_spherical_harmonics: GAUSSIAN_LOCATION_UNUSED_GAURAST,
            first_model_matrix: GAUSSIAN_LOCATION_UNUSED_GAURAST,
            model_opacity: GAUSSIAN_LOCATION_UNUSED_GAURAST,
        }
    }
}

impl GaussianAttributeLocationsGAURAST {
    setters! {
        position: u32,
        scale: u32,
        rotation: u32,
        opacity: u32,
        first_spherical_harmonics: u32,
        first_model_matrix: u32,
        model_opacity: u32,
    }
}

/// `VkGaussianVertexOutputLocationsGAURAST`: the vertex shader's outputs that are a projected
/// Gaussian, by location.
///
/// Used with [`GaussianProjectionModeGAURAST::VERTEX_SHADER`]. The mean and the fragment depth come
/// from `gl_Position`, by division and the viewport; no camera is read, and a Gaussian whose centre
/// lies outside the clip volume in depth (0 <= z <= w) or has w <= 0 is skipped. The locations that
/// are used must differ from one another. The default has every location unused.
#[repr(C)]
#[derive(Copy, Clone, Debug, PartialEq, Eq, Hash)]
#[must_use]
pub struct GaussianVertexOutputLocationsGAURAST {
    /// The 2D covariance, a `vec3` (xx, xy, yy) in px^2 along the framebuffer's axes, before the
    /// low-pass variance is added. Required.
    pub covariance: u32,
    /// The opacity, a `float`. Required.
    pub opacity: u32,
    /// The colour, a `vec3`, which is taken as it is written. Required.
    pub color: u32,
    /// The key by which Gaussians are ordered, ascending, a `float`. Unused means `gl_Position.w`,
    /// which an order by radial distance does not allow.
    pub depth_key: u32,
}

impl Default for GaussianVertexOutputLocationsGAURAST {
    #[inline]
    fn default() -> Self {
        Self {
            covariance: GAUSSIAN_LOCATION_UNUSED_GAURAST,
            opacity: GAUSSIAN_LOCATION_UNUSED_GAURAST,
            color: GAUSSIAN_LOCATION_UNUSED_GAURAST,
            depth_key: GAUSSIAN_LOCATION_UNUSED_GAURAST,
        }
    }
}

impl GaussianVertexOutputLocationsGAURAST {
    setters! {
        covariance: u32,
        opacity: u32,
        color: u32,
        depth_key: u32,
    }
}

/// `VkGaussianResolveInputLocationsGAURAST`: the resolve shader's inputs, by location.
///
/// Used when the pipeline has a fragment stage, which then runs once per covered pixel in place of
/// writing (C, 1 - T) to location 0. Needs `resolveFragmentShader`. The default has every location
/// unused.
#[repr(C)]
#[derive(Copy, Clone, Debug, PartialEq, Eq, Hash)]
#[must_use]
pub struct GaussianResolveInputLocationsGAURAST {
    /// The accumulated colour and alpha, a `vec4`: (C, 1 - T), premultiplied.
    pub accumulated_color: u32,
    /// The expected and the median fragment depth, a `vec2`: the mean of the Gaussians that
    /// contributed, weighted by T alpha; and the depth of the Gaussian at which T falls below one
    /// half, or of the last one that contributed.
    pub depth: u32,
}

impl Default for GaussianResolveInputLocationsGAURAST {
    #[inline]
    fn default() -> Self {
        Self {
            accumulated_color: GAUSSIAN_LOCATION_UNUSED_GAURAST,
            depth: GAUSSIAN_LOCATION_UNUSED_GAURAST,
        }
    }
}

impl GaussianResolveInputLocationsGAURAST {
    setters! {
        accumulated_color: u32,
        depth: u32,
    }
}

/// `VkPipelineGaussianStateCreateInfoGAURAST`: how a pipeline draws Gaussians.
///
/// Chain it to `VkGraphicsPipelineCreateInfo`. A pipeline of the Gaussian list topology without it
/// fails creation with `VK_ERROR_VALIDATION_FAILED_EXT`. The default is what the original 3DGS code
/// draws, of degree 0 and with every location unused.
#[repr(C)]
#[derive(Copy, Clone, Debug)]
#[must_use]
pub struct PipelineGaussianStateCreateInfoGAURAST<'a> {
    /// The structure's type.
    pub s_type: StructureType,
    /// The next structure of the chain, or null.
    pub p_next: *const c_void,
    /// Whether draws share a sorted set.
    pub flags: PipelineGaussianStateCreateFlagsGAURAST,
    /// Whether the device or a vertex shader projects.
    pub projection_mode: GaussianProjectionModeGAURAST,
    /// What a Gaussian is in space. Fixed-function projection only.
    pub geometry: GaussianGeometryGAURAST,
    /// How its covariance is projected. Fixed-function projection only.
    pub linearization: GaussianLinearizationGAURAST,
    /// The degree of the spherical harmonics, which have (degree + 1)^2 coefficients; at most
    /// `max_spherical_harmonics_degree`. Fixed-function projection only.
    pub spherical_harmonics_degree: u32,
    /// Where a 3D Gaussian's numbers come from. Fixed-function projection only.
    pub attribute_locations: GaussianAttributeLocationsGAURAST,
    /// Where a projected Gaussian's numbers come from. Vertex-shader projection only.
    pub vertex_output_locations: GaussianVertexOutputLocationsGAURAST,
    /// Where the resolve shader finds its inputs. Only where there is a fragment stage.
    pub resolve_input_locations: GaussianResolveInputLocationsGAURAST,
    /// The order in which Gaussians are accumulated.
    pub order: GaussianOrderGAURAST,
    /// The rasterizer's arithmetic.
    pub precision: GaussianPrecisionGAURAST,
    /// What the low-pass variance does to opacity.
    pub antialiasing: GaussianAntialiasingGAURAST,
    /// What is added to the diagonal of each projected covariance, in px^2; finite and not
    /// negative. 0.3 by default.
    pub low_pass_variance: f32,
    /// A Gaussian contributes to a pixel where its alpha is at least this; in \[0, 1\]. With 0 it
    /// contributes wherever its alpha does not underflow binary32. 1/255 by default.
    pub alpha_floor: f32,
    /// Alpha is limited to this; in (0, 1], and not below `alpha_floor`. 0.99 by default.
    pub alpha_ceiling: f32,
    /// A pixel is finished before the Gaussian that would bring its transmittance below this; in
    /// [0, 1). 0.0001 by default.
    pub transmittance_floor: f32,
    /// Where draws take their camera from. Fixed-function projection only.
    pub camera_source: GaussianCameraSourceGAURAST,
    /// The descriptor set of the camera's uniform buffer. Camera source `UNIFORM_BUFFER` only.
    pub camera_set: u32,
    /// The binding of the camera's uniform buffer, which holds a
    /// [`GaussianCameraDataGAURAST`](crate::vk::GaussianCameraDataGAURAST) at its start. The
    /// pipeline layout must have it as a (dynamic) uniform buffer visible to the vertex stage.
    /// Camera source `UNIFORM_BUFFER` only.
    pub camera_binding: u32,
    /// The lifetime of the `p_next` chain.
    pub _marker: PhantomData<&'a ()>,
}

impl Default for PipelineGaussianStateCreateInfoGAURAST<'_> {
    #[inline]
    fn default() -> Self {
        Self {
            s_type: Self::STRUCTURE_TYPE,
            p_next: core::ptr::null(),
            flags: PipelineGaussianStateCreateFlagsGAURAST::empty(),
            projection_mode: GaussianProjectionModeGAURAST::FIXED_FUNCTION,
            geometry: GaussianGeometryGAURAST::GAUSSIAN_3D,
            linearization: GaussianLinearizationGAURAST::JACOBIAN,
            spherical_harmonics_degree: 0,
            attribute_locations: GaussianAttributeLocationsGAURAST::default(),
            vertex_output_locations: GaussianVertexOutputLocationsGAURAST::default(),
            resolve_input_locations: GaussianResolveInputLocationsGAURAST::default(),
            order: GaussianOrderGAURAST::VIEW_DEPTH,
            precision: GaussianPrecisionGAURAST::FLOAT32,
            antialiasing: GaussianAntialiasingGAURAST::DILATE,
            low_pass_variance: 0.3,
            alpha_floor: 1.0 / 255.0,
            alpha_ceiling: 0.99,
            transmittance_floor: 1e-4,
            camera_source: GaussianCameraSourceGAURAST::COMMAND,
            camera_set: 0,
            camera_binding: 0,
            _marker: PhantomData,
        }
    }
}

impl PipelineGaussianStateCreateInfoGAURAST<'_> {
    setters! {
        flags: PipelineGaussianStateCreateFlagsGAURAST,
        projection_mode: GaussianProjectionModeGAURAST,
        geometry: GaussianGeometryGAURAST,
        linearization: GaussianLinearizationGAURAST,
        spherical_harmonics_degree: u32,
        attribute_locations: GaussianAttributeLocationsGAURAST,
        vertex_output_locations: GaussianVertexOutputLocationsGAURAST,
        resolve_input_locations: GaussianResolveInputLocationsGAURAST,
        order: GaussianOrderGAURAST,
        precision: GaussianPrecisionGAURAST,
        antialiasing: GaussianAntialiasingGAURAST,
        low_pass_variance: f32,
        alpha_floor: f32,
        alpha_ceiling: f32,
        transmittance_floor: f32,
        camera_source: GaussianCameraSourceGAURAST,
        camera_set: u32,
        camera_binding: u32,
    }
}
