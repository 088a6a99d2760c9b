//! Cut-offs, and the floor of compensation.

use ash::vk;
use gaurast::vk::{
    GaussianAntialiasingGAURAST as Antialiasing, GaussianCutOffGAURAST as CutOff, GaussianGeometryGAURAST as Geometry,
    GaussianLinearizationGAURAST as Linearization, PipelineGaussianStateCreateInfoGAURAST,
};

use super::chapter::Chapter;
use super::modes::ORDERS;
use super::scenes::{Gaussian, ball, cameras, cloud, dense, layered, many, parallels, pinholes, strange};
use crate::draw::{Depth, Draw, Footprint, Unscented};

type State = PipelineGaussianStateCreateInfoGAURAST<'static>;

const CUT_OFFS: [(&str, CutOff); 4] = [
    ("ellipse", CutOff::ELLIPSE),
    ("tile_square", CutOff::TILE_SQUARE),
    ("tile_rectangle", CutOff::TILE_RECTANGLE),
    ("tile_rectangle_compensated", CutOff::TILE_RECTANGLE_COMPENSATED),
];

pub(super) fn footprint(chapter: &mut Chapter<'_>) {
    for (name, cut_off) in CUT_OFFS {
        for (camera_name, camera) in cameras() {
            chapter.add(format!("{name}.{camera_name}"), move || {
                Draw::new(dense(301, 1)).seen_by(camera).within(cut_off, 1.5)
            });
        }
        for deviations in [0.25, 1.0, 3.0, 3.33, 10.0] {
            chapter.add(format!("{name}.deviations_{deviations}"), move || {
                Draw::new(cloud(302, 800, 0)).within(cut_off, deviations)
            });
        }
        for seed in 303..306 {
            chapter.add(format!("{name}.strange_{seed}"), move || Draw::new(strange(seed)).within(cut_off, 2.0));
        }
        // One alone shows where the shape ends.
        for (at, mean) in [[0.0, 0.0], [0.13, -0.41], [1.9, 1.2]].into_iter().enumerate() {
            chapter.add(format!("{name}.one_{at}"), move || {
                Draw::new(many(1, |_| Gaussian {
                    position: [mean[0], mean[1], 4.0],
                    scale: [0.5, 0.1, 0.3],
                    rotation: [0.9, 0.0, 0.1, 0.4],
                    ..ball()
                }))
                .in_state(|state| state.alpha_floor(1e-6))
                .within(cut_off, 2.0)
            });
        }
        for (order_name, order) in ORDERS {
            chapter.add(format!("{name}.{order_name}"), move || {
                Draw::new(layered(307, 0)).in_state(|state| state.order(order)).within(cut_off, 1.0)
            });
        }
        chapter.add(format!("{name}.lax"), move || {
            Draw::new(dense(308, 0))
                .in_state(|state| state.alpha_floor(0.0).transmittance_floor(0.0))
                .within(cut_off, 1.0)
        });
        chapter.add(format!("{name}.unscented"), move || {
            Draw::new(dense(309, 0))
                .in_state(|state| state.linearization(Linearization::UNSCENTED))
                .within(cut_off, 1.5)
        });
        chapter.add(format!("{name}.compensated"), move || {
            Draw::new(cloud(310, 800, 0))
                .in_state(|state| state.antialiasing(Antialiasing::OPACITY_COMPENSATED))
                .within(cut_off, 1.5)
        });
        chapter.add(format!("{name}.viewport"), move || Draw {
            viewport: Some(vk::Viewport::default().x(13.0).y(7.0).width(61.0).height(58.0).max_depth(1.0)),
            ..Draw::new(dense(311, 0)).within(cut_off, 1.0)
        });
        chapter.add(format!("{name}.four_samples"), move || Draw {
            samples: 4,
            ..Draw::new(dense(312, 0)).within(cut_off, 1.0)
        });
        // What is cut off reaches no stencil, either.
        chapter.add(format!("{name}.stencil"), move || Draw {
            depth: Some(Depth {
                format: vk::Format::D32_SFLOAT_S8_UINT,
                test: Some((vk::CompareOp::LESS, true)),
                bounds: None,
                stencil: Some(vk::StencilOpState {
                    fail_op: vk::StencilOp::INVERT,
                    pass_op: vk::StencilOp::INCREMENT_AND_WRAP,
                    depth_fail_op: vk::StencilOp::REPLACE,
                    compare_op: vk::CompareOp::LESS,
                    compare_mask: 0xff,
                    write_mask: 0xff,
                    reference: 3,
                }),
                stripes: [1.0, 2.5, 4.0, 5.5, 7.0, 9.0],
            }),
            ..Draw::new(dense(313, 0)).within(cut_off, 1.0)
        });
    }
    discs(chapter);
    compensated(chapter);
    for floor in [0.000_025, 0.1, 0.5, 1.0] {
        for low_pass in [0.05, 0.3, 1.0] {
            chapter.add(format!("floor_{floor}.low_pass_{low_pass}"), move || Draw {
                footprint: Some(Footprint::default().compensation_floor(floor)),
                ..Draw::new(cloud(314, 800, 1))
                    .in_state(|state| state.antialiasing(Antialiasing::OPACITY_COMPENSATED).low_pass_variance(low_pass))
            });
        }
    }
    // Without compensation it has no effect.
    chapter.add("floor_without_compensation", || Draw {
        footprint: Some(Footprint::default().compensation_floor(1.0)),
        ..Draw::new(cloud(315, 800, 0))
    });
}

/// Rectangles that the compensated opacity makes smaller, by filters, floors, compensation and the unscented transform's points.
fn compensated(chapter: &mut Chapter<'_>) {
    let footprint = |floor| {
        Footprint::default()
            .cut_off(CutOff::TILE_RECTANGLE_COMPENSATED)
            .cut_off_deviations(3.33)
            .compensation_floor(floor)
    };
    for (floor_name, floor) in [("least", 0.0), ("gsplat", 0.000_025), ("half", 0.5), ("one", 1.0)] {
        for low_pass in [0.0, 0.3, 8.0] {
            chapter.add(format!("smaller.floor_{floor_name}.low_pass_{low_pass}"), move || Draw {
                footprint: Some(footprint(floor)),
                ..Draw::new(cloud(324, 800, 0)).in_state(|state| state.low_pass_variance(low_pass))
            });
        }
    }
    chapter.add("smaller.compensated", move || Draw {
        footprint: Some(footprint(0.000_025)),
        ..Draw::new(cloud(325, 800, 0))
            .in_state(|state| state.antialiasing(Antialiasing::OPACITY_COMPENSATED).low_pass_variance(2.0))
    });
    chapter.add("smaller.gsplat", move || Draw {
        footprint: Some(footprint(0.000_025)),
        unscented: Some(Unscented::default().alpha(0.1).picture_margin(0.1)),
        ..Draw::new(dense(326, 1)).in_state(|state| state.linearization(Linearization::UNSCENTED))
    });
    chapter.add("smaller.viewport", move || Draw {
        footprint: Some(footprint(0.000_025)),
        viewport: Some(vk::Viewport::default().x(13.0).y(7.0).width(61.0).height(58.0).max_depth(1.0)),
        ..Draw::new(cloud(327, 800, 0)).in_state(|state| state.low_pass_variance(2.0))
    });
}

/// 2D Gaussians in the tiles of their rectangles, about whose middle the low-pass is.
fn discs(chapter: &mut Chapter<'_>) {
    let flat = |state: State, filter| state.geometry(Geometry::GAUSSIAN_2D).low_pass_variance(filter);
    let cut_off = CutOff::TILE_RECTANGLE;
    for (name, camera) in pinholes().into_iter().chain(parallels()) {
        for filter in [0.0, 0.5, 8.0] {
            chapter.add(format!("disc.{name}.filter_{filter}"), move || {
                Draw::new(dense(316, 1)).in_state(|state| flat(state, filter)).seen_by(camera).within(cut_off, 1.5)
            });
        }
    }
    for deviations in [0.25, 1.0, 3.33] {
        chapter.add(format!("disc.deviations_{deviations}"), move || {
            Draw::new(cloud(317, 800, 0)).in_state(|state| flat(state, 0.5)).within(cut_off, deviations)
        });
    }
    for seed in 318..322 {
        chapter.add(format!("disc.strange_{seed}"), move || {
            Draw::new(strange(seed)).in_state(|state| flat(state, 0.5)).within(cut_off, 2.0)
        });
    }
    for (order_name, order) in ORDERS {
        chapter.add(format!("disc.{order_name}"), move || {
            Draw::new(layered(322, 0)).in_state(|state| flat(state, 0.5).order(order)).within(cut_off, 1.0)
        });
    }
    chapter.add("disc.viewport", move || Draw {
        viewport: Some(vk::Viewport::default().x(13.0).y(7.0).width(61.0).height(58.0).max_depth(1.0)),
        ..Draw::new(dense(323, 0)).in_state(|state| flat(state, 2.0)).within(cut_off, 1.0)
    });
}
