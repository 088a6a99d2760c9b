//! The decodings of a Gaussian pipeline's attributes: their rules and their conversion.

use super::valid_usage::{DECODING, is_shaded, require};
use crate::abi::error::Error;
use crate::enabled::Enabled;
use crate::pipeline::parts::GraphicsState;
use crate::pipeline::state::{AttributeSource, attribute, find_attribute};
use ash::vk;
use gaurast::vk::{
    GaussianDecodingGAURAST, GaussianHarmonicsDecodingGAURAST, GaussianRotationDecodingGAURAST,
    PipelineGaussianStateCreateFlagsGAURAST as Flags, PipelineGaussianStateCreateInfoGAURAST,
};
use simdevice::Format;
use simdevice::packet::RotationDecoding;

const STRUCTURE: &str = "VkPipelineGaussianDecodingStateCreateInfoGAURAST";

/// The way in which an attribute's values are computed from integers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Method {
    /// The attribute has the values.
    #[default]
    None,
    /// By the bounds of a chunk.
    Chunk,
    /// By a codebook.
    Codebook,
}

/// The way in which the coefficients of spherical harmonics from degree 1 on are computed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum HarmonicsMethod {
    /// They are attributes, or in a buffer.
    #[default]
    None,
    /// By a codebook, from bytes of each Gaussian.
    Codebook,
    /// By a codebook, from bytes of a palette's entries.
    Palette,
}

/// The decodings of a pipeline's attributes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct DecodingState {
    /// That of positions.
    pub(crate) position: Method,
    /// True if decoded positions are signed logarithms.
    pub(crate) signed_log_position: bool,
    /// That of scales.
    pub(crate) scale: Method,
    /// That of rotations.
    pub(crate) rotation: RotationDecoding,
    /// That of opacities.
    pub(crate) opacity: Method,
    /// That of coefficient 0.
    pub(crate) color: Method,
    /// True if decoded values of coefficient 0 are colours.
    pub(crate) base_color: bool,
    /// That of the other coefficients.
    pub(crate) harmonics: HarmonicsMethod,
}

impl DecodingState {
    /// The decodings of a pipeline; the default if it has none.
    ///
    /// # Errors
    /// An [`Error`] that names the broken rule.
    pub(super) fn new(
        graphics: &GraphicsState,
        gaussian: &PipelineGaussianStateCreateInfoGAURAST,
        enabled: &Enabled,
    ) -> Result<Self, Error> {
        let Some(given) = graphics.pre_rasterization.decoding.filter(|_| !is_shaded(gaussian)) else {
            return Ok(Self::default());
        };
        let state = Self {
            position: method(given.position, "position")?,
            signed_log_position: given.signed_log_position != vk::FALSE,
            scale: method(given.scale, "scale")?,
            rotation: match given.rotation {
                GaussianRotationDecodingGAURAST::NONE => RotationDecoding::None,
                GaussianRotationDecodingGAURAST::SMALLEST_THREE_10 => RotationDecoding::SmallestThree10,
                GaussianRotationDecodingGAURAST::SMALLEST_THREE_8 => RotationDecoding::SmallestThree8,
                other => return Err(unknown("rotation", &other)),
            },
            opacity: method(given.opacity, "opacity")?,
            color: method(given.color, "color")?,
            base_color: given.base_color != vk::FALSE,
            harmonics: match given.spherical_harmonics {
                GaussianHarmonicsDecodingGAURAST::NONE => HarmonicsMethod::None,
                GaussianHarmonicsDecodingGAURAST::CODEBOOK => HarmonicsMethod::Codebook,
                GaussianHarmonicsDecodingGAURAST::PALETTE => HarmonicsMethod::Palette,
                other => return Err(unknown("sphericalHarmonics", &other)),
            },
        };
        if state.needs_tables() || state.rotation != RotationDecoding::None {
            require(enabled, &DECODING, "an attribute is decoded")?;
        }
        let of_harmonics = state.color != Method::None || state.harmonics != HarmonicsMethod::None;
        if of_harmonics && gaussian.flags.contains(Flags::SPHERICAL_HARMONICS_BUFFER) {
            return Err(Error::usage(
                "VUID-VkPipelineGaussianDecodingStateCreateInfoGAURAST-color-90098",
                format!(
                    "{STRUCTURE}: color or sphericalHarmonics is decoded, but flags has SPHERICAL_HARMONICS_BUFFER"
                ),
            ));
        }
        Ok(state)
    }

    /// True if a draw needs tables.
    pub(crate) fn needs_tables(&self) -> bool {
        let methods = [self.position, self.scale, self.opacity, self.color];
        methods.iter().any(|&method| method != Method::None) || self.harmonics != HarmonicsMethod::None
    }

    /// The number of attributes that coefficients of spherical harmonics have, of `coefficients`.
    pub(super) fn harmonics_attributes(&self, coefficients: u32) -> u32 {
        if self.harmonics == HarmonicsMethod::None { coefficients } else { 1 }
    }

    /// Finds the attribute of rotations.
    ///
    /// # Errors
    /// An [`Error`] if the location, its binding or its format is unsuitable.
    pub(super) fn rotation_source(&self, graphics: &GraphicsState, location: u32) -> Result<AttributeSource, Error> {
        let expected = match self.rotation {
            RotationDecoding::None => return attribute(graphics, "rotation", location, 4),
            RotationDecoding::SmallestThree10 => Format::R32Uint,
            RotationDecoding::SmallestThree8 => Format::R8G8B8A8Uint,
        };
        let source = find_attribute(graphics, "rotation", location)?;
        if source.format != expected {
            return Err(Error::usage(
                "VUID-VkPipelineGaussianDecodingStateCreateInfoGAURAST-rotation-90097",
                format!(
                    "{STRUCTURE}: rotation is {:?}, but the format of location {location} is {:?}, not {expected:?}",
                    self.rotation, source.format
                ),
            ));
        }
        Ok(source)
    }
}

/// An attribute with a method of decoding.
pub(super) struct Decoded {
    /// The name of the attribute.
    pub(super) name: &'static str,
    pub(super) method: Method,
    /// The components of the attribute if it is decoded.
    pub(super) components: u32,
    /// The components of the attribute if it is not.
    pub(super) plain_components: u32,
    /// True if a word may hold the components' codes for this method.
    pub(super) may_be_word: bool,
}

impl Decoded {
    /// Finds the attribute at `location`.
    ///
    /// # Errors
    /// An [`Error`] if the location, its binding or its format is unsuitable.
    pub(super) fn source(&self, graphics: &GraphicsState, location: u32) -> Result<AttributeSource, Error> {
        let &Self { name, method, components, plain_components, may_be_word } = self;
        if method == Method::None {
            return attribute(graphics, name, location, plain_components);
        }
        let source = find_attribute(graphics, name, location)?;
        let format = source.format;
        let bits = match format {
            Format::R8Uint | Format::R8G8Uint | Format::R8G8B8Uint | Format::R8G8B8A8Uint => 8,
            Format::R16Uint | Format::R16G16Uint | Format::R16G16B16Uint | Format::R16G16B16A16Uint => 16,
            _ => 0,
        };
        let is_right = match bits {
            0 => format == Format::R32Uint && may_be_word,
            8 => format.components().len() >= components as usize,
            _ => format.components().len() >= components as usize && method == Method::Chunk,
        };
        if !is_right {
            return Err(Error::usage(
                "VUID-VkPipelineGaussianDecodingStateCreateInfoGAURAST-position-90096",
                format!(
                    "{STRUCTURE}: {name} is {method:?}, but the format of location {location}, {format:?}, holds no \
                     {components} codes for that"
                ),
            ));
        }
        Ok(source)
    }
}

fn method(decoding: GaussianDecodingGAURAST, member: &str) -> Result<Method, Error> {
    match decoding {
        GaussianDecodingGAURAST::NONE => Ok(Method::None),
        GaussianDecodingGAURAST::CHUNK => Ok(Method::Chunk),
        GaussianDecodingGAURAST::CODEBOOK => Ok(Method::Codebook),
        other => Err(unknown(member, &other)),
    }
}

fn unknown(member: &str, value: &dyn std::fmt::Debug) -> Error {
    let vuid = match member {
        "position" => "VUID-VkPipelineGaussianDecodingStateCreateInfoGAURAST-position-parameter",
        "scale" => "VUID-VkPipelineGaussianDecodingStateCreateInfoGAURAST-scale-parameter",
        "rotation" => "VUID-VkPipelineGaussianDecodingStateCreateInfoGAURAST-rotation-parameter",
        "opacity" => "VUID-VkPipelineGaussianDecodingStateCreateInfoGAURAST-opacity-parameter",
        "color" => "VUID-VkPipelineGaussianDecodingStateCreateInfoGAURAST-color-parameter",
        _ => "VUID-VkPipelineGaussianDecodingStateCreateInfoGAURAST-sphericalHarmonics-parameter",
    };
    Error::usage(vuid, format!("{STRUCTURE}: {member} has the unknown value {value:?}"))
}
