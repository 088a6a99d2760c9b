//! What viewers need: a camera for each view, sets with a beginning and an end, sliders that are dynamic states, attributes
//! as trained files hold them, and picking. Each is held against the oracle.

mod activation;
mod bench;
mod dynamic;
mod harmonics;
mod stereo;
