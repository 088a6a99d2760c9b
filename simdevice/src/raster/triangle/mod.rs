//! Triangle mode of the tile engine: [`draw`] makes a draw ready and chooses its path through a tile, [`render`] takes its
//! primitives through [`setup`], [`coverage`] and early tests to a [`batch`] or, where they cover a [`whole_tile`], at once,
//! and [`write`] takes what was shaded to the attachments.

mod batch;
mod coverage;
mod draw;
pub(crate) mod recording;
mod render;
mod setup;
mod whole_tile;
mod write;

pub use draw::TriangleTileDraw;
pub use render::{MacroTile, Scratch, render};
