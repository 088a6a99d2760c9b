//! The extension beside state and features that are made for triangles, and the colours in attachments.

use crate::devices::image;
use crate::scene::{FORMAT, HEIGHT, Scene, Splat, WIDTH, over, splat, splats};
use ash::vk;
use gaurast_testkit::{Buffer, Graphics, Image, ImageOptions};

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

#[gaurast_runner::test]
fn state_of_triangles_has_no_effect() {
    let expected = picture(&splats());
    let raster = splats().raster;
    for (name, raster) in [
        (
            "culling",
            raster
                .cull_mode(vk::CullModeFlags::FRONT_AND_BACK)
                .front_face(vk::FrontFace::CLOCKWISE),
        ),
        (
            "depth bias",
            raster
                .depth_bias_enable(true)
                .depth_bias_constant_factor(1e6)
                .depth_bias_slope_factor(1e6),
        ),
        ("width", raster.line_width(1.0)),
    ] {
        let request = Graphics { raster, ..splats() };
        assert!(picture(&request) == expected, "{name}");
    }
}

#[gaurast_runner::test]
fn rasterization_is_not_discarded() {
    let gpu = crate::devices::open();
    let request = Graphics {
        raster: splats().raster.rasterizer_discard_enable(true),
        ..splats()
    };
    let refused = request.create(&gpu).expect_err("it is refused");
    assert_eq!(refused, vk::Result::ERROR_FEATURE_NOT_PRESENT);
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

#[gaurast_runner::test]
fn integer_attachments_are_left_as_they_are() {
    let format = vk::Format::R8G8B8A8_UINT;
    let request = Graphics {
        formats: vec![format],
        ..splats()
    };
    let mut scene = Scene::new(&gaussians(), &request);
    scene.image = image(&scene.gpu, format, [WIDTH, HEIGHT]);
    let draw = |device: &ash::Device, commands| {
        // SAFETY: see the crate.
        unsafe { device.cmd_draw(commands, 3, 1, 0, 0) };
    };
    let clear = [7, 9, 11, 13].map(f32::from_bits);
    scene.gpu.run(|recording| {
        let (device, commands) = recording.raw();
        crate::scene::pass(device, commands, &scene.image, clear, || {
            scene.bind(device, commands);
            draw(device, commands);
        });
    });
    let texels: Vec<[u8; 4]> = scene.image.colors();
    assert!(texels.iter().all(|texel| *texel == [7, 9, 11, 13]));
}

/// Light as sRGB has it.
fn encoded(light: f64) -> f64 {
    if light <= 0.003_130_8 {
        12.92 * light
    } else {
        1.055 * light.powf(1.0 / 2.4) - 0.055
    }
}

/// The bytes of the picture in an attachment of a format, and what is behind it there.
fn bytes(format: vk::Format) -> Vec<[u8; 4]> {
    let request = Graphics {
        formats: vec![format],
        blend: vec![over()],
        ..splats()
    };
    let mut scene = Scene::new(&gaussians(), &request);
    let usage = vk::ImageUsageFlags::COLOR_ATTACHMENT;
    let options = ImageOptions::new(format, [WIDTH, HEIGHT], usage);
    scene.image = Image::new(&scene.gpu, &options);
    scene.gpu.run(|recording| {
        let (device, commands) = recording.raw();
        crate::scene::pass(device, commands, &scene.image, BEHIND, || {
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
    let request = Graphics {
        formats: vec![FORMAT],
        blend: vec![over()],
        ..splats()
    };
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
