//! Sorted sets of several draws.

use std::sync::Arc;

use ash::vk;

use crate::facts::Facts;
use crate::objects::Pipeline;
use crate::recording::{Recording, Shared};
use crate::report::Faults;

/// `vkCmdBeginGaussianSetGAURAST`.
pub(crate) fn begin(recording: &mut Recording, facts: &Facts, faults: &mut Faults) {
    let before = faults.0.len();
    faults.require(facts.features.merged_draws != 0, "VUID-vkCmdBeginGaussianSetGAURAST-mergedDraws-90001", || {
        "vkCmdBeginGaussianSetGAURAST is recorded, but the feature mergedDraws is not enabled".to_owned()
    });
    faults.require(recording.pass.is_some(), "VUID-vkCmdBeginGaussianSetGAURAST-renderpass", || {
        "vkCmdBeginGaussianSetGAURAST is recorded outside of a render pass".to_owned()
    });
    faults.require(recording.set.is_none(), "VUID-vkCmdBeginGaussianSetGAURAST-None-90002", || {
        "a set begins, but the one before has not ended".to_owned()
    });
    if faults.0.len() == before {
        recording.set = Some(None);
        recording.first_of_set = None;
    }
}

/// `vkCmdEndGaussianSetGAURAST`.
pub(crate) fn end(recording: &mut Recording, facts: &Facts, faults: &mut Faults) {
    let is_open = recording.set.take().is_some();
    recording.first_of_set = None;
    // Where sets are not enabled, it was said already that none has begun.
    faults.require(is_open || facts.features.merged_draws == 0, "VUID-vkCmdEndGaussianSetGAURAST-None-90004", || {
        "a set ends, but none has begun in this command buffer".to_owned()
    });
}

/// A command at which no set may be open.
pub(crate) fn require_ended(recording: &mut Recording, command: &str, faults: &mut Faults) {
    let is_open = recording.set.take().is_some();
    faults.require(!is_open, "VUID-vkCmdBeginGaussianSetGAURAST-None-90003", || {
        format!(
            "{command} is recorded within a set: it must end in the subpass and the command buffer in which it \
             has begun"
        )
    });
}

/// The end of a query: what a set draws is drawn where the set ends.
pub(crate) fn check_query(recording: &Recording, faults: &mut Faults) {
    if matches!(recording.set, Some(Some(_))) {
        faults.warning(
            "GAURAST-Set-query",
            "a query ends within a set that has draws: the set is drawn where it ends, so that the query does not count it",
        );
    }
}

/// A draw of Gaussians: in a set it shares the state of the first one.
pub(crate) fn check_draw(recording: &mut Recording, faults: &mut Faults) {
    let Some(pipeline) = recording.pipeline.clone() else {
        return;
    };
    let shared = shared(recording, pipeline);
    match &mut recording.set {
        None => {}
        Some(first @ None) => *first = Some(shared),
        Some(Some(first)) if !Arc::ptr_eq(&first.pipeline, &shared.pipeline) => {
            faults.error("VUID-vkCmdDraw-None-90005", "a set has another pipeline at this draw than at its first one");
        }
        Some(Some(first)) => {
            let differs = if first.cameras == shared.cameras {
                let mut states = first.dynamic.iter().zip(&shared.dynamic);
                let other = states.find(|((_, a), (_, b))| a != b);
                other.map(|((&state, _), _)| format!("the dynamic state {:?}", vk::DynamicState::from_raw(state)))
            } else {
                Some("the camera".to_owned())
            };
            if let Some(what) = differs {
                faults.error(
                    "VUID-vkCmdDraw-None-90006",
                    format!("{what} has another value at this draw of a set than at its first one"),
                );
            }
        }
    }
}

fn shared(recording: &Recording, pipeline: Arc<Pipeline>) -> Shared {
    let cameras = recording.cameras.iter().flat_map(|cameras| cameras.iter());
    let cameras = cameras.flat_map(|camera| format!("{:?}", **camera).into_bytes()).collect();
    let dynamic = (pipeline.dynamic.iter())
        .map(|state| {
            let value = recording.dynamic.get(&state.as_raw());
            (state.as_raw(), value.cloned().unwrap_or_default())
        })
        .collect();
    Shared { pipeline, cameras, dynamic }
}
