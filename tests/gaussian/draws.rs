//! Gaussian draws, from pipeline and camera to pixels.

use ash::vk;
use gaurast_testkit::devices::gaussian;
use gaurast_testkit::scene::{CENTER, Scene, Splat, assert_close, at, over, pass, premultiplied, splat, splats};
use gaurast_testkit::{Buffer, Graphics};

const RED: [f32; 3] = [0.9, 0.2, 0.1];
const BLUE: [f32; 3] = [0.1, 0.3, 0.8];

fn scene(gaussians: &[Splat]) -> Scene {
    Scene::new(gaussians, &splats())
}

#[gaurast_runner::test]
fn a_gaussian_is_brightest_at_its_mean() {
    let scene = scene(&[splat([0.0, 0.0, 5.0], 0.1, 0.8, RED)]);
    let pixels = scene.draw([0.0; 4], |device, commands| {
        // SAFETY: see the crate.
        unsafe { device.cmd_draw(commands, 1, 1, 0, 0) };
    });
    let (x, y) = CENTER;
    assert_close(at(&pixels, CENTER), premultiplied(RED, 0.8));
    // One pixel from the centre, the variance is (100 * 0.1 / 5)^2 + 0.3.
    let alpha = 0.8 * (-0.5f32 / 4.3).exp();
    assert_close(at(&pixels, (x + 1, y)), premultiplied(RED, alpha));
    assert_close(at(&pixels, (x, y - 1)), premultiplied(RED, alpha));
    assert_eq!(at(&pixels, (0, 0)), [0.0; 4]);
    assert_eq!(scene.gpu.message_texts(), Vec::<String>::new());
}

#[gaurast_runner::test]
fn alpha_becomes_coverage_without_a_fragment_stage() {
    let gaussians = [splat([0.0, 0.0, 9.0], 0.3, 0.9, BLUE), splat([0.0, 0.0, 5.0], 0.1, 0.5, RED)];
    let clear = [0.2, 0.4, 0.6, 0.0];
    let [plain, covering] = [false, true].map(|alpha_to_coverage| {
        let request = Graphics {
            multisample: splats()
                .multisample
                .alpha_to_coverage_enable(alpha_to_coverage)
                .alpha_to_one_enable(alpha_to_coverage),
            ..splats()
        };
        let scene = Scene::new(&gaussians, &request);
        let pixels = scene.draw(clear, |device, commands| {
            // SAFETY: see the crate.
            unsafe { device.cmd_draw(commands, 2, 1, 0, 0) };
        });
        assert_eq!(scene.gpu.message_texts(), Vec::<String>::new());
        pixels
    });
    let (mut covered, mut left) = (0, 0);
    for (&[r, g, b, alpha], &found) in plain.iter().zip(&covering) {
        // With one sample, pixels that are at least half covered are written.
        if alpha >= 0.51 {
            assert_eq!(found, [r, g, b, 1.0]);
            covered += 1;
        } else if alpha <= 0.49 {
            assert_eq!(found, clear);
            left += u32::from(alpha > 0.0);
        }
    }
    assert!(covered > 20 && left > 20, "{covered} {left}");
}

#[gaurast_runner::test]
fn gaussians_are_sorted_and_blended_over_the_background() {
    let gaussians = [splat([0.0, 0.0, 9.0], 0.1, 0.6, BLUE), splat([0.0, 0.0, 5.0], 0.1, 0.5, RED)];
    let request = Graphics { blend: vec![over()], ..splats() };
    let scene = Scene::new(&gaussians, &request);
    let clear = [0.2, 0.4, 0.6, 1.0];
    let pixels = scene.draw(clear, |device, commands| {
        // SAFETY: see the crate.
        unsafe { device.cmd_draw(commands, 2, 1, 0, 0) };
    });
    let [r, g, b]: [f32; 3] = std::array::from_fn(|i| 0.5 * RED[i] + 0.5 * 0.6 * BLUE[i] + 0.5 * 0.4 * clear[i]);
    assert_close(at(&pixels, CENTER), [r, g, b, 1.0]);
    assert_eq!(at(&pixels, (0, 0)), clear);
}

#[gaurast_runner::test]
fn blend_constants_may_be_dynamic() {
    let blend =
        over().src_color_blend_factor(vk::BlendFactor::CONSTANT_COLOR).dst_color_blend_factor(vk::BlendFactor::ZERO);
    let mut request = Graphics { blend: vec![blend], blend_constants: [1.0; 4], ..splats() };
    request.dynamic.push(vk::DynamicState::BLEND_CONSTANTS);
    let scene = Scene::new(&[splat([0.0, 0.0, 5.0], 0.1, 0.5, RED)], &request);
    let pixels = scene.draw([0.0; 4], |device, commands| {
        // SAFETY: see the crate.
        unsafe {
            device.cmd_set_blend_constants(commands, &[0.5, 0.25, 0.0, 1.0]);
            device.cmd_draw(commands, 1, 1, 0, 0);
        }
    });
    let expected = [RED[0] * 0.25, RED[1] * 0.125, 0.0, 0.5];
    assert_close(at(&pixels, CENTER), expected);
}

#[gaurast_runner::test]
fn a_negative_viewport_height_draws_the_same_picture() {
    let scene = scene(&[splat([0.1, 0.4, 5.0], 0.1, 0.8, RED)]);
    let draw = |y: f32, height: f32| {
        scene.draw([0.0; 4], |device, commands| {
            let viewports = [vk::Viewport { x: 0.0, y, width: 64.0, height, min_depth: 0.0, max_depth: 1.0 }];
            // SAFETY: see the crate.
            unsafe {
                device.cmd_set_viewport(commands, 0, &viewports);
                device.cmd_draw(commands, 1, 1, 0, 0);
            }
        })
    };
    let upright = draw(0.0, 48.0);
    assert_close(at(&upright, (34, 32)), premultiplied(RED, 0.8));
    assert!(upright == draw(48.0, -48.0));
}

#[gaurast_runner::test]
fn the_scissor_cuts_and_does_not_move() {
    let scene = scene(&[splat([0.0, 0.0, 5.0], 0.1, 0.8, RED)]);
    let draw = |scissor: Option<vk::Rect2D>| {
        scene.draw([0.0; 4], |device, commands| {
            // SAFETY: see the crate.
            unsafe {
                if let Some(scissor) = scissor {
                    device.cmd_set_scissor(commands, 0, &[scissor]);
                }
                device.cmd_draw(commands, 1, 1, 0, 0);
            }
        })
    };
    let whole = draw(None);
    let cut = draw(Some(vk::Rect2D {
        offset: vk::Offset2D { x: 32, y: 20 },
        extent: vk::Extent2D { width: 3, height: 100 },
    }));
    for y in 0..48 {
        for x in 0..64 {
            let inside = (32..35).contains(&x) && y >= 20;
            let expected = if inside { at(&whole, (x, y)) } else { [0.0; 4] };
            assert_eq!(at(&cut, (x, y)), expected, "{x}, {y}");
        }
    }
}

#[gaurast_runner::test]
fn an_index_buffer_picks_gaussians() {
    let scene = scene(&[splat([0.0, 0.0, 5.0], 0.1, 0.5, RED), splat([0.0, 0.0, 5.0], 0.1, 0.7, BLUE)]);
    let indices = Buffer::of(&scene.gpu, &[9u16, 0, 0, 7]);
    let pixels = scene.draw([0.0; 4], |device, commands| {
        // SAFETY: see the crate.
        unsafe {
            device.cmd_bind_index_buffer(commands, indices.raw, 2, vk::IndexType::UINT16);
            device.cmd_draw_indexed(commands, 1, 1, 1, 1, 0);
        }
    });
    assert_close(at(&pixels, CENTER), premultiplied(BLUE, 0.7));
}

#[gaurast_runner::test]
fn instances_move_gaussians_by_attributes_of_their_own() {
    // The position advances by instance, all other attributes by vertex.
    let mut request = splats();
    request.bindings.push(vk::VertexInputBindingDescription {
        binding: 5,
        stride: 12,
        input_rate: vk::VertexInputRate::INSTANCE,
    });
    request.attributes[0].binding = 5;
    let scene = Scene::new(&[splat([f32::NAN; 3], 0.02, 0.8, RED)], &request);
    let positions = [[0.0f32, 0.0, -1.0], [-1.0, 0.0, 5.0], [1.0, 0.0, 5.0]];
    let positions = Buffer::of(&scene.gpu, positions.as_flattened());
    let pixels = scene.draw([0.0; 4], |device, commands| {
        // SAFETY: see the crate.
        unsafe {
            device.cmd_bind_vertex_buffers(commands, 5, &[positions.raw], &[0]);
            device.cmd_draw(commands, 1, 2, 0, 1);
        }
    });
    let (x, y) = CENTER;
    assert_close(at(&pixels, (x - 20, y)), premultiplied(RED, 0.8));
    assert_close(at(&pixels, (x + 20, y)), premultiplied(RED, 0.8));
    assert_eq!(at(&pixels, CENTER), [0.0; 4]);
}

/// Instances beyond the first two share a position by a divisor of 2; with a divisor of 0 all have the first.
#[gaurast_runner::test]
fn divisors_act_on_attributes_of_gaussians() {
    let (x, y) = CENTER;
    for (divisor, instances, seen) in [(2, 4, [true, true]), (2, 2, [true, false]), (0, 4, [true, false])] {
        let mut request = splats();
        request.bindings.push(vk::VertexInputBindingDescription {
            binding: 5,
            stride: 12,
            input_rate: vk::VertexInputRate::INSTANCE,
        });
        request.divisors.push(vk::VertexInputBindingDivisorDescriptionKHR { binding: 5, divisor });
        request.attributes[0].binding = 5;
        let scene = Scene::new(&[splat([f32::NAN; 3], 0.02, 0.8, RED)], &request);
        let positions = [[-1.0f32, 0.0, 5.0], [1.0, 0.0, 5.0]];
        let positions = Buffer::of(&scene.gpu, positions.as_flattened());
        let pixels = scene.draw([0.0; 4], |device, commands| {
            // SAFETY: see the crate.
            unsafe {
                device.cmd_bind_vertex_buffers(commands, 5, &[positions.raw], &[0]);
                device.cmd_draw(commands, 1, instances, 0, 0);
            }
        });
        let shows = [x - 20, x + 20].map(|x| at(&pixels, (x, y)) != [0.0; 4]);
        assert_eq!(shows, seen, "{divisor}, {instances}");
    }
}

#[gaurast_runner::test]
fn indirect_draws_read_their_numbers_when_they_execute() {
    let scene = scene(&[splat([0.0, 0.0, 5.0], 0.1, 0.5, RED), splat([0.0, 0.0, 5.0], 0.1, 0.7, BLUE)]);
    let numbers = Buffer::of(&scene.gpu, &[0u32; 5]);
    let indices = Buffer::of(&scene.gpu, &[1u32, 0]);
    let commands = scene
        .gpu
        .try_record(|recording| {
            let (device, commands) = recording.raw();
            pass(device, commands, &scene.image, [0.0; 4], || {
                scene.bind(device, commands);
                let buffer = indices.raw;
                // SAFETY: see the crate.
                unsafe {
                    device.cmd_bind_index_buffer(commands, buffer, 0, vk::IndexType::UINT32);
                    device.cmd_draw_indexed_indirect(commands, numbers.raw, 0, 1, 20);
                }
            });
        })
        .unwrap();
    for (now, expected) in [
        ([0u32, 0, 0, 0, 0], [0.0; 4]),
        ([1, 1, 0, 0, 0], premultiplied(BLUE, 0.7)),
        ([1, 1, 1, 0, 0], premultiplied(RED, 0.5)),
    ] {
        numbers.write(&now);
        commands.submit();
        assert_close(at(&scene.pixels(), CENTER), expected);
    }
}

#[gaurast_runner::test]
fn the_number_of_indirect_draws_may_lie_in_a_buffer() {
    let scene = scene(&[splat([-1.0, 0.0, 5.0], 0.02, 0.5, RED), splat([1.0, 0.0, 5.0], 0.02, 0.7, BLUE)]);
    let numbers = Buffer::of(&scene.gpu, &[1u32, 1, 0, 0, 1, 1, 1, 0]);
    for (count, drawn) in [(0u32, [false, false]), (1, [true, false]), (9, [true, true])] {
        let count = Buffer::of(&scene.gpu, &[count]);
        let pixels = scene.draw([0.0; 4], |device, commands| {
            let (numbers, count) = (numbers.raw, count.raw);
            // SAFETY: see the crate.
            unsafe { device.cmd_draw_indirect_count(commands, numbers, 0, count, 0, 2, 16) };
        });
        let (x, y) = CENTER;
        let [left, right] = [at(&pixels, (x - 20, y)), at(&pixels, (x + 20, y))];
        assert_eq!([left[3] > 0.4, right[3] > 0.6], drawn);
    }
}

#[gaurast_runner::test]
fn a_draw_without_a_camera_draws_nothing_and_says_so() {
    let scene = scene(&[splat([0.0, 0.0, 5.0], 0.1, 0.8, RED)]);
    scene.gpu.run(|recording| {
        let (device, commands) = recording.raw();
        pass(device, commands, &scene.image, [0.25; 4], || {
            // SAFETY: see the crate.
            unsafe {
                let pipeline = scene.pipeline.raw;
                device.cmd_bind_pipeline(commands, vk::PipelineBindPoint::GRAPHICS, pipeline);
                device.cmd_bind_vertex_buffers(commands, 0, &[scene.splats.raw], &[0]);
                device.cmd_draw(commands, 1, 1, 0, 0);
            }
        });
    });
    assert!(scene.pixels().iter().all(|pixel| *pixel == [0.25; 4]));
    let messages = scene.gpu.message_texts().concat();
    assert!(messages.contains("vkCmdSetGaussianCamerasGAURAST"), "{messages}");
}

#[gaurast_runner::test]
fn a_camera_that_is_none_fails_the_recording() {
    let scene = scene(&[splat([0.0, 0.0, 5.0], 0.1, 0.8, RED)]);
    let camera = gaurast_testkit::scene::camera().near_plane(-1.0);
    let recorded = scene.gpu.try_record(|recording| {
        let (_, commands) = recording.raw();
        // SAFETY: see the crate.
        unsafe {
            let gaussian = gaussian(&scene.gpu);
            gaussian.cmd_set_gaussian_cameras(commands, &[camera]);
        }
    });
    assert_eq!(recorded.unwrap_err(), vk::Result::ERROR_VALIDATION_FAILED_EXT);
    assert!(scene.gpu.message_texts().concat().contains("nearPlane"));
}
