//! Chunks that draws of the same Gaussians with several degrees of spherical harmonics share.

use super::drawing::{draw_as_without_skips, with_bands_of_zeros};
use crate::common::single;
use simdevice::stats::counters::Counter;
use simdevice::{CommandProcessor, Config, Device, Packet};
use std::sync::Arc;

/// Draws Gaussians with coefficients up to degree 2, with each of these degrees in turn. Returns for each picture
/// whether chunks were made. Every picture must equal that of a device without optimizations.
fn built(cluster_budget_bytes: u64, degrees: &[u32]) -> Vec<bool> {
    let config = Config { cluster_budget_bytes, ..single() };
    let mut processor = CommandProcessor::new(Arc::new(Device::new(&config).unwrap()));
    let all = with_bands_of_zeros();
    let pictures = degrees.iter().map(|&degree| {
        let mut packets = all.clone();
        if let [Packet::GaussianBegin(begin), Packet::GaussianAppend(append), ..] = &mut packets[..] {
            Arc::make_mut(&mut begin.state).sh_degree = degree;
            let coefficients = (degree as usize + 1).pow(2);
            append.attributes.spherical_harmonics.truncate(coefficients);
        }
        let counters = draw_as_without_skips(&mut processor, &packets);
        counters.get(Counter::ClustersBuilt) > 0
    });
    pictures.collect()
}

/// A budget in bytes that is enough for all coefficients.
const AMPLE: u64 = 10 << 20;

/// A budget in bytes that is enough for the coefficients of degree 0, but not for all.
const SCARCE: u64 = 400_000;

#[gaurast_runner::test]
fn lower_degrees_take_what_higher_ones_have() {
    let degrees = [2, 2, 1, 0, 2, 1];
    let expected = [false, true, false, false, false, false];
    assert_eq!(built(AMPLE, &degrees), expected);
}

#[gaurast_runner::test]
fn higher_degrees_replace_what_lower_ones_have() {
    let degrees = [0, 0, 2, 2, 0, 1, 2];
    let expected = [false, true, false, true, false, false, false];
    assert_eq!(built(AMPLE, &degrees), expected);
}

#[gaurast_runner::test]
fn what_has_no_room_for_coefficients_takes_the_rest() {
    let degrees = [0, 0, 2, 2, 0, 2];
    let expected = [false, true, false, false, false, false];
    assert_eq!(built(SCARCE, &degrees), expected);
    // The coefficients of degree 0 fit into the budget, so its draws make chunks again, which then serve both degrees.
    let degrees = [2, 2, 0, 0, 2, 0, 2];
    let expected = [false, true, false, true, false, false, false];
    assert_eq!(built(SCARCE, &degrees), expected);
}
