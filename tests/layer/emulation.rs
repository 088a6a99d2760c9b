//! `VK_LAYER_GAURAST_emulation` over lavapipe: cases of the conformance program, as it is.

use ash::vk;
use gaurast::vk::{
    GaussianCameraDistortionGAURAST, GaussianGeometryGAURAST, GaussianOrderGAURAST, GaussianPrecisionGAURAST,
    PipelineGaussianStateCreateInfoGAURAST,
};
use gaurast_conformance::{Device, Implementation, Outcome, all, cases, run};
use gaurast_runner::{Case, Need, Variant, is_long};
use gaurast_testkit::loader::with_emulation;
use gaurast_testkit::scene::splats;
use gaurast_testkit::{
    Attachments, Commands, GaussianOptions, GaussianPipeline, GaussianScene, Gpu, Graphics, Pass, Recorded, Target,
    TargetOptions, depth_test, over,
};
use gaurast_tests::long_run::memory;
use gaurast_tests::oracle::error_model::PrecisionClass;
use gaurast_tests::scenes;

type State = PipelineGaussianStateCreateInfoGAURAST<'static>;

/// Parts of the conformance program, each with the least number of its cases that the layer must pass.
const PARTS: &[(&str, &[&str], usize)] = &[
    ("commands", &["topology.*.primitive.*", "draws.indirect", "draws.multi"], 20),
    ("cameras", &["camera.pinhole", "camera.parallel"], 15),
    ("passes", &["passes"], 12),
    ("instances", &["instances.one", "instances.pinhole"], 10),
    ("footprints", &["footprint.ellipse", "footprint.tile_square", "footprint.smaller", "footprint.disc.strange"], 35),
    ("dynamic states", &["dynamic_state"], 15),
    ("numerics", &["numerics.needles", "numerics.discs"], 12),
    ("views", &["views"], 14),
    ("updates", &["updates"], 20),
    ("libraries", &["libraries"], 12),
    ("resolve shaders", &["resolve.*.pinhole*", "resolve.names", "resolve.camera_2", "resolve.depths.ellipse"], 30),
    ("targets", &["targets", "resolve.push_constants", "resolve.descriptors", "queries"], 18),
    ("angles", &["camera.fisheye", "camera.panorama"], 20),
    ("sigma points", &["unscented.pinhole", "unscented.points.alpha_0.1", "unscented.points.margin_0.1"], 25),
    ("lenses", &["distortion.*.strange", "distortion.*.pinhole.*", "distortion.fold"], 35),
    ("surfels", &["surfel"], 50),
    ("depths", &["depth.d16", "depth.d24", "depth.d32", "depth.samples", "depth.median"], 60),
    ("stencils", &["stencil.pass", "stencil.fail", "stencil.depth_fail", "stencil.compare", "stencil.masks"], 35),
    ("logarithms and logits", &["activation"], 12),
    ("codes", &["decoding.as_in", "decoding.end.codebook", "decoding.end.labels", "decoding.rotation"], 18),
    ("projecting shaders", &["projection"], 19),
    ("areas", &["interactions.viewport", "interactions.scissor", "interactions.area"], 38),
];

fn parts() -> Vec<Variant> {
    PARTS.iter().map(|(name, ..)| Variant::new(*name)).collect()
}

/// Runs a part's cases: none fails, and enough pass.
fn holds(case: &Case) {
    let (_, patterns, least) = PARTS.iter().find(|(name, ..)| *name == case.variant()).expect("a part");
    let device = Device::open("llvmpipe").unwrap_or_else(|error| panic!("{}", error.0));
    let mut failures = Vec::new();
    let mut passed = 0;
    for one in all().iter().filter(|one| patterns.iter().any(|pattern| cases::fits(&one.path(), pattern))) {
        match run(one, &device, device.precision()) {
            Outcome::Pass(_) => passed += 1,
            Outcome::Fail(failure) => failures.push(format!("{}: {}", one.path(), failure.message)),
            Outcome::NotSupported(_) => {}
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
    assert!(passed >= *least, "{passed}");
}

#[gaurast_runner::test(needs = [Need::Lavapipe], each = parts())]
fn lavapipe_draws_gaussians(case: &Case) {
    with_emulation(case, &[], || holds(case));
}

/// The parts that are drawn in binary32: those whose arithmetic differs the most, or in a long run all of them.
fn relaxed_parts() -> Vec<Variant> {
    const SAMPLE: [&str; 6] = ["cameras", "instances", "resolve shaders", "sigma points", "surfels", "depths"];
    if is_long() { parts() } else { SAMPLE.map(Variant::new).to_vec() }
}

/// In binary32 alone the device says so, and the parts' cases are within the bounds of the relaxed precision.
#[gaurast_runner::test(needs = [Need::Lavapipe], each = relaxed_parts())]
fn lavapipe_draws_gaussians_in_binary32(case: &Case) {
    with_emulation(case, &[("GAURAST_EMULATION_PRECISION", "relaxed")], || {
        let device = Device::open("llvmpipe").unwrap_or_else(|error| panic!("{}", error.0));
        assert_eq!(device.precision(), PrecisionClass::Relaxed);
        holds(case);
    });
}

/// Pairs that do not fit are looked for by every tile: the pictures are as right.
#[gaurast_runner::test(needs = [Need::Lavapipe], each = ["commands", "views", "footprints", "areas"].map(Variant::new).to_vec())]
fn pairs_that_do_not_fit_are_drawn(case: &Case) {
    with_emulation(case, &[("GAURAST_EMULATION_PAIRS", "10")], || holds(case));
}

/// Draws a generated garden by the first device of the loader, and writes its picture to the file that the environment names.
fn draw_garden() {
    // SAFETY: the loader is the system's own.
    let entry = unsafe { ash::Entry::load() }.expect("the loader");
    let mut renderer = gaurast_render::Renderer::new(entry).expect("a renderer");
    let scene = gaurast_scene::garden::scene(7, 2000);
    let camera = gaurast_scene::garden::camera(None, [96, 64]).expect("a camera");
    let picture = renderer.draw(&scene, &camera).expect("a picture");
    let file = std::env::var_os(PICTURE).expect("a file");
    std::fs::write(file, bytemuck::cast_slice(&picture.pixels)).expect("the picture is written");
}

/// The variable for the file of a picture.
const PICTURE: &str = "GAURAST_TEST_PICTURE";

/// A picture is the same, bit for bit, however many pairs fit the memory.
#[gaurast_runner::test(needs = [Need::Lavapipe])]
fn pictures_do_not_depend_on_the_memory_for_pairs(case: &Case) {
    if case.is_alone() {
        return draw_garden();
    }
    let folder = tempfile::tempdir().expect("a folder");
    let pictures = ["100000", "1000", "1"].map(|pairs| {
        let file = folder.path().join(pairs);
        let path = file.to_str().expect("a path of Unicode");
        with_emulation(case, &[("GAURAST_EMULATION_PAIRS", pairs), (PICTURE, path)], || {});
        std::fs::read(&file).expect("the picture")
    });
    let [all, some, none] = &pictures;
    assert!(all.iter().any(|byte| *byte != 0));
    assert!(all == some && all == none, "pictures differ");
}

/// Gaussians in front of a depth, on a device, and what they are drawn to.
struct Tested {
    target: Target,
    scene: GaussianScene,
}

impl Tested {
    fn new(gpu: &Gpu) -> Self {
        let colors = TargetOptions::of(vk::Format::R32G32B32A32_SFLOAT);
        let target = Target::new(gpu, &TargetOptions { size: [70, 50], depth: Some(vk::Format::D32_SFLOAT), ..colors });
        Self { target, scene: GaussianScene::new(gpu, &scenes::cloud(5, 300, 0)) }
    }

    /// A pass that clears the depth to that of Gaussians at a distance of 4.
    fn pass(flags: vk::RenderingFlags) -> Pass {
        Pass { depth: vk::ClearDepthStencilValue { depth: 0.8, stencil: 0 }, flags, ..Pass::default() }
    }

    fn pipeline(&self, gpu: &Gpu, render_pass: Option<vk::RenderPass>) -> GaussianPipeline {
        let options = GaussianOptions {
            depth_stencil: depth_test(vk::CompareOp::LESS),
            formats: self.target.attachment_formats(),
            blend: vec![over()],
            render_pass,
            ..GaussianOptions::new(0)
        };
        GaussianPipeline::new(gpu, &options)
    }

    fn draw(&self, commands: &Commands, pipeline: &GaussianPipeline) {
        let camera = scenes::camera(70, 50).to_vulkan().depth_coefficients([16.0 / 15.0, -16.0 / 15.0]);
        commands.whole(&self.target);
        self.scene.draw(commands, pipeline, &camera);
    }

    /// Draws in a render pass object that clears to the same values as the pass.
    fn draw_in_object(&self, gpu: &Gpu) {
        let device = gpu.device();
        let attachment = |format: vk::Format| {
            vk::AttachmentDescription::default()
                .format(format)
                .samples(vk::SampleCountFlags::TYPE_1)
                .load_op(vk::AttachmentLoadOp::CLEAR)
                .store_op(vk::AttachmentStoreOp::STORE)
                .initial_layout(vk::ImageLayout::GENERAL)
                .final_layout(vk::ImageLayout::GENERAL)
        };
        let attachments = [attachment(vk::Format::R32G32B32A32_SFLOAT), attachment(vk::Format::D32_SFLOAT)];
        let [color, depth] =
            [0, 1].map(|index| vk::AttachmentReference { attachment: index, layout: vk::ImageLayout::GENERAL });
        let colors = [color];
        let subpasses = [vk::SubpassDescription::default().color_attachments(&colors).depth_stencil_attachment(&depth)];
        let info = vk::RenderPassCreateInfo::default().attachments(&attachments).subpasses(&subpasses);
        let views = [self.target.colors[0].attachment, self.target.depth.as_ref().expect("depths").attachment];
        let pass = Self::pass(vk::RenderingFlags::empty());
        let clears = [vk::ClearValue { color: pass.color }, vk::ClearValue { depth_stencil: pass.depth }];
        // SAFETY: the render pass is valid, and what is created here is destroyed after the commands have run.
        unsafe {
            let object = device.create_render_pass(&info, None).expect("a render pass");
            let info = vk::FramebufferCreateInfo::default()
                .render_pass(object)
                .attachments(&views)
                .width(70)
                .height(50)
                .layers(1);
            let framebuffer = device.create_framebuffer(&info, None).expect("a framebuffer");
            let pipeline = self.pipeline(gpu, Some(object));
            gpu.run(|commands| {
                let (device, raw) = commands.raw();
                let info = vk::RenderPassBeginInfo::default()
                    .render_pass(object)
                    .framebuffer(framebuffer)
                    .render_area(vk::Rect2D::default().extent(vk::Extent2D { width: 70, height: 50 }))
                    .clear_values(&clears);
                commands.barrier();
                device.cmd_begin_render_pass(raw, &info, vk::SubpassContents::INLINE);
                self.draw(commands, &pipeline);
                device.cmd_end_render_pass(raw);
                commands.barrier();
            });
            device.destroy_framebuffer(framebuffer, None);
            device.destroy_render_pass(object, None);
        }
    }

    /// Records a secondary command buffer.
    fn secondary(&self, gpu: &Gpu, record: impl FnOnce(&Commands)) -> Result<Recorded, vk::Result> {
        let formats = self.target.attachment_formats();
        let mut rendering = vk::CommandBufferInheritanceRenderingInfo::default()
            .color_attachment_formats(&formats.colors)
            .depth_attachment_format(formats.depth)
            .rasterization_samples(vk::SampleCountFlags::TYPE_1);
        let inheritance = vk::CommandBufferInheritanceInfo::default().push_next(&mut rendering);
        let info = vk::CommandBufferBeginInfo::default()
            .flags(vk::CommandBufferUsageFlags::RENDER_PASS_CONTINUE)
            .inheritance_info(&inheritance);
        gpu.record_as(vk::CommandBufferLevel::SECONDARY, &info, record)
    }
}

/// Clears the depths of the picture to the pass's.
fn clear(commands: &Commands) {
    let (device, raw) = commands.raw();
    let depth = Tested::pass(vk::RenderingFlags::empty()).depth;
    let clear = vk::ClearAttachment::default()
        .aspect_mask(vk::ImageAspectFlags::DEPTH)
        .clear_value(vk::ClearValue { depth_stencil: depth });
    let whole = vk::Rect2D::default().extent(vk::Extent2D { width: 70, height: 50 });
    let area = vk::ClearRect { rect: whole, base_array_layer: 0, layer_count: 1 };
    // SAFETY: the pass has such an attachment.
    unsafe { device.cmd_clear_attachments(raw, &[clear], &[area]) };
}

/// Depths are tested and stored in render pass objects and in secondary command buffers, as in dynamic rendering.
#[gaurast_runner::test(needs = [Need::Lavapipe])]
fn all_passes_test_depths(case: &Case) {
    with_emulation(case, &[], || {
        let device = Device::open("llvmpipe").unwrap_or_else(|error| panic!("{}", error.0));
        let gpu = device.gpu();
        let tested = Tested::new(gpu);
        let pipeline = tested.pipeline(gpu, None);
        let pass = Tested::pass(vk::RenderingFlags::empty());
        let empty = tested.target.draw(gpu, &pass, |_| {}).pictures;
        let wanted = tested.target.draw(gpu, &pass, |commands| tested.draw(commands, &pipeline)).pictures;
        assert!(
            empty.iter().zip(&wanted).all(|(empty, drawn)| empty.bytes != drawn.bytes),
            "colours and depths change"
        );
        tested.draw_in_object(gpu);
        assert!(tested.target.output(gpu).pictures == wanted, "a render pass object differs");
        // What another secondary command buffer stores before is tested against.
        let before = tested.secondary(gpu, clear).expect("a secondary command buffer");
        let drawing = tested.secondary(gpu, |commands| tested.draw(commands, &pipeline));
        let drawing = drawing.expect("a secondary command buffer");
        let flags = vk::RenderingFlags::CONTENTS_SECONDARY_COMMAND_BUFFERS;
        let pass = Pass { flags, ..Pass::default() };
        let executed = tested.target.draw(gpu, &pass, |commands| {
            let (device, raw) = commands.raw();
            // SAFETY: the secondary command buffers are for this pass.
            unsafe { device.cmd_execute_commands(raw, &[before.raw, drawing.raw]) };
        });
        assert!(executed.pictures == wanted, "secondary command buffers differ");
        // What is stored within a secondary command buffer cannot be.
        let both = tested.secondary(gpu, |commands| {
            clear(commands);
            tested.draw(commands, &pipeline);
        });
        assert_eq!(both.err(), Some(vk::Result::ERROR_FEATURE_NOT_PRESENT));
    });
}

/// Frames leave nothing behind.
#[gaurast_runner::test(needs = [Need::Lavapipe])]
fn frames_take_no_more_memory(case: &Case) {
    with_emulation(case, &[], || {
        // SAFETY: the loader is the system's own.
        let entry = unsafe { ash::Entry::load() }.expect("the loader");
        let mut renderer = gaurast_render::Renderer::new(entry).expect("a renderer");
        let scene = gaurast_scene::garden::scene(7, 50);
        let camera = gaurast_scene::garden::camera(None, [32, 32]).expect("a camera");
        let frames = if is_long() { 10_000 } else { 200 };
        let mut early = None;
        for frame in 0..frames {
            renderer.draw(&scene, &camera).expect("a picture");
            if frame == frames / 4 {
                early = memory("VmRSS:");
            }
        }
        let (Some(early), Some(late)) = (early, memory("VmRSS:")) else {
            return;
        };
        assert!(late < early + (4 << 20), "{early} bytes, and {late} later");
    });
}

/// Pipelines and cameras that are not emulated are refused.
#[gaurast_runner::test(needs = [Need::Lavapipe])]
fn pictures_that_are_not_emulated_are_refused(case: &Case) {
    with_emulation(case, &[], || {
        let device = Device::open("llvmpipe").unwrap_or_else(|error| panic!("{}", error.0));
        let gpu = device.gpu();
        let absent = Some(vk::Result::ERROR_FEATURE_NOT_PRESENT);
        let created = |change: &dyn Fn(State) -> State| {
            let request = splats();
            Graphics { gaussian: request.gaussian.map(change), ..request }.create(gpu).err()
        };
        assert_eq!(created(&|state| state), None);
        assert_eq!(created(&|state| state.order(GaussianOrderGAURAST::PER_PIXEL)), absent);
        assert_eq!(created(&|state| state.precision(GaussianPrecisionGAURAST::FLOAT16)), absent);
    });
}

/// No disc is drawn through a lens that distorts, and no coefficients are no lens.
#[gaurast_runner::test(needs = [Need::Lavapipe])]
fn discs_are_not_seen_through_lenses(case: &Case) {
    with_emulation(case, &[], || {
        let device = Device::open("llvmpipe").unwrap_or_else(|error| panic!("{}", error.0));
        let gpu = device.gpu();
        let target = Target::new(gpu, &TargetOptions { size: [70, 50], ..TargetOptions::default() });
        let scene = GaussianScene::new(gpu, &scenes::cloud(5, 300, 0));
        let seen = |geometry: GaussianGeometryGAURAST, k1: f32| {
            let options = GaussianOptions::over(0, &target);
            let pipeline =
                GaussianPipeline::new(gpu, &GaussianOptions { state: options.state.geometry(geometry), ..options });
            let mut lens = GaussianCameraDistortionGAURAST::default().radial([k1, 0.0, 0.0, 0.0, 0.0, 0.0]);
            let camera = scenes::camera(70, 50).to_vulkan().push_next(&mut lens);
            target.draw(gpu, &Pass::zeros(), |commands| {
                commands.whole(&target);
                scene.draw(commands, &pipeline, &camera);
            })
        };
        let (volume, disc) = (GaussianGeometryGAURAST::GAUSSIAN_3D, GaussianGeometryGAURAST::GAUSSIAN_2D);
        assert!(seen(disc, 0.0).shows_something() && seen(volume, -0.1).shows_something());
        assert!(seen(volume, 0.0).pictures != seen(volume, -0.1).pictures, "a lens changes nothing");
        assert!(!seen(disc, -0.1).shows_something(), "a disc is drawn through a lens");
    });
}
