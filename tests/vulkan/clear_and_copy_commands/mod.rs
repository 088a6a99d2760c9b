//! The chapters *Clear Commands* and *Copy Commands*.

mod blits;
mod host_image_copies;
mod image_transfers;
mod transfers;
