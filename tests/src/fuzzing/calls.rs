//! Vulkan calls in any order and with many values, among them some that valid usage forbids: sizes and offsets that don't
//! fit, commands where they don't belong, counts of any size. Handles are always live ones of the right kind, pointers
//! are valid, and nothing is destroyed while it is in use: where those rules are broken, nothing can be promised.

use ash::vk;
use gaurast::gaussian_primitive_topology;
use gaurast::vk::{
    GaussianCameraGAURAST, GaussianCameraModelGAURAST, GaussianGeometryGAURAST,
    GaussianLinearizationGAURAST, GaussianOrderGAURAST, GaussianPrecisionGAURAST,
    PRIMITIVE_TOPOLOGY_GAUSSIAN_LIST_GAURAST,
    PhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST as GaussianFeatures,
    PipelineGaussianStateCreateInfoGAURAST,
};

use super::bytes::Bytes;
use crate::contexts::gaussian::{attribute_locations, attributes, scene_bindings};

/// Calls of a run at most.
const CALLS: usize = 120;
/// Objects of a kind at most.
const OBJECTS: usize = 6;
const FORMATS: [vk::Format; 6] = [
    vk::Format::R32G32B32A32_SFLOAT,
    vk::Format::R8G8B8A8_UNORM,
    vk::Format::B8G8R8A8_SRGB,
    vk::Format::D32_SFLOAT,
    vk::Format::D24_UNORM_S8_UINT,
    vk::Format::R16_UINT,
];

/// How a run ended.
#[derive(Clone, Copy, Debug, Default)]
pub struct Ended {
    /// Calls that returned success, or nothing.
    pub succeeded: u32,
    /// Calls that returned an error.
    pub failed: u32,
    /// Submissions that were executed.
    pub submitted: u32,
    /// Whether the device was lost.
    pub lost: bool,
}

struct Resource<T> {
    handle: T,
    memory: vk::DeviceMemory,
    format: vk::Format,
    extent: [u32; 2],
}

/// A device and what a run has made.
struct Run {
    instance: ash::Instance,
    device: ash::Device,
    gaussian: gaussian_primitive_topology::Device,
    types: vk::PhysicalDeviceMemoryProperties,
    queue: vk::Queue,
    pool: vk::CommandPool,
    commands: vk::CommandBuffer,
    layout: vk::PipelineLayout,
    queries: vk::QueryPool,
    buffers: Vec<Resource<vk::Buffer>>,
    images: Vec<(Resource<vk::Image>, vk::ImageView)>,
    pipelines: Vec<vk::Pipeline>,
    ended: Ended,
    /// Last: it may own the library that all others call.
    _entry: ash::Entry,
}

/// Makes the calls that bytes say, on a device of its own.
///
/// # Panics
/// If the driver cannot do what doesn't depend on the bytes.
pub fn run(data: &[u8]) -> Ended {
    let mut bytes = Bytes::new(data);
    let mut run = Run::new();
    for _ in 0..CALLS {
        if bytes.is_empty() || run.ended.lost {
            break;
        }
        run.call(&mut bytes);
    }
    run.ended
}

// `unsafe` here has one reason throughout: these are Vulkan calls whose handles are live and whose pointers are valid,
// which is all that the driver relies upon; see the module.
impl Run {
    fn new() -> Self {
        let entry = vulkan_gaurast::entry();
        // SAFETY: see above.
        unsafe {
            let application = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_3);
            let info = vk::InstanceCreateInfo::default().application_info(&application);
            let instance = entry.create_instance(&info, None).expect("an instance");
            let physical = instance.enumerate_physical_devices().expect("devices")[0];
            let queues = [vk::DeviceQueueCreateInfo::default().queue_priorities(&[1.0])];
            let extensions = [gaussian_primitive_topology::NAME.as_ptr()];
            let mut gaussian = GaussianFeatures::default()
                .gaussian_primitive_topology(true)
                .primitive_order(true)
                .radial_distance_order(true)
                .orthographic_camera(true)
                .fisheye_camera(true)
                .equirectangular_camera(true)
                .per_pixel_order(true)
                .rasterization_float16(true)
                .unscented_projection(true)
                .gaussian_2d(true)
                .gaussian_depth_stencil(true)
                .gaussian_multisample(true);
            let mut core = vk::PhysicalDeviceVulkan13Features::default().dynamic_rendering(true);
            let info = vk::DeviceCreateInfo::default()
                .queue_create_infos(&queues)
                .enabled_extension_names(&extensions)
                .push_next(&mut core)
                .push_next(&mut gaussian);
            let device = instance
                .create_device(physical, &info, None)
                .expect("a device");
            let flags = vk::CommandPoolCreateFlags::RESET_COMMAND_BUFFER;
            let pool = vk::CommandPoolCreateInfo::default().flags(flags);
            let pool = device.create_command_pool(&pool, None).expect("a pool");
            let info = vk::CommandBufferAllocateInfo::default()
                .command_pool(pool)
                .command_buffer_count(1);
            let commands = device
                .allocate_command_buffers(&info)
                .expect("a command buffer")[0];
            let layout = vk::PipelineLayoutCreateInfo::default();
            let queries = vk::QueryPoolCreateInfo::default()
                .query_type(vk::QueryType::TIMESTAMP)
                .query_count(4);
            Self {
                gaussian: gaussian_primitive_topology::Device::new(&instance, &device),
                types: instance.get_physical_device_memory_properties(physical),
                queue: device.get_device_queue(0, 0),
                layout: device
                    .create_pipeline_layout(&layout, None)
                    .expect("a layout"),
                queries: device.create_query_pool(&queries, None).expect("queries"),
                instance,
                device,
                pool,
                commands,
                buffers: Vec::new(),
                images: Vec::new(),
                pipelines: Vec::new(),
                ended: Ended::default(),
                _entry: entry,
            }
        }
    }

    /// Counts what a call returned.
    fn note<T>(&mut self, result: ash::prelude::VkResult<T>) -> Option<T> {
        match result {
            Ok(value) => {
                self.ended.succeeded += 1;
                Some(value)
            }
            Err(error) => {
                self.ended.failed += 1;
                self.ended.lost |= error == vk::Result::ERROR_DEVICE_LOST;
                // A defect of the driver, or a handle that it doesn't know.
                assert_ne!(error, vk::Result::ERROR_UNKNOWN);
                None
            }
        }
    }

    fn call(&mut self, bytes: &mut Bytes<'_>) {
        match bytes.below(32) {
            0 | 1 => self.create_buffer(bytes),
            2 | 3 => self.create_image(bytes),
            4 => self.create_pipeline(bytes),
            5 => self.map(bytes),
            6 => self.destroy(bytes),
            7 | 8 => self.begin(bytes),
            9 | 10 => self.submit(),
            11 | 12 => self.begin_rendering(bytes),
            // SAFETY: see above.
            13 => unsafe { self.device.cmd_end_rendering(self.commands) },
            14..18 => self.copy(bytes),
            18 | 19 => self.query(bytes),
            20 | 21 => self.set_state(bytes),
            22..24 => self.bind_vertex_buffers(bytes),
            24 => self.clear(bytes),
            _ => self.draw(bytes),
        }
    }

    fn memory(
        &mut self,
        bytes: &mut Bytes<'_>,
        needed: vk::MemoryRequirements,
    ) -> Option<vk::DeviceMemory> {
        let count = self.types.memory_type_count;
        let allowed: Vec<_> = (0..count)
            .filter(|index| needed.memory_type_bits >> index & 1 == 1)
            .collect();
        let info = vk::MemoryAllocateInfo::default()
            .allocation_size(needed.size)
            .memory_type_index(bytes.one(&allowed));
        // SAFETY: see above.
        let memory = unsafe { self.device.allocate_memory(&info, None) };
        self.note(memory)
    }

    fn create_buffer(&mut self, bytes: &mut Bytes<'_>) {
        if self.buffers.len() >= OBJECTS {
            return;
        }
        let usage = vk::BufferUsageFlags::VERTEX_BUFFER
            | vk::BufferUsageFlags::INDEX_BUFFER
            | vk::BufferUsageFlags::INDIRECT_BUFFER
            | vk::BufferUsageFlags::TRANSFER_SRC
            | vk::BufferUsageFlags::TRANSFER_DST;
        let size = bytes.long(40_000);
        let info = vk::BufferCreateInfo::default().size(size).usage(usage);
        // SAFETY: see above.
        unsafe {
            let buffer = self.device.create_buffer(&info, None);
            let Some(handle) = self.note(buffer) else {
                return;
            };
            let needed = self.device.get_buffer_memory_requirements(handle);
            let memory = if needed.size <= 1 << 24 {
                self.memory(bytes, needed)
            } else {
                None
            };
            let Some(memory) = memory else {
                self.device.destroy_buffer(handle, None);
                return;
            };
            let bound = self.device.bind_buffer_memory(handle, memory, 0);
            self.note(bound);
            let (format, extent) = (vk::Format::UNDEFINED, [0; 2]);
            self.buffers.push(Resource {
                handle,
                memory,
                format,
                extent,
            });
        }
    }

    fn create_image(&mut self, bytes: &mut Bytes<'_>) {
        if self.images.len() >= OBJECTS {
            return;
        }
        let format = bytes.one(&FORMATS);
        let depth = format == vk::Format::D32_SFLOAT || format == vk::Format::D24_UNORM_S8_UINT;
        let attachment = if depth {
            vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT
        } else {
            vk::ImageUsageFlags::COLOR_ATTACHMENT
        };
        let extent = [0; 2].map(|_| {
            if bytes.rarely(12) {
                bytes.number(5000) % 20_000
            } else {
                1 + bytes.below(90) as u32
            }
        });
        let info = vk::ImageCreateInfo::default()
            .image_type(vk::ImageType::TYPE_2D)
            .format(format)
            .extent(vk::Extent3D {
                width: extent[0],
                height: extent[1],
                depth: 1,
            })
            .mip_levels(1)
            .array_layers(1)
            .samples(bytes.one(&[
                vk::SampleCountFlags::TYPE_1,
                vk::SampleCountFlags::TYPE_1,
                vk::SampleCountFlags::TYPE_4,
            ]))
            .usage(
                attachment | vk::ImageUsageFlags::TRANSFER_SRC | vk::ImageUsageFlags::TRANSFER_DST,
            );
        if extent.contains(&0) {
            return;
        }
        // SAFETY: see above.
        unsafe {
            let image = self.device.create_image(&info, None);
            let Some(handle) = self.note(image) else {
                return;
            };
            let needed = self.device.get_image_memory_requirements(handle);
            let memory = if needed.size <= 1 << 24 {
                self.memory(bytes, needed)
            } else {
                None
            };
            let Some(memory) = memory else {
                self.device.destroy_image(handle, None);
                return;
            };
            let bound = self.device.bind_image_memory(handle, memory, 0);
            self.note(bound);
            let aspect = match format {
                vk::Format::D32_SFLOAT => vk::ImageAspectFlags::DEPTH,
                vk::Format::D24_UNORM_S8_UINT => {
                    vk::ImageAspectFlags::DEPTH | vk::ImageAspectFlags::STENCIL
                }
                _ => vk::ImageAspectFlags::COLOR,
            };
            let info = vk::ImageViewCreateInfo::default()
                .image(handle)
                .view_type(vk::ImageViewType::TYPE_2D)
                .format(format)
                .subresource_range(vk::ImageSubresourceRange {
                    aspect_mask: aspect,
                    base_mip_level: 0,
                    level_count: 1,
                    base_array_layer: 0,
                    layer_count: 1,
                });
            let view = self.device.create_image_view(&info, None);
            match self.note(view) {
                Some(view) => self.images.push((
                    Resource {
                        handle,
                        memory,
                        format,
                        extent,
                    },
                    view,
                )),
                None => {
                    self.device.destroy_image(handle, None);
                    self.device.free_memory(memory, None);
                }
            }
        }
    }

    fn create_pipeline(&mut self, bytes: &mut Bytes<'_>) {
        if self.pipelines.len() >= OBJECTS {
            return;
        }
        let (bindings, attributes) = (scene_bindings(0, false), attributes(0));
        let vertex_input = vk::PipelineVertexInputStateCreateInfo::default()
            .vertex_binding_descriptions(&bindings)
            .vertex_attribute_descriptions(&attributes);
        let assembly = vk::PipelineInputAssemblyStateCreateInfo::default()
            .topology(PRIMITIVE_TOPOLOGY_GAUSSIAN_LIST_GAURAST);
        let viewport = vk::PipelineViewportStateCreateInfo::default()
            .viewport_count(1)
            .scissor_count(1);
        let raster = vk::PipelineRasterizationStateCreateInfo::default().line_width(1.0);
        let samples = bytes.one(&[
            vk::SampleCountFlags::TYPE_1,
            vk::SampleCountFlags::TYPE_1,
            vk::SampleCountFlags::TYPE_4,
        ]);
        let multisample =
            vk::PipelineMultisampleStateCreateInfo::default().rasterization_samples(samples);
        let blend = [crate::contexts::over()];
        let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&blend);
        let dynamic = [vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR];
        let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&dynamic);
        let depth_test = bytes.rarely(2);
        let depth_stencil = vk::PipelineDepthStencilStateCreateInfo::default()
            .depth_test_enable(depth_test)
            .depth_write_enable(bytes.rarely(2))
            .depth_compare_op(vk::CompareOp::from_raw(bytes.below(8) as i32));
        let formats = [bytes.one(&FORMATS[..3])];
        let mut rendering =
            vk::PipelineRenderingCreateInfo::default().color_attachment_formats(&formats);
        if depth_test {
            rendering = rendering.depth_attachment_format(vk::Format::D32_SFLOAT);
        }
        let mut or = |usual: f32| {
            if bytes.rarely(5) {
                bytes.float()
            } else {
                usual
            }
        };
        let mut state = PipelineGaussianStateCreateInfoGAURAST::default()
            .alpha_floor(or(1.0 / 255.0))
            .alpha_ceiling(or(0.99))
            .transmittance_floor(or(1e-4))
            .low_pass_variance(or(0.3))
            .attribute_locations(attribute_locations())
            .order(bytes.one(&[
                GaussianOrderGAURAST::VIEW_DEPTH,
                GaussianOrderGAURAST::RADIAL_DISTANCE,
                GaussianOrderGAURAST::PRIMITIVE,
                GaussianOrderGAURAST::PER_PIXEL,
            ]))
            .geometry(bytes.one(&[
                GaussianGeometryGAURAST::GAUSSIAN_3D,
                GaussianGeometryGAURAST::GAUSSIAN_3D,
                GaussianGeometryGAURAST::GAUSSIAN_2D,
            ]))
            .precision(bytes.one(&[
                GaussianPrecisionGAURAST::FLOAT32,
                GaussianPrecisionGAURAST::FLOAT32,
                GaussianPrecisionGAURAST::FLOAT16,
            ]))
            .linearization(bytes.one(&[
                GaussianLinearizationGAURAST::JACOBIAN,
                GaussianLinearizationGAURAST::UNSCENTED,
            ]));
        let info = vk::GraphicsPipelineCreateInfo::default()
            .vertex_input_state(&vertex_input)
            .input_assembly_state(&assembly)
            .viewport_state(&viewport)
            .rasterization_state(&raster)
            .multisample_state(&multisample)
            .depth_stencil_state(&depth_stencil)
            .color_blend_state(&blend)
            .dynamic_state(&dynamic)
            .layout(self.layout)
            .push_next(&mut rendering)
            .push_next(&mut state);
        // SAFETY: see above.
        let pipelines = unsafe {
            self.device
                .create_graphics_pipelines(vk::PipelineCache::null(), &[info], None)
        };
        let pipelines = self.note(pipelines.map_err(|(_, error)| error));
        self.pipelines.extend(pipelines.into_iter().flatten());
    }

    fn map(&mut self, bytes: &mut Bytes<'_>) {
        let Some(buffer) = pick(bytes, &self.buffers) else {
            return;
        };
        let (handle, memory) = (buffer.handle, buffer.memory);
        let (offset, size) = (bytes.long(5000), bytes.long(5000));
        // SAFETY: see above; what is written lies in the mapped range.
        unsafe {
            let mapped = self
                .device
                .map_memory(memory, offset, size, vk::MemoryMapFlags::empty());
            if let Some(mapped) = self.note(mapped) {
                // The size may say whatever there is.
                let whole = self.device.get_buffer_memory_requirements(handle).size;
                let count = size.min(4096).min(whole.saturating_sub(offset)) as usize;
                for at in 0..count {
                    mapped.cast::<u8>().add(at).write(bytes.byte());
                }
                self.device.unmap_memory(memory);
            }
        }
    }

    fn destroy(&mut self, bytes: &mut Bytes<'_>) {
        // Nothing is in use: submissions are waited for, and what is recorded is made anew.
        self.reset();
        // SAFETY: see above.
        unsafe {
            if bytes.rarely(2) && !self.buffers.is_empty() {
                let buffer = self.buffers.swap_remove(bytes.below(self.buffers.len()));
                self.device.destroy_buffer(buffer.handle, None);
                self.device.free_memory(buffer.memory, None);
            } else if !self.images.is_empty() {
                let (image, view) = self.images.swap_remove(bytes.below(self.images.len()));
                self.device.destroy_image_view(view, None);
                self.device.destroy_image(image.handle, None);
                self.device.free_memory(image.memory, None);
            }
        }
    }

    fn reset(&mut self) {
        let flags = vk::CommandBufferResetFlags::empty();
        // SAFETY: see above.
        let reset = unsafe { self.device.reset_command_buffer(self.commands, flags) };
        self.note(reset);
    }

    fn begin(&mut self, bytes: &mut Bytes<'_>) {
        let flags = bytes.one(&[
            vk::CommandBufferUsageFlags::empty(),
            vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT,
        ]);
        let info = vk::CommandBufferBeginInfo::default().flags(flags);
        // SAFETY: see above.
        let begun = unsafe { self.device.begin_command_buffer(self.commands, &info) };
        self.note(begun);
    }

    fn submit(&mut self) {
        let commands = [self.commands];
        let submits = [vk::SubmitInfo::default().command_buffers(&commands)];
        // SAFETY: see above.
        unsafe {
            let ended = self.device.end_command_buffer(self.commands);
            self.note(ended);
            let submitted = self
                .device
                .queue_submit(self.queue, &submits, vk::Fence::null());
            if self.note(submitted).is_some() {
                self.ended.submitted += 1;
            }
            let idle = self.device.queue_wait_idle(self.queue);
            self.note(idle);
        }
        self.reset();
    }

    fn begin_rendering(&mut self, bytes: &mut Bytes<'_>) {
        let Some((image, view)) = pick(bytes, &self.images) else {
            return;
        };
        let depth =
            pick(bytes, &self.images).filter(|(image, _)| image.format == vk::Format::D32_SFLOAT);
        let color = [vk::RenderingAttachmentInfo::default()
            .image_view(*view)
            .image_layout(vk::ImageLayout::GENERAL)
            .load_op(bytes.one(&[
                vk::AttachmentLoadOp::CLEAR,
                vk::AttachmentLoadOp::LOAD,
                vk::AttachmentLoadOp::DONT_CARE,
            ]))
            .store_op(vk::AttachmentStoreOp::STORE)];
        let depth = depth.map(|(_, view)| {
            vk::RenderingAttachmentInfo::default()
                .image_view(*view)
                .image_layout(vk::ImageLayout::GENERAL)
                .load_op(vk::AttachmentLoadOp::CLEAR)
                .store_op(vk::AttachmentStoreOp::STORE)
        });
        let extent = image.extent;
        let mut side = |usual: u32| {
            if bytes.rarely(8) {
                bytes.number(200)
            } else {
                usual
            }
        };
        let area = vk::Rect2D {
            offset: vk::Offset2D {
                x: side(0).cast_signed(),
                y: side(0).cast_signed(),
            },
            extent: vk::Extent2D {
                width: side(extent[0]),
                height: side(extent[1]),
            },
        };
        let mut info = vk::RenderingInfo::default()
            .render_area(area)
            .layer_count(1)
            .color_attachments(&color);
        if let Some(depth) = &depth {
            info = info.depth_attachment(depth);
        }
        // SAFETY: see above.
        unsafe { self.device.cmd_begin_rendering(self.commands, &info) };
    }

    fn copy(&mut self, bytes: &mut Bytes<'_>) {
        let (Some(from), Some(to)) = (pick(bytes, &self.buffers), pick(bytes, &self.buffers))
        else {
            return;
        };
        let (from, to) = (from.handle, to.handle);
        let image = pick(bytes, &self.images).map(|(image, _)| image.handle);
        let layers = vk::ImageSubresourceLayers {
            aspect_mask: bytes.one(&[vk::ImageAspectFlags::COLOR, vk::ImageAspectFlags::DEPTH]),
            mip_level: bytes.number(2),
            base_array_layer: bytes.number(2),
            layer_count: bytes.number(2),
        };
        let region = [vk::BufferCopy::default()
            .src_offset(bytes.long(3000))
            .dst_offset(bytes.long(3000))
            .size(bytes.long(3000))];
        let texels = [vk::BufferImageCopy {
            buffer_offset: bytes.long(3000),
            buffer_row_length: bytes.number(60),
            buffer_image_height: bytes.number(60),
            image_subresource: layers,
            image_offset: vk::Offset3D {
                x: bytes.number(30).cast_signed(),
                y: bytes.number(30).cast_signed(),
                z: 0,
            },
            image_extent: vk::Extent3D {
                width: bytes.number(60),
                height: bytes.number(60),
                depth: 1,
            },
        }];
        let layout = vk::ImageLayout::GENERAL;
        let (device, commands) = (&self.device, self.commands);
        // SAFETY: see above.
        unsafe {
            match (bytes.below(6), image) {
                (0, _) => device.cmd_copy_buffer(commands, from, to, &region),
                (1, _) => {
                    device.cmd_fill_buffer(
                        commands,
                        to,
                        bytes.long(3000),
                        bytes.long(3000),
                        bytes.word(),
                    );
                }
                (2, _) => {
                    device.cmd_update_buffer(commands, to, bytes.long(3000), &[bytes.byte(); 64]);
                }
                (3, Some(image)) => {
                    device.cmd_copy_buffer_to_image(commands, from, image, layout, &texels);
                }
                (4, Some(image)) => {
                    device.cmd_copy_image_to_buffer(commands, image, layout, to, &texels);
                }
                (_, Some(image)) => {
                    let range = vk::ImageSubresourceRange {
                        aspect_mask: layers.aspect_mask,
                        base_mip_level: layers.mip_level,
                        level_count: bytes.number(3),
                        base_array_layer: layers.base_array_layer,
                        layer_count: layers.layer_count,
                    };
                    let color = vk::ClearColorValue {
                        float32: [0; 4].map(|_| bytes.float()),
                    };
                    device.cmd_clear_color_image(commands, image, layout, &color, &[range]);
                }
                (_, None) => {}
            }
        }
    }

    fn query(&mut self, bytes: &mut Bytes<'_>) {
        let (first, count) = (bytes.number(4), bytes.number(4));
        let (device, commands, queries) = (&self.device, self.commands, self.queries);
        // SAFETY: see above; results are written to memory of their own.
        unsafe {
            match bytes.below(4) {
                0 => device.cmd_reset_query_pool(commands, queries, first, count),
                1 => {
                    let stage = vk::PipelineStageFlags::BOTTOM_OF_PIPE;
                    device.cmd_write_timestamp(commands, stage, queries, first);
                }
                2 => {
                    let Some(buffer) = pick(bytes, &self.buffers) else {
                        return;
                    };
                    let (offset, stride) = (bytes.long(3000), bytes.long(64));
                    let flags = vk::QueryResultFlags::from_raw(bytes.below(16) as u32 & 0b1101);
                    device.cmd_copy_query_pool_results(
                        commands,
                        queries,
                        first,
                        count,
                        buffer.handle,
                        offset,
                        stride,
                        flags,
                    );
                }
                _ => {
                    let mut results = [0u64; 4];
                    let count = count as usize % 5;
                    let flags = vk::QueryResultFlags::TYPE_64;
                    let got =
                        device.get_query_pool_results(queries, first, &mut results[..count], flags);
                    self.note(got);
                }
            }
        }
    }

    fn set_state(&mut self, bytes: &mut Bytes<'_>) {
        let mut or = |usual: f32| {
            if bytes.rarely(8) {
                bytes.float()
            } else {
                usual
            }
        };
        let camera = GaussianCameraGAURAST::default()
            .eye([or(0.0).into(), or(0.0).into(), or(-3.0).into()])
            .focal_length([or(30.0), or(30.0)])
            .principal_point([or(20.0), or(20.0)])
            .near_plane(or(0.2))
            .far_plane(or(f32::INFINITY));
        let viewport = vk::Viewport {
            x: or(0.0),
            y: or(0.0),
            width: or(60.0),
            height: or(50.0),
            min_depth: or(0.0),
            max_depth: or(1.0),
        };
        let camera = camera.model(bytes.one(&[
            GaussianCameraModelGAURAST::PINHOLE,
            GaussianCameraModelGAURAST::ORTHOGRAPHIC,
            GaussianCameraModelGAURAST::FISHEYE,
            GaussianCameraModelGAURAST::EQUIRECTANGULAR,
        ]));
        let scissor = vk::Rect2D {
            offset: vk::Offset2D {
                x: bytes.number(9).cast_signed(),
                y: bytes.number(9).cast_signed(),
            },
            extent: vk::Extent2D {
                width: bytes.number(90),
                height: bytes.number(90),
            },
        };
        // SAFETY: see above.
        unsafe {
            self.gaussian
                .cmd_set_gaussian_camera(self.commands, &camera);
            self.device
                .cmd_set_viewport(self.commands, bytes.number(1), &[viewport]);
            self.device.cmd_set_scissor(self.commands, 0, &[scissor]);
            if let Some(pipeline) = pick(bytes, &self.pipelines) {
                let point = vk::PipelineBindPoint::GRAPHICS;
                self.device
                    .cmd_bind_pipeline(self.commands, point, *pipeline);
            }
        }
    }

    fn bind_vertex_buffers(&mut self, bytes: &mut Bytes<'_>) {
        if self.buffers.is_empty() {
            return;
        }
        let buffers = [0; 5].map(|_| self.buffers[bytes.below(self.buffers.len())].handle);
        let offsets = [0; 5].map(|_| bytes.long(2000));
        // SAFETY: see above.
        unsafe {
            self.device
                .cmd_bind_vertex_buffers(self.commands, 0, &buffers, &offsets);
            let (offset, ty) = (
                bytes.long(2000),
                bytes.one(&[vk::IndexType::UINT16, vk::IndexType::UINT32]),
            );
            self.device
                .cmd_bind_index_buffer(self.commands, buffers[0], offset, ty);
        }
    }

    fn clear(&mut self, bytes: &mut Bytes<'_>) {
        let clear = [vk::ClearAttachment {
            aspect_mask: bytes.one(&[
                vk::ImageAspectFlags::COLOR,
                vk::ImageAspectFlags::DEPTH,
                vk::ImageAspectFlags::STENCIL,
            ]),
            color_attachment: bytes.number(3),
            clear_value: vk::ClearValue {
                color: vk::ClearColorValue {
                    float32: [0; 4].map(|_| bytes.float()),
                },
            },
        }];
        let rect = [vk::ClearRect {
            rect: vk::Rect2D {
                offset: vk::Offset2D {
                    x: bytes.number(30).cast_signed(),
                    y: bytes.number(30).cast_signed(),
                },
                extent: vk::Extent2D {
                    width: bytes.number(60),
                    height: bytes.number(60),
                },
            },
            base_array_layer: bytes.number(2),
            layer_count: bytes.number(2),
        }];
        // SAFETY: see above.
        unsafe {
            self.device
                .cmd_clear_attachments(self.commands, &clear, &rect);
        };
    }

    fn draw(&mut self, bytes: &mut Bytes<'_>) {
        // More is no other than much, but takes long.
        let (count, instances) = (bytes.number(400) % 4000, bytes.number(3) % 5);
        let (first, first_instance) = (bytes.number(30), bytes.number(3));
        let (device, commands) = (&self.device, self.commands);
        // SAFETY: see above.
        unsafe {
            if bytes.rarely(4) {
                let offset = bytes.number(9).cast_signed();
                device.cmd_draw_indexed(commands, count, instances, first, offset, first_instance);
            } else {
                device.cmd_draw(commands, count, instances, first, first_instance);
            }
        }
    }
}

fn pick<'a, T>(bytes: &mut Bytes<'_>, all: &'a [T]) -> Option<&'a T> {
    (!all.is_empty()).then(|| &all[bytes.below(all.len())])
}

impl Drop for Run {
    fn drop(&mut self) {
        // SAFETY: see above; the device is idle, or lost.
        unsafe {
            let _ = self.device.device_wait_idle();
            for pipeline in &self.pipelines {
                self.device.destroy_pipeline(*pipeline, None);
            }
            for (image, view) in &self.images {
                self.device.destroy_image_view(*view, None);
                self.device.destroy_image(image.handle, None);
                self.device.free_memory(image.memory, None);
            }
            for buffer in &self.buffers {
                self.device.destroy_buffer(buffer.handle, None);
                self.device.free_memory(buffer.memory, None);
            }
            self.device.destroy_query_pool(self.queries, None);
            self.device.destroy_pipeline_layout(self.layout, None);
            self.device.destroy_command_pool(self.pool, None);
            self.device.destroy_device(None);
            self.instance.destroy_instance(None);
        }
    }
}
