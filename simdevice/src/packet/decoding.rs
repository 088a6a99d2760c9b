//! The decoding of Gaussians' attributes: what integers in memory stand for.

/// The way in which an attribute's values are computed from integers. `is_binary64` tells the numbers of its table:
/// binary64, or binary32 if it is false.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Decoding {
    /// The stream has the values.
    #[default]
    None,
    /// An integer is a fraction of the way from the least to the greatest value of its chunk.
    Chunk {
        /// The number of vertices of a chunk, at least 1.
        size: u32,
        /// The numbers of the table.
        is_binary64: bool,
    },
    /// An integer of 8 bits is the number of a value in a codebook.
    Codebook {
        /// The numbers of the table.
        is_binary64: bool,
    },
}

/// The way in which a quaternion is computed from integers. The largest of its four components is left out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum RotationDecoding {
    /// The stream has the quaternion.
    #[default]
    None,
    /// A word: the number of the largest component in the 2 highest bits, then the others in 10 bits each.
    SmallestThree10,
    /// Four bytes: the smaller components, then 252 more than the number of the largest.
    SmallestThree8,
}

/// The way in which the coefficients of spherical harmonics from degree 1 on are computed from bytes, the numbers of
/// values in a codebook. Their streams, those after the first, have the bytes of red.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum HarmonicsDecoding {
    /// The streams have the coefficients.
    #[default]
    None,
    /// An element for each vertex.
    Codebook(HarmonicsCodes),
    /// An element for each entry of a palette. Labels name the entries of vertices.
    Palette(HarmonicsCodes),
}

/// The layout of the codes of spherical harmonics, and the numbers of their codebook.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct HarmonicsCodes {
    /// Bytes from red to green, and from green to blue.
    pub component_stride: u32,
    /// True if the numbers of the codebook are binary64, false if they are binary32.
    pub is_binary64: bool,
}

/// The decodings of a draw's attributes. Values are computed in binary64, and rounded once to binary32 after the
/// functions of [`Activations`](super::Activations).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Decodings {
    /// That of positions.
    pub position: Decoding,
    /// True if a decoded coordinate `v` stands for `sign(v) (exp(|v|) - 1)`.
    pub signed_log_position: bool,
    /// That of scales.
    pub scale: Decoding,
    /// That of rotations.
    pub rotation: RotationDecoding,
    /// That of opacities.
    pub opacity: Decoding,
    /// That of coefficient 0.
    pub color: Decoding,
    /// True if a decoded component `v` of coefficient 0 stands for `(v - 0.5) / 0.28209479177387814`.
    pub base_color: bool,
    /// That of the other coefficients.
    pub harmonics: HarmonicsDecoding,
}
