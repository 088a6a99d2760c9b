//! What fuzz targets run, and the deterministic tests beside them: modules of any words taken through a pipeline's
//! creation and a dispatch, scene files of any bytes, Vulkan calls and packets in any order.

mod bytes;
pub mod calls;
mod harness;
pub mod loaders;
mod mutate;
pub mod packets;

pub use harness::{Harness, Layout, Outcome};
pub use mutate::{mutate, mutate_bytes};
