//! Tests of the front end, each against a naive reference or a property that must hold.

mod assembly;
mod binning;
mod clipping;
mod culling;
mod fetch;
mod robustness;
mod scene;
mod shapes;
mod snapping;
