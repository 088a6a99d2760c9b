//! Scenes of topologies, indices, restart, instances, indirect draws.

use ash::vk;
use ash::vk::PrimitiveTopology as Topology;

use gaurast_testkit::drawn::Drawn;
use gaurast_testkit::drawn::{cases, need, simple, with};
use gaurast_testkit::shapes;
use gaurast_testkit::{Buffer, Gpu, Output, PipelineOptions, TargetOptions, Vertex, attribute, binding};

fn of(topology: Topology) -> PipelineOptions<'static> {
    PipelineOptions { topology, ..PipelineOptions::default() }
}

fn drawn(gpu: &Gpu, topology: Topology, vertices: &[Vertex]) -> Output {
    simple(gpu, &TargetOptions::default(), &of(topology), vertices)
}

pub fn triangle_list(gpu: &Gpu) -> Drawn {
    // Two vertices too many, which make no triangle.
    let mut vertices = shapes::soup(1, 30);
    vertices.extend(shapes::points(1, 2));
    Ok(drawn(gpu, Topology::TRIANGLE_LIST, &vertices))
}

pub fn triangle_strip(gpu: &Gpu) -> Drawn {
    Ok(drawn(gpu, Topology::TRIANGLE_STRIP, &shapes::zigzag(2, 12)))
}

pub fn triangle_fan(gpu: &Gpu) -> Drawn {
    Ok(drawn(gpu, Topology::TRIANGLE_FAN, &shapes::zigzag(3, 11)))
}

/// Draws flat values, whose provoking vertex depends on the topology.
pub fn provoking_vertices(gpu: &Gpu) -> Drawn {
    const FLAT: &str = "
        layout(location = 0) in vec4 position;
        layout(location = 1) in vec4 color;
        layout(location = 0) flat out vec4 v_color;
        void main() { gl_Position = position; v_color = color; }";
    const FRAGMENT: &str = "
        layout(location = 0) flat in vec4 v_color;
        layout(location = 0) out vec4 color;
        void main() { color = v_color; }";
    let topologies = [
        Topology::TRIANGLE_LIST,
        Topology::TRIANGLE_STRIP,
        Topology::TRIANGLE_FAN,
        Topology::LINE_LIST,
        Topology::LINE_STRIP,
    ];
    let name = |topology: &Topology| format!("{topology:?}");
    Ok(cases(topologies, name, |&topology| {
        let options = PipelineOptions { vertex: FLAT, fragment: Some(FRAGMENT), ..of(topology) };
        simple(gpu, &TargetOptions::default(), &options, &shapes::zigzag(4, 12))
    }))
}

pub fn points(gpu: &Gpu) -> Drawn {
    Ok(drawn(gpu, Topology::POINT_LIST, &shapes::points(5, 300)))
}

/// A vertex shader that sets the point size from the alpha of the colour.
const SIZED: &str = "
    layout(location = 0) in vec4 position;
    layout(location = 1) in vec4 color;
    layout(location = 0) out vec4 v_color;
    void main() {
        gl_Position = position;
        gl_PointSize = 1.0 + 15.0 * color.a;
        v_color = color;
    }";

pub fn large_points(gpu: &Gpu) -> Drawn {
    need("largePoints", gpu.features().large_points)?;
    let options = PipelineOptions { vertex: SIZED, ..of(Topology::POINT_LIST) };
    let vertices = shapes::points(6, 40);
    Ok(simple(gpu, &TargetOptions::default(), &options, &vertices))
}

pub fn point_coordinates(gpu: &Gpu) -> Drawn {
    need("largePoints", gpu.features().large_points)?;
    let options = PipelineOptions {
        vertex: SIZED,
        fragment: Some(
            "layout(location = 0) in vec4 v_color;
             layout(location = 0) out vec4 color;
             void main() { color = vec4(gl_PointCoord, v_color.b, 1.0); }",
        ),
        ..of(Topology::POINT_LIST)
    };
    let vertices = shapes::points(7, 30);
    Ok(simple(gpu, &TargetOptions::default(), &options, &vertices))
}

pub fn line_list(gpu: &Gpu) -> Drawn {
    Ok(drawn(gpu, Topology::LINE_LIST, &shapes::points(8, 40)))
}

pub fn line_strip(gpu: &Gpu) -> Drawn {
    Ok(drawn(gpu, Topology::LINE_STRIP, &shapes::points(9, 20)))
}

pub fn wide_lines(gpu: &Gpu) -> Drawn {
    need("wideLines", gpu.features().wide_lines)?;
    let options =
        PipelineOptions { raster: PipelineOptions::default().raster.line_width(5.0), ..of(Topology::LINE_LIST) };
    let vertices = shapes::points(10, 16);
    Ok(simple(gpu, &TargetOptions::default(), &options, &vertices))
}

/// Draws with a list of indices of each type: 16 and 32 bits.
pub fn indices_of_every_type(gpu: &Gpu) -> Drawn {
    let vertices = shapes::soup(11, 30);
    let order: Vec<u16> = (0..90).rev().step_by(2).collect();
    let words: Vec<u32> = order.iter().map(|&index| u32::from(index)).collect();
    let types = [vk::IndexType::UINT16, vk::IndexType::UINT32];
    let name = |index_type: &vk::IndexType| format!("{index_type:?}");
    Ok(cases(types, name, |&index_type| {
        let indices = match index_type {
            vk::IndexType::UINT16 => Buffer::of(gpu, &order),
            _ => Buffer::of(gpu, &words),
        };
        let options = PipelineOptions::default();
        with(gpu, &TargetOptions::default(), &options, &vertices, |commands| {
            commands.indices(&indices, 0, index_type);
            commands.draw_indexed(0..45, 0);
        })
    }))
}

pub fn base_vertex_and_first_index(gpu: &Gpu) -> Drawn {
    let vertices = shapes::soup(12, 30);
    let order: Vec<u16> = (0..60).rev().collect();
    let indices = Buffer::of(gpu, &order);
    let options = PipelineOptions::default();
    let target = TargetOptions::default();
    Ok(with(gpu, &target, &options, &vertices, |commands| {
        commands.indices(&indices, 12, vk::IndexType::UINT16);
        commands.draw_indexed(3..30, 17);
        commands.indices(&indices, 0, vk::IndexType::UINT16);
        commands.draw_indexed(0..9, -30);
    }))
}

pub fn primitive_restart(gpu: &Gpu) -> Drawn {
    let vertices = shapes::zigzag(13, 24);
    let order: Vec<u16> = vec![
        0, 1, 2, 3, 0xffff, 5, 6, 7, 0xffff, 0xffff, 9, 10, 0xffff, 12, 13, 14, 15, 16, 17, 0xffff, 20, 21, 22, 23,
    ];
    let indices = Buffer::of(gpu, &order);
    let topologies = [Topology::TRIANGLE_STRIP, Topology::TRIANGLE_FAN, Topology::LINE_STRIP];
    let name = |topology: &Topology| format!("{topology:?}");
    Ok(cases(topologies, name, |&topology| {
        let options = PipelineOptions { restart: true, ..of(topology) };
        with(gpu, &TargetOptions::default(), &options, &vertices, |commands| {
            commands.indices(&indices, 0, vk::IndexType::UINT16);
            commands.draw_indexed(0..order.len() as u32, 0);
        })
    }))
}

/// A vertex shader that uses the numbers of vertices and instances.
const NUMBERED: &str = "
    layout(location = 0) out vec4 v_color;
    void main() {
        vec2 corner = vec2(gl_VertexIndex % 3 == 1, gl_VertexIndex % 3 == 2);
        vec2 cell = vec2(gl_InstanceIndex & 7, gl_InstanceIndex >> 3) + 0.9 * corner;
        gl_Position = vec4(cell / 4.0 - 1.0, 0.5, 1.0);
        v_color = vec4(gl_VertexIndex, gl_InstanceIndex, gl_VertexIndex + gl_InstanceIndex, 90.0) / 90.0;
    }";

fn numbered() -> PipelineOptions<'static> {
    PipelineOptions {
        vertex: NUMBERED,
        vertex_bindings: Vec::new(),
        vertex_attributes: Vec::new(),
        ..PipelineOptions::default()
    }
}

pub fn instances_by_number(gpu: &Gpu) -> Drawn {
    let target = TargetOptions::default();
    Ok(with(gpu, &target, &numbered(), &shapes::whole(0.0, [0.0; 4]), |commands| {
        commands.draw_instances(0..3, 0..20);
        commands.draw_instances(3..6, 30..50);
    }))
}

/// Draws a rectangle that instances move and colour.
pub fn instances_by_attribute(gpu: &Gpu) -> Drawn {
    let moves: Vec<[f32; 4]> = shapes::points(14, 25).iter().map(|vertex| vertex.position).collect();
    let moves = Buffer::of(gpu, &moves);
    let options = PipelineOptions {
        vertex: "
            layout(location = 0) in vec4 position;
            layout(location = 1) in vec4 color;
            layout(location = 2) in vec4 move;
            layout(location = 0) out vec4 v_color;
            void main() {
                gl_Position = vec4(0.2 * position.xy + 0.8 * move.xy, 0.5, 1.0);
                v_color = vec4(0.5 + 0.5 * move.xyz, 1.0);
            }",
        vertex_bindings: vec![
            binding(0, size_of::<Vertex>() as u32),
            vk::VertexInputBindingDescription { input_rate: vk::VertexInputRate::INSTANCE, ..binding(1, 16) },
        ],
        vertex_attributes: vec![
            attribute(0, vk::Format::R32G32B32A32_SFLOAT, 0),
            attribute(1, vk::Format::R32G32B32A32_SFLOAT, 16),
            vk::VertexInputAttributeDescription { binding: 1, ..attribute(2, vk::Format::R32G32B32A32_SFLOAT, 0) },
        ],
        ..PipelineOptions::default()
    };
    let vertices = shapes::rectangle([-0.5, -0.5, 0.5, 0.5], 0.5, [1.0; 4]);
    let target = TargetOptions::default();
    Ok(with(gpu, &target, &options, &vertices, |commands| {
        commands.vertex_buffer(1, &moves, 0);
        commands.draw_instances(0..6, 0..15);
        commands.draw_instances(0..6, 20..25);
    }))
}

pub fn indirect_draws(gpu: &Gpu) -> Drawn {
    need("multiDrawIndirect", gpu.features().multi_draw_indirect)?;
    need("drawIndirectFirstInstance", gpu.features().draw_indirect_first_instance)?;
    // Vertices, instances, first vertex, first instance, and a word that is skipped.
    let parameters = [[3u32, 5, 0, 0, 7], [3, 6, 3, 10, 7], [3, 7, 6, 40, 7]];
    let buffer = Buffer::of(gpu, &parameters);
    let target = TargetOptions::default();
    let vertices = shapes::whole(0.0, [0.0; 4]);
    Ok(with(gpu, &target, &numbered(), &vertices, |commands| {
        // SAFETY: see the crate.
        unsafe {
            let device = commands.device();
            device.cmd_draw_indirect(commands.raw, buffer.raw, 0, 2, 20);
            device.cmd_draw_indirect(commands.raw, buffer.raw, 40, 1, 20);
        }
    }))
}

pub fn indexed_indirect_draws(gpu: &Gpu) -> Drawn {
    need("multiDrawIndirect", gpu.features().multi_draw_indirect)?;
    // Indices, instances, first index, vertex offset, first instance.
    let parameters = [[6u32, 1, 0, 3, 0], [9, 1, 12, 0, 0], [3, 2, 30, 1, 0]];
    let buffer = Buffer::of(gpu, &parameters);
    let order: Vec<u32> = (0..60).rev().collect();
    let indices = Buffer::of(gpu, &order);
    let target = TargetOptions::default();
    let vertices = shapes::soup(15, 30);
    let options = PipelineOptions::default();
    Ok(with(gpu, &target, &options, &vertices, |commands| {
        commands.indices(&indices, 0, vk::IndexType::UINT32);
        // SAFETY: see the crate.
        unsafe {
            let device = commands.device();
            device.cmd_draw_indexed_indirect(commands.raw, buffer.raw, 0, 3, 20);
        }
    }))
}

pub fn indirect_count(gpu: &Gpu) -> Drawn {
    let parameters = [[3u32, 9, 0, 0], [3, 6, 3, 10], [3, 7, 6, 40]];
    let buffer = Buffer::of(gpu, &parameters);
    let count = Buffer::of(gpu, &[0u32, 2]);
    let target = TargetOptions::default();
    let vertices = shapes::whole(0.0, [0.0; 4]);
    Ok(with(gpu, &target, &numbered(), &vertices, |commands| {
        // SAFETY: see the crate.
        unsafe {
            let device = commands.device();
            device.cmd_draw_indirect_count(commands.raw, buffer.raw, 0, count.raw, 4, 3, 16);
        }
    }))
}
