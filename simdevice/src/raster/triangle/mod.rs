//! Triangle mode of the tile engine. [`draw`] prepares a draw and chooses its path through a tile. [`render`] runs
//! [`setup`], [`coverage`] and early tests for each primitive, and adds its quads to a [`batch`] or shades a
//! [`whole_tile`] at once. [`write`] writes shaded fragments to the attachments.

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
