//! A Vulkan device under test, with every feature of the extension that it supports.

use std::path::Path;

use ash::vk;
use gaurast::vk::PhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST as Features;
use gaurast::vk::PhysicalDeviceGaussianPrimitiveTopologyPropertiesGAURAST as Properties;
use gaurast::vk::{
    GaussianAntialiasingGAURAST as Antialiasing, GaussianCameraModelGAURAST as Model, GaussianCutOffGAURAST as CutOff,
    GaussianGeometryGAURAST as Geometry, GaussianLinearizationGAURAST as Linearization, GaussianOrderGAURAST as Order,
    GaussianPrecisionGAURAST as Precision,
};
use gaurast_oracle::oracle::Stored;
use gaurast_testkit::gpu::Driver;
use gaurast_testkit::{Gpu, OpenError, Opening};

use crate::draw::Draw;
use crate::implementation::{Error, Implementation, Picture};
use crate::record::record;

/// A device of a Vulkan driver.
pub struct Device {
    pub(crate) gpu: Gpu,
    /// The supported features, all of which are enabled.
    pub features: Features<'static>,
    /// The extension's properties.
    pub properties: Properties<'static>,
}

impl Device {
    /// Opens a driver's device. `driver` is one of these: `embedded` for the driver that is linked into this program;
    /// the path of a manifest, which becomes the loader's only one; `loader` for the loader's first device that draws
    /// Gaussians; or a part of such a device's name.
    ///
    /// # Errors
    /// If there is no such device, or Vulkan fails.
    pub fn open(driver: &str) -> Result<Self, Error> {
        let is_manifest = Path::new(driver).extension().is_some_and(|extension| extension == "json");
        if is_manifest {
            for variable in ["VK_DRIVER_FILES", "VK_ICD_FILENAMES"] {
                // SAFETY: the program opens its device before it starts a second thread.
                unsafe { std::env::set_var(variable, driver) };
            }
        }
        let opening = match driver {
            "embedded" => Opening::of(Driver::Embedded),
            "loader" => Opening::of(Driver::Extended),
            _ if is_manifest => Opening::of(Driver::Extended),
            name => Opening { device: name, ..Opening::of(Driver::Extended) },
        };
        let refused = |error: OpenError| Error(error.to_string());
        Ok(Self::of(Gpu::open(&opening).map_err(refused)?))
    }

    /// The device of the tests' application.
    pub fn of(gpu: Gpu) -> Self {
        let mut features = Features::default();
        let mut features_2 = vk::PhysicalDeviceFeatures2::default().push_next(&mut features);
        let mut properties = Properties::default();
        let mut properties_2 = vk::PhysicalDeviceProperties2::default().push_next(&mut properties);
        // SAFETY: the physical device is the instance's, and has the extension of these structures.
        unsafe {
            let (instance, device) = (gpu.instance(), gpu.physical_device());
            instance.get_physical_device_features2(device, &mut features_2);
            instance.get_physical_device_properties2(device, &mut properties_2);
        }
        features.p_next = std::ptr::null_mut();
        properties.p_next = std::ptr::null_mut();
        Self { gpu, features, properties }
    }

    /// The device of the tests' application.
    pub fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    /// The first feature, limit or format that a draw needs and the device lacks.
    fn lacks(&self, draw: &Draw) -> Option<&'static str> {
        let has = &self.features;
        let state = &draw.state;
        let depth = draw.depth.as_ref();
        let any = draw.approximation.is_some_and(|numbers| numbers != [0.0; 2]);
        let footprint = draw.footprint.unwrap_or_default();
        let needs = [
            (state.order == Order::RADIAL_DISTANCE, has.radial_distance_order, "radialDistanceOrder"),
            (state.order == Order::PRIMITIVE, has.primitive_order, "primitiveOrder"),
            (state.order == Order::PER_PIXEL, has.per_pixel_order, "perPixelOrder"),
            (state.precision == Precision::FLOAT16, has.rasterization_float16, "rasterizationFloat16"),
            (state.antialiasing == Antialiasing::OPACITY_COMPENSATED, has.opacity_compensation, "opacityCompensation"),
            (draw.camera.model == Model::ORTHOGRAPHIC, has.orthographic_camera, "orthographicCamera"),
            (draw.camera.model == Model::FISHEYE, has.fisheye_camera, "fisheyeCamera"),
            (draw.camera.model == Model::EQUIRECTANGULAR, has.equirectangular_camera, "equirectangularCamera"),
            (state.linearization == Linearization::UNSCENTED, has.unscented_projection, "unscentedProjection"),
            (state.geometry == Geometry::GAUSSIAN_2D, has.gaussian_2d, "gaussian2D"),
            (draw.camera_in_buffer, has.uniform_buffer_camera, "uniformBufferCamera"),
            (draw.merged, has.merged_draws, "mergedDraws"),
            (draw.instances.is_some(), has.gaussian_instancing, "gaussianInstancing"),
            (
                depth.is_some_and(|d| d.test.is_some() || d.bounds.is_some() || d.stencil.is_some()),
                has.gaussian_depth_stencil,
                "gaussianDepthStencil",
            ),
            (draw.samples > 1, has.gaussian_multisample, "gaussianMultisample"),
            (any, has.gaussian_approximation, "gaussianApproximation"),
            (footprint.cut_off != CutOff::NONE, has.gaussian_cut_off, "gaussianCutOff"),
            (footprint.compensation_floor != 0.0, has.opacity_compensation_floor, "opacityCompensationFloor"),
            (draw.shown.is_some(), has.resolve_fragment_shader, "resolveFragmentShader"),
            (draw.shown.is_some(), has.resolve_gaussian_indices, "resolveGaussianIndices"),
        ];
        let lacks = needs.iter().find(|(needed, offered, _)| *needed && *offered == vk::FALSE);
        if let Some((_, _, name)) = lacks {
            return Some(name);
        }
        if draw.degree > self.properties.max_spherical_harmonics_degree {
            return Some("maxSphericalHarmonicsDegree");
        }
        let counts = self.properties.gaussian_sample_counts;
        if !counts.contains(vk::SampleCountFlags::from_raw(draw.samples)) {
            return Some("gaussianSampleCounts");
        }
        use vk::FormatFeatureFlags as F;
        let copies = F::TRANSFER_SRC | F::TRANSFER_DST;
        let color = F::COLOR_ATTACHMENT | F::COLOR_ATTACHMENT_BLEND | copies;
        let has = |format, usage| self.gpu.format_features(format).contains(usage);
        if !has(draw.format.raw(), color) {
            return Some("the colour attachment's format");
        }
        let tested = F::DEPTH_STENCIL_ATTACHMENT | copies;
        if depth.is_some_and(|depth| !has(depth.format, tested)) {
            return Some("the depth attachment's format");
        }
        if depth.is_some_and(|depth| depth.bounds.is_some()) && self.gpu.features().depth_bounds == vk::FALSE {
            return Some("depthBounds");
        }
        None
    }
}

impl Implementation for Device {
    fn name(&self) -> &str {
        self.gpu.name()
    }

    fn missing(&self, draw: &Draw) -> Option<&'static str> {
        self.lacks(draw)
    }

    fn draw(&self, draw: &Draw, stored: &Stored) -> Result<Picture, Error> {
        Ok(record(&self.gpu, draw, stored))
    }
}
