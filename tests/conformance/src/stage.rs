//! The stage of a [`Draw`] on a device: its attachments, its pipeline, and its buffers.

use ash::vk;
use gaurast::vk::{
    GaussianCameraDataGAURAST, GaussianCameraSourceGAURAST, GaussianResolveInputLocationsGAURAST,
    PipelineGaussianApproximationStateCreateInfoGAURAST,
};
use gaurast_oracle::oracle::{OracleInstance, Stored};
use gaurast_oracle::scenes::SceneBuffers;
use gaurast_testkit::{
    Attachments, Bindable, Bindings, Buffer, Commands, GaussianOptions, GaussianScene, Gpu, Graphics, Image, Instance,
    Pass, Pipeline, Resource, Shader, Target, TargetOptions, bind_instances, blend, opaque,
};
use half::f16;

use crate::draw::{Blend, ColorFormat, Draw, Equation};
use crate::judge::stored_before;
use crate::picture::Picture;

/// A uniform buffer of the draw's camera, and the descriptor set that has it.
struct CameraBuffer {
    set: Bindings,
    _buffer: Buffer,
}

/// The stage.
pub(crate) struct Stage<'a> {
    pub(crate) gpu: &'a Gpu,
    pub(crate) draw: &'a Draw,
    pub(crate) target: Target,
    pub(crate) pipeline: Pipeline,
    pub(crate) scene: GaussianScene,
    /// The index buffer, of 32 bits.
    pub(crate) indices: Buffer,
    /// Model matrices and factors of the opacity, if the draw has them.
    pub(crate) instances: Option<Buffer>,
    camera: Option<CameraBuffer>,
}

impl<'a> Stage<'a> {
    /// The stage with a change of the pipeline.
    pub(crate) fn changed(gpu: &'a Gpu, draw: &'a Draw, change: &dyn Fn(&mut Graphics<'_>)) -> Self {
        Self::over(gpu, draw, &stored_before(draw), change)
    }

    /// The stage with these contents of the depth and stencil attachment.
    pub(crate) fn over(gpu: &'a Gpu, draw: &'a Draw, stored: &Stored, change: &dyn Fn(&mut Graphics<'_>)) -> Self {
        let target = target(gpu, draw, stored);
        let camera = draw.camera_in_buffer.then(|| {
            let data = GaussianCameraDataGAURAST::from(&draw.camera);
            let buffer = Buffer::of(gpu, &data.to_bytes());
            CameraBuffer { set: Bindings::new(gpu, &[Resource::Uniform(buffer.raw)]), _buffer: buffer }
        });
        let pipeline = pipeline(gpu, &target, draw, camera.as_ref().map(|camera| &camera.set), change);
        let instances = draw.instances.as_ref().map(|(_, all)| instance_buffer(gpu, all));
        let indices = Buffer::of(gpu, &draw.indices);
        Self { gpu, draw, target, pipeline, scene: scene(gpu, draw, &draw.scene), indices, instances, camera }
    }

    /// Another pipeline for the stage.
    pub(crate) fn pipeline(&self, draw: &Draw, change: &dyn Fn(&mut Graphics<'_>)) -> Pipeline {
        pipeline(self.gpu, &self.target, draw, self.camera.as_ref().map(|camera| &camera.set), change)
    }

    /// Other Gaussians in vertex buffers, as the stage's.
    pub(crate) fn other(&self, other: &SceneBuffers) -> GaussianScene {
        scene(self.gpu, self.draw, other)
    }

    /// Executes one pass over the attachments' contents, in which everything is bound.
    pub(crate) fn run(&self, record: impl FnOnce(&Commands)) {
        self.gpu.run(|commands| self.pass(commands, || record(commands)));
    }

    /// Records one pass over the attachments' contents, in which everything is bound.
    pub(crate) fn pass(&self, commands: &Commands, record: impl FnOnce()) {
        commands.pass(&self.target, &Pass { area: self.draw.area, ..Pass::load() }, || {
            self.bind(commands);
            record();
        });
    }

    /// Binds everything, and sets viewport, scissor and camera.
    pub(crate) fn bind(&self, commands: &Commands) {
        self.bind_with(commands, &self.pipeline);
    }

    /// The same with another pipeline.
    pub(crate) fn bind_with(&self, commands: &Commands, pipeline: &impl Bindable) {
        commands.bind(pipeline);
        self.place(commands);
        self.scene.bind_buffers(commands);
        if let Some(instances) = &self.instances {
            bind_instances(commands, instances);
        }
        commands.indices(&self.indices, 0, vk::IndexType::UINT32);
        match &self.camera {
            Some(camera) => commands.bind_set(&camera.set, &[]),
            None => self.set_camera(commands),
        }
    }

    /// Sets the camera with its lens.
    fn set_camera(&self, commands: &Commands) {
        let mut distortion = self.draw.distortion.unwrap_or_default();
        match self.draw.distortion {
            Some(_) => commands.camera(&self.draw.camera.push_next(&mut distortion)),
            None => commands.camera(&self.draw.camera),
        }
    }

    /// Sets viewport and scissor.
    pub(crate) fn place(&self, commands: &Commands) {
        let view = self.draw.viewport();
        commands.whole(&self.target);
        commands.viewport([view.x, view.y, view.width, view.height], [view.min_depth, view.max_depth]);
        if let Some(vk::Rect2D { offset, extent }) = self.draw.scissor {
            commands.scissor([offset.x, offset.y], [extent.width, extent.height]);
        }
    }

    /// The contents of the attachments.
    pub(crate) fn picture(&self) -> Picture {
        picture(self.draw, &self.target)
    }
}

/// Gaussians in vertex buffers, as a draw stores them.
fn scene(gpu: &Gpu, draw: &Draw, scene: &SceneBuffers) -> GaussianScene {
    if draw.half { GaussianScene::half(gpu, scene) } else { GaussianScene::new(gpu, scene) }
}

/// Model matrices and factors of the opacity.
pub(crate) fn instance_buffer(gpu: &Gpu, all: &[OracleInstance]) -> Buffer {
    let all = all.iter().map(|instance| -> Instance {
        let [x, y, z] = instance.matrix;
        let numbers = [x, y, z].into_iter().flatten().chain([instance.opacity]);
        let mut row = [0.0; 13];
        row.iter_mut().zip(numbers).for_each(|(to, from)| *to = from);
        row
    });
    Buffer::of(gpu, &all.collect::<Vec<_>>())
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

fn pipeline(
    gpu: &Gpu,
    target: &Target,
    draw: &Draw,
    set: Option<&Bindings>,
    change: &dyn Fn(&mut Graphics<'_>),
) -> Pipeline {
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
    let options = GaussianOptions {
        state,
        approximation,
        footprint: draw.footprint,
        unscented: draw.unscented,
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
    };
    let mut graphics = options.graphics();
    graphics.blend_constants = draw.equation.map_or([0.0; 4], |equation| equation.constants);
    change(&mut graphics);
    let created = graphics.create(gpu);
    created.unwrap_or_else(|error| panic!("a pipeline: {error:?}: {:?}", gpu.message_texts()))
}

pub(crate) fn color_blend(draw: &Draw) -> vk::PipelineColorBlendAttachmentState {
    use vk::BlendFactor as Factor;
    let add = vk::BlendOp::ADD;
    if let Some(Equation { color: ([from, to], op), alpha: ([from_alpha, to_alpha], alpha_op), .. }) = draw.equation {
        return vk::PipelineColorBlendAttachmentState {
            src_alpha_blend_factor: from_alpha,
            dst_alpha_blend_factor: to_alpha,
            alpha_blend_op: alpha_op,
            color_write_mask: draw.write_mask,
            ..blend(from, to, op)
        };
    }
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
