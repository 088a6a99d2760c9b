//! The kernels for what the fast one cannot do: the tile's list is divided by blocks of pixels, and each block composites its own
//! list.

pub(crate) mod binary16;
pub(crate) mod block_kernel;
pub(crate) mod block_lists;
mod exponents;
pub(crate) mod in_order;
pub(crate) mod per_pixel;
pub(crate) mod tracking;
pub(crate) mod wide_sums;
