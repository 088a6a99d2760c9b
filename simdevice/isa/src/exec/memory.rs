//! Loads, stores and atomics: every one bounds-checked by an index into a slice of atomic words.

use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

use fearless_simd::Simd;

use super::super::ir::{Address, AtomicOp, Binding, CHUNK_LANES, Format, Reg, Space};
use super::super::resources::{load_word, range_words};
use super::batch::Batch;
use super::file::{Slot, each_lane};
use super::mask::{MaskId, lanes_of};
use devmem::BufferRange;

/// Memory that an access goes to: words, and how many bytes of them count.
#[derive(Clone, Copy)]
pub(super) struct View<'a> {
    pub(super) words: &'a [AtomicU32],
    pub(super) bytes: u32,
    /// The range that it is, for atomics of 64 bits; workgroup memory has none, and only one thread.
    range: Option<&'a BufferRange>,
}

impl<'a> View<'a> {
    const EMPTY: Self = Self {
        words: &[],
        bytes: 0,
        range: None,
    };

    fn of(range: &'a BufferRange) -> Self {
        let (words, bytes) = range_words(range);
        Self {
            words,
            bytes,
            range: Some(range),
        }
    }

    /// The element's bits, if it is aligned and within.
    #[inline(always)]
    fn load(self, address: u64, format: Format) -> Option<u64> {
        let size = format.bytes();
        if address + u64::from(size) > u64::from(self.bytes)
            || !address.is_multiple_of(u64::from(size.min(4)))
        {
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
            Format::B64 => {
                u64::from(word)
                    | u64::from(load_word(self.words, (address / 4) as usize + 1)?) << 32
            }
        })
    }

    /// Stores an element, if it is aligned and within.
    #[inline(always)]
    fn store(self, address: u64, format: Format, value: u64) {
        let size = format.bytes();
        if address + u64::from(size) > u64::from(self.bytes)
            || !address.is_multiple_of(u64::from(size.min(4)))
        {
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
                // Neighbours in the word may be written at the same time.
                let _ = word.fetch_update(Relaxed, Relaxed, |old| Some(old & !mask | bits));
            }
        }
    }
}

/// Where each of 16 lanes accesses.
struct Places<'a> {
    /// One view for all lanes, or one for each.
    view: Result<View<'a>, Box<[View<'a>; CHUNK_LANES]>>,
    addresses: [u64; CHUNK_LANES],
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

impl<'a> Batch<'a> {
    /// The buffer that a bind point's element has.
    fn buffer(&self, binding: &Binding, index: u32) -> View<'a> {
        if index >= binding.count {
            return View::EMPTY;
        }
        match self.resources.buffers.get((binding.slot + index) as usize) {
            Some(Some(range)) => View::of(range),
            _ => View::EMPTY,
        }
    }

    /// Where lanes 16 `chunk`.. access. Lanes outside `lanes` may get any place.
    fn places(&self, address: &Address, chunk: usize, lanes: u16) -> Places<'a> {
        let offset = u64::from(address.offset);
        if address.space == Space::Global {
            return self.global_places(address, chunk, lanes);
        }
        let addresses = match address.base {
            Some(base) => self
                .file
                .lanes::<u32>(self.slot(base), chunk)
                .map(|base| u64::from(base) + offset),
            None => [offset; CHUNK_LANES],
        };
        let view = match &address.space {
            Space::Buffer(binding) => match binding.index {
                None => Ok(self.buffer(binding, 0)),
                Some(index) => {
                    let slot = self.slot(index);
                    let indices = self.file.lanes::<u32>(slot, chunk);
                    if slot.is_varying() {
                        Err(Box::new(indices.map(|index| self.buffer(binding, index))))
                    } else {
                        Ok(self.buffer(binding, indices[0]))
                    }
                }
            },
            space => Ok(self.common_view(space).unwrap_or(View::EMPTY)),
        };
        Places { view, addresses }
    }

    fn global_places(&self, address: &Address, chunk: usize, lanes: u16) -> Places<'a> {
        let mut places = Places {
            view: Ok(View::EMPTY),
            addresses: [0; CHUNK_LANES],
        };
        let Some(base) = address.base else {
            return places;
        };
        let bases = self.file.lanes::<u64>(self.slot(base), chunk);
        let mut views = [View::EMPTY; CHUNK_LANES];
        for lane in lanes_of(lanes) {
            let target = bases[lane].wrapping_add(u64::from(address.offset));
            if let Some((range, start)) = self.resources.global.find(target) {
                views[lane] = View::of(range);
                places.addresses[lane] = target.wrapping_sub(start).min(u64::from(u32::MAX));
            }
        }
        places.view = Err(Box::new(views));
        places
    }

    /// Sets one lane-chunk of a loaded register.
    fn put(&self, dst: Slot, format: Format, chunk: usize, values: [u64; CHUNK_LANES]) {
        if format == Format::B64 {
            self.file.set(dst, chunk, values);
        } else {
            self.file
                .set(dst, chunk, each_lane(values, |value| value as u32));
        }
    }

    /// One lane-chunk of a register to store.
    pub(super) fn take(&self, src: Slot, format: Format, chunk: usize) -> [u64; CHUNK_LANES] {
        if format == Format::B64 {
            self.file.lanes(src, chunk)
        } else {
            each_lane(self.file.lanes::<u32>(src, chunk), u64::from)
        }
    }

    /// The memory that all lanes access, if it's one memory of words.
    #[inline(always)]
    pub(super) fn common_view(&self, space: &Space) -> Option<View<'a>> {
        match space {
            Space::Buffer(binding) => match binding.index.map(|index| self.slot(index)) {
                None => Some(self.buffer(binding, 0)),
                Some(index) if index.is_varying() => None,
                Some(index) => Some(self.buffer(binding, self.file.first(index))),
            },
            Space::PushConstants => Some(View {
                words: self.resources.push_constants,
                bytes: u32::MAX,
                range: None,
            }),
            Space::Shared => Some(View {
                words: self.shared,
                bytes: self.executable.shared_bytes,
                range: None,
            }),
            Space::Private => self.executable.table.as_deref().map(|words| View {
                words,
                bytes: self.executable.private_bytes,
                range: None,
            }),
            Space::Global => None,
        }
    }

    pub fn load<S: Simd>(&self, simd: S, dst: &[Reg], address: &Address, format: Format) {
        let view = self.common_view(&address.space);
        // Registers of one load are uniform together.
        let uniform = dst.iter().any(|reg| !self.slot(*reg).is_varying());
        match view {
            Some(view) if uniform => self.load_uniform_from(view, dst, address, format),
            Some(view) if format == Format::B32 => self.load_words(simd, view, dst, address),
            None if address.space == Space::Private => self.load_private(dst, address, format),
            _ if uniform => self.load_uniform(dst, address, format),
            _ => self
                .file
                .span()
                .for_each(|chunk| self.load_chunk(dst, address, format, chunk)),
        }
    }

    /// Loads 16 lanes, one by one.
    pub(super) fn load_chunk(&self, dst: &[Reg], address: &Address, format: Format, chunk: usize) {
        let lanes = self.masks.chunk(MaskId::ACTIVE, chunk);
        if lanes == 0 {
            return;
        }
        let places = self.places(address, chunk, lanes);
        for (element, reg) in dst.iter().enumerate() {
            let step = element as u64 * u64::from(format.bytes());
            let mut values = [0; CHUNK_LANES];
            for lane in lanes_of(lanes) {
                values[lane] = places
                    .view(lane)
                    .load(places.addresses[lane] + step, format)
                    .unwrap_or(0);
            }
            self.put(self.slot(*reg), format, chunk, values);
        }
    }

    /// Loads what is the same in all lanes.
    fn load_uniform_from(&self, view: View<'_>, dst: &[Reg], address: &Address, format: Format) {
        let base = address
            .base
            .map_or(0, |base| self.file.first::<u32>(self.slot(base)));
        let mut at = u64::from(base) + u64::from(address.offset);
        for reg in dst {
            let value = view.load(at, format).unwrap_or(0);
            if format == Format::B64 {
                self.file.set(self.slot(*reg), 0, [value; CHUNK_LANES]);
            } else {
                self.file
                    .set(self.slot(*reg), 0, [value as u32; CHUNK_LANES]);
            }
            at += u64::from(format.bytes());
        }
    }

    fn load_uniform(&self, dst: &[Reg], address: &Address, format: Format) {
        let places = self.places(address, 0, 1);
        for (element, reg) in dst.iter().enumerate() {
            let step = element as u64 * u64::from(format.bytes());
            let value = places
                .view(0)
                .load(places.addresses[0] + step, format)
                .unwrap_or(0);
            self.put(self.slot(*reg), format, 0, [value; CHUNK_LANES]);
        }
    }

    pub fn store<S: Simd>(&self, simd: S, src: &[Reg], address: &Address, format: Format) {
        match self.common_view(&address.space) {
            Some(view) if format == Format::B32 => self.store_words(simd, view, src, address),
            None if address.space == Space::Private => self.store_private(src, address, format),
            _ => self
                .file
                .span()
                .for_each(|chunk| self.store_chunk(src, address, format, chunk)),
        }
    }

    /// Stores 16 lanes, one by one.
    pub(super) fn store_chunk(&self, src: &[Reg], address: &Address, format: Format, chunk: usize) {
        let lanes = self.masks.writing(chunk);
        if lanes == 0 {
            return;
        }
        let places = self.places(address, chunk, lanes);
        for (element, reg) in src.iter().enumerate() {
            let step = element as u64 * u64::from(format.bytes());
            let values = self.take(self.slot(*reg), format, chunk);
            for lane in lanes_of(lanes) {
                places
                    .view(lane)
                    .store(places.addresses[lane] + step, format, values[lane]);
            }
        }
    }

    #[allow(clippy::too_many_arguments, reason = "the statement has as many")]
    pub fn atomic<S: Simd>(
        &self,
        simd: S,
        op: AtomicOp,
        dst: Option<Reg>,
        address: &Address,
        format: Format,
        value: Reg,
        comparator: Option<Reg>,
    ) {
        for chunk in self.file.span() {
            let lanes = self.masks.writing(chunk);
            let mut old = [0; CHUNK_LANES];
            if lanes != 0 {
                let values = self.take(self.slot(value), format, chunk);
                let comparators = comparator.map_or([0; CHUNK_LANES], |reg| {
                    self.take(self.slot(reg), format, chunk)
                });
                let at_once = (format == Format::B32).then(|| {
                    let [values, comparators] =
                        [values, comparators].map(|lanes| each_lane(lanes, |lane| lane as u32));
                    self.atomic_words(simd, op, address, chunk, &values, &comparators)
                });
                old = match at_once.flatten() {
                    Some(old) => each_lane(old, u64::from),
                    None => {
                        let change =
                            |lane, old| combine(op, format, old, values[lane], comparators[lane]);
                        self.atomic_chunk(address, format, chunk, lanes, change)
                    }
                };
            }
            if let Some(dst) = dst {
                self.put(self.slot(dst), format, chunk, old);
            }
        }
    }

    /// Atomic operations of 16 lanes, one by one. Gives the old values.
    fn atomic_chunk(
        &self,
        address: &Address,
        format: Format,
        chunk: usize,
        lanes: u16,
        change: impl Fn(usize, u64) -> u64,
    ) -> [u64; CHUNK_LANES] {
        let mut old = [0; CHUNK_LANES];
        let places = self.places(address, chunk, lanes);
        for lane in lanes_of(lanes) {
            let (view, at) = (places.view(lane), places.addresses[lane]);
            old[lane] = update(view, at, format, |old| change(lane, old)).unwrap_or(0);
        }
        old
    }

    pub fn buffer_size(&self, dst: Reg, buffer: &Binding) {
        let slot = self.slot(dst);
        for chunk in self.file.rounds(slot) {
            let sizes = match buffer.index {
                None => [self.buffer(buffer, 0).bytes; CHUNK_LANES],
                Some(index) => self
                    .file
                    .lanes::<u32>(self.slot(index), chunk)
                    .map(|index| self.buffer(buffer, index).bytes),
            };
            self.file.set(slot, chunk, sizes);
        }
    }
}

/// Changes an element atomically, if it is aligned and within; returns what was there.
fn update(
    view: View<'_>,
    address: u64,
    format: Format,
    change: impl Fn(u64) -> u64,
) -> Option<u64> {
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

/// The new value of an atomic operation.
pub fn combine(op: AtomicOp, format: Format, old: u64, value: u64, comparator: u64) -> u64 {
    if format == Format::B64 {
        let (signed_old, signed) = (old.cast_signed(), value.cast_signed());
        let (float_old, float) = (f64::from_bits(old), f64::from_bits(value));
        return match op {
            AtomicOp::IAdd => old.wrapping_add(value),
            AtomicOp::SMin => signed_old.min(signed).cast_unsigned(),
            AtomicOp::SMax => signed_old.max(signed).cast_unsigned(),
            AtomicOp::UMin => old.min(value),
            AtomicOp::UMax => old.max(value),
            AtomicOp::And => old & value,
            AtomicOp::Or => old | value,
            AtomicOp::Xor => old ^ value,
            AtomicOp::Exchange => value,
            AtomicOp::CompareExchange => {
                if old == comparator {
                    value
                } else {
                    old
                }
            }
            AtomicOp::FAdd => (float_old + float).to_bits(),
            AtomicOp::FMin => float_old.min(float).to_bits(),
            AtomicOp::FMax => float_old.max(float).to_bits(),
        };
    }
    let (old, value) = (old as u32, value as u32);
    let (signed_old, signed) = (old.cast_signed(), value.cast_signed());
    let (float_old, float) = (f32::from_bits(old), f32::from_bits(value));
    u64::from(match op {
        AtomicOp::IAdd => old.wrapping_add(value),
        AtomicOp::SMin => signed_old.min(signed).cast_unsigned(),
        AtomicOp::SMax => signed_old.max(signed).cast_unsigned(),
        AtomicOp::UMin => old.min(value),
        AtomicOp::UMax => old.max(value),
        AtomicOp::And => old & value,
        AtomicOp::Or => old | value,
        AtomicOp::Xor => old ^ value,
        AtomicOp::Exchange => value,
        AtomicOp::CompareExchange => {
            if old == comparator as u32 {
                value
            } else {
                old
            }
        }
        AtomicOp::FAdd => (float_old + float).to_bits(),
        AtomicOp::FMin => float_old.min(float).to_bits(),
        AtomicOp::FMax => float_old.max(float).to_bits(),
    })
}
