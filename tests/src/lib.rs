//! What the project's tests share: the reference renderer, generated scenes, image comparison and
//! the place of test data.

pub mod compare;
pub mod convert;
pub mod data;
pub mod oracle;
pub mod scenes;
