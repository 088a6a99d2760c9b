//! Tests of scenes in memory: several appended to one, and statistics.

use gaurast_scene::info::Info;
use gaurast_scene::{Antialiasing, GaussianShape, Scene, Transform};
use glam::{DQuat, DVec3};

use super::support::*;

/// A scene of two Gaussians with distinct values.
fn scene(degree: usize) -> Scene {
    let (properties, rows) = distinct(degree, 2);
    read("a.ply", &ply(Encoding::Little, &properties, &rows)).expect("a good file")
}

#[gaurast_runner::test]
fn an_appended_scene_is_scaled_turned_and_moved() {
    let part = scene(1);
    let mut whole = scene(1);
    // A quarter turn around z.
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let transform = Transform {
        scale: 3.0,
        rotation: DQuat::from_xyzw(0.0, 0.0, half, half),
        translation: DVec3::new(10.0, 20.0, 30.0),
    };
    whole.append(&part, &transform);
    assert_eq!((whole.len(), whole.sh_degree()), (4, 1));
    for i in 0..2 {
        assert_eq!(whole.positions()[i], part.positions()[i]);
        let [x, y, z] = part.positions()[i];
        let expected = [10.0 - 3.0 * y, 20.0 + 3.0 * x, 30.0 + 3.0 * z];
        close(&whole.positions()[2 + i], &expected, 1e-5);
        let (old, new) = (part.shapes()[i], whole.shapes()[2 + i]);
        close(&new.scale, &old.scale.map(|s| 3.0 * s), 1e-5);
        assert_eq!(new.opacity, old.opacity);
        let [old, new] = [old, new].map(|shape| {
            let [w, x, y, z] = shape.rotation.map(f64::from);
            DQuat::from_xyzw(x, y, z, w).normalize() * DVec3::new(0.3, -0.5, 0.7)
        });
        let turned = DVec3::new(-old.y, old.x, old.z);
        assert!(new.abs_diff_eq(turned, 1e-5), "{new} is not {turned}");
        // The basis is -y, z and -x. x becomes y, and y becomes -x.
        let [old, new] = [&part.sh()[4 * i..], &whole.sh()[4 * (2 + i)..]];
        assert_eq!(new[0], old[0]);
        close(&new[1], &old[3], 1e-6);
        close(&new[2], &old[2], 1e-6);
        close(&new[3], &old[1].map(|c| -c), 1e-6);
    }
}

#[gaurast_runner::test]
fn scenes_of_several_degrees_have_the_greatest() {
    for (first, second) in [(0, 2), (2, 0), (3, 3)] {
        let (mut whole, part) = (scene(first), scene(second));
        whole.append(&part, &Transform::default());
        assert_eq!(whole.sh_degree() as usize, first.max(second));
        let stride = whole.sh_stride();
        for (i, (own, k)) in [(&scene(first), 0), (&scene(first), 1), (&part, 0), (&part, 1)].into_iter().enumerate() {
            let sh = &whole.sh()[i * stride..(i + 1) * stride];
            let (stored, rest) = sh.split_at(own.sh_stride());
            assert_eq!(stored, &own.sh()[k * own.sh_stride()..][..own.sh_stride()]);
            assert!(rest.iter().all(|c| *c == [0.0; 3]));
        }
        assert_eq!(whole.positions()[2..], *part.positions());
    }
}

#[gaurast_runner::test]
fn what_the_parts_of_a_scene_disagree_in_is_not_told() {
    let with = |antialiasing| {
        let mut scene = scene(0);
        scene.metadata_mut().antialiasing = Some(antialiasing);
        scene
    };
    let mut whole = Scene::default();
    whole.append(&with(Antialiasing::Compensated), &Transform::default());
    whole.append(&with(Antialiasing::Compensated), &Transform::default());
    assert_eq!(whole.antialiasing(), Antialiasing::Compensated);
    assert!(whole.metadata().notes.is_empty());
    whole.append(&with(Antialiasing::Off), &Transform::default());
    assert_eq!(whole.metadata().antialiasing, None);
    let notes = &whole.metadata().notes;
    assert!(notes.len() == 1 && notes[0].contains("antialiasing"), "{notes:?}");
}

#[gaurast_runner::test]
fn info_counts_what_a_scene_holds() {
    let mut scene = Scene::with_capacity(0, 0);
    let mut push = |position, scale, opacity| {
        let shape = GaussianShape { scale, rotation: [1.0, 0.0, 0.0, 0.0], opacity };
        scene.push(position, shape, &[[0.0; 3]]);
    };
    push([1.0, -2.0, 3.0], [0.02, 0.01, 0.03], 0.0);
    push([-1.0, 2.0, 4.0], [0.2, 0.01, 0.03], 0.55);
    push([0.0, 0.0, 9.0], [1e-12; 3], 1.0);
    push([0.0, 0.0, 0.0], [1e12; 3], 1.0);
    push([0.0, 5.0, 0.0], [f32::INFINITY; 3], 1.0);
    push([f32::NAN, 50.0, 0.0], [1.0; 3], 1.0);
    let info = Info::new(&scene);
    assert_eq!((info.gaussians, info.sh_degree, info.non_finite), (6, 0, 2));
    assert_eq!(info.bytes, 6 * (12 + 32 + 12));
    let bounds = info.bounds.expect("finite centres");
    assert_eq!((bounds.min, bounds.max), ([-1.0, -2.0, 0.0], [1.0, 5.0, 9.0]));
    let counts = |bars: &[gaurast_scene::info::Bar]| -> Vec<usize> { bars.iter().map(|bar| bar.count).collect() };
    assert_eq!(counts(&info.opacities), [1, 0, 0, 0, 0, 1, 0, 0, 0, 2]);
    assert_eq!(counts(&info.scales), [1, 0, 0, 0, 0, 1, 1, 0, 0, 0, 1]);
    let json = serde_json::to_value(&info).expect("JSON");
    assert_eq!(json["gaussians"], 6);
    assert_eq!(json["opacities"][5]["count"], 1);
    assert_eq!(json["metadata"]["antialiasing"], serde_json::Value::Null);
    assert_eq!(Info::new(&Scene::default()).bounds, None);
}
