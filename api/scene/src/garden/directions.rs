//! Directions of the garden's splats, with y up.

use std::f64::consts::{PI, TAU};

use glam::{DQuat, DVec3};

/// Point `index` of `count` points that are spread evenly over the unit sphere, from the top downwards.
pub(super) fn spread(index: usize, count: usize) -> DVec3 {
    let golden = PI * (3.0 - 5.0_f64.sqrt());
    let y = 1.0 - 2.0 * (index as f64 + 0.5) / count as f64;
    let ring = (1.0 - y * y).sqrt();
    let (sin, cos) = libm::sincos(golden * index as f64 % TAU);
    DVec3::new(ring * cos, y, ring * sin)
}

/// The rotation that takes +z to `normal`, after a rotation by `angle` around it.
pub(super) fn facing(normal: DVec3, angle: f64) -> DQuat {
    DQuat::from_rotation_arc(DVec3::Z, normal.normalize()) * DQuat::from_rotation_z(angle)
}
