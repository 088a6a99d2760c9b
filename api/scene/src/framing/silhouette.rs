//! The silhouette of a scene in a picture, and the place from which it fits the picture.

use glam::{DMat3, DVec3};

use super::coverage::{Coverage, Selection, rough_step};
use crate::camera::Camera;
use crate::metadata::Antialiasing;
use crate::scene::Scene;

/// The part of the covered area that may lie outside the picture if it lies apart from the rest: floaters.
const FLOATERS: f64 = 0.005;

/// The part of the picture's limiting side that the silhouette fills.
const FILL: f64 = 0.885;

/// A phase of the search.
struct Phase {
    /// The longer side in pixels of the picture in which the silhouette is searched. It has twice the angle.
    side: f64,
    /// True if a part of a large scene is enough.
    is_rough: bool,
    /// The phase ends at a step that is less than this part of the distance.
    settled: f64,
}

/// The phases of the search: first at low resolution, then as finely as the result is measured.
const PHASES: [Phase; 2] =
    [Phase { side: 160.0, is_rough: true, settled: 0.03 }, Phase { side: 640.0, is_rough: false, settled: 0.008 }];

/// The greatest angle of that picture, in degrees.
const WIDEST: f64 = 150.0;

/// The most steps of a phase. Each one sees what the last one brought into view.
const STEPS: usize = 10;

/// The near plane of the picture in which the silhouette is searched, as a part of the distance.
const NEAR: f64 = 0.02;

/// A place from which a scene fits the picture.
pub(super) struct Fit {
    pub(super) eye: DVec3,
    /// The least depth at which something is visible.
    pub(super) nearest: f64,
    /// The points of the silhouette in the scene.
    pub(super) points: Vec<DVec3>,
}

/// Moves `camera`, a pinhole about `distance` away from the scene's middle, until what `scene` covers is in the middle of
/// its picture and fills it. Its direction is kept. None if nothing is covered.
pub(super) fn fit(scene: &Scene, camera: &Camera, distance: f64) -> Option<Fit> {
    let is_compensated = scene.antialiasing() == Antialiasing::Compensated;
    // From world to camera, row by row: its transpose takes the camera's axes to the world's.
    let axes = DMat3::from_cols_array_2d(&camera.rotation);
    let tangents = [0, 1].map(|axis| FILL * camera.principal[axis] / camera.focal[axis]);
    let mut eye = DVec3::from_array(camera.eye);
    let mut distance = distance;
    let mut found = None;
    for phase in PHASES {
        let step = if phase.is_rough { rough_step(scene) } else { 1 };
        let selection = Selection { beyond: 0.0, is_compensated, step };
        for _ in 0..STEPS {
            let wide = Camera { eye: eye.to_array(), near: NEAR * distance, ..widened(camera, phase.side) };
            let silhouette = Silhouette::of(&Coverage::of(scene, &wide, selection), &wide)?;
            let step = centred(&silhouette.points, tangents);
            let points = silhouette.points.iter().map(|point| eye + axes * *point).collect();
            let mean = silhouette.points.iter().map(|point| point.z).sum::<f64>() / silhouette.points.len() as f64;
            eye += axes * step;
            distance = mean - step.z;
            found = Some(Fit { eye, nearest: silhouette.nearest - step.z, points });
            if step.length() < phase.settled * mean {
                break;
            }
        }
    }
    found
}

/// A camera at the same place with twice the angle and fewer pixels.
fn widened(camera: &Camera, side: f64) -> Camera {
    let [width, height] = [camera.width, camera.height].map(f64::from);
    let scale = side / width.max(height);
    let size = [width, height].map(|side| libm::ceil(side * scale).max(1.0));
    let half = libm::atan(camera.principal[1] / camera.focal[1]);
    let half = (2.0 * half).min(WIDEST.to_radians() / 2.0);
    let focal = size[1] / 2.0 / libm::tan(half);
    Camera {
        focal: [focal; 2],
        principal: size.map(|side| side / 2.0),
        width: size[0] as u32,
        height: size[1] as u32,
        ..camera.clone()
    }
}

/// The step in the camera's axes after which `points`, also in these axes, are in the middle and fill the tangents of the
/// limiting side.
fn centred(points: &[DVec3], tangents: [f64; 2]) -> DVec3 {
    // A point is within the left and the right edge of a camera at (x, z) if x + t z is at most its x + t z, and x - t z
    // at least its x - t z.
    let edges = |axis: usize, tangent: f64| {
        let sums = points.iter().map(|point| point[axis] + tangent * point.z);
        let differences = points.iter().map(|point| point[axis] - tangent * point.z);
        [sums.fold(f64::INFINITY, f64::min), differences.fold(f64::NEG_INFINITY, f64::max)]
    };
    let forward = [0, 1].map(|axis| {
        let [least, greatest] = edges(axis, tangents[axis]);
        (least - greatest) / (2.0 * tangents[axis])
    });
    let forward = forward[0].min(forward[1]);
    // With the distance given, the middle is where the margins of both edges are equal.
    let middle = |axis: usize| {
        let slack = |tangent: f64| {
            let [least, greatest] = edges(axis, tangent);
            [greatest + tangent * forward, least - tangent * forward]
        };
        let (mut low, mut high) = (0.0, tangents[axis]);
        for _ in 0..12 {
            let tangent = (low + high) / 2.0;
            let [from, to] = slack(tangent);
            if from <= to { high = tangent } else { low = tangent }
        }
        let [from, to] = slack(high);
        (from + to) / 2.0
    };
    DVec3::new(middle(0), middle(1), forward)
}

/// The covered pixels of a picture, without floaters.
struct Silhouette {
    /// Corners of pixels at the mean depth of what covers them, in the camera's axes.
    points: Vec<DVec3>,
    /// The least depth.
    nearest: f64,
}

impl Silhouette {
    /// None if nothing is covered.
    fn of(coverage: &Coverage, camera: &Camera) -> Option<Self> {
        let kept = without_floaters(coverage);
        let nearest = kept.iter().map(|index| f64::from(coverage.pixels[*index].nearest)).fold(f64::INFINITY, f64::min);
        let mut is_kept = vec![false; coverage.pixels.len()];
        kept.iter().for_each(|index| is_kept[*index] = true);
        // Pixels between two others of their row and of their column decide nothing.
        let outer = kept.iter().filter(|index| {
            let column = **index % coverage.width;
            let inner = column > 0
                && column + 1 < coverage.width
                && is_kept[**index - 1]
                && is_kept[**index + 1]
                && **index >= coverage.width
                && is_kept[**index - coverage.width]
                && is_kept.get(**index + coverage.width) == Some(&true);
            !inner
        });
        let points = outer.flat_map(|index| {
            let [column, row] = [index % coverage.width, index / coverage.width].map(|place| place as f64);
            let depth = f64::from(coverage.pixels[*index].depth());
            [[0.0, 0.0], [1.0, 1.0]].map(|[x, y]| {
                let slope = |axis: usize, place: f64| (place - camera.principal[axis]) / camera.focal[axis];
                DVec3::new(slope(0, column + x), slope(1, row + y), 1.0) * depth
            })
        });
        let points: Vec<DVec3> = points.filter(|point| point.is_finite()).collect();
        (!points.is_empty()).then_some(Self { points, nearest })
    }
}

/// The indices of the covered pixels, without the outermost ones that lie apart and together cover at most
/// [`FLOATERS`] of the area.
fn without_floaters(coverage: &Coverage) -> Vec<usize> {
    let mut components = components(coverage);
    let area: usize = components.iter().map(Vec::len).sum();
    components.sort_by_key(|component| std::cmp::Reverse(component.len()));
    let Some(main) = components.first() else {
        return Vec::new();
    };
    let (width, height) = (coverage.width, coverage.height());
    let bounds = |component: &[usize]| {
        let columns = component.iter().map(|index| index % width);
        let rows = component.iter().map(|index| index / width);
        [
            columns.clone().min().unwrap_or(0),
            rows.clone().min().unwrap_or(0),
            width - 1 - columns.max().unwrap_or(0),
            height - 1 - rows.max().unwrap_or(0),
        ]
    };
    let main_bounds = bounds(main);
    // How far a component reaches out of the main one's box, in pixels.
    let beyond = |component: &Vec<usize>| {
        let outer = bounds(component);
        (0..4).map(|side| main_bounds[side].saturating_sub(outer[side])).max().unwrap_or(0)
    };
    let mut others: Vec<(usize, Vec<usize>)> =
        components.split_off(1).into_iter().map(|component| (beyond(&component), component)).collect();
    others.sort_by_key(|(beyond, _)| std::cmp::Reverse(*beyond));
    let mut left = (FLOATERS * area as f64) as usize;
    let mut kept = components.concat();
    for (beyond, component) in others {
        if beyond > 0 && component.len() <= left {
            left -= component.len();
        } else {
            kept.extend(component);
        }
    }
    kept
}

/// The connected parts of what is covered, each as the indices of its pixels.
fn components(coverage: &Coverage) -> Vec<Vec<usize>> {
    let (width, height) = (coverage.width, coverage.height());
    let mut open: Vec<bool> = coverage.pixels.iter().map(|pixel| pixel.is_covered()).collect();
    let mut components = Vec::new();
    for start in 0..open.len() {
        if !std::mem::take(&mut open[start]) {
            continue;
        }
        let mut component = vec![start];
        let mut next = 0;
        while let Some(index) = component.get(next).copied() {
            next += 1;
            let (column, row) = (index % width, index / width);
            for y in row.saturating_sub(1)..(row + 2).min(height) {
                for x in column.saturating_sub(1)..(column + 2).min(width) {
                    if std::mem::take(&mut open[y * width + x]) {
                        component.push(y * width + x);
                    }
                }
            }
        }
        components.push(component);
    }
    components
}
