//! The part of a picture that a scene covers, at low resolution and without colours.

use glam::{DMat3, DQuat, DVec3, Mat3, Vec3};
use rayon::prelude::*;

use crate::camera::Camera;
use crate::scene::Scene;
use crate::shape::GaussianShape;

/// The variance in square pixels of the renderer's low-pass filter.
const LOW_PASS: f32 = 0.3;

/// A pixel is finished when it transmits less than this.
const FINISHED: f32 = 0.02;

/// Smaller alphas are left out, as in 3DGS.
const LEAST_ALPHA: f32 = 1.0 / 255.0;

/// The greatest alpha, as of 3DGS.
const GREATEST_ALPHA: f32 = 0.99;

/// The factor of the picture's tangents at which the slope of the projection is taken for Gaussians beside the picture,
/// as in 3DGS.
const BESIDE: f32 = 1.3;

/// The least number of Gaussians that a thread takes at once, and the most parts of a scene. They decide how sums are
/// rounded, so that the result does not depend on the number of threads.
const PART: usize = 1 << 15;
const PARTS: usize = 16;

/// The pixels of a pinhole camera's picture that a scene covers.
pub(super) struct Coverage {
    /// The picture's width in pixels.
    pub(super) width: usize,
    /// A pixel each, row by row.
    pub(super) pixels: Vec<Pixel>,
}

/// A pixel of a [`Coverage`].
#[derive(Clone, Copy)]
pub(super) struct Pixel {
    /// The part of the light from behind the scene that reaches the camera.
    pub(super) transmittance: f32,
    /// The least depth at which something is visible.
    pub(super) nearest: f32,
    /// The sums of alphas, and of alphas times depths.
    alphas: f32,
    depths: f32,
}

impl Pixel {
    const EMPTY: Self = Self { transmittance: 1.0, nearest: f32::INFINITY, alphas: 0.0, depths: 0.0 };

    /// Returns true if alpha is above a half.
    pub(super) fn is_covered(self) -> bool {
        self.transmittance < 0.5
    }

    /// The mean depth of what covers the pixel.
    pub(super) fn depth(self) -> f32 {
        self.depths / self.alphas
    }

    fn add(&mut self, alpha: f32, depth: f32) {
        self.transmittance *= 1.0 - alpha;
        self.alphas += alpha;
        self.depths += alpha * depth;
        self.nearest = self.nearest.min(depth);
    }

    /// Adds what another part of the scene covers.
    fn join(&mut self, other: Self) {
        self.transmittance *= other.transmittance;
        self.alphas += other.alphas;
        self.depths += other.depths;
        self.nearest = self.nearest.min(other.nearest);
    }
}

/// The Gaussians that a coverage has, and how they are filtered.
#[derive(Clone, Copy)]
pub(super) struct Selection {
    /// Gaussians are left out whose centres are nearer to the eye.
    pub(super) beyond: f64,
    /// True if opacities make up for the filter.
    pub(super) is_compensated: bool,
    /// One Gaussian of this many is drawn, and covers as much as that many.
    pub(super) step: usize,
}

/// The most Gaussians of a scene that a rough coverage draws.
const ROUGHLY: usize = 1 << 18;

/// The step of a rough coverage of `scene`.
pub(super) fn rough_step(scene: &Scene) -> usize {
    scene.len().div_ceil(ROUGHLY).max(1)
}

impl Coverage {
    /// The coverage of `scene` in the picture of `camera`, which is a pinhole.
    pub(super) fn of(scene: &Scene, camera: &Camera, selection: Selection) -> Self {
        let view = View::of(scene, camera, selection);
        let size = scene.len().div_ceil(PARTS).max(PART);
        let parts: Vec<Vec<Pixel>> = (scene.positions().par_chunks(size))
            .zip(scene.shapes().par_chunks(size))
            .map(|(positions, shapes)| {
                let mut pixels = view.empty();
                for (position, shape) in positions.iter().zip(shapes).step_by(selection.step) {
                    view.splat(*position, shape, &mut pixels);
                }
                pixels
            })
            .collect();
        let mut pixels = view.empty();
        for part in &parts {
            for (pixel, other) in pixels.iter_mut().zip(part) {
                pixel.join(*other);
            }
        }
        for triangle in scene.mesh().vertices().chunks_exact(3) {
            view.triangle([0, 1, 2].map(|i| triangle[i].position), &mut pixels);
        }
        Self { width: view.size[0], pixels }
    }

    /// The picture's height in pixels.
    pub(super) fn height(&self) -> usize {
        self.pixels.len() / self.width
    }
}

/// A camera, prepared for many Gaussians.
struct View {
    /// From the scene's positions to the camera's: right, down, forward.
    rotation: Mat3,
    /// The scene's origin, seen from the eye, in the scene's axes.
    origin: DVec3,
    focal: [f32; 2],
    principal: [f32; 2],
    near: f32,
    size: [usize; 2],
    selection: Selection,
}

impl View {
    fn of(scene: &Scene, camera: &Camera, selection: Selection) -> Self {
        let [right, down, forward] = camera.rotation.map(|row| DVec3::from_array(row).as_vec3());
        Self {
            rotation: Mat3::from_cols(right, down, forward).transpose(),
            origin: DVec3::from_array(scene.origin()) - DVec3::from_array(camera.eye),
            focal: camera.focal.map(|x| x as f32),
            principal: camera.principal.map(|x| x as f32),
            near: camera.near as f32,
            size: [camera.width as usize, camera.height as usize],
            selection,
        }
    }

    fn empty(&self) -> Vec<Pixel> {
        vec![Pixel::EMPTY; self.size[0] * self.size[1]]
    }

    /// The position in the camera's axes.
    fn seen(&self, position: [f32; 3]) -> Vec3 {
        let offset = DVec3::from_array(position.map(f64::from)) + self.origin;
        self.rotation * offset.as_vec3()
    }

    /// The position in the picture of a point in the camera's axes, in pixels.
    fn project(&self, point: Vec3) -> [f32; 2] {
        [self.focal[0] * point.x / point.z + self.principal[0], self.focal[1] * point.y / point.z + self.principal[1]]
    }

    /// Adds a Gaussian.
    fn splat(&self, position: [f32; 3], shape: &GaussianShape, pixels: &mut [Pixel]) {
        let point = self.seen(position);
        let is_drawn = point.z > self.near && point.is_finite() && shape.opacity > 0.0;
        if !is_drawn || f64::from(point.length_squared()) < self.selection.beyond * self.selection.beyond {
            return;
        }
        let [w, x, y, z] = shape.rotation.map(f64::from);
        let quaternion = DQuat::from_xyzw(x, y, z, w);
        let is_rotation = quaternion.length_squared() > 0.0;
        let axes = if is_rotation { DMat3::from_quat(quaternion.normalize()).as_mat3() } else { Mat3::IDENTITY };
        let scaled = self.rotation * axes * Mat3::from_diagonal(Vec3::from_array(shape.scale));
        let slope = |axis: usize, value: f32| {
            let greatest = BESIDE * self.size[axis] as f32 / 2.0 / self.focal[axis];
            (value / point.z).clamp(-greatest, greatest)
        };
        let row = |axis: usize, offset: f32| {
            let mut direction = [0.0, 0.0, -slope(axis, offset)];
            direction[axis] = 1.0;
            scaled.transpose() * (Vec3::from_array(direction) * (self.focal[axis] / point.z))
        };
        let (u, v) = (row(0, point.x), row(1, point.y));
        let (a, b, c) = (u.length_squared(), u.dot(v), v.length_squared());
        let (wide_a, wide_c) = (a + LOW_PASS, c + LOW_PASS);
        let determinant = wide_a * wide_c - b * b;
        let ratio = if self.selection.is_compensated { (a * c - b * b).max(0.0) / determinant } else { 1.0 };
        let opacity = (shape.opacity * ratio.sqrt()).min(GREATEST_ALPHA);
        if !determinant.is_finite() || opacity.is_nan() || opacity <= LEAST_ALPHA {
            return;
        }
        let reach = 2.0 * libm::logf(opacity / LEAST_ALPHA);
        let centre = self.project(point);
        let range = |axis: usize, variance: f32| {
            let half = (reach * variance).sqrt();
            let last = self.size[axis] as f32;
            let from = (centre[axis] - half - 0.5).clamp(0.0, last);
            let to = (centre[axis] + half + 0.5).clamp(0.0, last);
            from as usize..to as usize
        };
        let (columns, rows) = (range(0, wide_a), range(1, wide_c));
        for row in rows {
            let dy = row as f32 + 0.5 - centre[1];
            for column in columns.clone() {
                let pixel = &mut pixels[row * self.size[0] + column];
                if pixel.transmittance < FINISHED {
                    continue;
                }
                let dx = column as f32 + 0.5 - centre[0];
                let power = (wide_c * dx * dx - 2.0 * b * dx * dy + wide_a * dy * dy) / determinant;
                if power < reach {
                    let alpha = opacity * libm::expf(-0.5 * power);
                    let step = self.selection.step;
                    let all = if step == 1 { alpha } else { 1.0 - libm::powf(1.0 - alpha, step as f32) };
                    pixel.add(all, point.z);
                }
            }
        }
    }

    /// Adds an opaque triangle, unless it reaches behind the near plane. The pixels of its corners are covered even if it
    /// is thinner than a pixel.
    fn triangle(&self, corners: [[f32; 3]; 3], pixels: &mut [Pixel]) {
        let corners = corners.map(|corner| self.seen(corner));
        if !corners.iter().all(|corner| corner.z > self.near && corner.is_finite()) {
            return;
        }
        let points = corners.map(|corner| self.project(corner));
        let last = self.size.map(|side| side as f32);
        let mut cover = |column: f32, row: f32, depth: f32| {
            if (0.0..last[0]).contains(&column) && (0.0..last[1]).contains(&row) {
                pixels[row as usize * self.size[0] + column as usize].add(1.0, depth);
            }
        };
        for (point, corner) in points.iter().zip(&corners) {
            cover(point[0], point[1], corner.z);
        }
        let edge =
            |a: [f32; 2], b: [f32; 2], p: [f32; 2]| (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]);
        let area = edge(points[0], points[1], points[2]);
        if area == 0.0 || !area.is_finite() {
            return;
        }
        let range = |axis: usize| {
            let values = points.map(|point| point[axis]);
            let from = values.into_iter().fold(last[axis], f32::min).max(0.0);
            let to = (values.into_iter().fold(0.0, f32::max) + 1.0).min(last[axis]);
            from as usize..to as usize
        };
        for row in range(1) {
            for column in range(0) {
                let pixel = [column as f32 + 0.5, row as f32 + 0.5];
                let weights = [(1, 2), (2, 0), (0, 1)].map(|(a, b)| edge(points[a], points[b], pixel) / area);
                if weights.iter().all(|weight| *weight >= 0.0) {
                    let depth = weights.iter().zip(&corners).map(|(weight, corner)| weight * corner.z).sum();
                    cover(pixel[0], pixel[1], depth);
                }
            }
        }
    }
}
