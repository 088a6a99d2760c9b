//! Reading of picture files.

use std::fs::File;
use std::io::{self, BufReader, Read};
use std::path::{Path, PathBuf};

use exr::prelude::{ReadChannels, ReadLayers};
use thiserror::Error;

use crate::files::{EXTENSIONS, PictureFormat};
use crate::picture::Picture;

/// The most pixels of a picture that is read. A larger size is probably a damaged header.
const MAX_PIXELS: u64 = 1 << 29;

/// The reason that a picture could not be read.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ReadError {
    /// No supported format has the extension.
    #[error("{}: pictures are read from {EXTENSIONS}", path.display())]
    UnknownFormat {
        /// The file.
        path: PathBuf,
    },
    /// The file cannot be read.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The system's error.
        source: io::Error,
    },
    /// The file is damaged, or has something that is not read.
    #[error("{}: {reason}", path.display())]
    Malformed {
        /// The file.
        path: PathBuf,
        /// The decoder's reason.
        reason: String,
    },
}

/// Reads the picture file at `path`, whose extension gives the format. Values of eight or sixteen bits are scaled to 0
/// to 1 and premultiplied by alpha; floats are unchanged.
///
/// # Errors
/// See [`ReadError`].
pub fn read(path: &Path) -> Result<Picture, ReadError> {
    let format = PictureFormat::of(path).map_err(|_| ReadError::UnknownFormat { path: path.to_owned() })?;
    let io = |source| ReadError::Io { path: path.to_owned(), source };
    let file = BufReader::new(File::open(path).map_err(io)?);
    let picture = match format {
        PictureFormat::Png => png(file),
        PictureFormat::Jpeg => jpeg(file),
        PictureFormat::WebP => webp(file),
        PictureFormat::Exr => exr(file),
        PictureFormat::Ppm => ppm(file),
    };
    picture.map_err(|reason| ReadError::Malformed { path: path.to_owned(), reason })
}

/// Checks a size before memory is allocated for it.
fn sized(width: u64, height: u64) -> Result<(), String> {
    if width.saturating_mul(height) > MAX_PIXELS {
        return Err(format!("{width}x{height} pixels are more than are read"));
    }
    Ok(())
}

/// A picture from `channels` values a pixel, 1 to 4. `scaled` makes 0 to 1 of a value.
fn picture<T: Copy>(width: u32, height: u32, channels: usize, values: &[T], scaled: impl Fn(T) -> f32) -> Picture {
    let pixel = |values: &[T]| {
        let [r, g, b, alpha] = match *values {
            [grey] => [scaled(grey), scaled(grey), scaled(grey), 1.0],
            [grey, alpha] => [scaled(grey), scaled(grey), scaled(grey), scaled(alpha)],
            [r, g, b] => [scaled(r), scaled(g), scaled(b), 1.0],
            [r, g, b, alpha, ..] => [r, g, b, alpha].map(&scaled),
            [] => [0.0; 4],
        };
        [r * alpha, g * alpha, b * alpha, alpha]
    };
    Picture { width, height, pixels: values.chunks_exact(channels).map(pixel).collect() }
}

fn of_byte(byte: u8) -> f32 {
    f32::from(byte) / 255.0
}

fn of_word(word: u16) -> f32 {
    f32::from(word) / 65_535.0
}

fn png(file: BufReader<File>) -> Result<Picture, String> {
    let mut decoder = png::Decoder::new(file);
    decoder.set_transformations(png::Transformations::EXPAND);
    let mut reader = decoder.read_info().map_err(|error| error.to_string())?;
    let (width, height) = (reader.info().width, reader.info().height);
    sized(width.into(), height.into())?;
    let size = reader.output_buffer_size().ok_or("it is too large")?;
    let mut bytes = vec![0; size];
    let info = (reader.next_frame(&mut bytes)).map_err(|error| error.to_string())?;
    let bytes = &bytes[..info.buffer_size()];
    let channels = info.color_type.samples();
    Ok(if info.bit_depth == png::BitDepth::Sixteen {
        picture(width, height, channels, bytes.as_chunks().0, |pair| of_word(u16::from_be_bytes(pair)))
    } else {
        picture(width, height, channels, bytes, of_byte)
    })
}

fn jpeg(mut file: BufReader<File>) -> Result<Picture, String> {
    use zune_jpeg::zune_core::bytestream::ZCursor;
    use zune_jpeg::zune_core::colorspace::ColorSpace;
    use zune_jpeg::zune_core::options::DecoderOptions;
    let mut bytes = Vec::new();
    file.read_to_end(&mut bytes).map_err(|error| error.to_string())?;
    let options = DecoderOptions::default()
        .jpeg_set_out_colorspace(ColorSpace::RGB)
        .set_max_width(usize::from(u16::MAX))
        .set_max_height(usize::from(u16::MAX));
    let mut decoder = zune_jpeg::JpegDecoder::new_with_options(ZCursor::new(&bytes), options);
    let decoded = decoder.decode().map_err(|error| error.to_string())?;
    let (width, height) = decoder.dimensions().ok_or("it has no size")?;
    sized(width as u64, height as u64)?;
    Ok(picture(width as u32, height as u32, 3, &decoded, of_byte))
}

fn ppm(mut file: BufReader<File>) -> Result<Picture, String> {
    use zune_ppm::zune_core::bytestream::ZCursor;
    use zune_ppm::zune_core::result::DecodingResult;
    let mut bytes = Vec::new();
    file.read_to_end(&mut bytes).map_err(|error| error.to_string())?;
    let mut decoder = zune_ppm::PPMDecoder::new(ZCursor::new(&bytes));
    let text = |error| format!("{error:?}");
    decoder.decode_headers().map_err(text)?;
    let (width, height) = decoder.dimensions().ok_or("it has no size")?;
    sized(width as u64, height as u64)?;
    let channels = decoder.colorspace().ok_or("it has no channels")?.num_components();
    let (width, height) = (width as u32, height as u32);
    match decoder.decode().map_err(text)? {
        DecodingResult::U8(values) => Ok(picture(width, height, channels, &values, of_byte)),
        DecodingResult::U16(values) => Ok(picture(width, height, channels, &values, of_word)),
        _ => Err("its numbers are neither of 8 nor of 16 bits".to_owned()),
    }
}

fn webp(file: BufReader<File>) -> Result<Picture, String> {
    let mut decoder = image_webp::WebPDecoder::new(file).map_err(|error| error.to_string())?;
    let (width, height) = decoder.dimensions();
    sized(width.into(), height.into())?;
    let size = decoder.output_buffer_size().ok_or("it is too large")?;
    let channels = if decoder.has_alpha() { 4 } else { 3 };
    let mut bytes = vec![0; size];
    decoder.read_image(&mut bytes).map_err(|error| error.to_string())?;
    Ok(picture(width, height, channels, &bytes, of_byte))
}

fn exr(file: BufReader<File>) -> Result<Picture, String> {
    let image = exr::image::read::read()
        .no_deep_data()
        .largest_resolution_level()
        .rgba_channels(
            |size, _| (size.width(), vec![[0.0_f32; 4]; size.area()]),
            |(width, pixels): &mut (usize, Vec<[f32; 4]>), at, (r, g, b, a): (f32, f32, f32, f32)| {
                pixels[at.y() * *width + at.x()] = [r, g, b, a];
            },
        )
        .first_valid_layer()
        .all_attributes()
        .from_buffered(file)
        .map_err(|error| error.to_string())?;
    let size = image.layer_data.size;
    Ok(Picture {
        width: size.width() as u32,
        height: size.height() as u32,
        pixels: image.layer_data.channel_data.pixels.1,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_picture_is_one_sentence() {
        let folder = tempfile::tempdir().expect("a folder");
        for name in ["a.png", "a.jpg", "a.webp", "a.exr", "a.ppm"] {
            let path = folder.path().join(name);
            let missing = read(&path).expect_err("it is missing");
            assert!(matches!(missing, ReadError::Io { .. }), "{missing}");
            std::fs::write(&path, "neither").expect("written");
            let damaged = read(&path).expect_err("it is no picture").to_string();
            assert!(damaged.starts_with(&path.display().to_string()), "{damaged}");
            assert_eq!(damaged.lines().count(), 1, "{damaged}");
        }
    }
}
