//! Lowers draws of points, lines and triangles: pipeline, dynamic state, bound buffers and descriptor sets to a packet.

use super::bindings;
use super::draw::{Undrawn, attribute_stream, indices};
use crate::command::record::Draw;
use crate::command::state::State;
use crate::object::pipeline::GraphicsPipeline;
use crate::object::pipeline::polygon::{Origin, PolygonPipeline};
use simdevice::Packet;
use simdevice::packet;
use simdevice::state::DrawState;
use std::sync::Arc;

/// The packet of one draw.
///
/// # Errors
/// [`Undrawn`] where bound state that the draw needs is missing.
pub(crate) fn draw(
    state: &mut State,
    pipeline: &GraphicsPipeline,
    polygons: &PolygonPipeline,
    numbers: &Draw,
    draw_index: u32,
) -> Result<Packet, Undrawn> {
    let attributes = polygons
        .attributes
        .iter()
        .map(|source| attribute_stream(state, pipeline, source));
    let bindings =
        |descriptors| bindings::bindings(descriptors, &state.graphics_sets, &state.push_constants);
    Ok(Packet::Draw(Box::new(packet::Draw {
        pipeline: Arc::clone(&polygons.programs),
        attributes: attributes.collect::<Result<_, _>>()?,
        vertex_bindings: bindings(&polygons.vertex_descriptors)?,
        fragment_bindings: bindings(&polygons.fragment_descriptors)?,
        indices: indices(state, numbers)?,
        first: numbers.first,
        count: numbers.count,
        first_instance: numbers.first_instance,
        instance_count: numbers.instance_count,
        draw_index,
        state: fixed_state(state, polygons)?,
    })))
}

/// The fixed-function state, which is made anew only when something of it has changed since the last draw.
fn fixed_state(state: &mut State, polygons: &PolygonPipeline) -> Result<Arc<DrawState>, Undrawn> {
    if let Some(fixed) = polygons.state.as_ref().or(state.draw_state.as_ref()) {
        return Ok(Arc::clone(fixed));
    }
    let mut fixed = polygons.fixed.clone();
    fixed
        .set_dynamic(&polygons.dynamic, &state.settings)
        .map_err(Undrawn::Dynamic)?;
    if !fixed.draw.rasterizer_discard {
        if let Some(count) = dynamic_count(polygons.viewports, state.viewport_count) {
            fixed.draw.viewports = set(&state.viewports, count).ok_or(Undrawn::Viewport)?;
        }
        if let Some(count) = dynamic_count(polygons.scissors, state.scissor_count) {
            fixed.draw.scissors = set(&state.scissors, count).ok_or(Undrawn::Scissor)?;
        }
        let (viewports, scissors) = (fixed.draw.viewports.len(), fixed.draw.scissors.len());
        if viewports != scissors {
            return Err(Undrawn::ScissorCount {
                viewports,
                scissors,
            });
        }
    }
    let lowered = Arc::new(fixed.lower());
    state.draw_state = Some(Arc::clone(&lowered));
    Ok(lowered)
}

/// How many viewports or scissors the command buffer sets; `None` if the pipeline has them.
fn dynamic_count(origin: Origin, set: Option<u32>) -> Option<u32> {
    match origin {
        Origin::Static => None,
        Origin::Dynamic(count) => Some(count),
        Origin::DynamicWithCount => Some(set.unwrap_or(0)),
    }
}

/// The first `count` of what is set, if there are any and all are there.
fn set<T: Copy>(slots: &[Option<T>], count: u32) -> Option<Vec<T>> {
    slots
        .get(..count as usize)
        .filter(|slots| !slots.is_empty())?
        .iter()
        .copied()
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn viewports_are_there_when_all_are_set() {
        assert_eq!(set(&[Some(1), Some(2), None], 2), Some(vec![1, 2]));
        assert_eq!(set(&[Some(1), None], 2), None);
        assert_eq!(set(&[Some(1)], 2), None);
        assert_eq!(set::<u8>(&[], 0), None);
    }
}
