//! Buffers and buffer views.

use super::memory::{Memory, bind_all};
use crate::abi::error::Error;
use crate::abi::handle::{self, objects};
use crate::abi::valid::OutputChain;
use crate::device::Device;
use crate::device_addresses::Addresses;
use crate::physical_device::limits::{MAX_TEXEL_BUFFER_ELEMENTS, MIN_BUFFER_OFFSET_ALIGNMENT};
use crate::physical_device::memory::ALL_TYPE_BITS;
use crate::physical_device::{external, formats};
use ash::vk;
use simdevice::BufferRange;
use simdevice::{Allocation, Format};
use std::sync::{Arc, OnceLock};

/// The alignment of every buffer in memory: a cache line, which suffices for any texel.
pub(crate) const ALIGNMENT: u64 = 64;

/// A buffer.
#[derive(Debug)]
pub(crate) struct Buffer {
    size: u64,
    memory: OnceLock<(Arc<Allocation>, u64)>,
    /// The device's addresses, if the buffer needs one.
    addresses: Option<Arc<Addresses>>,
    /// Its address, if it is bound and needs one.
    address: OnceLock<u64>,
}

objects! {
    vk::Buffer => Buffer;
    vk::BufferView => BufferView;
}

/// The ids of the rules on a use of a buffer.
#[derive(Debug)]
pub(crate) struct BufferRules {
    /// The buffer must be bound to memory.
    pub(crate) memory: &'static str,
    /// The buffer must have the used bytes.
    pub(crate) range: &'static str,
}

/// The rules on the buffer of a buffer view.
const VIEWED: BufferRules = BufferRules {
    memory: "VUID-VkBufferViewCreateInfo-buffer-00935",
    range: "VUID-VkBufferViewCreateInfo-offset-00931",
};

impl Buffer {
    /// A buffer of `size` bytes, not yet bound to memory. With `addresses`, it gets one of them when it is bound.
    pub(crate) fn new(size: u64, addresses: Option<Arc<Addresses>>) -> Self {
        Self { size, memory: OnceLock::new(), addresses, address: OnceLock::new() }
    }

    /// The address of its first byte.
    ///
    /// # Errors
    /// [`Error::InvalidUsage`] if it is not bound, or was not created with a device address.
    fn address(&self) -> Result<vk::DeviceAddress, Error> {
        self.address.get().copied().ok_or_else(|| {
            Error::usage(
                "VUID-VkBufferDeviceAddressInfo-buffer-02601",
                "the buffer is not bound, or its usage has no SHADER_DEVICE_ADDRESS",
            )
        })
    }

    /// The memory that it needs, of any type.
    fn requirements(&self) -> vk::MemoryRequirements {
        requirements(self.size)
    }

    /// Binds it to memory from byte `offset` on.
    ///
    /// # Errors
    /// [`Error::InvalidUsage`] if it is bound already or does not fit.
    pub(crate) fn bind(&self, memory: Arc<Allocation>, offset: u64) -> Result<(), Error> {
        fits("VUID-vkBindBufferMemory-size-01037", &memory, offset, self.size)?;
        self.memory
            .set((memory, offset))
            .map_err(|_| Error::usage("VUID-vkBindBufferMemory-buffer-07459", "the buffer is bound already"))?;
        if let (Some(addresses), Some((memory, offset))) = (&self.addresses, self.memory.get()) {
            self.address.get_or_init(|| {
                addresses.add(BufferRange { memory: Arc::clone(memory), offset: *offset, size: self.size })
            });
        }
        Ok(())
    }

    /// `size` bytes from `offset` on; with `None` (`VK_WHOLE_SIZE`) all bytes from there on.
    ///
    /// # Errors
    /// [`Error::InvalidUsage`] if the buffer is not bound or does not have these bytes.
    pub(crate) fn range(&self, offset: u64, size: Option<u64>, rules: &BufferRules) -> Result<BufferRange, Error> {
        let Some((memory, start)) = self.memory.get() else {
            return Err(Error::usage(rules.memory, "a command uses a buffer that is not bound to memory"));
        };
        let rest = self.size.checked_sub(offset);
        match (rest, size) {
            (Some(rest), size) if size.is_none_or(|size| size <= rest) => {
                Ok(BufferRange { memory: Arc::clone(memory), offset: start + offset, size: size.unwrap_or(rest) })
            }
            _ => Err(Error::usage(
                rules.range,
                format!(
                    "a command uses {} bytes at offset {offset} of a buffer of {} bytes",
                    size.unwrap_or(0),
                    self.size
                ),
            )),
        }
    }

    /// All bytes of the buffer.
    ///
    /// # Errors
    /// [`Error::InvalidUsage`] if the buffer is not bound.
    pub(crate) fn whole(&self, rules: &BufferRules) -> Result<BufferRange, Error> {
        self.range(0, None, rules)
    }
}

impl Drop for Buffer {
    fn drop(&mut self) {
        if let (Some(addresses), Some(&address)) = (&self.addresses, self.address.get()) {
            addresses.remove(address);
        }
    }
}

/// The requirements of a resource of `size` bytes.
pub(crate) fn requirements(size: u64) -> vk::MemoryRequirements {
    vk::MemoryRequirements {
        // A size that can't be rounded up doesn't fit any memory.
        size: size.checked_next_multiple_of(ALIGNMENT).unwrap_or(u64::MAX),
        alignment: ALIGNMENT,
        memory_type_bits: ALL_TYPE_BITS,
    }
}

/// A buffer view.
#[derive(Debug)]
pub(crate) struct BufferView {
    /// The bytes.
    pub(crate) range: BufferRange,
    /// The format of its texels.
    pub(crate) format: Format,
}

/// Checks that `size` bytes from `offset` on lie in `memory` and that the offset is aligned.
pub(crate) fn fits(vuid: &'static str, memory: &Allocation, offset: u64, size: u64) -> Result<(), Error> {
    let end = offset.checked_add(size);
    if offset.is_multiple_of(ALIGNMENT) && end.is_some_and(|end| end <= memory.len()) {
        return Ok(());
    }
    Err(Error::usage(
        vuid,
        format!(
            "a resource of {size} bytes cannot be bound at offset {offset} of {} bytes of memory (offsets are \
             multiples of {ALIGNMENT})",
            memory.len()
        ),
    ))
}

/// The buffer of a create info.
fn new_buffer(
    info: &vk::BufferCreateInfo<'_>,
    shared: Option<&vk::ExternalMemoryBufferCreateInfo<'_>>,
    usage: vk::BufferUsageFlags,
    addresses: &Arc<Addresses>,
) -> Result<Buffer, Error> {
    if let Some(shared) = shared {
        external::check_memory_types(shared.handle_types, "VUID-VkBufferCreateInfo-pNext-00920")?;
    }
    let sparse_or_protected = vk::BufferCreateFlags::SPARSE_BINDING
        | vk::BufferCreateFlags::SPARSE_RESIDENCY
        | vk::BufferCreateFlags::SPARSE_ALIASED
        | vk::BufferCreateFlags::PROTECTED;
    if info.flags.intersects(sparse_or_protected) {
        return Err(Error::FeatureNotPresent(format!("a buffer with flags {:?}", info.flags)));
    }
    if info.size == 0 {
        return Err(Error::usage("VUID-VkBufferCreateInfo-size-00912", "the size of a buffer is 0"));
    }
    let is_addressed = usage.contains(vk::BufferUsageFlags::SHADER_DEVICE_ADDRESS);
    Ok(Buffer::new(info.size, is_addressed.then(|| Arc::clone(addresses))))
}

/// Writes the requirements and, if the chain asks, that no dedicated allocation is preferred.
pub(crate) fn fill_requirements(
    mut out: OutputChain<'_, vk::MemoryRequirements2<'_>>,
    requirements: vk::MemoryRequirements,
) -> Result<(), Error> {
    out.memory_requirements = requirements;
    out.for_each_chained(|mut structure| {
        if let Some(dedicated) = structure.cast::<vk::MemoryDedicatedRequirements>() {
            dedicated.prefers_dedicated_allocation = vk::FALSE;
            dedicated.requires_dedicated_allocation = vk::FALSE;
        }
    });
    Ok(())
}

#[doc(alias = "vkCreateBuffer")]
pub(crate) fn create_buffer(
    device: &Device,
    create_info: &vk::BufferCreateInfo<'_>,
    shared: Option<&vk::ExternalMemoryBufferCreateInfo<'_>>,
    usage2: Option<&vk::BufferUsageFlags2CreateInfoKHR<'_>>,
) -> Result<Arc<Buffer>, Error> {
    // The first 32 flags of the longer word are those of the shorter.
    let usage = usage2.map_or(create_info.usage, |it| vk::BufferUsageFlags::from_raw(it.usage.as_raw() as u32));
    new_buffer(create_info, shared, usage, device.addresses()).map(Arc::new)
}

#[doc(alias = "vkGetBufferDeviceAddress")]
pub(crate) fn get_buffer_device_address(buffer: &Buffer) -> Result<vk::DeviceAddress, Error> {
    buffer.address()
}

/// Returns the buffer's address, as its opaque capture address. Captured addresses are not replayed.
#[doc(alias = "vkGetBufferOpaqueCaptureAddress")]
pub(crate) fn get_buffer_opaque_capture_address(buffer: &Buffer) -> Result<u64, Error> {
    buffer.address()
}

#[doc(alias = "vkGetBufferMemoryRequirements")]
pub(crate) fn get_buffer_memory_requirements(buffer: &Buffer) -> Result<vk::MemoryRequirements, Error> {
    Ok(buffer.requirements())
}

#[doc(alias = "vkGetBufferMemoryRequirements2")]
pub(crate) fn get_buffer_memory_requirements2(
    buffer: &Buffer,
    memory_requirements: OutputChain<'_, vk::MemoryRequirements2<'_>>,
) -> Result<(), Error> {
    fill_requirements(memory_requirements, buffer.requirements())
}

#[doc(alias = "vkGetDeviceBufferMemoryRequirements")]
pub(crate) fn get_device_buffer_memory_requirements(
    create_info: &vk::BufferCreateInfo<'_>,
    memory_requirements: OutputChain<'_, vk::MemoryRequirements2<'_>>,
) -> Result<(), Error> {
    let buffer = new_buffer(create_info, None, vk::BufferUsageFlags::empty(), &Arc::default())?;
    fill_requirements(memory_requirements, buffer.requirements())
}

#[doc(alias = "vkBindBufferMemory")]
pub(crate) fn bind_buffer_memory(buffer: &Buffer, memory: &Memory, memory_offset: vk::DeviceSize) -> Result<(), Error> {
    buffer.bind(Arc::clone(memory.allocation()), memory_offset)
}

/// # Safety
/// The handles are live.
#[doc(alias = "vkBindBufferMemory2")]
pub(crate) unsafe fn bind_buffer_memory2(bind_infos: &[vk::BindBufferMemoryInfo<'_>]) -> Result<(), Error> {
    // SAFETY: the caller's promise, for the chains too.
    unsafe {
        bind_all(
            bind_infos,
            |info| info.p_next,
            |info| bind_buffer_memory(handle::get(info.buffer)?, handle::get(info.memory)?, info.memory_offset),
        )
    }
}

/// The bytes of a texel, or of a component of one of three.
fn texel_alignment(format: Format) -> u64 {
    let size = format.texel_size().max(1) as u64;
    if size.is_multiple_of(3) { size / 3 } else { size }
}

#[doc(alias = "vkCreateBufferView")]
pub(crate) fn create_buffer_view(
    create_info: &vk::BufferViewCreateInfo<'_>,
    buffer: &Buffer,
) -> Result<Arc<BufferView>, Error> {
    let info = create_info;
    let size = (info.range != vk::WHOLE_SIZE).then_some(info.range);
    let format = formats::device_format(info.format)
        .ok_or_else(|| Error::FormatNotSupported(format!("{:?} is not supported for buffer views", info.format)))?;
    let alignment = MIN_BUFFER_OFFSET_ALIGNMENT.min(texel_alignment(format));
    if !info.offset.is_multiple_of(alignment) {
        return Err(Error::usage(
            "VUID-VkBufferViewCreateInfo-buffer-02751",
            format!("the offset {} is not a multiple of {alignment}", info.offset),
        ));
    }
    let range = buffer.range(info.offset, size, &VIEWED)?;
    let texels = range.size / format.texel_size().max(1) as u64;
    if texels > u64::from(MAX_TEXEL_BUFFER_ELEMENTS) {
        return Err(Error::usage(
            "VUID-VkBufferViewCreateInfo-range-00930",
            format!("a texel buffer of {texels} texels; there may be {MAX_TEXEL_BUFFER_ELEMENTS}"),
        ));
    }
    Ok(Arc::new(BufferView { range, format }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_lie_inside_the_buffer() {
        let buffer = Buffer::new(100, None);
        assert!(buffer.whole(&VIEWED).is_err(), "not bound");
        let memory = Allocation::new_zeroed(4096).unwrap();
        assert!(buffer.bind(memory.clone(), 4032).is_err(), "does not fit");
        assert!(buffer.bind(memory.clone(), 3).is_err(), "not aligned");
        buffer.bind(memory.clone(), 128).unwrap();
        assert!(buffer.bind(memory, 128).is_err(), "bound already");
        let range = buffer.range(10, None, &VIEWED).unwrap();
        assert_eq!((range.offset, range.size), (138, 90));
        assert_eq!(buffer.range(100, None, &VIEWED).unwrap().size, 0);
        assert!(buffer.range(101, None, &VIEWED).is_err());
        assert!(buffer.range(99, Some(2), &VIEWED).is_err());
        assert!(buffer.range(u64::MAX, Some(2), &VIEWED).is_err());
    }
}
