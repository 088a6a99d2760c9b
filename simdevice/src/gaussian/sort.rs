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

const DIGIT_BITS: u32 = 11;
const DIGITS: usize = 1 << DIGIT_BITS;

/// Sorts `(key, payload)` pairs by ascending key; equal keys keep their order.
pub fn sort_by_key(pairs: &mut Vec<(u32, u32)>) {
    let (all, any) = pairs.iter().fold((u32::MAX, 0), |(all, any), &(key, _)| {
        (all & key, any | key)
    });
    let differing = all ^ any;
    let mut other: Vec<(u32, u32)> = host::zeroed(pairs.len());
    let mut shift = 0;
    while shift < u32::BITS {
        let digit = (differing >> shift) & (DIGITS as u32 - 1);
        if digit != 0 {
            scatter(pairs, &mut other, shift);
            std::mem::swap(pairs, &mut other);
        }
        shift += DIGIT_BITS;
    }
}

/// One counting-sort pass over the digit at `shift`.
fn scatter(from: &[(u32, u32)], to: &mut [(u32, u32)], shift: u32) {
    let digit = |key: u32| (key >> shift) as usize & (DIGITS - 1);
    let mut next = [0usize; DIGITS];
    for &(key, _) in from {
        next[digit(key)] += 1;
    }
    let mut start = 0;
    for slot in &mut next {
        start += std::mem::replace(slot, start);
    }
    for &pair in from {
        let slot = &mut next[digit(pair.0)];
        to[*slot] = pair;
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
