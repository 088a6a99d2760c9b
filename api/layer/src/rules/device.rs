//! The creation of a device.

use std::ffi::CStr;

use gaurast::gaussian_primitive_topology::NAME;

use crate::facts::Features;
use crate::report::Faults;

/// The features by name.
pub(crate) fn named(features: &Features) -> [(&'static str, bool); 30] {
    let f = features;
    [
        ("gaussianPrimitiveTopology", f.gaussian_primitive_topology),
        ("vertexShaderProjection", f.vertex_shader_projection),
        ("resolveFragmentShader", f.resolve_fragment_shader),
        ("radialDistanceOrder", f.radial_distance_order),
        ("primitiveOrder", f.primitive_order),
        ("perPixelOrder", f.per_pixel_order),
        ("rasterizationFloat16", f.rasterization_float16),
        ("opacityCompensation", f.opacity_compensation),
        ("orthographicCamera", f.orthographic_camera),
        ("fisheyeCamera", f.fisheye_camera),
        ("equirectangularCamera", f.equirectangular_camera),
        ("unscentedProjection", f.unscented_projection),
        ("gaussian2D", f.gaussian_2d),
        ("uniformBufferCamera", f.uniform_buffer_camera),
        ("mergedDraws", f.merged_draws),
        ("gaussianInstancing", f.gaussian_instancing),
        ("gaussianDepthStencil", f.gaussian_depth_stencil),
        ("gaussianMultisample", f.gaussian_multisample),
        ("gaussianApproximation", f.gaussian_approximation),
        ("gaussianMultiview", f.gaussian_multiview),
        ("attributeActivation", f.attribute_activation),
        ("sphericalHarmonicsBuffer", f.spherical_harmonics_buffer),
        ("gaussianDynamicState", f.gaussian_dynamic_state),
        ("resolveGaussianIndices", f.resolve_gaussian_indices),
        ("gaussianCutOff", f.gaussian_cut_off),
        ("opacityCompensationFloor", f.opacity_compensation_floor),
        ("gaussianDistortion", f.gaussian_distortion),
        ("unscentedParameters", f.unscented_parameters),
        ("attributeDecoding", f.attribute_decoding),
        ("gaussian2DCutOff", f.gaussian_2d_cut_off),
    ]
    .map(|(name, is_on)| (name, is_on != 0))
}

/// Checks what `vkCreateDevice` asks for.
pub(crate) fn check(extensions: &[&CStr], features: Option<&Features>, can: Option<&Features>, faults: &mut Faults) {
    let is_enabled = extensions.contains(&NAME);
    let on: Vec<&str> = features
        .map(|features| named(features).into_iter())
        .into_iter()
        .flatten()
        .filter_map(|(name, is_on)| is_on.then_some(name))
        .collect();
    if !is_enabled {
        if let Some(first) = on.first() {
            faults.error(
                "VUID-VkDeviceCreateInfo-pNext-pNext",
                format!("the feature {first} is enabled, but not its extension {}", NAME.to_string_lossy()),
            );
        }
        return;
    }
    if features.is_none() {
        faults.warning(
            "GAURAST-Device-no-features",
            "the extension is enabled, but the pNext chain of VkDeviceCreateInfo has no \
             VkPhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST: no feature is enabled, and no Gaussian can be \
             drawn. \
             If it was there, a layer above this one has dropped it: name this layer first, and tell \
             VK_LAYER_KHRONOS_validation of the extension's structures (docs/layer.md)",
        );
        return;
    }
    match on.first() {
        None => faults.warning(
            "GAURAST-Device-no-features",
            "the extension is enabled, but none of its features: gaussianPrimitiveTopology is what draws Gaussians",
        ),
        Some(first) if *first != "gaussianPrimitiveTopology" => faults.error(
            "VUID-VkPipelineGaussianStateCreateInfoGAURAST-gaussianPrimitiveTopology-90032",
            format!("the feature {first} is enabled without gaussianPrimitiveTopology, which every other one requires"),
        ),
        Some(_) => {}
    }
    let Some(can) = can else { return };
    let absent = named(can).into_iter().find(|(name, can)| !can && on.contains(name));
    if let Some((name, _)) = absent {
        faults.error(
            "VUID-VkDeviceCreateInfo-pNext-features",
            format!("the feature {name} is enabled, which the physical device does not support"),
        );
    }
}
