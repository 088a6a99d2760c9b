//! Memory, semaphores and fences that devices and processes share.

use std::os::fd::{AsFd, AsRawFd, BorrowedFd, FromRawFd, IntoRawFd, OwnedFd, RawFd};

use ash::vk;

use crate::Gpu;

pub use rustix;

/// Memory that other devices can import.
pub fn exportable(gpu: &Gpu, size: u64, memory_type: u32) -> vk::DeviceMemory {
    let mut export = vk::ExportMemoryAllocateInfo::default().handle_types(vk::ExternalMemoryHandleTypeFlags::OPAQUE_FD);
    let info =
        vk::MemoryAllocateInfo::default().allocation_size(size).memory_type_index(memory_type).push_next(&mut export);
    // SAFETY: see the crate.
    unsafe { gpu.device().allocate_memory(&info, None) }.expect("memory")
}

/// The file of memory.
pub fn memory_file(gpu: &Gpu, memory: vk::DeviceMemory) -> OwnedFd {
    let commands = ash::khr::external_memory_fd::Device::new(gpu.instance(), gpu.device());
    let info =
        vk::MemoryGetFdInfoKHR::default().memory(memory).handle_type(vk::ExternalMemoryHandleTypeFlags::OPAQUE_FD);
    // SAFETY: see the crate; the descriptor is new.
    unsafe { OwnedFd::from_raw_fd(commands.get_memory_fd(&info).expect("a file")) }
}

/// Memory that is imported by the number of a descriptor, which the driver closes if it succeeds.
///
/// # Errors
/// The driver's.
pub fn import_memory_of(gpu: &Gpu, fd: RawFd, size: u64, memory_type: u32) -> Result<vk::DeviceMemory, vk::Result> {
    let mut import =
        vk::ImportMemoryFdInfoKHR::default().handle_type(vk::ExternalMemoryHandleTypeFlags::OPAQUE_FD).fd(fd);
    let info =
        vk::MemoryAllocateInfo::default().allocation_size(size).memory_type_index(memory_type).push_next(&mut import);
    // SAFETY: see the crate.
    unsafe { gpu.device().allocate_memory(&info, None) }
}

/// Memory that is imported by a copy of a descriptor. The copy is closed once, by the driver or here.
///
/// # Errors
/// The driver's.
pub fn import_memory(
    gpu: &Gpu,
    file: BorrowedFd<'_>,
    size: u64,
    memory_type: u32,
) -> Result<vk::DeviceMemory, vk::Result> {
    given(file, |fd| import_memory_of(gpu, fd, size, memory_type))
}

/// Gives a copy of a descriptor to a command, which keeps it if it succeeds.
fn given<R>(file: BorrowedFd<'_>, import: impl FnOnce(RawFd) -> Result<R, vk::Result>) -> Result<R, vk::Result> {
    let copy = file.try_clone_to_owned().expect("a descriptor");
    let result = import(copy.as_raw_fd());
    if result.is_ok() {
        // It is the driver's.
        let _ = copy.into_raw_fd();
    } else {
        assert!(rustix::fs::fstat(&copy).is_ok(), "a descriptor that is not imported stays open");
    }
    result
}

/// A buffer for copies in memory, from its first byte on.
pub fn buffer_in(gpu: &Gpu, memory: vk::DeviceMemory, size: u64) -> vk::Buffer {
    let mut external =
        vk::ExternalMemoryBufferCreateInfo::default().handle_types(vk::ExternalMemoryHandleTypeFlags::OPAQUE_FD);
    let usage = vk::BufferUsageFlags::TRANSFER_SRC | vk::BufferUsageFlags::TRANSFER_DST;
    let info = vk::BufferCreateInfo::default().size(size).usage(usage).push_next(&mut external);
    // SAFETY: see the crate.
    unsafe {
        let buffer = gpu.device().create_buffer(&info, None).expect("a buffer");
        gpu.device().bind_buffer_memory(buffer, memory, 0).expect("a buffer is bound");
        buffer
    }
}

/// A semaphore that is exported with handles of these types; a timeline if it has a first value.
///
/// # Errors
/// The driver's.
pub fn semaphore(
    gpu: &Gpu,
    handle_types: vk::ExternalSemaphoreHandleTypeFlags,
    timeline: Option<u64>,
) -> Result<vk::Semaphore, vk::Result> {
    let mut export = vk::ExportSemaphoreCreateInfo::default().handle_types(handle_types);
    let mut kind = vk::SemaphoreTypeCreateInfo::default();
    if let Some(value) = timeline {
        kind = kind.semaphore_type(vk::SemaphoreType::TIMELINE).initial_value(value);
    }
    let info = vk::SemaphoreCreateInfo::default().push_next(&mut export).push_next(&mut kind);
    // SAFETY: see the crate.
    unsafe { gpu.device().create_semaphore(&info, None) }
}

/// The descriptor of a semaphore; -1 of a sync file that is signaled.
///
/// # Errors
/// The driver's.
pub fn semaphore_fd(
    gpu: &Gpu,
    semaphore: vk::Semaphore,
    handle_type: vk::ExternalSemaphoreHandleTypeFlags,
) -> Result<RawFd, vk::Result> {
    let commands = ash::khr::external_semaphore_fd::Device::new(gpu.instance(), gpu.device());
    let info = vk::SemaphoreGetFdInfoKHR::default().semaphore(semaphore).handle_type(handle_type);
    // SAFETY: see the crate.
    unsafe { commands.get_semaphore_fd(&info) }
}

/// The file of a semaphore, which is opaque.
pub fn semaphore_file(gpu: &Gpu, semaphore: vk::Semaphore) -> OwnedFd {
    let fd = semaphore_fd(gpu, semaphore, vk::ExternalSemaphoreHandleTypeFlags::OPAQUE_FD).expect("a file");
    // SAFETY: the descriptor is new.
    unsafe { OwnedFd::from_raw_fd(fd) }
}

/// Imports a semaphore's payload by the number of a descriptor, which the driver closes if it succeeds.
///
/// # Errors
/// The driver's.
pub fn import_semaphore_of(
    gpu: &Gpu,
    semaphore: vk::Semaphore,
    handle_type: vk::ExternalSemaphoreHandleTypeFlags,
    flags: vk::SemaphoreImportFlags,
    fd: RawFd,
) -> Result<(), vk::Result> {
    let commands = ash::khr::external_semaphore_fd::Device::new(gpu.instance(), gpu.device());
    let info =
        vk::ImportSemaphoreFdInfoKHR::default().semaphore(semaphore).handle_type(handle_type).flags(flags).fd(fd);
    // SAFETY: see the crate.
    unsafe { commands.import_semaphore_fd(&info) }
}

/// A semaphore with the payload of a file, which is opaque; a timeline or a binary one.
///
/// # Errors
/// The driver's.
pub fn import_semaphore(gpu: &Gpu, file: BorrowedFd<'_>, is_timeline: bool) -> Result<vk::Semaphore, vk::Result> {
    use vk::ExternalSemaphoreHandleTypeFlags as Types;
    let semaphore = semaphore(gpu, Types::empty(), is_timeline.then_some(0))?;
    let flags = vk::SemaphoreImportFlags::empty();
    let imported = given(file, |fd| import_semaphore_of(gpu, semaphore, Types::OPAQUE_FD, flags, fd));
    if imported.is_err() {
        // SAFETY: see the crate.
        unsafe { gpu.device().destroy_semaphore(semaphore, None) };
    }
    imported.map(|()| semaphore)
}

/// A fence that is exported with handles of these types.
///
/// # Errors
/// The driver's.
pub fn fence(gpu: &Gpu, handle_types: vk::ExternalFenceHandleTypeFlags) -> Result<vk::Fence, vk::Result> {
    let mut export = vk::ExportFenceCreateInfo::default().handle_types(handle_types);
    let info = vk::FenceCreateInfo::default().push_next(&mut export);
    // SAFETY: see the crate.
    unsafe { gpu.device().create_fence(&info, None) }
}

/// The descriptor of a fence; -1 of a sync file that is signaled.
///
/// # Errors
/// The driver's.
pub fn fence_fd(
    gpu: &Gpu,
    fence: vk::Fence,
    handle_type: vk::ExternalFenceHandleTypeFlags,
) -> Result<RawFd, vk::Result> {
    let commands = ash::khr::external_fence_fd::Device::new(gpu.instance(), gpu.device());
    let info = vk::FenceGetFdInfoKHR::default().fence(fence).handle_type(handle_type);
    // SAFETY: see the crate.
    unsafe { commands.get_fence_fd(&info) }
}

/// Imports a fence's payload by the number of a descriptor, which the driver closes if it succeeds.
///
/// # Errors
/// The driver's.
pub fn import_fence_of(
    gpu: &Gpu,
    fence: vk::Fence,
    handle_type: vk::ExternalFenceHandleTypeFlags,
    flags: vk::FenceImportFlags,
    fd: RawFd,
) -> Result<(), vk::Result> {
    let commands = ash::khr::external_fence_fd::Device::new(gpu.instance(), gpu.device());
    let info = vk::ImportFenceFdInfoKHR::default().fence(fence).handle_type(handle_type).flags(flags).fd(fd);
    // SAFETY: see the crate.
    unsafe { commands.import_fence_fd(&info) }
}

/// A copy of a descriptor that child processes inherit under the same number, as text.
pub fn inheritable(file: impl AsFd) -> (OwnedFd, String) {
    let copy = rustix::io::dup(file).expect("a descriptor");
    let number = copy.as_raw_fd().to_string();
    (copy, number)
}

/// The inherited descriptor whose number a variable of the environment has.
pub fn inherited(variable: &str) -> OwnedFd {
    let number = std::env::var(variable).expect("a variable of the parent");
    // SAFETY: the parent gives the descriptor to this process, and it is taken once.
    unsafe { OwnedFd::from_raw_fd(number.parse().expect("a number")) }
}
