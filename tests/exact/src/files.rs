//! Scenes and cameras as a program reads or makes them, without a device: attributes of files, framing, transforms.

use std::io::{Cursor, Write};
use std::path::Path;

use flate2::Compression;
use flate2::write::GzEncoder;
use gaurast_scene::{Camera, Extent, Framing, Scene, Subject, Transform, garden};
use glam::{DQuat, DVec3};

/// Gaussians of a file.
const GAUSSIANS: u32 = 500;

/// Numbers of a generator of integers.
struct Numbers(u32);

impl Numbers {
    /// A byte.
    fn byte(&mut self) -> u8 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 17;
        self.0 ^= self.0 << 5;
        (self.0 >> 8) as u8
    }

    /// A multiple of 1/64 from -2 to 2.
    fn number(&mut self) -> f32 {
        f32::from(self.byte()) / 64.0 - 2.0
    }
}

fn read(name: &str, bytes: &[u8]) -> Scene {
    let scene = gaurast_scene::read(Path::new(name), &mut Cursor::new(bytes), bytes.len() as u64);
    scene.expect("a valid file")
}

/// A PLY file of 3DGS: logarithms of scales, logits of opacities, harmonics of degree 1.
fn ply() -> Scene {
    let names = ["x", "y", "z", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3", "opacity"];
    let colors = (0..3).map(|at| format!("f_dc_{at}")).chain((0..9).map(|at| format!("f_rest_{at}")));
    let names: Vec<String> = names.iter().map(ToString::to_string).chain(colors).collect();
    let mut file = format!("ply\nformat binary_little_endian 1.0\nelement vertex {GAUSSIANS}\n").into_bytes();
    for name in &names {
        file.extend(format!("property float {name}\n").bytes());
    }
    file.extend(b"end_header\n");
    let mut numbers = Numbers(1);
    for _ in 0..GAUSSIANS * names.len() as u32 {
        file.extend(numbers.number().to_le_bytes());
    }
    read("scene.ply", &file)
}

/// An SPZ file of version 2 and degree 1.
fn spz() -> Scene {
    let mut file = b"NGSP".to_vec();
    file.extend(2_u32.to_le_bytes());
    file.extend(GAUSSIANS.to_le_bytes());
    file.extend([1, 12, 0, 0]);
    let mut numbers = Numbers(2);
    // Positions, opacities, colours, scales, rotations, harmonics.
    let bytes = GAUSSIANS * (9 + 1 + 3 + 3 + 3 + 9);
    file.extend((0..bytes).map(|_| numbers.byte()));
    let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(&file).expect("memory takes it");
    read("scene.spz", &encoder.finish().expect("memory takes it"))
}

/// A `.splat` file.
fn splat() -> Scene {
    let mut numbers = Numbers(3);
    let mut file = Vec::new();
    for _ in 0..GAUSSIANS {
        for number in 0..6 {
            let value = numbers.number();
            file.extend((if number < 3 { value } else { 0.01 + value.abs() }).to_le_bytes());
        }
        file.extend((0..8).map(|_| numbers.byte()));
    }
    read("scene.splat", &file)
}

/// A scene that is turned, scaled and moved.
fn transformed() -> Scene {
    let mut scene = ply();
    let axis = DVec3::new(1.0, 2.0, -0.5).normalize();
    let rotation = DQuat::from_axis_angle(axis, 0.7);
    scene.append(&spz(), &Transform { scale: 1.3, rotation, translation: DVec3::new(0.1, -0.2, 0.3) });
    scene
}

/// The attributes of a scene.
fn attributes(scene: &Scene) -> Vec<u8> {
    let mut bytes = bytemuck::cast_slice(scene.positions()).to_vec();
    bytes.extend_from_slice(bytemuck::cast_slice(scene.shapes()));
    bytes.extend_from_slice(bytemuck::cast_slice(scene.sh()));
    bytes
}

/// The numbers of cameras.
fn numbers(cameras: &[Camera]) -> Vec<u8> {
    let numbers = |camera: &Camera| {
        let mut numbers = camera.rotation.as_flattened().to_vec();
        numbers.extend(camera.eye);
        numbers.extend(camera.focal);
        numbers.extend(camera.principal);
        numbers.extend([camera.near, camera.far]);
        numbers
    };
    cameras.iter().flat_map(numbers).flat_map(f64::to_le_bytes).collect()
}

/// Cameras around a scene, and those of other models.
fn framed() -> Vec<u8> {
    let (scene, size) = (ply(), [160, 90]);
    let subject = Subject::of_box(Extent::of(&scene));
    let angles = (0..12).map(f64::from).map(|at| [30.0 * at - 170.0, 15.0 * at - 80.0]);
    let camera = |[azimuth, elevation]: [f64; 2]| {
        let framing = Framing {
            azimuth: Some(azimuth),
            elevation: Some(elevation),
            ..Framing::new(35.0 + elevation / 4.0, size)
        };
        framing.camera(&subject).expect("a camera")
    };
    let mut cameras: Vec<Camera> = angles.map(camera).collect();
    let first = gaurast_scene::frame_middle(&scene, 50.0, size);
    cameras.extend([first.orthographic(3.0), first.fisheye(2.8), first.panorama(), first.zoomed(1.7)]);
    cameras.extend(Camera::orbit(9, size));
    numbers(&cameras)
}

/// The names of all cases.
pub(crate) const NAMES: [&str; 6] = ["ply", "spz", "splat", "transformed", "garden", "cameras"];

/// The bytes of a case.
pub(crate) fn bytes(name: &str) -> Vec<u8> {
    match name {
        "ply" => attributes(&ply()),
        "spz" => attributes(&spz()),
        "splat" => attributes(&splat()),
        "transformed" => attributes(&transformed()),
        "garden" => attributes(&garden::scene(1, 3000)),
        _ => framed(),
    }
}
