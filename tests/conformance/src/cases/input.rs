//! Input of draws: commands and sets, attributes and skipped Gaussians, model matrices.

use ash::vk;
use gaurast::vk::{GaussianLinearizationGAURAST as Linearization, GaussianOrderGAURAST as Order};
use gaurast_oracle::oracle::OracleInstance;

use super::chapter::Chapter;
use super::modes::ORDERS;
use super::scenes::{Gaussian, SceneBuffers, ball, cameras, cloud, dense, layered, many};
use crate::draw::{Call, Draw, State};

fn vertices(first: u32, count: u32) -> Call {
    Call::Draw { vertices: [first, count], instances: [0, 1] }
}

pub(super) fn topology(chapter: &mut Chapter<'_>) {
    let indices: Vec<u32> = (0..500).rev().step_by(3).chain(100..140).chain(100..140).collect();
    let count = indices.len() as u32;
    let indexed = |first, count, offset| Call::Indexed { indices: [first, count], offset };
    let calls: Vec<(&str, Vec<Call>)> = vec![
        ("all", vec![vertices(0, 500)]),
        ("part", vec![vertices(123, 300)]),
        ("nothing", vec![vertices(0, 0)]),
        ("nothing_before", vec![vertices(7, 0), vertices(0, 500)]),
        ("one", vec![vertices(250, 1)]),
        ("two_draws", vec![vertices(0, 200), vertices(200, 300)]),
        ("back_to_front", vec![vertices(200, 300), vertices(0, 200)]),
        ("three_instances", vec![Call::Draw { vertices: [0, 150], instances: [0, 3] }]),
        ("indexed", vec![indexed(0, count, 0)]),
        ("indexed_part", vec![indexed(40, 90, 0)]),
        ("indexed_offset", vec![indexed(170, 75, 60)]),
        ("indexed_back", vec![indexed(170, 75, -60)]),
        ("indirect", vec![Call::Indirect { vertices: [30, 400] }]),
        ("every_command", vec![vertices(0, 60), indexed(0, 50, 0), Call::Indirect { vertices: [200, 90] }]),
        ("a_set_ends", vec![vertices(0, 200), Call::EndSet, vertices(100, 300)]),
    ];
    for (name, calls) in calls {
        for (order_name, order) in [ORDERS[0], ORDERS[2]] {
            for merges in [false, true] {
                if merges && calls.len() == 1 {
                    continue;
                }
                let (calls, indices) = (calls.clone(), indices.clone());
                let set = if merges { "merged" } else { "apart" };
                chapter.add(format!("{name}.{order_name}.{set}"), move || Draw {
                    merged: merges,
                    calls: calls.clone(),
                    indices: indices.clone(),
                    ..Draw::new(layered(21, 0)).in_state(|state| state.order(order))
                });
            }
        }
    }
}

/// A function that changes one attribute of a Gaussian.
type Change = fn(&mut SceneBuffers, usize, f32);

pub(super) fn attributes(chapter: &mut Chapter<'_>) {
    // One Gaussian in three is changed.
    let mut changed = |name: String, change: Change, value: f32| {
        chapter.add(name, move || {
            let mut scene = dense(22, 1);
            for index in (0..scene.positions.len()).step_by(3) {
                change(&mut scene, index, value);
            }
            Draw::new(scene)
        });
    };
    let members: [(&str, Change); 5] = [
        ("position", |scene, index, value| {
            scene.positions[index][index % 3] = value;
        }),
        ("scale", |scene, index, value| {
            scene.scales[index][index % 3] = value;
        }),
        ("rotation", |scene, index, value| {
            scene.rotations[index][index % 4] = value;
        }),
        ("opacity", |scene, index, value| {
            scene.opacities[index] = value;
        }),
        ("coefficient", |scene, index, value| {
            scene.sh[4 * index + index % 4][index % 3] = value;
        }),
    ];
    for (member, change) in members {
        for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            changed(format!("{member}.{value}"), change, value);
        }
    }
    let rotate: Change = |scene, index, factor| {
        scene.rotations[index] = scene.rotations[index].map(|c| c * factor);
    };
    for factor in [0.0, -1.0, 1e-30, 1e30] {
        changed(format!("rotation_times_{factor:e}"), rotate, factor);
    }
    let stretch: Change = |scene, index, value| scene.scales[index][index % 3] = value;
    for value in [-1e-30, -0.5, 0.0, -0.0] {
        changed(format!("scale_{value:e}"), stretch, value);
    }
    let floor = State::default().alpha_floor;
    let fade: Change = |scene, index, value| scene.opacities[index] = value;
    for (name, value) in [("below_floor", floor.next_down()), ("zero", 0.0), ("negative", -0.5)] {
        changed(format!("opacity_{name}"), fade, value);
    }
    // An opacity equal to the floor is not below it.
    chapter.add("opacity_at_floor", move || {
        Draw::new(many(1, |_| Gaussian { opacity: 0.25, scale: [8.0; 3], ..ball() }))
            .in_state(|state| state.alpha_floor(0.25))
    });
    chapter.add("coefficients_beyond_the_degree", || {
        let mut scene = dense(23, 2);
        for triples in scene.sh.chunks_exact_mut(9) {
            triples[4..].fill([f32::NAN; 3]);
        }
        Draw { degree: 1, ..Draw::new(scene) }
    });
    for degree in 0..4 {
        chapter.add(format!("binary16.degree_{degree}"), move || Draw { half: true, ..Draw::new(dense(24, degree)) });
    }
}

pub(super) fn instances(chapter: &mut Chapter<'_>) {
    let rates = [("by_instance", vk::VertexInputRate::INSTANCE), ("by_vertex", vk::VertexInputRate::VERTEX)];
    let linearizations = [("jacobian", Linearization::JACOBIAN), ("unscented", Linearization::UNSCENTED)];
    for index in [0, 2, 5, 7, 9] {
        let (name, camera) = cameras()[index];
        for (rate_name, rate) in rates {
            for (linearization_name, linearization) in linearizations {
                chapter.add(format!("{name}.{rate_name}.{linearization_name}"), move || {
                    placed(rate, placements(), 2).in_state(|state| state.linearization(linearization)).seen_by(camera)
                });
            }
        }
    }
    for (name, order) in &ORDERS[..3] {
        let order: Order = *order;
        chapter.add(format!("order.{name}"), move || {
            placed(vk::VertexInputRate::INSTANCE, placements(), 0).in_state(|state| state.order(order))
        });
    }
    let one: [(&str, [[f32; 4]; 3], f32); 6] = [
        ("mirrored", [[-1.0, 0.0, 0.0, 0.2], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]], 1.0),
        ("sheared", [[1.0, 0.7, 0.0, 0.0], [0.0, 1.0, 0.3, 0.0], [0.2, 0.0, 1.0, 0.5]], 1.0),
        ("singular", [[1.0, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]], 1.0),
        ("not_finite", [[1.0, 0.0, 0.0, f32::NAN], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]], 1.0),
        ("faint", [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]], 0.01),
        ("opaque", [[0.5, 0.0, 0.0, 0.0], [0.0, 0.5, 0.0, 0.0], [0.0, 0.0, 0.5, 2.0]], 5.0),
    ];
    for (name, matrix, opacity) in one {
        chapter.add(format!("one.{name}"), move || {
            let mut instances = vec![OracleInstance { matrix, opacity }];
            instances.push(OracleInstance {
                matrix: [[0.3, 0.0, 0.0, 1.0], [0.0, 0.3, 0.0, 1.0], [0.0, 0.0, 0.3, 2.0]],
                opacity: 1.0,
            });
            placed(vk::VertexInputRate::INSTANCE, instances, 3)
        });
    }
}

/// A few Gaussians, each at all placements, or each at its own placement.
fn placed(rate: vk::VertexInputRate, placements: Vec<OracleInstance>, degree: u32) -> Draw {
    let mut scene = cloud(25, 90, degree);
    scene.scales.as_flattened_mut().iter_mut().for_each(|scale| *scale *= 8.0);
    let count = placements.len() as u32;
    let (calls, placements) = match rate {
        vk::VertexInputRate::INSTANCE => (vec![Call::Draw { vertices: [0, 90], instances: [0, count] }], placements),
        _ => (vec![vertices(0, 90)], (0..90).map(|at| placements[at % placements.len()]).collect()),
    };
    Draw { calls, instances: Some((rate, placements)), ..Draw::new(scene) }
}

/// Matrices that rotate, stretch, shear, mirror and translate.
fn placements() -> Vec<OracleInstance> {
    (0..6)
        .map(|at| {
            let angle = at as f32;
            let (sin, cos) = libm::sincosf(angle);
            let size = 0.5 + 0.1 * angle;
            OracleInstance {
                matrix: [
                    [size * cos, -size * sin, 0.1 * angle, 0.3 * angle - 0.8],
                    [size * sin, cos, 0.0, 0.5 - 0.2 * angle],
                    [0.0, 0.2, if at % 2 == 0 { size } else { -size }, if at % 2 == 0 { 1.0 } else { 9.0 }],
                ],
                opacity: 1.0 - 0.12 * angle,
            }
        })
        .collect()
}
