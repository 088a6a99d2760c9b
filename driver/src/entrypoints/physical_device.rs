//! Physical devices: what they can do.
