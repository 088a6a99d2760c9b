//! Compares both models of the rasterizer's timing on the stress scenes.

use gaurast_testkit::{Gpu, Settings};
use gaurast_tests::recorded::{Agreement, read};

use super::accuracy::draw;
use super::scenes::all;

#[gaurast_runner::test]
fn models_of_the_rasterizer_agree_on_stress_scenes() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut agreement = Agreement::default();
    for (number, stress) in all().iter().enumerate() {
        let path = folder.path().join(format!("{number}.json"));
        let gpu = Gpu::embedded(&Settings { trace: Some(&path), ..Settings::default() }).expect("a device");
        draw(&gpu, stress);
        drop(gpu);
        agreement.add(stress.name, &read(&path));
    }
    agreement.judge(100);
}
