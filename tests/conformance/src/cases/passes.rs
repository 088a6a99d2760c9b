//! Render pass objects, subpasses, secondary command buffers, rendering in several parts, layers.

use ash::vk;
use gaurast_testkit::{Attachments, Commands, Gpu, Graphics, Image, Pass, PassObject, Pipeline, Recorded};

use super::chapter::Chapter;
use super::input::vertices;
use super::scenes::dense;
use crate::draw::Draw;
use crate::program::{Program, colors};
use crate::rendering::{FORMAT, Rendering, colors_by_layer, layers};
use crate::stage::Stage;

/// What is behind the Gaussians.
const BEHIND: [f32; 4] = [0.2, 0.4, 0.6, 0.8];

/// Two sets over each other.
fn halves(seed: u64) -> Draw {
    Draw { behind: BEHIND, calls: vec![vertices(0, 250), vertices(250, 250)], ..Draw::new(dense(seed, 0)) }
}

pub(super) fn passes(chapter: &mut Chapter<'_>) {
    chapter.program("cleared", || {
        Program::on_stage(halves(491), |stage| {
            // Clears something else first, so that it matters that attachments are cleared.
            stage.gpu.run(|commands| commands.pass(&stage.target, &Pass::clear([0.9, 0.1, 0.5, 0.3]), || {}));
            stage.gpu.run(|commands| {
                commands.pass(&stage.target, &Pass::clear(BEHIND), || {
                    stage.bind(commands);
                    commands.draw(0..250);
                    commands.draw(250..500);
                });
            });
        })
    });
    chapter.program("loaded", || {
        Program::on_stage(halves(492), |stage| {
            stage.run(|commands| commands.draw(0..250));
            stage.run(|commands| commands.draw(250..500));
        })
    });
    chapter.program("object", || {
        Program::on_stage(halves(493), |stage| {
            let object = PassObject::new(&stage.target);
            let pipeline = stage.pipeline(stage.draw, &|graphics| graphics.subpass = Some((object.render_pass, 0)));
            stage.gpu.run(|commands| {
                commands.pass(&object, &Pass::clear(BEHIND), || {
                    stage.bind_with(commands, &pipeline);
                    commands.draw(0..250);
                    commands.draw(250..500);
                });
            });
        })
    });
    chapter.program("subpasses", || Program::on_stage(halves(494), subpasses));
    secondaries(chapter);
    parts(chapter);
    chapter.program("base_layer", base_layer);
}

/// A render pass with two subpasses, in each of which a half is drawn.
fn subpasses(stage: &Stage<'_>) {
    let device = stage.gpu.device();
    let attachments = [vk::AttachmentDescription::default()
        .format(FORMAT)
        .samples(vk::SampleCountFlags::TYPE_1)
        .load_op(vk::AttachmentLoadOp::LOAD)
        .store_op(vk::AttachmentStoreOp::STORE)
        .initial_layout(vk::ImageLayout::GENERAL)
        .final_layout(vk::ImageLayout::GENERAL)];
    let references = [vk::AttachmentReference::default().layout(vk::ImageLayout::GENERAL)];
    let subpasses = [vk::SubpassDescription::default().color_attachments(&references); 2];
    let dependency = vk::SubpassDependency::default()
        .dst_subpass(1)
        .src_stage_mask(vk::PipelineStageFlags::COLOR_ATTACHMENT_OUTPUT)
        .dst_stage_mask(vk::PipelineStageFlags::COLOR_ATTACHMENT_OUTPUT)
        .src_access_mask(vk::AccessFlags::COLOR_ATTACHMENT_WRITE)
        .dst_access_mask(vk::AccessFlags::COLOR_ATTACHMENT_READ | vk::AccessFlags::COLOR_ATTACHMENT_WRITE)
        .dependency_flags(vk::DependencyFlags::BY_REGION);
    let dependencies = [dependency];
    let info =
        vk::RenderPassCreateInfo::default().attachments(&attachments).subpasses(&subpasses).dependencies(&dependencies);
    let [width, height] = stage.draw.size;
    let views = [stage.target.colors[0].attachment];
    // SAFETY: the render pass is valid, and what is created here is destroyed after the commands have run.
    unsafe {
        let pass = device.create_render_pass(&info, None).expect("a render pass");
        let info = vk::FramebufferCreateInfo::default()
            .render_pass(pass)
            .attachments(&views)
            .width(width)
            .height(height)
            .layers(1);
        let framebuffer = device.create_framebuffer(&info, None).expect("a framebuffer");
        let pipelines: [Pipeline; 2] =
            [0, 1].map(|subpass| stage.pipeline(stage.draw, &|graphics| graphics.subpass = Some((pass, subpass))));
        stage.gpu.run(|commands| {
            let (device, raw) = commands.raw();
            let info = vk::RenderPassBeginInfo::default()
                .render_pass(pass)
                .framebuffer(framebuffer)
                .render_area(vk::Rect2D::default().extent(vk::Extent2D { width, height }));
            commands.barrier();
            device.cmd_begin_render_pass(raw, &info, vk::SubpassContents::INLINE);
            stage.bind_with(commands, &pipelines[0]);
            commands.draw(0..250);
            device.cmd_next_subpass(raw, vk::SubpassContents::INLINE);
            // The camera stays, as all state of the command buffer does.
            commands.bind(&pipelines[1]);
            commands.draw(250..500);
            device.cmd_end_render_pass(raw);
            commands.barrier();
        });
        device.destroy_framebuffer(framebuffer, None);
        device.destroy_render_pass(pass, None);
    }
}

/// A secondary command buffer for dynamic rendering over the stage's attachments.
fn secondary(stage: &Stage<'_>, record: impl FnOnce(&Commands)) -> Recorded {
    let formats = stage.target.attachment_formats().colors;
    let mut rendering = vk::CommandBufferInheritanceRenderingInfo::default()
        .color_attachment_formats(&formats)
        .rasterization_samples(vk::SampleCountFlags::TYPE_1);
    let inheritance = vk::CommandBufferInheritanceInfo::default().push_next(&mut rendering);
    stage.gpu.record_secondary(&inheritance, |commands| {
        stage.bind(commands);
        record(commands);
    })
}

/// Executes secondary command buffers in a pass over the stage's attachments.
fn execute(stage: &Stage<'_>, all: &[Recorded]) {
    let flags = vk::RenderingFlags::CONTENTS_SECONDARY_COMMAND_BUFFERS;
    let buffers: Vec<_> = all.iter().map(|recorded| recorded.raw).collect();
    stage.gpu.run(|commands| {
        commands.pass(&stage.target, &Pass { flags, ..Pass::load() }, || {
            let (device, raw) = commands.raw();
            // SAFETY: the secondary command buffers are for this pass.
            unsafe { device.cmd_execute_commands(raw, &buffers) };
        });
    });
}

fn secondaries(chapter: &mut Chapter<'_>) {
    chapter.program("secondaries.one", || {
        Program::on_stage(halves(495), |stage| {
            let one = secondary(stage, |commands| {
                commands.draw(0..250);
                commands.draw(250..500);
            });
            execute(stage, &[one]);
        })
    });
    chapter.program("secondaries.two", || {
        Program::on_stage(halves(496), |stage| {
            let first = secondary(stage, |commands| commands.draw(0..250));
            let second = secondary(stage, |commands| commands.draw(250..500));
            execute(stage, &[first, second]);
        })
    });
    chapter.program("secondaries.sets", || {
        let draw = Draw {
            merged: true,
            behind: BEHIND,
            calls: vec![vertices(0, 300), crate::draw::Call::EndSet, vertices(300, 200)],
            ..Draw::new(dense(497, 0))
        };
        Program::on_stage(draw, |stage| {
            let first = secondary(stage, |commands| {
                commands.gaussian_set(|| {
                    commands.draw(0..100);
                    commands.draw(100..300);
                });
            });
            let second = secondary(stage, |commands| {
                commands.gaussian_set(|| {
                    commands.draw(300..400);
                    commands.draw(400..500);
                });
            });
            execute(stage, &[first, second]);
        })
    });
    chapter.program("secondaries.of_a_pass_object", || {
        Program::on_stage(halves(498), |stage| {
            let object = PassObject::new(&stage.target);
            let pipeline = stage.pipeline(stage.draw, &|graphics| graphics.subpass = Some((object.render_pass, 0)));
            let inheritance = vk::CommandBufferInheritanceInfo::default().render_pass(object.render_pass);
            let halves = [0..250, 250..500].map(|range| {
                stage.gpu.record_secondary(&inheritance, |commands| {
                    stage.bind_with(commands, &pipeline);
                    commands.draw(range);
                })
            });
            let buffers = halves.each_ref().map(|recorded| recorded.raw);
            stage.gpu.run(|commands| {
                object.execute(commands, BEHIND, &buffers);
            });
        })
    });
}

/// Rendering that is suspended and resumed.
fn parts(chapter: &mut Chapter<'_>) {
    for (name, clear) in [("loaded", None), ("cleared", Some(BEHIND))] {
        chapter.program(format!("resumed.{name}"), move || {
            Program::on_stage(halves(499), move |stage| {
                stage.gpu.run(|commands| in_parts(stage, commands, clear));
            })
        });
    }
    chapter.program("resumed.in_another_command_buffer", || {
        Program::on_stage(halves(500), |stage| {
            let [first, second] = split(stage, Some(BEHIND));
            let first = stage.gpu.record(|commands| {
                commands.barrier();
                first.record(commands, || {
                    stage.bind(commands);
                    commands.draw(0..250);
                });
            });
            let second = stage.gpu.record(|commands| {
                second.record(commands, || {
                    stage.bind(commands);
                    commands.draw(250..500);
                });
                commands.barrier();
            });
            submit(stage.gpu, &[first.raw, second.raw]);
        })
    });
}

/// The two parts of a rendering over the stage's attachment.
fn split<'a>(stage: &'a Stage<'_>, clear: Option<[f32; 4]>) -> [Rendering<'a>; 2] {
    let views = std::slice::from_ref(&stage.target.colors[0].attachment);
    let whole = Rendering { clear, ..Rendering::over(views, stage.draw.size) };
    [vk::RenderingFlags::SUSPENDING, vk::RenderingFlags::RESUMING].map(|flags| Rendering { flags, ..whole })
}

fn in_parts(stage: &Stage<'_>, commands: &Commands, clear: Option<[f32; 4]>) {
    let [first, second] = split(stage, clear);
    commands.barrier();
    first.record(commands, || {
        stage.bind(commands);
        commands.draw(0..250);
    });
    second.record(commands, || commands.draw(250..500));
    commands.barrier();
}

/// Submits command buffers at once, and waits.
pub(super) fn submit(gpu: &Gpu, buffers: &[vk::CommandBuffer]) {
    let submits = [vk::SubmitInfo::default().command_buffers(buffers)];
    // SAFETY: no other thread submits.
    unsafe {
        gpu.device().queue_submit(gpu.queue(), &submits, vk::Fence::null()).expect("it is submitted");
        gpu.device().queue_wait_idle(gpu.queue()).expect("it finishes");
    }
}

/// The second layer of an image is drawn to, and the first is as it was.
fn base_layer() -> Program {
    let draw = halves(501);
    let first = Draw { calls: Vec::new(), ..draw.clone() };
    Program::pictures(vec![first, draw.clone()], move |gpu| {
        let image: Image = layers(gpu, draw.size, 2, BEHIND);
        let stage = Stage::changed(gpu, &draw, &|_: &mut Graphics<'_>| {});
        let range = vk::ImageSubresourceRange {
            base_array_layer: 1,
            layer_count: 1,
            ..gaurast_testkit::range(vk::ImageAspectFlags::COLOR)
        };
        let info = vk::ImageViewCreateInfo::default()
            .image(image.raw)
            .view_type(vk::ImageViewType::TYPE_2D)
            .format(FORMAT)
            .subresource_range(range);
        // SAFETY: the image has the layer; the view is destroyed after the commands have run.
        let view = unsafe { gpu.device().create_image_view(&info, None) }.expect("a view");
        gpu.run(|commands| {
            Rendering::over(&[view], draw.size).record(commands, || {
                stage.bind(commands);
                commands.draw(0..250);
                commands.draw(250..500);
            });
        });
        // SAFETY: the commands have run.
        unsafe { gpu.device().destroy_image_view(view, None) };
        Ok(colors_by_layer(&image).into_iter().map(colors).collect())
    })
}
