//! Render passes whose subpasses read the results of others and resolve samples.

use ash::vk;
use gaurast_testkit::canvas::{Canvas, Vertex, colored, deep_vertex, everything};
use gaurast_testkit::devices::{COLOR_LAYERS, open};
use gaurast_testkit::scene::{FORMAT, HEIGHT, WIDTH, area, extent, set_viewport};
use gaurast_testkit::shader::spirv;
use gaurast_testkit::{Bindings, Buffer, Gpu, Graphics, Image, ImageOptions, Pipeline, Resource, Shader};

const GENERAL: vk::ImageLayout = vk::ImageLayout::GENERAL;
const RED: [f32; 4] = [1.0, 0.25, 0.0, 1.0];
const BLACK: [f32; 4] = [0.0; 4];
const FAR: f32 = 0.75;

fn image(gpu: &Gpu, format: vk::Format, samples: vk::SampleCountFlags) -> Image {
    let usage = match format {
        vk::Format::D32_SFLOAT | vk::Format::D32_SFLOAT_S8_UINT => vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT,
        _ => vk::ImageUsageFlags::COLOR_ATTACHMENT,
    };
    let usage = usage | vk::ImageUsageFlags::INPUT_ATTACHMENT;
    let options = ImageOptions { samples: samples.as_raw(), ..ImageOptions::new(format, [WIDTH, HEIGHT], usage) };
    Image::new(gpu, &options)
}

fn description(format: vk::Format, samples: vk::SampleCountFlags) -> vk::AttachmentDescription {
    vk::AttachmentDescription::default()
        .format(format)
        .samples(samples)
        .load_op(vk::AttachmentLoadOp::CLEAR)
        .store_op(vk::AttachmentStoreOp::STORE)
        .stencil_load_op(vk::AttachmentLoadOp::CLEAR)
        .stencil_store_op(vk::AttachmentStoreOp::STORE)
        .initial_layout(GENERAL)
        .final_layout(GENERAL)
}

fn reference(attachment: u32) -> vk::AttachmentReference {
    vk::AttachmentReference { attachment, layout: GENERAL }
}

/// A render pass of two subpasses, the second of which reads what the first wrote.
fn render_pass(
    gpu: &Gpu,
    attachments: &[vk::AttachmentDescription],
    subpasses: &[vk::SubpassDescription],
) -> vk::RenderPass {
    let dependencies = [dependency()];
    let info =
        vk::RenderPassCreateInfo::default().attachments(attachments).subpasses(subpasses).dependencies(&dependencies);
    // SAFETY: see the crate.
    unsafe { gpu.device().create_render_pass(&info, None).unwrap() }
}

/// The dependency of the second subpass's reads on the first one's writes.
fn dependency() -> vk::SubpassDependency {
    vk::SubpassDependency::default()
        .src_subpass(0)
        .dst_subpass(1)
        .src_stage_mask(vk::PipelineStageFlags::COLOR_ATTACHMENT_OUTPUT | vk::PipelineStageFlags::LATE_FRAGMENT_TESTS)
        .dst_stage_mask(vk::PipelineStageFlags::FRAGMENT_SHADER)
        .src_access_mask(vk::AccessFlags::COLOR_ATTACHMENT_WRITE | vk::AccessFlags::DEPTH_STENCIL_ATTACHMENT_WRITE)
        .dst_access_mask(vk::AccessFlags::INPUT_ATTACHMENT_READ)
}

/// A set of input attachments.
fn inputs(canvas: &Canvas, images: &[Image]) -> Bindings {
    let resources: Vec<_> = images.iter().map(|image| Resource::Input(image.view)).collect();
    Bindings::new(&canvas.gpu, &resources)
}

/// A pass of two subpasses, which draw a triangle each.
struct TwoDraws<'a> {
    canvas: &'a Canvas,
    pass: vk::RenderPass,
    images: &'a [Image],
    made: &'a [Pipeline; 2],
    vertices: [&'a [Vertex]; 2],
    set: vk::DescriptorSet,
}

impl TwoDraws<'_> {
    fn run(&self) {
        let gpu = &self.canvas.gpu;
        let views: Vec<_> = self.images.iter().map(|image| image.view).collect();
        let info = vk::FramebufferCreateInfo::default()
            .render_pass(self.pass)
            .attachments(&views)
            .width(WIDTH)
            .height(HEIGHT)
            .layers(1);
        let vertices = Buffer::of(gpu, self.vertices.concat().as_flattened());
        // SAFETY: see the crate.
        unsafe {
            let framebuffer = gpu.device().create_framebuffer(&info, None).unwrap();
            gpu.run(|recording| {
                let (device, commands) = recording.raw();
                let depth = vk::ClearValue { depth_stencil: vk::ClearDepthStencilValue { depth: FAR, stencil: 0 } };
                // The colours' clear values do not matter as long as they are black.
                let values = [vk::ClearValue::default(), depth, depth];
                let begin = vk::RenderPassBeginInfo::default()
                    .render_pass(self.pass)
                    .framebuffer(framebuffer)
                    .render_area(area(&self.images[0]))
                    .clear_values(&values);
                let graphics = vk::PipelineBindPoint::GRAPHICS;
                device.cmd_begin_render_pass(commands, &begin, vk::SubpassContents::INLINE);
                set_viewport(device, commands, &self.images[0]);
                device.cmd_bind_vertex_buffers(commands, 0, &[vertices.raw], &[0]);
                device.cmd_bind_pipeline(commands, graphics, self.made[0].raw);
                device.cmd_draw(commands, 3, 1, 0, 0);
                device.cmd_next_subpass(commands, vk::SubpassContents::INLINE);
                device.cmd_bind_pipeline(commands, graphics, self.made[1].raw);
                let layout = self.made[1].layout;
                device.cmd_bind_descriptor_sets(commands, graphics, layout, 0, &[self.set], &[]);
                device.cmd_draw(commands, 3, 1, 3, 0);
                device.cmd_end_render_pass(commands);
            });
            gpu.device().destroy_framebuffer(framebuffer, None);
        }
    }
}

/// A triangle that covers half of the canvas, in one colour and at one depth.
fn half(color: [f32; 4]) -> [Vertex; 3] {
    let corner = |x, y| deep_vertex([x, y, 0.25], color);
    [corner(-1.0, -1.0), corner(1.0, -1.0), corner(-1.0, 1.0)]
}

#[gaurast_runner::test]
fn a_subpass_reads_what_an_earlier_one_left() {
    let canvas = Canvas::new();
    let gpu = &canvas.gpu;
    let one = vk::SampleCountFlags::TYPE_1;
    let depth_format = vk::Format::D32_SFLOAT;
    let images = [image(gpu, FORMAT, one), image(gpu, depth_format, one), image(gpu, FORMAT, one)];
    let attachments = [
        description(FORMAT, one),
        description(depth_format, one),
        description(FORMAT, one).load_op(vk::AttachmentLoadOp::DONT_CARE),
    ];
    let (first, depth, last) = ([reference(0)], reference(1), [reference(2)]);
    let read = [reference(0), reference(1)];
    let subpasses = [
        vk::SubpassDescription::default().color_attachments(&first).depth_stencil_attachment(&depth),
        vk::SubpassDescription::default().color_attachments(&last).input_attachments(&read),
    ];
    let pass = render_pass(gpu, &attachments, &subpasses);
    let set = inputs(&canvas, &images[..2]);
    let writes_depth = Graphics {
        depth_stencil: vk::PipelineDepthStencilStateCreateInfo::default()
            .depth_test_enable(true)
            .depth_write_enable(true)
            .depth_compare_op(vk::CompareOp::LESS),
        subpass: Some((pass, 0)),
        ..colored()
    };
    let reads = Graphics {
        set_layouts: vec![set.layout],
        subpass: Some((pass, 1)),
        ..colored().with_shader(Shader::fragment(spirv("subpass.frag")))
    };
    let made = [writes_depth, reads].map(|request| request.create(gpu).unwrap());
    let (drawn, all) = (half(RED), everything(BLACK));
    TwoDraws { canvas: &canvas, pass, images: &images, made: &made, vertices: [&drawn, &all], set: set.set }.run();
    let written = images[0].colors::<[f32; 4]>();
    let read = images[2].colors::<[f32; 4]>();
    let mut counts = [0, 0];
    for (written, read) in written.into_iter().zip(read) {
        let is_drawn = written == RED;
        assert!(is_drawn || written == BLACK, "{written:?}");
        let depth = if is_drawn { 0.25 } else { FAR };
        assert_eq!(read, [written[0], written[2], written[1], depth]);
        counts[usize::from(is_drawn)] += 1;
    }
    assert!(counts.iter().all(|&count| count > 100), "{counts:?}");
    // SAFETY: see the crate.
    unsafe { gpu.device().destroy_render_pass(pass, None) };
}

#[gaurast_runner::test]
fn samples_are_resolved_and_read_one_by_one() {
    let canvas = Canvas::new();
    let gpu = &canvas.gpu;
    let (one, four) = (vk::SampleCountFlags::TYPE_1, vk::SampleCountFlags::TYPE_4);
    let images = [image(gpu, FORMAT, four), image(gpu, FORMAT, one), image(gpu, FORMAT, one)];
    let attachments = [
        description(FORMAT, four).store_op(vk::AttachmentStoreOp::DONT_CARE),
        description(FORMAT, one).load_op(vk::AttachmentLoadOp::DONT_CARE),
        description(FORMAT, one).load_op(vk::AttachmentLoadOp::DONT_CARE),
    ];
    let (many, resolved, last) = ([reference(0)], [reference(1)], [reference(2)]);
    let subpasses = [
        vk::SubpassDescription::default().color_attachments(&many).resolve_attachments(&resolved),
        vk::SubpassDescription::default().color_attachments(&last).input_attachments(&many),
    ];
    let pass = render_pass(gpu, &attachments, &subpasses);
    let set = inputs(&canvas, &images[..1]);
    let multisampled = Graphics {
        multisample: vk::PipelineMultisampleStateCreateInfo::default().rasterization_samples(four),
        subpass: Some((pass, 0)),
        ..colored()
    };
    let reads = Graphics {
        set_layouts: vec![set.layout],
        subpass: Some((pass, 1)),
        ..colored().with_shader(Shader::fragment(spirv("subpass_samples.frag")))
    };
    let made = [multisampled, reads].map(|request| request.create(gpu).unwrap());
    let (drawn, all) = (half(RED), everything(BLACK));
    TwoDraws { canvas: &canvas, pass, images: &images, made: &made, vertices: [&drawn, &all], set: set.set }.run();
    let means = images[1].colors::<[f32; 4]>();
    let read = images[2].colors::<[f32; 4]>();
    let mut counts = [0; 5];
    let mut differ = 0;
    for (mean, read) in means.into_iter().zip(read) {
        let covered = 4.0 * mean[0];
        assert!(covered.fract() == 0.0 && mean[1] == 0.25 * mean[0], "{mean:?}");
        counts[covered as usize] += 1;
        // The difference of two samples is 0 or 1, and it is 0 if all four samples agree.
        assert!([0.0, 1.0].contains(&read[0]) && read[1] == 0.25 * read[0], "{read:?}");
        if [0.0, 4.0].contains(&covered) {
            assert_eq!(read, [0.0, 0.0, 0.0, mean[3]], "{mean:?}");
        }
        differ += u32::from(read[0] == 1.0);
    }
    assert!(counts[0] > 100 && counts[4] > 100, "{counts:?}");
    assert!(counts[1..4].iter().sum::<u32>() > 10 && differ > 10, "{counts:?} {differ}");
    // SAFETY: see the crate.
    unsafe { gpu.device().destroy_render_pass(pass, None) };
}

#[gaurast_runner::test]
fn depth_and_stencil_are_resolved() {
    use vk::ResolveModeFlags as Mode;
    let gpu = open();
    check_resolve(&gpu, [Mode::MIN, Mode::SAMPLE_ZERO], (0.375, 9));
    // What is not resolved has its load operation all the same.
    check_resolve(&gpu, [Mode::NONE, Mode::SAMPLE_ZERO], (1.0, 9));
    check_resolve(&gpu, [Mode::MIN, Mode::NONE], (0.375, 1));
}

/// Clears samples to 0.375 and 9, and what they are resolved to by these modes of depth and stencil to 1 and 1.
fn check_resolve(gpu: &Gpu, modes: [vk::ResolveModeFlags; 2], expected: (f32, u8)) {
    let format = vk::Format::D32_SFLOAT_S8_UINT;
    let (one, four) = (vk::SampleCountFlags::TYPE_1, vk::SampleCountFlags::TYPE_4);
    let images = [image(gpu, format, four), image(gpu, format, one)];
    let attachments = [four, one].map(|samples| {
        vk::AttachmentDescription2::default()
            .format(format)
            .samples(samples)
            .load_op(vk::AttachmentLoadOp::CLEAR)
            .stencil_load_op(vk::AttachmentLoadOp::CLEAR)
            .stencil_store_op(vk::AttachmentStoreOp::STORE)
            .initial_layout(GENERAL)
            .final_layout(GENERAL)
    });
    let both = vk::ImageAspectFlags::DEPTH | vk::ImageAspectFlags::STENCIL;
    let [many, single] = [0, 1]
        .map(|attachment| vk::AttachmentReference2::default().attachment(attachment).layout(GENERAL).aspect_mask(both));
    let mut resolve = vk::SubpassDescriptionDepthStencilResolve::default()
        .depth_resolve_mode(modes[0])
        .stencil_resolve_mode(modes[1])
        .depth_stencil_resolve_attachment(&single);
    let subpasses = [vk::SubpassDescription2::default().depth_stencil_attachment(&many).push_next(&mut resolve)];
    let info = vk::RenderPassCreateInfo2::default().attachments(&attachments).subpasses(&subpasses);
    let views = [&images[0], &images[1]].map(|image| image.attachment);
    let texels = u64::from(WIDTH * HEIGHT);
    let buffers = [4, 1].map(|size| Buffer::new(gpu, texels * size));
    // SAFETY: see the crate.
    unsafe {
        let pass = gpu.device().create_render_pass2(&info, None).unwrap();
        let info = vk::FramebufferCreateInfo::default()
            .render_pass(pass)
            .attachments(&views)
            .width(WIDTH)
            .height(HEIGHT)
            .layers(1);
        let framebuffer = gpu.device().create_framebuffer(&info, None).unwrap();
        gpu.run(|recording| {
            let (device, commands) = recording.raw();
            let value =
                |depth, stencil| vk::ClearValue { depth_stencil: vk::ClearDepthStencilValue { depth, stencil } };
            let values = [value(0.375, 9), value(1.0, 1)];
            let begin = vk::RenderPassBeginInfo::default()
                .render_pass(pass)
                .framebuffer(framebuffer)
                .render_area(area(&images[0]))
                .clear_values(&values);
            device.cmd_begin_render_pass(commands, &begin, vk::SubpassContents::INLINE);
            device.cmd_end_render_pass(commands);
            let aspects = [vk::ImageAspectFlags::DEPTH, vk::ImageAspectFlags::STENCIL];
            for (aspect_mask, buffer) in aspects.into_iter().zip(&buffers) {
                let region = vk::BufferImageCopy::default()
                    .image_subresource(vk::ImageSubresourceLayers { aspect_mask, ..COLOR_LAYERS })
                    .image_extent(extent(&images[1]).into());
                let (from, to) = (images[1].raw, buffer.raw);
                device.cmd_copy_image_to_buffer(commands, from, GENERAL, to, &[region]);
            }
        });
        gpu.device().destroy_framebuffer(framebuffer, None);
        gpu.device().destroy_render_pass(pass, None);
    }
    let depths = buffers[0].values::<f32>();
    let stencils = buffers[1].values::<u8>();
    let of_depth = depths.iter().all(|&depth| depth == expected.0);
    let of_stencil = stencils.iter().all(|&stencil| stencil == expected.1);
    assert!(of_depth && of_stencil, "{modes:?}");
}
