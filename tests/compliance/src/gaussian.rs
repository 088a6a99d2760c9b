//! Gaussians as files state them.

use glam::{Quat, Vec3};

/// The harmonic of degree 0.
pub const SH_C0: f64 = 0.282_094_791_773_878_14;

/// A Gaussian in the axes of its file.
#[derive(Clone, Debug, PartialEq)]
pub struct Gaussian {
    /// The centre.
    pub position: [f32; 3],
    /// A quaternion x, y, z, w.
    pub rotation: [f32; 4],
    /// Standard deviations.
    pub scale: [f32; 3],
    /// From 0 to 1.
    pub opacity: f32,
    /// Red, green and blue of each harmonic, in the order of 3DGS; of one degree in a scene.
    pub harmonics: Vec<[f32; 3]>,
}

impl Gaussian {
    /// A round Gaussian of a colour at the origin, with a standard deviation of 0.4 and an opacity of 0.75.
    pub fn new(color: [f64; 3]) -> Self {
        Self {
            position: [0.0; 3],
            rotation: [0.0, 0.0, 0.0, 1.0],
            scale: [0.4; 3],
            opacity: 0.75,
            harmonics: vec![color.map(|channel| ((channel - 0.5) / SH_C0) as f32)],
        }
    }

    /// The same at another place.
    #[must_use]
    pub fn at(self, x: f32, y: f32, z: f32) -> Self {
        Self { position: [x, y, z], ..self }
    }

    /// The same with other standard deviations.
    #[must_use]
    pub fn scaled(self, x: f32, y: f32, z: f32) -> Self {
        Self { scale: [x, y, z], ..self }
    }

    /// The same with another opacity.
    #[must_use]
    pub fn opaque(self, opacity: f32) -> Self {
        Self { opacity, ..self }
    }

    /// The same turned about an axis.
    #[must_use]
    pub fn turned(self, axis: [f32; 3], degrees: f32) -> Self {
        let rotation = Quat::from_axis_angle(Vec3::from_array(axis).normalize(), degrees.to_radians());
        Self { rotation: rotation.to_array(), ..self }
    }

    /// The same with a rotation as it is.
    #[must_use]
    pub fn with_rotation(self, rotation: [f32; 4]) -> Self {
        Self { rotation, ..self }
    }

    /// The same with harmonics up to a degree: those above degree 0 are multiples of `strength`, which differ from one another.
    #[must_use]
    pub fn with_harmonics(mut self, degree: u32, strength: f32) -> Self {
        for index in 1..(degree + 1) * (degree + 1) {
            let part = |channel: u32| {
                let step = (7 * index + 5 * channel) % 11;
                strength * (step as f32 - 5.0) / 5.0
            };
            self.harmonics.push([part(0), part(1), part(2)]);
        }
        self
    }

    /// The colour of degree 0, from 0 to 1 if it is within.
    pub fn color(&self) -> [f64; 3] {
        self.harmonics[0].map(|coefficient| SH_C0 * f64::from(coefficient) + 0.5)
    }
}
