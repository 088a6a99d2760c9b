//! Binning: the splats of each tile in depth order.

mod row_band;
pub(crate) mod sorted_walk;
pub(crate) mod tile_lists;
mod tile_runs;
