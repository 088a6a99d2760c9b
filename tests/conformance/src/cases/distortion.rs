//! Cameras whose lens distorts: each model, the fold, the Jacobian and the unscented transform, a lens for each view.

use gaurast::vk::{
    GaussianAntialiasingGAURAST as Antialiasing, GaussianCameraModelGAURAST as CameraModel,
    GaussianCutOffGAURAST as CutOff, GaussianDistortionModelGAURAST as Model,
    GaussianLinearizationGAURAST as Linearization, GaussianOrderGAURAST as Order,
    GaussianPrecisionGAURAST as Precision,
};

use super::chapter::Chapter;
use super::scenes::{Gaussian, ball, cloud, dense, few, front, many, strange};
use crate::draw::{Call, Camera, Distortion, Draw, Unscented};
use crate::program::{Program, colors};
use crate::rendering::{Rendering, colors_by_layer, layers};
use crate::stage::Stage;

fn of(model: Model, radial: [f32; 6]) -> Distortion {
    Distortion::default().model(model).radial(radial)
}

/// A lens whose first radial coefficient alone is not 0.
fn of_one(model: Model, coefficient: f32) -> Distortion {
    of(model, [coefficient, 0.0, 0.0, 0.0, 0.0, 0.0])
}

/// Lenses of all models, each with every coefficient that the model has.
fn lenses() -> [(&'static str, Distortion); 7] {
    let rational = of(Model::RATIONAL, [0.2, -0.1, 0.02, 0.05, -0.01, 0.002]);
    let polynomial = of(Model::POLYNOMIAL, [0.15, -0.03, 0.008, -0.002, 0.0005, 0.0001]);
    // It folds, so that what lies far to the side is not enlarged without bounds.
    let first = of(Model::POLYNOMIAL_FIRST, [-0.05, -0.01, -0.002, -0.0005, -0.0001, -0.00002]);
    let whole = |lens: Distortion| lens.tangential([0.02, -0.03]).thin_prism([0.03, -0.01, -0.02, 0.015]);
    [
        ("rational", whole(rational)),
        ("polynomial", whole(polynomial)),
        ("polynomial_first", whole(first)),
        ("field_of_view", of_one(Model::FIELD_OF_VIEW, 0.9)),
        ("narrow_field_of_view", of_one(Model::FIELD_OF_VIEW, 1e-3)),
        ("division", of_one(Model::DIVISION, -0.3)),
        ("division_that_folds", of_one(Model::DIVISION, 0.4)),
    ]
}

/// Cameras that a lens may distort.
fn cameras() -> [(&'static str, Camera); 5] {
    let fisheye = front().model(CameraModel::FISHEYE);
    let turned = front()
        .rotation([0.8, 0.0, -0.6, 0.36, 0.8, 0.48, 0.48, -0.6, 0.64])
        .eye([3.0, 2.0, 1.0])
        .focal_length([60.0, 75.0])
        .principal_point([20.0, 65.0]);
    [
        ("pinhole", front()),
        ("pinhole_turned", turned),
        ("pinhole_wide", front().focal_length([22.0, 25.0]).eye([0.0, 0.0, 4.0])),
        ("fisheye", fisheye.focal_length([60.0, 55.0])),
        ("fisheye_inside", fisheye.eye([0.2, -0.1, 5.0]).focal_length([16.0; 2])),
    ]
}

/// Draws a scene to layers by one pass with views, each through a camera and a lens of its own.
fn of_views() -> Program {
    let lenses = lenses();
    let seen: Vec<(Camera, Option<Distortion>)> =
        vec![(front(), Some(lenses[0].1)), (front().eye([0.2, 0.0, 0.0]), None), (front(), Some(lenses[3].1))];
    let draw = Draw::new(dense(484, 1));
    let of_layer =
        |&(camera, distortion): &(Camera, Option<Distortion>)| Draw { distortion, ..draw.clone().seen_by(camera) };
    let pictures = seen.iter().map(of_layer).collect();
    let program = Program::pictures(pictures, move |gpu| {
        let image = layers(gpu, draw.size, 3, [0.0; 4]);
        let stage = Stage::changed(gpu, &draw, &|graphics| graphics.view_mask = 0b111);
        let mut chained: Vec<Distortion> = seen.iter().map(|(_, distortion)| distortion.unwrap_or_default()).collect();
        let cameras: Vec<_> = (seen.iter().zip(&mut chained))
            .map(|((camera, distortion), chained)| match distortion {
                Some(_) => camera.push_next(chained),
                None => *camera,
            })
            .collect();
        let views = [image.view];
        let rendering = Rendering { view_mask: 0b111, ..Rendering::over(&views, draw.size) };
        gpu.run(|commands| {
            rendering.record(commands, || {
                stage.bind(commands);
                let gaussian = gpu.gaussian().expect("a device that draws Gaussians");
                // SAFETY: the commands are being recorded.
                unsafe { gaussian.cmd_set_gaussian_cameras(commands.raw, &cameras) };
                commands.draw(0..stage.scene.count);
            });
        });
        Ok(colors_by_layer(&image).into_iter().map(colors).collect())
    });
    program.needing("gaussianMultiview")
}

pub(super) fn distortion(chapter: &mut Chapter<'_>) {
    for (name, lens) in lenses() {
        for (camera_name, camera) in cameras() {
            for (mode, linearization) in
                [("jacobian", Linearization::JACOBIAN), ("unscented", Linearization::UNSCENTED)]
            {
                chapter.add(format!("{name}.{camera_name}.{mode}"), move || {
                    Draw::new(dense(471, 1))
                        .in_state(|state| state.linearization(linearization))
                        .seen_by(camera)
                        .through(lens)
                });
            }
        }
        chapter.add(format!("{name}.strange"), move || Draw::new(strange(472)).through(lens));
    }
    coefficients(chapter);
    folds(chapter);
    modes(chapter);
    chapter.program("a_lens_for_each_view", of_views);
    chapter.program("no_lens_after_one", || {
        Program::pass(Draw::new(dense(485, 1)), |stage, commands| {
            let mut lens = of_one(Model::RATIONAL, 0.4);
            commands.camera(&front().push_next(&mut lens));
            commands.camera(&stage.draw.camera);
            commands.draw(0..500);
        })
    });
}

/// Each coefficient alone, and none.
fn coefficients(chapter: &mut Chapter<'_>) {
    for (model_name, model) in [
        ("rational", Model::RATIONAL),
        ("polynomial", Model::POLYNOMIAL),
        ("polynomial_first", Model::POLYNOMIAL_FIRST),
    ] {
        let mut lenses = Vec::new();
        for index in 0..6 {
            let mut radial = [0.0; 6];
            radial[index] = 0.3;
            lenses.push((format!("k{}", index + 1), of(model, radial)));
        }
        for index in 0..2 {
            let mut tangential = [0.0; 2];
            tangential[index] = 0.1;
            lenses.push((format!("p{}", index + 1), of(model, [0.0; 6]).tangential(tangential)));
        }
        for index in 0..4 {
            let mut thin_prism = [0.0; 4];
            thin_prism[index] = 0.2;
            lenses.push((format!("s{}", index + 1), of(model, [0.0; 6]).thin_prism(thin_prism)));
        }
        for (name, lens) in lenses {
            chapter.add(format!("{model_name}.{name}"), move || Draw::new(cloud(473, 800, 0)).through(lens));
        }
    }
    for (name, model) in [
        ("rational", Model::RATIONAL),
        ("polynomial", Model::POLYNOMIAL),
        ("polynomial_first", Model::POLYNOMIAL_FIRST),
        ("field_of_view", Model::FIELD_OF_VIEW),
        ("division", Model::DIVISION),
    ] {
        // Nothing is distorted, so that slopes are clamped as they are without a lens.
        chapter.add(format!("{name}.zeros"), move || {
            Draw::new(many(1, |_| Gaussian { position: [4.5, 0.0, 4.0], scale: [1.5, 1.5, 2.5], ..ball() }))
                .through(of(model, [0.0; 6]))
        });
    }
}

/// Lenses that fold within the picture, and polynomials that turn more than once.
fn folds(chapter: &mut Chapter<'_>) {
    let wide = cameras()[2].1;
    let lenses = [
        ("at_0.75", of_one(Model::POLYNOMIAL, -0.6)),
        ("at_0.75_rational", of_one(Model::RATIONAL, -0.6)),
        ("pole", of(Model::RATIONAL, [0.0, 0.0, 0.0, -0.9, 0.0, 0.0])),
        ("before_the_pole", of(Model::RATIONAL, [-0.4, 0.0, 0.0, -0.25, 0.0, 0.0])),
        // The derivative is not positive between two radii, and again from a third on.
        ("three_times", of(Model::POLYNOMIAL, [-1.2, 0.6, -0.08, 0.0, 0.0, 0.0])),
        // It comes near 0 without a fold.
        ("almost", of(Model::POLYNOMIAL, [-0.66, 0.2, 0.0, 0.0, 0.0, 0.0])),
        ("division", of_one(Model::DIVISION, 0.5)),
        ("first", of_one(Model::POLYNOMIAL_FIRST, -0.6).tangential([0.03, -0.02])),
    ];
    for (name, lens) in lenses {
        for (mode, linearization) in [("jacobian", Linearization::JACOBIAN), ("unscented", Linearization::UNSCENTED)] {
            chapter.add(format!("fold.{name}.{mode}"), move || {
                Draw::new(dense(474, 0))
                    .in_state(|state| state.linearization(linearization))
                    .seen_by(wide)
                    .through(lens)
            });
        }
    }
    let fisheye = cameras()[4].1;
    for (name, lens) in [("at_1", of_one(Model::POLYNOMIAL, -1.0 / 3.0)), ("at_1.8", of_one(Model::POLYNOMIAL, -0.1))] {
        chapter.add(format!("fold.fisheye.{name}"), move || Draw::new(dense(475, 0)).seen_by(fisheye).through(lens));
    }
}

/// Lenses with other modes of the pipeline.
fn modes(chapter: &mut Chapter<'_>) {
    let lens = lenses()[0].1;
    let [_, turned, wide, ..] = cameras().map(|(_, camera)| camera);
    for (name, order) in [("radial_distance", Order::RADIAL_DISTANCE), ("primitive", Order::PRIMITIVE)] {
        chapter.add(format!("order.{name}"), move || {
            Draw::new(dense(476, 0)).in_state(|state| state.order(order)).seen_by(turned).through(lens)
        });
    }
    chapter.add("compensated", move || {
        Draw::new(cloud(477, 800, 1))
            .in_state(|state| state.antialiasing(Antialiasing::OPACITY_COMPENSATED))
            .seen_by(wide)
            .through(lens)
    });
    chapter.add("binary16", move || {
        Draw::new(few(478, 0)).in_state(|state| state.precision(Precision::FLOAT16)).through(lens)
    });
    chapter.add("cut_off", move || {
        Draw::new(dense(479, 0)).within(CutOff::TILE_RECTANGLE, 3.33).seen_by(wide).through(lens)
    });
    chapter.add("near_sigma_points", move || Draw {
        unscented: Some(Unscented::default().alpha(0.1).picture_margin(0.1)),
        ..Draw::new(dense(480, 0))
            .in_state(|state| state.linearization(Linearization::UNSCENTED))
            .seen_by(wide)
            .through(lens)
    });
    chapter.add("two_draws_of_a_set", move || Draw {
        merged: true,
        calls: vec![
            Call::Draw { vertices: [0, 250], instances: [0, 1] },
            Call::Draw { vertices: [250, 250], instances: [0, 1] },
        ],
        ..Draw::new(dense(483, 0)).through(lens)
    });
}
