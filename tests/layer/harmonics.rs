//! Mistakes with spherical harmonics in a buffer.

use ash::vk;
use gaurast::vk::{GaussianSphericalHarmonicsBufferGAURAST, PipelineGaussianStateCreateFlagsGAURAST};
use gaurast_testkit::{Gpu, Message};

use crate::stage::{Mistake, SPLAT, Stage, camera, drawing, drawn, gaussian, mistake, recording, with};

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

/// The messages of a draw of two Gaussians with harmonics of degree 1 in a buffer.
fn harmonic(stage: &Stage, change: fn(Bound) -> Bound) -> Vec<Message> {
    let gpu = &stage.full;
    let buffer = Addressed::new(gpu, 256);
    let flag = PipelineGaussianStateCreateFlagsGAURAST::SPHERICAL_HARMONICS_BUFFER;
    let request = with(|s| s.flags(flag).spherical_harmonics_degree(1));
    drawing(gpu, &request, &[SPLAT; 2], |commands| {
        let bound = change(buffer.bound(256).stride(48).coefficient_stride(12));
        // SAFETY: see the crate.
        unsafe { gaussian(gpu).cmd_bind_gaussian_spherical_harmonics(commands.raw, &bound) };
        commands.camera(&camera());
        commands.draw(0..2);
    })
}

pub fn mistakes() -> Vec<Mistake> {
    let address = "VUID-VkGaussianSphericalHarmonicsBufferGAURAST-deviceAddress-90016";
    let format = "VUID-VkGaussianSphericalHarmonicsBufferGAURAST-format-90017";
    let alignment = "GAURAST-Harmonics-alignment";
    let past = "GAURAST-Draw-harmonics-past-buffer";
    vec![
        binds("more bytes than the buffer has", address, |b| b.size(257)),
        binds("an address of no buffer", address, |b| b.device_address(0)),
        binds("harmonics of integers", format, |b| b.format(vk::Format::R32G32B32_UINT)),
        binds("harmonics of two components", format, |b| b.format(vk::Format::R32G32_SFLOAT)),
        binds("harmonics of a format that is not fetched", format, |b| b.format(vk::Format::R64G64B64_SFLOAT)),
        binds("no strides", "GAURAST-Harmonics-stride", |b| b.stride(0)),
        binds("no bytes of harmonics", "GAURAST-Harmonics-size", |b| b.size(0)),
        binds("harmonics at an odd address", alignment, |mut b| {
            b.device_address += 1;
            b.size(200)
        }),
        binds("harmonics whose stride is counted in floats", alignment, |b| b.stride(3)),
        binds("an odd stride of coefficients", alignment, |b| b.coefficient_stride(6)),
        mistake("harmonics of the second Gaussian that are not bound", past, |stage| harmonic(stage, |b| b.size(12))),
        mistake("a stride of coefficients that overflows", past, |stage| {
            harmonic(stage, |b| b.coefficient_stride(u64::MAX - 3))
        }),
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
