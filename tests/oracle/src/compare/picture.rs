//! A picture of a difference, for people.

use std::path::Path;

use image::{Rgb, RgbImage};
use thiserror::Error;

use super::distance::{distance_between, distance_from_envelope, took_other_branch};
use crate::oracle::Reference;

/// An error of writing a picture.
#[derive(Debug, Error)]
pub enum PictureError {
    /// The folder could not be made.
    #[error("cannot make the folder: {0}")]
    Folder(#[from] std::io::Error),
    /// The file could not be encoded or written.
    #[error("cannot write the picture: {0}")]
    Write(#[from] image::ImageError),
}

/// Writes a PNG of three panels: the reference, the image, and their difference.
///
/// In the third panel grey is the distance from the binary64 result on a logarithmic scale: black for 1e-7 and less,
/// white for 1. Pixels further than `limit` from the envelope are red. Pixels on another branch are blue.
pub fn write_difference(
    path: &Path,
    image: &[[f32; 4]],
    reference: &Reference,
    limit: f64,
) -> Result<(), PictureError> {
    let (width, height) = (reference.width, reference.height);
    let picture = RgbImage::from_fn(3 * width, height, |x, y| {
        let index = (y * width + x % width) as usize;
        match x / width {
            0 => eight_bits(reference.nominal[index].map(|c| c as f32)),
            1 => eight_bits(image[index]),
            _ => difference(image[index], reference, index, limit),
        }
    });
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder)?;
    }
    Ok(picture.save(path)?)
}

fn eight_bits([r, g, b, _]: [f32; 4]) -> Rgb<u8> {
    // A conversion to u8 saturates, and makes 0 of what is not a number.
    Rgb([r, g, b].map(|c| (255.0 * c).round() as u8))
}

fn difference(rgba: [f32; 4], reference: &Reference, index: usize, limit: f64) -> Rgb<u8> {
    let distance = distance_between(rgba, reference.nominal[index]);
    let level = (255.0 * (1.0 + distance.log10() / 7.0)).round() as u8;
    if distance_from_envelope(rgba, reference, index) > limit {
        Rgb([255, level / 2, level / 2])
    } else if took_other_branch(rgba, reference, index, limit) {
        Rgb([level / 2, level / 2, 255])
    } else {
        Rgb([level; 3])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::oracle::{OracleState, render_literal};
    use crate::scenes;

    #[test]
    fn panels_show_reference_image_and_difference() {
        let scene = scenes::cloud(1, 50, 0);
        let camera = scenes::camera(16, 8);
        let reference = render_literal(&scene.as_oracle(), &camera, &OracleState::default());
        let mut image = reference.to_f32();
        image[16 * 3 + 5][0] += 0.5;
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("new/difference.png");
        write_difference(&path, &image, &reference, 5e-6).unwrap();
        let picture = image::open(&path).unwrap().into_rgb8();
        assert_eq!(picture.dimensions(), (48, 8));
        assert_eq!(picture.get_pixel(32 + 5, 3).0[0], 255);
        assert_eq!(picture.get_pixel(32 + 6, 3).0[0], 0);
        assert_eq!(picture.get_pixel(6, 3), picture.get_pixel(16 + 6, 3));
    }
}
