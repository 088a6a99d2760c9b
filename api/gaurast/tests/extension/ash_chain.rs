//! Tests that the extension's structures chain to ash's own, and that its command is loaded and called as ash's are.

use std::ffi::{CStr, c_char, c_void};
use std::sync::Mutex;

use ash::vk::{self, Handle, TaggedStructure};
use gaurast::gaussian_primitive_topology;
use gaurast::vk::*;

/// The structure of type `T` that follows `p_next` directly.
fn next<'a, T: TaggedStructure>(p_next: *const c_void) -> &'a T {
    let base = p_next.cast::<vk::BaseInStructure<'_>>();
    assert!(!base.is_null());
    // SAFETY: the tests keep what they chain alive, and every chained structure starts as
    // `BaseInStructure` does.
    assert_eq!(unsafe { (*base).s_type }, T::STRUCTURE_TYPE);
    // SAFETY: the structure type says that it is a `T`.
    unsafe { &*p_next.cast::<T>() }
}

#[gaurast_runner::test]
fn features_chain_to_query_and_device_creation() {
    let mut asked = PhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST::default();
    let query = vk::PhysicalDeviceFeatures2::default().push_next(&mut asked);
    let found: &PhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST<'_> = next(query.p_next);
    assert_eq!(found.gaussian_primitive_topology, vk::FALSE);

    let mut enabled = PhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST::default()
        .gaussian_primitive_topology(true)
        .merged_draws(true);
    let mut core = vk::PhysicalDeviceVulkan12Features::default();
    let create_info = vk::DeviceCreateInfo::default().push_next(&mut core).push_next(&mut enabled);
    let found: &PhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST<'_> = next(create_info.p_next);
    assert_eq!(found.gaussian_primitive_topology, vk::TRUE);
    assert_eq!(found.merged_draws, vk::TRUE);
    assert_eq!(found.gaussian_2d, vk::FALSE);
    let _: &vk::PhysicalDeviceVulkan12Features<'_> = next(found.p_next);
}

#[gaurast_runner::test]
fn properties_chain_to_the_query() {
    let mut asked = PhysicalDeviceGaussianPrimitiveTopologyPropertiesGAURAST::default();
    let query = vk::PhysicalDeviceProperties2::default().push_next(&mut asked);
    let found: &PhysicalDeviceGaussianPrimitiveTopologyPropertiesGAURAST<'_> = next(query.p_next);
    assert_eq!(found.max_gaussians_per_draw, 0);
}

#[gaurast_runner::test]
fn pipeline_state_chains_with_the_defaults_of_3dgs() {
    let mut state = PipelineGaussianStateCreateInfoGAURAST::default()
        .spherical_harmonics_degree(3)
        .attribute_locations(GaussianAttributeLocationsGAURAST::default().position(7));
    let create_info = vk::GraphicsPipelineCreateInfo::default().push_next(&mut state);
    let found: &PipelineGaussianStateCreateInfoGAURAST<'_> = next(create_info.p_next);
    assert_eq!(found.spherical_harmonics_degree, 3);
    assert_eq!(found.attribute_locations.position, 7);
    assert_eq!(found.attribute_locations.opacity, GAUSSIAN_LOCATION_UNUSED_GAURAST);
    assert_eq!(found.projection_mode, GaussianProjectionModeGAURAST::FIXED_FUNCTION);
    assert_eq!(found.order, GaussianOrderGAURAST::VIEW_DEPTH);
    assert_eq!(found.low_pass_variance, 0.3);
    assert_eq!(found.alpha_floor, 1.0 / 255.0);
    assert_eq!(found.alpha_ceiling, 0.99);
    assert_eq!(found.transmittance_floor, 1e-4);
}

#[gaurast_runner::test]
fn a_distortion_chains_to_its_camera() {
    let mut first = GaussianCameraDistortionGAURAST::default().radial([0.25; 6]);
    let mut second = GaussianCameraDistortionGAURAST::default().tangential([0.5; 2]);
    let camera = GaussianCameraGAURAST::default().push_next(&mut first).push_next(&mut second);
    let found: &GaussianCameraDistortionGAURAST<'_> = next(camera.p_next);
    assert_eq!(found.tangential, [0.5; 2]);
    let found: &GaussianCameraDistortionGAURAST<'_> = next(found.p_next);
    assert_eq!((found.radial, found.model), ([0.25; 6], GaussianDistortionModelGAURAST::RATIONAL));
    assert!(found.p_next.is_null());
}

/// The calls of the recording function below: the command buffer and the eye of each camera.
static CALLED: Mutex<Vec<(u64, [f64; 3])>> = Mutex::new(Vec::new());

unsafe extern "system" fn record_cameras(
    command_buffer: vk::CommandBuffer,
    camera_count: u32,
    p_cameras: *const GaussianCameraGAURAST<'_>,
) {
    // SAFETY: the test passes live cameras.
    let cameras = unsafe { std::slice::from_raw_parts(p_cameras, camera_count as usize) };
    for camera in cameras {
        assert_eq!(camera.s_type, STRUCTURE_TYPE_GAUSSIAN_CAMERA_GAURAST);
        let call = (command_buffer.as_raw(), camera.eye);
        CALLED.lock().unwrap().push(call);
    }
}

unsafe extern "system" fn get_device_proc_addr(_device: vk::Device, name: *const c_char) -> vk::PFN_vkVoidFunction {
    // SAFETY: ash passes a terminated string.
    if unsafe { CStr::from_ptr(name) } != c"vkCmdSetGaussianCamerasGAURAST" {
        return None;
    }
    let function: PFN_vkCmdSetGaussianCamerasGAURAST = record_cameras;
    // SAFETY: one function pointer type to another; the caller casts it back.
    Some(unsafe { std::mem::transmute::<PFN_vkCmdSetGaussianCamerasGAURAST, unsafe extern "system" fn()>(function) })
}

#[gaurast_runner::test]
fn the_command_is_loaded_and_called() {
    let load = |name: &CStr| {
        if name == c"vkGetDeviceProcAddr" { get_device_proc_addr as *const c_void } else { std::ptr::null() }
    };
    // SAFETY: only `vkGetDeviceProcAddr` is called, which is loaded.
    let instance = unsafe { ash::Instance::load_with(load, vk::Instance::from_raw(1)) };
    // SAFETY: none of the device's core functions is called.
    let device = unsafe { ash::Device::load_with(|_| std::ptr::null(), vk::Device::from_raw(2)) };
    let functions = gaussian_primitive_topology::Device::new(&instance, &device);
    assert_eq!(functions.device(), vk::Device::from_raw(2));

    let eyes = [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]];
    let cameras = eyes.map(|eye| GaussianCameraGAURAST::default().eye(eye));
    // SAFETY: the recording function accepts any handle.
    unsafe { functions.cmd_set_gaussian_cameras(vk::CommandBuffer::from_raw(3), &cameras) };
    assert_eq!(*CALLED.lock().unwrap(), eyes.map(|eye| (3, eye)));
}
