//! The chapters *Clear Commands* and *Copy Commands*.

mod blits;
mod image_transfers;
mod transfers;
