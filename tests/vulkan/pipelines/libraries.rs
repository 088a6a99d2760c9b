//! Graphics pipeline libraries: pipelines that are linked of parts draw what pipelines that are created at once do.

use std::sync::LazyLock;

use ash::vk;
use gaurast::vk::{
    DYNAMIC_STATE_GAUSSIAN_ALPHA_FLOOR_GAURAST, GaussianResolveInputLocationsGAURAST,
    PipelineGaussianStateCreateInfoGAURAST,
};
use gaurast_oracle::scenes;
use gaurast_runner::Case;
use gaurast_testkit::devices::own;
use gaurast_testkit::settings::strictly;
use gaurast_testkit::shader::GLSLANG;
use gaurast_testkit::shader::{Stage, compile};
use gaurast_testkit::{
    Attachments, Bindings, Buffer, Commands, FRAGMENT, GaussianOptions, GaussianScene, Gpu, Graphics, Output, Pass,
    Pipeline, Resource, Shader, Target, TargetOptions, VERTEX, Vertex, attribute, binding, blend, depth_test, over,
};
use vk::GraphicsPipelineLibraryFlagsEXT as Parts;
use vk::PipelineCreateFlags as Flags;

const ALL: [Parts; 4] = [
    Parts::VERTEX_INPUT_INTERFACE,
    Parts::PRE_RASTERIZATION_SHADERS,
    Parts::FRAGMENT_SHADER,
    Parts::FRAGMENT_OUTPUT_INTERFACE,
];

const SIZE: [u32; 2] = [48, 32];

/// A device with the extension.
fn device() -> &'static Gpu {
    static DEVICE: LazyLock<Gpu> = LazyLock::new(|| {
        let mut features =
            vk::PhysicalDeviceGraphicsPipelineLibraryFeaturesEXT::default().graphics_pipeline_library(true);
        let names = [ash::khr::pipeline_library::NAME, ash::ext::graphics_pipeline_library::NAME];
        Gpu::extended(&names, &mut features).expect("a device")
    });
    &DEVICE
}

/// A library of parts.
fn library<'a>(graphics: &Graphics<'a>, parts: Parts) -> Graphics<'a> {
    Graphics { flags: graphics.flags | Flags::LIBRARY_KHR, parts: Some(parts), ..graphics.clone() }
}

/// A pipeline that links libraries, and has no parts of its own.
fn link<'a>(graphics: &Graphics<'a>, libraries: &[Pipeline]) -> Graphics<'a> {
    Graphics {
        parts: Some(Parts::empty()),
        libraries: libraries.iter().map(|library| library.raw).collect(),
        shaders: Vec::new(),
        ..graphics.clone()
    }
}

/// Creates it, or panics with the driver's messages.
fn create(gpu: &Gpu, graphics: &Graphics<'_>) -> Pipeline {
    let created = graphics.create(gpu);
    created.unwrap_or_else(|error| panic!("{error:?}: {:?}", gpu.message_texts()))
}

/// A pipeline that is linked of a library for each element of `split`. The libraries are destroyed.
fn linked(gpu: &Gpu, graphics: &Graphics<'_>, split: &[Parts]) -> Pipeline {
    let parts = split.iter();
    let libraries: Vec<_> = parts.map(|&parts| create(gpu, &library(graphics, parts))).collect();
    create(gpu, &link(graphics, &libraries))
}

/// The splits of a pipeline into libraries.
fn splits() -> Vec<Vec<Parts>> {
    let [input, vertex, fragment, output] = ALL;
    vec![
        ALL.to_vec(),
        vec![output, fragment, input, vertex],
        vec![input | vertex, fragment | output],
        vec![input | output, vertex | fragment],
        vec![input, vertex | fragment | output],
        vec![output, input | vertex | fragment],
    ]
}

fn target(gpu: &Gpu) -> Target {
    let options =
        TargetOptions { size: SIZE, ..TargetOptions::with_depth(vk::Format::D32_SFLOAT_S8_UINT).multisampled() };
    Target::new(gpu, &options)
}

fn vertex(source: &str) -> Shader {
    Shader::vertex(compile(Stage::Vertex, source))
}

fn fragment(source: &str) -> Shader {
    Shader::fragment(compile(Stage::Fragment, source))
}

/// Two crossing triangles, of which one is a mirror image, and a third vertex for a strip.
fn triangles() -> Vec<Vertex> {
    let vertex = |x: f32, y: f32, z: f32, color: [f32; 4]| Vertex { position: [x, y, z, 1.0], color };
    let (red, green, blue) = ([1.0, 0.3, 0.0, 0.5], [0.0, 0.8, 0.4, 0.75], [0.1, 0.2, 0.9, 0.6]);
    vec![
        vertex(-0.9, -0.8, 0.3, red),
        vertex(0.9, -0.7, 0.6, green),
        vertex(-0.6, 0.9, 0.5, blue),
        vertex(0.7, 0.8, 0.4, green),
        vertex(-0.8, 0.1, 0.4, red),
        vertex(0.5, -0.9, 0.7, blue),
    ]
}

/// A pipeline of which each part has other state than the defaults.
fn plain(target: &Target) -> Graphics<'static> {
    let formats = target.attachment_formats();
    Graphics {
        shaders: vec![vertex(VERTEX), fragment(FRAGMENT)],
        bindings: vec![binding(0, size_of::<Vertex>() as u32)],
        attributes: vec![
            attribute(0, vk::Format::R32G32B32A32_SFLOAT, 0),
            attribute(1, vk::Format::R32G32B32A32_SFLOAT, 16),
        ],
        multisample: vk::PipelineMultisampleStateCreateInfo::default()
            .rasterization_samples(vk::SampleCountFlags::from_raw(formats.samples)),
        depth_stencil: depth_test(vk::CompareOp::LESS),
        formats: formats.colors,
        depth_format: formats.depth,
        ..Graphics::default()
    }
}

/// A pipeline that differs from [`plain`] in each part.
fn other(target: &Target) -> Graphics<'static> {
    let moved = "
        layout(constant_id = 3) const float SHIFT = 0.0;
        layout(location = 0) in vec4 position;
        layout(location = 1) in vec4 color;
        layout(location = 0) out vec4 v_color;
        void main() { gl_Position = position + vec4(SHIFT, 0.0, 0.0, 0.0); v_color = color; }";
    let striped = "
        layout(constant_id = 3) const float DARK = 0.0;
        layout(location = 0) in vec4 v_color;
        layout(location = 0) out vec4 color;
        void main() { color = int(gl_FragCoord.y) % 4 == 0 ? v_color : DARK * v_color; }";
    let constants = |value: f32| vec![(3, value.to_bits())];
    let face = vk::StencilOpState {
        pass_op: vk::StencilOp::INCREMENT_AND_CLAMP,
        compare_op: vk::CompareOp::ALWAYS,
        compare_mask: 0xFF,
        write_mask: 0xFF,
        ..Default::default()
    };
    let plain = plain(target);
    Graphics {
        shaders: vec![
            Shader { constants: constants(0.2), ..vertex(moved) },
            Shader { constants: constants(0.5), ..fragment(striped) },
        ],
        topology: vk::PrimitiveTopology::TRIANGLE_STRIP,
        raster: plain.raster.cull_mode(vk::CullModeFlags::BACK).front_face(vk::FrontFace::CLOCKWISE),
        depth_stencil: depth_test(vk::CompareOp::GREATER).stencil_test_enable(true).front(face).back(face),
        sample_mask: Some(0b0111),
        blend: vec![blend(vk::BlendFactor::CONSTANT_COLOR, vk::BlendFactor::ONE, vk::BlendOp::ADD)],
        blend_constants: [0.9, 0.7, 0.5, 0.3],
        ..plain
    }
}

/// The first pipeline with parts of the second.
fn mixed<'a>(one: &Graphics<'a>, second: &Graphics<'a>, parts: Parts) -> Graphics<'a> {
    let [input, vertex, fragment, output] = ALL.map(|part| if parts.contains(part) { second } else { one });
    let shader = |of: &Graphics<'_>, stage| {
        let mut shaders = of.shaders.iter();
        shaders.find(|shader| shader.stage == stage).cloned()
    };
    let shaders = [shader(vertex, vk::ShaderStageFlags::VERTEX), shader(fragment, vk::ShaderStageFlags::FRAGMENT)];
    Graphics {
        shaders: shaders.into_iter().flatten().collect(),
        topology: input.topology,
        raster: vertex.raster,
        depth_stencil: fragment.depth_stencil,
        sample_mask: output.sample_mask,
        blend: output.blend.clone(),
        blend_constants: output.blend_constants,
        ..one.clone()
    }
}

/// The picture of the triangles, with a depth between theirs at first.
fn draw(gpu: &Gpu, pipeline: &Pipeline, record: impl FnOnce(&Commands)) -> Output {
    draw_to(gpu, &target(gpu), pipeline, record)
}

fn draw_to(gpu: &Gpu, target: &Target, pipeline: &Pipeline, record: impl FnOnce(&Commands)) -> Output {
    let vertices = Buffer::of(gpu, &triangles());
    let pass = Pass { depth: vk::ClearDepthStencilValue { depth: 0.48, stencil: 3 }, ..Pass::default() };
    target.draw(gpu, &pass, |commands| {
        commands.bind(pipeline);
        commands.vertices(&vertices);
        record(commands);
        commands.draw(0..6);
    })
}

fn picture(gpu: &Gpu, pipeline: &Pipeline) -> Output {
    draw(gpu, pipeline, |_| {})
}

/// Every mixture of the parts of two pipelines gives another picture, and linking gives the same.
#[gaurast_runner::test(needs = [GLSLANG])]
fn each_part_is_that_of_its_library() {
    let gpu = device();
    let target = target(gpu);
    let (plain, other) = (plain(&target), other(&target));
    let libraries = |graphics| ALL.map(|part| create(gpu, &library(graphics, part)));
    let of = [libraries(&plain), libraries(&other)];
    let mut pictures: Vec<Output> = Vec::new();
    for bits in 0..16 {
        let parts = Parts::from_raw(bits);
        let expected = picture(gpu, &create(gpu, &mixed(&plain, &other, parts)));
        assert!(expected.shows_something());
        assert!(!pictures.contains(&expected), "{parts:?} makes no difference");
        let chosen = ALL.iter().enumerate().map(|(index, part)| {
            let library = usize::from(parts.contains(*part));
            of[library][index].raw
        });
        let linked = Graphics { libraries: chosen.collect(), ..link(&plain, &[]) };
        assert!(picture(gpu, &create(gpu, &linked)) == expected, "{parts:?}");
        pictures.push(expected);
    }
}

/// Pipelines of any split, of libraries that are destroyed, draw the same.
#[gaurast_runner::test(needs = [GLSLANG])]
fn every_split_draws_the_same() {
    let gpu = device();
    let target = target(gpu);
    let other = other(&target);
    let expected = picture(gpu, &create(gpu, &other));
    for split in splits() {
        assert!(picture(gpu, &linked(gpu, &other, &split)) == expected, "{split:?}");
        let inline =
            Graphics { inline_modules: true, flags: Flags::RETAIN_LINK_TIME_OPTIMIZATION_INFO_EXT, ..other.clone() };
        let libraries: Vec<_> = split.iter().map(|&parts| create(gpu, &library(&inline, parts))).collect();
        let optimized = Graphics { flags: Flags::LINK_TIME_OPTIMIZATION_EXT, ..link(&inline, &libraries) };
        let pipeline = create(gpu, &optimized);
        drop(libraries);
        assert!(picture(gpu, &pipeline) == expected, "{split:?}, inline");
    }
}

/// A pipeline may have parts itself, beside those of a library, and so may a library.
#[gaurast_runner::test(needs = [GLSLANG])]
fn libraries_are_made_of_libraries() {
    let gpu = device();
    let target = target(gpu);
    let other = other(&target);
    let expected = picture(gpu, &create(gpu, &other));
    let [input, vertex, fragment, output] = ALL.map(|part| library(&other, part));
    let with = |graphics: &Graphics<'_>, libraries: &[&Pipeline]| {
        let linking = Graphics { libraries: libraries.iter().map(|library| library.raw).collect(), ..graphics.clone() };
        create(gpu, &linking)
    };
    // A chain in which each library adds a part, and then the pipeline does.
    let first = with(&output, &[]);
    let second = with(&vertex, &[&first]);
    let third = with(&input, &[&second]);
    let last = Graphics { flags: Flags::empty(), ..fragment.clone() };
    let pipeline = with(&last, &[&third]);
    drop((first, second, third));
    assert!(picture(gpu, &pipeline) == expected, "a chain");
    // A tree, the inner libraries of which have no parts of their own. A structure without parts may be left out.
    let [input, vertex, fragment, output] = [input, vertex, fragment, output].map(|part| with(&part, &[]));
    let inner = Graphics { flags: Flags::LIBRARY_KHR, ..link(&other, &[]) };
    let (before, after) = (with(&inner, &[&input, &vertex]), with(&inner, &[&fragment, &output]));
    let root = Graphics { parts: None, ..link(&other, &[]) };
    // The testkit gives all state of a pipeline without the structure; it must not be read.
    assert!(picture(gpu, &with(&root, &[&before, &after])) == expected, "a tree");
}

/// Dynamic states of a part are those that its library names; what it names beside them has no effect.
#[gaurast_runner::test(needs = [GLSLANG])]
fn dynamic_states_are_those_of_their_part() {
    use vk::DynamicState as S;
    let gpu = device();
    let target = target(gpu);
    let other = other(&target);
    let expected = picture(gpu, &create(gpu, &other));
    let states = [
        (ALL[0], S::PRIMITIVE_TOPOLOGY),
        (ALL[1], S::CULL_MODE),
        (ALL[2], S::DEPTH_COMPARE_OP),
        (ALL[3], S::BLEND_CONSTANTS),
    ];
    let set = |commands: &Commands, state| {
        let (device, raw) = commands.raw();
        // SAFETY: the command buffer records.
        unsafe {
            match state {
                S::PRIMITIVE_TOPOLOGY => {
                    device.cmd_set_primitive_topology(raw, vk::PrimitiveTopology::TRIANGLE_LIST);
                }
                S::CULL_MODE => device.cmd_set_cull_mode(raw, vk::CullModeFlags::NONE),
                S::DEPTH_COMPARE_OP => {
                    device.cmd_set_depth_compare_op(raw, vk::CompareOp::ALWAYS);
                }
                _ => device.cmd_set_blend_constants(raw, &[0.1, 0.2, 0.3, 0.4]),
            }
        }
    };
    for (part, state) in states {
        let dynamic = other.clone().with_dynamic(state);
        let changed = draw(gpu, &create(gpu, &dynamic), |commands| set(commands, state));
        assert!(changed != expected, "{state:?} makes no difference");
        // The state is dynamic in the library that has its part alone, and then in all others alone.
        for own in [true, false] {
            let libraries = ALL.map(|other_part| {
                let names = (other_part == part) == own;
                let graphics = if names { &dynamic } else { &other };
                create(gpu, &library(graphics, other_part))
            });
            let pipeline = create(gpu, &link(&other, &libraries));
            let drawn = draw(gpu, &pipeline, |commands| {
                if own {
                    set(commands, state);
                }
            });
            let wanted = if own { &changed } else { &expected };
            assert!(drawn == *wanted, "{state:?}, of its part: {own}");
        }
    }
}

/// The layouts of libraries with independent sets lack the sets of other stages; the pipeline has all.
#[gaurast_runner::test(needs = [GLSLANG])]
fn independent_sets_are_united() {
    let gpu = device();
    let target = target(gpu);
    let moved = "
        layout(set = 0, binding = 0) uniform Shift { vec4 shift; };
        layout(push_constant) uniform Push { vec4 pushed; };
        layout(location = 0) in vec4 position;
        layout(location = 1) in vec4 color;
        layout(location = 0) out vec4 v_color;
        void main() { gl_Position = position + shift + pushed; v_color = color; }";
    let tinted = "
        layout(set = 2, binding = 0) uniform Tint { vec4 tint; };
        layout(location = 0) in vec4 v_color;
        layout(location = 0) out vec4 color;
        void main() { color = tint * v_color; }";
    let buffer = |values: [f32; 4]| Buffer::of(gpu, &values);
    let (shift, unused, tint) = (buffer([0.1, -0.2, 0.0, 0.0]), buffer([0.0; 4]), buffer([0.2, 1.0, 0.6, 1.0]));
    let set = |buffer: &Buffer| Bindings::new(gpu, &[Resource::Uniform(buffer.raw)]);
    let sets = [set(&shift), set(&unused), set(&tint)];
    let layouts: Vec<_> = sets.iter().map(|set| set.layout).collect();
    let null = vk::DescriptorSetLayout::null();
    let push = vk::PushConstantRange::default().stage_flags(vk::ShaderStageFlags::ALL_GRAPHICS).size(16);
    let whole = Graphics {
        shaders: vec![vertex(moved), fragment(tinted)],
        set_layouts: layouts.clone(),
        push: vec![push],
        ..other(&target)
    };
    let drawn = |pipeline: &Pipeline| {
        draw(gpu, pipeline, |commands| {
            let (device, raw) = commands.raw();
            let point = vk::PipelineBindPoint::GRAPHICS;
            for (number, set) in (0..).zip(&sets) {
                // SAFETY: the command buffer records, and the set has the layout of its number.
                unsafe {
                    let (layout, set) = (pipeline.layout, [set.set]);
                    device.cmd_bind_descriptor_sets(raw, point, layout, number, &set, &[]);
                }
            }
            commands.push(0, &[-0.05f32, 0.1, 0.0, 0.0]);
        })
    };
    let expected = drawn(&create(gpu, &whole));
    let independent = Graphics { layout_flags: vk::PipelineLayoutCreateFlags::INDEPENDENT_SETS_EXT, ..whole.clone() };
    let of = |part, set_layouts: &[vk::DescriptorSetLayout]| {
        let library = library(&independent, part);
        let graphics = Graphics { set_layouts: set_layouts.to_vec(), ..library };
        create(gpu, &graphics)
    };
    let [input, vertex, fragment, output] = ALL;
    let libraries = [
        of(input, &[]),
        of(vertex, &[layouts[0], layouts[1]]),
        of(fragment, &[null, layouts[1], layouts[2]]),
        of(output, &[]),
    ];
    let pipeline = create(gpu, &link(&independent, &libraries));
    drop(libraries);
    assert!(drawn(&pipeline) == expected);
    // A set that no stage uses may be null.
    let drawn_at_once = draw(gpu, &pipeline, |commands| {
        let (device, raw) = commands.raw();
        let handles = [sets[0].set, vk::DescriptorSet::null(), sets[2].set];
        let (layout, point) = (pipeline.layout, vk::PipelineBindPoint::GRAPHICS);
        // SAFETY: the command buffer records, and sets that are not null have the layouts of their numbers.
        unsafe { device.cmd_bind_descriptor_sets(raw, point, layout, 0, &handles, &[]) };
        commands.push(0, &[-0.05f32, 0.1, 0.0, 0.0]);
    });
    assert!(drawn_at_once == expected);
    // The fragment stage of a library with the vertex stage's layout lacks its set.
    let lacking = Graphics { set_layouts: vec![layouts[0]], ..library(&independent, fragment) };
    let result = vk::Result::ERROR_VALIDATION_FAILED_EXT;
    let rule = "VUID-VkGraphicsPipelineCreateInfo-layout-07988";
    refused(gpu, &lacking, result, rule);
}

/// A library's shader is translated again for pipelines that need it otherwise: `interpolateAtSample` needs the number of
/// samples.
#[gaurast_runner::test(needs = [GLSLANG])]
fn a_library_is_linked_for_any_number_of_samples() {
    let gpu = device();
    let sampled = "
        layout(location = 0) in vec4 v_color;
        layout(location = 0) out vec4 color;
        void main() { color = interpolateAtSample(v_color, 1); }";
    let target = |samples| {
        let options =
            TargetOptions { size: SIZE, samples, ..TargetOptions::with_depth(vk::Format::D32_SFLOAT_S8_UINT) };
        Target::new(gpu, &options)
    };
    let (one, four) = (target(1), target(4));
    let of = |target: &Target| plain(target).with_shader(fragment(sampled));
    let shaders = create(gpu, &library(&of(&one), ALL[1] | ALL[2]));
    for _ in 0..2 {
        for target in [&one, &four] {
            let own = of(target);
            let linked = Graphics {
                parts: Some(ALL[0] | ALL[3]),
                libraries: vec![shaders.raw],
                shaders: Vec::new(),
                ..own.clone()
            };
            let expected = draw_to(gpu, target, &create(gpu, &own), |_| {});
            assert!(draw_to(gpu, target, &create(gpu, &linked), |_| {}) == expected);
        }
    }
}

/// A pipeline that rasterizes nothing needs no parts for fragments; others need all.
#[gaurast_runner::test(needs = [GLSLANG])]
fn parts_that_are_needed() {
    let gpu = device();
    let target = target(gpu);
    let plain = plain(&target);
    let discarding = Graphics { raster: plain.raster.rasterizer_discard_enable(true), ..plain.clone() };
    let before = &ALL[..2];
    let pipeline = linked(gpu, &discarding, before);
    let nothing = picture(gpu, &pipeline);
    assert!(nothing != picture(gpu, &create(gpu, &plain)));
    assert!(nothing == picture(gpu, &create(gpu, &discarding)));
    let incomplete = "GAURAST-pipeline-incomplete";
    for missing in ALL {
        let parts = ALL.iter().filter(|&&part| part != missing);
        let libraries: Vec<_> = parts.map(|&part| create(gpu, &library(&plain, part))).collect();
        let result = vk::Result::ERROR_VALIDATION_FAILED_EXT;
        refused(gpu, &link(&plain, &libraries), result, incomplete);
    }
}

/// The state of Gaussians is that of the library with the pre-rasterization shaders.
#[gaurast_runner::test(needs = [GLSLANG])]
fn pipelines_of_gaussians_are_linked() {
    let gpu = device();
    let target = Target::floats(gpu, SIZE);
    let cloud = scenes::cloud(5, 200, 1);
    let scene = GaussianScene::new(gpu, &cloud);
    let camera = scenes::camera(SIZE[0], SIZE[1]).to_vulkan();
    let negative = "
        layout(location = 0) in vec4 accumulated;
        layout(location = 0) out vec4 color;
        void main() { color = vec4(accumulated.a - accumulated.rgb, accumulated.a); }";
    let floor = DYNAMIC_STATE_GAUSSIAN_ALPHA_FLOOR_GAURAST;
    let draw = |pipeline: &Pipeline, is_dynamic: bool| {
        target.draw(gpu, &Pass::default(), |commands| {
            commands.bind(pipeline);
            scene.bind_buffers(commands);
            commands.camera(&camera);
            if is_dynamic {
                let functions = gpu.gaussian().expect("Gaussian draws");
                // SAFETY: the command buffer records, and its device has the feature.
                unsafe { functions.cmd_set_gaussian_alpha_floor(commands.raw, 0.2) };
            }
            commands.draw(0..scene.count);
        })
    };
    let state = PipelineGaussianStateCreateInfoGAURAST::default()
        .low_pass_variance(1.5)
        .resolve_input_locations(GaussianResolveInputLocationsGAURAST::default().accumulated_color(0));
    let options =
        GaussianOptions { state, formats: target.attachment_formats(), blend: vec![over()], ..GaussianOptions::new(1) };
    let mut pictures: Vec<Output> = Vec::new();
    for is_dynamic in [false, true] {
        for resolve in [None, Some(fragment(negative))] {
            let options = GaussianOptions {
                resolve,
                dynamic: is_dynamic.then_some(floor).into_iter().collect(),
                ..options.clone()
            };
            let graphics = options.graphics();
            let expected = draw(&create(gpu, &graphics), is_dynamic);
            assert!(expected.shows_something() && !pictures.contains(&expected));
            for split in splits() {
                let drawn = draw(&linked(gpu, &graphics, &split), is_dynamic);
                assert!(drawn == expected, "{split:?}");
            }
            pictures.push(expected);
        }
    }
}

/// Stages without libraries may have their shader's code, too, in pipelines of any kind.
#[gaurast_runner::test(needs = [GLSLANG])]
fn stages_have_code_in_place_of_modules(case: &Case) {
    strictly(case, create_stages_with_code);
}

fn create_stages_with_code() {
    let gpu = device();
    let target = target(gpu);
    let plain = plain(&target);
    let inline = Graphics { inline_modules: true, ..plain.clone() };
    let expected = picture(gpu, &create(gpu, &plain));
    assert!(picture(gpu, &create(gpu, &inline)) == expected);
    refused(
        own(),
        &inline,
        vk::Result::ERROR_VALIDATION_FAILED_EXT,
        "VUID-VkPipelineShaderStageCreateInfo-stage-08771",
    );
    let words = compile(Stage::Compute, "layout(local_size_x = 1) in; void main() {}");
    let mut code = vk::ShaderModuleCreateInfo::default().code(&words);
    let stage = vk::PipelineShaderStageCreateInfo::default().stage(vk::ShaderStageFlags::COMPUTE).name(c"main");
    let device = gpu.device();
    // SAFETY: the create infos are valid, except the second's.
    unsafe {
        let layout = device.create_pipeline_layout(&vk::PipelineLayoutCreateInfo::default(), None).expect("a layout");
        let create = |stage| {
            let info = vk::ComputePipelineCreateInfo::default().stage(stage).layout(layout);
            device.create_compute_pipelines(vk::PipelineCache::null(), &[info], None)
        };
        let pipelines = create(stage.push_next(&mut code)).expect("a pipeline");
        device.destroy_pipeline(pipelines[0], None);
        let refused = create(vk::PipelineShaderStageCreateInfo { p_next: std::ptr::null(), ..stage });
        let (_, result) = refused.expect_err("a stage without code");
        assert_eq!(result, vk::Result::ERROR_VALIDATION_FAILED_EXT);
        let rule = "VUID-VkPipelineShaderStageCreateInfo-stage-06845";
        assert!(gpu.messages().iter().any(|message| message.id == rule));
        device.destroy_pipeline_layout(layout, None);
    }
}

/// Checks that a pipeline is refused with a message.
fn refused(gpu: &Gpu, graphics: &Graphics<'_>, result: vk::Result, id: &str) {
    gpu.messages();
    let refused = graphics.create(gpu).expect_err("a pipeline that is refused");
    let messages = gpu.messages();
    assert_eq!(refused, result, "{messages:?}");
    assert!(messages.iter().any(|message| message.id == id), "{id}: {messages:?}");
}

#[gaurast_runner::test(needs = [GLSLANG])]
fn invalid_use_is_refused(case: &Case) {
    strictly(case, use_libraries_wrongly);
}

fn use_libraries_wrongly() {
    let gpu = device();
    let target = target(gpu);
    let plain = plain(&target);
    refused(
        own(),
        &library(&plain, ALL[0]),
        vk::Result::ERROR_FEATURE_NOT_PRESENT,
        "VUID-VkGraphicsPipelineCreateInfo-graphicsPipelineLibrary-06606",
    );
    let invalid = vk::Result::ERROR_VALIDATION_FAILED_EXT;
    let pipeline = create(gpu, &plain);
    refused(
        gpu,
        &link(&plain, std::slice::from_ref(&pipeline)),
        invalid,
        "VUID-VkPipelineLibraryCreateInfoKHR-pLibraries-03381",
    );
    let twice = "VUID-VkGraphicsPipelineCreateInfo-pLibraries-06611";
    let libraries = [ALL[0] | ALL[1], ALL[1] | ALL[2] | ALL[3]].map(|parts| create(gpu, &library(&plain, parts)));
    refused(gpu, &link(&plain, &libraries), invalid, twice);
    let beside = Graphics { parts: Some(ALL[1]), libraries: vec![libraries[1].raw], ..plain.clone() };
    refused(gpu, &beside, invalid, twice);
    // A library can't be bound.
    gpu.messages();
    let recorded = gpu.try_record(|commands| commands.bind(&libraries[0]));
    assert!(recorded.is_err());
    let rule = "VUID-vkCmdBindPipeline-pipeline-03382";
    assert!(gpu.messages().iter().any(|message| message.id == rule));
}

/// The features and properties of the extension are what the driver does.
#[gaurast_runner::test]
fn linking_is_not_fast_and_decorations_are_independent() {
    let gpu = device();
    let mut found = vk::PhysicalDeviceGraphicsPipelineLibraryPropertiesEXT::default();
    let mut all = vk::PhysicalDeviceProperties2::default().push_next(&mut found);
    // SAFETY: the physical device is the instance's.
    unsafe {
        gpu.instance().get_physical_device_properties2(gpu.physical_device(), &mut all);
    }
    assert_eq!(found.graphics_pipeline_library_fast_linking, vk::FALSE);
    let independent = found.graphics_pipeline_library_independent_interpolation_decoration;
    assert_eq!(independent, vk::TRUE);
}
