//! The attachments of scenes, and reading them back.

use ash::vk;

use crate::descriptors::{Bindings, Resource};
use crate::gpu::{Commands, Gpu};
use crate::output::{Output, Picture};
use crate::pass::{Attachments, Formats, Pass};
use crate::pipeline::{Pipeline, PipelineOptions};
use crate::resource::{Image, ImageOptions, Sampler, aspects, depth_and_stencil, texel_size};

/// The options of a [`Target`].
#[derive(Clone, Debug)]
pub struct TargetOptions {
    /// Width and height.
    pub size: [u32; 2],
    /// Formats of the colour attachments.
    pub colors: Vec<vk::Format>,
    /// Format of depth, stencil or both.
    pub depth: Option<vk::Format>,
    /// Samples per pixel.
    pub samples: u32,
    /// True if colours of several samples are resolved at the end of each pass.
    pub resolve: bool,
}

impl Default for TargetOptions {
    /// One attachment of 8-bit colour.
    fn default() -> Self {
        Self { size: [128, 128], colors: vec![vk::Format::R8G8B8A8_UNORM], depth: None, samples: 1, resolve: true }
    }
}

impl TargetOptions {
    /// One attachment of 8-bit colour, and depth.
    pub fn with_depth(format: vk::Format) -> Self {
        Self { depth: Some(format), ..Self::default() }
    }

    /// One attachment of colour in a format.
    pub fn of(format: vk::Format) -> Self {
        Self { colors: vec![format], ..Self::default() }
    }

    /// The same with four samples per pixel.
    #[must_use]
    pub fn multisampled(self) -> Self {
        Self { samples: 4, ..self }
    }
}

/// The attachments of a pass.
pub struct Target {
    /// Its options.
    pub options: TargetOptions,
    /// Colour attachments.
    pub colors: Vec<Image>,
    /// The resolve attachments, if there are several samples.
    pub resolved: Vec<Image>,
    /// Depth and stencil.
    pub depth: Option<Image>,
}

impl Target {
    /// Creates the attachments. Their contents are undefined.
    pub fn new(gpu: &Gpu, options: &TargetOptions) -> Self {
        use vk::ImageUsageFlags as Usage;
        let image = |format, samples, attachment: Usage| {
            let usage = attachment | Usage::SAMPLED | Usage::INPUT_ATTACHMENT;
            let flat = ImageOptions::new(format, options.size, usage);
            Image::new(gpu, &ImageOptions { samples, ..flat })
        };
        let colors = |samples| {
            let formats = options.colors.iter();
            formats.map(|&format| image(format, samples, Usage::COLOR_ATTACHMENT)).collect()
        };
        Self {
            options: options.clone(),
            colors: colors(options.samples),
            resolved: if options.samples > 1 && options.resolve { colors(1) } else { Vec::new() },
            depth: options.depth.map(|format| image(format, options.samples, Usage::DEPTH_STENCIL_ATTACHMENT)),
        }
    }

    /// Formats for pipelines and secondary command buffers: colours, depth and stencil.
    pub fn formats(&self) -> (&[vk::Format], vk::Format, vk::Format) {
        let (depth, stencil) = depth_and_stencil(self.options.depth.unwrap_or_default());
        (&self.options.colors, depth, stencil)
    }

    /// One colour attachment of four 32-bit floats, and nothing else.
    pub fn floats(gpu: &Gpu, size: [u32; 2]) -> Self {
        let floats = TargetOptions::of(vk::Format::R32G32B32A32_SFLOAT);
        Self::new(gpu, &TargetOptions { size, ..floats })
    }

    /// The texels of the first colour attachment; `T` is a texel.
    pub fn read<T: bytemuck::AnyBitPattern>(&self) -> Vec<T> {
        self.colors[0].colors()
    }

    /// The area of a pass.
    fn area(&self, pass: &Pass) -> vk::Rect2D {
        let [width, height] = self.options.size;
        let whole = vk::Rect2D::default().extent(vk::Extent2D { width, height });
        pass.area.unwrap_or(whole)
    }

    /// Draws one pass of `draws`, and returns the contents of the target.
    pub fn draw(&self, gpu: &Gpu, pass: &Pass, draws: impl FnOnce(&Commands)) -> Output {
        gpu.run(|commands| commands.pass(self, pass, || draws(commands)));
        self.output(gpu)
    }

    /// The contents of the target: colours, depth and stencil. With several samples, the resolved colours and each
    /// sample.
    pub fn output(&self, gpu: &Gpu) -> Output {
        let mut pictures = Vec::new();
        let resolved = self.resolved.iter().enumerate();
        for (index, image) in resolved {
            let aspect = vk::ImageAspectFlags::COLOR;
            pictures.push(picture(format!("resolved {index}"), image, aspect));
        }
        for (index, image) in self.colors.iter().enumerate() {
            self.add(gpu, &format!("color {index}"), image, &mut pictures);
        }
        if let Some(image) = &self.depth {
            self.add(gpu, "depth", image, &mut pictures);
        }
        Output { pictures }
    }

    fn add(&self, gpu: &Gpu, name: &str, image: &Image, pictures: &mut Vec<Picture>) {
        if self.options.samples == 1 {
            for (aspect, name) in [
                (vk::ImageAspectFlags::COLOR, name),
                (vk::ImageAspectFlags::DEPTH, name),
                (vk::ImageAspectFlags::STENCIL, "stencil"),
            ] {
                if aspects(image.options.format).contains(aspect) {
                    pictures.push(picture(name.to_owned(), image, aspect));
                }
            }
            return;
        }
        for sample in 0..self.options.samples {
            let mut picture = fetch_sample(gpu, image, sample);
            picture.name = format!("{name} sample {sample}");
            pictures.push(picture);
        }
    }
}

impl Attachments for Target {
    fn size(&self) -> [u32; 2] {
        self.options.size
    }

    fn attachment_formats(&self) -> Formats {
        Formats {
            colors: self.options.colors.clone(),
            depth: self.options.depth.unwrap_or_default(),
            samples: self.options.samples,
        }
    }

    fn begin(&self, device: &ash::Device, commands: vk::CommandBuffer, pass: &Pass) {
        let layout = vk::ImageLayout::GENERAL;
        let attachment = |view| {
            vk::RenderingAttachmentInfo::default()
                .image_view(view)
                .image_layout(layout)
                .load_op(pass.load)
                .store_op(pass.store)
        };
        let mut colors: Vec<_> = (self.colors.iter())
            .map(|image| {
                let clear = vk::ClearValue { color: pass.color };
                attachment(image.attachment).clear_value(clear)
            })
            .collect();
        for (color, resolved) in colors.iter_mut().zip(&self.resolved) {
            let mode = if is_integer(resolved.options.format) {
                vk::ResolveModeFlags::SAMPLE_ZERO
            } else {
                vk::ResolveModeFlags::AVERAGE
            };
            *color = color.resolve_mode(mode).resolve_image_view(resolved.attachment).resolve_image_layout(layout);
        }
        let depth_view = self.depth.as_ref().map(|image| image.attachment);
        let depth =
            attachment(depth_view.unwrap_or_default()).clear_value(vk::ClearValue { depth_stencil: pass.depth });
        let (_, depth_format, stencil_format) = self.formats();
        let area = self.area(pass);
        let mut info =
            vk::RenderingInfo::default().flags(pass.flags).render_area(area).layer_count(1).color_attachments(&colors);
        if depth_format != vk::Format::UNDEFINED {
            info = info.depth_attachment(&depth);
        }
        if stencil_format != vk::Format::UNDEFINED {
            info = info.stencil_attachment(&depth);
        }
        // SAFETY: see the crate.
        unsafe { device.cmd_begin_rendering(commands, &info) };
    }
}

/// A render pass object with one subpass over a target's first colour attachment, and its framebuffer.
pub struct PassObject<'a> {
    /// The render pass.
    pub render_pass: vk::RenderPass,
    framebuffer: vk::Framebuffer,
    target: &'a Target,
}

impl<'a> PassObject<'a> {
    /// A render pass that clears `target` and stores its contents.
    pub fn new(target: &'a Target) -> Self {
        let attachments = [vk::AttachmentDescription::default()
            .format(target.options.colors[0])
            .samples(vk::SampleCountFlags::TYPE_1)
            .load_op(vk::AttachmentLoadOp::CLEAR)
            .store_op(vk::AttachmentStoreOp::STORE)
            .initial_layout(vk::ImageLayout::GENERAL)
            .final_layout(vk::ImageLayout::GENERAL)];
        let references = [vk::AttachmentReference::default().layout(vk::ImageLayout::GENERAL)];
        let subpasses = [vk::SubpassDescription::default().color_attachments(&references)];
        let info = vk::RenderPassCreateInfo::default().attachments(&attachments).subpasses(&subpasses);
        let device = target.colors[0].gpu().device();
        let [width, height] = target.options.size;
        let views = [target.colors[0].attachment];
        // SAFETY: see the crate.
        unsafe {
            let render_pass = device.create_render_pass(&info, None).expect("a render pass");
            let info = vk::FramebufferCreateInfo::default()
                .render_pass(render_pass)
                .attachments(&views)
                .width(width)
                .height(height)
                .layers(1);
            let framebuffer = device.create_framebuffer(&info, None);
            Self { render_pass, framebuffer: framebuffer.expect("a framebuffer"), target }
        }
    }
}

impl PassObject<'_> {
    /// Records a pass of secondary command buffers, which clears the target to a colour.
    pub fn execute(&self, commands: &Commands, color: [f32; 4], secondaries: &[vk::CommandBuffer]) {
        let clears = [vk::ClearValue { color: vk::ClearColorValue { float32: color } }];
        let info = vk::RenderPassBeginInfo::default()
            .render_pass(self.render_pass)
            .framebuffer(self.framebuffer)
            .render_area(self.target.area(&Pass::default()))
            .clear_values(&clears);
        let (device, raw) = commands.raw();
        commands.barrier();
        // SAFETY: see the crate.
        unsafe {
            device.cmd_begin_render_pass(raw, &info, vk::SubpassContents::SECONDARY_COMMAND_BUFFERS);
            device.cmd_execute_commands(raw, secondaries);
            device.cmd_end_render_pass(raw);
        }
        commands.barrier();
    }
}

impl Attachments for PassObject<'_> {
    fn size(&self) -> [u32; 2] {
        self.target.size()
    }

    fn attachment_formats(&self) -> Formats {
        self.target.attachment_formats()
    }

    fn begin(&self, device: &ash::Device, commands: vk::CommandBuffer, pass: &Pass) {
        let clears = [vk::ClearValue { color: pass.color }];
        let info = vk::RenderPassBeginInfo::default()
            .render_pass(self.render_pass)
            .framebuffer(self.framebuffer)
            .render_area(self.target.area(pass))
            .clear_values(&clears);
        // SAFETY: see the crate.
        unsafe { device.cmd_begin_render_pass(commands, &info, vk::SubpassContents::INLINE) };
    }

    fn end(&self, device: &ash::Device, commands: vk::CommandBuffer) {
        // SAFETY: see the crate.
        unsafe { device.cmd_end_render_pass(commands) };
    }
}

impl Drop for PassObject<'_> {
    fn drop(&mut self) {
        let device = self.target.colors[0].gpu().device();
        // SAFETY: see the crate.
        unsafe {
            device.destroy_framebuffer(self.framebuffer, None);
            device.destroy_render_pass(self.render_pass, None);
        }
    }
}

fn picture(name: String, image: &Image, aspect: vk::ImageAspectFlags) -> Picture {
    let format = format_of(image.options.format, aspect);
    Picture {
        name,
        format,
        size: [image.options.size[0], image.options.size[1]],
        bytes: image.read(aspect, texel_size(format)),
    }
}

/// The format in which an aspect is copied to a buffer.
fn format_of(format: vk::Format, aspect: vk::ImageAspectFlags) -> vk::Format {
    use vk::Format as F;
    match (format, aspect) {
        (_, vk::ImageAspectFlags::STENCIL) => F::S8_UINT,
        (F::D16_UNORM_S8_UINT, _) => F::D16_UNORM,
        (F::D24_UNORM_S8_UINT, _) => F::X8_D24_UNORM_PACK32,
        (F::D32_SFLOAT_S8_UINT, _) => F::D32_SFLOAT,
        _ => format,
    }
}

fn is_integer(format: vk::Format) -> bool {
    let name = format!("{format:?}");
    name.contains("UINT") || name.contains("SINT")
}

/// Shaders that fill the picture and copy one sample of each pixel.
const WHOLE: &str = "
    void main() {
        vec2 corner = vec2(gl_VertexIndex & 1, gl_VertexIndex >> 1);
        gl_Position = vec4(2.0 * corner - 1.0, 0.0, 1.0);
    }";

/// One sample of each pixel of `image`, drawn to an image of one sample; depth as a 32-bit float.
pub fn fetch_sample(gpu: &Gpu, image: &Image, sample: u32) -> Picture {
    let format = match aspects(image.options.format) {
        vk::ImageAspectFlags::COLOR => image.options.format,
        _ => vk::Format::R32_SFLOAT,
    };
    let prefix = match format!("{format:?}") {
        name if name.contains("UINT") => "u",
        name if name.contains("SINT") => "i",
        _ => "",
    };
    let fragment = format!(
        "layout(set = 0, binding = 0) uniform {prefix}sampler2DMS image;
         layout(push_constant) uniform Push {{ int index; }};
         layout(location = 0) out {prefix}vec4 texel;
         void main() {{ texel = texelFetch(image, ivec2(gl_FragCoord.xy), index); }}"
    );
    let size = [image.options.size[0], image.options.size[1]];
    let target = Target::new(gpu, &TargetOptions { size, ..TargetOptions::of(format) });
    let sampler = Sampler::new(gpu, &vk::SamplerCreateInfo::default());
    let bindings = Bindings::new(gpu, &[Resource::Texture(image.view, sampler.raw)]);
    let pipeline = Pipeline::new(
        gpu,
        &target,
        &PipelineOptions {
            vertex: WHOLE,
            fragment: Some(&fragment),
            vertex_bindings: Vec::new(),
            vertex_attributes: Vec::new(),
            topology: vk::PrimitiveTopology::TRIANGLE_STRIP,
            bindings: Some(&bindings),
            ..PipelineOptions::default()
        },
    );
    gpu.run(|commands| {
        commands.pass(&target, &Pass::zeros(), || {
            commands.bind(&pipeline);
            commands.bind_set(&bindings, &[]);
            commands.push(0, &[sample]);
            commands.draw(0..4);
        });
    });
    picture(String::new(), &target.colors[0], vk::ImageAspectFlags::COLOR)
}
