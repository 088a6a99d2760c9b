//! Decodes the images of a SOG scene to attributes of Gaussians.
//!
//! Positions are 16 bits between bounds, with low and high bytes in an image each, of a logarithm that keeps signs.
//! Quaternions are their three smallest components; alpha has the index of the largest. Version 2 has codebooks of 256
//! values for scales (logarithms), colours and other coefficients, and opacities as bytes; version 1 has bounds for all
//! of them, and opacities are logits. Other coefficients come from a palette: one image has its entries, 64 in a row,
//! and another one the entry's index for each Gaussian.

use std::f64::consts::FRAC_1_SQRT_2;

use serde::Deserialize;

use super::document::{META, parse};
use super::files::{Files, Image};
use crate::error::{Fault, Place, Reason};
use crate::harmonics::sh_coefficients;
use crate::metadata::{Antialiasing, Geometry, Metadata};
use crate::scene::Scene;
use crate::shape::{GaussianShape, sigmoid};

/// The number of entries of a codebook.
const CODEBOOK: usize = 256;

/// The entries of the palette in one row of its image.
const PALETTE_ROW: usize = 64;

/// The most Gaussians in a scene: pixels of the largest image that WebP has.
const MAX_COUNT: u64 = 1 << 28;

#[derive(Deserialize)]
struct Meta {
    version: Option<f64>,
    count: Option<f64>,
    model: Option<String>,
    means: Attribute,
    scales: Attribute,
    quats: Attribute,
    sh0: Attribute,
    #[serde(rename = "shN")]
    sh_rest: Option<Attribute>,
}

/// An attribute: its images, and the bounds or codebook that decode their bytes.
#[derive(Deserialize)]
struct Attribute {
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

impl Attribute {
    /// Image `index` of the attribute `name`, which must have `expected` entries.
    fn image(&self, name: &str, index: usize, files: &Files<'_>, expected: u64) -> Result<Image, Fault> {
        let file = self.files.get(index).ok_or_else(|| fault(name, "files", Reason::Missing))?;
        files.image(file, expected)
    }

    /// The minima and maxima of `N` components.
    fn bounds<const N: usize>(&self, name: &str) -> Result<[[f64; 2]; N], Fault> {
        let numbers = |numbers: &Numbers, field: &str| match numbers {
            Numbers::Many(values) if values.len() >= N => Ok(std::array::from_fn(|i| values[i])),
            Numbers::One(value) if N == 1 => Ok([*value; N]),
            Numbers::None => Err(fault(name, field, Reason::Missing)),
            Numbers::One(_) => Err(count(name, field, 1, N)),
            Numbers::Many(values) => Err(count(name, field, values.len(), N)),
        };
        let mins: [f64; N] = numbers(&self.mins, "mins")?;
        let maxs: [f64; N] = numbers(&self.maxs, "maxs")?;
        Ok(std::array::from_fn(|i| [mins[i], maxs[i]]))
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

/// The values of a byte in each component of an attribute.
type Values<const N: usize> = [[f64; 256]; N];

/// Values spaced evenly between bounds.
fn linear<const N: usize>(bounds: [[f64; 2]; N]) -> Values<N> {
    bounds.map(|[min, max]| std::array::from_fn(|byte| min + (max - min) * (byte as f64 / 255.0)))
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
pub(super) fn load(meta: &[u8], files: &Files<'_>) -> Result<Scene, Fault> {
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
    let bounds = meta.means.bounds::<3>("means")?;
    let (scale_values, colour_values, opacities) = if legacy {
        let [red, green, blue, opacity] = linear(meta.sh0.bounds::<4>("sh0")?);
        let scales = linear(meta.scales.bounds::<3>("scales")?);
        (scales, [red, green, blue], opacity.map(sigmoid))
    } else {
        let opacities = std::array::from_fn(|byte| byte as f32 / 255.0);
        let scales = [meta.scales.codebook("scales")?; 3];
        (scales, [meta.sh0.codebook("sh0")?; 3], opacities)
    };
    let scale_values = scale_values.map(|values| values.map(|log| libm::exp(log) as f32));
    let low = meta.means.image("means", 0, files, count)?;
    let high = meta.means.image("means", 1, files, count)?;
    let scales = meta.scales.image("scales", 0, files, count)?;
    let quaternions = meta.quats.image("quats", 0, files, count)?;
    let colours = meta.sh0.image("sh0", 0, files, count)?;
    let palette = match &meta.sh_rest {
        Some(rest) => Palette::read(rest, legacy, files, count)?,
        None => None,
    };
    let degree = palette.as_ref().map_or(0, |palette| palette.degree);

    let mut scene = Scene::try_generate(degree, count as usize, |index, sh| {
        let (low, high) = (low.texel(index), high.texel(index));
        let position = std::array::from_fn(|axis| {
            let [min, max] = bounds[axis];
            let span = if max == min { 1.0 } else { max - min };
            let code = u16::from_le_bytes([low[axis], high[axis]]);
            unsigned_log(min + span * (f64::from(code) / 65535.0)) as f32
        });
        let scale = scales.texel(index);
        let colour = colours.texel(index);
        sh[0] = std::array::from_fn(|c| colour_values[c][usize::from(colour[c])] as f32);
        if let Some(palette) = &palette {
            palette.fill(index, &mut sh[1..]);
        }
        let shape = GaussianShape {
            scale: std::array::from_fn(|axis| scale_values[axis][usize::from(scale[axis])]),
            rotation: quaternion(quaternions.texel(index)).unwrap_or([1.0, 0.0, 0.0, 0.0]),
            opacity: opacities[usize::from(colour[3])],
        };
        (position, shape)
    })?;
    let metadata = scene.metadata_mut();
    say_model(meta.model.as_deref(), metadata);
    let untagged = (0..count as usize).filter(|index| quaternion(quaternions.texel(*index)).is_none()).count();
    if untagged > 0 {
        metadata.note(format!("{untagged} rotations name no largest component, and are none"));
    }
    let unlabelled =
        palette.map_or(0, |palette| (0..count as usize).filter(|index| palette.label(*index) >= palette.len).count());
    if unlabelled > 0 {
        metadata
            .note(format!("{unlabelled} Gaussians name no entry of the palette, and have one colour from all sides"));
    }
    Ok(scene)
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

/// The number whose signed logarithm, sign(x) ln(1 + |x|), is `value`.
fn unsigned_log(value: f64) -> f64 {
    (libm::exp(value.abs()) - 1.0).copysign(value)
}

/// Decodes a quaternion w, x, y, z. Alpha minus 252 is the index of the largest component; None if alpha is smaller.
fn quaternion([a, b, c, tag]: [u8; 4]) -> Option<[f32; 4]> {
    let largest = usize::from(tag.checked_sub(252)?);
    let small = [a, b, c].map(|byte| (f64::from(byte) / 255.0 * 2.0 - 1.0) * FRAC_1_SQRT_2);
    let squares: f64 = small.iter().map(|c| c * c).sum();
    let mut quaternion = [0.0; 4];
    quaternion[largest] = (1.0 - squares).max(0.0).sqrt() as f32;
    let others = (0..4).filter(|i| *i != largest);
    for (i, component) in others.zip(small) {
        quaternion[i] = component as f32;
    }
    Some(quaternion)
}

impl Palette {
    /// Reads the palette of the attribute `rest`; None if it has no bands.
    fn read(rest: &Attribute, legacy: bool, files: &Files<'_>, count: u64) -> Result<Option<Self>, Fault> {
        let name = "shN";
        let values = if legacy {
            let [values] = linear(rest.bounds::<1>(name)?);
            values
        } else {
            rest.codebook(name)?
        };
        // Version 1 gives neither the number of bands nor that of entries: the image's width tells the bands.
        let (degree, len) = if legacy {
            (None, 0)
        } else {
            let bands = rest.bands.ok_or_else(|| fault(name, "bands", Reason::Missing))?;
            let Some(bands) = whole(bands, 3) else {
                let text = format!("{bands} bands are not 0 to 3");
                return Err(fault(name, "bands", Reason::Unsupported(text)));
            };
            let len = rest.count.ok_or_else(|| fault(name, "count", Reason::Missing))?;
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
        let entries = rest.image(name, 0, files, pixels as u64)?;
        let degree = (1..=3).find(|l| entries.width as usize == width(*l) && degree.is_none_or(|d| d == *l));
        let Some(degree) = degree else {
            let text = format!("{} pixels are not the width of a palette", entries.width);
            return Err(Reason::Unsupported(text).at(Place::Entry(rest.files[0].clone())));
        };
        let rows = entries.height as usize * PALETTE_ROW;
        Ok(Some(Self {
            degree,
            entries,
            labels: rest.image(name, 1, files, count)?,
            len: if legacy { rows } else { len.min(rows) },
            values,
        }))
    }

    /// The index of Gaussian `index`'s palette entry, which may be out of range.
    fn label(&self, index: usize) -> usize {
        let [low, high, ..] = self.labels.texel(index);
        u16::from_le_bytes([low, high]).into()
    }

    /// Writes the coefficients of Gaussian `index` from degree 1 on.
    fn fill(&self, index: usize, sh: &mut [[f32; 3]]) {
        let label = self.label(index);
        if label >= self.len {
            return;
        }
        let row = label / PALETTE_ROW * self.entries.width as usize;
        let first = row + label % PALETTE_ROW * sh.len();
        for (k, rgb) in sh.iter_mut().enumerate() {
            let texel = self.entries.texel(first + k);
            *rgb = std::array::from_fn(|c| self.values[usize::from(texel[c])] as f32);
        }
    }
}
