//! Tests of the renderer over many frames, scenes and sizes.

use gaurast_render::{Frame, RenderError, Renderer};
use gaurast_scene::camera::Camera;
use gaurast_scene::{GaussianShape, Scene};

fn renderer() -> Renderer {
    Renderer::new(vulkan_gaurast::entry()).expect("a device")
}

fn camera(size: [u32; 2]) -> Camera {
    Camera::look_at([0.; 3], [0., 0., 1.], [0., -1., 0.], 60.0, size).expect("a camera")
}

/// The value of the counter `name`.
fn counted(frame: &Frame, name: &str) -> f64 {
    let counter = frame.counters.iter().find(|counter| counter.name == name);
    counter.unwrap_or_else(|| panic!("no counter {name}")).value
}

#[gaurast_runner::test]
fn frames_of_any_size_and_order_are_the_same_pictures() {
    let mut renderer = renderer();
    let garden = gaurast_scene::garden::scene(5, 4000);
    let garden = renderer.upload(&garden, None).expect("uploaded");
    let corner = gaurast_scene::garden::scene(6, 1000);
    let corner = renderer.upload(&corner, None).expect("uploaded");
    let mut pictures = Vec::new();
    for _ in 0..2 {
        for size in [[64, 48], [33, 70], [64, 48]] {
            let camera = gaurast_scene::garden::camera(None, size).expect("a camera");
            let a = renderer.render(&garden, &camera).expect("a frame");
            let b = renderer.render(&corner, &camera).expect("a frame");
            assert_eq!((a.picture.width, a.picture.height), (size[0], size[1]));
            assert_eq!(a.picture.pixels.len(), (size[0] * size[1]) as usize);
            // A query counts only its own draw.
            assert_eq!(counted(&a, "gaussians read"), 4000.0);
            assert_eq!(counted(&b, "gaussians read"), 1000.0);
            pictures.push((a.picture, b.picture));
        }
    }
    assert_eq!(pictures[0], pictures[2]);
    assert_eq!(pictures[..3], pictures[3..]);
    assert_ne!(pictures[0].0, pictures[0].1);
}

/// The drawn degree is the least of the requested and the stored ones; the coefficients show which degree is drawn.
#[gaurast_runner::test]
fn the_degree_drawn_is_the_least_of_those_asked_for() {
    let mut renderer = renderer();
    let shape = GaussianShape { scale: [0.5; 3], rotation: [1.0, 0.0, 0.0, 0.0], opacity: 0.9 };
    let mut sh = vec![[0.0; 3]; 25];
    // The z function of band 1 and the middle function of band 2, which are greatest along +z, where the Gaussian is.
    sh[2] = [1.0, 0.0, 0.0];
    sh[6] = [0.0, 0.8, 0.0];
    let mut scene = Scene::with_capacity(4, 1);
    scene.push([0., 0., 3.], shape, &sh);
    let mut colour = |degree: Option<u32>| {
        let uploaded = renderer.upload(&scene, degree).expect("uploaded");
        let frame = renderer.render(&uploaded, &camera([9, 9])).expect("a frame");
        let [r, g, b, alpha] = frame.picture.pixels[40];
        assert!((alpha - 0.9).abs() < 5e-6, "{alpha}");
        [r, g, b].map(|c| c / alpha)
    };
    let band_1 = 0.488_602_5;
    let band_2 = 0.315_391_57 * 2.0 * 0.8;
    for (degree, expected) in [
        (Some(0), [0.5, 0.5, 0.5]),
        (Some(1), [0.5 + band_1, 0.5, 0.5]),
        (Some(2), [0.5 + band_1, 0.5 + band_2, 0.5]),
        (Some(4), [0.5 + band_1, 0.5 + band_2, 0.5]),
        (None, [0.5 + band_1, 0.5 + band_2, 0.5]),
    ] {
        for (value, expected) in colour(degree).into_iter().zip(expected) {
            assert!((value - expected).abs() < 1e-5, "{degree:?}: {value} {expected}");
        }
    }
}

#[gaurast_runner::test]
fn skipped_gaussians_are_counted_and_poison_nothing() {
    let mut renderer = renderer();
    let good = GaussianShape { scale: [0.2; 3], rotation: [1.0, 0.0, 0.0, 0.0], opacity: 0.5 };
    let mut scene = Scene::with_capacity(0, 0);
    let mut push = |position, shape| scene.push(position, shape, &[[0.5; 3]]);
    let ahead = [0., 0., 4.];
    push(ahead, good);
    push([f32::NAN, 0., 4.], good);
    push(ahead, GaussianShape { scale: [f32::INFINITY; 3], ..good });
    push(ahead, GaussianShape { rotation: [0.0; 4], ..good });
    push(ahead, GaussianShape { scale: [-1.0; 3], ..good });
    push(ahead, GaussianShape { opacity: 0.001, ..good });
    push([0., 0., -4.], good);
    let uploaded = renderer.upload(&scene, None).expect("uploaded");
    let frame = renderer.render(&uploaded, &camera([33, 33])).expect("a frame");
    assert_eq!(counted(&frame, "gaussians read"), 7.0);
    assert_eq!(counted(&frame, "gaussians drawn"), 1.0);
    let skipped: f64 = frame
        .counters
        .iter()
        .filter(|counter| counter.category == "gaussians skipped")
        .map(|counter| counter.value)
        .sum();
    assert_eq!(skipped, 6.0);
    assert!(frame.picture.pixels.as_flattened().iter().all(|c| c.is_finite()));
    let centre = frame.picture.pixels[33 * 16 + 16];
    assert!((centre[3] - 0.5).abs() < 5e-6, "{centre:?}");
}

#[gaurast_runner::test]
fn an_empty_scene_is_an_empty_picture() {
    let mut renderer = renderer();
    let uploaded = renderer.upload(&Scene::default(), None).expect("uploaded");
    let frame = renderer.render(&uploaded, &camera([20, 10])).expect("a frame");
    assert!(frame.picture.pixels.iter().all(|pixel| *pixel == [0.0; 4]));
}

#[gaurast_runner::test]
fn sizes_beyond_the_device_are_errors() {
    let mut renderer = renderer();
    let uploaded = renderer.upload(&Scene::default(), None).expect("uploaded");
    for size in [[0, 5], [5, 0], [u32::MAX, 1]] {
        let mut camera = camera([5, 5]);
        [camera.width, camera.height] = size;
        let refused = renderer.render(&uploaded, &camera);
        assert!(matches!(refused, Err(RenderError::Size { .. })), "{size:?}");
    }
    // The renderer still works.
    assert!(renderer.render(&uploaded, &camera([5, 5])).is_ok());
}
