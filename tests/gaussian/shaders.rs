//! Gaussians that a vertex shader projects, and fragments of Gaussians that a fragment shader makes. A vertex shader
//! that computes the same as fixed-function projection gives the same picture.

use ash::vk;
use gaurast::vk::{
    GaussianAntialiasingGAURAST, GaussianCameraGAURAST, GaussianOrderGAURAST, GaussianPrecisionGAURAST,
    GaussianProjectionModeGAURAST, GaussianResolveInputLocationsGAURAST, GaussianVertexOutputLocationsGAURAST,
    PipelineGaussianStateCreateInfoGAURAST,
};
use gaurast_testkit::canvas::Canvas;
use gaurast_testkit::devices::{gaussian, image};
use gaurast_testkit::scene::{FORMAT, HEIGHT, WIDTH, over, pass, splats};
use gaurast_testkit::shader::spirv;
use gaurast_testkit::{Bindings, Buffer, Graphics, Image, Shader};

/// The number of Gaussians of the scene.
const COUNT: u32 = 300;
/// The number of floats of a Gaussian without its spherical harmonics, and the number of those.
const SHAPE: u32 = 11;
const HARMONICS: u32 = 48;

type State = PipelineGaussianStateCreateInfoGAURAST<'static>;

/// A number from 0 to 1 that depends only on the arguments.
fn random(index: u32, what: u32) -> f32 {
    let mut x = (index * 64 + what + 1).wrapping_mul(0x9E37_79B9);
    x = (x ^ x >> 15).wrapping_mul(0x85EB_CA6B);
    x = (x ^ x >> 13).wrapping_mul(0xC2B2_AE35);
    (x >> 8) as f32 / (1 << 24) as f32
}

/// The Gaussians' positions, scales, rotations and opacities.
fn shapes() -> Vec<f32> {
    (0..COUNT)
        .flat_map(|index| {
            let at = |what: u32, low: f32, high: f32| low + (high - low) * random(index, what);
            [
                at(0, -2.0, 2.0),
                at(1, -1.5, 1.5),
                at(2, 3.0, 9.0),
                at(3, 0.05, 0.3),
                at(4, 0.05, 0.3),
                at(5, 0.05, 0.3),
                at(6, -1.0, 1.0),
                at(7, -1.0, 1.0),
                at(8, -1.0, 1.0),
                at(9, 0.1, 1.0),
                at(10, 0.05, 0.9),
            ]
        })
        .collect()
}

fn harmonics() -> Vec<f32> {
    (0..COUNT).flat_map(|index| (0..HARMONICS).map(move |k| random(index, 11 + k) - 0.4)).collect()
}

fn camera() -> GaussianCameraGAURAST<'static> {
    let (sin, cos) = 0.1f32.sin_cos();
    GaussianCameraGAURAST::default()
        .rotation([cos, 0.0, sin, 0.0, 1.0, 0.0, -sin, 0.0, cos])
        .eye([0.25, -0.125, 0.5])
        .focal_length([60.0, 62.0])
        .principal_point([33.5, 22.25])
        .depth_coefficients([1.0, -0.25])
}

/// The camera as the shader's push constants.
fn constants() -> Vec<f32> {
    let camera = camera();
    let mut constants = Vec::new();
    for row in camera.rotation.chunks(3) {
        constants.extend([row[0], row[1], row[2], 0.0]);
    }
    constants.extend(camera.eye.map(|c| c as f32));
    constants.push(0.0);
    constants.extend(camera.focal_length);
    constants.extend(camera.principal_point);
    constants.extend([WIDTH as f32, HEIGHT as f32]);
    constants.extend(camera.depth_coefficients);
    constants
}

pub fn outputs() -> GaussianVertexOutputLocationsGAURAST {
    GaussianVertexOutputLocationsGAURAST::default().covariance(1).opacity(3).color(4).depth_key(6)
}

/// A pipeline over the scene's buffers, with or without a shader.
pub fn request(shaded: bool) -> Graphics<'static> {
    let mut request = splats();
    request.attributes.truncate(4);
    request.bindings[0].stride = 4 * SHAPE;
    if shaded {
        let mode = GaussianProjectionModeGAURAST::VERTEX_SHADER;
        let with = |state: State| state.projection_mode(mode).vertex_output_locations(outputs());
        request.gaussian = request.gaussian.map(with);
        return request;
    }
    request.bindings.push(vk::VertexInputBindingDescription {
        binding: 1,
        stride: 4 * HARMONICS,
        input_rate: vk::VertexInputRate::VERTEX,
    });
    let harmonics = (0..16).map(|k| vk::VertexInputAttributeDescription {
        location: 4 + k,
        binding: 1,
        format: vk::Format::R32G32B32_SFLOAT,
        offset: 12 * k,
    });
    request.attributes.extend(harmonics);
    let degree = |state: State| state.spherical_harmonics_degree(3);
    request.gaussian = request.gaussian.map(degree);
    request
}

/// The scene's buffers, and a layout and a set for the shader.
struct Stage {
    canvas: Canvas,
    shapes: Buffer,
    harmonics: Buffer,
    set: Bindings,
    layout: vk::PipelineLayout,
    toned: Shader,
    woven: Shader,
    deep: Shader,
    image: Image,
}

/// The camera for the vertex stage, and a tint for the fragment stage.
fn ranges() -> [vk::PushConstantRange; 2] {
    let camera = 4 * constants().len() as u32;
    [
        vk::PushConstantRange::default().stage_flags(vk::ShaderStageFlags::VERTEX).size(camera),
        vk::PushConstantRange::default().stage_flags(vk::ShaderStageFlags::FRAGMENT).offset(camera).size(16),
    ]
}

impl Stage {
    fn new() -> Self {
        let canvas = Canvas::new();
        let gpu = &canvas.gpu;
        let harmonics = Buffer::of(gpu, &harmonics());
        let set = canvas.storage_set(&harmonics);
        let (layouts, ranges) = ([set.layout], ranges());
        let info = vk::PipelineLayoutCreateInfo::default().set_layouts(&layouts).push_constant_ranges(&ranges);
        // SAFETY: see the crate.
        let layout = unsafe { gpu.device().create_pipeline_layout(&info, None).unwrap() };
        Self {
            shapes: Buffer::of(gpu, &shapes()),
            image: image(gpu, FORMAT, [WIDTH, HEIGHT]),
            harmonics,
            set,
            layout,
            toned: Shader::fragment(spirv("toned.frag")),
            woven: Shader::fragment(spirv("woven.frag")),
            deep: Shader::fragment(spirv("deep.frag")),
            canvas,
        }
    }

    /// The request with the stage and the layout added.
    fn complete(&self, request: Graphics<'static>) -> Graphics<'static> {
        let shaded = |state: &State| state.projection_mode == GaussianProjectionModeGAURAST::VERTEX_SHADER;
        if request.gaussian.as_ref().is_some_and(shaded) {
            let stage = Shader::vertex(spirv("gaussian.vert"));
            self.laid_out(request.with_shader(stage))
        } else {
            request
        }
    }

    /// The request with the layout added.
    fn laid_out(&self, request: Graphics<'static>) -> Graphics<'static> {
        Graphics { set_layouts: vec![self.set.layout], push: ranges().to_vec(), ..request }
    }

    /// The request with a resolve shader, which reads the accumulated colour and the depths at these locations.
    fn resolved(
        &self,
        request: Graphics<'static>,
        shader: &Shader,
        [accumulated, depth]: [u32; 2],
    ) -> Graphics<'static> {
        let locations = GaussianResolveInputLocationsGAURAST::default().accumulated_color(accumulated).depth(depth);
        let with = |state: State| state.resolve_input_locations(locations);
        let request = self.laid_out(request.with_shader(shader.clone()));
        Graphics { gaussian: request.gaussian.map(with), ..request }
    }

    /// The picture of the scene by a pipeline; `record` records the draws.
    fn draw(&self, request: Graphics<'static>, record: impl FnOnce(&ash::Device, vk::CommandBuffer)) -> Vec<[f32; 4]> {
        let gpu = &self.canvas.gpu;
        let pipeline = self.complete(request).create(gpu).unwrap();
        gpu.run(|recording| {
            let (device, commands) = recording.raw();
            pass(device, commands, &self.image, [0.0; 4], || {
                let point = vk::PipelineBindPoint::GRAPHICS;
                let buffers = [self.shapes.raw, self.harmonics.raw];
                // SAFETY: see the crate.
                unsafe {
                    device.cmd_bind_pipeline(commands, point, pipeline.raw);
                    device.cmd_bind_vertex_buffers(commands, 0, &buffers, &[0, 0]);
                    gaussian(gpu).cmd_set_gaussian_cameras(commands, &[camera()]);
                }
                self.bind(device, commands);
                record(device, commands);
            });
        });
        assert_eq!(gpu.messages(), []);
        self.image.colors()
    }

    /// Binds the shader's inputs.
    fn bind(&self, device: &ash::Device, commands: vk::CommandBuffer) {
        let (point, stage) = (vk::PipelineBindPoint::GRAPHICS, vk::ShaderStageFlags::VERTEX);
        let constants = constants();
        let bytes = bytemuck::cast_slice(&constants);
        // SAFETY: see the crate.
        unsafe {
            device.cmd_bind_descriptor_sets(commands, point, self.layout, 0, &[self.set.set], &[]);
            device.cmd_push_constants(commands, self.layout, stage, 0, bytes);
        }
    }

    /// Draws the scene with both kinds of projection, in the state that `change` makes, and compares the pictures.
    #[track_caller]
    fn compare(&self, what: &str, change: impl Fn(State) -> State, record: impl Fn(&ash::Device, vk::CommandBuffer)) {
        let [fixed, shaded] = [false, true].map(|shaded| {
            let request = request(shaded);
            let request = Graphics { gaussian: request.gaussian.map(&change), blend: vec![over()], ..request };
            self.draw(request, &record)
        });
        assert!(fixed.iter().filter(|pixel| pixel[3] > 0.5).count() > 1000, "{what}");
        let differences = std::iter::zip(fixed.as_flattened(), shaded.as_flattened());
        let worst = differences.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(worst <= 1e-5, "{what}: {worst}");
    }
}

impl Drop for Stage {
    fn drop(&mut self) {
        // SAFETY: see the crate.
        unsafe {
            let device = self.canvas.gpu.device();
            device.destroy_pipeline_layout(self.layout, None);
        }
    }
}

fn draw_all(device: &ash::Device, commands: vk::CommandBuffer) {
    // SAFETY: see the crate.
    unsafe { device.cmd_draw(commands, COUNT, 1, 0, 0) };
}

#[gaurast_runner::test]
fn a_vertex_shader_may_do_what_the_device_does() {
    let stage = Stage::new();
    stage.compare("default", |state| state, draw_all);
    let compensated = GaussianAntialiasingGAURAST::OPACITY_COMPENSATED;
    stage.compare("compensated", |state| state.antialiasing(compensated), draw_all);
    let primitive = GaussianOrderGAURAST::PRIMITIVE;
    stage.compare("as drawn", |state| state.order(primitive), draw_all);
    let thresholds = |state: State| state.alpha_ceiling(0.7).alpha_floor(0.02);
    stage.compare("thresholds", thresholds, draw_all);
    // The depth key may be unused; Gaussians are then sorted by w.
    let w = |state: State| {
        let unused = gaurast::vk::GAUSSIAN_LOCATION_UNUSED_GAURAST;
        state.vertex_output_locations(outputs().depth_key(unused))
    };
    stage.compare("by w", w, draw_all);
}

#[gaurast_runner::test]
fn vertices_are_named_as_for_other_shaders() {
    let stage = Stage::new();
    let gpu = &stage.canvas.gpu;
    let indices: Vec<u32> = (0..COUNT).map(|number| (number * 7) % COUNT).collect();
    let indices = Buffer::of(gpu, &indices);
    stage.compare(
        "indexed",
        |state| state,
        // SAFETY: see the crate.
        |device, commands| unsafe {
            device.cmd_bind_index_buffer(commands, indices.raw, 0, vk::IndexType::UINT32);
            device.cmd_draw_indexed(commands, COUNT - 50, 2, 50, 0, 0);
        },
    );
    let numbers = Buffer::of(gpu, &[COUNT - 20, 1, 20, 0]);
    stage.compare(
        "indirect",
        |state| state,
        // SAFETY: see the crate.
        |device, commands| unsafe {
            device.cmd_draw_indirect(commands, numbers.raw, 0, 1, 16);
        },
    );
}

#[gaurast_runner::test]
fn what_a_shader_is_bound_to_may_change_within_a_set() {
    let stage = Stage::new();
    let blended = || Graphics { blend: vec![over()], ..request(true) };
    let whole = stage.draw(blended(), draw_all);
    let gaussian = gaussian(&stage.canvas.gpu);
    let in_two = stage.draw(blended(), |device, commands| {
        // SAFETY: see the crate.
        unsafe {
            gaussian.cmd_begin_gaussian_set(commands);
            device.cmd_draw(commands, 100, 1, 0, 0);
        }
        stage.bind(device, commands);
        // SAFETY: see the crate.
        unsafe {
            device.cmd_draw(commands, COUNT - 100, 1, 100, 0);
            gaussian.cmd_end_gaussian_set(commands);
        }
    });
    assert!(in_two == whole);
    let apart = stage.draw(blended(), |device, commands| {
        // SAFETY: see the crate.
        unsafe {
            device.cmd_draw(commands, 100, 1, 0, 0);
            device.cmd_draw(commands, COUNT - 100, 1, 100, 0);
        }
    });
    assert!(apart != whole);
}

/// The ids of statements about stages, each with the message that breaking it gives.
pub fn broken() -> Vec<(&'static str, String)> {
    let stage = Stage::new();
    let gpu = &stage.canvas.gpu;
    let unused = gaurast::vk::GAUSSIAN_LOCATION_UNUSED_GAURAST;
    let with = |locations: GaussianVertexOutputLocationsGAURAST| {
        let request = request(true);
        let state = request.gaussian;
        Graphics { gaussian: state.map(|state| state.vertex_output_locations(locations)), ..request }
    };
    let location = "VUID-VkGaussianVertexOutputLocationsGAURAST-None-90020";
    let by_distance = || {
        let request = with(outputs().depth_key(unused));
        let state = request.gaussian;
        Graphics { gaussian: state.map(|state| state.order(GaussianOrderGAURAST::RADIAL_DISTANCE)), ..request }
    };
    let per_pixel = || {
        let request = request(true);
        let state = request.gaussian;
        Graphics { gaussian: state.map(|state| state.order(GaussianOrderGAURAST::PER_PIXEL)), ..request }
    };
    let resolved = |shader, locations| stage.resolved(request(false), shader, locations);
    let half = |mut request: Graphics<'static>| {
        let state = request.gaussian.map(|s| s.precision(GaussianPrecisionGAURAST::FLOAT16));
        request.gaussian = state;
        request
    };
    let with_camera = || {
        let mut request = stage.resolved(request(true), &stage.toned, [0, 1]);
        request.gaussian = request.gaussian.map(|state| {
            let inputs = state.resolve_input_locations.first_camera(2);
            state.resolve_input_locations(inputs)
        });
        request
    };
    let read = "VUID-VkGaussianResolveInputLocationsGAURAST-None-90023";
    let requests = [
        // The location is missing, too small, or used twice.
        (read, resolved(&stage.toned, [3, 5])),
        (read, resolved(&stage.toned, [5, 2])),
        (read, resolved(&stage.woven, [0, 0])),
        ("VUID-VkGraphicsPipelineCreateInfo-FragDepth-90024", resolved(&stage.deep, [0, 1])),
        ("VUID-VkGaussianResolveInputLocationsGAURAST-depth-90031", half(resolved(&stage.toned, [0, 1]))),
        // Not written, too narrow, and used twice.
        (location, with(outputs().covariance(9))),
        (location, with(outputs().color(3))),
        (location, with(outputs().opacity(unused))),
        (location, with(outputs().depth_key(3))),
        ("VUID-VkGaussianResolveInputLocationsGAURAST-firstCamera-90072", with_camera()),
        ("VUID-VkPipelineGaussianStateCreateInfoGAURAST-depthKey-90021", by_distance()),
        ("VUID-VkPipelineGaussianStateCreateInfoGAURAST-projectionMode-90022", per_pixel()),
    ];
    let heard = requests.map(|(id, request)| {
        let error = stage.complete(request).create(gpu).expect_err(id);
        assert_eq!(error, vk::Result::ERROR_VALIDATION_FAILED_EXT, "{id}");
        (id, gpu.message_texts().concat())
    });
    heard.into()
}

/// The tone mapping of premultiplied colours.
fn toned([r, g, b, a]: [f32; 4]) -> [f32; 4] {
    let [r, g, b] = [r, g, b].map(|c| c / (1.0 + c));
    [r, g, b, a]
}

#[gaurast_runner::test]
fn a_resolve_shader_maps_tones_after_either_projection() {
    let stage = Stage::new();
    for shaded in [false, true] {
        let accumulated = stage.draw(request(shaded), draw_all);
        let request = stage.resolved(request(shaded), &stage.toned, [2, 5]);
        let mapped = stage.draw(request, draw_all);
        let mut covered = 0;
        for (accumulated, mapped) in std::iter::zip(accumulated, mapped) {
            let expected = toned(accumulated);
            let close = std::iter::zip(expected, mapped).all(|(a, b)| (a - b).abs() <= 1e-6);
            assert!(close, "{expected:?} {mapped:?}");
            covered += u32::from(accumulated[3] > 0.0);
        }
        assert!(covered > 1500, "{covered}");
    }
}

#[gaurast_runner::test]
fn a_resolve_shader_discards_and_differs_from_pixel_to_pixel() {
    let stage = Stage::new();
    let tint = [2.0f32, 3.0, 5.0, 1.0];
    let tinted = |device: &ash::Device, commands: vk::CommandBuffer| {
        let (flags, offset) = (vk::ShaderStageFlags::FRAGMENT, 4 * constants().len() as u32);
        let bytes = bytemuck::cast_slice(&tint);
        // SAFETY: see the crate.
        unsafe { device.cmd_push_constants(commands, stage.layout, flags, offset, bytes) };
        draw_all(device, commands);
    };
    let accumulated = stage.draw(request(true), draw_all);
    let request = stage.resolved(request(true), &stage.woven, [0, 1]);
    let woven = stage.draw(request, tinted);
    let alpha = |x: usize, y: usize| accumulated[y * WIDTH as usize + x][3];
    let mut covered = 0;
    for (index, pixel) in woven.into_iter().enumerate() {
        let (x, y) = (index % WIDTH as usize, index / WIDTH as usize);
        if (x + y) % 2 == 1 || alpha(x, y) == 0.0 {
            assert_eq!(pixel, [0.0; 4]);
            continue;
        }
        // The other pixel of the quad's row has its accumulated value, covered or not.
        let slope = alpha(x | 1, y) - alpha(x & !1, y);
        assert_eq!(pixel, [2.0, 3.0, 5.0 * slope, alpha(x, y)]);
        covered += 1;
    }
    assert!(covered > 700, "{covered}");
}

#[gaurast_runner::test]
fn a_stage_is_needed() {
    let canvas = Canvas::new();
    let error = request(true).create(&canvas.gpu).expect_err("no stage");
    assert_eq!(error, vk::Result::ERROR_VALIDATION_FAILED_EXT);
    let messages = canvas.gpu.message_texts().concat();
    let id = "VUID-VkGraphicsPipelineCreateInfo-projectionMode-90008";
    assert!(messages.contains(id), "{messages:?}");
}

/// Pipeline statistics count the invocations of shaders, and nothing of what is done without one.
#[gaurast_runner::test]
fn pipeline_statistics_count_shaders() {
    use vk::QueryPipelineStatisticFlags as Flags;
    let stage = Stage::new();
    let device = stage.canvas.gpu.device();
    let statistics = Flags::INPUT_ASSEMBLY_VERTICES
        | Flags::INPUT_ASSEMBLY_PRIMITIVES
        | Flags::VERTEX_SHADER_INVOCATIONS
        | Flags::CLIPPING_INVOCATIONS
        | Flags::CLIPPING_PRIMITIVES
        | Flags::FRAGMENT_SHADER_INVOCATIONS;
    let info = vk::QueryPoolCreateInfo::default()
        .query_type(vk::QueryType::PIPELINE_STATISTICS)
        .pipeline_statistics(statistics)
        .query_count(1);
    // SAFETY: see the crate.
    let pool = unsafe { device.create_query_pool(&info, None) }.unwrap();
    let count = |request: Graphics<'static>| {
        // SAFETY: see the crate.
        unsafe { device.reset_query_pool(pool, 0, 1) };
        let pixels = stage.draw(request, |device, commands| {
            // SAFETY: see the crate.
            unsafe { device.cmd_begin_query(commands, pool, 0, vk::QueryControlFlags::empty()) };
            draw_all(device, commands);
            // SAFETY: see the crate.
            unsafe { device.cmd_end_query(commands, pool, 0) };
        });
        let mut results = [[0u64; 6]];
        let flags = vk::QueryResultFlags::WAIT | vk::QueryResultFlags::TYPE_64;
        // SAFETY: see the crate.
        unsafe { device.get_query_pool_results(pool, 0, &mut results, flags) }.unwrap();
        let covered = pixels.iter().filter(|pixel| pixel[3] > 0.0).count() as u64;
        (results[0], covered)
    };
    let (none, _) = count(request(false));
    assert_eq!(none, [0; 6]);
    let (projected, _) = count(request(true));
    assert_eq!(projected, [0, 0, u64::from(COUNT), 0, 0, 0]);
    let (resolved, covered) = count(stage.resolved(request(false), &stage.toned, [2, 5]));
    assert!(covered > 1500, "{covered}");
    assert_eq!(resolved, [0, 0, 0, 0, 0, covered]);
    // SAFETY: see the crate.
    unsafe { device.destroy_query_pool(pool, None) };
}
