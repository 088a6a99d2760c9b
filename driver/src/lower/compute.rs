//! Lowers dispatches: pipeline, bound descriptor sets and push constants to a packet.

use super::bindings::{self, Unbound};
use crate::command::state::State;
use simdevice::Packet;
use simdevice::packet::Dispatch;
use std::sync::Arc;

/// Why a dispatch does nothing: state that it needs is undefined.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub(crate) enum Undispatched {
    /// No pipeline.
    #[error("no compute pipeline is bound")]
    Pipeline,
    /// Something that the pipeline reads is not bound.
    #[error(transparent)]
    Unbound(#[from] Unbound),
}

/// The packet of one dispatch.
///
/// # Errors
/// [`Undispatched`] where bound state that the dispatch needs is missing.
pub(crate) fn dispatch(
    state: &State,
    base: [u32; 3],
    count: [u32; 3],
) -> Result<Packet, Undispatched> {
    let pipeline = state
        .compute_pipeline
        .as_ref()
        .ok_or(Undispatched::Pipeline)?;
    let bindings = bindings::bindings(
        &pipeline.descriptors,
        &state.compute_sets,
        &state.push_constants,
    )?;
    Ok(Packet::Dispatch(Box::new(Dispatch {
        program: Arc::clone(&pipeline.program),
        base,
        count,
        bindings,
    })))
}
