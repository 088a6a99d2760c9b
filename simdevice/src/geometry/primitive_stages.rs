//! The tessellation and geometry programs of a draw, one after the other.

use super::geometry_shader::GeometryShader;
use super::pieces::{PieceNumber, Pieces};
use super::primitive_list::{ListedPrimitive, PrimitiveList};
use super::shade::{OutputReader, Shaded};
use super::stage_runner::Environment;
use super::tessellation_shader::TessellationShader;
use super::vertex_reuse::VertexReuse;
use crate::packet::Draw;
use crate::program::bindings::BoundResources;
use crate::program::outputs::VertexOutputs;
use crate::state::Topology;
use crate::tessellation::Tessellation;
use fearless_simd::Level;
use isa::machine::Stopped;
use isa::resources::Resources;

/// The bindings of the programs, prepared for a draw.
pub(super) struct BoundStages<'a> {
    draw: &'a Draw,
    control: BoundResources<'a>,
    evaluation: BoundResources<'a>,
    geometry: BoundResources<'a>,
}

/// The resources of the programs.
pub(super) struct StageResources<'a> {
    control: Resources<'a>,
    evaluation: Resources<'a>,
    geometry: Resources<'a>,
}

impl<'a> BoundStages<'a> {
    pub(super) fn new(draw: &'a Draw, level: Level) -> Self {
        let bindings = &draw.primitive_bindings;
        Self {
            draw,
            control: bindings.control.bind(level),
            evaluation: bindings.evaluation.bind(level),
            geometry: bindings.geometry.bind(level),
        }
    }

    pub(super) fn resources(&self) -> StageResources<'_> {
        StageResources {
            control: self.control.resources(),
            evaluation: self.evaluation.resources(),
            geometry: self.geometry.resources(),
        }
    }

    /// Marks the memory that the programs may have written as changed.
    pub(super) fn bump_generations(&self) {
        let bindings = &self.draw.primitive_bindings;
        bindings.control.bump_generations();
        bindings.evaluation.bump_generations();
        bindings.geometry.bump_generations();
    }
}

/// Runs the programs on the primitives of segments.
pub(super) struct PrimitiveStages<'a> {
    topology: Topology,
    provoking_last: bool,
    tessellation: Option<TessellationShader<'a>>,
    geometry: Option<GeometryShader<'a>>,
    assembled: PrimitiveList,
    listed: Vec<ListedPrimitive>,
}

impl<'a> PrimitiveStages<'a> {
    /// The programs of a draw; `None` if it has only a vertex program before rasterization.
    pub(super) fn new(
        draw: &'a Draw,
        reader: &impl Fn(&'a VertexOutputs) -> OutputReader<'a>,
        resources: &'a StageResources<'a>,
        environment: Environment<'a>,
    ) -> Option<Self> {
        let pipeline = &draw.pipeline;
        if pipeline.tessellation.is_none() && pipeline.geometry.is_none() {
            return None;
        }
        let provoking_last = draw.state.provoking_last;
        Some(Self {
            topology: draw.state.topology,
            provoking_last,
            tessellation: pipeline.tessellation.as_ref().map(|stage| {
                let resources = [&resources.control, &resources.evaluation];
                let outputs = reader(&stage.outputs);
                // The other origin turns the domain over.
                let tessellation = Tessellation {
                    clockwise: stage.tessellation.clockwise != draw.state.lower_left_domain,
                    ..stage.tessellation
                };
                TessellationShader::new(stage, outputs, tessellation, resources, environment)
            }),
            geometry: pipeline.geometry.as_ref().map(|stage| {
                let reader = reader(&stage.outputs);
                GeometryShader::new(stage, reader, provoking_last, &resources.geometry, environment)
            }),
            assembled: PrimitiveList::default(),
            listed: Vec::new(),
        })
    }

    /// Runs the programs on a segment, and sets up what they make of it.
    pub(super) fn run(
        &mut self,
        reuse: &VertexReuse,
        shaded: &Shaded,
        segment: u64,
        pieces: &mut Pieces<'_>,
    ) -> Result<(), Stopped> {
        self.assembled.assemble(self.topology, reuse);
        let mut number = PieceNumber { segment, piece: 0 };
        let mut set_up = |shaded: &Shaded, primitives: &[ListedPrimitive], pieces: &mut Pieces<'_>| {
            pieces.set_up(shaded, primitives, number);
            number.piece += 1;
        };
        let Self { geometry, listed, provoking_last, .. } = self;
        let mut next = |shaded: &Shaded, primitives: &PrimitiveList, pieces: &mut Pieces<'_>| match geometry {
            Some(geometry) => geometry.run(shaded.values(), primitives, pieces, &mut set_up),
            None => {
                primitives.list(*provoking_last, listed);
                set_up(shaded, listed, pieces);
                Ok(())
            }
        };
        match &mut self.tessellation {
            Some(tessellation) => tessellation.run(shaded.values(), &self.assembled, pieces, &mut next),
            None => next(shaded, &self.assembled, pieces),
        }
    }
}
