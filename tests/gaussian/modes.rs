//! Optional modes of Gaussian draws that change the source of data, but not the picture.

use ash::vk;
use gaurast::vk::{GaussianCameraDataGAURAST, GaussianCameraSourceGAURAST};
use gaurast_testkit::devices::{gaussian, open};
use gaurast_testkit::scene::{Scene, Splat, camera, over, pass, splat, splats};
use gaurast_testkit::{Buffer, Gpu, Graphics};

/// Overlapping Gaussians whose depths alternate between the first and the second half.
fn interleaved() -> Vec<Splat> {
    let one = |index: usize| {
        let (half, place) = (index / 8, index % 8);
        let z = 4.0 + place as f32 + 0.5 * half as f32;
        let color = [0.9, 0.5, 0.1].map(|c| (c + 0.11 * index as f32) % 1.0);
        splat([0.05 * place as f32, -0.03 * half as f32, z], 0.1, 0.4, color)
    };
    (0..16).map(one).collect()
}

fn blended() -> Graphics<'static> {
    Graphics { blend: vec![over()], ..splats() }
}

/// Draws the two halves one after the other, and records `between` between them.
fn halves(scene: &Scene, between: impl FnOnce(&ash::Device, vk::CommandBuffer)) -> Vec<[f32; 4]> {
    scene.draw([0.0; 4], |device, commands| {
        // SAFETY: see the crate.
        unsafe { device.cmd_draw(commands, 8, 1, 0, 0) };
        between(device, commands);
        // SAFETY: see the crate.
        unsafe { device.cmd_draw(commands, 8, 1, 8, 0) };
    })
}

/// Draws as [`halves`] does, in one set.
fn merged(scene: &Scene, between: impl FnOnce(&ash::Device, vk::CommandBuffer)) -> Vec<[f32; 4]> {
    let gaussian = gaussian(&scene.gpu);
    scene.draw([0.0; 4], |device, commands| {
        // SAFETY: see the crate.
        unsafe {
            gaussian.cmd_begin_gaussian_set(commands);
            device.cmd_draw(commands, 8, 1, 0, 0);
        }
        between(device, commands);
        // SAFETY: see the crate.
        unsafe {
            device.cmd_draw(commands, 8, 1, 8, 0);
            gaussian.cmd_end_gaussian_set(commands);
        }
    })
}

#[gaurast_runner::test]
fn draws_between_begin_and_end_are_one_sorted_set() {
    let scene = Scene::new(&interleaved(), &blended());
    let whole = scene.draw([0.0; 4], |device, commands| {
        // SAFETY: see the crate.
        unsafe { device.cmd_draw(commands, 16, 1, 0, 0) };
    });
    assert!(merged(&scene, |_, _| {}) == whole);
    assert!(halves(&scene, |_, _| {}) != whole, "without, each is a set");
    // Buffers may be bound within a set.
    let bound = merged(&scene, |device, commands| {
        // SAFETY: see the crate.
        unsafe { device.cmd_bind_vertex_buffers(commands, 0, &[scene.splats.raw], &[0]) };
    });
    assert!(bound == whole);
    // Indirect draws may be in a set.
    let numbers = Buffer::of(&scene.gpu, &[8u32, 1, 8, 0, 8, 1, 0, 0]);
    let gaussian = gaussian(&scene.gpu);
    let indirect = scene.draw([0.0; 4], |device, commands| {
        // SAFETY: see the crate.
        unsafe {
            gaussian.cmd_begin_gaussian_set(commands);
            device.cmd_draw_indirect(commands, numbers.raw, 0, 2, 16);
            gaussian.cmd_end_gaussian_set(commands);
        }
    });
    assert!(indirect == whole);
    assert_eq!(scene.gpu.message_texts(), Vec::<String>::new());
}

/// Only the end command ends a set.
#[gaurast_runner::test]
fn innocent_commands_do_not_end_a_set() {
    let scene = Scene::new(&interleaved(), &blended());
    let whole = merged(&scene, |_, _| {});
    let info = vk::QueryPoolCreateInfo::default().query_type(vk::QueryType::TIMESTAMP).query_count(1);
    // SAFETY: see the crate.
    let pool = unsafe { scene.gpu.device().create_query_pool(&info, None) }.unwrap();
    // SAFETY: see the crate.
    unsafe { scene.gpu.device().reset_query_pool(pool, 0, 1) };
    let meanwhile = merged(&scene, |device, commands| {
        let point = vk::PipelineBindPoint::GRAPHICS;
        let all = vk::PipelineStageFlags::ALL_COMMANDS;
        let gaussian = gaussian(&scene.gpu);
        // SAFETY: see the crate.
        unsafe {
            device.cmd_write_timestamp(commands, all, pool, 0);
            device.cmd_bind_pipeline(commands, point, scene.pipeline.raw);
            gaussian.cmd_set_gaussian_cameras(commands, &[camera()]);
            device.cmd_set_line_width(commands, 1.0);
            device.cmd_set_blend_constants(commands, &[0.5; 4]);
        }
    });
    assert!(meanwhile == whole);
    assert_eq!(scene.gpu.message_texts(), Vec::<String>::new());
    // SAFETY: see the crate.
    unsafe { scene.gpu.device().destroy_query_pool(pool, None) };
}

/// A set is drawn at its end, so other draws within it are behind it.
#[gaurast_runner::test]
fn a_set_is_drawn_where_it_ends() {
    let scene = Scene::new(&interleaved(), &blended());
    let clear = |device: &ash::Device, commands| {
        let value = vk::ClearValue { color: vk::ClearColorValue { float32: [0.5; 4] } };
        let attachment = vk::ClearAttachment::default().aspect_mask(vk::ImageAspectFlags::COLOR).clear_value(value);
        let rect = vk::ClearRect::default().rect(gaurast_testkit::scene::area(&scene.image)).layer_count(1);
        // SAFETY: see the crate.
        unsafe { device.cmd_clear_attachments(commands, &[attachment], &[rect]) };
    };
    let before = scene.draw([0.0; 4], |device, commands| {
        clear(device, commands);
        // SAFETY: see the crate.
        unsafe { device.cmd_draw(commands, 16, 1, 0, 0) };
    });
    assert!(merged(&scene, clear) == before);
}

/// A layout with one set of one dynamic uniform buffer, and a pool for it.
struct CameraSet {
    set_layout: vk::DescriptorSetLayout,
    layout: vk::PipelineLayout,
    pool: vk::DescriptorPool,
    set: vk::DescriptorSet,
}

impl CameraSet {
    fn new(gpu: &Gpu, binding: u32) -> Self {
        let kind = vk::DescriptorType::UNIFORM_BUFFER_DYNAMIC;
        let bindings = [vk::DescriptorSetLayoutBinding::default()
            .binding(binding)
            .descriptor_type(kind)
            .descriptor_count(1)
            .stage_flags(vk::ShaderStageFlags::VERTEX)];
        let sizes = [vk::DescriptorPoolSize::default().ty(kind).descriptor_count(1)];
        let device = &gpu.device();
        // SAFETY: see the crate.
        unsafe {
            let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
            let set_layouts = [device.create_descriptor_set_layout(&info, None).unwrap()];
            let info = vk::PipelineLayoutCreateInfo::default().set_layouts(&set_layouts);
            let layout = device.create_pipeline_layout(&info, None).unwrap();
            let info = vk::DescriptorPoolCreateInfo::default().max_sets(1).pool_sizes(&sizes);
            let pool = device.create_descriptor_pool(&info, None).unwrap();
            let info = vk::DescriptorSetAllocateInfo::default().descriptor_pool(pool).set_layouts(&set_layouts);
            let set = device.allocate_descriptor_sets(&info).unwrap()[0];
            Self { set_layout: set_layouts[0], layout, pool, set }
        }
    }

    fn destroy(&self, gpu: &Gpu) {
        // SAFETY: see the crate.
        unsafe {
            gpu.device().destroy_descriptor_pool(self.pool, None);
            gpu.device().destroy_pipeline_layout(self.layout, None);
            gpu.device().destroy_descriptor_set_layout(self.set_layout, None);
        }
    }
}

#[gaurast_runner::test]
fn the_camera_may_come_from_a_uniform_buffer() {
    let gpu = open();
    let camera_set = CameraSet::new(&gpu, 3);
    let from_buffer = GaussianCameraSourceGAURAST::UNIFORM_BUFFER;
    let request = splats();
    let request = Graphics {
        set_layouts: vec![camera_set.set_layout],
        gaussian: (request.gaussian).map(|s| s.camera_source(from_buffer).camera_binding(3)),
        ..request
    };
    let scene = Scene::on(gpu, &interleaved(), &request);
    let moved = camera().eye([0.25, -0.5, 1.0]).focal_length([90.0, 110.0]);
    // The bytes of two cameras and of an invalid one.
    let mut bytes = vec![0u8; 1024];
    for (offset, camera) in [(0, camera()), (256, moved), (512, camera().near_plane(-1.0))] {
        let data = GaussianCameraDataGAURAST::from(&camera).to_bytes();
        bytes[offset..offset + data.len()].copy_from_slice(&data);
    }
    let buffer = Buffer::of(&scene.gpu, &bytes);
    let infos = [vk::DescriptorBufferInfo::default().buffer(buffer.raw).range(128)];
    let write = vk::WriteDescriptorSet::default()
        .dst_set(camera_set.set)
        .dst_binding(3)
        .descriptor_type(vk::DescriptorType::UNIFORM_BUFFER_DYNAMIC)
        .buffer_info(&infos);
    // SAFETY: see the crate.
    unsafe { scene.gpu.device().update_descriptor_sets(&[write], &[]) };
    let draw = |offset: Option<u32>| {
        scene.gpu.run(|recording| {
            let (device, commands) = recording.raw();
            pass(device, commands, &scene.image, [0.0; 4], || {
                // The camera that the command sets is ignored.
                scene.bind(device, commands);
                // SAFETY: see the crate.
                unsafe {
                    if let Some(offset) = offset {
                        let point = vk::PipelineBindPoint::GRAPHICS;
                        let layout = camera_set.layout;
                        let (sets, offsets) = ([camera_set.set], [offset]);
                        device.cmd_bind_descriptor_sets(commands, point, layout, 0, &sets, &offsets);
                    }
                    device.cmd_draw(commands, 16, 1, 0, 0);
                }
            });
        });
        scene.pixels()
    };
    let by_command = Scene::new(&interleaved(), &splats());
    for (offset, camera) in [(0, camera()), (256, moved)] {
        let expected = by_command.draw([0.0; 4], |device, commands| {
            // SAFETY: see the crate.
            unsafe {
                gaussian(&by_command.gpu).cmd_set_gaussian_cameras(commands, &[camera]);
                device.cmd_draw(commands, 16, 1, 0, 0);
            }
        });
        assert!(expected.iter().any(|pixel| pixel[3] > 0.5));
        assert!(draw(Some(offset)) == expected, "at {offset}");
    }
    assert_eq!(scene.gpu.message_texts(), Vec::<String>::new());
    for (offset, word) in [(Some(512), "nearPlane"), (None, "set 0")] {
        assert!(draw(offset).iter().all(|pixel| *pixel == [0.0; 4]));
        let messages = scene.gpu.message_texts().concat();
        assert!(messages.contains(word), "{messages:?}");
    }
    camera_set.destroy(&scene.gpu);
}
