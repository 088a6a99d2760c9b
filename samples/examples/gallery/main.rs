//! Draws a picture of each mode of Gaussian draws, and writes the page that shows them:
//! `gallery [FOLDER]` writes FOLDER/GALLERY.md and FOLDER/pictures/gallery/*.png; FOLDER is `samples` by default.

mod gpu;
mod rooms;
mod scenes;

use std::error::Error;
use std::fmt::Write;
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

use gpu::Gpu;
use image::RgbImage;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use rooms::{Content, Exhibit};

/// The difference of two pictures, multiplied by `times`; grey where they are equal.
fn difference(a: &RgbImage, b: &RgbImage, times: f32) -> RgbImage {
    let mut picture = a.clone();
    for (a, b) in picture.iter_mut().zip(b.iter()) {
        let difference = f32::from(*b) - f32::from(*a);
        *a = (128.0 + times * difference).clamp(0.0, 255.0) as u8;
    }
    picture
}

fn picture(gpu: &mut Gpu, content: &Content<'_>) -> Result<RgbImage, Box<dyn Error>> {
    match content {
        Content::Drawn(picture) => gpu.draw(picture),
        Content::Difference([a, b], times) => Ok(difference(&gpu.draw(a)?, &gpu.draw(b)?, *times)),
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let (options, folders): (Vec<_>, Vec<_>) = (std::env::args().skip(1)).partition(|argument| argument == "--loader");
    let folder = Path::new(folders.first().map_or("samples", String::as_str));
    let entry = if options.is_empty() {
        vulkan_gaurast::entry()
    } else {
        // SAFETY: the system's loader is sound.
        unsafe { ash::Entry::load()? }
    };
    let pictures = folder.join("pictures/gallery");
    std::fs::create_dir_all(&pictures)?;
    let scenes = scenes::Scenes::new();
    let mut gpu = Gpu::new(entry)?;
    let mut page = "# Gallery\n\nA picture of each mode. `cargo run --release -p gaurast-examples --example gallery` draws them and writes this page.\n".to_owned();
    for room in rooms::all(&scenes) {
        let (mut images, mut captions) = (String::new(), String::new());
        for Exhibit { name, caption, content } in &room.exhibits {
            let file = BufWriter::new(File::create(pictures.join(format!("{name}.png")))?);
            let encoder = PngEncoder::new_with_quality(file, CompressionType::Best, FilterType::Adaptive);
            picture(&mut gpu, content)?.write_with_encoder(encoder)?;
            write!(images, "| ![{name}](pictures/gallery/{name}.png) ")?;
            write!(captions, "| {caption} ")?;
        }
        let rule = "|---".repeat(room.exhibits.len());
        let (title, text) = (room.title, room.text);
        write!(page, "\n## {title}\n\n{text}\n\n{images}|\n{rule}|\n{captions}|\n")?;
    }
    std::fs::write(folder.join("GALLERY.md"), page)?;
    Ok(())
}
