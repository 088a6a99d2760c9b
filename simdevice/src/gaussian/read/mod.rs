//! Reading: the attributes of Gaussians and of their models, from streams in memory to arrays of a number per lane.

pub(crate) mod attributes;
pub(crate) mod cluster_cache;
pub(crate) mod clusters;
pub(crate) mod decoding;
mod exponential;
pub(crate) mod fingerprint;
pub(crate) mod group;
pub(crate) mod harmonics;
mod harmonics_decoding;
pub(crate) mod models;
mod morton;
