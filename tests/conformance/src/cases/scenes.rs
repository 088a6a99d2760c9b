//! Scenes and cameras that the tables of cases use.

use std::ops::Range;

use gaurast::vk::GaussianCameraModelGAURAST as Model;
pub(super) use gaurast_oracle::scenes::{Gaussian, SceneBuffers, awkward, cloud};

use crate::draw::{Camera, SIZE};

/// A cloud of overlapping Gaussians: most pixels are covered by many.
pub(super) fn dense(seed: u64, degree: u32) -> SceneBuffers {
    let mut scene = cloud(seed, 500, degree);
    for scale in scene.scales.as_flattened_mut() {
        *scale *= 6.0;
    }
    scene
}

/// A few large Gaussians. The binary16 oracle evaluates each of them at every pixel.
pub(super) fn few(seed: u64, degree: u32) -> SceneBuffers {
    let mut scene = cloud(seed, 100, degree);
    for scale in scene.scales.as_flattened_mut() {
        *scale *= 10.0;
    }
    scene
}

/// A dense cloud in which many Gaussians are at the same depths.
pub(super) fn layered(seed: u64, degree: u32) -> SceneBuffers {
    let mut scene = dense(seed, degree);
    for position in &mut scene.positions {
        let z = position[2].round();
        *position = position.map(|c| c * z / position[2]);
        position[2] = z;
    }
    scene
}

/// Gaussians of every shape, many of which are skipped or cover everything.
pub(super) fn strange(seed: u64) -> SceneBuffers {
    awkward(seed, 10 + 2 * (seed % 20) as usize, (seed % 4) as u32)
}

/// The Gaussians of a scene in a range of its vertices.
pub(super) fn part(scene: &SceneBuffers, vertices: Range<usize>) -> SceneBuffers {
    let triples = (scene.degree + 1).pow(2) as usize;
    SceneBuffers {
        positions: scene.positions[vertices.clone()].to_vec(),
        scales: scene.scales[vertices.clone()].to_vec(),
        rotations: scene.rotations[vertices.clone()].to_vec(),
        opacities: scene.opacities[vertices.clone()].to_vec(),
        sh: scene.sh[vertices.start * triples..vertices.end * triples].to_vec(),
        degree: scene.degree,
    }
}

/// One round Gaussian of degree 0 straight ahead.
pub(super) fn ball() -> Gaussian {
    Gaussian {
        position: [0.0, 0.0, 4.0],
        scale: [0.4; 3],
        rotation: [1.0, 0.0, 0.0, 0.0],
        opacity: 0.8,
        sh: vec![[1.0, 0.2, -0.7]],
    }
}

/// `count` Gaussians, each made by `make` from its index.
pub(super) fn many(count: usize, make: impl Fn(usize) -> Gaussian) -> SceneBuffers {
    SceneBuffers::new(0, (0..count).map(make))
}

/// A pinhole at the origin that looks along +z.
pub(super) fn front() -> Camera {
    gaurast_oracle::scenes::camera(SIZE[0], SIZE[1]).to_vulkan()
}

/// Pinhole cameras.
pub(super) fn pinholes() -> Vec<(&'static str, Camera)> {
    let front = front();
    vec![
        ("pinhole", front),
        ("pinhole_inside", front.eye([0.2, -0.1, 5.0])),
        (
            "pinhole_turned",
            front
                .rotation([0.8, 0.0, -0.6, 0.36, 0.8, 0.48, 0.48, -0.6, 0.64])
                .eye([3.0, 2.0, 1.0])
                .focal_length([60.0, 75.0])
                .principal_point([20.0, 65.0]),
        ),
        (
            "pinhole_mirrored",
            front.rotation([-1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]).near_plane(3.0).far_plane(8.0),
        ),
        ("pinhole_wide", front.focal_length([22.0, 25.0]).eye([0.0, 0.0, 4.0])),
    ]
}

/// Orthographic cameras.
pub(super) fn parallels() -> Vec<(&'static str, Camera)> {
    let parallel = front().model(Model::ORTHOGRAPHIC).focal_length([16.0, 14.0]).depth_coefficients([0.0, 0.05]);
    vec![("parallel", parallel), ("parallel_inside", parallel.eye([0.2, -0.1, 5.0]).near_plane(-4.0))]
}

/// Cameras of all models: from the front, from inside, rotated, mirrored and wide.
pub(super) fn cameras() -> Vec<(&'static str, Camera)> {
    let fisheye = front().model(Model::FISHEYE);
    let panorama = fisheye
        .model(Model::EQUIRECTANGULAR)
        .eye([0.2, -0.1, 5.0])
        .focal_length([SIZE[0] as f32 / std::f32::consts::TAU, SIZE[1] as f32 / std::f32::consts::PI]);
    let mut cameras = pinholes();
    cameras.extend(parallels());
    cameras.extend([
        ("fisheye", fisheye.focal_length([60.0, 55.0])),
        ("fisheye_inside", fisheye.eye([0.2, -0.1, 5.0]).focal_length([16.0; 2])),
        ("panorama", panorama),
        (
            "panorama_turned",
            panorama
                .rotation([1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0])
                .focal_length([30.0, 22.0])
                .principal_point([90.0, 35.0]),
        ),
        // The picture is more than three periods wide.
        ("panorama_repeated", panorama.focal_length([4.5, 20.0])),
    ]);
    cameras
}
