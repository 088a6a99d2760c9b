//! What the project's tests share: the reference renderer, image comparison, test data.

pub mod oracle;
pub mod scenes;
