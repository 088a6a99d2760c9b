//! Tests of Gaussian draws, from an application's calls to pixels.

mod accuracy;
mod approximations;
mod cameras;
mod conformance_cases;
mod depth_stencil;
mod determinism;
mod given_scenes;
mod hybrid_scenes;
mod instances;
mod interleavings;
mod packets;
mod popping;
mod rasterization_modes;
mod recorded_work;
mod reference;
mod second;
mod shaded;
mod viewer;
mod what_ifs;

/// A trained scene of the test data.
const SKULL: &str = "splats/skull.ply";
const PLAYBOT: &str = "splats/playbot-125k.ply";
