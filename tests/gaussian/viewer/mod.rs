//! Features that viewers need: a camera for each view, sets with a beginning and an end, dynamic states, attributes in
//! the form of trained files, and picking. Each is compared with the oracle.

mod activation;
mod bench;
mod dynamic;
mod harmonics;
mod stereo;
