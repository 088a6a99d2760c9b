//! The command processor: the one match over [`Packet`](crate::Packet).

/// Executes packets in order.
#[derive(Debug)]
pub struct CommandProcessor {}
