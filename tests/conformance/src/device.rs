//! A Vulkan device under test, with every feature of the extension that it supports.

use std::path::Path;

use ash::vk;
use gaurast::vk::PhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST as Features;
use gaurast::vk::PhysicalDeviceGaussianPrimitiveTopologyPropertiesGAURAST as Properties;
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
        let is_manifest = Path::new(driver)
            .extension()
            .is_some_and(|extension| extension == "json");
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
            name => Opening {
                device: name,
                ..Opening::of(Driver::Extended)
            },
        };
        let refused = |error: OpenError| Error(error.to_string());
        Ok(Self::of(Gpu::open(&opening).map_err(refused)?))
    }

    fn of(gpu: Gpu) -> Self {
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
        Self {
            gpu,
            features,
            properties,
        }
    }
}

impl Implementation for Device {
    fn name(&self) -> &str {
        self.gpu.name()
    }

    fn missing(&self, draw: &Draw) -> Option<&'static str> {
        draw.missing(self)
    }

    fn draw(&self, draw: &Draw, stored: &Stored) -> Result<Picture, Error> {
        Ok(record(&self.gpu, draw, stored))
    }
}
