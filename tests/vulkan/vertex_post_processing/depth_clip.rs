//! Near and far planes that clip, or don't, whether or not depth is clamped; a near plane at -w; and depths that shaders
//! write.

use ash::vk;
use gaurast_testkit::shader::GLSLANG;
use gaurast_testkit::{Buffer, Gpu, Pass, Pipeline, PipelineOptions, Target, TargetOptions, Vertex};

/// The red of a target that a triangle covers, at depth `z` with a w of `w` and in a viewport with these depths; `None` if it is
/// clipped.
fn red_of_triangle(gpu: &Gpu, options: &PipelineOptions<'_>, z: f32, w: f32, viewport_depths: [f32; 2]) -> Option<f32> {
    let target = Target::new(gpu, &TargetOptions { size: [4, 4], ..TargetOptions::of(vk::Format::R32_SFLOAT) });
    let pipeline = Pipeline::new(gpu, &target, options);
    let vertex = |x: f32, y: f32| Vertex { position: [w * x, w * y, w * z, w], color: [0.0; 4] };
    let vertices = Buffer::of(gpu, &[vertex(-1.0, -1.0), vertex(3.0, -1.0), vertex(-1.0, 3.0)]);
    let pass = Pass { color: vk::ClearColorValue { float32: [100.0; 4] }, ..Pass::default() };
    gpu.run(|commands| {
        commands.pass(&target, &pass, || {
            commands.bind(&pipeline);
            commands.viewport([0.0, 0.0, 4.0, 4.0], viewport_depths);
            commands.vertices(&vertices);
            commands.draw(0..3);
        });
    });
    let found: Vec<f32> = bytemuck::pod_collect_to_vec(&target.colors[0].read(vk::ImageAspectFlags::COLOR, 4));
    assert!(found.iter().all(|depth| depth == &found[0]), "{found:?}");
    (found[0] != 100.0).then_some(found[0])
}

/// The depth that a fragment shader gets for a triangle that covers the target at depth `z`; `None` if it is clipped.
fn depth_seen(gpu: &Gpu, clamp: bool, clip: Option<bool>, z: f32) -> Option<f32> {
    let mut state =
        vk::PipelineRasterizationDepthClipStateCreateInfoEXT::default().depth_clip_enable(clip.unwrap_or(false));
    let mut raster = vk::PipelineRasterizationStateCreateInfo::default().line_width(1.0).depth_clamp_enable(clamp);
    if clip.is_some() {
        raster.p_next = std::ptr::from_mut(&mut state).cast();
    }
    let options = PipelineOptions {
        vertex: "layout(location = 0) in vec4 position;
                 layout(location = 0) out float depth;
                 void main() { gl_Position = position; depth = position.z; }",
        fragment: Some(
            "layout(location = 0) in float depth;
             layout(location = 0) out vec4 color;
             void main() { color = vec4(depth); }",
        ),
        raster,
        ..PipelineOptions::default()
    };
    red_of_triangle(gpu, &options, z, 1.0, [0.0, 1.0])
}

#[gaurast_runner::test(needs = [GLSLANG])]
fn planes_clip_as_the_pipeline_says() {
    let mut features = vk::PhysicalDeviceDepthClipEnableFeaturesEXT::default().depth_clip_enable(true);
    let gpu = Gpu::extended(&[ash::ext::depth_clip_enable::NAME], &mut features).expect("a device");
    for z in [-0.5, 1.5] {
        for (clamp, clip, drawn) in [
            (false, None, false),
            (true, None, true),
            (false, Some(true), false),
            (false, Some(false), true),
            (true, Some(true), false),
            (true, Some(false), true),
        ] {
            let seen = depth_seen(&gpu, clamp, clip, z);
            assert_eq!(seen, drawn.then_some(z), "{clamp}, {clip:?}");
        }
    }
    assert_eq!(depth_seen(&gpu, false, Some(true), 0.5), Some(0.5));
}

/// The depth of the fragments of a triangle that covers the target at depth `z` with a w of 2, in a viewport whose depths are a
/// quarter to three quarters; `None` if it is clipped.
fn depth_in_viewport(gpu: &Gpu, negative_one_to_one: bool, z: f32) -> Option<f32> {
    let options = PipelineOptions {
        vertex: "layout(location = 0) in vec4 position;
                 void main() { gl_Position = position; }",
        fragment: Some(
            "layout(location = 0) out vec4 color;
             void main() { color = vec4(gl_FragCoord.z); }",
        ),
        negative_one_to_one,
        ..PipelineOptions::default()
    };
    red_of_triangle(gpu, &options, z, 2.0, [0.25, 0.75])
}

#[gaurast_runner::test(needs = [GLSLANG])]
fn clip_space_begins_at_minus_w_where_the_pipeline_says_so() {
    let mut features = vk::PhysicalDeviceDepthClipControlFeaturesEXT::default().depth_clip_control(true);
    let gpu = Gpu::extended(&[ash::ext::depth_clip_control::NAME], &mut features).expect("a device");
    for (z, from_zero, from_minus_one) in [
        (-1.25, None, None),
        (-1.0, None, Some(0.25)),
        (-0.5, None, Some(0.375)),
        (0.0, Some(0.25), Some(0.5)),
        (0.5, Some(0.5), Some(0.625)),
        (1.0, Some(0.75), Some(0.75)),
        (1.25, None, None),
    ] {
        assert_eq!(depth_in_viewport(&gpu, false, z), from_zero, "{z}");
        assert_eq!(depth_in_viewport(&gpu, true, z), from_minus_one, "{z}");
    }
}

/// A depth test of fragments whose shader writes their depth.
#[derive(Clone, Copy)]
struct WrittenDepth {
    /// Further declarations of the fragment shader.
    declarations: &'static str,
    format: vk::Format,
    clamp: bool,
    viewport_depths: [f32; 2],
    compare: vk::CompareOp,
    cleared: f32,
}

/// Every depth passes in a floating-point attachment.
const STORED: WrittenDepth = WrittenDepth {
    declarations: "",
    format: vk::Format::D32_SFLOAT,
    clamp: false,
    viewport_depths: [0.0, 1.0],
    compare: vk::CompareOp::ALWAYS,
    cleared: 1.0,
};

/// The depth that is stored after fragments whose shader writes a depth.
fn stored_depth(gpu: &Gpu, test: WrittenDepth, written: f32) -> f32 {
    let target = Target::new(gpu, &TargetOptions { size: [4, 4], ..TargetOptions::with_depth(test.format) });
    let fragment = format!(
        "{}
        layout(location = 0) flat in float depth;
        layout(location = 0) out vec4 color;
        void main() {{ color = vec4(1); gl_FragDepth = depth; }}",
        test.declarations
    );
    let options = PipelineOptions {
        vertex: "layout(location = 0) in vec4 position;
                 layout(location = 1) in vec4 color;
                 layout(location = 0) flat out float depth;
                 void main() { gl_Position = position; depth = color.x; }",
        fragment: Some(&fragment),
        raster: vk::PipelineRasterizationStateCreateInfo::default().line_width(1.0).depth_clamp_enable(test.clamp),
        depth_stencil: vk::PipelineDepthStencilStateCreateInfo::default()
            .depth_test_enable(true)
            .depth_write_enable(true)
            .depth_compare_op(test.compare),
        ..PipelineOptions::default()
    };
    let pipeline = Pipeline::new(gpu, &target, &options);
    let vertex = |x: f32, y: f32| Vertex { position: [x, y, 0.5, 1.0], color: [written, 0.0, 0.0, 0.0] };
    let vertices = Buffer::of(gpu, &[vertex(-1.0, -1.0), vertex(3.0, -1.0), vertex(-1.0, 3.0)]);
    let pass = Pass { depth: vk::ClearDepthStencilValue { depth: test.cleared, stencil: 0 }, ..Pass::default() };
    gpu.run(|commands| {
        commands.pass(&target, &pass, || {
            commands.bind(&pipeline);
            commands.viewport([0.0, 0.0, 4.0, 4.0], test.viewport_depths);
            commands.vertices(&vertices);
            commands.draw(0..3);
        });
    });
    let depth = target.depth.as_ref().expect("it has depth");
    let found = match test.format {
        vk::Format::D16_UNORM => {
            let texels = depth.read(vk::ImageAspectFlags::DEPTH, 2);
            let texels = bytemuck::pod_collect_to_vec::<_, u16>(&texels);
            texels.iter().map(|&it| f32::from(it) / 65_535.0).collect()
        }
        _ => bytemuck::pod_collect_to_vec::<_, f32>(&depth.read(vk::ImageAspectFlags::DEPTH, 4)),
    };
    assert!(found.iter().all(|depth| depth == &found[0]), "{found:?}");
    found[0]
}

#[gaurast_runner::test(needs = [GLSLANG])]
fn depths_are_clamped_to_zero_and_one() {
    let mut features = vk::PhysicalDeviceDepthClampZeroOneFeaturesEXT::default().depth_clamp_zero_one(true);
    let gpu = Gpu::extended(&[ash::ext::depth_clamp_zero_one::NAME], &mut features).expect("a device");
    for (written, unclamped, clamped) in
        [(-0.5, 0.0, 0.25), (0.125, 0.125, 0.25), (0.5, 0.5, 0.5), (0.875, 0.875, 0.75), (1.5, 1.0, 0.75)]
    {
        assert_eq!(stored_depth(&gpu, STORED, written), unclamped);
        let within = WrittenDepth { clamp: true, viewport_depths: [0.75, 0.25], ..STORED };
        assert_eq!(stored_depth(&gpu, within, written), clamped);
    }
}

/// A device whose floating-point depths are unrestricted, and whose others are clamped to 0 and 1.
fn unrestricted() -> Gpu {
    let mut features = vk::PhysicalDeviceDepthClampZeroOneFeaturesEXT::default().depth_clamp_zero_one(true);
    let extensions = [ash::ext::depth_clamp_zero_one::NAME, ash::ext::depth_range_unrestricted::NAME];
    Gpu::extended(&extensions, &mut features).expect("a device")
}

#[gaurast_runner::test(needs = [GLSLANG])]
fn depths_of_floats_are_unrestricted() {
    let gpu = unrestricted();
    let within = WrittenDepth { clamp: true, viewport_depths: [3.0, -2.0], ..STORED };
    let integers = WrittenDepth { format: vk::Format::D16_UNORM, ..STORED };
    for (written, clamped, of_integers) in
        [(-7.5, -2.0, 0.0), (-0.5, -0.5, 0.0), (1.0, 1.0, 1.0), (1.5, 1.5, 1.0), (1e9, 3.0, 1.0)]
    {
        assert_eq!(stored_depth(&gpu, STORED, written), written);
        assert_eq!(stored_depth(&gpu, within, written), clamped);
        assert_eq!(stored_depth(&gpu, integers, written), of_integers);
    }
    for (written, cleared) in [(-2.0, -1.0), (-1.0, -2.0), (-1.0, 0.5), (0.5, -1.0)] {
        for (compare, passes) in [(vk::CompareOp::LESS, written < cleared), (vk::CompareOp::GREATER, written > cleared)]
        {
            let test = WrittenDepth { compare, cleared, ..STORED };
            let expected = if passes { written } else { cleared };
            assert_eq!(stored_depth(&gpu, test, written), expected, "{cleared}");
        }
    }
}

#[gaurast_runner::test(needs = [GLSLANG])]
fn viewports_reach_beyond_zero_and_one() {
    let gpu = unrestricted();
    let options = PipelineOptions {
        vertex: "layout(location = 0) in vec4 position;
                 void main() { gl_Position = position; }",
        fragment: Some(
            "layout(location = 0) out vec4 color;
             void main() { color = vec4(gl_FragCoord.z); }",
        ),
        ..PipelineOptions::default()
    };
    for (z, depth) in [(0.0, -4.0), (0.25, -2.0), (0.75, 2.0), (1.0, 4.0)] {
        assert_eq!(red_of_triangle(&gpu, &options, z, 1.0, [-4.0, 4.0]), Some(depth));
    }
    assert_eq!(red_of_triangle(&gpu, &options, 1.25, 1.0, [-4.0, 4.0]), None);
}

/// Shaders with both early and late tests write depths on one side of the primitive's, which is 0.5. The late tests
/// decide.
#[gaurast_runner::test(needs = [GLSLANG])]
fn late_tests_decide_after_early_ones() {
    const LESS: &str = "#extension GL_EXT_spirv_intrinsics : require
        spirv_execution_mode(extensions = [\"SPV_AMD_shader_early_and_late_fragment_tests\"], 5017);
        layout(depth_less) out float gl_FragDepth;";
    const GREATER: &str = "#extension GL_EXT_spirv_intrinsics : require
        spirv_execution_mode(extensions = [\"SPV_AMD_shader_early_and_late_fragment_tests\"], 5017);
        layout(depth_greater) out float gl_FragDepth;";
    let mut features = vk::PhysicalDeviceShaderEarlyAndLateFragmentTestsFeaturesAMD::default()
        .shader_early_and_late_fragment_tests(true);
    let gpu = Gpu::extended(&[ash::amd::shader_early_and_late_fragment_tests::NAME], &mut features).expect("a device");
    for (declarations, written) in [(LESS, 0.25), (GREATER, 0.75)] {
        // On both sides of the written depth, and beyond the primitive's.
        for cleared in [0.125, 0.375, 0.625, 0.875] {
            for (compare, passes) in [
                (vk::CompareOp::LESS, written < cleared),
                (vk::CompareOp::GREATER, written > cleared),
                (vk::CompareOp::NOT_EQUAL, true),
                (vk::CompareOp::EQUAL, false),
            ] {
                let test = WrittenDepth { declarations, compare, cleared, ..STORED };
                let expected = if passes { written } else { cleared };
                let found = stored_depth(&gpu, test, written);
                assert_eq!(found, expected, "{written} {compare:?} {cleared}");
            }
        }
    }
}
