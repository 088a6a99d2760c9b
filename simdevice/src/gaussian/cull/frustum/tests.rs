//! Tests that Gaussians outside of the frustum are drawn nowhere, in any mode.

use super::*;
use crate::format::Format;
use crate::gaussian::cull::group::cull;
use crate::gaussian::lanes::GROUP;
use crate::gaussian::project::group::project;
use crate::gaussian::project::scratch::Scratch;
use crate::gaussian::read::attributes::GroupVertices;
use crate::gaussian::read::decoding::Codebooks;
use crate::gaussian::read::group::{GroupAttributes, Sequence};
use crate::gaussian::read::harmonics::{CoefficientReader, Harmonics};
use crate::gaussian::splats::group::ProjectedGroup;
use crate::gaussian::splats::surfel::{Outline, Surfel};
use crate::gaussian::view::visible::Visible;
use crate::packet::{AttributeStream, GaussianAppend, GaussianAttributes, ModelAttributes};
use crate::runtime::SimdLevel;
use crate::state::Viewport;
use crate::state::gaussian::{
    Camera, Distortion, DistortionModel, GaussianGeometry, GaussianLinearization, GaussianPrecision, GaussianState,
};
use crate::stats::optimizations::Optimizations;
use devmem::{Allocation, BufferRange, dispatch};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

const SIZE: f32 = 400.0;

/// A draw of which only the colours are read from memory.
fn append() -> GaussianAppend {
    let memory = Allocation::new(64, false).unwrap();
    let stream = || AttributeStream {
        buffer: BufferRange { memory: memory.clone(), offset: 0, size: 64 },
        stride: 0,
        offset: 0,
        format: Format::R32G32B32Sfloat,
        instance_divisor: None,
    };
    GaussianAppend {
        attributes: GaussianAttributes {
            position: stream(),
            scale: stream(),
            rotation: stream(),
            opacity: stream(),
            spherical_harmonics: vec![stream()],
            model: ModelAttributes::default(),
            activations: Default::default(),
            tables: None,
        },
        indices: None,
        first: 0,
        count: GROUP as u32,
        first_instance: 0,
        instance_count: 1,
    }
}

/// Gaussians of all sizes around the edges of the view of a camera at the origin.
fn around_edges(rng: &mut ChaCha8Rng, is_surfel: bool) -> Attributes {
    let mut attributes = Attributes::default();
    for lane in 0..GROUP {
        let z = rng.random_range(-0.5..4.0f32).exp() * if rng.random_bool(0.05) { -1.0 } else { 1.0 };
        let slope = |rng: &mut ChaCha8Rng| rng.random_range(-2.5..2.5f32);
        let at = [slope(rng) * z.abs(), slope(rng) * z.abs(), z];
        let size = z.abs() * rng.random_range(-8.0..0.5f32).exp();
        for (axis, at) in at.into_iter().enumerate() {
            attributes.position[axis][lane] = at;
            attributes.scale[axis][lane] = size * rng.random_range(-3.0..0.0f32).exp();
        }
        if is_surfel {
            attributes.scale[2][lane] = 0.0;
        }
        for part in 0..4 {
            attributes.rotation[part][lane] = rng.random_range(-1.0..1.0);
        }
        attributes.opacity[lane] = rng.random_range(0.01..1.0);
    }
    attributes
}

/// The bounds of a cluster of one lane.
fn bounds(attributes: &Attributes, lane: usize) -> Bounds {
    let at = |of: &[f32; F32_LANES]| of[lane];
    let position = attributes.position.each_ref().map(at);
    Bounds {
        low: position,
        high: position,
        scale: attributes.scale.each_ref().map(at).into_iter().fold(0.0, f32::max),
        opacity: attributes.opacity[lane],
    }
}

#[gaurast_runner::test]
fn what_is_outside_is_drawn_nowhere() {
    let modes = [
        (GaussianGeometry::Volume, GaussianPrecision::Float32, GaussianLinearization::Jacobian),
        (GaussianGeometry::Volume, GaussianPrecision::Float32, GaussianLinearization::Unscented),
        (GaussianGeometry::Volume, GaussianPrecision::Float16, GaussianLinearization::Jacobian),
        (GaussianGeometry::Surfel, GaussianPrecision::Float32, GaussianLinearization::Jacobian),
    ];
    let mut rng = ChaCha8Rng::seed_from_u64(41);
    let append = append();
    let level = SimdLevel::Best.resolve().unwrap();
    for (geometry, precision, linearization) in modes {
        for model in [CameraModel::Pinhole, CameraModel::Orthographic] {
            let (mut drawn, mut beside, mut beside_chunks) = (0, 0, 0);
            for round in 0..60 {
                let state = GaussianState {
                    geometry,
                    precision,
                    linearization,
                    alpha_floor: [1.0 / 255.0, 0.1, 0.0][round % 3],
                    low_pass_variance: [0.3, 0.01, 4.0][round / 3 % 3],
                    ..GaussianState::default()
                };
                let camera = Camera {
                    model,
                    rotation: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
                    eye: [0.0; 3],
                    focal_length: [rng.random_range(100.0..900.0), 300.0],
                    // It may lie far from the middle.
                    principal_point: [rng.random_range(-400.0..800.0), 200.0],
                    near_plane: 0.2,
                    far_plane: 50.0,
                    depth_coefficients: [0.0; 2],
                    distortion: None,
                };
                let viewport = Viewport { x: 0.0, y: 0.0, width: SIZE, height: SIZE, min_depth: 0.0, max_depth: 1.0 };
                let visible = Visible { left: 0, top: 0, right: 400, bottom: 400 };
                let constants = ViewConstants::new(&state, &camera, &viewport, visible, None, Optimizations::NONE);
                let frustum = Frustum::new(&constants, 1.0);
                let attributes = around_edges(&mut rng, geometry == GaussianGeometry::Surfel);
                let group = GroupAttributes {
                    reader: CoefficientReader::new(&append.attributes, &mut Codebooks::default()),
                    vertices: GroupVertices::new(&append, 0, 0, GROUP),
                    attributes: &attributes,
                    matrices: None,
                    is_sound: false,
                    harmonics: Harmonics::default(),
                };
                let mut projected = ProjectedGroup::default();
                let mut scratch = Scratch::new();
                let outside = dispatch!(level, simd => {
                    let sequence = Sequence::From(0);
                    let kept = cull(&constants, simd, &group, None, &mut projected.counters);
                    project(&constants, simd, &group, &kept, &mut scratch, sequence, &mut projected);
                    frustum.lanes_outside(simd, &attributes, GROUP)
                });
                drawn += projected.keys.len();
                beside += outside.beside.count();
                let mut is_drawn = [false; GROUP];
                for (at, &[_, lane]) in projected.keys.iter().enumerate() {
                    // The tiles of discs that reach the eye's plane are found less exactly.
                    let is_open = |surfel: &Surfel| matches!(surfel.outline, Outline::Open);
                    is_drawn[lane as usize] = !projected.surfels.get(at).is_some_and(is_open);
                }
                let all = Bits::first(GROUP);
                for (of, what) in [(outside.near, "near"), (outside.far, "far"), (outside.beside, "beside")] {
                    all.and(&of).for_each(|lane| {
                        assert!(!is_drawn[lane], "{state:?} {camera:?} {what} {lane}");
                    });
                }
                for (lane, is_drawn) in is_drawn.into_iter().enumerate() {
                    let reason = frustum.excludes(&bounds(&attributes, lane));
                    beside_chunks += u32::from(reason == Some(Outside::Beside));
                    assert!(!(is_drawn && reason.is_some()), "{state:?} {camera:?} {reason:?} {lane}");
                }
            }
            assert!(
                drawn > 500 && beside > 1000 && beside_chunks > 1000,
                "{geometry:?} {precision:?} {linearization:?} {model:?}: {drawn} drawn, {beside} and {beside_chunks} beside"
            );
        }
    }
}

#[gaurast_runner::test]
fn what_lies_beyond_a_pinhole_s_fold_is_outside() {
    let radial = [-1.0 / 3.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    let (model, tangential, thin_prism) = (DistortionModel::Polynomial, [0.0; 2], [0.0; 4]);
    // The lens folds at a slope of 1.
    let distortion = Some(Distortion { model, radial, tangential, thin_prism });
    let camera = Camera { focal_length: [300.0; 2], principal_point: [200.0; 2], distortion, ..Camera::default() };
    let viewport = Viewport { x: 0.0, y: 0.0, width: SIZE, height: SIZE, min_depth: 0.0, max_depth: 1.0 };
    let visible = Visible { left: 0, top: 0, right: 400, bottom: 400 };
    let state = GaussianState::default();
    let constants = ViewConstants::new(&state, &camera, &viewport, visible, None, Optimizations::NONE);
    let frustum = Frustum::new(&constants, 1.0);
    let at = |x: f32, y: f32| {
        let place = [x, y, 5.0];
        frustum.excludes(&Bounds { low: place, high: place, scale: 100.0, opacity: 1.0 })
    };
    for [x, y] in [[4.99, 0.0], [-4.99, 4.99], [0.0, -4.99]] {
        assert_eq!(at(x, y), None, "{x} {y}");
    }
    for [x, y] in [[5.01, 0.0], [-5.01, 0.0], [1.0, 5.01], [1.0, -5.01]] {
        assert_eq!(at(x, y), Some(Outside::Beside), "{x} {y}");
    }
}
