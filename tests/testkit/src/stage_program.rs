//! Programs of geometry and tessellation shaders, which run unchanged on this driver and on lavapipe.
//!
//! A program draws to layers of floats, and its shaders can write words to a storage buffer. A draw has no vertex
//! buffers: the vertex shader passes on the numbers of vertex and instance as a position.

use crate::{
    Attachments, Bindings, Buffer, Commands, Formats, Gpu, Image, ImageOptions, Pass, Pipeline, PipelineOptions,
    Resource,
};
use ash::vk;
use gaurast_runner::{Case, Missing, Need, Variant, ignore};

use crate::devices::{lavapipe, own};

/// Width and height of the picture.
pub const SIDE: u32 = 128;

/// A variant for each driver.
pub fn drivers() -> Vec<Variant> {
    let lavapipe = Variant { name: "lavapipe".to_owned(), needs: vec![Need::VulkanLoader, Need::Lavapipe] };
    vec![Variant::new("this driver"), lavapipe]
}

/// The device of the test's variant.
pub fn device(case: &Case) -> &'static Gpu {
    match case.variant() {
        "lavapipe" => lavapipe(),
        _ => own(),
    }
}

/// Ends the test as ignored if the device lacks a feature.
pub fn need(feature: &str, has: vk::Bool32) {
    if has == vk::FALSE {
        let reason = format!("the device does not have {feature}");
        ignore(Missing::Capability, reason);
    }
}

/// The device of the test's variant, if it has geometry shaders that write to storage buffers.
pub fn with_geometry(case: &Case) -> &'static Gpu {
    let gpu = device(case);
    let features = gpu.features();
    need("geometryShader", features.geometry_shader);
    let stores = features.vertex_pipeline_stores_and_atomics;
    need("vertexPipelineStoresAndAtomics", stores);
    gpu
}

/// The device of the test's variant, if it has tessellation shaders that write to storage buffers.
pub fn with_tessellation(case: &Case) -> &'static Gpu {
    let gpu = device(case);
    let features = gpu.features();
    need("tessellationShader", features.tessellation_shader);
    let stores = features.vertex_pipeline_stores_and_atomics;
    need("vertexPipelineStoresAndAtomics", stores);
    gpu
}

/// The stages that the device has with several views.
pub fn multiview(gpu: &Gpu) -> vk::PhysicalDeviceMultiviewFeatures<'static> {
    let mut found = vk::PhysicalDeviceMultiviewFeatures::default();
    let mut all = vk::PhysicalDeviceFeatures2::default().push_next(&mut found);
    // SAFETY: the physical device is the instance's.
    unsafe {
        gpu.instance().get_physical_device_features2(gpu.physical_device(), &mut all);
    }
    found
}

/// A vertex shader that passes on the numbers of vertex and instance.
pub const NUMBERED: &str = "
    void main() { gl_Position = vec4(gl_VertexIndex, gl_InstanceIndex, 0.0, 1.0); }";

/// A fragment shader that writes a flat value.
pub const FLAT: &str = "
    layout(location = 0) flat in vec4 value;
    layout(location = 0) out vec4 color;
    void main() { color = value; }";

/// A fragment shader that writes ones.
pub const ONES: &str = "
    layout(location = 0) out vec4 color;
    void main() { color = vec4(1.0); }";

/// The declaration of the words in the storage buffer.
pub const WORDS: &str = "
    layout(std430, binding = 0) buffer Words { uint words[]; };";

/// Functions of a geometry shader with triangle strips: `at` gives the position of a place in pixels, and `cover` emits
/// a rectangle of pixels with the flat value `shown`.
pub const COVER: &str = "
    layout(location = 0) flat out vec4 value;
    vec4 shown;
    vec4 at(vec2 pixels) { return vec4(pixels / 64.0 - 1.0, 0.0, 1.0); }
    void cover(vec2 from, vec2 size) {
        for (int corner = 0; corner < 4; corner++) {
            gl_Position = at(from + size * vec2(corner & 1, corner >> 1));
            value = shown;
            EmitVertex();
        }
        EndPrimitive();
    }";

/// The options of a pipeline without vertex attributes, whose fragments write a flat value.
pub fn options() -> PipelineOptions<'static> {
    PipelineOptions {
        vertex: NUMBERED,
        fragment: Some(FLAT),
        vertex_bindings: Vec::new(),
        vertex_attributes: Vec::new(),
        ..PipelineOptions::default()
    }
}

/// A program: its pipeline, and what it draws to.
pub struct Program<'a> {
    /// The pipeline's options.
    pub options: PipelineOptions<'a>,
    /// The number of words of the storage buffer, which is binding 0.
    pub words: u32,
    /// The resources of the bindings after it.
    pub resources: Vec<Resource>,
    /// The number of layers, which are views if the pipeline has a view mask.
    pub layers: u32,
}

/// The words and pixels that a program has written.
pub struct Drawn {
    texels: Vec<[f32; 4]>,
    /// The words of the storage buffer.
    pub words: Vec<u32>,
}

impl Drawn {
    /// The texel of a layer.
    pub fn texel_of(&self, layer: u32, x: u32, y: u32) -> [f32; 4] {
        self.texels[((layer * SIDE + y) * SIDE + x) as usize]
    }

    /// The texel of the first layer.
    pub fn texel(&self, x: u32, y: u32) -> [f32; 4] {
        self.texel_of(0, x, y)
    }

    /// Checks the first component of each texel of a layer.
    ///
    /// # Panics
    /// If one differs from `expected`, a function of its place.
    pub fn assert_layer(&self, layer: u32, expected: impl Fn(u32, u32) -> f32) {
        for y in 0..SIDE {
            for x in 0..SIDE {
                let [found, ..] = self.texel_of(layer, x, y);
                let expected = expected(x, y);
                assert_eq!(found, expected, "layer {layer}, texel {x}, {y}");
            }
        }
    }

    /// Checks the first component of each texel.
    ///
    /// # Panics
    /// If one differs from `expected`, a function of its place.
    pub fn assert_all(&self, expected: impl Fn(u32, u32) -> f32) {
        self.assert_layer(0, expected);
    }

    /// The records of a buffer whose first word is their number, each of `N` words.
    ///
    /// # Panics
    /// If there were more than the buffer holds.
    pub fn records<const N: usize>(&self) -> Vec<[u32; N]> {
        let (count, records) = (self.words[0] as usize, &self.words[1..]);
        assert!(count * N <= records.len(), "{count} records");
        let records = records[..count * N].chunks_exact(N);
        records.map(|record| record.try_into().expect("N words")).collect()
    }
}

impl<'a> Program<'a> {
    /// A program that draws to one layer, with no more resources than the storage buffer.
    pub fn new(options: PipelineOptions<'a>, words: u32) -> Self {
        Self { options, words, resources: Vec::new(), layers: 1 }
    }

    /// Draws on zeros.
    pub fn draw(&self, gpu: &Gpu, draws: impl FnOnce(&Commands)) -> Drawn {
        self.run(gpu, None, draws)
    }

    /// Draws on zeros, and returns pipeline statistics, in the order of the bits of `counted`.
    pub fn statistics<const N: usize>(
        &self,
        gpu: &Gpu,
        counted: vk::QueryPipelineStatisticFlags,
        draws: impl FnOnce(&Commands),
    ) -> [u64; N] {
        let has = gpu.features().pipeline_statistics_query;
        need("pipelineStatisticsQuery", has);
        assert_eq!(counted.as_raw().count_ones() as usize, N);
        let info = vk::QueryPoolCreateInfo::default()
            .query_type(vk::QueryType::PIPELINE_STATISTICS)
            .pipeline_statistics(counted)
            .query_count(1);
        let device = gpu.device();
        // SAFETY: see the crate.
        let pool = unsafe { device.create_query_pool(&info, None).expect("a pool") };
        self.run(gpu, Some(pool), draws);
        let mut counts = [[0; N]];
        let flags = vk::QueryResultFlags::WAIT | vk::QueryResultFlags::TYPE_64;
        // SAFETY: see the crate.
        unsafe {
            let got = device.get_query_pool_results(pool, 0, &mut counts, flags);
            got.expect("results");
            device.destroy_query_pool(pool, None);
        }
        counts[0]
    }

    fn run(&self, gpu: &Gpu, query: Option<vk::QueryPool>, draws: impl FnOnce(&Commands)) -> Drawn {
        let canvas = Canvas::new(gpu, self.layers, self.options.view_mask);
        let buffer = Buffer::new(gpu, 4 * u64::from(self.words));
        let mut resources = vec![Resource::Storage(buffer.raw)];
        resources.extend(&self.resources);
        let bindings = Bindings::new(gpu, &resources);
        let options = PipelineOptions { bindings: Some(&bindings), ..self.options.clone() };
        let pipeline = Pipeline::new(gpu, &canvas, &options);
        gpu.run(|commands| {
            let (device, raw) = commands.raw();
            // SAFETY: see the crate.
            query.inspect(|&pool| unsafe {
                device.cmd_reset_query_pool(raw, pool, 0, 1);
                device.cmd_begin_query(raw, pool, 0, vk::QueryControlFlags::empty());
            });
            commands.pass(&canvas, &Pass::zeros(), || {
                commands.bind(&pipeline);
                commands.bind_set(&bindings, &[]);
                draws(commands);
            });
            // SAFETY: see the crate.
            query.inspect(|&pool| unsafe { device.cmd_end_query(raw, pool, 0) });
        });
        Drawn { texels: canvas.image.colors(), words: buffer.values() }
    }
}

/// Layers of floats.
struct Canvas {
    image: Image,
    view_mask: u32,
}

impl Canvas {
    fn new(gpu: &Gpu, layers: u32, view_mask: u32) -> Self {
        let usage = vk::ImageUsageFlags::COLOR_ATTACHMENT;
        let format = vk::Format::R32G32B32A32_SFLOAT;
        let options = ImageOptions {
            layers,
            view: vk::ImageViewType::TYPE_2D_ARRAY,
            ..ImageOptions::new(format, [SIDE; 2], usage)
        };
        Self { image: Image::new(gpu, &options), view_mask }
    }
}

impl Attachments for Canvas {
    fn size(&self) -> [u32; 2] {
        [SIDE; 2]
    }

    fn attachment_formats(&self) -> Formats {
        Formats::of(self.image.options.format)
    }

    fn begin(&self, device: &ash::Device, commands: vk::CommandBuffer, pass: &Pass) {
        let attachment = [vk::RenderingAttachmentInfo::default()
            .image_view(self.image.view)
            .image_layout(vk::ImageLayout::GENERAL)
            .load_op(pass.load)
            .store_op(pass.store)
            .clear_value(vk::ClearValue { color: pass.color })];
        let [width, height] = self.size();
        let area = vk::Rect2D::default().extent(vk::Extent2D { width, height });
        let info = vk::RenderingInfo::default()
            .render_area(area)
            .layer_count(self.image.options.layers)
            .view_mask(self.view_mask)
            .color_attachments(&attachment);
        // SAFETY: see the crate.
        unsafe { device.cmd_begin_rendering(commands, &info) };
    }
}
