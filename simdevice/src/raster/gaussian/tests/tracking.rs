//! The Gaussians that pixels show, against a twin that takes one pixel after the other.

use super::*;
use crate::gaussian::splats::identity::Identity;

/// The Gaussians that a pixel shows, as the twin finds them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct NaiveTracked {
    nearest: Option<Identity>,
    median: Identity,
    z_sum: f32,
    weight_sum: f32,
}

impl NaiveTracked {
    /// Takes account of a Gaussian of a weight, behind which the transmittance was `transmittance`.
    pub(crate) fn add(&mut self, identity: Identity, transmittance: f32, weight: f32) {
        self.nearest.get_or_insert(identity);
        if transmittance >= 0.5 {
            self.median = identity;
        }
        self.z_sum = weight.mul_add(identity.z, self.z_sum);
        self.weight_sum += weight;
    }
}

/// A draw whose Gaussians have identities: their numbers in reverse order, and a depth variable each.
fn tracked_draw(seed: u64, count: u32, state: GaussianState, device: &Device) -> BinnedDraw {
    let mut draw = draw(seed, count, state, device, WHOLE);
    let sorted = Arc::get_mut(&mut draw.sorted).unwrap();
    let mut sequence = count;
    let identities = sorted.splats.iter().map(|group| {
        let identity = |splat: &Splat| {
            sequence -= 1;
            Identity { z: 1.0 + splat.mean[0].abs() as f32 / 7.0, sequence }
        };
        group.iter().map(identity).collect()
    });
    sorted.identities = Some(identities.collect());
    draw
}

/// Every covered pixel of every tile shows what the twin says, bit for bit.
fn check(case: &Case, seed: u64, count: u32, state: &GaussianState) {
    let device = device_of(case);
    let draw = tracked_draw(seed, count, state.clone(), &device);
    let mut tile = Box::new(GaussianTile::default());
    let mut found = 0;
    for at in (0..4).flat_map(|y| (0..6).map(move |x| [x, y])) {
        let lanes = lanes_within(WHOLE, at.map(|at| at * TILE_SIZE));
        tile.run::<Track>(&draw, device.level(), at, 0, &lanes, &mut Counters::default());
        let accumulator = &tile.accumulators[0];
        for (x, y) in (0..TILE).flat_map(|y| (0..TILE).map(move |x| (x, y))) {
            let expected = naive_sample(&draw, at, [x, y], |_| true);
            let (block, lane) = grid::block_and_lane(x, y);
            assert_eq!(tile.pixel(x, y), expected.fragment, "seed {seed}, tile {at:?}, pixel {x}, {y}");
            let NaiveTracked { nearest, median, z_sum, weight_sum } = expected.tracked;
            let Some(nearest) = nearest else { continue };
            let tracked = &accumulator.tracked;
            assert_eq!(tracked.nearest[block][lane], nearest.sequence, "seed {seed}, tile {at:?}, pixel {x}, {y}");
            let got = Identity { z: tracked.median_z[block][lane], sequence: tracked.median[block][lane] };
            assert_eq!(got, median, "seed {seed}, tile {at:?}, pixel {x}, {y}");
            let sums = [tracked.z_sums[block][lane], accumulator.means[1][block][lane]];
            assert_eq!(sums, [z_sum, weight_sum], "seed {seed}, tile {at:?}, pixel {x}, {y}");
            assert_eq!(accumulator.mean_z(block)[lane], z_sum / weight_sum);
            found += 1;
        }
    }
    assert!(found > 1000, "seed {seed}: {found} pixels");
}

#[gaurast_runner::test(each = simd_levels())]
fn pixels_show_the_gaussians_that_the_twin_finds(case: &Case) {
    for seed in 60..63 {
        check(case, seed, 400, &defaults());
    }
}

#[gaurast_runner::test(each = simd_levels())]
fn they_do_where_pixels_end_at_once_and_where_exponents_need_binary64(case: &Case) {
    check(case, 63, 400, &GaussianState { transmittance_floor: 0.5, ..defaults() });
    check(case, 64, 3000, &GaussianState { low_pass_variance: 0.0, ..defaults() });
}
