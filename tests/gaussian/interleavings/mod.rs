//! Random sequences of all steps that one command processor executes, with triangles and Gaussians in the same passes.
//! They are compared with a binary64 composite of their parts, and are the same to the bit for all flush policies.

mod device;
mod model;
mod sequence;

use std::collections::HashSet;
use std::mem::discriminant;
use std::path::PathBuf;
use std::sync::Arc;

use device::Player;
use model::Model;
use rayon::prelude::*;
use sequence::{Interleaving, SIZE};
use simdevice::runtime::FlushPolicy;
use simdevice::stats::recorder::{Recorder, Trace};

/// The recorded work of a random interleaving.
pub(super) fn work(seed: u64) -> Trace {
    let recorder = Arc::new(Recorder::default());
    let player = Player::recording(FlushPolicy::WhenFull, Some(Arc::clone(&recorder)));
    player.play(&Interleaving::random(seed));
    recorder.trace()
}

#[gaurast_runner::test]
fn interleavings_are_the_composite_of_their_parts_whenever_they_are_flushed() {
    let players = |flush| Player::new(flush);
    let (never, always) = (players(FlushPolicy::WhenFull), players(FlushPolicy::EveryDraw));
    let judged: Vec<(usize, usize)> = (0..200)
        .into_par_iter()
        .map(|seed| {
            let interleaving = Interleaving::random(seed);
            let drawn = never.play(&interleaving);
            assert!(drawn == always.play(&interleaving), "{seed}: flushing every draw");
            let some = players(FlushPolicy::SomeDraws(seed));
            assert!(drawn == some.play(&interleaving), "{seed}: flushing some draws");
            let mut model = Model::new(&interleaving);
            model.play();
            model.judge(seed, &drawn)
        })
        .collect();
    let unknown: usize = judged.iter().map(|(unknown, _)| unknown).sum();
    let open: usize = judged.iter().map(|(_, open)| open).sum();
    let pixels = 200 * (SIZE * SIZE) as usize;
    assert!(unknown * 10_000 < pixels, "{unknown} pixels are not known");
    assert!(open * 100 < pixels, "{open} pixels have several outcomes");
}

/// The first interleaving that contains every kind of step.
fn example() -> Interleaving {
    const KINDS: usize = 10;
    let has_all = |interleaving: &Interleaving| {
        let kinds: HashSet<_> = interleaving.steps.iter().map(discriminant).collect();
        kinds.len() == KINDS
    };
    let mut interleavings = (0..10_000).map(Interleaving::random);
    interleavings.find(has_all).expect("one that has all")
}

/// The packets of an interleaving, one per line, equal those in the file `trace.txt`. With `GAURAST_BLESS` set, the
/// file is rewritten.
#[gaurast_runner::test]
fn the_packets_of_an_interleaving_are_as_written_down() {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("gaussian/interleavings/trace.txt");
    let packets = Player::new(FlushPolicy::WhenFull).packets(&example());
    let mut text = String::new();
    for packet in packets {
        text += &format!("{packet}\n");
    }
    if std::env::var_os("GAURAST_BLESS").is_some() {
        std::fs::write(&path, &text).expect("the trace is written");
    }
    let expected = std::fs::read_to_string(&path).expect("the trace is there");
    for (number, (line, expected)) in text.lines().zip(expected.lines()).enumerate() {
        assert_eq!(line, expected, "line {}", number + 1);
    }
    assert_eq!(text.lines().count(), expected.lines().count());
}
