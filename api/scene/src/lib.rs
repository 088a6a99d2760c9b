//! Scenes of 3D Gaussians and cameras: reading them from files, framing a scene, and a generated garden.
//!
//! Every [`Scene`] is in the frame of the original 3D Gaussian splatting code and its PLY files: +x right, +y **down**,
//! +z forward. Files in other frames are rotated when they are read; `docs/files.md` has the formats and their frames.
//!
//! ```
//! // `open("scene.ply")` reads a file; a generated scene needs none.
//! let garden = gaurast_scene::garden::scene(1, 1000);
//! // A camera that sees all of it, with a vertical field of view of 50 degrees.
//! let camera = gaurast_scene::frame(&garden, 50.0, [640, 360]);
//! assert_eq!((garden.len(), camera.width), (1000, 640));
//! ```

#![cfg_attr(not(test), deny(clippy::disallowed_methods))]

mod axes;
pub mod camera;
pub mod camera_files;
pub mod camera_path;
pub mod camera_tracks;
mod crop;
mod distortion;
pub mod encoded;
mod error;
mod formats;
mod framing;
pub mod garden;
mod harmonics;
pub mod info;
mod mesh;
mod metadata;
pub mod random;
mod scene;
mod shape;
mod transform;

pub use axes::{Axes, AxesReason, FileAxes};
pub use camera::Camera;
pub use crop::Crop;
pub use distortion::{Distortion, DistortionModel};
pub use encoded::EncodedScene;
pub use error::{Place, Reason, SceneError};
pub use formats::{Loaded, Options, known_extensions, load_with, open, open_with, read, read_with};
pub use framing::{DEFAULT_UP, Extent, Framed, Framing, Subject, default_angles, frame, frame_middle, inside};
pub use harmonics::{MAX_SH_DEGREE, SH_C0};
pub use mesh::{Mesh, MeshVertex};
pub use metadata::{Antialiasing, ColorSpace, Geometry, Metadata, SortOrder};
pub use scene::{Scene, SceneArrays};
pub use shape::{GaussianShape, sigmoid};
pub use transform::Transform;
