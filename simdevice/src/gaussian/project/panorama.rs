//! Panoramas: pictures that repeat horizontally, so that the right edge continues at the left one.
//!
//! Every Gaussian is drawn at its place and, where that reaches the picture, a period to the right and to the left. A
//! pixel counts at most one of the three: that whose mean is less than half a period away. Ellipses that are narrower
//! than the period ensure that themselves. Wider ones are marked ([`Splat::exceeds_period`]) and cut off by the tile
//! engine.
//!
//! [`Splat::exceeds_period`]: crate::gaussian::splats::splat::Splat::exceeds_period

use super::scratch::PanoramaCopy;
use crate::gaussian::splats::ellipse::Ellipse;
use crate::gaussian::splats::footprint::TileFootprint;
use crate::gaussian::splats::group::ProjectedGroup;
use crate::gaussian::view::visible::Visible;
use devmem::host;

/// The directions in which Gaussians are copied: right and left.
const SIDES: [f64; 2] = [1.0, -1.0];

/// The visible pixels within half a period of a mean at `x`, and a pixel more on each side.
fn near(visible: &Visible, x: f64, period: f64) -> Visible {
    let half = 0.5 * period + 1.0;
    // Outside of the visible range there are no pixels, however far `x` is.
    let pixel = |x: f64| (x as i64).clamp(visible.left, visible.right);
    Visible { left: pixel(libm::floor(x - half)), right: pixel(libm::ceil(x + half)), ..*visible }
}

/// The tiles that a Gaussian and its copies reach, or `None` if there are none. Copies that reach tiles are added to
/// `copies`. If only copies reach tiles, the Gaussian's own footprint is empty.
pub(crate) fn reach(
    at: usize,
    ellipse: &Ellipse,
    period: f64,
    visible: &Visible,
    copies: &mut Vec<PanoramaCopy>,
    projected: &mut ProjectedGroup,
    mut beside: Option<&mut u64>,
) -> Option<TileFootprint> {
    projected.copies.resize_with(SIDES.len(), ProjectedGroup::default);
    let [x, y] = ellipse.mean;
    let before = copies.len();
    for (side, direction) in SIDES.into_iter().enumerate() {
        let x = x + direction * period;
        let copy = Ellipse { mean: [x, y], ..*ellipse };
        let spans = &mut projected.copies[side].spans;
        let visible = near(visible, x, period);
        if let Some(reach) = copy.reach(&visible, spans, beside.as_deref_mut()) {
            copies.push(PanoramaCopy { at, side, footprint: reach });
        }
    }
    let reach = ellipse.reach(&near(visible, x, period), &mut projected.spans, beside);
    let by_copies = (copies.len() > before).then(TileFootprint::default);
    reach.or(by_copies)
}

/// Appends the copies of the kept Gaussian `at`, the last one of `projected`, and removes them from `copies`. Copies of
/// Gaussians that were skipped before it are removed, too.
pub(crate) fn copy_last(at: usize, period: f64, copies: &mut &[PanoramaCopy], projected: &mut ProjectedGroup) {
    while let Some((&PanoramaCopy { at: of, side, footprint }, rest)) =
        copies.split_first().filter(|(copy, _)| copy.at <= at)
    {
        *copies = rest;
        let last = projected.splats.last().zip(projected.keys.last());
        let Some((mut splat, &key)) = last.map(|(splat, key)| (*splat, key)).filter(|_| of == at) else {
            continue;
        };
        splat.mean[0] += SIDES[side] * period;
        let to = &mut projected.copies[side];
        to.splats.push(splat);
        // A copy has the same depth along a pixel's ray.
        to.ray_depths.extend(projected.ray_depths.last().copied());
        to.identities.extend(projected.identities.last().copied());
        to.keys.push(key);
        to.reaches.push(footprint);
    }
}

/// Moves the copies to groups of their own after all others. A copy has the key and sequence number of its original. No
/// pixel counts two of them, so their order among themselves does not matter.
pub(crate) fn append_copies(groups: &mut Vec<ProjectedGroup>) {
    let copies = groups
        .iter_mut()
        .flat_map(|group| std::mem::take(&mut group.copies))
        .filter(|copies| !copies.splats.is_empty());
    let copies = host::collect(copies);
    host::reserve(groups, copies.len());
    groups.extend(copies);
}

#[cfg(test)]
mod tests {
    use super::*;

    const VISIBLE: Visible = Visible { left: 0, top: 0, right: 100, bottom: 50 };

    fn tiles(x: f64, half: f64) -> [Vec<u32>; 3] {
        let ellipse =
            Ellipse { mean: [x, 20.0], half: [half, 2.0], slope: 0.0, narrowing: (half / 2.0).powi(2), peak: 0.0 };
        let (mut projected, mut copies) = (ProjectedGroup::default(), Vec::new());
        let reach = reach(0, &ellipse, 100.0, &VISIBLE, &mut copies, &mut projected, Some(&mut 0));
        let columns = |reach: &TileFootprint, spans: &[_]| {
            let spans = reach.spans(spans);
            spans.flat_map(|(_, span)| span.first.into()..span.end.into()).collect::<Vec<u32>>()
        };
        let mut found: [Vec<u32>; 3] = Default::default();
        if let Some(reach) = reach {
            found[0] = columns(&reach, &projected.spans);
        }
        for PanoramaCopy { side, footprint, .. } in copies {
            found[1 + side] = columns(&footprint, &projected.copies[side].spans);
        }
        found
    }

    #[gaurast_runner::test]
    fn only_visible_tiles_are_reached_from_however_far() {
        for x in [-1e30, -1e19, 1e19, 1e30, f64::INFINITY, f64::NAN] {
            for half in [2.0, 1e18, 1e31, f64::INFINITY, f64::NAN] {
                let all = tiles(x, half);
                assert!(all.iter().flatten().all(|&column| column < 7), "{x} {half}");
            }
        }
    }

    #[gaurast_runner::test]
    fn what_straddles_the_seam_is_on_both_sides() {
        let nothing = Vec::new;
        assert_eq!(tiles(50.0, 5.0), [vec![2, 3], nothing(), nothing()]);
        assert_eq!(tiles(2.0, 5.0), [vec![0], vec![6], nothing()]);
        assert_eq!(tiles(99.0, 5.0), [vec![5, 6], nothing(), vec![0]]);
        // Its mean is outside of the picture.
        assert_eq!(tiles(-30.0, 5.0), [nothing(), vec![4], nothing()]);
        assert_eq!(tiles(-200.0, 5.0), [nothing(), nothing(), nothing()]);
    }

    #[gaurast_runner::test]
    fn a_wide_one_is_cut_off_half_a_period_away() {
        let [itself, right, left] = tiles(20.0, 300.0);
        assert_eq!(itself, (0..5).collect::<Vec<u32>>());
        assert_eq!(right, [4, 5, 6]);
        assert_eq!(left, Vec::<u32>::new());
    }
}
