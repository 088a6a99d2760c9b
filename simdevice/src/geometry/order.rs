//! The order of a segment's primitives and vertices in memory: that in which macro-tiles read them. A tile then reads
//! memory sequentially, instead of waiting for each of many small primitives.

use super::bins::Bins;
use super::primitive::Primitive;
use super::setup::{NONE, Output};
use devmem::host;

/// The least number of primitives in a segment that is reordered. The front end's own tests expect primitives in the
/// order of the draw.
pub(super) const FEW: usize = if cfg!(test) { usize::MAX } else { 128 };

/// The primitives and the varyings of a segment, in the order of its bins, whose entries are renumbered. A segment of
/// fewer than `few` primitives is not reordered.
pub(super) fn in_order(output: &Output, per_vertex: usize, bins: &mut Bins, few: usize) -> (Vec<Primitive>, Vec<u32>) {
    if output.primitives.len() < few {
        return (host::copied(&output.primitives), host::copied(&output.varyings));
    }
    let mut ordered = Ordered {
        output,
        per_vertex,
        numbers: host::filled(NONE, output.vertices as usize),
        vertices: 0,
        varyings: host::with_capacity(output.varyings.len()),
    };
    let mut numbers = host::filled(NONE, output.primitives.len());
    let mut primitives = host::with_capacity(output.primitives.len());
    for name in bins.names_mut() {
        let number = &mut numbers[*name as usize];
        if *number == NONE {
            *number = primitives.len() as u32;
            let mut primitive = output.primitives[*name as usize];
            for vertex in &mut primitive.vertices {
                *vertex = ordered.number(*vertex);
            }
            primitive.provoking = ordered.number(primitive.provoking);
            host::push(&mut primitives, primitive);
        }
        *name = *number;
    }
    (primitives, ordered.varyings)
}

/// Vertices in the order of their first use.
struct Ordered<'a> {
    output: &'a Output,
    per_vertex: usize,
    /// The new number of each old one, or [`NONE`].
    numbers: Vec<u32>,
    vertices: u32,
    varyings: Vec<u32>,
}

impl Ordered<'_> {
    #[inline(always)]
    fn number(&mut self, old: u32) -> u32 {
        let number = &mut self.numbers[old as usize];
        if *number == NONE {
            *number = self.vertices;
            self.vertices += 1;
            let at = old as usize * self.per_vertex;
            let varyings = &self.output.varyings[at..at + self.per_vertex];
            host::extend(&mut self.varyings, varyings);
        }
        *number
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::bins::Grid;
    use crate::geometry::{PrimitiveKind, Varyings};
    use crate::state::Rect;

    /// A primitive with these three vertices.
    fn primitive(id: u32, vertices: [u32; 3]) -> Primitive {
        Primitive {
            corners: [[0; 2]; 3],
            offsets: [[0; 2]; 3],
            depth: [0.0; 3],
            inverse_w: [1.0; 3],
            vertices,
            provoking: vertices[id as usize % 3],
            id,
            kind: PrimitiveKind::Triangle,
            front: true,
            viewport: 0,
            layer: 0,
        }
    }

    #[gaurast_runner::test]
    fn every_tile_finds_the_same_in_the_same_order() {
        let few = 100;
        for count in [few as u32 / 2, 5 * few as u32] {
            let mut output = Output {
                vertices: count + 2,
                varyings: (0..2 * (count + 2)).map(|value| 1000 + value).collect(),
                primitives: (0..count).map(|id| primitive(id, [id, id + 1, (id * 7) % count])).collect(),
                ..Output::default()
            };
            // Primitives are in up to three tiles; some are in none.
            for id in 0..count {
                for tile in 0..id % 4 {
                    output.pairs.push(((id * 13 + tile * 5) % 16, id));
                }
            }
            let area = Rect { x: 0, y: 0, width: 256, height: 256 };
            let grid = Grid::new(area, 64);
            let before = Bins::new(&grid, 1, &output.pairs);
            let mut after = Bins::new(&grid, 1, &output.pairs);
            let (primitives, values) = in_order(&output, 2, &mut after, few);
            let varyings = |values: &[u32], primitive: &Primitive| {
                let [a, b, c] = primitive.vertices;
                [a, b, c, primitive.provoking].map(|vertex| {
                    let at = 2 * vertex as usize;
                    [values[at], values[at + 1]]
                })
            };
            let old = Varyings { values: output.varyings.clone(), per_vertex: 2 };
            for tile in 0..16 {
                let at = [tile % 4, tile / 4];
                let (expected, found) = (before.primitives_of(at, 0), after.primitives_of(at, 0));
                assert_eq!(expected.len(), found.len());
                for (&expected, &found) in expected.iter().zip(found) {
                    let (a, b) = (&output.primitives[expected as usize], &primitives[found as usize]);
                    assert_eq!(a.id, b.id);
                    assert_eq!(varyings(&old.values, a), varyings(&values, b));
                }
            }
        }
    }
}
