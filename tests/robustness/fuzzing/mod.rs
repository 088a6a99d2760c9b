//! Deterministic runs of the fuzz targets (see `tests/fuzz`): scene files, Vulkan calls, packets and shader modules,
//! from random bytes or from seeds that are changed at random. No thread may panic.
//!
//! `GAURAST_FUZZ_RUNS` sets the number of runs of each target. To repeat a single failure, take its number n from the
//! message: `GAURAST_FUZZ_RUNS=1 GAURAST_FUZZ_FIRST=n`. Panics are recorded per process, and several processes share
//! the runs.

mod shader_modules;
mod watch;

use std::ops::Range;
use std::path::Path;

use gaurast_runner::{Case, shards};
use gaurast_tests::fuzzing::packets::Player;
use gaurast_tests::fuzzing::{calls, loaders, mutate_bytes};
use rand::seq::IndexedRandom;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use watch::{are_many, panics, runs, watch_panics};

/// The seed files of a fuzz target.
fn corpus(name: &str) -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus").join(name);
    let mut paths: Vec<_> =
        std::fs::read_dir(folder).expect("a corpus").map(|entry| entry.expect("an entry").path()).collect();
    paths.sort();
    paths.iter().map(|path| std::fs::read(path).expect("readable")).collect()
}

/// Runs a target on a shard's seeds, then on changed seeds and on random bytes of at most `longest`.
fn fuzz(case: &Case, runs: Range<u64>, seeds: &[Vec<u8>], longest: usize, mut target: impl FnMut(&[u8])) {
    watch_panics();
    for (number, seed) in seeds.iter().enumerate() {
        if case.shard().has(number) {
            target(seed);
            let panics = panics();
            assert!(panics.is_empty(), "seed {number}: {panics:?}");
        }
    }
    for run in runs {
        let mut random = ChaCha8Rng::seed_from_u64(run);
        let data = if seeds.is_empty() || random.random_bool(0.3) {
            let len = random.random_range(0..longest);
            (0..len).map(|_| random.random()).collect()
        } else {
            let pick = |random: &mut ChaCha8Rng| seeds.choose(random).expect("some").clone();
            let (seed, other) = (pick(&mut random), pick(&mut random));
            mutate_bytes(&mut random, &seed, &other)
        };
        // A panic of this thread counts as well.
        let ran = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| target(&data)));
        let panics = panics();
        assert!(ran.is_ok() && panics.is_empty(), "run {run}: {panics:?}");
    }
}

#[gaurast_runner::test(each = shards(4), alone)]
fn scene_files_are_read_or_refused(case: &Case) {
    let runs = runs(case, 20_000);
    let (mut read, mut refused) = (0, 0);
    let seeds = [loaders::seeds(), corpus("scene_files")].concat();
    fuzz(case, runs.clone(), &seeds, 300, |data| match loaders::load(data) {
        Some(_) => read += 1,
        None => refused += 1,
    });
    assert!(!are_many(&runs) || read > refused / 50 && refused > 0, "{read} read, {refused} refused");
}

#[gaurast_runner::test(each = shards(4), alone)]
fn packets_are_executed_or_refused(case: &Case) {
    let runs = runs(case, 4000);
    let player = Player::new();
    let (mut executed, mut refused) = (0, 0);
    fuzz(case, runs.clone(), &corpus("packets"), 2000, |data| {
        let fared = player.run(data);
        executed += fared.executed;
        refused += fared.refused;
    });
    assert!(!are_many(&runs) || executed > refused / 4 && refused > 0, "{executed} executed, {refused} refused");
}

#[gaurast_runner::test(each = shards(4), alone)]
fn calls_succeed_or_fail(case: &Case) {
    let runs = runs(case, 4000);
    let (mut succeeded, mut failed, mut submitted, mut lost) = (0, 0, 0, Vec::new());
    fuzz(case, runs.clone(), &corpus("calls"), 3000, |data| {
        let ended = calls::run(data);
        succeeded += ended.succeeded;
        failed += ended.failed;
        submitted += ended.submitted;
        lost.extend(ended.lost);
    });
    assert!(
        !are_many(&runs) || succeeded > failed && submitted > 0,
        "{succeeded} succeeded, {failed} failed, {submitted} submitted"
    );
    // Invalid usage is refused with a message when it is recorded, and no command takes long, so no device may be lost.
    assert_eq!(lost, [""; 0], "devices were lost");
}
