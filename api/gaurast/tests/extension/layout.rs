//! Tests that structures have the layout of their C declarations, and enums the values of the extension's block. The
//! numbers are written out, because C programs and layers depend on them.

use std::mem::{align_of, offset_of, size_of};

use gaurast::gaussian_primitive_topology::{EXTENSION_NUMBER, NAME, SPEC_VERSION};
use gaurast::vk::*;

/// Checks a structure's size, alignment and the offset of each field.
macro_rules! assert_layout {
    ($name:ty, $size:literal, $align:literal, { $($field:ident: $offset:literal,)* }) => {
        assert_eq!(size_of::<$name>(), $size, "size of {}", stringify!($name));
        assert_eq!(align_of::<$name>(), $align, "alignment of {}", stringify!($name));
        $(assert_eq!(offset_of!($name, $field), $offset, "offset of {}", stringify!($field));)*
    };
}

#[gaurast_runner::test]
fn features() {
    assert_layout!(PhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST<'_>, 136, 8, {
        s_type: 0,
        p_next: 8,
        gaussian_primitive_topology: 16,
        vertex_shader_projection: 20,
        resolve_fragment_shader: 24,
        radial_distance_order: 28,
        primitive_order: 32,
        per_pixel_order: 36,
        rasterization_float16: 40,
        opacity_compensation: 44,
        orthographic_camera: 48,
        fisheye_camera: 52,
        equirectangular_camera: 56,
        unscented_projection: 60,
        gaussian_2d: 64,
        uniform_buffer_camera: 68,
        merged_draws: 72,
        gaussian_instancing: 76,
        gaussian_depth_stencil: 80,
        gaussian_multisample: 84,
        gaussian_approximation: 88,
        gaussian_multiview: 92,
        attribute_activation: 96,
        spherical_harmonics_buffer: 100,
        gaussian_dynamic_state: 104,
        resolve_gaussian_indices: 108,
        gaussian_cut_off: 112,
        opacity_compensation_floor: 116,
        gaussian_distortion: 120,
        unscented_parameters: 124,
        attribute_decoding: 128,
        gaussian_2d_cut_off: 132,
    });
}

#[gaurast_runner::test]
fn decodings() {
    assert_layout!(PipelineGaussianDecodingStateCreateInfoGAURAST<'_>, 48, 8, {
        s_type: 0,
        p_next: 8,
        position: 16,
        signed_log_position: 20,
        scale: 24,
        rotation: 28,
        opacity: 32,
        color: 36,
        base_color: 40,
        spherical_harmonics: 44,
    });
    assert_layout!(GaussianDecodingTableGAURAST, 32, 8, {
        device_address: 0,
        size: 8,
        format: 16,
        stride: 20,
        chunk_size: 24,
    });
    assert_layout!(GaussianHarmonicsCodesGAURAST, 32, 8, {
        device_address: 0,
        size: 8,
        stride: 16,
        coefficient_stride: 20,
        component_stride: 24,
    });
    assert_layout!(GaussianHarmonicsLabelsGAURAST, 24, 8, {
        device_address: 0,
        size: 8,
        stride: 16,
    });
    assert_layout!(GaussianDecodingTablesGAURAST<'_>, 232, 8, {
        s_type: 0,
        p_next: 8,
        position: 16,
        scale: 48,
        opacity: 80,
        color: 112,
        spherical_harmonics: 144,
        codes: 176,
        labels: 208,
    });
}

#[gaurast_runner::test]
fn properties() {
    assert_layout!(PhysicalDeviceGaussianPrimitiveTopologyPropertiesGAURAST<'_>, 48, 8, {
        s_type: 0,
        p_next: 8,
        tile_size: 16,
        max_spherical_harmonics_degree: 24,
        gaussian_sample_counts: 28,
        max_gaussians_per_draw: 32,
        max_gaussians_per_set: 40,
    });
}

#[gaurast_runner::test]
fn driver_options() {
    assert_layout!(DriverOptionsGAURAST<'_>, 64, 8, {
        s_type: 0,
        p_next: 8,
        thread_count: 16,
        simd_level: 20,
        shader_timeout: 24,
        p_optimizations: 32,
        simulated_timestamps: 40,
        pfn_work_trace: 48,
        p_user_data: 56,
    });
}

#[gaurast_runner::test]
fn pipeline_state() {
    assert_layout!(GaussianAttributeLocationsGAURAST, 28, 4, {
        position: 0,
        scale: 4,
        rotation: 8,
        opacity: 12,
        first_spherical_harmonics: 16,
        first_model_matrix: 20,
        model_opacity: 24,
    });
    assert_layout!(GaussianVertexOutputLocationsGAURAST, 16, 4, {
        covariance: 0,
        opacity: 4,
        color: 8,
        depth_key: 12,
    });
    assert_layout!(GaussianResolveInputLocationsGAURAST, 24, 4, {
        accumulated_color: 0,
        depth: 4,
        linear_depth: 8,
        median_gaussian: 12,
        nearest_gaussian: 16,
        first_camera: 20,
    });
    assert_layout!(PipelineGaussianStateCreateInfoGAURAST<'_>, 152, 8, {
        s_type: 0,
        p_next: 8,
        flags: 16,
        projection_mode: 20,
        geometry: 24,
        linearization: 28,
        spherical_harmonics_degree: 32,
        attribute_locations: 36,
        vertex_output_locations: 64,
        resolve_input_locations: 80,
        order: 104,
        precision: 108,
        antialiasing: 112,
        low_pass_variance: 116,
        alpha_floor: 120,
        alpha_ceiling: 124,
        transmittance_floor: 128,
        camera_source: 132,
        camera_set: 136,
        camera_binding: 140,
        camera_count: 144,
    });
    assert_layout!(PipelineGaussianFootprintStateCreateInfoGAURAST<'_>, 32, 8, {
        s_type: 0,
        p_next: 8,
        cut_off: 16,
        cut_off_deviations: 20,
        compensation_floor: 24,
    });
    assert_layout!(PipelineGaussianUnscentedStateCreateInfoGAURAST<'_>, 40, 8, {
        s_type: 0,
        p_next: 8,
        alpha: 16,
        beta: 20,
        kappa: 24,
        picture_margin: 28,
        all_sigma_points: 32,
    });
    assert_layout!(PipelineGaussianApproximationStateCreateInfoGAURAST<'_>, 24, 8, {
        s_type: 0,
        p_next: 8,
        exponential_error: 16,
        contribution_budget: 20,
    });
}

#[gaurast_runner::test]
fn spherical_harmonics_buffer() {
    assert_layout!(GaussianSphericalHarmonicsBufferGAURAST<'_>, 48, 8, {
        s_type: 0,
        p_next: 8,
        device_address: 16,
        size: 24,
        format: 32,
        stride: 36,
        coefficient_stride: 40,
    });
}

#[gaurast_runner::test]
fn camera() {
    assert_layout!(GaussianCameraGAURAST<'_>, 112, 8, {
        s_type: 0,
        p_next: 8,
        eye: 16,
        model: 40,
        rotation: 44,
        focal_length: 80,
        principal_point: 88,
        depth_coefficients: 96,
        near_plane: 104,
        far_plane: 108,
    });
    assert_layout!(GaussianCameraDistortionGAURAST<'_>, 72, 8, {
        s_type: 0,
        p_next: 8,
        model: 16,
        radial: 20,
        tangential: 44,
        thin_prism: 52,
    });
    assert_layout!(GaussianCameraDataGAURAST, 128, 8, {
        eye: 0,
        model: 24,
        reserved: 28,
        rotation: 32,
        focal_length: 80,
        principal_point: 88,
        depth_coefficients: 96,
        near_plane: 104,
        far_plane: 108,
        padding: 112,
    });
}

#[gaurast_runner::test]
fn names_and_values() {
    assert_eq!(NAME.to_str(), Ok("VK_GAURAST_gaussian_primitive_topology"));
    assert_eq!(SPEC_VERSION, 3);
    let first = 1_000_000_000 + (EXTENSION_NUMBER as i32 - 1) * 1000;
    assert_eq!(first, 1_000_997_000);
    assert_eq!(PRIMITIVE_TOPOLOGY_GAUSSIAN_LIST_GAURAST.as_raw(), first);
    let structure_types = [
        STRUCTURE_TYPE_PHYSICAL_DEVICE_GAUSSIAN_PRIMITIVE_TOPOLOGY_FEATURES_GAURAST,
        STRUCTURE_TYPE_PHYSICAL_DEVICE_GAUSSIAN_PRIMITIVE_TOPOLOGY_PROPERTIES_GAURAST,
        STRUCTURE_TYPE_PIPELINE_GAUSSIAN_STATE_CREATE_INFO_GAURAST,
        STRUCTURE_TYPE_GAUSSIAN_CAMERA_GAURAST,
        STRUCTURE_TYPE_PIPELINE_GAUSSIAN_APPROXIMATION_STATE_CREATE_INFO_GAURAST,
        STRUCTURE_TYPE_GAUSSIAN_SPHERICAL_HARMONICS_BUFFER_GAURAST,
        STRUCTURE_TYPE_PIPELINE_GAUSSIAN_FOOTPRINT_STATE_CREATE_INFO_GAURAST,
        STRUCTURE_TYPE_GAUSSIAN_CAMERA_DISTORTION_GAURAST,
        STRUCTURE_TYPE_PIPELINE_GAUSSIAN_UNSCENTED_STATE_CREATE_INFO_GAURAST,
    ];
    for (offset, structure_type) in structure_types.into_iter().enumerate() {
        assert_eq!(structure_type.as_raw(), first + offset as i32);
    }
    assert_eq!(GAUSSIAN_LOCATION_UNUSED_GAURAST, u32::MAX);
}

#[gaurast_runner::test]
fn enum_values() {
    assert_eq!(GaussianProjectionModeGAURAST::VERTEX_SHADER.as_raw(), 1);
    assert_eq!(GaussianGeometryGAURAST::GAUSSIAN_2D.as_raw(), 1);
    assert_eq!(GaussianLinearizationGAURAST::UNSCENTED.as_raw(), 1);
    assert_eq!(GaussianOrderGAURAST::RADIAL_DISTANCE.as_raw(), 1);
    assert_eq!(GaussianOrderGAURAST::PRIMITIVE.as_raw(), 2);
    assert_eq!(GaussianOrderGAURAST::PER_PIXEL.as_raw(), 3);
    assert_eq!(GaussianPrecisionGAURAST::FLOAT16.as_raw(), 1);
    assert_eq!(GaussianAntialiasingGAURAST::OPACITY_COMPENSATED.as_raw(), 1);
    assert_eq!(GaussianCameraSourceGAURAST::UNIFORM_BUFFER.as_raw(), 1);
    assert_eq!(GaussianCameraModelGAURAST::ORTHOGRAPHIC.as_raw(), 1);
    assert_eq!(GaussianCameraModelGAURAST::FISHEYE.as_raw(), 2);
    assert_eq!(GaussianCameraModelGAURAST::EQUIRECTANGULAR.as_raw(), 3);
    assert_eq!(GaussianDistortionModelGAURAST::RATIONAL.as_raw(), 0);
    assert_eq!(GaussianDistortionModelGAURAST::POLYNOMIAL.as_raw(), 1);
    assert_eq!(GaussianDistortionModelGAURAST::POLYNOMIAL_FIRST.as_raw(), 2);
    assert_eq!(GaussianDistortionModelGAURAST::FIELD_OF_VIEW.as_raw(), 3);
    assert_eq!(GaussianDistortionModelGAURAST::DIVISION.as_raw(), 4);
}

#[gaurast_runner::test]
fn debug_prints_names_and_unknown_numbers() {
    assert_eq!(format!("{:?}", GaussianOrderGAURAST::PER_PIXEL), "PER_PIXEL");
    assert_eq!(format!("{:?}", GaussianOrderGAURAST::from_raw(77)), "77");
    let flags = PipelineGaussianStateCreateFlagsGAURAST::from_raw(0b1001);
    assert_eq!(format!("{flags:?}"), "LOG_SCALE | 1000");
}
