//! The outputs that transform feedback captures, by their decorations.

use spirv::{Decoration, StorageClass};

use super::inputs_outputs::output_target;
use super::translator::Translator;
use crate::error::{Result, malformed, unsupported};
use crate::interface::{CapturedScalar, MAX_TRANSFORM_FEEDBACK_BUFFERS, MAX_VERTEX_STREAMS, TransformFeedback};
use crate::types::{Scalar, Type, Types};

/// The bytes of a word.
const WORD_BYTES: u32 = 4;

/// An offset that no vertex has.
const MAX_OFFSET: u32 = 1 << 31;

/// The decorations of a variable or a block's member that say where it is captured.
#[derive(Clone, Copy)]
struct Place {
    buffer: Option<u32>,
    stride: Option<u32>,
    stream: Option<u32>,
    offset: Option<u32>,
}

impl Place {
    fn new(number: impl Fn(Decoration) -> Option<u32>) -> Self {
        Self {
            buffer: number(Decoration::XfbBuffer),
            stride: number(Decoration::XfbStride),
            stream: number(Decoration::Stream),
            offset: number(Decoration::Offset),
        }
    }

    /// The place with what only the surrounding variable says.
    fn or(self, outer: Self) -> Self {
        Self {
            buffer: self.buffer.or(outer.buffer),
            stride: self.stride.or(outer.stride),
            stream: self.stream.or(outer.stream),
            offset: self.offset.or(outer.offset),
        }
    }
}

/// Describes in the interface what is captured of the variables that the entry point names, if it captures anything.
pub fn describe(t: &mut Translator, named: &[u32]) -> Result<()> {
    let Some(mut captured) = t.interface.transform_feedback.take() else {
        return Ok(());
    };
    for &id in named {
        let variable = t.globals.variables.get(&id);
        if let Some(variable) = variable.filter(|it| it.class == StorageClass::Output) {
            let ty = variable.pointee;
            capture_variable(t, id, ty, &mut captured)?;
        }
    }
    captured.scalars.sort_by_key(|scalar| (scalar.buffer, scalar.offset));
    check(&captured)?;
    t.interface.transform_feedback = Some(captured);
    Ok(())
}

fn capture_variable(t: &mut Translator, id: u32, ty: u32, captured: &mut TransformFeedback) -> Result<()> {
    let types = &t.globals.types;
    let place = Place::new(|decoration| t.module.literal(id, decoration));
    let (block, copies) = match types.get(ty)? {
        Type::Array { element, count, .. } => (*element, *count),
        _ => (ty, 1),
    };
    let members = match types.get(block)? {
        Type::Struct(members) if place.offset.is_none() => members.clone(),
        _ => return capture(t, id, 0, ty, place, captured),
    };
    // Each block of an array has its own buffer.
    let mut first = 0;
    for copy in 0..copies {
        for (number, member) in (0..).zip(members.iter()) {
            let own = Place::new(|it| t.module.member_literal(block, number, it));
            let mut place = own.or(place);
            place.buffer = place.buffer.map(|buffer| buffer.saturating_add(copy));
            capture(t, id, first, member.ty, place, captured)?;
            first += t.globals.types.scalars(member.ty)?;
        }
    }
    Ok(())
}

/// The offset of each scalar of a type from `offset` on, which becomes the end. Scalars lie side by side, but those of
/// 64 bits, and structures with such scalars, begin at multiples of 8.
fn place_scalars(types: &Types, ty: u32, offset: &mut u32, into: &mut Vec<u32>) -> Result<()> {
    let alignment = match types.flatten(ty)?.iter().any(|scalar| scalar.is_wide()) {
        true => 2 * WORD_BYTES,
        false => 1,
    };
    *offset = offset.next_multiple_of(alignment);
    match types.get(ty)? {
        Type::Struct(members) => {
            for member in members.iter() {
                place_scalars(types, member.ty, offset, into)?;
            }
        }
        Type::Vector { element, count }
        | Type::Matrix { column: element, count }
        | Type::Array { element, count, .. } => {
            for _ in 0..*count {
                place_scalars(types, *element, offset, into)?;
            }
        }
        _ => {
            into.push(*offset);
            *offset = offset.saturating_add(alignment.max(WORD_BYTES));
        }
    }
    Ok(())
}

/// Captures the scalars of a part of a variable from number `first` on, if it has an offset. The part is of type `ty`.
fn capture(
    t: &mut Translator,
    id: u32,
    first: u32,
    ty: u32,
    place: Place,
    captured: &mut TransformFeedback,
) -> Result<()> {
    let Some(buffer) = place.buffer else {
        return Ok(());
    };
    let stream = place.stream.unwrap_or(0);
    if buffer as usize >= MAX_TRANSFORM_FEEDBACK_BUFFERS || stream as usize >= MAX_VERTEX_STREAMS {
        return unsupported(format!("%{id} is captured in buffer {buffer} from stream {stream}"));
    }
    captured.streams[buffer as usize] = stream;
    if let Some(stride) = place.stride {
        captured.strides[buffer as usize] = stride;
    }
    let Some(offset) = place.offset else {
        return Ok(());
    };
    let types = &t.globals.types;
    let (mut offset, mut offsets) = (offset.min(MAX_OFFSET), Vec::new());
    place_scalars(types, ty, &mut offset, &mut offsets)?;
    let scalars = types.flatten(ty)?;
    let locations = t.io.locations(id)?;
    let parts = scalars.into_iter().zip(offsets);
    for ((scalar, offset), location) in parts.zip(&locations[first as usize..]) {
        if !matches!(scalar, Scalar::Int { width: 32 | 64, .. } | Scalar::Float { width: 32 | 64 }) {
            return unsupported(format!("%{id} is captured, and not of 32 or 64 bits"));
        }
        for (number, (word, _)) in (0..).zip(location.words(scalar)) {
            captured.scalars.push(CapturedScalar {
                target: output_target(word)?,
                buffer,
                offset: offset + number * WORD_BYTES,
            });
        }
    }
    Ok(())
}

/// Refuses scalars that overlap, aren't aligned or lie outside a vertex.
fn check(captured: &TransformFeedback) -> Result<()> {
    for scalar in &captured.scalars {
        let stride = captured.strides[scalar.buffer as usize];
        let end = scalar.offset.saturating_add(WORD_BYTES);
        let is_aligned = scalar.offset.is_multiple_of(WORD_BYTES) && stride.is_multiple_of(WORD_BYTES);
        if !is_aligned || end > stride {
            return malformed(format!("an output is captured at byte {} of {stride}", scalar.offset));
        }
    }
    let mut pairs = captured.scalars.windows(2);
    if pairs.any(|pair| (pair[0].buffer, pair[0].offset) == (pair[1].buffer, pair[1].offset)) {
        return malformed("two outputs are captured at one place");
    }
    Ok(())
}
