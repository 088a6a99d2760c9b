//! The C header says what the Rust structures say: sizes, offsets and values, as C11 and as C++17.

use ash::vk::TaggedStructure;
use core::mem::offset_of;
use gaurast::vk::*;
use gaurast_runner::Need;
use std::process::Command;

/// Expressions of C with the values that they must have.
fn expectations() -> Vec<(String, i64)> {
    let mut all = Vec::new();
    macro_rules! structure {
        ($c:literal, $rust:ty { $($c_field:literal: $field:ident),* $(,)? }) => {
            all.push((format!("sizeof({})", $c), size_of::<$rust>() as i64));
            $(all.push((format!("offsetof({}, {})", $c, $c_field), offset_of!($rust, $field) as i64));)*
        };
    }
    structure!("VkPhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST",
    PhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST<'_> {
        "sType": s_type, "pNext": p_next,
        "gaussianPrimitiveTopology": gaussian_primitive_topology,
        "vertexShaderProjection": vertex_shader_projection,
        "resolveFragmentShader": resolve_fragment_shader,
        "radialDistanceOrder": radial_distance_order,
        "primitiveOrder": primitive_order,
        "perPixelOrder": per_pixel_order,
        "rasterizationFloat16": rasterization_float16,
        "opacityCompensation": opacity_compensation,
        "orthographicCamera": orthographic_camera,
        "fisheyeCamera": fisheye_camera,
        "equirectangularCamera": equirectangular_camera,
        "unscentedProjection": unscented_projection,
        "gaussian2D": gaussian_2d,
        "uniformBufferCamera": uniform_buffer_camera,
        "mergedDraws": merged_draws,
        "gaussianInstancing": gaussian_instancing,
        "gaussianDepthStencil": gaussian_depth_stencil,
        "gaussianMultisample": gaussian_multisample,
        "gaussianApproximation": gaussian_approximation,
    });
    structure!("VkPhysicalDeviceGaussianPrimitiveTopologyPropertiesGAURAST",
    PhysicalDeviceGaussianPrimitiveTopologyPropertiesGAURAST<'_> {
        "tileSize": tile_size,
        "rasterizerModuleCount": rasterizer_module_count,
        "processingElementCount": processing_element_count,
        "maxSphericalHarmonicsDegree": max_spherical_harmonics_degree,
        "gaussianSampleCounts": gaussian_sample_counts,
        "maxGaussiansPerDraw": max_gaussians_per_draw,
        "maxGaussiansPerSet": max_gaussians_per_set,
    });
    structure!("VkGaussianAttributeLocationsGAURAST",
    GaussianAttributeLocationsGAURAST {
        "position": position, "scale": scale, "rotation": rotation, "opacity": opacity,
        "firstSphericalHarmonics": first_spherical_harmonics,
        "firstModelMatrix": first_model_matrix,
        "modelOpacity": model_opacity,
    });
    structure!("VkGaussianVertexOutputLocationsGAURAST",
    GaussianVertexOutputLocationsGAURAST {
        "covariance": covariance, "opacity": opacity, "color": color, "depthKey": depth_key,
    });
    structure!("VkGaussianResolveInputLocationsGAURAST",
    GaussianResolveInputLocationsGAURAST {
        "accumulatedColor": accumulated_color, "depth": depth,
    });
    structure!("VkPipelineGaussianStateCreateInfoGAURAST",
    PipelineGaussianStateCreateInfoGAURAST<'_> {
        "flags": flags,
        "projectionMode": projection_mode,
        "geometry": geometry,
        "linearization": linearization,
        "sphericalHarmonicsDegree": spherical_harmonics_degree,
        "attributeLocations": attribute_locations,
        "vertexOutputLocations": vertex_output_locations,
        "resolveInputLocations": resolve_input_locations,
        "order": order,
        "precision": precision,
        "antialiasing": antialiasing,
        "lowPassVariance": low_pass_variance,
        "alphaFloor": alpha_floor,
        "alphaCeiling": alpha_ceiling,
        "transmittanceFloor": transmittance_floor,
        "cameraSource": camera_source,
        "cameraSet": camera_set,
        "cameraBinding": camera_binding,
    });
    structure!("VkPipelineGaussianApproximationStateCreateInfoGAURAST",
    PipelineGaussianApproximationStateCreateInfoGAURAST<'_> {
        "sType": s_type, "pNext": p_next,
        "exponentialError": exponential_error,
        "contributionBudget": contribution_budget,
    });
    structure!("VkGaussianCameraGAURAST",
    GaussianCameraGAURAST<'_> {
        "model": model, "rotation": rotation, "eye": eye,
        "focalLength": focal_length, "principalPoint": principal_point,
        "nearPlane": near_plane, "farPlane": far_plane,
        "depthCoefficients": depth_coefficients,
    });
    structure!("VkGaussianCameraDataGAURAST",
    GaussianCameraDataGAURAST {
        "eye": eye, "model": model, "reserved": reserved, "rotation": rotation,
        "focalLength": focal_length, "principalPoint": principal_point,
        "depthCoefficients": depth_coefficients,
        "nearPlane": near_plane, "farPlane": far_plane,
    });
    macro_rules! values {
        ($($c:literal: $value:expr),* $(,)?) => {
            $(all.push((concat!("VK_", $c, "_GAURAST").to_owned(), i64::from($value)));)*
        };
    }
    values! {
        "PRIMITIVE_TOPOLOGY_GAUSSIAN_LIST": PRIMITIVE_TOPOLOGY_GAUSSIAN_LIST_GAURAST.as_raw(),
        "STRUCTURE_TYPE_PHYSICAL_DEVICE_GAUSSIAN_PRIMITIVE_TOPOLOGY_FEATURES":
            PhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST::STRUCTURE_TYPE.as_raw(),
        "STRUCTURE_TYPE_PHYSICAL_DEVICE_GAUSSIAN_PRIMITIVE_TOPOLOGY_PROPERTIES":
            PhysicalDeviceGaussianPrimitiveTopologyPropertiesGAURAST::STRUCTURE_TYPE.as_raw(),
        "STRUCTURE_TYPE_PIPELINE_GAUSSIAN_STATE_CREATE_INFO":
            PipelineGaussianStateCreateInfoGAURAST::STRUCTURE_TYPE.as_raw(),
        "STRUCTURE_TYPE_GAUSSIAN_CAMERA": GaussianCameraGAURAST::STRUCTURE_TYPE.as_raw(),
        "STRUCTURE_TYPE_PIPELINE_GAUSSIAN_APPROXIMATION_STATE_CREATE_INFO":
            PipelineGaussianApproximationStateCreateInfoGAURAST::STRUCTURE_TYPE.as_raw(),
        "GAUSSIAN_LOCATION_UNUSED": GAUSSIAN_LOCATION_UNUSED_GAURAST,
        "GAUSSIAN_PROJECTION_MODE_FIXED_FUNCTION": GaussianProjectionModeGAURAST::FIXED_FUNCTION.as_raw(),
        "GAUSSIAN_PROJECTION_MODE_VERTEX_SHADER": GaussianProjectionModeGAURAST::VERTEX_SHADER.as_raw(),
        "GAUSSIAN_GEOMETRY_GAUSSIAN_3D": GaussianGeometryGAURAST::GAUSSIAN_3D.as_raw(),
        "GAUSSIAN_GEOMETRY_GAUSSIAN_2D": GaussianGeometryGAURAST::GAUSSIAN_2D.as_raw(),
        "GAUSSIAN_LINEARIZATION_JACOBIAN": GaussianLinearizationGAURAST::JACOBIAN.as_raw(),
        "GAUSSIAN_LINEARIZATION_UNSCENTED": GaussianLinearizationGAURAST::UNSCENTED.as_raw(),
        "GAUSSIAN_ORDER_VIEW_DEPTH": GaussianOrderGAURAST::VIEW_DEPTH.as_raw(),
        "GAUSSIAN_ORDER_RADIAL_DISTANCE": GaussianOrderGAURAST::RADIAL_DISTANCE.as_raw(),
        "GAUSSIAN_ORDER_PRIMITIVE": GaussianOrderGAURAST::PRIMITIVE.as_raw(),
        "GAUSSIAN_ORDER_PER_PIXEL": GaussianOrderGAURAST::PER_PIXEL.as_raw(),
        "GAUSSIAN_PRECISION_FLOAT32": GaussianPrecisionGAURAST::FLOAT32.as_raw(),
        "GAUSSIAN_PRECISION_FLOAT16": GaussianPrecisionGAURAST::FLOAT16.as_raw(),
        "GAUSSIAN_ANTIALIASING_DILATE": GaussianAntialiasingGAURAST::DILATE.as_raw(),
        "GAUSSIAN_ANTIALIASING_OPACITY_COMPENSATED": GaussianAntialiasingGAURAST::OPACITY_COMPENSATED.as_raw(),
        "GAUSSIAN_CAMERA_SOURCE_COMMAND": GaussianCameraSourceGAURAST::COMMAND.as_raw(),
        "GAUSSIAN_CAMERA_SOURCE_UNIFORM_BUFFER": GaussianCameraSourceGAURAST::UNIFORM_BUFFER.as_raw(),
        "GAUSSIAN_CAMERA_MODEL_PINHOLE": GaussianCameraModelGAURAST::PINHOLE.as_raw(),
        "GAUSSIAN_CAMERA_MODEL_ORTHOGRAPHIC": GaussianCameraModelGAURAST::ORTHOGRAPHIC.as_raw(),
        "GAUSSIAN_CAMERA_MODEL_FISHEYE": GaussianCameraModelGAURAST::FISHEYE.as_raw(),
        "GAUSSIAN_CAMERA_MODEL_EQUIRECTANGULAR": GaussianCameraModelGAURAST::EQUIRECTANGULAR.as_raw(),
        "PIPELINE_GAUSSIAN_STATE_CREATE_MERGE_DRAWS_BIT": PipelineGaussianStateCreateFlagsGAURAST::MERGE_DRAWS.as_raw(),
    }
    all
}

const VULKAN_HEADER: Need = Need::File("/usr/include/vulkan/vulkan.h");

/// Asserts that a file compiles whose static assertions are the expectations.
fn compile(compiler: &str, flags: &[&str], name: &str, assertion: &str) {
    let mut source = String::from("#include <stddef.h>\n#include \"vulkan_gaurast.h\"\n");
    for (expression, value) in expectations() {
        source +=
            &format!("{assertion}((long long)({expression}) == {value}LL, \"{expression}\");\n");
    }
    let file = std::env::temp_dir().join(format!("{}-{name}", std::process::id()));
    std::fs::write(&file, source).expect("written");
    let include = concat!(env!("CARGO_MANIFEST_DIR"), "/../include");
    let output = Command::new(compiler)
        .args(flags)
        .args([
            "-Wall",
            "-Wextra",
            "-Wpedantic",
            "-Werror",
            "-fsyntax-only",
            "-I",
            include,
        ])
        .arg(&file)
        .output();
    std::fs::remove_file(&file).expect("removed");
    let output = output.expect("the compiler runs");
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
}

#[gaurast_runner::test(needs = [Need::Program("cc"), VULKAN_HEADER])]
fn the_header_is_c11() {
    compile("cc", &["-std=c11"], "layout.c", "_Static_assert");
}

#[gaurast_runner::test(needs = [Need::Program("c++"), VULKAN_HEADER])]
fn the_header_is_cpp17() {
    compile("c++", &["-std=c++17"], "layout.cpp", "static_assert");
}
