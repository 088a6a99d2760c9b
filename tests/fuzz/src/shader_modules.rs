//! Fuzz target: the bytes are used as a shader module, which is refused, runs, or loses its device within the time
//! limit. The driver catches panics, so that applications never see one; in this program every panic ends the process.

#![no_main]

use gaurast_tests::fuzzing::{Harness, Layout};
use libfuzzer_sys::fuzz_target;
use std::cell::RefCell;

thread_local! {
    static HARNESS: RefCell<Option<Harness>> = const { RefCell::new(None) };
}

/// Opens the device, and makes every panic end the process.
fn open() -> Harness {
    std::panic::set_hook(Box::new(|info| {
        eprintln!("{info}\n{}", std::backtrace::Backtrace::force_capture());
        std::process::abort();
    }));
    Harness::new()
}

fuzz_target!(|bytes: &[u8]| {
    let words: Vec<u32> = bytemuck::pod_collect_to_vec(&bytes[..bytes.len() / 4 * 4]);
    if words.is_empty() {
        return;
    }
    HARNESS.with_borrow_mut(|harness| {
        let harness = harness.get_or_insert_with(open);
        // A module whose descriptors cannot be determined is still created.
        let layout = Layout::of(&words).unwrap_or_default();
        harness.run(&words, &layout);
    });
});
