//! Defaults that are not zero: what the original 3DGS code draws, and locations that are not used.

use core::marker::PhantomData;

use ash::vk::TaggedStructure;

use super::definitions::*;

/// Every location is unused.
impl Default for GaussianAttributeLocationsGAURAST {
    #[inline]
    fn default() -> Self {
        Self {
            position: GAUSSIAN_LOCATION_UNUSED_GAURAST,
            scale: GAUSSIAN_LOCATION_UNUSED_GAURAST,
            rotation: GAUSSIAN_LOCATION_UNUSED_GAURAST,
            opacity: GAUSSIAN_LOCATION_UNUSED_GAURAST,
            first_spherical_harmonics: GAUSSIAN_LOCATION_UNUSED_GAURAST,
            first_model_matrix: GAUSSIAN_LOCATION_UNUSED_GAURAST,
            model_opacity: GAUSSIAN_LOCATION_UNUSED_GAURAST,
        }
    }
}

/// Every location is unused.
impl Default for GaussianVertexOutputLocationsGAURAST {
    #[inline]
    fn default() -> Self {
        Self {
            covariance: GAUSSIAN_LOCATION_UNUSED_GAURAST,
            opacity: GAUSSIAN_LOCATION_UNUSED_GAURAST,
            color: GAUSSIAN_LOCATION_UNUSED_GAURAST,
            depth_key: GAUSSIAN_LOCATION_UNUSED_GAURAST,
        }
    }
}

/// Every location is unused.
impl Default for GaussianResolveInputLocationsGAURAST {
    #[inline]
    fn default() -> Self {
        Self {
            accumulated_color: GAUSSIAN_LOCATION_UNUSED_GAURAST,
            depth: GAUSSIAN_LOCATION_UNUSED_GAURAST,
            linear_depth: GAUSSIAN_LOCATION_UNUSED_GAURAST,
            median_gaussian: GAUSSIAN_LOCATION_UNUSED_GAURAST,
            nearest_gaussian: GAUSSIAN_LOCATION_UNUSED_GAURAST,
            first_camera: GAUSSIAN_LOCATION_UNUSED_GAURAST,
        }
    }
}

/// The state of the original 3DGS code, with harmonics of degree 0 and every location unused.
impl Default for PipelineGaussianStateCreateInfoGAURAST<'_> {
    #[inline]
    fn default() -> Self {
        Self {
            s_type: Self::STRUCTURE_TYPE,
            p_next: core::ptr::null(),
            flags: PipelineGaussianStateCreateFlagsGAURAST::empty(),
            projection_mode: GaussianProjectionModeGAURAST::FIXED_FUNCTION,
            geometry: GaussianGeometryGAURAST::GAUSSIAN_3D,
            linearization: GaussianLinearizationGAURAST::JACOBIAN,
            spherical_harmonics_degree: 0,
            attribute_locations: GaussianAttributeLocationsGAURAST::default(),
            vertex_output_locations: GaussianVertexOutputLocationsGAURAST::default(),
            resolve_input_locations: GaussianResolveInputLocationsGAURAST::default(),
            order: GaussianOrderGAURAST::VIEW_DEPTH,
            precision: GaussianPrecisionGAURAST::FLOAT32,
            antialiasing: GaussianAntialiasingGAURAST::DILATE,
            low_pass_variance: 0.3,
            alpha_floor: 1.0 / 255.0,
            alpha_ceiling: 0.99,
            transmittance_floor: 1e-4,
            camera_source: GaussianCameraSourceGAURAST::COMMAND,
            camera_set: 0,
            camera_binding: 0,
            camera_count: 1,
            _marker: PhantomData,
        }
    }
}

/// The sigma points of pipelines without the structure.
impl Default for PipelineGaussianUnscentedStateCreateInfoGAURAST<'_> {
    #[inline]
    fn default() -> Self {
        Self {
            s_type: Self::STRUCTURE_TYPE,
            p_next: core::ptr::null(),
            alpha: 1.0,
            beta: 2.0,
            kappa: 0.0,
            picture_margin: f32::INFINITY,
            all_sigma_points: ash::vk::FALSE,
            _marker: PhantomData,
        }
    }
}

/// A camera that stands at the origin, looks along +z unrotated, has the depth 1 - 0.2 / z, and still needs a focal
/// length and a principal point. [`from_view_projection`](GaussianCameraGAURAST::from_view_projection) and its
/// siblings build others.
impl Default for GaussianCameraGAURAST<'_> {
    #[inline]
    fn default() -> Self {
        Self {
            s_type: Self::STRUCTURE_TYPE,
            p_next: core::ptr::null(),
            model: GaussianCameraModelGAURAST::PINHOLE,
            rotation: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
            eye: [0.0; 3],
            focal_length: [0.0; 2],
            principal_point: [0.0; 2],
            near_plane: 0.2,
            far_plane: f32::INFINITY,
            depth_coefficients: [1.0, -0.2],
            _marker: PhantomData,
        }
    }
}

/// The default camera.
impl Default for GaussianCameraDataGAURAST {
    #[inline]
    fn default() -> Self {
        Self::from(&GaussianCameraGAURAST::default())
    }
}
