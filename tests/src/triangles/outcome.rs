//! What becomes of a scene.

use gaurast_testkit::Output;

/// What a scene leaves behind, unless the device lacks an optional feature that it needs.
pub type Drawn = Result<Output, Missing>;

/// An optional feature that a device does not have.
#[derive(Clone, Debug, thiserror::Error)]
#[error("the device does not have {0}")]
pub struct Missing(pub String);
