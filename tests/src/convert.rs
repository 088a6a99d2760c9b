//! What applications hold, as the oracle takes it.

use gaurast::vk::{
    GaussianAntialiasingGAURAST, GaussianCameraGAURAST, GaussianCameraModelGAURAST,
    GaussianOrderGAURAST, PipelineGaussianStateCreateInfoGAURAST,
};
use gaurast_samples::scene::Scene;

use crate::oracle::{OracleCamera, OracleModel, OracleOrder, OracleState};
use crate::scenes::SceneBuffers;

impl From<&Scene> for SceneBuffers {
    fn from(scene: &Scene) -> Self {
        let shapes = scene.shapes();
        Self {
            positions: scene.positions().to_vec(),
            scales: shapes.iter().map(|shape| shape.scale).collect(),
            rotations: shapes.iter().map(|shape| shape.rotation).collect(),
            opacities: shapes.iter().map(|shape| shape.opacity).collect(),
            sh: scene.sh().to_vec(),
            degree: scene.sh_degree(),
        }
    }
}

impl OracleCamera {
    /// The camera of a draw and its viewport's width and height, or `None` if the oracle lacks its
    /// model.
    pub fn new(camera: &GaussianCameraGAURAST, [width, height]: [u32; 2]) -> Option<Self> {
        let model = match camera.model {
            GaussianCameraModelGAURAST::PINHOLE => OracleModel::Pinhole,
            GaussianCameraModelGAURAST::ORTHOGRAPHIC => OracleModel::Orthographic,
            GaussianCameraModelGAURAST::FISHEYE => OracleModel::Fisheye,
            _ => return None,
        };
        Some(Self {
            model,
            width,
            height,
            rotation: camera.rotation,
            eye: camera.eye,
            focal: camera.focal_length,
            principal: camera.principal_point,
            near: camera.near_plane,
            far: camera.far_plane,
        })
    }

    /// The camera as a draw takes it.
    pub fn to_vulkan(&self) -> GaussianCameraGAURAST<'static> {
        let model = match self.model {
            OracleModel::Pinhole => GaussianCameraModelGAURAST::PINHOLE,
            OracleModel::Orthographic => GaussianCameraModelGAURAST::ORTHOGRAPHIC,
            OracleModel::Fisheye => GaussianCameraModelGAURAST::FISHEYE,
        };
        GaussianCameraGAURAST::default()
            .model(model)
            .rotation(self.rotation)
            .eye(self.eye)
            .focal_length(self.focal)
            .principal_point(self.principal)
            .near_plane(self.near)
            .far_plane(self.far)
    }
}

impl From<&PipelineGaussianStateCreateInfoGAURAST<'_>> for OracleState {
    fn from(info: &PipelineGaussianStateCreateInfoGAURAST) -> Self {
        Self {
            low_pass: info.low_pass_variance,
            alpha_floor: info.alpha_floor,
            alpha_ceiling: info.alpha_ceiling,
            transmittance_floor: info.transmittance_floor,
            opacity_compensated: info.antialiasing
                == GaussianAntialiasingGAURAST::OPACITY_COMPENSATED,
            order: match info.order {
                GaussianOrderGAURAST::RADIAL_DISTANCE => OracleOrder::RadialDistance,
                GaussianOrderGAURAST::PRIMITIVE => OracleOrder::Primitive,
                _ => OracleOrder::ViewDepth,
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compare::Statistics;
    use crate::data::require_data;
    use crate::oracle::render_bounded;
    use gaurast_samples::camera::{Camera, DEFAULT_FOV};

    #[test]
    fn defaults_are_those_of_the_extension() {
        let info = PipelineGaussianStateCreateInfoGAURAST::default();
        assert_eq!(OracleState::from(&info), OracleState::default());
        let info = info.antialiasing(GaussianAntialiasingGAURAST::OPACITY_COMPENSATED);
        assert!(OracleState::from(&info).opacity_compensated);
    }

    #[test]
    fn other_cameras_are_refused() {
        let camera = GaussianCameraGAURAST::default();
        assert!(OracleCamera::new(&camera, [8, 8]).is_some());
        let own = crate::scenes::camera(8, 8);
        assert_eq!(OracleCamera::new(&own.to_vulkan(), [8, 8]), Some(own));
        let camera = camera.model(GaussianCameraModelGAURAST::EQUIRECTANGULAR);
        assert_eq!(OracleCamera::new(&camera, [8, 8]), None);
    }

    #[test]
    fn trained_scenes_are_drawn_and_nearly_all_decidable() {
        for name in [
            "splats/skull.ply",
            "splats/playbot-125k.ply",
            "splats/yashica-t4-top8192.ply",
        ] {
            let Some(path) = require_data(name) else {
                continue;
            };
            let scene = Scene::load(&path).unwrap();
            let size = [192, 144];
            let camera = Camera::framing(&scene, DEFAULT_FOV, size).to_vulkan();
            let reference = render_bounded(
                &SceneBuffers::from(&scene).as_oracle(),
                &OracleCamera::new(&camera, size).unwrap(),
                &OracleState::default(),
            );
            let pixels = reference.nominal.len();
            assert!(
                reference
                    .nominal
                    .iter()
                    .filter(|rgba| rgba[3] > 0.5)
                    .count()
                    > pixels / 20
            );
            assert!(reference.alternatives.len() * 100 < pixels, "{name}");
            assert_eq!(reference.exhausted, 0, "{name}");
        }
    }

    #[test]
    fn another_renderer_made_the_same_pictures() {
        // Pictures by splat-transform with its own cut-offs, 8 bits a channel and lossy: another
        // independent renderer is as far from them as is asked here.
        for (name, eye, size, psnr) in [
            ("tiny", [0.0, 5.0, -8.0], [320, 240], 47.5),
            ("mid", [0.0, 10.0, -15.0], [640, 360], 40.5),
        ] {
            let scene = require_data(&format!("reference/{name}.generated.ply"));
            let picture = require_data(&format!("reference/{name}.webp"));
            let (Some(scene), Some(picture)) = (scene, picture) else {
                continue;
            };
            let scene = Scene::load(&scene).unwrap();
            let camera = Camera::look_at(eye, [0.0; 3], [0.0, 1.0, 0.0], 60.0, size).unwrap();
            let drawn = render_bounded(
                &SceneBuffers::from(&scene).as_oracle(),
                &OracleCamera::new(&camera.to_vulkan(), size).unwrap(),
                &OracleState::default(),
            );
            let picture = image::open(picture).unwrap().into_rgb8();
            let picture: Vec<[f32; 4]> = picture
                .pixels()
                .map(|pixel| pixel.0.map(|c| f32::from(c) / 255.0))
                .map(|[r, g, b]| [r, g, b, 1.0])
                .collect();
            let drawn: Vec<[f32; 4]> = drawn
                .to_f32()
                .iter()
                .map(|[r, g, b, _]| [r.min(1.0), g.min(1.0), b.min(1.0), 1.0])
                .collect();
            let statistics = Statistics::new(&drawn, &picture, size[0]);
            assert!(statistics.psnr > psnr, "{name}: {statistics}");
        }
    }
}
