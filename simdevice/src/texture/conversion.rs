//! The conversion of luma and chroma (Y'CbCr) to red, green and blue.
//!
//! Vulkan 1.3, "Sampler Y'CBCR Range Expansion" and "Sampler Y'CBCR Model Conversion". Before the conversion, red is Cr,
//! green is luma and blue is Cb, all from 0 to 1. Values are not clamped.

use super::sampler::Filter;
use isa::resources::LaneWords;

/// The meaning of the components, and the colours to which they are converted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum YcbcrModel {
    /// Red, green and blue, which are not converted.
    #[default]
    RgbIdentity,
    /// Cr, luma and Cb. Only their range is expanded.
    YcbcrIdentity,
    /// Cr, luma and Cb of ITU-R BT.601.
    Ycbcr601,
    /// Cr, luma and Cb of ITU-R BT.709.
    Ycbcr709,
    /// Cr, luma and Cb of ITU-R BT.2020.
    Ycbcr2020,
}

impl YcbcrModel {
    /// The weights of red and blue in the luma; `None` if the model is not converted to another.
    fn weights(self) -> Option<[f64; 2]> {
        match self {
            Self::RgbIdentity | Self::YcbcrIdentity => None,
            Self::Ycbcr601 => Some([0.299, 0.114]),
            Self::Ycbcr709 => Some([0.2126, 0.0722]),
            Self::Ycbcr2020 => Some([0.2627, 0.0593]),
        }
    }
}

/// The codes that luma and chroma use.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum YcbcrRange {
    /// All codes.
    #[default]
    Full,
    /// In eight bits, 16 to 235 for luma and 16 to 240 for chroma.
    Narrow,
}

/// The place of a chroma texel among the two luma texels, along an axis, for which it is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum ChromaLocation {
    /// At the first.
    #[default]
    CositedEven,
    /// Between both.
    Midpoint,
}

/// A conversion from luma and chroma.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct YcbcrConversion {
    /// The model.
    pub model: YcbcrModel,
    /// The range of codes.
    pub range: YcbcrRange,
    /// The bits of a component, 8 to 16.
    pub bits: u32,
    /// The places of chroma along x and y, where it has half of the luma's texels.
    pub chroma_locations: [ChromaLocation; 2],
    /// The filter of chroma that has fewer texels than the luma.
    pub chroma_filter: Filter,
}

/// The expansion of codes: they are scaled to integers, and what remains beyond the offset is scaled to a value.
#[derive(Clone, Copy, Debug)]
struct Expansion {
    max_code: f32,
    offset: f32,
    scale: f32,
}

impl Expansion {
    /// The expansion of codes of `bits` bits that have their zero at `zero`, and `span` from there to 1; both in codes of
    /// eight bits.
    fn narrow(bits: u32, zero: u32, span: u32) -> Self {
        let steps = 1u32 << bits.saturating_sub(8);
        Self { max_code: max_code(bits), offset: (zero * steps) as f32, scale: (1.0 / f64::from(span * steps)) as f32 }
    }

    #[inline(always)]
    fn of(self, value: f32) -> f32 {
        (value * self.max_code - self.offset) * self.scale
    }
}

/// The greatest code of a component.
fn max_code(bits: u32) -> f32 {
    ((1u64 << bits.min(24)) - 1) as f32
}

impl YcbcrConversion {
    /// Converts 16 texels: their red, green and blue. Alpha stays.
    pub(super) fn convert(&self, texel: &mut [LaneWords; 4]) {
        if self.model == YcbcrModel::RgbIdentity {
            return;
        }
        let [red, green, blue, _] = texel;
        match self.range {
            YcbcrRange::Full => {
                // Half of the codes, rounded up.
                let half = (1u64 << self.bits.clamp(1, 24) >> 1) as f32 / max_code(self.bits);
                for_lanes([red, green, blue], |[cr, y, cb]| [cr - half, y, cb - half]);
            }
            YcbcrRange::Narrow => {
                let (luma, chroma) = (Expansion::narrow(self.bits, 16, 219), Expansion::narrow(self.bits, 128, 224));
                for_lanes([red, green, blue], |[cr, y, cb]| [chroma.of(cr), luma.of(y), chroma.of(cb)]);
            }
        }
        if let Some([red_weight, blue_weight]) = self.model.weights() {
            let green_weight = 1.0 - red_weight - blue_weight;
            let to_red = 2.0 * (1.0 - red_weight);
            let to_blue = 2.0 * (1.0 - blue_weight);
            let cr_to_green = (to_red * red_weight / green_weight) as f32;
            let cb_to_green = (to_blue * blue_weight / green_weight) as f32;
            let (to_red, to_blue) = (to_red as f32, to_blue as f32);
            for_lanes([red, green, blue], |[cr, y, cb]| {
                [y + to_red * cr, y - cb_to_green * cb - cr_to_green * cr, y + to_blue * cb]
            });
        }
    }
}

/// Replaces three components of 16 texels by a function of them.
#[inline(always)]
fn for_lanes(texel: [&mut LaneWords; 3], value: impl Fn([f32; 3]) -> [f32; 3]) {
    let [red, green, blue] = texel;
    for ((red, green), blue) in red.iter_mut().zip(green).zip(blue) {
        let converted = value([*red, *green, *blue].map(f32::from_bits));
        [*red, *green, *blue] = converted.map(f32::to_bits);
    }
}
