//! Formats of vertex attributes: their components, and how they are read.

use ash::vk;

/// A vertex format by its name's parts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Format {
    /// Number of components.
    pub(crate) components: u32,
    /// Values are integers, which do not convert to floating point.
    pub(crate) is_integer: bool,
    /// Values are numbers that are never negative.
    pub(crate) is_unsigned: bool,
    /// Red, green and blue are encoded when they are stored.
    pub(crate) is_srgb: bool,
    /// Components share words.
    pub(crate) is_packed: bool,
    /// Bytes of an element, 0 if that is not known.
    pub(crate) bytes: u32,
    kind: Kind,
}

/// The way in which components are stored, where the layer can read them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Float32,
    Float16,
    Unorm8,
    Snorm8,
    Unorm16,
    Snorm16,
    Other,
}

impl Format {
    /// The format of that value.
    pub(crate) fn of(format: vk::Format) -> Self {
        // As in `R16G16B16A16_SFLOAT` and `A2B10G10R10_UNORM_PACK32`: the components with their bits, then their kind.
        let name = format!("{format:?}");
        let mut parts = name.split('_');
        let layout = parts.next().unwrap_or_default();
        let kind = parts.next().unwrap_or_default();
        let is_packed = parts.next().is_some_and(|part| part.starts_with("PACK"));
        let is_color = |c: char| "RGBA".contains(c);
        let components = layout.chars().filter(|&c| is_color(c)).count() as u32;
        let bits: Vec<u32> = (layout.split(is_color).skip(1)).map(|bits| bits.parse().unwrap_or(0)).collect();
        let is_rgba = "RGBA".starts_with(&layout.chars().filter(|&c| is_color(c)).collect::<String>());
        let width = bits.first().copied().unwrap_or(0);
        let is_even = bits.iter().all(|&other| other == width) && is_rgba && !is_packed;
        let kind_of = match (kind, width) {
            _ if !is_even => Kind::Other,
            ("SFLOAT", 32) => Kind::Float32,
            ("SFLOAT", 16) => Kind::Float16,
            ("UNORM", 8) => Kind::Unorm8,
            ("SNORM", 8) => Kind::Snorm8,
            ("UNORM", 16) => Kind::Unorm16,
            ("SNORM", 16) => Kind::Snorm16,
            _ => Kind::Other,
        };
        Self {
            components,
            is_integer: matches!(kind, "UINT" | "SINT"),
            is_unsigned: matches!(kind, "UNORM" | "USCALED" | "UFLOAT"),
            is_srgb: kind == "SRGB",
            is_packed,
            bytes: bits.iter().sum::<u32>() / 8,
            kind: kind_of,
        }
    }

    /// Reports whether the layer can read elements.
    pub(crate) fn is_readable(self) -> bool {
        self.kind != Kind::Other
    }

    /// Bytes of the words that an element is made of.
    pub(crate) fn word_bytes(self) -> u32 {
        if self.is_packed { self.bytes } else { self.bytes / self.components.max(1) }
    }

    /// An element's components; those that it does not have are 0, 0, 0 and 1. `None` beyond the end.
    pub(crate) fn read(self, bytes: &[u8], offset: usize) -> Option<[f32; 4]> {
        let element = bytes.get(offset..)?.get(..self.bytes as usize)?;
        let mut value = [0.0, 0.0, 0.0, 1.0];
        let width = (self.bytes / self.components.max(1)) as usize;
        let components = element.chunks_exact(width.max(1));
        for (value, stored) in value.iter_mut().zip(components) {
            *value = match (self.kind, stored) {
                (Kind::Float32, &[a, b, c, d]) => f32::from_le_bytes([a, b, c, d]),
                (Kind::Float16, &[a, b]) => half(u16::from_le_bytes([a, b])),
                (Kind::Unorm8, &[a]) => f32::from(a) / 255.0,
                (Kind::Snorm8, &[a]) => (f32::from(a.cast_signed()) / 127.0).max(-1.0),
                (Kind::Unorm16, &[a, b]) => f32::from(u16::from_le_bytes([a, b])) / 65535.0,
                (Kind::Snorm16, &[a, b]) => (f32::from(i16::from_le_bytes([a, b])) / 32767.0).max(-1.0),
                _ => return None,
            };
        }
        Some(value)
    }
}

/// A binary16 number as binary32.
fn half(bits: u16) -> f32 {
    let sign = if bits & 0x8000 == 0 { 1.0 } else { -1.0 };
    let (exponent, fraction) = (bits >> 10 & 31, f32::from(bits & 1023));
    sign * match (exponent, fraction) {
        (0, _) => fraction * 2f32.powi(-24),
        (31, 0.0) => f32::INFINITY,
        (31, _) => f32::NAN,
        _ => (1.0 + fraction / 1024.0) * 2f32.powi(i32::from(exponent) - 15),
    }
}

/// Reports whether a colour attachment of this format holds integers.
pub(crate) fn is_integer(format: vk::Format) -> bool {
    Format::of(format).is_integer
}
