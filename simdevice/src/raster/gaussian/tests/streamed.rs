//! Draws without lists, since those would be too long.

use super::*;
use crate::state::gaussian::GaussianOrder;

/// Every pixel is the same, bit for bit, whether tiles have lists or find theirs in the sorted sequence.
#[gaurast_runner::test(each = simd_levels())]
fn lists_and_streams_agree(case: &Case) {
    let states = [
        defaults(),
        GaussianState { transmittance_floor: 0.0, ..defaults() },
        GaussianState { order: GaussianOrder::PerPixel, ..defaults() },
        GaussianState { precision: GaussianPrecision::Float16, ..defaults() },
    ];
    for (seed, state) in (50..).zip(&states) {
        let [listed, streamed] = [Config::default().bin_budget_bytes, 100].map(|budget| {
            let device = Device::new(&Config {
                threads: 2,
                simd: level_of(case),
                bin_budget_bytes: budget,
                ..Config::default()
            })
            .unwrap();
            let draw = draw(seed, 4000, state.clone(), &device, WHOLE);
            assert_eq!(draw.sorted.tiles.walk().is_some(), budget == 100);
            let mut tile = Box::new(GaussianTile::default());
            let mut counters = Counters::default();
            let mut pixels = Vec::new();
            for at in (0..4).flat_map(|y| (0..6).map(move |x| [x, y])) {
                tile.render(&draw, device.level(), at[0], at[1], &mut counters);
                let places = (0..TILE).flat_map(|y| (0..TILE).map(move |x| (x, y)));
                pixels.extend(places.map(|(x, y)| tile.pixel(x, y)));
            }
            let contributions = counters.get(Counter::PixelContributions);
            (pixels, draw.sorted.tiles.pairs(), contributions)
        });
        assert!(streamed == listed, "seed {seed}");
        assert!(listed.2 > 0);
    }
}
