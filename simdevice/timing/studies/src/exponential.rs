//! Powers of two, defined bit by bit: the exponential unit of the processing element, in two designs. The argument
//! becomes a fixed-point number. Its integer part is the result's exponent; a table or a polynomial gives the power of
//! its fraction. All arithmetic is on integers, so that `rtl/fp_exp2.sv` can compute the same bits. This module also
//! writes the table's SystemVerilog file.

use crate::number::Format;
use std::fmt::Write as _;

/// A design of the unit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Exponential {
    /// A table. In binary32, 64 entries with a quadratic each; in binary16, 32 entries with a line each.
    #[default]
    Table,
    /// One polynomial: of degree 5 in binary32, of degree 3 in binary16.
    Polynomial,
}

/// Widths of the unit for a format.
struct Widths {
    /// Fraction bits of the argument.
    fraction: u32,
    /// Fraction bits of the power.
    power: u32,
    /// Bits of the table's index.
    index: u32,
    /// Fraction bits of the table's slopes.
    slope: u32,
    /// Fraction bits of the table's curvatures; 0: it has none.
    curvature: u32,
    /// The slope and the curvature at 1, as factors of the power.
    line: [f64; 2],
    /// Coefficients of the polynomial, the constant one first, with `power` fraction bits.
    polynomial: &'static [u64],
}

const SINGLE: Widths = Widths {
    fraction: 26,
    power: 27,
    index: 6,
    slope: 22,
    curvature: 16,
    line: [0.693_139_528_347_847_5, 0.241_531_355_813_391_2],
    polynomial: &[134_217_728, 93_032_692, 32_240_064, 7_470_163, 1_234_721, 240_031],
};

const HALF: Widths = Widths {
    fraction: 13,
    power: 14,
    index: 5,
    slope: 12,
    curvature: 0,
    line: [0.700_701_907_688_284, 0.0],
    polynomial: &[16_384, 11_363, 3_827, 1_187],
};

/// An entry of the table: the power at the begin of its interval, the slope and the curvature there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Entry {
    power: u64,
    slope: u64,
    curvature: u64,
}

impl Widths {
    fn of(format: Format) -> &'static Self {
        if format == Format::SINGLE { &SINGLE } else { &HALF }
    }

    /// Computes an entry from square roots and products alone, which every processor rounds alike.
    fn entry(&self, index: u64) -> Entry {
        let (mut root, mut power) = (2f64, 1f64);
        for bit in (0..self.index).rev() {
            root = root.sqrt();
            if index >> bit & 1 == 1 {
                power *= root;
            }
        }
        let fixed = |value: f64, bits: u32| (value * (1u64 << bits) as f64).round() as u64;
        Entry {
            power: fixed(power, self.power),
            slope: fixed(power * self.line[0], self.slope),
            curvature: fixed(power * self.line[1], self.curvature),
        }
    }

    /// The power of a fraction by the table, from 1 to 2.
    fn table(&self, fraction: u64) -> u64 {
        let low_bits = self.fraction - self.index;
        let entry = self.entry(fraction >> low_bits);
        let low = fraction & ((1 << low_bits) - 1);
        let bend = match self.curvature {
            0 => 0,
            bits => (entry.curvature * low) >> (self.fraction + bits - self.slope),
        };
        let rise = ((entry.slope + bend) * low) >> (self.fraction + self.slope - self.power);
        entry.power + rise
    }

    /// The power of a fraction by the polynomial (Horner's rule), from 1 to 2.
    fn horner(&self, fraction: u64) -> u64 {
        let mut coefficients = self.polynomial.iter().rev();
        let first = coefficients.next().copied().unwrap_or_default();
        coefficients.fold(first, |sum, coefficient| coefficient + ((sum * fraction) >> self.fraction))
    }
}

/// 2 to the power of a number.
pub fn exp2(format: Format, design: Exponential, x: u32) -> u32 {
    let widths = Widths::of(format);
    let (sign, exponent) = (format.is_negative(x), x >> format.mantissa & ((1 << format.exponent) - 1));
    let unbiased = i64::from(exponent) - format.bias();
    let far = if sign { 0 } else { format.greatest() };
    if unbiased >= format.exponent.into() {
        return far;
    }
    let significand = u64::from(x & ((1 << format.mantissa) - 1) | 1 << format.mantissa);
    // Moves the argument's leading one to the top of the integer part, then shifts it down to its place.
    let up = format.exponent - 1 + widths.fraction - format.mantissa;
    let down = (i64::from(format.exponent) - 1 - unbiased).min(63);
    let magnitude = match exponent {
        0 => 0,
        _ => (significand << up >> down) as i64,
    };
    let fixed = if sign { -magnitude } else { magnitude };
    let whole = fixed >> widths.fraction;
    let fraction = (fixed & ((1 << widths.fraction) - 1)) as u64;
    let power = match design {
        Exponential::Table => widths.table(fraction),
        Exponential::Polynomial => widths.horner(fraction),
    };
    let extra = widths.power - format.mantissa;
    let rounded = (power + (1 << (extra - 1))) >> extra;
    let carry = rounded >> (format.mantissa + 1);
    let mantissa = match carry {
        0 => rounded as u32 & ((1 << format.mantissa) - 1),
        _ => 0,
    };
    let exponent = whole + format.bias() + carry as i64;
    if exponent <= 0 {
        0
    } else if exponent >= (1 << format.exponent) - 1 {
        format.greatest()
    } else {
        (exponent as u32) << format.mantissa | mantissa
    }
}

/// The table's module in SystemVerilog.
pub fn table_module() -> String {
    let mut out = "\
// The table of fp_exp2: for each part of [0, 1), the power of two where it begins, its slope and its curvature there.
// Written by `gaurast simulate --emit-rtl` from the table of the model.
module exp2_table #(
    parameter int INDEX = 6,
    parameter int POWER = 28,
    parameter int SLOPE = 23,
    parameter int CURVATURE = 16
) (
    input  logic [INDEX-1:0] index,
    output logic [POWER-1:0] power,
    output logic [SLOPE-1:0] slope,
    output logic [CURVATURE-1:0] curvature
);
    generate
"
    .to_owned();
    for (condition, widths) in [("if (INDEX == 6)", &SINGLE), ("else", &HALF)] {
        // Writing to a string cannot fail.
        let _ = writeln!(out, "        {condition} begin : of_{}", widths.index);
        out += "            always_comb\n                case (index)\n";
        for index in 0..1u64 << widths.index {
            let entry = widths.entry(index);
            let _ = writeln!(
                out,
                "                    {}'d{index}: begin power = POWER'('h{:x}); slope = SLOPE'('h{:x}); curvature = CURVATURE'('h{:x}); end",
                widths.index, entry.power, entry.slope, entry.curvature
            );
        }
        out += "                endcase\n        end\n";
    }
    out += "    endgenerate\nendmodule\n";
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The largest relative error over arguments from -24 to 4.
    fn error(format: Format, design: Exponential) -> f64 {
        let mut worst = 0f64;
        for step in 0..280_000 {
            let x = format.number(-24.0 + step as f32 * 1e-4);
            let exact = format.value(x).exp2();
            let ours = format.value(exp2(format, design, x));
            if exact > 2f64.powi(2 - format.bias() as i32) {
                worst = worst.max((ours / exact - 1.0).abs());
            }
        }
        worst
    }

    #[test]
    fn powers_are_within_an_ulp_or_two() {
        let ulps = |format: Format, design| error(format, design) * (1u64 << format.mantissa) as f64;
        assert!(ulps(Format::SINGLE, Exponential::Table) < 0.8);
        assert!(ulps(Format::SINGLE, Exponential::Polynomial) < 2.5);
        assert!(ulps(Format::HALF, Exponential::Table) < 0.8);
        assert!(ulps(Format::HALF, Exponential::Polynomial) < 1.2);
    }

    #[test]
    fn whole_powers_are_exact_and_far_ones_stop() {
        for format in [Format::SINGLE, Format::HALF] {
            for design in [Exponential::Table, Exponential::Polynomial] {
                let of = |x: f32| exp2(format, design, format.number(x));
                for whole in -14..=12 {
                    let power = format.number(2f32.powi(whole));
                    assert_eq!(of(whole as f32), power, "{format:?} {design:?} {whole}");
                }
                assert_eq!(of(-1e4), 0);
                assert_eq!(of(1e4), format.greatest());
                assert_eq!(exp2(format, design, format.negate(0)), format.one());
                assert_eq!(of(1e-30), format.one());
            }
        }
    }
}
