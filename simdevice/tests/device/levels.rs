//! Each SIMD level in a test of its own. A level that the processor lacks is reported as ignored.

use crate::scenes::{KINDS, draw};
use gaurast_runner::{Case, simd_levels};
use simdevice::Config;
use simdevice::runtime::SimdLevel;

#[gaurast_runner::test(each = simd_levels())]
fn every_level_draws_what_the_simplest_draws(case: &Case) {
    let level = SimdLevel::from_name(case.variant()).unwrap();
    // The kernels' own tests use this list.
    assert!(SimdLevel::supported().contains(&(case.variant(), level)));
    for (kind, name) in KINDS {
        let [simplest, drawn] = [SimdLevel::Baseline, level].map(|simd| {
            let config = Config { simd, ..Config::default() };
            draw(kind, &config, [&[], &[]])
        });
        assert!(drawn == simplest, "{name}");
    }
}
