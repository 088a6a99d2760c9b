//! Minimal scenes of glTF, USD and 3DGS's PLY, with the exact pictures of them, which hold any renderer against the formats' texts.
//!
//! A [`Case`] is a scene's file, a camera and a clause. Its picture is the binary64 oracle's, and its tolerance is the greatest
//! change that the text leaves open. Many cases have a [`Mistake`]: a misreading whose picture is at least twice the tolerance
//! away. The program writes the folder that is beside this crate; `gaurast compare --compliance` compares pictures with it.

mod case;
mod expected;
mod gaussian;
mod gltf_cases;
mod gltf_file;
mod manifest;
mod pipeline_cases;
mod ply_file;
mod usd_cases;
mod usd_file;

pub use case::{Case, Freedom, Level, Mistake, Pipeline, Source};
pub use expected::{Expected, ExpectedError};
pub use manifest::{WriteError, write};

/// All cases.
pub fn cases() -> Vec<Case> {
    let mut cases = gltf_cases::all();
    cases.extend(usd_cases::all());
    cases.extend(pipeline_cases::all());
    cases
}
