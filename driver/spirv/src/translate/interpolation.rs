//! Interpolation of inputs at other points of the pixel.

use isa::ir::{Axis, Rate, Reg};
use isa::op::Op as Ir;
use spirv::GlslStd450Op as G;

use super::inputs_outputs::IoLocation;
use super::translator::Translator;
use super::value::{DynamicIndex, Pointer};
use crate::error::{Result, malformed, unsupported};
use crate::instruction::Instruction;
use crate::interface::{InputSource, Interpolation, Sampling};

/// Offsets of the samples from the pixel's centre, in 1/16 pixel: the standard positions of 1, 2, 4, 8 and 16 samples.
fn sample_offsets(samples: u32) -> &'static [[i8; 2]] {
    match samples {
        2 => &[[4, 4], [-4, -4]],
        4 => &[[-2, -6], [6, -2], [-6, 2], [2, 6]],
        8 => &[[1, -3], [-1, 3], [5, 1], [-3, -5], [-5, 5], [-7, -1], [3, 7], [7, -7]],
        16 => &[
            [1, 1],
            [-1, -3],
            [-3, 2],
            [4, -1],
            [-5, -2],
            [2, 5],
            [5, 3],
            [3, -5],
            [-2, 6],
            [0, -7],
            [-4, -6],
            [-6, 4],
            [-8, 0],
            [7, -4],
            [6, 7],
            [-7, -8],
        ],
        _ => &[[0, 0]],
    }
}

/// The point of the pixel at which an input is evaluated.
#[derive(Clone, Copy)]
enum Point {
    Centroid,
    /// Offset from the point at which inputs are otherwise evaluated, in pixels.
    Offset([Reg; 2]),
}

/// A part of an input variable.
#[derive(Clone, Copy)]
struct Interpolant<'a> {
    variable: u32,
    /// The number of scalars before it.
    start: usize,
    /// Dynamic indices from there, known only at run time.
    indices: &'a [DynamicIndex],
    ty: u32,
}

/// Translates interpolation at another point of the pixel. At the centroid it is a separate input; at a sample or an
/// offset it is computed from the derivatives of the attribute divided by w, which are constant over the primitive.
pub fn interpolate(t: &mut Translator, instruction: &Instruction, op: G) -> Result<()> {
    let pointer = t.pointer(instruction.id(2)?)?;
    let Some(interpolant) = interpolant(t, &pointer) else {
        return unsupported("interpolation of what isn't an input");
    };
    let point = match op {
        G::InterpolateAtCentroid => Point::Centroid,
        G::InterpolateAtOffset => match *t.regs(instruction.id(3)?)? {
            [dx, dy] => Point::Offset(from_own_point(t, [dx, dy])?),
            _ => return malformed("the offset doesn't have two components"),
        },
        _ => {
            let sample = t.reg(instruction.id(3)?)?;
            let offset = sample_offset(t, sample);
            Point::Offset(from_own_point(t, offset)?)
        }
    };
    let regs = interpolated(t, interpolant, point)?;
    t.define(instruction, regs)
}

/// An offset from the pixel's centre, converted to one from the point at which the fragment evaluates its inputs: the
/// centre, or a sample if each sample is shaded.
fn from_own_point(t: &mut Translator, offset: [Reg; 2]) -> Result<[Reg; 2]> {
    let mut moved = offset;
    for (axis, moved) in (0..).zip(&mut moved) {
        let position = t.io.frag_coord(&mut t.emit, axis)?;
        let within = t.emit.op(Ir::FFract, &[position]);
        let centre = t.emit.f32(0.5);
        let own = t.emit.op(Ir::FSub, &[within, centre]);
        *moved = t.emit.op(Ir::FSub, &[*moved, own]);
    }
    Ok(moved)
}

/// The interpolant at another point of the pixel. For an array indexed at run time, each element is interpolated before
/// one is selected: neighbours in a quad, which derivatives need, may select others.
fn interpolated(t: &mut Translator, interpolant: Interpolant, point: Point) -> Result<Vec<Reg>> {
    let Some((dynamic, inner)) = interpolant.indices.split_first() else {
        return interpolated_part(t, interpolant, point);
    };
    let element = |index: u32| Interpolant {
        start: interpolant.start + (index * dynamic.scalars) as usize,
        indices: inner,
        ..interpolant
    };
    // An index out of range reads the first element.
    let mut picked = interpolated(t, element(0), point)?;
    for index in 1..dynamic.count {
        let candidate = interpolated(t, element(index), point)?;
        t.emit.charge_budget(candidate.len())?;
        let this = t.emit.index_is(dynamic.index, index);
        for (picked, candidate) in picked.iter_mut().zip(candidate) {
            *picked = t.emit.select(this, candidate, *picked);
        }
    }
    Ok(picked)
}

/// As [`interpolated`], for a part whose place is constant.
fn interpolated_part(t: &mut Translator, interpolant: Interpolant, point: Point) -> Result<Vec<Reg>> {
    let Point::Offset([dx, dy]) = point else {
        return read_input(t, interpolant, Sampling::Centroid);
    };
    let regs = read_input(t, interpolant, Sampling::Center)?;
    let interpolation = interpolation_of(t, interpolant);
    if interpolation == Some(Interpolation::Flat) {
        return Ok(regs);
    }
    let linear = interpolation == Some(Interpolation::Linear);
    let at = |t: &mut Translator, value: Reg| {
        let x = t.emit.builder.derivative(value, Axis::X, true);
        let y = t.emit.builder.derivative(value, Axis::Y, true);
        let moved = t.emit.op(Ir::FFma, &[x, dx, value]);
        t.emit.op(Ir::FFma, &[y, dy, moved])
    };
    let inverse_w = t.io.frag_coord(&mut t.emit, 3)?;
    let moved_w = at(t, inverse_w);
    let mut moved = Vec::with_capacity(regs.len());
    for reg in regs {
        moved.push(if linear {
            at(t, reg)
        } else {
            let over_w = t.emit.op(Ir::FMul, &[reg, inverse_w]);
            let over_w = at(t, over_w);
            t.emit.op(Ir::FDiv, &[over_w, moved_w])
        });
    }
    Ok(moved)
}

/// The offset of a sample from the pixel's centre.
fn sample_offset(t: &mut Translator, sample: Reg) -> [Reg; 2] {
    let offsets = sample_offsets(t.options.samples);
    [0, 1].map(|axis| {
        let offset = |index: usize| f32::from(offsets[index][axis]) / 16.0;
        let mut found = t.emit.f32(offset(0));
        for index in 1..offsets.len() {
            let number = t.emit.u32(index as u32);
            let this = t.emit.op(Ir::IEq, &[sample, number]);
            let value = t.emit.f32(offset(index));
            found = t.emit.select(this, value, found);
        }
        found
    })
}

/// Reads a part of an input, evaluated at another point of the pixel.
fn read_input(t: &mut Translator, interpolant: Interpolant, sampling: Sampling) -> Result<Vec<Reg>> {
    let scalars = t.globals.types.flatten(interpolant.ty)?;
    t.emit.charge_budget(scalars.len())?;
    let locations = t.io.locations(interpolant.variable)?;
    let mut regs = Vec::with_capacity(scalars.len());
    for (offset, scalar) in scalars.into_iter().enumerate() {
        let Some(IoLocation::Location { location, component, interpolation, .. }) =
            locations.get(interpolant.start + offset)
        else {
            return unsupported("interpolation of a built-in");
        };
        if scalar.is_wide() {
            return malformed("a scalar of 64 bits is not interpolated");
        }
        let source = InputSource::Location {
            location: *location,
            component: *component,
            interpolation: *interpolation,
            sampling,
        };
        regs.push(t.io.input(&mut t.emit, source, scalar.at_interface(), Rate::Varying));
    }
    Ok(regs)
}

/// The part of an input variable to which a pointer points.
fn interpolant<'a>(t: &Translator, pointer: &'a Pointer) -> Option<Interpolant<'a>> {
    let Pointer::PromotedVariable { variable, start, indices, ty } = pointer else {
        return None;
    };
    Some(Interpolant { variable: t.promoted.variables[*variable].input?, start: *start, indices, ty: *ty })
}

/// The interpolation of an interpolant.
fn interpolation_of(t: &mut Translator, interpolant: Interpolant) -> Option<Interpolation> {
    match t.io.locations(interpolant.variable).ok()?.get(interpolant.start)? {
        IoLocation::Location { interpolation, .. } => Some(*interpolation),
        IoLocation::BuiltIn { .. } => None,
    }
}
