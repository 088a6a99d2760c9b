//! Programs of random control flow give the results of a scalar interpreter, on this driver and on lavapipe.

use gaurast_runner::Need;
use gaurast_tests::programs::structured::{INVOCATIONS, Program, assemble, generate, run};
use gaurast_workloads::kernels::{Context, Kernel};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use std::borrow::Cow;
use std::process::Command;

use super::lavapipe;

/// The number of programs of a shader.
const PROGRAMS: u64 = 20;
/// The number of seeds on this driver.
const SEEDS: u64 = 4000;
/// The number of seeds on lavapipe, whose compiler is slow.
const SAMPLE: u64 = 100;

/// The inputs of invocations: small numbers, so that conditions are sometimes true and sometimes false, and random
/// ones.
fn inputs() -> Vec<[u32; 2]> {
    let mut random = ChaCha8Rng::seed_from_u64(71);
    (0..INVOCATIONS)
        .map(|lane| match lane % 3 {
            0 => [random.random_range(0..8), random.random_range(0..8)],
            1 => [random.random_range(0..8), random.random()],
            _ => random.random(),
        })
        .collect()
}

fn kernel(spirv: &[u32], inputs: &[[u32; 2]], programs: usize) -> Kernel {
    Kernel {
        name: "structured",
        spirv: Cow::Owned(bytemuck::pod_collect_to_vec(spirv)),
        specialization: Vec::new(),
        buffers: vec![inputs.as_flattened().to_vec(), vec![0xdead_beef; 2 * INVOCATIONS * programs]],
        uniform: None,
        push: Vec::new(),
        groups: [1, 1, 1],
        expected: Vec::new(),
    }
}

/// Runs the programs of seeds; returns the seeds with wrong results and the differences.
fn differences(
    context: &Context,
    seeds: std::ops::Range<u64>,
    rewrite: impl Fn(Vec<u32>) -> Vec<u32>,
) -> Vec<(u64, String)> {
    let inputs = inputs();
    let programs: Vec<Program> = seeds.clone().into_par_iter().map(|seed| generate(seed, &inputs)).collect();
    let spirv = rewrite(assemble(&programs));
    let kernel = kernel(&spirv, &inputs, programs.len());
    let place = || format!("seeds {seeds:?} on {}", context.name);
    let prepared = context.prepare(&kernel).unwrap_or_else(|error| panic!("{}: {error}", place()));
    prepared.run().unwrap_or_else(|error| panic!("{}: {error}", place()));
    let found = prepared.read(1);
    let mut wrong = Vec::new();
    for ((seed, program), found) in seeds.zip(&programs).zip(found.chunks(2 * INVOCATIONS)) {
        let differs = |(inputs, found): (&[u32; 2], &[u32])| {
            let expected = run(program, *inputs, u32::MAX).expect("it ends");
            let text = || format!("seed {seed} of {inputs:?}: {found:?} instead of {expected:?}");
            (found != expected).then(|| (seed, text()))
        };
        wrong.extend(inputs.iter().zip(found.chunks(2)).find_map(differs));
    }
    wrong
}

/// Runs the programs of `seeds` seeds. Seeds with wrong results must be in the list, which gives a reason for each;
/// with an empty list there may be none. The list of another driver was made with one version of it on one processor,
/// so a few more may be wrong, but no more than the list has.
fn check(context: &Context, seeds: u64, list: &str, rewrite: impl Fn(Vec<u32>) -> Vec<u32> + Copy) {
    let listed: Vec<u64> = list
        .lines()
        .filter(|line| !line.starts_with('#'))
        .map(|line| line.split_once(": ").expect("a seed, a colon and a reason").0)
        .map(|seed| seed.parse().expect("a number"))
        .collect();
    let wrong: Vec<(u64, String)> = (0..seeds)
        .step_by(PROGRAMS as usize)
        .flat_map(|first| differences(context, first..(first + PROGRAMS).min(seeds), rewrite))
        .collect();
    let unlisted: Vec<_> = wrong.iter().filter(|(seed, _)| !listed.contains(seed)).collect();
    assert!(
        unlisted.len() <= 2 * listed.len(),
        "{}: of {seeds} programs {} are wrong, and of these the list lacks {unlisted:#?}",
        context.name,
        wrong.len()
    );
}

/// Runs an installed program on a module; returns its output.
fn system(program: &str, arguments: &[&str], words: &[u32]) -> Vec<u8> {
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), bytemuck::cast_slice(words)).unwrap();
    let mut command = Command::new(program);
    let output = command.args(arguments).arg(file.path()).output().unwrap();
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{program}: {message}");
    output.stdout
}

#[gaurast_runner::test]
fn random_programs_give_what_the_interpreter_says() {
    check(&Context::gaurast().unwrap(), SEEDS, "", |words| words);
}

#[gaurast_runner::test(needs = [Need::Program("spirv-opt"), Need::Program("spirv-val")])]
fn optimized_programs_give_the_same() {
    let context = Context::gaurast().unwrap();
    check(&context, SEEDS / 10, "", |words| {
        system("spirv-val", &["--target-env", "vulkan1.2"], &words);
        bytemuck::pod_collect_to_vec(&system("spirv-opt", &["-O", "-o", "-"], &words))
    });
}

#[gaurast_runner::test(needs = [Need::Lavapipe])]
fn random_programs_give_the_same_on_lavapipe() {
    check(&lavapipe(), SAMPLE, include_str!("../../expected_failures/lavapipe_structured.txt"), |words| words);
}
