//! Cut-offs in the device's own tiles: the tiles that they leave out are taken from footprints.

use super::scratch::Scratch;
use super::surfel::surfel_of;
use crate::gaussian::lanes::Bits;
use crate::gaussian::splats::footprint::TileSpan;
use crate::gaussian::view::constants::ViewConstants;
use crate::gaussian::view::cut_off::TileCutOff;
use crate::state::gaussian::GaussianGeometry;

/// Takes the device's tiles that the cut-off leaves out from what lanes reach, and lanes that reach no other from `reached`.
/// Spans that are not held by footprints lie in `others`.
pub(crate) fn clip(
    view: &ViewConstants,
    cut_off: &TileCutOff,
    scratch: &mut Scratch,
    others: &mut [TileSpan],
    reached: &mut Bits,
) {
    let mut left = Bits::default();
    reached.for_each(|at| {
        let tiles = match view.geometry {
            GaussianGeometry::Surfel => surfel_of(view, at, scratch).tiles,
            GaussianGeometry::Volume => {
                let screen = &*scratch.screen;
                let mean = [screen.mean[0][at], screen.mean[1][at]];
                let factor = [0, 1, 2].map(|element| screen.factor[element][at]);
                cut_off.tiles(mean, factor, screen.log2_opacity[at] as f32)
            }
        };
        let [columns, rows] = cut_off.device_tiles(tiles);
        let mut reach = scratch.reaches.get(at);
        let spans: Vec<(u32, TileSpan)> = reach.spans(others).collect();
        let mut any = false;
        for (number, (row, span)) in (0..).zip(spans) {
            let clipped = if (rows[0]..rows[1]).contains(&f64::from(row)) {
                // No tile is beyond 16 bits; conversions saturate.
                let first = span.first.max(columns[0].max(0.0) as u16);
                let end = span.end.min(columns[1].max(0.0) as u16);
                TileSpan { first, end }
            } else {
                TileSpan::default()
            };
            let is_empty = clipped.first >= clipped.end;
            any |= !is_empty;
            let clipped = if is_empty { TileSpan::default() } else { clipped };
            reach.set(others, number, clipped);
        }
        scratch.reaches.set(at, &reach);
        left.set_one(at, any);
    });
    *reached = left;
}
