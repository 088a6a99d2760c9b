//! Execution of a [`Draw`] on a device: its pipeline, its buffers, its commands, and the final contents of the
//! attachments.

use ash::vk;
use gaurast::vk::{
    GaussianAttributeLocationsGAURAST, GaussianCameraDataGAURAST, GaussianCameraSourceGAURAST,
    GaussianResolveInputLocationsGAURAST, PRIMITIVE_TOPOLOGY_GAUSSIAN_LIST_GAURAST,
    PipelineGaussianApproximationStateCreateInfoGAURAST,
};
use gaurast_oracle::oracle::Stored;
use half::f16;

use crate::device::{Buffer, Device, Error, Image, Scope, whole};
use crate::draw::{Blend, Call, ColorFormat, Draw, Shown};
use crate::implementation::Picture;

/// Vertex buffers of a scene: positions, scales, rotations, opacities, coefficients.
const BINDINGS: u32 = 5;

/// The first location of instance attributes, after those of degree 3.
const MODEL_MATRIX: u32 = 20;
const MODEL_OPACITY: u32 = 23;

/// Draws on a device.
///
/// # Errors
/// If a command fails.
pub fn record(device: &Device, draw: &Draw, stored: &Stored) -> Result<Picture, Error> {
    let scope = Scope::new(device);
    let targets = Targets::new(&scope, draw, stored)?;
    let (pipeline, layout) = pipeline(&scope, draw)?;
    let scene = scene_buffers(&scope, draw)?;
    let indices = scope.buffer_of(&draw.indices)?;
    let parameters: Vec<[u32; 4]> = (draw.calls.iter())
        .map(|call| match *call {
            Call::Indirect {
                vertices: [first, count],
            } => [count, 1, first, 0],
            _ => [0; 4],
        })
        .collect();
    let parameters = scope.buffer_of(&parameters)?;
    let camera = match layout.sets {
        Some(set) => Some((camera_set(&scope, draw, set)?, layout.raw)),
        None => None,
    };
    let raw = &device.raw;
    device.run(|commands| {
        targets.begin(&scope, draw, commands);
        // SAFETY: see `device`.
        unsafe {
            raw.cmd_bind_pipeline(commands, vk::PipelineBindPoint::GRAPHICS, pipeline);
            raw.cmd_set_viewport(commands, 0, &[draw.viewport()]);
            raw.cmd_set_scissor(commands, 0, &[scissor(draw)]);
            let buffers: Vec<vk::Buffer> = scene.iter().map(|buffer| buffer.raw).collect();
            raw.cmd_bind_vertex_buffers(commands, 0, &buffers, &vec![0; buffers.len()]);
            raw.cmd_bind_index_buffer(commands, indices.raw, 0, vk::IndexType::UINT32);
            match camera {
                Some((set, layout)) => raw.cmd_bind_descriptor_sets(
                    commands,
                    vk::PipelineBindPoint::GRAPHICS,
                    layout,
                    0,
                    &[set],
                    &[],
                ),
                None => device
                    .gaussian
                    .cmd_set_gaussian_cameras(commands, &[draw.camera]),
            }
            if draw.merged {
                device.gaussian.cmd_begin_gaussian_set(commands);
            }
            for (number, call) in draw.calls.iter().enumerate() {
                match *call {
                    Call::Draw {
                        vertices,
                        instances,
                    } => raw.cmd_draw(
                        commands,
                        vertices[1],
                        instances[1],
                        vertices[0],
                        instances[0],
                    ),
                    Call::Indexed {
                        indices: [first, count],
                        offset,
                    } => {
                        raw.cmd_draw_indexed(commands, count, 1, first, offset, 0);
                    }
                    Call::Indirect { .. } => {
                        raw.cmd_draw_indirect(commands, parameters.raw, 16 * number as u64, 1, 16);
                    }
                    Call::EndSet if draw.merged => {
                        device.gaussian.cmd_end_gaussian_set(commands);
                        device.gaussian.cmd_begin_gaussian_set(commands);
                    }
                    // Each call is a separate set.
                    Call::EndSet => {}
                }
            }
            if draw.merged {
                device.gaussian.cmd_end_gaussian_set(commands);
            }
            raw.cmd_end_rendering(commands);
        }
        targets.copy(&scope, draw, commands);
    })?;
    Ok(targets.read(&scope, draw))
}

fn scissor(draw: &Draw) -> vk::Rect2D {
    draw.scissor.unwrap_or_else(|| everything(draw))
}

fn everything(draw: &Draw) -> vk::Rect2D {
    let [width, height] = draw.size;
    vk::Rect2D::default().extent(vk::Extent2D { width, height })
}

/// The attachments, and the buffers that they are copied from and to.
struct Targets {
    color: Image,
    resolved: Option<Image>,
    depth: Option<Image>,
    texels: Buffer,
    depths: Buffer,
    stencils: Buffer,
}

impl Targets {
    fn new(scope: &Scope<'_>, draw: &Draw, stored: &Stored) -> Result<Self, Error> {
        use vk::ImageAspectFlags as Aspect;
        let pixels = u64::from(draw.size[0] * draw.size[1]);
        let format = draw.format.raw();
        let aspect = |depth: &crate::draw::Depth| match depth.has_stencil() {
            true => Aspect::DEPTH | Aspect::STENCIL,
            false => Aspect::DEPTH,
        };
        let depths = match draw.depth.as_ref().map(|depth| depth.texel()) {
            Some(2) => {
                let codes: Vec<u16> = stored.depth.iter().map(|&code| code as u16).collect();
                scope.buffer_of(&codes)?
            }
            _ => scope.buffer_of(&stored.depth)?,
        };
        Ok(Self {
            color: scope.image(format, draw.size, draw.samples, Aspect::COLOR)?,
            resolved: match draw.samples {
                1 => None,
                _ => Some(scope.image(format, draw.size, 1, Aspect::COLOR)?),
            },
            depth: match &draw.depth {
                Some(d) => Some(scope.image(d.format, draw.size, draw.samples, aspect(d))?),
                None => None,
            },
            texels: scope.buffer(pixels * draw.format.texel())?,
            depths,
            stencils: scope.buffer_of(&stored.stencil)?,
        })
    }

    /// Fills the attachments and begins rendering.
    fn begin(&self, scope: &Scope<'_>, draw: &Draw, commands: vk::CommandBuffer) {
        use vk::ImageLayout as Layout;
        let device = &scope.device.raw;
        let color_clear = vk::ClearColorValue {
            float32: draw.behind,
        };
        let images = [Some(self.color), self.resolved, self.depth];
        for image in images.iter().flatten() {
            barrier(device, commands, image, Layout::UNDEFINED);
        }
        // SAFETY: see `device`.
        unsafe {
            let color = [whole(self.color.aspect)];
            device.cmd_clear_color_image(
                commands,
                self.color.raw,
                Layout::GENERAL,
                &color_clear,
                &color,
            );
            if let Some(image) = self.depth {
                if draw.samples == 1 {
                    for (buffer, region) in self.planes(draw) {
                        device.cmd_copy_buffer_to_image(
                            commands,
                            buffer.raw,
                            image.raw,
                            Layout::GENERAL,
                            &[region],
                        );
                    }
                } else {
                    // Images of several samples cannot be copied to, so they are cleared to the far plane.
                    let clear = vk::ClearDepthStencilValue {
                        depth: 1.0,
                        stencil: 0,
                    };
                    let ranges = [whole(image.aspect)];
                    device.cmd_clear_depth_stencil_image(
                        commands,
                        image.raw,
                        Layout::GENERAL,
                        &clear,
                        &ranges,
                    );
                }
            }
        }
        for image in images.iter().flatten() {
            barrier(device, commands, image, Layout::GENERAL);
        }
        let attachment = |image: &Image| {
            vk::RenderingAttachmentInfo::default()
                .image_view(image.view)
                .image_layout(Layout::GENERAL)
                .load_op(vk::AttachmentLoadOp::LOAD)
                .store_op(vk::AttachmentStoreOp::STORE)
        };
        let mut color = attachment(&self.color);
        if let Some(resolved) = &self.resolved {
            color = color
                .resolve_mode(vk::ResolveModeFlags::AVERAGE)
                .resolve_image_view(resolved.view)
                .resolve_image_layout(Layout::GENERAL);
        }
        let colors = [color];
        let depth = self.depth.as_ref().map(attachment);
        let mut rendering = vk::RenderingInfo::default()
            .render_area(draw.area.unwrap_or_else(|| everything(draw)))
            .layer_count(1)
            .color_attachments(&colors);
        if let (Some(attachment), Some(depth)) = (&depth, &draw.depth) {
            rendering = rendering.depth_attachment(attachment);
            if depth.has_stencil() {
                rendering = rendering.stencil_attachment(attachment);
            }
        }
        // SAFETY: see `device`.
        unsafe { device.cmd_begin_rendering(commands, &rendering) };
    }

    /// The buffers of depths and stencils, and the copies between them and the image.
    fn planes(&self, draw: &Draw) -> Vec<(Buffer, vk::BufferImageCopy)> {
        use vk::ImageAspectFlags as Aspect;
        let mut planes = vec![(self.depths, region(draw, Aspect::DEPTH))];
        if draw.depth.as_ref().is_some_and(|depth| depth.has_stencil()) {
            planes.push((self.stencils, region(draw, Aspect::STENCIL)));
        }
        planes
    }

    /// Copies the attachments to buffers.
    fn copy(&self, scope: &Scope<'_>, draw: &Draw, commands: vk::CommandBuffer) {
        use vk::ImageLayout as Layout;
        let device = &scope.device.raw;
        let color = self.resolved.unwrap_or(self.color);
        let mut copies = vec![(color, self.texels, region(draw, color.aspect))];
        if let Some(image) = self.depth.filter(|_| draw.samples == 1) {
            let planes = self.planes(draw);
            copies.extend(
                planes
                    .into_iter()
                    .map(|(buffer, region)| (image, buffer, region)),
            );
        }
        for (image, buffer, region) in copies {
            barrier(device, commands, &image, Layout::GENERAL);
            // SAFETY: see `device`.
            unsafe {
                device.cmd_copy_image_to_buffer(
                    commands,
                    image.raw,
                    Layout::GENERAL,
                    buffer.raw,
                    &[region],
                );
            }
        }
        let to_host = [vk::MemoryBarrier::default()
            .src_access_mask(vk::AccessFlags::TRANSFER_WRITE)
            .dst_access_mask(vk::AccessFlags::HOST_READ)];
        // SAFETY: see `device`.
        unsafe {
            device.cmd_pipeline_barrier(
                commands,
                vk::PipelineStageFlags::TRANSFER,
                vk::PipelineStageFlags::HOST,
                vk::DependencyFlags::empty(),
                &to_host,
                &[],
                &[],
            );
        }
    }

    fn read(&self, scope: &Scope<'_>, draw: &Draw) -> Picture {
        let pixels = (draw.size[0] * draw.size[1]) as usize;
        let color = match draw.format {
            ColorFormat::Float32 => scope.read(&self.texels, pixels),
            ColorFormat::Float16 => {
                let texels: Vec<[u16; 4]> = scope.read(&self.texels, pixels);
                texels
                    .into_iter()
                    .map(|texel| texel.map(|bits| f16::from_bits(bits).to_f32()))
                    .collect()
            }
            ColorFormat::Unorm8 => {
                let texels: Vec<[u8; 4]> = scope.read(&self.texels, pixels);
                texels
                    .into_iter()
                    .map(|texel| texel.map(|byte| f32::from(byte) / 255.0))
                    .collect()
            }
        };
        let mut stored = Stored::default();
        if let Some(depth) = draw.depth.as_ref().filter(|_| draw.samples == 1) {
            stored.depth = match depth.texel() {
                2 => scope
                    .read::<u16>(&self.depths, pixels)
                    .into_iter()
                    .map(u32::from)
                    .collect(),
                _ => scope.read(&self.depths, pixels),
            };
            if depth.format == vk::Format::X8_D24_UNORM_PACK32 {
                stored.depth.iter_mut().for_each(|code| *code &= 0xff_ffff);
            }
            if depth.has_stencil() {
                stored.stencil = scope.read(&self.stencils, pixels);
            }
        }
        Picture { color, stored }
    }
}

fn region(draw: &Draw, aspect: vk::ImageAspectFlags) -> vk::BufferImageCopy {
    let [width, height] = draw.size;
    let layers = vk::ImageSubresourceLayers::default()
        .aspect_mask(aspect)
        .layer_count(1);
    vk::BufferImageCopy::default()
        .image_subresource(layers)
        .image_extent(vk::Extent3D {
            width,
            height,
            depth: 1,
        })
}

/// Records a barrier on an image: all later accesses wait for all earlier ones.
fn barrier(
    device: &ash::Device,
    commands: vk::CommandBuffer,
    image: &Image,
    from: vk::ImageLayout,
) {
    let access = vk::AccessFlags::MEMORY_READ | vk::AccessFlags::MEMORY_WRITE;
    let barriers = [vk::ImageMemoryBarrier::default()
        .src_access_mask(access)
        .dst_access_mask(access)
        .old_layout(from)
        .new_layout(vk::ImageLayout::GENERAL)
        .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .image(image.raw)
        .subresource_range(whole(image.aspect))];
    let all = vk::PipelineStageFlags::ALL_COMMANDS;
    // SAFETY: see `device`.
    unsafe {
        device.cmd_pipeline_barrier(
            commands,
            all,
            all,
            vk::DependencyFlags::empty(),
            &[],
            &[],
            &barriers,
        );
    }
}

/// The vertex buffers.
fn scene_buffers(scope: &Scope<'_>, draw: &Draw) -> Result<Vec<Buffer>, Error> {
    let scene = &draw.scene;
    let mut buffers = if draw.half {
        let halves = |values: &[f32]| -> Vec<u16> {
            values
                .iter()
                .map(|&value| f16::from_f32(value).to_bits())
                .collect()
        };
        let triples = |triples: &[[f32; 3]]| {
            let padded: Vec<[f32; 4]> = triples.iter().map(|&[x, y, z]| [x, y, z, 0.0]).collect();
            scope.buffer_of(&halves(padded.as_flattened()))
        };
        vec![
            triples(&scene.positions)?,
            triples(&scene.scales)?,
            scope.buffer_of(&halves(scene.rotations.as_flattened()))?,
            scope.buffer_of(&halves(&scene.opacities))?,
            triples(&scene.sh)?,
        ]
    } else {
        vec![
            scope.buffer_of(&scene.positions)?,
            scope.buffer_of(&scene.scales)?,
            scope.buffer_of(&scene.rotations)?,
            scope.buffer_of(&scene.opacities)?,
            scope.buffer_of(&scene.sh)?,
        ]
    };
    if let Some((_, instances)) = &draw.instances {
        let flat: Vec<f32> = (instances.iter())
            .flat_map(|instance| {
                instance
                    .matrix
                    .into_iter()
                    .flatten()
                    .chain([instance.opacity])
            })
            .collect();
        buffers.push(scope.buffer_of(&flat)?);
    }
    Ok(buffers)
}

/// A descriptor set with the camera's uniform buffer.
fn camera_set(
    scope: &Scope<'_>,
    draw: &Draw,
    set_layout: vk::DescriptorSetLayout,
) -> Result<vk::DescriptorSet, Error> {
    let data = GaussianCameraDataGAURAST::from(&draw.camera);
    let mut words = [0_u32; 32];
    let eye = data.eye.map(f64::to_bits);
    for (pair, bits) in words.chunks_exact_mut(2).zip(eye) {
        pair.copy_from_slice(&[bits as u32, (bits >> 32) as u32]);
    }
    words[6] = data.model.as_raw() as u32;
    let floats = data.rotation.into_iter().flatten();
    let floats = floats
        .chain(data.focal_length)
        .chain(data.principal_point)
        .chain(data.depth_coefficients)
        .chain([data.near_plane, data.far_plane]);
    for (word, float) in words[8..].iter_mut().zip(floats) {
        *word = float.to_bits();
    }
    let buffer = scope.buffer_of(&words)?;
    let device = &scope.device.raw;
    let sizes = [vk::DescriptorPoolSize::default()
        .ty(vk::DescriptorType::UNIFORM_BUFFER)
        .descriptor_count(1)];
    let pool_info = vk::DescriptorPoolCreateInfo::default()
        .max_sets(1)
        .pool_sizes(&sizes);
    // SAFETY: see `device`.
    unsafe {
        let pool = device.create_descriptor_pool(&pool_info, None)?;
        scope.later(move |device| device.destroy_descriptor_pool(pool, None));
        let layouts = [set_layout];
        let allocate_info = vk::DescriptorSetAllocateInfo::default()
            .descriptor_pool(pool)
            .set_layouts(&layouts);
        let sets = device.allocate_descriptor_sets(&allocate_info)?;
        let buffers = [vk::DescriptorBufferInfo::default()
            .buffer(buffer.raw)
            .range(vk::WHOLE_SIZE)];
        let writes = [vk::WriteDescriptorSet::default()
            .dst_set(sets[0])
            .descriptor_type(vk::DescriptorType::UNIFORM_BUFFER)
            .buffer_info(&buffers)];
        device.update_descriptor_sets(&writes, &[]);
        Ok(sets[0])
    }
}

/// A pipeline layout, and the layout of the camera's descriptor set.
struct Layout {
    raw: vk::PipelineLayout,
    sets: Option<vk::DescriptorSetLayout>,
}

fn layout(scope: &Scope<'_>, draw: &Draw) -> Result<Layout, Error> {
    let device = &scope.device.raw;
    // SAFETY: see `device`.
    unsafe {
        let mut sets = None;
        if draw.camera_in_buffer {
            let bindings = [vk::DescriptorSetLayoutBinding::default()
                .descriptor_type(vk::DescriptorType::UNIFORM_BUFFER)
                .descriptor_count(1)
                .stage_flags(vk::ShaderStageFlags::VERTEX)];
            let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
            let set = device.create_descriptor_set_layout(&info, None)?;
            scope.later(move |device| device.destroy_descriptor_set_layout(set, None));
            sets = Some(set);
        }
        let info = vk::PipelineLayoutCreateInfo::default().set_layouts(sets.as_slice());
        let raw = device.create_pipeline_layout(&info, None)?;
        scope.later(move |device| device.destroy_pipeline_layout(raw, None));
        Ok(Layout { raw, sets })
    }
}

fn pipeline(scope: &Scope<'_>, draw: &Draw) -> Result<(vk::Pipeline, Layout), Error> {
    let layout = layout(scope, draw)?;
    let (bindings, attributes) = vertex_input(draw);
    let vertex_input = vk::PipelineVertexInputStateCreateInfo::default()
        .vertex_binding_descriptions(&bindings)
        .vertex_attribute_descriptions(&attributes);
    let assembly = vk::PipelineInputAssemblyStateCreateInfo::default()
        .topology(PRIMITIVE_TOPOLOGY_GAUSSIAN_LIST_GAURAST);
    let viewport = vk::PipelineViewportStateCreateInfo::default()
        .viewport_count(1)
        .scissor_count(1);
    let rasterization = vk::PipelineRasterizationStateCreateInfo::default().line_width(1.0);
    let mask = [draw.sample_mask];
    let multisample = vk::PipelineMultisampleStateCreateInfo::default()
        .rasterization_samples(vk::SampleCountFlags::from_raw(draw.samples))
        .sample_mask(&mask);
    let blends = [blend(draw)];
    let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&blends);
    let dynamic_states = [vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR];
    let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&dynamic_states);
    let depth_stencil = depth_stencil(draw);
    let formats = [draw.format.raw()];
    let mut rendering =
        vk::PipelineRenderingCreateInfo::default().color_attachment_formats(&formats);
    if let Some(depth) = &draw.depth {
        rendering = rendering.depth_attachment_format(depth.format);
        if depth.has_stencil() {
            rendering = rendering.stencil_attachment_format(depth.format);
        }
    }
    let mut locations = GaussianAttributeLocationsGAURAST::default()
        .position(0)
        .scale(1)
        .rotation(2)
        .opacity(3)
        .first_spherical_harmonics(4);
    if draw.instances.is_some() {
        locations = locations
            .first_model_matrix(MODEL_MATRIX)
            .model_opacity(MODEL_OPACITY);
    }
    let mut state = draw
        .state
        .spherical_harmonics_degree(draw.degree)
        .attribute_locations(locations);
    if draw.camera_in_buffer {
        state = state.camera_source(GaussianCameraSourceGAURAST::UNIFORM_BUFFER);
    }
    let [error, budget] = draw.approximation.unwrap_or_default();
    if draw.shown.is_some() {
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
    let resolve = draw.shown.map(|shown| ResolveShader::new(scope, shown));
    let resolve = resolve.transpose()?;
    let specialization = resolve.as_ref().map(ResolveShader::specialization);
    let stages: Vec<_> = (resolve.iter().zip(&specialization))
        .map(|(shader, specialization)| shader.stage(specialization))
        .collect();
    let mut footprint = draw.footprint.unwrap_or_default();
    let mut approximation = PipelineGaussianApproximationStateCreateInfoGAURAST::default()
        .exponential_error(error)
        .contribution_budget(budget);
    let mut info = vk::GraphicsPipelineCreateInfo::default()
        .stages(&stages)
        .vertex_input_state(&vertex_input)
        .input_assembly_state(&assembly)
        .viewport_state(&viewport)
        .rasterization_state(&rasterization)
        .multisample_state(&multisample)
        .depth_stencil_state(&depth_stencil)
        .color_blend_state(&blend)
        .dynamic_state(&dynamic)
        .layout(layout.raw)
        .push_next(&mut rendering)
        .push_next(&mut state);
    if draw.approximation.is_some() {
        info = info.push_next(&mut approximation);
    }
    if draw.footprint.is_some() {
        info = info.push_next(&mut footprint);
    }
    let device = &scope.device.raw;
    // SAFETY: see `device`.
    unsafe {
        let made = device.create_graphics_pipelines(vk::PipelineCache::null(), &[info], None);
        let pipeline = made.map_err(|(_, result)| Error::from(result))?[0];
        scope.later(move |device| device.destroy_pipeline(pipeline, None));
        Ok((pipeline, layout))
    }
}

/// The resolve shader that shows some of its inputs.
struct ResolveShader {
    module: vk::ShaderModule,
    /// The bytes of its constant.
    number: [u8; 4],
    entries: [vk::SpecializationMapEntry; 1],
}

impl ResolveShader {
    fn new(scope: &Scope<'_>, shown: Shown) -> Result<Self, Error> {
        let words: Vec<u32> = include_bytes!("../shaders/shown.frag.spv")
            .chunks_exact(4)
            .map(|word| u32::from_le_bytes([word[0], word[1], word[2], word[3]]))
            .collect();
        let info = vk::ShaderModuleCreateInfo::default().code(&words);
        // SAFETY: see `device`; the code is a fragment shader of SPIR-V.
        let module = unsafe { scope.device.raw.create_shader_module(&info, None)? };
        // SAFETY: see `device`.
        scope.later(move |device| unsafe { device.destroy_shader_module(module, None) });
        Ok(Self {
            module,
            number: shown.number().to_ne_bytes(),
            entries: [vk::SpecializationMapEntry::default().size(4)],
        })
    }

    fn specialization(&self) -> vk::SpecializationInfo<'_> {
        vk::SpecializationInfo::default()
            .map_entries(&self.entries)
            .data(&self.number)
    }

    fn stage<'a>(
        &self,
        specialization: &'a vk::SpecializationInfo<'a>,
    ) -> vk::PipelineShaderStageCreateInfo<'a> {
        vk::PipelineShaderStageCreateInfo::default()
            .stage(vk::ShaderStageFlags::FRAGMENT)
            .module(self.module)
            .name(c"main")
            .specialization_info(specialization)
    }
}

fn blend(draw: &Draw) -> vk::PipelineColorBlendAttachmentState {
    use vk::BlendFactor as Factor;
    let (source, destination) = match draw.blend {
        Blend::Over => (Factor::ONE, Factor::ONE_MINUS_SRC_ALPHA),
        Blend::Add => (Factor::ONE, Factor::ONE),
        Blend::Under => (Factor::ONE_MINUS_DST_ALPHA, Factor::ONE),
        Blend::Replace => (Factor::ONE, Factor::ZERO),
    };
    vk::PipelineColorBlendAttachmentState::default()
        .color_write_mask(draw.write_mask)
        .blend_enable(draw.blend != Blend::Replace)
        .src_color_blend_factor(source)
        .dst_color_blend_factor(destination)
        .src_alpha_blend_factor(source)
        .dst_alpha_blend_factor(destination)
}

fn depth_stencil(draw: &Draw) -> vk::PipelineDepthStencilStateCreateInfo<'static> {
    let mut state = vk::PipelineDepthStencilStateCreateInfo::default();
    let Some(depth) = &draw.depth else {
        return state;
    };
    if let Some((op, write)) = depth.test {
        state = state
            .depth_test_enable(true)
            .depth_compare_op(op)
            .depth_write_enable(write);
    }
    if let Some([least, greatest]) = depth.bounds {
        state = state
            .depth_bounds_test_enable(true)
            .min_depth_bounds(least)
            .max_depth_bounds(greatest);
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

type VertexInput = (
    Vec<vk::VertexInputBindingDescription>,
    Vec<vk::VertexInputAttributeDescription>,
);

fn vertex_input(draw: &Draw) -> VertexInput {
    let triples = (draw.scene.degree + 1).pow(2);
    let triple = if draw.half { 8 } else { 12 };
    let strides = match draw.half {
        true => [8, 8, 8, 2, 8 * triples],
        false => [12, 12, 16, 4, 12 * triples],
    };
    let mut bindings: Vec<_> = (0..BINDINGS)
        .zip(strides)
        .map(|(binding, stride)| vk::VertexInputBindingDescription {
            binding,
            stride,
            input_rate: vk::VertexInputRate::VERTEX,
        })
        .collect();
    let (three, four, one) = match draw.half {
        true => (
            vk::Format::R16G16B16A16_SFLOAT,
            vk::Format::R16G16B16A16_SFLOAT,
            vk::Format::R16_SFLOAT,
        ),
        false => (
            vk::Format::R32G32B32_SFLOAT,
            vk::Format::R32G32B32A32_SFLOAT,
            vk::Format::R32_SFLOAT,
        ),
    };
    let attribute = |location, binding, format, offset| vk::VertexInputAttributeDescription {
        location,
        binding,
        format,
        offset,
    };
    let mut attributes = vec![
        attribute(0, 0, three, 0),
        attribute(1, 1, three, 0),
        attribute(2, 2, four, 0),
        attribute(3, 3, one, 0),
    ];
    let drawn = (draw.degree + 1).pow(2);
    attributes.extend((0..drawn).map(|k| attribute(4 + k, 4, three, triple * k)));
    if let Some((input_rate, _)) = draw.instances {
        bindings.push(vk::VertexInputBindingDescription {
            binding: BINDINGS,
            stride: 52,
            input_rate,
        });
        let row = vk::Format::R32G32B32A32_SFLOAT;
        attributes.extend((0..3).map(|at| attribute(MODEL_MATRIX + at, BINDINGS, row, 16 * at)));
        attributes.push(attribute(
            MODEL_OPACITY,
            BINDINGS,
            vk::Format::R32_SFLOAT,
            48,
        ));
    }
    (bindings, attributes)
}
