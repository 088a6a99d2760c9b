//! The depth sort: a stable radix sort on exactly the bits that differ.

use devmem::host;

/// Maps a binary32 number to an integer that orders alike (negative zero before zero).
pub(super) fn ordered_bits(value: f32) -> u32 {
    let bits = value.to_bits();
    if bits >> 31 == 0 {
        bits | 1 << 31
    } else {
        !bits
    }
}

/// The most bits of a digit: a first-level cache holds a line for each of its values.
const MAX_DIGIT_BITS: u32 = 9;

/// Sorts `(key, payload)` pairs by ascending key; equal keys keep their order.
pub fn sort_by_key(pairs: &mut Vec<(u32, u32)>) {
    let (all, any) = pairs.iter().fold((u32::MAX, 0), |(all, any), &(key, _)| {
        (all & key, any | key)
    });
    let differing = all ^ any;
    if differing == 0 || pairs.is_empty() {
        return;
    }
    let first = differing.trailing_zeros();
    let width = u32::BITS - differing.leading_zeros() - first;
    let bits = width.div_ceil(width.div_ceil(MAX_DIGIT_BITS));
    let mut other: Vec<(u32, u32)> = host::zeroed(pairs.len());
    for shift in (first..first + width).step_by(bits as usize) {
        if (differing >> shift) & ((1 << bits) - 1) != 0 {
            scatter(pairs, &mut other, shift, bits);
            std::mem::swap(pairs, &mut other);
        }
    }
}

/// One counting-sort pass over the digit of so many bits at `shift`.
fn scatter(from: &[(u32, u32)], to: &mut [(u32, u32)], shift: u32, bits: u32) {
    let mask = (1usize << bits.min(MAX_DIGIT_BITS)) - 1;
    let digit = |key: u32| (key >> shift) as usize & mask;
    let mut next = [0u32; 1 << MAX_DIGIT_BITS];
    for &(key, _) in from {
        next[digit(key)] += 1;
    }
    let mut start = 0;
    for slot in &mut next {
        start += std::mem::replace(slot, start);
    }
    for &pair in from {
        let slot = &mut next[digit(pair.0)];
        to[*slot as usize] = pair;
        *slot += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn bits_order_as_numbers_do() {
        let ascending = [
            f32::NEG_INFINITY,
            -1e30,
            -1.0,
            -1e-45,
            -0.0,
            0.0,
            1e-45,
            0.2,
            0.2f32.next_up(),
            3e38,
            f32::INFINITY,
        ];
        for pair in ascending.windows(2) {
            assert!(ordered_bits(pair[0]) < ordered_bits(pair[1]), "{pair:?}");
        }
    }

    proptest! {
        #[test]
        fn it_is_a_stable_sort(keys in prop::collection::vec(prop_oneof![any::<u32>(), 0u32..4, Just(u32::MAX)], 0..300)) {
            let mut pairs: Vec<_> = keys.iter().zip(0..).map(|(&key, at)| (key, at)).collect();
            let mut expected = pairs.clone();
            expected.sort_by_key(|&(key, _)| key);
            sort_by_key(&mut pairs);
            prop_assert_eq!(pairs, expected);
        }
    }
}
