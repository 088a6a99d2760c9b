//! A floor of large 2D Gaussians, coloured as a chessboard and seen at a grazing angle, and the same floor of flat 3D
//! Gaussians: `tilted_plane FOLDER` writes surfels.png and ellipses.png.
//!
//! A 2D Gaussian is evaluated at the intersection of each pixel's ray with its plane, so the lines of the board are
//! straight everywhere. The picture of a 3D Gaussian is an ellipse, whose error grows with its angular size.

use std::error::Error;
use std::path::Path;

use gaurast_render::{Renderer, Settings};
use gaurast_scene::camera::Camera;
use gaurast_scene::{GaussianShape, Geometry, Scene};

/// The number of discs along a side of the floor, and their distance.
const SIDE: i32 = 24;
const STEP: f32 = 0.5;

fn main() -> Result<(), Box<dyn Error>> {
    let (options, folders): (Vec<_>, Vec<_>) = (std::env::args().skip(1)).partition(|argument| argument == "--loader");
    let folder = folders.first().ok_or("a folder for the pictures")?;
    let mut scene = Scene::with_capacity(0, (SIDE * SIDE) as usize);
    for row in 0..SIDE {
        for column in 0..SIDE {
            let position = [(column - SIDE / 2) as f32 * STEP, 0.0, row as f32 * STEP];
            let shape = GaussianShape {
                scale: [0.22 * STEP, 0.22 * STEP, 0.0],
                // Rotates the axes x and y to x and z.
                rotation: [0.5f32.sqrt(), 0.5f32.sqrt(), 0.0, 0.0],
                opacity: 0.98,
            };
            let bright = (row + column) % 2 == 0;
            let color = if bright { [1.6, 1.3, 0.7] } else { [-0.6, -1.2, -0.4] };
            scene.push(position, shape, &[color]);
        }
    }
    let camera = Camera::look_at([0.0, -0.8, -0.4], [0.0, 0.3, 3.0], [0.0, -1.0, 0.0], 75.0, [960, 540])?;
    let entry = if options.is_empty() {
        vulkan_gaurast::entry()
    } else {
        // SAFETY: the system's loader is sound.
        unsafe { ash::Entry::load()? }
    };
    let mut renderer = Renderer::new(entry)?;
    let mut uploaded = renderer.upload(&scene, None)?;
    for (name, geometry) in [("surfels.png", Geometry::Surfel), ("ellipses.png", Geometry::Volume)] {
        let settings = Settings { geometry, ..Settings::default() };
        renderer.set(&mut uploaded, settings)?;
        let frame = renderer.render(&uploaded, &camera)?;
        gaurast_picture::write(&Path::new(folder).join(name), &frame.picture, Some([0.1; 3]))?;
    }
    Ok(())
}
