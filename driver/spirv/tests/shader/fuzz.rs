//! Tests of mutated modules: any words are translated or refused, without a panic and in bounded time.

use std::time::{Duration, Instant};

use crate::common::{OPTIONS, Random, all_shaders, stage_of, words_of};
use fearless_simd::Level;
use gaurast_runner::{Case, shards};
use gaurast_spirv::{Module, Specialization, translate};
use isa::Options as ExecOptions;
use isa::machine::Executable;

/// Translates a module if it can, and compiles the program for the device. Returns true if that worked.
fn attempt(name: &str, words: &[u32]) -> bool {
    let Ok(module) = Module::parse(words) else {
        return false;
    };
    let specialization = Specialization::default();
    let Ok(shader) = translate(&module, "main", stage_of(name), &specialization, &OPTIONS) else {
        return false;
    };
    let options = ExecOptions::new(Level::new());
    Executable::new(shader.program, &options).is_ok()
}

/// The word at which the instructions of a module begin.
fn instructions(words: &[u32]) -> Vec<usize> {
    let mut starts = Vec::new();
    let mut at = 5;
    while at < words.len() && words[at] >> 16 > 0 {
        starts.push(at);
        at += (words[at] >> 16) as usize;
    }
    starts
}

fn mutate(random: &mut Random, original: &[u32]) -> Vec<u32> {
    let mut words = original.to_vec();
    let bound = words[3] as usize;
    for _ in 0..=random.below(3) {
        let starts = instructions(&words);
        let Some(start) = starts.get(random.below(starts.len())).copied() else {
            break;
        };
        let count = ((words[start] >> 16) as usize).min(words.len() - start);
        match random.below(9) {
            // A byte anywhere.
            0 => {
                let at = random.below(words.len());
                words[at] ^= (random.next() & 0xff) << (8 * random.below(4));
            }
            // An operand becomes another id, a small number or any.
            1..=3 if count > 1 => {
                let at = start + 1 + random.below(count - 1);
                words[at] = match random.below(4) {
                    0 => random.next(),
                    1 => random.below(16) as u32,
                    _ => random.below(bound) as u32,
                };
            }
            // Replaces the opcode.
            4 => words[start] = words[start] & 0xffff_0000 | random.below(460) as u32,
            // Removes, duplicates or moves an instruction.
            5 => drop(words.drain(start..start + count)),
            6 => {
                let copy = words[start..start + count].to_vec();
                words.splice(start..start, copy);
            }
            7 => {
                let moved: Vec<u32> = words.drain(start..start + count).collect();
                let starts = instructions(&words);
                let at = starts.get(random.below(starts.len())).copied().unwrap_or(5);
                words.splice(at..at, moved);
            }
            // The end is cut off.
            _ => words.truncate(words.len() - random.below(8)),
        }
    }
    words
}

#[gaurast_runner::test(each = shards(4), alone)]
fn mutated_modules_never_panic(case: &Case) {
    let shard = case.shard();
    let mut slowest = Duration::ZERO;
    let (mut runs, mut survivors) = (0, 0);
    for (index, name) in all_shaders().into_iter().enumerate() {
        if !shard.has(index) {
            continue;
        }
        let mut random = Random(0x5eed + index as u64);
        let original = words_of(&name);
        for _ in 0..400 {
            let words = mutate(&mut random, &original);
            let start = Instant::now();
            survivors += u32::from(attempt(&name, &words));
            slowest = slowest.max(start.elapsed());
            runs += 1;
        }
    }
    assert!(survivors > runs / 20, "mutations should leave some modules valid: {survivors} of {runs}");
    assert!(slowest < Duration::from_secs(5), "a module took {slowest:?}");
}

#[gaurast_runner::test(each = shards(4), alone)]
fn modules_cut_off_anywhere_are_refused(case: &Case) {
    let shard = case.shard();
    for (index, name) in all_shaders().into_iter().enumerate() {
        if !shard.has(index) {
            continue;
        }
        let words = words_of(&name);
        for length in 0..words.len() {
            assert!(!attempt(&name, &words[..length]), "{name} cut to {length} words");
        }
    }
}
