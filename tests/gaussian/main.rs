//! Gaussian draws, from an application's calls to pixels.

mod accuracy;
mod depth_stencil;
mod determinism;
mod hybrid_scenes;
mod interleavings;
mod reference;
