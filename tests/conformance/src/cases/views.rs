//! Multiview: a camera for each view, or one for all.

use gaurast::vk::{GaussianCameraDataGAURAST, GaussianCameraSourceGAURAST, GaussianOrderGAURAST as Order};
use gaurast_testkit::{Bindings, Buffer, Graphics, Resource};

use super::chapter::Chapter;
use super::scenes::{dense, front};
use crate::draw::{Camera, Draw};
use crate::program::{Program, colors};
use crate::rendering::{Rendering, colors_by_layer, layers};
use crate::stage::Stage;

/// The contents of the layers before.
const BEHIND: [f32; 4] = [0.1, 0.2, 0.3, 0.4];

/// The place of the cameras.
#[derive(Clone, Copy, PartialEq)]
enum Source {
    Command,
    Buffer,
}

/// Cameras beside each other, which differ in their principal points too.
fn eyes() -> [Camera; 3] {
    [-1.0_f32, 0.0, 1.0].map(|side| {
        let [x, y] = front().principal_point;
        front().eye([0.2 * f64::from(side), 0.05, -0.3]).principal_point([x - 7.0 * side, y + 2.0 * side])
    })
}

/// Draws a scene to layers by one pass with views. Each layer shows what the camera of its index, or the only one, sees.
fn program(draw: Draw, view_mask: u32, cameras: Vec<Camera>, source: Source) -> Program {
    let of_layer = |layer: usize| {
        let seen = Draw { behind: BEHIND, ..draw.clone() };
        match view_mask >> layer & 1 {
            0 => Draw { calls: Vec::new(), ..seen },
            _ => seen.seen_by(cameras[if cameras.len() == 1 { 0 } else { layer }]),
        }
    };
    let pictures = (0..3).map(of_layer).collect();
    let program = Program::pictures(pictures, move |gpu| {
        let image = layers(gpu, draw.size, 3, BEHIND);
        let data: Vec<[u8; 128]> =
            cameras.iter().map(|camera| GaussianCameraDataGAURAST::from(camera).to_bytes()).collect();
        let buffer = Buffer::of(gpu, data.as_flattened());
        let set = Bindings::new(gpu, &[Resource::Uniform(buffer.raw)]);
        let change = |graphics: &mut Graphics<'_>| {
            graphics.view_mask = view_mask;
            if source == Source::Buffer {
                let state = graphics.gaussian.expect("a Gaussian state");
                let state = state.camera_source(GaussianCameraSourceGAURAST::UNIFORM_BUFFER);
                graphics.gaussian = Some(state.camera_count(cameras.len() as u32));
                graphics.set_layouts = vec![set.layout];
            }
        };
        let stage = Stage::changed(gpu, &draw, &change);
        let views = [image.view];
        let rendering = Rendering { view_mask, ..Rendering::over(&views, draw.size) };
        gpu.run(|commands| {
            rendering.record(commands, || {
                stage.bind(commands);
                match source {
                    Source::Buffer => commands.bind_set(&set, &[]),
                    Source::Command => {
                        let gaussian = gpu.gaussian().expect("a device that draws Gaussians");
                        // SAFETY: the commands are being recorded.
                        unsafe { gaussian.cmd_set_gaussian_cameras(commands.raw, &cameras) };
                    }
                }
                commands.draw(0..stage.scene.count);
            });
        });
        Ok(colors_by_layer(&image).into_iter().map(colors).collect())
    });
    let program = program.needing("gaussianMultiview");
    if source == Source::Buffer { program.needing("uniformBufferCamera") } else { program }
}

pub(super) fn views(chapter: &mut Chapter<'_>) {
    for (source_name, source) in [("command", Source::Command), ("buffer", Source::Buffer)] {
        for (name, mask, count) in [
            ("three", 0b111, 3),
            ("first_and_third", 0b101, 3),
            ("third", 0b100, 3),
            ("first_two", 0b11, 2),
            ("one_camera", 0b111, 1),
            ("further_cameras", 0b1, 3),
        ] {
            chapter.program(format!("{source_name}.{name}"), move || {
                program(Draw::new(dense(481, 1)), mask, eyes()[..count].to_vec(), source)
            });
        }
    }
    for (name, order) in
        [("radial_distance", Order::RADIAL_DISTANCE), ("primitive", Order::PRIMITIVE), ("per_pixel", Order::PER_PIXEL)]
    {
        chapter.program(format!("order.{name}"), move || {
            let draw = Draw::new(dense(482, 0)).in_state(|state| state.order(order));
            program(draw, 0b101, eyes().to_vec(), Source::Command)
        });
    }
}
