//! A Vulkan device under test, with every feature of the extension that it supports.

use std::ffi::{CStr, c_void};
use std::path::Path;

use ash::vk;
use gaurast::vk::GaussianPrecisionClassGAURAST;
use gaurast::vk::PhysicalDeviceGaussianPrecisionPropertiesGAURAST as PrecisionProperties;
use gaurast::vk::PhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST as Features;
use gaurast::vk::PhysicalDeviceGaussianPrimitiveTopologyPropertiesGAURAST as Properties;
use gaurast_oracle::oracle::Stored;
use gaurast_oracle::oracle::error_model::PrecisionClass;
use gaurast_testkit::gpu::Driver;
use gaurast_testkit::{Gpu, OpenError, Opening};

use crate::draw::Draw;
use crate::features::{self, FEATURES};
use crate::implementation::{Error, Implementation};
use crate::picture::Picture;
use crate::program::Program;
use crate::record::record;

/// A device of a Vulkan driver.
pub struct Device {
    pub(crate) gpu: Gpu,
    /// The supported features, all of which are enabled.
    pub features: Features<'static>,
    /// The extension's properties.
    pub properties: Properties<'static>,
    /// The class of precision of its pictures.
    precision: PrecisionClass,
    /// The optional extensions that are enabled.
    optional: Vec<&'static CStr>,
    has_draw_indirect_count: bool,
}

/// Extensions of which some cases are, if the device has them.
const OPTIONAL: [&CStr; 3] =
    [ash::ext::multi_draw::NAME, ash::khr::pipeline_library::NAME, ash::ext::graphics_pipeline_library::NAME];

impl Device {
    /// Opens a driver's device. `driver` is one of these: `embedded` for the driver that is linked into this program;
    /// the path of a manifest, which becomes the loader's only one; `loader` for the loader's first device that draws
    /// Gaussians; or a part of such a device's name.
    ///
    /// # Errors
    /// If there is no such device, or Vulkan fails.
    pub fn open(driver: &str) -> Result<Self, Error> {
        Self::open_under(driver, &[])
    }

    /// Opens a driver's device under layers, which the loader must find; the embedded driver has none.
    ///
    /// # Errors
    /// As [`Self::open`].
    pub fn open_under(driver: &str, layers: &[&CStr]) -> Result<Self, Error> {
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
        Self::with(&Opening { layers, ..opening }).map_err(|error| Error(error.to_string()))
    }

    fn with(opening: &Opening<'_>) -> Result<Self, OpenError> {
        let optional = supported(&Gpu::open(opening)?);
        let mut libraries = vk::PhysicalDeviceGraphicsPipelineLibraryFeaturesEXT::default()
            .graphics_pipeline_library(optional.contains(&ash::ext::graphics_pipeline_library::NAME));
        let mut features = vk::PhysicalDeviceMultiDrawFeaturesEXT::default()
            .multi_draw(optional.contains(&ash::ext::multi_draw::NAME));
        features.p_next = (&raw mut libraries).cast::<c_void>();
        let opening = Opening { extensions: &optional, ..*opening };
        let gpu = if optional.is_empty() { Gpu::open(&opening)? } else { Gpu::open_with(&opening, &mut features)? };
        Ok(Self::having(gpu, optional))
    }

    /// The device of the tests' application, without optional extensions.
    pub fn of(gpu: Gpu) -> Self {
        Self::having(gpu, Vec::new())
    }

    fn having(gpu: Gpu, optional: Vec<&'static CStr>) -> Self {
        let mut features = Features::default();
        let mut vulkan_1_2 = vk::PhysicalDeviceVulkan12Features::default();
        let mut features_2 = vk::PhysicalDeviceFeatures2::default().push_next(&mut features).push_next(&mut vulkan_1_2);
        let mut properties = Properties::default();
        let mut precision = PrecisionProperties::default();
        let mut properties_2 =
            vk::PhysicalDeviceProperties2::default().push_next(&mut properties).push_next(&mut precision);
        // SAFETY: the physical device is the instance's, and has the extension of these structures.
        unsafe {
            let (instance, device) = (gpu.instance(), gpu.physical_device());
            instance.get_physical_device_features2(device, &mut features_2);
            instance.get_physical_device_properties2(device, &mut properties_2);
        }
        features.p_next = std::ptr::null_mut();
        properties.p_next = std::ptr::null_mut();
        let has_draw_indirect_count = vulkan_1_2.draw_indirect_count != vk::FALSE;
        let precision = match precision.precision_class {
            GaussianPrecisionClassGAURAST::RELAXED => PrecisionClass::Relaxed,
            _ => PrecisionClass::Full,
        };
        Self { gpu, features, properties, precision, optional, has_draw_indirect_count }
    }

    /// The first of some features, of the extension or of Vulkan, that the device lacks.
    fn lacks_feature(&self, needs: &[&'static str]) -> Option<&'static str> {
        needs.iter().copied().find(|name| !self.offers(name))
    }

    /// Reports whether the device has a feature of the extension, a feature of Vulkan, or an optional extension.
    fn offers(&self, name: &str) -> bool {
        let of_extension = FEATURES.iter().find(|(feature, _)| *feature == name);
        if let Some((_, offered)) = of_extension {
            return offered(&self.features) != vk::FALSE;
        }
        let has = self.gpu.features();
        match name {
            "multiDrawIndirect" => has.multi_draw_indirect != vk::FALSE,
            "drawIndirectFirstInstance" => has.draw_indirect_first_instance != vk::FALSE,
            "independentBlend" => has.independent_blend != vk::FALSE,
            "logicOp" => has.logic_op != vk::FALSE,
            "occlusionQueryPrecise" => has.occlusion_query_precise != vk::FALSE,
            "pipelineStatisticsQuery" => has.pipeline_statistics_query != vk::FALSE,
            "depthBounds" => has.depth_bounds != vk::FALSE,
            "drawIndirectCount" => self.has_draw_indirect_count,
            _ => self.optional.iter().any(|extension| extension.to_bytes() == name.as_bytes()),
        }
    }

    /// The device of the tests' application.
    pub fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    /// The first feature, limit or format that a draw needs and the device lacks.
    fn lacks(&self, draw: &Draw) -> Option<&'static str> {
        let lacks = self.lacks_feature(&features::needs(draw));
        if lacks.is_some() {
            return lacks;
        }
        let depth = draw.depth.as_ref();
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

    fn precision(&self) -> PrecisionClass {
        self.precision
    }

    fn missing(&self, draw: &Draw) -> Option<&'static str> {
        self.lacks(draw)
    }

    fn missing_for(&self, program: &Program) -> Option<&'static str> {
        let lacks = self.lacks_feature(&program.needs());
        lacks.or_else(|| program.draws().find_map(|draw| self.lacks(draw)))
    }

    fn vulkan(&self) -> Option<&Gpu> {
        Some(&self.gpu)
    }

    fn draw(&self, draw: &Draw, stored: &Stored) -> Result<Picture, Error> {
        Ok(record(&self.gpu, draw, stored))
    }
}

/// The optional extensions that a device has.
fn supported(gpu: &Gpu) -> Vec<&'static CStr> {
    // SAFETY: the physical device is the instance's.
    let all = unsafe { gpu.instance().enumerate_device_extension_properties(gpu.physical_device()) };
    let all = all.unwrap_or_default();
    let has = |name: &&CStr| all.iter().any(|extension| extension.extension_name_as_c_str() == Ok(*name));
    OPTIONAL.into_iter().filter(has).collect()
}
