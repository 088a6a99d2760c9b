//! Draws as they are recorded.

use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use ash::vk;
use gaurast::vk::{
    self as gvk, GAUSSIAN_LOCATION_UNUSED_GAURAST as UNUSED, GaussianAntialiasingGAURAST,
    GaussianCameraModelGAURAST as Model, GaussianCameraSourceGAURAST as CameraSource,
    GaussianGeometryGAURAST as Geometry, GaussianOrderGAURAST, GaussianPrecisionGAURAST as Precision,
    PipelineGaussianStateCreateFlagsGAURAST as Flags,
};

use crate::facts::{Camera, Facts, GaussianState};
use crate::formats::Format;
use crate::objects::{Objects, Pipeline};
use crate::recording::{Call, Draw, Operation, Recording};
use crate::report::Faults;
use crate::rules::{set, state};

/// Checks a draw command, and notes it for the check of its contents.
pub(crate) fn check(recording: &mut Recording, call: Call, objects: &Objects, facts: &Facts, faults: &mut Faults) {
    let Some(pipeline) = recording.pipeline.clone() else {
        return;
    };
    let viewport = pipeline.viewport.or(recording.viewport);
    let continues_set = pipeline.gaussian.is_some() && matches!(recording.set, Some(Some(_)));
    if let Some(gaussian) = pipeline.gaussian {
        set::check_draw(recording, faults);
        let gaussian = with_dynamic(gaussian, &pipeline, recording, facts, faults);
        check_cameras(recording, &gaussian, viewport, faults);
        check_harmonics(recording, &gaussian, faults);
        check_ranges(recording, &pipeline, &gaussian, call, objects, facts, faults);
        if faults.is_empty() {
            if !continues_set {
                check_blending(recording, &pipeline, viewport, faults);
            }
            note(recording, &pipeline, gaussian, call, viewport);
        }
    }
    if let Some(pass) = &mut recording.pass
        && !continues_set
        && !pass.drawn.contains(&viewport)
    {
        pass.drawn.push(viewport);
    }
}

/// The state with the values of its dynamic states, which must be set and go together with the rest.
fn with_dynamic(
    gaussian: GaussianState,
    pipeline: &Pipeline,
    recording: &Recording,
    facts: &Facts,
    faults: &mut Faults,
) -> GaussianState {
    let mut s = gaussian;
    let stored_degree = s.spherical_harmonics_degree;
    let mut approximation = pipeline.approximation.unwrap_or_default();
    let mut has_own = false;
    for &own in &pipeline.dynamic {
        if !crate::rules::pipeline::is_own(own) {
            continue;
        }
        has_own = true;
        let Some(bits) = recording.dynamic_bits(own) else {
            faults.error(
                "VUID-vkCmdDraw-dynamic-90060",
                format!("the pipeline's {} was not set in the command buffer", own_name(own)),
            );
            return s;
        };
        let float = f32::from_bits(bits);
        match own {
            gvk::DYNAMIC_STATE_GAUSSIAN_ORDER_GAURAST => {
                s.order = GaussianOrderGAURAST::from_raw(bits.cast_signed());
            }
            gvk::DYNAMIC_STATE_GAUSSIAN_ANTIALIASING_GAURAST => {
                s.antialiasing = GaussianAntialiasingGAURAST::from_raw(bits.cast_signed());
            }
            gvk::DYNAMIC_STATE_GAUSSIAN_LOW_PASS_VARIANCE_GAURAST => s.low_pass_variance = float,
            gvk::DYNAMIC_STATE_GAUSSIAN_ALPHA_FLOOR_GAURAST => s.alpha_floor = float,
            gvk::DYNAMIC_STATE_GAUSSIAN_ALPHA_CEILING_GAURAST => s.alpha_ceiling = float,
            gvk::DYNAMIC_STATE_GAUSSIAN_TRANSMITTANCE_FLOOR_GAURAST => {
                s.transmittance_floor = float;
            }
            gvk::DYNAMIC_STATE_GAUSSIAN_EXPONENTIAL_ERROR_GAURAST => approximation[0] = float,
            gvk::DYNAMIC_STATE_GAUSSIAN_CONTRIBUTION_BUDGET_GAURAST => approximation[1] = float,
            _ => s.spherical_harmonics_degree = bits,
        }
    }
    if !has_own {
        return s;
    }
    let fixed = state::is_fixed(&s);
    faults.require(
        !fixed || s.spherical_harmonics_degree <= stored_degree,
        "VUID-vkCmdDraw-sphericalHarmonicsDegree-90061",
        || {
            format!(
                "the dynamic sphericalHarmonicsDegree is {}, but the pipeline has coefficients of degree \
                     {stored_degree}",
                s.spherical_harmonics_degree
            )
        },
    );
    let mut broken = Faults::default();
    state::check_values(&s, Some(approximation), pipeline.has_fragment, facts, &mut broken);
    if let Some(fault) = broken.0.first() {
        faults.error(
            "VUID-vkCmdDraw-dynamic-90060",
            format!("the values of dynamic states do not go together: {} ({})", fault.text, fault.id),
        );
    }
    s
}

fn own_name(own: vk::DynamicState) -> &'static str {
    match own {
        gvk::DYNAMIC_STATE_GAUSSIAN_ORDER_GAURAST => "order",
        gvk::DYNAMIC_STATE_GAUSSIAN_ANTIALIASING_GAURAST => "antialiasing",
        gvk::DYNAMIC_STATE_GAUSSIAN_LOW_PASS_VARIANCE_GAURAST => "lowPassVariance",
        gvk::DYNAMIC_STATE_GAUSSIAN_ALPHA_FLOOR_GAURAST => "alphaFloor",
        gvk::DYNAMIC_STATE_GAUSSIAN_ALPHA_CEILING_GAURAST => "alphaCeiling",
        gvk::DYNAMIC_STATE_GAUSSIAN_TRANSMITTANCE_FLOOR_GAURAST => "transmittanceFloor",
        gvk::DYNAMIC_STATE_GAUSSIAN_EXPONENTIAL_ERROR_GAURAST => "exponentialError",
        gvk::DYNAMIC_STATE_GAUSSIAN_CONTRIBUTION_BUDGET_GAURAST => "contributionBudget",
        _ => "sphericalHarmonicsDegree",
    }
}

fn check_cameras(recording: &Recording, gaussian: &GaussianState, viewport: Option<[f32; 4]>, faults: &mut Faults) {
    if !state::is_fixed(gaussian) || gaussian.camera_source != CameraSource::COMMAND {
        return;
    }
    let Some(cameras) = &recording.cameras else {
        return faults.warning(
            "GAURAST-Draw-no-camera",
            "no camera was set in this command buffer, or vkCmdExecuteCommands came after: the draw draws nothing",
        );
    };
    let view_mask = recording.pass.as_ref().map_or(0, |pass| pass.subpass.view_mask);
    let views = u32::BITS - view_mask.leading_zeros();
    let count = cameras.len() as u32;
    faults.require(view_mask == 0 || count == 1 || count >= views, "VUID-vkCmdDraw-cameraCount-90063", || {
        format!(
            "there are {count} cameras, but the view mask is {view_mask:#b}: there must be 1, or at least \
             {views}"
        )
    });
    let seen = if view_mask == 0 { 1 } else { cameras.len() };
    for camera in &cameras[..seen.min(cameras.len())] {
        check_model(camera, gaussian, faults);
        if let Some([_, _, width, height]) = viewport {
            warn_of_units(camera, [width.abs(), height.abs()], faults);
        }
    }
}

/// The camera models that a pipeline draws through.
pub(crate) fn check_model(camera: &Camera, gaussian: &GaussianState, faults: &mut Faults) {
    let id = "VUID-vkCmdDraw-geometry-90071";
    let model = camera.model;
    let is_flat = gaussian.geometry == Geometry::GAUSSIAN_2D;
    if is_flat && model != Model::PINHOLE && model != Model::ORTHOGRAPHIC {
        faults.error(id, format!("geometry is GAUSSIAN_2D, but the camera is {model:?}, not PINHOLE or ORTHOGRAPHIC"));
    } else if gaussian.precision == Precision::FLOAT16 && model == Model::EQUIRECTANGULAR {
        faults.error(id, "precision is FLOAT16, but the camera is EQUIRECTANGULAR");
    }
    let may_distort = !is_flat && gaussian.order != GaussianOrderGAURAST::PER_PIXEL;
    faults.require(!camera.distorts || may_distort, "VUID-vkCmdDraw-None-90089", || {
        "the camera's lens distorts, but geometry is GAUSSIAN_2D or order is PER_PIXEL".to_owned()
    });
}

/// Warns of a camera whose numbers are not pixels.
fn warn_of_units(camera: &Camera, [width, height]: [f32; 2], faults: &mut Faults) {
    if camera.model != Model::PINHOLE || width < 32.0 || height < 32.0 {
        return;
    }
    if camera.focal_length.iter().all(|&f| f < 4.0) {
        faults.warning(
            "GAURAST-Draw-focal-length",
            format!(
                "focalLength is {:?} with a viewport of {width} x {height}: its unit is the pixel, not the picture's \
                     side",
                camera.focal_length
            ),
        );
    } else if camera.principal_point.iter().all(|c| c.abs() <= 1.0) {
        faults.warning(
            "GAURAST-Draw-principal-point",
            format!(
                "principalPoint is {:?} with a viewport of {width} x {height}: it is in pixels from the upper left \
                     corner, and \
                 mostly the middle",
                camera.principal_point
            ),
        );
    }
}

fn check_harmonics(recording: &Recording, gaussian: &GaussianState, faults: &mut Faults) {
    let needs = state::is_fixed(gaussian) && gaussian.flags.contains(Flags::SPHERICAL_HARMONICS_BUFFER);
    faults.require(!needs || recording.harmonics.is_some(), "VUID-vkCmdDraw-sphericalHarmonicsBuffer-90018", || {
        "flags has SPHERICAL_HARMONICS_BUFFER, but vkCmdBindGaussianSphericalHarmonicsGAURAST has bound no \
             buffer"
            .to_owned()
    });
}

/// The numbers of vertices, indices and instances.
fn check_ranges(
    recording: &Recording,
    pipeline: &Pipeline,
    gaussian: &GaussianState,
    call: Call,
    objects: &Objects,
    facts: &Facts,
    faults: &mut Faults,
) {
    let [first, count, first_instance, instances] = match call {
        Call::Vertices(numbers) | Call::Indices(numbers, _) => numbers,
        Call::Indirect(..) => return,
    };
    let gaussians = u64::from(count) * u64::from(instances);
    if facts.has_extension && gaussians > facts.max_gaussians_per_draw {
        return faults.error(
            "VUID-vkCmdDraw-maxGaussiansPerDraw-90083",
            format!("the draw has {gaussians} Gaussians, but must not have more than {}", facts.max_gaussians_per_draw),
        );
    }
    if count == 0 || instances == 0 {
        return;
    }
    if let Call::Indices(..) = call {
        check_indices(recording, first, count, objects, faults);
    }
    let range = |first: u32, count: u32| u64::from(first)..u64::from(first) + u64::from(count);
    let vertices = matches!(call, Call::Vertices(_)).then(|| range(first, count));
    check_vertices(recording, pipeline, vertices, range(first_instance, instances), objects, faults);
    let locations = &gaussian.attribute_locations;
    let used = [
        locations.position,
        locations.scale,
        locations.rotation,
        locations.opacity,
        locations.first_spherical_harmonics,
        locations.first_model_matrix,
        locations.model_opacity,
    ];
    let by_instance = used.into_iter().filter(|&location| location != UNUSED).any(|location| {
        let attribute = pipeline.attributes.get(&location);
        let binding = attribute.and_then(|attribute| pipeline.bindings.get(&attribute.binding));
        binding.is_none_or(|binding| binding.by_instance)
    });
    if state::is_fixed(gaussian) && instances > 1 && !by_instance {
        faults.warning(
            "GAURAST-Draw-instances",
            format!(
                "the draw has {instances} instances, but no attribute advances by instance: each Gaussian is drawn \
                     {instances} times \
                 at one place. Number the Gaussians by vertexCount"
            ),
        );
    }
}

fn check_indices(recording: &Recording, first: u32, count: u32, objects: &Objects, faults: &mut Faults) {
    let Some(index) = recording.index_buffer else {
        return;
    };
    let bytes = index_bytes(index.ty);
    let Some(buffer) = objects.buffers.get(&index.buffer) else {
        return;
    };
    let end = (u64::from(first) + u64::from(count)) * bytes;
    let has = buffer.size.saturating_sub(index.offset);
    if end > has {
        faults.warning(
            "GAURAST-Draw-indices-past-buffer",
            format!(
                "the draw reads indices {first} to {}, but the index buffer holds {}",
                u64::from(first) + u64::from(count) - 1,
                has / bytes
            ),
        );
    }
}

/// Bytes of an index.
pub(crate) fn index_bytes(ty: vk::IndexType) -> u64 {
    match ty {
        vk::IndexType::UINT16 => 2,
        vk::IndexType::UINT8_KHR => 1,
        _ => 4,
    }
}

/// The end of what is bound, in bytes after the offset.
fn bound_bytes(recording: &Recording, binding: u32, objects: &Objects) -> Option<u64> {
    let bound = recording.vertex_buffers.get(&binding)?;
    let size = objects.buffers.get(&bound.buffer)?.size.saturating_sub(bound.offset);
    Some(bound.size.map_or(size, |given| given.min(size)))
}

/// Warns about attributes of vertices and instances that lie beyond their buffers. Both ranges are not empty; `vertices`
/// is `None` in indexed draws.
fn check_vertices(
    recording: &Recording,
    pipeline: &Pipeline,
    vertices: Option<Range<u64>>,
    instances: Range<u64>,
    objects: &Objects,
    faults: &mut Faults,
) {
    for (location, attribute) in &pipeline.attributes {
        let number = attribute.binding;
        let Some(binding) = pipeline.bindings.get(&number) else {
            continue;
        };
        let Some(bytes) = bound_bytes(recording, number, objects) else {
            if !recording.vertex_buffers.contains_key(&number) {
                return faults.warning(
                    "GAURAST-Draw-no-vertex-buffer",
                    format!("location {location} comes from binding {number}, to which no vertex buffer is bound"),
                );
            }
            continue;
        };
        let stride = recording.vertex_buffers[&number].stride.unwrap_or(binding.stride);
        let (what, first, last) = if binding.by_instance {
            let steps = (instances.end - 1 - instances.start).checked_div(binding.divisor.into()).unwrap_or(0);
            ("instance", instances.start, instances.start + steps)
        } else {
            let Some(vertices) = &vertices else {
                continue;
            };
            ("vertex", vertices.start, vertices.end - 1)
        };
        let size = u64::from(attribute.offset) + u64::from(Format::of(attribute.format).bytes);
        let end = last * u64::from(stride) + size;
        if end > bytes {
            let holds = if stride == 0 || bytes < size { 0 } else { (bytes - size) / u64::from(stride) + 1 };
            return faults.warning(
                "GAURAST-Draw-vertices-past-buffer",
                format!(
                    "the draw reads location {location} of {what} {first} to {last}, but the buffer of binding \
                         {number} holds {holds}"
                ),
            );
        }
    }
}

/// Warns of a fragment that replaces what is there.
fn check_blending(recording: &Recording, pipeline: &Pipeline, viewport: Option<[f32; 4]>, faults: &mut Faults) {
    let Some(pass) = &recording.pass else { return };
    let is_loaded = pass.subpass.colors.first().is_some_and(|&(_, is_loaded)| is_loaded);
    let is_drawn = pass.drawn.contains(&viewport);
    if pipeline.replaces && !pipeline.has_fragment && (is_loaded || is_drawn) {
        faults.warning(
            "GAURAST-Draw-blending-off",
            "blending is off, and the attachment holds something before the draw (an earlier draw, or loadOp LOAD): \
                 Gaussians replace \
             it with their premultiplied colour. \"Over\" is ONE, ONE_MINUS_SRC_ALPHA",
        );
    }
}

fn note(
    recording: &mut Recording,
    pipeline: &Arc<Pipeline>,
    gaussian: GaussianState,
    call: Call,
    viewport: Option<[f32; 4]>,
) {
    if !state::is_fixed(&gaussian) {
        return;
    }
    let key = (gaussian.camera_set, gaussian.camera_binding);
    let draw = Draw {
        pipeline: Arc::clone(pipeline),
        state: gaussian,
        call,
        vertex_buffers: recording.vertex_buffers.clone(),
        index_buffer: recording.index_buffer,
        cameras: recording.cameras.clone(),
        viewport,
        camera_set: recording.sets.get(&gaussian.camera_set).cloned(),
        pushed: recording.pushed.get(&key).copied(),
        was_checked: AtomicBool::new(false),
    };
    recording.operations.push(Operation::Draw(Arc::new(draw)));
}
