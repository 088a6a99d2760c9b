//! Random texels, and their comparison code by code.

use simdevice::Format;
use simdevice::format::Numeric;

/// A generator of bits.
pub struct Noise(u64);

impl Noise {
    /// A generator whose bits a seed determines.
    pub fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1)
    }

    /// The next 32 bits.
    pub fn bits(&mut self) -> u32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 32) as u32
    }

    /// A number from 0 to 1.
    pub fn unit(&mut self) -> f32 {
        (self.bits() >> 8) as f32 / (1 << 24) as f32
    }

    /// A finite number from -2 to 2.
    pub fn float(&mut self) -> f32 {
        4.0 * self.unit() - 2.0
    }

    /// Random texels: numbers around 1 in floating-point formats, any bits in others.
    pub fn texels(&mut self, format: Format, count: usize) -> Vec<u8> {
        let size = format.texel_size();
        (0..count)
            .flat_map(|_| {
                let texel = match format.numeric() {
                    Numeric::Sfloat | Numeric::Ufloat | Numeric::SharedExponent => {
                        let is_depth = format.has(simdevice::format::Channel::D);
                        format.encode([(); 4].map(|()| if is_depth { self.unit() } else { self.float() }))
                    }
                    _ => bytemuck::cast([(); 4].map(|()| self.bits())),
                };
                texel[..size].to_vec()
            })
            .collect()
    }
}

/// The distance between two texels of a format: in codes, or for floating-point formats in units of `unit`. Different
/// integers are infinitely far apart, and unused bits are ignored.
pub fn distance(format: Format, a: &[u8], b: &[u8], unit: f64) -> f64 {
    let worst = |distances: [f64; 4]| distances.into_iter().fold(0.0, f64::max);
    let (x, y) = (format.decode(a), format.decode(b));
    match format.numeric() {
        Numeric::Uint | Numeric::Sint => {
            if x.map(f32::to_bits) == y.map(f32::to_bits) {
                0.0
            } else {
                f64::INFINITY
            }
        }
        Numeric::Sfloat | Numeric::Ufloat | Numeric::SharedExponent => worst([0, 1, 2, 3].map(|i| {
            let (x, y) = (f64::from(x[i]), f64::from(y[i]));
            if x == y || x.is_nan() && y.is_nan() {
                return 0.0;
            }
            (x - y).abs() / unit
        })),
        _ => {
            let mut shift = 0;
            let code = |texel: &[u8], shift: u32, bits: u32| {
                let mut wide = [0; 16];
                wide[..texel.len()].copy_from_slice(texel);
                (u128::from_le_bytes(wide) >> shift) as i64 & ((1 << bits) - 1)
            };
            let mut largest = 0;
            for component in format.components() {
                let signed = |code: i64| match format.numeric() {
                    Numeric::Snorm | Numeric::Sscaled => {
                        let signed = code << (64 - component.bits) >> (64 - component.bits);
                        // Two codes mean -1.
                        if format.numeric() == Numeric::Snorm {
                            signed.max(1 - (1 << (component.bits - 1)))
                        } else {
                            signed
                        }
                    }
                    _ => code,
                };
                let [a, b] = [a, b].map(|texel| signed(code(texel, shift, component.bits)));
                if component.channel != simdevice::format::Channel::X {
                    largest = largest.max((a - b).abs());
                }
                shift += component.bits;
            }
            largest as f64
        }
    }
}
