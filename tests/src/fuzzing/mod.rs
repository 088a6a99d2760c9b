//! Functions that fuzz targets and deterministic tests call: shader modules of any words, which are created and
//! dispatched; scene files of any bytes; Vulkan calls and packets in any order.

mod bytes;
pub mod calls;
mod harness;
pub mod loaders;
mod mutate;
pub mod packets;

pub use harness::{Harness, Layout, Outcome};
pub use mutate::{mutate, mutate_bytes};
