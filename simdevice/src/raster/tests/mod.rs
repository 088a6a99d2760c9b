//! Code that the tests of both modes share.

pub(super) mod blender;
