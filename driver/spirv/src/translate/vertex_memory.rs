//! The values of vertices in workgroup memory, where tessellation and geometry stages take and give them.
//!
//! Inputs of these stages are arrays over the vertices of a primitive or patch, and so are the outputs of a tessellation
//! control stage. The batch's memory holds them for each primitive or patch. A geometry stage's outputs are variables
//! like a vertex stage's; when it emits a vertex, they are stored to memory.

use isa::ir::{Address, Format, Rate, Reg, Space, Type as IrType};
use isa::op::Op as Ir;
use spirv::{BuiltIn, Capability, Decoration, StorageClass};

use super::inputs_outputs::output_target;
use super::translator::Translator;
use super::value::{MemoryRef, TIGHT};
use super::vertex_places::{Array, Emission, Region};
use crate::error::{Result, malformed};
use crate::instruction::Instruction;
use crate::interface::{
    InputSource, MAX_VERTEX_STREAMS, MemoryScalar, Output, OutputTarget, ScalarType, Stage, VertexMemory,
};
use crate::types::{Scalar, Type};

/// The most lanes of a batch.
const MAX_LANES: u32 = 128;
/// The most patches of a batch of a tessellation evaluation stage.
const MAX_PATCHES: u32 = 32;
/// The bytes that a batch's vertices take, unless a few primitives or patches take more.
const BATCH_BYTES: u32 = 1 << 18;
/// The most scalars of one store of the IR.
const MAX_ELEMENTS: usize = 16;
/// The most vertices of a patch.
const MAX_PATCH_VERTICES: u32 = 32;
/// The most vertices that an invocation of a geometry stage emits.
const MAX_EMITTED_VERTICES: u32 = 1024;
/// The bytes of a word.
const WORD_BYTES: u32 = 4;
/// The bytes of an emitted vertex before its scalars.
const VERTEX_HEADER: u32 = WORD_BYTES;

/// Reserves the memory of a tessellation or geometry stage.
pub fn allocate(t: &mut Translator) -> Result<()> {
    let Some(vertices) = output_vertices(t)? else {
        return Ok(());
    };
    let is_geometry = t.interface.stage == Stage::Geometry;
    let mut inputs = region(t, StorageClass::Input)?;
    let mut outputs = region(t, StorageClass::Output)?;
    let emitted = emitted_variables(t);
    let vertex_bytes = vertex_bytes(t, &emitted)?;
    if is_geometry {
        outputs.stride = vertex_bytes.saturating_mul(vertices);
    }
    let group = begin_batch(t, &mut inputs, &mut outputs, vertices);
    place_arrays(t, &inputs, group);
    let first = place_arrays(t, &outputs, group);
    if is_geometry {
        let start = t.emit.u32(outputs.start);
        let first = t.emit.op(Ir::IAdd, &[first, start]);
        let emission = Emission {
            variables: emitted,
            max_vertices: vertices,
            vertex_bytes,
            next: variable(t, first),
            count: count_output(t),
            begins_strip: {
                let one = t.emit.u32(1);
                (0..streams(t)).map(|_| variable(t, one)).collect()
            },
        };
        t.vertex_memory.emission = Some(emission);
    }
    (t.vertex_memory.inputs, t.vertex_memory.outputs) = (inputs, outputs);
    Ok(())
}

/// The number of vertices that an invocation of a geometry stage may emit, or of a control stage's output patch, or 1.
/// None for stages that don't use this memory.
fn output_vertices(t: &Translator) -> Result<Option<u32>> {
    let limit = match t.interface.stage {
        Stage::Vertex | Stage::Fragment | Stage::Compute => return Ok(None),
        Stage::TessellationEvaluation => return Ok(Some(1)),
        Stage::TessellationControl => MAX_PATCH_VERTICES,
        Stage::Geometry => MAX_EMITTED_VERTICES,
    };
    match t.interface.modes.output_vertices {
        Some(count) if (1..=limit).contains(&count) => Ok(Some(count)),
        _ => malformed(format!("the number of output vertices isn't 1 to {limit}")),
    }
}

/// The variables of a storage class that are in memory, in order.
fn region(t: &Translator, class: StorageClass) -> Result<Region> {
    let mut region = Region::default();
    let mut used: Vec<u32> = t.analysis.used.iter().copied().collect();
    used.sort_unstable();
    for id in used {
        let variable = t.globals.variables.get(&id);
        let Some(variable) = variable.filter(|it| it.class == class) else {
            continue;
        };
        let types = &t.globals.types;
        let bytes = |ty| types.tight_size(ty).map(narrow);
        let (ty, vertex_stride) = match sharing(t, id, class, variable.pointee) {
            Sharing::Invocation => continue,
            Sharing::Patch => (variable.pointee, None),
            Sharing::Vertex => match types.get(variable.pointee)? {
                Type::Array { element, .. } => (*element, Some(bytes(*element)?)),
                _ => return malformed(format!("%{id} isn't an array over vertices")),
            },
        };
        region.arrays.push(Array { variable: id, ty, offset: region.stride, vertex_stride });
        region.stride = region.stride.saturating_add(bytes(variable.pointee)?);
    }
    Ok(region)
}

/// What has a value of an input or output of its own.
enum Sharing {
    Invocation,
    Vertex,
    Patch,
}

fn sharing(t: &Translator, id: u32, class: StorageClass, ty: u32) -> Sharing {
    let stage = t.interface.stage;
    if class == StorageClass::Output && stage != Stage::TessellationControl {
        return Sharing::Invocation;
    }
    match t.module.built_in(id) {
        Some(BuiltIn::TessLevelOuter | BuiltIn::TessLevelInner) => Sharing::Patch,
        Some(BuiltIn::Position | BuiltIn::PointSize | BuiltIn::ClipDistance | BuiltIn::CullDistance) => Sharing::Vertex,
        Some(_) => Sharing::Invocation,
        None if is_of_patch(t, id, ty) => Sharing::Patch,
        None => Sharing::Vertex,
    }
}

/// Reports whether a variable, or a member of its block, belongs to the patch.
fn is_of_patch(t: &Translator, id: u32, ty: u32) -> bool {
    let block = match t.globals.types.get(ty) {
        Ok(Type::Array { element, .. }) => *element,
        _ => ty,
    };
    let members = match t.globals.types.get(block) {
        Ok(Type::Struct(members)) => members.len() as u32,
        _ => 0,
    };
    let of_patch = |member| t.module.member_has(block, member, Decoration::Patch);
    t.module.has(id, Decoration::Patch) || (0..members).any(of_patch)
}

/// The output variables of a geometry stage, in order.
fn emitted_variables(t: &Translator) -> Vec<u32> {
    let is_output = |id: &u32| {
        let variable = t.globals.variables.get(id);
        variable.is_some_and(|it| it.class == StorageClass::Output)
    };
    let mut variables: Vec<u32> = t.analysis.used.iter().copied().filter(is_output).collect();
    variables.sort_unstable();
    variables
}

/// The bytes of a vertex with these variables.
fn vertex_bytes(t: &Translator, variables: &[u32]) -> Result<u32> {
    let mut bytes = VERTEX_HEADER;
    for id in variables {
        let size = t.globals.types.tight_size(t.globals.variables[id].pointee)?;
        bytes = bytes.saturating_add(narrow(size));
    }
    Ok(bytes)
}

/// Chooses the size of a batch and reserves its memory. Returns the number of a lane's primitive or patch.
fn begin_batch(t: &mut Translator, inputs: &mut Region, outputs: &mut Region, vertices: u32) -> Reg {
    let each = inputs.stride.saturating_add(outputs.stride).max(1);
    let most = (BATCH_BYTES / each).max(1);
    let exchange = &mut t.interface.exchange;
    (exchange.groups, exchange.lanes) = match t.interface.stage {
        Stage::Geometry => {
            let lanes = (most / 16 * 16).clamp(16, MAX_LANES);
            (lanes, lanes)
        }
        Stage::TessellationControl => {
            let patches = most.min(MAX_LANES / vertices);
            (patches, (patches * vertices).next_multiple_of(16))
        }
        _ => (most.min(MAX_PATCHES), MAX_LANES),
    };
    let groups = exchange.groups;
    let builder = &mut t.emit.builder;
    inputs.start = builder.allocate_shared(groups.saturating_mul(inputs.stride), 4);
    builder.preload_shared();
    outputs.start = builder.allocate_shared(groups.saturating_mul(outputs.stride), 4);
    match t.interface.stage {
        Stage::Geometry => t.emit.builder.lane_index(),
        Stage::TessellationControl => {
            let lane = t.emit.builder.lane_index();
            t.emit.div_rem(lane, vertices).0
        }
        _ => {
            let number = ScalarType::Uint { width: 32 };
            let source = InputSource::Patch;
            t.io.input(&mut t.emit, source, number, Rate::Varying)
        }
    }
}

/// Gives the arrays of a region their places. Returns the first byte, within the region, of a lane's group.
fn place_arrays(t: &mut Translator, region: &Region, group: Reg) -> Reg {
    let stride = t.emit.u32(region.stride);
    let base = t.emit.op(Ir::IMul, &[group, stride]);
    for array in &region.arrays {
        let place = MemoryRef {
            space: Space::Shared,
            base: Some(base),
            offset: region.start.saturating_add(array.offset),
            layout: TIGHT,
            ty: t.globals.variables[&array.variable].pointee,
        };
        t.vertex_memory.places.insert(array.variable, place);
    }
    base
}

/// A variable of the IR with its first value.
fn variable(t: &mut Translator, value: Reg) -> Reg {
    let variable = t.emit.builder.variable(IrType::B32);
    t.emit.builder.assign(variable, value);
    variable
}

/// The output that counts the emitted vertices.
fn count_output(t: &mut Translator) -> Reg {
    let slot = t.io.outputs.len() as u32;
    t.io.outputs.push(Output { target: OutputTarget::VertexCount, numeric: ScalarType::Uint { width: 32 } });
    t.emit.builder.output(slot, IrType::B32)
}

/// The number of streams to which a geometry stage may emit vertices.
fn streams(t: &Translator) -> usize {
    match t.module.declares(Capability::GeometryStreams) {
        true => MAX_VERTEX_STREAMS,
        false => 1,
    }
}

/// The stream that an instruction names.
fn stream(t: &Translator, instruction: &Instruction) -> Result<u32> {
    match t.globals.constant_u32(instruction.id(0)?) {
        Some(stream) if (stream as usize) < streams(t) => Ok(stream),
        _ => malformed("the stream isn't a constant that there is"),
    }
}

/// Translates `OpEmitStreamVertex`.
pub fn emit_stream_vertex(t: &mut Translator, instruction: &Instruction) -> Result<()> {
    let stream = stream(t, instruction)?;
    emit_vertex(t, stream)
}

/// Translates `OpEndStreamPrimitive`.
pub fn end_stream_primitive(t: &mut Translator, instruction: &Instruction) -> Result<()> {
    let stream = stream(t, instruction)?;
    end_primitive(t, stream)
}

/// Emits a vertex to a stream. Vertices beyond the most that the stage declares are dropped.
pub fn emit_vertex(t: &mut Translator, stream: u32) -> Result<()> {
    let Some(emission) = &t.vertex_memory.emission else {
        return malformed("this stage emits no vertices");
    };
    let Emission { max_vertices, vertex_bytes, next, count, ref begins_strip, ref variables } = *emission;
    let (begins_strip, variables) = (begins_strip[stream as usize], variables.clone());
    let header = match stream {
        0 => begins_strip,
        _ => {
            let number = t.emit.u32(stream << 1);
            t.emit.op(Ir::Or, &[begins_strip, number])
        }
    };
    let mut stored = vec![header];
    for id in variables {
        let Some(variable) = t.promoted.find(id) else {
            return malformed(format!("output %{id} isn't held in registers"));
        };
        for index in 0..t.promoted.variables[variable].scalars.len() {
            let (emit, io) = (&mut t.emit, &mut t.io);
            let reg = t.promoted.read_scalar(emit, io, variable, index)?;
            match t.emit.builder.type_of(reg) {
                IrType::B32 => stored.push(reg),
                IrType::B64 => stored.extend(t.emit.words(reg)),
                _ => return malformed("an output of a geometry shader is a truth value"),
            }
        }
    }
    t.emit.charge_budget(stored.len())?;
    let (zero, one, all) = (t.emit.u32(0), t.emit.u32(1), t.emit.u32(max_vertices));
    let (size, nowhere) = (t.emit.u32(vertex_bytes), t.emit.u32(u32::MAX));
    let fits = t.emit.op(Ir::ULt, &[count, all]);
    let base = t.emit.select(fits, next, nowhere);
    for (part, regs) in (0..).zip(stored.chunks(MAX_ELEMENTS)) {
        let address = Address { space: Space::Shared, base: Some(base), offset: part * 4 * MAX_ELEMENTS as u32 };
        t.emit.builder.store(address, Format::B32, regs);
    }
    for (variable, step) in [(next, size), (count, one)] {
        let step = t.emit.select(fits, step, zero);
        let sum = t.emit.op(Ir::IAdd, &[variable, step]);
        t.emit.builder.assign(variable, sum);
    }
    t.emit.builder.assign(begins_strip, zero);
    Ok(())
}

/// Ends the strip of a stream.
pub fn end_primitive(t: &mut Translator, stream: u32) -> Result<()> {
    let Some(emission) = &t.vertex_memory.emission else {
        return malformed("this stage emits no primitives");
    };
    let begins_strip = emission.begins_strip[stream as usize];
    let one = t.emit.u32(1);
    t.emit.builder.assign(begins_strip, one);
    Ok(())
}

/// Describes the memory in the interface.
pub fn describe(t: &mut Translator) -> Result<()> {
    let places = std::mem::take(&mut t.vertex_memory);
    t.interface.exchange.inputs = arrays(t, &places.inputs)?;
    t.interface.exchange.outputs = arrays(t, &places.outputs)?;
    if let Some(emission) = &places.emission {
        t.interface.exchange.vertex_bytes = emission.vertex_bytes;
        let scalars = emitted_scalars(t, emission)?;
        t.interface.exchange.outputs.scalars = scalars;
    }
    Ok(())
}

fn arrays(t: &mut Translator, region: &Region) -> Result<VertexMemory> {
    let mut scalars = Vec::new();
    for array in &region.arrays {
        let types: Vec<Scalar> = t.globals.types.flatten(array.ty)?;
        let locations = t.io.locations_as(array.variable, array.ty)?;
        let mut offset = array.offset;
        for (location, scalar) in locations.iter().zip(types) {
            for (word, numeric) in location.words(scalar) {
                scalars.push(MemoryScalar {
                    target: output_target(word)?,
                    numeric,
                    offset,
                    vertex_stride: array.vertex_stride,
                });
                offset = offset.saturating_add(WORD_BYTES);
            }
        }
    }
    Ok(VertexMemory { start: region.start, stride: region.stride, scalars })
}

/// The scalars that a geometry stage's vertices have.
fn emitted_scalars(t: &mut Translator, emission: &Emission) -> Result<Vec<MemoryScalar>> {
    let mut scalars = Vec::new();
    let mut offset = VERTEX_HEADER;
    for id in &emission.variables {
        let Some(number) = t.promoted.find(*id) else {
            continue;
        };
        let locations = t.io.locations(*id)?;
        let variable = &t.promoted.variables[number];
        for (index, location) in locations.iter().enumerate() {
            for (word, numeric) in location.words(variable.scalars[index]) {
                if variable.written[index] {
                    scalars.push(MemoryScalar {
                        target: output_target(word)?,
                        numeric,
                        offset,
                        vertex_stride: Some(emission.vertex_bytes),
                    });
                }
                offset = offset.saturating_add(WORD_BYTES);
            }
        }
    }
    Ok(scalars)
}

/// A size in memory, which is checked when memory is reserved.
fn narrow(bytes: u64) -> u32 {
    u32::try_from(bytes).unwrap_or(u32::MAX)
}
