//! Inputs of resolve shaders.

use ash::vk;
use gaurast::vk::{
    GaussianAntialiasingGAURAST as Antialiasing, GaussianCutOffGAURAST as CutOff, GaussianGeometryGAURAST as Geometry,
};
use gaurast_oracle::oracle::OracleInstance;

use super::chapter::Chapter;
use super::modes::ORDERS;
use super::scenes::{SceneBuffers, cameras, cloud, dense, layered, strange};
use crate::draw::{Blend, Call, Draw, Shown};

/// A draw whose fragments are what a shader shows of them; elsewhere the picture is less than anything.
fn showing(shown: Shown, scene: SceneBuffers) -> Draw {
    Draw { shown: Some(shown), behind: [-1e9; 4], blend: Blend::Replace, ..Draw::new(scene) }
}

const OF_GAUSSIANS: [(&str, Shown); 4] = [
    ("accumulated", Shown::Accumulated),
    ("depths", Shown::Depths),
    ("linear_depths", Shown::LinearDepths),
    ("gaussians", Shown::Gaussians),
];

pub(super) fn resolve(chapter: &mut Chapter<'_>) {
    for (name, shown) in OF_GAUSSIANS {
        for (camera_name, camera) in cameras() {
            chapter.add(format!("{name}.{camera_name}"), move || showing(shown, dense(321, 1)).seen_by(camera));
        }
        for (order_name, order) in &ORDERS[..3] {
            let order = *order;
            chapter.add(format!("{name}.{order_name}"), move || {
                showing(shown, layered(322, 0)).in_state(|state| state.order(order))
            });
        }
        for seed in 323..326 {
            chapter.add(format!("{name}.strange_{seed}"), move || showing(shown, strange(seed)));
        }
        // Without a floor, what underflows may be the first to contribute or not.
        chapter.add(format!("{name}.lax"), move || {
            showing(shown, dense(327, 0))
                .in_state(|state| state.alpha_floor(1e-6).transmittance_floor(0.0).alpha_ceiling(1.0))
        });
        chapter.add(format!("{name}.compensated"), move || {
            showing(shown, cloud(328, 800, 0)).in_state(|state| state.antialiasing(Antialiasing::OPACITY_COMPENSATED))
        });
        chapter.add(format!("{name}.surfel"), move || {
            showing(shown, dense(329, 0)).in_state(|state| state.geometry(Geometry::GAUSSIAN_2D).low_pass_variance(0.5))
        });
        for (cut_name, cut_off) in [("ellipse", CutOff::ELLIPSE), ("tile_square", CutOff::TILE_SQUARE)] {
            chapter.add(format!("{name}.{cut_name}"), move || showing(shown, dense(330, 0)).within(cut_off, 1.0));
        }
    }
    for location in 0..6 {
        for index in [2, 5, 7, 9] {
            let (camera_name, camera) = cameras()[index];
            chapter.add(format!("camera_{location}.{camera_name}"), move || {
                showing(Shown::Camera(location), dense(331, 0)).seen_by(camera)
            });
        }
    }
    names(chapter);
    super::targets::inputs(chapter);
}

/// Vertices and instances by which Gaussians are named.
fn names(chapter: &mut Chapter<'_>) {
    let gaussians = || showing(Shown::Gaussians, dense(332, 0));
    chapter.add("names.first_vertex", move || Draw {
        calls: vec![Call::Draw { vertices: [100, 300], instances: [0, 1] }],
        ..gaussians()
    });
    chapter.add("names.indices", move || Draw {
        indices: (0..400).map(|index| (index * 7) % 450).collect(),
        calls: vec![Call::Indexed { indices: [20, 350], offset: 40 }],
        ..gaussians()
    });
    chapter.add("names.indirect", move || Draw { calls: vec![Call::Indirect { vertices: [50, 400] }], ..gaussians() });
    chapter.add("names.instances", move || {
        let placed = (0..5).map(|instance| OracleInstance {
            matrix: [
                [1.0, 0.0, 0.0, 0.7 * instance as f32 - 1.4],
                [0.0, 1.0, 0.0, 0.3],
                [0.0, 0.0, 1.0, 0.4 * instance as f32],
            ],
            opacity: 0.8,
        });
        Draw {
            instances: Some((vk::VertexInputRate::INSTANCE, placed.collect())),
            calls: vec![Call::Draw { vertices: [10, 120], instances: [2, 3] }],
            ..gaussians()
        }
    });
    chapter.add("names.set", move || Draw {
        merged: true,
        indices: (0..100).rev().collect(),
        calls: vec![
            Call::Draw { vertices: [300, 150], instances: [0, 1] },
            Call::Indexed { indices: [0, 100], offset: 0 },
            Call::Draw { vertices: [100, 200], instances: [7, 1] },
        ],
        ..gaussians()
    });
}
