//! Gaussians among triangles: draws of a scene on a device of [`triangles`](crate::triangles), to its targets.
//!
//! `unsafe` has the reason that it has there.

use ash::vk;
use gaurast::vk::{
    GaussianCameraGAURAST, PRIMITIVE_TOPOLOGY_GAUSSIAN_LIST_GAURAST,
    PipelineGaussianStateCreateInfoGAURAST,
};

use glam::{DMat3, DVec3};

use crate::contexts::gaussian::{attribute_locations, attributes, scene_bindings};
use crate::contexts::over;
use crate::oracle::{OracleDepthFormat, Stored};
use crate::scenes::SceneBuffers;
use crate::triangles::{Buffer, Commands, Gpu, Output, Picture, Target, TargetOptions};

/// What a [`GaussianPipeline`] is made of. By default nothing is tested, and colours are blended over what is there.
#[derive(Clone)]
pub struct GaussianOptions {
    /// The Gaussian state; its degree and locations are filled in.
    pub state: PipelineGaussianStateCreateInfoGAURAST<'static>,
    /// Depth and stencil tests.
    pub depth_stencil: vk::PipelineDepthStencilStateCreateInfo<'static>,
    /// Which samples are written.
    pub sample_mask: u32,
    /// Blending of each colour attachment; those beyond are blended as the first.
    pub blend: Vec<vk::PipelineColorBlendAttachmentState>,
    /// A logic operation instead of blending.
    pub logic_op: Option<vk::LogicOp>,
    /// Dynamic states beside viewport and scissor.
    pub dynamic: Vec<vk::DynamicState>,
}

impl Default for GaussianOptions {
    fn default() -> Self {
        Self {
            state: PipelineGaussianStateCreateInfoGAURAST::default(),
            depth_stencil: vk::PipelineDepthStencilStateCreateInfo::default(),
            sample_mask: u32::MAX,
            blend: vec![over()],
            logic_op: None,
            dynamic: Vec::new(),
        }
    }
}

/// A pipeline that draws [`GaussianScene`]s to a target.
pub struct GaussianPipeline {
    raw: vk::Pipeline,
    layout: vk::PipelineLayout,
    gpu: Gpu,
}

impl GaussianPipeline {
    /// Creates it, for scenes of a degree.
    ///
    /// # Panics
    /// If the driver refuses it.
    pub fn new(gpu: &Gpu, target: &Target, degree: u32, options: &GaussianOptions) -> Self {
        let bindings = scene_bindings(degree, false);
        let attributes = attributes(degree);
        let vertex_input = vk::PipelineVertexInputStateCreateInfo::default()
            .vertex_binding_descriptions(&bindings)
            .vertex_attribute_descriptions(&attributes);
        let assembly = vk::PipelineInputAssemblyStateCreateInfo::default()
            .topology(PRIMITIVE_TOPOLOGY_GAUSSIAN_LIST_GAURAST);
        let viewport = vk::PipelineViewportStateCreateInfo::default()
            .viewport_count(1)
            .scissor_count(1);
        let raster = vk::PipelineRasterizationStateCreateInfo::default().line_width(1.0);
        let mask = [options.sample_mask];
        let multisample = vk::PipelineMultisampleStateCreateInfo::default()
            .rasterization_samples(vk::SampleCountFlags::from_raw(target.options.samples))
            .sample_mask(&mask);
        let mut blend = options.blend.clone();
        blend.resize(target.colors.len(), options.blend[0]);
        let blend = vk::PipelineColorBlendStateCreateInfo::default()
            .logic_op_enable(options.logic_op.is_some())
            .logic_op(options.logic_op.unwrap_or_default())
            .attachments(&blend);
        let mut dynamic = vec![vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR];
        dynamic.extend(&options.dynamic);
        let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&dynamic);
        let (colors, depth, stencil) = target.formats();
        let mut rendering = vk::PipelineRenderingCreateInfo::default()
            .color_attachment_formats(colors)
            .depth_attachment_format(depth)
            .stencil_attachment_format(stencil);
        let mut state = options
            .state
            .spherical_harmonics_degree(degree)
            .attribute_locations(attribute_locations());
        let info = vk::GraphicsPipelineCreateInfo::default()
            .vertex_input_state(&vertex_input)
            .input_assembly_state(&assembly)
            .viewport_state(&viewport)
            .rasterization_state(&raster)
            .multisample_state(&multisample)
            .depth_stencil_state(&options.depth_stencil)
            .color_blend_state(&blend)
            .dynamic_state(&dynamic)
            .push_next(&mut rendering)
            .push_next(&mut state);
        // SAFETY: see the module.
        unsafe {
            let device = gpu.device();
            let layout = device
                .create_pipeline_layout(&vk::PipelineLayoutCreateInfo::default(), None)
                .expect("a layout");
            let infos = [info.layout(layout)];
            let pipelines = device
                .create_graphics_pipelines(vk::PipelineCache::null(), &infos, None)
                .expect("a pipeline");
            Self {
                raw: pipelines[0],
                layout,
                gpu: gpu.clone(),
            }
        }
    }
}

impl Drop for GaussianPipeline {
    fn drop(&mut self) {
        // SAFETY: see the module.
        unsafe {
            self.gpu.device().destroy_pipeline(self.raw, None);
            self.gpu.device().destroy_pipeline_layout(self.layout, None);
        }
    }
}

/// A scene in vertex buffers.
pub struct GaussianScene {
    buffers: [Buffer; 5],
    count: u32,
}

impl GaussianScene {
    /// Copies `scene` to the device.
    pub fn new(gpu: &Gpu, scene: &SceneBuffers) -> Self {
        Self {
            buffers: [
                Buffer::of(gpu, &scene.positions),
                Buffer::of(gpu, &scene.scales),
                Buffer::of(gpu, &scene.rotations),
                Buffer::of(gpu, &scene.opacities),
                Buffer::of(gpu, &scene.sh),
            ],
            count: scene.positions.len() as u32,
        }
    }

    /// Draws all of it, as seen by `camera`.
    ///
    /// # Panics
    /// If the device doesn't draw Gaussians.
    pub fn draw(
        &self,
        commands: &Commands,
        pipeline: &GaussianPipeline,
        camera: &GaussianCameraGAURAST,
    ) {
        for (binding, buffer) in (0..).zip(&self.buffers) {
            commands.vertex_buffer(binding, buffer, 0);
        }
        let gaussian = commands.gpu().gaussian();
        // SAFETY: see the module.
        unsafe {
            commands.device().cmd_bind_pipeline(
                commands.raw,
                vk::PipelineBindPoint::GRAPHICS,
                pipeline.raw,
            );
            gaussian
                .expect("a device that draws Gaussians")
                .cmd_set_gaussian_cameras(commands.raw, &[*camera]);
        }
        commands.draw(0..self.count);
    }
}

/// Takes points of the world to clip coordinates, so that triangles are seen as Gaussians are.
#[derive(Clone, Copy)]
pub struct ToClip {
    /// A pinhole, whose depth coefficients are those of a perspective projection.
    pub camera: GaussianCameraGAURAST<'static>,
    /// The picture's width and height in pixels.
    pub size: [u32; 2],
}

impl ToClip {
    /// A vertex's position.
    pub fn position(&self, point: DVec3) -> [f32; 4] {
        let camera = &self.camera;
        let rotation = DMat3::from_cols_array(&camera.rotation.map(f64::from)).transpose();
        let t = rotation * (point - DVec3::from(camera.eye));
        let place = |axis: usize, t: f64, z: f64| {
            let (focal, principal) = (camera.focal_length[axis], camera.principal_point[axis]);
            let size = f64::from(self.size[axis]);
            2.0 * (f64::from(focal) * t + f64::from(principal) * z) / size - z
        };
        let [c0, c1] = camera.depth_coefficients.map(f64::from);
        [place(0, t.x, t.z), place(1, t.y, t.z), c0 * t.z + c1, t.z].map(|c| c as f32)
    }
}

/// What a target holds of one sample of each pixel.
#[derive(Clone, Debug, Default)]
pub struct Held {
    /// The first colour attachment, of four 32-bit floats.
    pub color: Vec<[f32; 4]>,
    /// Depths, if any, as numbers of their format; and stencils, of one sample a pixel only.
    pub stored: Stored,
}

/// The format of a target's depth.
///
/// # Panics
/// If it has none.
pub fn depth_format(options: &TargetOptions) -> OracleDepthFormat {
    use vk::Format as F;
    match options.depth {
        Some(F::D16_UNORM | F::D16_UNORM_S8_UINT) => OracleDepthFormat::Unorm(16),
        Some(F::X8_D24_UNORM_PACK32 | F::D24_UNORM_S8_UINT) => OracleDepthFormat::Unorm(24),
        Some(F::D32_SFLOAT | F::D32_SFLOAT_S8_UINT) => OracleDepthFormat::Float,
        other => panic!("{other:?} is no depth format"),
    }
}

/// What a target holds, sample by sample.
///
/// # Panics
/// If its first colour attachment is not of four 32-bit floats.
pub fn held(options: &TargetOptions, output: &Output) -> Vec<Held> {
    let format = depth_format(options);
    let codes = |picture: &Picture| -> Vec<u32> {
        match picture.format {
            vk::Format::D16_UNORM => {
                let texels = picture.texels::<u16>();
                texels.into_iter().map(u32::from).collect()
            }
            vk::Format::X8_D24_UNORM_PACK32 => {
                let texels = picture.texels::<u32>();
                texels.into_iter().map(|texel| texel & 0xFF_FFFF).collect()
            }
            // A depth, or a sample of one that was fetched as a float.
            _ => {
                let texels = picture.texels::<f32>();
                texels
                    .into_iter()
                    .map(|depth| format.code(depth.into()))
                    .collect()
            }
        }
    };
    let find = |name: &str, sample: u32| {
        let name = match options.samples {
            1 => name.to_owned(),
            _ => format!("{name} sample {sample}"),
        };
        output.pictures.iter().find(|picture| picture.name == name)
    };
    (0..options.samples)
        .map(|sample| Held {
            color: find("color 0", sample).map_or_else(Vec::new, Picture::texels),
            stored: Stored {
                depth: find("depth", sample).map_or_else(Vec::new, codes),
                stencil: find("stencil", sample).map_or_else(Vec::new, |p| p.bytes.clone()),
            },
        })
        .collect()
}
