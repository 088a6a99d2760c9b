//! Deterministic runs of the fuzz targets (see `tests/fuzz`): scene files, Vulkan calls and packets from bytes that are
//! random, or seeds that are changed at random. Nothing panics, in whatever thread.
//!
//! `GAURAST_FUZZ_RUNS` says how many of each; the numbers of a failure's message make it happen again alone:
//! `GAURAST_FUZZ_RUNS=1 GAURAST_FUZZ_FIRST=n`.

use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};

use gaurast_tests::fuzzing::packets::Player;
use gaurast_tests::fuzzing::{calls, loaders, mutate_bytes};
use rand::seq::IndexedRandom;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// What panicked, in whatever thread: the driver catches panics, so that an application never sees them.
static PANICS: Mutex<Vec<String>> = Mutex::new(Vec::new());

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

fn number(variable: &str, otherwise: u64) -> u64 {
    match std::env::var(variable) {
        Ok(text) => text.parse().expect("a number"),
        Err(_) => otherwise,
    }
}

/// The files that fuzzing of a target begins with.
fn corpus(name: &str) -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("fuzz/corpus")
        .join(name);
    let mut paths: Vec<_> = std::fs::read_dir(folder)
        .expect("a corpus")
        .map(|entry| entry.expect("an entry").path())
        .collect();
    paths.sort();
    paths
        .iter()
        .map(|path| std::fs::read(path).expect("readable"))
        .collect()
}

/// Runs a target on seeds, then on changed ones and on random bytes of up to `longest`; one test at a time, since panics
/// are the process's.
fn fuzz(runs: u64, seeds: &[Vec<u8>], longest: usize, mut target: impl FnMut(&[u8])) {
    static ONE: Mutex<()> = Mutex::new(());
    let _one = lock(&ONE);
    std::panic::set_hook(Box::new(|info| {
        eprintln!("{info}\n{}", std::backtrace::Backtrace::force_capture());
        lock(&PANICS).push(info.to_string());
    }));
    // Those of a test that failed before are that test's.
    lock(&PANICS).clear();
    for (number, seed) in seeds.iter().enumerate() {
        target(seed);
        let panics = std::mem::take(&mut *lock(&PANICS));
        assert!(panics.is_empty(), "seed {number}: {panics:?}");
    }
    let first = number("GAURAST_FUZZ_FIRST", 0);
    for run in first..first + number("GAURAST_FUZZ_RUNS", runs) {
        let mut random = ChaCha8Rng::seed_from_u64(run);
        let data = if seeds.is_empty() || random.random_bool(0.3) {
            let len = random.random_range(0..longest);
            (0..len).map(|_| random.random()).collect()
        } else {
            let pick = |random: &mut ChaCha8Rng| seeds.choose(random).expect("some").clone();
            let (seed, other) = (pick(&mut random), pick(&mut random));
            mutate_bytes(&mut random, &seed, &other)
        };
        // A panic of this thread is no less one.
        let ran = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| target(&data)));
        let panics = std::mem::take(&mut *lock(&PANICS));
        assert!(ran.is_ok() && panics.is_empty(), "run {run}: {panics:?}");
    }
}

#[test]
fn scene_files_are_read_or_refused() {
    let (mut read, mut refused) = (0, 0);
    let seeds = [loaders::seeds(), corpus("scene_files")].concat();
    fuzz(20_000, &seeds, 300, |data| match loaders::load(data) {
        Some(_) => read += 1,
        None => refused += 1,
    });
    println!("{read} read, {refused} refused");
    assert!(read > refused / 50 && refused > 0);
}

#[test]
fn packets_are_executed_or_refused() {
    let player = Player::new();
    let (mut executed, mut refused) = (0, 0);
    fuzz(4000, &corpus("packets"), 2000, |data| {
        let fared = player.run(data);
        executed += fared.executed;
        refused += fared.refused;
    });
    println!("{executed} executed, {refused} refused");
    assert!(executed > refused / 4 && refused > 0);
}

#[test]
fn calls_succeed_or_fail() {
    let (mut succeeded, mut failed, mut submitted, mut lost) = (0, 0, 0, Vec::new());
    fuzz(4000, &corpus("calls"), 3000, |data| {
        let ended = calls::run(data);
        succeeded += ended.succeeded;
        failed += ended.failed;
        submitted += ended.submitted;
        lost.extend(ended.lost);
    });
    println!("{succeeded} succeeded, {failed} failed, {submitted} submitted");
    assert!(succeeded > failed && submitted > 0);
    // What is against the rules is refused where it is recorded, with a message, and nothing here takes long.
    assert_eq!(lost, [""; 0], "devices were lost");
}
