//! Memory that devices, processes and the host share, and handles that are not of such memory.

use ash::vk;
use gaurast_runner::Case;
use gaurast_testkit::devices::{COLOR, COLOR_LAYERS, DEVICE_ONLY, MAPPABLE, allocate, open};
use gaurast_testkit::sharing::rustix::fs::{MemfdFlags, SealFlags, fcntl_add_seals, ftruncate, memfd_create};
use gaurast_testkit::sharing::rustix::mm;
use gaurast_testkit::sharing::{
    buffer_in, exportable, import_memory, import_memory_of, inheritable, inherited, memory_file, rustix, semaphore,
    semaphore_file,
};
use gaurast_testkit::{Buffer, Gpu};
use std::os::fd::{AsFd, OwnedFd};

const SIZE: u64 = 10_000;

/// The words of memory, by a copy on the device.
fn words_of(gpu: &Gpu, shared: vk::Buffer, size: u64) -> Vec<u32> {
    let target = Buffer::new(gpu, size);
    gpu.run(|recording| {
        let (device, commands) = recording.raw();
        let region = [vk::BufferCopy::default().size(size)];
        // SAFETY: see the crate.
        unsafe { device.cmd_copy_buffer(commands, shared, target.raw, &region) };
    });
    target.values()
}

fn fill(gpu: &Gpu, buffer: vk::Buffer, word: u32) {
    gpu.run(|recording| {
        let (device, commands) = recording.raw();
        // SAFETY: see the crate.
        unsafe { device.cmd_fill_buffer(commands, buffer, 0, vk::WHOLE_SIZE, word) };
    });
}

/// Destroys a buffer and frees its memory.
fn free(gpu: &Gpu, buffer: vk::Buffer, memory: vk::DeviceMemory) {
    // SAFETY: see the crate.
    unsafe {
        gpu.device().destroy_buffer(buffer, None);
        gpu.device().free_memory(memory, None);
    }
}

#[gaurast_runner::test]
fn devices_share_a_buffer() {
    for memory_type in [DEVICE_ONLY, MAPPABLE] {
        let (one, two) = (open(), open());
        let memory = exportable(&one, SIZE, memory_type);
        let file = memory_file(&one, memory);
        let imported = import_memory(&two, file.as_fd(), SIZE, memory_type).unwrap();
        drop(file);
        let (first, second) = (buffer_in(&one, memory, SIZE), buffer_in(&two, imported, SIZE));
        fill(&one, first, 5);
        assert_eq!(words_of(&two, second, SIZE), [5; 2500]);
        fill(&two, second, 6);
        assert_eq!(words_of(&one, first, SIZE), [6; 2500]);
        // An imported payload is exported again, and outlives the memory that it came from.
        let again = memory_file(&two, imported);
        free(&one, first, memory);
        free(&two, second, imported);
        let imported = import_memory(&one, again.as_fd(), SIZE, memory_type).unwrap();
        let third = buffer_in(&one, imported, SIZE);
        assert_eq!(words_of(&one, third, SIZE), [6; 2500]);
        free(&one, third, imported);
        assert_eq!(one.message_texts(), [""; 0]);
        assert_eq!(two.message_texts(), [""; 0]);
    }
}

#[gaurast_runner::test]
fn mappings_of_two_devices_are_the_same_memory() {
    let (one, two) = (open(), open());
    let memory = exportable(&one, SIZE, MAPPABLE);
    let imported = import_memory(&two, memory_file(&one, memory).as_fd(), SIZE, MAPPABLE).unwrap();
    // SAFETY: see the crate.
    unsafe {
        let none = vk::MemoryMapFlags::empty();
        let first = one.device().map_memory(memory, 0, vk::WHOLE_SIZE, none).unwrap().cast::<u8>();
        let second = two.device().map_memory(imported, 0, vk::WHOLE_SIZE, none).unwrap().cast::<u8>();
        assert_ne!(first, second);
        first.add(9_999).write_volatile(7);
        assert_eq!(second.add(9_999).read_volatile(), 7);
        one.device().free_memory(memory, None);
        second.add(9_999).write_volatile(8);
        two.device().free_memory(imported, None);
    }
}

/// An image in memory, in the layout `GENERAL`.
fn image_in(gpu: &Gpu, memory: vk::DeviceMemory, info: &vk::ImageCreateInfo<'_>) -> vk::Image {
    let mut external =
        vk::ExternalMemoryImageCreateInfo::default().handle_types(vk::ExternalMemoryHandleTypeFlags::OPAQUE_FD);
    let info = info.push_next(&mut external);
    // SAFETY: see the crate.
    unsafe {
        let image = gpu.device().create_image(&info, None).unwrap();
        gpu.device().bind_image_memory(image, memory, 0).unwrap();
        become_general(gpu, image);
        image
    }
}

fn become_general(gpu: &Gpu, image: vk::Image) {
    let barrier = vk::ImageMemoryBarrier::default()
        .dst_access_mask(vk::AccessFlags::MEMORY_READ | vk::AccessFlags::MEMORY_WRITE)
        .new_layout(vk::ImageLayout::GENERAL)
        .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .image(image)
        .subresource_range(COLOR);
    gpu.run(|recording| {
        let (device, commands) = recording.raw();
        let all = vk::PipelineStageFlags::ALL_COMMANDS;
        let none = vk::DependencyFlags::empty();
        // SAFETY: see the crate.
        unsafe { device.cmd_pipeline_barrier(commands, all, all, none, &[], &[], &[barrier]) };
    });
}

fn image_info(format: vk::Format, side: u32) -> vk::ImageCreateInfo<'static> {
    vk::ImageCreateInfo::default()
        .image_type(vk::ImageType::TYPE_2D)
        .format(format)
        .extent(vk::Extent3D { width: side, height: side, depth: 1 })
        .mip_levels(1)
        .array_layers(1)
        .samples(vk::SampleCountFlags::TYPE_1)
        .usage(vk::ImageUsageFlags::TRANSFER_SRC | vk::ImageUsageFlags::TRANSFER_DST)
}

fn whole(side: u32) -> vk::BufferImageCopy {
    let extent = vk::Extent3D { width: side, height: side, depth: 1 };
    vk::BufferImageCopy::default().image_subresource(COLOR_LAYERS).image_extent(extent)
}

#[gaurast_runner::test]
fn devices_share_an_image() {
    let (one, two) = (open(), open());
    let info = image_info(vk::Format::R8G8B8A8_UNORM, 37);
    let memory = exportable(&one, 1 << 16, DEVICE_ONLY);
    let imported = import_memory(&two, memory_file(&one, memory).as_fd(), 1 << 16, DEVICE_ONLY).unwrap();
    let (first, second) = (image_in(&one, memory, &info), image_in(&two, imported, &info));
    for byte in [51u8, 102] {
        let value = f32::from(byte) / 255.0;
        one.run(|recording| {
            let (device, commands) = recording.raw();
            let color = vk::ClearColorValue { float32: [value, 0.0, 1.0, 1.0] };
            // SAFETY: see the crate.
            unsafe { device.cmd_clear_color_image(commands, first, vk::ImageLayout::GENERAL, &color, &[COLOR]) };
        });
        let target = Buffer::new(&two, 37 * 37 * 4);
        two.run(|recording| recording.download(second, &target, &[whole(37)]));
        assert_eq!(target.values::<[u8; 4]>(), [[byte, 0, 255, 255]; 37 * 37]);
    }
    // SAFETY: see the crate.
    unsafe {
        one.device().destroy_image(first, None);
        two.device().destroy_image(second, None);
        one.device().free_memory(memory, None);
        two.device().free_memory(imported, None);
    }
}

/// The device keeps the texels of compressed images in memory that only it writes; this memory has two devices.
#[gaurast_runner::test]
fn what_another_device_compressed_again_is_decompressed_again() {
    let (one, two) = (open(), open());
    let info = image_info(vk::Format::BC1_RGB_UNORM_BLOCK, 4);
    let memory = exportable(&one, 4096, DEVICE_ONLY);
    let imported = import_memory(&two, memory_file(&one, memory).as_fd(), 4096, DEVICE_ONLY).unwrap();
    let (first, second) = (image_in(&one, memory, &info), image_in(&two, imported, &info));
    let plain_memory = allocate(&two, 4096, DEVICE_ONLY);
    let plain = image_in(&two, plain_memory, &image_info(vk::Format::R8G8B8A8_UNORM, 4));
    // Both colours of a block are red, then green.
    for (color, texel) in [(0xf800_u16, [255u8, 0, 0, 255]), (0x07e0, [0, 255, 0, 255]), (0xf800, [255, 0, 0, 255])] {
        let block = Buffer::of(&one, &[color, color, 0, 0]);
        one.run(|recording| recording.upload(&block, first, &[whole(4)]));
        let target = Buffer::new(&two, 4 * 4 * 4);
        two.run(|recording| {
            let (device, commands) = recording.raw();
            let all = [vk::Offset3D::default(), vk::Offset3D { x: 4, y: 4, z: 1 }];
            let region = [vk::ImageBlit {
                src_subresource: COLOR_LAYERS,
                src_offsets: all,
                dst_subresource: COLOR_LAYERS,
                dst_offsets: all,
            }];
            let layout = vk::ImageLayout::GENERAL;
            // SAFETY: see the crate.
            unsafe {
                device.cmd_blit_image(commands, second, layout, plain, layout, &region, vk::Filter::NEAREST);
            }
            recording.download(plain, &target, &[whole(4)]);
        });
        assert_eq!(target.values::<[u8; 4]>(), [texel; 16]);
    }
    // SAFETY: see the crate.
    unsafe {
        one.device().destroy_image(first, None);
        one.device().free_memory(memory, None);
        for (image, memory) in [(second, imported), (plain, plain_memory)] {
            two.device().destroy_image(image, None);
            two.device().free_memory(memory, None);
        }
    }
}

/// A file of `size` bytes of memory with these seals, which is not the driver's.
fn foreign_file(size: u64, seals: SealFlags) -> OwnedFd {
    let file = memfd_create(c"test", MemfdFlags::ALLOW_SEALING).unwrap();
    ftruncate(&file, size).unwrap();
    fcntl_add_seals(&file, seals).unwrap();
    file
}

/// Breaks VUID-VkImportMemoryFdInfoKHR-handleType-00670 and VUID-VkMemoryAllocateInfo-allocationSize-01742.
#[gaurast_runner::test]
fn other_files_are_refused() {
    let gpu = open();
    let sealed = SealFlags::SHRINK | SealFlags::GROW | SealFlags::SEAL;
    let (pipe, _writer) = std::io::pipe().unwrap();
    let (socket, _other) = std::os::unix::net::UnixStream::pair().unwrap();
    let semaphore = semaphore(&gpu, vk::ExternalSemaphoreHandleTypeFlags::OPAQUE_FD, None).unwrap();
    let memory = exportable(&gpu, 8192, MAPPABLE);
    let own = memory_file(&gpu, memory);
    let files: [(&str, OwnedFd, u64); 10] = [
        ("not a file of memory", std::fs::File::open("/dev/null").unwrap().into(), 4096),
        ("not a file of memory", pipe.into(), 4096),
        ("not a file of memory", socket.into(), 4096),
        ("size is not sealed", foreign_file(8192, SealFlags::empty()), 4096),
        ("size is not sealed", foreign_file(8192, SealFlags::GROW), 4096),
        ("bytes in place of", foreign_file(0, sealed), 4096),
        ("another driver", foreign_file(8192, sealed), 4096),
        ("a binary semaphore and not memory", semaphore_file(&gpu, semaphore), 4096),
        ("allocationSize is 8192 and not 8191", own.try_clone().unwrap(), 8191),
        ("allocationSize is 8192 and not 16384", own.try_clone().unwrap(), 16384),
    ];
    let refused = |text: &str, result: Result<vk::DeviceMemory, vk::Result>| {
        assert_eq!(result.unwrap_err(), vk::Result::ERROR_INVALID_EXTERNAL_HANDLE, "{text}");
        let messages = gpu.message_texts().concat();
        assert!(messages.contains(text), "{messages}");
    };
    for (text, file, size) in &files {
        refused(text, import_memory(&gpu, file.as_fd(), *size, MAPPABLE));
    }
    refused("of type 1 and not memory of type 0", import_memory(&gpu, own.as_fd(), 8192, DEVICE_ONLY));
    for fd in [-1, -2, i32::MIN] {
        refused("it is negative", import_memory_of(&gpu, fd, 4096, MAPPABLE));
    }
    refused("not a file of memory", import_memory_of(&gpu, i32::MAX, 4096, MAPPABLE));
    let imported = import_memory(&gpu, own.as_fd(), 8192, MAPPABLE).unwrap();
    // SAFETY: see the crate.
    unsafe {
        gpu.device().free_memory(imported, None);
        gpu.device().free_memory(memory, None);
        gpu.device().destroy_semaphore(semaphore, None);
    }
}

/// Breaks VUID-VkMemoryGetFdInfoKHR-handleType-00671, VUID-VkExportMemoryAllocateInfo-handleTypes-00656,
/// VUID-VkImportMemoryFdInfoKHR-handleType-00667, VUID-vkGetMemoryFdPropertiesKHR-handleType-00674 and
/// VUID-VkBufferCreateInfo-pNext-00920.
#[gaurast_runner::test]
fn what_is_not_shared_is_refused() {
    use vk::ExternalMemoryHandleTypeFlags as Types;
    let gpu = open();
    let commands = ash::khr::external_memory_fd::Device::new(gpu.instance(), gpu.device());
    let memory = allocate(&gpu, 4096, MAPPABLE);
    // SAFETY: see the crate.
    unsafe {
        let info = vk::MemoryGetFdInfoKHR::default().memory(memory).handle_type(Types::OPAQUE_FD);
        assert!(commands.get_memory_fd(&info).is_err());
        assert!(gpu.message_texts().concat().contains("not allocated for export"));
        gpu.device().free_memory(memory, None);
        for types in [Types::DMA_BUF_EXT, Types::HOST_ALLOCATION_EXT, Types::OPAQUE_FD | Types::DMA_BUF_EXT] {
            let mut export = vk::ExportMemoryAllocateInfo::default().handle_types(types);
            let info = vk::MemoryAllocateInfo::default().allocation_size(4096).push_next(&mut export);
            assert!(gpu.device().allocate_memory(&info, None).is_err(), "{types:?}");
        }
        let mut import = vk::ImportMemoryFdInfoKHR::default().handle_type(Types::DMA_BUF_EXT).fd(0);
        let info = vk::MemoryAllocateInfo::default().allocation_size(4096).push_next(&mut import);
        assert!(gpu.device().allocate_memory(&info, None).is_err());
        let mut properties = vk::MemoryFdPropertiesKHR::default();
        for types in [Types::OPAQUE_FD, Types::DMA_BUF_EXT] {
            assert!(commands.get_memory_fd_properties(types, 0, &mut properties).is_err());
        }
        let mut external = vk::ExternalMemoryBufferCreateInfo::default().handle_types(Types::DMA_BUF_EXT);
        let info = vk::BufferCreateInfo::default().size(64).usage(vk::BufferUsageFlags::TRANSFER_SRC);
        assert!(gpu.device().create_buffer(&info.push_next(&mut external), None).is_err());
    }
    assert_eq!(gpu.message_texts().len(), 7);
}

#[gaurast_runner::test]
fn queries_say_what_memory_can_be_shared() {
    use vk::ExternalMemoryFeatureFlags as Features;
    use vk::ExternalMemoryHandleTypeFlags as Types;
    let gpu = open();
    let both = Features::EXPORTABLE | Features::IMPORTABLE;
    for (handle_type, features, exported) in [
        (Types::OPAQUE_FD, both, Types::OPAQUE_FD),
        (Types::HOST_ALLOCATION_EXT, Features::IMPORTABLE, Types::empty()),
        (Types::HOST_MAPPED_FOREIGN_MEMORY_EXT, Features::empty(), Types::empty()),
        (Types::DMA_BUF_EXT, Features::empty(), Types::empty()),
        (Types::OPAQUE_WIN32, Features::empty(), Types::empty()),
    ] {
        let expected = vk::ExternalMemoryProperties {
            external_memory_features: features,
            export_from_imported_handle_types: exported,
            compatible_handle_types: if features.is_empty() { Types::empty() } else { handle_type },
        };
        let same = |found: vk::ExternalMemoryProperties| {
            assert_eq!(found.external_memory_features, expected.external_memory_features, "{handle_type:?}");
            assert_eq!(found.export_from_imported_handle_types, expected.export_from_imported_handle_types);
            assert_eq!(found.compatible_handle_types, expected.compatible_handle_types, "{handle_type:?}");
        };
        let info = vk::PhysicalDeviceExternalBufferInfo::default()
            .usage(vk::BufferUsageFlags::TRANSFER_SRC)
            .handle_type(handle_type);
        let mut found = vk::ExternalBufferProperties::default();
        let mut external = vk::PhysicalDeviceExternalImageFormatInfo::default().handle_type(handle_type);
        let image = vk::PhysicalDeviceImageFormatInfo2::default()
            .format(vk::Format::R8G8B8A8_UNORM)
            .ty(vk::ImageType::TYPE_2D)
            .tiling(vk::ImageTiling::OPTIMAL)
            .usage(vk::ImageUsageFlags::SAMPLED)
            .push_next(&mut external);
        let mut of_image = vk::ExternalImageFormatProperties::default();
        let mut properties = vk::ImageFormatProperties2::default().push_next(&mut of_image);
        let (instance, device) = (gpu.instance(), gpu.physical_device());
        // SAFETY: see the crate.
        unsafe {
            instance.get_physical_device_external_buffer_properties(device, &info, &mut found);
            same(found.external_memory_properties);
            let result = instance.get_physical_device_image_format_properties2(device, &image, &mut properties);
            let unsupported = Err(vk::Result::ERROR_FORMAT_NOT_SUPPORTED);
            assert_eq!(result, if features.is_empty() { unsupported } else { Ok(()) });
            same(of_image.external_memory_properties);
        }
    }
}

/// Pages of the application's own.
struct Pages {
    start: *mut std::ffi::c_void,
    size: usize,
}

impl Pages {
    fn new(size: usize) -> Self {
        let (readable, private) = (mm::ProtFlags::READ | mm::ProtFlags::WRITE, mm::MapFlags::PRIVATE);
        // SAFETY: the host chooses the place.
        let start = unsafe { mm::mmap_anonymous(std::ptr::null_mut(), size, readable, private) }.unwrap();
        Self { start, size }
    }

    fn texels(&self) -> Vec<[u8; 4]> {
        // SAFETY: the pages are mapped, and the device is idle.
        unsafe { std::slice::from_raw_parts(self.start.cast::<[u8; 4]>(), self.size / 4).to_vec() }
    }
}

impl Drop for Pages {
    fn drop(&mut self) {
        // SAFETY: nothing uses the pages any more.
        unsafe { mm::munmap(self.start, self.size) }.unwrap();
    }
}

fn import_host(
    gpu: &Gpu,
    pointer: *mut std::ffi::c_void,
    size: u64,
    memory_type: u32,
) -> Result<vk::DeviceMemory, vk::Result> {
    let mut import = vk::ImportMemoryHostPointerInfoEXT::default()
        .handle_type(vk::ExternalMemoryHandleTypeFlags::HOST_ALLOCATION_EXT)
        .host_pointer(pointer);
    let info =
        vk::MemoryAllocateInfo::default().allocation_size(size).memory_type_index(memory_type).push_next(&mut import);
    // SAFETY: see the crate.
    unsafe { gpu.device().allocate_memory(&info, None) }
}

#[gaurast_runner::test]
fn the_device_draws_into_memory_of_the_application() {
    let gpu = open();
    let pages = Pages::new(3 * 4096);
    let commands = ash::ext::external_memory_host::Device::new(gpu.instance(), gpu.device());
    let handle_type = vk::ExternalMemoryHandleTypeFlags::HOST_ALLOCATION_EXT;
    // SAFETY: see the crate.
    unsafe {
        let mut found = vk::MemoryHostPointerPropertiesEXT::default();
        let query = commands.fp().get_memory_host_pointer_properties_ext;
        query(gpu.device().handle(), handle_type, pages.start, &raw mut found).result().unwrap();
        assert_eq!(found.memory_type_bits, 1 << MAPPABLE);
        // The page between two others.
        let memory = import_host(&gpu, pages.start.byte_add(4096), 4096, MAPPABLE).unwrap();
        let mut external = vk::ExternalMemoryImageCreateInfo::default().handle_types(handle_type);
        let info = image_info(vk::Format::R8G8B8A8_UNORM, 32).tiling(vk::ImageTiling::LINEAR);
        let image = gpu.device().create_image(&info.push_next(&mut external), None).unwrap();
        gpu.device().bind_image_memory(image, memory, 0).unwrap();
        become_general(&gpu, image);
        gpu.run(|recording| {
            let (device, commands) = recording.raw();
            let color = vk::ClearColorValue { float32: [0.2, 0.4, 0.6, 1.0] };
            device.cmd_clear_color_image(commands, image, vk::ImageLayout::GENERAL, &color, &[COLOR]);
        });
        let texels = pages.texels();
        assert_eq!(texels[1024..2048], [[51, 102, 153, 255]; 1024]);
        assert_eq!((&texels[..1024], &texels[2048..]), ([[0; 4]; 1024].as_slice(), [[0; 4]; 1024].as_slice()));
        // What the application writes is the device's.
        pages.start.byte_add(4096).cast::<u32>().write_volatile(7);
        let mapped = gpu.device().map_memory(memory, 0, 4, vk::MemoryMapFlags::empty()).unwrap();
        assert_eq!(mapped, pages.start.byte_add(4096));
        gpu.device().unmap_memory(memory);
        let target = Buffer::new(&gpu, 4096);
        gpu.run(|recording| recording.download(image, &target, &[whole(32)]));
        assert_eq!(target.values::<u32>()[..2], [7, u32::from_le_bytes([51, 102, 153, 255])]);
        gpu.device().destroy_image(image, None);
        gpu.device().free_memory(memory, None);
    }
    assert_eq!(pages.texels()[1025], [51, 102, 153, 255], "it is still the application's");
}

/// Breaks VUID-VkImportMemoryHostPointerInfoEXT-pHostPointer-01749, VUID-VkMemoryAllocateInfo-allocationSize-01745,
/// VUID-VkMemoryAllocateInfo-memoryTypeIndex-01744 and VUID-VkImportMemoryHostPointerInfoEXT-handleType-01750.
#[gaurast_runner::test]
fn wrong_host_pointers_are_refused() {
    let gpu = open();
    let pages = Pages::new(2 * 4096);
    let refused = |pointer, size, memory_type, text: &str| {
        assert!(import_host(&gpu, pointer, size, memory_type).is_err(), "{text}");
        let messages = gpu.message_texts().concat();
        assert!(messages.contains(text), "{messages}");
    };
    // SAFETY: the pointers are inside the pages.
    unsafe {
        refused(pages.start.byte_add(64), 4096, MAPPABLE, "not aligned to 4096");
        refused(pages.start, 4095, MAPPABLE, "not a multiple of 4096");
    }
    refused(pages.start, 4096, DEVICE_ONLY, "not host-visible");
    refused(std::ptr::null_mut(), 4096, MAPPABLE, "it is null");
    // The host maps nothing at the lowest addresses.
    refused(std::ptr::without_provenance_mut(4096), 4096, MAPPABLE, "cannot be imported");
    let mut all = vk::PhysicalDeviceExternalMemoryHostPropertiesEXT::default();
    let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut all);
    // SAFETY: see the crate.
    unsafe { gpu.instance().get_physical_device_properties2(gpu.physical_device(), &mut properties) };
    assert_eq!(all.min_imported_host_pointer_alignment, 4096);
}

/// The variable of the environment by which a child finds the file of the memory.
const FILE: &str = "GAURAST_TEST_MEMORY_FILE";

/// A child writes through its own device, and then tries whatever could hurt the parent.
#[gaurast_runner::test]
fn processes_share_memory_and_survive_each_other(case: &Case) {
    if std::env::var_os(FILE).is_some() {
        return misbehave();
    }
    let gpu = open();
    let memory = exportable(&gpu, SIZE, MAPPABLE);
    let buffer = buffer_in(&gpu, memory, SIZE);
    fill(&gpu, buffer, 3);
    let (_file, number) = inheritable(memory_file(&gpu, memory));
    case.run_alone(|command| {
        command.env(FILE, &number);
    });
    assert_eq!(words_of(&gpu, buffer, SIZE), [4; 2500], "the child has written");
    fill(&gpu, buffer, 5);
    assert_eq!(words_of(&gpu, buffer, SIZE), [5; 2500], "no page is missing");
    // The label is spoiled, so nobody imports the file any more.
    let error = import_memory(&gpu, memory_file(&gpu, memory).as_fd(), SIZE, MAPPABLE).unwrap_err();
    assert_eq!(error, vk::Result::ERROR_INVALID_EXTERNAL_HANDLE);
    free(&gpu, buffer, memory);
}

/// The work of the child process.
fn misbehave() {
    let file = inherited(FILE);
    let gpu = open();
    let memory = import_memory(&gpu, file.as_fd(), SIZE, MAPPABLE).unwrap();
    let buffer = buffer_in(&gpu, memory, SIZE);
    assert_eq!(words_of(&gpu, buffer, SIZE), [3; 2500]);
    for size in [SIZE - 1, SIZE + 1, u64::MAX / 2] {
        assert!(import_memory(&gpu, file.as_fd(), size, MAPPABLE).is_err());
    }
    fill(&gpu, buffer, 4);
    for size in [0, 1 << 20] {
        assert!(ftruncate(&file, size).is_err());
    }
    assert!(fcntl_add_seals(&file, SealFlags::WRITE).is_err());
    let end = rustix::fs::fstat(&file).unwrap().st_size.unsigned_abs();
    rustix::io::pwrite(&file, &[0xff; 4096], end - 4096).unwrap();
    // The memory is not freed, and the process ends.
}
