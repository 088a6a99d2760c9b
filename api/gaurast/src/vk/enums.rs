//! Enum values in the extension's block, the extension's own enums and its flags.

use ash::vk::{Flags, PrimitiveTopology, StructureType};

use crate::ash_compat::vk_enum;

/// The first value of the extension's block: 1000000000 + (extension number - 1) * 1000.
const FIRST_VALUE: i32 = 1_000_997_000;

/// `VK_PRIMITIVE_TOPOLOGY_GAUSSIAN_LIST_GAURAST`: one vertex is one Gaussian.
///
/// A topology class of its own: no tessellation, geometry or mesh stages and no primitive restart.
/// The pipeline must chain a
/// [`PipelineGaussianStateCreateInfoGAURAST`](crate::vk::PipelineGaussianStateCreateInfoGAURAST).
pub const PRIMITIVE_TOPOLOGY_GAUSSIAN_LIST_GAURAST: PrimitiveTopology =
    PrimitiveTopology::from_raw(FIRST_VALUE);

/// `VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_GAUSSIAN_PRIMITIVE_TOPOLOGY_FEATURES_GAURAST`.
pub const STRUCTURE_TYPE_PHYSICAL_DEVICE_GAUSSIAN_PRIMITIVE_TOPOLOGY_FEATURES_GAURAST:
    StructureType = StructureType::from_raw(FIRST_VALUE);

/// `VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_GAUSSIAN_PRIMITIVE_TOPOLOGY_PROPERTIES_GAURAST`.
pub const STRUCTURE_TYPE_PHYSICAL_DEVICE_GAUSSIAN_PRIMITIVE_TOPOLOGY_PROPERTIES_GAURAST:
    StructureType = StructureType::from_raw(FIRST_VALUE + 1);

/// `VK_STRUCTURE_TYPE_PIPELINE_GAUSSIAN_STATE_CREATE_INFO_GAURAST`.
pub const STRUCTURE_TYPE_PIPELINE_GAUSSIAN_STATE_CREATE_INFO_GAURAST: StructureType =
    StructureType::from_raw(FIRST_VALUE + 2);

/// `VK_STRUCTURE_TYPE_GAUSSIAN_CAMERA_GAURAST`.
pub const STRUCTURE_TYPE_GAUSSIAN_CAMERA_GAURAST: StructureType =
    StructureType::from_raw(FIRST_VALUE + 3);

/// `VK_STRUCTURE_TYPE_PIPELINE_GAUSSIAN_APPROXIMATION_STATE_CREATE_INFO_GAURAST`.
pub const STRUCTURE_TYPE_PIPELINE_GAUSSIAN_APPROXIMATION_STATE_CREATE_INFO_GAURAST: StructureType =
    StructureType::from_raw(FIRST_VALUE + 4);

/// `VK_GAUSSIAN_LOCATION_UNUSED_GAURAST`: a location that the pipeline does not use.
pub const GAUSSIAN_LOCATION_UNUSED_GAURAST: u32 = u32::MAX;

vk_enum! {
    /// `VkGaussianProjectionModeGAURAST`: where the nine numbers that the rasterizer takes per
    /// Gaussian (mean 2, covariance 3, opacity 1, colour 3) come from.
    pub struct GaussianProjectionModeGAURAST {
        /// The vertex attributes are the 3D Gaussian itself, and the device projects it. The
        /// pipeline has no vertex stage.
        FIXED_FUNCTION = 0,
        /// A vertex shader runs once per Gaussian and writes the projected one to `gl_Position` and
        /// to outputs at the locations that the pipeline names. Needs `vertexShaderProjection`.
        VERTEX_SHADER = 1,
    }
}

vk_enum! {
    /// `VkGaussianGeometryGAURAST`: what a fixed-function Gaussian is in space.
    pub struct GaussianGeometryGAURAST {
        /// A volume with three standard deviations (3DGS).
        GAUSSIAN_3D = 0,
        /// A flat disc (surfel) with two standard deviations, along the rotated x and y axes
        /// (2DGS), evaluated where each pixel's ray meets its plane; the scale attribute's third
        /// component is not read. Seen by pinhole and orthographic cameras, with dilation only.
        /// Needs `gaussian2D`.
        GAUSSIAN_2D = 1,
    }
}

vk_enum! {
    /// `VkGaussianLinearizationGAURAST`: how a 3D covariance becomes a 2D one.
    pub struct GaussianLinearizationGAURAST {
        /// By the projection's Jacobian at the mean (EWA splatting, as in 3DGS).
        JACOBIAN = 0,
        /// By the unscented transform, from projected sigma points (alpha 1, beta 2, kappa 0, as in 3DGUT); by the
        /// Jacobian where some point is not seen. Needs `unscentedProjection`.
        UNSCENTED = 1,
    }
}

vk_enum! {
    /// `VkGaussianOrderGAURAST`: the order, front to back, in which a draw's Gaussians are
    /// accumulated. Ties are broken by draw, instance and position in the draw.
    pub struct GaussianOrderGAURAST {
        /// Ascending depth variable z of the camera's model, or the vertex shader's depth key.
        VIEW_DEPTH = 0,
        /// Ascending distance from the eye. Needs `radialDistanceOrder`.
        RADIAL_DISTANCE = 1,
        /// The order of the draw: the application has sorted. Needs `primitiveOrder`.
        PRIMITIVE = 2,
        /// At each pixel, ascending depth of the Gaussian's peak along that pixel's ray: an exact
        /// sort, in which nothing pops as the camera turns. Fixed-function projection only. Needs
        /// `perPixelOrder`.
        PER_PIXEL = 3,
    }
}

vk_enum! {
    /// `VkGaussianPrecisionGAURAST`: the rasterizer's arithmetic.
    pub struct GaussianPrecisionGAURAST {
        /// binary32.
        FLOAT32 = 0,
        /// binary16 evaluation and accumulation, of 3D Gaussians in another order than `PER_PIXEL`.
        /// Needs `rasterizationFloat16`.
        FLOAT16 = 1,
    }
}

vk_enum! {
    /// `VkGaussianAntialiasingGAURAST`: what the low-pass variance does to a Gaussian's opacity.
    pub struct GaussianAntialiasingGAURAST {
        /// Nothing: the Gaussian is dilated and grows brighter, as in 3DGS.
        DILATE = 0,
        /// The opacity is multiplied by the square root of the determinants' ratio before and after
        /// the low-pass, so that the integral is kept. Needs `opacityCompensation`.
        OPACITY_COMPENSATED = 1,
    }
}

vk_enum! {
    /// `VkGaussianCameraSourceGAURAST`: where a pipeline's draws take their camera from.
    pub struct GaussianCameraSourceGAURAST {
        /// From the command buffer's state, set by `vkCmdSetGaussianCameraGAURAST`.
        COMMAND = 0,
        /// From a uniform buffer, read when the draw executes: reused command buffers and cameras
        /// written by shaders need this. Needs `uniformBufferCamera`.
        UNIFORM_BUFFER = 1,
    }
}

vk_enum! {
    /// `VkGaussianCameraModelGAURAST`: how a point t in camera axes (+x right, +y down, +z forward)
    /// becomes a pixel, with focal length (fx, fy) and principal point (cx, cy).
    pub struct GaussianCameraModelGAURAST {
        /// (fx t.x/t.z + cx, fy t.y/t.z + cy); the depth variable z is t.z. Focal length in pixels.
        PINHOLE = 0,
        /// (fx t.x + cx, fy t.y + cy); the depth variable z is t.z. Focal length in pixels per unit
        /// of length. Needs `orthographicCamera`.
        ORTHOGRAPHIC = 1,
        /// Equidistant fisheye: (fx a t.x/r + cx, fy a t.y/r + cy), where r = |t.xy| and
        /// a = atan2(r, t.z); the depth variable z is |t|. Focal length in pixels per radian. Needs
        /// `fisheyeCamera`.
        FISHEYE = 2,
        /// (fx atan2(t.x, t.z) + cx, fy atan2(t.y, |t.xz|) + cy); the depth variable z is |t|.
        /// Focal length in pixels per radian. Needs `equirectangularCamera`.
        EQUIRECTANGULAR = 3,
    }
}

/// `VkPipelineGaussianStateCreateFlagsGAURAST`: a pipeline's switches.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(transparent)]
pub struct PipelineGaussianStateCreateFlagsGAURAST(Flags);

#[expect(
    missing_docs,
    reason = "ash's macro leaves what it writes undocumented"
)]
const _: () = {
    ash::vk_bitflags_wrapped!(PipelineGaussianStateCreateFlagsGAURAST, Flags);
};

impl PipelineGaussianStateCreateFlagsGAURAST {
    /// Consecutive draws with this pipeline share one sorted set, as if they were one draw.
    ///
    /// Between them only vertex buffers, the index buffer, and (with vertex-shader projection)
    /// descriptor sets and push constants may change; any other state change, command or draw, and
    /// the end of the subpass, ends the set. Needs `mergedDraws`.
    pub const MERGE_DRAWS: Self = Self(0b1);
}

impl core::fmt::Debug for PipelineGaussianStateCreateFlagsGAURAST {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let unnamed = *self & !Self::MERGE_DRAWS;
        match (self.contains(Self::MERGE_DRAWS), unnamed.is_empty()) {
            (true, true) => f.write_str("MERGE_DRAWS"),
            (true, false) => write!(f, "MERGE_DRAWS | {:b}", unnamed.0),
            (false, true) => Ok(()),
            (false, false) => write!(f, "{:b}", unnamed.0),
        }
    }
}
