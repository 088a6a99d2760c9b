//! Multiview: one draw renders each view to its layer, and no other layer changes.

use ash::vk;
use gaurast_testkit::devices::own;
use gaurast_testkit::shader::GLSLANG;
use gaurast_testkit::shapes;
use gaurast_testkit::{Bindings, Vertex};
use gaurast_testkit::{Buffer, Gpu, Image, ImageOptions, Pipeline, PipelineOptions, Resource, Target, TargetOptions};

const SIDE: u32 = 8;
const LAYERS: u32 = 7;
/// The contents of layers before a pass.
const BEFORE: f32 = 9.0;
/// The clear value of a pass.
const CLEARED: f32 = 5.0;

/// Shaders that write the view index: the vertex shader's in red, the fragment shader's in green. The triangle covers
/// the left half.
const VERTEX: &str = "
    #extension GL_EXT_multiview : require
    layout(location = 0) in vec4 position;
    layout(location = 0) flat out float view;
    void main() { gl_Position = position; view = float(gl_ViewIndex); }";
const FRAGMENT: &str = "
    #extension GL_EXT_multiview : require
    layout(location = 0) flat in float view;
    layout(location = 0) out vec4 color;
    void main() { color = vec4(view, float(gl_ViewIndex), 0.0, 1.0); }";

/// An image of layers that hold [`BEFORE`].
fn layered(gpu: &Gpu, usage: vk::ImageUsageFlags) -> Image {
    let options = ImageOptions {
        layers: LAYERS,
        view: vk::ImageViewType::TYPE_2D_ARRAY,
        ..ImageOptions::new(vk::Format::R32G32B32A32_SFLOAT, [SIDE; 2], usage)
    };
    let image = Image::new(gpu, &options);
    gpu.run(|commands| {
        let value = vk::ClearColorValue { float32: [BEFORE; 4] };
        let range = gaurast_testkit::range(vk::ImageAspectFlags::COLOR);
        // SAFETY: the image is alive and in that layout.
        unsafe {
            commands.device().cmd_clear_color_image(
                commands.raw,
                image.raw,
                vk::ImageLayout::GENERAL,
                &value,
                &[range],
            );
        }
        commands.barrier();
    });
    image
}

/// The left and the right pixel of the middle row of each layer, red and green.
fn pixels(image: &Image) -> Vec<[[f32; 2]; 2]> {
    let bytes = image.read(vk::ImageAspectFlags::COLOR, 16);
    let texels: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&bytes);
    let at = |layer: u32, x: u32| {
        let [red, green, ..] = texels[((layer * SIDE + SIDE / 2) * SIDE + x) as usize];
        [red, green]
    };
    (0..LAYERS).map(|layer| [at(layer, 1), at(layer, SIDE - 2)]).collect()
}

/// The expected pixels: those of a layer that is not a view, and those of a layer that was drawn to.
fn expected(mask: u32) -> Vec<[[f32; 2]; 2]> {
    (0..LAYERS)
        .map(|layer| match mask & (1 << layer) {
            0 => [[BEFORE; 2]; 2],
            _ => [[layer as f32; 2], [CLEARED; 2]],
        })
        .collect()
}

fn left_half() -> Vec<Vertex> {
    shapes::rectangle([-1.0, -1.0, 0.0, 1.0], 0.5, [1.0; 4])
}

/// A render pass with one attachment, which is cleared, and a subpass for each view mask.
fn render_pass(gpu: &Gpu, masks: &[u32], second: bool) -> vk::RenderPass {
    let attachment = [vk::AttachmentDescription::default()
        .format(vk::Format::R32G32B32A32_SFLOAT)
        .samples(vk::SampleCountFlags::TYPE_1)
        .load_op(vk::AttachmentLoadOp::CLEAR)
        .store_op(vk::AttachmentStoreOp::STORE)
        .initial_layout(vk::ImageLayout::GENERAL)
        .final_layout(vk::ImageLayout::GENERAL)];
    let attachments: Vec<_> = attachment.iter().cycle().take(1 + usize::from(second)).copied().collect();
    let general = vk::ImageLayout::GENERAL;
    let reference = |attachment| vk::AttachmentReference { attachment, layout: general };
    let (first, other) = ([reference(0)], [reference(1)]);
    let subpasses: Vec<_> = (0..masks.len())
        .map(|index| {
            let subpass = vk::SubpassDescription::default();
            match second && index == 1 {
                true => subpass.color_attachments(&other).input_attachments(&first),
                false => subpass.color_attachments(&first),
            }
        })
        .collect();
    let dependencies: Vec<_> = (1..masks.len() as u32)
        .map(|index| {
            vk::SubpassDependency::default()
                .src_subpass(index - 1)
                .dst_subpass(index)
                .src_stage_mask(vk::PipelineStageFlags::COLOR_ATTACHMENT_OUTPUT)
                .dst_stage_mask(vk::PipelineStageFlags::FRAGMENT_SHADER)
                .src_access_mask(vk::AccessFlags::COLOR_ATTACHMENT_WRITE)
                .dst_access_mask(vk::AccessFlags::INPUT_ATTACHMENT_READ)
                .dependency_flags(vk::DependencyFlags::BY_REGION | vk::DependencyFlags::VIEW_LOCAL)
        })
        .collect();
    let mut multiview = vk::RenderPassMultiviewCreateInfo::default().view_masks(masks);
    let info = vk::RenderPassCreateInfo::default()
        .attachments(&attachments)
        .subpasses(&subpasses)
        .dependencies(&dependencies)
        .push_next(&mut multiview);
    // SAFETY: the create info is valid.
    unsafe { gpu.device().create_render_pass(&info, None) }.expect("a render pass")
}

/// Runs a render pass over attachments; `draw` records each subpass.
fn run(gpu: &Gpu, pass: vk::RenderPass, views: &[vk::ImageView], draw: &[&dyn Fn(&gaurast_testkit::Commands)]) {
    let info =
        vk::FramebufferCreateInfo::default().render_pass(pass).attachments(views).width(SIDE).height(SIDE).layers(1);
    let clear = vk::ClearValue { color: vk::ClearColorValue { float32: [CLEARED; 4] } };
    let device = gpu.device();
    // SAFETY: all handles are alive until the device is idle.
    unsafe {
        let framebuffer = device.create_framebuffer(&info, None).expect("a framebuffer");
        gpu.run(|commands| {
            let clears = vec![clear; views.len()];
            let begin = vk::RenderPassBeginInfo::default()
                .render_pass(pass)
                .framebuffer(framebuffer)
                .render_area(vk::Rect2D {
                    offset: vk::Offset2D::default(),
                    extent: vk::Extent2D { width: SIDE, height: SIDE },
                })
                .clear_values(&clears);
            device.cmd_begin_render_pass(commands.raw, &begin, vk::SubpassContents::INLINE);
            for (index, draw) in draw.iter().enumerate() {
                if index > 0 {
                    device.cmd_next_subpass(commands.raw, vk::SubpassContents::INLINE);
                }
                commands.viewport([0.0, 0.0, SIDE as f32, SIDE as f32], [0.0, 1.0]);
                commands.scissor([0, 0], [SIDE; 2]);
                draw(commands);
            }
            device.cmd_end_render_pass(commands.raw);
            commands.barrier();
        });
        device.destroy_framebuffer(framebuffer, None);
    }
}

/// A target that gives pipelines its size and formats. Its contents are not used.
fn target(gpu: &Gpu) -> Target {
    let options = TargetOptions { size: [SIDE; 2], ..TargetOptions::of(vk::Format::R32G32B32A32_SFLOAT) };
    Target::new(gpu, &options)
}

fn views(pass: vk::RenderPass, subpass: u32) -> PipelineOptions<'static> {
    PipelineOptions {
        vertex: VERTEX,
        fragment: Some(FRAGMENT),
        subpass: Some((pass, subpass)),
        ..PipelineOptions::default()
    }
}

#[gaurast_runner::test(needs = [GLSLANG])]
fn render_passes_draw_every_view_to_its_layer() {
    let gpu = own();
    let (target, vertices) = (target(gpu), Buffer::of(gpu, &left_half()));
    for mask in [0b1, 0b11_1111, 0b101_0010] {
        let pass = render_pass(gpu, &[mask], false);
        let pipeline = Pipeline::new(gpu, &target, &views(pass, 0));
        let image = layered(gpu, vk::ImageUsageFlags::COLOR_ATTACHMENT);
        run(
            gpu,
            pass,
            &[image.view],
            &[&|commands| {
                commands.bind(&pipeline);
                commands.vertices(&vertices);
                commands.draw(0..6);
            }],
        );
        assert_eq!(pixels(&image), expected(mask), "{mask:b}");
        // SAFETY: the device is idle.
        unsafe { gpu.device().destroy_render_pass(pass, None) };
    }
}

/// With the flag, the index that shaders read is that of the device: of the group's one device, 0.
#[gaurast_runner::test(needs = [GLSLANG])]
fn the_index_may_be_the_devices() {
    let gpu = own();
    let (target, vertices) = (target(gpu), Buffer::of(gpu, &left_half()));
    let mask = 0b1101;
    let pass = render_pass(gpu, &[mask], false);
    let options = views(pass, 0);
    let flags = options.flags | vk::PipelineCreateFlags::VIEW_INDEX_FROM_DEVICE_INDEX;
    let pipeline = Pipeline::new(gpu, &target, &PipelineOptions { flags, ..options });
    let image = layered(gpu, vk::ImageUsageFlags::COLOR_ATTACHMENT);
    run(
        gpu,
        pass,
        &[image.view],
        &[&|commands| {
            commands.bind(&pipeline);
            commands.vertices(&vertices);
            commands.draw(0..6);
        }],
    );
    for (layer, [left, right]) in pixels(&image).into_iter().enumerate() {
        let [drawn, cleared] = if mask & (1 << layer) == 0 { [BEFORE; 2] } else { [0.0, CLEARED] };
        assert_eq!([left, right], [[drawn; 2], [cleared; 2]], "{layer}");
    }
    // SAFETY: the device is idle.
    unsafe { gpu.device().destroy_render_pass(pass, None) };
}

/// The first subpass with a view clears it, and later subpasses keep its contents.
#[gaurast_runner::test(needs = [GLSLANG])]
fn views_are_loaded_by_the_first_subpass_that_has_them() {
    let gpu = own();
    let (target, vertices) = (target(gpu), Buffer::of(gpu, &left_half()));
    let right = Buffer::of(gpu, &shapes::rectangle([0.0, -1.0, 1.0, 1.0], 0.5, [1.0; 4]));
    let pass = render_pass(gpu, &[0b11, 0b110], false);
    let pipelines = [0, 1].map(|subpass| Pipeline::new(gpu, &target, &views(pass, subpass)));
    let image = layered(gpu, vk::ImageUsageFlags::COLOR_ATTACHMENT);
    let draw = |index: usize, buffer| {
        let pipeline: &Pipeline = &pipelines[index];
        move |commands: &gaurast_testkit::Commands| {
            commands.bind(pipeline);
            commands.vertices(buffer);
            commands.draw(0..6);
        }
    };
    run(gpu, pass, &[image.view], &[&draw(0, &vertices), &draw(1, &right)]);
    let found = pixels(&image);
    assert_eq!(found[0], [[0.0; 2], [CLEARED; 2]], "first subpass only");
    assert_eq!(found[1], [[1.0; 2], [1.0; 2]], "both");
    assert_eq!(found[2], [[CLEARED; 2], [2.0; 2]], "second subpass only");
    assert_eq!(found[3], [[BEFORE; 2]; 2], "neither");
    // SAFETY: the device is idle.
    unsafe { gpu.device().destroy_render_pass(pass, None) };
}

/// A fragment reads the input attachment in its own view.
#[gaurast_runner::test(needs = [GLSLANG])]
fn input_attachments_are_read_in_the_view() {
    let gpu = own();
    let (target, vertices) = (target(gpu), Buffer::of(gpu, &left_half()));
    let mask = 0b10_0101;
    let pass = render_pass(gpu, &[mask, mask], true);
    let usage = vk::ImageUsageFlags::COLOR_ATTACHMENT | vk::ImageUsageFlags::INPUT_ATTACHMENT;
    let (first, second) = (layered(gpu, usage), layered(gpu, usage));
    let bindings = Bindings::new(gpu, &[Resource::Input(first.view)]);
    let writes = Pipeline::new(gpu, &target, &views(pass, 0));
    let reads = Pipeline::new(
        gpu,
        &target,
        &PipelineOptions {
            vertex: VERTEX,
            fragment: Some(
                "layout(input_attachment_index = 0, binding = 0) uniform subpassInput before;
                 layout(location = 0) flat in float view;
                 layout(location = 0) out vec4 color;
                 void main() { color = vec4(subpassLoad(before).x, view, 0.0, 1.0); }",
            ),
            bindings: Some(&bindings),
            subpass: Some((pass, 1)),
            ..PipelineOptions::default()
        },
    );
    run(
        gpu,
        pass,
        &[first.view, second.view],
        &[
            &|commands| {
                commands.bind(&writes);
                commands.vertices(&vertices);
                commands.draw(0..6);
            },
            &|commands| {
                commands.bind(&reads);
                commands.bind_set(&bindings, &[]);
                commands.vertices(&vertices);
                commands.draw(0..6);
            },
        ],
    );
    assert_eq!(pixels(&second), expected(mask));
    // SAFETY: the device is idle.
    unsafe { gpu.device().destroy_render_pass(pass, None) };
}

/// Dynamic rendering with views. A clear within it applies to all views. A query of several views uses consecutive
/// queries, the first of which counts the samples of all.
#[gaurast_runner::test(needs = [GLSLANG])]
fn dynamic_rendering_has_views() {
    let gpu = own();
    let (mask, device) = (0b101_0110u32, gpu.device());
    let vertices = Buffer::of(gpu, &left_half());
    let image = layered(gpu, vk::ImageUsageFlags::COLOR_ATTACHMENT);
    let target = target(gpu);
    let pipeline = Pipeline::new(
        gpu,
        &target,
        &PipelineOptions { view_mask: mask, subpass: None, ..views(vk::RenderPass::null(), 0) },
    );
    let views = mask.count_ones();
    let info = vk::QueryPoolCreateInfo::default().query_type(vk::QueryType::OCCLUSION).query_count(views);
    // SAFETY: all handles are alive until the device is idle.
    unsafe {
        let pool = device.create_query_pool(&info, None).expect("a query pool");
        gpu.run(|commands| {
            let attachment = [vk::RenderingAttachmentInfo::default()
                .image_view(image.view)
                .image_layout(vk::ImageLayout::GENERAL)
                .load_op(vk::AttachmentLoadOp::LOAD)
                .store_op(vk::AttachmentStoreOp::STORE)];
            let area =
                vk::Rect2D { offset: vk::Offset2D::default(), extent: vk::Extent2D { width: SIDE, height: SIDE } };
            let info = vk::RenderingInfo::default().render_area(area).view_mask(mask).color_attachments(&attachment);
            device.cmd_reset_query_pool(commands.raw, pool, 0, views);
            device.cmd_begin_rendering(commands.raw, &info);
            commands.viewport([0.0, 0.0, SIDE as f32, SIDE as f32], [0.0, 1.0]);
            commands.scissor([0, 0], [SIDE; 2]);
            let clear = vk::ClearAttachment::default()
                .aspect_mask(vk::ImageAspectFlags::COLOR)
                .clear_value(vk::ClearValue { color: vk::ClearColorValue { float32: [CLEARED; 4] } });
            let rect = vk::ClearRect::default().rect(area).layer_count(1);
            device.cmd_clear_attachments(commands.raw, &[clear], &[rect]);
            let precise = vk::QueryControlFlags::PRECISE;
            device.cmd_begin_query(commands.raw, pool, 0, precise);
            commands.bind(&pipeline);
            commands.vertices(&vertices);
            commands.draw(0..6);
            device.cmd_end_query(commands.raw, pool, 0);
            device.cmd_end_rendering(commands.raw);
            commands.barrier();
        });
        let mut results = vec![u32::MAX; views as usize];
        device
            .get_query_pool_results(pool, 0, &mut results, vk::QueryResultFlags::empty())
            .expect("all queries are available");
        assert_eq!(results.iter().sum::<u32>(), views * SIDE * SIDE / 2);
        device.destroy_query_pool(pool, None);
    }
    assert_eq!(pixels(&image), expected(mask));
}
