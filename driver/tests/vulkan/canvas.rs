//! What points, lines and triangles are drawn on: an image, perhaps with depth and stencil, and passes over it.

use crate::gpu::{Buffer, COLOR, COLOR_LAYERS, DEVICE_ONLY, Gpu, Image, MAPPABLE};
use crate::polygons::{Made, Request, Vertex, vertex};
use crate::scene::{FORMAT, HEIGHT, WIDTH, set_viewport};
use ash::vk;

pub use crate::polygons::DEPTH_FORMAT;

/// What passes clear colour to.
pub const CLEAR: [f32; 4] = [0.25, 0.25, 0.25, 0.0];

/// What passes clear depth to; stencil is cleared to 0.
pub const CLEAR_DEPTH: f32 = 0.5;

pub const RED: [f32; 4] = [1.0, 0.0, 0.0, 1.0];
pub const GREEN: [f32; 4] = [0.0, 1.0, 0.0, 0.5];
pub const BLUE: [f32; 4] = [0.0, 0.0, 1.0, 0.25];

/// How many pixels a canvas has.
pub const PIXELS: usize = (WIDTH * HEIGHT) as usize;

/// A triangle that covers everything.
pub fn everything(color: [f32; 4]) -> [Vertex; 3] {
    [
        vertex(-1.0, -1.0, color),
        vertex(3.0, -1.0, color),
        vertex(-1.0, 3.0, color),
    ]
}

/// How many pixels are of a colour.
pub fn count(pixels: &[[f32; 4]], color: [f32; 4]) -> usize {
    pixels.iter().filter(|pixel| **pixel == color).count()
}

/// A device and an image that it draws on.
pub struct Canvas {
    pub gpu: Gpu,
    pub image: Image,
    depth: Option<Image>,
}

/// A descriptor set and what it is made of.
#[derive(Clone, Copy)]
pub struct Set {
    pub set: vk::DescriptorSet,
    pub layout: vk::DescriptorSetLayout,
    pool: vk::DescriptorPool,
}

impl Set {
    /// Destroys it.
    pub fn destroy(self, gpu: &Gpu) {
        // SAFETY: see the crate.
        unsafe {
            gpu.device.destroy_descriptor_pool(self.pool, None);
            gpu.device.destroy_descriptor_set_layout(self.layout, None);
        }
    }
}

impl Canvas {
    /// A canvas of floats without depth.
    pub fn new() -> Self {
        Self::of(FORMAT)
    }

    /// A canvas of a colour format without depth.
    pub fn of(format: vk::Format) -> Self {
        let gpu = Gpu::new();
        Self {
            image: gpu.image(format, WIDTH, HEIGHT),
            depth: None,
            gpu,
        }
    }

    /// A canvas of floats with depth and stencil.
    pub fn with_depth() -> Self {
        let mut canvas = Self::new();
        canvas.depth = Some(depth_image(&canvas.gpu));
        canvas
    }

    /// The image's pixels, if they are floats.
    pub fn pixels(&self) -> Vec<[f32; 4]> {
        self.gpu.read_image(self.image, 16)
    }

    /// Draws vertices once each.
    pub fn draw_vertices(&self, request: &Request, vertices: &[Vertex]) -> Vec<[f32; 4]> {
        self.draw(request, vertices, |device, commands, _| {
            // SAFETY: see the crate.
            unsafe { device.cmd_draw(commands, vertices.len() as u32, 1, 0, 0) };
        })
    }

    /// Draws by a pipeline of its own what `record` records, over bound vertices.
    pub fn draw(
        &self,
        request: &Request,
        vertices: &[Vertex],
        record: impl FnOnce(&ash::Device, vk::CommandBuffer, Made),
    ) -> Vec<[f32; 4]> {
        self.draw_of(request, vertices.as_flattened(), record)
    }

    /// Draws by a pipeline of its own what `record` records, over a bound vertex buffer.
    pub fn draw_of<T: bytemuck::NoUninit>(
        &self,
        request: &Request,
        vertices: &[T],
        record: impl FnOnce(&ash::Device, vk::CommandBuffer, Made),
    ) -> Vec<[f32; 4]> {
        let made = request
            .create(&self.gpu)
            .unwrap_or_else(|error| panic!("{error}: {:?}", self.gpu.take_messages()));
        let vertices = self.gpu.buffer_of(vertices);
        self.pass(&[self.image], |device, commands| {
            // SAFETY: see the crate.
            unsafe {
                device.cmd_bind_pipeline(commands, vk::PipelineBindPoint::GRAPHICS, made.pipeline);
                device.cmd_bind_vertex_buffers(commands, 0, &[vertices.buffer], &[0]);
            }
            record(device, commands, made);
        });
        self.gpu.free_buffer(vertices);
        made.destroy(&self.gpu);
        self.pixels()
    }

    /// Runs a pass that clears images, with viewport and scissor set.
    pub fn pass(&self, color: &[Image], record: impl FnOnce(&ash::Device, vk::CommandBuffer)) {
        self.gpu.run(|device, commands| {
            self.record_pass(device, commands, color, 1, || {
                set_viewport(device, commands, self.image);
                record(device, commands);
            });
        });
    }

    /// Records a pass that clears layers of images.
    pub fn record_pass(
        &self,
        device: &ash::Device,
        commands: vk::CommandBuffer,
        color: &[Image],
        layers: u32,
        record: impl FnOnce(),
    ) {
        let attachments: Vec<_> = color.iter().map(|image| attachment(*image)).collect();
        self.record_pass_of(device, commands, &attachments, layers, record);
    }

    /// Records a pass that clears `samples` and resolves them to the canvas.
    pub fn record_resolving_pass(
        &self,
        device: &ash::Device,
        commands: vk::CommandBuffer,
        samples: Image,
        record: impl FnOnce(),
    ) {
        let resolving = attachment(samples)
            .resolve_mode(vk::ResolveModeFlags::AVERAGE)
            .resolve_image_view(self.image.view)
            .resolve_image_layout(vk::ImageLayout::GENERAL);
        self.record_pass_of(device, commands, &[resolving], 1, || {
            set_viewport(device, commands, self.image);
            record();
        });
    }

    fn record_pass_of(
        &self,
        device: &ash::Device,
        commands: vk::CommandBuffer,
        color: &[vk::RenderingAttachmentInfo],
        layers: u32,
        record: impl FnOnce(),
    ) {
        let depth = self.depth.map(|depth| {
            attachment(depth).clear_value(vk::ClearValue {
                depth_stencil: vk::ClearDepthStencilValue {
                    depth: CLEAR_DEPTH,
                    stencil: 0,
                },
            })
        });
        let mut rendering = vk::RenderingInfo::default()
            .render_area(vk::Rect2D {
                offset: vk::Offset2D::default(),
                extent: self.image.extent,
            })
            .layer_count(layers)
            .color_attachments(color);
        if let Some(depth) = &depth {
            rendering = rendering.depth_attachment(depth).stencil_attachment(depth);
        }
        // SAFETY: see the crate.
        unsafe { device.cmd_begin_rendering(commands, &rendering) };
        record();
        // SAFETY: see the crate.
        unsafe { device.cmd_end_rendering(commands) };
    }

    /// A sampler that filters nothing.
    pub fn nearest_sampler(&self) -> vk::Sampler {
        let info = vk::SamplerCreateInfo::default();
        // SAFETY: see the crate.
        unsafe { self.gpu.device.create_sampler(&info, None).unwrap() }
    }

    /// A set of a uniform buffer and a texture, for the fragment stage.
    pub fn tint_set(&self, texture: Image, sampler: vk::Sampler, tint: Buffer) -> Set {
        let kinds = [
            vk::DescriptorType::UNIFORM_BUFFER,
            vk::DescriptorType::COMBINED_IMAGE_SAMPLER,
        ];
        let set = self.set(&kinds, vk::ShaderStageFlags::FRAGMENT);
        let buffers = [crate::kernel::whole(tint)];
        let images = [vk::DescriptorImageInfo::default()
            .image_view(texture.view)
            .sampler(sampler)
            .image_layout(vk::ImageLayout::GENERAL)];
        let write = |binding: u32| {
            vk::WriteDescriptorSet::default()
                .dst_set(set.set)
                .dst_binding(binding)
                .descriptor_type(kinds[binding as usize])
        };
        let writes = [write(0).buffer_info(&buffers), write(1).image_info(&images)];
        // SAFETY: see the crate.
        unsafe { self.gpu.device.update_descriptor_sets(&writes, &[]) };
        set
    }

    /// A set of one storage buffer, for both stages.
    pub fn storage_set(&self, buffer: Buffer) -> Set {
        let kind = vk::DescriptorType::STORAGE_BUFFER;
        let stages = vk::ShaderStageFlags::VERTEX | vk::ShaderStageFlags::FRAGMENT;
        let set = self.set(&[kind], stages);
        crate::kernel::write(
            &self.gpu,
            set.set,
            (0, 0),
            kind,
            &[crate::kernel::whole(buffer)],
        );
        set
    }

    /// A set of descriptors, one a binding.
    pub fn set(&self, kinds: &[vk::DescriptorType], stages: vk::ShaderStageFlags) -> Set {
        let bindings: Vec<_> = (0..)
            .zip(kinds)
            .map(|(binding, &kind)| {
                vk::DescriptorSetLayoutBinding::default()
                    .binding(binding)
                    .descriptor_type(kind)
                    .descriptor_count(1)
                    .stage_flags(stages)
            })
            .collect();
        let sizes: Vec<_> = kinds
            .iter()
            .map(|&kind| {
                vk::DescriptorPoolSize::default()
                    .ty(kind)
                    .descriptor_count(1)
            })
            .collect();
        let device = &self.gpu.device;
        // SAFETY: see the crate.
        unsafe {
            let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
            let layout = device.create_descriptor_set_layout(&info, None).unwrap();
            let info = vk::DescriptorPoolCreateInfo::default()
                .max_sets(1)
                .pool_sizes(&sizes);
            let pool = device.create_descriptor_pool(&info, None).unwrap();
            let layouts = [layout];
            let info = vk::DescriptorSetAllocateInfo::default()
                .descriptor_pool(pool)
                .set_layouts(&layouts);
            let set = device.allocate_descriptor_sets(&info).unwrap()[0];
            Set { set, layout, pool }
        }
    }
}

impl Drop for Canvas {
    fn drop(&mut self) {
        self.gpu.free_image(self.image);
        if let Some(depth) = self.depth {
            self.gpu.free_image(depth);
        }
    }
}

fn attachment(image: Image) -> vk::RenderingAttachmentInfo<'static> {
    vk::RenderingAttachmentInfo::default()
        .image_view(image.view)
        .image_layout(vk::ImageLayout::GENERAL)
        .load_op(vk::AttachmentLoadOp::CLEAR)
        .store_op(vk::AttachmentStoreOp::STORE)
        .clear_value(vk::ClearValue {
            color: vk::ClearColorValue { float32: CLEAR },
        })
}

/// A depth and stencil image.
fn depth_image(gpu: &Gpu) -> Image {
    attachment_image(
        gpu,
        vk::ImageCreateInfo::default()
            .format(DEPTH_FORMAT)
            .array_layers(1)
            .samples(vk::SampleCountFlags::TYPE_1)
            .usage(vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT),
        vk::ImageViewType::TYPE_2D,
        vk::ImageAspectFlags::DEPTH | vk::ImageAspectFlags::STENCIL,
    )
}

/// An image of several layers with a view of them all.
pub fn layered_image(gpu: &Gpu, layers: u32) -> Image {
    attachment_image(
        gpu,
        vk::ImageCreateInfo::default()
            .format(FORMAT)
            .array_layers(layers)
            .samples(vk::SampleCountFlags::TYPE_1)
            .usage(vk::ImageUsageFlags::COLOR_ATTACHMENT | vk::ImageUsageFlags::TRANSFER_SRC),
        vk::ImageViewType::TYPE_2D_ARRAY,
        vk::ImageAspectFlags::COLOR,
    )
}

/// An image of several samples.
pub fn sampled_image(gpu: &Gpu, samples: vk::SampleCountFlags) -> Image {
    attachment_image(
        gpu,
        vk::ImageCreateInfo::default()
            .format(FORMAT)
            .array_layers(1)
            .samples(samples)
            .usage(vk::ImageUsageFlags::COLOR_ATTACHMENT),
        vk::ImageViewType::TYPE_2D,
        vk::ImageAspectFlags::COLOR,
    )
}

/// An image as large as a canvas, with a view of it.
pub fn attachment_image(
    gpu: &Gpu,
    info: vk::ImageCreateInfo,
    view_type: vk::ImageViewType,
    aspect_mask: vk::ImageAspectFlags,
) -> Image {
    let extent = vk::Extent2D {
        width: WIDTH,
        height: HEIGHT,
    };
    let info = info
        .image_type(vk::ImageType::TYPE_2D)
        .extent(extent.into())
        .mip_levels(1);
    // SAFETY: see the crate.
    unsafe {
        let image = gpu.device.create_image(&info, None).unwrap();
        let requirements = gpu.device.get_image_memory_requirements(image);
        let memory = gpu.allocate(requirements.size, DEVICE_ONLY);
        gpu.device.bind_image_memory(image, memory, 0).unwrap();
        let range = vk::ImageSubresourceRange {
            aspect_mask,
            layer_count: info.array_layers,
            ..COLOR
        };
        let view_info = vk::ImageViewCreateInfo::default()
            .image(image)
            .view_type(view_type)
            .format(info.format)
            .subresource_range(range);
        let view = gpu.device.create_image_view(&view_info, None).unwrap();
        gpu.run(|device, commands| {
            let barriers = [vk::ImageMemoryBarrier::default()
                .new_layout(vk::ImageLayout::GENERAL)
                .image(image)
                .subresource_range(range)];
            let all = vk::PipelineStageFlags::ALL_COMMANDS;
            let none = vk::DependencyFlags::empty();
            device.cmd_pipeline_barrier(commands, all, all, none, &[], &[], &barriers);
        });
        Image {
            image,
            memory,
            view,
            extent,
        }
    }
}

/// The float texels of a layer.
pub fn read_layer(gpu: &Gpu, image: Image, layer: u32) -> Vec<[f32; 4]> {
    let buffer = gpu.buffer(u64::from(WIDTH * HEIGHT) * 16, MAPPABLE);
    let region = region(image, layer);
    gpu.run(|device, commands| {
        let (from, to) = (image.image, buffer.buffer);
        let layout = vk::ImageLayout::GENERAL;
        // SAFETY: see the crate.
        unsafe { device.cmd_copy_image_to_buffer(commands, from, layout, to, &[region]) };
    });
    let texels = gpu.read(buffer);
    gpu.free_buffer(buffer);
    texels
}

/// Fills a colour image from a buffer.
pub fn write_image(gpu: &Gpu, image: Image, texels: Buffer) {
    let region = region(image, 0);
    gpu.run(|device, commands| {
        let (from, to) = (texels.buffer, image.image);
        let layout = vk::ImageLayout::GENERAL;
        // SAFETY: see the crate.
        unsafe { device.cmd_copy_buffer_to_image(commands, from, to, layout, &[region]) };
    });
}

fn region(image: Image, layer: u32) -> vk::BufferImageCopy {
    vk::BufferImageCopy::default()
        .image_subresource(vk::ImageSubresourceLayers {
            base_array_layer: layer,
            ..COLOR_LAYERS
        })
        .image_extent(image.extent.into())
}
