//! Optimizations: each saves work, and none changes a bit of the picture.
//!
//! Every scene is drawn twice to a target, because some optimizations use data that the first draw prepares.

mod degrees;
mod drawing;
mod hidden;
mod unchanged;

use crate::common::single;
use drawing::{bounded_modes, chunks_built, draw, draw_again, scenes};
use simdevice::Config;
use simdevice::format::ClearValue;
use simdevice::packet::LoadOp;
use simdevice::stats::counters::{Counter, Counters};
use simdevice::stats::optimizations::{Optimization, Optimizations};

#[gaurast_runner::test]
fn every_mode_has_bounds_that_change_no_bit() {
    let over_black = LoadOp::Clear(ClearValue::Float([0.0, 0.0, 0.0, 1.0]));
    for (mode, packets) in bounded_modes() {
        let (without, _) = draw(Optimizations::NONE, &packets, over_black);
        let saved = |optimizations, counter| {
            let (image, counters) = draw(optimizations, &packets, over_black);
            assert!(image == without, "{mode}");
            counters.get(counter)
        };
        let chunks = Optimizations::ALL.without(Optimization::Bounds);
        let by_chunks = saved(chunks, Counter::OutsideByClusters);
        let bounds = Optimizations::ALL.without(Optimization::ClusterCulling);
        let by_bounds = saved(bounds, Counter::OutsideByBounds);
        assert!(by_chunks > 0, "{mode}: no chunk is beside the picture");
        assert!(by_bounds > 2 * by_chunks, "{mode}: {by_bounds} {by_chunks}");
    }
}

#[gaurast_runner::test]
fn every_skip_saves_work() {
    let mut saved = Counters::default();
    for (_, packets, load) in scenes() {
        saved.add_all(&draw(Optimizations::ALL, &packets, load).1);
    }
    for &optimization in Optimization::ALL {
        assert!(saved.get(optimization.counter()) > 0, "{optimization:?} saved nothing");
    }
}

#[gaurast_runner::test(each = gaurast_runner::shards(4))]
fn no_skip_changes_a_bit(case: &gaurast_runner::Case) {
    let all = scenes().into_iter().enumerate();
    for (_, (scene, packets, load)) in all.filter(|(number, _)| case.shard().has(*number)) {
        let (image, _) = draw(Optimizations::ALL, &packets, load);
        let (other, without) = draw(Optimizations::NONE, &packets, load);
        assert!(other == image, "{scene}: without any optimization");
        for &optimization in Optimization::ALL {
            assert_eq!(without.get(optimization.counter()), 0, "{scene}: {optimization:?}");
            for optimizations in [Optimizations::ALL.without(optimization), Optimizations::NONE.with(optimization)] {
                let (other, counters) = draw(optimizations, &packets, load);
                assert!(other == image, "{scene}: {optimizations:?}");
                let count = counters.get(optimization.counter());
                assert!(count == 0 || optimizations.has(optimization), "{scene}: {optimization:?}");
            }
        }
    }
}

#[gaurast_runner::test]
fn without_skips_everything_is_worked_on() {
    for (scene, packets, load) in scenes() {
        let (_, counters) = draw(Optimizations::NONE, &packets, load);
        let pairs = counters.get(Counter::TilePairs);
        assert_eq!(counters.get(Counter::TilePairsEvaluated), pairs, "{scene}");
        assert_eq!(counters.get(Counter::BlockEvaluations), 16 * pairs, "{scene}");
    }
}

#[gaurast_runner::test]
fn chunks_are_made_once() {
    let passes = draw_again(&single(), |_, _| {});
    assert_eq!(chunks_built(&passes), [0, 79, 0, 0]);
    let left_out = |pass: &Counters| pass.get(Counter::OutsideByClusters);
    assert_eq!(left_out(&passes[0]), 0);
    assert!(left_out(&passes[3]) > 0);
    for pass in &passes {
        assert_eq!(pass.get(Counter::GaussiansRead), 20_000);
        let drawn = pass.get(Counter::GaussiansDrawn);
        assert_eq!(drawn, passes[0].get(Counter::GaussiansDrawn));
    }
}

#[gaurast_runner::test]
fn chunks_are_made_anew_when_the_memory_was_written() {
    let far = [0.0f32, 0.0, 1e3];
    let passes = draw_again(&single(), |pass, memory| {
        if pass == 1 {
            memory.write(0, &far).unwrap();
            memory.bump_generation();
        }
    });
    assert_eq!(chunks_built(&passes), [0, 79, 0, 79]);
}

#[gaurast_runner::test]
fn chunks_stay_within_their_budget() {
    let config = Config { cluster_budget_bytes: 100_000, ..single() };
    assert_eq!(chunks_built(&draw_again(&config, |_, _| {})), [0; 4]);
}
