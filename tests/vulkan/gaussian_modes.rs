//! Optional modes of Gaussian draws that change where things come from, and not the picture.

use crate::devices::{gaussian, open};
use crate::scene::{Scene, Splat, camera, over, pass, splat, splats};
use ash::vk;
use gaurast::vk::{
    GaussianCameraDataGAURAST, GaussianCameraSourceGAURAST, PipelineGaussianStateCreateFlagsGAURAST,
};
use gaurast_testkit::{Buffer, Gpu, Graphics};

/// Overlapping Gaussians whose depths alternate between the first and the second half.
fn interleaved() -> Vec<Splat> {
    let one = |index: usize| {
        let (half, place) = (index / 8, index % 8);
        let z = 4.0 + place as f32 + 0.5 * half as f32;
        let color = [0.9, 0.5, 0.1].map(|c| (c + 0.11 * index as f32) % 1.0);
        splat(
            [0.05 * place as f32, -0.03 * half as f32, z],
            0.1,
            0.4,
            color,
        )
    };
    (0..16).map(one).collect()
}

fn merging() -> Graphics<'static> {
    let request = Graphics {
        blend: vec![over()],
        ..splats()
    };
    let merge = PipelineGaussianStateCreateFlagsGAURAST::MERGE_DRAWS;
    Graphics {
        gaussian: request.gaussian.map(|state| state.flags(merge)),
        ..request
    }
}

/// Draws the halves one after the other, with something between them.
fn halves(scene: &Scene, between: impl FnOnce(&ash::Device, vk::CommandBuffer)) -> Vec<[f32; 4]> {
    scene.draw([0.0; 4], |device, commands| {
        // SAFETY: see the crate.
        unsafe { device.cmd_draw(commands, 8, 1, 0, 0) };
        between(device, commands);
        // SAFETY: see the crate.
        unsafe { device.cmd_draw(commands, 8, 1, 8, 0) };
    })
}

#[gaurast_runner::test]
fn merged_draws_are_one_sorted_set() {
    let scene = Scene::new(&interleaved(), &merging());
    let whole = scene.draw([0.0; 4], |device, commands| {
        // SAFETY: see the crate.
        unsafe { device.cmd_draw(commands, 16, 1, 0, 0) };
    });
    assert!(halves(&scene, |_, _| {}) == whole);
    // Buffers may be bound meanwhile.
    let bound = halves(&scene, |device, commands| {
        // SAFETY: see the crate.
        unsafe { device.cmd_bind_vertex_buffers(commands, 0, &[scene.splats.raw], &[0]) };
    });
    assert!(bound == whole);
    // Indirect draws are draws like others.
    let numbers = Buffer::of(&scene.gpu, &[8u32, 1, 8, 0, 8, 1, 0, 0]);
    let indirect = scene.draw([0.0; 4], |device, commands| {
        // SAFETY: see the crate.
        unsafe { device.cmd_draw_indirect(commands, numbers.raw, 0, 2, 16) };
    });
    assert!(indirect == whole);
    assert_eq!(scene.gpu.message_texts(), Vec::<String>::new());
}

#[gaurast_runner::test]
fn anything_else_between_draws_ends_the_set() {
    let scene = Scene::new(&interleaved(), &merging());
    let apart = Scene::new(
        &interleaved(),
        &Graphics {
            blend: vec![over()],
            ..splats()
        },
    );
    let two_sets = halves(&apart, |_, _| {});
    assert!(two_sets != halves(&scene, |_, _| {}));
    let bind = halves(&scene, |device, commands| {
        let point = vk::PipelineBindPoint::GRAPHICS;
        // SAFETY: see the crate.
        unsafe { device.cmd_bind_pipeline(commands, point, scene.pipeline.raw) };
    });
    assert!(bind == two_sets);
    let look = halves(&scene, |_, commands| {
        let gaussian = gaussian(&scene.gpu);
        // SAFETY: see the crate.
        unsafe { gaussian.cmd_set_gaussian_camera(commands, &camera()) };
    });
    assert!(look == two_sets);
    // The end of a pass, and of the commands, ends it too.
    scene.gpu.run(|recording| {
        let (device, commands) = recording.raw();
        for first in [0, 8] {
            pass(device, commands, &scene.image, [0.0; 4], || {
                scene.bind(device, commands);
                // SAFETY: see the crate.
                unsafe { device.cmd_draw(commands, 8, 1, first, 0) };
            });
        }
    });
    let second = apart.draw([0.0; 4], |device, commands| {
        // SAFETY: see the crate.
        unsafe { device.cmd_draw(commands, 8, 1, 8, 0) };
    });
    assert!(scene.pixels() == second);
}

/// The bytes of a camera as a uniform buffer holds it.
fn camera_bytes(data: &GaussianCameraDataGAURAST) -> Vec<u8> {
    // SAFETY: the structure has no padding: 3 x 8, 2 x 4, 12 x 4 and 8 x 4 bytes.
    let bytes = unsafe {
        std::slice::from_raw_parts(std::ptr::from_ref(data).cast::<u8>(), size_of_val(data))
    };
    bytes.to_vec()
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
        let sizes = [vk::DescriptorPoolSize::default()
            .ty(kind)
            .descriptor_count(1)];
        let device = gpu.device();
        // SAFETY: see the crate.
        unsafe {
            let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
            let set_layouts = [device.create_descriptor_set_layout(&info, None).unwrap()];
            let info = vk::PipelineLayoutCreateInfo::default().set_layouts(&set_layouts);
            let layout = device.create_pipeline_layout(&info, None).unwrap();
            let info = vk::DescriptorPoolCreateInfo::default()
                .max_sets(1)
                .pool_sizes(&sizes);
            let pool = device.create_descriptor_pool(&info, None).unwrap();
            let info = vk::DescriptorSetAllocateInfo::default()
                .descriptor_pool(pool)
                .set_layouts(&set_layouts);
            let set = device.allocate_descriptor_sets(&info).unwrap()[0];
            Self {
                set_layout: set_layouts[0],
                layout,
                pool,
                set,
            }
        }
    }

    fn destroy(&self, gpu: &Gpu) {
        // SAFETY: see the crate.
        unsafe {
            gpu.device().destroy_descriptor_pool(self.pool, None);
            gpu.device().destroy_pipeline_layout(self.layout, None);
            gpu.device()
                .destroy_descriptor_set_layout(self.set_layout, None);
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
    // Two cameras, and one that is none.
    let mut bytes = vec![0u8; 1024];
    for (offset, camera) in [
        (0, camera()),
        (256, moved),
        (512, camera().near_plane(-1.0)),
    ] {
        let data = camera_bytes(&GaussianCameraDataGAURAST::from(&camera));
        bytes[offset..offset + data.len()].copy_from_slice(&data);
    }
    let buffer = Buffer::of(&scene.gpu, &bytes);
    let infos = [vk::DescriptorBufferInfo::default()
        .buffer(buffer.raw)
        .range(112)];
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
                // The camera that the command sets is not looked at.
                scene.bind(device, commands);
                // SAFETY: see the crate.
                unsafe {
                    if let Some(offset) = offset {
                        let point = vk::PipelineBindPoint::GRAPHICS;
                        let layout = camera_set.layout;
                        let (sets, offsets) = ([camera_set.set], [offset]);
                        device
                            .cmd_bind_descriptor_sets(commands, point, layout, 0, &sets, &offsets);
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
                (gaussian(&by_command.gpu)).cmd_set_gaussian_camera(commands, &camera);
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
