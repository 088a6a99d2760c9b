//! Dynamic rendering whose draws read, as input attachments, what earlier draws of the pass have written.

use ash::vk;
use gaurast_testkit::shader::{GLSLANG, Stage, compile};
use gaurast_testkit::{Attachments, Bindings, Formats, Gpu, Image, ImageOptions, Pass, Resource};

const SIDE: u32 = 16;
const COLOR: vk::Format = vk::Format::R32G32B32A32_SFLOAT;

/// Two colour attachments of a pass.
struct Two([Image; 2]);

impl Attachments for Two {
    fn size(&self) -> [u32; 2] {
        [SIDE; 2]
    }

    fn attachment_formats(&self) -> Formats {
        Formats { colors: vec![COLOR; 2], depth: vk::Format::UNDEFINED, samples: 1 }
    }

    fn begin(&self, device: &ash::Device, commands: vk::CommandBuffer, pass: &Pass) {
        let colors = self.0.each_ref().map(|image| {
            vk::RenderingAttachmentInfo::default()
                .image_view(image.view)
                .image_layout(vk::ImageLayout::RENDERING_LOCAL_READ_KHR)
                .load_op(pass.load)
                .store_op(pass.store)
                .clear_value(vk::ClearValue { color: pass.color })
        });
        let extent = vk::Extent2D { width: SIDE, height: SIDE };
        let info = vk::RenderingInfo::default()
            .render_area(vk::Rect2D::default().extent(extent))
            .layer_count(1)
            .color_attachments(&colors);
        // SAFETY: see the crate.
        unsafe { device.cmd_begin_rendering(commands, &info) };
    }
}

/// A pipeline over all pixels.
struct Placed<'a> {
    fragment: &'a str,
    layout: vk::PipelineLayout,
    /// The location of the output that each colour attachment takes.
    locations: [u32; 2],
    alpha_to_coverage: bool,
}

fn pipeline(gpu: &Gpu, placed: &Placed<'_>) -> vk::Pipeline {
    let &Placed { fragment, layout, locations, alpha_to_coverage } = placed;
    let device = gpu.device();
    let vertex = "void main() {
        gl_Position = vec4(4.0 * (gl_VertexIndex & 1) - 1.0, 4.0 * (gl_VertexIndex >> 1) - 1.0, 0.0, 1.0);
    }";
    let words = [compile(Stage::Vertex, vertex), compile(Stage::Fragment, fragment)];
    // SAFETY: see the crate.
    unsafe {
        let modules = words.each_ref().map(|words| {
            let info = vk::ShaderModuleCreateInfo::default().code(words);
            device.create_shader_module(&info, None).expect("a module")
        });
        let flags = [vk::ShaderStageFlags::VERTEX, vk::ShaderStageFlags::FRAGMENT];
        let stages: Vec<_> = (modules.iter().zip(flags))
            .map(|(&module, stage)| {
                vk::PipelineShaderStageCreateInfo::default().stage(stage).module(module).name(c"main")
            })
            .collect();
        let input = vk::PipelineVertexInputStateCreateInfo::default();
        let assembly =
            vk::PipelineInputAssemblyStateCreateInfo::default().topology(vk::PrimitiveTopology::TRIANGLE_LIST);
        let area = vk::Rect2D::default().extent(vk::Extent2D { width: SIDE, height: SIDE });
        let viewports =
            [vk::Viewport { width: SIDE as f32, height: SIDE as f32, max_depth: 1.0, ..Default::default() }];
        let scissors = [area];
        let viewport = vk::PipelineViewportStateCreateInfo::default().viewports(&viewports).scissors(&scissors);
        let raster = vk::PipelineRasterizationStateCreateInfo::default().line_width(1.0);
        let multisample = vk::PipelineMultisampleStateCreateInfo::default()
            .rasterization_samples(vk::SampleCountFlags::TYPE_1)
            .alpha_to_coverage_enable(alpha_to_coverage);
        let attachments = [gaurast_testkit::pipeline::opaque(); 2];
        let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&attachments);
        let formats = [COLOR; 2];
        let mut rendering = vk::PipelineRenderingCreateInfo::default().color_attachment_formats(&formats);
        let mut placed = vk::RenderingAttachmentLocationInfoKHR::default().color_attachment_locations(&locations);
        let info = vk::GraphicsPipelineCreateInfo::default()
            .stages(&stages)
            .vertex_input_state(&input)
            .input_assembly_state(&assembly)
            .viewport_state(&viewport)
            .rasterization_state(&raster)
            .multisample_state(&multisample)
            .color_blend_state(&blend)
            .layout(layout)
            .push_next(&mut rendering)
            .push_next(&mut placed);
        let created = device.create_graphics_pipelines(vk::PipelineCache::null(), &[info], None);
        modules.into_iter().for_each(|module| device.destroy_shader_module(module, None));
        created.expect("a pipeline")[0]
    }
}

/// The first draw writes the first attachment by its second output; the second reads that, and writes the second
/// attachment by its first output, and nothing to the first.
#[gaurast_runner::test(needs = [GLSLANG])]
fn a_draw_reads_what_another_wrote_to_its_pixel() {
    let mut features =
        vk::PhysicalDeviceDynamicRenderingLocalReadFeaturesKHR::default().dynamic_rendering_local_read(true);
    let gpu = Gpu::extended(&[ash::khr::dynamic_rendering_local_read::NAME], &mut features).expect("a device");
    let device = gpu.device();
    let local = ash::khr::dynamic_rendering_local_read::Device::new(gpu.instance(), device);
    let usage = vk::ImageUsageFlags::COLOR_ATTACHMENT | vk::ImageUsageFlags::INPUT_ATTACHMENT;
    let target = Two([(); 2].map(|()| Image::new(&gpu, &ImageOptions::new(COLOR, [SIDE; 2], usage))));
    let bindings = Bindings::new(&gpu, &[Resource::Input(target.0[0].view)]);
    let set_layouts = [bindings.layout];
    let info = vk::PipelineLayoutCreateInfo::default().set_layouts(&set_layouts);
    // SAFETY: see the crate.
    let layout = unsafe { device.create_pipeline_layout(&info, None) }.expect("a layout");
    const UNUSED: u32 = vk::ATTACHMENT_UNUSED;
    let writes = "
        layout(location = 0) out vec4 nowhere;
        layout(location = 1) out vec4 color;
        void main() { nowhere = vec4(100.0); color = vec4(gl_FragCoord.xy, 1.0, 2.0); }";
    let reads = "
        layout(input_attachment_index = 0, binding = 0) uniform subpassInput before;
        layout(location = 0) out vec4 color;
        layout(location = 1) out vec4 nowhere;
        void main() { color = 2.0 * subpassLoad(before) + vec4(1.0); nowhere = vec4(200.0); }";
    let locations = [[1, UNUSED], [UNUSED, 0]];
    let pipelines = [(writes, locations[0]), (reads, locations[1])]
        .map(|(fragment, locations)| pipeline(&gpu, &Placed { fragment, layout, locations, alpha_to_coverage: false }));
    gpu.run(|commands| {
        commands.pass(&target, &Pass::clear([7.0; 4]), || {
            let (_, raw) = commands.raw();
            let point = vk::PipelineBindPoint::GRAPHICS;
            let written = vk::MemoryBarrier::default()
                .src_access_mask(vk::AccessFlags::COLOR_ATTACHMENT_WRITE)
                .dst_access_mask(vk::AccessFlags::INPUT_ATTACHMENT_READ);
            for (pipeline, locations) in pipelines.iter().zip(&locations) {
                let placed = vk::RenderingAttachmentLocationInfoKHR::default().color_attachment_locations(locations);
                let indices = vk::RenderingInputAttachmentIndexInfoKHR::default();
                // SAFETY: see the crate.
                unsafe {
                    local.cmd_set_rendering_attachment_locations(raw, &placed);
                    local.cmd_set_rendering_input_attachment_indices(raw, &indices);
                    device.cmd_bind_pipeline(raw, point, *pipeline);
                    device.cmd_bind_descriptor_sets(raw, point, layout, 0, &[bindings.set], &[]);
                    device.cmd_draw(raw, 3, 1, 0, 0);
                    device.cmd_pipeline_barrier(
                        raw,
                        vk::PipelineStageFlags::COLOR_ATTACHMENT_OUTPUT,
                        vk::PipelineStageFlags::FRAGMENT_SHADER,
                        vk::DependencyFlags::BY_REGION,
                        &[written],
                        &[],
                        &[],
                    );
                }
            }
        });
    });
    let [first, second] = target.0.each_ref().map(Image::colors::<[f32; 4]>);
    for (place, (first, second)) in (0..).zip(first.iter().zip(&second)) {
        let (x, y) = ((place % SIDE) as f32 + 0.5, (place / SIDE) as f32 + 0.5);
        assert_eq!(*first, [x, y, 1.0, 2.0]);
        assert_eq!(*second, [2.0 * x + 1.0, 2.0 * y + 1.0, 3.0, 5.0]);
    }
    assert_eq!(gpu.message_texts(), [""; 0]);
    // SAFETY: see the crate.
    unsafe {
        pipelines.into_iter().for_each(|pipeline| device.destroy_pipeline(pipeline, None));
        device.destroy_pipeline_layout(layout, None);
    }
}

/// Alpha to coverage takes the alpha of location 0, to whichever attachment that goes.
#[gaurast_runner::test(needs = [GLSLANG])]
fn the_alpha_of_location_zero_is_the_coverage() {
    let mut features =
        vk::PhysicalDeviceDynamicRenderingLocalReadFeaturesKHR::default().dynamic_rendering_local_read(true);
    let gpu = Gpu::extended(&[ash::khr::dynamic_rendering_local_read::NAME], &mut features).expect("a device");
    let device = gpu.device();
    let local = ash::khr::dynamic_rendering_local_read::Device::new(gpu.instance(), device);
    let usage = vk::ImageUsageFlags::COLOR_ATTACHMENT;
    let target = Two([(); 2].map(|()| Image::new(&gpu, &ImageOptions::new(COLOR, [SIDE; 2], usage))));
    // SAFETY: see the crate.
    let layout = unsafe { device.create_pipeline_layout(&Default::default(), None) }.expect("a layout");
    let fragment = "
        layout(location = 0) out vec4 zero;
        layout(location = 1) out vec4 one;
        void main() {
            bool left = gl_FragCoord.x < 8.0;
            zero = vec4(1.0, 2.0, 3.0, left ? 1.0 : 0.0);
            one = vec4(4.0, 5.0, 6.0, left ? 0.0 : 1.0);
        }";
    const UNUSED: u32 = vk::ATTACHMENT_UNUSED;
    let outputs = [[1.0, 2.0, 3.0, 1.0], [4.0, 5.0, 6.0, 0.0f32]];
    for locations in [[0, 1], [1, 0], [1, UNUSED], [UNUSED, 0], [UNUSED, UNUSED]] {
        let pipeline = pipeline(&gpu, &Placed { fragment, layout, locations, alpha_to_coverage: true });
        gpu.run(|commands| {
            commands.pass(&target, &Pass::clear([7.0; 4]), || {
                let (_, raw) = commands.raw();
                let placed = vk::RenderingAttachmentLocationInfoKHR::default().color_attachment_locations(&locations);
                // SAFETY: see the crate.
                unsafe {
                    local.cmd_set_rendering_attachment_locations(raw, &placed);
                    device.cmd_bind_pipeline(raw, vk::PipelineBindPoint::GRAPHICS, pipeline);
                    device.cmd_draw(raw, 3, 1, 0, 0);
                }
            });
        });
        for (image, location) in target.0.iter().zip(locations) {
            for (place, color) in (0..).zip(image.colors::<[f32; 4]>()) {
                let output = outputs.get(location as usize).filter(|_| place % SIDE < 8);
                assert_eq!(color, output.copied().unwrap_or([7.0; 4]), "{locations:?}: pixel {place}");
            }
        }
        // SAFETY: see the crate.
        unsafe { device.destroy_pipeline(pipeline, None) };
    }
    assert_eq!(gpu.message_texts(), [""; 0]);
    // SAFETY: see the crate.
    unsafe { device.destroy_pipeline_layout(layout, None) };
}
