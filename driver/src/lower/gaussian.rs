//! Lowers Gaussian draws: pipeline, bound buffers, viewport and camera to the three packets of a sorted set.

use super::draw::{Undrawn, attribute_stream, indices};
use crate::command::record::Draw;
use crate::command::state::State;
use crate::object::pipeline::{AttributeSource, GaussianPipeline, GraphicsPipeline};
use simdevice::Packet;
use simdevice::packet::{
    GaussianAppend, GaussianAttributes, GaussianBegin, GaussianState, Viewport,
};
use std::sync::Arc;

/// The packets of one draw.
///
/// # Errors
/// [`Undrawn`] where bound state that the draw needs is missing.
pub(crate) fn draw(
    state: &State,
    pipeline: &GraphicsPipeline,
    gaussian: &GaussianPipeline,
    draw: &Draw,
) -> Result<[Packet; 3], Undrawn> {
    let begin = GaussianBegin {
        state: fixed_state(state, gaussian)?,
        camera: state.camera.ok_or(Undrawn::Camera)?,
        viewport: upright(state.viewport(gaussian).ok_or(Undrawn::Viewport)?),
        scissor: state.scissor(gaussian).ok_or(Undrawn::Scissor)?,
    };
    let append = GaussianAppend {
        attributes: attributes(state, pipeline, gaussian)?,
        indices: indices(state, draw)?,
        first: draw.first,
        count: draw.count,
        first_instance: draw.first_instance,
        instance_count: draw.instance_count,
    };
    Ok([
        Packet::GaussianBegin(Box::new(begin)),
        Packet::GaussianAppend(Box::new(append)),
        Packet::GaussianResolve,
    ])
}

/// What the pipeline fixes, with the dynamic part filled in.
fn fixed_state(state: &State, gaussian: &GaussianPipeline) -> Result<Arc<GaussianState>, Undrawn> {
    if gaussian.dynamic.is_empty() {
        return Ok(Arc::clone(&gaussian.state));
    }
    let mut fixed = gaussian.fixed.clone();
    fixed
        .set_dynamic(&gaussian.dynamic, &state.settings)
        .map_err(Undrawn::Dynamic)?;
    let lowered = fixed.lower();
    Ok(Arc::new(GaussianState {
        depth_stencil: lowered.depth_stencil,
        blend_constants: lowered.blend_constants,
        ..GaussianState::clone(&gaussian.state)
    }))
}

/// A Gaussian's pixels count from the upper left corner of the area that the viewport covers, so a negative
/// height changes nothing but where that corner is.
fn upright(viewport: Viewport) -> Viewport {
    if viewport.height >= 0.0 {
        return viewport;
    }
    Viewport {
        y: viewport.y + viewport.height,
        height: -viewport.height,
        ..viewport
    }
}

fn attributes(
    state: &State,
    pipeline: &GraphicsPipeline,
    gaussian: &GaussianPipeline,
) -> Result<GaussianAttributes, Undrawn> {
    let stream = |source: &AttributeSource| attribute_stream(state, pipeline, source);
    Ok(GaussianAttributes {
        position: stream(&gaussian.position)?,
        scale: stream(&gaussian.scale)?,
        rotation: stream(&gaussian.rotation)?,
        opacity: stream(&gaussian.opacity)?,
        spherical_harmonics: gaussian
            .spherical_harmonics
            .iter()
            .map(stream)
            .collect::<Result<_, _>>()?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_negative_height_moves_the_corner() {
        let viewport = Viewport {
            x: 3.0,
            y: 90.0,
            width: 50.0,
            height: -80.0,
            min_depth: 0.0,
            max_depth: 1.0,
        };
        let upright = upright(viewport);
        assert_eq!((upright.y, upright.height), (10.0, 80.0));
        assert_eq!((upright.x, upright.width), (3.0, 50.0));
    }
}
