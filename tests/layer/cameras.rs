//! Mistakes in cameras that commands set.

use ash::vk;
use gaurast::vk::{
    GaussianCameraDistortionGAURAST, GaussianCameraGAURAST, GaussianCameraModelGAURAST, GaussianDistortionModelGAURAST,
};

use crate::stage::{Mistake, camera, gaussian, mistake, recording};

type Camera = GaussianCameraGAURAST<'static>;

fn set(name: &'static str, id: &'static str, cameras: fn() -> Vec<Camera>) -> Mistake {
    mistake(name, id, move |stage| {
        recording(&stage.full, |commands| {
            // SAFETY: see the crate.
            unsafe { gaussian(&stage.full).cmd_set_gaussian_cameras(commands.raw, &cameras()) };
        })
    })
}

/// A camera through a lens.
fn lens(
    name: &'static str,
    id: &'static str,
    model: GaussianCameraModelGAURAST,
    change: fn(GaussianCameraDistortionGAURAST<'static>) -> GaussianCameraDistortionGAURAST<'static>,
) -> Mistake {
    mistake(name, id, move |stage| {
        recording(&stage.full, |commands| {
            let mut lens = change(GaussianCameraDistortionGAURAST::default().radial([0.1, 0.0, 0.0, 0.0, 0.0, 0.0]));
            commands.camera(&camera().model(model).push_next(&mut lens));
        })
    })
}

pub fn mistakes() -> Vec<Mistake> {
    let mut all = of_cameras();
    all.extend(of_lenses());
    all
}

fn of_lenses() -> Vec<Mistake> {
    use GaussianCameraModelGAURAST as Camera;
    use GaussianDistortionModelGAURAST as Model;
    let model = "VUID-VkGaussianCameraDistortionGAURAST-model-90085";
    let one = "VUID-VkGaussianCameraDistortionGAURAST-radial-90087";
    let angle = "VUID-VkGaussianCameraDistortionGAURAST-radial-90088";
    vec![
        mistake(
            "a lens that distorts without its feature",
            "VUID-VkGaussianCameraDistortionGAURAST-gaussianDistortion-90084",
            |stage| {
                recording(&stage.bare, |commands| {
                    let mut lens = GaussianCameraDistortionGAURAST::default().tangential([0.01, 0.0]);
                    commands.camera(&camera().push_next(&mut lens));
                })
            },
        ),
        lens(
            "a distortion whose model is none",
            "VUID-VkGaussianCameraDistortionGAURAST-model-parameter",
            Camera::PINHOLE,
            |lens| lens.model(Model::from_raw(77)),
        ),
        lens("a parallel camera whose lens distorts", model, Camera::ORTHOGRAPHIC, |lens| lens),
        lens("a panorama whose lens distorts", model, Camera::EQUIRECTANGULAR, |lens| lens),
        lens(
            "a distortion that is NaN",
            "VUID-VkGaussianCameraDistortionGAURAST-radial-90086",
            Camera::FISHEYE,
            |lens| lens.thin_prism([0.0, f32::NAN, 0.0, 0.0]),
        ),
        lens("a division with tangential coefficients", one, Camera::PINHOLE, |lens| {
            lens.model(Model::DIVISION).tangential([0.0, 0.1])
        }),
        lens("a field of view with two coefficients", one, Camera::PINHOLE, |lens| {
            lens.model(Model::FIELD_OF_VIEW).radial([0.9, 0.1, 0.0, 0.0, 0.0, 0.0])
        }),
        lens("a field of view in degrees", angle, Camera::PINHOLE, |lens| {
            lens.model(Model::FIELD_OF_VIEW).radial([55.0, 0.0, 0.0, 0.0, 0.0, 0.0])
        }),
    ]
}

fn of_cameras() -> Vec<Mistake> {
    let count = "VUID-vkCmdSetGaussianCamerasGAURAST-cameraCount-90062";
    let model = "VUID-VkGaussianCameraGAURAST-model-parameter";
    let near = "VUID-VkGaussianCameraGAURAST-nearPlane-90069";
    let focal = "VUID-VkGaussianCameraGAURAST-focalLength-90068";
    let far = "VUID-VkGaussianCameraGAURAST-farPlane-90070";
    vec![
        set("no cameras", count, Vec::new),
        set("more cameras than views", count, || vec![camera(); 33]),
        set("the structure's type was not set", "VUID-VkGaussianCameraGAURAST-sType-sType", || {
            let mut camera = camera();
            camera.s_type = vk::StructureType::APPLICATION_INFO;
            vec![camera]
        }),
        set("a model that is none", model, || vec![camera().model(GaussianCameraModelGAURAST::from_raw(77))]),
        mistake("a fisheye without its feature", "VUID-VkGaussianCameraGAURAST-model-90079", |stage| {
            recording(&stage.bare, |commands| {
                let fisheye = camera().model(GaussianCameraModelGAURAST::FISHEYE);
                commands.camera(&fisheye);
            })
        }),
        set("a rotation that is NaN", "VUID-VkGaussianCameraGAURAST-rotation-90064", || {
            vec![camera().rotation([f32::NAN; 9])]
        }),
        set("an infinite eye", "VUID-VkGaussianCameraGAURAST-eye-90065", || vec![camera().eye([f64::INFINITY; 3])]),
        set("a principal point that is NaN", "VUID-VkGaussianCameraGAURAST-principalPoint-90066", || {
            vec![camera().principal_point([f32::NAN, 0.0])]
        }),
        set("depth coefficients that are NaN", "VUID-VkGaussianCameraGAURAST-depthCoefficients-90067", || {
            vec![camera().depth_coefficients([0.0, f32::NAN])]
        }),
        set("no focal length", focal, || vec![camera().focal_length([0.0; 2])]),
        set("a focal length that mirrors", focal, || vec![camera().focal_length([100.0, -100.0])]),
        set("a near plane at the eye", near, || vec![camera().near_plane(0.0)]),
        set("a far plane before the near one", far, || vec![camera().far_plane(0.1)]),
        set("a far plane of 0 for none", far, || vec![camera().far_plane(0.0)]),
        set("an eye beyond all positions", "GAURAST-Camera-eye", || vec![camera().eye([1e300, 0.0, 0.0])]),
        set("a focal length of 1e38", "GAURAST-Camera-focal-length", || vec![camera().focal_length([1e38; 2])]),
        set("a rotation with a scale", "GAURAST-Camera-rotation", || {
            vec![camera().rotation([2.0, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 2.0])]
        }),
    ]
}
