//! Spherical harmonics in a buffer that is given by its address.

use ash::vk;
use gaurast::vk::{
    GaussianSphericalHarmonicsBufferGAURAST as Harmonics, PipelineGaussianStateCreateFlagsGAURAST as Flags,
};
use gaurast_testkit::{Addressed, Commands, Gpu, Graphics};
use half::f16;

use super::chapter::Chapter;
use super::input::{placed, placements, vertices};
use super::scenes::{dense, part};
use crate::draw::Draw;
use crate::program::Program;
use crate::stage::Stage;

/// A draw whose harmonics are in a buffer.
fn in_buffer(draw: Draw) -> Draw {
    draw.in_state(|state| state.flags(Flags::SPHERICAL_HARMONICS_BUFFER))
}

/// Takes the attributes of harmonics away.
fn without_attributes(graphics: &mut Graphics<'_>) {
    graphics.attributes.retain(|attribute| attribute.binding != 4);
    graphics.bindings.retain(|binding| binding.binding != 4);
}

/// Records a binding of harmonics.
fn bind(commands: &Commands, harmonics: &Harmonics<'_>) {
    let gaussian = commands.gpu().gaussian().expect("a device that draws Gaussians");
    // SAFETY: the buffer lives until the commands have run.
    unsafe { gaussian.cmd_bind_gaussian_spherical_harmonics(commands.raw, harmonics) };
}

/// How coefficients lie in the buffer: bytes from the buffer's beginning, from Gaussian to Gaussian and from coefficient
/// to coefficient.
#[derive(Clone, Copy)]
struct Layout {
    start: usize,
    stride: usize,
    coefficient_stride: usize,
    format: vk::Format,
}

impl Layout {
    /// The buffer with the coefficients of a draw, of which the last bytes are no part.
    fn buffer(self, gpu: &Gpu, draw: &Draw) -> Addressed {
        let triples = (draw.scene.degree + 1).pow(2) as usize;
        let count = draw.scene.positions.len();
        let end = self.start + (count - 1) * self.stride + (triples - 1) * self.coefficient_stride + 16;
        let mut bytes = vec![0x3c_u8; end + 256];
        for (at, triple) in draw.scene.sh.iter().enumerate() {
            let to = self.start + at / triples * self.stride + at % triples * self.coefficient_stride;
            match self.format {
                vk::Format::R16G16B16A16_SFLOAT => {
                    let halves = triple.map(|c| f16::from_f32(c).to_bits());
                    bytes[to..to + 6].copy_from_slice(bytemuck::cast_slice(&halves));
                }
                _ => bytes[to..to + 12].copy_from_slice(bytemuck::cast_slice(triple)),
            }
        }
        Addressed::of(gpu, &bytes)
    }

    fn harmonics(self, buffer: &Addressed) -> Harmonics<'static> {
        Harmonics::default()
            .device_address(buffer.address + self.start as u64)
            .size(buffer.size - self.start as u64 - 256)
            .format(self.format)
            .stride(self.stride as u32)
            .coefficient_stride(self.coefficient_stride as u64)
    }
}

const FLOATS: vk::Format = vk::Format::R32G32B32_SFLOAT;

pub(super) fn harmonics_buffer(chapter: &mut Chapter<'_>) {
    for degree in 0..=4_u32 {
        let triples = (degree as usize + 1).pow(2);
        let packed = Layout { start: 64, stride: 12 * triples, coefficient_stride: 12, format: FLOATS };
        let apart = Layout { stride: 20 * triples + 8, coefficient_stride: 20, ..packed };
        let planes = Layout { stride: 12, coefficient_stride: 12 * 500, ..packed };
        let halves =
            Layout { stride: 8 * triples, coefficient_stride: 8, format: vk::Format::R16G16B16A16_SFLOAT, ..packed };
        for (name, layout) in [("packed", packed), ("apart", apart), ("planes", planes), ("halves", halves)] {
            chapter.program(format!("{name}.degree_{degree}"), move || {
                let mut draw = in_buffer(Draw::new(dense(461, degree)));
                if layout.format != FLOATS {
                    draw.scene.sh.as_flattened_mut().iter_mut().for_each(|c| *c = f16::from_f32(*c).to_f32());
                }
                Program::changed(draw, without_attributes, move |stage| {
                    let buffer = layout.buffer(stage.gpu, stage.draw);
                    stage.run(|commands| {
                        bind(commands, &layout.harmonics(&buffer));
                        commands.draw(0..500);
                    });
                })
            });
        }
    }
    let packed = Layout { start: 64, stride: 48, coefficient_stride: 12, format: FLOATS };
    // Coefficients beyond the size are zeros, also those that lie there in part.
    for (name, size) in [("whole", 48 * 100), ("in_part", 48 * 100 + 8)] {
        chapter.program(format!("size.{name}"), move || {
            let mut draw = in_buffer(Draw::new(dense(462, 1)));
            let all = draw.scene.sh.clone();
            draw.scene.sh[400..].fill([0.0; 3]);
            Program::changed(draw, without_attributes, move |stage| {
                let mut stored = stage.draw.clone();
                stored.scene.sh.clone_from(&all);
                let buffer = packed.buffer(stage.gpu, &stored);
                stage.run(|commands| {
                    bind(commands, &packed.harmonics(&buffer).size(size));
                    commands.draw(0..500);
                });
            })
        });
    }
    chapter.program("rebound", move || {
        let draw = Draw { calls: vec![vertices(0, 200), vertices(200, 300)], ..Draw::new(dense(463, 1)) };
        Program::changed(in_buffer(draw), without_attributes, move |stage| two(stage, packed, |_, draw| draw()))
    });
    chapter.program("first_vertex", move || {
        let draw = Draw { calls: vec![vertices(170, 300)], ..Draw::new(dense(464, 1)) };
        Program::changed(in_buffer(draw), without_attributes, move |stage| {
            let buffer = packed.buffer(stage.gpu, stage.draw);
            stage.run(|commands| {
                bind(commands, &packed.harmonics(&buffer));
                commands.draw(170..470);
            });
        })
    });
    chapter.program("instances", move || {
        let draw = in_buffer(placed(vk::VertexInputRate::INSTANCE, placements(), 1));
        Program::changed(draw, without_attributes, move |stage| {
            let buffer = packed.buffer(stage.gpu, stage.draw);
            stage.run(|commands| {
                bind(commands, &packed.harmonics(&buffer));
                commands.draw_instances(0..90, 0..6);
            });
        })
    });
}

/// Draws two parts of a scene, whose vertices and harmonics are in buffers of their own.
fn two(stage: &Stage<'_>, layout: Layout, wrap: impl Fn(&Commands, &dyn Fn())) {
    let parts = [0..200, 200..500].map(|range| Draw::new(part(&stage.draw.scene, range)));
    let harmonics = parts.each_ref().map(|part| layout.buffer(stage.gpu, part));
    let scenes = parts.each_ref().map(|part| stage.other(&part.scene));
    stage.run(|commands| {
        wrap(commands, &|| {
            for (scene, harmonics) in scenes.iter().zip(&harmonics) {
                scene.bind_buffers(commands);
                bind(commands, &layout.harmonics(harmonics));
                commands.draw(0..scene.count);
            }
        });
    });
}

/// A set whose draws have harmonics in buffers of their own, for the chapter of sets.
pub(super) fn in_a_set(chapter: &mut Chapter<'_>) {
    let packed = Layout { start: 64, stride: 48, coefficient_stride: 12, format: FLOATS };
    chapter.program("harmonics", move || {
        let draw = in_buffer(Draw { merged: true, ..Draw::new(dense(465, 1)) });
        Program::changed(draw, without_attributes, move |stage| {
            two(stage, packed, |commands, draw| commands.gaussian_set(draw));
        })
    });
}
