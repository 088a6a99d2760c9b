//! Conversions of one component between its bits and a register.

use super::{Channel, Component, Numeric};
use half::f16;
use half::slice::HalfFloatSliceExt;
use std::sync::LazyLock;

/// The register of a component whose bits are `code`.
pub(super) fn decode(numeric: Numeric, component: Component, code: u32) -> f32 {
    let bits = component.bits;
    match numeric {
        Numeric::Unorm => from_unorm(code, bits),
        Numeric::Snorm => (sign_extend(code, bits) as f32 / signed_max(bits) as f32).max(-1.0),
        Numeric::Uscaled => code as f32,
        Numeric::Sscaled => sign_extend(code, bits) as f32,
        Numeric::Uint => f32::from_bits(code),
        Numeric::Sint => f32::from_bits(sign_extend(code, bits) as u32),
        Numeric::Sfloat if bits == 16 => f16::from_bits(code as u16).to_f32(),
        Numeric::Sfloat => f32::from_bits(code),
        // The exponent is that of binary16; the mantissa is shorter.
        Numeric::Ufloat => f16::from_bits((code << (15 - bits)) as u16).to_f32(),
        Numeric::Srgb if component.channel == Channel::A => from_unorm(code, bits),
        Numeric::Srgb => SRGB.linear[code as u8 as usize],
        Numeric::SharedExponent | Numeric::DepthStencil => 0.0,
    }
}

/// The bits of a component whose register is `value`: rounded to nearest, ties to even, and clamped. NaN becomes 0 in
/// encodings without NaN.
pub(super) fn encode(numeric: Numeric, component: Component, value: f32) -> u32 {
    let bits = component.bits;
    let mask = u32::MAX >> (32 - bits);
    match numeric {
        Numeric::Unorm => to_unorm(value, bits),
        Numeric::Snorm => {
            let value = f64::from(value).clamp(-1.0, 1.0) * f64::from(signed_max(bits));
            round_ties_even(zero_if_nan(value)) as i32 as u32 & mask
        }
        Numeric::Uscaled => (round_ties_even(f64::from(value).clamp(0.0, f64::from(mask)))) as u32,
        Numeric::Sscaled => {
            let max = f64::from(signed_max(bits));
            round_ties_even(zero_if_nan(f64::from(value).clamp(-max - 1.0, max))) as i32 as u32 & mask
        }
        Numeric::Uint => value.to_bits().min(mask),
        Numeric::Sint => {
            let max = signed_max(bits);
            (value.to_bits() as i32).clamp(-max - 1, max) as u32 & mask
        }
        Numeric::Sfloat if bits == 16 => u32::from(f16::from_f32(value).to_bits()),
        Numeric::Sfloat => value.to_bits(),
        Numeric::Ufloat => to_ufloat(value, bits - 5),
        Numeric::Srgb if component.channel == Channel::A => to_unorm(value, bits),
        Numeric::Srgb => u32::from(SRGB.encode(value)),
        Numeric::SharedExponent | Numeric::DepthStencil => 0,
    }
}

/// The greatest value of a signed integer.
fn signed_max(bits: u32) -> i32 {
    i32::MAX >> (32 - bits)
}

fn sign_extend(code: u32, bits: u32) -> i32 {
    (code << (32 - bits)) as i32 >> (32 - bits)
}

fn zero_if_nan(value: f64) -> f64 {
    if value.is_nan() { 0.0 } else { value }
}

/// Rounds a number of magnitude below 2^51. Adding 1.5 * 2^52 leaves no bits for a fraction, and the sum is
/// rounded to nearest, ties to even; unlike `f64::round_ties_even` this needs no instruction beyond SSE2.
fn round_ties_even(value: f64) -> f64 {
    const NO_FRACTION: f64 = 6_755_399_441_055_744.0;
    (value + NO_FRACTION) - NO_FRACTION
}

/// 2 to a power from -1022 to 1023.
fn power_of_two(exponent: i32) -> f64 {
    f64::from_bits(((exponent + 1023) as u64) << 52)
}

/// Clamps to 0 to 1. NaN becomes 0.
fn clamp_unorm(value: f32) -> f64 {
    f64::from(if value > 0.0 { value.min(1.0) } else { 0.0 })
}

fn from_unorm(code: u32, bits: u32) -> f32 {
    // Both operands are exact in binary32 up to 24 bits, so that the quotient is correctly rounded.
    code as f32 / (u32::MAX >> (32 - bits)) as f32
}

fn to_unorm(value: f32, bits: u32) -> u32 {
    let max = f64::from(u32::MAX >> (32 - bits));
    // The product of 24 and up to 24 bits is exact in binary64, so that only the sum rounds: to nearest, ties to even,
    // and to an integer, since 2^52 leaves no bits for a fraction. The integer is in the low bits.
    (clamp_unorm(value) * max + 4_503_599_627_370_496.0).to_bits() as u32
}

pub(super) fn from_unorm8(code: u8) -> f32 {
    f32::from(code) / 255.0
}

pub(super) fn to_unorm8(value: f32) -> u8 {
    to_unorm(value, 8) as u8
}

/// The results of [`to_unorm8`] for four numbers, in binary32: the compiler makes vectors of this.
pub(super) fn to_unorm8x4(values: [f32; 4]) -> [u8; 4] {
    // At this magnitude binary32 has no bits for a fraction.
    const NO_FRACTION: f32 = 8_388_608.0;
    let mut codes = [0; 4];
    for c in 0..4 {
        let value = if values[c] > 0.0 { values[c].min(1.0) } else { 0.0 };
        // 255 v = 256 v - v. The first term is exact, so that its nearest integer is the result or one more.
        let scaled = value * 256.0;
        let rounded = scaled + NO_FRACTION;
        let excess = (scaled - (rounded - NO_FRACTION) + 0.5) - value;
        codes[c] = (rounded.to_bits() - u32::from(excess < 0.0)) as u8;
    }
    codes
}

/// Four numbers from 0 to 1 of a word: three of ten bits, from the least significant one, and one of two.
pub(super) fn from_unorm10(word: u32) -> [f32; 4] {
    let codes = [word & 0x3FF, word >> 10 & 0x3FF, word >> 20 & 0x3FF, word >> 30];
    let greatest = [1023.0, 1023.0, 1023.0, 3.0];
    let mut numbers = [0.0; 4];
    for c in 0..4 {
        numbers[c] = codes[c].cast_signed() as f32 / greatest[c];
    }
    numbers
}

/// The inverse of [`from_unorm10`].
pub(super) fn to_unorm10([x, y, z, w]: [f32; 4]) -> u32 {
    to_unorm(x, 10) | to_unorm(y, 10) << 10 | to_unorm(z, 10) << 20 | to_unorm(w, 2) << 30
}

/// Decodes sRGB: R, G and B by the transfer function, A linearly.
pub(super) fn from_srgb8([r, g, b, a]: [u8; 4]) -> [f32; 4] {
    let linear = &SRGB.linear;
    let [r, g, b] = [r, g, b].map(|code| linear[usize::from(code)]);
    [r, g, b, from_unorm8(a)]
}

/// Encodes sRGB: R, G and B by the transfer function, A linearly.
pub(super) fn to_srgb8([r, g, b, a]: [f32; 4]) -> [u8; 4] {
    let table = &*SRGB;
    let [r, g, b] = [r, g, b].map(|linear| table.encode(linear));
    [r, g, b, to_unorm8(a)]
}

/// The number of components that are converted at once between binary16 and binary32.
const HALVES: usize = 16;

/// Reads consecutive little-endian binary16 numbers until either slice ends.
pub(super) fn from_halves(bytes: &[u8], out: &mut [f32]) {
    for (bytes, out) in bytes.chunks(2 * HALVES).zip(out.chunks_mut(HALVES)) {
        let mut halves = [f16::ZERO; HALVES];
        let count = out.len().min(bytes.len() / 2);
        bytemuck::cast_slice_mut(&mut halves[..count]).copy_from_slice(&bytes[..2 * count]);
        halves[..count].convert_to_f32_slice(&mut out[..count]);
    }
}

/// Writes consecutive little-endian binary16 numbers until either slice ends.
pub(super) fn to_halves(numbers: &[f32], out: &mut [u8]) {
    for (numbers, out) in numbers.chunks(HALVES).zip(out.chunks_mut(2 * HALVES)) {
        let mut halves = [f16::ZERO; HALVES];
        let count = numbers.len().min(out.len() / 2);
        halves[..count].convert_from_f32_slice(&numbers[..count]);
        out[..2 * count].copy_from_slice(bytemuck::cast_slice(&halves[..count]));
    }
}

/// Encodes a float without a sign: 5 bits of exponent with bias 15, and `mantissa` bits. Negative numbers become 0, and
/// finite numbers that are too large become the greatest finite one.
fn to_ufloat(value: f32, mantissa: u32) -> u32 {
    let infinity = 31 << mantissa;
    if value.is_nan() {
        return infinity | 1;
    }
    if value == f32::INFINITY {
        return infinity;
    }
    // The exponent of the number, or that of the least normal number if the result is denormal.
    let exponent = ((value.to_bits() >> 23) as i32 - 127).max(-14);
    if value <= 0.0 {
        return 0;
    }
    // Scaling by a power of two is exact. Rounding up to the next power of two carries into the exponent.
    let scaled = f64::from(value) * power_of_two(mantissa as i32 - exponent);
    let code = (((exponent + 14) as u32) << mantissa) + round_ties_even(scaled) as u32;
    code.min(infinity - 1)
}

/// The exponent's bias in the shared-exponent format; `SHARED_MANTISSA` is the number of the mantissa's bits.
const SHARED_BIAS: i32 = 15;
const SHARED_MANTISSA: i32 = 9;

pub(super) fn from_shared_exponent(code: u32) -> [f32; 4] {
    let scale = power_of_two((code >> 27) as i32 - SHARED_BIAS - SHARED_MANTISSA) as f32;
    let component = |shift: u32| (code >> shift & 0x1FF) as f32 * scale;
    [component(0), component(9), component(18), 1.0]
}

/// Encodes a shared-exponent texel (Vulkan 1.3, "RGB to Shared Exponent Conversion").
pub(super) fn to_shared_exponent(texel: &[f32; 4]) -> u32 {
    const MAX: f32 = 65_408.0;
    let [r, g, b, _] = texel.map(|component| if component > 0.0 { component.min(MAX) } else { 0.0 });
    let greatest = r.max(g).max(b);
    let floor_log2 = (greatest.to_bits() >> 23) as i32 - 127;
    let preliminary = floor_log2.max(-SHARED_BIAS - 1) + 1 + SHARED_BIAS;
    let mantissa = |component: f32, exponent: i32| {
        let scaled = f64::from(component) * power_of_two(SHARED_BIAS + SHARED_MANTISSA - exponent);
        (scaled + 0.5) as u32
    };
    let carries = mantissa(greatest, preliminary) == 1 << SHARED_MANTISSA;
    let exponent = preliminary + i32::from(carries);
    mantissa(r, exponent) | mantissa(g, exponent) << 9 | mantissa(b, exponent) << 18 | (exponent as u32) << 27
}

/// Tables of the sRGB transfer function and its inverse for 8-bit codes.
struct Srgb {
    /// The linear value of each code.
    linear: [f32; 256],
    /// The least linear value that rounds to each code.
    threshold: [f32; 256],
    /// The code for the least linear value with these upper 16 bits.
    code: Vec<u8>,
}

static SRGB: LazyLock<Srgb> = LazyLock::new(Srgb::new);

/// The sRGB transfer function from linear values, from 0 to 1 (Khronos Data Format 1.3, 13.3.2).
pub(super) fn srgb_from_linear(linear: f64) -> f64 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * libm::pow(linear, 1.0 / 2.4) - 0.055 }
}

/// The sRGB transfer function to linear values, from 0 to 1 (Khronos Data Format 1.3, 13.3.1).
pub(super) fn linear_from_srgb(encoded: f64) -> f64 {
    if encoded <= 0.040_45 { encoded / 12.92 } else { libm::pow((encoded + 0.055) / 1.055, 2.4) }
}

impl Srgb {
    fn new() -> Self {
        let nearest = |bits: u32| round_ties_even(srgb_from_linear(f64::from(f32::from_bits(bits))) * 255.0) as u8;
        let one = 1f32.to_bits();
        // Positive floats have the same order as their bits, and so have their codes.
        let threshold = std::array::from_fn(|code| {
            let (mut below, mut reached) = (0, one);
            while below < reached {
                let middle = (below + reached) / 2;
                if usize::from(nearest(middle)) >= code {
                    reached = middle;
                } else {
                    below = middle + 1;
                }
            }
            f32::from_bits(reached)
        });
        Self {
            linear: std::array::from_fn(|code| linear_from_srgb(code as f64 / 255.0) as f32),
            threshold,
            code: (0..=one >> 16).map(|upper| nearest(upper << 16)).collect(),
        }
    }

    fn encode(&self, linear: f32) -> u8 {
        let linear = clamp_unorm(linear) as f32;
        // Floats with equal upper 16 bits have at most two codes.
        let code = self.code[(linear.to_bits() >> 16) as usize];
        match self.threshold.get(usize::from(code) + 1) {
            Some(&next) if linear >= next => code + 1,
            _ => code,
        }
    }
}
