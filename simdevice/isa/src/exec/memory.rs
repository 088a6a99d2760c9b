//! Loads, stores and atomics: every one bounds-checked by an index into a slice of atomic words.

use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

use super::super::ir::{Address, AtomicOp, Binding, CHUNK_LANES, Format, Reg, Space};
use super::super::resources::{load_word, range_words};
use super::batch::Batch;
use super::file::Slot;
use super::mask::{MaskId, lanes_of};
use devmem::BufferRange;

/// Memory that an access goes to: words, and how many bytes of them count.
#[derive(Clone, Copy)]
struct View<'a> {
    words: &'a [AtomicU32],
    bytes: u32,
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
            Space::PushConstants => Ok(View {
                words: self.resources.push_constants,
                bytes: u32::MAX,
                range: None,
            }),
            _ => Ok(View {
                words: self.shared,
                bytes: self.executable.shared_bytes,
                range: None,
            }),
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
            self.file.set(dst, chunk, values.map(|value| value as u32));
        }
    }

    /// One lane-chunk of a register to store.
    fn take(&self, src: Slot, format: Format, chunk: usize) -> [u64; CHUNK_LANES] {
        if format == Format::B64 {
            self.file.lanes(src, chunk)
        } else {
            self.file.lanes::<u32>(src, chunk).map(u64::from)
        }
    }

    pub fn load(&self, dst: &[Reg], address: &Address, format: Format) {
        if address.space == Space::Private {
            return self.load_private(dst, address, format);
        }
        // Registers of one load are uniform together.
        if dst.iter().any(|reg| !self.slot(*reg).is_varying()) {
            return self.load_uniform(dst, address, format);
        }
        for chunk in 0..self.file.width() {
            let lanes = self.masks.chunk(MaskId::ACTIVE, chunk);
            if lanes == 0 {
                continue;
            }
            let places = self.places(address, chunk, lanes);
            if lanes == u16::MAX
                && format == Format::B32
                && self.load_consecutive(dst, chunk, &places)
            {
                continue;
            }
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

    /// Loads 16 lanes whose elements follow one another in memory, all within it. False if they don't.
    fn load_consecutive(&self, dst: &[Reg], chunk: usize, places: &Places<'_>) -> bool {
        let Ok(view) = places.view else { return false };
        let count = dst.len();
        let first = places.addresses[0];
        let stride = 4 * count as u64;
        let mut follows = first.is_multiple_of(4);
        for (lane, address) in places.addresses.iter().enumerate() {
            follows &= *address == first + lane as u64 * stride;
        }
        if !follows || first + stride * CHUNK_LANES as u64 > u64::from(view.bytes) {
            return false;
        }
        let start = (first / 4) as usize;
        let Some(words) = view.words.get(start..start + count * CHUNK_LANES) else {
            return false;
        };
        for (element, reg) in dst.iter().enumerate() {
            let values = std::array::from_fn(|lane| words[lane * count + element].load(Relaxed));
            self.file.set::<u32>(self.slot(*reg), chunk, values);
        }
        true
    }

    pub fn store(&self, src: &[Reg], address: &Address, format: Format) {
        if address.space == Space::Private {
            return self.store_private(src, address, format);
        }
        for chunk in 0..self.file.width() {
            let lanes = self.masks.writing(chunk);
            if lanes == 0 {
                continue;
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
    }

    pub fn atomic(
        &self,
        op: AtomicOp,
        dst: Option<Reg>,
        address: &Address,
        format: Format,
        value: Reg,
        comparator: Option<Reg>,
    ) {
        for chunk in 0..self.file.width() {
            let lanes = self.masks.writing(chunk);
            let mut old = [0; CHUNK_LANES];
            if lanes != 0 {
                let places = self.places(address, chunk, lanes);
                let values = self.take(self.slot(value), format, chunk);
                let comparators = comparator.map_or([0; CHUNK_LANES], |reg| {
                    self.take(self.slot(reg), format, chunk)
                });
                for lane in lanes_of(lanes) {
                    let (view, at) = (places.view(lane), places.addresses[lane]);
                    let change =
                        |old: u64| combine(op, format, old, values[lane], comparators[lane]);
                    old[lane] = update(view, at, format, change).unwrap_or(0);
                }
            }
            if let Some(dst) = dst {
                self.put(self.slot(dst), format, chunk, old);
            }
        }
    }

    pub fn buffer_size(&self, dst: Reg, buffer: &Binding) {
        let slot = self.slot(dst);
        let rounds = if slot.is_varying() {
            self.file.width()
        } else {
            1
        };
        for chunk in 0..rounds {
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

    /// The word of private memory that each of 16 lanes accesses, if it exists.
    fn private_words(
        &self,
        address: &Address,
        element: usize,
        format: Format,
        chunk: usize,
    ) -> [u64; CHUNK_LANES] {
        let step = u64::from(address.offset) + element as u64 * u64::from(format.bytes());
        let bases = address.base.map_or([0; CHUNK_LANES], |base| {
            self.file.lanes::<u32>(self.slot(base), chunk)
        });
        bases.map(|base| {
            let address = u64::from(base) + step;
            if address.is_multiple_of(4) {
                address / 4
            } else {
                u64::MAX / 2
            }
        })
    }

    fn private_word(&self, word: u64, chunk: usize, lane: usize) -> Option<u32> {
        let row = usize::try_from(word).ok()?.checked_mul(self.file.width())?;
        self.private
            .get(row.checked_add(chunk)?)
            .map(|chunk| chunk.get().0[lane])
    }

    fn set_private_word(&self, word: u64, chunk: usize, lane: usize, value: u32) {
        let row = usize::try_from(word)
            .ok()
            .and_then(|word| word.checked_mul(self.file.width()));
        if let Some(cell) = row.and_then(|row| self.private.get(row.checked_add(chunk)?)) {
            let mut lanes = cell.get();
            lanes.0[lane] = value;
            cell.set(lanes);
        }
    }

    fn load_private(&self, dst: &[Reg], address: &Address, format: Format) {
        for chunk in 0..self.file.width() {
            for (element, reg) in dst.iter().enumerate() {
                let words = self.private_words(address, element, format, chunk);
                let low: [u32; CHUNK_LANES] = std::array::from_fn(|lane| {
                    self.private_word(words[lane], chunk, lane).unwrap_or(0)
                });
                if format == Format::B64 {
                    let values: [u64; CHUNK_LANES] = std::array::from_fn(|lane| {
                        self.private_word(words[lane] + 1, chunk, lane)
                            .map_or(0, |high| u64::from(low[lane]) | u64::from(high) << 32)
                    });
                    self.file.set(self.slot(*reg), chunk, values);
                } else {
                    self.file.set(self.slot(*reg), chunk, low);
                }
            }
        }
    }

    fn store_private(&self, src: &[Reg], address: &Address, format: Format) {
        for chunk in 0..self.file.width() {
            let lanes = self.masks.chunk(MaskId::ACTIVE, chunk);
            for (element, reg) in src.iter().enumerate() {
                let words = self.private_words(address, element, format, chunk);
                let values = self.take(self.slot(*reg), format, chunk);
                for lane in lanes_of(lanes) {
                    if format == Format::B64
                        && self.private_word(words[lane] + 1, chunk, lane).is_none()
                    {
                        continue;
                    }
                    self.set_private_word(words[lane], chunk, lane, values[lane] as u32);
                    if format == Format::B64 {
                        self.set_private_word(
                            words[lane] + 1,
                            chunk,
                            lane,
                            (values[lane] >> 32) as u32,
                        );
                    }
                }
            }
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
