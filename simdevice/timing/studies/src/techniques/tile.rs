//! Tiles: lists of Gaussians by a test of each with each tile, and compositing by the definition.

use super::footprint::{Footprint, Rectangle};
use super::mask::Mask;
use timing::work::TILE_SIDE;

/// The greatest alpha.
const ALPHA_CEILING: f64 = 0.99;
/// The least transmittance.
const TRANSMITTANCE_FLOOR: f64 = 1e-4;
const SIDE: f64 = TILE_SIDE as f64;

/// A view: projected Gaussians in depth order.
#[derive(Clone, Debug, Default)]
pub struct View {
    /// Width and height of the picture in pixels.
    pub size: [u32; 2],
    /// The Gaussians, the nearest first.
    pub footprints: Vec<Footprint>,
}

/// The Gaussians of a tile, in depth order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct List {
    /// The tile's column and row.
    pub at: [u32; 2],
    /// The places of its Gaussians in [`View::footprints`].
    pub places: Vec<u32>,
}

impl List {
    /// The tile's corner in pixels.
    pub fn corner(&self) -> [f64; 2] {
        self.at.map(|at| f64::from(at) * SIDE)
    }
}

impl View {
    /// The lists of all tiles, row by row. A Gaussian is tested with the tiles that its bounds overlap.
    pub fn lists(
        &self,
        bounds: impl Fn(&Footprint) -> Rectangle,
        is_listed: impl Fn(&Footprint, [f64; 2]) -> bool,
    ) -> Vec<List> {
        let [columns, rows] = self.size.map(|side| side.div_ceil(TILE_SIDE));
        let at = |number: u32| [number % columns, number / columns];
        let mut lists: Vec<_> = (0..columns * rows).map(|number| List { at: at(number), places: Vec::new() }).collect();
        for (place, footprint) in self.footprints.iter().enumerate() {
            let bounds = bounds(footprint);
            let range = |axis: usize, tiles: u32| {
                let low = (bounds.low[axis] / SIDE).floor().clamp(0.0, f64::from(tiles)) as u32;
                low..(bounds.high[axis] / SIDE).ceil().clamp(0.0, f64::from(tiles)) as u32
            };
            for row in range(1, rows) {
                for column in range(0, columns) {
                    let list = &mut lists[(row * columns + column) as usize];
                    if is_listed(footprint, list.corner()) {
                        list.places.push(place as u32);
                    }
                }
            }
        }
        lists
    }

    /// The lists by the exact test: alpha is at least its floor somewhere between the tile's pixel centres.
    pub fn exact_lists(&self) -> Vec<List> {
        self.lists(Footprint::bounds, |footprint, corner| footprint.reaches(&Rectangle::centres(corner, SIDE)))
    }

    /// The number of pairs of a tile and a Gaussian in lists by a test.
    pub fn pairs(
        &self,
        bounds: impl Fn(&Footprint) -> Rectangle,
        is_listed: impl Fn(&Footprint, [f64; 2]) -> bool,
    ) -> u64 {
        self.lists(bounds, is_listed).iter().map(|list| list.places.len() as u64).sum()
    }
}

/// A Gaussian in a tile.
#[derive(Clone, Copy, Debug)]
pub struct Pair {
    /// The Gaussian.
    pub footprint: Footprint,
    /// The pixels in which alpha is at least its floor.
    pub covered: Mask,
    /// The pixels that were not finished before it.
    pub open: Mask,
}

/// Composites a tile and calls `visit` with each Gaussian of its list, also after all pixels are finished.
pub fn composite(view: &View, list: &List, mut visit: impl FnMut(&Pair)) {
    let corner = list.corner();
    let [width, height] = view.size.map(f64::from);
    let inside = Mask::of(|x, y| corner[0] + (x as f64) < width && corner[1] + (y as f64) < height);
    let mut transmittance = [[1.0f64; TILE_SIDE as usize]; TILE_SIDE as usize];
    let mut open = inside;
    for &place in &list.places {
        let footprint = view.footprints[place as usize];
        let ([a, b, c], cut) = (footprint.conic(), footprint.cut());
        let form = |x: usize, y: usize| {
            let dx = corner[0] + x as f64 + 0.5 - footprint.mean[0];
            let dy = corner[1] + y as f64 + 0.5 - footprint.mean[1];
            a * dx * dx + 2.0 * b * dx * dy + c * dy * dy
        };
        let covered = Mask::of(|x, y| inside.has(x, y) && form(x, y) <= cut);
        let pair = Pair { footprint, covered, open };
        visit(&pair);
        for (y, row) in transmittance.iter_mut().enumerate() {
            for (x, left) in row.iter_mut().enumerate().filter(|(x, _)| covered.has(*x, y) && pair.open.has(*x, y)) {
                let alpha = (footprint.opacity * (-0.5 * form(x, y)).exp()).min(ALPHA_CEILING);
                let rest = *left * (1.0 - alpha);
                if rest < TRANSMITTANCE_FLOOR {
                    open.0[y] &= !(1 << x);
                } else {
                    *left = rest;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn opaque_layers_finish_a_tile() {
        let large = Footprint { id: 0, mean: [8.0; 2], covariance: [1e6, 0.0, 1e6], opacity: 1.0 };
        let view = View { size: [20, 16], footprints: vec![large; 4] };
        let lists = view.exact_lists();
        assert_eq!(lists.iter().map(|list| list.places.len()).collect::<Vec<_>>(), [4, 4]);
        let mut open = Vec::new();
        lists.iter().for_each(|list| composite(&view, list, |pair| open.push(pair.open.count())));
        // Each layer leaves a hundredth, so that the third leaves less than the floor. Four columns of the second tile are
        // in the picture.
        assert_eq!([open[0], open[1], open[3]], [256, 256, 0]);
        assert_eq!([open[4], open[5], open[7]], [64, 64, 0]);
    }

    #[test]
    fn exact_lists_are_within_those_of_bounds() {
        let tilted = Footprint { id: 0, mean: [24.0; 2], covariance: [130.0, 126.0, 130.0], opacity: 0.9 };
        let view = View { size: [64, 64], footprints: vec![tilted] };
        let exact = view.exact_lists().iter().map(|list| list.places.len()).sum::<usize>() as u64;
        let bounded = view.pairs(Footprint::bounds, |_, _| true);
        assert!(exact < bounded && exact >= 4, "{exact} {bounded}");
        let mut covered = 0;
        for list in view.exact_lists() {
            composite(&view, &list, |pair| covered += u64::from(!pair.covered.is_empty()));
        }
        assert!(covered <= exact && covered + 2 >= exact);
    }
}
