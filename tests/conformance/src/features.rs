//! The features that cases need, by the names of the extension's text and of Vulkan.

use ash::vk;
use gaurast::vk::PhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST as Features;
use gaurast::vk::{
    GaussianAntialiasingGAURAST as Antialiasing, GaussianCameraModelGAURAST as Model, GaussianCutOffGAURAST as CutOff,
    GaussianGeometryGAURAST as Geometry, GaussianLinearizationGAURAST as Linearization, GaussianOrderGAURAST as Order,
    GaussianPrecisionGAURAST as Precision, PipelineGaussianStateCreateFlagsGAURAST as Flags,
};

use crate::draw::Draw;

/// A feature of the extension: its name, and the bit of a device.
pub type Feature = (&'static str, fn(&Features<'_>) -> vk::Bool32);

/// All features of the extension, in the order of the structure.
pub const FEATURES: [Feature; 30] = [
    ("gaussianPrimitiveTopology", |has| has.gaussian_primitive_topology),
    ("vertexShaderProjection", |has| has.vertex_shader_projection),
    ("resolveFragmentShader", |has| has.resolve_fragment_shader),
    ("radialDistanceOrder", |has| has.radial_distance_order),
    ("primitiveOrder", |has| has.primitive_order),
    ("perPixelOrder", |has| has.per_pixel_order),
    ("rasterizationFloat16", |has| has.rasterization_float16),
    ("opacityCompensation", |has| has.opacity_compensation),
    ("orthographicCamera", |has| has.orthographic_camera),
    ("fisheyeCamera", |has| has.fisheye_camera),
    ("equirectangularCamera", |has| has.equirectangular_camera),
    ("unscentedProjection", |has| has.unscented_projection),
    ("gaussian2D", |has| has.gaussian_2d),
    ("uniformBufferCamera", |has| has.uniform_buffer_camera),
    ("mergedDraws", |has| has.merged_draws),
    ("gaussianInstancing", |has| has.gaussian_instancing),
    ("gaussianDepthStencil", |has| has.gaussian_depth_stencil),
    ("gaussianMultisample", |has| has.gaussian_multisample),
    ("gaussianApproximation", |has| has.gaussian_approximation),
    ("gaussianMultiview", |has| has.gaussian_multiview),
    ("attributeActivation", |has| has.attribute_activation),
    ("sphericalHarmonicsBuffer", |has| has.spherical_harmonics_buffer),
    ("gaussianDynamicState", |has| has.gaussian_dynamic_state),
    ("resolveGaussianIndices", |has| has.resolve_gaussian_indices),
    ("gaussianCutOff", |has| has.gaussian_cut_off),
    ("opacityCompensationFloor", |has| has.opacity_compensation_floor),
    ("gaussianDistortion", |has| has.gaussian_distortion),
    ("unscentedParameters", |has| has.unscented_parameters),
    ("attributeDecoding", |has| has.attribute_decoding),
    ("gaussian2DCutOff", |has| has.gaussian_2d_cut_off),
];

/// The names of the features that a draw needs.
pub fn needs(draw: &Draw) -> Vec<&'static str> {
    let state = &draw.state;
    let depth = draw.depth.as_ref();
    let footprint = draw.footprint.unwrap_or_default();
    let is_activated = [Flags::LOG_SCALE, Flags::LOGIT_OPACITY].iter().any(|flag| state.flags.contains(*flag));
    let needs = [
        (true, "gaussianPrimitiveTopology"),
        (state.order == Order::RADIAL_DISTANCE, "radialDistanceOrder"),
        (state.order == Order::PRIMITIVE, "primitiveOrder"),
        (state.order == Order::PER_PIXEL, "perPixelOrder"),
        (state.precision == Precision::FLOAT16, "rasterizationFloat16"),
        (state.antialiasing == Antialiasing::OPACITY_COMPENSATED, "opacityCompensation"),
        (draw.camera.model == Model::ORTHOGRAPHIC, "orthographicCamera"),
        (draw.camera.model == Model::FISHEYE, "fisheyeCamera"),
        (draw.camera.model == Model::EQUIRECTANGULAR, "equirectangularCamera"),
        (state.linearization == Linearization::UNSCENTED, "unscentedProjection"),
        (state.geometry == Geometry::GAUSSIAN_2D, "gaussian2D"),
        (draw.camera_in_buffer, "uniformBufferCamera"),
        (draw.merged, "mergedDraws"),
        (draw.instances.is_some(), "gaussianInstancing"),
        (depth.is_some_and(|d| d.test.is_some() || d.bounds.is_some() || d.stencil.is_some()), "gaussianDepthStencil"),
        (draw.samples > 1, "gaussianMultisample"),
        (draw.approximation.is_some_and(|numbers| numbers != [0.0; 2]), "gaussianApproximation"),
        (footprint.cut_off != CutOff::NONE, "gaussianCutOff"),
        (footprint.cut_off != CutOff::NONE && state.geometry == Geometry::GAUSSIAN_2D, "gaussian2DCutOff"),
        (footprint.compensation_floor != 0.0, "opacityCompensationFloor"),
        (draw.distortion.is_some(), "gaussianDistortion"),
        (draw.unscented.is_some(), "unscentedParameters"),
        (draw.shown.is_some(), "resolveFragmentShader"),
        (draw.shown.is_some(), "resolveGaussianIndices"),
        (is_activated, "attributeActivation"),
        (state.flags.contains(Flags::SPHERICAL_HARMONICS_BUFFER), "sphericalHarmonicsBuffer"),
    ];
    needs.iter().filter(|(is_needed, _)| *is_needed).map(|(_, name)| *name).collect()
}
