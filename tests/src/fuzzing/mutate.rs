//! Random changes of bytes and of whole instructions in modules.

use rand::Rng;
use rand::seq::IndexedRandom;
use rand_chacha::ChaCha8Rng;

/// The words before the first instruction.
const HEADER: usize = 5;

/// The start and the length, in words, of each instruction of a module.
fn instructions(words: &[u32]) -> Vec<(usize, usize)> {
    let mut all = Vec::new();
    let mut at = HEADER;
    while at < words.len() && words[at] >> 16 > 0 {
        let count = ((words[at] >> 16) as usize).min(words.len() - at);
        all.push((at, count));
        at += count;
    }
    all
}

/// Bytes with a few changes: some set, some cut out or doubled, some taken from `other`.
pub fn mutate_bytes(random: &mut ChaCha8Rng, bytes: &[u8], other: &[u8]) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    for _ in 0..random.random_range(1..=6) {
        let at = random.random_range(0..=bytes.len());
        let len = random.random_range(0..=16.min(bytes.len() - at));
        match random.random_range(0..8) {
            0 => drop(bytes.drain(at..at + len)),
            1 => {
                let copy = bytes[at..at + len].to_vec();
                bytes.splice(at..at, copy);
            }
            2 => bytes.truncate(at),
            3 if !other.is_empty() => {
                let from = random.random_range(0..other.len());
                let to = other.len().min(from + random.random_range(0..40usize));
                bytes.splice(at..at + len, other[from..to].iter().copied());
            }
            4 => {
                let number = number(random, 100).to_le_bytes();
                for (byte, new) in bytes[at..].iter_mut().zip(number) {
                    *byte = new;
                }
            }
            _ => {
                if let Some(byte) = bytes.get_mut(at) {
                    *byte = random.random();
                }
            }
        }
    }
    bytes
}

/// An edge case or any number.
fn number(random: &mut ChaCha8Rng, bound: u32) -> u32 {
    match random.random_range(0..5) {
        0 => random.random(),
        1 => random.random_range(0..16),
        2 => *[0, u32::MAX, 1 << 31, i32::MAX.cast_unsigned(), 0x7f80_0000, 0xffff].choose(random).expect("some"),
        _ => random.random_range(0..bound.max(1)),
    }
}

/// A module like the first, with one to three changes; some of them take instructions from the second.
pub fn mutate(random: &mut ChaCha8Rng, original: &[u32], other: &[u32]) -> Vec<u32> {
    let mut words = original.to_vec();
    for _ in 0..*[1, 1, 2, 3].choose(random).expect("some") {
        change(random, &mut words, other);
    }
    words
}

fn change(random: &mut ChaCha8Rng, words: &mut Vec<u32>, other: &[u32]) {
    let all = instructions(words);
    let Some((start, count)) = all.choose(random).copied() else {
        return;
    };
    let bound = words.get(3).copied().unwrap_or(0).min(1 << 20);
    match random.random_range(0..20) {
        // A byte anywhere.
        0 | 1 => {
            let at = random.random_range(0..words.len());
            words[at] ^= random.random_range(1..256) << (8 * random.random_range(0..4));
        }
        // An operand becomes another id, a small number or any.
        2..=5 if count > 1 => {
            words[start + random.random_range(1..count)] = number(random, bound);
        }
        // Two operands change places.
        6 if count > 2 => {
            let [a, b] = [(); 2].map(|()| start + random.random_range(1..count));
            words.swap(a, b);
        }
        // An operand comes from an instruction of the same opcode, so that it usually has the right type.
        15..=18 if count > 1 => {
            let at = random.random_range(1..count);
            let same: Vec<_> = all.iter().filter(|it| words[it.0] == words[start] && at < it.1).copied().collect();
            if let Some((from, _)) = same.choose(random) {
                words[start + at] = words[from + at];
            }
        }
        // Another opcode: any, a neighbour, or that of an instruction of the same length.
        7 => words[start] = words[start] & 0xffff_0000 | random.random_range(0..460),
        8 | 9 => {
            let opcode = words[start] as u16;
            let near = opcode.wrapping_add(1).wrapping_sub(random.random_range(0..3));
            words[start] = words[start] & 0xffff_0000 | u32::from(near);
        }
        10 | 11 => {
            let same: Vec<_> = all.iter().filter(|it| it.1 == count).copied().collect();
            if let Some((from, _)) = same.choose(random) {
                words[start] = words[*from];
            }
        }
        // An instruction is removed, doubled or moved.
        12 => drop(words.drain(start..start + count)),
        13 => {
            let copy = words[start..start + count].to_vec();
            let to = all.choose(random).map_or(start, |it| it.0);
            words.splice(to..to, copy);
        }
        14 => {
            let theirs = instructions(other);
            if let Some((from, count)) = theirs.choose(random).copied() {
                words.splice(start..start, other[from..from + count].iter().copied());
            }
        }
        // The end is cut off.
        _ => words.truncate(words.len() - random.random_range(0..words.len().min(8))),
    }
}
