//! Scenes of blending, write masks, logic operations, several attachments, formats.

use ash::vk;
use ash::vk::BlendFactor as Factor;
use ash::vk::BlendOp as Op;

use gaurast_testkit::drawn::Drawn;
use gaurast_testkit::drawn::{cases, need, need_format, simple};
use gaurast_testkit::shapes;
use gaurast_testkit::{Gpu, Output, PipelineOptions, TargetOptions, Vertex, blend, opaque};

const FACTORS: [Factor; 15] = [
    Factor::ZERO,
    Factor::ONE,
    Factor::SRC_COLOR,
    Factor::ONE_MINUS_SRC_COLOR,
    Factor::DST_COLOR,
    Factor::ONE_MINUS_DST_COLOR,
    Factor::SRC_ALPHA,
    Factor::ONE_MINUS_SRC_ALPHA,
    Factor::DST_ALPHA,
    Factor::ONE_MINUS_DST_ALPHA,
    Factor::CONSTANT_COLOR,
    Factor::ONE_MINUS_CONSTANT_COLOR,
    Factor::CONSTANT_ALPHA,
    Factor::ONE_MINUS_CONSTANT_ALPHA,
    Factor::SRC_ALPHA_SATURATE,
];

const OPERATIONS: [Op; 5] = [Op::ADD, Op::SUBTRACT, Op::REVERSE_SUBTRACT, Op::MIN, Op::MAX];

/// Overlapping rectangles. Their colours are exact unorm bytes, so that differences of rounding cannot grow from layer
/// to layer.
fn layers() -> Vec<Vertex> {
    let mut vertices = shapes::soup(60, 20);
    for vertex in &mut vertices {
        vertex.color = vertex.color.map(|channel| (255.0 * channel).round() / 255.0);
    }
    for triangle in vertices.chunks_exact_mut(3) {
        let color = triangle[0].color;
        triangle.iter_mut().for_each(|vertex| vertex.color = color);
    }
    vertices
}

fn blended(gpu: &Gpu, format: vk::Format, state: vk::PipelineColorBlendAttachmentState, vertices: &[Vertex]) -> Output {
    let options =
        PipelineOptions { blend: vec![state], blend_constants: [0.2, 0.4, 0.6, 0.8], ..PipelineOptions::default() };
    simple(gpu, &TargetOptions::of(format), &options, vertices)
}

/// Draws one layer over the background in floats, for each pair of factors: nothing is rounded.
pub fn blend_factors(gpu: &Gpu) -> Drawn {
    let vertices = &layers()[..30];
    let pairs = FACTORS.into_iter().flat_map(|from| FACTORS[..14].iter().map(move |&to| (from, to)));
    let name = |(from, to): &(Factor, Factor)| format!("{from:?} {to:?}");
    Ok(cases(pairs, name, |&(from, to)| {
        let format = vk::Format::R16G16B16A16_SFLOAT;
        blended(gpu, format, blend(from, to, Op::ADD), vertices)
    }))
}

pub fn blend_operations(gpu: &Gpu) -> Drawn {
    let name = |op: &Op| format!("{op:?}");
    Ok(cases(OPERATIONS, name, |&op| {
        let state = blend(Factor::SRC_ALPHA, Factor::ONE_MINUS_SRC_ALPHA, op);
        blended(gpu, vk::Format::R32G32B32A32_SFLOAT, state, &layers())
    }))
}

/// Draws several layers of 8 bits, each rounded.
pub fn blended_bytes(gpu: &Gpu) -> Drawn {
    let state = blend(Factor::SRC_ALPHA, Factor::ONE_MINUS_SRC_ALPHA, Op::ADD);
    Ok(blended(gpu, vk::Format::R8G8B8A8_UNORM, state, &layers()[..9]))
}

pub fn added_bytes(gpu: &Gpu) -> Drawn {
    let state = blend(Factor::ONE, Factor::ONE, Op::ADD);
    Ok(blended(gpu, vk::Format::R8G8B8A8_UNORM, state, &layers()))
}

pub fn blended_srgb(gpu: &Gpu) -> Drawn {
    let state = blend(Factor::SRC_ALPHA, Factor::ONE_MINUS_SRC_ALPHA, Op::ADD);
    Ok(blended(gpu, vk::Format::R8G8B8A8_SRGB, state, &layers()[..6]))
}

/// Blends colour and alpha with separate factors and operations.
pub fn separate_alpha(gpu: &Gpu) -> Drawn {
    let state = blend(Factor::SRC_ALPHA, Factor::ONE_MINUS_SRC_ALPHA, Op::ADD)
        .src_alpha_blend_factor(Factor::ONE)
        .dst_alpha_blend_factor(Factor::DST_ALPHA)
        .alpha_blend_op(Op::REVERSE_SUBTRACT);
    let format = vk::Format::R16G16B16A16_SFLOAT;
    Ok(blended(gpu, format, state, &layers()))
}

pub fn dual_source_blending(gpu: &Gpu) -> Drawn {
    need("dualSrcBlend", gpu.features().dual_src_blend)?;
    let options = PipelineOptions {
        fragment: Some(
            "layout(location = 0) in vec4 v_color;
             layout(location = 0, index = 0) out vec4 color;
             layout(location = 0, index = 1) out vec4 factor;
             void main() { color = v_color; factor = v_color.gbra; }",
        ),
        blend: vec![blend(Factor::SRC1_COLOR, Factor::ONE_MINUS_SRC1_COLOR, Op::ADD)],
        ..PipelineOptions::default()
    };
    let target = TargetOptions::of(vk::Format::R16G16B16A16_SFLOAT);
    Ok(simple(gpu, &target, &options, &layers()))
}

pub fn write_masks(gpu: &Gpu) -> Drawn {
    let masks = (0..16).map(vk::ColorComponentFlags::from_raw);
    let name = |mask: &vk::ColorComponentFlags| format!("mask {:04b}", mask.as_raw());
    Ok(cases(masks, name, |&mask| {
        let state = opaque().color_write_mask(mask);
        let format = vk::Format::R8G8B8A8_UNORM;
        blended(gpu, format, state, &layers()[..30])
    }))
}

pub fn logic_operations(gpu: &Gpu) -> Drawn {
    need("logicOp", gpu.features().logic_op)?;
    let operations = (0..16).map(vk::LogicOp::from_raw);
    let name = |op: &vk::LogicOp| format!("{op:?}");
    Ok(cases(operations, name, |&op| {
        let options = PipelineOptions { logic_op: Some(op), ..PipelineOptions::default() };
        simple(gpu, &TargetOptions::default(), &options, &layers()[..30])
    }))
}

/// Draws to four attachments of three formats, written and blended differently.
pub fn several_attachments(gpu: &Gpu) -> Drawn {
    need("independentBlend", gpu.features().independent_blend)?;
    let options = PipelineOptions {
        fragment: Some(
            "layout(location = 0) in vec4 v_color;
             layout(location = 0) out vec4 first;
             layout(location = 1) out vec4 second;
             layout(location = 2) out uvec4 third;
             layout(location = 3) out float fourth;
             void main() {
                 first = v_color;
                 second = v_color.bgra;
                 third = uvec4(3, 1, 4, 1);
                 fourth = 100.0 * v_color.g;
             }",
        ),
        blend: vec![
            opaque(),
            blend(Factor::ONE, Factor::ONE, Op::ADD),
            opaque().color_write_mask(vk::ColorComponentFlags::R | vk::ColorComponentFlags::B),
            opaque(),
        ],
        ..PipelineOptions::default()
    };
    let target = TargetOptions {
        colors: vec![
            vk::Format::R8G8B8A8_UNORM,
            vk::Format::R16G16B16A16_SFLOAT,
            vk::Format::R8G8B8A8_UINT,
            vk::Format::R32_SFLOAT,
        ],
        ..TargetOptions::default()
    };
    Ok(simple(gpu, &target, &options, &layers()))
}

/// Draws to the colour formats that both devices support.
pub fn color_formats(gpu: &Gpu) -> Drawn {
    use vk::Format as F;
    let formats = [
        F::R8_UNORM,
        F::R8G8_UNORM,
        F::B8G8R8A8_UNORM,
        F::R8G8B8A8_SNORM,
        F::R8G8B8A8_SRGB,
        F::B8G8R8A8_SRGB,
        F::R5G6B5_UNORM_PACK16,
        F::A2B10G10R10_UNORM_PACK32,
        F::B10G11R11_UFLOAT_PACK32,
        F::R16G16B16A16_UNORM,
        F::R16_SFLOAT,
        F::R16G16_SFLOAT,
        F::R16G16B16A16_SFLOAT,
        F::R32_SFLOAT,
        F::R32G32_SFLOAT,
        F::R32G32B32A32_SFLOAT,
    ];
    for format in formats {
        need_format(gpu, format, vk::FormatFeatureFlags::COLOR_ATTACHMENT)?;
    }
    let name = |format: &F| format!("{format:?}");
    Ok(cases(formats, name, |&format| blended(gpu, format, opaque(), &shapes::soup(61, 30))))
}

pub fn integer_formats(gpu: &Gpu) -> Drawn {
    use vk::Format as F;
    let formats = [
        (F::R8_UINT, "u"),
        (F::R16_UINT, "u"),
        (F::R8G8B8A8_SINT, "i"),
        (F::R32_SINT, "i"),
        (F::R32G32_UINT, "u"),
        (F::R32G32B32A32_UINT, "u"),
    ];
    let name = |(format, _): &(F, &str)| format!("{format:?}");
    Ok(cases(formats, name, |&(format, prefix)| {
        let fragment = format!(
            "layout(location = 0) in vec4 v_color;
             layout(location = 0) out {prefix}vec4 color;
             void main() {{ color = {prefix}vec4(ivec4(gl_FragCoord.xyxy) & 127); }}"
        );
        let options = PipelineOptions { fragment: Some(&fragment), ..PipelineOptions::default() };
        simple(gpu, &TargetOptions::of(format), &options, &layers())
    }))
}

/// Writes values outside the range of unorm, which are clamped, and NaN, which becomes zero.
pub fn colors_out_of_range(gpu: &Gpu) -> Drawn {
    let mut vertices = shapes::soup(62, 20);
    for vertex in &mut vertices {
        vertex.color = vertex.color.map(|channel| 4.0 * channel - 1.5);
    }
    let format = vk::Format::R8G8B8A8_UNORM;
    Ok(blended(gpu, format, opaque(), &vertices))
}
