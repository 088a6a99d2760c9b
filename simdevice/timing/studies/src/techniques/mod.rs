//! Techniques of other accelerators, each evaluated on the work of this project's device: a function or a counter for
//! each technique, [`measured`] that runs all of them on a view, and [`page`], the comparison with what their papers say.
//!
//! Two kinds of input are used. A trace of the device ([`timing::work`]) has the lists of tiles, what was fetched of
//! them, and the ids. Projected Gaussians ([`footprint`]) have the geometry that a trace lacks. [`tile`] composites them
//! by the definition, pixel by pixel.

pub mod axis_sharing;
pub mod conditional;
pub mod footprint;
pub mod mask;
pub mod measured;
pub mod order_reuse;
pub mod page;
pub mod quad_merging;
pub mod row_transform;
pub mod scaling;
pub mod shape_tests;
pub mod tile;
