//! Linking of tessellation and geometry programs: the exchange of vertices with the stages before and after them.

use super::varyings::{InterfaceComponent, LiveOutputs, Varyings, drop_outputs, vertex_output, zero_inputs};
use crate::abi::error::Error;
use gaurast_spirv::{
    BuiltIn, Domain, InputPrimitive, InputSource, Interface, MemoryScalar, OutputPrimitive, OutputTarget,
    PrimitiveModes, Shader, Spacing, Stage, VertexMemory as ShaderMemory,
};
use simdevice::program::interface::{
    GeometryPrograms, PrimitiveInput, PrimitiveProgram, TessellationPrograms, VertexMemory, VertexOutput, VertexValue,
};
use simdevice::state::Topology;
use simdevice::tessellation::{self, Tessellation};

/// The shaders of tessellation.
pub(crate) struct TessellationShaders {
    /// The control shader.
    pub(crate) control: Shader,
    /// The evaluation shader.
    pub(crate) evaluation: Shader,
}

/// The values that a stage gives to the stage after it, in the order of their numbers.
pub(super) type Given = Vec<OutputTarget>;

/// The targets that a stage writes.
pub(super) fn targets(interface: &Interface) -> impl Iterator<Item = OutputTarget> {
    let memory = interface.exchange.outputs.scalars.iter();
    let outputs = interface.outputs.iter().map(|output| output.target);
    outputs.chain(memory.map(|scalar| scalar.target))
}

/// The values that a stage writes and the next stage takes from each vertex.
pub(super) fn given(before: &Interface, next: &Interface) -> Given {
    let mut given = Given::new();
    for scalar in &next.exchange.inputs.scalars {
        let is_written = targets(before).any(|target| target == scalar.target);
        if is_written && !given.contains(&scalar.target) {
            given.push(scalar.target);
        }
    }
    given
}

/// The output of a vertex or evaluation stage as a value for the stage after it.
pub(super) fn output_given(target: OutputTarget, given: &Given) -> Option<VertexOutput> {
    let number = given.iter().position(|it| *it == target)?;
    Some(VertexOutput::Varying(number as u32))
}

/// Links the tessellation stages. `given` are the values of the vertex stage, and `outputs` gives the meaning of an
/// output of the evaluation stage.
pub(super) fn tessellation(
    shaders: TessellationShaders,
    given: &Given,
    outputs: impl Fn(OutputTarget) -> Option<VertexOutput>,
) -> TessellationPrograms {
    let TessellationShaders { control, evaluation } = shaders;
    let memory = &control.interface.exchange.outputs;
    let levels = |built_in, component| {
        let target = OutputTarget::BuiltIn { built_in, component };
        let scalar = memory.scalars.iter().find(|it| it.target == target);
        scalar.map(|it| it.offset)
    };
    let outer_levels = [0, 1, 2, 3].map(|index| levels(BuiltIn::TessLevelOuter, index));
    let inner_levels = [0, 1].map(|index| levels(BuiltIn::TessLevelInner, index));
    let wanted = &evaluation.interface.exchange.inputs.scalars;
    let taken: Vec<MemoryScalar> =
        memory.scalars.iter().copied().filter(|written| wanted.iter().any(|read| is_same(read, written))).collect();
    let output_memory = VertexMemory {
        start: memory.start,
        stride: memory.stride,
        values: (0..).zip(&taken).map(|(number, it)| value(number, it)).collect(),
    };
    let source = |read: &MemoryScalar| taken.iter().position(|written| is_same(read, written));
    let modes = [control.interface.modes, evaluation.interface.modes];
    let output_vertices = modes[0].output_vertices.unwrap_or(1);
    let mut evaluation = evaluation;
    let meanings: Vec<_> = evaluation.interface.outputs.iter().map(|output| outputs(output.target)).collect();
    drop_outputs(&mut evaluation.program, &meanings);
    TessellationPrograms {
        control: program(control, |read| position(given, read.target)),
        output_memory,
        outer_levels,
        inner_levels,
        output_vertices,
        evaluation: program(evaluation, source),
        outputs: meanings,
        tessellation: division(modes),
    }
}

/// Links the geometry stage. `given` are the values of the stage before it.
pub(super) fn geometry(
    shader: Shader,
    given: &Given,
    varyings: &Varyings,
    live_outputs: LiveOutputs<'_>,
) -> GeometryPrograms {
    let memory = &shader.interface.exchange.outputs;
    let modes = shader.interface.modes;
    let mut output_memory = VertexMemory { start: memory.start, stride: memory.stride, values: Vec::new() };
    let mut outputs = Vec::new();
    for scalar in &memory.scalars {
        let meaning = vertex_output(scalar.target, varyings, live_outputs);
        if meaning.is_some() {
            output_memory.values.push(value(outputs.len() as u32, scalar));
            outputs.push(meaning);
        }
    }
    let mut count = shader.interface.outputs.iter();
    let count = count.position(|output| output.target == OutputTarget::VertexCount);
    GeometryPrograms {
        invocations: modes.invocations.unwrap_or(1).max(1),
        count: count.unwrap_or(0) as u32,
        output_memory,
        vertex_bytes: shader.interface.exchange.vertex_bytes,
        outputs,
        corners: match modes.output {
            Some(OutputPrimitive::Points) => 1,
            Some(OutputPrimitive::LineStrip) => 2,
            Some(OutputPrimitive::TriangleStrip) | None => 3,
        },
        program: program(shader, |read| position(given, read.target)),
    }
}

/// Gives an output of a geometry stage a second target. `None` if the stage never writes it.
pub(super) fn carry_written(interface: &mut Interface, written: OutputTarget, target: OutputTarget) -> Option<()> {
    let scalars = &mut interface.exchange.outputs.scalars;
    let found = scalars.iter().find(|scalar| scalar.target == written);
    let scalar = MemoryScalar { target, ..*found? };
    scalars.push(scalar);
    Some(())
}

/// The number of vertices of the primitives that a geometry stage takes.
fn taken_corners(input: InputPrimitive) -> usize {
    match input {
        InputPrimitive::Points => 1,
        InputPrimitive::Lines => 2,
        InputPrimitive::LinesAdjacency => 4,
        InputPrimitive::Triangles => 3,
        InputPrimitive::TrianglesAdjacency => 6,
    }
}

/// The program of a stage that takes vertices. `source` gives the number of the value that an input takes.
fn program(mut shader: Shader, source: impl Fn(&MemoryScalar) -> Option<usize>) -> PrimitiveProgram {
    let exchange = &shader.interface.exchange;
    let inputs: Vec<_> = shader.interface.inputs.iter().map(|input| primitive_input(input.source)).collect();
    zero_inputs(&mut shader.program, &inputs);
    let input_memory = memory(&exchange.inputs, source);
    PrimitiveProgram { inputs, input_memory, groups: exchange.groups, lanes: exchange.lanes, program: shader.program }
}

/// The values that a stage takes. Those without a source stay zero.
fn memory(memory: &ShaderMemory, source: impl Fn(&MemoryScalar) -> Option<usize>) -> VertexMemory {
    let values = memory.scalars.iter();
    VertexMemory {
        start: memory.start,
        stride: memory.stride,
        values: values.filter_map(|scalar| Some(value(source(scalar)? as u32, scalar))).collect(),
    }
}

fn value(number: u32, scalar: &MemoryScalar) -> VertexValue {
    VertexValue { number, offset: scalar.offset, vertex_stride: scalar.vertex_stride }
}

fn position(given: &Given, target: OutputTarget) -> Option<usize> {
    given.iter().position(|it| *it == target)
}

/// Reports whether an input of the evaluation stage is an output of the control stage.
fn is_same(read: &MemoryScalar, written: &MemoryScalar) -> bool {
    read.target == written.target && read.vertex_stride.is_some() == written.vertex_stride.is_some()
}

fn primitive_input(source: InputSource) -> Option<PrimitiveInput> {
    match source {
        InputSource::Patch => Some(PrimitiveInput::Patch),
        InputSource::BuiltIn { built_in, component } => match built_in {
            BuiltIn::PrimitiveId => Some(PrimitiveInput::PrimitiveId),
            BuiltIn::InvocationId => Some(PrimitiveInput::InvocationId),
            BuiltIn::PatchVertices => Some(PrimitiveInput::PatchVertices),
            BuiltIn::TessCoord => Some(PrimitiveInput::TessCoord(component as usize)),
            BuiltIn::ViewIndex => Some(PrimitiveInput::ViewIndex),
            _ => None,
        },
        InputSource::Location { .. } => None,
    }
}

/// The way in which patches are divided, which either stage may say.
fn division([control, evaluation]: [PrimitiveModes; 2]) -> Tessellation {
    Tessellation {
        domain: match evaluation.domain.or(control.domain) {
            Some(Domain::Isolines) => tessellation::Domain::Isolines,
            Some(Domain::Quads) => tessellation::Domain::Quads,
            Some(Domain::Triangles) | None => tessellation::Domain::Triangles,
        },
        spacing: match evaluation.spacing.or(control.spacing) {
            Some(Spacing::FractionalEven) => tessellation::Spacing::FractionalEven,
            Some(Spacing::FractionalOdd) => tessellation::Spacing::FractionalOdd,
            Some(Spacing::Equal) | None => tessellation::Spacing::Equal,
        },
        clockwise: evaluation.clockwise.or(control.clockwise).unwrap_or(false),
        point_mode: evaluation.point_mode || control.point_mode,
    }
}

/// The primitives that a geometry stage takes of a topology; `None` for patches.
fn primitives_of(topology: Topology) -> Option<InputPrimitive> {
    match topology {
        Topology::PointList => Some(InputPrimitive::Points),
        Topology::LineList | Topology::LineStrip => Some(InputPrimitive::Lines),
        Topology::LineListWithAdjacency | Topology::LineStripWithAdjacency => Some(InputPrimitive::LinesAdjacency),
        Topology::TriangleList | Topology::TriangleStrip | Topology::TriangleFan => Some(InputPrimitive::Triangles),
        Topology::TriangleListWithAdjacency | Topology::TriangleStripWithAdjacency => {
            Some(InputPrimitive::TrianglesAdjacency)
        }
        Topology::PatchList { .. } => None,
    }
}

/// Refuses stages that don't fit each other, or the topology, unless that is dynamic.
///
/// # Errors
/// [`Error::InvalidUsage`].
pub(crate) fn check(
    tessellation: Option<&TessellationShaders>,
    geometry: Option<&Shader>,
    topology: Option<Topology>,
) -> Result<(), Error> {
    if let Some(TessellationShaders { control, evaluation }) = tessellation {
        let (first, second) = (control.interface.modes, evaluation.interface.modes);
        if first.domain.or(second.domain).is_none() {
            return Err(Error::usage(
                "VUID-VkGraphicsPipelineCreateInfo-pStages-00733",
                "no tessellation stage names the domain of patches",
            ));
        }
        let others = (first.domain, second.domain);
        if matches!(others, (Some(one), Some(other)) if one != other) {
            return Err(Error::usage(
                "VUID-VkGraphicsPipelineCreateInfo-pStages-00733",
                "the tessellation stages name two domains",
            ));
        }
    }
    if let Some(geometry) = geometry
        && (geometry.interface.modes.input.is_none() || geometry.interface.modes.output.is_none())
    {
        return Err(Error::InvalidShader(
            "the geometry shader doesn't name the primitives that it takes and emits".into(),
        ));
    }
    let taken = geometry.and_then(|shader| shader.interface.modes.input);
    let given = topology.and_then(primitives_of);
    if let (Some(taken), Some(given), None) = (taken, given, tessellation)
        && taken != given
    {
        return Err(Error::usage(
            "VUID-VkGraphicsPipelineCreateInfo-pStages-00738",
            format!("the geometry shader takes {taken:?}, and the topology makes {given:?}"),
        ));
    }
    if let (Some(taken), Some(shaders)) = (taken, tessellation) {
        let modes = [shaders.control.interface.modes, shaders.evaluation.interface.modes];
        let corners = division(modes).corners();
        if taken_corners(taken) != corners {
            return Err(Error::usage(
                "VUID-VkGraphicsPipelineCreateInfo-pStages-00739",
                format!("the geometry shader takes {taken:?}, but tessellation makes primitives of {corners} vertices"),
            ));
        }
    }
    Ok(())
}

/// The components of locations that a stage writes.
pub(super) fn components_written(interface: &Interface) -> impl Iterator<Item = InterfaceComponent> + '_ {
    targets(interface).filter_map(|target| match target {
        OutputTarget::Location { location, component, .. } => Some(InterfaceComponent { location, component }),
        _ => None,
    })
}

/// Reports whether a stage gives its outputs in memory.
pub(super) fn gives_memory(interface: &Interface) -> bool {
    interface.stage == Stage::Geometry
}
