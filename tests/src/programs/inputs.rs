//! Test values of operands: values at the edges of their types, and random ones.

use super::types::Kind;
use rand::Rng;
use rand_chacha::ChaCha8Rng;

/// The set of values of an operand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Domain {
    /// Any value, with all special values of the type.
    Any,
    /// Floats in a range.
    Floats(f64, f64),
    /// Integers in a range.
    Integers(i128, i128),
    /// Floats at, or next to, the midpoint of two floats of a narrower type.
    NearTies(Kind),
}

/// The special values of a type.
pub fn special(kind: Kind) -> Vec<u64> {
    match kind {
        Kind::Bool => vec![0, 1],
        kind if kind.is_float() => {
            let sign = 1 << (kind.bits() - 1);
            let infinity = kind.round(f64::INFINITY);
            let least_normal = kind.round(kind.least_normal());
            let numbers = [0.0, 0.5, 1.0, 1.5, 2.5, 3.0, 8.25];
            let mut all: Vec<u64> = numbers.map(|number| kind.round(number)).to_vec();
            all.extend([
                kind.round(1.0) + 1,
                kind.round(1.0) - 1,
                kind.round(2f64.powi(if kind == Kind::F16 { 10 } else { 24 })) + 1,
                1,
                least_normal - 1,
                least_normal,
                infinity - 1,
                infinity,
            ]);
            all.extend(all.clone().iter().map(|bits| bits | sign));
            all.push(kind.round(f64::NAN));
            all
        }
        kind => {
            let top = 1u64 << (kind.bits() - 1);
            let all = [0, 1, 2, 3, 7, 10, 31, 32, top, top + 1, top - 1, top - 2];
            let patterns = [0x5555_5555_5555_5555, u64::MAX, u64::MAX - 1, 0xff00_ff00];
            all.into_iter().chain(patterns).map(|bits| bits & kind.mask()).collect()
        }
    }
}

fn anything(kind: Kind, random: &mut ChaCha8Rng) -> u64 {
    if kind == Kind::Bool {
        return random.random_range(0..2);
    }
    match random.random_range(0..4) {
        0 => {
            let special = special(kind);
            special[random.random_range(0..special.len())]
        }
        1 if kind.is_float() => kind.round(random.random_range(-8.0..8.0)),
        1 | 2 => (random.random::<u64>() & kind.mask()) >> random.random_range(0..kind.bits()),
        _ => random.random::<u64>() & kind.mask(),
    }
}

/// A value of a domain for component `component` of operand `operand`. The first lanes take all combinations of the
/// special values of the first two operands.
pub fn value(kind: Kind, domain: Domain, [lane, operand, component]: [usize; 3], random: &mut ChaCha8Rng) -> u64 {
    match domain {
        Domain::Any => {
            let special = special(kind);
            let count = special.len();
            if lane >= count * count || operand > 1 {
                return anything(kind, random);
            }
            let index = if operand == 0 { lane } else { lane / count };
            special[(index + component) % count]
        }
        Domain::Floats(low, high) => {
            let number = match random.random_range(0..16) {
                0 => low,
                1 => high,
                2 if low <= 0.0 && high >= 0.0 => 0.0,
                _ => low + (high - low) * random.random::<f64>(),
            };
            kind.round(number)
        }
        Domain::NearTies(narrow) => {
            let largest = narrow.round(f64::INFINITY) - 1;
            let low = random.random_range(0..largest);
            let middle = (narrow.float(low) + narrow.float(low + 1)) / 2.0;
            let next_to = kind.round(middle) + 1 - random.random_range(0..3);
            next_to | u64::from(random.random::<bool>()) << (kind.bits() - 1)
        }
        Domain::Integers(low, high) => kind.wrap(random.random_range(low..=high)),
    }
}
