//! The parts of texels: components, aspects, and the values that they are cleared to.

use std::fmt;
use std::fmt::{Display, Formatter};

/// The interpretation of a component's bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Numeric {
    /// A number from 0 to 1.
    Unorm,
    /// A number from -1 to 1.
    Snorm,
    /// An unsigned integer that is converted to floating point.
    Uscaled,
    /// A signed integer that is converted to floating point.
    Sscaled,
    /// An unsigned integer.
    Uint,
    /// A signed integer.
    Sint,
    /// A binary16 or binary32 number.
    Sfloat,
    /// A floating-point number without a sign: 5 bits of exponent, 5 or 6 of mantissa.
    Ufloat,
    /// A number from 0 to 1, encoded by the sRGB transfer function. Alpha is linear.
    Srgb,
    /// Three 9-bit mantissas with one 5-bit exponent.
    SharedExponent,
    /// A depth and a stencil component, each in its own plane (see [`Format::plane`](super::Format::plane)).
    DepthStencil,
}

/// The meaning of a component.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Channel {
    /// Red.
    R,
    /// Green.
    G,
    /// Blue.
    B,
    /// Alpha.
    A,
    /// Depth.
    D,
    /// Stencil.
    S,
    /// The shared exponent.
    E,
    /// Unused bits.
    X,
}

impl Channel {
    /// The register that holds the component, if it has one.
    pub(crate) fn register(self) -> Option<usize> {
        match self {
            Self::R | Self::D | Self::S => Some(0),
            Self::G => Some(1),
            Self::B => Some(2),
            Self::A => Some(3),
            Self::E | Self::X => None,
        }
    }
}

/// A component: its meaning and its width in bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Component {
    /// The meaning of the component.
    pub channel: Channel,
    /// The number of bits.
    pub bits: u32,
}

/// The aspect of an image: colour, depth or stencil.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Aspect {
    /// Colour texels.
    Color,
    /// The depth component.
    Depth,
    /// The stencil component.
    Stencil,
}

/// A clear value. The image's format must match the variant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ClearValue {
    /// For normalised and floating-point colour formats.
    Float([f32; 4]),
    /// For signed integer colour formats.
    Int([i32; 4]),
    /// For unsigned integer colour formats.
    Uint([u32; 4]),
    /// For depth and stencil formats.
    DepthStencil {
        /// The depth, from 0 to 1.
        depth: f32,
        /// The stencil value.
        stencil: u32,
    },
}

impl Display for ClearValue {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::Float(value) => write!(f, "{value:?}"),
            Self::Int(value) => write!(f, "{value:?}"),
            Self::Uint(value) => write!(f, "{value:?}"),
            Self::DepthStencil { depth, stencil } => write!(f, "depth {depth}, stencil {stencil}"),
        }
    }
}
