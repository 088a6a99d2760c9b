//! Any bytes as a scene file: the first says of which kind.
#![no_main]

use gaurast_tests::fuzzing::loaders;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    // An error is as good as a scene.
    let _ = loaders::load(data);
});
