//! Command buffers' contents: what recording leaves, and how a queue turns it into packets.
//!
//! [`record`] is plain data. [`replay`] walks it through one exhaustive match, with the bound [`state`] that
//! draws need, and hands packets to the device's command processor.

pub(crate) mod bound;
pub(crate) mod record;
pub(crate) mod recorder;
pub(crate) mod replay;
pub(crate) mod state;
