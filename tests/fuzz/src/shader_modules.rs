//! Any bytes as a shader module: it is refused, runs, or loses its device in time. A panic in the driver, which catches
//! them so that applications never see one, ends the process here.

#![no_main]

use gaurast_tests::fuzzing::{Harness, Layout};
use libfuzzer_sys::fuzz_target;
use std::cell::RefCell;

thread_local! {
    static HARNESS: RefCell<Option<Harness>> = const { RefCell::new(None) };
}

/// The device, with a short time limit, in a process that ends at the first panic.
fn open() -> Harness {
    // SAFETY: no other thread runs yet that reads the environment.
    unsafe { std::env::set_var("GAURAST_TIMEOUT_MS", "20") };
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
        // A module whose descriptors can't be had still goes through creation.
        let layout = Layout::of(&words).unwrap_or_default();
        harness.run(&words, &layout);
    });
});
