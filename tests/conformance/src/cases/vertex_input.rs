//! Vertex input: formats, offsets, strides, input rates and locations of attributes.

use ash::vk;
use gaurast_oracle::scenes::SceneBuffers;
use gaurast_testkit::{Buffer, Graphics, bind_instances};
use half::f16;

use super::chapter::Chapter;
use super::input::{placed, placements, vertices};
use super::scenes::{cloud, dense, front, part};
use crate::draw::{Call, Draw};
use crate::program::Program;

/// A vertex format that packs four numbers, or one.
#[derive(Clone, Copy)]
struct Packing {
    name: &'static str,
    /// The format of one component, if there is one, and that of four.
    formats: [vk::Format; 2],
    pack: fn([f32; 4]) -> Vec<u8>,
    /// The number that is read for one that is packed.
    read: fn(f32) -> f32,
}

/// A normalised number's integer, and the number that is read for it.
fn unorm(value: f32, greatest: f32) -> f32 {
    (value.clamp(0.0, 1.0) * greatest).round()
}

fn snorm(value: f32, greatest: f32) -> f32 {
    (value.clamp(-1.0, 1.0) * greatest).round()
}

const PACKINGS: [Packing; 9] = [
    Packing {
        name: "unorm8",
        formats: [vk::Format::R8_UNORM, vk::Format::R8G8B8A8_UNORM],
        pack: |values| values.map(|value| unorm(value, 255.0) as u8).to_vec(),
        read: |value| unorm(value, 255.0) / 255.0,
    },
    Packing {
        name: "snorm8",
        formats: [vk::Format::R8_SNORM, vk::Format::R8G8B8A8_SNORM],
        pack: |values| values.map(|value| snorm(value, 127.0) as i8 as u8).to_vec(),
        read: |value| snorm(value, 127.0) / 127.0,
    },
    Packing {
        name: "unorm16",
        formats: [vk::Format::R16_UNORM, vk::Format::R16G16B16A16_UNORM],
        pack: |values| values.iter().flat_map(|&value| (unorm(value, 65535.0) as u16).to_ne_bytes()).collect(),
        read: |value| unorm(value, 65535.0) / 65535.0,
    },
    Packing {
        name: "snorm16",
        formats: [vk::Format::R16_SNORM, vk::Format::R16G16B16A16_SNORM],
        pack: |values| values.iter().flat_map(|&value| (snorm(value, 32767.0) as i16).to_ne_bytes()).collect(),
        read: |value| snorm(value, 32767.0) / 32767.0,
    },
    Packing {
        name: "sfloat16",
        formats: [vk::Format::R16_SFLOAT, vk::Format::R16G16B16A16_SFLOAT],
        pack: |values| values.iter().flat_map(|&value| f16::from_f32(value).to_ne_bytes()).collect(),
        read: |value| f16::from_f32(value).to_f32(),
    },
    Packing {
        name: "bgra8",
        formats: [vk::Format::UNDEFINED, vk::Format::B8G8R8A8_UNORM],
        pack: |[red, green, blue, alpha]| [blue, green, red, alpha].map(|value| unorm(value, 255.0) as u8).to_vec(),
        read: |value| unorm(value, 255.0) / 255.0,
    },
    Packing {
        name: "unorm10",
        formats: [vk::Format::UNDEFINED, vk::Format::A2B10G10R10_UNORM_PACK32],
        pack: |[red, green, blue, _]| {
            let [red, green, blue] = [red, green, blue].map(|value| unorm(value, 1023.0) as u32);
            (red | green << 10 | blue << 20 | 3 << 30).to_ne_bytes().to_vec()
        },
        read: |value| unorm(value, 1023.0) / 1023.0,
    },
    Packing {
        name: "uscaled8",
        formats: [vk::Format::UNDEFINED, vk::Format::R8G8B8A8_USCALED],
        pack: |values| values.map(|value| value.round().clamp(0.0, 255.0) as u8).to_vec(),
        read: |value| value.round().clamp(0.0, 255.0),
    },
    Packing {
        name: "sfloat32",
        formats: [vk::Format::R32_SFLOAT, vk::Format::R32G32B32A32_SFLOAT],
        pack: |values| values.iter().flat_map(|value| value.to_ne_bytes()).collect(),
        read: |value| value,
    },
];

/// An attribute of a Gaussian, whose binding and location have its number.
#[derive(Clone, Copy)]
struct Attribute {
    name: &'static str,
    binding: usize,
    components: usize,
    /// The numbers of a vertex, of which further ones are not read.
    get: fn(&SceneBuffers, usize) -> [f32; 4],
    set: fn(&mut SceneBuffers, usize, [f32; 4]),
    /// The packings that it has.
    packings: &'static [&'static str],
}

/// What the components hold that are not read.
const UNREAD: f32 = 0.75;

const ATTRIBUTES: [Attribute; 5] = [
    Attribute {
        name: "position",
        binding: 0,
        components: 3,
        get: |scene, at| {
            let [x, y, z] = scene.positions[at];
            [x, y, z, UNREAD]
        },
        set: |scene, at, [x, y, z, _]| scene.positions[at] = [x, y, z],
        packings: &["snorm16", "sfloat16", "sfloat32"],
    },
    Attribute {
        name: "scale",
        binding: 1,
        components: 3,
        get: |scene, at| {
            let [x, y, z] = scene.scales[at];
            [x, y, z, UNREAD]
        },
        set: |scene, at, [x, y, z, _]| scene.scales[at] = [x, y, z],
        packings: &["unorm8", "unorm16", "snorm16", "sfloat16", "unorm10", "bgra8", "sfloat32"],
    },
    Attribute {
        name: "rotation",
        binding: 2,
        components: 4,
        get: |scene, at| scene.rotations[at],
        set: |scene, at, rotation| scene.rotations[at] = rotation,
        packings: &["snorm8", "snorm16", "sfloat16"],
    },
    Attribute {
        name: "opacity",
        binding: 3,
        components: 1,
        get: |scene, at| [scene.opacities[at], 0.2, 0.9, 0.4],
        set: |scene, at, [opacity, ..]| scene.opacities[at] = opacity,
        packings: &["unorm8", "snorm8", "unorm16", "snorm16", "sfloat16", "bgra8", "unorm10", "sfloat32"],
    },
    Attribute {
        name: "coefficient",
        binding: 4,
        components: 3,
        get: |scene, at| {
            let [red, green, blue] = scene.sh[at];
            [red, green, blue, UNREAD]
        },
        set: |scene, at, [red, green, blue, _]| scene.sh[at] = [red, green, blue],
        packings: &["unorm8", "snorm8", "unorm16", "snorm16", "sfloat16", "bgra8", "unorm10", "uscaled8", "sfloat32"],
    },
];

/// A scene of a sixteenth of the usual size, whose positions and scales are within -1 and 1, and looks as ever.
fn small(seed: u64) -> Draw {
    let mut scene = dense(seed, 0);
    scene.positions.as_flattened_mut().iter_mut().for_each(|c| *c /= 16.0);
    scene.scales.as_flattened_mut().iter_mut().for_each(|c| *c /= 16.0);
    // Colours of all components, in the range of every format.
    for (at, triple) in scene.sh.iter_mut().enumerate() {
        *triple = [at % 3, at % 5, at % 7].map(|part| part as f32 / 5.0 - 0.3);
    }
    Draw::new(scene).seen_by(front().near_plane(0.0125))
}

pub(super) fn vertex_input(chapter: &mut Chapter<'_>) {
    for attribute in ATTRIBUTES {
        for name in attribute.packings {
            let packing = *PACKINGS.iter().find(|packing| packing.name == *name).expect("a packing");
            for one in [true, false] {
                // Fewer components than are read are not valid.
                let format = packing.formats[usize::from(!one)];
                if format == vk::Format::UNDEFINED || (one && attribute.components > 1) {
                    continue;
                }
                let width = if one { 1 } else { 4 };
                chapter.program(format!("{}.{name}_{width}", attribute.name), move || {
                    packed(attribute, packing, format, one)
                });
            }
        }
    }
    places(chapter);
    strides(chapter);
    rates(chapter);
}

/// One attribute in another format.
fn packed(attribute: Attribute, packing: Packing, format: vk::Format, one: bool) -> Program {
    let mut draw = small(431);
    let mut bytes = Vec::new();
    for at in 0..draw.scene.positions.len() {
        let values = (attribute.get)(&draw.scene, at);
        let mut packed = (packing.pack)(values);
        packed.truncate(if one { packed.len() / 4 } else { packed.len() });
        bytes.extend(packed);
        (attribute.set)(&mut draw.scene, at, values.map(packing.read));
    }
    let stride = (bytes.len() / draw.scene.positions.len()) as u32;
    let change = move |graphics: &mut Graphics<'_>| {
        graphics.bindings[attribute.binding].stride = stride;
        graphics.attributes[attribute.binding].format = format;
    };
    Program::changed(draw, change, move |stage| {
        let buffer = Buffer::of(stage.gpu, &bytes);
        stage.run(|commands| {
            commands.vertex_buffer(attribute.binding as u32, &buffer, 0);
            commands.draw(0..stage.scene.count);
        });
    })
}

/// The floats of all attributes of each vertex, `stride` floats apart.
fn interleaved(scene: &SceneBuffers, stride: usize) -> Vec<f32> {
    let mut floats = Vec::new();
    for at in 0..scene.positions.len() {
        let start = floats.len();
        floats.push(scene.opacities[at]);
        floats.extend(scene.rotations[at]);
        floats.extend(scene.sh[at]);
        floats.extend(scene.scales[at]);
        floats.extend(scene.positions[at]);
        floats.resize(start + stride, 0.3);
    }
    floats
}

/// Puts all attributes into one binding.
fn interleave(graphics: &mut Graphics<'_>, stride: usize) {
    graphics.bindings.truncate(1);
    graphics.bindings[0].stride = 4 * stride as u32;
    for (attribute, floats) in graphics.attributes.iter_mut().zip([11, 8, 1, 0, 5]) {
        (attribute.binding, attribute.offset) = (0, 4 * floats);
    }
}

/// Where buffers and attributes begin.
fn places(chapter: &mut Chapter<'_>) {
    for (name, stride) in [("interleaved", 14), ("interleaved_apart", 19)] {
        chapter.program(name, move || {
            Program::changed(
                Draw::new(dense(432, 0)),
                move |graphics| interleave(graphics, stride),
                move |stage| {
                    let buffer = Buffer::of(stage.gpu, &interleaved(&stage.draw.scene, stride));
                    stage.run(|commands| {
                        commands.vertices(&buffer);
                        commands.draw(0..500);
                    });
                },
            )
        });
    }
    chapter.program("buffer_offset", || {
        Program::changed(
            Draw::new(dense(433, 0)),
            |graphics| interleave(graphics, 14),
            |stage| {
                let mut floats = vec![0.5; 31];
                floats.extend(interleaved(&stage.draw.scene, 14));
                let buffer = Buffer::of(stage.gpu, &floats);
                stage.run(|commands| {
                    commands.vertex_buffer(0, &buffer, 4 * 31);
                    commands.draw(0..500);
                });
            },
        )
    });
    chapter.program("buffers_of_one_command", || {
        Program::on_stage(Draw::new(dense(434, 0)), |stage| {
            let scene = &stage.draw.scene;
            let buffers = [
                Buffer::of(stage.gpu, &scene.positions),
                Buffer::of(stage.gpu, &scene.scales),
                Buffer::of(stage.gpu, &scene.rotations),
                Buffer::of(stage.gpu, &scene.opacities),
                Buffer::of(stage.gpu, &scene.sh),
            ];
            let other = stage.other(&dense(435, 0));
            stage.run(|commands| {
                other.bind_buffers(commands);
                let (device, raw) = commands.raw();
                let buffers = buffers.each_ref().map(|buffer| buffer.raw);
                // SAFETY: the buffers have the attributes of 500 vertices.
                unsafe { device.cmd_bind_vertex_buffers(raw, 0, &buffers, &[0; 5]) };
                commands.draw(0..500);
            });
        })
    });
    chapter.program("buffers_rebound", || {
        let draw = Draw { calls: vec![vertices(0, 200), vertices(200, 300)], ..Draw::new(dense(436, 0)) };
        Program::on_stage(draw, |stage| {
            let parts = [0..200, 200..500].map(|range| stage.other(&part(&stage.draw.scene, range)));
            stage.run(|commands| {
                for part in &parts {
                    part.bind_buffers(commands);
                    commands.draw(0..part.count);
                }
            });
        })
    });
    // Locations in another order than the structure's members.
    chapter.program("locations", || {
        let change = |graphics: &mut Graphics<'_>| {
            for (attribute, location) in graphics.attributes.iter_mut().zip([9, 3, 6, 1, 2]) {
                attribute.location = location;
            }
            let mut state = graphics.gaussian.expect("a Gaussian state");
            let locations = state.attribute_locations.position(9).scale(3).rotation(6).opacity(1);
            state = state.attribute_locations(locations.first_spherical_harmonics(2));
            graphics.gaussian = Some(state);
        };
        Program::changed(Draw::new(dense(437, 0)), change, |stage| stage.run(|commands| commands.draw(0..500)))
    });
    // A second attribute of four components, which the rotation must not be taken for.
    chapter.program("locations_unused", || {
        let change = |graphics: &mut Graphics<'_>| {
            let tint = vk::VertexInputAttributeDescription {
                location: 14,
                binding: 2,
                format: vk::Format::R32G32B32A32_SFLOAT,
                offset: 16,
            };
            graphics.attributes.push(tint);
            graphics.bindings[2].stride = 32;
        };
        Program::changed(Draw::new(dense(438, 0)), change, |stage| {
            let rotations = stage.draw.scene.rotations.iter();
            let pairs: Vec<[[f32; 4]; 2]> = rotations.map(|&[w, x, y, z]| [[w, x, y, z], [z, -w, y, x]]).collect();
            let buffer = Buffer::of(stage.gpu, pairs.as_flattened());
            stage.run(|commands| {
                commands.vertex_buffer(2, &buffer, 0);
                commands.draw(0..500);
            });
        })
    });
}

/// Strides that are dynamic.
fn strides(chapter: &mut Chapter<'_>) {
    for (name, stride, offset) in [("packed", 14, 0), ("apart", 19, 0), ("offset", 17, 23)] {
        chapter.program(format!("buffers_2.{name}"), move || {
            let change = move |graphics: &mut Graphics<'_>| {
                interleave(graphics, 25);
                graphics.dynamic.push(vk::DynamicState::VERTEX_INPUT_BINDING_STRIDE);
            };
            Program::changed(Draw::new(dense(439, 0)), change, move |stage| {
                let mut floats = vec![0.5; offset];
                floats.extend(interleaved(&stage.draw.scene, stride));
                let buffer = Buffer::of(stage.gpu, &floats);
                let other = Buffer::of(stage.gpu, &interleaved(&dense(440, 0), stride));
                stage.run(|commands| {
                    let (device, raw) = commands.raw();
                    let strides = [4 * stride as u64];
                    // SAFETY: the buffers have the attributes of 500 vertices.
                    unsafe {
                        device.cmd_bind_vertex_buffers2(raw, 0, &[other.raw], &[0], None, Some(&strides));
                        let offsets = [4 * offset as u64];
                        device.cmd_bind_vertex_buffers2(raw, 0, &[buffer.raw], &offsets, None, Some(&strides));
                    }
                    commands.draw(0..500);
                });
            })
        });
    }
}

/// Attributes that advance by instance.
fn rates(chapter: &mut Chapter<'_>) {
    // Gaussians of 60 shapes, each of which has three opacities and colours.
    chapter.program("rate.opacity_and_colour", || {
        let shapes = dense(441, 0);
        let mut scene = part(&shapes, 0..60);
        for instance in 1..3 {
            let again = part(&shapes, 0..60);
            scene.positions.extend(again.positions);
            scene.scales.extend(again.scales);
            scene.rotations.extend(again.rotations);
            scene.opacities.extend(std::iter::repeat_n(0.3 * instance as f32, 60));
            scene.sh.extend(std::iter::repeat_n([instance as f32 - 1.5, 0.4, 0.8], 60));
        }
        scene.opacities[..60].fill(0.8);
        scene.sh[..60].fill([0.2, 1.1, -0.9]);
        let change = |graphics: &mut Graphics<'_>| {
            graphics.bindings[3..].iter_mut().for_each(|one| one.input_rate = vk::VertexInputRate::INSTANCE);
        };
        Program::changed(Draw::new(scene), change, |stage| {
            let scene = &stage.draw.scene;
            let opacities = Buffer::of(stage.gpu, &[0, 60, 120].map(|at| scene.opacities[at]));
            let colors = Buffer::of(stage.gpu, &[0, 60, 120].map(|at| scene.sh[at]));
            stage.run(|commands| {
                commands.vertex_buffer(3, &opacities, 0);
                commands.vertex_buffer(4, &colors, 0);
                commands.draw_instances(0..60, 0..3);
            });
        })
    });
    // One Gaussian an instance: all attributes advance by instance.
    chapter.program("rate.all", || {
        let change = |graphics: &mut Graphics<'_>| {
            graphics.bindings.iter_mut().for_each(|one| one.input_rate = vk::VertexInputRate::INSTANCE);
        };
        Program::changed(Draw::new(cloud(442, 300, 1)), change, |stage| {
            stage.run(|commands| commands.draw_instances(0..1, 0..300));
        })
    });
    chapter.program("rate.matrices_from_an_offset", || {
        let draw = Draw {
            calls: vec![Call::Draw { vertices: [0, 90], instances: [3, 3] }],
            ..placed(vk::VertexInputRate::INSTANCE, placements(), 0)
        };
        Program::on_stage(draw, |stage| {
            let instances = stage.instances.as_ref().expect("instances");
            stage.run(|commands| {
                bind_instances(commands, instances);
                commands.vertex_buffer(5, instances, 3 * 52);
                commands.draw_instances(0..90, 0..3);
            });
        })
    });
}
