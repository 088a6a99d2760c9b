//! The parts of texels: components, aspects, and the values that they are cleared to.

use std::fmt;
use std::fmt::{Display, Formatter};

/// How the bits of a component are to be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Numeric {
    /// 0 to 1.
    Unorm,
    /// -1 to 1.
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
    /// 0 to 1 by the sRGB transfer function, alpha linear.
    Srgb,
    /// Three 9-bit mantissas with one 5-bit exponent.
    SharedExponent,
    /// A depth and a stencil component, which live in planes of their own (see [`Format::plane`]).
    DepthStencil,
}

/// A component's meaning.
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
    /// The register that holds it, if any.
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
    /// What it means.
    pub channel: Channel,
    /// How many bits it has.
    pub bits: u32,
}

/// Which half of a depth and stencil image is meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Aspect {
    /// Colour texels.
    Color,
    /// The depth component.
    Depth,
    /// The stencil component.
    Stencil,
}

/// A clear value, as bits: how they are read depends on the format cleared.
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
        /// Depth, 0 to 1.
        depth: f32,
        /// Stencil.
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
