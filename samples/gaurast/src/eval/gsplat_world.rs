//! The coordinates in which gsplat's `simple_trainer.py` trains by default.
//!
//! It turns, moves and scales the world so that the cameras' mean up is its up, the point that they look at is the origin,
//! and their median distance is 1. Then it turns the world to the principal axes of COLMAP's points, whose median is the
//! origin. The signs of these axes are what an eigenvalue solver happens to give, so the model decides among them: its
//! Gaussians lie where the points do.

use std::collections::HashSet;

use gaurast_scene::Camera;
use glam::{DMat3, DVec3};

/// The cells along the longest axis of the points, by which the orientations are judged.
const CELLS: f64 = 48.0;

/// The share of the points that are left out at each end of an axis.
const OUTLIERS: f64 = 0.02;

/// The turns that keep the axes and the handedness.
const TURNS: [[f64; 3]; 4] = [[1.0, 1.0, 1.0], [-1.0, -1.0, 1.0], [-1.0, 1.0, -1.0], [1.0, -1.0, -1.0]];

/// A map of the world: a rotation and a factor, then a translation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct World {
    rotation: DMat3,
    scale: f64,
    translation: DVec3,
}

impl World {
    fn point(&self, point: DVec3) -> DVec3 {
        self.scale * (self.rotation * point) + self.translation
    }

    /// The camera in this world.
    pub fn camera(&self, camera: &Camera) -> Camera {
        let turned = |direction: [f64; 3]| (self.rotation * DVec3::from_array(direction)).to_array();
        Camera {
            rotation: camera.rotation.map(turned),
            eye: self.point(DVec3::from_array(camera.eye)).to_array(),
            ..camera.clone()
        }
    }

    /// The world after another map, a rotation and a translation.
    fn then(&self, rotation: DMat3, translation: DVec3) -> Self {
        Self {
            rotation: rotation * self.rotation,
            scale: self.scale,
            translation: rotation * self.translation + translation,
        }
    }
}

/// The worlds in which a model may have been trained.
#[derive(Debug)]
pub struct Worlds {
    candidates: [World; 4],
    points: Vec<DVec3>,
}

/// A chosen world, and the shares of the points near which there are Gaussians, in it and in the next best one.
#[derive(Debug)]
pub struct Chosen {
    pub world: World,
    pub share: f64,
    pub next: f64,
}

impl Worlds {
    /// The worlds of all cameras and points of a data set. None if there are no cameras or points.
    pub fn new(cameras: &[Camera], points: &[[f64; 3]]) -> Option<Self> {
        if cameras.is_empty() || points.is_empty() {
            return None;
        }
        let world = of_cameras(cameras);
        let points: Vec<DVec3> = points.iter().copied().map(DVec3::from_array).collect();
        let placed: Vec<DVec3> = points.iter().map(|point| world.point(*point)).collect();
        let middle = median(&placed);
        let axes = principal_axes(&placed, middle);
        let candidates = TURNS.map(|signs| {
            let rotation = DMat3::from_diagonal(DVec3::from_array(signs)) * axes.transpose();
            world.then(rotation, -(rotation * middle))
        });
        Some(Self { candidates, points })
    }

    /// The world in which most of the points lie near Gaussians at `positions`.
    pub fn choose(&self, positions: &[[f32; 3]]) -> Chosen {
        let mut shares = self.candidates.map(|world| (self.share(&world, positions), world));
        shares.sort_by(|(a, _), (b, _)| b.total_cmp(a));
        let [(share, world), (next, _), ..] = shares;
        Chosen { world, share, next }
    }

    /// The share of the points in whose cells there are Gaussians.
    fn share(&self, world: &World, positions: &[[f32; 3]]) -> f64 {
        let placed: Vec<DVec3> = self.points.iter().map(|point| world.point(*point)).collect();
        let range = |axis: usize| {
            let sorted = sorted(placed.iter().map(|point| point[axis]));
            let end = (OUTLIERS * sorted.len() as f64) as usize;
            sorted[sorted.len() - 1 - end] - sorted[end]
        };
        let cell = range(0).max(range(1)).max(range(2)).max(f64::MIN_POSITIVE) / CELLS;
        let of_cell = |point: DVec3| (point / cell).floor().as_ivec3();
        let filled: HashSet<_> = positions.iter().map(|p| of_cell(DVec3::from_array(p.map(f64::from)))).collect();
        let near = placed.iter().filter(|point| filled.contains(&of_cell(**point))).count();
        near as f64 / placed.len() as f64
    }
}

/// The world in which the cameras' mean up is -y, the median of the points of their axes next to the origin is the origin,
/// and the median of their distances from it is 1.
fn of_cameras(cameras: &[Camera]) -> World {
    let up = cameras.iter().map(|camera| -DVec3::from_array(camera.rotation[1])).sum::<DVec3>().normalize_or_zero();
    let target = DVec3::NEG_Y;
    let cosine = up.dot(target);
    let rotation = if cosine > -1.0 {
        let axis = up.cross(target);
        let skew = DMat3::from_cols(
            DVec3::new(0.0, axis.z, -axis.y),
            DVec3::new(-axis.z, 0.0, axis.x),
            DVec3::new(axis.y, -axis.x, 0.0),
        );
        DMat3::IDENTITY + skew + skew * skew * (1.0 / (1.0 + cosine))
    } else {
        DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0))
    };
    let eyes: Vec<DVec3> = cameras.iter().map(|camera| rotation * DVec3::from_array(camera.eye)).collect();
    let nearest: Vec<DVec3> = eyes
        .iter()
        .zip(cameras)
        .map(|(eye, camera)| {
            let forward = rotation * DVec3::from_array(camera.rotation[2]);
            *eye - forward.dot(*eye) * forward
        })
        .collect();
    let focus = median(&nearest);
    let distance = middle_of(&sorted(eyes.iter().map(|eye| (*eye - focus).length())));
    let scale = if distance > 0.0 { 1.0 / distance } else { 1.0 };
    World { rotation, scale, translation: -scale * focus }
}

fn sorted(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut sorted: Vec<f64> = values.collect();
    sorted.sort_by(f64::total_cmp);
    sorted
}

/// The median of sorted values, of which there is one at least.
fn middle_of(sorted: &[f64]) -> f64 {
    let half = sorted.len() / 2;
    if sorted.len().is_multiple_of(2) { 0.5 * (sorted[half - 1] + sorted[half]) } else { sorted[half] }
}

/// The median of each coordinate.
fn median(points: &[DVec3]) -> DVec3 {
    let of_axis = |axis: usize| middle_of(&sorted(points.iter().map(|point| point[axis])));
    DVec3::new(of_axis(0), of_axis(1), of_axis(2))
}

/// The principal axes of points as columns: a rotation, with the axis of the greatest variance first.
fn principal_axes(points: &[DVec3], middle: DVec3) -> DMat3 {
    let mean = points.iter().map(|point| *point - middle).sum::<DVec3>() / points.len() as f64;
    let mut matrix = [[0.0; 3]; 3];
    for point in points {
        let apart = *point - middle - mean;
        for (row, matrix) in matrix.iter_mut().enumerate() {
            for (column, sum) in matrix.iter_mut().enumerate() {
                *sum += apart[row] * apart[column];
            }
        }
    }
    let mut axes = DMat3::IDENTITY;
    // Jacobi's rotations, which make the largest remaining entry zero; a few dozen do for three rows.
    for _ in 0..64 {
        let entries = [(0, 1), (0, 2), (1, 2)];
        let [p, q] = entries.into_iter().fold([0, 1], |[p, q], (row, column)| {
            if matrix[row][column].abs() > matrix[p][q].abs() { [row, column] } else { [p, q] }
        });
        if matrix[p][q] == 0.0 {
            break;
        }
        let slope = (matrix[q][q] - matrix[p][p]) / (2.0 * matrix[p][q]);
        let tangent = slope.signum() / (slope.abs() + (slope * slope + 1.0).sqrt());
        let cosine = 1.0 / (tangent * tangent + 1.0).sqrt();
        let sine = tangent * cosine;
        let mut turn = DMat3::IDENTITY;
        (turn.col_mut(p)[p], turn.col_mut(q)[q]) = (cosine, cosine);
        (turn.col_mut(q)[p], turn.col_mut(p)[q]) = (sine, -sine);
        let turned = turn.transpose() * DMat3::from_cols_array_2d(&matrix) * turn;
        matrix = turned.to_cols_array_2d();
        axes *= turn;
    }
    let mut order = [0, 1, 2];
    order.sort_by(|a, b| matrix[*b][*b].total_cmp(&matrix[*a][*a]));
    let axes = DMat3::from_cols(axes.col(order[0]), axes.col(order[1]), axes.col(order[2]));
    if axes.determinant() < 0.0 { DMat3::from_cols(-axes.x_axis, axes.y_axis, axes.z_axis) } else { axes }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The map that gsplat's formulas give in numpy, row by row.
    const EXPECTED: [[f64; 4]; 3] = [
        [2.057_179_412_439_076e-1, 7.435_690_711_669_519e-4, 1.378_016_876_107_459e-2, 1.149_594_283_128_23e-2],
        [-7.005_724_770_906_757e-4, 2.061_780_347_194_546e-1, -6.667_031_624_522_955e-4, -4.456_134_720_562_929e-2],
        [-1.378_242_156_704_094e-2, 6.183_849_439_344_07e-4, 2.057_182_047_157_922e-1, -4.124_897_722_503_414e-3],
    ];

    /// Cameras that look at a moving point from around it, which nod.
    fn cameras() -> Vec<Camera> {
        let first = Camera::orbit(1, [8, 8]).remove(0);
        let camera = |at: u32| {
            let (turn, nod) = (0.3 * f64::from(at), 0.1 * f64::from(at % 3));
            let rotation = DMat3::from_rotation_y(turn) * DMat3::from_rotation_x(nod);
            let eye = -5.0 * rotation.z_axis + DVec3::new(0.5, 0.1 * f64::from(at), -0.2);
            Camera { rotation: rotation.to_cols_array_2d(), eye: eye.to_array(), ..first.clone() }
        };
        (0..9).map(camera).collect()
    }

    fn points() -> Vec<[f64; 3]> {
        let point = |at: u32| {
            let t = f64::from(at);
            let sine = |factor: f64| libm::sin(factor * t);
            let cosine = |factor: f64| libm::cos(factor * t);
            [
                3.0 * sine(1.7) + 0.3 * cosine(1.0),
                cosine(2.3) + 0.5 * sine(1.0).abs(),
                0.4 * sine(0.9) * sine(0.9) * sine(0.9) + 0.2 * sine(1.7),
            ]
        };
        (0..200).map(point).collect()
    }

    #[test]
    fn the_world_is_that_of_gsplats_formulas() {
        let worlds = Worlds::new(&cameras(), &points()).expect("cameras and points");
        let expected =
            |point: &[f64; 3]| EXPECTED.map(|[x, y, z, offset]| x * point[0] + y * point[1] + z * point[2] + offset);
        // A model that was trained in this world has its Gaussians where the points are.
        let model: Vec<[f32; 3]> = points().iter().map(|point| expected(point).map(|value| value as f32)).collect();
        let Chosen { world, share, next } = worlds.choose(&model);
        assert!(share > 0.95 && next < 0.6, "{share} {next}");
        for point in points() {
            let placed = world.point(DVec3::from_array(point));
            assert!(placed.abs_diff_eq(DVec3::from_array(expected(&point)), 1e-9), "{point:?}: {placed}");
        }
        // The eye that a camera has is where the map takes it, and it looks at the same points.
        let camera = cameras().remove(4);
        let placed = world.camera(&camera);
        for point in points() {
            let before = camera.project(point);
            let after = placed.project(world.point(DVec3::from_array(point)).to_array());
            let apart = before.zip(after).map(|(a, b)| (a[0] - b[0]).abs().max((a[1] - b[1]).abs()));
            assert!(apart.is_some_and(|apart| apart < 1e-9), "{before:?} {after:?}");
        }
    }

    #[test]
    fn a_data_set_without_points_has_no_world() {
        assert!(Worlds::new(&cameras(), &[]).is_none());
        assert!(Worlds::new(&[], &points()).is_none());
    }
}
