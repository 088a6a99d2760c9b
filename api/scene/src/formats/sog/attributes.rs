//! Decodes the images of a SOG scene to attributes of Gaussians.
//!
//! Positions are 16 bits between bounds, with low and high bytes in an image each, of a logarithm that keeps signs.
//! Quaternions are their three smallest components; alpha has the index of the largest. Version 2 has codebooks of 256
//! values for scales (logarithms), colours and other coefficients, and opacities as bytes; version 1 has bounds for all
//! of them, and opacities are logits. Other coefficients come from a palette: one image has its entries, 64 in a row,
//! and another one the entry's index for each Gaussian.

use std::path::PathBuf;

use glam::DMat3;
use serde::Deserialize;

use super::document::{META, parse};
use super::files::{Files, Image};
use crate::encoded::{Attribute, CODEBOOK, Decoding, EncodedHarmonics, EncodedScene, Form, Stream};
use crate::error::{Fault, Place, Reason};
use crate::harmonics::sh_coefficients;
use crate::metadata::{Antialiasing, Geometry, Metadata};

/// The entries of the palette in one row of its image.
const PALETTE_ROW: usize = 64;

/// The most Gaussians in a scene: pixels of the largest image that WebP has.
const MAX_COUNT: u64 = 1 << 28;

#[derive(Deserialize)]
struct Meta {
    version: Option<f64>,
    count: Option<f64>,
    model: Option<String>,
    means: Property,
    scales: Property,
    quats: Property,
    sh0: Property,
    #[serde(rename = "shN")]
    sh_rest: Option<Property>,
}

/// A property of Gaussians: its images, and the bounds or codebook that decode their bytes.
#[derive(Deserialize)]
struct Property {
    files: Vec<String>,
    #[serde(default)]
    mins: Numbers,
    #[serde(default)]
    maxs: Numbers,
    /// The codebook. Its first entry may be null, because of a mistake of an early writer.
    #[serde(default)]
    codebook: Vec<Option<f64>>,
    shape: Option<Vec<f64>>,
    bands: Option<f64>,
    count: Option<f64>,
}

/// A number or a list of them.
#[derive(Default, Deserialize)]
#[serde(untagged)]
enum Numbers {
    #[default]
    None,
    One(f64),
    Many(Vec<f64>),
}

/// `value` as an integer from 0 to `last`; None if it is not one.
fn whole(value: f64, last: u64) -> Option<u64> {
    (libm::trunc(value) == value && (0.0..=last as f64).contains(&value)).then_some(value as u64)
}

fn fault(name: &str, field: &str, reason: Reason) -> Fault {
    reason.at(Place::Part(format!("meta.json, {name}.{field}")))
}

impl Property {
    /// Image `index` of the property `name`, which must have `expected` entries.
    fn image(&self, name: &str, index: usize, files: &Files<'_>, expected: u64) -> Result<Image, Fault> {
        let file = self.files.get(index).ok_or_else(|| fault(name, "files", Reason::Missing))?;
        files.image(file, expected)
    }

    /// The minima of the components, and then their maxima.
    fn bounds(&self, name: &str, components: usize) -> Result<Vec<f64>, Fault> {
        let numbers = |numbers: &Numbers, field: &str| match numbers {
            Numbers::Many(values) if values.len() >= components => Ok(values[..components].to_vec()),
            Numbers::One(value) if components == 1 => Ok(vec![*value]),
            Numbers::None => Err(fault(name, field, Reason::Missing)),
            Numbers::One(_) => Err(count(name, field, 1, components)),
            Numbers::Many(values) => Err(count(name, field, values.len(), components)),
        };
        Ok([numbers(&self.mins, "mins")?, numbers(&self.maxs, "maxs")?].concat())
    }

    /// The values of the 256 bytes.
    fn codebook(&self, name: &str) -> Result<[f64; CODEBOOK], Fault> {
        let field = "codebook";
        if self.codebook.len() != CODEBOOK {
            return Err(count(name, field, self.codebook.len(), CODEBOOK));
        }
        let mut values = [0.0; CODEBOOK];
        for (value, entry) in values.iter_mut().zip(&self.codebook).skip(1) {
            *value = entry.ok_or_else(|| fault(name, field, Reason::Missing))?;
        }
        let step = (values[1] - values[CODEBOOK - 1]) / 255.0;
        values[0] = self.codebook[0].unwrap_or(values[1] + step);
        Ok(values)
    }
}

fn count(name: &str, field: &str, found: usize, expected: usize) -> Fault {
    let (found, expected) = (found as u64, expected as u64);
    fault(name, field, Reason::Count { found, expected })
}

/// The palette of other coefficients.
struct Palette {
    degree: u32,
    entries: Image,
    labels: Image,
    len: usize,
    values: [f64; CODEBOOK],
}

/// Reads the scene of the document `meta`.
pub(super) fn load(meta: &[u8], files: &Files<'_>) -> Result<EncodedScene, Fault> {
    let meta: Meta = parse(meta, Place::Entry(META.to_owned()))?;
    let part = |field: &str| Place::Part(format!("meta.json, {field}"));
    let version = meta.version.unwrap_or(1.0);
    let legacy = version == 1.0;
    if !legacy && version != 2.0 {
        let (found, read) = (version as u32, "1 and 2");
        return Err(Reason::Version { found, read }.at(part("version")));
    }
    let claimed = match &meta.means.shape {
        Some(shape) if legacy => shape.first().copied(),
        _ => meta.count,
    };
    let claimed = claimed.ok_or_else(|| Reason::Missing.at(part("count")))?;
    let Some(count) = whole(claimed, MAX_COUNT) else {
        let text = "it is not a number of Gaussians that images could hold";
        return Err(Reason::Unsupported(text.to_owned()).at(part("count")));
    };
    if count == 0 {
        return Err(Reason::Empty.at(part("count")));
    }
    let size = count as usize;
    let mut numbers = Vec::new();
    // All Gaussians are one chunk.
    let mut chunk = |mut bounds: Vec<f64>| {
        let table = numbers.len();
        let stride = bounds.len();
        numbers.append(&mut bounds);
        Decoding::Chunks { table, stride, size }
    };
    let mut bounds = meta.means.bounds("means", 3)?;
    for axis in 0..3 {
        if bounds[3 + axis] == bounds[axis] {
            bounds[3 + axis] = bounds[axis] + 1.0;
        }
    }
    let means = chunk(bounds);
    let (scale_decoding, color_decoding, opacity_decoding) = if legacy {
        let bounds = meta.sh0.bounds("sh0", 4)?;
        let (colors, opacities) = ([&bounds[..3], &bounds[4..7]].concat(), vec![bounds[3], bounds[7]]);
        (chunk(meta.scales.bounds("scales", 3)?), chunk(colors), chunk(opacities))
    } else {
        let mut codebook = |values: [f64; CODEBOOK]| {
            let table = numbers.len();
            numbers.extend(values);
            Decoding::Codebook { table }
        };
        (codebook(meta.scales.codebook("scales")?), codebook(meta.sh0.codebook("sh0")?), Decoding::None)
    };
    let low = meta.means.image("means", 0, files, count)?;
    let high = meta.means.image("means", 1, files, count)?;
    let positions = joined(&low, &high, size)?;
    drop((low, high));
    let scales = meta.scales.image("scales", 0, files, count)?;
    let quaternions = meta.quats.image("quats", 0, files, count)?.with_alpha()?;
    let colors = meta.sh0.image("sh0", 0, files, count)?.with_alpha()?;
    let mut metadata = Metadata::default();
    say_model(meta.model.as_deref(), &mut metadata);
    let untagged = (0..size).filter(|index| quaternions.texel(*index)[3] < 252).count();
    if untagged > 0 {
        metadata.note(format!("{untagged} rotations name no largest component, and are none"));
    }
    let palette = match &meta.sh_rest {
        Some(rest) => Palette::read(rest, legacy, files, count)?,
        None => None,
    };
    let unlabelled =
        (palette.as_ref()).map_or(0, |palette| (0..size).filter(|index| palette.label(*index) >= palette.len).count());
    if unlabelled > 0 {
        metadata
            .note(format!("{unlabelled} Gaussians name no entry of the palette, and have one colour from all sides"));
    }
    let codebook = numbers.len();
    numbers.extend(palette.iter().flat_map(|palette| palette.values));
    let bytes = |stream: usize, decoding: Decoding| Attribute { stream, offset: 0, form: Form::Bytes, decoding };
    Ok(EncodedScene {
        count: size,
        sh_degree: palette.as_ref().map_or(0, |palette| palette.degree),
        streams: vec![positions, scales.into_stream(size), quaternions.into_stream(size), colors.into_stream(size)],
        position: Attribute { form: Form::Shorts, ..bytes(0, means) },
        scale: bytes(1, scale_decoding),
        rotation: bytes(2, Decoding::SmallestThree),
        color: bytes(3, color_decoding),
        opacity: Attribute { offset: 3, ..bytes(3, opacity_decoding) },
        has_signed_log_positions: true,
        has_logit_opacities: legacy,
        has_base_colors: false,
        numbers,
        harmonics: palette.map(|palette| palette.into_harmonics(codebook, size)),
        turn: DMat3::IDENTITY,
        metadata,
        path: PathBuf::new(),
    })
}

/// Positions whose components have their bytes in two images.
fn joined(low: &Image, high: &Image, count: usize) -> Result<Stream, Fault> {
    let stride = 2 * 3;
    let mut bytes = Vec::new();
    let size = count.saturating_mul(stride);
    bytes.try_reserve_exact(size).map_err(|_| Reason::Memory(size as u64).at(Place::File))?;
    for index in 0..count {
        let (low, high) = (low.texel(index), high.texel(index));
        bytes.extend([low[0], high[0], low[1], high[1], low[2], high[2]]);
    }
    Ok(Stream { bytes, stride })
}

fn say_model(model: Option<&str>, metadata: &mut Metadata) {
    let (antialiasing, geometry) = match model {
        None => return,
        Some("default") => (Antialiasing::Off, Geometry::Volume),
        Some("antialiased") => (Antialiasing::Compensated, Geometry::Volume),
        Some("2dgs") => (Antialiasing::Off, Geometry::Surfel),
        Some(other) => return metadata.note(format!("the model {other:?} is unknown and ignored")),
    };
    metadata.antialiasing = Some(antialiasing);
    metadata.geometry = Some(geometry);
}

impl Palette {
    /// Reads the palette of a property; None if it has no bands.
    fn read(property: &Property, legacy: bool, files: &Files<'_>, count: u64) -> Result<Option<Self>, Fault> {
        let name = "shN";
        let values = if legacy {
            let bounds = property.bounds(name, 1)?;
            // Values spaced evenly between bounds.
            std::array::from_fn(|byte| bounds[0] + (bounds[1] - bounds[0]) * (byte as f64 / 255.0))
        } else {
            property.codebook(name)?
        };
        // Version 1 gives neither the number of bands nor that of entries: the image's width tells the bands.
        let (degree, len) = if legacy {
            (None, 0)
        } else {
            let bands = property.bands.ok_or_else(|| fault(name, "bands", Reason::Missing))?;
            let Some(bands) = whole(bands, 3) else {
                let text = format!("{bands} bands are not 0 to 3");
                return Err(fault(name, "bands", Reason::Unsupported(text)));
            };
            let len = property.count.ok_or_else(|| fault(name, "count", Reason::Missing))?;
            let Some(len) = whole(len, 1 << 16) else {
                let text = format!("a palette of {len} entries is not one of 16-bit labels");
                return Err(fault(name, "count", Reason::Unsupported(text)));
            };
            if bands == 0 {
                return Ok(None);
            }
            (Some(bands as u32), len as usize)
        };
        let width = |degree: u32| PALETTE_ROW * (sh_coefficients(degree) - 1);
        let pixels = degree.map_or(1, |degree| width(degree) * len.div_ceil(PALETTE_ROW));
        let entries = property.image(name, 0, files, pixels as u64)?;
        let degree = (1..=3).find(|l| entries.width as usize == width(*l) && degree.is_none_or(|d| d == *l));
        let Some(degree) = degree else {
            let text = format!("{} pixels are not the width of a palette", entries.width);
            return Err(Reason::Unsupported(text).at(Place::Entry(property.files[0].clone())));
        };
        let rows = entries.height as usize * PALETTE_ROW;
        Ok(Some(Self {
            degree,
            entries,
            labels: property.image(name, 1, files, count)?,
            len: if legacy { rows } else { len.min(rows) },
            values,
        }))
    }

    /// The index of Gaussian `index`'s palette entry, which may be out of range.
    fn label(&self, index: usize) -> usize {
        let [low, high, ..] = self.labels.texel(index);
        u16::from_le_bytes([low, high]).into()
    }

    /// The palette as coefficients of `count` Gaussians. The codebook is at place `codebook` of the numbers. Entries follow one
    /// another, since a row of the image has a whole number of them.
    fn into_harmonics(self, codebook: usize, count: usize) -> EncodedHarmonics {
        let coefficients = sh_coefficients(self.degree) - 1;
        let pixels = self.entries.into_stream(self.len * coefficients);
        EncodedHarmonics {
            coefficient_stride: pixels.stride,
            component_stride: 1,
            codes: Stream { stride: pixels.stride * coefficients, ..pixels },
            codebook,
            labels: Some(self.labels.into_stream(count)),
        }
    }
}
