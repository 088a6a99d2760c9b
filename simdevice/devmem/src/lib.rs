//! Device memory.
//!
//! An [`Allocation`] is a page-aligned, zeroed range that the application may keep mapped while the device works on it,
//! and on which shader invocations may legally race. Therefore no reference into it is ever formed: bulk access copies
//! to and from the caller's slices, shader access is a relaxed atomic of 8 to 64 bits or a vector of such, and every
//! access is checked against the allocation's length.
//!
//! All of the simulated device's `unsafe` is in this crate.

mod hints;
pub mod host;
pub mod level;
mod lookup;
mod memory;
mod runs;
pub mod shared;

#[doc(hidden)]
pub use fearless_simd;
pub use hints::{PAGE_SIZE, prefetch};
pub use lookup::{gather, gather_2, gather_4, gather_each, look_up, look_up_16};
pub use memory::{Allocation, AllocationError, BufferRange, DerivedData, OutOfBounds};
pub use runs::{load_4, load_16, store_16};
