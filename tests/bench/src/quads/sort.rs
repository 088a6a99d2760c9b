//! A radix sort of (key, index) pairs.

/// Bits of a digit.
const BITS: u32 = 11;

/// Sorts `pairs` by their keys, ascending and stably. `scratch` is working memory.
pub(super) fn sort(pairs: &mut Vec<(u32, u32)>, scratch: &mut Vec<(u32, u32)>) {
    let differing = pairs.iter().fold(0, |bits, pair| bits | (pair.0 ^ pairs[0].0));
    scratch.resize(pairs.len(), (0, 0));
    for shift in (0..u32::BITS).step_by(BITS as usize) {
        let digit = |key: u32| (key >> shift & ((1 << BITS) - 1)) as usize;
        if digit(differing) == 0 {
            continue;
        }
        let mut next = [0_u32; 1 << BITS];
        for pair in pairs.iter() {
            next[digit(pair.0)] += 1;
        }
        let mut sum = 0;
        for count in &mut next {
            sum += std::mem::replace(count, sum);
        }
        for pair in pairs.iter() {
            let place = &mut next[digit(pair.0)];
            scratch[*place as usize] = *pair;
            *place += 1;
        }
        std::mem::swap(pairs, scratch);
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn it_is_a_stable_sort(
            keys in prop::collection::vec(prop_oneof![any::<u32>(), 0..5_u32, Just(1 << 30)], 0..300),
        ) {
            let mut pairs: Vec<(u32, u32)> = keys.into_iter().zip(0..).collect();
            let mut expected = pairs.clone();
            expected.sort_by_key(|pair| pair.0);
            super::sort(&mut pairs, &mut vec![(7, 7); 9]);
            prop_assert_eq!(pairs, expected);
        }
    }
}
