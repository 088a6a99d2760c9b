//! Draws as they are recorded.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use ash::vk;
use gaurast::vk::{
    self as gvk, GaussianAntialiasingGAURAST, GaussianCameraModelGAURAST as Model,
    GaussianCameraSourceGAURAST as CameraSource, GaussianGeometryGAURAST as Geometry, GaussianOrderGAURAST,
    GaussianPrecisionGAURAST as Precision, PipelineGaussianStateCreateFlagsGAURAST as Flags,
};

use crate::facts::{Camera, Facts, GaussianState};
use crate::objects::{Objects, Pipeline};
use crate::recording::{Call, DepthUse, Draw, Operation, Recording, Sources};
use crate::report::Faults;
use crate::rules::ranges::Ranges;
use crate::rules::{decoding, depth, indirect, set, state};

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
        let depth = depth::of(recording, &pipeline);
        check_cameras(recording, &gaussian, viewport, depth.as_ref(), faults);
        check_harmonics(recording, &gaussian, faults);
        if let Some(decoded) = &pipeline.decoding {
            decoding::check_draw(&gaussian, decoded, &recording.inputs, faults);
        }
        check_constants(recording, &pipeline, faults);
        if let Call::Indirect(call) = &call {
            indirect::check_command(call, facts, faults);
        } else {
            let size = |buffer| Some(objects.buffers.get(&buffer)?.size);
            let ranges = Ranges { pipeline: &pipeline, inputs: &recording.inputs, state: &gaussian, size: &size };
            ranges.check(call, facts, faults);
        }
        if faults.is_empty() {
            if !continues_set {
                check_blending(recording, &pipeline, viewport, faults);
            }
            note(recording, &pipeline, gaussian, call, viewport, depth);
        }
    }
    depth::note(recording, &pipeline);
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

fn check_cameras(
    recording: &mut Recording,
    gaussian: &GaussianState,
    viewport: Option<[f32; 4]>,
    depth: Option<&DepthUse>,
    faults: &mut Faults,
) {
    if !state::is_fixed(gaussian) {
        return;
    }
    if gaussian.camera_source != CameraSource::COMMAND {
        recording.sources.by_buffer = true;
        return;
    }
    recording.sources.by_command = true;
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
        depth::check(camera, depth, faults);
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
    }
}

fn check_harmonics(recording: &Recording, gaussian: &GaussianState, faults: &mut Faults) {
    let needs = state::is_fixed(gaussian) && gaussian.flags.contains(Flags::SPHERICAL_HARMONICS_BUFFER);
    let is_bound = recording.inputs.harmonics.is_some();
    faults.require(!needs || is_bound, "VUID-vkCmdDraw-sphericalHarmonicsBuffer-90018", || {
        "flags has SPHERICAL_HARMONICS_BUFFER, but vkCmdBindGaussianSphericalHarmonicsGAURAST has bound no \
             buffer"
            .to_owned()
    });
}

/// Warns of cameras that a command buffer sets, if it draws through cameras in buffers alone.
pub(crate) fn check_sources(sources: Sources, faults: &mut Faults) {
    if sources.sets && sources.by_buffer && !sources.by_command {
        faults.warning(
            "GAURAST-Draw-camera-source",
            "the command buffer sets cameras, but cameraSource of every pipeline that draws in it is UNIFORM_BUFFER: they \
             are not used",
        );
    }
}

/// Warns of shaders that read push constants, of which none were pushed.
fn check_constants(recording: &Recording, pipeline: &Pipeline, faults: &mut Faults) {
    let missing = pipeline.reads_constants & !recording.constants;
    if !missing.is_empty() {
        faults.warning(
            "GAURAST-Draw-push-constants",
            format!("the {missing:?} shader has push constants, but none were pushed for it in this command buffer"),
        );
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
    depth: Option<DepthUse>,
) {
    if !state::is_fixed(&gaussian) {
        return;
    }
    let key = (gaussian.camera_set, gaussian.camera_binding);
    let draw = Draw {
        pipeline: Arc::clone(pipeline),
        state: gaussian,
        call,
        inputs: recording.inputs.clone(),
        cameras: recording.cameras.clone(),
        viewport,
        depth,
        first_of_set: recording.first_of_set.clone(),
        camera_set: recording.sets.get(&gaussian.camera_set).cloned(),
        pushed: recording.pushed.get(&key).copied(),
        was_checked: AtomicBool::new(false),
    };
    let draw = Arc::new(draw);
    if recording.set.is_some() && recording.first_of_set.is_none() {
        recording.first_of_set = Some(Arc::clone(&draw));
    }
    recording.operations.push(Operation::Draw(draw));
}
