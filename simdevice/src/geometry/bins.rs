//! Binning: the list of primitives of each macro-tile.

use super::primitive::Primitive;
use crate::simd::{both, three};
use crate::state::Rect;
use devmem::host;

/// The grid of macro-tiles that a pass's area touches.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Grid {
    /// The side of a macro-tile in pixels.
    size: i32,
    /// 2^32 / size, rounded up. A multiplication by it replaces the division of a coordinate by the size.
    reciprocal: u64,
    /// The column and row of the first macro-tile.
    first: [u32; 2],
    columns: u32,
    rows: u32,
}

impl Grid {
    /// The macro-tiles of side `size` that share pixels with `area`.
    pub(super) fn new(area: Rect, size: u32) -> Self {
        let span = |start: i32, length: u32| {
            // A pass's area begins at or after the framebuffer's corner.
            let first = start.max(0) as u32 / size;
            let end = (start.max(0) as u32).saturating_add(length).div_ceil(size);
            (first, end.saturating_sub(first))
        };
        let (column, columns) = span(area.x, area.width);
        let (row, rows) = span(area.y, area.height);
        Self { size: size as i32, reciprocal: (1u64 << 32).div_ceil(size.into()), first: [column, row], columns, rows }
    }

    fn tile(&self, column: u32, row: u32, layer: u32) -> u32 {
        let place = [column - self.first[0], row - self.first[1], layer];
        tile_number(self.columns, self.rows, place)
    }
}

/// A rectangle of pixels in the pass's area: the first and the last in x, and in y, both inclusive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Pixels {
    pub x: [i32; 2],
    pub y: [i32; 2],
}

/// The number of a macro-tile in a grid, and a primitive that may touch it.
pub(super) type Pair = (u32, u32);

/// Appends a pair for each macro-tile that a primitive may touch. The primitive covers nothing outside `pixels`.
pub(super) fn bin(grid: &Grid, primitive: &Primitive, number: u32, pixels: Pixels, pairs: &mut Vec<Pair>) {
    let tile = |pixel: i32| ((pixel.max(0) as u64 * grid.reciprocal) >> 32) as u32;
    let tiles = |[first, last]: [i32; 2]| tile(first)..=tile(last);
    let (columns, rows) = (tiles(pixels.x), tiles(pixels.y));
    let layer = primitive.layer.into();
    if columns.start() == columns.end() || rows.start() == rows.end() {
        for row in rows {
            for column in columns.clone() {
                host::push(pairs, (grid.tile(column, row, layer), number));
            }
        }
        return;
    }
    let outline = Outline::new(primitive);
    for row in rows {
        for column in columns.clone() {
            if outline.touches(both([column, row], |tile| i64::from(tile) * i64::from(grid.size)), grid.size) {
                host::push(pairs, (grid.tile(column, row, layer), number));
            }
        }
    }
}

/// The edge functions of a primitive: at x, y each is `at + x * along[0] + y * along[1]`, positive inside.
struct Outline {
    edges: [(i64, [i64; 2]); 4],
}

impl Outline {
    fn new(primitive: &Primitive) -> Self {
        let [a, b, c] = three(primitive.corners, |corner| both(corner, i64::from));
        let d = [a[0] + c[0] - b[0], a[1] + c[1] - b[1]];
        let edge = |from: [i64; 2], to: [i64; 2]| {
            let along = [from[1] - to[1], to[0] - from[0]];
            (-(from[0] * along[0] + from[1] * along[1]), along)
        };
        let edges = match primitive.kind {
            super::PrimitiveKind::Triangle => [edge(a, b), edge(b, c), edge(c, a), edge(c, a)],
            _ => [edge(a, b), edge(b, c), edge(c, d), edge(d, a)],
        };
        Self { edges }
    }

    /// True if it may share a point with the square of `size` pixels whose top left corner is `corner`.
    fn touches(&self, corner: [i64; 2], size: i32) -> bool {
        let (low, side) = (both(corner, |c| 256 * c), 256 * i64::from(size));
        self.edges.iter().all(|&(at, along)| {
            let greatest = |axis: usize| along[axis] * (low[axis] + if along[axis] > 0 { side } else { 0 });
            at + greatest(0) + greatest(1) >= 0
        })
    }
}

/// The number of lists up to which a list is kept for every macro-tile, even if most are empty.
const DENSE_LISTS: usize = 4096;

/// Lists of primitives by macro-tile and layer, each in order.
#[derive(Debug, Default)]
pub struct Bins {
    /// The grid's first column and row.
    origin: [u32; 2],
    columns: u32,
    rows: u32,
    layers: u32,
    /// The macro-tile of the first list. Macro-tiles are numbered by layer, row and column.
    first: u32,
    /// The macro-tiles that have lists, in ascending order. Empty if all from the first to the last have one.
    tiles: Box<[u32]>,
    /// The index of each list's first entry, and the end of the last list.
    starts: Box<[u32]>,
    primitives: Box<[u32]>,
}

impl Bins {
    /// The lists of these pairs. A list keeps the order of its pairs.
    pub(super) fn new(grid: &Grid, layers: u32, pairs: &[Pair]) -> Self {
        let tiles = pairs.iter().map(|pair| pair.0);
        let (mut first, mut last) = (u32::MAX, 0);
        for tile in tiles.clone() {
            first = first.min(tile);
            last = last.max(tile);
        }
        let mut bins =
            Self { origin: grid.first, columns: grid.columns, rows: grid.rows, layers, first, ..Self::default() };
        if pairs.is_empty() {
            return bins;
        }
        let mut lists = (last - first) as usize + 1;
        if lists > DENSE_LISTS + 4 * pairs.len() {
            let mut distinct: Vec<u32> = host::collect(tiles.clone());
            distinct.sort_unstable();
            distinct.dedup();
            lists = distinct.len();
            bins.tiles = distinct.into();
        }
        let mut starts: Vec<u32> = host::zeroed(lists + 1);
        for tile in tiles {
            starts[bins.list(tile).unwrap_or_default() + 1] += 1;
        }
        for place in 1..starts.len() {
            starts[place] += starts[place - 1];
        }
        let mut next = host::copied(&starts);
        let mut primitives: Vec<u32> = host::zeroed(pairs.len());
        for &(tile, primitive) in pairs {
            let next = &mut next[bins.list(tile).unwrap_or_default()];
            primitives[*next as usize] = primitive;
            *next += 1;
        }
        (bins.starts, bins.primitives) = (starts.into(), primitives.into());
        bins
    }

    /// The number of a macro-tile's list, if it has one.
    #[inline]
    fn list(&self, tile: u32) -> Option<usize> {
        if self.tiles.is_empty() {
            tile.checked_sub(self.first).map(|list| list as usize)
        } else {
            self.tiles.binary_search(&tile).ok()
        }
    }

    /// The primitives that may touch a macro-tile, given by column and row from the framebuffer's corner, in a layer:
    /// indices into [`PrimitiveSegment::primitives`](super::PrimitiveSegment::primitives), in the order of the draw.
    pub fn primitives_of(&self, macro_tile: [u32; 2], layer: u32) -> &[u32] {
        let within = |axis: usize, count: u32| {
            let at = macro_tile[axis].checked_sub(self.origin[axis]);
            at.filter(|&at| at < count)
        };
        let (Some(column), Some(row)) = (within(0, self.columns), within(1, self.rows)) else {
            return &[];
        };
        if layer >= self.layers {
            return &[];
        }
        let tile = tile_number(self.columns, self.rows, [column, row, layer]);
        let list = self.list(tile);
        let bounds = list.and_then(|list| self.starts.get(list..list + 2));
        match bounds {
            Some(&[start, end]) => &self.primitives[start as usize..end as usize],
            _ => &[],
        }
    }

    /// The entries of all lists, list by list, so that primitives can be renumbered.
    pub(super) fn names_mut(&mut self) -> &mut [u32] {
        &mut self.primitives
    }

    /// Every primitive in every macro-tile of its layer, for tests that set up primitives by hand.
    #[cfg(test)]
    pub(crate) fn everywhere(primitives: &[Primitive], area: Rect, size: u32, layers: u32) -> Self {
        let grid = Grid::new(area, size);
        let mut pairs = Vec::new();
        for (number, primitive) in primitives.iter().enumerate() {
            for row in 0..grid.rows {
                for column in 0..grid.columns {
                    let at = [grid.first[0] + column, grid.first[1] + row];
                    let tile = grid.tile(at[0], at[1], primitive.layer.into());
                    pairs.push((tile, number as u32));
                }
            }
        }
        Self::new(&grid, layers, &pairs)
    }

    /// The number of pairs of a macro-tile and a primitive.
    pub fn pairs(&self) -> u64 {
        self.primitives.len() as u64
    }

    /// The bytes of host memory that the lists take.
    pub(super) fn memory_bytes(&self) -> usize {
        size_of_val(&*self.starts) + size_of_val(&*self.tiles) + size_of_val(&*self.primitives)
    }
}

/// The number of a macro-tile, given its column, row and layer, in a grid of `columns` and `rows`.
fn tile_number(columns: u32, rows: u32, [column, row, layer]: [u32; 3]) -> u32 {
    (layer * rows + row) * columns + column
}

#[cfg(test)]
mod tests {
    use super::*;

    #[gaurast_runner::test]
    fn few_pairs_far_apart_make_few_lists() {
        let area = Rect { x: 0, y: 0, width: 1024, height: 1024 };
        let grid = Grid::new(area, 64);
        let layers = 2048;
        let at = |column, row, layer| tile_number(16, 16, [column, row, layer]);
        let pairs = [(at(3, 2, 1000), 0), (at(0, 0, 0), 1), (at(3, 2, 1000), 2), (at(15, 15, 2047), 3)];
        let bins = Bins::new(&grid, layers, &pairs);
        assert_eq!(bins.primitives_of([3, 2], 1000), [0, 2]);
        assert_eq!(bins.primitives_of([0, 0], 0), [1]);
        assert_eq!(bins.primitives_of([15, 15], 2047), [3]);
        assert_eq!(bins.primitives_of([3, 3], 1000), [0; 0]);
        assert_eq!(bins.primitives_of([15, 15], 2048), [0; 0]);
        assert_eq!(bins.pairs(), 4);
        assert!(bins.memory_bytes() < 100);
    }
}
