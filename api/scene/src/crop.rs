//! A box to which a scene is cropped.

use glam::{DMat3, DVec3};

use crate::axes::Axes;
use crate::scene::Scene;

/// A box to which a scene is cropped: Gaussians whose centres are outside are left out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crop {
    /// The box's middle.
    pub centre: [f64; 3],
    /// The directions of its sides, each a unit vector.
    pub sides: [[f64; 3]; 3],
    /// The lengths of its sides.
    pub lengths: [f64; 3],
}

impl Crop {
    /// The box with its sides turned by roll, pitch and yaw in radians, about x, then y, then z.
    pub(crate) fn turned_by(centre: [f64; 3], [roll, pitch, yaw]: [f64; 3], lengths: [f64; 3]) -> Self {
        let rotation = DMat3::from_rotation_z(yaw) * DMat3::from_rotation_y(pitch) * DMat3::from_rotation_x(roll);
        Self { centre, sides: rotation.to_cols_array_2d(), lengths }
    }

    /// The same box of a scene that is read with these axes, and not with those of scenes.
    #[must_use]
    pub fn with_axes(&self, axes: Axes) -> Self {
        let turned = |vector: [f64; 3]| (axes.matrix() * DVec3::from_array(vector)).to_array();
        Self { centre: turned(self.centre), sides: self.sides.map(turned), ..*self }
    }

    /// True if a point is in the box.
    pub fn contains(&self, point: [f64; 3]) -> bool {
        let from_centre = DVec3::from_array(point) - DVec3::from_array(self.centre);
        let within = |(side, length): (&[f64; 3], f64)| from_centre.dot(DVec3::from_array(*side)).abs() < length / 2.0;
        self.sides.iter().zip(self.lengths).all(within)
    }

    /// Leaves out the Gaussians of `scene` that are outside.
    pub fn apply(&self, scene: &mut Scene) {
        let origin = DVec3::from_array(scene.origin());
        scene.retain(|position| {
            let centre = DVec3::from_array(position.map(f64::from)) + origin;
            self.contains(centre.to_array())
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::GaussianShape;

    #[test]
    fn a_box_keeps_the_centres_within() {
        let quarter = std::f64::consts::FRAC_PI_2;
        // Turned about z by a quarter, the longest side is along y.
        let turned = Crop::turned_by([1.0, 0.0, 0.0], [0.0, 0.0, quarter], [4.0, 2.0, 1.0]);
        assert!(turned.contains([1.0, 1.9, 0.0]) && !turned.contains([2.9, 0.0, 0.0]));
        // Roll is first: y goes to z, and pitch takes z to x.
        let both = Crop::turned_by([0.0; 3], [quarter, quarter, 0.0], [1.0, 4.0, 2.0]);
        assert!(both.contains([1.9, 0.0, 0.0]) && !both.contains([0.0, 1.9, 0.0]));
        let upright = Crop::turned_by([0.0, 2.0, 0.0], [0.0; 3], [1.0; 3]).with_axes(Axes::RIGHT_UP_BACK);
        assert!(upright.contains([0.0, -2.0, 0.0]) && !upright.contains([0.0, 2.0, 0.0]));
    }

    #[test]
    fn gaussians_outside_are_left_out() {
        let mut scene = Scene::with_capacity(1, 0);
        for x in 0..4_u8 {
            let sh: Vec<[f32; 3]> = (0..4_u8).map(|i| [f32::from(10 * x + i); 3]).collect();
            scene.push([x.into(), 0.0, 0.0], GaussianShape { opacity: x.into(), ..GaussianShape::default() }, &sh);
        }
        scene.set_origin([100.0, 0.0, 0.0]);
        Crop::turned_by([101.5, 0.0, 0.0], [0.0; 3], [1.5, 1.0, 1.0]).apply(&mut scene);
        assert_eq!(scene.positions(), [[1.0, 0.0, 0.0], [2.0, 0.0, 0.0]]);
        assert_eq!(scene.shapes().iter().map(|shape| shape.opacity).collect::<Vec<_>>(), [1.0, 2.0]);
        assert_eq!((scene.sh().len(), scene.sh()[0], scene.sh()[7]), (8, [10.0; 3], [23.0; 3]));
    }
}
