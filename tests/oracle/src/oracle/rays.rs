//! The per-pixel order: depths along a pixel's ray ([`own_axes`](super::own_axes)) and the orders that they allow.
//!
//! If a correct binary64 implementation may round two depths so that neighbours change places, the order is
//! undecidable, and the reference follows both orders.

use super::own_axes::RayDepth;
use super::pixel::{MAX_DECISIONS, Pixel};

/// Rounds to 36 bits of the significand, halves away from zero.
pub fn rounded(depth: f64) -> f64 {
    let bits = depth.to_bits().wrapping_add(1 << 15);
    f64::from_bits(bits & !0xFFFF) + 0.0
}

/// Composites the Gaussians that reach a pixel in every order that their depths allow, the binary64 order first.
///
/// `reached` is in the order of the draw; `add` adds one of it to a pixel. Two of which `are_tied` is true are in the order of
/// the draw.
pub(super) fn composite<T>(
    reached: &[(RayDepth, T)],
    are_tied: impl Fn(&T, &T) -> bool,
    add: impl Fn(&mut Pixel, &T),
) -> Pixel {
    let mut nominal: Vec<usize> = (0..reached.len()).collect();
    let key = |index: usize| rounded(reached[index].0.value);
    nominal.sort_by(|&a, &b| key(a).total_cmp(&key(b)));
    let draw = |order: &[usize]| {
        let mut pixel = Pixel::EMPTY;
        for &index in order {
            add(&mut pixel, &reached[index].1);
        }
        pixel
    };
    let mut pixel = draw(&nominal);
    let swap = |first: usize, second: usize| {
        may_swap(reached, first, second) && !are_tied(&reached[first].1, &reached[second].1)
    };
    let swaps: Vec<usize> = (1..nominal.len()).filter(|&at| swap(nominal[at - 1], nominal[at])).collect();
    let followed = swaps.len().min(MAX_DECISIONS as usize);
    for which in 1..1usize << followed {
        let mut order = nominal.clone();
        for (bit, &at) in swaps[..followed].iter().enumerate() {
            if which >> bit & 1 == 1 {
                order.swap(at - 1, at);
            }
        }
        pixel.take_ways_of(draw(&order));
    }
    if followed < swaps.len() {
        pixel.exhaust();
    }
    pixel
}

/// True if the second of two neighbours may come first.
fn may_swap<T>(reached: &[(RayDepth, T)], first: usize, second: usize) -> bool {
    let greatest = |depth: &RayDepth| rounded(depth.value + depth.error);
    let least = |depth: &RayDepth| rounded(depth.value - depth.error);
    let (latest, earliest) = (greatest(&reached[first].0), least(&reached[second].0));
    // Equal depths are in the order of the draw.
    earliest < latest || earliest == latest && second < first
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_keeps_36_bits() {
        let step = 2.0f64.powi(-36);
        for x in [1.5, -1.5, 1.0 + step, -1.0 - 3.0 * step] {
            assert_eq!(rounded(x), x);
            assert_eq!(rounded(x + 0.4 * step), x);
            assert_eq!(rounded(x - 0.2 * step), x);
        }
        assert_eq!(rounded(1.0 + 0.5 * step), 1.0 + step);
        assert!(rounded(-0.0).is_sign_positive());
    }

    #[test]
    fn orders_are_followed_where_they_cannot_be_told() {
        let depth = |value: f64| RayDepth { value, error: 1e-14 };
        let step = 2.0f64.powi(-36);
        let swap = |a: f64, b: f64| may_swap(&[(depth(a), ()), (depth(b), ())], 0, 1);
        assert!(!swap(1.0, 2.0));
        // The depths are certainly equal: the order of the draw.
        assert!(!swap(1.0, 1.0));
        // Either may round to the next number. If only the first may, the depths are equal at most.
        assert!(swap(1.0 + 0.5 * step, 1.0 + 0.5 * step));
        assert!(!swap(1.0 + 0.5 * step, 1.0 + 0.6 * step));
        assert!(!swap(1.0, 1.0 + 0.5 * step));
    }
}
