//! Scenes as compressed files have them: integers, and the tables that say what these stand for.
//!
//! A device draws them with the feature `attributeDecoding`, in a quarter to a third of the memory. [`EncodedScene::decode`]
//! computes the same numbers on the host: in binary64, rounded to binary32 once.

use std::f64::consts::FRAC_1_SQRT_2;
use std::path::PathBuf;

use glam::{DMat3, DVec3};

use crate::error::{Fault, SceneError};
use crate::harmonics::{SH_C0, sh_coefficients};
use crate::metadata::Metadata;
use crate::scene::Scene;
use crate::shape::{GaussianShape, sigmoid};
use crate::transform::Motion;

/// The entries of a codebook.
pub(crate) const CODEBOOK: usize = 256;

/// A scene as a compressed file has it.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct EncodedScene {
    /// The number of Gaussians.
    pub count: usize,
    /// The degree of the spherical harmonics.
    pub sh_degree: u32,
    /// The bytes that the attributes are in.
    pub streams: Vec<Stream>,
    /// Positions: three components.
    pub position: Attribute,
    /// The logarithms of scales: three components.
    pub scale: Attribute,
    /// Rotations: four numbers, or the codes of three components and the index of the fourth.
    pub rotation: Attribute,
    /// Opacities: one component.
    pub opacity: Attribute,
    /// The constant coefficients of the spherical harmonics: three components.
    pub color: Attribute,
    /// True if a position x stands for sign(x) (exp(|x|) - 1).
    pub has_signed_log_positions: bool,
    /// True if opacities are logits.
    pub has_logit_opacities: bool,
    /// True if a colour c stands for the coefficient (c - 0.5) / [`SH_C0`].
    pub has_base_colors: bool,
    /// The numbers of all tables.
    pub numbers: Vec<f64>,
    /// The other coefficients of the spherical harmonics, if the degree is not 0.
    pub harmonics: Option<EncodedHarmonics>,
    /// The orthogonal matrix from the file's coordinates to a scene's.
    pub turn: DMat3,
    /// The metadata of the file.
    pub metadata: Metadata,
    /// The file, for messages.
    pub(crate) path: PathBuf,
}

/// Bytes of which each Gaussian, or each entry of a palette, has `stride`.
#[derive(Clone, Debug)]
pub struct Stream {
    /// The bytes.
    pub bytes: Vec<u8>,
    /// The bytes from one Gaussian to the next.
    pub stride: usize,
}

/// An attribute of Gaussians in a stream.
#[derive(Clone, Copy, Debug)]
pub struct Attribute {
    /// The index of the stream.
    pub stream: usize,
    /// The attribute's place in a Gaussian's bytes.
    pub offset: usize,
    /// The form of its components.
    pub form: Form,
    /// The meaning of its integers.
    pub decoding: Decoding,
}

/// The form of an attribute's components. Numbers are little-endian.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// A binary32 for each.
    Floats,
    /// An integer of 8 bits for each.
    Bytes,
    /// An integer of 16 bits for each.
    Shorts,
    /// A word of 32 bits with all of them, from its highest bits down: 11, 10 and 11 bits for positions and scales, 8, 8 and 8 for
    /// colours, and for rotations 2 of the index and 10, 10 and 10.
    Word,
}

/// The meaning of an attribute's integers. Tables are given by their first place in [`EncodedScene::numbers`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Decoding {
    /// They are numbers as they are; an integer of 8 bits is a fraction of 255.
    None,
    /// Fractions of the range between bounds, which some Gaussians after one another share: their chunk. A chunk's minima of all
    /// components come before the maxima.
    Chunks {
        /// The bounds of the first chunk.
        table: usize,
        /// The numbers from one chunk to the next.
        stride: usize,
        /// The Gaussians of a chunk.
        size: usize,
    },
    /// Indices of the 256 numbers of a table.
    Codebook {
        /// The first of them.
        table: usize,
    },
    /// Three components of a quaternion w, x, y, z from -1/sqrt(2) to 1/sqrt(2), and the index of the one that is left out. In
    /// [`Form::Bytes`] the index has 252 added; without, the quaternion is 1, 0, 0, 0.
    SmallestThree,
}

/// Coefficients of spherical harmonics from degree 1 on, as indices of a codebook.
#[derive(Clone, Debug)]
pub struct EncodedHarmonics {
    /// The indices of each Gaussian or, if there are labels, of each entry of a palette.
    pub codes: Stream,
    /// The bytes from one coefficient to the next.
    pub coefficient_stride: usize,
    /// The bytes from red to green, and from green to blue.
    pub component_stride: usize,
    /// The place of the codebook's first number in [`EncodedScene::numbers`].
    pub codebook: usize,
    /// The entry of each Gaussian, in the first 16 bits. All coefficients of one that there isn't are 0.
    pub labels: Option<Stream>,
}

impl EncodedScene {
    /// Decodes the scene.
    ///
    /// # Errors
    /// If there is not enough memory.
    pub fn decode(&self) -> Result<Scene, SceneError> {
        self.checked(self.sh_degree)
    }

    /// Decodes the scene without view-dependent colours: its spherical harmonics have degree 0.
    ///
    /// # Errors
    /// If there is not enough memory.
    pub fn outline(&self) -> Result<Scene, SceneError> {
        self.checked(0)
    }

    /// Decodes the scene with spherical harmonics of degree `degree`, and warns of what is not drawn.
    fn checked(&self, degree: u32) -> Result<Scene, SceneError> {
        let mut scene = self.decoded(degree).map_err(|fault| fault.of(&self.path))?;
        scene.warn_of_dropped();
        Ok(scene)
    }

    /// Decodes the scene with spherical harmonics of degree `degree`.
    pub(crate) fn decoded(&self, degree: u32) -> Result<Scene, Fault> {
        let position = if self.has_signed_log_positions { unsigned_log } else { rounded };
        let opacity = if self.has_logit_opacities { sigmoid } else { rounded };
        let color = if self.has_base_colors { coefficient } else { rounded };
        let position = self.components(&self.position, FIELDS_OF_11_10_11, position);
        let scale = self.components(&self.scale, FIELDS_OF_11_10_11, |log| libm::exp(log) as f32);
        let opacity = self.components(&self.opacity, FIELDS_OF_8, opacity);
        let color = self.components(&self.color, FIELDS_OF_8, color);
        let harmonics = self.harmonics.as_ref().filter(|_| degree > 0);
        let harmonics = harmonics.map(|harmonics| (harmonics, self.codebook(harmonics.codebook, rounded)));
        let motion = Motion::new(self.turn, DVec3::ZERO, degree);
        let mut scene = Scene::try_generate(degree, self.count, |index, sh| {
            let mut center = position.get(index);
            let [opacity] = opacity.get(index);
            let mut shape = GaussianShape { scale: scale.get(index), rotation: self.rotation(index), opacity };
            sh[0] = color.get(index);
            if let Some((harmonics, codebook)) = &harmonics {
                harmonics.fill(index, codebook, &mut sh[1..]);
            }
            motion.apply(DVec3::ZERO, &mut center, &mut shape, sh);
            (center, shape)
        })?;
        *scene.metadata_mut() = self.metadata.clone();
        Ok(scene)
    }

    /// The reader of an attribute, whose components are passed through `finish`.
    fn components(&self, attribute: &Attribute, fields: [Field; 3], finish: fn(f64) -> f32) -> Components<'_> {
        let values = match attribute.decoding {
            Decoding::None | Decoding::SmallestThree => Values::Fractions,
            Decoding::Chunks { table, stride, size } => {
                Values::Bounds { numbers: &self.numbers[table..], stride, size }
            }
            Decoding::Codebook { table } => Values::Codebook(Box::new(self.codebook(table, finish))),
        };
        let stream = &self.streams[attribute.stream];
        Components { stream, offset: attribute.offset, form: attribute.form, fields, values, finish }
    }

    /// The codebook at place `table` of the numbers, passed through `finish`.
    fn codebook(&self, table: usize, finish: fn(f64) -> f32) -> [f32; CODEBOOK] {
        std::array::from_fn(|code| finish(self.numbers[table + code]))
    }

    /// The quaternion w, x, y, z of a Gaussian.
    fn rotation(&self, index: usize) -> [f32; 4] {
        let Stream { bytes, stride } = &self.streams[self.rotation.stream];
        let bytes = &bytes[stride * index + self.rotation.offset..];
        match self.rotation.form {
            Form::Floats => std::array::from_fn(|component| float(&bytes[4 * component..])),
            Form::Bytes => match bytes[3].checked_sub(252) {
                Some(largest) => {
                    quaternion([bytes[0], bytes[1], bytes[2]].map(|code| fraction(code.into(), 8)), largest)
                }
                None => [1.0, 0.0, 0.0, 0.0],
            },
            Form::Shorts | Form::Word => {
                let word = word(bytes);
                let fields = [20, 10, 0].map(|shift| Field { shift, bits: 10 });
                quaternion(fields.map(|field| field.fraction(word)), (word >> 30) as u8)
            }
        }
    }
}

impl EncodedHarmonics {
    /// The entry of a Gaussian in the codes; None if there is no such entry.
    fn entry(&self, index: usize) -> Option<&[u8]> {
        let entry = self.labels.as_ref().map_or(index, |labels| {
            let bytes = &labels.bytes[labels.stride * index..];
            u16::from_le_bytes([bytes[0], bytes[1]]).into()
        });
        self.codes.bytes.chunks_exact(self.codes.stride).nth(entry)
    }

    /// Writes the coefficients of a Gaussian from degree 1 on. Those of an entry that there isn't keep their values.
    fn fill(&self, index: usize, codebook: &[f32; CODEBOOK], sh: &mut [[f32; 3]]) {
        let Some(codes) = self.entry(index) else {
            return;
        };
        for (k, rgb) in sh.iter_mut().enumerate() {
            let first = k * self.coefficient_stride;
            *rgb = std::array::from_fn(|c| codebook[usize::from(codes[first + c * self.component_stride])]);
        }
    }
}

/// Bits of a word.
#[derive(Clone, Copy)]
struct Field {
    shift: u32,
    bits: u32,
}

/// The components of positions and scales in a word.
const FIELDS_OF_11_10_11: [Field; 3] =
    [Field { shift: 21, bits: 11 }, Field { shift: 11, bits: 10 }, Field { shift: 0, bits: 11 }];

/// The components of a colour in a word.
const FIELDS_OF_8: [Field; 3] =
    [Field { shift: 24, bits: 8 }, Field { shift: 16, bits: 8 }, Field { shift: 8, bits: 8 }];

impl Field {
    /// The field of `word` as a fraction of its greatest value.
    fn fraction(self, word: u32) -> f64 {
        fraction((word >> self.shift) & ((1 << self.bits) - 1), self.bits)
    }
}

/// A code of `bits` bits as a fraction of the greatest one.
fn fraction(code: u32, bits: u32) -> f64 {
    f64::from(code) / f64::from((1 << bits) - 1)
}

/// Reads the components of an attribute.
struct Components<'a> {
    stream: &'a Stream,
    offset: usize,
    form: Form,
    /// The bits of the components in a word.
    fields: [Field; 3],
    values: Values<'a>,
    /// The last step of decoding, with the rounding to binary32.
    finish: fn(f64) -> f32,
}

/// The meaning of codes.
enum Values<'a> {
    /// Fractions.
    Fractions,
    /// Fractions of a range: the bounds of all chunks.
    Bounds { numbers: &'a [f64], stride: usize, size: usize },
    /// The finished numbers of a table.
    Codebook(Box<[f32; CODEBOOK]>),
}

impl Components<'_> {
    /// The `N` components of a Gaussian.
    #[inline]
    fn get<const N: usize>(&self, index: usize) -> [f32; N] {
        let bytes = &self.stream.bytes[self.stream.stride * index + self.offset..];
        if self.form == Form::Floats {
            return std::array::from_fn(|component| float(&bytes[4 * component..]));
        }
        if let Values::Codebook(numbers) = &self.values {
            return std::array::from_fn(|component| numbers[usize::from(bytes[component])]);
        }
        let fractions: [f64; N] = match self.form {
            Form::Floats | Form::Bytes => std::array::from_fn(|component| fraction(bytes[component].into(), 8)),
            Form::Shorts => std::array::from_fn(|component| {
                let code = u16::from_le_bytes([bytes[2 * component], bytes[2 * component + 1]]);
                fraction(code.into(), 16)
            }),
            Form::Word => {
                let word = word(bytes);
                std::array::from_fn(|component| self.fields[component].fraction(word))
            }
        };
        match self.values {
            Values::Bounds { numbers, stride, size } => {
                let bounds = &numbers[index / size * stride..][..2 * N];
                std::array::from_fn(|component| {
                    let t = fractions[component];
                    (self.finish)(bounds[component] * (1.0 - t) + bounds[N + component] * t)
                })
            }
            _ => fractions.map(|fraction| (self.finish)(fraction)),
        }
    }
}

/// The first four bytes as a word.
fn word(bytes: &[u8]) -> u32 {
    u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])
}

/// The first four bytes as a binary32.
fn float(bytes: &[u8]) -> f32 {
    f32::from_bits(word(bytes))
}

/// `value`, rounded.
fn rounded(value: f64) -> f32 {
    value as f32
}

/// The number whose signed logarithm, sign(x) ln(1 + |x|), is `value`.
fn unsigned_log(value: f64) -> f32 {
    (libm::exp(value.abs()) - 1.0).copysign(value) as f32
}

/// The constant coefficient of a colour.
fn coefficient(color: f64) -> f32 {
    ((color - 0.5) / SH_C0) as f32
}

/// The unit quaternion with component `largest` left out. The others, in order, are `fractions` of the range from -1/sqrt(2) to
/// 1/sqrt(2).
fn quaternion(fractions: [f64; 3], largest: u8) -> [f32; 4] {
    let small = fractions.map(|fraction| (2.0 * fraction - 1.0) * FRAC_1_SQRT_2);
    let squares = small[0] * small[0] + small[1] * small[1] + small[2] * small[2];
    let left_out = (1.0 - squares).max(0.0).sqrt();
    let mut small = small.into_iter();
    std::array::from_fn(|component| {
        let value = if component == usize::from(largest) { Some(left_out) } else { small.next() };
        value.unwrap_or_default() as f32
    })
}

/// The bytes of a Gaussian's coefficients from degree 1 on, one for each component.
pub(crate) fn harmonics_bytes(degree: u32) -> usize {
    3 * (sh_coefficients(degree) - 1)
}
