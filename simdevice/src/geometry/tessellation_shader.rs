//! Tessellation programs: the control program shades patches, the tessellator divides them, and the evaluation program
//! shades the vertices.

use super::pieces::Pieces;
use super::primitive_list::PrimitiveList;
use super::shade::{OutputReader, Shaded, Vertices};
use super::stage_runner::{ENOUGH_VERTICES, Environment, StageRunner};
use crate::program::interface::PrimitiveInput;
use crate::program::primitive::TessellationStage;
use crate::stats::counters::Counter;
use crate::tessellation::{TessellatedPatch, Tessellation};
use devmem::host;
use isa::machine::Stopped;
use isa::resources::Resources;
use std::sync::atomic::Ordering::Relaxed;

/// Runs the programs of tessellation.
pub(super) struct TessellationShader<'a> {
    stage: &'a TessellationStage,
    control: StageRunner<'a>,
    evaluation: StageRunner<'a>,
    reader: OutputReader<'a>,
    tessellation: Tessellation,
    environment: Environment<'a>,
    /// The values that the control program gave, patch by patch: those of each vertex, then those of the patch.
    patches: Vec<u32>,
    /// The number of values of each vertex and of each patch.
    values: usize,
    tessellated: TessellatedPatch,
    batch: Batch,
    shaded: Shaded,
    primitives: PrimitiveList,
}

/// The vertices that wait for the evaluation program.
#[derive(Default)]
struct Batch {
    /// The coordinates of each vertex.
    points: Vec<[f32; 3]>,
    /// The number in the batch of each vertex's patch.
    groups: Vec<u32>,
    /// The numbers within the instance of the batch's patches.
    ids: Vec<u32>,
}

/// The receiver of the vertices and primitives of tessellation.
pub(super) type Receiver<'r> = dyn FnMut(&Shaded, &PrimitiveList, &mut Pieces<'_>) -> Result<(), Stopped> + 'r;

impl<'a> TessellationShader<'a> {
    pub(super) fn new(
        stage: &'a TessellationStage,
        reader: OutputReader<'a>,
        tessellation: Tessellation,
        [control, evaluation]: [&'a Resources<'a>; 2],
        environment: Environment<'a>,
    ) -> Self {
        Self {
            stage,
            control: StageRunner::new(&stage.control, control, environment),
            evaluation: StageRunner::new(&stage.evaluation, evaluation, environment),
            reader,
            tessellation,
            environment,
            patches: Vec::new(),
            values: stage.output_memory.values.len(),
            tessellated: TessellatedPatch::default(),
            batch: Batch::default(),
            shaded: Shaded::default(),
            primitives: PrimitiveList::default(),
        }
    }

    /// Runs the programs on patches. `receive` takes the vertices and primitives, in order.
    pub(super) fn run(
        &mut self,
        vertices: Vertices<'_>,
        patches: &PrimitiveList,
        pieces: &mut Pieces<'_>,
        receive: &mut Receiver<'_>,
    ) -> Result<(), Stopped> {
        self.shaded.clear();
        self.primitives.clear(self.tessellation.corners());
        let most = self.control.stage.groups;
        for first in (0..patches.len()).step_by(most) {
            let count = most.min(patches.len() - first);
            let ran = self.run_control(vertices, patches, first, count);
            pieces.counters.add_work(&self.control.machine.take_work());
            pieces.counters.add(Counter::TessellationPatches, count as u64);
            ran?;
            self.take_patches(count);
            for patch in 0..count {
                self.tessellate(patch, patches.ids[first + patch], pieces)?;
                if self.shaded.vertices.len() >= ENOUGH_VERTICES {
                    self.evaluate(pieces)?;
                    self.flush(pieces, receive)?;
                }
            }
            // The next patches of the control program replace these.
            self.evaluate(pieces)?;
        }
        self.flush(pieces, receive)
    }

    fn flush(&mut self, pieces: &mut Pieces<'_>, receive: &mut Receiver<'_>) -> Result<(), Stopped> {
        if self.primitives.len() > 0 {
            receive(&self.shaded, &self.primitives, pieces)?;
        }
        self.shaded.clear();
        self.primitives.clear(self.tessellation.corners());
        Ok(())
    }

    /// Runs the control program on patches `first` to `first + count`, a lane for each output vertex.
    fn run_control(
        &mut self,
        vertices: Vertices<'_>,
        patches: &PrimitiveList,
        first: usize,
        count: usize,
    ) -> Result<(), Stopped> {
        for patch in 0..count {
            let slots = patches.vertices_of(first + patch);
            let values = slots.iter().map(|&slot| vertices.vertex(slot));
            self.control.set_vertices(patch, values, &[]);
        }
        let per_patch = self.stage.output_vertices;
        self.control.run(count * per_patch, |input, lane| match input {
            PrimitiveInput::PrimitiveId => patches.ids[first + lane / per_patch],
            PrimitiveInput::PatchVertices => patches.per_primitive as u32,
            _ => 0,
        })
    }

    /// Copies what the control program gave, since its next batch replaces it.
    fn take_patches(&mut self, count: usize) {
        let memory = &self.stage.output_memory;
        self.patches.clear();
        for patch in 0..count as u32 {
            let start = memory.start + patch * memory.stride;
            for row in 0..=self.stage.output_vertices {
                let is_patch = row == self.stage.output_vertices;
                for value in &memory.values {
                    let bits = match value.vertex_stride {
                        Some(stride) if !is_patch => {
                            self.control.output_word(start + value.offset + row as u32 * stride)
                        }
                        None if is_patch => self.control.output_word(start + value.offset),
                        _ => 0,
                    };
                    host::push(&mut self.patches, bits);
                }
            }
        }
    }

    /// Tessellates a patch of the control program's batch, and adds its vertices to batches of the evaluation program.
    fn tessellate(&mut self, patch: usize, id: u32, pieces: &mut Pieces<'_>) -> Result<(), Stopped> {
        let memory = &self.stage.output_memory;
        let start = memory.start + patch as u32 * memory.stride;
        let level =
            |offset: Option<u32>| f32::from_bits(offset.map_or(0, |offset| self.control.output_word(start + offset)));
        let outer = self.stage.outer_levels.map(level);
        let inner = self.stage.inner_levels.map(level);
        let mut tessellated = std::mem::take(&mut self.tessellated);
        self.tessellation.tessellate(outer, inner, &mut tessellated);
        let first = (self.shaded.vertices.len() + self.batch.points.len()) as u32;
        let count = tessellated.indices.len() / self.primitives.per_primitive;
        for &index in &tessellated.indices {
            host::push(&mut self.primitives.vertices, first + index);
        }
        self.number(id, count);
        let lanes = self.evaluation.stage.lanes;
        let mut rest = &tessellated.points[..];
        while !rest.is_empty() {
            if self.batch.points.len() == lanes || self.batch.ids.len() == self.evaluation.stage.groups {
                self.evaluate(pieces)?;
            }
            let group = self.batch.ids.len();
            let values = self.values * (self.stage.output_vertices + 1);
            let rows = &self.patches[patch * values..][..values];
            let (vertices, of_patch) = rows.split_at(values - self.values);
            let vertices = vertices.chunks_exact(self.values.max(1));
            self.evaluation.set_vertices(group, vertices, of_patch);
            self.batch.ids.push(id);
            let part = rest.len().min(lanes - self.batch.points.len());
            self.batch.points.extend(&rest[..part]);
            self.batch.groups.resize(self.batch.points.len(), group as u32);
            rest = &rest[part..];
        }
        self.tessellated = tessellated;
        Ok(())
    }

    /// Numbers the primitives of a patch: by the patch, or if a later program reads the numbers, by how many came before
    /// in the instance.
    fn number(&mut self, patch: u32, count: usize) {
        let (ids, count) = (&mut self.primitives.ids, count as u32);
        host::reserve(ids, count as usize);
        match self.environment.presented {
            None => ids.extend(std::iter::repeat_n(patch, count as usize)),
            Some(presented) => {
                // The instance begins.
                if patch == 0 {
                    presented.store(0, Relaxed);
                }
                let before = presented.fetch_add(count, Relaxed);
                ids.extend((0..count).map(|number| before.wrapping_add(number)));
            }
        }
    }

    /// Runs the evaluation program on the vertices that wait.
    fn evaluate(&mut self, pieces: &mut Pieces<'_>) -> Result<(), Stopped> {
        let batch = &self.batch;
        let count = batch.points.len();
        if count == 0 {
            return Ok(());
        }
        let output_vertices = self.stage.output_vertices as u32;
        let ran = self.evaluation.run(count, |input, lane| match input {
            PrimitiveInput::TessCoord(axis) => batch.points[lane][axis].to_bits(),
            PrimitiveInput::Patch => batch.groups[lane],
            PrimitiveInput::PrimitiveId => batch.ids[batch.groups[lane] as usize],
            PrimitiveInput::PatchVertices => output_vertices,
            _ => 0,
        });
        pieces.counters.add_work(&self.evaluation.machine.take_work());
        pieces.counters.add(Counter::TessellationInvocations, count as u64);
        ran?;
        let machine = &self.evaluation.machine;
        self.reader.take(count, |slot| machine.output_vectors(slot), &mut self.shaded);
        self.batch.points.clear();
        self.batch.groups.clear();
        self.batch.ids.clear();
        Ok(())
    }
}
