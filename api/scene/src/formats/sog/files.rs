//! Access to the files of a SOG scene: entries of a zip archive, or files of a folder.

use image_webp::WebPDecoder;

use crate::encoded::Stream;
use crate::error::{Fault, Place, Reason};
use crate::formats::archive::Archive;
use crate::formats::input::Origin;
use crate::formats::spz::one_line;

/// The files of a scene.
pub(super) enum Files<'a> {
    /// The entries of a zip archive.
    Archive(Archive<'a>),
    /// The files of this folder, which is below that of the input.
    Folder(Origin<'a>, String),
}

/// A decoded image.
pub(super) struct Image {
    channels: usize,
    texels: Vec<u8>,
    pub(super) width: u32,
    pub(super) height: u32,
}

impl Image {
    /// Red, green, blue and alpha of pixel `index`, row by row.
    #[inline]
    pub(super) fn texel(&self, index: usize) -> [u8; 4] {
        let texel = &self.texels[self.channels * index..][..self.channels];
        [texel[0], texel[1], texel[2], texel.get(3).copied().unwrap_or(255)]
    }

    /// The image with an alpha of 255 if it has none.
    pub(super) fn with_alpha(mut self) -> Result<Self, Fault> {
        if self.channels == 3 {
            let pixels = self.texels.len() / 3;
            let mut texels = Vec::new();
            texels.try_reserve_exact(4 * pixels).map_err(|_| Reason::Memory(4 * pixels as u64).at(Place::File))?;
            texels.extend((0..pixels).flat_map(|index| self.texel(index)));
            (self.channels, self.texels) = (4, texels);
        }
        Ok(self)
    }

    /// The first `count` pixels.
    pub(super) fn into_stream(mut self, count: usize) -> Stream {
        self.texels.truncate(self.channels * count);
        self.texels.shrink_to_fit();
        Stream { bytes: self.texels, stride: self.channels }
    }
}

impl<'a> Files<'a> {
    /// The files in the zip archive `bytes`.
    pub(super) fn archive(bytes: &'a [u8]) -> Result<Self, Fault> {
        Ok(Self::Archive(Archive::new(bytes)?))
    }

    /// The files in `folder`, which is below that of `origin`.
    pub(super) fn folder(origin: Origin<'a>, folder: &str) -> Self {
        Self::Folder(origin, folder.to_owned())
    }

    /// Reads the file `name`.
    pub(super) fn read(&self, name: &str) -> Result<Vec<u8>, Fault> {
        match self {
            Self::Folder(origin, folder) => origin.companion(&join(folder, name)),
            Self::Archive(archive) => archive.read(name),
        }
    }

    /// Reads the image `name`, in which each of `expected` entries is a pixel.
    pub(super) fn image(&self, name: &str, expected: u64) -> Result<Image, Fault> {
        let bytes = self.read(name)?;
        image(&bytes, expected).map_err(|reason| reason.at(Place::Entry(name.to_owned())))
    }
}

/// The path of `name` in `folder`.
pub(super) fn join(folder: &str, name: &str) -> String {
    if folder.is_empty() { name.to_owned() } else { format!("{folder}/{name}") }
}

/// The WebP image `bytes`, of at least `expected` pixels and not many more.
fn image(bytes: &[u8], expected: u64) -> Result<Image, Reason> {
    let damaged = |error: image_webp::DecodingError| Reason::Image(one_line(&error));
    let mut decoder = WebPDecoder::new(std::io::Cursor::new(bytes)).map_err(damaged)?;
    let (width, height) = decoder.dimensions();
    let pixels = u64::from(width) * u64::from(height);
    // Writers round sides up. A few bytes may claim an image of a gigabyte.
    if pixels < expected || pixels > 4 * expected + (1 << 20) {
        return Err(Reason::Pixels { width, height, expected });
    }
    let channels = if decoder.has_alpha() { 4 } else { 3 };
    let size = decoder.output_buffer_size().unwrap_or(usize::MAX);
    let mut texels = Vec::new();
    texels.try_reserve_exact(size).map_err(|_| Reason::Memory(size as u64))?;
    texels.resize(size, 0);
    decoder.read_image(&mut texels).map_err(damaged)?;
    Ok(Image { channels, texels, width, height })
}
