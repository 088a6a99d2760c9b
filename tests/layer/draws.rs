//! Mistakes in draws, as they are recorded.

use ash::vk;
use gaurast::vk::{
    GaussianCameraDistortionGAURAST, GaussianCameraModelGAURAST, GaussianGeometryGAURAST, GaussianOrderGAURAST,
    GaussianPrecisionGAURAST, GaussianResolveInputLocationsGAURAST,
};
use gaurast_testkit::shader::{Stage as ShaderStage, compile};
use gaurast_testkit::{Buffer, Commands, Gpu, Graphics, Image, ImageOptions, Message, Pass, Shader, Target, opaque};

use crate::stage::{IDENTITY, Mistake, SIZE, SPLAT, camera, drawing, instanced, mistake, recording, splats, with};

/// A draw of two Gaussians that `record` records.
fn draw(name: &'static str, id: &'static str, request: fn() -> Graphics<'static>, record: fn(&Commands)) -> Mistake {
    mistake(name, id, move |stage| drawing(&stage.full, &request(), &[SPLAT; 2], record))
}

/// The messages of a draw in a pass with views 0 and 2.
fn in_views(gpu: &Gpu) -> Vec<Message> {
    let options = ImageOptions {
        layers: 3,
        view: vk::ImageViewType::TYPE_2D_ARRAY,
        ..ImageOptions::new(vk::Format::R32G32B32A32_SFLOAT, SIZE, vk::ImageUsageFlags::COLOR_ATTACHMENT)
    };
    let image = Image::new(gpu, &options);
    let request = Graphics { view_mask: 0b101, ..splats() };
    let pipeline = request.create(gpu).expect("a pipeline");
    let buffer = Buffer::of(gpu, &SPLAT);
    let attachments = [vk::RenderingAttachmentInfo::default()
        .image_view(image.view)
        .image_layout(vk::ImageLayout::GENERAL)
        .load_op(vk::AttachmentLoadOp::CLEAR)];
    let [width, height] = SIZE;
    let info = vk::RenderingInfo::default()
        .render_area(vk::Rect2D::default().extent(vk::Extent2D { width, height }))
        .layer_count(1)
        .view_mask(0b101)
        .color_attachments(&attachments);
    recording(gpu, |commands| {
        // SAFETY: see the crate.
        unsafe { commands.device().cmd_begin_rendering(commands.raw, &info) };
        commands.bind(&pipeline);
        commands.viewport([0.0, 0.0, width as f32, height as f32], [0.0, 1.0]);
        commands.scissor([0, 0], SIZE);
        commands.vertices(&buffer);
        let gaussian = gpu.gaussian().expect("a device that draws Gaussians");
        // SAFETY: see the crate.
        unsafe {
            gaussian.cmd_set_gaussian_cameras(commands.raw, &[camera(); 2]);
            commands.device().cmd_draw(commands.raw, 1, 1, 0, 0);
            commands.device().cmd_end_rendering(commands.raw);
        }
    })
}

pub fn mistakes() -> Vec<Mistake> {
    let mut all = cameras();
    all.extend(ranges());
    all.extend(blending());
    all
}

fn cameras() -> Vec<Mistake> {
    let model = "VUID-vkCmdDraw-geometry-90071";
    let lens = "VUID-vkCmdDraw-None-90089";
    let through_a_lens = |commands: &Commands| {
        let mut lens = GaussianCameraDistortionGAURAST::default().tangential([0.01, 0.0]);
        commands.camera(&camera().push_next(&mut lens));
        commands.draw(0..2);
    };
    vec![
        draw("a draw without a camera", "GAURAST-Draw-no-camera", splats, |commands| {
            commands.draw(0..2);
        }),
        draw(
            "2D Gaussians through a fisheye",
            model,
            || with(|s| s.geometry(GaussianGeometryGAURAST::GAUSSIAN_2D)),
            |commands| {
                commands.camera(&camera().model(GaussianCameraModelGAURAST::FISHEYE));
                commands.draw(0..2);
            },
        ),
        draw(
            "binary16 through an equirectangular camera",
            model,
            || with(|s| s.precision(GaussianPrecisionGAURAST::FLOAT16)),
            |commands| {
                commands.camera(&camera().model(GaussianCameraModelGAURAST::EQUIRECTANGULAR));
                commands.draw(0..2);
            },
        ),
        draw(
            "2D Gaussians through a lens that distorts",
            lens,
            || with(|s| s.geometry(GaussianGeometryGAURAST::GAUSSIAN_2D)),
            through_a_lens,
        ),
        draw(
            "the per-pixel order through a lens that distorts",
            lens,
            || with(|s| s.order(GaussianOrderGAURAST::PER_PIXEL)),
            through_a_lens,
        ),
        mistake("two cameras for views 0 and 2", "VUID-vkCmdDraw-cameraCount-90063", |stage| in_views(&stage.full)),
        draw("a focal length in units of the picture", "GAURAST-Draw-focal-length", splats, |commands| {
            commands.camera(&camera().focal_length([1.2, 1.6]).principal_point([0.5, 0.5]));
            commands.draw(0..2);
        }),
        draw("a principal point of zeros", "GAURAST-Draw-principal-point", splats, |commands| {
            // Another eye than in other draws: cameras that differ in the principal point alone are of parts of one picture.
            commands.camera(&camera().eye([0.0, 0.01, 0.0]).principal_point([0.0; 2]));
            commands.draw(0..2);
        }),
    ]
}

/// A resolve shader that takes a factor from push constants.
const PUSHED: &str = "
    layout(location = 0) in vec4 accumulated;
    layout(push_constant) uniform Factor { vec4 factor; };
    layout(location = 0) out vec4 color;
    void main() { color = factor * accumulated; }";

fn ranges() -> Vec<Mistake> {
    let vertices = "GAURAST-Draw-vertices-past-buffer";
    let indexed = |indices: &'static [u32], count: u32, offset: i32| {
        move |stage: &crate::stage::Stage| {
            let buffer = Buffer::of(&stage.full, indices);
            drawing(&stage.full, &splats(), &[SPLAT; 2], |commands| {
                commands.camera(&camera());
                commands.indices(&buffer, 0, vk::IndexType::UINT32);
                commands.draw_indexed(0..count, offset);
            })
        }
    };
    let index = "GAURAST-Draw-index-past-vertices";
    vec![
        draw("more Gaussians than the buffer holds", vertices, splats, |commands| {
            commands.camera(&camera());
            commands.draw(0..3);
        }),
        draw("a first vertex in floats", vertices, splats, |commands| {
            commands.camera(&camera());
            commands.draw(14..15);
        }),
        mistake("more instances than matrices", vertices, |stage| {
            let models = Buffer::of(&stage.full, &IDENTITY);
            drawing(&stage.full, &instanced(), &[SPLAT], |commands| {
                commands.camera(&camera());
                commands.vertex_buffer(1, &models, 0);
                commands.draw_instances(0..1, 0..2);
            })
        }),
        mistake("positions that advance by instance", "GAURAST-Draw-instance-rate", |stage| {
            let mut request = splats();
            request.bindings[0].input_rate = vk::VertexInputRate::INSTANCE;
            drawing(&stage.full, &request, &[SPLAT; 2], |commands| {
                commands.camera(&camera());
                commands.draw(0..2);
            })
        }),
        mistake("push constants that were not pushed", "GAURAST-Draw-push-constants", |stage| {
            let request = splats().with_shader(Shader::fragment(compile(ShaderStage::Fragment, PUSHED)));
            let locations = GaussianResolveInputLocationsGAURAST::default().accumulated_color(0);
            let gaussian = request.gaussian.map(|state| state.resolve_input_locations(locations));
            let push = vk::PushConstantRange::default().stage_flags(vk::ShaderStageFlags::ALL_GRAPHICS).size(16);
            let request = Graphics { gaussian, push: vec![push], ..request };
            drawing(&stage.full, &request, &[SPLAT], |commands| {
                commands.camera(&camera());
                commands.draw(0..1);
            })
        }),
        draw("Gaussians as instances of one vertex", "GAURAST-Draw-instances", splats, |commands| {
            commands.camera(&camera());
            commands.draw_instances(0..1, 0..2);
        }),
        mistake("more indices than the buffer holds", "GAURAST-Draw-indices-past-buffer", indexed(&[0, 1], 3, 0)),
        mistake("an index of no Gaussian", index, indexed(&[0, 1, 2], 3, 0)),
        mistake("a vertex offset past the Gaussians", index, indexed(&[0, 1], 2, 1)),
        mistake("more Gaussians than a draw may have", "VUID-vkCmdDraw-maxGaussiansPerDraw-90083", |stage| {
            let pipeline = splats().create(&stage.full).expect("a pipeline");
            let buffer = Buffer::of(&stage.full, &SPLAT);
            let target = Target::floats(&stage.full, SIZE);
            recording(&stage.full, |commands| {
                commands.pass(&target, &Pass::zeros(), || {
                    commands.bind(&pipeline);
                    commands.vertices(&buffer);
                    commands.camera(&camera());
                    commands.draw_instances(0..u32::MAX, 0..u32::MAX);
                });
            })
        }),
    ]
}

fn blending() -> Vec<Mistake> {
    let off = "GAURAST-Draw-blending-off";
    let replacing = || Graphics { blend: vec![opaque()], ..splats() };
    vec![
        draw("a second draw that replaces the first", off, replacing, |commands| {
            commands.camera(&camera());
            commands.draw(0..1);
            commands.draw(1..2);
        }),
        mistake("a draw that replaces what was loaded", off, move |stage| {
            let pipeline = replacing().create(&stage.full).expect("a pipeline");
            let buffer = Buffer::of(&stage.full, &SPLAT);
            let target = Target::floats(&stage.full, SIZE);
            stage.full.run(|commands| commands.pass(&target, &Pass::zeros(), || ()));
            recording(&stage.full, |commands| {
                commands.pass(&target, &Pass::load(), || {
                    commands.bind(&pipeline);
                    commands.vertices(&buffer);
                    commands.camera(&camera());
                    commands.draw(0..1);
                });
            })
        }),
    ]
}
