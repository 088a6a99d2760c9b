//! Draw commands: direct, indexed, indirect, with a count in a buffer, and several by one command.

use ash::vk;
use gaurast_testkit::{Buffer, Commands};

use super::chapter::Chapter;
use super::input::{placed, placements, vertices};
use super::scenes::{cloud, dense};
use crate::draw::{Call, Draw};
use crate::program::Program;

/// The draws of the indirect commands: vertices from and number.
const PARTS: [[u32; 2]; 4] = [[30, 200], [300, 150], [0, 25], [460, 40]];

/// A draw of parts of a scene, each of which is a set.
fn parts(parts: &[[u32; 2]]) -> Draw {
    let calls = parts.iter().map(|&[first, count]| vertices(first, count)).collect();
    Draw { calls, ..Draw::new(dense(401, 0)) }
}

/// Vertices in another order than theirs, so that indices matter.
fn shuffled(first: u32, count: u32) -> Vec<u32> {
    (0..count).map(|at| first + at * 7 % count).collect()
}

/// A draw of indexed parts of a scene, whose index buffer has each part's indices.
fn indexed_parts(parts: &[[u32; 2]]) -> Draw {
    let mut indices = vec![0; 11];
    let mut calls = Vec::new();
    for &[first, count] in parts {
        calls.push(Call::Indexed { indices: [indices.len() as u32, count], offset: 0 });
        indices.extend(shuffled(first, count));
    }
    Draw { calls, indices, ..Draw::new(dense(401, 0)) }
}

/// Words of the parameters of indirect draws, `stride` words apart, after `offset` words.
fn parameters(draw: &Draw, offset: usize, stride: usize) -> Vec<u32> {
    let mut words = vec![0; offset];
    for call in &draw.calls {
        let start = words.len();
        match *call {
            Call::Draw { vertices: [first, count], instances: [first_instance, instances] } => {
                words.extend([count, instances, first, first_instance]);
            }
            Call::Indexed { indices: [first, count], offset } => words.extend([count, 1, first, offset as u32, 0]),
            _ => {}
        }
        words.resize(start + stride, 0);
    }
    words
}

/// An indirect command over a buffer: offset, number of draws and stride in bytes.
#[derive(Clone, Copy)]
struct Indirect {
    offset: u64,
    count: u32,
    stride: u32,
}

impl Indirect {
    fn draw(self, commands: &Commands, buffer: &Buffer, is_indexed: bool) {
        let (device, raw) = commands.raw();
        // SAFETY: the buffer has the parameters of the draws.
        unsafe {
            if is_indexed {
                device.cmd_draw_indexed_indirect(raw, buffer.raw, self.offset, self.count, self.stride);
            } else {
                device.cmd_draw_indirect(raw, buffer.raw, self.offset, self.count, self.stride);
            }
        }
    }

    /// With the number of draws, which is at most this one's, in a buffer.
    fn counted(self, commands: &Commands, buffer: &Buffer, is_indexed: bool, (count, at): (&Buffer, u64)) {
        let (device, raw) = commands.raw();
        let Self { offset, count: maximum, stride } = self;
        // SAFETY: the buffers have the count and the parameters of the draws.
        unsafe {
            if is_indexed {
                let (from, of) = (buffer.raw, count.raw);
                device.cmd_draw_indexed_indirect_count(raw, from, offset, of, at, maximum, stride);
            } else {
                device.cmd_draw_indirect_count(raw, buffer.raw, offset, count.raw, at, maximum, stride);
            }
        }
    }
}

pub(super) fn draws(chapter: &mut Chapter<'_>) {
    direct(chapter);
    indexed(chapter);
    for is_indexed in [false, true] {
        indirect(chapter, is_indexed);
        counted(chapter, is_indexed);
    }
    several(chapter);
}

fn direct(chapter: &mut Chapter<'_>) {
    chapter.add("first_vertex", || parts(&[[123, 377]]));
    chapter.add("last_vertex", || {
        // The last of few covers the others.
        let mut scene = dense(402, 0);
        (scene.positions[499], scene.scales[499], scene.opacities[499]) = ([0.0, 0.0, 1.0], [0.6; 3], 0.9);
        Draw::new(scene)
    });
    chapter.add("instances", || placed(vk::VertexInputRate::INSTANCE, placements(), 0));
    chapter.add("first_instance", || Draw {
        calls: vec![Call::Draw { vertices: [5, 60], instances: [2, 3] }],
        ..placed(vk::VertexInputRate::INSTANCE, placements(), 0)
    });
    chapter.add("vertices_12000", || {
        let mut scene = cloud(403, 12_000, 0);
        // The last ones are in front, and larger.
        for at in 10_000..12_000 {
            scene.positions[at] = scene.positions[at].map(|c| 0.5 * c);
        }
        Draw::new(scene)
    });
    chapter.add("no_vertices", || parts(&[[0, 0], [40, 100]]));
    chapter.add("no_instances", || Draw {
        calls: vec![Call::Draw { vertices: [40, 300], instances: [0, 0] }],
        behind: [0.1, 0.2, 0.3, 0.4],
        ..Draw::new(dense(404, 0))
    });
}

fn indexed(chapter: &mut Chapter<'_>) {
    chapter.add("indexed.first_index", || indexed_parts(&PARTS[..2]));
    chapter.add("indexed.vertex_offset", || Draw {
        indices: shuffled(0, 200),
        calls: vec![Call::Indexed { indices: [0, 200], offset: 250 }],
        ..Draw::new(dense(405, 0))
    });
    // The first indices of the buffer are those of other vertices.
    chapter.program("indexed.buffer_offset", || {
        let draw = Draw { calls: vec![vertices(200, 300)], ..Draw::new(dense(406, 0)) };
        Program::on_stage(draw, |stage| {
            let indices: Vec<u32> = shuffled(0, 150).into_iter().chain(shuffled(200, 300)).collect();
            let buffer = Buffer::of(stage.gpu, &indices);
            stage.run(|commands| {
                commands.indices(&buffer, 4 * 150, vk::IndexType::UINT32);
                commands.draw_indexed(0..300, 0);
            });
        })
    });
    chapter.program("indexed.uint16", || {
        let draw = Draw { calls: vec![vertices(200, 300)], ..Draw::new(dense(407, 0)) };
        Program::on_stage(draw, |stage| {
            let indices: Vec<u16> = shuffled(200, 300).into_iter().map(|index| index as u16).collect();
            let buffer = Buffer::of(stage.gpu, &indices);
            stage.run(|commands| {
                commands.indices(&buffer, 0, vk::IndexType::UINT16);
                commands.draw_indexed(0..300, 0);
            });
        })
    });
    chapter.program("indexed.rebound", || {
        let draw = Draw { calls: vec![vertices(0, 150), vertices(300, 200)], ..Draw::new(dense(408, 0)) };
        Program::on_stage(draw, |stage| {
            let [first, second] = [shuffled(0, 150), shuffled(300, 200)].map(|all| Buffer::of(stage.gpu, &all));
            stage.run(|commands| {
                commands.indices(&first, 0, vk::IndexType::UINT32);
                commands.draw_indexed(0..150, 0);
                commands.indices(&second, 0, vk::IndexType::UINT32);
                commands.draw_indexed(0..200, 0);
            });
        })
    });
    for (name, first, count) in [("instances", 0, 6), ("first_instance", 2, 3)] {
        chapter.program(format!("indexed.{name}"), move || {
            let draw = Draw {
                calls: vec![Call::Draw { vertices: [20, 60], instances: [first, count] }],
                ..placed(vk::VertexInputRate::INSTANCE, placements(), 0)
            };
            Program::on_stage(draw, move |stage| {
                let buffer = Buffer::of(stage.gpu, &shuffled(0, 60));
                stage.run(|commands| {
                    commands.indices(&buffer, 0, vk::IndexType::UINT32);
                    let (device, raw) = commands.raw();
                    // SAFETY: the indices are those of vertices.
                    unsafe { device.cmd_draw_indexed(raw, 60, count, 0, 20, first) };
                });
            })
        });
    }
}

/// The name of a kind of draws.
fn kind(is_indexed: bool) -> &'static str {
    if is_indexed { "indexed_indirect" } else { "indirect" }
}

fn of_kind(is_indexed: bool, ranges: &[[u32; 2]]) -> Draw {
    if is_indexed { indexed_parts(ranges) } else { parts(ranges) }
}

fn indirect(chapter: &mut Chapter<'_>, is_indexed: bool) {
    let words = if is_indexed { 5 } else { 4 };
    let kind = kind(is_indexed);
    chapter.program(format!("{kind}.one"), move || {
        Program::on_stage(of_kind(is_indexed, &PARTS[..1]), move |stage| {
            let buffer = Buffer::of(stage.gpu, &parameters(stage.draw, 0, words));
            stage.run(|commands| Indirect { offset: 0, count: 1, stride: 0 }.draw(commands, &buffer, is_indexed));
        })
    });
    chapter.program(format!("{kind}.offset"), move || {
        Program::on_stage(of_kind(is_indexed, &PARTS[..1]), move |stage| {
            let mut all = vec![60, 1, 0, 0, 0, 0];
            all.extend(parameters(stage.draw, 0, words));
            let buffer = Buffer::of(stage.gpu, &all);
            stage.run(|commands| Indirect { offset: 24, count: 1, stride: 0 }.draw(commands, &buffer, is_indexed));
        })
    });
    for (name, stride) in [("packed", words), ("stride", words + 3)] {
        chapter.program(format!("{kind}.several.{name}"), move || {
            let program = Program::on_stage(of_kind(is_indexed, &PARTS[..3]), move |stage| {
                let buffer = Buffer::of(stage.gpu, &parameters(stage.draw, 0, stride));
                let all = Indirect { offset: 0, count: 3, stride: 4 * stride as u32 };
                stage.run(|commands| all.draw(commands, &buffer, is_indexed));
            });
            program.needing("multiDrawIndirect")
        });
    }
    chapter.program(format!("{kind}.none"), move || {
        Program::on_stage(of_kind(is_indexed, &PARTS[..1]), move |stage| {
            let buffer = Buffer::of(stage.gpu, &parameters(stage.draw, 0, words));
            stage.run(|commands| {
                Indirect { offset: 0, count: 0, stride: 32 }.draw(commands, &buffer, is_indexed);
                Indirect { offset: 0, count: 1, stride: 32 }.draw(commands, &buffer, is_indexed);
            });
        })
    });
}

fn counted(chapter: &mut Chapter<'_>, is_indexed: bool) {
    let kind = kind(is_indexed);
    let stride = if is_indexed { 6 } else { 5 };
    // The number of draws in the buffer, the greatest number, and the number that are made.
    for (name, count, maximum, made) in
        [("fewer", 2, 4, 2), ("equal", 3, 3, 3), ("more", 4, 2, 2), ("none", 0, 3, 0), ("no_maximum", 2, 0, 0)]
    {
        chapter.program(format!("{kind}_count.{name}"), move || {
            let whole = of_kind(is_indexed, &PARTS);
            let calls = whole.calls[..made].to_vec();
            let program = Program::on_stage(Draw { calls, ..whole.clone() }, move |stage| {
                let buffer = Buffer::of(stage.gpu, &parameters(&whole, 0, stride));
                let counts = Buffer::of(stage.gpu, &[1, 9, count]);
                let all = Indirect { offset: 0, count: maximum, stride: 4 * stride as u32 };
                stage.run(|commands| all.counted(commands, &buffer, is_indexed, (&counts, 8)));
            });
            program.needing("drawIndirectCount").needing("multiDrawIndirect")
        });
    }
}

/// `vkCmdDrawMultiEXT` and `vkCmdDrawMultiIndexedEXT`.
fn several(chapter: &mut Chapter<'_>) {
    chapter.program("multi.stride", || {
        let program = Program::pass(parts(&PARTS), |stage, commands| {
            let draws: Vec<[u32; 4]> = PARTS.iter().map(|&[first, count]| [first, count, 0, 0]).collect();
            let extension = ash::ext::multi_draw::Device::new(stage.gpu.instance(), stage.gpu.device());
            let draw = extension.fp().cmd_draw_multi_ext;
            // SAFETY: the extension is enabled, and there are as many draws, 16 bytes apart.
            unsafe { draw(commands.raw, draws.len() as u32, draws.as_ptr().cast(), 1, 0, 16) };
        });
        program.needing("VK_EXT_multi_draw")
    });
    chapter.program("multi.instances", || {
        let calls = vec![
            Call::Draw { vertices: [0, 40], instances: [2, 3] },
            Call::Draw { vertices: [50, 30], instances: [2, 3] },
        ];
        let draw = Draw { calls, ..placed(vk::VertexInputRate::INSTANCE, placements(), 0) };
        let program = Program::pass(draw, |stage, commands| {
            let draws = [[0, 40], [50, 30]]
                .map(|[first_vertex, vertex_count]| vk::MultiDrawInfoEXT { first_vertex, vertex_count });
            let extension = ash::ext::multi_draw::Device::new(stage.gpu.instance(), stage.gpu.device());
            let draw = extension.fp().cmd_draw_multi_ext;
            // SAFETY: the extension is enabled, and there are as many draws, 8 bytes apart.
            unsafe { draw(commands.raw, 2, draws.as_ptr(), 3, 2, 8) };
        });
        program.needing("VK_EXT_multi_draw")
    });
    for (name, offsets) in [("offsets", None), ("one_offset", Some(130))] {
        chapter.program(format!("multi.indexed.{name}"), move || {
            let draw = Draw {
                indices: shuffled(0, 300),
                calls: vec![
                    Call::Indexed { indices: [0, 200], offset: offsets.unwrap_or(100) },
                    Call::Indexed { indices: [150, 120], offset: offsets.unwrap_or(0) },
                ],
                ..Draw::new(dense(409, 0))
            };
            let program = Program::pass(draw, move |stage, commands| {
                let draws = [[0, 200, 100], [150, 120, 0]].map(|[first_index, index_count, vertex_offset]| {
                    vk::MultiDrawIndexedInfoEXT { first_index, index_count, vertex_offset: vertex_offset as i32 }
                });
                let extension = ash::ext::multi_draw::Device::new(stage.gpu.instance(), stage.gpu.device());
                let draw = extension.fp().cmd_draw_multi_indexed_ext;
                let offset = offsets.as_ref().map_or(std::ptr::null(), std::ptr::from_ref);
                // SAFETY: the extension is enabled, and there are as many draws, 12 bytes apart.
                unsafe { draw(commands.raw, 2, draws.as_ptr(), 1, 0, 12, offset) };
            });
            program.needing("VK_EXT_multi_draw")
        });
    }
}
