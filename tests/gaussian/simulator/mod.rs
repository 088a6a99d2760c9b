//! Tests of the rasterizer's timing model against its hardware description.

mod page;
mod rtl;
mod rtl_mutants;
mod tiles;
