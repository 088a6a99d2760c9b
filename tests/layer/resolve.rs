//! Resolve shaders through `VK_LAYER_GAURAST_emulation` over lavapipe, beside this driver: what they read, keep and count is the same.

use ash::vk;
use gaurast::vk::GaussianResolveInputLocationsGAURAST as Inputs;
use gaurast_conformance::Device;
use gaurast_runner::{Case, Need};
use gaurast_testkit::gpu::Driver;
use gaurast_testkit::loader::with_emulation;
use gaurast_testkit::shader::{GLSLANG, Stage as ShaderStage, compile};
use gaurast_testkit::{
    Attachments, Bindings, Buffer, Commands, GaussianOptions, GaussianScene, Gpu, Graphics, Opening, Pass, Pipeline,
    Resource, Shader, Target, TargetOptions, depth_test,
};
use gaurast_tests::scenes;

const SIZE: [u32; 2] = [70, 50];

/// The beginning of every shader: its inputs, its output, and a counter.
const HEAD: &str = "
    layout(location = 2) in vec4 accumulated;
    layout(location = 0) out vec4 color;
    layout(push_constant) uniform Push { vec4 tint; };
    layout(set = 0, binding = 0) buffer Counter { uint count; };
";

/// A shader, and how it is drawn.
#[derive(Clone, Copy)]
struct Shown {
    name: &'static str,
    source: &'static str,
    samples: u32,
    is_tested: bool,
    is_sample_shaded: bool,
}

const fn shown(name: &'static str, source: &'static str) -> Shown {
    Shown { name, source, samples: 1, is_tested: false, is_sample_shaded: false }
}

const SHOWN: [Shown; 10] = [
    shown(
        "the place and the median depth",
        "void main() { color = vec4(gl_FragCoord.xy, gl_FragCoord.z, gl_FragCoord.w); }",
    ),
    shown(
        "built-ins without a meaning",
        "void main() {
            float facing = gl_FrontFacing ? 100.0 : 0.0;
            color = vec4(facing + gl_PrimitiveID, gl_PointCoord, gl_Layer + gl_ViewportIndex) + accumulated;
        }",
    ),
    shown(
        "every other pixel",
        "void main() {
            if ((int(gl_FragCoord.x) + int(gl_FragCoord.y)) % 2 == 1) discard;
            atomicAdd(count, 1u);
            color = vec4(gl_HelperInvocation ? 1.0 : 0.0, accumulated.rga);
        }",
    ),
    shown(
        "arrays and components",
        "layout(location = 5) flat in vec4 camera[6];
        layout(location = 11, component = 1) in float median;
        layout(location = 12) flat in uvec2 nearest;
        vec4 chosen(vec4 a) { return a + interpolateAtCentroid(accumulated); }
        void main() { color = chosen(camera[int(gl_FragCoord.x) % 6]) + vec4(median, nearest, 0.0); }",
    ),
    shown(
        "a block",
        "layout(location = 5) in Block { flat mat3x4 view; layout(location = 11) vec2 depth; } block;
        void main() { color = block.view[1] + vec4(block.depth, 0.0, 0.0); }",
    ),
    Shown {
        samples: 4,
        is_tested: true,
        ..shown(
            "a mask of samples",
            "void main() {
                atomicAdd(count, 1u);
                gl_SampleMask[0] = gl_FragCoord.x < 40.0 ? 6 : 9;
                color = accumulated;
            }",
        )
    },
    Shown {
        samples: 4,
        is_tested: true,
        ..shown(
            "each sample by its number",
            "void main() { atomicAdd(count, 1u); color = vec4(gl_SampleID, accumulated.rga); }",
        )
    },
    Shown {
        samples: 4,
        is_tested: true,
        is_sample_shaded: true,
        ..shown(
            "sample shading with tests",
            "void main() { atomicAdd(count, 1u); color = vec4(gl_FragCoord.z, accumulated.rga); }",
        )
    },
    Shown {
        samples: 4,
        is_sample_shaded: true,
        ..shown("sample shading", "void main() { atomicAdd(count, 1u); color = accumulated; }")
    },
    Shown {
        is_tested: true,
        ..shown(
            "the depth",
            "layout(location = 11) in vec2 depth; void main() { color = vec4(depth, gl_FragCoord.zw); }",
        )
    },
];

fn resolve_shader(source: &str) -> Shader {
    Shader::fragment(compile(ShaderStage::Fragment, &format!("{HEAD}{source}")))
}

/// A scene on a device, with a counter.
struct Stage<'a> {
    gpu: &'a Gpu,
    target: Target,
    scene: GaussianScene,
    counter: Buffer,
    set: Bindings,
}

impl<'a> Stage<'a> {
    fn new(gpu: &'a Gpu, samples: u32, is_tested: bool) -> Self {
        let colors = TargetOptions::of(vk::Format::R32G32B32A32_SFLOAT);
        let depth = is_tested.then_some(vk::Format::D32_SFLOAT);
        let counter = Buffer::of(gpu, &[0_u32]);
        Self {
            gpu,
            target: Target::new(gpu, &TargetOptions { size: SIZE, depth, samples, resolve: false, ..colors }),
            scene: GaussianScene::new(gpu, &scenes::cloud(5, 300, 0)),
            set: Bindings::new(gpu, &[Resource::Storage(counter.raw)]),
            counter,
        }
    }

    fn pipeline(&self, shader: Option<Shader>, change: &dyn Fn(&mut Graphics<'_>)) -> Result<Pipeline, vk::Result> {
        let locations = Inputs::default().accumulated_color(2).first_camera(5).depth(11).nearest_gaussian(12);
        let mut options = GaussianOptions::new(0);
        options.state = options.state.resolve_input_locations(locations);
        options.formats = self.target.attachment_formats();
        options.resolve = shader;
        options.set = Some(&self.set);
        if self.target.options.depth.is_some() {
            options.depth_stencil = depth_test(vk::CompareOp::LESS);
        }
        let mut graphics = options.graphics();
        graphics.push = vec![vk::PushConstantRange::default().stage_flags(vk::ShaderStageFlags::ALL_GRAPHICS).size(16)];
        change(&mut graphics);
        graphics.create(self.gpu)
    }

    fn bind(&self, commands: &Commands, pipeline: &Pipeline) {
        commands.whole(&self.target);
        commands.bind(pipeline);
        commands.bind_set(&self.set, &[]);
        self.scene.bind_buffers(commands);
        commands.camera(&scenes::camera(SIZE[0], SIZE[1]).to_vulkan().depth_coefficients([16.0 / 15.0, -16.0 / 15.0]));
    }

    /// The texels of all samples after a pass.
    fn draw(&self, record: impl FnOnce(&Commands)) -> Vec<f32> {
        let pictures = self.target.draw(self.gpu, &Pass::clear([0.0; 4]), record).pictures;
        pictures.iter().flat_map(|picture| bytemuck::pod_collect_to_vec::<u8, f32>(&picture.bytes)).collect()
    }

    fn count(&self) -> u32 {
        self.counter.values::<u32>()[0]
    }
}

impl Shown {
    /// Reports whether samples that are alike have one invocation. This driver takes those for different that store other depths, though
    /// no Gaussian lies between.
    fn merges_samples(&self) -> bool {
        self.samples > 1 && self.is_tested && !self.is_sample_shaded && !self.source.contains("gl_SampleID")
    }
}

/// The texels that a shader leaves on a device, and its count.
fn drawn(gpu: &Gpu, shown: Shown) -> (Vec<f32>, u32) {
    let stage = Stage::new(gpu, shown.samples, shown.is_tested);
    let half = |graphics: &mut Graphics<'_>| graphics.sample_mask = Some(0b0101);
    let before = stage.pipeline(None, &half).expect("a pipeline without a shader");
    let shading = |graphics: &mut Graphics<'_>| {
        graphics.multisample =
            graphics.multisample.sample_shading_enable(shown.is_sample_shaded).min_sample_shading(1.0);
    };
    let pipeline = stage.pipeline(Some(resolve_shader(shown.source)), &shading).expect("a pipeline");
    let texels = stage.draw(|commands| {
        if shown.is_tested {
            // The depths of some samples are those of Gaussians.
            stage.bind(commands, &before);
            commands.draw(0..100);
        }
        stage.bind(commands, &pipeline);
        commands.draw(100..300);
    });
    (texels, stage.count())
}

/// Opens this driver, and lavapipe through the layer.
fn devices() -> (Gpu, Device) {
    let own = Gpu::open(&Opening::of(Driver::Embedded)).expect("this driver");
    (own, Device::open("llvmpipe").unwrap_or_else(|error| panic!("{}", error.0)))
}

#[track_caller]
fn assert_close(name: &str, emulated: &[f32], own: &[f32]) {
    assert_eq!(emulated.len(), own.len(), "{name}");
    assert!(own.iter().any(|texel| *texel != 0.0), "{name} shows nothing");
    for (index, (a, b)) in emulated.iter().zip(own).enumerate() {
        // The far plane may be infinite.
        assert!(a == b || (a - b).abs() <= 1e-5 * b.abs().max(1.0), "{name}: {a} in place of {b} at {index}");
    }
}

/// Shaders read, discard and run as on this driver.
#[gaurast_runner::test(needs = [Need::Lavapipe, GLSLANG])]
fn resolve_shaders_draw_what_they_draw_on_this_driver(case: &Case) {
    with_emulation(case, &[], || {
        let (own, emulated) = devices();
        for shown in SHOWN {
            let ((texels, count), (own_texels, own_count)) = (drawn(emulated.gpu(), shown), drawn(&own, shown));
            assert_close(shown.name, &texels, &own_texels);
            let is_as_often = if shown.merges_samples() { count <= own_count } else { count == own_count };
            assert!(is_as_often, "{}: {count}, {own_count}", shown.name);
        }
    });
}

/// A shader runs once for the samples of a pixel that are alike, and knows which these are.
#[gaurast_runner::test(needs = [Need::Lavapipe, GLSLANG])]
fn samples_that_are_alike_have_one_invocation(case: &Case) {
    const MASKS: &str = "void main() { atomicAdd(count, 1u); color = vec4(gl_SampleMaskIn[0], -1.0, accumulated.ra); }";
    with_emulation(case, &[], || {
        let device = Device::open("llvmpipe").unwrap_or_else(|error| panic!("{}", error.0));
        let (texels, count) = drawn(device.gpu(), Shown { samples: 4, is_tested: true, ..shown("masks", MASKS) });
        let pixels = (SIZE[0] * SIZE[1]) as usize;
        let at = |pixel: usize, sample: usize| &texels[4 * (sample * pixels + pixel)..][..4];
        let (mut invocations, mut parted) = (0, 0);
        for pixel in 0..pixels {
            let mut masks = std::collections::BTreeSet::new();
            for sample in (0..4).filter(|&sample| at(pixel, sample)[1] == -1.0) {
                let mask = at(pixel, sample)[0] as u32;
                assert!(mask >> sample & 1 == 1, "{pixel} {sample}: {mask}");
                for other in (0..4).filter(|other| mask >> other & 1 == 1) {
                    assert_eq!(at(pixel, sample), at(pixel, other), "{pixel}: {sample} and {other}");
                }
                masks.insert(mask);
            }
            invocations += masks.len() as u32;
            parted += u32::from(masks.len() > 1);
        }
        assert!(parted > 10 && count == invocations, "{parted}: {count}, {invocations}");
    });
}

/// Derivatives are differences within a quad, of which a pixel without a fragment has zeros.
#[gaurast_runner::test(needs = [Need::Lavapipe, GLSLANG])]
fn derivatives_see_the_pixels_beside(case: &Case) {
    const SLOPES: &str = "void main() { color = vec4(dFdx(accumulated.a), dFdy(accumulated.a), 0.0, accumulated.a); }";
    with_emulation(case, &[], || {
        let device = Device::open("llvmpipe").unwrap_or_else(|error| panic!("{}", error.0));
        let (texels, _) = drawn(device.gpu(), shown("slopes", SLOPES));
        let [width, height] = SIZE.map(|size| size as usize);
        let at = |x: usize, y: usize, component: usize| texels[4 * (y * width + x) + component];
        let mut beside_nothing = 0;
        for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
            if at(x, y, 3) == 0.0 {
                continue;
            }
            // Either row and either column of the quad.
            let (left, right, top, bottom) = (x & !1, x | 1, y & !1, y | 1);
            let across = [top, bottom].map(|y| at(right, y, 3) - at(left, y, 3));
            let down = [left, right].map(|x| at(x, bottom, 3) - at(x, top, 3));
            let is_one = |of: [f32; 2], slope: f32| of.iter().any(|one| (one - slope).abs() < 1e-6);
            let slopes = [at(x, y, 0), at(x, y, 1)];
            assert!(is_one(across, slopes[0]) && is_one(down, slopes[1]), "{x} {y}: {slopes:?} {across:?} {down:?}");
            beside_nothing += u32::from(at(x ^ 1, y, 3) == 0.0);
        }
        assert!(beside_nothing > 10, "{beside_nothing}");
    });
}

/// A set's shader reads what was bound and pushed at its first draw. What the application has bound is bound after it.
#[gaurast_runner::test(needs = [Need::Lavapipe, GLSLANG])]
fn resolve_shaders_are_bound_to_the_first_draw(case: &Case) {
    with_emulation(case, &[], || {
        let (own, emulated) = devices();
        let [emulated, own] = [emulated.gpu(), &own].map(|gpu| {
            let stage = Stage::new(gpu, 1, false);
            let pipeline = stage.pipeline(Some(resolve_shader("void main() { color = accumulated * tint; }")), &|_| {});
            let pipeline = pipeline.expect("a pipeline");
            // A triangle that shows the first vertex's position.
            let vertex = "
                layout(location = 0) in vec3 position;
                layout(location = 0) flat out vec3 shown;
                void main() {
                    shown = position;
                    vec2 corner = vec2(gl_VertexIndex & 1, gl_VertexIndex >> 1);
                    gl_Position = vec4(4.0 * corner - 1.0, 0.0, 1.0);
                }";
            let fragment = "
                layout(location = 0) flat in vec3 shown;
                layout(location = 0) out vec4 color;
                layout(push_constant) uniform Push { vec4 tint; };
                void main() { color = vec4(shown, 1.0) * tint; }";
            let triangle = stage.pipeline(None, &|graphics| {
                graphics.gaussian = None;
                graphics.topology = vk::PrimitiveTopology::TRIANGLE_LIST;
                graphics.attributes.truncate(1);
                graphics.shaders = vec![
                    Shader::vertex(compile(ShaderStage::Vertex, vertex)),
                    Shader::fragment(compile(ShaderStage::Fragment, fragment)),
                ];
            });
            let triangle = triangle.expect("a pipeline of triangles");
            stage.draw(|commands| {
                stage.bind(commands, &pipeline);
                commands.push(0, &[0.5_f32, 0.25, 2.0, 1.0]);
                commands.gaussian_set(|| {
                    commands.draw(0..100);
                    commands.push(0, &[3.0_f32, 5.0, 7.0, 9.0]);
                    commands.draw(100..300);
                });
                commands.scissor([0, 0], [20, 50]);
                commands.bind(&triangle);
                commands.draw(0..3);
            })
        });
        assert_close("a set and a triangle", &emulated, &own);
    });
}

/// The number of samples that a query counts in a pass.
fn counted(stage: &Stage<'_>, record: impl FnOnce(&Commands)) -> u32 {
    let info = vk::QueryPoolCreateInfo::default().query_type(vk::QueryType::OCCLUSION).query_count(1);
    let device = stage.gpu.device();
    // SAFETY: the pool is destroyed after the commands have run.
    unsafe {
        let pool = device.create_query_pool(&info, None).expect("a query pool");
        stage.gpu.run(|commands| {
            let (device, raw) = commands.raw();
            device.cmd_reset_query_pool(raw, pool, 0, 1);
            commands.pass(&stage.target, &Pass::clear([0.0; 4]), || {
                commands.whole(&stage.target);
                device.cmd_begin_query(raw, pool, 0, vk::QueryControlFlags::PRECISE);
                record(commands);
                device.cmd_end_query(raw, pool, 0);
            });
        });
        let mut counted = [0_u32];
        device.get_query_pool_results(pool, 0, &mut counted, vk::QueryResultFlags::WAIT).expect("a count");
        device.destroy_query_pool(pool, None);
        counted[0]
    }
}

const EARLY: [&str; 2] = [
    "layout(early_fragment_tests) in; void main() { color = accumulated; }",
    "layout(early_fragment_tests) in; void main() { discard; }",
];

/// Queries with early tests count the pixels that have a fragment, and what a shader discards of them where the device does so for
/// triangles, which lavapipe 22.3 does not. Where such tests decide something, they are refused.
#[gaurast_runner::test(needs = [Need::Lavapipe, GLSLANG])]
fn early_tests_count_what_is_discarded(case: &Case) {
    with_emulation(case, &[], || {
        let (own, emulated) = devices();
        let counts = [emulated.gpu(), &own].map(|gpu| {
            let stage = Stage::new(gpu, 1, false);
            EARLY.map(|source| {
                let pipeline = stage.pipeline(Some(resolve_shader(source)), &|_| {}).expect("a pipeline");
                counted(&stage, |commands| {
                    stage.bind(commands, &pipeline);
                    commands.draw(0..300);
                })
            })
        });
        let stage = Stage::new(emulated.gpu(), 1, false);
        let vertex =
            "void main() { gl_Position = vec4(4.0 * vec2(gl_VertexIndex & 1, gl_VertexIndex >> 1) - 1.0, 0.0, 1.0); }";
        let triangle = stage.pipeline(None, &|graphics| {
            graphics.gaussian = None;
            graphics.topology = vk::PrimitiveTopology::TRIANGLE_LIST;
            graphics.attributes.clear();
            let fragment = "layout(early_fragment_tests) in; void main() { discard; }";
            graphics.shaders = vec![
                Shader::vertex(compile(ShaderStage::Vertex, vertex)),
                Shader::fragment(compile(ShaderStage::Fragment, fragment)),
            ];
        });
        let triangle = triangle.expect("a pipeline of triangles");
        let of_triangle = counted(&stage, |commands| {
            commands.bind(&triangle);
            commands.draw(0..3);
        });
        let [[kept, discarded], own] = counts;
        assert!(own[0] > 500 && own[0] == own[1], "{own:?}");
        assert_eq!(kept, own[0]);
        assert_eq!(discarded, if of_triangle > 0 { own[1] } else { 0 });
        let tested = Stage::new(emulated.gpu(), 1, true);
        let refused = tested.pipeline(Some(resolve_shader(EARLY[0])), &|_| {}).err();
        assert_eq!(refused, Some(vk::Result::ERROR_FEATURE_NOT_PRESENT));
    });
}
