//! Vertex shading: runs the vertex program on the vertices of a segment, and projects the positions.

use super::fetch::Fetcher;
use super::vertex_reuse::VertexReuse;
use super::viewport::{Projections, Transform, WindowVertex, code};
use crate::limits::MAX_CLIP_CULL_DISTANCES;
use crate::program::outputs::VertexOutputs;
use crate::program::pool::PooledMachine;
use crate::program::vertex::VERTEX_BATCH;
use devmem::dispatch;
use devmem::host;
use fearless_simd::Level;
use isa::Vector;
use isa::machine::{LaneMask, Stopped, Watchdog};
use isa::resources::Resources;

/// A vertex after the vertex program and the first viewport's transform.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Vertex {
    /// The position in clip space.
    pub position: [f32; 4],
    pub window_vertex: WindowVertex,
    /// The clip code; see [`code`].
    pub code: u32,
}

/// The outputs that only some vertex programs write.
#[derive(Clone, Copy, Debug)]
pub(super) struct OptionalOutputs {
    pub point_size: f32,
    pub layer: u32,
    pub viewport: u32,
    pub primitive_id: u32,
    pub clip: [f32; MAX_CLIP_CULL_DISTANCES],
    pub cull: [f32; MAX_CLIP_CULL_DISTANCES],
}

/// The optional outputs of a program that writes none.
pub(super) const NO_OPTIONAL_OUTPUTS: OptionalOutputs = OptionalOutputs {
    point_size: 1.0,
    layer: 0,
    viewport: 0,
    primitive_id: 0,
    clip: [0.0; MAX_CLIP_CULL_DISTANCES],
    cull: [0.0; MAX_CLIP_CULL_DISTANCES],
};

/// The shaded vertices of a segment, by slot.
#[derive(Debug, Default)]
pub(super) struct Shaded {
    pub vertices: Vec<Vertex>,
    /// The optional outputs; empty if they are not needed.
    pub optional: Vec<OptionalOutputs>,
    /// The varyings, vertex by vertex.
    pub varyings: Vec<u32>,
    /// The number of varyings of a vertex.
    pub per_vertex: usize,
}

/// The varyings of vertices, which are the values that the next program takes.
#[derive(Clone, Copy)]
pub(super) struct Vertices<'a> {
    /// The values, vertex by vertex.
    pub values: &'a [u32],
    /// The number of values of a vertex.
    pub per_vertex: usize,
}

impl<'a> Vertices<'a> {
    /// The values of the vertex in a slot.
    pub(super) fn vertex(self, slot: u32) -> &'a [u32] {
        &self.values[slot as usize * self.per_vertex..][..self.per_vertex]
    }
}

impl Shaded {
    /// The varyings.
    pub(super) fn values(&self) -> Vertices<'_> {
        Vertices { values: &self.varyings, per_vertex: self.per_vertex }
    }

    /// Removes all vertices.
    pub(super) fn clear(&mut self) {
        self.vertices.clear();
        self.optional.clear();
        self.varyings.clear();
    }
}

/// Runs the vertex program on batches.
pub(super) struct Shader<'a> {
    pub machine: PooledMachine<'a>,
    pub fetcher: Fetcher<'a>,
    pub reader: OutputReader<'a>,
    pub resources: &'a Resources<'a>,
    pub watchdog: Watchdog<'a>,
}

/// Reads the outputs of a batch of vertices, and projects their positions.
#[derive(Clone, Copy)]
pub(super) struct OutputReader<'a> {
    pub outputs: &'a VertexOutputs,
    /// True if outputs other than positions and varyings are needed.
    pub takes_optional: bool,
    pub level: Level,
    pub transform: Transform,
}

impl Shader<'_> {
    /// Shades all vertices of a segment.
    pub(super) fn shade(&mut self, reuse: &VertexReuse, shaded: &mut Shaded) -> Result<(), Stopped> {
        shaded.clear();
        let batches = reuse.vertices.chunks(VERTEX_BATCH).zip(reuse.instances.chunks(VERTEX_BATCH));
        for (vertices, instances) in batches {
            self.fetcher.fetch(&mut self.machine, vertices, instances);
            self.machine.run(&LaneMask::first(vertices.len()), &LaneMask::none(), self.resources, self.watchdog)?;
            let machine = &self.machine;
            let output = |slot| machine.output_vectors(slot);
            self.reader.take(vertices.len(), output, shaded);
        }
        Ok(())
    }
}

impl OutputReader<'_> {
    /// Appends the vertices of a batch to `shaded`. `output` gives the lanes of an output.
    #[inline]
    pub(super) fn take<'v>(&self, count: usize, output: impl Fn(u32) -> &'v [Vector], shaded: &mut Shaded) {
        let outputs = self.outputs;
        let first = shaded.vertices.len();
        host::resize(&mut shaded.vertices, first + count, Vertex::default());
        let vertices = &mut shaded.vertices[first..];
        let lanes = outputs.position.map(|slot| slot.map_or(&[][..], &output));
        for (chunk, vertices) in vertices.chunks_mut(16).enumerate() {
            let mut position = [[0.0; 16]; 4];
            for (component, lanes) in position.iter_mut().zip(&lanes) {
                if let Some(lanes) = lanes.get(chunk) {
                    *component = bytemuck::cast(lanes.0);
                }
            }
            let projections = self.project(&position);
            for (lane, vertex) in vertices.iter_mut().enumerate() {
                *vertex = Vertex {
                    position: [position[0][lane], position[1][lane], position[2][lane], position[3][lane]],
                    window_vertex: WindowVertex {
                        window: [projections.window[0][lane], projections.window[1][lane]],
                        snapped: [projections.snapped[0][lane], projections.snapped[1][lane]],
                        depth: projections.depth[lane],
                        inverse_w: projections.inverse_w[lane],
                    },
                    code: projections.code[lane],
                };
            }
        }
        if self.takes_optional {
            self.take_optional(count, &output, shaded);
        }
        let per_vertex = outputs.varyings.len();
        shaded.per_vertex = per_vertex;
        if per_vertex > 0 {
            let first = shaded.varyings.len();
            host::resize(&mut shaded.varyings, first + count * per_vertex, 0);
            for (number, &slot) in outputs.varyings.iter().enumerate() {
                let mut vertices = shaded.varyings[first..].chunks_exact_mut(per_vertex);
                let chunks = slot.map_or(&[][..], &output);
                for chunk in chunks {
                    for (&bits, vertex) in chunk.0.iter().zip(&mut vertices) {
                        vertex[number] = bits;
                    }
                }
            }
        }
    }

    #[inline(never)]
    fn project(&self, position: &[[f32; 16]; 4]) -> Projections {
        let transform = self.transform;
        dispatch!(self.level, _ => transform.project_all(position))
    }

    fn take_optional<'v>(&self, count: usize, output: &impl Fn(u32) -> &'v [Vector], shaded: &mut Shaded) {
        let outputs = self.outputs;
        let first = shaded.optional.len();
        shaded.optional.resize(first + count, NO_OPTIONAL_OUTPUTS);
        let optional = &mut shaded.optional[first..];
        for_lanes(output, outputs.point_size, optional, |optional, bits| {
            optional.point_size = f32::from_bits(bits);
        });
        for_lanes(output, outputs.layer, optional, |optional, bits| {
            optional.layer = bits;
        });
        for_lanes(output, outputs.viewport, optional, |optional, bits| {
            optional.viewport = bits;
        });
        for_lanes(output, outputs.primitive_id, optional, |optional, bits| {
            optional.primitive_id = bits;
        });
        for index in 0..MAX_CLIP_CULL_DISTANCES {
            for_lanes(output, outputs.clip[index], optional, |optional, bits| {
                optional.clip[index] = f32::from_bits(bits);
            });
            for_lanes(output, outputs.cull[index], optional, |optional, bits| {
                optional.cull[index] = f32::from_bits(bits);
            });
        }
        if outputs.has_distances() {
            for (vertex, optional) in shaded.vertices[first..].iter_mut().zip(optional) {
                vertex.code |= distance_code(optional);
            }
        }
    }
}

/// The bits of a vertex's clip code that depend on its clip and cull distances.
fn distance_code(optional: &OptionalOutputs) -> u32 {
    let mut bits = 0;
    for (index, distance) in optional.clip.iter().enumerate() {
        if *distance < 0.0 {
            bits |= code::USER << index;
        }
        if !distance.is_finite() {
            bits |= code::INVALID;
        }
    }
    for (index, distance) in optional.cull.iter().enumerate() {
        if *distance < 0.0 {
            bits |= code::CULL << index;
        }
    }
    bits
}

/// Calls `set` with each item and its lane of an output, if there is such an output.
fn for_lanes<'v, T>(
    output: impl Fn(u32) -> &'v [Vector],
    slot: Option<u32>,
    items: &mut [T],
    set: impl Fn(&mut T, u32),
) {
    let Some(slot) = slot else {
        return;
    };
    let chunks = output(slot);
    for (chunk, items) in chunks.iter().zip(items.chunks_mut(16)) {
        for (&bits, item) in chunk.0.iter().zip(items) {
            set(item, bits);
        }
    }
}
