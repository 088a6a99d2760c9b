//! Descriptor sets.

use ash::vk;

use crate::gpu::Gpu;

/// The resource to which a binding refers.
#[derive(Clone, Copy, Debug)]
pub enum Resource {
    /// A uniform buffer.
    Uniform(vk::Buffer),
    /// A uniform buffer of this many bytes, at an offset that is given when the set is bound.
    DynamicUniform(vk::Buffer, u64),
    /// A storage buffer.
    Storage(vk::Buffer),
    /// An image with a sampler.
    Texture(vk::ImageView, vk::Sampler),
    /// An input attachment of the same pass.
    Input(vk::ImageView),
    /// A storage image.
    StorageImage(vk::ImageView),
    /// A uniform texel buffer.
    Texels(vk::BufferView),
    /// A storage texel buffer.
    StoredTexels(vk::BufferView),
}

impl Resource {
    fn descriptor_type(&self) -> vk::DescriptorType {
        match self {
            Self::Uniform(_) => vk::DescriptorType::UNIFORM_BUFFER,
            Self::DynamicUniform(..) => vk::DescriptorType::UNIFORM_BUFFER_DYNAMIC,
            Self::Storage(_) => vk::DescriptorType::STORAGE_BUFFER,
            Self::Texture(..) => vk::DescriptorType::COMBINED_IMAGE_SAMPLER,
            Self::Input(_) => vk::DescriptorType::INPUT_ATTACHMENT,
            Self::StorageImage(_) => vk::DescriptorType::STORAGE_IMAGE,
            Self::Texels(_) => vk::DescriptorType::UNIFORM_TEXEL_BUFFER,
            Self::StoredTexels(_) => vk::DescriptorType::STORAGE_TEXEL_BUFFER,
        }
    }

    fn stages(&self) -> vk::ShaderStageFlags {
        match self {
            Self::Input(_) => vk::ShaderStageFlags::FRAGMENT,
            _ => vk::ShaderStageFlags::ALL_GRAPHICS | vk::ShaderStageFlags::COMPUTE,
        }
    }
}

/// A descriptor set whose bindings are numbered from 0.
pub struct Bindings {
    /// The set.
    pub set: vk::DescriptorSet,
    /// Its layout.
    pub layout: vk::DescriptorSetLayout,
    pool: vk::DescriptorPool,
    gpu: Gpu,
}

impl Bindings {
    /// Creates the set. The resources must outlive it.
    pub fn new(gpu: &Gpu, resources: &[Resource]) -> Self {
        let entries: Vec<_> = (0..)
            .zip(resources)
            .map(|(index, resource)| {
                vk::DescriptorSetLayoutBinding::default()
                    .binding(index)
                    .descriptor_type(resource.descriptor_type())
                    .descriptor_count(1)
                    .stage_flags(resource.stages())
            })
            .collect();
        let sizes: Vec<_> = resources
            .iter()
            .map(|resource| vk::DescriptorPoolSize { ty: resource.descriptor_type(), descriptor_count: 1 })
            .collect();
        let device = gpu.device();
        // SAFETY: see the crate.
        let bindings = unsafe {
            let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&entries);
            let layout = device.create_descriptor_set_layout(&info, None).expect("a descriptor set layout");
            let info = vk::DescriptorPoolCreateInfo::default().max_sets(1).pool_sizes(&sizes);
            let pool = device.create_descriptor_pool(&info, None).expect("a descriptor pool");
            let layouts = [layout];
            let info = vk::DescriptorSetAllocateInfo::default().descriptor_pool(pool).set_layouts(&layouts);
            let sets = device.allocate_descriptor_sets(&info);
            Self { set: sets.expect("a descriptor set")[0], layout, pool, gpu: gpu.clone() }
        };
        for (index, resource) in (0..).zip(resources) {
            bindings.write(index, resource);
        }
        bindings
    }

    fn write(&self, binding: u32, resource: &Resource) {
        let write = vk::WriteDescriptorSet::default()
            .dst_set(self.set)
            .dst_binding(binding)
            .descriptor_type(resource.descriptor_type());
        let image = |view, sampler| {
            [vk::DescriptorImageInfo::default()
                .image_view(view)
                .sampler(sampler)
                .image_layout(vk::ImageLayout::GENERAL)]
        };
        let buffer = |buffer, range| [vk::DescriptorBufferInfo::default().buffer(buffer).range(range)];
        // SAFETY: see the crate.
        let update = |write| unsafe { self.gpu.device().update_descriptor_sets(&[write], &[]) };
        match *resource {
            Resource::Uniform(raw) | Resource::Storage(raw) => {
                update(write.buffer_info(&buffer(raw, vk::WHOLE_SIZE)));
            }
            Resource::DynamicUniform(raw, range) => update(write.buffer_info(&buffer(raw, range))),
            Resource::Texture(view, sampler) => update(write.image_info(&image(view, sampler))),
            Resource::Input(view) | Resource::StorageImage(view) => {
                update(write.image_info(&image(view, vk::Sampler::null())));
            }
            Resource::Texels(view) | Resource::StoredTexels(view) => {
                update(write.texel_buffer_view(&[view]));
            }
        }
    }
}

impl From<&Bindings> for vk::DescriptorSet {
    fn from(bindings: &Bindings) -> Self {
        bindings.set
    }
}

impl Drop for Bindings {
    fn drop(&mut self) {
        let device = self.gpu.device();
        // SAFETY: see the crate.
        unsafe {
            device.destroy_descriptor_pool(self.pool, None);
            device.destroy_descriptor_set_layout(self.layout, None);
        }
    }
}

/// A binding: its number, descriptor type and count.
pub type Binding = (u32, vk::DescriptorType, u32);

/// Layouts of descriptor sets for compute shaders, and a pool for one set of each.
pub struct Sets {
    /// The layouts.
    pub layouts: Vec<vk::DescriptorSetLayout>,
    /// The pool.
    pub pool: vk::DescriptorPool,
    gpu: Gpu,
}

impl Sets {
    /// Creates layouts of sets with these bindings, and the pool.
    pub fn new(gpu: &Gpu, sets: &[&[Binding]]) -> Self {
        let none = vk::DescriptorSetLayoutCreateFlags::empty();
        let layouts = sets.iter().map(|set| set_layout(gpu, set, none));
        Self::of(gpu, layouts.collect(), sets)
    }

    /// Creates the pool for these layouts, whose sets have these bindings.
    pub fn of(gpu: &Gpu, layouts: Vec<vk::DescriptorSetLayout>, sets: &[&[Binding]]) -> Self {
        let sizes: Vec<_> = (sets.iter().copied().flatten())
            .map(|&(_, ty, count)| vk::DescriptorPoolSize::default().ty(ty).descriptor_count(count))
            .collect();
        let info = vk::DescriptorPoolCreateInfo::default().max_sets(sets.len().max(1) as u32).pool_sizes(&sizes);
        // SAFETY: see the crate.
        let pool = unsafe { gpu.device().create_descriptor_pool(&info, None) };
        Self { layouts, pool: pool.expect("a descriptor pool"), gpu: gpu.clone() }
    }

    /// Allocates a set of each layout.
    pub fn allocate(&self) -> Vec<vk::DescriptorSet> {
        let info = vk::DescriptorSetAllocateInfo::default().descriptor_pool(self.pool).set_layouts(&self.layouts);
        // SAFETY: see the crate.
        unsafe { self.gpu.device().allocate_descriptor_sets(&info) }.expect("descriptor sets")
    }
}

impl Drop for Sets {
    fn drop(&mut self) {
        let device = self.gpu.device();
        // SAFETY: see the crate.
        unsafe {
            device.destroy_descriptor_pool(self.pool, None);
            for &layout in &self.layouts {
                device.destroy_descriptor_set_layout(layout, None);
            }
        }
    }
}

/// A descriptor set layout of these bindings, for compute shaders.
pub fn set_layout(
    gpu: &Gpu,
    bindings: &[Binding],
    flags: vk::DescriptorSetLayoutCreateFlags,
) -> vk::DescriptorSetLayout {
    let bindings: Vec<_> = bindings
        .iter()
        .map(|&(number, ty, count)| {
            vk::DescriptorSetLayoutBinding::default()
                .binding(number)
                .descriptor_type(ty)
                .descriptor_count(count)
                .stage_flags(vk::ShaderStageFlags::COMPUTE)
        })
        .collect();
    let info = vk::DescriptorSetLayoutCreateInfo::default().flags(flags).bindings(&bindings);
    // SAFETY: see the crate.
    unsafe { gpu.device().create_descriptor_set_layout(&info, None) }.expect("a set layout")
}

/// Writes descriptors of buffers, starting at an array element of a binding.
pub fn write(
    gpu: &Gpu,
    set: vk::DescriptorSet,
    (binding, element): (u32, u32),
    ty: vk::DescriptorType,
    infos: &[vk::DescriptorBufferInfo],
) {
    let write = vk::WriteDescriptorSet::default()
        .dst_set(set)
        .dst_binding(binding)
        .dst_array_element(element)
        .descriptor_type(ty)
        .buffer_info(infos);
    // SAFETY: see the crate.
    unsafe { gpu.device().update_descriptor_sets(&[write], &[]) };
}
