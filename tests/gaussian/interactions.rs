//! The extension beside state and features that are made for triangles, and the colours in attachments.

use ash::vk;
use gaurast_testkit::devices::{gaussian, image, open};
use gaurast_testkit::scene::{
    FORMAT, HEIGHT, Scene, Splat, WIDTH, camera, over, pass, pass_with, set_viewport, splat, splats,
};
use gaurast_testkit::{Buffer, Gpu, Graphics, Image, ImageOptions, Pass, Target, TargetOptions, TransformFeedback};

/// Three Gaussians, one behind the others.
fn gaussians() -> [Splat; 3] {
    [
        splat([-0.3, 0.1, 5.0], 0.3, 0.7, [0.9, 0.2, 0.1]),
        splat([0.3, -0.1, 5.5], 0.4, 0.6, [0.1, 0.8, 0.3]),
        splat([0.0, 0.0, 9.0], 1.2, 0.9, [0.2, 0.3, 0.9]),
    ]
}

const BEHIND: [f32; 4] = [0.25, 0.5, 0.125, 1.0];

/// The picture of a pipeline over [`BEHIND`], of three vertices.
fn picture(request: &Graphics<'_>) -> Vec<[f32; 4]> {
    let scene = Scene::new(&gaussians(), request);
    let pixels = scene.draw(BEHIND, |device, commands| {
        // SAFETY: see the crate.
        unsafe { device.cmd_draw(commands, 3, 1, 0, 0) };
    });
    assert_eq!(scene.gpu.message_texts(), Vec::<String>::new());
    pixels
}

/// Rasterization that has no effect on Gaussians.
fn rasterizations() -> Vec<(&'static str, vk::PipelineRasterizationStateCreateInfo<'static>)> {
    let raster = splats().raster;
    vec![
        ("culling", raster.cull_mode(vk::CullModeFlags::FRONT_AND_BACK).front_face(vk::FrontFace::CLOCKWISE)),
        ("depth bias", raster.depth_bias_enable(true).depth_bias_constant_factor(1e6).depth_bias_slope_factor(1e6)),
        ("depth clamp", raster.depth_clamp_enable(true)),
        ("lines", raster.polygon_mode(vk::PolygonMode::LINE)),
        ("points", raster.polygon_mode(vk::PolygonMode::POINT)),
        ("width", raster.line_width(1.0)),
    ]
}

/// The bytes of colours and of depths of Gaussians of which the last one is beyond the depth range.
fn depths(gpu: &Gpu, request: &Graphics<'_>, set: impl FnOnce(vk::CommandBuffer)) -> [Vec<u8>; 2] {
    let options = TargetOptions {
        size: [WIDTH, HEIGHT],
        colors: vec![FORMAT],
        ..TargetOptions::with_depth(vk::Format::D32_SFLOAT)
    };
    let target = Target::new(gpu, &options);
    let request = Graphics {
        depth_format: vk::Format::D32_SFLOAT,
        depth_stencil: gaurast_testkit::depth_test(vk::CompareOp::ALWAYS),
        ..request.clone()
    };
    let pipeline = request.create(gpu).expect("a pipeline");
    let splats = Buffer::of(gpu, gaussians().as_flattened());
    let pass = Pass { depth: vk::ClearDepthStencilValue { depth: 0.0, stencil: 0 }, ..Pass::clear(BEHIND) };
    let output = target.draw(gpu, &pass, |commands| {
        commands.bind(&pipeline);
        commands.vertices(&splats);
        set(commands.raw);
        // Depths of 0.5, 0.68 and 1.39.
        commands.camera(&camera().depth_coefficients([2.5, -10.0]));
        commands.draw(0..3);
    });
    assert_eq!(gpu.message_texts(), Vec::<String>::new());
    [0, 1].map(|picture: usize| output.pictures[picture].bytes.clone())
}

#[gaurast_runner::test]
fn state_of_triangles_has_no_effect() {
    let gpu = open();
    let plain = depths(&gpu, &splats(), |_| {});
    let stored: Vec<f32> = bytemuck::pod_collect_to_vec(&plain[1]);
    assert!(stored.contains(&0.5) && stored.contains(&1.0), "clamped");
    for (name, raster) in rasterizations() {
        let request = Graphics { raster, ..splats() };
        assert!(depths(&gpu, &request, |_| {}) == plain, "{name}");
    }
}

/// The same state, set by commands: it is allowed, and has no effect.
#[gaurast_runner::test]
fn dynamic_state_of_triangles_has_no_effect() {
    use vk::DynamicState as S;
    let (gpu, states) = with_dynamic_state_3();
    let plain = depths(&gpu, &splats(), |_| {});
    let mut request = splats();
    for state in [
        S::CULL_MODE,
        S::FRONT_FACE,
        S::DEPTH_BIAS,
        S::DEPTH_BIAS_ENABLE,
        S::LINE_WIDTH,
        S::PRIMITIVE_TOPOLOGY,
        S::DEPTH_CLAMP_ENABLE_EXT,
        S::POLYGON_MODE_EXT,
    ] {
        request = request.with_dynamic(state);
    }
    let device = gpu.device();
    let set = |commands: vk::CommandBuffer| {
        // SAFETY: see the crate.
        unsafe {
            device.cmd_set_cull_mode(commands, vk::CullModeFlags::FRONT_AND_BACK);
            device.cmd_set_front_face(commands, vk::FrontFace::CLOCKWISE);
            device.cmd_set_depth_bias(commands, 1e6, 0.0, 1e6);
            device.cmd_set_depth_bias_enable(commands, true);
            device.cmd_set_line_width(commands, 1.0);
            // The topology is dynamic within its class, which has one.
            device.cmd_set_primitive_topology(commands, request.topology);
            states.cmd_set_depth_clamp_enable(commands, true);
            states.cmd_set_polygon_mode(commands, vk::PolygonMode::LINE);
        }
    };
    assert!(depths(&gpu, &request, set) == plain);
}

/// A device with dynamic states of `VK_EXT_extended_dynamic_state3`.
fn with_dynamic_state_3() -> (Gpu, ash::ext::extended_dynamic_state3::Device) {
    let mut features = vk::PhysicalDeviceExtendedDynamicState3FeaturesEXT::default()
        .extended_dynamic_state3_depth_clamp_enable(true)
        .extended_dynamic_state3_polygon_mode(true)
        .extended_dynamic_state3_sample_mask(true)
        .extended_dynamic_state3_logic_op_enable(true)
        .extended_dynamic_state3_color_blend_enable(true)
        .extended_dynamic_state3_color_blend_equation(true)
        .extended_dynamic_state3_color_write_mask(true);
    let name = ash::ext::extended_dynamic_state3::NAME;
    let gpu = Gpu::extended(&[name], &mut features).expect("a device");
    let states = ash::ext::extended_dynamic_state3::Device::new(gpu.instance(), gpu.device());
    (gpu, states)
}

/// Blending, write masks, samples and logic operations that commands set are those that a pipeline has.
#[gaurast_runner::test]
fn dynamic_blending_is_that_of_the_pipeline() {
    use vk::DynamicState as S;
    let (gpu, states) = with_dynamic_state_3();
    let (one, add) = (vk::BlendFactor::ONE, vk::BlendOp::ADD);
    let blended = |blend| Graphics { blend: vec![blend], ..splats() };
    let masked = Graphics { sample_mask: Some(0), ..blended(over()) };
    let red = vk::ColorComponentFlags::R;
    let sum = vk::ColorBlendEquationEXT::default()
        .src_color_blend_factor(one)
        .dst_color_blend_factor(one)
        .src_alpha_blend_factor(one)
        .dst_alpha_blend_factor(one);
    let set = |state: S, commands: vk::CommandBuffer| {
        // SAFETY: see the crate.
        unsafe {
            match state {
                S::COLOR_BLEND_ENABLE_EXT => {
                    states.cmd_set_color_blend_enable(commands, 0, &[vk::FALSE]);
                }
                S::COLOR_BLEND_EQUATION_EXT => {
                    states.cmd_set_color_blend_equation(commands, 0, &[sum]);
                }
                S::COLOR_WRITE_MASK_EXT => states.cmd_set_color_write_mask(commands, 0, &[red]),
                S::SAMPLE_MASK_EXT => {
                    states.cmd_set_sample_mask(commands, vk::SampleCountFlags::TYPE_1, &[0]);
                }
                _ => states.cmd_set_logic_op_enable(commands, false),
            }
        }
    };
    let plain = depths(&gpu, &blended(over()), |_| {});
    for (state, expected) in [
        (S::COLOR_BLEND_ENABLE_EXT, blended(gaurast_testkit::scene::replace())),
        (S::COLOR_BLEND_EQUATION_EXT, blended(gaurast_testkit::blend(one, one, add))),
        (S::COLOR_WRITE_MASK_EXT, blended(over().color_write_mask(red))),
        (S::SAMPLE_MASK_EXT, masked),
        (S::LOGIC_OP_ENABLE_EXT, blended(over())),
    ] {
        let dynamic = blended(over()).with_dynamic(state);
        let output = depths(&gpu, &dynamic, |commands| set(state, commands));
        assert!(output == depths(&gpu, &expected, |_| {}), "{state:?}");
        // A logic operation that is off is as none.
        let is_plain = state == S::LOGIC_OP_ENABLE_EXT;
        assert_eq!(output == plain, is_plain, "{state:?}");
    }
}

/// Samples that are shaded one by one are alike where nothing is shaded.
#[gaurast_runner::test]
fn sample_shading_changes_nothing_without_a_fragment_stage() {
    let gpu = open();
    let resolved = |shading: bool| {
        let options = TargetOptions { size: [WIDTH, HEIGHT], ..TargetOptions::of(FORMAT).multisampled() };
        let target = Target::new(&gpu, &options);
        let request = Graphics {
            multisample: vk::PipelineMultisampleStateCreateInfo::default()
                .rasterization_samples(vk::SampleCountFlags::TYPE_4)
                .sample_shading_enable(shading)
                .min_sample_shading(1.0),
            blend: vec![over()],
            ..splats()
        };
        let pipeline = request.create(&gpu).expect("a pipeline");
        let splats = Buffer::of(&gpu, gaussians().as_flattened());
        gpu.run(|commands| {
            commands.pass(&target, &Pass::clear(BEHIND), || {
                commands.bind(&pipeline);
                commands.vertices(&splats);
                commands.camera(&camera());
                commands.draw(0..3);
            });
        });
        target.resolved[0].colors::<[f32; 4]>()
    };
    let plain = resolved(false);
    assert!(plain.iter().any(|pixel| *pixel != BEHIND));
    assert!(resolved(true) == plain);
}

/// Extensions that make fragments of their own are absent, so that no pipeline has them.
#[gaurast_runner::test]
fn no_shading_rates_are_offered() {
    let gpu = open();
    // SAFETY: see the crate.
    let offered =
        unsafe { gpu.instance().enumerate_device_extension_properties(gpu.physical_device()) }.expect("the extensions");
    let names: Vec<_> = (offered.iter()).map(|one| one.extension_name_as_c_str().expect("a name")).collect();
    assert!(names.contains(&gaurast::gaussian_primitive_topology::NAME));
    for absent in [
        ash::khr::fragment_shading_rate::NAME,
        ash::ext::mesh_shader::NAME,
        ash::ext::conservative_rasterization::NAME,
        ash::ext::sample_locations::NAME,
    ] {
        assert!(!names.contains(&absent), "{absent:?} needs tests with Gaussians");
    }
}

/// The picture is the same, and nothing is written.
#[gaurast_runner::test]
fn transform_feedback_captures_nothing_of_gaussians() {
    let mut features = vk::PhysicalDeviceTransformFeedbackFeaturesEXT::default().transform_feedback(true);
    let gpu =
        Gpu::extended(&[ash::ext::transform_feedback::NAME], &mut features).expect("a device with transform feedback");
    let feedback = TransformFeedback::new(&gpu);
    let captured = Buffer::with_usage(&gpu, 1024, TransformFeedback::usage());
    captured.write(&[7u32; 256]);
    let counter = Buffer::with_usage(&gpu, 4, TransformFeedback::usage());
    counter.write(&[12u32]);
    let scene = Scene::on(gpu.clone(), &gaussians(), &splats());
    let drawn = |captures: bool| {
        gpu.run(|commands| {
            let (device, raw) = commands.raw();
            pass(device, raw, &scene.image, BEHIND, || {
                scene.bind(device, raw);
                if captures {
                    feedback.bind(commands, 0, &[(&captured, 0)]);
                    feedback.begin(commands, &[(&counter, 0)]);
                }
                commands.draw(0..3);
                if captures {
                    feedback.end(commands, &[(&counter, 0)]);
                }
            });
        });
        scene.pixels()
    };
    let (plain, beside) = (drawn(false), drawn(true));
    assert!(plain.iter().any(|pixel| *pixel != BEHIND));
    assert!(beside == plain);
    assert_eq!(captured.values::<u32>(), [7; 256]);
    assert_eq!(counter.values::<u32>(), [12]);
}

#[gaurast_runner::test]
fn rasterization_is_not_discarded() {
    let gpu = open();
    let request = Graphics { raster: splats().raster.rasterizer_discard_enable(true), ..splats() };
    let refused = request.create(&gpu).expect_err("it is refused");
    assert_eq!(refused, vk::Result::ERROR_VALIDATION_FAILED_EXT);
    let heard = gpu.message_texts().concat();
    assert!(heard.contains("rasterizerDiscardEnable"), "{heard}");
}

#[gaurast_runner::test]
fn an_index_of_all_ones_is_an_index() {
    let scene = Scene::new(&gaussians(), &splats());
    let plain = scene.draw(BEHIND, |device, commands| {
        // SAFETY: see the crate.
        unsafe { device.cmd_draw(commands, 3, 1, 0, 0) };
    });
    let indices = Buffer::of(&scene.gpu, &[0xffff_u16, 0xfffe, 0xfffd]);
    let pixels = scene.draw(BEHIND, |device, commands| {
        // SAFETY: see the crate. The last index is the first vertex.
        unsafe {
            device.cmd_bind_index_buffer(commands, indices.raw, 0, vk::IndexType::UINT16);
            device.cmd_draw_indexed(commands, 3, 1, 0, -0xfffd, 0);
        }
    });
    assert!(pixels == plain);
}

#[gaurast_runner::test]
fn attributes_beyond_their_buffer_are_no_gaussians() {
    let scene = Scene::new(&gaussians(), &splats());
    let draw = |count: u32| {
        scene.draw(BEHIND, |device, commands| {
            // SAFETY: see the crate; what lies beyond the buffer reads as zeros.
            unsafe { device.cmd_draw(commands, count, 1, 0, 0) };
        })
    };
    assert!(draw(3) == draw(1000));
}

/// Indices beyond their buffer are 0, which is the first Gaussian: it is drawn again and again.
#[gaurast_runner::test]
fn indices_beyond_their_buffer_are_zeros() {
    let scene = Scene::new(&gaussians(), &splats());
    let draw = |indices: &[u32], count: u32| {
        let indices = Buffer::of(&scene.gpu, indices);
        scene.draw(BEHIND, |device, commands| {
            // SAFETY: see the crate.
            unsafe {
                device.cmd_bind_index_buffer(commands, indices.raw, 0, vk::IndexType::UINT32);
                device.cmd_draw_indexed(commands, count, 1, 0, 0, 0);
            }
        })
    };
    let beyond = draw(&[2, 1], 5);
    assert!(beyond == draw(&[2, 1, 0, 0, 0], 5));
    assert!(beyond != draw(&[2, 1], 2));
    // An index to what is not there is no Gaussian.
    assert!(draw(&[0, 1, 2, 1_000_000, 0x7fff_ffff], 5) == draw(&[0, 1, 2], 3));
}

/// Draws of a set that are switched off have no Gaussians in it; the set's commands are executed whatever the word.
#[gaurast_runner::test]
fn draws_are_conditional_and_sets_are_not() {
    let mut features = vk::PhysicalDeviceConditionalRenderingFeaturesEXT::default().conditional_rendering(true);
    let name = ash::ext::conditional_rendering::NAME;
    let gpu = Gpu::extended(&[name], &mut features).expect("a device");
    let functions = ash::ext::conditional_rendering::Device::new(gpu.instance(), gpu.device());
    let request = Graphics { blend: vec![over()], ..splats() };
    let scene = Scene::on(gpu.clone(), &gaussians(), &request);
    let words = Buffer::of(&gpu, &[0u32, 1]);
    let draw = |second: Option<u64>, draws: [(u32, u32); 2], whole: bool| {
        scene.draw(BEHIND, |device, commands| {
            let own = gaussian(&scene.gpu);
            // SAFETY: see the crate.
            unsafe {
                let begin = |offset| {
                    let info = vk::ConditionalRenderingBeginInfoEXT::default().buffer(words.raw).offset(offset);
                    (functions.fp().cmd_begin_conditional_rendering_ext)(commands, &info);
                };
                let end = || (functions.fp().cmd_end_conditional_rendering_ext)(commands);
                let of_whole = second.filter(|_| whole);
                let of_draw = second.filter(|_| !whole);
                of_whole.into_iter().for_each(begin);
                own.cmd_begin_gaussian_set(commands);
                device.cmd_draw(commands, draws[0].1, 1, draws[0].0, 0);
                of_draw.into_iter().for_each(begin);
                device.cmd_draw(commands, draws[1].1, 1, draws[1].0, 0);
                of_draw.into_iter().for_each(|_| end());
                own.cmd_end_gaussian_set(commands);
                of_whole.into_iter().for_each(|_| end());
            }
        })
    };
    // The front Gaussian is the second draw, so that an order by draws would show.
    let draws = [(1, 2), (0, 1)];
    let both = draw(None, draws, false);
    let first = draw(None, [(1, 2), (0, 0)], false);
    assert!(both != first);
    assert!(draw(Some(4), draws, false) == both);
    assert!(draw(Some(0), draws, false) == first);
    assert!(draw(Some(4), draws, true) == both);
    assert!(draw(Some(0), draws, true) == vec![BEHIND; (WIDTH * HEIGHT) as usize]);
    assert_eq!(gpu.message_texts(), Vec::<String>::new());
}

/// Each draw of a command of several draws is a set of its own, as those of an indirect command are.
#[gaurast_runner::test]
fn each_draw_of_a_command_of_several_is_a_set() {
    let mut features = vk::PhysicalDeviceMultiDrawFeaturesEXT::default().multi_draw(true);
    let gpu = Gpu::extended(&[ash::ext::multi_draw::NAME], &mut features).expect("a device");
    let functions = ash::ext::multi_draw::Device::new(gpu.instance(), gpu.device());
    let request = Graphics { blend: vec![over()], ..splats() };
    let scene = Scene::on(gpu.clone(), &gaussians(), &request);
    let draws = [(2, 1), (0, 2)];
    let several = scene.draw(BEHIND, |_, commands| {
        let draws = draws.map(|(first, count)| vk::MultiDrawInfoEXT::default().first_vertex(first).vertex_count(count));
        let stride = size_of::<vk::MultiDrawInfoEXT>() as u32;
        // SAFETY: see the crate.
        unsafe { (functions.fp().cmd_draw_multi_ext)(commands, 2, draws.as_ptr(), 1, 0, stride) };
    });
    let one_by_one = |draws: [(u32, u32); 2]| {
        scene.draw(BEHIND, |device, commands| {
            for (first, count) in draws {
                // SAFETY: see the crate.
                unsafe { device.cmd_draw(commands, count, 1, first, 0) };
            }
        })
    };
    assert!(several == one_by_one(draws));
    assert!(several != one_by_one([draws[1], draws[0]]), "the order of draws shows");
}

/// Draws in the parts of a rendering that is suspended and resumed are draws in one.
#[gaurast_runner::test]
fn suspended_rendering_goes_on() {
    let request = Graphics { blend: vec![over()], ..splats() };
    let scene = Scene::new(&gaussians(), &request);
    let whole = scene.draw(BEHIND, |device, commands| {
        // SAFETY: see the crate.
        unsafe {
            device.cmd_draw(commands, 1, 1, 2, 0);
            device.cmd_draw(commands, 2, 1, 0, 0);
        }
    });
    scene.gpu.run(|recording| {
        let (device, commands) = recording.raw();
        let part = |flags, first: u32, count| {
            pass_with(flags, device, commands, &scene.image, BEHIND, || {
                set_viewport(device, commands, &scene.image);
                scene.bind(device, commands);
                // SAFETY: see the crate.
                unsafe {
                    gaussian(&scene.gpu).cmd_begin_gaussian_set(commands);
                    device.cmd_draw(commands, count, 1, first, 0);
                    gaussian(&scene.gpu).cmd_end_gaussian_set(commands);
                }
            });
        };
        part(vk::RenderingFlags::SUSPENDING, 2, 1);
        part(vk::RenderingFlags::RESUMING, 0, 2);
    });
    assert!(scene.pixels() == whole);
    assert_eq!(scene.gpu.message_texts(), Vec::<String>::new());
}

/// Records a secondary command buffer for [`Scene`]'s pass.
fn secondary(scene: &Scene, record: impl FnOnce(&ash::Device, vk::CommandBuffer)) -> gaurast_testkit::Recorded {
    let formats = [FORMAT];
    let mut rendering = vk::CommandBufferInheritanceRenderingInfo::default()
        .color_attachment_formats(&formats)
        .rasterization_samples(vk::SampleCountFlags::TYPE_1);
    let inheritance = vk::CommandBufferInheritanceInfo::default().push_next(&mut rendering);
    scene.gpu.record_secondary(&inheritance, |recording| {
        let (device, commands) = recording.raw();
        set_viewport(device, commands, &scene.image);
        record(device, commands);
    })
}

/// The picture of secondary command buffers in a pass over [`BEHIND`].
fn executed(
    scene: &Scene,
    secondaries: &[&gaurast_testkit::Recorded],
    before: impl FnOnce(&ash::Device, vk::CommandBuffer),
) -> Vec<[f32; 4]> {
    let raw: Vec<_> = secondaries.iter().map(|one| one.raw).collect();
    let flags = vk::RenderingFlags::CONTENTS_SECONDARY_COMMAND_BUFFERS;
    scene.gpu.run(|recording| {
        let (device, commands) = recording.raw();
        before(device, commands);
        pass_with(flags, device, commands, &scene.image, BEHIND, || {
            // SAFETY: see the crate.
            unsafe { device.cmd_execute_commands(commands, &raw) };
        });
    });
    scene.pixels()
}

/// Neither cameras nor sets cross from one command buffer to another; a secondary command buffer may hold whole sets.
#[gaurast_runner::test]
fn cameras_and_sets_stay_in_their_command_buffer() {
    let request = Graphics { blend: vec![over()], ..splats() };
    let scene = Scene::new(&gaussians(), &request);
    let own = gaussian(&scene.gpu);
    let draws = |device: &ash::Device, commands| {
        // SAFETY: see the crate.
        unsafe {
            device.cmd_draw(commands, 2, 1, 1, 0);
            device.cmd_draw(commands, 1, 1, 0, 0);
        }
    };
    let apart = scene.draw(BEHIND, draws);
    let set = |device: &ash::Device, commands| {
        // SAFETY: see the crate.
        unsafe {
            own.cmd_begin_gaussian_set(commands);
            draws(device, commands);
            own.cmd_end_gaussian_set(commands);
        }
    };
    let merged = scene.draw(BEHIND, set);
    assert!(apart != merged);
    // A whole set in a secondary is a set, and what two secondaries draw is two.
    let whole = secondary(&scene, |device, commands| {
        scene.bind(device, commands);
        set(device, commands);
    });
    assert!(executed(&scene, &[&whole], |_, _| {}) == merged);
    let [far, near] = [(2, 1), (1, 0)].map(|(count, first)| {
        secondary(&scene, |device, commands| {
            scene.bind(device, commands);
            // SAFETY: see the crate.
            unsafe { device.cmd_draw(commands, count, 1, first, 0) };
        })
    });
    assert!(executed(&scene, &[&far, &near], |_, _| {}) == apart);
    assert_eq!(scene.gpu.message_texts(), Vec::<String>::new());
    // The primary's camera is not the secondary's.
    let blind = secondary(&scene, |device, commands| {
        let point = vk::PipelineBindPoint::GRAPHICS;
        // SAFETY: see the crate.
        unsafe {
            device.cmd_bind_pipeline(commands, point, scene.pipeline.raw);
            device.cmd_bind_vertex_buffers(commands, 0, &[scene.splats.raw], &[0]);
        }
        draws(device, commands);
    });
    let nothing = executed(&scene, &[&blind], |_, commands| {
        // SAFETY: see the crate.
        unsafe { own.cmd_set_gaussian_cameras(commands, &[camera()]) };
    });
    assert!(nothing == vec![BEHIND; (WIDTH * HEIGHT) as usize]);
    let heard = scene.gpu.message_texts().concat();
    assert!(heard.contains("no camera is set"), "{heard}");
    // Nor is a secondary's the primary's after it was executed.
    scene.gpu.run(|recording| {
        let (device, commands) = recording.raw();
        let flags = vk::RenderingFlags::CONTENTS_SECONDARY_COMMAND_BUFFERS;
        scene.bind(device, commands);
        pass_with(flags, device, commands, &scene.image, BEHIND, || {
            // SAFETY: see the crate.
            unsafe { device.cmd_execute_commands(commands, &[whole.raw]) };
        });
        pass(device, commands, &scene.image, BEHIND, || {
            let point = vk::PipelineBindPoint::GRAPHICS;
            // SAFETY: see the crate.
            unsafe {
                device.cmd_bind_pipeline(commands, point, scene.pipeline.raw);
                device.cmd_bind_vertex_buffers(commands, 0, &[scene.splats.raw], &[0]);
            }
            draws(device, commands);
        });
    });
    assert!(scene.pixels() == nothing);
}

#[gaurast_runner::test]
fn integer_attachments_are_left_as_they_are() {
    let format = vk::Format::R8G8B8A8_UINT;
    let request = Graphics { formats: vec![format], ..splats() };
    let mut scene = Scene::new(&gaussians(), &request);
    scene.image = image(&scene.gpu, format, [WIDTH, HEIGHT]);
    let draw = |device: &ash::Device, commands| {
        // SAFETY: see the crate.
        unsafe { device.cmd_draw(commands, 3, 1, 0, 0) };
    };
    let clear = [7, 9, 11, 13].map(f32::from_bits);
    scene.gpu.run(|recording| {
        let (device, commands) = recording.raw();
        pass(device, commands, &scene.image, clear, || {
            scene.bind(device, commands);
            draw(device, commands);
        });
    });
    let texels: Vec<[u8; 4]> = scene.image.colors();
    assert!(texels.iter().all(|texel| *texel == [7, 9, 11, 13]));
}

/// Light as sRGB has it.
fn encoded(light: f64) -> f64 {
    if light <= 0.003_130_8 { 12.92 * light } else { 1.055 * light.powf(1.0 / 2.4) - 0.055 }
}

/// The bytes of the picture in an attachment of a format, and what is behind it there.
fn bytes(format: vk::Format) -> Vec<[u8; 4]> {
    let request = Graphics { formats: vec![format], blend: vec![over()], ..splats() };
    let mut scene = Scene::new(&gaussians(), &request);
    let usage = vk::ImageUsageFlags::COLOR_ATTACHMENT;
    let options = ImageOptions::new(format, [WIDTH, HEIGHT], usage);
    scene.image = Image::new(&scene.gpu, &options);
    scene.gpu.run(|recording| {
        let (device, commands) = recording.raw();
        pass(device, commands, &scene.image, BEHIND, || {
            scene.bind(device, commands);
            // SAFETY: see the crate.
            unsafe { device.cmd_draw(commands, 3, 1, 0, 0) };
        });
    });
    assert_eq!(scene.gpu.message_texts(), Vec::<String>::new());
    scene.image.colors()
}

#[gaurast_runner::test]
fn srgb_attachments_take_sums_for_light_and_others_take_them_as_they_are() {
    let request = Graphics { formats: vec![FORMAT], blend: vec![over()], ..splats() };
    let exact = picture(&request);
    let plain = bytes(vk::Format::R8G8B8A8_UNORM);
    let light = bytes(vk::Format::R8G8B8A8_SRGB);
    let mut differing = 0;
    for ((exact, plain), light) in exact.iter().zip(plain).zip(light) {
        for channel in 0..4 {
            let sum = f64::from(exact[channel]);
            let stored = if channel == 3 { sum } else { encoded(sum) };
            // What is behind was rounded, too.
            let is_near = |byte: u8, value: f64| (f64::from(byte) - 255.0 * value).abs() <= 1.6;
            assert!(is_near(plain[channel], sum), "{exact:?} {plain:?}");
            assert!(is_near(light[channel], stored), "{exact:?} {light:?}");
        }
        differing += usize::from(plain != light);
    }
    assert!(differing > 1000, "{differing}");
}

/// Each interaction in the extension's text has a row in `docs/conformance.md`, and the tests that it names exist.
#[gaurast_runner::test]
fn every_interaction_has_a_test() {
    const TEXT: &str = include_str!("../../api/spec/VK_GAURAST_gaussian_primitive_topology.adoc");
    const PAGE: &str = include_str!("../../docs/conformance.md");
    /// The files whose tests the page names.
    const SOURCES: &[&str] = &[
        include_str!("interactions.rs"),
        include_str!("determinism.rs"),
        include_str!("draws.rs"),
        include_str!("shaders.rs"),
        include_str!("../vulkan/command_buffers/life_cycle.rs"),
        include_str!("../vulkan/pipelines/libraries.rs"),
        include_str!("../vulkan/queries/pools.rs"),
        include_str!("depth_stencil.rs"),
        include_str!("viewer/stereo.rs"),
        include_str!("../layer/main.rs"),
        include_str!("../layer/samples.rs"),
        include_str!("../../driver/src/pipeline/dynamic_state.rs"),
    ];
    let stated: Vec<&str> = (TEXT.split("[[interaction-").skip(1)).filter_map(|rest| rest.split("]]").next()).collect();
    assert!(stated.len() > 20, "{stated:?}");
    let rows = PAGE.lines().filter_map(|line| {
        let (anchor, tests) = line.strip_prefix("| `interaction-")?.split_once("` | ")?;
        Some((anchor, tests))
    });
    let rows: Vec<_> = rows.collect();
    let tested: Vec<&str> = rows.iter().map(|(anchor, _)| *anchor).collect();
    assert_eq!(tested, stated, "one row for each, in order");
    for (anchor, tests) in rows {
        let names = tests.split('`').skip(1).step_by(2);
        let names: Vec<_> = names.filter(|name| *name != "interactions").collect();
        assert!(!names.is_empty(), "{anchor}");
        for name in names {
            let function = format!("fn {name}(");
            assert!(SOURCES.iter().any(|source| source.contains(&function)), "{name}");
        }
    }
}
