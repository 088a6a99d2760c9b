//! Fuzz target: the bytes are read as a scene file, whose kind the first byte selects.
#![no_main]

use gaurast_tests::fuzzing::loaders;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    // Both an error and a scene are valid results.
    let _ = loaders::load(data);
});
