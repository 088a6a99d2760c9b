//! What applications hold, as the oracle takes it.

use gaurast::vk::{
    GaussianAntialiasingGAURAST, GaussianCameraGAURAST, GaussianCameraModelGAURAST,
    GaussianGeometryGAURAST, GaussianLinearizationGAURAST, GaussianOrderGAURAST,
    PipelineGaussianStateCreateInfoGAURAST,
};

use crate::oracle::{OracleCamera, OracleGeometry, OracleModel, OracleOrder, OracleState};

impl OracleCamera {
    /// The camera of a draw and its viewport's width and height, or `None` if the oracle lacks its
    /// model.
    pub fn new(camera: &GaussianCameraGAURAST, [width, height]: [u32; 2]) -> Option<Self> {
        let model = match camera.model {
            GaussianCameraModelGAURAST::PINHOLE => OracleModel::Pinhole,
            GaussianCameraModelGAURAST::ORTHOGRAPHIC => OracleModel::Orthographic,
            GaussianCameraModelGAURAST::FISHEYE => OracleModel::Fisheye,
            GaussianCameraModelGAURAST::EQUIRECTANGULAR => OracleModel::Equirectangular,
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
            OracleModel::Equirectangular => GaussianCameraModelGAURAST::EQUIRECTANGULAR,
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
            unscented: info.linearization == GaussianLinearizationGAURAST::UNSCENTED,
            geometry: match info.geometry {
                GaussianGeometryGAURAST::GAUSSIAN_2D => OracleGeometry::Surfel,
                _ => OracleGeometry::Volume,
            },
            order: match info.order {
                GaussianOrderGAURAST::RADIAL_DISTANCE => OracleOrder::RadialDistance,
                GaussianOrderGAURAST::PRIMITIVE => OracleOrder::Primitive,
                GaussianOrderGAURAST::PER_PIXEL => OracleOrder::PerPixel,
                _ => OracleOrder::ViewDepth,
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
        let camera = camera.model(GaussianCameraModelGAURAST::from_raw(77));
        assert_eq!(OracleCamera::new(&camera, [8, 8]), None);
    }
}
