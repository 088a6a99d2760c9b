//! The valid usage of cameras by view, sets, dynamic states and what else viewers need: each statement is broken once.

use crate::gpu::Gpu;
use crate::scene::{PipelineRequest, Scene, camera, splat};
use ash::vk;
use gaurast::vk::{GaussianCameraGAURAST, GaussianCameraSourceGAURAST};

/// What is heard when a recording fails.
fn unrecorded(gpu: &Gpu, record: impl FnOnce(&ash::Device, vk::CommandBuffer)) -> String {
    let error = gpu.record(record).expect_err("it fails");
    assert_eq!(error, vk::Result::ERROR_VALIDATION_FAILED_EXT);
    gpu.take_messages().concat()
}

/// What is heard when a pipeline is refused.
fn refused(gpu: &Gpu, request: &PipelineRequest) -> String {
    let error = request.create(gpu).expect_err("it is refused");
    assert_eq!(error, vk::Result::ERROR_VALIDATION_FAILED_EXT);
    gpu.take_messages().concat()
}

/// What is heard of a draw that draws nothing.
fn draws_nothing(
    request: &PipelineRequest,
    record: impl FnOnce(&Scene, &ash::Device, vk::CommandBuffer),
) -> String {
    let scene = Scene::new(&[splat([0.0, 0.0, 5.0], 0.1, 0.8, [0.5; 3])], request);
    let pixels = scene.draw([0.25; 4], |device, commands| {
        record(&scene, device, commands);
    });
    assert!(pixels.iter().all(|pixel| *pixel == [0.25; 4]));
    scene.gpu.take_messages().concat()
}

/// The ids of statements, each with what is heard when it is broken.
pub fn broken() -> Vec<(&'static str, String)> {
    cameras_by_view()
}

fn cameras_by_view() -> Vec<(&'static str, String)> {
    let gpu = Gpu::new();
    let set = |cameras: &[GaussianCameraGAURAST<'static>]| {
        unrecorded(&gpu, |_, commands| {
            // SAFETY: see the crate.
            unsafe { gpu.gaussian.cmd_set_gaussian_cameras(commands, cameras) };
        })
    };
    let limit = "VUID-vkCmdSetGaussianCamerasGAURAST-cameraCount-limit";
    let binding = vk::DescriptorSetLayoutBinding::default()
        .descriptor_type(vk::DescriptorType::UNIFORM_BUFFER)
        .descriptor_count(1)
        .stage_flags(vk::ShaderStageFlags::VERTEX);
    let bindings = [binding];
    let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
    // SAFETY: see the crate.
    let layouts = unsafe { gpu.device.create_descriptor_set_layout(&info, None) };
    let layouts = [layouts.unwrap()];
    let info = vk::PipelineLayoutCreateInfo::default().set_layouts(&layouts);
    // SAFETY: see the crate.
    let layout = unsafe { gpu.device.create_pipeline_layout(&info, None) }.unwrap();
    let counted = |count: u32| {
        let request = PipelineRequest::default();
        let state = request.gaussian.map(|state| {
            let buffer = GaussianCameraSourceGAURAST::UNIFORM_BUFFER;
            state.camera_source(buffer).camera_count(count)
        });
        let request = PipelineRequest {
            view_mask: 0b101,
            layout,
            gaussian: state,
            ..request
        };
        refused(&gpu, &request)
    };
    let views = "VUID-VkPipelineGaussianStateCreateInfoGAURAST-cameraCount-views";
    let by_view = PipelineRequest {
        view_mask: 0b101,
        ..PipelineRequest::default()
    };
    let of_view = draws_nothing(&by_view, |scene, device, commands| {
        let gaussian = &scene.gpu.gaussian;
        // SAFETY: see the crate.
        unsafe {
            gaussian.cmd_set_gaussian_cameras(commands, &[camera(), camera()]);
            device.cmd_draw(commands, 1, 1, 0, 0);
        }
    });
    let broken = vec![
        (limit, set(&[])),
        (limit, set(&[camera(); 33])),
        (views, counted(0)),
        (views, counted(2)),
        ("VUID-vkCmdDraw-cameraCount-GAURAST", of_view),
    ];
    // SAFETY: see the crate.
    unsafe {
        gpu.device.destroy_pipeline_layout(layout, None);
        gpu.device.destroy_descriptor_set_layout(layouts[0], None);
    }
    broken
}
