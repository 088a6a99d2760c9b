//! All Vulkan code: a device that presents to a window, its pipelines, and a frame. The end of the process frees the
//! objects, except those that depend on the window's size.

#![cfg_attr(rustfmt, rustfmt_skip)] // A step a line, so that a few screens show everything.

use ash::vk::{self, AccessFlags as Access, ImageLayout as Layout, PipelineStageFlags as Stage};
use gaurast::{gaussian_primitive_topology, vk::*};
use gaurast_scene::{GaussianShape, Scene};
use glam::DMat4;
use winit::raw_window_handle::{HasDisplayHandle, HasWindowHandle};
use winit::window::Window;

/// The result of a function that can fail.
pub type Outcome<T> = Result<T, Box<dyn std::error::Error>>;

const DEPTH: vk::Format = vk::Format::D32_SFLOAT;
/// The first attribute location of the spherical harmonics.
const FIRST_SH: u32 = 4;
const VISIBLE: vk::MemoryPropertyFlags = vk::MemoryPropertyFlags::HOST_VISIBLE;

/// A vertex of a mesh: its position and its normal.
pub type Vertex = [[f32; 3]; 2];

/// The camera of a frame: a view that looks along +z, its projection, and the mesh's model matrix.
pub struct View { pub world_to_view: DMat4, pub projection: DMat4, pub mesh: DMat4 }

/// A pipeline, its vertex buffers, and the number of vertices.
type Draw = (vk::Pipeline, Vec<vk::Buffer>, u32);

/// A swapchain with the objects of its images. A semaphore signals that its image may be presented.
#[derive(Default)]
struct Swapchain {
    raw: vk::SwapchainKHR, size: [u32; 2], is_outdated: bool,
    images: Vec<(vk::Image, vk::ImageView, vk::Semaphore)>,
    depth: (vk::Image, vk::ImageView, vk::DeviceMemory),
}

/// A device, the objects that it draws, and its swapchain.
pub struct Gpu {
    physical: vk::PhysicalDevice, device: ash::Device, queue: vk::Queue, types: vk::PhysicalDeviceMemoryProperties,
    surfaces: ash::khr::surface::Instance, surface: vk::SurfaceKHR,
    swapchains: ash::khr::swapchain::Device, format: vk::SurfaceFormatKHR, mode: vk::PresentModeKHR,
    extension: gaussian_primitive_topology::Device, layout: vk::PipelineLayout,
    /// The mesh, and then the Gaussians.
    draws: Vec<Draw>,
    commands: vk::CommandBuffer, acquired: vk::Semaphore, drawn: vk::Fence, swapchain: Swapchain,
    _instance: ash::Instance, _entry: ash::Entry,
}

// SAFETY of all `unsafe` here: handles are used while they are valid, structures are valid, and commands are in order.
impl Gpu {
    pub fn new(entry: ash::Entry, window: &Window, mode: vk::PresentModeKHR, scene: &Scene, mesh: &[Vertex]) -> Outcome<Self> {
        // SAFETY: see above; the window outlives this.
        unsafe {
            let (display, handle) = (window.display_handle()?.as_raw(), window.window_handle()?.as_raw());
            let app = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_3);
            let extensions = ash_window::enumerate_required_extensions(display)?;
            let info = vk::InstanceCreateInfo::default().application_info(&app).enabled_extension_names(extensions);
            let instance = entry.create_instance(&info, None)?;
            let surface = ash_window::create_surface(&entry, &instance, display, handle, None)?;
            let surfaces = ash::khr::surface::Instance::new(&entry, &instance);
            let has_gaussians = |physical: &vk::PhysicalDevice| {
                let extensions = instance.enumerate_device_extension_properties(*physical).unwrap_or_default();
                extensions.iter().any(|it| it.extension_name_as_c_str() == Ok(gaussian_primitive_topology::NAME))
            };
            let physical = instance.enumerate_physical_devices()?.into_iter().find(has_gaussians)
                .ok_or("no device draws Gaussians")?;
            let queues = [vk::DeviceQueueCreateInfo::default().queue_priorities(&[1.0])];
            let names = [gaussian_primitive_topology::NAME.as_ptr(), ash::khr::swapchain::NAME.as_ptr()];
            let mut topology = PhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST::default();
            let mut all = vk::PhysicalDeviceFeatures2::default().push_next(&mut topology);
            instance.get_physical_device_features2(physical, &mut all);
            // All modes that the device has.
            topology.p_next = std::ptr::null_mut();
            let mut features = vk::PhysicalDeviceVulkan13Features::default().dynamic_rendering(true);
            let info = vk::DeviceCreateInfo::default().queue_create_infos(&queues).enabled_extension_names(&names)
                .push_next(&mut topology).push_next(&mut features);
            let device = instance.create_device(physical, &info, None)?;
            // The colours of 3DGS are meant for the display and are not converted.
            let formats = surfaces.get_physical_device_surface_formats(physical, surface)?;
            let unorm = [vk::Format::B8G8R8A8_UNORM, vk::Format::R8G8B8A8_UNORM];
            let format = formats.into_iter().find(|it| unorm.contains(&it.format)).ok_or("no format for the window")?;
            let ranges = [vk::PushConstantRange::default().stage_flags(vk::ShaderStageFlags::VERTEX).size(64)];
            let layout = device.create_pipeline_layout(&vk::PipelineLayoutCreateInfo::default().push_constant_ranges(&ranges), None)?;
            let reset = vk::CommandPoolCreateFlags::RESET_COMMAND_BUFFER;
            let pool = device.create_command_pool(&vk::CommandPoolCreateInfo::default().flags(reset), None)?;
            let info = vk::CommandBufferAllocateInfo::default().command_pool(pool).command_buffer_count(1);
            let signaled = vk::FenceCreateInfo::default().flags(vk::FenceCreateFlags::SIGNALED);
            let mut gpu = Self {
                physical, surface, format, mode, layout, surfaces,
                commands: device.allocate_command_buffers(&info)?[0],
                acquired: device.create_semaphore(&Default::default(), None)?,
                drawn: device.create_fence(&signaled, None)?,
                swapchains: ash::khr::swapchain::Device::new(&instance, &device),
                extension: gaussian_primitive_topology::Device::new(&instance, &device),
                types: instance.get_physical_device_memory_properties(physical),
                queue: device.get_device_queue(0, 0),
                draws: Vec::new(), swapchain: Swapchain { is_outdated: true, ..Default::default() },
                device, _instance: instance, _entry: entry,
            };
            let parts = [bytemuck::cast_slice(scene.positions()), bytemuck::cast_slice(scene.shapes()), bytemuck::cast_slice(scene.sh())];
            let buffers = parts.iter().map(|bytes| gpu.vertex_buffer(bytes)).collect::<Outcome<_>>()?;
            gpu.draws = vec![
                (gpu.mesh_pipeline()?, vec![gpu.vertex_buffer(bytemuck::cast_slice(mesh))?], mesh.len() as u32),
                (gpu.gaussian_pipeline(scene)?, buffers, scene.len() as u32),
            ];
            Ok(gpu)
        }
    }

    fn allocate(&self, needs: vk::MemoryRequirements, wanted: vk::MemoryPropertyFlags) -> Outcome<vk::DeviceMemory> {
        let index = (0..self.types.memory_type_count).find(|index| {
            let flags = self.types.memory_types[*index as usize].property_flags;
            needs.memory_type_bits & (1 << index) != 0 && flags.contains(wanted)
        });
        let info = vk::MemoryAllocateInfo::default().allocation_size(needs.size)
            .memory_type_index(index.ok_or("no memory for it")?);
        // SAFETY: see above.
        Ok(unsafe { self.device.allocate_memory(&info, None)? })
    }

    /// A vertex buffer in device-local memory, from which draws are faster.
    fn vertex_buffer(&self, bytes: &[u8]) -> Outcome<vk::Buffer> {
        let device = &self.device;
        let create = |usage, wanted| {
            let info = vk::BufferCreateInfo::default().size(bytes.len().max(4) as u64).usage(usage);
            // SAFETY: see above.
            unsafe {
                let buffer = device.create_buffer(&info, None)?;
                let memory = self.allocate(device.get_buffer_memory_requirements(buffer), wanted)?;
                device.bind_buffer_memory(buffer, memory, 0)?;
                Ok::<_, Box<dyn std::error::Error>>((buffer, memory))
            }
        };
        // SAFETY: see above; the host writes before the copy is submitted, and the copy is waited for.
        unsafe {
            let usage = vk::BufferUsageFlags::VERTEX_BUFFER | vk::BufferUsageFlags::TRANSFER_DST;
            let (buffer, _) = create(usage, vk::MemoryPropertyFlags::DEVICE_LOCAL)?;
            let (staging, memory) = create(vk::BufferUsageFlags::TRANSFER_SRC, VISIBLE | vk::MemoryPropertyFlags::HOST_COHERENT)?;
            let mapped = device.map_memory(memory, 0, vk::WHOLE_SIZE, Default::default())?;
            mapped.cast::<u8>().copy_from(bytes.as_ptr(), bytes.len());
            let commands = [self.commands];
            device.begin_command_buffer(commands[0], &Default::default())?;
            device.cmd_copy_buffer(commands[0], staging, buffer, &[vk::BufferCopy::default().size(bytes.len().max(4) as u64)]);
            device.end_command_buffer(commands[0])?;
            device.queue_submit(self.queue, &[vk::SubmitInfo::default().command_buffers(&commands)], vk::Fence::null())?;
            device.queue_wait_idle(self.queue)?;
            device.destroy_buffer(staging, None);
            device.free_memory(memory, None);
            Ok(buffer)
        }
    }

    fn mesh_pipeline(&self) -> Outcome<vk::Pipeline> {
        let bindings = [vk::VertexInputBindingDescription::default().stride(size_of::<Vertex>() as u32)];
        let attributes = [attribute(0, 0, 0), attribute(1, 0, size_of::<[f32; 3]>())];
        let stage = |code: &[u8], stage| {
            let words = ash::util::read_spv(&mut std::io::Cursor::new(code))?;
            // SAFETY: see above.
            let module = unsafe { self.device.create_shader_module(&vk::ShaderModuleCreateInfo::default().code(&words), None)? };
            Ok::<_, Box<dyn std::error::Error>>(vk::PipelineShaderStageCreateInfo::default().stage(stage).module(module).name(c"main"))
        };
        let stages = [stage(include_bytes!("../shaders/mesh.vert.spv"), vk::ShaderStageFlags::VERTEX)?,
            stage(include_bytes!("../shaders/mesh.frag.spv"), vk::ShaderStageFlags::FRAGMENT)?];
        self.pipeline(&bindings, &attributes, vk::PrimitiveTopology::TRIANGLE_LIST, &stages, None)
    }

    fn gaussian_pipeline(&self, scene: &Scene) -> Outcome<vk::Pipeline> {
        let strides = [size_of::<[f32; 3]>(), size_of::<GaussianShape>(), scene.sh_stride() * size_of::<[f32; 3]>()];
        let bindings: Vec<_> = (0..).zip(strides).map(|(binding, stride)| {
            vk::VertexInputBindingDescription::default().binding(binding).stride(stride as u32)
        }).collect();
        let mut attributes = vec![
            attribute(0, 0, 0), attribute(1, 1, std::mem::offset_of!(GaussianShape, scale)),
            attribute(2, 1, std::mem::offset_of!(GaussianShape, rotation)).format(vk::Format::R32G32B32A32_SFLOAT),
            attribute(3, 1, std::mem::offset_of!(GaussianShape, opacity)).format(vk::Format::R32_SFLOAT),
        ];
        let coefficients = (scene.sh_degree() + 1).pow(2);
        attributes.extend((0..coefficients).map(|k| attribute(FIRST_SH + k, 2, k as usize * size_of::<[f32; 3]>())));
        let state = PipelineGaussianStateCreateInfoGAURAST::default().spherical_harmonics_degree(scene.sh_degree())
            .attribute_locations(GaussianAttributeLocationsGAURAST::default()
                .position(0).scale(1).rotation(2).opacity(3).first_spherical_harmonics(FIRST_SH));
        self.pipeline(&bindings, &attributes, PRIMITIVE_TOPOLOGY_GAUSSIAN_LIST_GAURAST, &[], Some(state))
    }

    /// A pipeline with a depth test. Gaussians are blended over the contents and do not write depth.
    fn pipeline(&self, bindings: &[vk::VertexInputBindingDescription], attributes: &[vk::VertexInputAttributeDescription],
        topology: vk::PrimitiveTopology, stages: &[vk::PipelineShaderStageCreateInfo<'_>],
        gaussian: Option<PipelineGaussianStateCreateInfoGAURAST<'_>>) -> Outcome<vk::Pipeline> {
        let is_gaussian = gaussian.is_some();
        let vertices = vk::PipelineVertexInputStateCreateInfo::default()
            .vertex_binding_descriptions(bindings).vertex_attribute_descriptions(attributes);
        let assembly = vk::PipelineInputAssemblyStateCreateInfo::default().topology(topology);
        let viewport = vk::PipelineViewportStateCreateInfo::default().viewport_count(1).scissor_count(1);
        let raster = vk::PipelineRasterizationStateCreateInfo::default().line_width(1.0);
        let samples = vk::PipelineMultisampleStateCreateInfo::default().rasterization_samples(vk::SampleCountFlags::TYPE_1);
        let depth = vk::PipelineDepthStencilStateCreateInfo::default().depth_test_enable(true)
            .depth_write_enable(!is_gaussian).depth_compare_op(vk::CompareOp::LESS);
        let (one, rest) = (vk::BlendFactor::ONE, vk::BlendFactor::ONE_MINUS_SRC_ALPHA);
        let blends = [vk::PipelineColorBlendAttachmentState::default().color_write_mask(vk::ColorComponentFlags::RGBA)
            .blend_enable(is_gaussian).src_color_blend_factor(one).dst_color_blend_factor(rest)
            .src_alpha_blend_factor(one).dst_alpha_blend_factor(rest)];
        let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&blends);
        let dynamic = vk::PipelineDynamicStateCreateInfo::default()
            .dynamic_states(&[vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR]);
        let formats = [self.format.format];
        let mut rendering = vk::PipelineRenderingCreateInfo::default().color_attachment_formats(&formats).depth_attachment_format(DEPTH);
        let mut state = gaussian.unwrap_or_default();
        let mut info = vk::GraphicsPipelineCreateInfo::default().stages(stages).vertex_input_state(&vertices)
            .input_assembly_state(&assembly).viewport_state(&viewport).rasterization_state(&raster).multisample_state(&samples)
            .depth_stencil_state(&depth).color_blend_state(&blend).dynamic_state(&dynamic).layout(self.layout).push_next(&mut rendering);
        if is_gaussian { info = info.push_next(&mut state); }
        // SAFETY: see above.
        let pipelines = unsafe { self.device.create_graphics_pipelines(Default::default(), &[info], None) };
        Ok(pipelines.map_err(|(_, error)| error)?[0])
    }

    fn image_view(&self, image: vk::Image, format: vk::Format, aspect: vk::ImageAspectFlags) -> Outcome<vk::ImageView> {
        let info = vk::ImageViewCreateInfo::default().image(image).view_type(vk::ImageViewType::TYPE_2D)
            .format(format).subresource_range(whole(aspect));
        // SAFETY: see above.
        Ok(unsafe { self.device.create_image_view(&info, None)? })
    }

    /// Creates a swapchain for a window of a size, which replaces the one before.
    fn rebuild(&mut self, [width, height]: [u32; 2]) -> Outcome<()> {
        self.wait()?;
        let (device, old) = (&self.device, std::mem::take(&mut self.swapchain));
        // SAFETY: see above; the old swapchain's objects are no longer used.
        unsafe {
            let can = self.surfaces.get_physical_device_surface_capabilities(self.physical, self.surface)?;
            let extent = match can.current_extent {
                vk::Extent2D { width: u32::MAX, .. } => vk::Extent2D { width, height },
                extent => extent,
            };
            let count = (can.min_image_count + 1).min(if can.max_image_count == 0 { u32::MAX } else { can.max_image_count });
            let info = vk::SwapchainCreateInfoKHR::default().surface(self.surface).min_image_count(count)
                .image_format(self.format.format).image_color_space(self.format.color_space).image_extent(extent)
                .image_array_layers(1).image_usage(vk::ImageUsageFlags::COLOR_ATTACHMENT).pre_transform(can.current_transform)
                .composite_alpha(vk::CompositeAlphaFlagsKHR::OPAQUE).present_mode(self.mode).clipped(true).old_swapchain(old.raw);
            let raw = self.swapchains.create_swapchain(&info, None)?;
            for (_, view, semaphore) in old.images {
                device.destroy_image_view(view, None);
                device.destroy_semaphore(semaphore, None);
            }
            device.destroy_image_view(old.depth.1, None);
            device.destroy_image(old.depth.0, None);
            device.free_memory(old.depth.2, None);
            self.swapchains.destroy_swapchain(old.raw, None);
            let images = self.swapchains.get_swapchain_images(raw)?.into_iter().map(|image| {
                let view = self.image_view(image, self.format.format, vk::ImageAspectFlags::COLOR)?;
                Ok((image, view, device.create_semaphore(&Default::default(), None)?))
            }).collect::<Outcome<_>>()?;
            let info = vk::ImageCreateInfo::default().image_type(vk::ImageType::TYPE_2D).format(DEPTH).extent(extent.into())
                .mip_levels(1).array_layers(1).samples(vk::SampleCountFlags::TYPE_1).usage(vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT);
            let depth = device.create_image(&info, None)?;
            let memory = self.allocate(device.get_image_memory_requirements(depth), vk::MemoryPropertyFlags::DEVICE_LOCAL)?;
            device.bind_image_memory(depth, memory, 0)?;
            let depth = (depth, self.image_view(depth, DEPTH, vk::ImageAspectFlags::DEPTH)?, memory);
            self.swapchain = Swapchain { raw, size: [extent.width, extent.height], images, depth, is_outdated: false };
        }
        Ok(())
    }

    /// Draws and presents a frame to a window of a size.
    pub fn draw(&mut self, size: [u32; 2], view: &View) -> Outcome<()> {
        if self.swapchain.is_outdated || self.swapchain.size != size { self.rebuild(size)?; }
        let (device, chain) = (&self.device, &self.swapchain);
        // SAFETY: see above.
        unsafe {
            device.wait_for_fences(&[self.drawn], true, u64::MAX)?;
            let index = match self.swapchains.acquire_next_image(chain.raw, u64::MAX, self.acquired, vk::Fence::null()) {
                Ok((index, _)) => index,
                // The next frame creates a new swapchain.
                Err(vk::Result::ERROR_OUT_OF_DATE_KHR) => { self.swapchain.is_outdated = true; return Ok(()); }
                Err(error) => return Err(error.into()),
            };
            device.reset_fences(&[self.drawn])?;
            let (image, target, drawn) = chain.images[index as usize];
            self.record(self.commands, image, target, view)?;
            let (waits, stages) = ([self.acquired], [Stage::COLOR_ATTACHMENT_OUTPUT]);
            let (commands, signals) = ([self.commands], [drawn]);
            let submit = vk::SubmitInfo::default().wait_semaphores(&waits).wait_dst_stage_mask(&stages)
                .command_buffers(&commands).signal_semaphores(&signals);
            device.queue_submit(self.queue, &[submit], self.drawn)?;
            let (raws, indices) = ([chain.raw], [index]);
            let info = vk::PresentInfoKHR::default().wait_semaphores(&signals).swapchains(&raws).image_indices(&indices);
            self.swapchain.is_outdated = match self.swapchains.queue_present(self.queue, &info) {
                Ok(is_suboptimal) => is_suboptimal,
                Err(vk::Result::ERROR_OUT_OF_DATE_KHR) => true,
                Err(error) => return Err(error.into()),
            };
        }
        Ok(())
    }

    fn record(&self, c: vk::CommandBuffer, image: vk::Image, target: vk::ImageView, view: &View) -> Outcome<()> {
        let (device, [width, height]) = (&self.device, self.swapchain.size);
        let area = vk::Rect2D::default().extent(vk::Extent2D { width, height });
        let (width, height) = (width as f32, height as f32);
        let (view_matrix, projection) = (view.world_to_view.to_cols_array_2d(), view.projection.to_cols_array_2d());
        let camera = GaussianCameraGAURAST::from_forward_z_view_projection(&view_matrix, &projection, [width, height])?;
        let to_clip = (view.projection * view.world_to_view * view.mesh).as_mat4().to_cols_array();
        let attachment = |view, layout, value| vk::RenderingAttachmentInfo::default().image_view(view).image_layout(layout)
            .load_op(vk::AttachmentLoadOp::CLEAR).store_op(vk::AttachmentStoreOp::STORE).clear_value(value);
        let color = vk::ClearValue { color: vk::ClearColorValue { float32: [0.05, 0.06, 0.08, 1.0] } };
        let far = vk::ClearValue { depth_stencil: vk::ClearDepthStencilValue { depth: 1.0, stencil: 0 } };
        let colors = [attachment(target, Layout::COLOR_ATTACHMENT_OPTIMAL, color)];
        let depth = attachment(self.swapchain.depth.1, Layout::DEPTH_ATTACHMENT_OPTIMAL, far).store_op(vk::AttachmentStoreOp::DONT_CARE);
        let info = vk::RenderingInfo::default().render_area(area).layer_count(1).color_attachments(&colors).depth_attachment(&depth);
        let begin = vk::ImageMemoryBarrier::default().image(image).subresource_range(whole(vk::ImageAspectFlags::COLOR))
            .new_layout(Layout::COLOR_ATTACHMENT_OPTIMAL).dst_access_mask(Access::COLOR_ATTACHMENT_WRITE);
        let end = begin.old_layout(Layout::COLOR_ATTACHMENT_OPTIMAL).src_access_mask(Access::COLOR_ATTACHMENT_WRITE)
            .new_layout(Layout::PRESENT_SRC_KHR).dst_access_mask(Access::empty());
        let tests = Stage::EARLY_FRAGMENT_TESTS | Stage::LATE_FRAGMENT_TESTS;
        let begin_depth = vk::ImageMemoryBarrier::default().image(self.swapchain.depth.0).subresource_range(whole(vk::ImageAspectFlags::DEPTH))
            .new_layout(Layout::DEPTH_ATTACHMENT_OPTIMAL).src_access_mask(Access::DEPTH_STENCIL_ATTACHMENT_WRITE)
            .dst_access_mask(Access::DEPTH_STENCIL_ATTACHMENT_WRITE | Access::DEPTH_STENCIL_ATTACHMENT_READ);
        let (drawn, no) = (Stage::COLOR_ATTACHMENT_OUTPUT, vk::DependencyFlags::empty());
        // SAFETY: see above.
        unsafe {
            device.begin_command_buffer(c, &Default::default())?;
            device.cmd_pipeline_barrier(c, drawn | tests, drawn | tests, no, &[], &[], &[begin, begin_depth]);
            device.cmd_begin_rendering(c, &info);
            device.cmd_set_viewport(c, 0, &[vk::Viewport::default().width(width).height(height).max_depth(1.0)]);
            device.cmd_set_scissor(c, 0, &[area]);
            self.extension.cmd_set_gaussian_cameras(c, &[camera]);
            device.cmd_push_constants(c, self.layout, vk::ShaderStageFlags::VERTEX, 0, bytemuck::bytes_of(&to_clip));
            for (pipeline, buffers, count) in &self.draws {
                device.cmd_bind_pipeline(c, vk::PipelineBindPoint::GRAPHICS, *pipeline);
                device.cmd_bind_vertex_buffers(c, 0, buffers, &[0; 3][..buffers.len()]);
                device.cmd_draw(c, *count, 1, 0, 0);
            }
            device.cmd_end_rendering(c);
            device.cmd_pipeline_barrier(c, drawn, Stage::BOTTOM_OF_PIPE, no, &[], &[], &[end]);
            Ok(device.end_command_buffer(c)?)
        }
    }

    /// Waits until everything is drawn.
    pub fn wait(&self) -> Outcome<()> {
        // SAFETY: see above.
        Ok(unsafe { self.device.device_wait_idle() }?)
    }
}

impl Drop for Gpu {
    fn drop(&mut self) {
        // The window is destroyed after this, so nothing may be presented to it later.
        // SAFETY: see above.
        unsafe {
            let _ = self.device.device_wait_idle();
            self.swapchains.destroy_swapchain(self.swapchain.raw, None);
            self.surfaces.destroy_surface(self.surface, None);
        }
    }
}

fn attribute(location: u32, binding: u32, offset: usize) -> vk::VertexInputAttributeDescription {
    vk::VertexInputAttributeDescription { location, binding, format: vk::Format::R32G32B32_SFLOAT, offset: offset as u32 }
}

fn whole(aspect: vk::ImageAspectFlags) -> vk::ImageSubresourceRange {
    vk::ImageSubresourceRange::default().aspect_mask(aspect).level_count(1).layer_count(1)
}
