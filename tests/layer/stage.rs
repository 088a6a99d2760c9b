//! Devices under the layer, and the scene in which mistakes are made.

use ash::vk;
use gaurast::gaussian_primitive_topology;
use gaurast::vk::{
    GaussianAttributeLocationsGAURAST, GaussianCameraGAURAST, GaussianProjectionModeGAURAST,
    GaussianResolveInputLocationsGAURAST, GaussianVertexOutputLocationsGAURAST,
    PRIMITIVE_TOPOLOGY_GAUSSIAN_LIST_GAURAST, PhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST as Features,
    PipelineGaussianStateCreateInfoGAURAST,
};
use gaurast_testkit::loader::LAYER;
use gaurast_testkit::{
    Bindings, Buffer, Commands, Driver, Gpu, Graphics, Message, Opening, Pass, Resource, Shader, Target, binding, over,
};

/// Devices under the layer.
pub struct Stage {
    /// With all that the driver has.
    pub full: Gpu,
    /// Without the optional modes of the extension.
    pub bare: Gpu,
    /// With fragment stages, the unscented transform, 2D Gaussians and cut-offs as the only optional features.
    pub resolving: Gpu,
    /// Without the topology.
    pub without: Gpu,
    /// Without any feature of Vulkan, and with the topology.
    pub plain: Gpu,
    /// A device with pipeline libraries.
    pub linking: Gpu,
}

/// A device under the layer with pipeline libraries.
pub fn linking(layers: &[&std::ffi::CStr]) -> Gpu {
    let mut libraries = vk::PhysicalDeviceGraphicsPipelineLibraryFeaturesEXT::default().graphics_pipeline_library(true);
    let names = [ash::khr::pipeline_library::NAME, ash::ext::graphics_pipeline_library::NAME];
    let opening = Opening { layers, extensions: &names, ..Opening::of(Driver::Loaded) };
    Gpu::open_with(&opening, &mut libraries).expect("a device with pipeline libraries")
}

impl Stage {
    pub fn new() -> Self {
        let open = |gaussian: Option<Features<'static>>| {
            let opening = Opening {
                layers: &[LAYER],
                all_extensions: true,
                robust: true,
                gaussian,
                ..Opening::of(Driver::Loaded)
            };
            Gpu::open(&opening).expect("a device")
        };
        let stage = Self {
            full: open(None),
            bare: open(Some(Features::default().gaussian_primitive_topology(true))),
            resolving: open(Some(
                Features::default()
                    .gaussian_primitive_topology(true)
                    .resolve_fragment_shader(true)
                    .unscented_projection(true)
                    .gaussian_2d(true)
                    .gaussian_cut_off(true),
            )),
            without: open(Some(Features::default())),
            plain: Gpu::open(&Opening {
                layers: &[LAYER],
                extensions: &[gaussian_primitive_topology::NAME],
                gaussian: Some(Features::default().gaussian_primitive_topology(true)),
                robust: true,
                bare: true,
                ..Opening::of(Driver::Loaded)
            })
            .expect("a device"),
            linking: linking(&[LAYER]),
        };
        // That nothing is enabled was said.
        assert_eq!(said_by_the_layer(&stage.without.messages()).len(), 1);
        stage
    }
}

/// The beginning of the layer's messages.
const PREFIX: &str = "VK_LAYER_GAURAST_validation: ";

/// The layer's messages, without the layer's name.
pub fn said_by_the_layer(messages: &[Message]) -> Vec<Message> {
    let of_layer = messages.iter().filter_map(|message| {
        let text = message.text.strip_prefix(PREFIX)?.to_owned();
        let id = message.id.clone();
        Some(Message { id, text })
    });
    of_layer.collect()
}

/// The messages of others.
pub fn said_by_the_driver(messages: &[Message]) -> Vec<Message> {
    let mut others = messages.to_vec();
    others.retain(|message| !message.text.starts_with(PREFIX));
    others
}

/// A Gaussian: position, scale, rotation, opacity, degree-0 colour.
pub type Splat = [f32; 14];

/// A Gaussian ahead of [`camera`].
pub const SPLAT: Splat = [0.0, 0.0, 5.0, 0.1, 0.1, 0.1, 1.0, 0.0, 0.0, 0.0, 0.8, 0.5, 0.5, 0.5];
/// The offsets of the parts of a [`Splat`].
pub const SCALE: usize = 3;
pub const ROTATION: usize = 6;
pub const OPACITY: usize = 10;
pub const COLOR: usize = 11;

/// A Gaussian with other numbers from a place on.
pub fn splat<const N: usize>(at: usize, numbers: [f32; N]) -> Splat {
    let mut splat = SPLAT;
    splat[at..at + N].copy_from_slice(&numbers);
    splat
}

pub const SIZE: [u32; 2] = [64, 48];

/// Looks along +z from the origin.
pub fn camera() -> GaussianCameraGAURAST<'static> {
    GaussianCameraGAURAST::default().focal_length([100.0, 100.0]).principal_point([32.0, 24.0])
}

pub type State = PipelineGaussianStateCreateInfoGAURAST<'static>;

pub fn locations() -> GaussianAttributeLocationsGAURAST {
    GaussianAttributeLocationsGAURAST::default()
        .position(0)
        .scale(1)
        .rotation(2)
        .opacity(3)
        .first_spherical_harmonics(4)
}

pub fn attribute(location: u32, binding: u32, format: vk::Format, floats: u32) -> vk::VertexInputAttributeDescription {
    vk::VertexInputAttributeDescription { location, binding, format, offset: 4 * floats }
}

/// A right pipeline for [`Splat`]s, to be changed before it is created.
pub fn splats() -> Graphics<'static> {
    let (one, three, four) = (vk::Format::R32_SFLOAT, vk::Format::R32G32B32_SFLOAT, vk::Format::R32G32B32A32_SFLOAT);
    Graphics {
        topology: PRIMITIVE_TOPOLOGY_GAUSSIAN_LIST_GAURAST,
        attributes: vec![
            attribute(0, 0, three, 0),
            attribute(1, 0, three, 3),
            attribute(2, 0, four, 6),
            attribute(3, 0, one, 10),
            attribute(4, 0, three, 11),
        ],
        bindings: vec![binding(0, size_of::<Splat>() as u32)],
        blend: vec![over()],
        gaussian: Some(State::default().attribute_locations(locations())),
        ..Graphics::default()
    }
}

/// The same with a change of the Gaussian state.
pub fn with(change: impl FnOnce(State) -> State) -> Graphics<'static> {
    let request = splats();
    Graphics { gaussian: request.gaussian.map(change), ..request }
}

/// A matrix's rows and a factor of the opacity.
pub type Model = [f32; 13];

pub const IDENTITY: Model = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0];

/// A pipeline with a [`Model`] for each instance from binding 1.
pub fn instanced() -> Graphics<'static> {
    let mut request = with(|s| s.attribute_locations(locations().first_model_matrix(9).model_opacity(12)));
    let row = |row: u32| attribute(9 + row, 1, vk::Format::R32G32B32A32_SFLOAT, 4 * row);
    request.attributes.extend((0..3).map(row));
    request.attributes.push(attribute(12, 1, vk::Format::R32_SFLOAT, 12));
    request.bindings.push(vk::VertexInputBindingDescription {
        binding: 1,
        stride: size_of::<Model>() as u32,
        input_rate: vk::VertexInputRate::INSTANCE,
    });
    request
}

/// The SPIR-V of a shader beside the compiler's tests.
macro_rules! spirv {
    ($name:literal) => {
        bytemuck::pod_collect_to_vec::<u8, u32>(include_bytes!(concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/../driver/spirv/tests/shaders/",
            $name,
            ".spv"
        )))
    };
}
pub(crate) use spirv;

/// A set with a storage buffer, which the shaders read, and the pipeline that `request` becomes with it.
pub fn laid_out(gpu: &Gpu, request: Graphics<'static>) -> (Graphics<'static>, Bindings, Buffer) {
    let buffer = Buffer::new(gpu, 1 << 16);
    let set = Bindings::new(gpu, &[Resource::Storage(buffer.raw)]);
    let push = vk::PushConstantRange::default().stage_flags(vk::ShaderStageFlags::ALL_GRAPHICS).size(128);
    let request = Graphics { set_layouts: vec![set.layout], push: vec![push], ..request };
    (request, set, buffer)
}

pub fn outputs() -> GaussianVertexOutputLocationsGAURAST {
    GaussianVertexOutputLocationsGAURAST::default().covariance(1).opacity(3).color(4).depth_key(6)
}

/// A pipeline whose vertex shader projects.
pub fn shaded(change: impl FnOnce(State) -> State) -> Graphics<'static> {
    let request = with(|s| {
        change(s.projection_mode(GaussianProjectionModeGAURAST::VERTEX_SHADER).vertex_output_locations(outputs()))
    });
    // The shader takes harmonics from its storage buffer.
    let mut request = request.with_shader(Shader::vertex(spirv!("gaussian.vert")));
    request.attributes.truncate(4);
    request
}

/// A pipeline with a resolve shader that finds what was accumulated and depths at these locations.
pub fn resolved(
    words: Vec<u32>,
    [accumulated, depth]: [u32; 2],
    change: impl FnOnce(State) -> State,
) -> Graphics<'static> {
    let locations = GaussianResolveInputLocationsGAURAST::default().accumulated_color(accumulated).depth(depth);
    let request = with(|s| change(s.resolve_input_locations(locations)));
    request.with_shader(Shader::fragment(words))
}

/// The messages as a pipeline is created.
pub fn creation(gpu: &Gpu, request: &Graphics<'_>) -> Vec<Message> {
    gpu.messages();
    // The driver may refuse it.
    let _ = request.create(gpu);
    gpu.messages()
}

/// The messages as commands are recorded.
pub fn recording(gpu: &Gpu, record: impl FnOnce(&Commands)) -> Vec<Message> {
    gpu.messages();
    let _ = gpu.try_record(record);
    gpu.messages()
}

/// The messages as a pass is recorded and executed, in which a pipeline and Gaussians are bound.
pub fn drawing(gpu: &Gpu, request: &Graphics<'_>, splats: &[Splat], record: impl FnOnce(&Commands)) -> Vec<Message> {
    gpu.messages();
    let pipeline = request.create(gpu).expect("a pipeline");
    let target = Target::floats(gpu, SIZE);
    let buffer = Buffer::of(gpu, splats.as_flattened());
    gpu.messages();
    let recorded = gpu.try_record(|commands| {
        commands.pass(&target, &Pass::clear([0.0; 4]), || {
            commands.bind(&pipeline);
            commands.vertices(&buffer);
            record(commands);
        });
    });
    if let Ok(recorded) = recorded {
        recorded.submit();
    }
    gpu.messages()
}

/// The messages of a draw of these Gaussians.
pub fn drawn(gpu: &Gpu, request: &Graphics<'_>, splats: &[Splat]) -> Vec<Message> {
    drawing(gpu, request, splats, |commands| {
        commands.camera(&camera());
        commands.draw(0..splats.len() as u32);
    })
}

/// The extension's functions.
pub fn gaussian(gpu: &Gpu) -> &gaussian_primitive_topology::Device {
    gpu.gaussian().expect("a device that draws Gaussians")
}

/// Makes a mistake, and gives all that was said.
type Make = Box<dyn Fn(&Stage) -> Vec<Message>>;

/// A mistake, and the message that names it.
pub struct Mistake {
    pub name: &'static str,
    pub id: &'static str,
    /// Makes it; gives all that was said.
    pub make: Make,
}

pub fn mistake(name: &'static str, id: &'static str, make: impl Fn(&Stage) -> Vec<Message> + 'static) -> Mistake {
    Mistake { name, id, make: Box::new(make) }
}

/// A pipeline that is wrong, on the device with all features.
pub fn pipeline(name: &'static str, id: &'static str, request: impl Fn() -> Graphics<'static> + 'static) -> Mistake {
    mistake(name, id, move |stage| creation(&stage.full, &request()))
}

/// A wrong pipeline whose shaders need a layout.
pub fn shaders(name: &'static str, id: &'static str, request: impl Fn() -> Graphics<'static> + 'static) -> Mistake {
    mistake(name, id, move |stage| {
        let (request, _set, _buffer) = laid_out(&stage.full, request());
        creation(&stage.full, &request)
    })
}
