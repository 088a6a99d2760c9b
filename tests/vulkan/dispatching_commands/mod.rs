//! The chapter *Dispatching Commands*.

mod dispatches;
