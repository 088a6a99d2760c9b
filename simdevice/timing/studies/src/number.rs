//! The numbers of the processing element, defined bit by bit: a sign, a biased exponent and a mantissa with a hidden
//! one, rounded to nearest, ties to even. There are no subnormals, infinities or NaNs: a result that is too small is
//! zero with its sign, and one that is too large is the greatest number. The units of `rtl/` compute the same bits.

/// A layout of numbers: 1 sign bit above `exponent` bits above `mantissa` bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Format {
    /// Bits of the exponent.
    pub exponent: u32,
    /// Bits of the mantissa, without the hidden one.
    pub mantissa: u32,
}

/// A number's parts; an exponent of 0 means zero.
#[derive(Clone, Copy)]
struct Parts {
    sign: u32,
    exponent: i64,
    /// The significand with the hidden one; 0 for zero.
    significand: u64,
}

impl Format {
    /// The layout of IEEE 754's binary32. The greatest exponent has no special meaning.
    pub const SINGLE: Self = Self { exponent: 8, mantissa: 23 };
    /// The layout of IEEE 754's binary16. The greatest exponent has no special meaning.
    pub const HALF: Self = Self { exponent: 5, mantissa: 10 };

    /// Bits of a number.
    pub const fn bits(self) -> u32 {
        1 + self.exponent + self.mantissa
    }

    /// The exponent of 1.
    pub const fn bias(self) -> i64 {
        (1 << (self.exponent - 1)) - 1
    }

    /// The greatest number.
    pub const fn greatest(self) -> u32 {
        (((1 << self.exponent) - 1) << self.mantissa) - 1
    }

    /// The number 1.
    pub const fn one(self) -> u32 {
        (self.bias() as u32) << self.mantissa
    }

    /// Reports whether the sign bit of a number is set.
    pub const fn is_negative(self, a: u32) -> bool {
        a >> (self.exponent + self.mantissa) & 1 == 1
    }

    /// The number with its sign changed.
    pub const fn negate(self, a: u32) -> u32 {
        a ^ 1 << (self.exponent + self.mantissa)
    }

    fn parts(self, a: u32) -> Parts {
        let exponent = a >> self.mantissa & ((1 << self.exponent) - 1);
        let mantissa = a & ((1 << self.mantissa) - 1);
        Parts {
            sign: u32::from(self.is_negative(a)),
            exponent: exponent.into(),
            significand: match exponent {
                0 => 0,
                _ => (mantissa | 1 << self.mantissa).into(),
            },
        }
    }

    /// Rounds `significand * 2^(exponent - bias - mantissa - extra)`, whose leading one is at bit `mantissa + extra`.
    fn round(self, sign: u32, exponent: i64, significand: u64, extra: u32) -> u32 {
        let (kept, half) = (significand >> extra, 1u64 << (extra - 1));
        let rest = significand & (2 * half - 1);
        let up = rest > half || rest == half && kept & 1 == 1;
        let mut rounded = kept + u64::from(up);
        let mut exponent = exponent;
        if rounded >> (self.mantissa + 1) == 1 {
            rounded >>= 1;
            exponent += 1;
        }
        let sign = sign << (self.exponent + self.mantissa);
        if exponent <= 0 {
            return sign;
        }
        if exponent >= (1 << self.exponent) - 1 {
            return sign | self.greatest();
        }
        let mantissa = rounded as u32 & ((1 << self.mantissa) - 1);
        sign | (exponent as u32) << self.mantissa | mantissa
    }

    /// The rounded sum.
    pub fn add(self, a: u32, b: u32) -> u32 {
        let magnitude = |a: u32| a & ((1 << (self.exponent + self.mantissa)) - 1);
        let (large, small) = if magnitude(a) >= magnitude(b) { (a, b) } else { (b, a) };
        let (large, small) = (self.parts(large), self.parts(small));
        if large.significand == 0 {
            // Both are zero.
            return (large.sign & small.sign) << (self.exponent + self.mantissa);
        }
        // Guard, round and sticky bits.
        const EXTRA: u32 = 3;
        let distance = (large.exponent - small.exponent) as u32;
        let whole = small.significand << EXTRA;
        let width = self.mantissa + 1 + EXTRA;
        let aligned = if distance >= width {
            u64::from(whole != 0)
        } else {
            whole >> distance | u64::from(whole & ((1 << distance) - 1) != 0)
        };
        let sum = if large.sign == small.sign {
            (large.significand << EXTRA) + aligned
        } else {
            (large.significand << EXTRA) - aligned
        };
        if sum == 0 {
            return 0;
        }
        if sum >> width == 1 {
            let sum = sum >> 1 | sum & 1;
            return self.round(large.sign, large.exponent + 1, sum, EXTRA);
        }
        let zeros = width - 1 - sum.ilog2();
        let exponent = large.exponent - i64::from(zeros);
        self.round(large.sign, exponent, sum << zeros, EXTRA)
    }

    /// The rounded difference.
    pub fn sub(self, a: u32, b: u32) -> u32 {
        self.add(a, self.negate(b))
    }

    /// The rounded product.
    pub fn mul(self, a: u32, b: u32) -> u32 {
        let (a, b) = (self.parts(a), self.parts(b));
        let sign = a.sign ^ b.sign;
        let product = a.significand * b.significand;
        if product == 0 {
            return sign << (self.exponent + self.mantissa);
        }
        let exponent = a.exponent + b.exponent - self.bias();
        // The leading one is at bit 2 mantissa or one above.
        let high = product >> (2 * self.mantissa + 1) == 1;
        let product = if high { product } else { product << 1 };
        self.round(sign, exponent + i64::from(high), product, self.mantissa + 1)
    }

    /// The rounded quotient. A division by zero gives the greatest number; zero by zero gives zero.
    pub fn div(self, a: u32, b: u32) -> u32 {
        let (a, b) = (self.parts(a), self.parts(b));
        let sign = (a.sign ^ b.sign) << (self.exponent + self.mantissa);
        if a.significand == 0 {
            return sign;
        }
        if b.significand == 0 {
            return sign | self.greatest();
        }
        let less = a.significand < b.significand;
        let numerator = a.significand << u32::from(less);
        let exponent = a.exponent - b.exponent + self.bias() - i64::from(less);
        // A guard bit, and a sticky bit below it.
        let shifted = numerator << (self.mantissa + 1);
        let (quotient, rest) = (shifted / b.significand, shifted % b.significand);
        let significand = quotient << 1 | u64::from(rest != 0);
        self.round(sign >> (self.exponent + self.mantissa), exponent, significand, 2)
    }

    /// The number nearest to a value.
    pub fn number(self, value: f32) -> u32 {
        let single = Self::SINGLE;
        let parts = single.parts(value.to_bits());
        if parts.significand == 0 {
            return parts.sign << (self.exponent + self.mantissa);
        }
        // More bits than any format keeps, so that rounding works for all.
        let exponent = parts.exponent - single.bias() + self.bias();
        let extra = single.mantissa - self.mantissa + 1;
        self.round(parts.sign, exponent, parts.significand << 1, extra)
    }

    /// A number's value, which is exact.
    pub fn value(self, number: u32) -> f64 {
        let parts = self.parts(number);
        let power = parts.exponent - self.bias() - i64::from(self.mantissa);
        let magnitude = parts.significand as f64 * 2f64.powi(power as i32);
        if parts.sign == 1 { -magnitude } else { magnitude }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// A number whose exponent is near that of 1.
    fn near_one(random: &mut ChaCha8Rng) -> f32 {
        let bits: u32 = random.random();
        f32::from_bits(bits & 0x807f_ffff | (127 - 20 + bits % 40) << 23)
    }

    #[test]
    fn single_numbers_are_those_of_the_processor() {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let single = Format::SINGLE;
        for _ in 0..400_000 {
            let (a, mut b) = (near_one(&mut random), near_one(&mut random));
            if random.random_bool(0.2) {
                // Cancellation of almost equal numbers.
                b = f32::from_bits(a.to_bits() ^ 0x8000_0000 ^ random.random_range(0..4));
            }
            let [x, y] = [a, b].map(f32::to_bits);
            assert_eq!(single.add(x, y), (a + b).to_bits(), "{a} + {b}");
            assert_eq!(single.mul(x, y), (a * b).to_bits(), "{a} * {b}");
            assert_eq!(single.div(x, y), (a / b).to_bits(), "{a} / {b}");
        }
    }

    #[test]
    fn half_numbers_are_rounded_once() {
        let half = Format::HALF;
        let mut random = ChaCha8Rng::seed_from_u64(2);
        for _ in 0..200_000 {
            let mut number = || random.random::<u32>() & 0x83ff | random.random_range(10..20) << 10;
            let (a, b) = (number(), number());
            // Sums and products of two binary16 numbers are exact in binary64, as is the conversion to binary32 of the
            // checked ones.
            let nearest = |value: f64| {
                let (down, up) = (half.number(value as f32), value);
                let error = (half.value(down) - up).abs();
                for other in [down - 1, down + 1] {
                    assert!((half.value(other) - up).abs() >= error, "{value}");
                }
                down
            };
            for (ours, exact) in
                [(half.add(a, b), half.value(a) + half.value(b)), (half.mul(a, b), half.value(a) * half.value(b))]
            {
                if exact.abs() > 1e-4 && exact.abs() < 6e4 {
                    assert_eq!(ours, nearest(exact), "{a:x} {b:x}");
                }
            }
        }
    }

    #[test]
    fn what_has_no_number_is_zero_or_the_greatest() {
        for format in [Format::SINGLE, Format::HALF] {
            let (one, top) = (format.one(), format.greatest());
            let least = 1 << format.mantissa;
            assert_eq!(format.add(top, top), top);
            assert_eq!(format.mul(format.negate(top), top), format.negate(top));
            assert_eq!(format.mul(least, least), 0);
            assert_eq!(format.mul(format.negate(least), least), format.negate(0));
            assert_eq!(format.div(one, 0), top);
            assert_eq!(format.div(0, one), 0);
            // Subnormals are zero.
            assert_eq!(format.add(least - 1, 0), 0);
            assert_eq!(format.add(format.negate(0), format.negate(0)), format.negate(0));
            assert_eq!(format.sub(one, one), 0);
            assert_eq!(format.value(one), 1.0);
            assert_eq!(format.number(1.0), one);
            // A difference that is too small keeps its sign.
            assert_eq!(format.sub(least, least + 1), format.negate(0));
        }
    }
}
