//! Lists of Gaussians, which the host makes for a frame.

use gaurast_scene::Camera;

use crate::resource::Buffer;

/// The Gaussians of a frame, in the order in which they are composited.
pub(crate) struct List {
    /// Their numbers, as an index buffer.
    pub indices: Buffer,
    pub count: u32,
}

/// The numbers of the Gaussians whose centres' z is between the camera's planes, in the order of z. Those of equal z are in
/// the order of their numbers. z is rounded to binary32, as the device does.
pub(crate) fn by_z(positions: &[[f32; 3]], camera: &Camera) -> Vec<u32> {
    let forward = camera.rotation[2].map(|part| f64::from(part as f32));
    let (near, far) = (camera.near as f32, camera.far as f32);
    let z_of = |position: &[f32; 3]| {
        let part = |axis: usize| forward[axis] * (f64::from(position[axis]) - camera.eye[axis]);
        (part(0) + part(1) + part(2)) as f32
    };
    let mut listed: Vec<(f32, u32)> = (0..).zip(positions).map(|(number, position)| (z_of(position), number)).collect();
    listed.retain(|(z, _)| near < *z && *z < far);
    listed.sort_unstable_by(|(z, number), (other_z, other)| z.total_cmp(other_z).then(number.cmp(other)));
    listed.into_iter().map(|(_, number)| number).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaussians_are_listed_by_z() {
        let camera = Camera::look_at([0.0, 0.0, -1.0], [0.0; 3], [0.0, -1.0, 0.0], 90.0, [8, 8]).expect("a camera");
        let camera = camera.with_planes(0.5, 10.0);
        // Depths of 4, 0.25, 2, -1, 2, 11 and 1; the third is the farthest from the eye.
        let positions = [
            [0.0, 0.0, 3.0],
            [0.0, 0.0, -0.75],
            [9.0, 0.0, 1.0],
            [0.0, 0.0, -2.0],
            [0.0, 0.0, 1.0],
            [0.0, 0.0, 10.0],
            [0.0, 0.0, 0.0],
        ];
        assert_eq!(by_z(&positions, &camera), [6, 2, 4, 0]);
    }
}
