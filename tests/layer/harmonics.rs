//! Mistakes with spherical harmonics in a buffer.

use ash::vk;
use gaurast::vk::{GaussianSphericalHarmonicsBufferGAURAST, PipelineGaussianStateCreateFlagsGAURAST};
use gaurast_testkit::{Gpu, Message};

use crate::stage::{Mistake, SPLAT, drawn, gaussian, mistake, recording, with};

type Bound = GaussianSphericalHarmonicsBufferGAURAST<'static>;

/// A buffer that has an address.
pub struct Addressed {
    gpu: Gpu,
    buffer: vk::Buffer,
    memory: vk::DeviceMemory,
    pub address: u64,
}

impl Addressed {
    pub fn new(gpu: &Gpu, size: u64) -> Self {
        let usage = vk::BufferUsageFlags::SHADER_DEVICE_ADDRESS | vk::BufferUsageFlags::STORAGE_BUFFER;
        let info = vk::BufferCreateInfo::default().size(size).usage(usage);
        let device = gpu.device();
        // SAFETY: see the crate.
        unsafe {
            let buffer = device.create_buffer(&info, None).expect("a buffer");
            let needed = device.get_buffer_memory_requirements(buffer);
            let mut flags = vk::MemoryAllocateFlagsInfo::default().flags(vk::MemoryAllocateFlags::DEVICE_ADDRESS);
            let info = vk::MemoryAllocateInfo::default()
                .allocation_size(needed.size)
                .memory_type_index(needed.memory_type_bits.trailing_zeros())
                .push_next(&mut flags);
            let memory = device.allocate_memory(&info, None).expect("memory");
            device.bind_buffer_memory(buffer, memory, 0).expect("a buffer is bound");
            let info = vk::BufferDeviceAddressInfo::default().buffer(buffer);
            Self { gpu: gpu.clone(), buffer, memory, address: device.get_buffer_device_address(&info) }
        }
    }

    /// Triples of floats from its beginning on.
    pub fn bound(&self, size: u64) -> Bound {
        Bound::default().device_address(self.address).size(size).format(vk::Format::R32G32B32_SFLOAT).stride(12)
    }
}

impl Drop for Addressed {
    fn drop(&mut self) {
        let device = self.gpu.device();
        // SAFETY: see the crate.
        unsafe {
            device.destroy_buffer(self.buffer, None);
            device.free_memory(self.memory, None);
        }
    }
}

fn binds(name: &'static str, id: &'static str, change: fn(Bound) -> Bound) -> Mistake {
    mistake(name, id, move |stage| {
        let buffer = Addressed::new(&stage.full, 256);
        binding(&stage.full, change(buffer.bound(256)))
    })
}

fn binding(gpu: &Gpu, bound: Bound) -> Vec<Message> {
    recording(gpu, |commands| {
        // SAFETY: see the crate.
        unsafe { gaussian(gpu).cmd_bind_gaussian_spherical_harmonics(commands.raw, &bound) };
    })
}

pub fn mistakes() -> Vec<Mistake> {
    let address = "VUID-VkGaussianSphericalHarmonicsBufferGAURAST-deviceAddress-90016";
    let format = "VUID-VkGaussianSphericalHarmonicsBufferGAURAST-format-90017";
    vec![
        binds("more bytes than the buffer has", address, |b| b.size(257)),
        binds("an address of no buffer", address, |b| b.device_address(0)),
        binds("harmonics of integers", format, |b| b.format(vk::Format::R32G32B32_UINT)),
        binds("harmonics of two components", format, |b| b.format(vk::Format::R32G32_SFLOAT)),
        binds("harmonics of a format that is not fetched", format, |b| b.format(vk::Format::R64G64B64_SFLOAT)),
        binds("no strides", "GAURAST-Harmonics-stride", |b| b.stride(0)),
        binds(
            "the structure's type of the buffer was not set",
            "VUID-VkGaussianSphericalHarmonicsBufferGAURAST-sType-sType",
            |mut b| {
                b.s_type = vk::StructureType::APPLICATION_INFO;
                b
            },
        ),
        mistake(
            "a draw with harmonics in a buffer that was not bound",
            "VUID-vkCmdDraw-sphericalHarmonicsBuffer-90018",
            |stage| {
                let flag = PipelineGaussianStateCreateFlagsGAURAST::SPHERICAL_HARMONICS_BUFFER;
                drawn(&stage.full, &with(|s| s.flags(flag)), &[SPLAT])
            },
        ),
    ]
}
