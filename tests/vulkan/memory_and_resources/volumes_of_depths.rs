//! Images of depths and stencils in three dimensions: their slices are filled, cleared, sampled and rendered to.

use ash::vk;
use gaurast_testkit::devices::own;
use gaurast_testkit::shader::GLSLANG;
use gaurast_testkit::{
    Attachments, Bindings, Buffer, Formats, Image, ImageOptions, Kernel, Pass, Pipeline, PipelineOptions, Resource,
    Sampler, depth_test, range, shapes,
};

const SIDE: u32 = 20;
const DEPTH: u32 = 5;
const SLICE: usize = (SIDE * SIDE) as usize;

fn volume(format: vk::Format) -> Image {
    let usage = vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT;
    let options = ImageOptions {
        size: [SIDE, SIDE, DEPTH],
        view: vk::ImageViewType::TYPE_3D,
        flags: vk::ImageCreateFlags::TYPE_2D_ARRAY_COMPATIBLE,
        ..ImageOptions::new(format, [SIDE; 2], usage)
    };
    Image::new(own(), &options)
}

/// The depth of a place, which differs from all others.
fn depth(place: usize) -> f32 {
    place as f32 / 4096.0
}

#[gaurast_runner::test(needs = [GLSLANG])]
fn depths_of_a_volume_are_sampled() {
    let gpu = own();
    let image = volume(vk::Format::D32_SFLOAT);
    let count = SLICE * DEPTH as usize;
    let depths: Vec<f32> = (0..count).map(depth).collect();
    image.upload(vk::ImageAspectFlags::DEPTH, bytemuck::cast_slice(&depths));
    let sampler = Sampler::new(gpu, &vk::SamplerCreateInfo::default());
    let found = Buffer::new(gpu, 4 * count as u64);
    let bindings = Bindings::new(gpu, &[Resource::Storage(found.raw), Resource::Texture(image.view, sampler.raw)]);
    let kernel = Kernel::new(
        gpu,
        "layout(local_size_x = 1) in;
         layout(binding = 0) buffer B { float found[]; };
         layout(binding = 1) uniform sampler3D volume;
         void main() {
             uvec3 size = gl_NumWorkGroups;
             uvec3 at = gl_WorkGroupID;
             vec3 place = (vec3(at) + 0.5) / vec3(size);
             found[(at.z * size.y + at.y) * size.x + at.x] = textureLod(volume, place, 0.0).x;
         }",
        &bindings,
    );
    kernel.run(&[bindings.set], &[], [SIDE, SIDE, DEPTH]);
    assert_eq!(found.values::<f32>(), depths);
}

/// A slice of a volume, as the only attachment.
struct Slice<'a> {
    image: &'a Image,
    view: vk::ImageView,
}

impl<'a> Slice<'a> {
    fn new(image: &'a Image, slice: u32, aspects: vk::ImageAspectFlags) -> Self {
        let info = vk::ImageViewCreateInfo::default()
            .image(image.raw)
            .view_type(vk::ImageViewType::TYPE_2D)
            .format(image.options.format)
            .subresource_range(range(aspects).base_array_layer(slice).layer_count(1));
        // SAFETY: see the crate.
        let view = unsafe { own().device().create_image_view(&info, None) };
        Self { image, view: view.expect("a view of a slice") }
    }
}

impl Drop for Slice<'_> {
    fn drop(&mut self) {
        // SAFETY: see the crate.
        unsafe { own().device().destroy_image_view(self.view, None) };
    }
}

impl Attachments for Slice<'_> {
    fn size(&self) -> [u32; 2] {
        [SIDE; 2]
    }

    fn attachment_formats(&self) -> Formats {
        Formats { colors: Vec::new(), depth: self.image.options.format, samples: 1 }
    }

    fn begin(&self, device: &ash::Device, commands: vk::CommandBuffer, pass: &Pass) {
        let attachment = vk::RenderingAttachmentInfo::default()
            .image_view(self.view)
            .image_layout(vk::ImageLayout::GENERAL)
            .load_op(pass.load)
            .store_op(pass.store);
        let info = vk::RenderingInfo::default()
            .render_area(vk::Rect2D::default().extent(vk::Extent2D { width: SIDE, height: SIDE }))
            .layer_count(1)
            .depth_attachment(&attachment)
            .stencil_attachment(&attachment);
        // SAFETY: see the crate.
        unsafe { device.cmd_begin_rendering(commands, &info) };
    }
}

#[gaurast_runner::test(needs = [GLSLANG])]
fn a_slice_is_rendered_to_and_no_other() {
    let gpu = own();
    let format = vk::Format::D32_SFLOAT_S8_UINT;
    let image = volume(format);
    let both = vk::ImageAspectFlags::DEPTH | vk::ImageAspectFlags::STENCIL;
    gpu.run(|commands| {
        let (device, raw) = commands.raw();
        let value = vk::ClearDepthStencilValue { depth: 0.75, stencil: 3 };
        // SAFETY: see the crate.
        unsafe {
            device.cmd_clear_depth_stencil_image(raw, image.raw, vk::ImageLayout::GENERAL, &value, &[range(both)]);
        }
    });
    let slice = Slice::new(&image, 2, both);
    let face = vk::StencilOpState {
        pass_op: vk::StencilOp::INCREMENT_AND_CLAMP,
        fail_op: vk::StencilOp::KEEP,
        depth_fail_op: vk::StencilOp::KEEP,
        compare_op: vk::CompareOp::ALWAYS,
        compare_mask: 0xFF,
        write_mask: 0xFF,
        reference: 0,
    };
    let tests = depth_test(vk::CompareOp::LESS).stencil_test_enable(true).front(face).back(face);
    let options = PipelineOptions { fragment: None, depth_stencil: tests, ..PipelineOptions::default() };
    let pipeline = Pipeline::new(gpu, &slice, &options);
    // The left half is nearer than what is there, the right half farther.
    let near = shapes::rectangle([-1.0, -1.0, 0.0, 1.0], 0.5, [1.0; 4]);
    let far = shapes::rectangle([0.0, -1.0, 1.0, 1.0], 0.875, [1.0; 4]);
    let vertices = Buffer::of(gpu, &[near, far].concat());
    gpu.run(|commands| {
        commands.pass(&slice, &Pass::load(), || {
            commands.bind(&pipeline);
            commands.vertices(&vertices);
            commands.draw(0..12);
        });
    });
    let depths: Vec<f32> = bytemuck::pod_collect_to_vec(&image.download(vk::ImageAspectFlags::DEPTH));
    let stencils = image.download(vk::ImageAspectFlags::STENCIL);
    for (place, (depth, stencil)) in depths.into_iter().zip(stencils).enumerate() {
        let is_drawn = place / SLICE == 2 && place % (SIDE as usize) < SIDE as usize / 2;
        assert_eq!((depth, stencil), if is_drawn { (0.5, 4) } else { (0.75, 3) }, "{place}");
    }
}
