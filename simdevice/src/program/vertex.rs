//! Vertex programs that are compiled for draws, alone or with the programs of later stages.

use super::outputs::VertexOutputs;
use super::pool::MachinePool;
use crate::limits::DRAW_SUBGROUP_SIZE;
use crate::program::fragment::FragmentStage;
use crate::program::interface::{
    CapturedOutputs, DrawPrograms, FragmentInput, PrimitiveInput, PrimitiveProgram, VertexInput,
};
use crate::program::primitive::{GeometryStage, TessellationStage};
use fearless_simd::Level;
use isa::Options;
use isa::ir::{Rate, Type};
use isa::machine::Executable;
use isa::validate::InvalidProgram;

/// The number of vertices in a batch.
pub(crate) const VERTEX_BATCH: usize = 128;

/// The programs of a draw's stages, compiled for one device.
#[derive(Debug)]
pub struct DrawPipeline {
    pub(crate) vertex: VertexProgram,
    /// The tessellation programs.
    pub(crate) tessellation: Option<TessellationStage>,
    /// The geometry program.
    pub(crate) geometry: Option<GeometryStage>,
    /// The fragment program.
    pub(crate) fragment: Option<FragmentStage>,
    /// The outputs that transform feedback writes.
    pub(crate) captured: Option<CapturedOutputs>,
}

/// The vertex program, and the meanings of its slots.
#[derive(Debug)]
pub(crate) struct VertexProgram {
    pub machines: MachinePool,
    pub inputs: Vec<(u32, Rate, VertexInput)>,
    pub outputs: VertexOutputs,
}

impl DrawPipeline {
    /// Compiles programs.
    ///
    /// # Errors
    /// [`InvalidProgram`] if one of them cannot run on the device.
    pub fn new(level: Level, programs: &DrawPrograms) -> Result<Self, InvalidProgram> {
        let captured = programs.captured.as_ref().map_or(0, |it| it.varyings);
        let varyings = programs.varyings_read() + captured;
        let control = programs.tessellation.as_ref().map(|it| &it.control);
        let geometry = programs.geometry.as_ref().map(|it| &it.program);
        // The stage after a stage reads its varyings.
        let given = |next: Option<&PrimitiveProgram>| next.map_or(varyings, values_taken);
        let vertex = VertexProgram::new(level, programs, given(control.or(geometry)))?;
        let tessellation = programs.tessellation.as_ref().map(|it| {
            let slots = it.evaluation.program.outputs.iter().map(|it| it.slot);
            let outputs = VertexOutputs::new(slots, &it.outputs, given(geometry), programs);
            TessellationStage::new(level, it, outputs)
        });
        let geometry = programs.geometry.as_ref().map(|it| {
            let numbers = 0..it.outputs.len() as u32;
            let outputs = VertexOutputs::new(numbers, &it.outputs, varyings, programs);
            GeometryStage::new(level, it, outputs)
        });
        let fragment = programs.fragment.as_ref();
        let fragment = fragment.map(|fragment| FragmentStage::new(level, fragment)).transpose()?;
        Ok(Self {
            vertex,
            tessellation: tessellation.transpose()?,
            geometry: geometry.transpose()?,
            fragment,
            captured: programs.captured.clone(),
        })
    }

    /// True if a stage after tessellation reads the numbers of primitives, which count those of all patches before.
    pub(crate) fn numbers_primitives(&self) -> bool {
        let of_geometry = |stage: &GeometryStage| {
            let mut inputs = stage.stage.inputs.iter();
            inputs.any(|(_, input)| *input == PrimitiveInput::PrimitiveId)
        };
        let reads = match &self.geometry {
            Some(stage) => of_geometry(stage),
            None => self.fragment.as_ref().is_some_and(|stage| {
                let mut inputs = stage.interface.inputs.iter();
                inputs.any(|(_, input, _)| *input == FragmentInput::PrimitiveId)
            }),
        };
        self.tessellation.is_some() && reads
    }

    /// The outputs of the last stage before rasterization.
    pub(crate) fn last_outputs(&self) -> &VertexOutputs {
        match (&self.geometry, &self.tessellation) {
            (Some(geometry), _) => &geometry.outputs,
            (None, Some(tessellation)) => &tessellation.outputs,
            (None, None) => &self.vertex.outputs,
        }
    }

    /// Compiles a vertex program that projects Gaussians; see [`gaussian`](crate::program::interface::gaussian).
    ///
    /// # Errors
    /// [`InvalidProgram`] if it cannot run on the device.
    pub fn of_gaussians(level: Level, programs: &DrawPrograms) -> Result<Self, InvalidProgram> {
        Ok(Self {
            vertex: VertexProgram::new(level, programs, programs.varyings)?,
            tessellation: None,
            geometry: None,
            fragment: None,
            captured: None,
        })
    }
}

impl VertexProgram {
    /// Compiles the vertex program. `varyings` is the number of varyings that are read.
    fn new(level: Level, programs: &DrawPrograms, varyings: u32) -> Result<Self, InvalidProgram> {
        let options = Options {
            lanes: VERTEX_BATCH,
            subgroup_size: DRAW_SUBGROUP_SIZE as usize,
            count_work: true,
            ..Options::new(level)
        };
        let executable = Executable::new(programs.vertex.clone(), &options)?;
        let meaning = |slot: u32| programs.vertex_inputs.get(slot as usize).copied().flatten();
        let is_word = |reg: isa::ir::Reg| {
            let register = programs.vertex.registers.get(reg.0 as usize);
            register.is_some_and(|register| register.ty == Type::B32)
        };
        let inputs = executable
            .inputs()
            .iter()
            .filter(|input| is_word(input.reg))
            .filter_map(|input| Some((input.slot, input.rate, meaning(input.slot)?)))
            .collect();
        Ok(Self {
            inputs,
            outputs: VertexOutputs::new(
                programs.vertex.outputs.iter().map(|output| output.slot),
                &programs.vertex_outputs,
                varyings,
                programs,
            ),
            machines: MachinePool::new(executable),
        })
    }
}

/// The number of values that a program takes from the stage before it.
fn values_taken(program: &PrimitiveProgram) -> u32 {
    let numbers = program.input_memory.values.iter().map(|value| value.number + 1);
    numbers.max().unwrap_or(0)
}
