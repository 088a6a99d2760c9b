//! Attributes in the form of trained files: logarithms of scales and logits of opacities.

use super::bench::{Options, Pipeline, SIZE, State, Stream, extension, pictures};
use crate::SKULL;
use ash::vk;
use gaurast::vk::{GaussianCameraGAURAST, GaussianGeometryGAURAST, PipelineGaussianStateCreateFlagsGAURAST as Flags};
use gaurast_runner::{Need, data};
use gaurast_scene::camera::DEFAULT_FOV;
use gaurast_tests::compare::{Limits, assert_contract};
use gaurast_tests::oracle::activation::{opacity_of_logit, scale_of_logarithm};
use gaurast_tests::oracle::{OracleCamera, OracleState, render_bounded};
use gaurast_tests::scenes::{self, SceneBuffers};
use std::collections::HashMap;

/// Attributes before the activation functions are applied.
struct Stored {
    logarithms: Vec<[f32; 3]>,
    logits: Vec<f32>,
}

/// The activated attributes, with both functions.
fn activated(scene: &SceneBuffers, stored: &Stored) -> SceneBuffers {
    let scales = stored.logarithms.iter();
    SceneBuffers {
        scales: scales.map(|s| s.map(scale_of_logarithm)).collect(),
        opacities: stored.logits.iter().copied().map(opacity_of_logit).collect(),
        ..scene.clone()
    }
}

/// The picture of a scene whose scales and opacities are `stored`, with the given flags.
fn draw(scene: &SceneBuffers, stored: &Stored, state: State, camera: &GaussianCameraGAURAST) -> Vec<[f32; 4]> {
    let mut streams = Stream::of(scene);
    if state.flags.contains(Flags::LOG_SCALE) {
        streams[1] = Stream::new(1, vk::Format::R32G32B32_SFLOAT, &stored.logarithms);
    }
    if state.flags.contains(Flags::LOGIT_OPACITY) {
        streams[3] = Stream::new(3, vk::Format::R32_SFLOAT, &stored.logits);
    }
    let pipeline = Pipeline::new(&streams, &Options::new(state, scene.degree));
    let mut all = pictures(1, 0, |commands| {
        pipeline.bind(commands, &streams, None);
        // SAFETY: the command buffer is being recorded.
        unsafe { extension().cmd_set_gaussian_cameras(commands.raw, &[*camera]) };
        commands.draw(0..scene.positions.len() as u32);
    });
    all.remove(0)
}

/// The floats of a binary PLY file's vertices, by property name.
fn properties(bytes: &[u8]) -> HashMap<String, Vec<f32>> {
    let end = b"end_header\n";
    let start = bytes.windows(end.len()).position(|w| w == end).expect("a header") + end.len();
    let header = std::str::from_utf8(&bytes[..start]).expect("text");
    assert!(header.contains("format binary_little_endian"));
    let names: Vec<&str> = header.lines().filter_map(|line| line.strip_prefix("property float ")).collect();
    assert_eq!(header.matches("property").count(), names.len());
    let (floats, _) = bytes[start..].as_chunks::<4>();
    let column = |(index, name): (usize, &&str)| {
        let values = floats.iter().skip(index).step_by(names.len());
        let values = values.map(|bytes| f32::from_le_bytes(*bytes));
        ((*name).to_owned(), values.collect())
    };
    names.iter().enumerate().map(column).collect()
}

/// A trained file's values are used without conversion.
#[gaurast_runner::test(needs = [Need::Data(SKULL)])]
fn a_trained_file_is_drawn_as_it_is_stored() {
    let scene = gaurast_scene::open(data(SKULL)).expect("a scene");
    let camera = gaurast_scene::frame_middle(&scene, DEFAULT_FOV, SIZE).to_vulkan();
    let scene = SceneBuffers::from(&scene);
    let columns = properties(&std::fs::read(data(SKULL)).expect("a file"));
    let [x, y, z] = ["scale_0", "scale_1", "scale_2"].map(|name| &columns[name]);
    let stored =
        Stored { logarithms: (0..x.len()).map(|i| [x[i], y[i], z[i]]).collect(), logits: columns["opacity"].clone() };
    assert_eq!(stored.logits.len(), scene.positions.len());
    assert!(stored.logits.iter().any(|&logit| logit < 0.0));
    let state = State::default().flags(Flags::LOG_SCALE | Flags::LOGIT_OPACITY);
    let picture = draw(&scene, &stored, state, &camera);
    let oracle = OracleCamera::new(&camera, SIZE).expect("a pinhole");
    let meant = activated(&scene, &stored);
    let expected = render_bounded(&meant.as_oracle(), &oracle, &OracleState::default());
    assert!(expected.nominal.iter().filter(|rgba| rgba[3] > 0.5).count() > 500);
    assert_contract("the skull", &picture, &expected, Limits::ENVELOPE_ONLY);
}

/// Each flag alone and both, for volumes and discs. A logarithm of minus infinity gives a scale of zero, an infinite
/// logit gives an opacity of zero or one, and Gaussians with other non-finite results are skipped.
#[gaurast_runner::test]
fn flags_are_the_functions_before() {
    let camera = scenes::camera(SIZE[0], SIZE[1]).to_vulkan();
    let scene = scenes::cloud(73, 1200, 1);
    let mut stored = Stored {
        logarithms: scene.scales.iter().map(|s| s.map(f32::ln)).collect(),
        logits: scene.opacities.iter().map(|&o| (o / (1.0 - o)).ln()).collect(),
    };
    stored.logits[3] = f32::INFINITY;
    stored.logits[4] = f32::NEG_INFINITY;
    stored.logits[5] = f32::NAN;
    stored.logarithms[6] = [f32::NEG_INFINITY, -3.0, -2.5];
    stored.logarithms[7] = [300.0, -3.0, -2.5];
    let meant = activated(&scene, &stored);
    assert_eq!((meant.opacities[3], meant.opacities[4]), (1.0, 0.0));
    assert_eq!((meant.scales[6][0], meant.scales[7][0]), (0.0, f32::INFINITY));
    let oracle = OracleCamera::new(&camera, SIZE).expect("a pinhole");
    for geometry in [GaussianGeometryGAURAST::GAUSSIAN_3D, GaussianGeometryGAURAST::GAUSSIAN_2D] {
        for flags in [Flags::LOG_SCALE, Flags::LOGIT_OPACITY, Flags::LOG_SCALE | Flags::LOGIT_OPACITY] {
            let state = State::default().flags(flags).geometry(geometry);
            let picture = draw(&scene, &stored, state, &camera);
            let mut meant = meant.clone();
            if !flags.contains(Flags::LOG_SCALE) {
                meant.scales.clone_from(&scene.scales);
            }
            if !flags.contains(Flags::LOGIT_OPACITY) {
                meant.opacities.clone_from(&scene.opacities);
            }
            let drawn = draw(&meant, &stored, state.flags(Flags::empty()), &camera);
            assert!(picture == drawn, "{flags:?}: not what an application would have applied");
            let expected = render_bounded(&meant.as_oracle(), &oracle, &OracleState::from(&state));
            let name = format!("{flags:?}, {geometry:?}");
            assert_contract(&name, &picture, &expected, Limits::ENVELOPE_ONLY);
        }
    }
}
