//! Vertex streams, pipelines and pictures with layers, on a device with all features.
//!
//! The safety of `unsafe` is explained in `gaurast_testkit`.

use ash::vk;
use gaurast::gaussian_primitive_topology;
use gaurast::vk::{
    GaussianAttributeLocationsGAURAST, PRIMITIVE_TOPOLOGY_GAUSSIAN_LIST_GAURAST,
    PipelineGaussianApproximationStateCreateInfoGAURAST, PipelineGaussianStateCreateInfoGAURAST,
};
use gaurast_testkit::devices::own;
use gaurast_testkit::shader::{Stage, compile};
use gaurast_testkit::{Bindings, Buffer, Commands, Gpu, Graphics, Image, ImageOptions, Shader};
use gaurast_tests::scenes::SceneBuffers;

pub type State = PipelineGaussianStateCreateInfoGAURAST<'static>;

/// The width and height of all pictures.
pub const SIZE: [u32; 2] = [131, 97];

/// A vertex buffer and the attributes in it.
pub struct Stream {
    buffer: Buffer,
    stride: u32,
    rate: vk::VertexInputRate,
    /// Locations, formats and offsets.
    attributes: Vec<(u32, vk::Format, u32)>,
}

impl Stream {
    /// A buffer of one attribute that advances by vertex and is tightly packed.
    pub fn new<T: bytemuck::Pod>(location: u32, format: vk::Format, elements: &[T]) -> Self {
        Self {
            buffer: Buffer::of(own(), elements),
            stride: size_of::<T>() as u32,
            rate: vk::VertexInputRate::VERTEX,
            attributes: vec![(location, format, 0)],
        }
    }

    /// A buffer of matrix rows and a number that advances by instance, at four locations.
    pub fn of_instances(location: u32, instances: &[[f32; 13]]) -> Self {
        let four = vk::Format::R32G32B32A32_SFLOAT;
        Self {
            rate: vk::VertexInputRate::INSTANCE,
            attributes: vec![
                (location, four, 0),
                (location + 1, four, 16),
                (location + 2, four, 32),
                (location + 3, vk::Format::R32_SFLOAT, 48),
            ],
            ..Self::new(location, four, instances)
        }
    }

    /// The attributes of a scene: position, scale, rotation, opacity, harmonics, starting at location 0.
    pub fn of(scene: &SceneBuffers) -> Vec<Self> {
        let triple = vk::Format::R32G32B32_SFLOAT;
        let count = (scene.degree + 1).pow(2);
        vec![
            Self::new(0, triple, &scene.positions),
            Self::new(1, triple, &scene.scales),
            Self::new(2, vk::Format::R32G32B32A32_SFLOAT, &scene.rotations),
            Self::new(3, vk::Format::R32_SFLOAT, &scene.opacities),
            Self {
                buffer: Buffer::of(own(), &scene.sh),
                stride: 12 * count,
                rate: vk::VertexInputRate::VERTEX,
                attributes: (0..count).map(|k| (4 + k, triple, 12 * k)).collect(),
            },
        ]
    }
}

/// The locations of [`Stream::of`].
pub fn locations() -> GaussianAttributeLocationsGAURAST {
    GaussianAttributeLocationsGAURAST::default()
        .position(0)
        .scale(1)
        .rotation(2)
        .opacity(3)
        .first_spherical_harmonics(4)
}

/// The options of a [`Pipeline`].
#[derive(Clone)]
pub struct Options<'a> {
    pub state: State,
    pub approximation: Option<PipelineGaussianApproximationStateCreateInfoGAURAST<'static>>,
    pub view_mask: u32,
    /// Dynamic states in addition to viewport and scissor.
    pub dynamic: Vec<vk::DynamicState>,
    pub bindings: Option<&'a Bindings>,
    /// A resolve shader in GLSL.
    pub fragment: Option<&'a str>,
}

impl Options<'_> {
    /// Options for drawing scenes of a degree.
    pub fn new(state: State, degree: u32) -> Self {
        Self {
            state: state.spherical_harmonics_degree(degree).attribute_locations(locations()),
            approximation: None,
            view_mask: 0,
            dynamic: Vec::new(),
            bindings: None,
            fragment: None,
        }
    }
}

/// A pipeline that replaces the contents of a target of 32-bit floats.
pub struct Pipeline(gaurast_testkit::Pipeline);

impl Pipeline {
    pub fn new(streams: &[Stream], options: &Options<'_>) -> Self {
        let numbered = || (0..).zip(streams);
        let bindings = numbered().map(|(binding, stream)| vk::VertexInputBindingDescription {
            binding,
            stride: stream.stride,
            input_rate: stream.rate,
        });
        let attributes = numbered().flat_map(|(binding, stream)| {
            let all = stream.attributes.iter();
            all.map(move |&(location, format, offset)| vk::VertexInputAttributeDescription {
                location,
                binding,
                format,
                offset,
            })
        });
        let shaders = (options.fragment.iter()).map(|source| Shader::fragment(compile(Stage::Fragment, source)));
        let mut graphics = Graphics {
            shaders: shaders.collect(),
            set_layouts: options.bindings.iter().map(|all| all.layout).collect(),
            bindings: bindings.collect(),
            attributes: attributes.collect(),
            topology: PRIMITIVE_TOPOLOGY_GAUSSIAN_LIST_GAURAST,
            view_mask: options.view_mask,
            gaussian: Some(options.state),
            approximation: options.approximation,
            ..Graphics::default()
        };
        graphics.dynamic.extend(&options.dynamic);
        Self(graphics.create(own()).expect("a pipeline"))
    }

    /// Binds the pipeline, its vertex buffers and its descriptors.
    pub fn bind(&self, commands: &Commands, streams: &[Stream], bindings: Option<&Bindings>) {
        for (binding, stream) in (0..).zip(streams) {
            commands.vertex_buffer(binding, &stream.buffer, 0);
        }
        commands.bind(&self.0);
        if let Some(bindings) = bindings {
            commands.bind_set(bindings, &[]);
        }
    }
}

/// The extension's functions.
pub fn extension() -> &'static gaussian_primitive_topology::Device {
    own().gaussian().expect("a device that draws Gaussians")
}

/// The pictures of a pass over `layers` layers, which are cleared to transparent. `view_mask` selects the views.
pub fn pictures(layers: u32, view_mask: u32, draw: impl FnOnce(&Commands)) -> Vec<Vec<[f32; 4]>> {
    let gpu: &Gpu = own();
    let format = vk::Format::R32G32B32A32_SFLOAT;
    let image = Image::new(
        gpu,
        &ImageOptions {
            layers,
            view: vk::ImageViewType::TYPE_2D_ARRAY,
            ..ImageOptions::new(format, SIZE, vk::ImageUsageFlags::COLOR_ATTACHMENT)
        },
    );
    let attachments = [vk::RenderingAttachmentInfo::default()
        .image_view(image.view)
        .image_layout(vk::ImageLayout::GENERAL)
        .load_op(vk::AttachmentLoadOp::CLEAR)
        .store_op(vk::AttachmentStoreOp::STORE)];
    let [width, height] = SIZE;
    let area = vk::Rect2D::default().extent(vk::Extent2D { width, height });
    let info = vk::RenderingInfo::default()
        .render_area(area)
        .layer_count(1)
        .view_mask(view_mask)
        .color_attachments(&attachments);
    gpu.run(|commands| {
        commands.barrier();
        // SAFETY: see the module.
        unsafe { gpu.device().cmd_begin_rendering(commands.raw, &info) };
        commands.viewport([0.0, 0.0, width as f32, height as f32], [0.0, 1.0]);
        commands.scissor([0, 0], SIZE);
        draw(commands);
        // SAFETY: see the module.
        unsafe { gpu.device().cmd_end_rendering(commands.raw) };
        commands.barrier();
    });
    let bytes = image.read(vk::ImageAspectFlags::COLOR, 16);
    let texels: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&bytes);
    let layer = (width * height) as usize;
    texels.chunks_exact(layer).map(<[_]>::to_vec).collect()
}
