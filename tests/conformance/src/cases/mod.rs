//! The cases of all chapters, made from tables.

mod activation;
mod attachments;
mod chapter;
mod coded;
mod decoding;
mod descriptors;
mod distortion;
mod draws;
mod dynamic_state;
mod footprint;
mod harmonics_buffer;
mod input;
mod libraries;
mod limits;
mod modes;
mod numerics;
mod passes;
mod projection;
mod queries;
mod resolve;
mod scenes;
mod sets;
mod targets;
mod updates;
mod vertex_input;
mod views;

use chapter::Chapter;
pub use chapter::{Case, Subject};

type Write = fn(&mut Chapter<'_>);

/// The chapters in their order.
const CHAPTERS: [(&str, Write); 34] = [
    ("topology", input::topology),
    ("attributes", input::attributes),
    ("instances", input::instances),
    ("camera", modes::camera),
    ("distortion", distortion::distortion),
    ("order", modes::order),
    ("surfel", modes::surfel),
    ("unscented", modes::unscented),
    ("state", modes::state),
    ("harmonics", modes::harmonics),
    ("binary16", modes::binary16),
    ("approximation", modes::approximation),
    ("footprint", footprint::footprint),
    ("resolve", resolve::resolve),
    ("depth", attachments::depth),
    ("stencil", attachments::stencil),
    ("interactions", attachments::interactions),
    ("numerics", numerics::numerics),
    ("draws", draws::draws),
    ("sets", sets::sets),
    ("vertex_input", vertex_input::vertex_input),
    ("activation", activation::activation),
    ("harmonics_buffer", harmonics_buffer::harmonics_buffer),
    ("decoding", decoding::decoding),
    ("dynamic_state", dynamic_state::dynamic_state),
    ("views", views::views),
    ("projection", projection::projection),
    ("targets", targets::targets),
    ("passes", passes::passes),
    ("updates", updates::updates),
    ("descriptors", descriptors::descriptors),
    ("queries", queries::queries),
    ("libraries", libraries::libraries),
    ("limits", limits::limits),
];

/// The names of the chapters.
pub fn chapters() -> impl Iterator<Item = &'static str> {
    CHAPTERS.iter().map(|(name, _)| *name)
}

/// All cases but the largest draws, in the order of the chapters.
pub fn all() -> Vec<Case> {
    let mut cases = with_largest();
    cases.retain(|case| !case.is_large);
    cases
}

/// All cases, in the order of the chapters. The largest draws take minutes, and the oracle much memory for them.
pub fn with_largest() -> Vec<Case> {
    let mut cases = Vec::new();
    for (name, write) in CHAPTERS {
        write(&mut Chapter::new(name, &mut cases));
    }
    cases
}

/// Returns true if a path matches a pattern, in which `*` stands for any text. A pattern without `*` must be a part of
/// the path.
pub fn fits(path: &str, pattern: &str) -> bool {
    let Some((first, rest)) = pattern.split_once('*') else {
        return path.contains(pattern);
    };
    let Some(mut path) = path.strip_prefix(first) else {
        return false;
    };
    let mut parts: Vec<&str> = rest.split('*').collect();
    let last = parts.pop().unwrap_or_default();
    for part in parts {
        match path.find(part) {
            Some(at) => path = &path[at + part.len()..],
            None => return false,
        }
    }
    path.ends_with(last)
}
