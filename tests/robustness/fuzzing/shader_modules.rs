//! Modules whose bytes and instructions are changed at random go through pipeline creation and a dispatch. Each is
//! refused, runs, or loses its device within the time limit. Nothing panics, and nothing outside the bound ranges is
//! written.

use std::path::Path;

use gaurast_runner::{Case, shards};
use gaurast_tests::fuzzing::{Harness, Layout, Outcome, mutate};
use gaurast_tests::programs::structured;
use rand::seq::IndexedRandom;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::watch::{are_many, panics, runs, watch_panics};

/// The checked-in compute shaders that use only buffers, and some with random control flow.
fn seeds() -> Vec<(String, Vec<u32>, Layout)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../driver/spirv/tests/shaders");
    let mut names: Vec<_> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.to_string_lossy().ends_with(".comp.spv"))
        .collect();
    names.sort();
    let kept = names.into_iter().map(|path| {
        let words = bytemuck::pod_collect_to_vec(&std::fs::read(&path).unwrap());
        (path.file_name().unwrap().to_string_lossy().into_owned(), words)
    });
    let made = (0..8).map(|seed| {
        let program = structured::generate(seed, &[[seed as u32, 3]]);
        (format!("structured {seed}"), structured::assemble(&[program]))
    });
    kept.chain(made).filter_map(|(name, words)| Layout::of(&words).map(|layout| (name, words, layout))).collect()
}

/// Modules that fuzzing has found. Descriptors that the test cannot provide are not bound.
fn found() -> Vec<(String, Vec<u32>)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus/shader_modules");
    let mut paths: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    let read = |path: &std::path::PathBuf| {
        let mut bytes = std::fs::read(path).unwrap();
        bytes.truncate(bytes.len() / 4 * 4);
        (path.display().to_string(), bytemuck::pod_collect_to_vec(&bytes))
    };
    paths.iter().map(read).collect()
}

#[gaurast_runner::test(each = shards(4), alone)]
fn mutated_modules_never_panic_and_never_write_elsewhere(case: &Case) {
    watch_panics();
    let seeds = seeds();
    assert!(seeds.len() > 20, "there should be shaders to begin with");
    let mut harness = Harness::new();
    for (number, (name, words)) in found().into_iter().enumerate() {
        if case.shard().has(number) {
            harness.run(&words, &Layout::of(&words).unwrap_or_default());
            let panics = panics();
            assert!(panics.is_empty(), "{name}: {panics:?}");
        }
    }
    let runs = runs(case, 3000);
    let mut counts = [0u64; 3];
    for run in runs.clone() {
        let mut random = ChaCha8Rng::seed_from_u64(run);
        let (name, words, layout) = seeds.choose(&mut random).unwrap();
        let other = &seeds[random.random_range(0..seeds.len())].1;
        let words = mutate(&mut random, words, other);
        counts[match harness.run(&words, layout) {
            Outcome::Refused => 0,
            Outcome::Ran => 1,
            Outcome::Lost => 2,
        }] += 1;
        let panics = panics();
        assert!(panics.is_empty(), "run {run}, of {name}: {panics:?}");
    }
    let [refused, ran, lost] = counts;
    assert!(
        !are_many(&runs) || ran > (refused + ran + lost) / 20,
        "mutations should leave some modules valid: {refused} refused, {ran} ran, {lost} lost their device"
    );
}
