//! Interpolation of inputs elsewhere in the pixel.

use isa::ir::{Axis, Rate, Reg};
use isa::op::Op as Ir;
use spirv::GlslStd450Op as G;

use super::inputs_outputs::IoLocation;
use super::translator::Translator;
use super::value::Pointer;
use crate::error::{Result, malformed, unsupported};
use crate::instruction::Instruction;
use crate::interface::{InputSource, Interpolation, Sampling};

/// Offsets of the samples from the pixel's centre, in 1/16 pixel: the standard positions of 1, 2, 4, 8 and 16 samples.
fn sample_offsets(samples: u32) -> &'static [[i8; 2]] {
    match samples {
        2 => &[[4, 4], [-4, -4]],
        4 => &[[-2, -6], [6, -2], [-6, 2], [2, 6]],
        8 => &[
            [1, -3],
            [-1, 3],
            [5, 1],
            [-3, -5],
            [-5, 5],
            [-7, -1],
            [3, 7],
            [7, -7],
        ],
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

/// Interpolation elsewhere in the pixel. At a centroid it is an input of its own; at a sample or an offset it
/// follows from the derivatives of the attribute divided by w, which are constant over the primitive.
pub fn interpolate(t: &mut Translator, it: &Instruction, op: G) -> Result<()> {
    let pointer = t.pointer(it.id(2)?)?;
    if op == G::InterpolateAtCentroid {
        let regs = read_input(t, &pointer, Sampling::Centroid)?;
        return t.define(it, regs);
    }
    let regs = read_input(t, &pointer, Sampling::Center)?;
    let [dx, dy] = if op == G::InterpolateAtOffset {
        match *t.regs(it.id(3)?)? {
            [dx, dy] => [dx, dy],
            _ => return malformed("the offset doesn't have two components"),
        }
    } else {
        let sample = t.reg(it.id(3)?)?;
        sample_offset(t, sample)
    };
    let interpolation = interpolation_of(t, &pointer);
    if interpolation == Some(Interpolation::Flat) {
        return t.define(it, regs);
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
    t.define(it, moved)
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

/// Reads a part of an input as it is elsewhere in the pixel.
fn read_input(t: &mut Translator, pointer: &Pointer, sampling: Sampling) -> Result<Vec<Reg>> {
    let Some((variable, start, ty)) = interpolant(t, pointer) else {
        return unsupported("interpolation of what isn't an input");
    };
    let scalars = t.globals.types.flatten(ty)?;
    let locations = t.io.locations(variable)?;
    let mut regs = Vec::with_capacity(scalars.len());
    for (offset, scalar) in scalars.into_iter().enumerate() {
        let Some(IoLocation::Location {
            location,
            component,
            interpolation,
            ..
        }) = locations.get(start + offset)
        else {
            return unsupported("interpolation of a built-in");
        };
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

/// The input variable that a pointer leads into, the scalar where, and the type of what it points to.
fn interpolant(t: &Translator, pointer: &Pointer) -> Option<(u32, usize, u32)> {
    let Pointer::PromotedVariable {
        variable,
        start,
        indices,
        ty,
    } = pointer
    else {
        return None;
    };
    let variable = t.promoted.variables[*variable]
        .input
        .filter(|_| indices.is_empty())?;
    Some((variable, *start, *ty))
}

/// The interpolation of the input that a pointer leads into.
fn interpolation_of(t: &mut Translator, pointer: &Pointer) -> Option<Interpolation> {
    let (variable, start, _) = interpolant(t, pointer)?;
    match t.io.locations(variable).ok()?.get(start)? {
        IoLocation::Location { interpolation, .. } => Some(*interpolation),
        IoLocation::BuiltIn { .. } => None,
    }
}
