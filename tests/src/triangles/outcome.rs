//! The result of a scene.

use gaurast_testkit::Output;

/// The pictures of a scene, or the optional feature that it needs and the device lacks.
pub type Drawn = Result<Output, Missing>;

/// An optional feature that a device does not have.
#[derive(Clone, Debug, thiserror::Error)]
#[error("the device does not have {0}")]
pub struct Missing(pub String);
