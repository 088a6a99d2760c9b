//! The model of the rasterizer held against its hardware.

mod rtl;
mod tiles;
