//! What a physical device supports: features and properties.

use core::ffi::c_void;
use core::marker::PhantomData;

use ash::vk::{Bool32, Extent2D, SampleCountFlags, StructureType, TaggedStructure};

use crate::ash_compat::setters;

/// `VkPhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST`: one bit per optional mode.
///
/// Chain it to `VkPhysicalDeviceFeatures2` to ask, to `VkDeviceCreateInfo` to enable.
#[repr(C)]
#[derive(Copy, Clone, Debug)]
#[must_use]
pub struct PhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST<'a> {
    /// The structure's type.
    pub s_type: StructureType,
    /// The next structure of the chain, or null.
    pub p_next: *mut c_void,
    /// The Gaussian list topology, with everything that no other bit gates: fixed-function
    /// projection of 3D Gaussians by the Jacobian through a pinhole camera set by command, view
    /// depth order, binary32, dilation. Every other bit requires this one.
    pub gaussian_primitive_topology: Bool32,
    /// [`GaussianProjectionModeGAURAST::VERTEX_SHADER`](crate::vk::GaussianProjectionModeGAURAST::VERTEX_SHADER).
    pub vertex_shader_projection: Bool32,
    /// A fragment stage in Gaussian pipelines: the resolve shader.
    pub resolve_fragment_shader: Bool32,
    /// [`GaussianOrderGAURAST::RADIAL_DISTANCE`](crate::vk::GaussianOrderGAURAST::RADIAL_DISTANCE).
    pub radial_distance_order: Bool32,
    /// [`GaussianOrderGAURAST::PRIMITIVE`](crate::vk::GaussianOrderGAURAST::PRIMITIVE).
    pub primitive_order: Bool32,
    /// [`GaussianOrderGAURAST::PER_PIXEL`](crate::vk::GaussianOrderGAURAST::PER_PIXEL).
    pub per_pixel_order: Bool32,
    /// [`GaussianPrecisionGAURAST::FLOAT16`](crate::vk::GaussianPrecisionGAURAST::FLOAT16).
    pub rasterization_float16: Bool32,
    /// [`GaussianAntialiasingGAURAST::OPACITY_COMPENSATED`](crate::vk::GaussianAntialiasingGAURAST::OPACITY_COMPENSATED).
    pub opacity_compensation: Bool32,
    /// [`GaussianCameraModelGAURAST::ORTHOGRAPHIC`](crate::vk::GaussianCameraModelGAURAST::ORTHOGRAPHIC).
    pub orthographic_camera: Bool32,
    /// [`GaussianCameraModelGAURAST::FISHEYE`](crate::vk::GaussianCameraModelGAURAST::FISHEYE).
    pub fisheye_camera: Bool32,
    /// [`GaussianCameraModelGAURAST::EQUIRECTANGULAR`](crate::vk::GaussianCameraModelGAURAST::EQUIRECTANGULAR).
    pub equirectangular_camera: Bool32,
    /// [`GaussianLinearizationGAURAST::UNSCENTED`](crate::vk::GaussianLinearizationGAURAST::UNSCENTED).
    pub unscented_projection: Bool32,
    /// [`GaussianGeometryGAURAST::GAUSSIAN_2D`](crate::vk::GaussianGeometryGAURAST::GAUSSIAN_2D).
    pub gaussian_2d: Bool32,
    /// [`GaussianCameraSourceGAURAST::UNIFORM_BUFFER`](crate::vk::GaussianCameraSourceGAURAST::UNIFORM_BUFFER).
    pub uniform_buffer_camera: Bool32,
    /// [`PipelineGaussianStateCreateFlagsGAURAST::MERGE_DRAWS`](crate::vk::PipelineGaussianStateCreateFlagsGAURAST::MERGE_DRAWS).
    pub merged_draws: Bool32,
    /// The `first_model_matrix` and `model_opacity` attributes, which place and fade a whole model
    /// per instance. (Instanced draws without them need no feature.)
    pub gaussian_instancing: Bool32,
    /// Depth and stencil tests and writes in Gaussian pipelines.
    pub gaussian_depth_stencil: Bool32,
    /// Gaussian pipelines with more than one rasterization sample.
    pub gaussian_multisample: Bool32,
    /// [`PipelineGaussianApproximationStateCreateInfoGAURAST`](crate::vk::PipelineGaussianApproximationStateCreateInfoGAURAST)
    /// with numbers other than 0.
    pub gaussian_approximation: Bool32,
    /// The lifetime of the `p_next` chain.
    pub _marker: PhantomData<&'a ()>,
}

impl Default for PhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST<'_> {
    #[inline]
    fn default() -> Self {
        Self {
            s_type: Self::STRUCTURE_TYPE,
            p_next: core::ptr::null_mut(),
            gaussian_primitive_topology: Bool32::default(),
            vertex_shader_projection: Bool32::default(),
            resolve_fragment_shader: Bool32::default(),
            radial_distance_order: Bool32::default(),
            primitive_order: Bool32::default(),
            per_pixel_order: Bool32::default(),
            rasterization_float16: Bool32::default(),
            opacity_compensation: Bool32::default(),
            orthographic_camera: Bool32::default(),
            fisheye_camera: Bool32::default(),
            equirectangular_camera: Bool32::default(),
            unscented_projection: Bool32::default(),
            gaussian_2d: Bool32::default(),
            uniform_buffer_camera: Bool32::default(),
            merged_draws: Bool32::default(),
            gaussian_instancing: Bool32::default(),
            gaussian_depth_stencil: Bool32::default(),
            gaussian_multisample: Bool32::default(),
            gaussian_approximation: Bool32::default(),
            _marker: PhantomData,
        }
    }
}

impl PhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST<'_> {
    setters! {
        gaussian_primitive_topology: bool,
        vertex_shader_projection: bool,
        resolve_fragment_shader: bool,
        radial_distance_order: bool,
        primitive_order: bool,
        per_pixel_order: bool,
        rasterization_float16: bool,
        opacity_compensation: bool,
        orthographic_camera: bool,
        fisheye_camera: bool,
        equirectangular_camera: bool,
        unscented_projection: bool,
        gaussian_2d: bool,
        uniform_buffer_camera: bool,
        merged_draws: bool,
        gaussian_instancing: bool,
        gaussian_depth_stencil: bool,
        gaussian_multisample: bool,
        gaussian_approximation: bool,
    }
}

/// `VkPhysicalDeviceGaussianPrimitiveTopologyPropertiesGAURAST`: the device's shape and limits.
///
/// Chain it to `VkPhysicalDeviceProperties2`. Vertex attributes are limited as ever by
/// `maxVertexInputAttributes`, which is at least 32: degree 3 takes 20 locations, degree 4 takes 29.
#[repr(C)]
#[derive(Copy, Clone, Debug)]
#[must_use]
pub struct PhysicalDeviceGaussianPrimitiveTopologyPropertiesGAURAST<'a> {
    /// The structure's type.
    pub s_type: StructureType,
    /// The next structure of the chain, or null.
    pub p_next: *mut c_void,
    /// The tile for which the device keeps one list of Gaussians, in pixels. A hint: no image
    /// depends on it.
    pub tile_size: Extent2D,
    /// How many rasterizer modules the device has. A module works on one tile at a time.
    pub rasterizer_module_count: u32,
    /// How many processing elements each rasterizer module has.
    pub processing_element_count: u32,
    /// The greatest `spherical_harmonics_degree` of a pipeline; at least 3.
    pub max_spherical_harmonics_degree: u32,
    /// The sample counts that Gaussian pipelines may use; only `TYPE_1` without
    /// `gaussian_multisample`.
    pub gaussian_sample_counts: SampleCountFlags,
    /// The most Gaussians, over all instances, of one draw.
    pub max_gaussians_per_draw: u64,
    /// The most Gaussians of all the draws that share one sorted set.
    pub max_gaussians_per_set: u64,
    /// The lifetime of the `p_next` chain.
    pub _marker: PhantomData<&'a ()>,
}

impl Default for PhysicalDeviceGaussianPrimitiveTopologyPropertiesGAURAST<'_> {
    #[inline]
    fn default() -> Self {
        Self {
            s_type: Self::STRUCTURE_TYPE,
            p_next: core::ptr::null_mut(),
            tile_size: Extent2D::default(),
            rasterizer_module_count: u32::default(),
            processing_element_count: u32::default(),
            max_spherical_harmonics_degree: u32::default(),
            gaussian_sample_counts: SampleCountFlags::default(),
            max_gaussians_per_draw: u64::default(),
            max_gaussians_per_set: u64::default(),
            _marker: PhantomData,
        }
    }
}

impl PhysicalDeviceGaussianPrimitiveTopologyPropertiesGAURAST<'_> {
    setters! {
        tile_size: Extent2D,
        rasterizer_module_count: u32,
        processing_element_count: u32,
        max_spherical_harmonics_degree: u32,
        gaussian_sample_counts: SampleCountFlags,
        max_gaussians_per_draw: u64,
        max_gaussians_per_set: u64,
    }
}
