//! The table of formats, and the decoding and encoding of rows of texels.

use super::{astc, block, convert, etc};
use crate::format::{Aspect, Channel, ClearValue, Component, Numeric};

macro_rules! formats {
    ($($variant:ident: $numeric:ident, $($channel:ident $bits:literal)+;)*) => {
        /// The storage format of a texel or a vertex attribute.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        #[allow(missing_docs, reason = "the names are Vulkan's")]
        pub enum Format {
            $($variant,)*
        }

        impl Format {
            /// All formats, in Vulkan's order.
            pub const ALL: &[Self] = &[$(Self::$variant,)*];

            /// The interpretation of its components' bits.
            pub const fn numeric(self) -> Numeric {
                match self {
                    $(Self::$variant => Numeric::$numeric,)*
                }
            }

            /// The bytes per texel, or per block of a compressed format. A format with both depth and stencil has no
            /// texel of both: see [`Format::plane`].
            #[inline]
            pub const fn texel_size(self) -> usize {
                // In the order of the variants.
                const SIZES: &[usize] = &[$((0 $(+ $bits)+) / 8,)*];
                SIZES[self as usize]
            }

            /// The components of the format, least significant bits first. A texel is little-endian.
            pub const fn components(self) -> &'static [Component] {
                match self {
                    $(Self::$variant => &[$(Component { channel: Channel::$channel, bits: $bits },)+],)*
                }
            }
        }
    };
}

formats! {
    R4G4UnormPack8: Unorm, G 4 R 4;
    R4G4B4A4UnormPack16: Unorm, A 4 B 4 G 4 R 4;
    B4G4R4A4UnormPack16: Unorm, A 4 R 4 G 4 B 4;
    A4R4G4B4UnormPack16: Unorm, B 4 G 4 R 4 A 4;
    A4B4G4R4UnormPack16: Unorm, R 4 G 4 B 4 A 4;
    R5G6B5UnormPack16: Unorm, B 5 G 6 R 5;
    B5G6R5UnormPack16: Unorm, R 5 G 6 B 5;
    R5G5B5A1UnormPack16: Unorm, A 1 B 5 G 5 R 5;
    B5G5R5A1UnormPack16: Unorm, A 1 R 5 G 5 B 5;
    A1R5G5B5UnormPack16: Unorm, B 5 G 5 R 5 A 1;
    A1B5G5R5UnormPack16: Unorm, R 5 G 5 B 5 A 1;
    A8Unorm: Unorm, A 8;
    R8Unorm: Unorm, R 8;
    R8Snorm: Snorm, R 8;
    R8Uscaled: Uscaled, R 8;
    R8Sscaled: Sscaled, R 8;
    R8Uint: Uint, R 8;
    R8Sint: Sint, R 8;
    R8Srgb: Srgb, R 8;
    R8G8Unorm: Unorm, R 8 G 8;
    R8G8Snorm: Snorm, R 8 G 8;
    R8G8Uscaled: Uscaled, R 8 G 8;
    R8G8Sscaled: Sscaled, R 8 G 8;
    R8G8Uint: Uint, R 8 G 8;
    R8G8Sint: Sint, R 8 G 8;
    R8G8Srgb: Srgb, R 8 G 8;
    R8G8B8Unorm: Unorm, R 8 G 8 B 8;
    R8G8B8Snorm: Snorm, R 8 G 8 B 8;
    R8G8B8Uscaled: Uscaled, R 8 G 8 B 8;
    R8G8B8Sscaled: Sscaled, R 8 G 8 B 8;
    R8G8B8Uint: Uint, R 8 G 8 B 8;
    R8G8B8Sint: Sint, R 8 G 8 B 8;
    R8G8B8Srgb: Srgb, R 8 G 8 B 8;
    B8G8R8Unorm: Unorm, B 8 G 8 R 8;
    B8G8R8Snorm: Snorm, B 8 G 8 R 8;
    B8G8R8Uscaled: Uscaled, B 8 G 8 R 8;
    B8G8R8Sscaled: Sscaled, B 8 G 8 R 8;
    B8G8R8Uint: Uint, B 8 G 8 R 8;
    B8G8R8Sint: Sint, B 8 G 8 R 8;
    B8G8R8Srgb: Srgb, B 8 G 8 R 8;
    R8G8B8A8Unorm: Unorm, R 8 G 8 B 8 A 8;
    R8G8B8A8Snorm: Snorm, R 8 G 8 B 8 A 8;
    R8G8B8A8Uscaled: Uscaled, R 8 G 8 B 8 A 8;
    R8G8B8A8Sscaled: Sscaled, R 8 G 8 B 8 A 8;
    R8G8B8A8Uint: Uint, R 8 G 8 B 8 A 8;
    R8G8B8A8Sint: Sint, R 8 G 8 B 8 A 8;
    R8G8B8A8Srgb: Srgb, R 8 G 8 B 8 A 8;
    B8G8R8A8Unorm: Unorm, B 8 G 8 R 8 A 8;
    B8G8R8A8Snorm: Snorm, B 8 G 8 R 8 A 8;
    B8G8R8A8Uscaled: Uscaled, B 8 G 8 R 8 A 8;
    B8G8R8A8Sscaled: Sscaled, B 8 G 8 R 8 A 8;
    B8G8R8A8Uint: Uint, B 8 G 8 R 8 A 8;
    B8G8R8A8Sint: Sint, B 8 G 8 R 8 A 8;
    B8G8R8A8Srgb: Srgb, B 8 G 8 R 8 A 8;
    A8B8G8R8UnormPack32: Unorm, R 8 G 8 B 8 A 8;
    A8B8G8R8SnormPack32: Snorm, R 8 G 8 B 8 A 8;
    A8B8G8R8UscaledPack32: Uscaled, R 8 G 8 B 8 A 8;
    A8B8G8R8SscaledPack32: Sscaled, R 8 G 8 B 8 A 8;
    A8B8G8R8UintPack32: Uint, R 8 G 8 B 8 A 8;
    A8B8G8R8SintPack32: Sint, R 8 G 8 B 8 A 8;
    A8B8G8R8SrgbPack32: Srgb, R 8 G 8 B 8 A 8;
    A2R10G10B10UnormPack32: Unorm, B 10 G 10 R 10 A 2;
    A2R10G10B10SnormPack32: Snorm, B 10 G 10 R 10 A 2;
    A2R10G10B10UscaledPack32: Uscaled, B 10 G 10 R 10 A 2;
    A2R10G10B10SscaledPack32: Sscaled, B 10 G 10 R 10 A 2;
    A2R10G10B10UintPack32: Uint, B 10 G 10 R 10 A 2;
    A2R10G10B10SintPack32: Sint, B 10 G 10 R 10 A 2;
    A2B10G10R10UnormPack32: Unorm, R 10 G 10 B 10 A 2;
    A2B10G10R10SnormPack32: Snorm, R 10 G 10 B 10 A 2;
    A2B10G10R10UscaledPack32: Uscaled, R 10 G 10 B 10 A 2;
    A2B10G10R10SscaledPack32: Sscaled, R 10 G 10 B 10 A 2;
    A2B10G10R10UintPack32: Uint, R 10 G 10 B 10 A 2;
    A2B10G10R10SintPack32: Sint, R 10 G 10 B 10 A 2;
    R16Unorm: Unorm, R 16;
    R16Snorm: Snorm, R 16;
    R16Uscaled: Uscaled, R 16;
    R16Sscaled: Sscaled, R 16;
    R16Uint: Uint, R 16;
    R16Sint: Sint, R 16;
    R16Sfloat: Sfloat, R 16;
    R16G16Unorm: Unorm, R 16 G 16;
    R16G16Snorm: Snorm, R 16 G 16;
    R16G16Uscaled: Uscaled, R 16 G 16;
    R16G16Sscaled: Sscaled, R 16 G 16;
    R16G16Uint: Uint, R 16 G 16;
    R16G16Sint: Sint, R 16 G 16;
    R16G16Sfloat: Sfloat, R 16 G 16;
    R16G16B16Unorm: Unorm, R 16 G 16 B 16;
    R16G16B16Snorm: Snorm, R 16 G 16 B 16;
    R16G16B16Uscaled: Uscaled, R 16 G 16 B 16;
    R16G16B16Sscaled: Sscaled, R 16 G 16 B 16;
    R16G16B16Uint: Uint, R 16 G 16 B 16;
    R16G16B16Sint: Sint, R 16 G 16 B 16;
    R16G16B16Sfloat: Sfloat, R 16 G 16 B 16;
    R16G16B16A16Unorm: Unorm, R 16 G 16 B 16 A 16;
    R16G16B16A16Snorm: Snorm, R 16 G 16 B 16 A 16;
    R16G16B16A16Uscaled: Uscaled, R 16 G 16 B 16 A 16;
    R16G16B16A16Sscaled: Sscaled, R 16 G 16 B 16 A 16;
    R16G16B16A16Uint: Uint, R 16 G 16 B 16 A 16;
    R16G16B16A16Sint: Sint, R 16 G 16 B 16 A 16;
    R16G16B16A16Sfloat: Sfloat, R 16 G 16 B 16 A 16;
    R32Uint: Uint, R 32;
    R32Sint: Sint, R 32;
    R32Sfloat: Sfloat, R 32;
    R32G32Uint: Uint, R 32 G 32;
    R32G32Sint: Sint, R 32 G 32;
    R32G32Sfloat: Sfloat, R 32 G 32;
    R32G32B32Uint: Uint, R 32 G 32 B 32;
    R32G32B32Sint: Sint, R 32 G 32 B 32;
    R32G32B32Sfloat: Sfloat, R 32 G 32 B 32;
    R32G32B32A32Uint: Uint, R 32 G 32 B 32 A 32;
    R32G32B32A32Sint: Sint, R 32 G 32 B 32 A 32;
    R32G32B32A32Sfloat: Sfloat, R 32 G 32 B 32 A 32;
    B10G11R11UfloatPack32: Ufloat, R 11 G 11 B 10;
    E5B9G9R9UfloatPack32: SharedExponent, R 9 G 9 B 9 E 5;
    D16Unorm: Unorm, D 16;
    X8D24UnormPack32: Unorm, D 24 X 8;
    D32Sfloat: Sfloat, D 32;
    S8Uint: Uint, S 8;
    D16UnormS8Uint: DepthStencil, D 16 S 8;
    D24UnormS8Uint: DepthStencil, D 24 S 8;
    D32SfloatS8Uint: DepthStencil, D 32 S 8;
    Bc1RgbUnormBlock: Unorm, X 32 X 32;
    Bc1RgbSrgbBlock: Srgb, X 32 X 32;
    Bc1RgbaUnormBlock: Unorm, X 32 X 32;
    Bc1RgbaSrgbBlock: Srgb, X 32 X 32;
    Bc2UnormBlock: Unorm, X 32 X 32 X 32 X 32;
    Bc2SrgbBlock: Srgb, X 32 X 32 X 32 X 32;
    Bc3UnormBlock: Unorm, X 32 X 32 X 32 X 32;
    Bc3SrgbBlock: Srgb, X 32 X 32 X 32 X 32;
    Bc4UnormBlock: Unorm, X 32 X 32;
    Bc4SnormBlock: Snorm, X 32 X 32;
    Bc5UnormBlock: Unorm, X 32 X 32 X 32 X 32;
    Bc5SnormBlock: Snorm, X 32 X 32 X 32 X 32;
    Bc6hUfloatBlock: Ufloat, X 32 X 32 X 32 X 32;
    Bc6hSfloatBlock: Sfloat, X 32 X 32 X 32 X 32;
    Bc7UnormBlock: Unorm, X 32 X 32 X 32 X 32;
    Bc7SrgbBlock: Srgb, X 32 X 32 X 32 X 32;
    R10X6UnormPack16: Unorm, X 6 R 10;
    R10X6G10X6Unorm2Pack16: Unorm, X 6 R 10 X 6 G 10;
    R10X6G10X6B10X6A10X6Unorm4Pack16: Unorm, X 6 R 10 X 6 G 10 X 6 B 10 X 6 A 10;
    R12X4UnormPack16: Unorm, X 4 R 12;
    R12X4G12X4Unorm2Pack16: Unorm, X 4 R 12 X 4 G 12;
    R12X4G12X4B12X4A12X4Unorm4Pack16: Unorm, X 4 R 12 X 4 G 12 X 4 B 12 X 4 A 12;
    Etc2R8G8B8UnormBlock: Unorm, X 32 X 32;
    Etc2R8G8B8SrgbBlock: Srgb, X 32 X 32;
    Etc2R8G8B8A1UnormBlock: Unorm, X 32 X 32;
    Etc2R8G8B8A1SrgbBlock: Srgb, X 32 X 32;
    Etc2R8G8B8A8UnormBlock: Unorm, X 32 X 32 X 32 X 32;
    Etc2R8G8B8A8SrgbBlock: Srgb, X 32 X 32 X 32 X 32;
    EacR11UnormBlock: Unorm, X 32 X 32;
    EacR11SnormBlock: Snorm, X 32 X 32;
    EacR11G11UnormBlock: Unorm, X 32 X 32 X 32 X 32;
    EacR11G11SnormBlock: Snorm, X 32 X 32 X 32 X 32;
    Astc4x4UnormBlock: Unorm, X 32 X 32 X 32 X 32;
    Astc4x4SrgbBlock: Srgb, X 32 X 32 X 32 X 32;
    Astc5x4UnormBlock: Unorm, X 32 X 32 X 32 X 32;
    Astc5x4SrgbBlock: Srgb, X 32 X 32 X 32 X 32;
    Astc5x5UnormBlock: Unorm, X 32 X 32 X 32 X 32;
    Astc5x5SrgbBlock: Srgb, X 32 X 32 X 32 X 32;
    Astc6x5UnormBlock: Unorm, X 32 X 32 X 32 X 32;
    Astc6x5SrgbBlock: Srgb, X 32 X 32 X 32 X 32;
    Astc6x6UnormBlock: Unorm, X 32 X 32 X 32 X 32;
    Astc6x6SrgbBlock: Srgb, X 32 X 32 X 32 X 32;
    Astc8x5UnormBlock: Unorm, X 32 X 32 X 32 X 32;
    Astc8x5SrgbBlock: Srgb, X 32 X 32 X 32 X 32;
    Astc8x6UnormBlock: Unorm, X 32 X 32 X 32 X 32;
    Astc8x6SrgbBlock: Srgb, X 32 X 32 X 32 X 32;
    Astc8x8UnormBlock: Unorm, X 32 X 32 X 32 X 32;
    Astc8x8SrgbBlock: Srgb, X 32 X 32 X 32 X 32;
    Astc10x5UnormBlock: Unorm, X 32 X 32 X 32 X 32;
    Astc10x5SrgbBlock: Srgb, X 32 X 32 X 32 X 32;
    Astc10x6UnormBlock: Unorm, X 32 X 32 X 32 X 32;
    Astc10x6SrgbBlock: Srgb, X 32 X 32 X 32 X 32;
    Astc10x8UnormBlock: Unorm, X 32 X 32 X 32 X 32;
    Astc10x8SrgbBlock: Srgb, X 32 X 32 X 32 X 32;
    Astc10x10UnormBlock: Unorm, X 32 X 32 X 32 X 32;
    Astc10x10SrgbBlock: Srgb, X 32 X 32 X 32 X 32;
    Astc12x10UnormBlock: Unorm, X 32 X 32 X 32 X 32;
    Astc12x10SrgbBlock: Srgb, X 32 X 32 X 32 X 32;
    Astc12x12UnormBlock: Unorm, X 32 X 32 X 32 X 32;
    Astc12x12SrgbBlock: Srgb, X 32 X 32 X 32 X 32;
}

/// The most bytes of a texel.
pub const MAX_TEXEL_SIZE: usize = 16;

/// The values of registers whose component a format lacks.
const ABSENT: [f32; 4] = [0.0, 0.0, 0.0, 1.0];

impl Format {
    /// True if registers hold integers.
    pub const fn is_integer(self) -> bool {
        matches!(self.numeric(), Numeric::Uint | Numeric::Sint)
    }

    /// True if a texel has this component.
    pub fn has(self, channel: Channel) -> bool {
        self.components().iter().any(|c| c.channel == channel)
    }

    /// The aspects of an image of this format.
    pub fn aspects(self) -> &'static [Aspect] {
        match (self.has(Channel::D), self.has(Channel::S)) {
            (false, false) => &[Aspect::Color],
            (true, false) => &[Aspect::Depth],
            (false, true) => &[Aspect::Stencil],
            (true, true) => &[Aspect::Depth, Aspect::Stencil],
        }
    }

    /// The format of one aspect's texels, in images and in buffers that are copied to and from them.
    pub fn plane(self, aspect: Aspect) -> Option<Self> {
        match (self, aspect) {
            (Self::D16UnormS8Uint, Aspect::Depth) => Some(Self::D16Unorm),
            (Self::D24UnormS8Uint, Aspect::Depth) => Some(Self::X8D24UnormPack32),
            (Self::D32SfloatS8Uint, Aspect::Depth) => Some(Self::D32Sfloat),
            (format, Aspect::Depth) if format.has(Channel::D) => Some(format),
            (format, Aspect::Stencil) if format.has(Channel::S) => Some(Self::S8Uint),
            (format, Aspect::Color) if format.aspects() == [Aspect::Color] => Some(format),
            _ => None,
        }
    }

    /// Decodes a texel. Bytes missing from `texel` are taken as zero.
    pub fn decode(self, texel: &[u8]) -> [f32; 4] {
        let mut out = [ABSENT];
        let size = self.texel_size();
        if texel.len() >= size {
            self.decode_row(&texel[..size], &mut out);
        } else {
            let mut padded = [0; MAX_TEXEL_SIZE];
            padded[..texel.len()].copy_from_slice(texel);
            self.decode_row(&padded[..size], &mut out);
        }
        out[0]
    }

    /// Encodes a texel. Only the first [`Format::texel_size`] bytes are used.
    pub fn encode(self, texel: [f32; 4]) -> [u8; MAX_TEXEL_SIZE] {
        let mut out = [0; MAX_TEXEL_SIZE];
        self.encode_row(&[texel], &mut out[..self.texel_size()]);
        out
    }

    /// Decodes consecutive texels until either slice ends.
    pub fn decode_row(self, bytes: &[u8], out: &mut [[f32; 4]]) {
        match self {
            Self::R8G8B8A8Unorm | Self::A8B8G8R8UnormPack32 => {
                decode_each(bytes, out, |texel: [u8; 4]| texel.map(convert::from_unorm8));
            }
            Self::B8G8R8A8Unorm => decode_each(bytes, out, |[b, g, r, a]| [r, g, b, a].map(convert::from_unorm8)),
            Self::R8G8B8A8Srgb | Self::A8B8G8R8SrgbPack32 => {
                decode_each(bytes, out, convert::from_srgb8);
            }
            Self::B8G8R8A8Srgb => {
                decode_each(bytes, out, |[b, g, r, a]| convert::from_srgb8([r, g, b, a]));
            }
            Self::R8Unorm => decode_each(bytes, out, |[r]: [u8; 1]| [convert::from_unorm8(r), 0.0, 0.0, 1.0]),
            Self::R8G8Unorm => {
                decode_each(bytes, out, |[r, g]| [convert::from_unorm8(r), convert::from_unorm8(g), 0.0, 1.0]);
            }
            Self::A2B10G10R10UnormPack32 => {
                decode_each(bytes, out, |texel| convert::from_unorm10(u32::from_le_bytes(texel)));
            }
            Self::A2R10G10B10UnormPack32 => decode_each(bytes, out, |texel| {
                let [b, g, r, a] = convert::from_unorm10(u32::from_le_bytes(texel));
                [r, g, b, a]
            }),
            Self::R16G16B16A16Sfloat => {
                let (texels, _) = bytes.as_chunks::<8>();
                convert::from_halves(texels.as_flattened(), out.as_flattened_mut());
            }
            Self::R32Sfloat => decode_each(bytes, out, |texel: [u8; 4]| [f32::from_le_bytes(texel), 0.0, 0.0, 1.0]),
            Self::R32G32Sfloat => decode_each(bytes, out, |texel: [u8; 8]| {
                let [x, y] = bytemuck::cast(texel);
                [x, y, 0.0, 1.0]
            }),
            Self::R32G32B32Sfloat => decode_each(bytes, out, |texel: [u8; 12]| {
                let [x, y, z] = bytemuck::cast(texel);
                [x, y, z, 1.0]
            }),
            Self::R32G32B32A32Sfloat => {
                decode_each(bytes, out, bytemuck::cast::<[u8; 16], _>);
            }
            Self::E5B9G9R9UfloatPack32 => {
                decode_each(bytes, out, |texel| convert::from_shared_exponent(u32::from_le_bytes(texel)));
            }
            _ => {
                let (numeric, components) = (self.numeric(), self.components());
                for (texel, out) in bytes.chunks_exact(self.texel_size()).zip(out) {
                    *out = decode_components(numeric, components, texel);
                }
            }
        }
    }

    /// Encodes consecutive texels until either slice ends.
    pub fn encode_row(self, texels: &[[f32; 4]], out: &mut [u8]) {
        match self {
            Self::R8G8B8A8Unorm | Self::A8B8G8R8UnormPack32 => {
                encode_each(texels, out, convert::to_unorm8x4);
            }
            Self::B8G8R8A8Unorm => encode_each(texels, out, |[r, g, b, a]| convert::to_unorm8x4([b, g, r, a])),
            Self::R8Unorm => encode_each(texels, out, |[r, ..]| [convert::to_unorm8(r)]),
            Self::R8G8Unorm => encode_each(texels, out, |[r, g, ..]| [r, g].map(convert::to_unorm8)),
            Self::A2B10G10R10UnormPack32 => encode_each(texels, out, |texel| convert::to_unorm10(texel).to_le_bytes()),
            Self::A2R10G10B10UnormPack32 => {
                encode_each(texels, out, |[r, g, b, a]| convert::to_unorm10([b, g, r, a]).to_le_bytes());
            }
            Self::R8G8B8A8Srgb | Self::A8B8G8R8SrgbPack32 => {
                encode_each(texels, out, convert::to_srgb8);
            }
            Self::B8G8R8A8Srgb => encode_each(texels, out, |texel| {
                let [r, g, b, a] = convert::to_srgb8(texel);
                [b, g, r, a]
            }),
            Self::R16G16B16A16Sfloat => {
                let (out, _) = out.as_chunks_mut::<8>();
                convert::to_halves(texels.as_flattened(), out.as_flattened_mut());
            }
            Self::R32G32B32A32Sfloat => {
                encode_each(texels, out, bytemuck::cast::<_, [u8; 16]>);
            }
            Self::E5B9G9R9UfloatPack32 => {
                encode_each(texels, out, |texel| convert::to_shared_exponent(&texel).to_le_bytes());
            }
            _ => {
                let (numeric, components) = (self.numeric(), self.components());
                for (out, texel) in out.chunks_exact_mut(self.texel_size()).zip(texels) {
                    encode_components(numeric, components, texel, out);
                }
            }
        }
    }

    /// The bytes to which one aspect of an image of this format is cleared.
    pub fn encode_clear(self, aspect: Aspect, value: ClearValue) -> [u8; MAX_TEXEL_SIZE] {
        let Some(plane) = self.plane(aspect) else {
            return [0; MAX_TEXEL_SIZE];
        };
        let registers = match value {
            ClearValue::Float(value) => value,
            // Scaled formats hold integers.
            ClearValue::Int(value) if plane.numeric() == Numeric::Sscaled => value.map(|component| component as f32),
            ClearValue::Uint(value) if plane.numeric() == Numeric::Uscaled => value.map(|component| component as f32),
            ClearValue::Int(value) => value.map(|component| f32::from_bits(component as u32)),
            ClearValue::Uint(value) => value.map(f32::from_bits),
            ClearValue::DepthStencil { stencil, .. } if aspect == Aspect::Stencil => {
                // The stencil buffer receives the value's low bits.
                [f32::from_bits(stencil & 0xFF), 0.0, 0.0, 0.0]
            }
            ClearValue::DepthStencil { depth, .. } => [depth, 0.0, 0.0, 0.0],
        };
        plane.encode(registers)
    }
}

/// Decodes texels of `N` bytes.
fn decode_each<const N: usize>(bytes: &[u8], out: &mut [[f32; 4]], decode: impl Fn([u8; N]) -> [f32; 4]) {
    let (texels, _) = bytes.as_chunks();
    for (&texel, out) in texels.iter().zip(out) {
        *out = decode(texel);
    }
}

/// Encodes texels of `N` bytes.
fn encode_each<const N: usize>(texels: &[[f32; 4]], out: &mut [u8], encode: impl Fn([f32; 4]) -> [u8; N]) {
    let (out, _) = out.as_chunks_mut();
    for (&texel, out) in texels.iter().zip(out) {
        *out = encode(texel);
    }
}

pub(super) fn decode_components(numeric: Numeric, components: &[Component], bytes: &[u8]) -> [f32; 4] {
    let mut texel = [0; MAX_TEXEL_SIZE];
    texel[..bytes.len()].copy_from_slice(bytes);
    let mut rest = u128::from_le_bytes(texel);
    let mut out = match numeric {
        Numeric::Uint | Numeric::Sint => [0.0, 0.0, 0.0, f32::from_bits(1)],
        _ => ABSENT,
    };
    for component in components {
        let code = rest as u32 & (u32::MAX >> (32 - component.bits));
        rest >>= component.bits;
        if let Some(register) = component.channel.register() {
            out[register] = convert::decode(numeric, *component, code);
        }
    }
    out
}

pub(super) fn encode_components(numeric: Numeric, components: &[Component], texel: &[f32; 4], out: &mut [u8]) {
    let (mut bits, mut shift) = (0u128, 0);
    for component in components {
        if let Some(register) = component.channel.register() {
            let code = convert::encode(numeric, *component, texel[register]);
            bits |= u128::from(code) << shift;
        }
        shift += component.bits;
    }
    out.copy_from_slice(&bits.to_le_bytes()[..out.len()]);
}

impl Format {
    /// The width and height of a storage unit in texels: those of a compressed format's blocks, otherwise 1 and 1.
    pub const fn block_extent(self) -> [u32; 2] {
        match self {
            Self::Astc5x4UnormBlock | Self::Astc5x4SrgbBlock => [5, 4],
            Self::Astc5x5UnormBlock | Self::Astc5x5SrgbBlock => [5, 5],
            Self::Astc6x5UnormBlock | Self::Astc6x5SrgbBlock => [6, 5],
            Self::Astc6x6UnormBlock | Self::Astc6x6SrgbBlock => [6, 6],
            Self::Astc8x5UnormBlock | Self::Astc8x5SrgbBlock => [8, 5],
            Self::Astc8x6UnormBlock | Self::Astc8x6SrgbBlock => [8, 6],
            Self::Astc8x8UnormBlock | Self::Astc8x8SrgbBlock => [8, 8],
            Self::Astc10x5UnormBlock | Self::Astc10x5SrgbBlock => [10, 5],
            Self::Astc10x6UnormBlock | Self::Astc10x6SrgbBlock => [10, 6],
            Self::Astc10x8UnormBlock | Self::Astc10x8SrgbBlock => [10, 8],
            Self::Astc10x10UnormBlock | Self::Astc10x10SrgbBlock => [10, 10],
            Self::Astc12x10UnormBlock | Self::Astc12x10SrgbBlock => [12, 10],
            Self::Astc12x12UnormBlock | Self::Astc12x12SrgbBlock => [12, 12],
            _ if self.decompressed().is_some() => [block::SIDE as u32; 2],
            _ => [1; 2],
        }
    }

    /// The uncompressed format that holds a compressed format's texels without loss; `None` if this format is not
    /// compressed.
    pub const fn decompressed(self) -> Option<Self> {
        Some(match self {
            Self::Bc1RgbUnormBlock
            | Self::Bc1RgbaUnormBlock
            | Self::Bc2UnormBlock
            | Self::Bc3UnormBlock
            | Self::Bc7UnormBlock
            | Self::Etc2R8G8B8UnormBlock
            | Self::Etc2R8G8B8A1UnormBlock
            | Self::Etc2R8G8B8A8UnormBlock => Self::R8G8B8A8Unorm,
            Self::Bc1RgbSrgbBlock
            | Self::Bc1RgbaSrgbBlock
            | Self::Bc2SrgbBlock
            | Self::Bc3SrgbBlock
            | Self::Bc7SrgbBlock
            | Self::Etc2R8G8B8SrgbBlock
            | Self::Etc2R8G8B8A1SrgbBlock
            | Self::Etc2R8G8B8A8SrgbBlock => Self::R8G8B8A8Srgb,
            Self::Bc4UnormBlock | Self::Bc4SnormBlock | Self::EacR11UnormBlock | Self::EacR11SnormBlock => {
                Self::R32Sfloat
            }
            Self::Bc5UnormBlock | Self::Bc5SnormBlock | Self::EacR11G11UnormBlock | Self::EacR11G11SnormBlock => {
                Self::R32G32Sfloat
            }
            Self::Bc6hUfloatBlock | Self::Bc6hSfloatBlock => Self::R16G16B16A16Sfloat,
            _ => match self.astc() {
                // The results have 16 bits unless they are sRGB.
                Some(Numeric::Srgb) => Self::R8G8B8A8Srgb,
                Some(_) => Self::R16G16B16A16Sfloat,
                None => return None,
            },
        })
    }

    /// The interpretation of the texels of an ASTC format; `None` for other formats.
    const fn astc(self) -> Option<Numeric> {
        let (first, last) = (Self::Astc4x4UnormBlock as usize, Self::Astc12x12SrgbBlock as usize);
        let is_astc = first <= self as usize && self as usize <= last;
        if is_astc { Some(self.numeric()) } else { None }
    }

    /// True if blocks of a compressed format of the same size have the same decoded bytes in both formats.
    pub(crate) fn decodes_like(self, other: Self) -> bool {
        let has_bytes = |format: Self| matches!(format.decompressed(), Some(Self::R8G8B8A8Unorm | Self::R8G8B8A8Srgb));
        self == other || (has_bytes(self) && has_bytes(other) && self.astc() == other.astc())
    }

    /// Writes the texels of a block row by row, in the format of [`Format::decompressed`]; `None` if this format is not
    /// compressed. `texels` has the bytes of a block of such texels.
    pub(crate) fn decode_block(self, bytes: &[u8; 16], texels: &mut [u8]) -> Option<()> {
        match self {
            Self::Bc1RgbUnormBlock | Self::Bc1RgbSrgbBlock => block::bc1_rgb(bytes, texels),
            Self::Bc1RgbaUnormBlock | Self::Bc1RgbaSrgbBlock => block::bc1(bytes, texels),
            Self::Bc2UnormBlock | Self::Bc2SrgbBlock => block::bc2(bytes, texels),
            Self::Bc3UnormBlock | Self::Bc3SrgbBlock => block::bc3(bytes, texels),
            Self::Bc4UnormBlock => block::bc4(bytes, false, texels),
            Self::Bc4SnormBlock => block::bc4(bytes, true, texels),
            Self::Bc5UnormBlock => block::bc5(bytes, false, texels),
            Self::Bc5SnormBlock => block::bc5(bytes, true, texels),
            Self::Bc6hUfloatBlock => block::bc6h(bytes, false, texels),
            Self::Bc6hSfloatBlock => block::bc6h(bytes, true, texels),
            Self::Bc7UnormBlock | Self::Bc7SrgbBlock => block::bc7(bytes, texels),
            Self::Etc2R8G8B8UnormBlock | Self::Etc2R8G8B8SrgbBlock => etc::rgb(bytes, texels),
            Self::Etc2R8G8B8A1UnormBlock | Self::Etc2R8G8B8A1SrgbBlock => etc::rgb_a1(bytes, texels),
            Self::Etc2R8G8B8A8UnormBlock | Self::Etc2R8G8B8A8SrgbBlock => etc::rgba(bytes, texels),
            Self::EacR11UnormBlock => etc::eac::<1>(bytes, false, texels),
            Self::EacR11SnormBlock => etc::eac::<1>(bytes, true, texels),
            Self::EacR11G11UnormBlock => etc::eac::<2>(bytes, false, texels),
            Self::EacR11G11SnormBlock => etc::eac::<2>(bytes, true, texels),
            _ => match self.astc()? {
                Numeric::Srgb => astc::srgb(bytes, self.block_extent(), texels),
                _ => astc::linear(bytes, self.block_extent(), texels),
            },
        }
        Some(())
    }
}
