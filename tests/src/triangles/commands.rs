//! Recording commands: one method for each that scenes use, and whole passes.

use std::cell::Cell;

use ash::vk;

use super::{Bindings, Buffer, Gpu, Image, Pipeline, Target, aspects, range};

/// A command buffer that is being recorded.
pub struct Commands {
    gpu: Gpu,
    /// The command buffer.
    pub raw: vk::CommandBuffer,
    layout: Cell<vk::PipelineLayout>,
}

/// How a pass begins and ends.
#[derive(Clone, Copy)]
pub struct Pass {
    /// What all colour attachments are cleared to.
    pub color: vk::ClearColorValue,
    /// What depth and stencil are cleared to.
    pub depth: vk::ClearDepthStencilValue,
    /// What becomes of the attachments' contents at the beginning.
    pub load: vk::AttachmentLoadOp,
    /// What becomes of them at the end.
    pub store: vk::AttachmentStoreOp,
    /// The area drawn to; everything by default.
    pub area: Option<vk::Rect2D>,
    /// Whether draws come from secondary command buffers.
    pub flags: vk::RenderingFlags,
}

impl Default for Pass {
    fn default() -> Self {
        Self {
            color: vk::ClearColorValue {
                float32: [0.1, 0.2, 0.3, 1.0],
            },
            depth: vk::ClearDepthStencilValue {
                depth: 1.0,
                stencil: 0,
            },
            load: vk::AttachmentLoadOp::CLEAR,
            store: vk::AttachmentStoreOp::STORE,
            area: None,
            flags: vk::RenderingFlags::empty(),
        }
    }
}

impl Pass {
    /// A pass that clears to zeros, whatever the format.
    pub fn zeros() -> Self {
        Self {
            color: vk::ClearColorValue { uint32: [0; 4] },
            ..Self::default()
        }
    }

    /// A pass that goes on with what is there.
    pub fn load() -> Self {
        Self {
            load: vk::AttachmentLoadOp::LOAD,
            ..Self::default()
        }
    }
}

impl Commands {
    pub(super) fn new(gpu: &Gpu, raw: vk::CommandBuffer) -> Self {
        Self {
            gpu: gpu.clone(),
            raw,
            layout: Cell::new(vk::PipelineLayout::null()),
        }
    }

    /// The device that commands are recorded for.
    pub fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    /// The device's functions.
    pub fn device(&self) -> &ash::Device {
        self.gpu.device()
    }

    /// Everything after waits for everything before.
    pub fn barrier(&self) {
        self.barriers(&[]);
    }

    fn barriers(&self, images: &[vk::ImageMemoryBarrier<'_>]) {
        let memory = [vk::MemoryBarrier::default()
            .src_access_mask(vk::AccessFlags::MEMORY_WRITE)
            .dst_access_mask(vk::AccessFlags::MEMORY_READ | vk::AccessFlags::MEMORY_WRITE)];
        let all = vk::PipelineStageFlags::ALL_COMMANDS;
        let flags = vk::DependencyFlags::empty();
        // SAFETY: see `triangles`.
        unsafe {
            self.device()
                .cmd_pipeline_barrier(self.raw, all, all, flags, &memory, &[], images);
        }
    }

    /// An image's first layout.
    pub(super) fn become_general(&self, image: &Image) {
        let ignored = vk::QUEUE_FAMILY_IGNORED;
        self.barriers(&[vk::ImageMemoryBarrier::default()
            .dst_access_mask(vk::AccessFlags::MEMORY_READ | vk::AccessFlags::MEMORY_WRITE)
            .new_layout(vk::ImageLayout::GENERAL)
            .src_queue_family_index(ignored)
            .dst_queue_family_index(ignored)
            .image(image.raw)
            .subresource_range(range(aspects(image.options.format)))]);
    }

    /// Copies a buffer to an image.
    pub fn upload(&self, from: &Buffer, to: &Image, regions: &[vk::BufferImageCopy]) {
        let layout = vk::ImageLayout::GENERAL;
        // SAFETY: see `triangles`.
        unsafe {
            self.device()
                .cmd_copy_buffer_to_image(self.raw, from.raw, to.raw, layout, regions);
        }
        self.barrier();
    }

    /// Copies an image to a buffer.
    pub fn download(&self, from: &Image, to: &Buffer, regions: &[vk::BufferImageCopy]) {
        let layout = vk::ImageLayout::GENERAL;
        self.barrier();
        // SAFETY: see `triangles`.
        unsafe {
            self.device()
                .cmd_copy_image_to_buffer(self.raw, from.raw, layout, to.raw, regions);
        }
        self.barrier();
    }

    /// A dynamic render to `target`, with viewport and scissor set to all of it.
    pub fn pass(&self, target: &Target, pass: &Pass, draws: impl FnOnce()) {
        self.barrier();
        target.begin(self, pass);
        if pass.flags.is_empty() {
            self.whole(target);
        }
        draws();
        // SAFETY: see `triangles`.
        unsafe { self.device().cmd_end_rendering(self.raw) };
        self.barrier();
    }

    /// Sets viewport and scissor to all of `target`.
    pub fn whole(&self, target: &Target) {
        let [width, height] = target.options.size;
        self.viewport([0.0, 0.0, width as f32, height as f32], [0.0, 1.0]);
        self.scissor([0, 0], [width, height]);
    }

    /// Sets the viewport to x, y, width and height, and its range of depths.
    pub fn viewport(&self, [x, y, width, height]: [f32; 4], [min_depth, max_depth]: [f32; 2]) {
        let viewport = vk::Viewport {
            x,
            y,
            width,
            height,
            min_depth,
            max_depth,
        };
        // SAFETY: see `triangles`.
        unsafe { self.device().cmd_set_viewport(self.raw, 0, &[viewport]) };
    }

    /// Sets the scissor.
    pub fn scissor(&self, [x, y]: [i32; 2], [width, height]: [u32; 2]) {
        let scissor = vk::Rect2D {
            offset: vk::Offset2D { x, y },
            extent: vk::Extent2D { width, height },
        };
        // SAFETY: see `triangles`.
        unsafe { self.device().cmd_set_scissor(self.raw, 0, &[scissor]) };
    }

    /// Sets the stencil reference of both faces.
    pub fn stencil_reference(&self, reference: u32) {
        let faces = vk::StencilFaceFlags::FRONT_AND_BACK;
        // SAFETY: see `triangles`.
        unsafe {
            self.device()
                .cmd_set_stencil_reference(self.raw, faces, reference);
        }
    }

    /// Binds a graphics pipeline.
    pub fn bind(&self, pipeline: &Pipeline) {
        self.layout.set(pipeline.layout);
        let point = vk::PipelineBindPoint::GRAPHICS;
        // SAFETY: see `triangles`.
        unsafe {
            self.device()
                .cmd_bind_pipeline(self.raw, point, pipeline.raw);
        }
    }

    /// Binds a descriptor set to the pipeline bound last.
    pub fn bind_set(&self, bindings: &Bindings, dynamic_offsets: &[u32]) {
        let point = vk::PipelineBindPoint::GRAPHICS;
        // SAFETY: see `triangles`.
        unsafe {
            self.device().cmd_bind_descriptor_sets(
                self.raw,
                point,
                self.layout.get(),
                0,
                &[bindings.set],
                dynamic_offsets,
            );
        }
    }

    /// Sets push constants from `offset`, for all graphics stages.
    pub fn push<T: bytemuck::Pod>(&self, offset: u32, constants: &[T]) {
        let bytes = bytemuck::cast_slice(constants);
        let stages = vk::ShaderStageFlags::ALL_GRAPHICS;
        // SAFETY: see `triangles`.
        unsafe {
            self.device()
                .cmd_push_constants(self.raw, self.layout.get(), stages, offset, bytes);
        }
    }

    /// Binds a vertex buffer to binding 0.
    pub fn vertices(&self, buffer: &Buffer) {
        self.vertex_buffer(0, buffer, 0);
    }

    /// Binds a vertex buffer to any binding.
    pub fn vertex_buffer(&self, binding: u32, buffer: &Buffer, offset: u64) {
        // SAFETY: see `triangles`.
        unsafe {
            self.device()
                .cmd_bind_vertex_buffers(self.raw, binding, &[buffer.raw], &[offset]);
        }
    }

    /// Binds an index buffer.
    pub fn indices(&self, buffer: &Buffer, offset: u64, index_type: vk::IndexType) {
        // SAFETY: see `triangles`.
        unsafe {
            self.device()
                .cmd_bind_index_buffer(self.raw, buffer.raw, offset, index_type);
        }
    }

    /// Draws `vertices`, once.
    pub fn draw(&self, vertices: std::ops::Range<u32>) {
        self.draw_instances(vertices, 0..1);
    }

    /// Draws `vertices` for each of `instances`.
    pub fn draw_instances(&self, vertices: std::ops::Range<u32>, instances: std::ops::Range<u32>) {
        let (count, first) = (vertices.end - vertices.start, vertices.start);
        let (many, first_instance) = (instances.end - instances.start, instances.start);
        // SAFETY: see `triangles`.
        unsafe {
            self.device()
                .cmd_draw(self.raw, count, many, first, first_instance);
        }
    }

    /// Draws indexed vertices, once.
    pub fn draw_indexed(&self, indices: std::ops::Range<u32>, vertex_offset: i32) {
        let (count, first) = (indices.end - indices.start, indices.start);
        // SAFETY: see `triangles`.
        unsafe {
            self.device()
                .cmd_draw_indexed(self.raw, count, 1, first, vertex_offset, 0);
        }
    }
}
