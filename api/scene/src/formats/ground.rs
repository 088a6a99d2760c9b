//! A guess at the end of a scene where its ground is, for files of a format whose writers disagree about their axes.

use glam::{DMat3, DQuat};

use crate::scene::Scene;
use crate::shape::GaussianShape;

/// The part of the height at each end that is compared.
const END: f64 = 0.1;

/// The part of the opaque area that lies at the ground's end at least.
const LEAST: f64 = 0.1;

/// The least ratio of the areas at both ends.
const RATIO: f64 = 2.0;

/// Scenes of fewer Gaussians are not judged.
const LEAST_GAUSSIANS: usize = 1000;

/// The part of the area that is left out at each end.
const TAIL: f64 = 0.005;

/// The largest area that a Gaussian counts with, as a quantile of all areas.
const LARGEST: f64 = 0.999;

/// An end of a scene's height.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum End {
    /// The greatest y, where the ground is if y points down.
    Down,
    /// The least y.
    Up,
}

/// The least part of all area that lies flat at the ground's end, and the least ratio of these areas at both ends.
const LEAST_FLAT: f64 = 0.025;
const FLAT_RATIO: f64 = 4.0;

/// A Gaussian lies flat if the cosine of the angle from its shortest axis to the vertical is at least this, and this axis
/// is at most half as long as the next one.
const LEAST_COSINE: f64 = 0.9;

/// A Gaussian as an area at a height.
struct Area {
    height: f64,
    area: f64,
    lies_flat: bool,
}

impl Area {
    fn of(position: [f32; 3], shape: &GaussianShape) -> Self {
        let scale = shape.scale.map(f64::from);
        let mut order = [0, 1, 2];
        order.sort_unstable_by(|a, b| scale[*a].total_cmp(&scale[*b]));
        let [shortest, middle, longest] = order.map(|axis| scale[axis]);
        let [w, x, y, z] = shape.rotation.map(f64::from);
        let axes = DMat3::from_quat(DQuat::from_xyzw(x, y, z, w).normalize());
        Self {
            height: position[1].into(),
            area: f64::from(shape.opacity) * middle * longest,
            lies_flat: shortest <= middle / 2.0 && axes.col(order[0]).y.abs() >= LEAST_COSINE,
        }
    }
}

/// The end of `scene` where its ground is, by the area of its opaque Gaussians: there, the outermost tenth of the height
/// has at least a tenth of the area and at least twice as much as the other end has; at least 2.5 % of all area lies flat
/// there, and four times as much as at the other end; and the area's centre is on this side. None if no end is like that,
/// or the scene has few Gaussians.
pub(super) fn ground(scene: &Scene) -> Option<End> {
    if scene.len() < LEAST_GAUSSIANS {
        return None;
    }
    let mut areas: Vec<Area> = (scene.positions().iter().zip(scene.shapes()))
        .map(|(position, shape)| Area::of(*position, shape))
        .filter(|area| area.height.is_finite() && area.area.is_finite() && area.area > 0.0)
        .collect();
    if areas.is_empty() {
        return None;
    }
    let mut sizes: Vec<f64> = areas.iter().map(|area| area.area).collect();
    let at = ((sizes.len() - 1) as f64 * LARGEST) as usize;
    let largest = *sizes.select_nth_unstable_by(at, f64::total_cmp).1;
    areas.iter_mut().for_each(|area| area.area = area.area.min(largest));
    areas.sort_unstable_by(|a, b| a.height.total_cmp(&b.height));
    let total: f64 = areas.iter().map(|area| area.area).sum();
    let height_at = |part: f64| {
        let mut sum = 0.0;
        let found = areas.iter().find(|area| {
            sum += area.area;
            sum >= part * total
        });
        found.map_or(0.0, |area| area.height)
    };
    let (least, greatest) = (height_at(TAIL), height_at(1.0 - TAIL));
    let within = |from: f64, to: f64, flat: bool| {
        let counts = |area: &&Area| {
            let place = (area.height - least) / (greatest - least);
            (from..=to).contains(&place) && (area.lies_flat || !flat)
        };
        areas.iter().filter(counts).map(|area| area.area).sum::<f64>() / total
    };
    let [up, flat_up] = [false, true].map(|flat| within(-END, END, flat));
    let [down, flat_down] = [false, true].map(|flat| within(1.0 - END, 1.0 + END, flat));
    let lower_half = within(0.5, f64::INFINITY, false);
    let is_ground = |area: f64, other: f64, flat: f64, other_flat: f64| {
        area >= LEAST && area >= RATIO * other && flat >= LEAST_FLAT && flat >= FLAT_RATIO * other_flat
    };
    if is_ground(down, up, flat_down, flat_up) && lower_half > 0.5 {
        Some(End::Down)
    } else if is_ground(up, down, flat_up, flat_down) && lower_half < 0.5 {
        Some(End::Up)
    } else {
        None
    }
}
