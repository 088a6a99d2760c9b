//! Inputs and outputs: locations and built-ins.

use std::rc::Rc;

use isa::ir::{Rate, Reg};
use isa::op::Op as Ir;
use spirv::{BuiltIn as Spirv, Decoration};

use super::super::error::{Result, malformed, unsupported};
use super::super::interface::{
    BuiltIn, Input, InputSource, Interpolation, Sampling, ScalarType, Stage,
};
use super::super::types::{Member, Scalar, Type};
use super::Translator;
use super::access::Pointer;
use super::resource::numeric;

/// The most locations of an interface.
const MAX_LOCATIONS: u32 = 1 << 10;

/// The most scalars of a built-in.
const MAX_BUILT_IN_SCALARS: u32 = 64;

/// Where a scalar of an input or output comes from or goes.
#[derive(Clone, Copy, Debug)]
pub enum IoLocation {
    Location {
        location: u32,
        component: u32,
        interpolation: Interpolation,
        sampling: Sampling,
        index: u32,
    },
    BuiltIn {
        built_in: Spirv,
        component: u32,
    },
}

/// Where the next scalar goes.
#[derive(Clone, Copy)]
struct Cursor {
    location: Option<u32>,
    component: u32,
    interpolation: Interpolation,
    sampling: Sampling,
    index: u32,
}

impl Translator<'_> {
    /// Where each scalar of an input or output variable belongs.
    pub fn io_locations(&mut self, variable: u32) -> Result<Rc<[IoLocation]>> {
        if let Some(io_locations) = self.io_locations.get(&variable) {
            return Ok(io_locations.clone());
        }
        let io_locations = self.find_io_locations(variable)?;
        self.io_locations.insert(variable, io_locations.clone());
        Ok(io_locations)
    }

    fn find_io_locations(&self, variable: u32) -> Result<Rc<[IoLocation]>> {
        let Some(global) = self.globals.variables.get(&variable) else {
            return malformed(format!("%{variable} isn't an input or output"));
        };
        let scalars = self.globals.types.scalars(global.pointee)?;
        if let Some(built_in) = self.module.built_in(variable) {
            if scalars > MAX_BUILT_IN_SCALARS {
                return unsupported("a built-in of this many elements");
            }
            let one = |component| IoLocation::BuiltIn {
                built_in,
                component,
            };
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
        let mut io_locations = Vec::with_capacity(scalars as usize);
        self.place(global.pointee, &mut cursor, &mut io_locations)?;
        Ok(io_locations.into())
    }

    /// Gives each scalar of a type its location and component.
    fn place(&self, ty: u32, cursor: &mut Cursor, into: &mut Vec<IoLocation>) -> Result<()> {
        match self.globals.types.get(ty)? {
            Type::Scalar(_) | Type::Vector { .. } => {
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
                        interpolation: if flat {
                            Interpolation::Flat
                        } else {
                            cursor.interpolation
                        },
                        sampling: cursor.sampling,
                        index: cursor.index,
                    });
                }
                let end = cursor.component + each * count;
                cursor.location = Some(location + end.div_ceil(4));
                Ok(())
            }
            Type::Matrix {
                column: element,
                count,
            }
            | Type::Array { element, count, .. } => {
                (0..*count).try_for_each(|_| self.place(*element, cursor, into))
            }
            Type::Struct(members) => {
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
            into.extend((0..scalars).map(|component| IoLocation::BuiltIn {
                built_in,
                component,
            }));
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

    /// The register of an input, made when it is first read.
    fn input(&mut self, source: InputSource, scalar: ScalarType, rate: Rate) -> Reg {
        if let Some(reg) = self.inputs.get(&source) {
            return *reg;
        }
        let ty = match scalar {
            ScalarType::Bool => isa::ir::Type::Bool,
            ScalarType::Float { width: 64 }
            | ScalarType::Int { width: 64 }
            | ScalarType::Uint { width: 64 } => isa::ir::Type::B64,
            _ => isa::ir::Type::B32,
        };
        let reg = self
            .builder
            .input(self.interface.inputs.len() as u32, ty, rate);
        self.interface.inputs.push(Input {
            source,
            numeric: scalar,
        });
        self.inputs.insert(source, reg);
        reg
    }

    fn built_in_input(&mut self, built_in: BuiltIn, component: u32, scalar: ScalarType) -> Reg {
        let rate = match built_in {
            BuiltIn::BaseVertex
            | BuiltIn::BaseInstance
            | BuiltIn::DrawIndex
            | BuiltIn::ViewIndex
            | BuiltIn::WorkgroupId
            | BuiltIn::NumWorkgroups => Rate::Uniform,
            _ => Rate::Varying,
        };
        let source = InputSource::BuiltIn {
            built_in,
            component,
        };
        self.input(source, scalar, rate)
    }

    /// A component of the fragment's position.
    pub fn frag_coord(&mut self, component: u32) -> Result<Reg> {
        if self.interface.stage != Stage::Fragment {
            return malformed("there are no fragments in this stage");
        }
        Ok(self.built_in_input(
            BuiltIn::FragCoord,
            component,
            ScalarType::Float { width: 32 },
        ))
    }

    /// Computes the scalars of an input that aren't simply given. That is done before anything else, so that they exist
    /// wherever they are read.
    pub fn compute_inputs(&mut self, variable: u32) -> Result<()> {
        let Some(slot) = self.slot_of_root(variable) else {
            return Ok(());
        };
        let io_locations = self.io_locations(variable)?;
        if io_locations
            .iter()
            .any(|io_location| matches!(io_location, IoLocation::BuiltIn { .. }))
        {
            for index in 0..io_locations.len() {
                if let IoLocation::BuiltIn { built_in, .. } = io_locations[index]
                    && is_computed(built_in)
                {
                    self.read_scalar(slot, index)?;
                }
            }
        }
        Ok(())
    }

    /// The register of a scalar of an input variable.
    pub fn input_scalar(&mut self, variable: u32, index: usize, scalar: Scalar) -> Result<Reg> {
        let io_locations = self.io_locations(variable)?;
        match io_locations.get(index) {
            Some(IoLocation::Location {
                location,
                component,
                interpolation,
                sampling,
                ..
            }) => {
                self.interface.per_sample |= *sampling == Sampling::Sample;
                let source = InputSource::Location {
                    location: *location,
                    component: *component,
                    interpolation: *interpolation,
                    sampling: *sampling,
                };
                Ok(self.input(source, numeric(scalar), Rate::Varying))
            }
            Some(IoLocation::BuiltIn {
                built_in,
                component,
            }) => {
                let reg = self.built_in(*built_in, *component, scalar)?;
                if self.builder.type_of(reg) != scalar.register() {
                    return malformed(format!("built-in {built_in:?} is of another type"));
                }
                Ok(reg)
            }
            None => malformed("an access beyond the end of an input"),
        }
    }

    /// Reads what a pointer into an input points to, taken elsewhere in the pixel.
    pub fn read_input(&mut self, pointer: &Pointer, sampling: Sampling) -> Result<Vec<Reg>> {
        let Some((variable, start, ty)) = self.interpolant(pointer) else {
            return unsupported("interpolation of what isn't an input");
        };
        let scalars = self.globals.types.flatten(ty)?;
        let io_locations = self.io_locations(variable)?;
        let mut regs = Vec::with_capacity(scalars.len());
        for (offset, scalar) in scalars.into_iter().enumerate() {
            let Some(IoLocation::Location {
                location,
                component,
                interpolation,
                ..
            }) = io_locations.get(start + offset)
            else {
                return unsupported("interpolation of a built-in");
            };
            let source = InputSource::Location {
                location: *location,
                component: *component,
                interpolation: *interpolation,
                sampling,
            };
            regs.push(self.input(source, numeric(scalar), Rate::Varying));
        }
        Ok(regs)
    }

    /// The input variable that a pointer leads into, the scalar where, and the type of what it points to.
    fn interpolant(&self, pointer: &Pointer) -> Option<(u32, usize, u32)> {
        let Pointer::PromotedVariable {
            slot,
            start,
            steps,
            ty,
        } = pointer
        else {
            return None;
        };
        let variable = self.slots[*slot].input.filter(|_| steps.is_empty())?;
        Some((variable, *start, *ty))
    }

    fn interpolation_of(&mut self, pointer: &Pointer) -> Option<Interpolation> {
        let (variable, start, _) = self.interpolant(pointer)?;
        match self.io_locations(variable).ok()?.get(start)? {
            IoLocation::Location { interpolation, .. } => Some(*interpolation),
            IoLocation::BuiltIn { .. } => None,
        }
    }

    /// Whether an input isn't interpolated.
    pub fn is_flat(&mut self, pointer: &Pointer) -> bool {
        self.interpolation_of(pointer) == Some(Interpolation::Flat)
    }

    /// Whether an input is interpolated without perspective.
    pub fn is_linear(&mut self, pointer: &Pointer) -> bool {
        self.interpolation_of(pointer) == Some(Interpolation::Linear)
    }

    fn built_in(&mut self, built_in: Spirv, component: u32, scalar: Scalar) -> Result<Reg> {
        let given = match built_in {
            Spirv::VertexIndex => BuiltIn::VertexIndex,
            Spirv::InstanceIndex => BuiltIn::InstanceIndex,
            Spirv::BaseVertex => BuiltIn::BaseVertex,
            Spirv::BaseInstance => BuiltIn::BaseInstance,
            Spirv::DrawIndex => BuiltIn::DrawIndex,
            Spirv::ViewIndex => BuiltIn::ViewIndex,
            Spirv::Layer => BuiltIn::Layer,
            Spirv::ViewportIndex => BuiltIn::ViewportIndex,
            Spirv::PrimitiveId => BuiltIn::PrimitiveId,
            Spirv::FragCoord => BuiltIn::FragCoord,
            Spirv::PointCoord => BuiltIn::PointCoord,
            Spirv::FrontFacing => BuiltIn::FrontFacing,
            Spirv::SampleMask => BuiltIn::SampleMask,
            Spirv::ClipDistance => BuiltIn::ClipDistance,
            Spirv::CullDistance => BuiltIn::CullDistance,
            Spirv::SampleId | Spirv::SamplePosition => {
                self.interface.per_sample = true;
                match built_in {
                    Spirv::SampleId => BuiltIn::SampleId,
                    _ => BuiltIn::SamplePosition,
                }
            }
            Spirv::WorkgroupId => BuiltIn::WorkgroupId,
            Spirv::NumWorkgroups => BuiltIn::NumWorkgroups,
            other => return self.computed_built_in(other, component),
        };
        Ok(self.built_in_input(given, component, numeric(scalar)))
    }

    fn computed_built_in(&mut self, built_in: Spirv, component: u32) -> Result<Reg> {
        let [x, y, z] = self.interface.workgroup_size;
        let invocations = x * y * z;
        let size = self.options.subgroup_size;
        let axis = component.min(2) as usize;
        Ok(match built_in {
            Spirv::LocalInvocationIndex => self.builder.lane_index(),
            Spirv::LocalInvocationId => self.local_id(axis),
            Spirv::GlobalInvocationId => {
                let local = self.local_id(axis);
                let group = self.built_in_input(
                    BuiltIn::WorkgroupId,
                    component,
                    ScalarType::Uint { width: 32 },
                );
                let each = self.u32([x, y, z][axis]);
                let first = self.op(Ir::IMul, &[group, each]);
                self.op(Ir::IAdd, &[first, local])
            }
            Spirv::WorkgroupSize => self.u32([x, y, z][axis]),
            Spirv::HelperInvocation => self.builder.is_helper(),
            Spirv::DeviceIndex => self.u32(0),
            Spirv::SubgroupSize => self.u32(size),
            Spirv::NumSubgroups => self.u32(invocations.div_ceil(size.max(1))),
            Spirv::SubgroupId => {
                let lane = self.builder.lane_index();
                self.divided(lane, size).0
            }
            Spirv::SubgroupLocalInvocationId => self.subgroup_lane(),
            Spirv::SubgroupEqMask
            | Spirv::SubgroupGeMask
            | Spirv::SubgroupGtMask
            | Spirv::SubgroupLeMask
            | Spirv::SubgroupLtMask => self.lane_mask(built_in, component),
            other => return unsupported(format!("built-in {other:?}")),
        })
    }

    /// The lane's index within its subgroup.
    pub fn subgroup_lane(&mut self) -> Reg {
        let lane = self.builder.lane_index();
        self.divided(lane, self.options.subgroup_size).1
    }

    /// Quotient and remainder by a constant.
    fn divided(&mut self, reg: Reg, by: u32) -> (Reg, Reg) {
        if by.is_power_of_two() {
            let (shift, mask) = (self.u32(by.trailing_zeros()), self.u32(by - 1));
            (
                self.op(Ir::UShr, &[reg, shift]),
                self.op(Ir::And, &[reg, mask]),
            )
        } else {
            let by = self.u32(by);
            (self.op(Ir::UDiv, &[reg, by]), self.op(Ir::URem, &[reg, by]))
        }
    }

    fn local_id(&mut self, axis: usize) -> Reg {
        let [x, y, z] = self.interface.workgroup_size;
        if [x, y, z][axis] == 1 {
            return self.u32(0);
        }
        let lane = self.builder.lane_index();
        if x * y * z == [x, y, z][axis] {
            return lane;
        }
        let (rest, column) = self.divided(lane, x);
        match axis {
            0 => column,
            1 => self.divided(rest, y).1,
            _ => self.divided(rest, y).0,
        }
    }

    /// A word of the masks of lanes equal to, above or below one's own.
    pub fn lane_mask(&mut self, which: Spirv, word: u32) -> Reg {
        let lane = self.subgroup_lane();
        let first = self.u32(32 * word);
        let offset = self.op(Ir::ISub, &[lane, first]);
        let (zero, one, ones, size) = (self.u32(0), self.u32(1), self.u32(u32::MAX), self.u32(32));
        let within = self.op(Ir::ULt, &[offset, size]);
        let before = self.op(Ir::ULt, &[lane, first]);
        let bit = self.op(Ir::Shl, &[one, offset]);
        let bit = self.select(within, bit, zero);
        // Bits below one's own, in this word: none, some, or all.
        let below = self.op(Ir::ISub, &[bit, one]);
        let below = self.select(within, below, ones);
        let below = self.select(before, zero, below);
        let up_to = self.op(Ir::Or, &[below, bit]);
        let limit = self.options.subgroup_size.saturating_sub(32 * word).min(32);
        let existing = if limit == 32 {
            u32::MAX
        } else {
            (1 << limit) - 1
        };
        let existing = self.u32(existing);
        match which {
            Spirv::SubgroupEqMask => bit,
            Spirv::SubgroupLtMask => below,
            Spirv::SubgroupLeMask => up_to,
            Spirv::SubgroupGtMask => {
                let above = self.op(Ir::Not, &[up_to]);
                self.op(Ir::And, &[above, existing])
            }
            _ => {
                let above = self.op(Ir::Not, &[below]);
                self.op(Ir::And, &[above, existing])
            }
        }
    }

    /// Reads the workgroup's size from the constant that is decorated as it, which wins over the execution mode.
    pub fn built_in_workgroup_size(&mut self) {
        let constants = &self.globals.constants;
        let found = constants
            .iter()
            .find(|(id, _)| self.module.built_in(**id) == Some(Spirv::WorkgroupSize));
        if let Some((_, constant)) = found
            && let [x, y, z] = *constant.bits
        {
            self.interface.workgroup_size = [x as u32, y as u32, z as u32];
        }
    }
}

/// Whether a built-in input follows from the lane.
fn is_computed(built_in: Spirv) -> bool {
    use Spirv::*;
    matches!(
        built_in,
        LocalInvocationIndex
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
