//! The units of depth bias.

use ash::vk;
use gaurast_testkit::shader::GLSLANG;
use gaurast_testkit::{Attachments, Formats, Gpu, Image, ImageOptions, Pass, Pipeline, PipelineOptions};
use vk::DepthBiasRepresentationEXT as Representation;

const SIDE: u32 = 8;

/// The depth that is drawn, before the bias.
const DEPTH: f32 = 1.0 / 16.0;

/// An attachment of depth alone.
struct Depth(Image);

impl Attachments for Depth {
    fn size(&self) -> [u32; 2] {
        [SIDE; 2]
    }

    fn attachment_formats(&self) -> Formats {
        Formats { colors: Vec::new(), depth: self.0.options.format, samples: 1 }
    }

    fn begin(&self, device: &ash::Device, commands: vk::CommandBuffer, pass: &Pass) {
        let attachment = vk::RenderingAttachmentInfo::default()
            .image_view(self.0.view)
            .image_layout(vk::ImageLayout::GENERAL)
            .load_op(pass.load)
            .store_op(pass.store)
            .clear_value(vk::ClearValue { depth_stencil: pass.depth });
        let extent = vk::Extent2D { width: SIDE, height: SIDE };
        let info = vk::RenderingInfo::default()
            .render_area(vk::Rect2D::default().extent(extent))
            .layer_count(1)
            .depth_attachment(&attachment);
        // SAFETY: see the crate.
        unsafe { device.cmd_begin_rendering(commands, &info) };
    }
}

/// The depth of a biased triangle in a format, without and with the structure of a unit.
fn drawn(
    gpu: &Gpu,
    format: vk::Format,
    constant: f32,
    unit: Option<(vk::DepthBiasRepresentationEXT, bool)>,
) -> Vec<u8> {
    let usage = vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT;
    let target = Depth(Image::new(gpu, &ImageOptions::new(format, [SIDE; 2], usage)));
    let options = PipelineOptions {
        vertex: "void main() {
            gl_Position = vec4(4.0 * (gl_VertexIndex & 1) - 1.0, 4.0 * (gl_VertexIndex >> 1) - 1.0, 0.0625, 1.0);
        }",
        fragment: None,
        vertex_bindings: Vec::new(),
        vertex_attributes: Vec::new(),
        depth_stencil: gaurast_testkit::pipeline::depth_test(vk::CompareOp::ALWAYS),
        raster: vk::PipelineRasterizationStateCreateInfo::default().line_width(1.0).depth_bias_enable(true),
        dynamic: vec![vk::DynamicState::DEPTH_BIAS],
        ..PipelineOptions::default()
    };
    let pipeline = Pipeline::new(gpu, &target, &options);
    let control = ash::ext::depth_bias_control::Device::new(gpu.instance(), gpu.device());
    gpu.run(|commands| {
        commands.pass(&target, &Pass::default(), || {
            commands.bind(&pipeline);
            let mut info = vk::DepthBiasInfoEXT::default().depth_bias_constant_factor(constant);
            let mut representation = vk::DepthBiasRepresentationInfoEXT::default();
            if let Some((unit, is_exact)) = unit {
                representation = representation.depth_bias_representation(unit).depth_bias_exact(is_exact);
                info = info.push_next(&mut representation);
            }
            let (_, raw) = commands.raw();
            // SAFETY: see the crate.
            unsafe { (control.fp().cmd_set_depth_bias2_ext)(raw, &raw const info) };
            commands.draw(0..3);
        });
    });
    assert_eq!(gpu.message_texts(), [""; 0]);
    let bytes = target.0.download(vk::ImageAspectFlags::DEPTH);
    let texel = bytes.len() / (SIDE * SIDE) as usize;
    assert!(bytes.chunks(texel).all(|one| *one == bytes[..texel]), "all pixels are equal");
    bytes[..texel].to_vec()
}

#[gaurast_runner::test(needs = [GLSLANG])]
fn depth_bias_is_in_the_unit_that_is_asked_for() {
    let mut features = vk::PhysicalDeviceDepthBiasControlFeaturesEXT::default()
        .depth_bias_control(true)
        .least_representable_value_force_unorm_representation(true)
        .float_representation(true)
        .depth_bias_exact(true);
    let gpu = Gpu::extended(&[ash::ext::depth_bias_control::NAME], &mut features).expect("a device");
    let format = Representation::LEAST_REPRESENTABLE_VALUE_FORMAT;
    let unorm = Representation::LEAST_REPRESENTABLE_VALUE_FORCE_UNORM;
    let unit = |bits: i32| 2f32.powi(-bits);
    // The exponent of the depth is -4, so that a float's unit is that of 27 bits.
    for (constant, asked, bias) in [
        (1024.0, None, 1024.0 * unit(27)),
        (1024.0, Some((format, false)), 1024.0 * unit(27)),
        (1024.0, Some((format, true)), 1024.0 * unit(27)),
        (1024.0, Some((unorm, false)), 1024.0 * unit(23)),
        (1024.0, Some((unorm, true)), 1024.0 * unit(24)),
        (0.125, Some((Representation::FLOAT, false)), 0.125),
    ] {
        let found = drawn(&gpu, vk::Format::D32_SFLOAT, constant, asked);
        let found = f32::from_le_bytes(found.try_into().expect("a float"));
        assert_eq!(found, DEPTH + bias, "{asked:?}");
    }
    for (constant, asked, bias) in [
        (64.0, None, 64.0 * unit(15)),
        (64.0, Some((format, true)), 64.0 * unit(16)),
        (64.0, Some((unorm, true)), 64.0 * unit(16)),
        (0.125, Some((Representation::FLOAT, true)), 0.125),
    ] {
        let found = drawn(&gpu, vk::Format::D16_UNORM, constant, asked);
        let found = u16::from_le_bytes(found.try_into().expect("a number of 16 bits"));
        let expected = 65535.0 * (DEPTH + bias);
        assert!((f32::from(found) - expected).abs() <= 1.0, "{asked:?}: {found}, not {expected}");
    }
}
