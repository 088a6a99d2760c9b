//! Execution of a [`Draw`] on a device: its pipeline, its buffers, its commands, and the final contents of the
//! attachments.

use ash::vk;
use gaurast::vk::{
    GaussianCameraDataGAURAST, GaussianCameraSourceGAURAST, GaussianResolveInputLocationsGAURAST,
    PipelineGaussianApproximationStateCreateInfoGAURAST,
};
use gaurast_oracle::oracle::Stored;
use gaurast_testkit::{
    Attachments, Bindings, Buffer, Commands, GaussianOptions, GaussianPipeline, GaussianScene, Gpu, Image, Instance,
    Pass, Resource, Shader, Target, TargetOptions, bind_instances, blend, opaque,
};
use half::f16;

use crate::draw::{Blend, Call, ColorFormat, Draw};
use crate::implementation::Picture;

/// Draws on a device.
///
/// # Panics
/// If a command fails.
pub(crate) fn record(gpu: &Gpu, draw: &Draw, stored: &Stored) -> Picture {
    let target = target(gpu, draw, stored);
    let camera = draw.camera_in_buffer.then(|| {
        let data = GaussianCameraDataGAURAST::from(&draw.camera);
        Buffer::of(gpu, &data.to_bytes())
    });
    let set = camera.map(|buffer| (Bindings::new(gpu, &[Resource::Uniform(buffer.raw)]), buffer));
    let set = set.as_ref().map(|(set, _)| set);
    let pipeline = pipeline(gpu, &target, draw, set);
    let scene = match draw.half {
        true => GaussianScene::half(gpu, &draw.scene),
        false => GaussianScene::new(gpu, &draw.scene),
    };
    let instances = draw.instances.as_ref().map(|(_, all)| {
        let all = all.iter().map(|instance| -> Instance {
            let [x, y, z] = instance.matrix;
            let numbers = [x, y, z].into_iter().flatten().chain([instance.opacity]);
            let mut row = [0.0; 13];
            row.iter_mut().zip(numbers).for_each(|(to, from)| *to = from);
            row
        });
        Buffer::of(gpu, &all.collect::<Vec<_>>())
    });
    let indices = Buffer::of(gpu, &draw.indices);
    let parameters: Vec<Buffer> = (draw.calls.iter())
        .map(|call| match *call {
            Call::Indirect { vertices: [first, count] } => Buffer::of(gpu, &[count, 1, first, 0]),
            _ => Buffer::new(gpu, 16),
        })
        .collect();
    let pass = Pass { area: draw.area, ..Pass::load() };
    gpu.run(|commands| {
        commands.pass(&target, &pass, || {
            commands.bind(&pipeline);
            let view = draw.viewport();
            commands.viewport([view.x, view.y, view.width, view.height], [view.min_depth, view.max_depth]);
            if let Some(vk::Rect2D { offset, extent }) = draw.scissor {
                commands.scissor([offset.x, offset.y], [extent.width, extent.height]);
            }
            scene.bind_buffers(commands);
            if let Some(instances) = &instances {
                bind_instances(commands, instances);
            }
            commands.indices(&indices, 0, vk::IndexType::UINT32);
            match set {
                Some(set) => commands.bind_set(set, &[]),
                None => commands.camera(&draw.camera),
            }
            let calls: Vec<_> = draw.calls.iter().zip(&parameters).collect();
            for set in calls.split(|(call, _)| matches!(call, Call::EndSet)) {
                let all = || set.iter().for_each(|(call, at)| issue(commands, call, at));
                if draw.merged {
                    commands.gaussian_set(all);
                } else {
                    all();
                }
            }
        });
    });
    picture(draw, &target)
}

/// Records a draw command. `parameters` is the buffer of an indirect one.
fn issue(commands: &Commands, call: &Call, parameters: &Buffer) {
    match *call {
        Call::Draw { vertices: [vertex, vertices], instances: [instance, instances] } => {
            commands.draw_instances(vertex..vertex + vertices, instance..instance + instances);
        }
        Call::Indexed { indices: [first, count], offset } => commands.draw_indexed(first..first + count, offset),
        Call::Indirect { .. } => commands.draw_indirect(parameters, 1),
        Call::EndSet => {}
    }
}

/// The attachments with their initial contents.
fn target(gpu: &Gpu, draw: &Draw, stored: &Stored) -> Target {
    let target = Target::new(
        gpu,
        &TargetOptions {
            size: draw.size,
            colors: vec![draw.format.raw()],
            depth: draw.depth.map(|depth| depth.format),
            samples: draw.samples,
            resolve: true,
        },
    );
    // Images of several samples cannot be copied to, so their depths are cleared to the far plane.
    gpu.run(|commands| commands.pass(&target, &Pass::clear(draw.behind), || {}));
    if let (Some(depth), Some(image), 1) = (&draw.depth, &target.depth, draw.samples) {
        let depths: Vec<u8> = match depth.texel() {
            2 => (stored.depth.iter()).flat_map(|&code| (code as u16).to_ne_bytes()).collect(),
            _ => bytemuck::cast_slice(&stored.depth).to_vec(),
        };
        image.upload(vk::ImageAspectFlags::DEPTH, &depths);
        if depth.has_stencil() {
            image.upload(vk::ImageAspectFlags::STENCIL, &stored.stencil);
        }
    }
    target
}

/// The contents of the attachments.
fn picture(draw: &Draw, target: &Target) -> Picture {
    let image = target.resolved.first().unwrap_or(&target.colors[0]);
    let color = match draw.format {
        ColorFormat::Float32 => image.colors(),
        ColorFormat::Float16 => converted(image, |bits: u16| f16::from_bits(bits).to_f32()),
        ColorFormat::Unorm8 => converted(image, |byte: u8| f32::from(byte) / 255.0),
    };
    let mut stored = Stored::default();
    if let (Some(depth), Some(image), 1) = (&draw.depth, &target.depth, draw.samples) {
        let bytes = image.download(vk::ImageAspectFlags::DEPTH);
        stored.depth = match depth.texel() {
            2 => (bytes.chunks_exact(2)).map(|code| u16::from_ne_bytes([code[0], code[1]]).into()).collect(),
            _ => bytemuck::pod_collect_to_vec(&bytes),
        };
        if depth.format == vk::Format::X8_D24_UNORM_PACK32 {
            stored.depth.iter_mut().for_each(|code| *code &= 0xff_ffff);
        }
        if depth.has_stencil() {
            stored.stencil = image.download(vk::ImageAspectFlags::STENCIL);
        }
    }
    Picture { color, stored }
}

/// The texels of an image, each component converted.
fn converted<T: bytemuck::AnyBitPattern>(image: &Image, convert: impl Fn(T) -> f32 + Copy) -> Vec<[f32; 4]> {
    let texels = image.download(vk::ImageAspectFlags::COLOR);
    let components = texels.chunks_exact(size_of::<T>());
    let floats = components.map(|bytes| convert(bytemuck::pod_read_unaligned(bytes)));
    let floats: Vec<f32> = floats.collect();
    floats.as_chunks().0.to_vec()
}

fn pipeline(gpu: &Gpu, target: &Target, draw: &Draw, set: Option<&Bindings>) -> GaussianPipeline {
    let mut state = draw.state;
    if draw.camera_in_buffer {
        state = state.camera_source(GaussianCameraSourceGAURAST::UNIFORM_BUFFER);
    }
    let resolve = draw.shown.map(|shown| {
        let words = include_bytes!("../shaders/shown.frag.spv").chunks_exact(4);
        let words = words.map(|word| u32::from_le_bytes([word[0], word[1], word[2], word[3]]));
        Shader { constants: vec![(0, shown.number())], ..Shader::fragment(words.collect()) }
    });
    if resolve.is_some() {
        state = state.resolve_input_locations(
            GaussianResolveInputLocationsGAURAST::default()
                .accumulated_color(0)
                .depth(1)
                .linear_depth(2)
                .median_gaussian(3)
                .nearest_gaussian(4)
                .first_camera(5),
        );
    }
    let approximation = draw.approximation.map(|[error, budget]| {
        PipelineGaussianApproximationStateCreateInfoGAURAST::default()
            .exponential_error(error)
            .contribution_budget(budget)
    });
    GaussianPipeline::new(
        gpu,
        &GaussianOptions {
            state,
            approximation,
            footprint: draw.footprint,
            resolve,
            set,
            stored_degree: draw.scene.degree,
            drawn_degree: draw.degree,
            half: draw.half,
            instances: draw.instances.as_ref().map(|(rate, _)| *rate),
            formats: target.attachment_formats(),
            depth_stencil: depth_stencil(draw),
            sample_mask: draw.sample_mask,
            blend: vec![color_blend(draw)],
            ..GaussianOptions::new(draw.degree)
        },
    )
}

fn color_blend(draw: &Draw) -> vk::PipelineColorBlendAttachmentState {
    use vk::BlendFactor as Factor;
    let add = vk::BlendOp::ADD;
    let state = match draw.blend {
        Blend::Over => blend(Factor::ONE, Factor::ONE_MINUS_SRC_ALPHA, add),
        Blend::Add => blend(Factor::ONE, Factor::ONE, add),
        Blend::Under => blend(Factor::ONE_MINUS_DST_ALPHA, Factor::ONE, add),
        Blend::Replace => opaque(),
    };
    state.color_write_mask(draw.write_mask)
}

fn depth_stencil(draw: &Draw) -> vk::PipelineDepthStencilStateCreateInfo<'static> {
    let mut state = vk::PipelineDepthStencilStateCreateInfo::default();
    let Some(depth) = &draw.depth else {
        return state;
    };
    if let Some((op, write)) = depth.test {
        state = state.depth_test_enable(true).depth_compare_op(op).depth_write_enable(write);
    }
    if let Some([least, greatest]) = depth.bounds {
        state = state.depth_bounds_test_enable(true).min_depth_bounds(least).max_depth_bounds(greatest);
    }
    if let Some(front) = depth.stencil {
        // A Gaussian is always front-facing. The back-face state is different, to show that it is not used.
        let back = vk::StencilOpState {
            pass_op: vk::StencilOp::INVERT,
            fail_op: vk::StencilOp::INVERT,
            depth_fail_op: vk::StencilOp::INVERT,
            write_mask: 0xff,
            ..front
        };
        state = state.stencil_test_enable(true).front(front).back(back);
    }
    state
}
