//! Loads, stores and atomics. Each is bounds-checked by an index into a slice of atomic words.

use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

use devmem::{BufferRange, load_4, load_16, store_16};
use fearless_simd::{Simd, prelude::*, u32x16};

use super::batch::Batch;
use super::masks::{bits_to_mask, lanes_of};
use crate::compiler::step::MaskId;
use crate::ir::{Address, AtomicOp, Binding, Format, Reg, Space, VECTOR_LANES};
use crate::kernels::combine;
use crate::kernels::registers::{RegisterSlot, each_lane, load_vector, store_vector};
use crate::resources::{load_word, range_words};

/// The memory of an access: words, and the number of their bytes that may be accessed.
#[derive(Clone, Copy)]
struct View<'a> {
    words: &'a [AtomicU32],
    bytes: u32,
    /// The buffer range, for 64-bit atomics. Workgroup memory has none; only one thread accesses it.
    range: Option<&'a BufferRange>,
}

impl<'a> View<'a> {
    const EMPTY: Self = Self { words: &[], bytes: 0, range: None };

    fn of(range: &'a BufferRange) -> Self {
        let (words, bytes) = range_words(range);
        Self { words, bytes, range: Some(range) }
    }

    /// Returns the element's bits. None if it is misaligned or out of range.
    #[inline(always)]
    fn load(self, address: u64, format: Format) -> Option<u64> {
        let size = format.bytes();
        if address + u64::from(size) > u64::from(self.bytes) || !address.is_multiple_of(u64::from(size.min(4))) {
            return None;
        }
        let word = load_word(self.words, (address / 4) as usize)?;
        let narrow = word >> (8 * (address % 4) as u32);
        Some(match format {
            Format::B32 => u64::from(word),
            Format::U8 => u64::from(narrow as u8),
            Format::S8 => u64::from(i32::from(narrow as u8 as i8).cast_unsigned()),
            Format::U16 => u64::from(narrow as u16),
            Format::S16 => u64::from(i32::from(narrow as u16 as i16).cast_unsigned()),
            Format::B64 => u64::from(word) | u64::from(load_word(self.words, (address / 4) as usize + 1)?) << 32,
        })
    }

    /// Stores an element. Does nothing if it is misaligned or out of range.
    #[inline(always)]
    fn store(self, address: u64, format: Format, value: u64) {
        let size = format.bytes();
        if address + u64::from(size) > u64::from(self.bytes) || !address.is_multiple_of(u64::from(size.min(4))) {
            return;
        }
        let index = (address / 4) as usize;
        let Some(word) = self.words.get(index) else {
            return;
        };
        match format {
            Format::B32 => word.store(value as u32, Relaxed),
            Format::B64 => {
                if let Some(high) = self.words.get(index + 1) {
                    word.store(value as u32, Relaxed);
                    high.store((value >> 32) as u32, Relaxed);
                }
            }
            Format::U8 | Format::S8 | Format::U16 | Format::S16 => {
                let shift = 8 * (address % 4) as u32;
                let mask = (if size == 1 { 0xff } else { 0xffff }) << shift;
                let bits = (value as u32) << shift & mask;
                // Another thread may write the word's other bytes at the same time.
                let _ = word.fetch_update(Relaxed, Relaxed, |old| Some(old & !mask | bits));
            }
        }
    }
}

/// The addresses of an access in 16 lanes.
struct Places<'a> {
    /// One view for all lanes, or one for each.
    view: Result<View<'a>, Box<[View<'a>; VECTOR_LANES]>>,
    addresses: [u64; VECTOR_LANES],
}

impl<'a> Places<'a> {
    #[inline(always)]
    fn view(&self, lane: usize) -> View<'a> {
        match &self.view {
            Ok(view) => *view,
            Err(views) => views[lane],
        }
    }
}

/// The buffer at an element of a bind point's array.
fn buffer<'a>(batch: &Batch<'a>, binding: &Binding, index: u32) -> View<'a> {
    if index >= binding.count {
        return View::EMPTY;
    }
    match batch.resources.buffers.get((binding.slot + index) as usize) {
        Some(Some(range)) => View::of(range),
        _ => View::EMPTY,
    }
}

/// The addresses in the 16 lanes of a vector. Lanes outside `lanes` may get any.
fn places<'a>(batch: &Batch<'a>, address: &Address, vector: usize, lanes: u16) -> Places<'a> {
    let offset = u64::from(address.offset);
    if address.space == Space::Global {
        return global_places(batch, address, vector, lanes);
    }
    let addresses = match address.base {
        Some(base) => batch.file.lanes::<u32>(batch.slot(base), vector).map(|base| u64::from(base) + offset),
        None => [offset; VECTOR_LANES],
    };
    let view = match &address.space {
        Space::Buffer(binding) => match binding.index {
            None => Ok(buffer(batch, binding, 0)),
            Some(index) => {
                let slot = batch.slot(index);
                let indices = batch.file.lanes::<u32>(slot, vector);
                if slot.is_varying() {
                    Err(Box::new(indices.map(|index| buffer(batch, binding, index))))
                } else {
                    Ok(buffer(batch, binding, indices[0]))
                }
            }
        },
        space => Ok(common_view(batch, space).unwrap_or(View::EMPTY)),
    };
    Places { view, addresses }
}

fn global_places<'a>(batch: &Batch<'a>, address: &Address, vector: usize, lanes: u16) -> Places<'a> {
    let mut places = Places { view: Ok(View::EMPTY), addresses: [0; VECTOR_LANES] };
    let Some(base) = address.base else {
        return places;
    };
    let bases = batch.file.lanes::<u64>(batch.slot(base), vector);
    let mut views = [View::EMPTY; VECTOR_LANES];
    for lane in lanes_of(lanes) {
        let target = bases[lane].wrapping_add(u64::from(address.offset));
        if let Some((range, start)) = batch.resources.global.find(target) {
            views[lane] = View::of(range);
            places.addresses[lane] = target.wrapping_sub(start).min(u64::from(u32::MAX));
        }
    }
    places.view = Err(Box::new(views));
    places
}

/// Writes 16 lanes of a loaded register.
fn put(batch: &Batch<'_>, dst: RegisterSlot, format: Format, vector: usize, values: [u64; VECTOR_LANES]) {
    if format == Format::B64 {
        batch.file.set(dst, vector, values);
    } else {
        batch.file.set(dst, vector, each_lane(values, |value| value as u32));
    }
}

/// Reads 16 lanes of a register that is stored.
fn take(batch: &Batch<'_>, src: RegisterSlot, format: Format, vector: usize) -> [u64; VECTOR_LANES] {
    if format == Format::B64 {
        batch.file.lanes(src, vector)
    } else {
        each_lane(batch.file.lanes::<u32>(src, vector), u64::from)
    }
}

/// The memory that all lanes access, if it's one memory of words.
#[inline(always)]
fn common_view<'a>(batch: &Batch<'a>, space: &Space) -> Option<View<'a>> {
    match space {
        Space::Buffer(binding) => match binding.index.map(|index| batch.slot(index)) {
            None => Some(buffer(batch, binding, 0)),
            Some(index) if index.is_varying() => None,
            Some(index) => Some(buffer(batch, binding, batch.file.first(index))),
        },
        Space::PushConstants => Some(View { words: batch.resources.push_constants, bytes: u32::MAX, range: None }),
        Space::Shared => Some(View { words: batch.shared, bytes: batch.program.shared_bytes, range: None }),
        Space::Private => {
            batch.program.table.as_deref().map(|words| View { words, bytes: batch.program.private_bytes, range: None })
        }
        Space::Global => None,
    }
}

pub fn load<S: Simd>(batch: &Batch<'_>, simd: S, dst: &[Reg], address: &Address, format: Format) {
    let view = common_view(batch, &address.space);
    // Registers of one load are uniform together.
    let uniform = dst.iter().any(|reg| !batch.slot(*reg).is_varying());
    match view {
        Some(view) if uniform => load_uniform_from(batch, view, dst, address, format),
        Some(view) if format == Format::B32 => load_words(batch, simd, view, dst, address),
        None if address.space == Space::Private => load_private(batch, dst, address, format),
        _ if uniform => load_uniform(batch, dst, address, format),
        _ => batch.file.span().for_each(|vector| load_lanes(batch, dst, address, format, vector)),
    }
}

/// Loads 16 lanes, one by one.
fn load_lanes(batch: &Batch<'_>, dst: &[Reg], address: &Address, format: Format, vector: usize) {
    let lanes = batch.masks.bits(MaskId::ACTIVE, vector);
    if lanes == 0 {
        return;
    }
    let places = places(batch, address, vector, lanes);
    for (element, reg) in dst.iter().enumerate() {
        let step = element as u64 * u64::from(format.bytes());
        let mut values = [0; VECTOR_LANES];
        for lane in lanes_of(lanes) {
            values[lane] = places.view(lane).load(places.addresses[lane] + step, format).unwrap_or(0);
        }
        put(batch, batch.slot(*reg), format, vector, values);
    }
}

/// Loads elements that are the same in all lanes.
fn load_uniform_from(batch: &Batch<'_>, view: View<'_>, dst: &[Reg], address: &Address, format: Format) {
    let base = address.base.map_or(0, |base| batch.file.first::<u32>(batch.slot(base)));
    let mut at = u64::from(base) + u64::from(address.offset);
    for reg in dst {
        let value = view.load(at, format).unwrap_or(0);
        if format == Format::B64 {
            batch.file.set(batch.slot(*reg), 0, [value; VECTOR_LANES]);
        } else {
            batch.file.set(batch.slot(*reg), 0, [value as u32; VECTOR_LANES]);
        }
        at += u64::from(format.bytes());
    }
}

fn load_uniform(batch: &Batch<'_>, dst: &[Reg], address: &Address, format: Format) {
    let places = places(batch, address, 0, 1);
    for (element, reg) in dst.iter().enumerate() {
        let step = element as u64 * u64::from(format.bytes());
        let value = places.view(0).load(places.addresses[0] + step, format).unwrap_or(0);
        put(batch, batch.slot(*reg), format, 0, [value; VECTOR_LANES]);
    }
}

pub fn store<S: Simd>(batch: &Batch<'_>, simd: S, src: &[Reg], address: &Address, format: Format) {
    match common_view(batch, &address.space) {
        Some(view) if format == Format::B32 => store_words(batch, simd, view, src, address),
        None if address.space == Space::Private => store_private(batch, src, address, format),
        _ => batch.file.span().for_each(|vector| store_lanes(batch, src, address, format, vector)),
    }
}

/// Stores 16 lanes, one by one.
fn store_lanes(batch: &Batch<'_>, src: &[Reg], address: &Address, format: Format, vector: usize) {
    let lanes = batch.masks.writing(vector);
    if lanes == 0 {
        return;
    }
    let places = places(batch, address, vector, lanes);
    for (element, reg) in src.iter().enumerate() {
        let step = element as u64 * u64::from(format.bytes());
        let values = take(batch, batch.slot(*reg), format, vector);
        for lane in lanes_of(lanes) {
            places.view(lane).store(places.addresses[lane] + step, format, values[lane]);
        }
    }
}

#[allow(clippy::too_many_arguments, reason = "the statement has as many")]
pub fn atomic<S: Simd>(
    batch: &Batch<'_>,
    simd: S,
    op: AtomicOp,
    dst: Option<Reg>,
    address: &Address,
    format: Format,
    value: Reg,
    comparator: Option<Reg>,
) {
    for vector in batch.file.span() {
        let lanes = batch.masks.writing(vector);
        let mut old = [0; VECTOR_LANES];
        if lanes != 0 {
            let values = take(batch, batch.slot(value), format, vector);
            let comparators = comparator.map_or([0; VECTOR_LANES], |reg| take(batch, batch.slot(reg), format, vector));
            let at_once = (format == Format::B32).then(|| {
                let [values, comparators] = [values, comparators].map(|lanes| each_lane(lanes, |lane| lane as u32));
                atomic_words(batch, simd, op, address, vector, &values, &comparators)
            });
            old = match at_once.flatten() {
                Some(old) => each_lane(old, u64::from),
                None => {
                    let change = |lane, old| combine(op, format, old, values[lane], comparators[lane]);
                    atomic_lanes(batch, address, format, vector, lanes, change)
                }
            };
        }
        if let Some(dst) = dst {
            put(batch, batch.slot(dst), format, vector, old);
        }
    }
}

/// Atomic operations of 16 lanes, one by one. Gives the old values.
fn atomic_lanes(
    batch: &Batch<'_>,
    address: &Address,
    format: Format,
    vector: usize,
    lanes: u16,
    change: impl Fn(usize, u64) -> u64,
) -> [u64; VECTOR_LANES] {
    let mut old = [0; VECTOR_LANES];
    let places = places(batch, address, vector, lanes);
    for lane in lanes_of(lanes) {
        let (view, at) = (places.view(lane), places.addresses[lane]);
        old[lane] = update(view, at, format, |old| change(lane, old)).unwrap_or(0);
    }
    old
}

pub fn buffer_size(batch: &Batch<'_>, dst: Reg, binding: &Binding) {
    let slot = batch.slot(dst);
    for vector in batch.file.rounds(slot) {
        let sizes = match binding.index {
            None => [buffer(batch, binding, 0).bytes; VECTOR_LANES],
            Some(index) => {
                batch.file.lanes::<u32>(batch.slot(index), vector).map(|index| buffer(batch, binding, index).bytes)
            }
        };
        batch.file.set(slot, vector, sizes);
    }
}

/// Changes an element atomically and returns the old value. Does nothing if it is misaligned or out of range.
fn update(view: View<'_>, address: u64, format: Format, change: impl Fn(u64) -> u64) -> Option<u64> {
    let size = u64::from(format.bytes());
    if address + size > u64::from(view.bytes) || !address.is_multiple_of(size) {
        return None;
    }
    if format == Format::B64 {
        if let Some(range) = view.range {
            return range.memory.update_u64(range.offset + address, change);
        }
        let old = view.load(address, format)?;
        view.store(address, format, change(old));
        return Some(old);
    }
    let word = view.words.get((address / 4) as usize)?;
    let changed = word.fetch_update(Relaxed, Relaxed, |old| Some(change(u64::from(old)) as u32));
    Some(u64::from(changed.unwrap_or_else(|old| old)))
}

// Elements of 32 bits in one memory: bounds are checked for 16 lanes at once.

/// The number of elements of one access that are handled together: those of a four-component vector.
const TOGETHER: usize = 4;

/// The words that an access may reach, from its offset on.
#[derive(Clone, Copy)]
struct Window<'a> {
    words: &'a [AtomicU32],
}

impl<'a> Window<'a> {
    /// Empty if the offset isn't aligned.
    #[inline(always)]
    fn new(view: View<'a>, offset: u32) -> Self {
        let end = view.words.len().min(view.bytes as usize / 4);
        let start = (offset as usize / 4).min(end);
        if offset.is_multiple_of(4) { Self { words: &view.words[start..end] } } else { Self { words: &[] } }
    }

    /// The index of each lane's first word from the window's start. None if an element of one of `lanes` is out of
    /// range or misaligned. Other lanes get an index that is in range.
    #[inline(always)]
    fn starts<S: Simd>(self, simd: S, mut bases: u32x16<S>, lanes: u16, count: usize) -> Option<u32x16<S>> {
        if lanes != u16::MAX {
            let first = bases[lanes.trailing_zeros() as usize % VECTOR_LANES];
            let first = u32x16::splat(simd, first);
            bases = bits_to_mask(simd, lanes).select(bases, first);
        }
        let last = u32::try_from(self.words.len().checked_sub(count)?).unwrap_or(u32::MAX);
        let words = bases >> 2;
        let within = words.simd_le(u32x16::splat(simd, last));
        let aligned = (bases & 3).simd_eq(u32x16::splat(simd, 0));
        (within & aligned).all_true().then_some(words)
    }
}

/// Reports whether lanes follow one another, `STRIDE` words apart.
#[inline(always)]
fn are_apart<S: Simd, const STRIDE: usize>(starts: u32x16<S>) -> bool {
    let steps = const {
        let mut steps = [0; VECTOR_LANES];
        let mut lane = 0;
        while lane < VECTOR_LANES {
            steps[lane] = (lane * STRIDE) as u32;
            lane += 1;
        }
        steps
    };
    let steps = u32x16::simd_from(starts.simd, steps);
    let wanted = u32x16::splat(starts.simd, starts[0]) + steps;
    starts.simd_eq(wanted).all_true()
}

/// `COUNT` elements from a word on.
#[inline(always)]
fn element<const COUNT: usize>(words: &[AtomicU32], at: u32) -> &[AtomicU32; COUNT] {
    match words[at as usize..][..COUNT].try_into() {
        Ok(element) => element,
        Err(_) => unreachable!("the slice has that length"),
    }
}

#[inline(always)]
fn bases<S: Simd>(batch: &Batch<'_>, simd: S, address: &Address, vector: usize) -> u32x16<S> {
    match address.base.map(|base| batch.slot(base)) {
        Some(base) if base.is_varying() => load_vector(simd, &batch.file.narrow(base)[vector]),
        Some(base) => load_vector(simd, &batch.file.narrow(base)[0]),
        None => u32x16::splat(simd, 0),
    }
}

#[inline(always)]
fn slots<const COUNT: usize>(batch: &Batch<'_>, regs: [Reg; COUNT]) -> [RegisterSlot; COUNT] {
    let mut slots = [RegisterSlot::ZERO; COUNT];
    for index in 0..COUNT {
        slots[index] = batch.slot(regs[index]);
    }
    slots
}

/// Loads into varying registers.
fn load_words<'a, S: Simd>(batch: &Batch<'a>, simd: S, view: View<'a>, dst: &[Reg], address: &Address) {
    for (part, dst) in dst.chunks(TOGETHER).enumerate() {
        let address = Address {
            // An offset that overflows is beyond the end of any memory.
            offset: address.offset.saturating_add((4 * TOGETHER * part) as u32),
            ..*address
        };
        match dst {
            [a] => load_elements(batch, simd, [*a], view, dst, &address),
            [a, b] => load_elements(batch, simd, [*a, *b], view, dst, &address),
            [a, b, c] => load_elements(batch, simd, [*a, *b, *c], view, dst, &address),
            [a, b, c, d, ..] => load_elements(batch, simd, [*a, *b, *c, *d], view, dst, &address),
            [] => {}
        }
    }
}

#[inline(never)]
fn load_elements<'a, S: Simd, const COUNT: usize>(
    batch: &Batch<'a>,
    simd: S,
    regs: [Reg; COUNT],
    view: View<'a>,
    dst: &[Reg],
    address: &Address,
) {
    simd.vectorize(
        #[inline(always)]
        || {
            let slots = slots(batch, regs);
            let window = Window::new(view, address.offset);
            if has_one_address(batch, address)
                && let Some(starts) = window.starts(simd, bases(batch, simd, address, 0), u16::MAX, COUNT)
            {
                return load_one(batch, simd, slots, element(window.words, starts[0]));
            }
            for vector in batch.file.span() {
                let lanes = batch.masks.bits(MaskId::ACTIVE, vector);
                if lanes == 0 {
                    continue;
                }
                let bases = bases(batch, simd, address, vector);
                match window.starts(simd, bases, lanes, COUNT) {
                    Some(starts) => gather_words(batch, slots, vector, window, starts),
                    None => load_lanes(batch, dst, address, Format::B32, vector),
                }
            }
        },
    );
}

/// Reports whether all lanes access the same address.
#[inline(always)]
fn has_one_address(batch: &Batch<'_>, address: &Address) -> bool {
    match address.base {
        Some(base) => !batch.slot(base).is_varying(),
        None => true,
    }
}

/// Loads one element into varying registers.
#[inline(always)]
fn load_one<S: Simd, const COUNT: usize>(
    batch: &Batch<'_>,
    simd: S,
    slots: [RegisterSlot; COUNT],
    element: &[AtomicU32; COUNT],
) {
    for index in 0..COUNT {
        let value = u32x16::splat(simd, element[index].load(Relaxed));
        for vector in batch.file.span() {
            store_vector(batch.file.vector(slots[index], vector), value);
        }
    }
}

#[inline(always)]
fn gather_words<S: Simd, const COUNT: usize>(
    batch: &Batch<'_>,
    slots: [RegisterSlot; COUNT],
    vector: usize,
    window: Window<'_>,
    starts: u32x16<S>,
) {
    let simd = starts.simd;
    let mut values = [u32x16::splat(simd, 0); COUNT];
    if are_apart::<S, 0>(starts) {
        let element = element::<COUNT>(window.words, starts[0]);
        for index in 0..COUNT {
            values[index] = u32x16::splat(simd, element[index].load(Relaxed));
        }
    } else if COUNT != 3 && are_apart::<S, COUNT>(starts) {
        let run = &window.words[starts[0] as usize..][..VECTOR_LANES * COUNT];
        let mut parts = [u32x16::splat(simd, 0); COUNT];
        for (part, words) in parts.iter_mut().zip(run.as_chunks().0) {
            *part = load_16(simd, words);
        }
        values = separate(parts);
    } else if COUNT == 4 {
        let starts: [u32; VECTOR_LANES] = starts.into();
        let mut parts = values;
        for (part, starts) in parts.iter_mut().zip(starts.as_chunks::<4>().0) {
            let a = load_4(simd, element::<4>(window.words, starts[0]));
            let b = load_4(simd, element::<4>(window.words, starts[1]));
            let c = load_4(simd, element::<4>(window.words, starts[2]));
            let d = load_4(simd, element::<4>(window.words, starts[3]));
            *part = a.combine(b).combine(c.combine(d));
        }
        values = separate(parts);
    } else {
        let starts: [u32; VECTOR_LANES] = starts.into();
        let mut lanes = [[0; VECTOR_LANES]; COUNT];
        for lane in 0..VECTOR_LANES {
            let element = element::<COUNT>(window.words, starts[lane]);
            for index in 0..COUNT {
                lanes[index][lane] = element[index].load(Relaxed);
            }
        }
        for index in 0..COUNT {
            values[index] = u32x16::simd_from(simd, lanes[index]);
        }
    }
    for index in 0..COUNT {
        store_vector(batch.file.vector(slots[index], vector), values[index]);
    }
}

/// The elements of 16 lanes, given `COUNT` elements of each lane one after the other; `COUNT` is 1, 2 or 4.
#[inline(always)]
fn separate<S: Simd, const COUNT: usize>(mut parts: [u32x16<S>; COUNT]) -> [u32x16<S>; COUNT] {
    if COUNT == 2 {
        (parts[0], parts[1]) = parts[0].deinterleave(parts[1]);
    }
    if COUNT == 4 {
        let (even, odd) = parts[0].deinterleave(parts[1]);
        let (even_later, odd_later) = parts[2].deinterleave(parts[3]);
        (parts[0], parts[2]) = even.deinterleave(even_later);
        (parts[1], parts[3]) = odd.deinterleave(odd_later);
    }
    parts
}

/// The inverse of [`separate`].
#[inline(always)]
fn join<S: Simd, const COUNT: usize>(mut parts: [u32x16<S>; COUNT]) -> [u32x16<S>; COUNT] {
    if COUNT == 2 {
        (parts[0], parts[1]) = parts[0].interleave(parts[1]);
    }
    if COUNT == 4 {
        let (even, even_later) = parts[0].interleave(parts[2]);
        let (odd, odd_later) = parts[1].interleave(parts[3]);
        (parts[0], parts[1]) = even.interleave(odd);
        (parts[2], parts[3]) = even_later.interleave(odd_later);
    }
    parts
}

/// Stores words.
fn store_words<'a, S: Simd>(batch: &Batch<'a>, simd: S, view: View<'a>, src: &[Reg], address: &Address) {
    for (part, src) in src.chunks(TOGETHER).enumerate() {
        let address = Address { offset: address.offset.saturating_add((4 * TOGETHER * part) as u32), ..*address };
        match src {
            [a] => store_elements(batch, simd, [*a], view, src, &address),
            [a, b] => store_elements(batch, simd, [*a, *b], view, src, &address),
            [a, b, c] => store_elements(batch, simd, [*a, *b, *c], view, src, &address),
            [a, b, c, d, ..] => {
                store_elements(batch, simd, [*a, *b, *c, *d], view, src, &address);
            }
            [] => {}
        }
    }
}

#[inline(never)]
fn store_elements<'a, S: Simd, const COUNT: usize>(
    batch: &Batch<'a>,
    simd: S,
    regs: [Reg; COUNT],
    view: View<'a>,
    src: &[Reg],
    address: &Address,
) {
    simd.vectorize(
        #[inline(always)]
        || {
            let slots = slots(batch, regs);
            let window = Window::new(view, address.offset);
            for vector in batch.file.span() {
                let lanes = batch.masks.writing(vector);
                if lanes == 0 {
                    continue;
                }
                let bases = bases(batch, simd, address, vector);
                match window.starts(simd, bases, lanes, COUNT) {
                    Some(starts) => scatter_words(batch, slots, vector, lanes, window, starts),
                    None => store_lanes(batch, src, address, Format::B32, vector),
                }
            }
        },
    );
}

#[inline(always)]
fn scatter_words<S: Simd, const COUNT: usize>(
    batch: &Batch<'_>,
    slots: [RegisterSlot; COUNT],
    vector: usize,
    lanes: u16,
    window: Window<'_>,
    starts: u32x16<S>,
) {
    if COUNT != 3 && lanes == u16::MAX && are_apart::<S, COUNT>(starts) {
        let simd = starts.simd;
        let mut parts = [u32x16::splat(simd, 0); COUNT];
        for index in 0..COUNT {
            parts[index] = load_vector(simd, batch.file.vector(slots[index], vector));
        }
        let run = &window.words[starts[0] as usize..][..VECTOR_LANES * COUNT];
        for (words, part) in run.as_chunks().0.iter().zip(join(parts)) {
            store_16(simd, words, part);
        }
        return;
    }
    let mut values = [[0; VECTOR_LANES]; COUNT];
    for index in 0..COUNT {
        values[index] = batch.file.lanes::<u32>(slots[index], vector);
    }
    let starts: [u32; VECTOR_LANES] = starts.into();
    let put = |lane: usize| {
        let element = element::<COUNT>(window.words, starts[lane]);
        for index in 0..COUNT {
            element[index].store(values[index][lane], Relaxed);
        }
    };
    if lanes == u16::MAX {
        for lane in 0..VECTOR_LANES {
            put(lane);
        }
    } else {
        for lane in lanes_of(lanes) {
            put(lane);
        }
    }
}

/// A read-modify-write of 32 bits, in 16 lanes in order. Gives the old values, or None if a lane is out of range.
fn atomic_words<S: Simd>(
    batch: &Batch<'_>,
    simd: S,
    op: AtomicOp,
    address: &Address,
    vector: usize,
    values: &[u32; VECTOR_LANES],
    comparators: &[u32; VECTOR_LANES],
) -> Option<[u32; VECTOR_LANES]> {
    let lanes = batch.masks.writing(vector);
    let window = Window::new(common_view(batch, &address.space)?, address.offset);
    let starts = window.starts(simd, bases(batch, simd, address, vector), lanes, 1)?;
    let access = Access { lanes, window, starts: starts.into(), values, comparators };
    let combined = |old: u32, value: u32, comparator: u32| {
        let (old, value) = (u64::from(old), u64::from(value));
        combine(op, Format::B32, old, value, comparator.into()) as u32
    };
    if address.space == Space::Shared {
        // No other thread accesses this memory.
        return Some(access.each(|word, value, comparator| {
            let old = word.load(Relaxed);
            word.store(combined(old, value, comparator), Relaxed);
            old
        }));
    }
    Some(match op {
        AtomicOp::IAdd => access.each(|word, value, _| word.fetch_add(value, Relaxed)),
        AtomicOp::UMin => access.each(|word, value, _| word.fetch_min(value, Relaxed)),
        AtomicOp::UMax => access.each(|word, value, _| word.fetch_max(value, Relaxed)),
        AtomicOp::And => access.each(|word, value, _| word.fetch_and(value, Relaxed)),
        AtomicOp::Or => access.each(|word, value, _| word.fetch_or(value, Relaxed)),
        AtomicOp::Xor => access.each(|word, value, _| word.fetch_xor(value, Relaxed)),
        AtomicOp::Exchange => access.each(|word, value, _| word.swap(value, Relaxed)),
        _ => access.each(|word, value, comparator| {
            let change = |old| Some(combined(old, value, comparator));
            word.fetch_update(Relaxed, Relaxed, change).unwrap_or_else(|old| old)
        }),
    })
}

/// The operands of an atomic operation.
struct Access<'a> {
    lanes: u16,
    window: Window<'a>,
    starts: [u32; VECTOR_LANES],
    values: &'a [u32; VECTOR_LANES],
    comparators: &'a [u32; VECTOR_LANES],
}

impl Access<'_> {
    /// Calls `change(word, value, comparator)` for each lane in order; it gives the old value.
    #[inline(always)]
    fn each(&self, change: impl Fn(&AtomicU32, u32, u32) -> u32) -> [u32; VECTOR_LANES] {
        let mut old = [0; VECTOR_LANES];
        for lane in lanes_of(self.lanes) {
            let word = &self.window.words[self.starts[lane] as usize];
            old[lane] = change(word, self.values[lane], self.comparators[lane]);
        }
        old
    }
}

// Private memory of each lane. A word of it is a row of vectors, as a varying register is.

/// The row that means a word that doesn't exist.
const NOWHERE: usize = usize::MAX;

/// The rows that 16 lanes access.
enum Rows {
    Same(usize),
    Each([usize; VECTOR_LANES]),
}

/// The row of private memory at a byte address; [`NOWHERE`] if there is none.
#[inline(always)]
fn private_row(batch: &Batch<'_>, address: u64) -> usize {
    if address.is_multiple_of(4) && address < u64::from(batch.program.private_bytes) {
        (address / 4) as usize * batch.file.width()
    } else {
        NOWHERE
    }
}

/// The rows that 16 lanes access.
#[inline(always)]
fn private_rows(batch: &Batch<'_>, address: &Address, step: u64, vector: usize) -> Rows {
    let step = u64::from(address.offset) + step;
    match address.base.map(|base| batch.slot(base)) {
        None => Rows::Same(private_row(batch, step)),
        Some(base) if !base.is_varying() => {
            Rows::Same(private_row(batch, u64::from(batch.file.first::<u32>(base)) + step))
        }
        Some(base) => {
            let bases = batch.file.lanes::<u32>(base, vector);
            Rows::Each(each_lane(bases, |base| private_row(batch, u64::from(base) + step)))
        }
    }
}

/// Loads one word for 16 lanes; zero where it doesn't exist.
#[inline(always)]
fn private_words(batch: &Batch<'_>, address: &Address, step: u64, vector: usize) -> [u32; VECTOR_LANES] {
    let word = |row: usize| batch.private.get(row.wrapping_add(vector));
    match private_rows(batch, address, step, vector) {
        Rows::Same(NOWHERE) => [0; VECTOR_LANES],
        Rows::Same(row) => word(row).map_or([0; VECTOR_LANES], |vector| vector.get().0),
        Rows::Each(rows) => {
            let mut values = [0; VECTOR_LANES];
            for (lane, row) in rows.into_iter().enumerate() {
                if row != NOWHERE {
                    values[lane] = word(row).map_or(0, |vector| vector.get().0[lane]);
                }
            }
            values
        }
    }
}

fn load_private(batch: &Batch<'_>, dst: &[Reg], address: &Address, format: Format) {
    for vector in batch.file.span() {
        for (element, reg) in dst.iter().enumerate() {
            let step = element as u64 * u64::from(format.bytes());
            let low = private_words(batch, address, step, vector);
            if format != Format::B64 {
                batch.file.set(batch.slot(*reg), vector, low);
                continue;
            }
            let high = private_words(batch, address, step + 4, vector);
            let exists = second_exists(batch, address, step, vector);
            let values: [u64; VECTOR_LANES] =
                std::array::from_fn(
                    |lane| {
                        if exists[lane] { u64::from(low[lane]) | u64::from(high[lane]) << 32 } else { 0 }
                    },
                );
            batch.file.set(batch.slot(*reg), vector, values);
        }
    }
}

/// The lanes in which the second word of a 64-bit element exists.
fn second_exists(batch: &Batch<'_>, address: &Address, step: u64, vector: usize) -> [bool; VECTOR_LANES] {
    match private_rows(batch, address, step + 4, vector) {
        Rows::Same(row) => [row != NOWHERE; VECTOR_LANES],
        Rows::Each(rows) => rows.map(|row| row != NOWHERE),
    }
}

fn store_private(batch: &Batch<'_>, src: &[Reg], address: &Address, format: Format) {
    for vector in batch.file.span() {
        let lanes = batch.masks.bits(MaskId::ACTIVE, vector);
        for (element, reg) in src.iter().enumerate() {
            let step = element as u64 * u64::from(format.bytes());
            if format == Format::B64 {
                let values: [u64; VECTOR_LANES] = batch.file.lanes(batch.slot(*reg), vector);
                let exists = second_exists(batch, address, step, vector);
                let whole = lanes_of(lanes).filter(|lane| exists[*lane]);
                let lanes = whole.fold(0, |lanes, lane| lanes | 1 << lane);
                let low = values.map(|value| value as u32);
                let high = values.map(|value| (value >> 32) as u32);
                set_private(batch, address, step, vector, lanes, low);
                set_private(batch, address, step + 4, vector, lanes, high);
            } else {
                let values = batch.file.lanes(batch.slot(*reg), vector);
                set_private(batch, address, step, vector, lanes, values);
            }
        }
    }
}

/// Sets one word in some of 16 lanes.
#[inline(always)]
fn set_private(
    batch: &Batch<'_>,
    address: &Address,
    step: u64,
    vector: usize,
    lanes: u16,
    values: [u32; VECTOR_LANES],
) {
    let word = |row: usize| batch.private.get(row.wrapping_add(vector));
    match private_rows(batch, address, step, vector) {
        Rows::Same(NOWHERE) => {}
        Rows::Same(row) => {
            if let Some(cell) = word(row) {
                let mut vector = cell.get();
                for (lane, value) in values.into_iter().enumerate() {
                    if lanes >> lane & 1 != 0 {
                        vector.0[lane] = value;
                    }
                }
                cell.set(vector);
            }
        }
        Rows::Each(rows) => {
            for lane in lanes_of(lanes).filter(|lane| rows[*lane] != NOWHERE) {
                if let Some(cell) = word(rows[lane]) {
                    let mut vector = cell.get();
                    vector.0[lane] = values[lane];
                    cell.set(vector);
                }
            }
        }
    }
}
