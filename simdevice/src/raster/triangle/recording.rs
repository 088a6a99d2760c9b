//! The record of the work of points, lines and triangles: before their tiles, and in each tile.

use crate::geometry::PrimitiveDraw;
use crate::limits::{MAX_MACRO_TILE_SIZE, TILE_SIZE};
use crate::packet::Draw;
use crate::stats::counters::{Counter, Counters};
use crate::stats::recorder::{DrawRecord, ShaderWork, shader_work, sized_tiles};
use timing::work::{DrawWork, Mode, Run, TILE_GROUPS, TileWork};

/// The numbers per primitive that the rasterizer reads; GauRast, Table II.
const NUMBERS_IN: u64 = 9;

/// The work of a draw in the tiles of a macro-tile.
#[derive(Debug)]
pub(crate) struct MacroTileWork {
    tiles: Vec<TileWork>,
}

impl Default for MacroTileWork {
    fn default() -> Self {
        let tiles = (MAX_MACRO_TILE_SIZE / TILE_SIZE).pow(2);
        Self { tiles: vec![TileWork::default(); tiles as usize] }
    }
}

impl MacroTileWork {
    /// Records a primitive whose bounding box touches a tile and which covers `blocks` of its 4x4 blocks.
    pub(crate) fn list(&mut self, tile: usize, blocks: u32) {
        let tile = &mut self.tiles[tile];
        tile.listed += 1;
        if tile.runs.is_empty() {
            tile.runs.push(Run { rows: TILE_GROUPS as u8, blocks: TILE_GROUPS as u8, ..Run::default() });
        }
        for run in &mut tile.runs {
            run.primitives += 1;
            run.reached += blocks;
        }
    }

    /// Records that the primitive that was listed last is hidden in all of a tile.
    pub(crate) fn hide(&mut self, tile: usize, blocks: u32) {
        let tile = &mut self.tiles[tile];
        for run in &mut tile.runs {
            run.hidden += 1;
            run.hidden_blocks += blocks;
            run.reached -= blocks;
        }
    }

    /// Records the early tests of a block: the covered lanes and those that passed, both by sample.
    pub(crate) fn test<const N: usize>(&mut self, tile: usize, covered: &[u16; N], left: &[u16; N]) {
        let any = |lanes: &[u16; N]| lanes.iter().fold(0, |any, lanes| any | lanes);
        let quads = |lanes: u16| {
            let pairs = lanes | lanes >> 1;
            ((pairs | pairs >> 2) & 0x1111).count_ones()
        };
        let (covered, left) = (any(covered), any(left));
        let tile = &mut self.tiles[tile];
        tile.quads += quads(left);
        tile.killed += quads(covered) - quads(left);
        tile.contributions += u64::from(left.count_ones());
    }
}

/// The record of a draw of primitives before any work.
pub(crate) fn no_primitives() -> DrawWork {
    DrawWork { mode: Mode::Triangle, ..DrawWork::default() }
}

/// Adds the work of a part of a draw before its tiles. `counters` are those of the part alone.
pub(crate) fn add_front_end(record: &DrawRecord, counters: &Counters, draw: &Draw, part: &PrimitiveDraw) {
    let shaded = counters.get(Counter::VertexInvocations);
    let drawn = counters.get(Counter::PrimitivesDrawn);
    let attributes = draw.attributes.iter();
    let read: usize = attributes.map(|stream| stream.format.texel_size()).sum();
    // A vertex's outputs are a position and the varyings.
    let written = 4 * (4 + part.varyings_per_vertex() as u64);
    let index = draw.indices.as_ref().map_or(0, |indices| indices.index_size);
    let bytes = shaded * (read as u64 + written)
        + counters.get(Counter::InputVertices) * u64::from(index)
        + drawn * 4 * NUMBERS_IN;
    let mut preprocess = shader_work(counters);
    preprocess.bytes += bytes as f64;
    let mut sized = [0; 4];
    for primitive in part.segments.iter().flat_map(|segment| &segment.primitives) {
        let Some(&region) = part.regions.get(usize::from(primitive.viewport)) else {
            continue;
        };
        let side = |axis: usize, of: fn(i32, i32) -> i32| {
            let at = primitive.corners.map(|corner| corner[axis]);
            f64::from(of(of(at[0], at[1]), at[2])) / 256.0
        };
        let (low, high) = ([0, 1].map(|k| side(k, i32::min)), [0, 1].map(|k| side(k, i32::max)));
        for (sum, tiles) in sized.iter_mut().zip(sized_tiles(low, high, region)) {
            *sum += tiles;
        }
    }
    record.update(|work| {
        work.primitives += counters.get(Counter::InputPrimitives);
        work.drawn += drawn;
        work.preprocess = work.preprocess.plus(&preprocess);
        // Lists are built outside of the shader cores, and cost only memory traffic.
        work.sort.bytes += 4.0 * sized[1] as f64;
        for (sum, tiles) in work.sized_pairs.iter_mut().zip(sized) {
            *sum += tiles;
        }
    });
}

/// Adds the work in macro-tile `at` of `size` x `size` pixels. `counters` are those of the macro-tile alone.
pub(crate) fn add_macro_tile(record: &DrawRecord, at: [u32; 2], size: u32, done: MacroTileWork, counters: &Counters) {
    let side = size / TILE_SIZE;
    let listed = done.tiles.into_iter().enumerate();
    let listed = listed.filter(|(_, tile)| tile.listed > 0);
    let shade: ShaderWork = shader_work(counters);
    record.update(|work| {
        work.shade = work.shade.plus(&shade);
        work.tiles.extend(listed.map(|(index, tile)| TileWork {
            at: [at[0] * side + index as u32 % side, at[1] * side + index as u32 / side],
            ..tile
        }));
    });
}

#[cfg(test)]
mod tests {

    use super::*;

    #[gaurast_runner::test]
    fn quads_and_blocks_are_counted_once() {
        let mut work = MacroTileWork::default();
        work.list(3, 5);
        // Lanes of a quad are consecutive. Of three covered quads, early tests leave one.
        work.test(3, &[0x0F31], &[0x0030]);
        work.test(3, &[0x0001, 0x0002], &[0x0001, 0]);
        work.list(3, 16);
        work.hide(3, 16);
        work.list(3, 0);
        let tile = &work.tiles[3];
        assert_eq!((tile.listed, tile.runs[0].primitives), (3, 3));
        assert_eq!((tile.runs[0].reached, tile.hidden_blocks()), (5, 16));
        assert_eq!((tile.quads, tile.killed, tile.hidden()), (2, 2, 1));
        assert_eq!(tile.contributions, 3);
        assert_eq!(work.tiles[0], TileWork::default());
    }
}
