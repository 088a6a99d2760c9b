//! Orders of the last picture, repaired: where a camera leaves most of an order as it is, and nowhere else.

use super::unchanged::{Edit, of_append, of_begin, with_bands_of_zeros};
use super::*;

/// A set that is drawn twice, by cameras beside each other.
pub(super) fn from_two_sides() -> Vec<Packet> {
    let mut packets = gaussians_in(false, 51, 3000, OVER);
    let again = packets.clone();
    move_by([0.1, 0.05, -0.02], &mut packets);
    packets.extend(again);
    packets
}

fn begin_of(packets: &mut [Packet]) -> &mut GaussianBegin {
    match &mut packets[0] {
        Packet::GaussianBegin(begin) => begin,
        _ => panic!("what a set begins with"),
    }
}

fn move_by(by: [f64; 3], packets: &mut [Packet]) {
    let eye = &mut begin_of(packets).camera.eye;
    for (eye, by) in eye.iter_mut().zip(by) {
        *eye += by;
    }
}

/// Turns about the vertical axis through the eye, and rolls.
fn turn(packets: &mut [Packet], angle: f32, roll: f32) {
    let ((s, c), (t, d)) = (angle.sin_cos(), roll.sin_cos());
    let rows = [[d * c, -t, -d * s], [t * c, d, -t * s], [s, 0.0, c]];
    begin_of(packets).camera.rotation = rows.as_flattened().try_into().unwrap();
}

fn moved(by: [f64; 3]) -> Edit {
    Box::new(move |packets| move_by(by, packets))
}

fn turned(angle: f32, roll: f32) -> Edit {
    Box::new(move |packets| turn(packets, angle, roll))
}

/// Draws `packets`, of which chunks are made for the second picture, twice, and then after each change; says in which of
/// the pictures after changes the order was repaired. Every picture is that of a device without optimizations.
fn repaired(config: &Config, packets: &mut [Packet], changes: Vec<Edit>) -> Vec<u64> {
    let mut processor = CommandProcessor::new(Arc::new(Device::new(config).unwrap()));
    let nothing: fn() -> Edit = || Box::new(|_| {});
    let changes = [nothing(), nothing()].into_iter().chain(changes);
    let pictures = changes.map(|mut change| {
        change(packets);
        let counters = draw_as_without_skips(&mut processor, packets);
        assert!(counters.get(Counter::GaussiansDrawn) > 100);
        counters.get(Counter::OrdersRepaired)
    });
    let pictures: Vec<u64> = pictures.collect();
    assert_eq!(pictures[..2], [0, 0]);
    pictures[2..].to_vec()
}

#[gaurast_runner::test]
fn cameras_that_slide_and_roll_keep_the_order() {
    for threads in [1, 2, 3] {
        let config = Config {
            threads,
            ..single()
        };
        let changes = || {
            vec![
                moved([0.02, 0.0, 0.0]),
                moved([0.0, 0.01, 0.03]),
                turned(0.0, 0.3),
                moved([-0.1, 0.1, -0.2]),
                turned(1e-7, 0.4),
                turned(0.8, 0.4),
                moved([0.01, 0.01, 0.01]),
            ]
        };
        let expected = [1, 1, 1, 1, 1, 0, 1];
        let mut many = gaussians_in(false, 52, 20_000, OVER);
        assert_eq!(repaired(&config, &mut many, changes()), expected);
        let mut banded = with_bands_of_zeros();
        assert_eq!(repaired(&config, &mut banded, changes()), expected);
    }
}

#[gaurast_runner::test]
fn other_orders_are_repaired_too() {
    let by =
        |order| -> Edit { of_begin(move |begin| Arc::make_mut(&mut begin.state).order = order) };
    let mut packets = gaussians_in(false, 53, 5000, OVER);
    let changes = vec![
        by(GaussianOrder::RadialDistance),
        moved([1e-5, 0.0, 0.0]),
        turned(0.3, 0.0),
        by(GaussianOrder::Primitive),
        // What is seen is nearly the same.
        turned(0.29, 0.0),
        by(GaussianOrder::PerPixel),
        moved([0.1, 0.0, 0.0]),
    ];
    let found = repaired(&single(), &mut packets, changes);
    assert_eq!(found, [0, 1, 0, 0, 1, 1, 1]);
}

#[gaurast_runner::test]
fn what_has_other_places_is_sorted() {
    let slide = || moved([0.01, 0.0, 0.0]);
    let mut packets = gaussians_in(false, 54, 5000, OVER);
    let changes = vec![
        slide(),
        of_append(|append| append.count -= 300),
        // Chunks are made.
        slide(),
        slide(),
        of_append(|append| {
            let memory = &append.attributes.position.buffer.memory;
            memory.write(0, &[0.5f32]).unwrap();
            memory.bump_generation();
        }),
    ];
    let found = repaired(&single(), &mut packets, changes);
    assert_eq!(found, [1, 0, 0, 1, 0]);
    let mut mapped = gaussians_in(true, 55, 5000, OVER);
    assert_eq!(
        repaired(&single(), &mut mapped, vec![slide(), slide()]),
        [0, 0]
    );
}

#[gaurast_runner::test]
fn it_needs_no_other_skip() {
    let packets = gaussians_in(false, 56, 3000, OVER);
    let over_black = LoadOp::Clear(ClearValue::Float([0.0, 0.0, 0.0, 1.0]));
    // It is drawn twice; without chunks there is an order from the first picture on.
    let (_, counters) = draw(
        Optimizations::NONE.with(Optimization::OrderRepair),
        &packets,
        over_black,
    );
    assert_eq!(counters.get(Counter::OrdersRepaired), 1);
}
