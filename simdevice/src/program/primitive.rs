//! Tessellation and geometry programs that are compiled for draws. They take vertices from the stage before, and give
//! others, in the workgroup memory of their batches.

use super::outputs::VertexOutputs;
use super::pool::MachinePool;
use crate::limits::DRAW_SUBGROUP_SIZE;
use crate::program::interface::{
    GeometryPrograms, PrimitiveInput, PrimitiveProgram, TessellationPrograms, VertexMemory,
};
use crate::tessellation::Tessellation;
use fearless_simd::Level;
use isa::Options;
use isa::machine::Executable;
use isa::validate::InvalidProgram;

/// A program that takes vertices, and the meanings of its slots.
#[derive(Debug)]
pub(crate) struct PrimitiveStage {
    pub machines: MachinePool,
    pub inputs: Vec<(u32, PrimitiveInput)>,
    /// The vertices that it takes.
    pub input_memory: VertexMemory,
    /// The number of primitives or patches of a batch.
    pub groups: usize,
    /// The lanes of a batch.
    pub lanes: usize,
}

/// The two programs of tessellation.
#[derive(Debug)]
pub(crate) struct TessellationStage {
    pub control: PrimitiveStage,
    /// The vertices and the patch that the control program gives.
    pub output_memory: VertexMemory,
    /// The first bytes of the outer and inner levels in the memory of a patch.
    pub outer_levels: [Option<u32>; 4],
    pub inner_levels: [Option<u32>; 2],
    /// The number of vertices of an output patch.
    pub output_vertices: usize,
    pub evaluation: PrimitiveStage,
    pub outputs: VertexOutputs,
    pub tessellation: Tessellation,
}

/// The geometry program.
#[derive(Debug)]
pub(crate) struct GeometryStage {
    pub stage: PrimitiveStage,
    /// The number of invocations for each primitive.
    pub invocations: usize,
    /// The output that counts a lane's vertices.
    pub count: u32,
    /// The vertices that it gives.
    pub output_memory: VertexMemory,
    /// The bytes of each.
    pub vertex_bytes: u32,
    /// The outputs, by number in `output_memory`.
    pub outputs: VertexOutputs,
    /// The number of corners of the primitives that it gives.
    pub corners: usize,
}

impl GeometryStage {
    /// The most vertices that it gives for a primitive, at least 1.
    pub fn most_vertices(&self) -> u64 {
        let of_invocation = self.output_memory.stride / self.vertex_bytes.max(1);
        (self.invocations as u64 * u64::from(of_invocation)).max(1)
    }
}

impl PrimitiveStage {
    fn new(level: Level, stage: &PrimitiveProgram) -> Result<Self, InvalidProgram> {
        let options = Options {
            lanes: stage.lanes as usize,
            subgroup_size: DRAW_SUBGROUP_SIZE as usize,
            count_work: true,
            ..Options::new(level)
        };
        let executable = Executable::new(stage.program.clone(), &options)?;
        let meaning = |slot: u32| stage.inputs.get(slot as usize).copied().flatten();
        let inputs = executable.inputs().iter();
        let inputs = inputs.filter_map(|input| Some((input.slot, meaning(input.slot)?)));
        Ok(Self {
            inputs: inputs.collect(),
            input_memory: stage.input_memory.clone(),
            groups: stage.groups as usize,
            lanes: stage.lanes as usize,
            machines: MachinePool::new(executable),
        })
    }
}

impl TessellationStage {
    /// Compiles both programs. `outputs` are those of the evaluation program.
    pub(crate) fn new(
        level: Level,
        programs: &TessellationPrograms,
        outputs: VertexOutputs,
    ) -> Result<Self, InvalidProgram> {
        Ok(Self {
            control: PrimitiveStage::new(level, &programs.control)?,
            output_memory: programs.output_memory.clone(),
            outer_levels: programs.outer_levels,
            inner_levels: programs.inner_levels,
            output_vertices: programs.output_vertices as usize,
            evaluation: PrimitiveStage::new(level, &programs.evaluation)?,
            outputs,
            tessellation: programs.tessellation,
        })
    }
}

impl GeometryStage {
    /// Compiles the program. `outputs` are its outputs, by number in the memory that it gives.
    pub(crate) fn new(
        level: Level,
        programs: &GeometryPrograms,
        outputs: VertexOutputs,
    ) -> Result<Self, InvalidProgram> {
        Ok(Self {
            stage: PrimitiveStage::new(level, &programs.program)?,
            invocations: programs.invocations as usize,
            count: programs.count,
            output_memory: programs.output_memory.clone(),
            vertex_bytes: programs.vertex_bytes,
            outputs,
            corners: programs.corners,
        })
    }
}
