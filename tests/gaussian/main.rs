//! Gaussian draws, from an application's calls to pixels.

mod accuracy;
mod determinism;
mod given_scenes;
mod popping;
mod reference;
