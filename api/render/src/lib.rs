//! A headless renderer of scenes: an ordinary Vulkan application that draws with the Gaussian
//! primitive topology.
//!
//! ```no_run
//! use gaurast_render::Renderer;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let scene = gaurast_scene::open("garden.ply")?;
//! let camera = gaurast_scene::frame(&scene, 50.0, [1280, 720]);
//! let mut renderer = Renderer::new(vulkan_gaurast::entry())?; // or ash::Entry::load()?
//! let picture = renderer.draw(&scene, &camera)?;
//! gaurast_picture::write("garden.png".as_ref(), &picture, None)?;
//! # Ok(())
//! # }
//! ```
//!
//! [`Renderer::upload`] and [`Renderer::render`] draw a scene many times. A generated scene needs no file:
//!
//! ```
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let garden = gaurast_scene::garden::scene(1, 2000);
//! let camera = gaurast_scene::garden::camera(None, [64, 36])?;
//! let picture = gaurast_render::Renderer::new(vulkan_gaurast::entry())?.draw(&garden, &camera)?;
//! assert!(picture.pixels.iter().any(|[red, ..]| *red > 0.1));
//! # Ok(())
//! # }
//! ```

#![cfg_attr(not(test), deny(clippy::disallowed_methods))]

mod arrays;
pub mod device;
mod device_scene;
mod draw;
mod encoded;
mod error;
mod library;
mod listed;
mod mesh;
mod modes;
mod options;
mod pipeline;
pub mod process_stats;
mod query;
mod renderer;
pub mod resource;
mod settings;
mod target;

pub use arrays::{Arrays, Colors};
pub use device::device_names;
pub use device_scene::DeviceScene;
pub use error::{During, RenderError};
pub use gaurast::WorkTrace;
pub use library::{DriverError, load_driver};
pub use modes::{CutOff, Precision, SigmaPoints};
pub use options::{DeviceOptions, Message, MessageFunction};
pub use query::Counter;
pub use renderer::{Frame, Renderer};
pub use settings::Settings;
pub use target::{COLOR_FORMAT, Target, check_size, copy_image, record_copy};
