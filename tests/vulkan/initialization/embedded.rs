//! Tests of the embedded driver's entry.

use ash::vk;
use gaurast::gaussian_primitive_topology;
use gaurast::vk::{
    PhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST, PhysicalDeviceGaussianPrimitiveTopologyPropertiesGAURAST,
};
use gaurast_testkit::context::{Context, everything};
use gaurast_testkit::{Message, Messages};
use std::ffi::{CStr, c_char, c_void};
use std::sync::Mutex;

#[gaurast_runner::test]
fn a_device_is_created_used_and_destroyed() {
    let context = Context::embedded(&[]);
    let mut gaussian =
        PhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST::default().gaussian_primitive_topology(true);
    let mut vulkan13 = vk::PhysicalDeviceVulkan13Features::default().dynamic_rendering(true).synchronization2(true);
    let mut features = vk::PhysicalDeviceFeatures2::default().push_next(&mut gaussian).push_next(&mut vulkan13);
    let device = context.device(&[gaussian_primitive_topology::NAME], &mut features).unwrap();
    // SAFETY: the device is live, and destroyed last.
    unsafe {
        let queue = device.get_device_queue(0, 0);
        assert_ne!(queue, vk::Queue::null());
        let info = vk::DeviceQueueInfo2::default();
        assert_eq!(device.get_device_queue2(&info), queue);
        assert_eq!(device.get_device_queue(7, 0), vk::Queue::null());
        device.destroy_device(None);
    }
}

#[gaurast_runner::test]
fn the_device_says_what_it_is() {
    let context = Context::embedded(&[]);
    // SAFETY: the instance is live.
    let version = unsafe { context.entry.try_enumerate_instance_version() }.unwrap();
    assert!(version >= Some(vk::API_VERSION_1_3));

    let mut gaussian = PhysicalDeviceGaussianPrimitiveTopologyPropertiesGAURAST::default();
    let mut driver = vk::PhysicalDeviceDriverProperties::default();
    let mut vulkan11 = vk::PhysicalDeviceVulkan11Properties::default();
    let mut properties = vk::PhysicalDeviceProperties2::default()
        .push_next(&mut gaussian)
        .push_next(&mut driver)
        .push_next(&mut vulkan11);
    // SAFETY: the physical device is the instance's, and the chain is valid.
    unsafe {
        context.instance.get_physical_device_properties2(context.physical_device, &mut properties);
    }
    let properties = properties.properties;
    assert_eq!(properties.device_type, vk::PhysicalDeviceType::CPU);
    assert_eq!(properties.device_name_as_c_str().unwrap(), c"GauRast simulated device");
    assert_eq!(driver.driver_name_as_c_str().unwrap(), c"GauRast");
    assert_eq!(driver.conformance_version.major, 0);
    assert!(properties.limits.max_vertex_input_attributes >= 32);
    assert!(properties.limits.max_vertex_input_bindings >= 32);
    assert_eq!(properties.limits.max_image_dimension2_d, 16384);
    assert_ne!(vulkan11.device_uuid, [0; 16]);
    assert!(vulkan11.max_memory_allocation_size >= 1 << 30);
    assert_eq!(gaussian.tile_size, vk::Extent2D { width: 16, height: 16 });
    assert_eq!(gaussian.max_spherical_harmonics_degree, 4);
}

#[gaurast_runner::test]
fn memory_can_be_hidden_from_the_host_or_shared_with_it() {
    let context = Context::embedded(&[]);
    // SAFETY: the physical device is the instance's.
    let memory = unsafe { context.instance.get_physical_device_memory_properties(context.physical_device) };
    let types: Vec<_> = memory.memory_types_as_slice().iter().map(|memory_type| memory_type.property_flags).collect();
    let shared = vk::MemoryPropertyFlags::DEVICE_LOCAL
        | vk::MemoryPropertyFlags::HOST_VISIBLE
        | vk::MemoryPropertyFlags::HOST_COHERENT;
    assert!(types.contains(&vk::MemoryPropertyFlags::DEVICE_LOCAL));
    assert!(types.iter().any(|flags| flags.contains(shared)));
    assert!(memory.memory_heaps_as_slice()[0].size >= 1 << 30);
}

#[gaurast_runner::test]
fn what_is_not_there_is_refused() {
    let heard = Messages::default();
    let context = Context::embedded(&[ash::ext::debug_utils::NAME]);
    let debug = ash::ext::debug_utils::Instance::new(&context.entry, &context.instance);
    // SAFETY: `heard` outlives the messenger.
    let messenger = unsafe { debug.create_debug_utils_messenger(&everything(&heard), None) }.unwrap();

    let refusal = |extensions: &[&CStr], features: &mut vk::PhysicalDeviceFeatures2<'_>| {
        let error = context.device(extensions, features).err();
        (error, heard.take())
    };
    let (error, messages) = refusal(&[c"VK_EXT_mesh_shader"], &mut Default::default());
    assert_eq!(error, Some(vk::Result::ERROR_EXTENSION_NOT_PRESENT));
    assert!(messages.iter().any(|message| message.text.contains("VK_EXT_mesh_shader")), "{messages:?}");

    let mut features = vk::PhysicalDeviceFeatures2::default();
    features.features.sparse_residency16_samples = vk::TRUE;
    let (error, messages) = refusal(&[], &mut features);
    assert_eq!(error, Some(vk::Result::ERROR_FEATURE_NOT_PRESENT));
    assert_eq!(messages.len(), 1, "{messages:?}");
    let Message { id, text } = &messages[0];
    assert_eq!(id, "GAURAST-error");
    assert!(text.contains("vkCreateDevice") && text.contains("sparseResidency16Samples"), "{text}");

    let mut chained = vk::PhysicalDeviceVulkan13Features::default().texture_compression_astc_hdr(true);
    let (error, _) = refusal(
        &[gaussian_primitive_topology::NAME],
        &mut vk::PhysicalDeviceFeatures2::default().push_next(&mut chained),
    );
    assert_eq!(error, Some(vk::Result::ERROR_FEATURE_NOT_PRESENT));

    // SAFETY: the messenger is live and not used again.
    unsafe { debug.destroy_debug_utils_messenger(messenger, None) };
    let (error, messages) = refusal(&[c"VK_EXT_mesh_shader"], &mut Default::default());
    assert!(error.is_some() && messages.is_empty());
}

#[gaurast_runner::test]
fn an_instance_refuses_what_it_lacks_and_says_so() {
    let entry = vulkan_gaurast::entry();
    let heard = Messages::default();
    let mut messenger = everything(&heard);
    let names = [c"VK_KHR_xcb_surface".as_ptr()];
    let info = vk::InstanceCreateInfo::default().enabled_extension_names(&names).push_next(&mut messenger);
    // SAFETY: the creation info is valid.
    let error = unsafe { entry.create_instance(&info, None) }.err();
    assert_eq!(error, Some(vk::Result::ERROR_EXTENSION_NOT_PRESENT));
    assert!(heard.take().iter().any(|message| message.text.contains("VK_KHR_xcb_surface")));

    let names = [c"VK_LAYER_KHRONOS_validation".as_ptr()];
    let info = vk::InstanceCreateInfo::default().enabled_layer_names(&names);
    // SAFETY: the creation info is valid.
    let error = unsafe { entry.create_instance(&info, None) }.err();
    assert_eq!(error, Some(vk::Result::ERROR_LAYER_NOT_PRESENT));
}

/// A report that a callback of `VK_EXT_debug_report` received: its flags, object, location, code, prefix and text.
type Report = (vk::DebugReportFlagsEXT, u64, usize, i32, String, String);

unsafe extern "system" fn hear_report(
    flags: vk::DebugReportFlagsEXT,
    _object_type: vk::DebugReportObjectTypeEXT,
    object: u64,
    location: usize,
    message_code: i32,
    layer_prefix: *const c_char,
    message: *const c_char,
    user_data: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: the caller passes valid strings, and the user data of `listening`.
    let (texts, heard) = unsafe {
        let text = |text| CStr::from_ptr(text).to_string_lossy().into_owned();
        let texts = [layer_prefix, message].map(text);
        (texts, &*user_data.cast::<Mutex<Vec<Report>>>())
    };
    let [prefix, text] = texts;
    let mut heard = heard.lock().unwrap();
    heard.push((flags, object, location, message_code, prefix, text));
    vk::FALSE
}

/// Creation info of a callback that stores reports of these kinds.
fn listening(heard: &Mutex<Vec<Report>>, flags: vk::DebugReportFlagsEXT) -> vk::DebugReportCallbackCreateInfoEXT<'_> {
    vk::DebugReportCallbackCreateInfoEXT::default()
        .flags(flags)
        .pfn_callback(Some(hear_report))
        .user_data(std::ptr::from_ref(heard).cast_mut().cast())
}

#[gaurast_runner::test]
fn report_callbacks_hear_the_driver_and_the_application() {
    use ash::ext::debug_report;
    use vk::DebugReportFlagsEXT as Flags;
    let (errors, all) = (Mutex::default(), Mutex::default());
    let context = Context::embedded(&[debug_report::NAME]);
    let reports = debug_report::Instance::new(&context.entry, &context.instance);
    // ash's own methods are deprecated, as the extension is.
    let (reports, instance) = (reports.fp(), context.instance.handle());
    let create = |heard, flags| {
        let mut callback = vk::DebugReportCallbackEXT::null();
        let info = listening(heard, flags);
        // SAFETY: what is heard outlives the callback.
        let result = unsafe {
            (reports.create_debug_report_callback_ext)(instance, &raw const info, std::ptr::null(), &raw mut callback)
        };
        assert_eq!(result, vk::Result::SUCCESS);
        callback
    };
    // SAFETY: the callback is null, or live and not used again.
    let destroy = |callback| unsafe {
        (reports.destroy_debug_report_callback_ext)(instance, callback, std::ptr::null());
    };
    let taken = |heard: &Mutex<Vec<Report>>| std::mem::take(&mut *heard.lock().unwrap());
    let refuse = || {
        let device = context.device(&[c"VK_EXT_mesh_shader"], &mut Default::default());
        assert!(device.is_err());
    };

    let of_errors = create(&errors, Flags::ERROR);
    let everything = Flags::ERROR | Flags::WARNING | Flags::INFORMATION | Flags::DEBUG;
    let of_all = create(&all, everything);
    refuse();
    let heard = taken(&errors);
    assert_eq!(heard, taken(&all));
    let (flags, _, _, _, prefix, text) = &heard[0];
    assert_eq!((*flags, prefix.as_str()), (Flags::ERROR, "GAURAST-error"));
    assert!(text.contains("vkCreateDevice") && text.contains("VK_EXT_mesh_shader"), "{text}");

    // SAFETY: the strings are valid.
    unsafe {
        (reports.debug_report_message_ext)(
            instance,
            Flags::WARNING,
            vk::DebugReportObjectTypeEXT::BUFFER,
            7,
            8,
            -9,
            c"test".as_ptr(),
            c"hello".as_ptr(),
        );
    }
    let sent = (Flags::WARNING, 7, 8, -9, "test".to_owned(), "hello".to_owned());
    assert_eq!((taken(&errors), taken(&all)), (vec![], vec![sent]));

    destroy(of_errors);
    destroy(vk::DebugReportCallbackEXT::null());
    refuse();
    assert!(taken(&errors).is_empty() && !taken(&all).is_empty());
    destroy(of_all);
    refuse();
    assert!(taken(&all).is_empty());

    let mut callback = listening(&errors, Flags::ERROR);
    let names = [c"VK_KHR_xcb_surface".as_ptr()];
    let info = vk::InstanceCreateInfo::default().enabled_extension_names(&names).push_next(&mut callback);
    // SAFETY: the creation info is valid.
    let error = unsafe { context.entry.create_instance(&info, None) }.err();
    assert_eq!(error, Some(vk::Result::ERROR_EXTENSION_NOT_PRESENT));
    assert!(taken(&errors)[0].5.contains("VK_KHR_xcb_surface"));
}

#[gaurast_runner::test]
fn applications_may_send_messages() {
    let heard = Messages::default();
    let context = Context::embedded(&[ash::ext::debug_utils::NAME]);
    let debug = ash::ext::debug_utils::Instance::new(&context.entry, &context.instance);
    let data = vk::DebugUtilsMessengerCallbackDataEXT::default().message_id_name(c"test").message(c"hello");
    // SAFETY: `heard` outlives the messenger, and the message is valid.
    unsafe {
        let messenger = debug.create_debug_utils_messenger(&everything(&heard), None).unwrap();
        debug.submit_debug_utils_message(
            vk::DebugUtilsMessageSeverityFlagsEXT::INFO,
            vk::DebugUtilsMessageTypeFlagsEXT::GENERAL,
            &data,
        );
        debug.destroy_debug_utils_messenger(messenger, None);
    }
    let expected = Message { id: "test".to_owned(), text: "hello".to_owned() };
    assert_eq!(heard.take(), [expected]);
}

#[gaurast_runner::test]
fn device_commands_appear_with_their_extension() {
    let context = Context::embedded(&[]);
    let found = |device: &ash::Device, name: &CStr| {
        // SAFETY: the device is live.
        unsafe { context.instance.get_device_proc_addr(device.handle(), name.as_ptr()) }.is_some()
    };
    let set_camera = c"vkCmdSetGaussianCamerasGAURAST";
    let bare = context.device(&[], &mut Default::default()).unwrap();
    assert!(!found(&bare, set_camera));
    assert!(!found(&bare, c"vkCreateDevice"));
    assert!(found(&bare, c"vkCmdDraw"));
    let extended = context.device(&[gaussian_primitive_topology::NAME], &mut Default::default()).unwrap();
    assert!(found(&extended, set_camera));
    // SAFETY: the devices are live and not used again.
    unsafe {
        bare.destroy_device(None);
        extended.destroy_device(None);
    }
}

#[gaurast_runner::test]
fn enumeration_may_be_cut_short() {
    let context = Context::embedded(&[]);
    let enumerate = context.instance.fp_v1_0().enumerate_device_extension_properties;
    let mut count = 1;
    let mut extensions = [vk::ExtensionProperties::default(); 2];
    // SAFETY: the array is large enough for `count` extensions.
    let result = unsafe { enumerate(context.physical_device, std::ptr::null(), &mut count, extensions.as_mut_ptr()) };
    assert_eq!((result, count), (vk::Result::INCOMPLETE, 1));
    assert_eq!(extensions[0].extension_name_as_c_str().unwrap(), gaussian_primitive_topology::NAME);
    assert_eq!(extensions[1].extension_name_as_c_str().unwrap(), c"");
}

#[gaurast_runner::test]
fn counters_are_enumerated_with_their_descriptions() {
    let context = Context::embedded(&[]);
    let performance = ash::khr::performance_query::Instance::new(&context.entry, &context.instance);
    // SAFETY: the physical device is the instance's.
    let count = unsafe {
        performance.enumerate_physical_device_queue_family_performance_query_counters_len(context.physical_device, 0)
    }
    .unwrap();
    assert!(count > 10);
    let mut counters = vec![vk::PerformanceCounterKHR::default(); count];
    let mut descriptions = vec![vk::PerformanceCounterDescriptionKHR::default(); count];
    // SAFETY: the arrays have as many elements as there are counters.
    unsafe {
        performance.enumerate_physical_device_queue_family_performance_query_counters(
            context.physical_device,
            0,
            &mut counters,
            &mut descriptions,
        )
    }
    .unwrap();
    let names: Vec<_> = descriptions.iter().map(|d| d.name_as_c_str().unwrap()).collect();
    assert!(names.contains(&c"gaussians drawn"), "{names:?}");
    assert!(counters.iter().all(|c| c.storage == vk::PerformanceCounterStorageKHR::UINT64));
}

/// A device with the features of Vulkan 1.2 and 1.3 that tests below use.
fn device_with_core_features(context: &Context) -> ash::Device {
    let mut vulkan12 = vk::PhysicalDeviceVulkan12Features::default().timeline_semaphore(true).host_query_reset(true);
    let mut vulkan13 = vk::PhysicalDeviceVulkan13Features::default().private_data(true);
    let mut features = vk::PhysicalDeviceFeatures2::default().push_next(&mut vulkan12).push_next(&mut vulkan13);
    context.device(&[], &mut features).unwrap()
}

#[gaurast_runner::test]
fn timelines_are_signalled_by_host_and_queue() {
    let context = Context::embedded(&[]);
    let device = device_with_core_features(&context);
    let mut timeline =
        vk::SemaphoreTypeCreateInfo::default().semaphore_type(vk::SemaphoreType::TIMELINE).initial_value(3);
    let info = vk::SemaphoreCreateInfo::default().push_next(&mut timeline);
    // SAFETY: the device is live, and destroyed last; the semaphore is idle when it is destroyed.
    unsafe {
        let semaphore = device.create_semaphore(&info, None).unwrap();
        assert_eq!(device.get_semaphore_counter_value(semaphore), Ok(3));
        let semaphores = [semaphore];
        let wait = |value, timeout| {
            let values = [value];
            let info = vk::SemaphoreWaitInfo::default().semaphores(&semaphores).values(&values);
            device.wait_semaphores(&info, timeout)
        };
        assert_eq!(wait(3, 0), Ok(()));
        assert_eq!(wait(4, 1000), Err(vk::Result::TIMEOUT));

        // The queue waits for a value that the host signals later.
        let (wait_values, signal_values) = ([4], [7]);
        let mut values = vk::TimelineSemaphoreSubmitInfo::default()
            .wait_semaphore_values(&wait_values)
            .signal_semaphore_values(&signal_values);
        let submit = vk::SubmitInfo::default()
            .wait_semaphores(&semaphores)
            .wait_dst_stage_mask(&[vk::PipelineStageFlags::ALL_COMMANDS])
            .signal_semaphores(&semaphores)
            .push_next(&mut values);
        let queue = device.get_device_queue(0, 0);
        device.queue_submit(queue, &[submit], vk::Fence::null()).unwrap();
        let signal = vk::SemaphoreSignalInfo::default().semaphore(semaphore).value(4);
        device.signal_semaphore(&signal).unwrap();
        assert_eq!(wait(7, u64::MAX), Ok(()));
        device.queue_wait_idle(queue).unwrap();
        device.destroy_semaphore(semaphore, None);
        device.destroy_device(None);
    }
}

#[gaurast_runner::test]
fn private_data_is_kept_per_object_and_slot() {
    let context = Context::embedded(&[]);
    let device = device_with_core_features(&context);
    let info = vk::PrivateDataSlotCreateInfo::default();
    // SAFETY: the device is live, and destroyed last.
    unsafe {
        let slots = [(); 2].map(|()| device.create_private_data_slot(&info, None).unwrap());
        let queue = device.get_device_queue(0, 0);
        device.set_private_data(queue, slots[0], 5).unwrap();
        device.set_private_data(device.handle(), slots[0], 6).unwrap();
        assert_eq!(device.get_private_data(queue, slots[0]), 5);
        assert_eq!(device.get_private_data(device.handle(), slots[0]), 6);
        assert_eq!(device.get_private_data(queue, slots[1]), 0);
        for slot in slots {
            device.destroy_private_data_slot(slot, None);
        }
        device.destroy_device(None);
    }
}

/// A command that is not implemented yet fails with a message. It neither aborts nor does something else.
#[gaurast_runner::test]
fn core_commands_that_do_not_work_yet_fail() {
    let heard = Messages::default();
    let context = Context::embedded(&[ash::ext::debug_utils::NAME]);
    let debug = ash::ext::debug_utils::Instance::new(&context.entry, &context.instance);
    let device = context.device(&[], &mut Default::default()).unwrap();
    // SAFETY: everything is destroyed after its last use.
    unsafe {
        let messenger = debug.create_debug_utils_messenger(&everything(&heard), None).unwrap();
        let queue = device.get_device_queue(0, 0);
        let error = device.queue_bind_sparse(queue, &[], vk::Fence::null()).err();
        assert_eq!(error, Some(vk::Result::ERROR_FEATURE_NOT_PRESENT));
        let messages = heard.take();
        assert_eq!(messages[0].id, "GAURAST-unsupported-command");
        assert!(messages[0].text.contains("vkQueueBindSparse"), "{messages:?}");
        debug.destroy_debug_utils_messenger(messenger, None);
        device.destroy_device(None);
    }
}
