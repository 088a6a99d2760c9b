//! Scenes that tell the renderers of `--as` apart, each drawn by the rules of all.

use gaurast_scene::Camera;

use crate::case::{Case, Level, Pipeline, Source, front};
use crate::gaussian::Gaussian;

/// A scene on which the renderers differ.
struct Difference {
    name: &'static str,
    clause: &'static str,
    shows: &'static str,
    gaussians: Vec<Gaussian>,
    is_compensated: bool,
}

/// The cases.
pub fn all() -> Vec<Case> {
    let of_each = |difference: &Difference| Pipeline::ALL.map(|pipeline| case(difference, pipeline));
    differences().iter().flat_map(of_each).collect()
}

fn differences() -> Vec<Difference> {
    let red = [0.9, 0.2, 0.1];
    // Coordinates are those of 3DGS: y downwards, z away from the viewer.
    vec![
        Difference {
            name: "cut-off",
            clause: "The shape outside which nothing is drawn",
            shows: "Pixels at 3.26 deviations, in a tile that a square of 3 does not touch, and a rectangle of 3.33 does.",
            gaussians: vec![Gaussian::new([4.0; 3]).scaled(0.497, 0.3, 0.3).opaque(0.98).at(-0.38, 0.03, 0.0)],
            is_compensated: false,
        },
        Difference {
            name: "ceiling",
            clause: "The greatest alpha",
            shows: "A bright Gaussian behind an opaque one: 0.99 or 0.999.",
            gaussians: vec![
                Gaussian::new(red).scaled(2.0, 2.0, 2.0).opaque(0.9999),
                Gaussian::new([6.0; 3]).scaled(2.0, 2.0, 2.0).opaque(0.9).at(0.0, 0.0, 0.5),
            ],
            is_compensated: false,
        },
        Difference {
            name: "near",
            clause: "The near plane",
            shows: "A Gaussian 0.1 before the eye: beyond 0.01, before 0.2.",
            gaussians: vec![
                Gaussian::new(red).at(0.01, 0.005, -3.9).scaled(0.01, 0.01, 0.01),
                Gaussian::new([0.2, 0.3, 0.9]).at(-0.4, 0.1, 0.0),
            ],
            is_compensated: false,
        },
        Difference {
            name: "order",
            clause: "The order",
            shows: "Two Gaussians whose distances and depths are in opposite orders.",
            gaussians: vec![
                Gaussian::new(red).at(0.2, 0.0, 0.0),
                Gaussian::new([0.1, 0.8, 0.3]).at(1.3, 0.0, -0.15).scaled(0.5, 0.5, 0.5),
            ],
            is_compensated: false,
        },
        Difference {
            name: "compensation",
            clause: "The least ratio of the compensated opacity",
            shows: "Bright Gaussians far smaller than a pixel: a ratio of at least 0.005, or none.",
            gaussians: (0..4)
                .map(|index| {
                    Gaussian::new([6.0; 3])
                        .scaled(0.002, 0.002, 0.002)
                        .at(0.4 * index as f32 - 0.75, 0.05, 0.0)
                        .opaque(0.98)
                })
                .collect(),
            is_compensated: true,
        },
    ]
}

fn case(difference: &Difference, pipeline: Pipeline) -> Case {
    let Difference { name, clause, shows, gaussians, is_compensated } = difference;
    Case {
        // Names are files' without extensions.
        name: format!("{name}-{}", pipeline.name().replace('.', "-")),
        scene: (*name).to_owned(),
        pipeline,
        level: Level::Recommended,
        clause,
        shows,
        source: Source::Ply(gaussians.clone()),
        camera: Camera { near: pipeline.near(), ..front() },
        is_compensated: *is_compensated,
        freedoms: Vec::new(),
        mistake: None,
    }
}
