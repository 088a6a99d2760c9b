//! Niantic's SPZ, versions 1 to 3: a gzip stream of a 16-byte header and one array per attribute.
//!
//! Positions are 24-bit fixed point (version 1: half floats), scales logarithms in sixteenths,
//! quaternions their first (versions 1 and 2) or smallest three components, opacities bytes,
//! colours bytes over a range wider than 0 to 1, other coefficients bytes over -1 to 1. The
//! frame is right-up-back; it is turned half around x, into that of PLY files, as the format's
//! own library does when asked for it.

use std::f32::consts::FRAC_1_SQRT_2;
use std::io::{ErrorKind, Read};

use flate2::bufread::GzDecoder;
use half::f16;

use super::input::{Format, Input};
use crate::error::{Fault, Place, Reason};
use crate::metadata::Antialiasing;
use crate::scene::{GaussianShape, MAX_SH_DEGREE, Scene, sh_coefficients};

/// The format.
pub(super) struct Spz;

const MAGIC: &[u8; 4] = b"NGSP";
const HEADER: usize = 16;
const READ_VERSIONS: &str = "1 to 3";

/// The range of colour bytes is 1 / 0.15 wide, in units of the constant coefficient.
const COLOUR_SCALE: f32 = 0.15;

/// Deflate's highest ratio of expansion; no honest header claims more.
const MAX_EXPANSION: u64 = 1032;

/// Bytes of extension records that are passed over, at most.
const MAX_EXTENSIONS: u64 = 1 << 20;

/// Set in the header's flags if the Gaussians were trained with a filter that opacity pays for.
const FLAG_ANTIALIASED: u8 = 1;

/// Set in the header's flags if extension records follow the arrays.
const FLAG_EXTENSIONS: u8 = 2;

impl Format for Spz {
    fn name(&self) -> &'static str {
        "SPZ"
    }

    fn extensions(&self) -> &'static [&'static str] {
        &["spz"]
    }

    fn magic(&self) -> Option<&'static [u8]> {
        Some(&[0x1f, 0x8b])
    }

    fn load(&self, input: &mut Input<'_>) -> Result<Scene, Fault> {
        let compressed = input.size();
        let mut start = [0; 2];
        input.fill(&mut start)?;
        if start != [0x1f, 0x8b] {
            return Err(refuse_uncompressed(input, start));
        }
        let mut gzip = GzDecoder::new((&start[..]).chain(&mut *input));
        let mut header = [0; HEADER];
        fill(&mut gzip, &mut header, 0)?;
        let header = Header::parse(&header)?;
        let payload = header.payload();
        let available = compressed.saturating_mul(MAX_EXPANSION);
        if payload > available {
            let claimed = payload;
            return Err(Reason::TooShort { claimed, available }.at(Place::Header("numPoints")));
        }
        // Grows with what is really there, never ahead of it.
        let mut data = Vec::new();
        (&mut gzip)
            .take(payload)
            .read_to_end(&mut data)
            .map_err(|error| gzip_fault(error, HEADER as u64 + data.len() as u64))?;
        if (data.len() as u64) < payload {
            return Err(Reason::Truncated.at(Place::Byte(HEADER as u64 + data.len() as u64)));
        }
        finish(gzip, &header, payload)?;
        if input.remaining() > 0 {
            return Err(Reason::Trailing.at(Place::File));
        }
        Ok(header.unpack(&data))
    }
}

/// Why a file that is not compressed is refused: version 4 is known, but not read.
fn refuse_uncompressed(input: &mut Input<'_>, start: [u8; 2]) -> Fault {
    let mut rest = [0; 6];
    let expected = "an SPZ file";
    let not_spz = Reason::Magic { expected }.at(Place::Byte(0));
    if input.fill(&mut rest).is_err() || [&start[..], &rest[..2]].concat() != MAGIC {
        return not_spz;
    }
    match u32::from_le_bytes([rest[2], rest[3], rest[4], rest[5]]) {
        // These are never stored without compression.
        ..=3 => not_spz,
        found => version(found),
    }
}

fn version(found: u32) -> Fault {
    let read = READ_VERSIONS;
    Reason::Version { found, read }.at(Place::Header("version"))
}

/// Reads to the end of the stream, which checks its sum.
fn finish(gzip: impl Read, header: &Header, payload: u64) -> Result<(), Fault> {
    let extended = header.flags & FLAG_EXTENSIONS != 0;
    let allowed = if extended { MAX_EXTENSIONS } else { 0 };
    let end = HEADER as u64 + payload;
    let mut rest = Vec::new();
    gzip.take(allowed + 1)
        .read_to_end(&mut rest)
        .map_err(|error| gzip_fault(error, end))?;
    if rest.len() as u64 > allowed {
        return Err(Reason::Trailing.at(Place::Byte(end)));
    }
    Ok(())
}

fn fill(gzip: &mut impl Read, buffer: &mut [u8], position: u64) -> Result<(), Fault> {
    gzip.read_exact(buffer)
        .map_err(|error| gzip_fault(error, position))
}

fn gzip_fault(error: std::io::Error, position: u64) -> Fault {
    match error.kind() {
        ErrorKind::UnexpectedEof => Reason::Truncated.at(Place::Byte(position)),
        ErrorKind::InvalidInput | ErrorKind::InvalidData => {
            Reason::Gzip(error).at(Place::Byte(position))
        }
        _ => Reason::Io(error).at(Place::Byte(position)),
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
        if !(1..=3).contains(&word(4)) {
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
        if self.flags & FLAG_ANTIALIASED != 0 {
            Antialiasing::Compensated
        } else {
            Antialiasing::Off
        }
    }

    fn position_bytes(&self) -> usize {
        if self.version == 1 { 6 } else { 9 }
    }

    fn rotation_bytes(&self) -> usize {
        if self.version < 3 { 3 } else { 4 }
    }

    /// Bytes of one Gaussian's other coefficients.
    fn rest_bytes(&self) -> usize {
        3 * (sh_coefficients(self.sh_degree) - 1)
    }

    /// Bytes of all arrays.
    fn payload(&self) -> u64 {
        let each = self.position_bytes() + 1 + 3 + 3 + self.rotation_bytes() + self.rest_bytes();
        each as u64 * u64::from(self.count)
    }

    /// The scene whose arrays are `data`, of [`Header::payload`] bytes.
    fn unpack(&self, data: &[u8]) -> Scene {
        let count = self.count as usize;
        let mut scene = Scene::with_capacity(self.sh_degree, count);
        scene.metadata_mut().antialiasing = Some(self.antialiasing());
        let mut data = data;
        let mut array = |size: usize| {
            let (array, rest) = data.split_at(size * count);
            data = rest;
            move |index: usize| &array[size * index..][..size]
        };
        let positions = array(self.position_bytes());
        let opacities = array(1);
        let colours = array(3);
        let scales = array(3);
        let rotations = array(self.rotation_bytes());
        let rests = array(self.rest_bytes());
        let mut sh = vec![[0.0; 3]; scene.sh_stride()];
        for i in 0..count {
            let shape = GaussianShape {
                scale: std::array::from_fn(|axis| scale(scales(i)[axis])),
                rotation: rotation(rotations(i)),
                opacity: f32::from(opacities(i)[0]) / 255.0,
            };
            sh[0] =
                std::array::from_fn(|c| (f32::from(colours(i)[c]) / 255.0 - 0.5) / COLOUR_SCALE);
            for (k, rgb) in rests(i).chunks_exact(3).enumerate() {
                let sign = turn_sh(k + 1);
                sh[k + 1] = std::array::from_fn(|c| sign * (f32::from(rgb[c]) - 128.0) / 128.0);
            }
            scene.push(turn(self.position(positions(i))), shape, &sh);
        }
        scene
    }

    fn position(&self, bytes: &[u8]) -> [f32; 3] {
        if self.version == 1 {
            return std::array::from_fn(|axis| {
                f16::from_le_bytes([bytes[2 * axis], bytes[2 * axis + 1]]).to_f32()
            });
        }
        let unit = 1.0 / (1_u64 << self.fractional_bits) as f32;
        std::array::from_fn(|axis| {
            let b = &bytes[3 * axis..][..3];
            // The shift back extends the sign; 24 bits are exact in binary32.
            (i32::from_le_bytes([0, b[0], b[1], b[2]]) >> 8) as f32 * unit
        })
    }
}

fn scale(byte: u8) -> f32 {
    (f64::from(byte) / 16.0 - 10.0).exp() as f32
}

/// The quaternion w, x, y, z, turned into the scene's frame.
fn rotation(bytes: &[u8]) -> [f32; 4] {
    let [x, y, z, w] = match *bytes {
        [a, b, c, d] => smallest_three(u32::from_le_bytes([a, b, c, d])),
        _ => first_three(bytes),
    };
    let [x, y, z] = turn([x, y, z]);
    [w, x, y, z]
}

/// The component that makes the sum of squares one.
fn complement(components: &[f32]) -> f32 {
    let squares: f32 = components.iter().map(|c| c * c).sum();
    (1.0 - squares).max(0.0).sqrt()
}

/// Quaternion x, y, z, w from bytes of x, y and z; w is not negative.
fn first_three(bytes: &[u8]) -> [f32; 4] {
    let xyz: [f32; 3] = std::array::from_fn(|i| f32::from(bytes[i]) / 127.5 - 1.0);
    [xyz[0], xyz[1], xyz[2], complement(&xyz)]
}

/// Quaternion x, y, z, w from the index of the largest component (two bits) and the others (a
/// sign and nine bits each, the first highest).
fn smallest_three(word: u32) -> [f32; 4] {
    let which = (word >> 30) as usize;
    let small = [20, 10, 0].map(|shift| {
        let magnitude = ((word >> shift) & 0x1ff) as f32 * FRAC_1_SQRT_2 / 511.0;
        if (word >> shift) & 0x200 == 0 {
            magnitude
        } else {
            -magnitude
        }
    });
    let largest = complement(&small);
    let mut small = small.into_iter();
    std::array::from_fn(|i| {
        if i == which {
            largest
        } else {
            small.next().unwrap_or_default()
        }
    })
}

/// Turns a vector, or a quaternion's vector part, half around x.
fn turn([x, y, z]: [f32; 3]) -> [f32; 3] {
    [x, -y, -z]
}

/// The sign that coefficient `k` takes when the scene is turned half around x: negating z flips
/// basis functions of odd l - |m|, negating y those of negative m.
fn turn_sh(k: usize) -> f32 {
    let l = k.isqrt() as i32;
    let m = k as i32 - l * l - l;
    let flips = (l - m.abs()) + i32::from(m < 0);
    if flips % 2 == 0 { 1.0 } else { -1.0 }
}
