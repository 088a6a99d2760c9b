//! Images whose luma and chroma are apart: samples through conversions, and their planes.

mod colors;
mod image;
mod planes;
