//! Pictures as files.
//!
//! A rendered pixel is (C, 1 - T): accumulated colour, already weighted by alpha, and alpha. EXR
//! files hold exactly that in 32-bit floats. PNG's alpha is not premultiplied and eight bits
//! cannot undo that, so a PNG is always opaque: over the background, which is black by default.

use std::io::{self, Cursor};
use std::path::{Path, PathBuf};

use exr::image::write::WritableImage;
use exr::prelude::{Image, SpecificChannels, Vec2};
use thiserror::Error;

use crate::atomic::{folder, write_atomically};
use crate::picture::Picture;

/// A format of picture files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PictureFormat {
    /// 8-bit RGB.
    Png,
    /// 32-bit float RGBA.
    Exr,
}

/// Why a picture could not be written.
#[derive(Debug, Error)]
pub enum OutputError {
    /// The extension is of no format that is written.
    #[error("{}: pictures are written as .png or .exr", path.display())]
    UnknownFormat {
        /// The file.
        path: PathBuf,
    },
    /// The file cannot be written.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// The picture doesn't fit the format.
    #[error("{}: {reason}", path.display())]
    Encode {
        /// The file.
        path: PathBuf,
        /// The encoder's message.
        reason: String,
    },
}

impl PictureFormat {
    /// The format of the file `path`, by its extension.
    ///
    /// # Errors
    /// [`OutputError::UnknownFormat`].
    pub fn of(path: &Path) -> Result<Self, OutputError> {
        let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        match extension.as_deref() {
            Some("png") => Ok(Self::Png),
            Some("exr") => Ok(Self::Exr),
            _ => Err(OutputError::UnknownFormat {
                path: path.to_owned(),
            }),
        }
    }
}

/// Checks, before there is a picture, that one could be written to `path`: its format is known, and
/// its folder is there.
///
/// # Errors
/// [`OutputError::UnknownFormat`] or [`OutputError::Io`].
pub fn check(path: &Path) -> Result<(), OutputError> {
    PictureFormat::of(path)?;
    let io = |source| OutputError::Io {
        path: path.to_owned(),
        source,
    };
    let is_folder = |path: &Path| path.metadata().map(|metadata| metadata.is_dir());
    if !is_folder(folder(path)).map_err(io)? {
        return Err(io(io::ErrorKind::NotADirectory.into()));
    }
    if is_folder(path).unwrap_or(false) {
        return Err(io(io::ErrorKind::IsADirectory.into()));
    }
    Ok(())
}

/// Writes `picture` to `path`, in the format of its extension, over `background` if there is one.
/// The file appears whole or not at all.
///
/// # Errors
/// See [`OutputError`].
pub fn write(
    path: &Path,
    picture: &Picture,
    background: Option<[f32; 3]>,
) -> Result<(), OutputError> {
    let io = |source| OutputError::Io {
        path: path.to_owned(),
        source,
    };
    let format = PictureFormat::of(path)?;
    let composited = background.map(|background| picture.over(background));
    let picture = composited.as_ref().unwrap_or(picture);
    let encoded = match format {
        PictureFormat::Png => png(picture).map_err(|error| error.to_string()),
        PictureFormat::Exr => exr(picture).map_err(|error| error.to_string()),
    };
    let encoded = encoded.map_err(|reason| OutputError::Encode {
        path: path.to_owned(),
        reason,
    })?;
    write_atomically(path, &encoded).map_err(io)
}

/// The bytes of a PNG file: red, green and blue, opaque; what is not covered shows black.
fn png(picture: &Picture) -> Result<Vec<u8>, png::EncodingError> {
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, picture.width, picture.height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_compression(png::Compression::Fast);
    let mut writer = encoder.write_header()?;
    let pixels = picture.pixels.iter();
    let bytes: Vec<u8> = pixels
        .flat_map(|[r, g, b, _]| [r, g, b].map(|c| to_byte(*c)))
        .collect();
    writer.write_image_data(&bytes)?;
    writer.finish()?;
    Ok(file)
}

/// The bytes of an OpenEXR file: the four channels as they are, uncompressed.
fn exr(picture: &Picture) -> Result<Vec<u8>, exr::error::Error> {
    let (width, height) = (picture.width as usize, picture.height as usize);
    let channels = SpecificChannels::rgba(|Vec2(x, y)| {
        let [r, g, b, a] = picture.pixels[y * width + x];
        (r, g, b, a)
    });
    let mut file = Cursor::new(Vec::new());
    Image::from_channels((width, height), channels)
        .write()
        .to_buffered(&mut file)?;
    Ok(file.into_inner())
}

/// Colours are written as they are trained and drawn: no transfer function.
fn to_byte(value: f32) -> u8 {
    (255.0 * value.clamp(0.0, 1.0)).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture() -> Picture {
        Picture {
            width: 3,
            height: 2,
            pixels: vec![
                [0.0, 0.0, 0.0, 0.0],
                [0.5, 0.25, 0.125, 0.5],
                [1.0, 2.0, -1.0, 1.0],
                [0.1, 0.2, 0.3, 0.4],
                [f32::NAN, 0.0, 0.0, 1.0],
                [0.6, 0.001_960_7, 0.001_961, 1.0],
            ],
        }
    }

    #[test]
    fn png_is_opaque_over_black_or_the_background() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.PNG");
        write(&path, &picture(), None).expect("written");
        let read = image::open(&path).expect("a PNG");
        assert_eq!(read.color(), image::ColorType::Rgb8);
        let read = read.to_rgb8();
        assert_eq!(read.get_pixel(0, 0).0, [0, 0, 0]);
        assert_eq!(read.get_pixel(1, 0).0, [128, 64, 32]);
        assert_eq!(read.get_pixel(2, 0).0, [255, 255, 0]);
        // Half a step rounds up, just below it down.
        assert_eq!(read.get_pixel(2, 1).0, [153, 0, 1]);

        write(&path, &picture(), Some([1.0, 0.5, 0.0])).expect("written over");
        let read = image::open(&path).expect("a PNG").to_rgb8();
        assert_eq!(read.get_pixel(0, 0).0, [255, 128, 0]);
        assert_eq!(read.get_pixel(1, 0).0, [255, 128, 32]);
    }

    #[test]
    fn exr_holds_the_floats_themselves() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.exr");
        write(&path, &picture(), None).expect("written");
        let read = image::open(&path).expect("an EXR").to_rgba32f();
        for (pixel, expected) in read.pixels().zip(&picture().pixels) {
            for (value, expected) in pixel.0.iter().zip(expected) {
                assert_eq!(value.to_bits(), expected.to_bits());
            }
        }
        write(&path, &picture(), Some([1.0, 0.0, 0.5])).expect("written");
        let read = image::open(&path).expect("an EXR").to_rgba32f();
        assert_eq!(read.get_pixel(1, 0).0, [1.0, 0.25, 0.375, 1.0]);
    }

    #[test]
    fn failure_leaves_nothing_behind() {
        let folder = tempfile::tempdir().expect("a folder");
        let unknown = write(&folder.path().join("a.jpg"), &picture(), None);
        assert!(matches!(unknown, Err(OutputError::UnknownFormat { .. })));
        let missing = folder.path().join("no/such/a.png");
        assert!(matches!(check(&missing), Err(OutputError::Io { .. })));
        let missing = write(&missing, &picture(), None);
        assert!(matches!(missing, Err(OutputError::Io { .. })));
        // The target is a folder: the rename fails after everything was written.
        let taken = folder.path().join("a.png");
        std::fs::create_dir(&taken).expect("a folder");
        assert!(matches!(check(&taken), Err(OutputError::Io { .. })));
        assert!(write(&taken, &picture(), None).is_err());
        let left = std::fs::read_dir(folder.path()).expect("readable").count();
        assert_eq!(left, 1);
    }
}
