//! Modes of the pipeline: cameras, orders, geometry, projection, the state's numbers, harmonics, binary16,
//! approximations.

use gaurast::vk::{
    GaussianAntialiasingGAURAST as Antialiasing, GaussianCameraModelGAURAST as Model,
    GaussianGeometryGAURAST as Geometry, GaussianLinearizationGAURAST as Linearization, GaussianOrderGAURAST as Order,
    GaussianPrecisionGAURAST as Precision,
};

use gaurast_testkit::Pass;

use super::chapter::Chapter;
use super::scenes::{
    Gaussian, SceneBuffers, ball, cameras, cloud, dense, few, front, layered, many, parallels, pinholes, strange,
};
use crate::draw::{Draw, State, Unscented};
use crate::program::Program;

pub(super) const ORDERS: [(&str, Order); 4] = [
    ("view_depth", Order::VIEW_DEPTH),
    ("radial_distance", Order::RADIAL_DISTANCE),
    ("primitive", Order::PRIMITIVE),
    ("per_pixel", Order::PER_PIXEL),
];

type Scene = fn() -> SceneBuffers;
type Change = fn(State) -> State;

/// Cameras that are set more than once, and before a pipeline is bound.
fn again(chapter: &mut Chapter<'_>) {
    chapter.program("set_again", || {
        Program::pass(Draw::new(dense(4, 1)).seen_by(front().eye([0.3, 0.1, -0.5])), |stage, commands| {
            commands.camera(&front().eye([50.0; 3]));
            commands.camera(&stage.draw.camera);
            commands.draw(0..500);
        })
    });
    chapter.program("each_draw_its_own", || {
        // Nothing is seen through the second.
        Program::pass(Draw::new(dense(5, 1)), |stage, commands| {
            commands.draw(0..500);
            commands.camera(&stage.draw.camera.eye([1e5; 3]));
            commands.draw(0..500);
        })
    });
    chapter.program("set_before_the_pipeline", || {
        Program::pass(Draw::new(dense(6, 1)), |stage, commands| {
            commands.camera(&front().eye([50.0; 3]));
            commands.camera(&stage.draw.camera);
            commands.bind(&stage.pipeline);
            commands.draw(0..500);
        })
    });
    chapter.program("in_the_next_pass", || {
        Program::on_stage(Draw::new(dense(7, 1)), |stage| {
            stage.gpu.run(|commands| {
                stage.pass(commands, || {});
                // The camera stays when a pass ends.
                commands.pass(&stage.target, &Pass::load(), || {
                    commands.bind(&stage.pipeline);
                    stage.scene.bind_buffers(commands);
                    commands.draw(0..500);
                });
            });
        })
    });
}

pub(super) fn camera(chapter: &mut Chapter<'_>) {
    let scenes: [(&str, Scene); 4] = [
        ("cloud", || cloud(1, 800, 1)),
        ("dense", || dense(2, 1)),
        ("strange_1", || strange(101)),
        ("strange_2", || strange(117)),
    ];
    for (name, camera) in cameras() {
        for (scene_name, scene) in scenes {
            chapter.add(format!("{name}.{scene_name}"), move || Draw::new(scene()).seen_by(camera));
        }
    }
    for index in [0, 5, 7, 9] {
        let (name, camera) = cameras()[index];
        chapter.add(format!("{name}.in_a_buffer"), move || Draw {
            camera_in_buffer: true,
            ..Draw::new(dense(3, 2)).seen_by(camera)
        });
    }
    again(chapter);
    // Centres in the planes are not between them; their neighbours are.
    let in_planes = || {
        many(6, |index| {
            let z = [2.0, 2.0_f32.next_up(), 3.0, 5.0_f32.next_down(), 5.0, 6.0][index];
            Gaussian {
                position: [0.3 * (index as f32 - 2.5), 0.0, z],
                scale: [0.2; 3],
                sh: vec![[0.3 * index as f32, 1.0, -0.3 * index as f32]],
                ..ball()
            }
        })
    };
    for (name, camera) in [
        ("near_and_far", front().near_plane(2.0).far_plane(5.0)),
        ("no_far", front().near_plane(2.0)),
        ("parallel", parallels()[0].1.near_plane(2.0).far_plane(5.0)),
    ] {
        chapter.add(format!("planes.{name}"), move || Draw::new(in_planes()).seen_by(camera));
    }
    // Outside the picture the Jacobian uses a clamped slope.
    for (name, by) in [("left", [-1.0, 0.0]), ("right", [1.0, 0.0]), ("above", [0.0, -1.0]), ("below", [0.0, 1.0])] {
        chapter.add(format!("beside.{name}"), move || {
            Draw::new(many(1, |_| Gaussian {
                position: [4.5 * by[0], 4.5 * by[1], 4.0],
                scale: [1.5, 1.5, 2.5],
                ..ball()
            }))
        });
    }
}

pub(super) fn order(chapter: &mut Chapter<'_>) {
    let scenes: [(&str, Scene); 2] = [("dense", || dense(4, 1)), ("layered", || layered(5, 0))];
    for (order_name, order) in ORDERS {
        for (name, camera) in cameras() {
            for (scene_name, scene) in scenes {
                chapter.add(format!("{order_name}.{name}.{scene_name}"), move || {
                    Draw::new(scene()).in_state(|state| state.order(order)).seen_by(camera)
                });
            }
        }
    }
    // Along the camera's axis all depths are equal to within a quarter of a unit in the last place.
    let tilt = 1e-7;
    let tilted = front().rotation([1.0, 0.0, -tilt, 0.0, 1.0, 0.0, tilt, 0.0, 1.0]);
    chapter.add("ties.equal_when_rounded", move || {
        Draw::new(many(60, |index| Gaussian {
            position: [((index * 37) % 60) as f32 / 30.0 - 1.0, 0.0, 4.0],
            scale: [1.5; 3],
            opacity: 0.3,
            sh: vec![[index as f32 / 30.0 - 1.0, 0.0, 1.0 - index as f32 / 30.0]],
            ..ball()
        }))
        .seen_by(tilted)
    });
    chapter.add("ties.neighbours_differ", || {
        Draw::new(many(64, |index| Gaussian {
            // The Gaussians are one unit in the last place apart, in the reverse order of the draw.
            position: [0.0, 0.0, f32::from_bits(4.0_f32.to_bits() + 64 - index as u32)],
            opacity: 0.3,
            sh: vec![[index as f32 / 32.0 - 1.0, 0.0, 1.0 - index as f32 / 32.0]],
            ..ball()
        }))
    });
    for count in [2, 100, 2000] {
        chapter.add(format!("ties.all_of_{count}"), move || {
            Draw::new(many(count, |index| Gaussian {
                opacity: 0.9 / (1.0 + count as f32 / 20.0) + 0.01,
                sh: vec![[(index % 7) as f32 / 3.0 - 1.0, (index % 5) as f32 / 2.0 - 1.0, 0.0]],
                ..ball()
            }))
        });
    }
}

pub(super) fn surfel(chapter: &mut Chapter<'_>) {
    let flat = |state: State, filter| state.geometry(Geometry::GAUSSIAN_2D).low_pass_variance(filter);
    let cameras: Vec<_> = pinholes().into_iter().chain(parallels()).collect();
    for (name, camera) in cameras {
        for (order_name, order) in [ORDERS[0], ORDERS[1], ORDERS[3]] {
            for filter in [0.0, 0.5, 2.0] {
                chapter.add(format!("{name}.{order_name}.filter_{filter}"), move || {
                    Draw::new(dense(6, 1)).in_state(|state| flat(state, filter).order(order)).seen_by(camera)
                });
            }
        }
    }
    for seed in 210..218 {
        chapter.add(format!("strange_{seed}"), move || Draw::new(strange(seed)).in_state(|state| flat(state, 0.5)));
    }
}

pub(super) fn unscented(chapter: &mut Chapter<'_>) {
    let antialiasing = [("dilate", Antialiasing::DILATE), ("compensated", Antialiasing::OPACITY_COMPENSATED)];
    let scenes: [(&str, Scene); 2] = [("dense", || dense(7, 1)), ("strange", || strange(205))];
    for (name, camera) in cameras() {
        for (mode, antialiasing) in antialiasing {
            for (scene_name, scene) in scenes {
                chapter.add(format!("{name}.{mode}.{scene_name}"), move || {
                    Draw::new(scene())
                        .in_state(|state| state.linearization(Linearization::UNSCENTED).antialiasing(antialiasing))
                        .seen_by(camera)
                });
            }
        }
    }
    sigma_points(chapter);
}

/// Other sigma points than the default's.
fn sigma_points(chapter: &mut Chapter<'_>) {
    let near = Unscented::default().alpha(0.1);
    let points = [
        ("alpha_0.1", near),
        ("alpha_0.5", Unscented::default().alpha(0.5)),
        ("beta_0", near.beta(0.0)),
        ("kappa_1.5", Unscented::default().kappa(1.5)),
        ("kappa_-1", Unscented::default().kappa(-1.0)),
        ("margin_0.1", near.picture_margin(0.1)),
        ("margin_0", near.picture_margin(0.0)),
        ("all_points", Unscented::default().picture_margin(0.05).all_sigma_points(true)),
        ("default", Unscented::default()),
    ];
    let cameras = [
        ("pinhole", front()),
        ("pinhole_wide", front().focal_length([22.0, 25.0]).eye([0.0, 0.0, 4.0])),
        ("fisheye", front().model(Model::FISHEYE).focal_length([60.0, 55.0])),
    ];
    for (name, unscented) in points {
        for (camera_name, camera) in cameras {
            chapter.add(format!("points.{name}.{camera_name}"), move || Draw {
                unscented: Some(unscented),
                ..Draw::new(dense(206, 1))
                    .in_state(|state| state.linearization(Linearization::UNSCENTED))
                    .seen_by(camera)
            });
        }
    }
    // With a negative weight the opacity's root may be of a negative number, which counts as 0.
    chapter.add("points.alpha_0.1.compensated", move || Draw {
        unscented: Some(near),
        ..Draw::new(dense(207, 1)).in_state(|state| {
            state.linearization(Linearization::UNSCENTED).antialiasing(Antialiasing::OPACITY_COMPENSATED)
        })
    });
}

pub(super) fn state(chapter: &mut Chapter<'_>) {
    let ends = [(0.99, 1e-4), (0.9, 0.02), (0.999, 0.0), (1.0, 0.0)];
    for low_pass in [0.0, 0.05, 0.3, 1.0] {
        for floor in [1e-4, 1.0 / 255.0, 0.05] {
            for (ceiling, end) in ends {
                let name = format!("low_pass_{low_pass}.floor_{floor:.4}.ceiling_{ceiling}.end_{end}");
                chapter.add(name, move || {
                    Draw::new(dense(8, 0)).in_state(|state| {
                        state
                            .low_pass_variance(low_pass)
                            .alpha_floor(floor)
                            .alpha_ceiling(ceiling)
                            .transmittance_floor(end)
                    })
                });
            }
        }
        for floor in [1e-4, 1.0 / 255.0] {
            chapter.add(format!("compensated.low_pass_{low_pass}.floor_{floor:.4}"), move || {
                Draw::new(cloud(9, 800, 1)).in_state(|state| {
                    state.antialiasing(Antialiasing::OPACITY_COMPENSATED).low_pass_variance(low_pass).alpha_floor(floor)
                })
            });
        }
    }
    // If the floor equals the ceiling, alphas at the ceiling still contribute.
    chapter.add("floor_is_ceiling", || {
        Draw::new(many(3, |index| Gaussian { position: [0.8 * index as f32 - 0.8, 0.0, 4.0], opacity: 0.9, ..ball() }))
            .in_state(|state| state.alpha_floor(0.5).alpha_ceiling(0.5))
    });
    chapter.add("floor_0", || Draw::new(dense(10, 0)).in_state(|state| state.alpha_floor(0.0)));
    chapter.add("floor_1", || {
        Draw::new(many(1, |_| Gaussian { opacity: 4.0, ..ball() }))
            .in_state(|state| state.alpha_floor(1.0).alpha_ceiling(1.0).transmittance_floor(0.0))
    });
    // The first Gaussian would leave a transmittance of zero, so nothing contributes.
    chapter.add("opaque_first", || {
        Draw::new(many(1, |_| Gaussian { opacity: 4.0, ..ball() }))
            .in_state(|state| state.alpha_ceiling(1.0).transmittance_floor(0.01))
    });
    for opacity in [1.0, 3.0, 100.0] {
        chapter.add(format!("opacity_{opacity}"), move || {
            let mut scene = dense(11, 0);
            scene.opacities.iter_mut().step_by(3).for_each(|o| *o = opacity);
            Draw::new(scene)
        });
    }
    // Only wide Gaussians show where the cut-off is.
    for floor in [1e-6, 1e-4, 1.0 / 255.0] {
        chapter.add(format!("reach.floor_{floor:.6}"), move || {
            Draw::new(many(1, |_| Gaussian { opacity: 1.0, ..ball() })).in_state(|state| state.alpha_floor(floor))
        });
    }
    // The Gaussian that ends a pixel does not contribute.
    for end in [0.3, 0.55, 0.9] {
        chapter.add(format!("ends.{end}"), move || {
            Draw::new(dense(12, 0)).in_state(|state| state.transmittance_floor(end))
        });
    }
}

pub(super) fn harmonics(chapter: &mut Chapter<'_>) {
    for function in 0..25_usize {
        let degree = function.isqrt() as u32;
        chapter.add(format!("function_{function}"), move || {
            let mut scene = dense(13, degree);
            let triples = (degree + 1).pow(2) as usize;
            for (at, triple) in scene.sh.iter_mut().enumerate() {
                *triple = if at % triples == function { [0.6, -0.6, 0.2] } else { [0.0; 3] };
            }
            Draw::new(scene).seen_by(front().eye([0.3, -0.2, 5.0]).focal_length([30.0; 2]))
        });
    }
    for degree in 0..=4 {
        for (name, camera) in [cameras()[0], cameras()[2], cameras()[6], cameras()[9]] {
            chapter.add(format!("degree_{degree}.{name}"), move || Draw::new(dense(14, degree)).seen_by(camera));
        }
        chapter.add(format!("degree_{degree}_of_4"), move || Draw { degree, ..Draw::new(dense(15, 4)) });
    }
    chapter.add("bright", || {
        let mut scene = dense(16, 1);
        scene.sh.as_flattened_mut().iter_mut().for_each(|k| *k *= 20.0);
        Draw::new(scene)
    });
}

pub(super) fn binary16(chapter: &mut Chapter<'_>) {
    let half = |state: State| state.precision(Precision::FLOAT16);
    let cameras = cameras().into_iter().filter(|(_, camera)| camera.model != Model::EQUIRECTANGULAR);
    for (name, camera) in cameras {
        for (order_name, order) in &ORDERS[..3] {
            let order = *order;
            chapter.add(format!("{name}.{order_name}"), move || {
                Draw::new(few(17, 1)).in_state(|state| half(state).order(order)).seen_by(camera)
            });
        }
    }
    let states: [(&str, Change); 4] = [
        ("compensated", |state| state.antialiasing(Antialiasing::OPACITY_COMPENSATED)),
        ("lax", |state| state.alpha_floor(1e-3).transmittance_floor(0.0)),
        ("strict", |state| state.alpha_floor(0.05).alpha_ceiling(0.9).transmittance_floor(0.02)),
        ("unscented", |state| state.linearization(Linearization::UNSCENTED)),
    ];
    for (name, change) in states {
        chapter.add(name, move || Draw::new(few(18, 0)).in_state(|state| change(half(state))));
    }
}

pub(super) fn approximation(chapter: &mut Chapter<'_>) {
    let layers = || {
        many(120, |layer| Gaussian {
            position: [0.0, 0.0, 3.0 + 0.01 * layer as f32],
            scale: [3.0, 3.0, 0.01],
            opacity: 0.02 + 0.0005 * layer as f32,
            sh: vec![if layer % 2 == 0 { [1.5, 0.0, -1.5] } else { [-1.5, 0.0, 1.5] }],
            ..ball()
        })
    };
    for error in [0.0, 1e-4, 2e-3] {
        for budget in [0.0, 1.0 / 255.0, 16.0 / 255.0] {
            let allowed = Some([error, budget]);
            chapter.add(format!("error_{error}.budget_{budget:.4}.cloud"), move || Draw {
                approximation: allowed,
                ..Draw::new(cloud(19, 800, 1))
            });
            chapter.add(format!("error_{error}.budget_{budget:.4}.layers"), move || Draw {
                approximation: allowed,
                ..Draw::new(layers())
            });
        }
    }
}
