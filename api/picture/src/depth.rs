//! Depths as files: PNG files of 16 bits, and NumPy's arrays of binary32.

use std::path::Path;

use crate::atomic::write_atomically;
use crate::files::{EncodeError, OutputError};

/// A format of files of depths.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DepthFormat {
    /// Whole steps in 16 bits of grey. 0 is no depth, and the greatest number that depth or a greater one.
    Png,
    /// NumPy's array of binary32, a row of the picture after the other. No depth is infinite.
    Npy,
}

/// The depths of a picture, row by row, in the scene's units; infinite where there are none.
#[derive(Clone, Copy, Debug)]
pub struct DepthMap<'a> {
    /// The picture's width in pixels.
    pub width: u32,
    /// The picture's height in pixels.
    pub height: u32,
    /// A depth for each pixel.
    pub depths: &'a [f32],
}

impl DepthFormat {
    /// The format of the file `path`, by its extension.
    ///
    /// # Errors
    /// [`OutputError::UnknownDepthFormat`].
    pub fn of(path: &Path) -> Result<Self, OutputError> {
        let extension = path.extension().map(|extension| extension.to_string_lossy().to_lowercase());
        match extension.as_deref() {
            Some("png") => Ok(Self::Png),
            Some("npy") => Ok(Self::Npy),
            _ => Err(OutputError::UnknownDepthFormat { path: path.to_owned() }),
        }
    }
}

/// Writes depths to `path`, in the format of its extension. `step` is the unit of PNG files. The write is atomic; see
/// [`write_atomically`].
///
/// # Errors
/// See [`OutputError`].
pub fn write_depths(path: &Path, map: &DepthMap<'_>, step: f64) -> Result<(), OutputError> {
    let encoded = match DepthFormat::of(path)? {
        DepthFormat::Png => png(map, step)
            .map_err(|error| OutputError::Encode { path: path.to_owned(), reason: EncodeError::of(error) })?,
        DepthFormat::Npy => npy(map),
    };
    write_atomically(path, &encoded).map_err(|source| OutputError::Io { path: path.to_owned(), source })
}

fn png(map: &DepthMap<'_>, step: f64) -> Result<Vec<u8>, png::EncodingError> {
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, map.width, map.height);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::Sixteen);
    encoder.set_compression(png::Compression::Fast);
    let mut writer = encoder.write_header()?;
    let steps = |depth: &f32| match libm::round(f64::from(*depth) / step) {
        _ if !depth.is_finite() => 0,
        steps => steps.clamp(1.0, f64::from(u16::MAX)) as u16,
    };
    let bytes: Vec<u8> = map.depths.iter().flat_map(|depth| steps(depth).to_be_bytes()).collect();
    writer.write_image_data(&bytes)?;
    writer.finish()?;
    Ok(file)
}

/// The bytes of NumPy's format, version 1.0: <https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html>.
fn npy(map: &DepthMap<'_>) -> Vec<u8> {
    /// The header and what is before it are a multiple of this.
    const ALIGNMENT: usize = 64;
    let shape = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': ({}, {}), }}", map.height, map.width);
    let mut file = b"\x93NUMPY\x01\x00".to_vec();
    let before = file.len() + size_of::<u16>();
    let length = (before + shape.len() + 1).next_multiple_of(ALIGNMENT) - before;
    file.extend((length as u16).to_le_bytes());
    file.extend(format!("{shape:<width$}\n", width = length - 1).bytes());
    file.extend(map.depths.iter().flat_map(|depth| depth.to_le_bytes()));
    file
}

#[cfg(test)]
mod tests {
    use super::*;

    const DEPTHS: [f32; 6] = [0.0, 0.0015, 1.25, 65.535, 1e9, f32::INFINITY];
    const MAP: DepthMap<'static> = DepthMap { width: 3, height: 2, depths: &DEPTHS };

    #[test]
    fn png_has_whole_steps_and_0_for_none() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.png");
        write_depths(&path, &MAP, 0.001).expect("written");
        let read = image::open(&path).expect("a PNG");
        assert_eq!(read.color(), image::ColorType::L16);
        assert_eq!(read.to_luma16().as_raw(), &[1, 2, 1250, 65_535, 65_535, 0]);
    }

    #[test]
    fn npy_is_numpys_array() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.npy");
        write_depths(&path, &MAP, 0.001).expect("written");
        let bytes = std::fs::read(&path).expect("readable");
        let (header, data) = bytes.split_at(128);
        assert!(
            header.starts_with(b"\x93NUMPY\x01\x00\x76\x00{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3), }")
        );
        assert!(header.ends_with(b" \n"));
        let read: Vec<f32> = data.as_chunks().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect();
        assert_eq!(read, DEPTHS);
        let unknown = write_depths(&folder.path().join("a.tiff"), &MAP, 0.001).expect_err("unknown").to_string();
        assert!(unknown.contains("depths are written as .png or .npy"), "{unknown}");
    }
}
