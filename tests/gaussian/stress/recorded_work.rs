//! Compares both models of the rasterizer's timing on the stress scenes.

use gaurast_testkit::{Gpu, Settings};
use gaurast_tests::recorded::{Agreement, recorded};
use std::sync::Arc;

use super::accuracy::draw;
use super::scenes::all;

#[gaurast_runner::test]
fn models_of_the_rasterizer_agree_on_stress_scenes() {
    let mut agreement = Agreement::default();
    for stress in &all() {
        let trace = Arc::default();
        let gpu = Gpu::embedded(&Settings { trace: Some(&trace), ..Settings::default() }).expect("a device");
        draw(&gpu, stress);
        drop(gpu);
        agreement.add(stress.name, &recorded(&trace));
    }
    agreement.judge(100);
}
