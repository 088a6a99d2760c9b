//! Sort keys and sequence numbers of kept Gaussians.

use super::scratch::Scratch;
use crate::gaussian::read::group::Sequence;
use crate::gaussian::sort::radix::ordered_bits;
use crate::gaussian::view::constants::ViewConstants;
use crate::state::gaussian::GaussianOrder;

/// Computes the sort key and the sequence number of each kept lane.
#[inline(always)]
pub(crate) fn find_keys(view: &ViewConstants, sequence: Sequence<'_>, scratch: &mut Scratch) {
    let [keys, sequences] = &mut *scratch.keys;
    let to_lanes = sequences.iter_mut().zip(&scratch.lanes);
    match sequence {
        Sequence::From(first) => to_lanes.for_each(|(to, &lane)| *to = first + lane as u32),
        // All lanes are there, in order.
        Sequence::Listed(first, numbers) if numbers.len() == scratch.lanes.len() => {
            let to_lanes = sequences.iter_mut().zip(numbers);
            to_lanes.for_each(|(to, &number)| *to = first + number);
        }
        Sequence::Listed(first, numbers) => {
            to_lanes.for_each(|(to, &lane)| *to = first + numbers[lane]);
        }
    }
    match view.order {
        GaussianOrder::ViewDepth => {
            for (key, &depth) in keys.iter_mut().zip(&*scratch.depth) {
                *key = ordered_bits(depth as f32);
            }
        }
        GaussianOrder::RadialDistance => {
            let [x, y, z] = &*scratch.offset;
            for (key, ((x, y), z)) in keys.iter_mut().zip(x.iter().zip(y).zip(z)) {
                *key = ordered_bits((x * x + y * y + z * z).sqrt() as f32);
            }
        }
        // Per-pixel sorting happens later, and uses the order of the draw for equal depths.
        GaussianOrder::Primitive | GaussianOrder::PerPixel => *keys = *sequences,
    }
}
