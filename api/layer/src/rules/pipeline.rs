//! The creation of a graphics pipeline.

use std::collections::BTreeMap;
use std::ops::Range;

use ash::vk;
use gaurast::vk::{
    self as gvk, GAUSSIAN_LOCATION_UNUSED_GAURAST as UNUSED, GaussianAntialiasingGAURAST,
    GaussianCameraSourceGAURAST as CameraSource, GaussianCutOffGAURAST as CutOff, GaussianGeometryGAURAST as Geometry,
    GaussianHarmonicsDecodingGAURAST as HarmonicsDecoding, GaussianLinearizationGAURAST as Linearization,
    GaussianOrderGAURAST, GaussianPrecisionGAURAST, PipelineGaussianStateCreateFlagsGAURAST as Flags,
};

use crate::facts::{Decoding, Facts, GaussianState};
use crate::formats::{Format, is_integer};
use crate::objects::Attribute;
use crate::report::Faults;
use crate::request::{Footprint, Request, SigmaPoints};
use crate::rules::{decoding, shaders, state};
use crate::spirv::{INPUT, Interface, OUTPUT};

/// The dynamic states of the extension.
const OWN: std::ops::RangeInclusive<i32> = gvk::DYNAMIC_STATE_GAUSSIAN_ORDER_GAURAST.as_raw()
    ..=gvk::DYNAMIC_STATE_GAUSSIAN_CONTRIBUTION_BUDGET_GAURAST.as_raw();

/// Reports whether a dynamic state is one of the extension.
pub(crate) fn is_own(state: vk::DynamicState) -> bool {
    OWN.contains(&state.as_raw())
}

/// Checks a pipeline.
pub(crate) fn check(request: &Request, facts: &Facts, faults: &mut Faults) {
    if !request.draws_gaussians {
        if request.gaussian.is_some() {
            faults.warning(
                "GAURAST-Pipeline-topology",
                "the pNext chain has a VkPipelineGaussianStateCreateInfoGAURAST, but the topology is not \
                 VK_PRIMITIVE_TOPOLOGY_GAUSSIAN_LIST_GAURAST: the pipeline draws no Gaussians",
            );
        }
        return;
    }
    let id = "VUID-VkPipelineGaussianStateCreateInfoGAURAST-gaussianPrimitiveTopology-90032";
    if facts.features.gaussian_primitive_topology == 0 {
        return faults.error(id, state::absent(id));
    }
    let Some(gaussian) = request.gaussian else {
        return faults.error(
            "VUID-VkGraphicsPipelineCreateInfo-topology-90007",
            "the topology is VK_PRIMITIVE_TOPOLOGY_GAUSSIAN_LIST_GAURAST, but the pNext chain has no \
             VkPipelineGaussianStateCreateInfoGAURAST (or a layer above this one has dropped it)",
        );
    };
    if !state::check_enums(&gaussian, faults) {
        return;
    }
    let static_state = without_dynamic(&gaussian, request);
    let has_fragment = request.has(vk::ShaderStageFlags::FRAGMENT);
    let approximation = static_approximation(request);
    state::check_values(&static_state, approximation, has_fragment, facts, faults);
    check_stages(&gaussian, request, facts, faults);
    check_fixed_function(request, faults);
    check_gates(request, facts, faults);
    if let Some(footprint) = &request.footprint {
        check_footprint(&gaussian, footprint, facts, faults);
    }
    if let Some(points) = &request.sigma_points
        && state::is_fixed(&gaussian)
        && gaussian.linearization == Linearization::UNSCENTED
    {
        check_sigma_points(points, facts, faults);
    }
    if state::is_fixed(&gaussian) {
        let before = faults.0.len();
        check_degree(&gaussian, facts, faults);
        if let Some(decoded) = &request.decoding {
            let attributes = request.vertex_input.as_ref().map(|(_, attributes)| attributes);
            let format = |location| attributes?.get(&location).map(|attribute: &Attribute| attribute.format);
            decoding::check(&gaussian, decoded, format, facts, faults);
        }
        if faults.0.len() == before {
            check_attributes(&gaussian, request, faults);
        }
        check_camera(&gaussian, request, faults);
    }
    if faults.is_empty() {
        warn(&static_state, request, faults);
    }
}

/// Checks the rules of a library's own state. Those of several parts are checked where they are linked.
pub(crate) fn check_library(request: &Request, facts: &Facts, faults: &mut Faults) {
    let Some(gaussian) = request.gaussian.filter(|_| request.is_library) else {
        return;
    };
    let id = "VUID-VkPipelineGaussianStateCreateInfoGAURAST-gaussianPrimitiveTopology-90032";
    if facts.features.gaussian_primitive_topology == 0 {
        return faults.error(id, state::absent(id));
    }
    if !state::check_enums(&gaussian, faults) {
        return;
    }
    state::check_values(&without_dynamic(&gaussian, request), static_approximation(request), false, facts, faults);
    if let Some(footprint) = &request.footprint {
        check_footprint(&gaussian, footprint, facts, faults);
    }
}

/// The state with values that break nothing in place of those that are dynamic, and ignored.
fn without_dynamic(gaussian: &GaussianState, request: &Request) -> GaussianState {
    let mut state = *gaussian;
    if request.is_dynamic(gvk::DYNAMIC_STATE_GAUSSIAN_ORDER_GAURAST) {
        state.order = GaussianOrderGAURAST::VIEW_DEPTH;
    }
    if request.is_dynamic(gvk::DYNAMIC_STATE_GAUSSIAN_ANTIALIASING_GAURAST) {
        state.antialiasing = GaussianAntialiasingGAURAST::DILATE;
    }
    if request.is_dynamic(gvk::DYNAMIC_STATE_GAUSSIAN_LOW_PASS_VARIANCE_GAURAST) {
        state.low_pass_variance = 0.0;
    }
    if request.is_dynamic(gvk::DYNAMIC_STATE_GAUSSIAN_ALPHA_FLOOR_GAURAST) {
        state.alpha_floor = 0.0;
    }
    if request.is_dynamic(gvk::DYNAMIC_STATE_GAUSSIAN_ALPHA_CEILING_GAURAST) {
        state.alpha_ceiling = 1.0;
    }
    if request.is_dynamic(gvk::DYNAMIC_STATE_GAUSSIAN_TRANSMITTANCE_FLOOR_GAURAST) {
        state.transmittance_floor = 0.0;
    }
    state
}

fn static_approximation(request: &Request) -> Option<[f32; 2]> {
    let [mut error, mut budget] = request.approximation?;
    if request.is_dynamic(gvk::DYNAMIC_STATE_GAUSSIAN_EXPONENTIAL_ERROR_GAURAST) {
        error = 0.0;
    }
    if request.is_dynamic(gvk::DYNAMIC_STATE_GAUSSIAN_CONTRIBUTION_BUDGET_GAURAST) {
        budget = 0.0;
    }
    Some([error, budget])
}

fn check_stages(gaussian: &GaussianState, request: &Request, facts: &Facts, faults: &mut Faults) {
    use vk::ShaderStageFlags as Stage;
    let id = "VUID-VkGraphicsPipelineCreateInfo-projectionMode-90008";
    let others = Stage::TESSELLATION_CONTROL
        | Stage::TESSELLATION_EVALUATION
        | Stage::GEOMETRY
        | Stage::TASK_EXT
        | Stage::MESH_EXT;
    let (fixed, has_vertex) = (state::is_fixed(gaussian), request.has(Stage::VERTEX));
    if request.has(others) {
        faults.error(id, "the pipeline has a tessellation, geometry, task or mesh stage, which Gaussians do not pass");
    } else if fixed && has_vertex {
        faults.error(id, "projectionMode is FIXED_FUNCTION, but the pipeline has a vertex stage");
    } else if !fixed && !has_vertex {
        faults.error(id, "projectionMode is VERTEX_SHADER, but the pipeline has no vertex stage");
    }
    let interface = |stage: Stage, class: u32| {
        let found = request.stages.iter().find(|other| other.stage == stage)?;
        Some(Interface::of(found.words.as_ref()?, &found.entry, class))
    };
    if !fixed && has_vertex {
        let outputs = interface(Stage::VERTEX, OUTPUT);
        shaders::check_vertex(&gaussian.vertex_output_locations, outputs.as_ref(), faults);
    }
    if request.has(Stage::FRAGMENT) {
        let id = "VUID-VkPipelineGaussianStateCreateInfoGAURAST-resolveFragmentShader-90034";
        if facts.features.resolve_fragment_shader == 0 {
            return faults.error(id, state::absent(id));
        }
        let locations = &gaussian.resolve_input_locations;
        let indices = [locations.median_gaussian, locations.nearest_gaussian];
        let reads_indices = indices.iter().any(|&location| location != UNUSED);
        let id = "VUID-VkPipelineGaussianStateCreateInfoGAURAST-resolveGaussianIndices-90073";
        let has_indices = facts.features.resolve_gaussian_indices != 0;
        faults.require(!reads_indices || has_indices, id, || state::absent(id));
        faults.require(
            fixed || locations.first_camera == UNUSED,
            "VUID-VkGaussianResolveInputLocationsGAURAST-firstCamera-90072",
            || "firstCamera is used with vertex-shader projection, which has no camera".to_owned(),
        );
        let inputs = interface(Stage::FRAGMENT, INPUT);
        shaders::check_fragment(&gaussian.resolve_input_locations, inputs.as_ref(), faults);
        if let Some(outputs) = interface(Stage::FRAGMENT, OUTPUT) {
            let formats: Vec<_> = request.subpass.colors.iter().map(|&(format, _)| format).collect();
            shaders::check_outputs(&outputs, &formats, faults);
        }
    }
}

/// The state of the other fixed functions.
fn check_fixed_function(request: &Request, faults: &mut Faults) {
    faults.require(
        !request.restart || request.is_dynamic(vk::DynamicState::PRIMITIVE_RESTART_ENABLE),
        "VUID-VkPipelineInputAssemblyStateCreateInfo-topology-90009",
        || "primitiveRestartEnable is VK_TRUE, but a list of Gaussians has no restart".to_owned(),
    );
    faults.require(!request.discards, "VUID-VkGraphicsPipelineCreateInfo-rasterizerDiscardEnable-90080", || {
        "rasterizerDiscardEnable is VK_TRUE, but must be VK_FALSE".to_owned()
    });
    faults.require(request.viewport_count == 1, "VUID-VkGraphicsPipelineCreateInfo-viewportCount-90081", || {
        format!("viewportCount is {}, but must be 1", request.viewport_count)
    });
    for state in [
        vk::DynamicState::PRIMITIVE_RESTART_ENABLE,
        vk::DynamicState::RASTERIZER_DISCARD_ENABLE,
        vk::DynamicState::VERTEX_INPUT_EXT,
        vk::DynamicState::ALPHA_TO_COVERAGE_ENABLE_EXT,
        vk::DynamicState::ALPHA_TO_ONE_ENABLE_EXT,
    ] {
        faults.require(!request.is_dynamic(state), "VUID-VkGraphicsPipelineCreateInfo-pDynamicStates-90082", || {
            format!("{state:?} must not be dynamic in a Gaussian pipeline")
        });
    }
}

/// Features of modes that are not of the Gaussian state.
fn check_gates(request: &Request, facts: &Facts, faults: &mut Faults) {
    let features = &facts.features;
    let is_tested = request.tests_depth && request.subpass.depth != vk::Format::UNDEFINED;
    let id = "VUID-VkPipelineGaussianStateCreateInfoGAURAST-gaussianDepthStencil-90044";
    faults.require(!is_tested || features.gaussian_depth_stencil != 0, id, || state::absent(id));
    let id = "VUID-VkPipelineGaussianStateCreateInfoGAURAST-gaussianMultisample-90045";
    let is_one = request.samples == vk::SampleCountFlags::TYPE_1;
    if !is_one && features.gaussian_multisample == 0 {
        faults.error(id, state::absent(id));
    } else {
        let fits = is_one || facts.sample_counts.contains(request.samples);
        faults.require(fits, id, || {
            format!(
                "rasterizationSamples is {:?}, but gaussianSampleCounts has {:?}",
                request.samples, facts.sample_counts
            )
        });
    }
    let id = "VUID-VkPipelineGaussianStateCreateInfoGAURAST-gaussianDynamicState-90048";
    let has_own = request.dynamic.iter().any(|&state| is_own(state));
    faults.require(!has_own || features.gaussian_dynamic_state != 0, id, || state::absent(id));
    let id = "VUID-VkPipelineGaussianStateCreateInfoGAURAST-gaussianMultiview-90049";
    let has_views = request.subpass.view_mask != 0;
    faults.require(!has_views || features.gaussian_multiview != 0, id, || state::absent(id));
}

/// Checks the footprint state.
fn check_footprint(gaussian: &GaussianState, footprint: &Footprint, facts: &Facts, faults: &mut Faults) {
    let &Footprint { cut_off, cut_off_deviations: deviations, compensation_floor: floor } = footprint;
    let known = [
        CutOff::NONE,
        CutOff::ELLIPSE,
        CutOff::TILE_SQUARE,
        CutOff::TILE_RECTANGLE,
        CutOff::TILE_RECTANGLE_COMPENSATED,
    ];
    if !known.contains(&cut_off) {
        return faults.error(
            "VUID-VkPipelineGaussianFootprintStateCreateInfoGAURAST-cutOff-parameter",
            format!("cutOff is {}, which is no value of its type", cut_off.as_raw()),
        );
    }
    let cuts = cut_off != CutOff::NONE;
    faults.require(
        !cuts || deviations.is_finite() && deviations > 0.0,
        "VUID-VkPipelineGaussianFootprintStateCreateInfoGAURAST-cutOffDeviations-90076",
        || format!("cutOffDeviations is {deviations}, but must be finite and greater than 0"),
    );
    faults.require(
        (0.0..=1.0).contains(&floor),
        "VUID-VkPipelineGaussianFootprintStateCreateInfoGAURAST-compensationFloor-90077",
        || format!("compensationFloor is {floor}, but must be in [0, 1]"),
    );
    let is_flat = state::is_fixed(gaussian) && gaussian.geometry == Geometry::GAUSSIAN_2D;
    faults.require(
        !cuts
            || gaussian.precision == GaussianPrecisionGAURAST::FLOAT32
                && (!is_flat || cut_off == CutOff::TILE_RECTANGLE),
        "VUID-VkPipelineGaussianFootprintStateCreateInfoGAURAST-cutOff-90078",
        || format!("cutOff is {cut_off:?}, but that needs FLOAT32 and, unless it is TILE_RECTANGLE, GAUSSIAN_3D"),
    );
    let id = "VUID-VkPipelineGaussianStateCreateInfoGAURAST-gaussianCutOff-90074";
    faults.require(!cuts || facts.features.gaussian_cut_off != 0, id, || state::absent(id));
    let id = "VUID-VkPipelineGaussianStateCreateInfoGAURAST-gaussian2DCutOff-90102";
    faults.require(!cuts || !is_flat || facts.features.gaussian_2d_cut_off != 0, id, || state::absent(id));
    let id = "VUID-VkPipelineGaussianStateCreateInfoGAURAST-opacityCompensationFloor-90075";
    let has_floor = facts.features.opacity_compensation_floor != 0;
    faults.require(floor == 0.0 || has_floor, id, || state::absent(id));
}

/// Checks the state of sigma points.
fn check_sigma_points(points: &SigmaPoints, facts: &Facts, faults: &mut Faults) {
    let &SigmaPoints { alpha, beta, kappa, picture_margin: margin, .. } = points;
    faults.require(
        alpha.is_finite() && alpha > 0.0,
        "VUID-VkPipelineGaussianUnscentedStateCreateInfoGAURAST-alpha-90091",
        || format!("alpha is {alpha}, but must be finite and greater than 0"),
    );
    faults.require(beta.is_finite(), "VUID-VkPipelineGaussianUnscentedStateCreateInfoGAURAST-beta-90092", || {
        format!("beta is {beta}, but must be finite")
    });
    faults.require(
        kappa.is_finite() && kappa > -3.0,
        "VUID-VkPipelineGaussianUnscentedStateCreateInfoGAURAST-kappa-90093",
        || format!("kappa is {kappa}, but must be finite and greater than -3"),
    );
    faults.require(margin >= 0.0, "VUID-VkPipelineGaussianUnscentedStateCreateInfoGAURAST-pictureMargin-90094", || {
        format!("pictureMargin is {margin}, but must be at least 0")
    });
    let id = "VUID-VkPipelineGaussianStateCreateInfoGAURAST-unscentedParameters-90090";
    faults.require(points.are_default() || facts.features.unscented_parameters != 0, id, || state::absent(id));
}

fn check_degree(gaussian: &GaussianState, facts: &Facts, faults: &mut Faults) {
    faults.require(
        gaussian.spherical_harmonics_degree <= facts.max_degree,
        "VUID-VkPipelineGaussianStateCreateInfoGAURAST-sphericalHarmonicsDegree-90010",
        || {
            format!(
                "sphericalHarmonicsDegree is {}, but must be at most maxSphericalHarmonicsDegree ({})",
                gaussian.spherical_harmonics_degree, facts.max_degree
            )
        },
    );
}

/// The locations of an attribute with their names and the components that each needs.
pub(crate) fn used_locations(gaussian: &GaussianState, decoding: Option<&Decoding>) -> Vec<(String, u32, u32)> {
    let locations = &gaussian.attribute_locations;
    let scales = if gaussian.geometry == Geometry::GAUSSIAN_2D { 2 } else { 3 };
    let mut used = vec![
        ("position".to_owned(), locations.position, 3),
        ("scale".to_owned(), locations.scale, scales),
        ("rotation".to_owned(), locations.rotation, 4),
        ("opacity".to_owned(), locations.opacity, 1),
    ];
    let mut rows = |name: &str, first: u32, count: u32, components: u32| {
        used.extend((0..count).map(|index| {
            let name = if count > 1 { format!("{name} + {index}") } else { name.to_owned() };
            (name, first.saturating_add(index), components)
        }));
    };
    if !gaussian.flags.contains(Flags::SPHERICAL_HARMONICS_BUFFER) {
        let are_codes = decoding.is_some_and(|decoding| decoding.spherical_harmonics != HarmonicsDecoding::NONE);
        let coefficients = if are_codes { 1 } else { (gaussian.spherical_harmonics_degree.min(16) + 1).pow(2) };
        rows("firstSphericalHarmonics", locations.first_spherical_harmonics, coefficients, 3);
    }
    if locations.first_model_matrix != UNUSED {
        rows("firstModelMatrix", locations.first_model_matrix, 3, 4);
    }
    if locations.model_opacity != UNUSED {
        rows("modelOpacity", locations.model_opacity, 1, 1);
    }
    used
}

fn check_attributes(gaussian: &GaussianState, request: &Request, faults: &mut Faults) {
    let decoded = request.decoding.as_ref();
    let used = used_locations(gaussian, decoded);
    for (index, (name, location, _)) in used.iter().enumerate() {
        let same = used[..index].iter().find(|(_, other, _)| other == location && *other != UNUSED);
        if let Some((other, ..)) = same {
            return faults.error(
                "VUID-VkGaussianAttributeLocationsGAURAST-None-90019",
                format!(
                    "{other} and {name} are the same location, {location}; members that are not used are ~0U, \
                     not 0"
                ),
            );
        }
    }
    let id = "VUID-VkGaussianAttributeLocationsGAURAST-None-90015";
    let Some((bindings, attributes)) = &request.vertex_input else {
        return;
    };
    for (name, location, components) in used {
        let Some(attribute) = attributes.get(&location) else {
            let text = if location == UNUSED {
                format!("{name} is unused, but fixed-function projection needs it")
            } else {
                format!("{name} is location {location}, which the vertex input state does not have")
            };
            return faults.error(id, text);
        };
        let format = Format::of(attribute.format);
        let is_decoded = decoded.is_some_and(|decoded| decoding::is_decoded(gaussian, decoded, location));
        if !is_decoded && (format.components < components || format.is_integer) {
            return faults.error(
                id,
                format!(
                    "{name} is location {location}, whose format is {:?}, but must have {components} components or \
                         more that \
                     convert to floating point",
                    attribute.format
                ),
            );
        }
        if !bindings.contains_key(&attribute.binding) {
            return faults.error(
                id,
                format!("{name} is location {location}, whose binding {} does not exist", attribute.binding),
            );
        }
    }
}

fn check_camera(gaussian: &GaussianState, request: &Request, faults: &mut Faults) {
    if gaussian.camera_source != CameraSource::UNIFORM_BUFFER {
        return;
    }
    let (set, number) = (gaussian.camera_set, gaussian.camera_binding);
    if let Some(layout) = &request.layout {
        let layout = layout.get(set as usize).cloned().flatten();
        let binding = layout.and_then(|layout| {
            let found = layout.iter().find(|binding| binding.binding == number);
            found.copied()
        });
        let types = [vk::DescriptorType::UNIFORM_BUFFER, vk::DescriptorType::UNIFORM_BUFFER_DYNAMIC];
        let fits = binding.is_some_and(|binding| {
            types.contains(&binding.ty) && binding.count > 0 && binding.stages.contains(vk::ShaderStageFlags::VERTEX)
        });
        faults.require(fits, "VUID-VkPipelineGaussianStateCreateInfoGAURAST-cameraBinding-90025", || {
            format!(
                "cameraSource is UNIFORM_BUFFER, but the layout has no uniform buffer visible to the vertex stage at \
                     set {set}, \
                 binding {number}"
            )
        });
    }
    let views = u32::BITS - request.subpass.view_mask.leading_zeros();
    let count = gaussian.camera_count;
    let id = "VUID-VkPipelineGaussianStateCreateInfoGAURAST-cameraCount-90026";
    faults.require(count == 1 || count >= views.max(1), id, || {
        format!(
            "cameraCount is {count}, but must be 1, or greater than the greatest view index, and not 0 (there \
             are {views} views)"
        )
    });
}

/// Warns of state that is valid and surely not meant.
fn warn(gaussian: &GaussianState, request: &Request, faults: &mut Faults) {
    let has_fragment = request.has(vk::ShaderStageFlags::FRAGMENT);
    if !request.cull_mode.is_empty() && !request.is_dynamic(vk::DynamicState::CULL_MODE) {
        faults.warning(
            "GAURAST-Pipeline-cull-mode",
            format!("cullMode is {:?}, which has no effect: a Gaussian always faces front", request.cull_mode),
        );
    }
    if request.polygon_mode != vk::PolygonMode::FILL {
        faults.warning(
            "GAURAST-Pipeline-polygon-mode",
            format!("polygonMode is {:?}, which has no effect on Gaussians", request.polygon_mode),
        );
    }
    if gaussian.transmittance_floor > 0.0 && gaussian.alpha_ceiling > 1.0 - gaussian.transmittance_floor {
        faults.warning(
            "GAURAST-Pipeline-alpha-ceiling",
            format!(
                "alphaCeiling is {}, which is more than 1 less transmittanceFloor ({}): where the first Gaussian \
                     reaches it, \
                 nothing is drawn at all",
                gaussian.alpha_ceiling, gaussian.transmittance_floor
            ),
        );
    }
    if !has_fragment {
        warn_of_output(gaussian, request, faults);
    }
    if let Some((bindings, attributes)) = &request.vertex_input {
        if state::is_fixed(gaussian) {
            warn_of_formats(gaussian, request, attributes, faults);
        }
        let is_dynamic = request.is_dynamic(vk::DynamicState::VERTEX_INPUT_BINDING_STRIDE);
        for (name, location, _) in used_locations(gaussian, request.decoding.as_ref()) {
            let Some(attribute) = attributes.get(&location) else {
                continue;
            };
            let Some(binding) = bindings.get(&attribute.binding) else {
                continue;
            };
            let end = attribute.offset + Format::of(attribute.format).bytes;
            if is_dynamic || !state::is_fixed(gaussian) || binding.stride >= end {
                continue;
            }
            return faults.warning(
                "GAURAST-Pipeline-stride",
                format!(
                    "binding {} has a stride of {} bytes, but {name} ends at byte {end} of its vertex",
                    attribute.binding, binding.stride
                ),
            );
        }
    }
}

/// Warns of attributes that can't be what their members want, by their formats and offsets.
fn warn_of_formats(
    gaussian: &GaussianState,
    request: &Request,
    attributes: &BTreeMap<u32, Attribute>,
    faults: &mut Faults,
) {
    let decoded = request.decoding.as_ref();
    let has_matrix = gaussian.attribute_locations.first_model_matrix != UNUSED;
    // The bytes that are read, by member.
    let mut read: Vec<(String, u32, Range<u32>)> = Vec::new();
    for (name, location, components) in used_locations(gaussian, decoded) {
        let Some(attribute) = attributes.get(&location) else {
            continue;
        };
        if decoded.is_some_and(|decoded| decoding::is_decoded(gaussian, decoded, location)) {
            continue;
        }
        let format = Format::of(attribute.format);
        // A matrix may take positions from 0 to 1 to where they are.
        let is_signed =
            name == "rotation" || name.starts_with("firstSphericalHarmonics") || name == "position" && !has_matrix;
        if is_signed && format.is_unsigned {
            return faults.warning(
                "GAURAST-Pipeline-unsigned-format",
                format!(
                    "{name} is location {location}, whose format is {:?}: it has no negative numbers",
                    attribute.format
                ),
            );
        }
        if format.is_packed {
            continue;
        }
        let bytes = attribute.offset..attribute.offset + components * format.word_bytes();
        let overlaps = |(_, binding, other): &&(String, u32, Range<u32>)| {
            *binding == attribute.binding && *other != bytes && other.start < bytes.end && bytes.start < other.end
        };
        if let Some((other, _, range)) = read.iter().find(overlaps) {
            return faults.warning(
                "GAURAST-Pipeline-overlap",
                format!(
                    "{name} is read from bytes {} to {} of binding {}, and {other} from bytes {} to {}: they overlap in part",
                    bytes.start,
                    bytes.end - 1,
                    attribute.binding,
                    range.start,
                    range.end - 1
                ),
            );
        }
        read.push((name, attribute.binding, bytes));
    }
}

/// Warns of what becomes of the fragment's colour, which is premultiplied.
fn warn_of_output(gaussian: &GaussianState, request: &Request, faults: &mut Faults) {
    let attachments = request.subpass.colors.iter().zip(&request.blend).skip(1);
    let mut written = attachments.filter(|(_, blend)| !blend.color_write_mask.is_empty());
    if let Some(((format, _), _)) = written.find(|((format, _), _)| is_integer(*format)) {
        return faults.warning(
            "GAURAST-Pipeline-integer-attachment",
            format!(
                "a colour attachment after the first is {format:?}, and colorWriteMask is not 0: without a fragment stage \
                 the first one alone is written. What Gaussian a pixel shows is an input of a resolve shader"
            ),
        );
    }
    let Some(&(format, _)) = request.subpass.colors.first() else {
        return;
    };
    if is_integer(format) {
        return faults.warning(
            "GAURAST-Pipeline-integer-attachment",
            format!(
                "the first colour attachment is {format:?}: without a fragment stage integer attachments are \
                 left as they are"
            ),
        );
    }
    let Some(blend) = request.blend.first() else {
        return;
    };
    let are_of_training =
        state::is_fixed(gaussian) && gaussian.flags.intersects(Flags::LOG_SCALE | Flags::LOGIT_OPACITY);
    if Format::of(format).is_srgb && are_of_training {
        return faults.warning(
            "GAURAST-Pipeline-srgb-attachment",
            format!(
                "the first colour attachment is {format:?}, which takes colours for linear light and encodes them, but scenes \
                 that hold logarithms and logits were trained by colours that are encoded already: UNORM stores them as they \
                 are"
            ),
        );
    }
    let nothing_else = !(request.depth.is_enabled && request.depth.writes) && request.subpass.colors.len() == 1;
    if blend.color_write_mask.is_empty() && nothing_else {
        return faults.warning(
            "GAURAST-Pipeline-write-mask",
            "colorWriteMask is 0 and no depth is written: the pipeline writes nothing",
        );
    }
    let by_alpha = [vk::BlendFactor::SRC_ALPHA, vk::BlendFactor::SRC_ALPHA_SATURATE];
    if blend.blend_enable != 0 && !request.has_logic_op && by_alpha.contains(&blend.src_color_blend_factor) {
        faults.warning(
            "GAURAST-Pipeline-blending",
            format!(
                "srcColorBlendFactor is {:?}, but a fragment's colour is premultiplied by its alpha: \"over\" is ONE, \
                 ONE_MINUS_SRC_ALPHA",
                blend.src_color_blend_factor
            ),
        );
    }
}
