//! Buffers, images and command buffers that destroy themselves.

use std::mem::MaybeUninit;
use std::sync::Arc;

use ash::vk;
use bytemuck::Pod;

use crate::device::{Device, MemoryPreference};
use crate::error::{During, RenderError};

/// The kind of memory of a resource.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Memory {
    /// Device-local memory, not host-visible if there is such a type.
    Device,
    /// Host-coherent memory, for writing.
    Host,
    /// Host-coherent memory, for reading.
    HostCached,
}

impl Memory {
    /// The memory types that serve, the best first.
    fn preferences(self) -> &'static [MemoryPreference] {
        use vk::MemoryPropertyFlags as Flags;
        const COHERENT: Flags = Flags::from_raw(Flags::HOST_VISIBLE.as_raw() | Flags::HOST_COHERENT.as_raw());
        const CACHED: Flags = Flags::from_raw(COHERENT.as_raw() | Flags::HOST_CACHED.as_raw());
        const ANY: MemoryPreference = MemoryPreference::having(Flags::empty());
        const LOCAL: MemoryPreference = MemoryPreference::having(Flags::DEVICE_LOCAL);
        const INVISIBLE: MemoryPreference = MemoryPreference { excluded: Flags::HOST_VISIBLE, ..LOCAL };
        const HOST: MemoryPreference = MemoryPreference::having(COHERENT);
        const HOST_CACHED: MemoryPreference = MemoryPreference::having(CACHED);
        match self {
            Self::Device => &[INVISIBLE, LOCAL, ANY],
            Self::Host => &[HOST],
            Self::HostCached => &[HOST_CACHED, HOST],
        }
    }

    fn allocate(
        self,
        device: &Device,
        requirements: vk::MemoryRequirements,
        flags: vk::MemoryAllocateFlags,
    ) -> Result<vk::DeviceMemory, RenderError> {
        let name = match self {
            Self::Device => "device",
            Self::Host | Self::HostCached => "host-visible",
        };
        let memory_type =
            device.memory_type(requirements.memory_type_bits, self.preferences()).ok_or(RenderError::NoMemory(name))?;
        let mut flags_info = vk::MemoryAllocateFlagsInfo::default().flags(flags);
        let allocate_info = vk::MemoryAllocateInfo::default()
            .allocation_size(requirements.size)
            .memory_type_index(memory_type)
            .push_next(&mut flags_info);
        // SAFETY: the structure is valid.
        unsafe { device.raw().allocate_memory(&allocate_info, None) }.during("vkAllocateMemory")
    }
}

/// A buffer with its memory.
pub struct Buffer {
    handle: vk::Buffer,
    memory: vk::DeviceMemory,
    size: u64,
    device: Arc<Device>,
}

impl Buffer {
    /// A buffer of `size` bytes, not zero.
    ///
    /// # Errors
    /// If there is no memory for it, or Vulkan fails.
    pub fn new(
        device: &Arc<Device>,
        size: u64,
        usage: vk::BufferUsageFlags,
        kind: Memory,
    ) -> Result<Self, RenderError> {
        let create_info = vk::BufferCreateInfo::default().size(size).usage(usage);
        // SAFETY: the structure is valid.
        let handle = unsafe { device.raw().create_buffer(&create_info, None) }.during("vkCreateBuffer")?;
        let mut buffer = Self { handle, memory: vk::DeviceMemory::null(), size, device: device.clone() };
        // SAFETY: the buffer is the device's.
        let requirements = unsafe { device.raw().get_buffer_memory_requirements(handle) };
        let has_address = usage.contains(vk::BufferUsageFlags::SHADER_DEVICE_ADDRESS);
        let flags =
            if has_address { vk::MemoryAllocateFlags::DEVICE_ADDRESS } else { vk::MemoryAllocateFlags::empty() };
        buffer.memory = kind.allocate(device, requirements, flags)?;
        // SAFETY: the memory is new, and of the size and a type that the buffer requires.
        unsafe { device.raw().bind_buffer_memory(handle, buffer.memory, 0) }.during("vkBindBufferMemory")?;
        Ok(buffer)
    }

    /// The buffer's handle.
    pub fn handle(&self) -> vk::Buffer {
        self.handle
    }

    /// The buffer's address, for one with the usage `SHADER_DEVICE_ADDRESS`.
    pub fn address(&self) -> vk::DeviceAddress {
        let info = vk::BufferDeviceAddressInfo::default().buffer(self.handle);
        // SAFETY: the buffer is the device's, and was created to have an address.
        unsafe { self.device.raw().get_buffer_device_address(&info) }
    }

    /// Copies `bytes` to the beginning of the buffer, which must be in host memory and unused by
    /// the device.
    ///
    /// # Errors
    /// If the memory cannot be mapped.
    ///
    /// # Panics
    /// If the buffer is smaller.
    pub fn write(&self, bytes: &[u8]) -> Result<(), RenderError> {
        assert!(bytes.len() as u64 <= self.size, "the buffer holds the bytes");
        self.mapped(|mapped| {
            // SAFETY: `mapped` points to `size` bytes, which nothing else accesses meanwhile.
            unsafe { mapped.copy_from_nonoverlapping(bytes.as_ptr(), bytes.len()) }
        })
    }

    /// Copies the beginning of the buffer, which must be in host memory and unused by the device.
    ///
    /// # Errors
    /// If the memory cannot be mapped.
    ///
    /// # Panics
    /// If the buffer is smaller.
    pub fn read<T: Pod>(&self, values: &mut [T]) -> Result<(), RenderError> {
        let bytes: &mut [u8] = bytemuck::cast_slice_mut(values);
        assert!(bytes.len() as u64 <= self.size, "the buffer holds the bytes");
        self.mapped(|mapped| {
            // SAFETY: `mapped` points to `size` bytes, which nothing else accesses meanwhile.
            unsafe { mapped.copy_to_nonoverlapping(bytes.as_mut_ptr(), bytes.len()) }
        })
    }

    /// A copy of the first `count` elements of the buffer, which must be in host memory and unused by the device.
    ///
    /// # Errors
    /// If the memory cannot be mapped.
    ///
    /// # Panics
    /// If the buffer is smaller.
    pub fn read_new<T: Pod>(&self, count: usize) -> Result<Vec<T>, RenderError> {
        let bytes = count * size_of::<T>();
        assert!(bytes as u64 <= self.size, "the buffer holds the elements");
        let mut values = Vec::<T>::with_capacity(count);
        self.mapped(|mapped| {
            let to = values.as_mut_ptr().cast::<u8>();
            // SAFETY: `mapped` points to `size` bytes, which nothing else accesses meanwhile, and `to` to memory for
            // `bytes`.
            unsafe { mapped.copy_to_nonoverlapping(to, bytes) }
        })?;
        // SAFETY: the capacity suffices, and every pattern of bits that was copied is one of `T` (`Pod`).
        unsafe { values.set_len(count) };
        Ok(values)
    }

    /// Lets `fill` write the first `count` elements of the buffer, which must be in host memory and
    /// unused by the device.
    ///
    /// # Errors
    /// If the memory cannot be mapped.
    ///
    /// # Panics
    /// If the buffer is smaller.
    pub fn fill<T: Pod>(&self, count: usize, fill: impl FnOnce(&mut [MaybeUninit<T>])) -> Result<(), RenderError> {
        assert!((count * size_of::<T>()) as u64 <= self.size, "the buffer holds the elements");
        self.mapped(|mapped| {
            assert!(mapped.cast::<T>().is_aligned(), "memory is mapped at 64");
            // SAFETY: `mapped` points to `size` bytes, aligned for `T`, which nothing else
            // accesses meanwhile and which need not be initialised.
            fill(unsafe { std::slice::from_raw_parts_mut(mapped.cast(), count) });
        })
    }

    /// Lets `look` read the first `count` elements of the buffer, which must be in host memory and unused by the device.
    ///
    /// # Errors
    /// If the memory cannot be mapped.
    ///
    /// # Panics
    /// If the buffer is smaller.
    pub fn look<T: Pod, R>(&self, count: usize, look: impl FnOnce(&[T]) -> R) -> Result<R, RenderError> {
        assert!((count * size_of::<T>()) as u64 <= self.size, "the buffer holds the elements");
        let mut result = None;
        self.mapped(|mapped| {
            assert!(mapped.cast::<T>().is_aligned(), "memory is mapped at 64");
            // SAFETY: `mapped` points to `size` bytes of memory, aligned for `T`, which nothing writes meanwhile, and every
            // pattern of bits is a `T` (`Pod`).
            result = Some(look(unsafe { std::slice::from_raw_parts(mapped.cast(), count) }));
        })?;
        Ok(result.expect("the memory was mapped"))
    }

    /// The size in bytes.
    pub fn size(&self) -> u64 {
        self.size
    }

    fn mapped(&self, access: impl FnOnce(*mut u8)) -> Result<(), RenderError> {
        let raw = self.device.raw();
        // SAFETY: only buffers in coherent host memory are read and written; each has memory of
        // its own, mapped nowhere else; this call ends with the mapping.
        let mapped = unsafe { raw.map_memory(self.memory, 0, vk::WHOLE_SIZE, vk::MemoryMapFlags::empty()) }
            .during("vkMapMemory")?;
        access(mapped.cast());
        // SAFETY: the memory was mapped above.
        unsafe { raw.unmap_memory(self.memory) };
        Ok(())
    }
}

impl Drop for Buffer {
    fn drop(&mut self) {
        let raw = self.device.raw();
        // SAFETY: every submission has been waited for, so the device doesn't use the buffer. The
        // memory may be null.
        unsafe {
            raw.destroy_buffer(self.handle, None);
            raw.free_memory(self.memory, None);
        }
    }
}

/// A two-dimensional image of colours or depths, with its memory and a view of it.
pub struct Image {
    handle: vk::Image,
    memory: vk::DeviceMemory,
    view: vk::ImageView,
    extent: vk::Extent2D,
    whole: vk::ImageSubresourceRange,
    device: Arc<Device>,
}

impl Image {
    /// An image of one level, one layer and one sample.
    ///
    /// # Errors
    /// If there is no memory for it, or Vulkan fails.
    pub fn new(
        device: &Arc<Device>,
        extent: vk::Extent2D,
        format: vk::Format,
        usage: vk::ImageUsageFlags,
    ) -> Result<Self, RenderError> {
        Self::with_samples(device, extent, format, usage, vk::SampleCountFlags::TYPE_1)
    }

    /// An image of one level and one layer, with a number of samples for each pixel.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn with_samples(
        device: &Arc<Device>,
        extent: vk::Extent2D,
        format: vk::Format,
        usage: vk::ImageUsageFlags,
        samples: vk::SampleCountFlags,
    ) -> Result<Self, RenderError> {
        let create_info = vk::ImageCreateInfo::default()
            .image_type(vk::ImageType::TYPE_2D)
            .format(format)
            .extent(extent.into())
            .mip_levels(1)
            .array_layers(1)
            .samples(samples)
            .tiling(vk::ImageTiling::OPTIMAL)
            .usage(usage);
        // SAFETY: the structure is valid.
        let handle = unsafe { device.raw().create_image(&create_info, None) }.during("vkCreateImage")?;
        let mut image = Self {
            handle,
            memory: vk::DeviceMemory::null(),
            view: vk::ImageView::null(),
            extent,
            whole: whole(format),
            device: device.clone(),
        };
        // SAFETY: the image is the device's.
        let requirements = unsafe { device.raw().get_image_memory_requirements(handle) };
        image.memory = Memory::Device.allocate(device, requirements, vk::MemoryAllocateFlags::empty())?;
        // SAFETY: the memory is new, and of the size and a type that the image requires.
        unsafe { device.raw().bind_image_memory(handle, image.memory, 0) }.during("vkBindImageMemory")?;
        let create_info = vk::ImageViewCreateInfo::default()
            .image(handle)
            .view_type(vk::ImageViewType::TYPE_2D)
            .format(format)
            .subresource_range(image.whole);
        // SAFETY: the structure is valid, and the image is bound to memory.
        image.view = unsafe { device.raw().create_image_view(&create_info, None) }.during("vkCreateImageView")?;
        Ok(image)
    }

    /// The image's handle.
    pub fn handle(&self) -> vk::Image {
        self.handle
    }

    /// The view of the whole image.
    pub fn view(&self) -> vk::ImageView {
        self.view
    }

    /// Width and height in pixels.
    pub fn extent(&self) -> vk::Extent2D {
        self.extent
    }

    /// A barrier that changes the layout, still without accesses.
    pub fn barrier(&self, from: vk::ImageLayout, to: vk::ImageLayout) -> vk::ImageMemoryBarrier<'static> {
        vk::ImageMemoryBarrier::default()
            .image(self.handle)
            .old_layout(from)
            .new_layout(to)
            .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
            .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
            .subresource_range(self.whole)
    }
}

/// All of an image of `format`, of one level and one layer.
fn whole(format: vk::Format) -> vk::ImageSubresourceRange {
    let aspect =
        if format == vk::Format::D32_SFLOAT { vk::ImageAspectFlags::DEPTH } else { vk::ImageAspectFlags::COLOR };
    vk::ImageSubresourceRange::default().aspect_mask(aspect).level_count(1).layer_count(1)
}

impl Drop for Image {
    fn drop(&mut self) {
        let raw = self.device.raw();
        // SAFETY: every submission has been waited for, so the device doesn't use the image. View
        // and memory may be null.
        unsafe {
            raw.destroy_image_view(self.view, None);
            raw.destroy_image(self.handle, None);
            raw.free_memory(self.memory, None);
        }
    }
}

/// `N` command buffers that are recorded again for every use, and the fence that signals the end of their submissions.
pub struct CommandBuffers<const N: usize> {
    pool: vk::CommandPool,
    fence: vk::Fence,
    handles: Vec<vk::CommandBuffer>,
    device: Arc<Device>,
}

impl<const N: usize> CommandBuffers<N> {
    /// Allocates the command buffers, with nothing recorded.
    ///
    /// # Errors
    /// If Vulkan fails.
    pub fn new(device: &Arc<Device>) -> Result<Self, RenderError> {
        let raw = device.raw();
        let create_info = vk::CommandPoolCreateInfo::default()
            .flags(vk::CommandPoolCreateFlags::RESET_COMMAND_BUFFER)
            .queue_family_index(device.queue_family());
        // SAFETY: the structure is valid.
        let pool = unsafe { raw.create_command_pool(&create_info, None) }.during("vkCreateCommandPool")?;
        let mut commands = Self { pool, fence: vk::Fence::null(), handles: Vec::new(), device: device.clone() };
        // SAFETY: the structure is valid.
        commands.fence = unsafe { raw.create_fence(&vk::FenceCreateInfo::default(), None) }.during("vkCreateFence")?;
        let allocate_info = vk::CommandBufferAllocateInfo::default().command_pool(pool).command_buffer_count(N as u32);
        // SAFETY: the structure is valid, and the pool is used by `self` alone.
        commands.handles =
            unsafe { raw.allocate_command_buffers(&allocate_info) }.during("vkAllocateCommandBuffers")?;
        Ok(commands)
    }

    /// Records command buffer `index`.
    ///
    /// # Errors
    /// If Vulkan fails.
    pub fn record(
        &self,
        index: usize,
        record: impl FnOnce(&ash::Device, vk::CommandBuffer),
    ) -> Result<(), RenderError> {
        let (raw, handle) = (self.device.raw(), self.handles[index]);
        let begin_info = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        // SAFETY: no submission is pending, since each is waited for; beginning resets.
        unsafe { raw.begin_command_buffer(handle, &begin_info) }.during("vkBeginCommandBuffer")?;
        record(raw, handle);
        // SAFETY: the command buffer is recording.
        unsafe { raw.end_command_buffer(handle) }.during("vkEndCommandBuffer")
    }

    /// Submits command buffers in the order of `indices`, and waits for their end.
    ///
    /// # Errors
    /// If Vulkan fails.
    pub fn submit_and_wait(&mut self, indices: &[usize]) -> Result<(), RenderError> {
        let raw = self.device.raw();
        let handles: Vec<_> = indices.iter().map(|index| self.handles[*index]).collect();
        let submit = vk::SubmitInfo::default().command_buffers(&handles);
        // SAFETY: the command buffers are recorded, `&mut self` and the one renderer per device
        // keep others from the queue, and the fence is unsignalled.
        unsafe { raw.queue_submit(self.device.queue(), &[submit], self.fence) }.during("vkQueueSubmit")?;
        // SAFETY: the fence is the device's.
        unsafe { raw.wait_for_fences(&[self.fence], true, u64::MAX) }.during("vkWaitForFences")?;
        // SAFETY: no submission with the fence is pending.
        unsafe { raw.reset_fences(&[self.fence]) }.during("vkResetFences")
    }
}

impl<const N: usize> Drop for CommandBuffers<N> {
    fn drop(&mut self) {
        let raw = self.device.raw();
        // SAFETY: no submission is pending; the fence may be null; the pool frees its buffers.
        unsafe {
            raw.destroy_fence(self.fence, None);
            raw.destroy_command_pool(self.pool, None);
        }
    }
}
