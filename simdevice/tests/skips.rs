//! Skips: each saves work, and none changes a bit.

mod common;

use common::*;
use simdevice::counters::{Counter, Counters};
use simdevice::packet::*;
use simdevice::skips::{Skip, Skips};
use simdevice::{CommandProcessor, Config, Device, Format, Packet};
use std::sync::Arc;

/// Few Gaussians, many, and several draws with a clear between them; how the attachment begins.
fn scenes() -> Vec<(&'static str, Vec<Packet>, LoadOp)> {
    let clear_part = clear(
        vec![AttachmentClear::Color {
            index: 0,
            value: ClearValue::Float([0.4, 0.1, 0.9, 0.5]),
        }],
        &[Rect {
            x: 30,
            y: 20,
            width: 40,
            height: 40,
        }],
    );
    let over_black = LoadOp::Clear(ClearValue::Float([0.0, 0.0, 0.0, 1.0]));
    let several = [
        gaussians(3, 20, OVER),
        vec![clear_part],
        gaussians(4, 300, OVER),
    ];
    vec![
        ("few", gaussians(1, 12, OVER), LoadOp::Load),
        ("many", gaussians(2, 5000, OVER), over_black),
        ("several", several.concat(), LoadOp::Load),
        ("nothing", Vec::new(), over_black),
    ]
}

/// Draws a scene on a device of its own.
fn draw(skips: Skips, packets: &[Packet], load: LoadOp) -> (Vec<u8>, Counters) {
    let config = Config { skips, ..single() };
    let target = image(Format::R32G32B32A32Sfloat, 1, 0x3E);
    let mut processor = CommandProcessor::new(Arc::new(Device::new(&config).unwrap()));
    let begin = Packet::BeginRendering(Box::new(rendering(attachment(&target, load))));
    for packet in [begin].iter().chain(packets).chain([&Packet::EndRendering]) {
        processor.execute(packet).unwrap();
    }
    (bytes(&target), processor.counters().clone())
}

#[test]
fn every_skip_saves_work_and_changes_no_bit() {
    let mut saved = Counters::default();
    for (scene, packets, load) in scenes() {
        let (image, counters) = draw(Skips::ALL, &packets, load);
        saved.add_all(&counters);
        let (other, without) = draw(Skips::NONE, &packets, load);
        assert!(other == image, "{scene}: without any skip");
        for &skip in Skip::ALL {
            assert_eq!(without.get(skip.counter()), 0, "{scene}: {skip:?}");
            for skips in [Skips::ALL.without(skip), Skips::NONE.with(skip)] {
                let (other, counters) = draw(skips, &packets, load);
                assert!(other == image, "{scene}: {skips:?}");
                let count = counters.get(skip.counter());
                assert!(count == 0 || skips.has(skip), "{scene}: {skip:?}");
            }
        }
    }
    for &skip in Skip::ALL {
        assert!(saved.get(skip.counter()) > 0, "{skip:?} saved nothing");
    }
}

#[test]
fn without_skips_everything_is_worked_on() {
    for (scene, packets, load) in scenes() {
        let (_, counters) = draw(Skips::NONE, &packets, load);
        let pairs = counters.get(Counter::TilePairs);
        assert_eq!(counters.get(Counter::TilePairsEvaluated), pairs, "{scene}");
        assert_eq!(
            counters.get(Counter::BlockEvaluations),
            16 * pairs,
            "{scene}"
        );
    }
}
