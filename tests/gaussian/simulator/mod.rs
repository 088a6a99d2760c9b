//! Tests of the rasterizer's timing model against its hardware description.

mod rtl;
mod rtl_mutants;
mod tiles;
