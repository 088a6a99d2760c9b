//! The `.ksplat` format of mkkellogg's viewer, versions 0.1 and later, compression levels 0 to 2.
//!
//! A header of 4096 bytes and one of 1024 for each section are followed by the sections: sizes of partly filled
//! buckets, the buckets' centres, and records. A record is position, scale (linear), quaternion w, x, y, z, colour and
//! opacity (4 bytes) and the other coefficients, degree by degree, channel by channel. Level 0 has floats. Levels 1 and
//! 2 have half floats, but positions are 16-bit steps from a bucket's centre; at level 2 coefficients are bytes. The
//! frame is that of PLY files.

use half::f16;

use super::input::{Format, Input, Loaded};
use crate::error::{Fault, Place, Reason};
use crate::harmonics::{SH_C0, sh_coefficients};
use crate::scene::Scene;
use crate::shape::GaussianShape;

/// The format.
pub(super) struct KSplat;

const HEADER: usize = 4096;
const SECTION_HEADER: usize = 1024;

/// The range of byte coefficients if the header has none.
const COEFFICIENT_RANGE: f32 = 1.5;

impl Format for KSplat {
    fn name(&self) -> &'static str {
        "ksplat"
    }

    fn extensions(&self) -> &'static [&'static str] {
        &["ksplat"]
    }

    fn load(&self, input: &mut Input<'_>) -> Result<Loaded, Fault> {
        let bytes = input.rest()?;
        let file = File::parse(&bytes)?;
        let degree = file.sections.iter().map(|s| s.degree).max().unwrap_or(0);
        let count = file.sections.iter().map(|s| s.count).sum();
        if count == 0 {
            return Err(Reason::Empty.at(Place::Header("splatCount")));
        }
        let mut scene = Scene::try_with_capacity(degree, count)?;
        let mut sh = vec![[0.0; 3]; scene.sh_stride()];
        for section in &file.sections {
            for index in 0..section.count {
                sh.fill([0.0; 3]);
                let (position, shape) = file.read(section, index, &mut sh);
                scene.push(position, shape, &sh);
            }
        }
        Ok(scene.into())
    }
}

/// A file with its headers parsed and its sizes checked.
struct File<'a> {
    level: u16,
    /// The values of byte coefficients 0 and 255.
    range: [f32; 2],
    sections: Vec<Section<'a>>,
}

/// A section whose records are complete.
struct Section<'a> {
    count: usize,
    degree: u32,
    /// Bytes of a record.
    stride: usize,
    records: &'a [u8],
    /// Centres of the buckets, three floats each, `bucket_stride` bytes apart.
    buckets: &'a [u8],
    bucket_stride: usize,
    /// The first record of each bucket.
    bucket_starts: Vec<usize>,
    /// The length of a position step; below, the step that means zero.
    step: f32,
    middle: f32,
}

fn u16_at(bytes: &[u8], offset: usize) -> u16 {
    u16::from_le_bytes([bytes[offset], bytes[offset + 1]])
}

fn u32_at(bytes: &[u8], offset: usize) -> u32 {
    u32::from_le_bytes(std::array::from_fn(|i| bytes[offset + i]))
}

fn f32_at(bytes: &[u8], offset: usize) -> f32 {
    f32::from_bits(u32_at(bytes, offset))
}

impl<'a> File<'a> {
    fn parse(bytes: &'a [u8]) -> Result<Self, Fault> {
        let too_short = |claimed: u64| {
            let available = bytes.len() as u64;
            Reason::TooShort { claimed, available }.at(Place::File)
        };
        if bytes.len() < HEADER {
            return Err(too_short(HEADER as u64));
        }
        if bytes[0] != 0 || bytes[1] == 0 {
            let text = format!("version {}.{} is not one of those read (0.1 and later)", bytes[0], bytes[1]);
            return Err(Reason::Unsupported(text).at(Place::Header("version")));
        }
        let level = u16_at(bytes, 20);
        if level > 2 {
            let (found, range) = (level.into(), "0 to 2");
            return Err(Reason::Range { found, range }.at(Place::Header("compressionLevel")));
        }
        let bound = |offset: usize, default: f32| match f32_at(bytes, offset) {
            0.0 => default,
            value => value,
        };
        let count = u64::from(u32_at(bytes, 4));
        let mut at = HEADER as u64 + count * SECTION_HEADER as u64;
        if at > bytes.len() as u64 {
            return Err(too_short(at));
        }
        let mut sections = Vec::new();
        for index in 0..count as usize {
            let header = &bytes[HEADER + index * SECTION_HEADER..][..SECTION_HEADER];
            let (section, end) = Section::parse(header, bytes, at, level)?;
            at = end;
            sections.push(section);
        }
        let found = sections.iter().map(|section| section.count as u64).sum();
        let expected = u64::from(u32_at(bytes, 16));
        if found != expected {
            return Err(Reason::Count { found, expected }.at(Place::Header("splatCount")));
        }
        Ok(Self { level, range: [bound(36, -COEFFICIENT_RANGE), bound(40, COEFFICIENT_RANGE)], sections })
    }

    /// Reads record `index` of `section`. Returns position and shape, and writes the coefficients to `sh`.
    fn read(&self, section: &Section<'_>, index: usize, sh: &mut [[f32; 3]]) -> ([f32; 3], GaussianShape) {
        let record = &section.records[index * section.stride..][..section.stride];
        let number = |at: usize| match self.level {
            0 => f32_at(record, 4 * at),
            _ => f16::from_bits(u16_at(record, 2 * at)).to_f32(),
        };
        let position = if self.level == 0 {
            std::array::from_fn(number)
        } else {
            // The last bucket that begins at this record or before it.
            let bucket = section.bucket_starts.partition_point(|start| *start <= index) - 1;
            let centre = &section.buckets[bucket * section.bucket_stride..];
            std::array::from_fn(|axis| {
                let steps = f32::from(u16_at(record, 2 * axis)) - section.middle;
                steps * section.step + f32_at(centre, 4 * axis)
            })
        };
        let colour = if self.level == 0 { 40 } else { 20 };
        let shape = GaussianShape {
            scale: std::array::from_fn(|axis| number(3 + axis)),
            rotation: std::array::from_fn(|i| number(6 + i)),
            opacity: f32::from(record[colour + 3]) / 255.0,
        };
        sh[0] = std::array::from_fn(|c| ((f64::from(record[colour + c]) / 255.0 - 0.5) / SH_C0) as f32);
        let rest = &record[colour + 4..];
        let coefficient = |at: usize| match self.level {
            0 => f32_at(rest, 4 * at),
            1 => f16::from_bits(u16_at(rest, 2 * at)).to_f32(),
            _ => self.range[0] + f32::from(rest[at]) / 255.0 * (self.range[1] - self.range[0]),
        };
        for l in 1..=section.degree as usize {
            let size = 2 * l + 1;
            let first = 3 * (l * l - 1);
            for m in 0..size {
                sh[l * l + m] = std::array::from_fn(|c| coefficient(first + c * size + m));
            }
        }
        (position, shape)
    }
}

impl<'a> Section<'a> {
    /// Parses the section of `header` that begins at byte `start` of `bytes`. Returns also its end.
    fn parse(header: &[u8], bytes: &'a [u8], start: u64, level: u16) -> Result<(Self, u64), Fault> {
        let field = |offset: usize| u64::from(u32_at(header, offset));
        let (count, max_count) = (field(0), field(4));
        let (bucket_size, bucket_count) = (field(8), field(12));
        let bucket_stride = u64::from(u16_at(header, 20));
        let (full, partial) = (field(32), field(36));
        let degree = u32::from(u16_at(header, 40));
        if degree > 3 {
            let (found, range) = (degree, "0 to 3");
            return Err(Reason::Range { found, range }.at(Place::Header("sphericalHarmonicsDegree")));
        }
        if count > max_count {
            let (found, expected) = (max_count, count);
            return Err(Reason::Count { found, expected }.at(Place::Header("maxSplatCount")));
        }
        let rest = 3 * (sh_coefficients(degree) as u64 - 1);
        let stride = match level {
            0 => 44 + 4 * rest,
            1 => 24 + 2 * rest,
            _ => 24 + rest,
        };
        // Each factor has at most 32 bits, and the sum three terms.
        let (sizes, centres, records) = (4 * partial, bucket_stride * bucket_count, stride * max_count);
        let claimed = start + sizes + centres + records;
        let available = bytes.len() as u64;
        // The last section may have fewer records than its capacity.
        let needed = start + sizes + centres + stride * count;
        if needed > available {
            return Err(Reason::TooShort { claimed: needed, available }.at(Place::Header("a section's size")));
        }
        let [start, sizes, centres, used] = [start, sizes, centres, stride * count].map(|n| n as usize);
        let (sizes, rest) = bytes[start..].split_at(sizes);
        let (buckets, rest) = rest.split_at(centres);
        let mut section = Self {
            count: count as usize,
            degree,
            stride: stride as usize,
            records: &rest[..used],
            buckets,
            bucket_stride: bucket_stride as usize,
            bucket_starts: Vec::new(),
            step: 0.0,
            middle: 0.0,
        };
        if level > 0 && count > 0 {
            section.middle = match u32_at(header, 24) {
                0 => 32767.0,
                middle => middle as f32,
            };
            section.step = f32_at(header, 16) / 2.0 / section.middle;
            let sizes = (0..full.min(count))
                .map(|_| bucket_size)
                .chain(sizes.chunks_exact(4).map(|size| u64::from(u32_at(size, 0))));
            section.find_buckets(sizes, bucket_count)?;
        }
        Ok((section, claimed.min(available)))
    }

    /// Computes the first record of each bucket, from the `sizes` of the buckets; `count` of them have centres.
    fn find_buckets(&mut self, sizes: impl Iterator<Item = u64>, count: u64) -> Result<(), Fault> {
        let mut next = 0;
        for size in sizes {
            if next >= self.count as u64 {
                break;
            }
            self.bucket_starts.push(next as usize);
            next += size;
        }
        let (found, expected) = (next, self.count as u64);
        if found < expected {
            return Err(Reason::Count { found, expected }.at(Place::Header("a section's buckets")));
        }
        let expected = self.bucket_starts.len() as u64;
        if count < expected || self.bucket_stride < 12 {
            let found = if self.bucket_stride < 12 { 0 } else { count };
            return Err(Reason::Count { found, expected }.at(Place::Header("bucketCount")));
        }
        Ok(())
    }
}
