//! Tests of the camera helpers: every visible point must have the same pixel and depth by the camera's formulas as by
//! view matrix, projection matrix, division and viewport.

use gaurast::camera::{CameraError, widen};
use gaurast::vk::{GaussianCameraDataGAURAST, GaussianCameraGAURAST, GaussianCameraModelGAURAST};
use glam::dcamera::lh::proj::vulkan as vulkan_lh;
use glam::dcamera::lh::view::look_at_mat4 as look_at_lh;
use glam::dcamera::rh::proj::{directx, vulkan};
use glam::dcamera::rh::view::look_at_mat4 as look_at_rh;
use glam::{DMat3, DMat4, DVec3, Vec3};

const VIEWPORT: [f32; 2] = [640.0, 360.0];
const EYE: DVec3 = DVec3::new(3.0, -2.0, 5.0);
const TARGET: DVec3 = DVec3::new(0.5, 0.25, -1.0);

/// Pixel and depth by the camera's own definition, and the depth variable z.
fn by_camera(camera: &GaussianCameraGAURAST<'_>, p: DVec3) -> ([f64; 2], f64, f64) {
    let rotation = DMat3::from_cols_array(&camera.rotation.map(f64::from)).transpose();
    let t = rotation * (p - DVec3::from_array(camera.eye));
    let [fx, fy] = camera.focal_length.map(f64::from);
    let [cx, cy] = camera.principal_point.map(f64::from);
    let [c0, c1] = camera.depth_coefficients.map(f64::from);
    if camera.model == GaussianCameraModelGAURAST::ORTHOGRAPHIC {
        ([fx * t.x + cx, fy * t.y + cy], c0 + c1 * t.z, t.z)
    } else {
        ([fx * t.x / t.z + cx, fy * t.y / t.z + cy], c0 + c1 / t.z, t.z)
    }
}

/// Pixel and depth of a vertex in Vulkan, from the corner of the viewport's area.
fn by_matrices(view: DMat4, projection: DMat4, viewport: [f32; 2], p: DVec3) -> ([f64; 2], f64) {
    let clip = projection * view * p.extend(1.0);
    let ndc = clip.truncate() / clip.w;
    let [width, height] = viewport.map(f64::from);
    let corner = if height < 0.0 { -height } else { 0.0 };
    ([(ndc.x + 1.0) * width / 2.0, corner + (ndc.y + 1.0) * height / 2.0], ndc.z)
}

/// Asserts that camera and matrices agree for points in front of the eye, some off screen.
fn assert_agrees(camera: &GaussianCameraGAURAST<'_>, view: DMat4, projection: DMat4, viewport: [f32; 2], forward: f64) {
    assert!(camera.focal_length.iter().all(|&f| f > 0.0));
    let camera_to_world = view.inverse();
    for distance in [0.5, 1.0, 3.0, 20.0, 90.0] {
        for (x, y) in [(0.0, 0.0), (0.4, 0.1), (-0.7, 0.3), (0.2, -0.5), (-1.5, -1.2)] {
            let t = DVec3::new(x * distance, y * distance, forward * distance);
            let p = camera_to_world.transform_point3(t);
            let (pixel, depth, z) = by_camera(camera, p);
            let (expected_pixel, expected_depth) = by_matrices(view, projection, viewport, p);
            // Only the camera's rounding to binary32 may make a difference.
            let scale = f64::from(viewport[0]) * (1.0 + distance);
            for axis in 0..2 {
                let error = (pixel[axis] - expected_pixel[axis]).abs();
                assert!(error < 1e-6 * scale, "{pixel:?} is not {expected_pixel:?}");
            }
            assert!((z - distance).abs() < 1e-5 * distance, "z {z} is not {distance}");
            assert!((depth - expected_depth).abs() < 1e-6, "{depth} is not {expected_depth}");
        }
    }
}

fn look_at() -> DMat4 {
    look_at_rh(EYE, TARGET, DVec3::Y)
}

fn from(view: DMat4, projection: DMat4) -> Result<GaussianCameraGAURAST<'static>, CameraError> {
    GaussianCameraGAURAST::from_view_projection(&view.to_cols_array_2d(), &projection.to_cols_array_2d(), VIEWPORT)
}

fn assert_near(value: f32, expected: f32) {
    assert!((value - expected).abs() <= 1e-5 * expected.abs(), "{value} is not {expected}");
}

#[gaurast_runner::test]
fn perspective() {
    let projection = vulkan::perspective(0.9, 16.0 / 9.0, 0.1, 100.0);
    let camera = from(look_at(), projection).unwrap();
    assert_eq!(camera.model, GaussianCameraModelGAURAST::PINHOLE);
    assert_eq!(camera.principal_point, [320.0, 180.0]);
    assert_near(camera.focal_length[1], (180.0 / 0.45_f64.tan()) as f32);
    assert_near(camera.near_plane, 0.1);
    assert_near(camera.far_plane, 100.0);
    assert!((DVec3::from_array(camera.eye) - EYE).length() < 1e-14);
    // An upright picture is a proper rotation: right x down = forward.
    let rotation = DMat3::from_cols_array(&camera.rotation.map(f64::from));
    assert!((rotation.determinant() - 1.0).abs() < 1e-6);
    assert_agrees(&camera, look_at(), projection, VIEWPORT, -1.0);
}

#[gaurast_runner::test]
fn perspective_with_y_up_is_the_same_picture_upside_down() {
    let projection = directx::perspective(0.9, 16.0 / 9.0, 0.1, 100.0);
    let camera = from(look_at(), projection).unwrap();
    assert_agrees(&camera, look_at(), projection, VIEWPORT, -1.0);
}

#[gaurast_runner::test]
fn negative_viewport_height_turns_the_picture_over() {
    let projection = directx::frustum(-0.05, 0.08, -0.03, 0.06, 0.1, 100.0);
    let viewport = [VIEWPORT[0], -VIEWPORT[1]];
    let camera = GaussianCameraGAURAST::from_view_projection(
        &look_at().to_cols_array_2d(),
        &projection.to_cols_array_2d(),
        viewport,
    )
    .unwrap();
    assert_agrees(&camera, look_at(), projection, viewport, -1.0);
    let flipped = from(look_at(), vulkan::frustum(-0.05, 0.08, -0.03, 0.06, 0.1, 100.0)).unwrap();
    assert_eq!(camera.rotation, flipped.rotation);
    assert_eq!(camera.principal_point, flipped.principal_point);
}

#[gaurast_runner::test]
fn off_centre() {
    let projection = vulkan::frustum(-0.05, 0.08, -0.03, 0.06, 0.1, 100.0);
    let camera = from(look_at(), projection).unwrap();
    assert_near(camera.principal_point[0], 640.0 * 5.0 / 13.0);
    assert_near(camera.principal_point[1], 360.0 * 6.0 / 9.0);
    assert_agrees(&camera, look_at(), projection, VIEWPORT, -1.0);
}

#[gaurast_runner::test]
fn reverse_depth_and_infinite_far_planes() {
    let finite_reverse = directx::perspective(0.9, 16.0 / 9.0, 100.0, 0.1);
    let infinite = directx::perspective_infinite(0.9, 16.0 / 9.0, 0.1);
    let infinite_reverse = directx::perspective_infinite_reverse(0.9, 16.0 / 9.0, 0.1);
    for (projection, far) in [(finite_reverse, 100.0), (infinite, f32::INFINITY), (infinite_reverse, f32::INFINITY)] {
        let camera = from(look_at(), projection).unwrap();
        assert_near(camera.near_plane, 0.1);
        if far.is_finite() {
            assert_near(camera.far_plane, far);
        } else {
            assert_eq!(camera.far_plane, far);
        }
        assert_agrees(&camera, look_at(), projection, VIEWPORT, -1.0);
    }
}

#[gaurast_runner::test]
fn orthographic() {
    for (near, far) in [(0.1, 100.0), (-10.0, 30.0)] {
        let projection = vulkan::orthographic(-4.0, 3.0, -2.0, 2.5, near, far);
        let camera = from(look_at(), projection).unwrap();
        assert_eq!(camera.model, GaussianCameraModelGAURAST::ORTHOGRAPHIC);
        assert_near(camera.focal_length[0], 640.0 / 7.0);
        assert_near(camera.near_plane, near as f32);
        assert_near(camera.far_plane, far as f32);
        assert_agrees(&camera, look_at(), projection, VIEWPORT, -1.0);
    }
}

#[gaurast_runner::test]
fn forward_z_views() {
    let view = look_at_lh(EYE, TARGET, DVec3::Y);
    for projection in [
        vulkan_lh::perspective(0.9, 16.0 / 9.0, 0.1, 100.0),
        vulkan_lh::perspective_infinite_reverse(0.9, 16.0 / 9.0, 0.1),
        vulkan_lh::orthographic(-4.0, 3.0, -2.0, 2.5, 0.1, 100.0),
    ] {
        let camera = GaussianCameraGAURAST::from_forward_z_view_projection(
            &view.to_cols_array_2d(),
            &projection.to_cols_array_2d(),
            VIEWPORT,
        )
        .unwrap();
        assert_agrees(&camera, view, projection, VIEWPORT, 1.0);
    }
}

#[gaurast_runner::test]
fn the_eye_keeps_double_precision() {
    let eye = DVec3::new(1.0e7 + 0.125, -3.0e6, 5.0e6 + 0.0625);
    let view = look_at_rh(eye, eye + DVec3::new(1.0, 0.3, -0.5), DVec3::Y);
    let camera = from(view, directx::perspective_infinite(0.9, 1.0, 0.1)).unwrap();
    assert!((DVec3::from_array(camera.eye) - eye).length() < 1e-7);
}

#[gaurast_runner::test]
fn single_precision_matrices_are_accepted() {
    let view = glam::camera::rh::view::look_at_mat4(Vec3::new(3.0, -2.0, 5.0), Vec3::ZERO, Vec3::Y);
    let projection = glam::camera::rh::proj::vulkan::perspective(0.9, 16.0 / 9.0, 0.1, 100.0);
    let camera = GaussianCameraGAURAST::from_view_projection(
        &widen(&view.to_cols_array_2d()),
        &widen(&projection.to_cols_array_2d()),
        VIEWPORT,
    )
    .unwrap();
    assert_agrees(&camera, view.as_dmat4(), projection.as_dmat4(), VIEWPORT, -1.0);
}

#[gaurast_runner::test]
fn a_panorama_fills_its_viewport() {
    let axes = [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let camera = GaussianCameraGAURAST::panorama(&axes, [1.0, 2.0, 3.0], [512.0, 256.0]).unwrap();
    assert_eq!(camera.model, GaussianCameraModelGAURAST::EQUIRECTANGULAR);
    assert_eq!(camera.eye, [1.0, 2.0, 3.0]);
    assert_eq!(camera.rotation[3..6], [0.0, 0.0, 1.0]);
    assert_eq!(camera.principal_point, [256.0, 128.0]);
    let [x, y] = camera.focal_length.map(f64::from);
    assert!((x * core::f64::consts::TAU - 512.0).abs() < 1e-4);
    assert!((y * core::f64::consts::PI - 256.0).abs() < 1e-4);
    let error = |axes, viewport| GaussianCameraGAURAST::panorama(axes, [0.0; 3], viewport).unwrap_err();
    assert_eq!(error(&axes, [0.0, 8.0]), CameraError::EmptyViewport);
    assert_eq!(error(&axes, [8.0, f32::NAN]), CameraError::NotFinite);
    assert_eq!(error(&[[2.0; 3]; 3], [8.0; 2]), CameraError::NotRigid);
}

#[gaurast_runner::test]
fn a_pose_sees_its_axes() {
    let rotation = DMat3::from_rotation_y(0.7) * DMat3::from_rotation_x(-0.2);
    let rows = rotation.transpose().to_cols_array_2d();
    let camera = GaussianCameraGAURAST::from_pose(&rows, EYE.to_array(), [500.0, 510.0], [300.0, 190.0]).unwrap();
    // A point 2 ahead, 0.5 to the right and 0.25 down.
    let p = EYE + rotation * DVec3::new(0.5, 0.25, 2.0);
    let (pixel, _, z) = by_camera(&camera, p);
    assert!((pixel[0] - 425.0).abs() < 1e-4);
    assert!((pixel[1] - 253.75).abs() < 1e-4);
    assert!((z - 2.0).abs() < 1e-6);
}

#[gaurast_runner::test]
fn depth_ranges_agree_with_projections() {
    let rotation = DMat3::IDENTITY.to_cols_array_2d();
    let pose = GaussianCameraGAURAST::from_pose(&rotation, [0.0; 3], [1.0; 2], [0.0; 2]).unwrap();
    let perspective = |near, far| from(DMat4::IDENTITY, directx::perspective(0.9, 1.0, near, far));
    let check = |camera: GaussianCameraGAURAST<'_>, expected: GaussianCameraGAURAST<'_>| {
        for i in 0..2 {
            let error = camera.depth_coefficients[i] - expected.depth_coefficients[i];
            assert!(error.abs() < 1e-6, "{camera:?} {expected:?}");
        }
    };
    check(pose.depth_range(0.5, 40.0).unwrap(), perspective(0.5, 40.0).unwrap());
    check(pose.reverse_depth_range(0.5, 40.0).unwrap(), perspective(40.0, 0.5).unwrap());
    let infinite = pose.depth_range(0.5, f32::INFINITY).unwrap();
    assert_eq!(infinite.depth_coefficients, [1.0, -0.5]);
    let reverse = pose.reverse_depth_range(0.5, f32::INFINITY).unwrap();
    assert_eq!(reverse.depth_coefficients, [0.0, 0.5]);
    let orthographic = pose.model(GaussianCameraModelGAURAST::ORTHOGRAPHIC);
    let range = orthographic.depth_range(-1.0, 3.0).unwrap();
    assert_eq!(range.depth_coefficients, [0.25, 0.25]);
    for (near, far) in [(0.0, 1.0), (2.0, 2.0), (1.0, f32::NAN), (-1.0, 1.0)] {
        assert_eq!(pose.depth_range(near, far).unwrap_err(), CameraError::InvalidDepthRange);
    }
    assert!(orthographic.depth_range(1.0, f32::INFINITY).is_err());
}

#[gaurast_runner::test]
fn unusable_inputs_are_errors() {
    let projection = directx::perspective(0.9, 1.0, 0.1, 100.0);
    let error = |view, projection| from(view, projection).unwrap_err();
    let scaled = DMat4::from_scale(DVec3::splat(2.0));
    assert_eq!(error(scaled, projection), CameraError::NotRigid);
    assert_eq!(error(DMat4::ZERO, projection), CameraError::NotRigid);
    assert_eq!(error(DMat4::NAN, projection), CameraError::NotFinite);
    assert_eq!(error(look_at(), DMat4::ZERO), CameraError::UnsupportedProjection);
    let mut skewed = projection;
    skewed.y_axis.x = 0.5;
    assert_eq!(error(look_at(), skewed), CameraError::UnsupportedProjection);
    let mut oblique = projection;
    oblique.x_axis.z = 0.5;
    assert_eq!(error(look_at(), oblique), CameraError::UnsupportedProjection);
    let backwards = vulkan_lh::perspective(0.9, 1.0, 0.1, 100.0);
    assert_eq!(error(look_at(), backwards), CameraError::OppositeDirection);
    let narrow = DMat4::from_scale(DVec3::new(1e300, 1.0, 1.0)) * projection;
    assert_eq!(error(look_at(), narrow), CameraError::NotFinite);
    let empty = GaussianCameraGAURAST::from_view_projection(
        &look_at().to_cols_array_2d(),
        &projection.to_cols_array_2d(),
        [640.0, 0.0],
    );
    assert_eq!(empty.unwrap_err(), CameraError::EmptyViewport);
    let stretched = [[2.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let pose = GaussianCameraGAURAST::from_pose(&stretched, [0.0; 3], [1.0; 2], [0.0; 2]);
    assert_eq!(pose.unwrap_err(), CameraError::NotRigid);
}

#[gaurast_runner::test]
fn uniform_data_holds_the_same_camera() {
    let camera = from(look_at(), directx::perspective(0.9, 1.0, 0.1, 100.0)).unwrap();
    let data = GaussianCameraDataGAURAST::from(&camera);
    for row in 0..3 {
        assert_eq!(data.rotation[row][..3], camera.rotation[3 * row..3 * row + 3]);
    }
    assert_eq!(data.eye, camera.eye);
    assert_eq!(data.focal_length, camera.focal_length);
    assert_eq!(data.principal_point, camera.principal_point);
    assert_eq!(data.depth_coefficients, camera.depth_coefficients);
    assert_eq!([data.near_plane, data.far_plane], [camera.near_plane, camera.far_plane]);
}
