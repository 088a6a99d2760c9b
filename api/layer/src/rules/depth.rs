//! Depths of Gaussians beside the comparison, the clear value and the viewport that they meet.

use ash::vk;
use gaurast::vk::GaussianCameraModelGAURAST as Model;

use crate::facts::Camera;
use crate::objects::Pipeline;
use crate::recording::{DepthUse, Recording};
use crate::report::Faults;

/// The depth test of a pipeline with the values of its dynamic states: the comparison, and whether it writes.
struct Test {
    op: vk::CompareOp,
    writes: bool,
}

fn test(recording: &Recording, pipeline: &Pipeline) -> Option<Test> {
    let stored = pipeline.depth;
    let value = |state: vk::DynamicState| {
        let is_dynamic = pipeline.dynamic.contains(&state);
        is_dynamic.then(|| recording.dynamic_bits(state)).flatten()
    };
    let is = |state: vk::DynamicState, stored: bool| value(state).map_or(stored, |bits| bits != 0);
    if !stored.is_there || !is(vk::DynamicState::DEPTH_TEST_ENABLE, stored.is_enabled) {
        return None;
    }
    let op = value(vk::DynamicState::DEPTH_COMPARE_OP).map(|bits| vk::CompareOp::from_raw(bits.cast_signed()));
    let writes = is(vk::DynamicState::DEPTH_WRITE_ENABLE, stored.writes);
    Some(Test { op: op.unwrap_or(stored.op), writes })
}

/// The state that tests a draw's depths, if they are tested.
pub(crate) fn of(recording: &Recording, pipeline: &Pipeline) -> Option<DepthUse> {
    let test = test(recording, pipeline)?;
    let pass = recording.pass.as_ref()?;
    Some(DepthUse {
        op: test.op,
        from_minus_one: pipeline.depth.from_minus_one,
        range: pipeline.depth_range.or(recording.depth_range),
        cleared: pass.cleared_depth,
        writers: pass.depth_writers.clone(),
    })
}

/// Notes that a draw writes depths.
pub(crate) fn note(recording: &mut Recording, pipeline: &Pipeline) {
    let Some(test) = test(recording, pipeline).filter(|test| test.writes) else {
        return;
    };
    if let Some(pass) = &mut recording.pass
        && !pass.depth_writers.contains(&test.op)
    {
        pass.depth_writers.push(test.op);
    }
}

/// The depths that pass a comparison: smaller ones, greater ones, or neither.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Way {
    Smaller,
    Greater,
    Other,
}

fn way_of(op: vk::CompareOp) -> Way {
    match op {
        vk::CompareOp::LESS | vk::CompareOp::LESS_OR_EQUAL => Way::Smaller,
        vk::CompareOp::GREATER | vk::CompareOp::GREATER_OR_EQUAL => Way::Greater,
        _ => Way::Other,
    }
}

/// Checks the depths that a camera gives.
pub(crate) fn check(camera: &Camera, meets: Option<&DepthUse>, faults: &mut Faults) {
    let Some(meets) = meets else { return };
    let own_way = way_of(meets.op);
    if own_way == Way::Other {
        return;
    }
    let [c0, c1] = camera.depth_coefficients;
    if c0 == 0.0 && c1 == 0.0 {
        return faults.warning(
            "GAURAST-Draw-depth-coefficients",
            "depthCoefficients are 0 and 0: the depth of every Gaussian is 0. They are those of the projection matrix",
        );
    }
    let at_near = f64::from(c0) + f64::from(c1) / f64::from(camera.near_plane);
    let is_of_opengl = camera.model == Model::PINHOLE && !meets.from_minus_one && (at_near + 1.0).abs() < 1e-3;
    if is_of_opengl {
        return faults.warning(
            "GAURAST-Draw-depth-coefficients",
            format!(
                "depthCoefficients are {c0} and {c1}, which give a depth of -1 at nearPlane, as OpenGL's matrices do: Vulkan's \
                 depths are from 0 to 1, unless the pipeline has negativeOneToOne"
            ),
        );
    }
    check_clear(meets, own_way, faults);
    if faults.is_empty() {
        check_direction(camera, meets, own_way, faults);
    }
}

/// Warns of a comparison that nothing passes where the depth is as it was cleared.
fn check_clear(meets: &DepthUse, own_way: Way, faults: &mut Faults) {
    let Some(cleared) = meets.cleared else { return };
    let only_this_way = meets.writers.iter().all(|&op| way_of(op) == own_way);
    let is_never = match own_way {
        Way::Smaller => meets.op == vk::CompareOp::LESS && cleared <= 0.0,
        _ => meets.op == vk::CompareOp::GREATER && cleared >= 1.0,
    };
    if is_never && only_this_way {
        faults.warning(
            "GAURAST-Draw-depth-clear",
            format!("depthCompareOp is {:?}, but the depth is cleared to {cleared}: nothing passes", meets.op),
        );
    }
}

/// Warns of depths that grow the other way than the comparison wants, and of draws before that compare the other way.
fn check_direction(camera: &Camera, meets: &DepthUse, own_way: Way, faults: &mut Faults) {
    let opposite_way = match own_way {
        Way::Smaller => Way::Greater,
        _ => Way::Smaller,
    };
    let is_of = |way: Way| meets.writers.iter().any(|&op| way_of(op) == way);
    if is_of(opposite_way) && !is_of(own_way) {
        return faults.warning(
            "GAURAST-Draw-depth-compare",
            format!(
                "depthCompareOp is {:?}, but the draws before in this pass that write depths compare by {:?}: Gaussians are \
                 drawn behind them alone",
                meets.op, meets.writers[0]
            ),
        );
    }
    let cleared_way = match meets.cleared {
        Some(depth) if depth >= 1.0 => Way::Smaller,
        Some(depth) if depth <= 0.0 => Way::Greater,
        _ => Way::Other,
    };
    let [_, c1] = camera.depth_coefficients;
    let grows = if camera.model == Model::ORTHOGRAPHIC { c1 > 0.0 } else { c1 < 0.0 };
    let is_turned = meets.range.is_some_and(|[least, greatest]| greatest < least);
    let wanted_way = if grows == is_turned { Way::Greater } else { Way::Smaller };
    if cleared_way == own_way && wanted_way != own_way && c1 != 0.0 {
        let range = if is_turned { " in a viewport whose depths are turned" } else { "" };
        let what = if wanted_way == Way::Greater { "smaller" } else { "greater" };
        faults.warning(
            "GAURAST-Draw-depth-compare",
            format!(
                "depthCompareOp is {:?}, but depthCoefficients {:?}{range} give {what} depths to what is farther away: the \
                 farthest is drawn. Reversed depths need GREATER and a clear value of 0",
                meets.op, camera.depth_coefficients
            ),
        );
    }
}
