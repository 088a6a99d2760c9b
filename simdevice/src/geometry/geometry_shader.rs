//! Geometry programs: from primitives to strips of vertices.

use super::assemble::corners;
use super::pieces::Pieces;
use super::primitive_list::{ListedPrimitive, PrimitiveList};
use super::shade::{OutputReader, Shaded, Vertices};
use super::stage_runner::{ENOUGH_VERTICES, Environment, StageRunner};
use crate::limits::MAX_VERTEX_STREAMS;
use crate::program::interface::PrimitiveInput;
use crate::program::primitive::GeometryStage;
use crate::state::Topology;
use crate::stats::counters::Counter;
use devmem::host;
use isa::Vector;
use isa::machine::Stopped;
use isa::resources::Resources;

/// Runs a geometry program.
pub(super) struct GeometryShader<'a> {
    stage: &'a GeometryStage,
    runner: StageRunner<'a>,
    reader: OutputReader<'a>,
    provoking_last: bool,
    /// The values of a batch's vertices, by number of the value.
    columns: Vec<Vec<Vector>>,
    shaded: Shaded,
    listed: Vec<ListedPrimitive>,
    /// The slots of the current strip of each vertex stream.
    strips: [Vec<u32>; MAX_VERTEX_STREAMS],
}

impl<'a> GeometryShader<'a> {
    pub(super) fn new(
        stage: &'a GeometryStage,
        reader: OutputReader<'a>,
        provoking_last: bool,
        resources: &'a Resources<'a>,
        environment: Environment<'a>,
    ) -> Self {
        Self {
            stage,
            runner: StageRunner::new(&stage.stage, resources, environment),
            reader,
            provoking_last,
            columns: vec![Vec::new(); stage.output_memory.values.len()],
            shaded: Shaded::default(),
            listed: Vec::new(),
            strips: Default::default(),
        }
    }

    /// Runs the program on primitives. `set_up` takes the vertices and primitives that it emits, in order.
    pub(super) fn run(
        &mut self,
        vertices: Vertices<'_>,
        primitives: &PrimitiveList,
        pieces: &mut Pieces<'_>,
        set_up: &mut dyn FnMut(&Shaded, &[ListedPrimitive], &mut Pieces<'_>),
    ) -> Result<(), Stopped> {
        let invocations = primitives.len() * self.stage.invocations;
        let lanes = self.runner.stage.lanes;
        for first in (0..invocations).step_by(lanes) {
            let count = lanes.min(invocations - first);
            let ran = self.run_batch(vertices, primitives, first, count);
            pieces.counters.add_work(&self.runner.machine.take_work());
            pieces.counters.add(Counter::GeometryInvocations, count as u64);
            ran?;
            let before = self.listed.len();
            self.append_batch(primitives, first, count);
            let emitted = self.listed.len() - before;
            pieces.counters.add(Counter::GeometryPrimitives, emitted as u64);
            if self.shaded.vertices.len() >= ENOUGH_VERTICES || first + count == invocations {
                set_up(&self.shaded, &self.listed, pieces);
                self.shaded.clear();
                self.listed.clear();
            }
        }
        Ok(())
    }

    /// Runs invocations `first` to `first + count`, a lane for each.
    fn run_batch(
        &mut self,
        vertices: Vertices<'_>,
        primitives: &PrimitiveList,
        first: usize,
        count: usize,
    ) -> Result<(), Stopped> {
        let invocations = self.stage.invocations;
        for lane in 0..count {
            let slots = primitives.vertices_of((first + lane) / invocations);
            let values = slots.iter().map(|&slot| vertices.vertex(slot));
            self.runner.set_vertices(lane, values, &[]);
        }
        self.runner.run(count, |input, lane| match input {
            PrimitiveInput::PrimitiveId => primitives.ids[(first + lane) / invocations],
            PrimitiveInput::InvocationId => ((first + lane) % invocations) as u32,
            _ => 0,
        })
    }

    /// Appends the vertices of the last batch's lanes, and their primitives.
    fn append_batch(&mut self, primitives: &PrimitiveList, first: usize, lanes: usize) {
        self.columns.iter_mut().for_each(Vec::clear);
        let memory = &self.stage.output_memory;
        let vertex_bytes = self.stage.vertex_bytes;
        let mut vertices = 0;
        let slot_before = self.shaded.vertices.len() as u32;
        for lane in 0..lanes {
            let count = self.runner.machine.output(self.stage.count, lane);
            let id = primitives.ids[(first + lane) / self.stage.invocations];
            self.strips.iter_mut().for_each(Vec::clear);
            for number in 0..count {
                let start = memory.start + lane as u32 * memory.stride + number * vertex_bytes;
                let slot = slot_before + vertices;
                let header = self.runner.output_word(start);
                let (begins, stream) = (header & 1 != 0, header >> 1);
                self.list(stream, begins, slot, id);
                let place = vertices as usize;
                for (column, value) in self.columns.iter_mut().zip(&memory.values) {
                    if place.is_multiple_of(16) {
                        host::push(column, Vector::default());
                    }
                    let bits = self.runner.output_word(start + value.offset);
                    column[place / 16].0[place % 16] = bits;
                }
                vertices += 1;
            }
        }
        let columns = &self.columns;
        let column = |number: u32| columns.get(number as usize).map_or(&[][..], Vec::as_slice);
        self.reader.take(vertices as usize, column, &mut self.shaded);
    }

    /// Adds a vertex to the strip of a stream, and lists the primitive that it completes, if there is one.
    fn list(&mut self, stream: u32, begins_strip: bool, slot: u32, id: u32) {
        let Some(strip) = self.strips.get_mut(stream as usize) else {
            return;
        };
        if begins_strip {
            strip.clear();
        }
        strip.push(slot);
        let topology = match self.stage.corners {
            1 => Topology::PointList,
            2 => Topology::LineStrip,
            _ => Topology::TriangleStrip,
        };
        let Some(number) = strip.len().checked_sub(self.stage.corners) else {
            return;
        };
        let found = corners(topology, self.provoking_last, number as u32);
        let slots = found.places.map(|place| strip[place as usize]);
        let primitive = ListedPrimitive { slots, provoking: slots[found.provoking], id, stream };
        host::push(&mut self.listed, primitive);
    }
}
