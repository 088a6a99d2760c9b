//! Scenes of render pass objects: subpasses, input attachments, resolves.

use ash::vk;

use gaurast_testkit::drawn::Drawn;
use gaurast_testkit::drawn::need_format;
use gaurast_testkit::shapes;
use gaurast_testkit::{
    Bindings, Buffer, Commands, Gpu, Pipeline, PipelineOptions, Resource, Target, TargetOptions, depth_test,
};

/// A render pass with a framebuffer.
struct Object {
    render_pass: vk::RenderPass,
    framebuffer: vk::Framebuffer,
    gpu: Gpu,
}

impl Object {
    fn new(gpu: &Gpu, info: &vk::RenderPassCreateInfo<'_>, views: &[vk::ImageView], [width, height]: [u32; 2]) -> Self {
        // SAFETY: see the crate.
        unsafe {
            let device = gpu.device();
            let render_pass = device.create_render_pass(info, None).expect("a render pass");
            let info = vk::FramebufferCreateInfo::default()
                .render_pass(render_pass)
                .attachments(views)
                .width(width)
                .height(height)
                .layers(1);
            let framebuffer = device.create_framebuffer(&info, None).expect("a framebuffer");
            Self { render_pass, framebuffer, gpu: gpu.clone() }
        }
    }

    /// Records a pass that clears its attachments to `clears`.
    fn pass(&self, commands: &Commands, target: &Target, clears: &[vk::ClearValue], draws: impl FnOnce()) {
        let [width, height] = target.options.size;
        let info = vk::RenderPassBeginInfo::default()
            .render_pass(self.render_pass)
            .framebuffer(self.framebuffer)
            .render_area(vk::Rect2D { offset: vk::Offset2D::default(), extent: vk::Extent2D { width, height } })
            .clear_values(clears);
        let device = commands.device();
        commands.barrier();
        // SAFETY: see the crate.
        unsafe { device.cmd_begin_render_pass(commands.raw, &info, vk::SubpassContents::INLINE) };
        commands.whole(target);
        draws();
        // SAFETY: see the crate.
        unsafe { device.cmd_end_render_pass(commands.raw) };
        commands.barrier();
    }
}

impl Drop for Object {
    fn drop(&mut self) {
        let device = self.gpu.device();
        // SAFETY: see the crate.
        unsafe {
            device.destroy_framebuffer(self.framebuffer, None);
            device.destroy_render_pass(self.render_pass, None);
        }
    }
}

fn attachment(format: vk::Format, samples: u32) -> vk::AttachmentDescription {
    vk::AttachmentDescription::default()
        .format(format)
        .samples(vk::SampleCountFlags::from_raw(samples))
        .load_op(vk::AttachmentLoadOp::CLEAR)
        .store_op(vk::AttachmentStoreOp::STORE)
        .stencil_load_op(vk::AttachmentLoadOp::CLEAR)
        .stencil_store_op(vk::AttachmentStoreOp::STORE)
        .initial_layout(vk::ImageLayout::GENERAL)
        .final_layout(vk::ImageLayout::GENERAL)
}

fn reference(attachment: u32, layout: vk::ImageLayout) -> vk::AttachmentReference {
    vk::AttachmentReference { attachment, layout }
}

const COLOR: vk::ImageLayout = vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL;
const DEPTH: vk::ImageLayout = vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL;
/// The image layout in the descriptors.
const READ: vk::ImageLayout = vk::ImageLayout::GENERAL;

fn clears() -> [vk::ClearValue; 3] {
    let color = vk::ClearValue { color: vk::ClearColorValue { float32: [0.2, 0.4, 0.6, 1.0] } };
    let depth = vk::ClearValue { depth_stencil: vk::ClearDepthStencilValue { depth: 1.0, stencil: 0 } };
    [color, depth, color]
}

pub fn render_pass_object(gpu: &Gpu) -> Drawn {
    let format = vk::Format::D32_SFLOAT;
    let target = Target::new(gpu, &TargetOptions::with_depth(format));
    let attachments = [attachment(target.options.colors[0], 1), attachment(format, 1)];
    let colors = [reference(0, COLOR)];
    let depth = reference(1, DEPTH);
    let subpasses = [vk::SubpassDescription::default().color_attachments(&colors).depth_stencil_attachment(&depth)];
    let info = vk::RenderPassCreateInfo::default().attachments(&attachments).subpasses(&subpasses);
    let depth_image = target.depth.as_ref().expect("it has depth");
    let views = [target.colors[0].attachment, depth_image.attachment];
    let object = Object::new(gpu, &info, &views, target.options.size);
    let options = PipelineOptions {
        depth_stencil: depth_test(vk::CompareOp::LESS),
        subpass: Some((object.render_pass, 0)),
        ..PipelineOptions::default()
    };
    let pipeline = Pipeline::new(gpu, &target, &options);
    let vertices = Buffer::of(gpu, &shapes::soup(140, 40));
    gpu.run(|commands| {
        object.pass(commands, &target, &clears()[..2], || {
            commands.bind(&pipeline);
            commands.vertices(&vertices);
            commands.draw(0..120);
        });
    });
    Ok(target.output(gpu))
}

/// Reads colour and depth of the first subpass in a second subpass.
pub fn input_attachments(gpu: &Gpu) -> Drawn {
    let format = vk::Format::D32_SFLOAT;
    let feature = vk::FormatFeatureFlags::SAMPLED_IMAGE;
    need_format(gpu, format, feature)?;
    let options = TargetOptions { colors: vec![vk::Format::R8G8B8A8_UNORM; 2], ..TargetOptions::with_depth(format) };
    let target = Target::new(gpu, &options);
    let depth_image = target.depth.as_ref().expect("it has depth");
    let attachments = [attachment(options.colors[0], 1), attachment(format, 1), attachment(options.colors[1], 1)];
    let first_colors = [reference(0, COLOR)];
    let depth = reference(1, DEPTH);
    let second_colors = [reference(2, COLOR)];
    let inputs = [reference(0, READ), reference(1, READ)];
    let subpasses = [
        vk::SubpassDescription::default().color_attachments(&first_colors).depth_stencil_attachment(&depth),
        vk::SubpassDescription::default().color_attachments(&second_colors).input_attachments(&inputs),
    ];
    let dependencies = [vk::SubpassDependency::default()
        .dst_subpass(1)
        .src_stage_mask(vk::PipelineStageFlags::ALL_GRAPHICS)
        .dst_stage_mask(vk::PipelineStageFlags::ALL_GRAPHICS)
        .src_access_mask(vk::AccessFlags::MEMORY_WRITE)
        .dst_access_mask(vk::AccessFlags::MEMORY_READ)
        .dependency_flags(vk::DependencyFlags::BY_REGION)];
    let info =
        vk::RenderPassCreateInfo::default().attachments(&attachments).subpasses(&subpasses).dependencies(&dependencies);
    let views = [target.colors[0].attachment, depth_image.attachment, target.colors[1].attachment];
    let object = Object::new(gpu, &info, &views, options.size);
    let resources = [Resource::Input(target.colors[0].view), Resource::Input(depth_image.view)];
    let bindings = Bindings::new(gpu, &resources);
    // Each subpass has one colour attachment.
    let one = Target::new(gpu, &TargetOptions::with_depth(format));
    let first = PipelineOptions {
        depth_stencil: depth_test(vk::CompareOp::LESS),
        subpass: Some((object.render_pass, 0)),
        ..PipelineOptions::default()
    };
    let second = PipelineOptions {
        fragment: Some(
            "layout(input_attachment_index = 0, set = 0, binding = 0) uniform subpassInput color_in;
             layout(input_attachment_index = 1, set = 0, binding = 1) uniform subpassInput depth_in;
             layout(location = 0) out vec4 color;
             void main() {
                 vec4 c = subpassLoad(color_in);
                 color = vec4(1.0 - c.rgb, subpassLoad(depth_in).r);
             }",
        ),
        bindings: Some(&bindings),
        subpass: Some((object.render_pass, 1)),
        ..PipelineOptions::default()
    };
    let first = Pipeline::new(gpu, &one, &first);
    let second = Pipeline::new(gpu, &one, &second);
    let mut all = shapes::soup(141, 40);
    all.extend(shapes::rectangle([-0.9, -0.8, 0.7, 0.95], 0.5, [1.0; 4]));
    let vertices = Buffer::of(gpu, &all);
    gpu.run(|commands| {
        object.pass(commands, &target, &clears(), || {
            commands.bind(&first);
            commands.vertices(&vertices);
            commands.draw(0..120);
            // SAFETY: see the crate.
            unsafe {
                let device = commands.device();
                device.cmd_next_subpass(commands.raw, vk::SubpassContents::INLINE);
            }
            commands.bind(&second);
            commands.bind_set(&bindings, &[]);
            commands.draw(120..126);
        });
    });
    Ok(target.output(gpu))
}

/// Resolves samples at the end of a subpass.
pub fn resolve_attachments(gpu: &Gpu) -> Drawn {
    let target = Target::new(gpu, &TargetOptions::default().multisampled());
    let format = target.options.colors[0];
    let attachments = [attachment(format, 4), attachment(format, 1)];
    let colors = [reference(0, COLOR)];
    let resolves = [reference(1, COLOR)];
    let subpasses = [vk::SubpassDescription::default().color_attachments(&colors).resolve_attachments(&resolves)];
    let info = vk::RenderPassCreateInfo::default().attachments(&attachments).subpasses(&subpasses);
    let views = [target.colors[0].attachment, target.resolved[0].attachment];
    let object = Object::new(gpu, &info, &views, target.options.size);
    let options = PipelineOptions { subpass: Some((object.render_pass, 0)), ..PipelineOptions::default() };
    let pipeline = Pipeline::new(gpu, &target, &options);
    let vertices = Buffer::of(gpu, &shapes::flat_soup(142, 40));
    gpu.run(|commands| {
        object.pass(commands, &target, &[clears()[0]; 2], || {
            commands.bind(&pipeline);
            commands.vertices(&vertices);
            commands.draw(0..120);
        });
    });
    Ok(target.output(gpu))
}
