//! Commands that begin and end a sorted set, which several draws share.

use super::Command;
use super::buffer::{CommandBuffer, Recorder};
use crate::abi::error::Error;
use std::sync::Arc;

#[doc(alias = "vkCmdBeginGaussianSetGAURAST")]
pub(crate) fn cmd_begin_gaussian_set(command_buffer: &CommandBuffer) -> Result<(), Error> {
    let enabled = Arc::clone(command_buffer.device().enabled());
    command_buffer.record("vkCmdBeginGaussianSetGAURAST", |recorder| {
        enabled.require(enabled.features().merged_draws, || Error::FeatureNotEnabled {
            vuid: "VUID-vkCmdBeginGaussianSetGAURAST-mergedDraws-90001",
            message: "a set of draws is begun, but the feature mergedDraws is not enabled".into(),
        })?;
        recorder.require_pass()?;
        if recorder.has_gaussian_set {
            return Err(Error::usage(
                "VUID-vkCmdBeginGaussianSetGAURAST-None-90002",
                "the set that was begun before has not ended",
            ));
        }
        recorder.has_gaussian_set = true;
        recorder.push(Command::BeginGaussianSet);
        Ok(())
    })
}

#[doc(alias = "vkCmdEndGaussianSetGAURAST")]
pub(crate) fn cmd_end_gaussian_set(recorder: &mut Recorder) -> Result<(), Error> {
    if !std::mem::take(&mut recorder.has_gaussian_set) {
        return Err(Error::usage(
            "VUID-vkCmdEndGaussianSetGAURAST-None-90004",
            "no set was begun in this command buffer, or it has ended",
        ));
    }
    recorder.push(Command::EndGaussianSet);
    Ok(())
}
