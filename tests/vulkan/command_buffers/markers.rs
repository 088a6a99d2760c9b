//! Debug markers, which do nothing.

use ash::vk;
use ash::vk::Handle;
use gaurast_testkit::{Buffer, Driver, Gpu, Opening};

#[expect(deprecated, reason = "applications still use the older extension")]
#[gaurast_runner::test]
fn markers_and_names_do_nothing() {
    let opening = Opening { extensions: &[ash::ext::debug_marker::NAME], ..Opening::of(Driver::Embedded) };
    let gpu = Gpu::open(&opening).expect("a device");
    let markers = ash::ext::debug_marker::Device::new(gpu.instance(), gpu.device());
    let buffer = Buffer::new(&gpu, 4);
    // SAFETY: see the crate.
    unsafe {
        let name = vk::DebugMarkerObjectNameInfoEXT::default()
            .object_type(vk::DebugReportObjectTypeEXT::BUFFER)
            .object(buffer.raw.as_raw())
            .object_name(c"a buffer");
        assert_eq!(markers.debug_marker_set_object_name(&name), Ok(()));
        let tag = vk::DebugMarkerObjectTagInfoEXT::default()
            .object_type(vk::DebugReportObjectTypeEXT::BUFFER)
            .object(buffer.raw.as_raw())
            .tag(&[1, 2, 3]);
        let set_tag = markers.fp().debug_marker_set_object_tag_ext;
        assert_eq!(set_tag(gpu.device().handle(), &raw const tag), vk::Result::SUCCESS);
    }
    gpu.run(|commands| {
        let (device, raw) = commands.raw();
        let marker = vk::DebugMarkerMarkerInfoEXT::default().marker_name(c"a marker");
        // SAFETY: see the crate.
        unsafe {
            markers.cmd_debug_marker_begin(raw, &marker);
            device.cmd_fill_buffer(raw, buffer.raw, 0, 4, 7);
            markers.cmd_debug_marker_insert(raw, &marker);
            markers.cmd_debug_marker_end(raw);
        }
        commands.barrier();
    });
    assert_eq!(buffer.values::<u32>(), [7]);
    assert_eq!(gpu.message_texts(), [""; 0]);
}
