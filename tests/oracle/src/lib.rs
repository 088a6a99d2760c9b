//! The references that tests and benchmarks compare pictures of Gaussians with: a renderer in binary64, measures of the
//! difference between two pictures, and generated scenes.
//!
//! The accuracy of a picture of any renderer:
//!
//! ```
//! use gaurast_oracle::compare::{Accuracy, Limits};
//! use gaurast_oracle::oracle::{OracleCamera, OracleState, render_bounded};
//! use gaurast_oracle::scenes::SceneBuffers;
//!
//! # let mut scene = gaurast_scene::Scene::with_capacity(0, 1);
//! # let shape = gaurast_scene::GaussianShape { scale: [0.1; 3], rotation: [1.0, 0.0, 0.0, 0.0], opacity: 0.9 };
//! # scene.push([0.0, 0.0, 2.0], shape, &[[1.0, 0.0, 0.5]]);
//! // let scene = gaurast_scene::open("scene.ply")?;
//! let camera = gaurast_scene::frame_middle(&scene, 50.0, [64, 48]);
//! let buffers = SceneBuffers::from(&scene);
//! let seen = OracleCamera::new(&camera.to_vulkan(), [camera.width, camera.height]).expect("a model that it knows");
//! let reference = render_bounded(&buffers.as_oracle(), &seen, &OracleState::default());
//!
//! // The pixels of the picture in question, as floats, premultiplied, row by row.
//! let picture: Vec<[f32; 4]> = reference.to_f32();
//! let accuracy = Accuracy::of(&picture, &reference, Limits::CONTRACT);
//! println!("{accuracy}");
//! assert!(accuracy.holds());
//! ```

pub mod compare;
pub mod oracle;
pub mod scenes;
