//! The valid usage of cameras by view, sets, dynamic states and other features for viewers: each statement is violated
//! once.

use ash::vk;
use gaurast::gaussian_primitive_topology;
use gaurast::vk::{
    DYNAMIC_STATE_GAUSSIAN_ALPHA_CEILING_GAURAST, DYNAMIC_STATE_GAUSSIAN_SPHERICAL_HARMONICS_DEGREE_GAURAST,
    GaussianAntialiasingGAURAST, GaussianCameraGAURAST, GaussianCameraSourceGAURAST, GaussianDecodingGAURAST,
    GaussianDecodingTableGAURAST, GaussianDecodingTablesGAURAST, GaussianOrderGAURAST,
    GaussianSphericalHarmonicsBufferGAURAST, PhysicalDeviceGaussianPrimitiveTopologyPropertiesGAURAST,
    PipelineGaussianDecodingStateCreateInfoGAURAST, PipelineGaussianStateCreateFlagsGAURAST,
};
use gaurast_testkit::devices::{gaussian, open, without_modes};
use gaurast_testkit::scene::{Scene, camera, splat, splats};
use gaurast_testkit::{Addressed, Gpu, Graphics};

/// The messages when ending a recording fails.
fn unrecorded(gpu: &Gpu, record: impl FnOnce(&ash::Device, vk::CommandBuffer)) -> String {
    let recorded = gpu.try_record(|recording| {
        let (device, commands) = recording.raw();
        record(device, commands);
    });
    let error = recorded.expect_err("it fails");
    assert_eq!(error, vk::Result::ERROR_VALIDATION_FAILED_EXT);
    gpu.message_texts().concat()
}

/// The messages when a pipeline is refused.
fn refused(gpu: &Gpu, request: &Graphics) -> String {
    let error = request.create(gpu).expect_err("it is refused");
    assert_eq!(error, vk::Result::ERROR_VALIDATION_FAILED_EXT);
    gpu.message_texts().concat()
}

/// The messages of a draw that draws nothing.
fn draws_nothing(request: &Graphics, record: impl FnOnce(&Scene, &ash::Device, vk::CommandBuffer)) -> String {
    let scene = Scene::new(&[splat([0.0, 0.0, 5.0], 0.1, 0.8, [0.5; 3])], request);
    let pixels = scene.draw([0.25; 4], |device, commands| {
        record(&scene, device, commands);
    });
    assert!(pixels.iter().all(|pixel| *pixel == [0.25; 4]));
    scene.gpu.message_texts().concat()
}

/// The ids of statements, each with the messages when it is violated.
pub fn broken() -> Vec<(&'static str, String)> {
    let mut broken = cameras_by_view();
    broken.extend(sets());
    broken.extend(dynamic_states());
    broken.extend(harmonics_buffers());
    broken.extend(decoding_tables());
    broken
}

fn decoding_tables() -> Vec<(&'static str, String)> {
    let gpu = open();
    let buffer = Addressed::of(&gpu, &[0_u8; 256]);
    let table = GaussianDecodingTableGAURAST::default()
        .device_address(buffer.address)
        .size(24)
        .format(vk::Format::R32_SFLOAT)
        .stride(24)
        .chunk_size(256);
    let bound = |table: GaussianDecodingTableGAURAST| {
        unrecorded(&gpu, |_, commands| {
            let tables = GaussianDecodingTablesGAURAST::default().scale(table);
            // SAFETY: see the crate.
            unsafe { gaussian(&gpu).cmd_bind_gaussian_decoding_tables(commands, &tables) };
        })
    };
    let mut request = splats();
    let positions = request.attributes.iter_mut().filter(|attribute| attribute.location == 0);
    positions.for_each(|attribute| attribute.format = vk::Format::R32_UINT);
    let decoding = PipelineGaussianDecodingStateCreateInfoGAURAST::default().position(GaussianDecodingGAURAST::CHUNK);
    let request = Graphics { decoding: Some(decoding), ..request };
    let unbound = draws_nothing(&request, |_, device, commands| {
        // SAFETY: see the crate.
        unsafe { device.cmd_draw(commands, 1, 1, 0, 0) };
    });
    let no_chunk = draws_nothing(&request, |scene, device, commands| {
        let tables = GaussianDecodingTablesGAURAST::default();
        // SAFETY: see the crate.
        unsafe {
            gaussian(&scene.gpu).cmd_bind_gaussian_decoding_tables(commands, &tables);
            device.cmd_draw(commands, 1, 1, 0, 0);
        }
    });
    vec![
        ("VUID-VkGaussianDecodingTableGAURAST-deviceAddress-90099", bound(table.size(257))),
        ("VUID-VkGaussianDecodingTableGAURAST-format-90100", bound(table.format(vk::Format::R16_SFLOAT))),
        ("VUID-vkCmdDraw-attributeDecoding-90101", unbound),
        ("VUID-vkCmdDraw-attributeDecoding-90101", no_chunk),
    ]
}

fn harmonics_buffers() -> Vec<(&'static str, String)> {
    let gpu = open();
    let bound = |buffer: GaussianSphericalHarmonicsBufferGAURAST<'static>| {
        unrecorded(&gpu, |_, commands| {
            let own = gaussian(&gpu);
            // SAFETY: see the crate.
            unsafe { own.cmd_bind_gaussian_spherical_harmonics(commands, &buffer) };
        })
    };
    let usage = vk::BufferUsageFlags::SHADER_DEVICE_ADDRESS | vk::BufferUsageFlags::STORAGE_BUFFER;
    let info = vk::BufferCreateInfo::default().size(256).usage(usage);
    let device = &gpu.device();
    // SAFETY: see the crate.
    let (buffer, memory, address) = unsafe {
        let buffer = device.create_buffer(&info, None).unwrap();
        let needed = device.get_buffer_memory_requirements(buffer);
        let mut flags = vk::MemoryAllocateFlagsInfo::default().flags(vk::MemoryAllocateFlags::DEVICE_ADDRESS);
        let allocation = vk::MemoryAllocateInfo::default()
            .allocation_size(needed.size)
            .memory_type_index(gaurast_testkit::devices::MAPPABLE)
            .push_next(&mut flags);
        let memory = device.allocate_memory(&allocation, None).unwrap();
        device.bind_buffer_memory(buffer, memory, 0).unwrap();
        let info = vk::BufferDeviceAddressInfo::default().buffer(buffer);
        (buffer, memory, device.get_buffer_device_address(&info))
    };
    let good = GaussianSphericalHarmonicsBufferGAURAST::default()
        .device_address(address)
        .size(256)
        .format(vk::Format::R32G32B32_SFLOAT)
        .stride(12);
    let too_long = bound(good.size(257));
    let integers = bound(good.format(vk::Format::R32G32B32_UINT));
    let too_few = bound(good.format(vk::Format::R32G32_SFLOAT));
    // SAFETY: see the crate.
    unsafe {
        device.destroy_buffer(buffer, None);
        device.free_memory(memory, None);
    }
    let request = splats();
    let flag = PipelineGaussianStateCreateFlagsGAURAST::SPHERICAL_HARMONICS_BUFFER;
    let request = Graphics { gaussian: request.gaussian.map(|state| state.flags(flag)), ..request };
    let none = draws_nothing(&request, |_, device, commands| {
        // SAFETY: see the crate.
        unsafe { device.cmd_draw(commands, 1, 1, 0, 0) };
    });
    let format = "VUID-VkGaussianSphericalHarmonicsBufferGAURAST-format-90017";
    vec![
        ("VUID-VkGaussianSphericalHarmonicsBufferGAURAST-deviceAddress-90016", too_long),
        (format, integers),
        (format, too_few),
        ("VUID-vkCmdDraw-sphericalHarmonicsBuffer-90018", none),
    ]
}

fn dynamic_states() -> Vec<(&'static str, String)> {
    let gpu = open();
    type Set<'a> = &'a dyn Fn(&gaussian_primitive_topology::Device, vk::CommandBuffer);
    let set = |set: Set<'_>| unrecorded(&gpu, |_, commands| set(gaussian(&gpu), commands));
    // SAFETY: see the crate.
    let commands: [(&'static str, Set<'_>); 9] = unsafe {
        [
            ("VUID-vkCmdSetGaussianOrderGAURAST-order-parameter", &|own, commands| {
                own.cmd_set_gaussian_order(commands, GaussianOrderGAURAST::from_raw(77));
            }),
            ("VUID-vkCmdSetGaussianAntialiasingGAURAST-antialiasing-parameter", &|own, commands| {
                let none = GaussianAntialiasingGAURAST::from_raw(77);
                own.cmd_set_gaussian_antialiasing(commands, none);
            }),
            ("VUID-vkCmdSetGaussianLowPassVarianceGAURAST-lowPassVariance-90053", &|own, commands| {
                own.cmd_set_gaussian_low_pass_variance(commands, f32::INFINITY);
            }),
            ("VUID-vkCmdSetGaussianAlphaFloorGAURAST-alphaFloor-90054", &|own, commands| {
                own.cmd_set_gaussian_alpha_floor(commands, 1.5);
            }),
            ("VUID-vkCmdSetGaussianAlphaCeilingGAURAST-alphaCeiling-90055", &|own, commands| {
                own.cmd_set_gaussian_alpha_ceiling(commands, 0.0);
            }),
            ("VUID-vkCmdSetGaussianTransmittanceFloorGAURAST-transmittanceFloor-90056", &|own, commands| {
                own.cmd_set_gaussian_transmittance_floor(commands, 1.0);
            }),
            (
                "VUID-vkCmdSetGaussianSphericalHarmonicsDegreeGAURAST-sphericalHarmonicsDegree-90057",
                &|own, commands| own.cmd_set_gaussian_spherical_harmonics_degree(commands, 5),
            ),
            ("VUID-vkCmdSetGaussianExponentialErrorGAURAST-exponentialError-90058", &|own, commands| {
                own.cmd_set_gaussian_exponential_error(commands, f32::NAN);
            }),
            ("VUID-vkCmdSetGaussianContributionBudgetGAURAST-contributionBudget-90059", &|own, commands| {
                own.cmd_set_gaussian_contribution_budget(commands, -1.0);
            }),
        ]
    };
    let mut broken: Vec<_> = commands.into_iter().map(|(id, command)| (id, set(command))).collect();
    let drawn = |state, value: Set<'_>| {
        let mut request = splats();
        request.dynamic.push(state);
        draws_nothing(&request, |scene, device, commands| {
            value(gaussian(&scene.gpu), commands);
            // SAFETY: see the crate.
            unsafe { device.cmd_draw(commands, 1, 1, 0, 0) };
        })
    };
    // SAFETY: see the crate.
    let ceiling = drawn(DYNAMIC_STATE_GAUSSIAN_ALPHA_CEILING_GAURAST, &|own, commands| unsafe {
        own.cmd_set_gaussian_alpha_ceiling(commands, 1e-3);
    });
    // SAFETY: see the crate.
    let degree = drawn(DYNAMIC_STATE_GAUSSIAN_SPHERICAL_HARMONICS_DEGREE_GAURAST, &|own, commands| unsafe {
        own.cmd_set_gaussian_spherical_harmonics_degree(commands, 1);
    });
    broken
        .extend([("VUID-vkCmdDraw-dynamic-90060", ceiling), ("VUID-vkCmdDraw-sphericalHarmonicsDegree-90061", degree)]);
    broken
}

fn sets() -> Vec<(&'static str, String)> {
    let (gpu, bare) = (open(), without_modes());
    let extension = gaussian(&gpu);
    let image = gaurast_testkit::devices::image(&gpu, gaurast_testkit::scene::FORMAT, [8, 8]);
    let within = |record: &dyn Fn(vk::CommandBuffer)| {
        unrecorded(&gpu, |device, commands| {
            gaurast_testkit::scene::pass(device, commands, &image, [0.0; 4], || record(commands));
        })
    };
    let without_feature = bare.try_record(|recording| {
        let (_, commands) = recording.raw();
        // SAFETY: see the crate.
        unsafe { gaussian(&bare).cmd_begin_gaussian_set(commands) };
    });
    let absent = vk::Result::ERROR_FEATURE_NOT_PRESENT;
    assert_eq!(without_feature.unwrap_err(), absent);
    let feature = bare.message_texts().concat();
    let outside = unrecorded(&gpu, |_, commands| {
        // SAFETY: see the crate.
        unsafe { extension.cmd_begin_gaussian_set(commands) };
    });
    let twice = within(&|commands| {
        // SAFETY: see the crate.
        unsafe {
            extension.cmd_begin_gaussian_set(commands);
            extension.cmd_begin_gaussian_set(commands);
        }
    });
    let not_begun = within(&|commands| {
        // SAFETY: see the crate.
        unsafe { extension.cmd_end_gaussian_set(commands) };
    });
    let not_ended = within(&|commands| {
        // SAFETY: see the crate.
        unsafe { extension.cmd_begin_gaussian_set(commands) };
    });
    let other_draw = |change: &dyn Fn(&Scene, &ash::Device, vk::CommandBuffer)| {
        // The first draw draws nothing either, because it is behind the camera.
        let behind = [splat([0.0, 0.0, -5.0], 0.1, 0.8, [0.5; 3]); 2];
        let scene = Scene::new(&behind, &splats());
        scene.draw([0.25; 4], |device, commands| {
            let extension = gaussian(&scene.gpu);
            // SAFETY: see the crate.
            unsafe {
                extension.cmd_begin_gaussian_set(commands);
                device.cmd_draw(commands, 1, 1, 0, 0);
            }
            change(&scene, device, commands);
            // SAFETY: see the crate.
            unsafe {
                device.cmd_draw(commands, 1, 1, 1, 0);
                extension.cmd_end_gaussian_set(commands);
            }
        });
        scene.gpu.message_texts().concat()
    };
    let other_camera = other_draw(&|scene, _, commands| {
        let moved = camera().eye([1.0, 0.0, 0.0]);
        // SAFETY: see the crate.
        unsafe { gaussian(&scene.gpu).cmd_set_gaussian_cameras(commands, &[moved]) };
    });
    let other_pipeline = other_draw(&|scene, device, commands| {
        let point = vk::PipelineBindPoint::GRAPHICS;
        let other = splats().create(&scene.gpu).unwrap();
        // SAFETY: see the crate. The recorded commands keep the pipeline alive.
        unsafe { device.cmd_bind_pipeline(commands, point, other.raw) };
    });
    vec![
        ("VUID-vkCmdBeginGaussianSetGAURAST-mergedDraws-90001", feature),
        ("VUID-vkCmdBeginGaussianSetGAURAST-renderpass", outside),
        ("VUID-vkCmdBeginGaussianSetGAURAST-None-90002", twice),
        ("VUID-vkCmdEndGaussianSetGAURAST-None-90004", not_begun),
        ("VUID-vkCmdBeginGaussianSetGAURAST-None-90003", not_ended),
        ("VUID-vkCmdDraw-None-90006", other_camera),
        ("VUID-vkCmdDraw-None-90005", other_pipeline),
    ]
}

fn cameras_by_view() -> Vec<(&'static str, String)> {
    let gpu = open();
    let set = |cameras: &[GaussianCameraGAURAST<'static>]| {
        unrecorded(&gpu, |_, commands| {
            // SAFETY: see the crate.
            unsafe { gaussian(&gpu).cmd_set_gaussian_cameras(commands, cameras) };
        })
    };
    let limit = "VUID-vkCmdSetGaussianCamerasGAURAST-cameraCount-90062";
    let binding = vk::DescriptorSetLayoutBinding::default()
        .descriptor_type(vk::DescriptorType::UNIFORM_BUFFER)
        .descriptor_count(1)
        .stage_flags(vk::ShaderStageFlags::VERTEX);
    let bindings = [binding];
    let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
    // SAFETY: see the crate.
    let layouts = unsafe { gpu.device().create_descriptor_set_layout(&info, None) };
    let layouts = [layouts.unwrap()];
    let counted = |count: u32| {
        let request = splats();
        let state = request.gaussian.map(|state| {
            let buffer = GaussianCameraSourceGAURAST::UNIFORM_BUFFER;
            state.camera_source(buffer).camera_count(count)
        });
        let request = Graphics { view_mask: 0b101, set_layouts: layouts.to_vec(), gaussian: state, ..request };
        refused(&gpu, &request)
    };
    let views = "VUID-VkPipelineGaussianStateCreateInfoGAURAST-cameraCount-90026";
    let by_view = Graphics { view_mask: 0b101, ..splats() };
    let of_view = draws_nothing(&by_view, |scene, device, commands| {
        let gaussian = gaussian(&scene.gpu);
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
        ("VUID-vkCmdDraw-cameraCount-90063", of_view),
    ];
    // SAFETY: see the crate.
    unsafe {
        gpu.device().destroy_descriptor_set_layout(layouts[0], None);
    }
    broken
}

/// Every property is within the limits that the specification requires.
#[gaurast_runner::test]
fn properties_meet_their_limits() {
    let gpu = open();
    let mut own = PhysicalDeviceGaussianPrimitiveTopologyPropertiesGAURAST::default();
    let mut all = vk::PhysicalDeviceProperties2::default().push_next(&mut own);
    // SAFETY: see the crate.
    unsafe {
        let device = gpu.physical_device();
        gpu.instance().get_physical_device_properties2(device, &mut all);
    }
    let attributes = all.properties.limits.max_vertex_input_attributes;
    assert!(own.tile_size.width >= 1 && own.tile_size.height >= 1);
    assert!((3..=4).contains(&own.max_spherical_harmonics_degree));
    let samples = vk::SampleCountFlags::TYPE_1 | vk::SampleCountFlags::TYPE_4;
    assert!(own.gaussian_sample_counts.contains(samples));
    assert!(own.max_gaussians_per_draw >= (1 << 24) - 1);
    assert!(own.max_gaussians_per_set >= own.max_gaussians_per_draw);
    assert!(attributes >= 29);
}
