//! Niantic's SPZ, versions 1 to 4: a header and one array per attribute.
//!
//! Versions 1 to 3 are one gzip stream. Version 4 has a plain header, extension records, a table of sizes, and a zstd
//! stream for each array. Positions are 24-bit fixed point (version 1: half floats), scales logarithms in sixteenths,
//! quaternions their first (versions 1 and 2) or smallest three components, opacities bytes, colours bytes over a range
//! wider than 0 to 1, other coefficients bytes over -1 to 1.
//!
//! The axes are right, up, back, unless an extension names others. But many writers store a PLY's axes as they are, without
//! saying so. Therefore the end where the scene's ground is decides, if there is no doubt about it.

use std::f32::consts::FRAC_1_SQRT_2;
use std::path::PathBuf;

use half::f16;
use ruzstd::decoding::StreamingDecoder;

use super::ground::{End, ground};
use super::input::{Format, Input, Loaded, read_growing};
use crate::axes::{Axes, AxesReason, FileAxes};
use crate::encoded::{Attribute, CODEBOOK, Decoding, EncodedHarmonics, EncodedScene, Form, Stream};
use crate::error::{Fault, Place, Reason};
use crate::harmonics::{MAX_SH_DEGREE, sh_coefficients};
use crate::metadata::{Antialiasing, Metadata};

/// The format.
pub(super) struct Spz;

const MAGIC: &[u8; 4] = b"NGSP";

/// Bytes of the header that all versions have.
const HEADER: usize = 16;

/// Bytes of the header of version 4.
const PLAIN_HEADER: usize = 32;

/// Bytes of an entry of version 4's table: the compressed size and the size of a stream.
const ENTRY: usize = 16;

/// The axes of files that name none.
const DEFAULT_AXES: Axes = Axes::RIGHT_UP_BACK;

const READ_VERSIONS: &str = "1 to 4";

/// The range of colour bytes is 1 / 0.15 wide, in units of the constant coefficient.
const COLOUR_SCALE: f32 = 0.15;

/// The highest compression ratio of version 4's positions that the format's library accepts.
const MAX_RATIO: u64 = 1024;

/// The most bytes of extension records that are read.
const MAX_EXTENSIONS: u64 = 1 << 20;

/// The header flag of Gaussians trained with compensated antialiasing.
const FLAG_ANTIALIASED: u8 = 1;

/// The header flag of extension records.
const FLAG_EXTENSIONS: u8 = 2;

/// Adobe's extension of the frame that a file is in.
const COORDINATE_SYSTEM: u32 = 0xadbe_0003;

/// Adobe's extension of a camera's range.
const SAFE_ORBIT_CAMERA: u32 = 0xadbe_0002;

impl Format for Spz {
    fn name(&self) -> &'static str {
        "SPZ"
    }

    fn extensions(&self) -> &'static [&'static str] {
        &["spz"]
    }

    fn magic(&self) -> Option<&'static [u8]> {
        Some(MAGIC)
    }

    fn has_axes_of_cameras(&self) -> bool {
        false
    }

    fn load(&self, input: &mut Input<'_>) -> Result<Loaded, Fault> {
        let given = input.origin().options.axes;
        let mut scene = load_into(input, given, Axes::RIGHT_DOWN_FRONT)?;
        if scene.metadata.axes.is_some_and(|axes| axes.reason == AxesReason::Format)
            && let Some(end) = ground(&scene.decoded(0)?)
        {
            let axes = match end {
                End::Down => DEFAULT_AXES,
                End::Up => Axes::RIGHT_DOWN_FRONT,
            };
            scene.turn = axes.matrix();
            scene.metadata.axes = Some(FileAxes { axes, reason: AxesReason::Ground, of_cameras: false });
        }
        Ok(scene.into())
    }
}

/// Reads a scene into the axes `into`, from the axes that are `given`, or that the file names, or that are the format's.
pub(super) fn load_into(input: &mut Input<'_>, given: Option<Axes>, into: Axes) -> Result<EncodedScene, Fault> {
    let conversion = Conversion { given, into };
    input.unpacked(
        |input| if input.is_compressed() { load_gzip(input, conversion) } else { load_plain(input, conversion) },
    )
}

/// The axes from which and into which a file is read.
#[derive(Clone, Copy)]
struct Conversion {
    given: Option<Axes>,
    into: Axes,
}

/// Reads versions 1 to 3.
fn load_gzip(input: &mut Input<'_>, conversion: Conversion) -> Result<EncodedScene, Fault> {
    let mut header = [0; HEADER];
    input.fill(&mut header)?;
    let header = Header::parse(&header)?;
    if header.version > 3 {
        return Err(version(header.version));
    }
    let (claimed, available) = (header.sizes().iter().sum(), input.remaining());
    if claimed > available {
        return Err(Reason::TooShort { claimed, available }.at(Place::Header("numPoints")));
    }
    let mut arrays = [const { Vec::new() }; 6];
    for (array, size) in arrays.iter_mut().zip(header.sizes()) {
        *array = input.bytes(size)?;
    }
    let end = HEADER as u64 + claimed;
    let allowed = if header.flags & FLAG_EXTENSIONS != 0 { MAX_EXTENSIONS } else { 0 };
    let records = input.up_to(allowed + 1)?;
    if records.len() as u64 > allowed {
        return Err(Reason::Trailing.at(Place::Byte(end)));
    }
    header.encoded(arrays, &Extensions::parse(&records), conversion)
}

/// Reads version 4. Other versions are an error.
fn load_plain(input: &mut Input<'_>, conversion: Conversion) -> Result<EncodedScene, Fault> {
    let size = input.size();
    let start = input.up_to(PLAIN_HEADER as u64)?;
    if !start.starts_with(MAGIC) {
        let expected = "an SPZ file";
        return Err(Reason::Magic { expected }.at(Place::Byte(0)));
    }
    let Some(header) = start.first_chunk::<HEADER>() else {
        return Err(Reason::Truncated.at(Place::Byte(start.len() as u64)));
    };
    let parsed = Header::parse(header)?;
    if parsed.version < 4 {
        let text = format!("version {} is not compressed with gzip", parsed.version);
        return Err(Reason::Unsupported(text).at(Place::Header("version")));
    }
    if start.len() < PLAIN_HEADER {
        return Err(Reason::Truncated.at(Place::Byte(start.len() as u64)));
    }
    let sizes = parsed.sizes();
    let (claimed, available) = (sizes[0], size.saturating_mul(MAX_RATIO));
    if claimed > available {
        return Err(Reason::TooShort { claimed, available }.at(Place::Header("numPoints")));
    }
    let streams = if parsed.sh_degree == 0 { 5 } else { 6 };
    if usize::from(start[15]) != streams {
        let (found, expected) = (start[15].into(), streams as u64);
        return Err(Reason::Count { found, expected }.at(Place::Header("numStreams")));
    }
    let table = u32::from_le_bytes([start[16], start[17], start[18], start[19]]);
    let Some(records) = u64::from(table).checked_sub(PLAIN_HEADER as u64) else {
        let (found, range) = (table, "32 and more");
        return Err(Reason::Range { found, range }.at(Place::Header("tocByteOffset")));
    };
    let records = input.bytes(records)?;
    let extensions =
        if parsed.flags & FLAG_EXTENSIONS != 0 { Extensions::parse(&records) } else { Extensions::default() };
    let entries = input.bytes((streams * ENTRY) as u64)?;
    let mut arrays = [const { Vec::new() }; 6];
    for (index, entry) in entries.chunks_exact(ENTRY).enumerate() {
        let word = |at: usize| u64::from_le_bytes(std::array::from_fn(|i| entry[at + i]));
        let (compressed, found, expected) = (word(0), word(8), sizes[index]);
        let place = Place::Part(format!("stream {index}"));
        if found != expected {
            return Err(Reason::Count { found, expected }.at(place));
        }
        let available = input.remaining();
        if compressed > available {
            let claimed = compressed;
            return Err(Reason::TooShort { claimed, available }.at(place));
        }
        arrays[index] = zstd(&input.bytes(compressed)?, expected).map_err(|r| r.at(place))?;
    }
    if input.remaining() > 0 {
        return Err(Reason::Trailing.at(Place::File));
    }
    parsed.encoded(arrays, &extensions, conversion)
}

/// The contents of the zstd stream `compressed`, which must be `len` bytes.
fn zstd(compressed: &[u8], len: u64) -> Result<Vec<u8>, Reason> {
    let decoder = StreamingDecoder::new(compressed).map_err(|e| Reason::Zstd(one_line(&e)))?;
    let bytes = read_growing(decoder, len + 1, 0).map_err(|e| match e.kind() {
        std::io::ErrorKind::OutOfMemory => Reason::Memory(len),
        _ => Reason::Zstd(one_line(&e)),
    })?;
    let (found, expected) = (bytes.len() as u64, len);
    if found != expected {
        return Err(Reason::Count { found, expected });
    }
    Ok(bytes)
}

/// Another library's message, on one line.
pub(super) fn one_line(error: &dyn std::fmt::Display) -> String {
    error.to_string().lines().next().unwrap_or_default().to_owned()
}

fn version(found: u32) -> Fault {
    let read = READ_VERSIONS;
    Reason::Version { found, read }.at(Place::Header("version"))
}

/// The contents of the extension records.
#[derive(Default)]
struct Extensions {
    axes: Option<Axes>,
    notes: Metadata,
}

impl Extensions {
    /// Parses records of type, size in bytes, and content. Bytes that are not a whole record are ignored, as by the
    /// format's library.
    fn parse(mut records: &[u8]) -> Self {
        let mut extensions = Self::default();
        while let Some((head, rest)) = records.split_first_chunk::<8>() {
            let [kind, size] = [0, 4].map(|at| u32::from_le_bytes(std::array::from_fn(|i| head[at + i])));
            let Some((content, rest)) = rest.split_at_checked(size as usize) else {
                break;
            };
            records = rest;
            let word = content.first_chunk::<4>().map(|word| u32::from_le_bytes(*word));
            match (kind, word) {
                (COORDINATE_SYSTEM, number) => {
                    extensions.axes = number.and_then(Axes::of_spz);
                    if extensions.axes.is_none() {
                        extensions.notes.note("SPZ_ADOBE_coordinate_system names no axes");
                    }
                }
                (SAFE_ORBIT_CAMERA, _) => extensions.notes.note("the extension SPZ_ADOBE_safe_orbit_camera is ignored"),
                (kind, _) => extensions.notes.note(format!("the extension {kind:#010x} is unknown and ignored")),
            }
        }
        if !records.is_empty() {
            extensions.notes.note("bytes that are no extension record are ignored");
        }
        extensions
    }
}

/// The header's fields, checked.
struct Header {
    version: u32,
    count: u32,
    sh_degree: u32,
    fractional_bits: u32,
    flags: u8,
}

impl Header {
    fn parse(bytes: &[u8; HEADER]) -> Result<Self, Fault> {
        let word = |offset: usize| u32::from_le_bytes(std::array::from_fn(|i| bytes[offset + i]));
        if bytes[..4] != *MAGIC {
            let expected = "an SPZ file";
            return Err(Reason::Magic { expected }.at(Place::Byte(0)));
        }
        if !(1..=4).contains(&word(4)) {
            return Err(version(word(4)));
        }
        let header = Self {
            version: word(4),
            count: word(8),
            sh_degree: bytes[12].into(),
            fractional_bits: bytes[13].into(),
            flags: bytes[14],
        };
        if header.count == 0 {
            return Err(Reason::Empty.at(Place::Header("numPoints")));
        }
        if header.sh_degree > MAX_SH_DEGREE {
            return Err(Reason::ShDegree(header.sh_degree).at(Place::Header("shDegree")));
        }
        if header.fractional_bits > 31 {
            let (found, range) = (header.fractional_bits, "0 to 31");
            return Err(Reason::Range { found, range }.at(Place::Header("fractionalBits")));
        }
        Ok(header)
    }

    fn antialiasing(&self) -> Antialiasing {
        if self.flags & FLAG_ANTIALIASED != 0 { Antialiasing::Compensated } else { Antialiasing::Off }
    }

    /// Bytes of one Gaussian in each of the arrays of positions, opacities, colours, scales, rotations and other
    /// coefficients.
    fn strides(&self) -> [usize; 6] {
        let position = if self.version == 1 { 6 } else { 9 };
        let rotation = if self.version < 3 { 3 } else { 4 };
        let rest = 3 * (sh_coefficients(self.sh_degree) - 1);
        [position, 1, 3, 3, rotation, rest]
    }

    /// The sizes of the arrays in bytes.
    fn sizes(&self) -> [u64; 6] {
        self.strides().map(|stride| stride as u64 * u64::from(self.count))
    }

    /// The scene of `arrays`, which have [`Header::sizes`]. Positions and rotations become binary32.
    fn encoded(
        &self,
        [positions, opacities, colors, scales, rotations, codes]: [Vec<u8>; 6],
        extensions: &Extensions,
        conversion: Conversion,
    ) -> Result<EncodedScene, Fault> {
        let named = |axes: Option<Axes>, reason| axes.map(|axes| FileAxes { axes, reason, of_cameras: false });
        let from = named(conversion.given, AxesReason::Given)
            .or(named(extensions.axes, AxesReason::File))
            .unwrap_or(FileAxes { axes: DEFAULT_AXES, reason: AxesReason::Format, of_cameras: false });
        let [position_stride, .., rotation_stride, code_stride] = self.strides();
        let positions = floats(positions.chunks_exact(position_stride).map(|bytes| self.position(bytes)))?;
        let rotations = floats(rotations.chunks_exact(rotation_stride).map(rotation))?;
        let attribute = |stream: usize, form: Form, decoding: Decoding| Attribute { stream, offset: 0, form, decoding };
        let codebook = |index: usize| Decoding::Codebook { table: CODEBOOK * index };
        let scale = |byte: u8| f64::from(byte) / 16.0 - 10.0;
        let color = |byte: u8| f64::from((f32::from(byte) / 255.0 - 0.5) / COLOUR_SCALE);
        let coefficient = |byte: u8| f64::from((f32::from(byte) - 128.0) / 128.0);
        let bytes = || 0..=u8::MAX;
        Ok(EncodedScene {
            count: self.count as usize,
            sh_degree: self.sh_degree,
            position: attribute(0, Form::Floats, Decoding::None),
            rotation: attribute(1, Form::Floats, Decoding::None),
            scale: attribute(2, Form::Bytes, codebook(0)),
            color: attribute(3, Form::Bytes, codebook(1)),
            opacity: attribute(4, Form::Bytes, Decoding::None),
            streams: vec![
                positions,
                rotations,
                Stream { bytes: scales, stride: 3 },
                Stream { bytes: colors, stride: 3 },
                Stream { bytes: opacities, stride: 1 },
            ],
            has_signed_log_positions: false,
            has_logit_opacities: false,
            has_base_colors: false,
            numbers: bytes().map(scale).chain(bytes().map(color)).chain(bytes().map(coefficient)).collect(),
            harmonics: (self.sh_degree > 0).then_some(EncodedHarmonics {
                codes: Stream { bytes: codes, stride: code_stride },
                coefficient_stride: 3,
                component_stride: 1,
                codebook: CODEBOOK * 2,
                labels: None,
            }),
            turn: conversion.into.matrix().transpose() * from.axes.matrix(),
            metadata: Metadata {
                antialiasing: Some(self.antialiasing()),
                axes: Some(from),
                notes: extensions.notes.notes.clone(),
                ..Metadata::default()
            },
            path: PathBuf::new(),
        })
    }

    fn position(&self, bytes: &[u8]) -> [f32; 3] {
        if self.version == 1 {
            return std::array::from_fn(|axis| f16::from_le_bytes([bytes[2 * axis], bytes[2 * axis + 1]]).to_f32());
        }
        let unit = 1.0 / (1_u64 << self.fractional_bits) as f32;
        std::array::from_fn(|axis| {
            let b = &bytes[3 * axis..][..3];
            // The shift back extends the sign; 24 bits are exact in binary32.
            (i32::from_le_bytes([0, b[0], b[1], b[2]]) >> 8) as f32 * unit
        })
    }
}

/// A stream of numbers as binary32.
fn floats<const N: usize>(values: impl ExactSizeIterator<Item = [f32; N]>) -> Result<Stream, Fault> {
    let stride = 4 * N;
    let mut bytes = Vec::new();
    let size = values.len().saturating_mul(stride);
    bytes.try_reserve_exact(size).map_err(|_| Reason::Memory(size as u64).at(Place::File))?;
    bytes.extend(values.flatten().flat_map(f32::to_le_bytes));
    Ok(Stream { bytes, stride })
}

/// Decodes a quaternion w, x, y, z.
fn rotation(bytes: &[u8]) -> [f32; 4] {
    let [x, y, z, w] = match *bytes {
        [a, b, c, d] => smallest_three(u32::from_le_bytes([a, b, c, d])),
        _ => first_three(bytes),
    };
    [w, x, y, z]
}

/// The component that makes the sum of squares one.
fn complement(components: &[f32]) -> f32 {
    let squares: f32 = components.iter().map(|c| c * c).sum();
    (1.0 - squares).max(0.0).sqrt()
}

/// Decodes a quaternion x, y, z, w from bytes of x, y and z; w is not negative.
fn first_three(bytes: &[u8]) -> [f32; 4] {
    let xyz: [f32; 3] = std::array::from_fn(|i| f32::from(bytes[i]) / 127.5 - 1.0);
    [xyz[0], xyz[1], xyz[2], complement(&xyz)]
}

/// Decodes a quaternion x, y, z, w from the index of the largest component (two bits) and the others (a sign and nine
/// bits each, the first highest).
fn smallest_three(word: u32) -> [f32; 4] {
    let which = (word >> 30) as usize;
    let small = [20, 10, 0].map(|shift| {
        let magnitude = ((word >> shift) & 0x1ff) as f32 * FRAC_1_SQRT_2 / 511.0;
        if (word >> shift) & 0x200 == 0 { magnitude } else { -magnitude }
    });
    let largest = complement(&small);
    let mut small = small.into_iter();
    std::array::from_fn(|i| if i == which { largest } else { small.next().unwrap_or_default() })
}
