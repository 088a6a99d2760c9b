//! Pictures as files.
//!
//! A rendered pixel is (C, 1 - T): accumulated colour, already weighted by alpha, and alpha. EXR files store it
//! unchanged in 32-bit floats, with depths as further channels if there are any. The other formats have eight bits and
//! are opaque, over the background, which is black by default. PNG and WebP may be transparent instead: their alpha is
//! not premultiplied, so colours are divided by alpha before they are rounded.

use std::io::{self, Cursor};
use std::path::{Path, PathBuf};

use exr::image::write::WritableImage;
use exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Encoding as ExrEncoding, FlatSamples, Image, Layer, LayerAttributes,
    SpecificChannels, Text, Vec2,
};
use thiserror::Error;

use crate::atomic::{folder, write_atomically};
use crate::color::Background;
use crate::picture::Picture;

/// The default quality of JPEG files, 1 to 100.
pub const DEFAULT_QUALITY: u8 = 90;

/// The greatest side of a JPEG file's picture.
const MAX_JPEG_SIDE: u32 = 65_535;

/// The greatest side of a WebP file's picture.
const MAX_WEBP_SIDE: u32 = 16_384;

/// A format of picture files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum PictureFormat {
    /// 8-bit RGB, or RGBA if the background is transparent.
    Png,
    /// 8-bit RGB, lossy.
    Jpeg,
    /// 8-bit RGB or RGBA, lossless.
    WebP,
    /// 32-bit float RGBA, and depths.
    Exr,
    /// 8-bit RGB without compression: Netpbm's `P6`.
    Ppm,
}

/// The reason that a picture does not become a file of a format: the format cannot hold it, or its encoder failed.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{0}")]
pub struct EncodeError(pub(crate) String);

impl EncodeError {
    /// An encoder's error.
    pub(crate) fn of(error: impl ToString) -> Self {
        Self(error.to_string())
    }
}

/// The reason that a picture could not be written.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum OutputError {
    /// No supported format has the extension.
    #[error("{}: pictures are written as {EXTENSIONS}", path.display())]
    UnknownFormat {
        /// The file.
        path: PathBuf,
    },
    /// No supported format of depths has the extension.
    #[error("{}: depths are written as .png or .npy", path.display())]
    UnknownDepthFormat {
        /// The file.
        path: PathBuf,
    },
    /// The file cannot be written.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The system's error.
        source: io::Error,
    },
    /// The picture doesn't fit the format.
    #[error("{}: {reason}", path.display())]
    Encode {
        /// The file.
        path: PathBuf,
        /// The encoder's reason.
        reason: EncodeError,
    },
}

/// The extensions of all formats, as messages show them.
pub(crate) const EXTENSIONS: &str = ".png, .jpg, .webp, .ppm or .exr";

impl PictureFormat {
    /// The format of the file `path`, by its extension.
    ///
    /// # Errors
    /// [`OutputError::UnknownFormat`].
    pub fn of(path: &Path) -> Result<Self, OutputError> {
        let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        match extension.as_deref() {
            Some("png") => Ok(Self::Png),
            Some("jpg" | "jpeg") => Ok(Self::Jpeg),
            Some("webp") => Ok(Self::WebP),
            Some("exr") => Ok(Self::Exr),
            Some("ppm") => Ok(Self::Ppm),
            _ => Err(OutputError::UnknownFormat { path: path.to_owned() }),
        }
    }

    /// Reports whether files of this format can be transparent.
    pub fn has_alpha(self) -> bool {
        !matches!(self, Self::Jpeg | Self::Ppm)
    }

    /// The most bytes for each pixel that encoding allocates, apart from the picture.
    pub fn bytes_per_pixel(self) -> u64 {
        match self {
            Self::Png | Self::Jpeg | Self::WebP | Self::Ppm => 8,
            // The channels twice: as planes, then as the file.
            Self::Exr => 48,
        }
    }
}

/// The options of encoding a picture.
#[derive(Clone, Copy, Debug)]
pub struct Encoding<'a> {
    /// The background. Without one, EXR files are transparent and others have a black background.
    pub background: Option<Background>,
    /// The expected and the median depth of each pixel, for EXR files.
    pub depth: Option<&'a [[f32; 2]]>,
    /// The quality of JPEG files, 1 to 100.
    pub quality: u8,
    /// True for EXR files in linear light: colours, which are trained as sRGB, are converted.
    pub linear: bool,
    /// The colour space of the picture.
    pub colors: Colors,
}

/// The colour space of a picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Colors {
    /// sRGB: the colours of 3DGS's training.
    #[default]
    Srgb,
    /// Linear light, which is converted to sRGB for files of eight bits.
    Linear,
}

impl Colors {
    /// The background, whose colour is sRGB, in this colour space; black without a background.
    fn behind(self, background: Option<Background>) -> [f32; 3] {
        let shown = background.map_or([0.0; 3], Background::color);
        match self {
            Self::Srgb => shown,
            Self::Linear => shown.map(|colour| to_linear(colour, 1.0)),
        }
    }

    /// A colour, not premultiplied, converted from this colour space to sRGB.
    fn shown(self, colour: f32) -> f32 {
        match self {
            Self::Srgb => colour,
            Self::Linear if colour > 0.003_130_8 => 1.055 * libm::powf(colour, 1.0 / 2.4) - 0.055,
            Self::Linear => 12.92 * colour,
        }
    }
}

impl Default for Encoding<'_> {
    fn default() -> Self {
        Self { background: None, depth: None, quality: DEFAULT_QUALITY, linear: false, colors: Colors::Srgb }
    }
}

/// Checks, before a picture is rendered, that one can be written to `path`: its format is known, and its folder exists.
///
/// # Errors
/// [`OutputError::UnknownFormat`] or [`OutputError::Io`].
pub fn check(path: &Path) -> Result<(), OutputError> {
    PictureFormat::of(path)?;
    check_place(path)
}

/// Checks that a file can be written to `path`: its folder exists, and it is not a folder itself.
///
/// # Errors
/// [`OutputError::Io`].
pub fn check_place(path: &Path) -> Result<(), OutputError> {
    let io = |source| OutputError::Io { path: path.to_owned(), source };
    let is_folder = |path: &Path| path.metadata().map(|metadata| metadata.is_dir());
    if !is_folder(folder(path)).map_err(io)? {
        return Err(io(io::ErrorKind::NotADirectory.into()));
    }
    if is_folder(path).unwrap_or(false) {
        return Err(io(io::ErrorKind::IsADirectory.into()));
    }
    Ok(())
}

/// Writes `picture` to `path`, in the format of its extension, over `background` if there is one. The write is atomic;
/// see [`write_atomically`](crate::write_atomically).
///
/// # Errors
/// See [`OutputError`].
pub fn write(path: &Path, picture: &Picture, background: Option<[f32; 3]>) -> Result<(), OutputError> {
    let encoding = Encoding { background: background.map(Background::Color), ..Encoding::default() };
    write_encoded(path, picture, &encoding)
}

/// Writes `picture` to `path`, in the format of its extension, with the options `encoding`. The write is atomic; see
/// [`write_atomically`](crate::write_atomically).
///
/// # Errors
/// See [`OutputError`].
pub fn write_encoded(path: &Path, picture: &Picture, encoding: &Encoding<'_>) -> Result<(), OutputError> {
    let format = PictureFormat::of(path)?;
    let encoded =
        encode(format, picture, encoding).map_err(|reason| OutputError::Encode { path: path.to_owned(), reason })?;
    write_atomically(path, &encoded).map_err(|source| OutputError::Io { path: path.to_owned(), source })
}

/// The bytes of a file of `picture`.
///
/// # Errors
/// If the picture doesn't fit the format.
pub fn encode(format: PictureFormat, picture: &Picture, encoding: &Encoding<'_>) -> Result<Vec<u8>, EncodeError> {
    let side = picture.width.max(picture.height);
    let transparent = encoding.background == Some(Background::Transparent);
    match format {
        PictureFormat::Png => png(picture, encoding).map_err(EncodeError::of),
        PictureFormat::Jpeg if transparent => Err(EncodeError("JPEG files cannot be transparent".to_owned())),
        PictureFormat::Jpeg if side > MAX_JPEG_SIDE => {
            Err(EncodeError(format!("JPEG files have sides of at most {MAX_JPEG_SIDE}")))
        }
        PictureFormat::Jpeg => {
            let mut file = Vec::new();
            let mut encoder = jpeg_encoder::Encoder::new(&mut file, encoding.quality);
            // At high quality, colour is not subsampled.
            if encoding.quality >= 95 {
                encoder.set_sampling_factor(jpeg_encoder::SamplingFactor::F_1_1);
            }
            let [width, height] = [picture.width, picture.height].map(|side| side as u16);
            let bytes = rgb(picture, encoding);
            encoder.encode(&bytes, width, height, jpeg_encoder::ColorType::Rgb).map_err(EncodeError::of)?;
            Ok(file)
        }
        PictureFormat::WebP if side > MAX_WEBP_SIDE => {
            Err(EncodeError(format!("WebP files have sides of at most {MAX_WEBP_SIDE}")))
        }
        PictureFormat::WebP => {
            let mut file = Vec::new();
            let (bytes, color) = if transparent {
                (rgba(picture, encoding.colors), image_webp::ColorType::Rgba8)
            } else {
                (rgb(picture, encoding), image_webp::ColorType::Rgb8)
            };
            image_webp::WebPEncoder::new(&mut file)
                .encode(&bytes, picture.width, picture.height, color)
                .map_err(EncodeError::of)?;
            Ok(file)
        }
        PictureFormat::Exr => exr(picture, encoding).map_err(EncodeError::of),
        PictureFormat::Ppm if transparent => Err(EncodeError("PPM files cannot be transparent".to_owned())),
        PictureFormat::Ppm => {
            let mut file = format!("P6\n{} {}\n255\n", picture.width, picture.height).into_bytes();
            file.extend(rgb(picture, encoding));
            Ok(file)
        }
    }
}

/// Red, green and blue of each pixel in eight bits, over the background, which is black by default.
pub fn rgb(picture: &Picture, encoding: &Encoding<'_>) -> Vec<u8> {
    let Encoding { background, colors, .. } = *encoding;
    let behind = colors.behind(background);
    let over = |pixel: &[f32; 4]| {
        let [r, g, b, _] = match background {
            Some(_) => over_pixel(*pixel, behind),
            None => *pixel,
        };
        [r, g, b].map(|colour| to_byte(colors.shown(colour)))
    };
    picture.pixels.iter().flat_map(over).collect()
}

/// Red, green, blue and alpha of each pixel in eight bits; colours are not premultiplied.
fn rgba(picture: &Picture, colors: Colors) -> Vec<u8> {
    let straight = |&[r, g, b, alpha]: &[f32; 4]| {
        let part = |colour: f32| {
            if alpha > 0.0 { to_byte(colors.shown(colour / alpha)) } else { 0 }
        };
        [part(r), part(g), part(b), to_byte(alpha)]
    };
    picture.pixels.iter().flat_map(straight).collect()
}

/// The bytes of a PNG file.
fn png(picture: &Picture, encoding: &Encoding<'_>) -> Result<Vec<u8>, png::EncodingError> {
    let transparent = encoding.background == Some(Background::Transparent);
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, picture.width, picture.height);
    encoder.set_color(if transparent { png::ColorType::Rgba } else { png::ColorType::Rgb });
    encoder.set_compression(png::Compression::Fast);
    let mut writer = encoder.write_header()?;
    let bytes = if transparent { rgba(picture, encoding.colors) } else { rgb(picture, encoding) };
    writer.write_image_data(&bytes)?;
    writer.finish()?;
    Ok(file)
}

/// The value of the attribute `colorSpace` of EXR files.
fn color_space(linear: bool) -> AttributeValue {
    AttributeValue::Text(Text::from(if linear {
        "linear light, Rec. 709 primaries, premultiplied"
    } else {
        "sRGB as trained (not linear), Rec. 709 primaries, premultiplied"
    }))
}

/// The bytes of an OpenEXR file: the four channels unchanged, and depths if there are any, uncompressed.
fn exr(picture: &Picture, encoding: &Encoding<'_>) -> Result<Vec<u8>, exr::error::Error> {
    let (width, height) = (picture.width as usize, picture.height as usize);
    let pixel = |index: usize| {
        let [r, g, b, a] = match encoding.background {
            Some(Background::Color(_)) => {
                let behind = encoding.colors.behind(encoding.background);
                over_pixel(picture.pixels[index], behind)
            }
            Some(Background::Transparent) | None => picture.pixels[index],
        };
        if encoding.linear && encoding.colors == Colors::Srgb {
            let linear = [r, g, b].map(|colour| to_linear(colour, a));
            [linear[0], linear[1], linear[2], a]
        } else {
            [r, g, b, a]
        }
    };
    let mut file = Cursor::new(Vec::new());
    let mut attributes = LayerAttributes::default();
    attributes
        .other
        .insert(Text::from("colorSpace"), color_space(encoding.linear || encoding.colors == Colors::Linear));
    if let Some(depth) = encoding.depth {
        let plane = |name: &str, value: &dyn Fn(usize) -> f32| {
            let samples = (0..width * height).map(value).collect();
            AnyChannel::new(name, FlatSamples::F32(samples))
        };
        let channels = AnyChannels::sort(smallvec::smallvec![
            plane("R", &|i| pixel(i)[0]),
            plane("G", &|i| pixel(i)[1]),
            plane("B", &|i| pixel(i)[2]),
            plane("A", &|i| pixel(i)[3]),
            plane("expected.Z", &|i| depth[i][0]),
            plane("Z", &|i| depth[i][1]),
        ]);
        let layer = Layer::new((width, height), attributes, ExrEncoding::UNCOMPRESSED, channels);
        Image::from_layer(layer).write().to_buffered(&mut file)?;
    } else {
        let channels = SpecificChannels::rgba(|Vec2(x, y)| {
            let [r, g, b, a] = pixel(y * width + x);
            (r, g, b, a)
        });
        let layer = Layer::new((width, height), attributes, ExrEncoding::UNCOMPRESSED, channels);
        Image::from_layer(layer).write().to_buffered(&mut file)?;
    }
    Ok(file.into_inner())
}

fn over_pixel([r, g, b, alpha]: [f32; 4], behind: [f32; 3]) -> [f32; 4] {
    let transmittance = 1.0 - alpha;
    [r + transmittance * behind[0], g + transmittance * behind[1], b + transmittance * behind[2], 1.0]
}

/// A premultiplied sRGB colour, converted to premultiplied linear light.
fn to_linear(colour: f32, alpha: f32) -> f32 {
    if alpha <= 0.0 {
        return 0.0;
    }
    let straight = colour / alpha;
    let linear = if straight > 0.04045 { libm::powf((straight + 0.055) / 1.055, 2.4) } else { straight / 12.92 };
    linear * alpha
}

/// Rounds a colour to eight bits, without a transfer function.
fn to_byte(value: f32) -> u8 {
    libm::roundf(255.0 * value.clamp(0.0, 1.0)) as u8
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
    fn a_transparent_picture_has_straight_colours() {
        let folder = tempfile::tempdir().expect("a folder");
        let encoding = Encoding { background: Some(Background::Transparent), ..Encoding::default() };
        for name in ["a.png", "a.webp"] {
            let path = folder.path().join(name);
            write_encoded(&path, &picture(), &encoding).expect("written");
            let read = crate::read(&path).expect("readable");
            assert_eq!((read.width, read.height), (3, 2), "{name}");
            // (0.5, 0.25, 0.125) at half alpha is (1, 0.5, 0.25) at 128 of 255.
            let alpha = 128.0 / 255.0;
            let expected = [255.0, 128.0, 64.0].map(|step: f32| step / 255.0 * alpha);
            for (value, expected) in read.pixels[1].iter().zip(expected) {
                assert!((value - expected).abs() < 1e-6, "{name}: {:?}", read.pixels[1]);
            }
            assert_eq!(read.pixels[0], [0.0; 4], "{name}");
            assert_eq!(read.pixels[1][3], alpha, "{name}");
        }
        let jpeg = write_encoded(&folder.path().join("a.jpg"), &picture(), &encoding);
        let refused = jpeg.expect_err("JPEG has no alpha").to_string();
        assert!(refused.ends_with("JPEG files cannot be transparent"), "{refused}");
    }

    #[test]
    fn linear_colours_are_shown_as_srgb() {
        let half = Picture { width: 1, height: 1, pixels: vec![[0.25, 0.0, 0.5, 0.5]] };
        let over = |background| Encoding { background, colors: Colors::Linear, ..Encoding::default() };
        // Half of linear light is 188 of 255 steps, a quarter 137.
        assert_eq!(rgb(&half, &over(None)), [137, 0, 188]);
        let white = Some(Background::Color([1.0; 3]));
        assert_eq!(rgb(&half, &over(white)), [225, 188, 255]);
        assert_eq!(rgba(&half, Colors::Linear), [188, 0, 255, 128]);
    }

    #[test]
    fn jpeg_is_close_and_webp_is_exact() {
        let folder = tempfile::tempdir().expect("a folder");
        let ramp = Picture {
            width: 64,
            height: 64,
            pixels: (0..64 * 64_u16).map(|i| [f32::from(i % 64) / 63.0, f32::from(i / 64) / 63.0, 0.5, 1.0]).collect(),
        };
        for (name, error) in [("a.jpg", 0.03), ("b.webp", 0.002), ("c.png", 0.002)] {
            let path = folder.path().join(name);
            write(&path, &ramp, None).expect("written");
            let read = crate::read(&path).expect("readable");
            let differences = read.pixels.iter().zip(&ramp.pixels);
            let worst = differences.flat_map(|(a, b)| a.iter().zip(b).map(|(a, b)| (a - b).abs())).fold(0.0, f32::max);
            assert!(worst <= error, "{name}: {worst}");
        }
    }

    #[test]
    fn exr_holds_depths_and_says_its_colour_space() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.exr");
        let depth: Vec<[f32; 2]> = (0..6_u8).map(|i| [f32::from(i), 10.0 + f32::from(i)]).collect();
        let encoding = Encoding { depth: Some(&depth), ..Encoding::default() };
        write_encoded(&path, &picture(), &encoding).expect("written");
        let read = exr::prelude::read_all_flat_layers_from_file(&path).expect("an EXR");
        let layer = &read.layer_data[0];
        let names: Vec<String> = (layer.channel_data.list.iter()).map(|channel| channel.name.to_string()).collect();
        assert_eq!(names, ["A", "B", "G", "R", "Z", "expected.Z"]);
        let values =
            |index: usize| -> Vec<f32> { layer.channel_data.list[index].sample_data.values_as_f32().collect() };
        assert_eq!(values(4), [10.0, 11.0, 12.0, 13.0, 14.0, 15.0]);
        assert_eq!(values(5), [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]);
        assert_eq!(values(3)[1], 0.5);
        let said = layer.attributes.other.get(&Text::from("colorSpace"));
        assert_eq!(said, Some(&color_space(false)));
        // A colour of 0.5 at half alpha is 1, which is 1 in linear light.
        let encoding = Encoding { linear: true, ..Encoding::default() };
        write_encoded(&path, &picture(), &encoding).expect("written");
        let read = crate::read(&path).expect("readable");
        assert!((read.pixels[1][0] - 0.5).abs() < 1e-6 && read.pixels[1][1] < 0.12);
    }

    #[test]
    fn failure_leaves_nothing_behind() {
        let folder = tempfile::tempdir().expect("a folder");
        let unknown = write(&folder.path().join("a.bmp"), &picture(), None);
        assert!(matches!(unknown, Err(OutputError::UnknownFormat { .. })));
        let missing = folder.path().join("no/such/a.png");
        assert!(matches!(check(&missing), Err(OutputError::Io { .. })));
        let missing = write(&missing, &picture(), None);
        assert!(matches!(missing, Err(OutputError::Io { .. })));
        // The target is a folder, so that the rename fails after everything was written.
        let taken = folder.path().join("a.png");
        std::fs::create_dir(&taken).expect("a folder");
        assert!(matches!(check(&taken), Err(OutputError::Io { .. })));
        assert!(write(&taken, &picture(), None).is_err());
        let left = std::fs::read_dir(folder.path()).expect("readable").count();
        assert_eq!(left, 1);
    }
}
