//! Pipelines for other attachments than their pass has: what one of them lacks is not written, and not tested.

use ash::vk;
use gaurast_testkit::pipeline::{depth_test, opaque};
use gaurast_testkit::shader::{GLSLANG, Stage, compile};
use gaurast_testkit::{Attachments, Formats, Gpu, Graphics, Image, ImageOptions, Pass, Shader};

const SIDE: u32 = 8;
const COLOR: vk::Format = vk::Format::R32G32B32A32_SFLOAT;
const DEPTH: vk::Format = vk::Format::D32_SFLOAT;
const NONE: vk::Format = vk::Format::UNDEFINED;

/// Two colour attachments and one of depth, of which a pass has some.
struct Some3 {
    colors: [Image; 2],
    depth: Image,
    has_color: [bool; 2],
    has_depth: bool,
}

impl Attachments for Some3 {
    fn size(&self) -> [u32; 2] {
        [SIDE; 2]
    }

    fn attachment_formats(&self) -> Formats {
        Formats { colors: vec![COLOR; 2], depth: DEPTH, samples: 1 }
    }

    fn begin(&self, device: &ash::Device, commands: vk::CommandBuffer, pass: &Pass) {
        let attachment = |image: &Image, is_there: bool, value: vk::ClearValue| {
            vk::RenderingAttachmentInfo::default()
                .image_view(if is_there { image.view } else { vk::ImageView::null() })
                .image_layout(vk::ImageLayout::GENERAL)
                .load_op(pass.load)
                .store_op(pass.store)
                .clear_value(value)
        };
        let color = vk::ClearValue { color: pass.color };
        let colors = [0, 1].map(|index| attachment(&self.colors[index], self.has_color[index], color));
        let depth = attachment(&self.depth, self.has_depth, vk::ClearValue { depth_stencil: pass.depth });
        let extent = vk::Extent2D { width: SIDE, height: SIDE };
        let info = vk::RenderingInfo::default()
            .render_area(vk::Rect2D::default().extent(extent))
            .layer_count(1)
            .color_attachments(&colors)
            .depth_attachment(&depth);
        // SAFETY: see the crate.
        unsafe { device.cmd_begin_rendering(commands, &info) };
    }
}

/// A triangle of depth 0.5 over everything, whose depth test fails against 0.25.
#[gaurast_runner::test(needs = [GLSLANG])]
fn what_one_of_them_lacks_is_not_written() {
    let mut features = vk::PhysicalDeviceDynamicRenderingUnusedAttachmentsFeaturesEXT::default()
        .dynamic_rendering_unused_attachments(true);
    let name = ash::ext::dynamic_rendering_unused_attachments::NAME;
    let gpu = Gpu::extended(&[name], &mut features).expect("a device");
    let vertex = compile(
        Stage::Vertex,
        "void main() {
            gl_Position = vec4(4.0 * (gl_VertexIndex & 1) - 1.0, 4.0 * (gl_VertexIndex >> 1) - 1.0, 0.5, 1.0);
        }",
    );
    let fragment = compile(
        Stage::Fragment,
        "layout(location = 0) out vec4 first;
         layout(location = 1) out vec4 second;
         void main() { first = vec4(1.0, 2.0, 3.0, 4.0); second = vec4(5.0, 6.0, 7.0, 8.0); }",
    );
    let image = |format, usage| Image::new(&gpu, &ImageOptions::new(format, [SIDE; 2], usage));
    let clear = Pass { depth: vk::ClearDepthStencilValue { depth: 0.25, stencil: 0 }, ..Pass::clear([9.0; 4]) };
    // The alpha of the first output is above 1, so that it covers all where it is the coverage.
    for (formats, depth_format, coverage) in [
        (vec![COLOR, COLOR], DEPTH, false),
        (vec![COLOR, COLOR], NONE, true),
        (vec![NONE, COLOR], NONE, false),
        (vec![NONE, COLOR], NONE, true),
        (vec![COLOR, NONE], DEPTH, false),
        (vec![COLOR], NONE, false),
        (vec![], NONE, false),
        (vec![], NONE, true),
    ] {
        let graphics = Graphics {
            shaders: vec![Shader::vertex(vertex.clone()), Shader::fragment(fragment.clone())],
            blend: vec![opaque(); formats.len()],
            formats: formats.clone(),
            depth_format,
            depth_stencil: depth_test(vk::CompareOp::LESS),
            multisample: Graphics::default().multisample.alpha_to_coverage_enable(coverage),
            ..Graphics::default()
        };
        let pipeline = graphics.create(&gpu).expect("a pipeline");
        for (has_color, has_depth) in
            [([true, true], true), ([true, false], true), ([false, true], false), ([true, true], false)]
        {
            let target = Some3 {
                colors: [(); 2].map(|()| image(COLOR, vk::ImageUsageFlags::COLOR_ATTACHMENT)),
                depth: image(DEPTH, vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT),
                has_color,
                has_depth,
            };
            let all = Some3 { has_color: [true; 2], has_depth: true, ..target };
            gpu.run(|commands| {
                commands.pass(&all, &clear, || {});
                commands.barrier();
            });
            let target = Some3 { has_color, has_depth, ..all };
            gpu.run(|commands| {
                commands.pass(&target, &Pass::load(), || {
                    commands.bind(&pipeline);
                    commands.draw(0..3);
                });
            });
            let fails = has_depth && depth_format == DEPTH;
            let values = [[1.0, 2.0, 3.0, 4.0], [5.0, 6.0, 7.0, 8.0f32]];
            for (index, value) in values.into_iter().enumerate() {
                let is_written = !fails && has_color[index] && formats.get(index) == Some(&COLOR);
                let pixels: Vec<[f32; 4]> = target.colors[index].colors();
                let expected = if is_written { value } else { [9.0; 4] };
                assert!(
                    pixels.iter().all(|pixel| *pixel == expected),
                    "{index} of {formats:?}, {depth_format:?} in {has_color:?}, {has_depth}: {:?}",
                    pixels[0]
                );
            }
            let depths: Vec<f32> = bytemuck::pod_collect_to_vec(&target.depth.download(vk::ImageAspectFlags::DEPTH));
            assert!(depths.iter().all(|depth| *depth == 0.25));
        }
    }
    assert_eq!(gpu.message_texts(), [""; 0]);
}
