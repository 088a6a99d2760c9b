//! Scenes of 3D Gaussians and cameras: reading them from files, framing a scene, and a generated garden.
//!
//! Every [`Scene`] is in the frame of the original 3D Gaussian splatting code and its PLY files:
//! +x right, +y **down**, +z forward. PLY, compressed PLY and `.splat` files are kept as they are;
//! SPZ files, which are right-up-back, are turned half around x.

pub mod camera;
pub mod camera_files;
pub mod camera_path;
mod error;
mod formats;
mod framing;
pub mod garden;
mod metadata;
pub mod random;
mod scene;

pub use camera::Camera;
pub use error::{Place, Reason, SceneError};
pub use formats::{known_extensions, open, open_through, read};
pub use framing::{DEFAULT_UP, Extent, Framing, default_angles, frame, inside};
pub use metadata::{Antialiasing, ColorSpace, Geometry, Metadata};
pub use scene::{GaussianShape, MAX_SH_DEGREE, SH_C0, Scene, sigmoid};
