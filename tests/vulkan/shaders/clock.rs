//! The clocks of shaders.

use gaurast_testkit::shader::GLSLANG;
use gaurast_testkit::{Bindings, Buffer, Gpu, Kernel, Resource};

use ash::vk;

/// Each invocation reads the clock of its subgroup and that of the device in turn, as words and as numbers of 64 bits.
#[gaurast_runner::test(needs = [GLSLANG])]
fn clocks_never_go_back() {
    const LANES: usize = 64;
    const READS: usize = 6;
    let mut features =
        vk::PhysicalDeviceShaderClockFeaturesKHR::default().shader_subgroup_clock(true).shader_device_clock(true);
    let gpu = Gpu::extended(&[ash::khr::shader_clock::NAME], &mut features).expect("a device");
    let times = Buffer::new(&gpu, (8 * LANES * READS) as u64);
    let bindings = Bindings::new(&gpu, &[Resource::Storage(times.raw)]);
    let source = format!(
        "#extension GL_ARB_gpu_shader_int64 : require
        #extension GL_ARB_shader_clock : require
        #extension GL_EXT_shader_realtime_clock : require
        layout(local_size_x = {LANES}) in;
        layout(binding = 0) buffer Times {{ uint64_t times[]; }};
        void main() {{
            uint first = {READS} * gl_LocalInvocationIndex;
            times[first] = packUint2x32(clock2x32ARB());
            times[first + 1] = packUint2x32(clockRealtime2x32EXT());
            times[first + 2] = clockARB();
            times[first + 3] = clockRealtimeEXT();
            for (uint at = 4; at < {READS}; at++)
                times[first + at] = clockARB();
        }}"
    );
    let kernel = Kernel::new(&gpu, &source, &bindings);
    kernel.run(&[bindings.set], &[], [1, 1, 1]);
    let earlier: Vec<u64> = bytemuck::pod_collect_to_vec(&times.read());
    kernel.run(&[bindings.set], &[], [1, 1, 1]);
    let later: Vec<u64> = bytemuck::pod_collect_to_vec(&times.read());
    for times in [&earlier, &later] {
        for times in times.as_chunks::<READS>().0 {
            assert!(times.is_sorted(), "{times:?}");
            assert!(times[0] < times[READS - 1], "time passes");
        }
    }
    assert!(earlier.iter().max() < later.iter().min(), "a clock of the device");
}
