//! Devices to test: those that the tests of a process share, and new ones of this driver with all or some of its features;
//! their memory and images.

use std::sync::LazyLock;

use crate::{Driver, Gpu, Image, ImageOptions, Opening, Settings};
use ash::vk;
use gaurast::gaussian_primitive_topology;
use gaurast::vk::PhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST as GaussianFeatures;

/// The memory type that the host cannot map.
pub const DEVICE_ONLY: u32 = 0;
/// The memory type that the host can map.
pub const MAPPABLE: u32 = 1;

/// The colour of an image with one level and one layer.
pub const COLOR: vk::ImageSubresourceRange = vk::ImageSubresourceRange {
    aspect_mask: vk::ImageAspectFlags::COLOR,
    base_mip_level: 0,
    level_count: 1,
    base_array_layer: 0,
    layer_count: 1,
};

/// The same, for copies.
pub const COLOR_LAYERS: vk::ImageSubresourceLayers = vk::ImageSubresourceLayers {
    aspect_mask: vk::ImageAspectFlags::COLOR,
    mip_level: 0,
    base_array_layer: 0,
    layer_count: 1,
};

/// This driver's device, linked into the process, which all tests of the process share.
pub fn own() -> &'static Gpu {
    static OWN: LazyLock<Gpu> = LazyLock::new(|| Gpu::embedded(&Settings::default()).expect("this driver's device"));
    &OWN
}

/// lavapipe's device, which all tests of the process share, if `Need::Lavapipe` is met.
pub fn lavapipe() -> &'static Gpu {
    static LAVAPIPE: LazyLock<Gpu> = LazyLock::new(|| Gpu::lavapipe().expect("lavapipe's device"));
    &LAVAPIPE
}

/// The options for opening a driver's device with all that it supports.
pub const fn everything_of(driver: Driver) -> Opening<'static> {
    Opening { all_extensions: true, robust: true, ..Opening::of(driver) }
}

/// Opens this driver's device with all that it supports.
pub fn open() -> Gpu {
    Gpu::open(&everything_of(Driver::Embedded)).expect("a device")
}

/// Opens the device with all that it supports, of the extension only some features.
pub fn with_features_of_gaussians(features: GaussianFeatures<'static>) -> Gpu {
    let opening = Opening { gaussian: Some(features), ..everything_of(Driver::Embedded) };
    Gpu::open(&opening).expect("a device")
}

/// Opens the device with all that it supports, except the optional modes of the extension.
pub fn without_modes() -> Gpu {
    with_features_of_gaussians(GaussianFeatures::default().gaussian_primitive_topology(true))
}

/// Opens the device with all that it supports, except the Gaussian topology.
pub fn without_the_topology() -> Gpu {
    with_features_of_gaussians(GaussianFeatures::default())
}

/// The extension's functions.
pub fn gaussian(gpu: &Gpu) -> &gaussian_primitive_topology::Device {
    gpu.gaussian().expect("a device that draws Gaussians")
}

/// Memory of a type.
pub fn allocate(gpu: &Gpu, size: u64, memory_type: u32) -> vk::DeviceMemory {
    let info = vk::MemoryAllocateInfo::default().allocation_size(size).memory_type_index(memory_type);
    // SAFETY: see the crate.
    unsafe { gpu.device().allocate_memory(&info, None) }.expect("memory")
}

/// A 2D image for use as an attachment; a colour image can also be sampled and stored to.
pub fn image(gpu: &Gpu, format: vk::Format, size: [u32; 2]) -> Image {
    let usage = match format {
        vk::Format::D32_SFLOAT | vk::Format::D16_UNORM => vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT,
        _ => vk::ImageUsageFlags::COLOR_ATTACHMENT | vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::STORAGE,
    };
    Image::new(gpu, &ImageOptions::new(format, size, usage))
}
