//! Inputs and outputs: locations and built-ins.

use std::collections::HashMap;
use std::rc::Rc;

use isa::ir::{Rate, Reg, Type};
use isa::op::Op as Ir;
use spirv::{BuiltIn as Spirv, Decoration};

use super::emitter::Emitter;
use super::options::Options;
use crate::error::{Result, malformed, unsupported};
use crate::globals::Globals;
use crate::interface::{
    BuiltIn, Input, InputSource, Interface, Interpolation, Output, OutputTarget, Sampling, ScalarType, Stage,
};
use crate::module::Module;
use crate::types::{Member, Scalar, Type as SpirvType};

/// The most locations of an interface.
const MAX_LOCATIONS: u32 = 1 << 10;

/// The most scalars of a built-in.
const MAX_BUILT_IN_SCALARS: u32 = 64;

/// The source of a scalar of an input, or the target of one of an output.
#[derive(Clone, Copy, Debug)]
pub enum IoLocation {
    Location { location: u32, component: u32, interpolation: Interpolation, sampling: Sampling, index: u32 },
    BuiltIn { built_in: Spirv, component: u32 },
}

impl IoLocation {
    /// The location of the second word of a 64-bit scalar whose first word is here.
    fn second(self) -> Self {
        match self {
            Self::Location { location, component, interpolation, sampling, index } => {
                Self::Location { location, component: component + 1, interpolation, sampling, index }
            }
            built_in => built_in,
        }
    }

    /// The locations of a scalar's words, each with its type.
    pub fn words(self, scalar: Scalar) -> Vec<(Self, ScalarType)> {
        match scalar.is_wide() {
            false => vec![(self, scalar.at_interface())],
            true => vec![(self, WORD), (self.second(), WORD)],
        }
    }
}

/// The type of a word of a 64-bit scalar.
const WORD: ScalarType = ScalarType::Uint { width: 32 };

/// The location of the next scalar.
#[derive(Clone, Copy)]
struct Cursor {
    location: Option<u32>,
    component: u32,
    interpolation: Interpolation,
    sampling: Sampling,
    index: u32,
}

/// The inputs and outputs of an entry point.
#[derive(Debug)]
pub struct InputsOutputs<'a> {
    pub module: &'a Module,
    pub globals: &'a Globals,
    pub stage: Stage,
    pub workgroup_size: [u32; 3],
    pub subgroup_size: u32,
    view_is_device: bool,
    /// Tessellation control: the number of vertices of an output patch.
    pub output_vertices: u32,
    pub inputs: Vec<Input>,
    pub outputs: Vec<Output>,
    /// True if an input is read that differs between samples.
    pub per_sample: bool,
    /// The registers of the inputs that were read.
    registers: HashMap<InputSource, Reg>,
    /// The locations of the variables' scalars.
    locations: HashMap<u32, Rc<[IoLocation]>>,
}

impl<'a> InputsOutputs<'a> {
    /// The interface of an entry point, still without inputs and outputs.
    pub fn new(module: &'a Module, globals: &'a Globals, interface: &Interface, options: &Options) -> Self {
        Self {
            module,
            globals,
            stage: interface.stage,
            workgroup_size: interface.workgroup_size,
            subgroup_size: options.subgroup_size,
            view_is_device: options.view_is_device,
            output_vertices: interface.modes.output_vertices.unwrap_or(0),
            inputs: Vec::new(),
            outputs: Vec::new(),
            per_sample: false,
            registers: HashMap::new(),
            locations: HashMap::new(),
        }
    }

    /// The location of each scalar of an input or output variable.
    pub fn locations(&mut self, variable: u32) -> Result<Rc<[IoLocation]>> {
        if let Some(locations) = self.locations.get(&variable) {
            return Ok(locations.clone());
        }
        let locations = self.find_locations(variable)?;
        self.locations.insert(variable, locations.clone());
        Ok(locations)
    }

    fn find_locations(&self, variable: u32) -> Result<Rc<[IoLocation]>> {
        let Some(global) = self.globals.variables.get(&variable) else {
            return malformed(format!("%{variable} isn't an input or output"));
        };
        self.locations_as(variable, global.pointee)
    }

    /// The location of each scalar of an input or output variable, taken as of type `ty`: that of one vertex, if the
    /// variable is an array of vertices' values.
    pub fn locations_as(&self, variable: u32, ty: u32) -> Result<Rc<[IoLocation]>> {
        let scalars = self.globals.types.scalars(ty)?;
        if let Some(built_in) = self.module.built_in(variable) {
            if scalars > MAX_BUILT_IN_SCALARS {
                return unsupported("a built-in of this many elements");
            }
            let one = |component| IoLocation::BuiltIn { built_in, component };
            return Ok((0..scalars).map(one).collect());
        }
        let number = |decoration| self.module.literal(variable, decoration);
        let has = |decoration| self.module.has(variable, decoration);
        let mut cursor = Cursor {
            location: number(Decoration::Location),
            component: number(Decoration::Component).unwrap_or(0),
            interpolation: interpolation(has),
            sampling: sampling(has),
            index: number(Decoration::Index).unwrap_or(0),
        };
        let mut locations = Vec::with_capacity(scalars as usize);
        self.place(ty, &mut cursor, &mut locations)?;
        Ok(locations.into())
    }

    /// Assigns a location and component to each scalar of a type.
    fn place(&self, ty: u32, cursor: &mut Cursor, into: &mut Vec<IoLocation>) -> Result<()> {
        match self.globals.types.get(ty)? {
            SpirvType::Scalar(_) | SpirvType::Vector { .. } => {
                let (scalar, count) = self.globals.types.vector(ty)?;
                let Some(location) = cursor.location else {
                    return malformed("an input or output has no location");
                };
                let flat = !matches!(scalar, Scalar::Float { width: 16 | 32 });
                let each = if scalar.is_wide() { 2 } else { 1 };
                if location >= MAX_LOCATIONS || cursor.component > 3 {
                    return unsupported("locations this high");
                }
                for index in 0..count {
                    let at = cursor.component + each * index;
                    into.push(IoLocation::Location {
                        location: location + at / 4,
                        component: at % 4,
                        interpolation: if flat { Interpolation::Flat } else { cursor.interpolation },
                        sampling: cursor.sampling,
                        index: cursor.index,
                    });
                }
                let end = cursor.component + each * count;
                cursor.location = Some(location + end.div_ceil(4));
                Ok(())
            }
            SpirvType::Matrix { column: element, count } | SpirvType::Array { element, count, .. } => {
                (0..*count).try_for_each(|_| self.place(*element, cursor, into))
            }
            SpirvType::Struct(members) => {
                let mut next = cursor.location;
                for (index, member) in (0..).zip(members.iter()) {
                    self.place_member(ty, index, member, *cursor, &mut next, into)?;
                }
                cursor.location = next;
                Ok(())
            }
            _ => malformed("this type can't be an input or output"),
        }
    }

    fn place_member(
        &self,
        ty: u32,
        index: u32,
        member: &Member,
        outer: Cursor,
        next: &mut Option<u32>,
        into: &mut Vec<IoLocation>,
    ) -> Result<()> {
        if let Some(built_in) = member.built_in {
            let scalars = self.globals.types.scalars(member.ty)?;
            into.extend((0..scalars).map(|component| IoLocation::BuiltIn { built_in, component }));
            return Ok(());
        }
        let number = |decoration| self.module.member_literal(ty, index, decoration);
        let has = |decoration| self.module.member_has(ty, index, decoration);
        let mut cursor = Cursor {
            location: number(Decoration::Location).or(*next),
            component: number(Decoration::Component).unwrap_or(0),
            interpolation: match interpolation(has) {
                Interpolation::Perspective => outer.interpolation,
                own => own,
            },
            sampling: match sampling(has) {
                Sampling::Center => outer.sampling,
                own => own,
            },
            index: outer.index,
        };
        self.place(member.ty, &mut cursor, into)?;
        *next = cursor.location;
        Ok(())
    }

    /// The register of an input, created when it is first read.
    pub fn input(&mut self, emit: &mut Emitter, source: InputSource, scalar: ScalarType, rate: Rate) -> Reg {
        if let Some(reg) = self.registers.get(&source) {
            return *reg;
        }
        let ty = match scalar {
            ScalarType::Bool => Type::Bool,
            ScalarType::Float { width: 64 } | ScalarType::Int { width: 64 } | ScalarType::Uint { width: 64 } => {
                Type::B64
            }
            _ => Type::B32,
        };
        let reg = emit.builder.input(self.inputs.len() as u32, ty, rate);
        self.inputs.push(Input { source, numeric: scalar });
        self.registers.insert(source, reg);
        reg
    }

    fn built_in_input(&mut self, emit: &mut Emitter, built_in: BuiltIn, component: u32, scalar: ScalarType) -> Reg {
        let rate = match built_in {
            BuiltIn::BaseVertex
            | BuiltIn::BaseInstance
            | BuiltIn::DrawIndex
            | BuiltIn::ViewIndex
            | BuiltIn::PatchVertices
            | BuiltIn::WorkgroupId
            | BuiltIn::NumWorkgroups => Rate::Uniform,
            _ => Rate::Varying,
        };
        let source = InputSource::BuiltIn { built_in, component };
        self.input(emit, source, scalar, rate)
    }

    /// A component of the fragment's position.
    pub fn frag_coord(&mut self, emit: &mut Emitter, component: u32) -> Result<Reg> {
        if self.stage != Stage::Fragment {
            return malformed("there are no fragments in this stage");
        }
        Ok(self.built_in_input(emit, BuiltIn::FragCoord, component, ScalarType::Float { width: 32 }))
    }

    /// The layer of the fragment.
    pub fn layer(&mut self, emit: &mut Emitter) -> Reg {
        self.built_in_input(emit, BuiltIn::Layer, 0, ScalarType::Int { width: 32 })
    }

    /// The register of a scalar of an input variable.
    pub fn input_scalar(&mut self, emit: &mut Emitter, variable: u32, index: usize, scalar: Scalar) -> Result<Reg> {
        let locations = self.locations(variable)?;
        match locations.get(index).copied() {
            Some(place @ IoLocation::Location { .. }) if scalar.is_wide() => {
                let words = place.words(scalar).into_iter();
                let words: Vec<_> = words.map(|(word, numeric)| self.word(emit, word, numeric)).collect();
                Ok(emit.op(Ir::Join64, &words))
            }
            Some(place @ IoLocation::Location { .. }) => Ok(self.word(emit, place, scalar.at_interface())),
            Some(IoLocation::BuiltIn { built_in, component }) => {
                let reg = self.built_in(emit, built_in, component, scalar)?;
                if emit.builder.type_of(reg) != scalar.register() {
                    return malformed(format!("built-in {built_in:?} is of another type"));
                }
                Ok(reg)
            }
            None => malformed("an access beyond the end of an input"),
        }
    }

    /// The register of an input at a location.
    fn word(&mut self, emit: &mut Emitter, place: IoLocation, numeric: ScalarType) -> Reg {
        let IoLocation::Location { location, component, interpolation, sampling, .. } = place else {
            return emit.constant(Type::B32, 0);
        };
        self.per_sample |= sampling == Sampling::Sample;
        let source = InputSource::Location { location, component, interpolation, sampling };
        self.input(emit, source, numeric, Rate::Varying)
    }

    fn built_in(&mut self, emit: &mut Emitter, built_in: Spirv, component: u32, scalar: Scalar) -> Result<Reg> {
        let given = match built_in {
            Spirv::VertexIndex => BuiltIn::VertexIndex,
            Spirv::InstanceIndex => BuiltIn::InstanceIndex,
            Spirv::BaseVertex => BuiltIn::BaseVertex,
            Spirv::BaseInstance => BuiltIn::BaseInstance,
            Spirv::DrawIndex => BuiltIn::DrawIndex,
            Spirv::ViewIndex if !self.view_is_device => BuiltIn::ViewIndex,
            Spirv::Layer => BuiltIn::Layer,
            Spirv::ViewportIndex => BuiltIn::ViewportIndex,
            Spirv::PrimitiveId => BuiltIn::PrimitiveId,
            Spirv::InvocationId if self.stage == Stage::Geometry => BuiltIn::InvocationId,
            Spirv::PatchVertices => BuiltIn::PatchVertices,
            Spirv::TessCoord => BuiltIn::TessCoord,
            Spirv::FragCoord => BuiltIn::FragCoord,
            Spirv::PointCoord => BuiltIn::PointCoord,
            Spirv::FrontFacing => BuiltIn::FrontFacing,
            Spirv::SampleMask => BuiltIn::SampleMask,
            Spirv::ClipDistance => BuiltIn::ClipDistance,
            Spirv::CullDistance => BuiltIn::CullDistance,
            Spirv::SampleId | Spirv::SamplePosition => {
                self.per_sample = true;
                match built_in {
                    Spirv::SampleId => BuiltIn::SampleId,
                    _ => BuiltIn::SamplePosition,
                }
            }
            Spirv::WorkgroupId => BuiltIn::WorkgroupId,
            Spirv::NumWorkgroups => BuiltIn::NumWorkgroups,
            other => return self.computed_built_in(emit, other, component),
        };
        Ok(self.built_in_input(emit, given, component, scalar.at_interface()))
    }

    fn computed_built_in(&mut self, emit: &mut Emitter, built_in: Spirv, component: u32) -> Result<Reg> {
        let [x, y, z] = self.workgroup_size;
        let invocations = x * y * z;
        let size = self.subgroup_size;
        let axis = component.min(2) as usize;
        Ok(match built_in {
            Spirv::LocalInvocationIndex => emit.builder.lane_index(),
            // A patch has a lane for each output vertex.
            Spirv::InvocationId if self.stage == Stage::TessellationControl => {
                let lane = emit.builder.lane_index();
                emit.div_rem(lane, self.output_vertices.max(1)).1
            }
            Spirv::LocalInvocationId => self.local_id(emit, axis),
            Spirv::GlobalInvocationId => {
                let local = self.local_id(emit, axis);
                let group = self.built_in_input(emit, BuiltIn::WorkgroupId, component, ScalarType::Uint { width: 32 });
                let each = emit.u32([x, y, z][axis]);
                let first = emit.op(Ir::IMul, &[group, each]);
                emit.op(Ir::IAdd, &[first, local])
            }
            Spirv::WorkgroupSize => emit.u32([x, y, z][axis]),
            Spirv::HelperInvocation => emit.builder.is_helper(),
            Spirv::DeviceIndex | Spirv::ViewIndex => emit.u32(0),
            Spirv::SubgroupSize => emit.u32(size),
            Spirv::NumSubgroups => emit.u32(invocations.div_ceil(size.max(1))),
            Spirv::SubgroupId => {
                let lane = emit.builder.lane_index();
                emit.div_rem(lane, size).0
            }
            Spirv::SubgroupLocalInvocationId => self.subgroup_lane(emit),
            Spirv::SubgroupEqMask
            | Spirv::SubgroupGeMask
            | Spirv::SubgroupGtMask
            | Spirv::SubgroupLeMask
            | Spirv::SubgroupLtMask => self.lane_mask(emit, built_in, component),
            other => return unsupported(format!("built-in {other:?}")),
        })
    }

    /// The lane's index within its subgroup.
    pub fn subgroup_lane(&mut self, emit: &mut Emitter) -> Reg {
        let lane = emit.builder.lane_index();
        emit.div_rem(lane, self.subgroup_size).1
    }

    fn local_id(&mut self, emit: &mut Emitter, axis: usize) -> Reg {
        let [x, y, z] = self.workgroup_size;
        if [x, y, z][axis] == 1 {
            return emit.u32(0);
        }
        let lane = emit.builder.lane_index();
        if x * y * z == [x, y, z][axis] {
            return lane;
        }
        let (rest, column) = emit.div_rem(lane, x);
        match axis {
            0 => column,
            1 => emit.div_rem(rest, y).1,
            _ => emit.div_rem(rest, y).0,
        }
    }

    /// A word of the mask of lanes equal to, above or below the current one.
    pub fn lane_mask(&mut self, emit: &mut Emitter, which: Spirv, word: u32) -> Reg {
        let lane = self.subgroup_lane(emit);
        let first = emit.u32(32 * word);
        let offset = emit.op(Ir::ISub, &[lane, first]);
        let (zero, one, ones, size) = (emit.u32(0), emit.u32(1), emit.u32(u32::MAX), emit.u32(32));
        let within = emit.op(Ir::ULt, &[offset, size]);
        let before = emit.op(Ir::ULt, &[lane, first]);
        let bit = emit.op(Ir::Shl, &[one, offset]);
        let bit = emit.select(within, bit, zero);
        // The bits below the current lane, in this word: none, some, or all.
        let below = emit.op(Ir::ISub, &[bit, one]);
        let below = emit.select(within, below, ones);
        let below = emit.select(before, zero, below);
        let up_to = emit.op(Ir::Or, &[below, bit]);
        let limit = self.subgroup_size.saturating_sub(32 * word).min(32);
        let existing = if limit == 32 { u32::MAX } else { (1 << limit) - 1 };
        let existing = emit.u32(existing);
        match which {
            Spirv::SubgroupEqMask => bit,
            Spirv::SubgroupLtMask => below,
            Spirv::SubgroupLeMask => up_to,
            Spirv::SubgroupGtMask => {
                let above = emit.op(Ir::Not, &[up_to]);
                emit.op(Ir::And, &[above, existing])
            }
            _ => {
                let above = emit.op(Ir::Not, &[below]);
                emit.op(Ir::And, &[above, existing])
            }
        }
    }

    /// Assigns a register to the output at a location.
    pub fn write_output(&mut self, emit: &mut Emitter, location: IoLocation, scalar: Scalar, reg: Reg) -> Result<()> {
        let regs = match scalar.is_wide() {
            false => vec![reg],
            true => emit.words(reg).to_vec(),
        };
        for ((word, numeric), reg) in location.words(scalar).into_iter().zip(regs) {
            let target = output_target(word)?;
            if self.outputs.iter().any(|it| it.target == target) {
                return malformed(format!("two outputs at {target:?}"));
            }
            let slot = self.outputs.len() as u32;
            let output = emit.builder.output(slot, Type::B32);
            self.outputs.push(Output { target, numeric });
            emit.builder.assign(output, reg);
        }
        Ok(())
    }
}

/// The target of an output's scalar.
pub fn output_target(location: IoLocation) -> Result<OutputTarget> {
    Ok(match location {
        IoLocation::Location { location, component, index, .. } => {
            OutputTarget::Location { location, component, index }
        }
        IoLocation::BuiltIn { built_in, component } => OutputTarget::BuiltIn {
            built_in: match built_in {
                Spirv::Position => BuiltIn::Position,
                Spirv::PointSize => BuiltIn::PointSize,
                Spirv::ClipDistance => BuiltIn::ClipDistance,
                Spirv::CullDistance => BuiltIn::CullDistance,
                Spirv::Layer => BuiltIn::Layer,
                Spirv::ViewportIndex => BuiltIn::ViewportIndex,
                Spirv::PrimitiveId => BuiltIn::PrimitiveId,
                Spirv::TessLevelOuter => BuiltIn::TessLevelOuter,
                Spirv::TessLevelInner => BuiltIn::TessLevelInner,
                Spirv::FragDepth => BuiltIn::FragDepth,
                Spirv::FragStencilRefEXT => BuiltIn::FragStencilRef,
                Spirv::SampleMask => BuiltIn::SampleMask,
                other => return unsupported(format!("output built-in {other:?}")),
            },
            component,
        },
    })
}

/// Reports whether a built-in input is computed from the lane.
pub fn is_computed(built_in: Spirv) -> bool {
    use Spirv::*;
    matches!(
        built_in,
        LocalInvocationIndex
            | InvocationId
            | LocalInvocationId
            | GlobalInvocationId
            | HelperInvocation
            | SubgroupId
            | SubgroupLocalInvocationId
            | SubgroupEqMask
            | SubgroupGeMask
            | SubgroupGtMask
            | SubgroupLeMask
            | SubgroupLtMask
    )
}

fn interpolation(has: impl Fn(Decoration) -> bool) -> Interpolation {
    if has(Decoration::Flat) {
        Interpolation::Flat
    } else if has(Decoration::NoPerspective) {
        Interpolation::Linear
    } else {
        Interpolation::Perspective
    }
}

fn sampling(has: impl Fn(Decoration) -> bool) -> Sampling {
    if has(Decoration::Sample) {
        Sampling::Sample
    } else if has(Decoration::Centroid) {
        Sampling::Centroid
    } else {
        Sampling::Center
    }
}
