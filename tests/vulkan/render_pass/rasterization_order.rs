//! Fragments that read, as an input attachment, what earlier primitives of the same draw have left in the attachment that
//! they write. Each test runs on this driver and on lavapipe.

use ash::vk;
use gaurast_runner::Case;
use gaurast_testkit::shader::GLSLANG;
use gaurast_testkit::stage_program::drivers;
use gaurast_testkit::{
    Attachments, Bindings, Buffer, Driver, Formats, Gpu, Image, ImageOptions, Opening, Pass, Pipeline, PipelineOptions,
    Resource, depth_test, range, shapes,
};
use vk::PipelineColorBlendStateCreateFlags as ColorFlags;
use vk::PipelineDepthStencilStateCreateFlags as DepthFlags;
use vk::SubpassDescriptionFlags as SubpassFlags;

const SIDE: u32 = 70;
const COLOR: vk::Format = vk::Format::R32G32B32A32_SFLOAT;
const DEPTH: vk::Format = vk::Format::D32_SFLOAT_S8_UINT;
const TRIANGLES: u32 = 40;

/// The attachment that a fragment reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Read {
    Color,
    Samples,
    Depth,
    Stencil,
}

/// A device with the extension.
fn device(case: &Case) -> Gpu {
    let opening = Opening {
        extensions: &[ash::ext::rasterization_order_attachment_access::NAME],
        ..Opening::of(match case.variant() {
            "lavapipe" => Driver::Lavapipe,
            _ => Driver::Embedded,
        })
    };
    let mut features = vk::PhysicalDeviceRasterizationOrderAttachmentAccessFeaturesEXT::default()
        .rasterization_order_color_attachment_access(true)
        .rasterization_order_depth_attachment_access(true)
        .rasterization_order_stencil_attachment_access(true);
    Gpu::open_with(&opening, &mut features).expect("a device")
}

/// A render pass of colour, depth and stencil, whose only subpass reads one of them.
struct SelfReading {
    gpu: Gpu,
    pass: vk::RenderPass,
    framebuffer: vk::Framebuffer,
    color: Image,
    depth: Image,
    /// The view that is read.
    input: vk::ImageView,
    samples: u32,
}

impl SelfReading {
    fn new(gpu: &Gpu, read: Read) -> Self {
        let samples = if read == Read::Samples { 4 } else { 1 };
        let image = |format, usage| {
            let usage = usage | vk::ImageUsageFlags::INPUT_ATTACHMENT | vk::ImageUsageFlags::SAMPLED;
            Image::new(gpu, &ImageOptions { samples, ..ImageOptions::new(format, [SIDE; 2], usage) })
        };
        let color = image(COLOR, vk::ImageUsageFlags::COLOR_ATTACHMENT);
        let depth = image(DEPTH, vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT);
        let (raw, format, aspect) = match read {
            Read::Color | Read::Samples => (color.raw, COLOR, vk::ImageAspectFlags::COLOR),
            Read::Depth => (depth.raw, DEPTH, vk::ImageAspectFlags::DEPTH),
            Read::Stencil => (depth.raw, DEPTH, vk::ImageAspectFlags::STENCIL),
        };
        let info = vk::ImageViewCreateInfo::default()
            .image(raw)
            .view_type(vk::ImageViewType::TYPE_2D)
            .format(format)
            .subresource_range(range(aspect));
        // SAFETY: see the crate.
        let input = unsafe { gpu.device().create_image_view(&info, None) }.expect("a view");
        let (pass, framebuffer) = Self::pass(gpu, read, [&color, &depth], samples);
        Self { gpu: gpu.clone(), pass, framebuffer, color, depth, input, samples }
    }

    fn pass(gpu: &Gpu, read: Read, images: [&Image; 2], samples: u32) -> (vk::RenderPass, vk::Framebuffer) {
        let attachments = [COLOR, DEPTH].map(|format| {
            vk::AttachmentDescription::default()
                .format(format)
                .samples(vk::SampleCountFlags::from_raw(samples))
                .load_op(vk::AttachmentLoadOp::CLEAR)
                .store_op(vk::AttachmentStoreOp::STORE)
                .stencil_load_op(vk::AttachmentLoadOp::CLEAR)
                .stencil_store_op(vk::AttachmentStoreOp::STORE)
                .initial_layout(vk::ImageLayout::GENERAL)
                .final_layout(vk::ImageLayout::GENERAL)
        });
        let reference = |attachment| vk::AttachmentReference { attachment, layout: vk::ImageLayout::GENERAL };
        let (colors, depth) = ([reference(0)], reference(1));
        let (flags, inputs) = match read {
            Read::Color | Read::Samples => {
                (SubpassFlags::RASTERIZATION_ORDER_ATTACHMENT_COLOR_ACCESS_EXT, [reference(0)])
            }
            Read::Depth => (SubpassFlags::RASTERIZATION_ORDER_ATTACHMENT_DEPTH_ACCESS_EXT, [reference(1)]),
            Read::Stencil => (SubpassFlags::RASTERIZATION_ORDER_ATTACHMENT_STENCIL_ACCESS_EXT, [reference(1)]),
        };
        let subpasses = [vk::SubpassDescription::default()
            .flags(flags)
            .color_attachments(&colors)
            .depth_stencil_attachment(&depth)
            .input_attachments(&inputs)];
        let (stages, written) = barrier();
        let dependencies = [vk::SubpassDependency::default()
            .src_stage_mask(stages)
            .src_access_mask(written)
            .dst_stage_mask(vk::PipelineStageFlags::FRAGMENT_SHADER)
            .dst_access_mask(vk::AccessFlags::INPUT_ATTACHMENT_READ)
            .dependency_flags(vk::DependencyFlags::BY_REGION)];
        let info = vk::RenderPassCreateInfo::default()
            .attachments(&attachments)
            .subpasses(&subpasses)
            .dependencies(&dependencies);
        let views = images.map(|image| image.attachment);
        // SAFETY: see the crate.
        unsafe {
            let pass = gpu.device().create_render_pass(&info, None).expect("a render pass");
            let info = vk::FramebufferCreateInfo::default()
                .render_pass(pass)
                .attachments(&views)
                .width(SIDE)
                .height(SIDE)
                .layers(1);
            (pass, gpu.device().create_framebuffer(&info, None).expect("a framebuffer"))
        }
    }
}

/// The stages and accesses by which a draw writes attachments.
fn barrier() -> (vk::PipelineStageFlags, vk::AccessFlags) {
    let stages = vk::PipelineStageFlags::COLOR_ATTACHMENT_OUTPUT
        | vk::PipelineStageFlags::EARLY_FRAGMENT_TESTS
        | vk::PipelineStageFlags::LATE_FRAGMENT_TESTS;
    (stages, vk::AccessFlags::COLOR_ATTACHMENT_WRITE | vk::AccessFlags::DEPTH_STENCIL_ATTACHMENT_WRITE)
}

impl Attachments for SelfReading {
    fn size(&self) -> [u32; 2] {
        [SIDE; 2]
    }

    fn attachment_formats(&self) -> Formats {
        Formats { colors: vec![COLOR], depth: DEPTH, samples: self.samples }
    }

    fn begin(&self, device: &ash::Device, commands: vk::CommandBuffer, pass: &Pass) {
        let clears = [vk::ClearValue { color: pass.color }, vk::ClearValue { depth_stencil: pass.depth }];
        let info = vk::RenderPassBeginInfo::default()
            .render_pass(self.pass)
            .framebuffer(self.framebuffer)
            .render_area(vk::Rect2D::default().extent(vk::Extent2D { width: SIDE, height: SIDE }))
            .clear_values(&clears);
        // SAFETY: see the crate.
        unsafe { device.cmd_begin_render_pass(commands, &info, vk::SubpassContents::INLINE) };
    }

    fn end(&self, device: &ash::Device, commands: vk::CommandBuffer) {
        // SAFETY: see the crate.
        unsafe { device.cmd_end_render_pass(commands) };
    }
}

impl Drop for SelfReading {
    fn drop(&mut self) {
        let device = self.gpu.device();
        // SAFETY: see the crate.
        unsafe {
            device.destroy_framebuffer(self.framebuffer, None);
            device.destroy_render_pass(self.pass, None);
            device.destroy_image_view(self.input, None);
        }
    }
}

/// A fragment shader that reads the attachment, and halves what earlier primitives have left.
fn fragment(read: Read) -> String {
    let (ty, load) = match read {
        Read::Color => ("subpassInput", "subpassLoad(before)"),
        Read::Samples => ("subpassInputMS", "subpassLoad(before, gl_SampleID)"),
        Read::Depth => ("subpassInput", "vec4(subpassLoad(before).x)"),
        Read::Stencil => ("usubpassInput", "vec4(subpassLoad(before).x)"),
    };
    format!(
        "layout(input_attachment_index = 0, binding = 0) uniform {ty} before;
         layout(location = 0) in vec4 v_color;
         layout(location = 0) out vec4 color;
         void main() {{ color = 0.5 * {load} + v_color; }}"
    )
}

fn options<'a>(bindings: &'a Bindings, fragment: &'a str, in_order: Option<Read>) -> PipelineOptions<'a> {
    let (color, depth) = match in_order {
        None => (ColorFlags::empty(), DepthFlags::empty()),
        Some(Read::Color | Read::Samples) => {
            (ColorFlags::RASTERIZATION_ORDER_ATTACHMENT_ACCESS_EXT, DepthFlags::empty())
        }
        Some(Read::Depth) => (ColorFlags::empty(), DepthFlags::RASTERIZATION_ORDER_ATTACHMENT_DEPTH_ACCESS_EXT),
        Some(Read::Stencil) => (ColorFlags::empty(), DepthFlags::RASTERIZATION_ORDER_ATTACHMENT_STENCIL_ACCESS_EXT),
    };
    let face = vk::StencilOpState {
        pass_op: vk::StencilOp::INCREMENT_AND_WRAP,
        fail_op: vk::StencilOp::KEEP,
        depth_fail_op: vk::StencilOp::DECREMENT_AND_WRAP,
        compare_op: vk::CompareOp::ALWAYS,
        compare_mask: 0xFF,
        write_mask: 0xFF,
        reference: 0,
    };
    let tests = depth_test(vk::CompareOp::LESS).flags(depth).stencil_test_enable(true).front(face).back(face);
    PipelineOptions {
        fragment: Some(fragment),
        bindings: Some(bindings),
        depth_stencil: tests,
        blend_flags: color,
        ..PipelineOptions::default()
    }
}

/// The triangles, each with its own colour, which is a small integer.
fn triangles() -> Vec<gaurast_testkit::Vertex> {
    let mut vertices = shapes::flat_soup(11, TRIANGLES as usize);
    for (index, vertex) in vertices.iter_mut().enumerate() {
        vertex.color = [1.0, 2.0, 3.0, 4.0].map(|channel| channel + (index / 3) as f32);
    }
    vertices
}

/// The colours of all samples after the triangles, in one draw in order or in a draw each with barriers between.
fn drawn(gpu: &Gpu, read: Read, is_one_draw: bool) -> Vec<u8> {
    let target = SelfReading::new(gpu, read);
    let bindings = Bindings::new(gpu, &[Resource::Input(target.input)]);
    let fragment = fragment(read);
    let options = options(&bindings, &fragment, is_one_draw.then_some(read));
    let pipeline = Pipeline::new(gpu, &target, &PipelineOptions { subpass: Some((target.pass, 0)), ..options });
    let vertices = Buffer::of(gpu, &triangles());
    gpu.run(|commands| {
        commands.pass(&target, &Pass::clear([8.0; 4]), || {
            commands.bind(&pipeline);
            commands.bind_set(&bindings, &[]);
            commands.vertices(&vertices);
            if is_one_draw {
                commands.draw(0..3 * TRIANGLES);
                return;
            }
            for triangle in 0..TRIANGLES {
                let (device, raw) = commands.raw();
                let (stages, written) = barrier();
                let read = vk::AccessFlags::INPUT_ATTACHMENT_READ;
                let memory = [vk::MemoryBarrier::default().src_access_mask(written).dst_access_mask(read)];
                let (region, reader) = (vk::DependencyFlags::BY_REGION, vk::PipelineStageFlags::FRAGMENT_SHADER);
                // SAFETY: see the crate.
                unsafe { device.cmd_pipeline_barrier(raw, stages, reader, region, &memory, &[], &[]) };
                commands.draw(3 * triangle..3 * triangle + 3);
            }
        });
    });
    assert!(target.depth.options.samples == target.samples);
    match target.samples {
        1 => target.color.read(vk::ImageAspectFlags::COLOR, 16),
        count => {
            (0..count).flat_map(|sample| gaurast_testkit::fetch_sample(gpu, &target.color, sample).bytes).collect()
        }
    }
}

fn compare(case: &Case, read: Read) {
    let gpu = device(case);
    let (found, expected) = (drawn(&gpu, read, true), drawn(&gpu, read, false));
    let texels = |bytes: &[u8]| -> Vec<[f32; 4]> { bytemuck::pod_collect_to_vec(bytes) };
    let (found, expected) = (texels(&found), texels(&expected));
    let values: std::collections::BTreeSet<_> = expected.iter().map(|texel| texel[0].to_bits()).collect();
    assert!(values.len() > 40, "{read:?}: only {} values", values.len());
    for (place, (found, expected)) in found.iter().zip(&expected).enumerate() {
        assert_eq!(found, expected, "{read:?}, texel {place}");
    }
}

#[gaurast_runner::test(needs = [GLSLANG], each = drivers())]
fn colors_are_read_in_order(case: &Case) {
    compare(case, Read::Color);
}

#[gaurast_runner::test(needs = [GLSLANG], each = drivers())]
fn colors_of_samples_are_read_in_order(case: &Case) {
    compare(case, Read::Samples);
}

#[gaurast_runner::test(needs = [GLSLANG], each = drivers())]
fn depths_are_read_in_order(case: &Case) {
    compare(case, Read::Depth);
}

#[gaurast_runner::test(needs = [GLSLANG], each = drivers())]
fn stencils_are_read_in_order(case: &Case) {
    compare(case, Read::Stencil);
}
