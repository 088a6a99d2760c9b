//! Numerically difficult input: needles, discs seen from the side, far coordinates, thousands of layers, very large and
//! very small Gaussians.

use gaurast::vk::GaussianAntialiasingGAURAST as Antialiasing;

use super::chapter::Chapter;
use super::modes::ORDERS;
use super::scenes::{Gaussian, ball, cloud, dense, front, many, strange};
use crate::draw::{Camera, Draw};

/// A rotation that differs for each Gaussian index.
fn turned(index: usize) -> [f32; 4] {
    let angle = index as f32;
    [libm::cosf(0.7 * angle), libm::sinf(1.3 * angle), libm::sinf(0.4 * angle), libm::cosf(0.9 * angle)]
}

/// A position in front of the camera for each Gaussian index, in no particular order.
fn spread(index: usize) -> [f32; 3] {
    let at = |step: usize| ((index * step) % 101) as f32 / 50.0 - 1.0;
    let z = 3.0 + 2.0 * at(67);
    [0.6 * z * at(37), 0.5 * z * at(53), z + 0.5]
}

fn shaped(count: usize, scale: [f32; 3], opacity: f32) -> Draw {
    Draw::new(many(count, |index| Gaussian {
        position: spread(index),
        rotation: turned(index),
        scale,
        opacity,
        sh: vec![[0.5, ((index % 5) as f32 - 2.0) / 2.0, -0.5]],
    }))
}

pub(super) fn numerics(chapter: &mut Chapter<'_>) {
    for low_pass in [0.3, 0.05, 1e-4] {
        for (name, scale) in [
            ("needles_1e2", [1.0, 0.01, 0.01]),
            ("needles_1e4", [3.0, 3e-4, 3e-4]),
            ("needles_1e6", [30.0, 3e-5, 3e-5]),
            ("discs", [0.5, 0.5, 0.0]),
            ("discs_1e4", [2.0, 2.0, 2e-4]),
            ("lines", [1.0, 0.0, 0.0]),
            ("points", [0.0; 3]),
            ("dust", [1e-8; 3]),
            ("giants", [1e3, 2e3, 5e2]),
            ("giants_1e6", [1e6; 3]),
        ] {
            chapter.add(format!("{name}.low_pass_{low_pass}"), move || {
                shaped(40, scale, 0.4).in_state(|state| state.low_pass_variance(low_pass))
            });
        }
    }
    for (name, scale) in [("needles", [3.0, 3e-4, 3e-4]), ("discs", [0.5, 0.5, 0.0]), ("points", [0.0; 3])] {
        chapter.add(format!("compensated.{name}"), move || {
            shaped(40, scale, 0.8).in_state(|state| state.antialiasing(Antialiasing::OPACITY_COMPENSATED))
        });
    }
    // Discs seen at a grazing angle.
    for angle in [0.0, 1e-6, 1e-3] {
        chapter.add(format!("edge_on_{angle}"), move || {
            let [sin, cos] = [0.5 * (std::f32::consts::FRAC_PI_2 + angle)].map(f32::sin_cos).map(|(s, c)| [s, c])[0];
            Draw::new(many(9, |index| Gaussian {
                position: [0.7 * (index % 3) as f32 - 0.7, 0.6 * (index / 3) as f32 - 0.6, 3.0],
                scale: [0.3, 0.3, 0.0],
                rotation: [cos, sin, 0.0, 0.0],
                ..ball()
            }))
        });
    }
    for distance in [1e3_f32, 1e5, 1e6, 1e7] {
        chapter.add(format!("far.{distance:e}"), move || {
            let mut scene = cloud(51, 600, 1);
            for position in &mut scene.positions {
                *position = position.map(|c| c + distance);
            }
            let moved = f64::from(distance) + 1.0 / 7.0;
            Draw::new(scene).seen_by(front().eye([moved, moved, moved]))
        });
    }
    for scale in [1e-6_f32, 1e-3, 1e3, 1e6] {
        chapter.add(format!("units.{scale:e}"), move || {
            let mut scene = dense(52, 1);
            for values in [&mut scene.positions, &mut scene.scales] {
                values.as_flattened_mut().iter_mut().for_each(|c| *c *= scale);
            }
            Draw::new(scene).seen_by(front().near_plane(0.2 * scale))
        });
    }
    let layers = |count: usize, opacity: f32, camera: Camera| {
        let draw = Draw::new(many(count, |index| {
            let z = 2.0 + (index * 7919 % count) as f32 * 1e-3;
            Gaussian {
                position: [0.01 * z, -0.02 * z, z],
                scale: [0.05, 0.04, 0.01],
                opacity,
                sh: vec![[(index % 7) as f32 / 3.0 - 1.0, 0.0, (index % 3) as f32 - 1.0]],
                ..ball()
            }
        }));
        Draw { size: [33, 29], ..draw.seen_by(camera) }.in_state(|state| state.transmittance_floor(0.0))
    };
    let small = front().focal_length([26.0; 2]).principal_point([16.5, 14.5]);
    for (name, order) in ORDERS {
        for (count, opacity) in [(1_000, 0.02), (10_000, 0.02), (10_000, 0.005)] {
            chapter.add(format!("layers_{count}.opacity_{opacity}.{name}"), move || {
                layers(count, opacity, small).in_state(|state| state.order(order))
            });
        }
    }
    // The eye is inside the Gaussians, with their centres just in front of it.
    for z in [0.201_f32, 0.25, 0.5] {
        chapter.add(format!("close_{z}"), move || {
            Draw::new(many(5, |index| Gaussian {
                position: [0.05 * (index as f32 - 2.0), 0.02 * index as f32, z + 0.01 * index as f32],
                scale: [0.02, 0.1, 0.05],
                rotation: turned(index),
                opacity: 0.5,
                ..ball()
            }))
        });
    }
    for opacity in [1e4_f32, 1e10, 1e30] {
        chapter.add(format!("opacity_{opacity:e}"), move || shaped(30, [0.1, 0.03, 0.2], opacity));
    }
    for seed in 300..324 {
        chapter.add(format!("strange.{seed}"), move || Draw::new(strange(seed)));
        chapter.add(format!("strange.{seed}.lax"), move || {
            Draw::new(strange(seed)).in_state(|state| state.alpha_floor(1e-4).transmittance_floor(0.0))
        });
    }
}
