//! Unfiltered accesses: fetches, reads, writes and atomics. Every one is bounds-checked; what lies outside reads zero,
//! and writes there vanish.

use super::surface::{Surface, Texel};
use isa::exec::combine;
use isa::ir::{AtomicOp, CHUNK_LANES, Dimension, Format as Word, ImageShape};
use isa::resources::{Lanes, TexelRequest};

/// The texel that a lane means.
fn place(shape: ImageShape, request: &TexelRequest, lane: usize) -> Texel {
    let [x, y, z, w] = request.coordinate.map(|lanes| lanes[lane]);
    let (at, layer) = match (shape.dimension, shape.arrayed) {
        (Dimension::Buffer, _) | (Dimension::D1, false) => ([x, 0, 0], 0),
        (Dimension::D1, true) => ([x, 0, 0], y),
        (Dimension::D2, false) => ([x, y, 0], 0),
        (Dimension::D2, true) | (Dimension::Cube, _) => ([x, y, 0], z),
        (Dimension::D3, false) => ([x, y, z], 0),
        (Dimension::D3, true) => ([x, y, z], w),
    };
    let sample = if shape.multisampled {
        request.sample[lane]
    } else {
        0
    };
    Texel { at, layer, sample }
}

/// The lanes that take part, in order.
fn lanes(request: &TexelRequest) -> impl Iterator<Item = usize> {
    let mask = request.mask;
    (0..CHUNK_LANES).filter(move |lane| mask >> lane & 1 != 0)
}

/// Reads texels.
pub(super) fn read(surface: &Surface, request: &TexelRequest) -> [Lanes; 4] {
    let mut out = [[0; CHUNK_LANES]; 4];
    for lane in lanes(request) {
        let texel = place(request.shape, request, lane);
        let texel = surface.texel(request.level[lane] as usize, texel);
        let texel = texel.unwrap_or_else(|| surface.outside());
        for (out, component) in out.iter_mut().zip(surface.swizzled(texel)) {
            out[lane] = component;
        }
    }
    out
}

/// Writes texels.
pub(super) fn write(surface: &Surface, request: &TexelRequest, texel: &[Lanes; 4]) {
    if !surface.writable {
        return;
    }
    for lane in lanes(request) {
        let Some(offset) = surface.offset(0, place(request.shape, request, lane)) else {
            continue;
        };
        let registers = texel.map(|lanes| f32::from_bits(lanes[lane]));
        store(surface, offset, &surface.format.encode(registers));
    }
}

/// Stores a texel's bytes. Where a texel is a machine word, one of its writers wins whole.
fn store(surface: &Surface, offset: u64, bytes: &[u8; 16]) {
    let memory = &surface.memory;
    let [a, b, c, d, e, f, g, h, ..] = *bytes;
    let stored = match surface.texel_size {
        1 => memory.store_u8(offset, a),
        2 => memory.store_u16(offset, u16::from_le_bytes([a, b])),
        4 => memory.store_u32(offset, u32::from_le_bytes([a, b, c, d])),
        8 => memory.store_u64(offset, u64::from_le_bytes([a, b, c, d, e, f, g, h])),
        _ => None,
    };
    if stored.is_none() {
        // The offset was found within the surface, so that this cannot miss the memory.
        let _ = memory.write(offset, &bytes[..surface.texel_size]);
    }
}

/// Updates texels of one 32-bit component; returns the old values. Other formats read zero and keep what they have.
pub(super) fn atomic(
    surface: &Surface,
    request: &TexelRequest,
    op: AtomicOp,
    value: &Lanes,
    comparator: &Lanes,
) -> Lanes {
    let mut old = [0; CHUNK_LANES];
    let one_word = surface.texel_size == 4 && surface.format.components().len() == 1;
    if !surface.writable || !one_word {
        return old;
    }
    for lane in lanes(request) {
        let texel = place(request.shape, request, lane);
        let changed = surface.offset(0, texel).and_then(|offset| {
            surface.memory.update_u32(offset, |old| {
                let (value, comparator) = (u64::from(value[lane]), u64::from(comparator[lane]));
                combine(op, Word::B32, u64::from(old), value, comparator) as u32
            })
        });
        old[lane] = changed.unwrap_or(0);
    }
    old
}
