//! The states of the command processor: a packet in the wrong state is an error, and leaves the processor usable.

use crate::common::*;
use simdevice::command_processor::ExecutionError;
use simdevice::packet::*;
use simdevice::stats::query::{QueryKind, QueryPool, QueryResult, host_time};
use simdevice::{BufferRange, CommandProcessor, Device, Format, Packet};
use std::sync::Arc;

fn processor() -> CommandProcessor {
    CommandProcessor::new(Arc::new(Device::new(&single()).unwrap()))
}

fn pass() -> Packet {
    let view = image(Format::R8G8B8A8Unorm, 1, 0);
    Packet::BeginRendering(Box::new(rendering(attachment(&view, LoadOp::Load))))
}

fn fill() -> Packet {
    let view = image(Format::R8Unorm, 1, 0);
    let memory = view.image.memory.clone();
    Packet::FillBuffer { target: BufferRange { memory, offset: 0, size: 16 }, word: 1 }
}

#[gaurast_runner::test]
fn what_needs_a_pass_is_refused_outside_of_one() {
    let mut processor = processor();
    let [begin, append, resolve] = &gaussians(1, 3, OVER)[..] else {
        panic!("three packets");
    };
    let outside = Err(ExecutionError::OutsidePass);
    assert_eq!(processor.execute(begin), outside);
    assert_eq!(processor.execute(&clear(vec![], &[])), outside);
    assert_eq!(processor.execute(&Packet::EndRendering), outside);
    let no_set = Err(ExecutionError::NoGaussianSet);
    assert_eq!(processor.execute(append), no_set);
    assert_eq!(processor.execute(resolve), no_set);
    assert_eq!(processor.execute(&Packet::Barrier), Ok(()));
    assert_eq!(processor.execute(&fill()), Ok(()));
}

#[gaurast_runner::test]
fn what_does_not_belong_in_a_pass_is_refused_there() {
    let mut processor = processor();
    assert_eq!(processor.execute(&pass()), Ok(()));
    assert!(processor.in_pass());
    let inside = Err(ExecutionError::InsidePass);
    assert_eq!(processor.execute(&pass()), inside);
    assert_eq!(processor.execute(&fill()), inside);
    assert_eq!(processor.execute(&Packet::EndRendering), Ok(()));
    assert_eq!(processor.execute(&fill()), Ok(()));
}

#[gaurast_runner::test]
fn sets_of_gaussians_do_not_nest_or_outlive_the_pass() {
    let mut processor = processor();
    let [begin, append, resolve] = &gaussians(1, 3, OVER)[..] else {
        panic!("three packets");
    };
    let open = Err(ExecutionError::GaussianSetOpen);
    processor.execute(&pass()).unwrap();
    processor.execute(begin).unwrap();
    assert_eq!(processor.execute(begin), open);
    // Other draws come before the set, which is drawn where it ends.
    assert_eq!(processor.execute(&clear(vec![], &[])), Ok(()));
    processor.execute(append).unwrap();
    processor.execute(append).unwrap();
    processor.execute(resolve).unwrap();
    assert_eq!(processor.execute(resolve), Err(ExecutionError::NoGaussianSet));
    processor.execute(begin).unwrap();
    assert_eq!(processor.execute(&Packet::EndRendering), open);
    assert!(!processor.in_pass());
    processor.execute(&pass()).unwrap();
    processor.execute(begin).unwrap();
    processor.reset();
    assert_eq!(processor.execute(&Packet::GaussianEnd), Err(ExecutionError::NoGaussianSet));
    processor.execute(&pass()).unwrap();
}

#[gaurast_runner::test]
fn attachments_that_cannot_be_rendered_to_begin_no_pass() {
    let mut processor = processor();
    let mut view = image(Format::R8Unorm, 1, 0);
    view.base_layer = 5;
    let packet = Packet::BeginRendering(Box::new(rendering(attachment(&view, LoadOp::Load))));
    assert!(matches!(processor.execute(&packet), Err(ExecutionError::Attachment(_))));
    assert!(!processor.in_pass());
}

#[gaurast_runner::test]
fn timestamps_ascend() {
    let mut processor = processor();
    let pool = Arc::new(QueryPool::new(QueryKind::Timestamp, 2));
    let before = host_time();
    for index in 0..2 {
        let pool = pool.clone();
        processor.execute(&Packet::WriteTimestamp { pool, index }).unwrap();
    }
    let stamp = |index| match pool.result(index) {
        Some(QueryResult::Timestamp(nanoseconds)) => nanoseconds,
        other => panic!("{other:?}"),
    };
    assert!(before <= stamp(0) && stamp(0) <= stamp(1) && stamp(1) <= host_time());
    let (first, count) = (0, 1);
    processor.execute(&Packet::ResetQueries { pool: pool.clone(), first, count }).unwrap();
    assert_eq!(pool.result(0), None);
    assert!(pool.result(1).is_some());
}

#[gaurast_runner::test]
fn updates_arrive() {
    let mut processor = processor();
    let view = image(Format::R8Unorm, 1, 0);
    let target = BufferRange { memory: view.image.memory.clone(), offset: 8, size: 4 };
    let data = Arc::from([1u8, 2, 3, 4]);
    processor.execute(&Packet::UpdateBuffer { target, data }).unwrap();
    assert_eq!(bytes(&view)[6..14], [0, 0, 1, 2, 3, 4, 0, 0]);
}
