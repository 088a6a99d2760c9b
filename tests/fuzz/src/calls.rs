//! Fuzz target: the bytes are decoded as Vulkan calls.
#![no_main]

use gaurast_tests::fuzzing::calls;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    calls::run(data);
});
