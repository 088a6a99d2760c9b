//! Private memory: of each lane. A word of it is a row of chunks, as a varying register is.

use super::super::ir::{Address, CHUNK_LANES, Format, Reg};
use super::batch::Batch;
use super::file::each_lane;
use super::mask::{MaskId, lanes_of};

/// A word that doesn't exist.
const NOWHERE: usize = usize::MAX;

/// The rows that 16 lanes access.
enum Rows {
    Same(usize),
    Each([usize; CHUNK_LANES]),
}

impl Batch<'_> {
    /// The row of private memory that a byte address means; [`NOWHERE`] if there is none.
    #[inline(always)]
    fn private_row(&self, address: u64) -> usize {
        if address.is_multiple_of(4) && address < u64::from(self.executable.private_bytes) {
            (address / 4) as usize * self.file.width()
        } else {
            NOWHERE
        }
    }

    /// The rows that 16 lanes access.
    #[inline(always)]
    fn private_rows(&self, address: &Address, step: u64, chunk: usize) -> Rows {
        let step = u64::from(address.offset) + step;
        match address.base.map(|base| self.slot(base)) {
            None => Rows::Same(self.private_row(step)),
            Some(base) if !base.is_varying() => {
                Rows::Same(self.private_row(u64::from(self.file.first::<u32>(base)) + step))
            }
            Some(base) => {
                let bases = self.file.lanes::<u32>(base, chunk);
                Rows::Each(each_lane(bases, |base| {
                    self.private_row(u64::from(base) + step)
                }))
            }
        }
    }

    /// One word of 16 lanes; zero where there is none.
    #[inline(always)]
    fn private_words(&self, address: &Address, step: u64, chunk: usize) -> [u32; CHUNK_LANES] {
        let word = |row: usize| self.private.get(row.wrapping_add(chunk));
        match self.private_rows(address, step, chunk) {
            Rows::Same(NOWHERE) => [0; CHUNK_LANES],
            Rows::Same(row) => word(row).map_or([0; CHUNK_LANES], |chunk| chunk.get().0),
            Rows::Each(rows) => {
                let mut values = [0; CHUNK_LANES];
                for (lane, row) in rows.into_iter().enumerate() {
                    if row != NOWHERE {
                        values[lane] = word(row).map_or(0, |chunk| chunk.get().0[lane]);
                    }
                }
                values
            }
        }
    }

    pub(super) fn load_private(&self, dst: &[Reg], address: &Address, format: Format) {
        for chunk in self.file.span() {
            for (element, reg) in dst.iter().enumerate() {
                let step = element as u64 * u64::from(format.bytes());
                let low = self.private_words(address, step, chunk);
                if format != Format::B64 {
                    self.file.set(self.slot(*reg), chunk, low);
                    continue;
                }
                let high = self.private_words(address, step + 4, chunk);
                let exists = self.second_exists(address, step, chunk);
                let values: [u64; CHUNK_LANES] = std::array::from_fn(|lane| {
                    if exists[lane] {
                        u64::from(low[lane]) | u64::from(high[lane]) << 32
                    } else {
                        0
                    }
                });
                self.file.set(self.slot(*reg), chunk, values);
            }
        }
    }

    /// Where the second word of a 64-bit element exists.
    fn second_exists(&self, address: &Address, step: u64, chunk: usize) -> [bool; CHUNK_LANES] {
        match self.private_rows(address, step + 4, chunk) {
            Rows::Same(row) => [row != NOWHERE; CHUNK_LANES],
            Rows::Each(rows) => rows.map(|row| row != NOWHERE),
        }
    }

    pub(super) fn store_private(&self, src: &[Reg], address: &Address, format: Format) {
        for chunk in self.file.span() {
            let lanes = self.masks.chunk(MaskId::ACTIVE, chunk);
            for (element, reg) in src.iter().enumerate() {
                let step = element as u64 * u64::from(format.bytes());
                if format == Format::B64 {
                    let values: [u64; CHUNK_LANES] = self.file.lanes(self.slot(*reg), chunk);
                    let exists = self.second_exists(address, step, chunk);
                    let whole = lanes_of(lanes).filter(|lane| exists[*lane]);
                    let lanes = whole.fold(0, |lanes, lane| lanes | 1 << lane);
                    let low = values.map(|value| value as u32);
                    let high = values.map(|value| (value >> 32) as u32);
                    self.set_private(address, step, chunk, lanes, low);
                    self.set_private(address, step + 4, chunk, lanes, high);
                } else {
                    let values = self.file.lanes(self.slot(*reg), chunk);
                    self.set_private(address, step, chunk, lanes, values);
                }
            }
        }
    }

    /// Sets one word in some of 16 lanes.
    #[inline(always)]
    fn set_private(
        &self,
        address: &Address,
        step: u64,
        chunk: usize,
        lanes: u16,
        values: [u32; CHUNK_LANES],
    ) {
        let word = |row: usize| self.private.get(row.wrapping_add(chunk));
        match self.private_rows(address, step, chunk) {
            Rows::Same(NOWHERE) => {}
            Rows::Same(row) => {
                if let Some(cell) = word(row) {
                    let mut chunk = cell.get();
                    for (lane, value) in values.into_iter().enumerate() {
                        if lanes >> lane & 1 != 0 {
                            chunk.0[lane] = value;
                        }
                    }
                    cell.set(chunk);
                }
            }
            Rows::Each(rows) => {
                for lane in lanes_of(lanes).filter(|lane| rows[*lane] != NOWHERE) {
                    if let Some(cell) = word(rows[lane]) {
                        let mut chunk = cell.get();
                        chunk.0[lane] = values[lane];
                        cell.set(chunk);
                    }
                }
            }
        }
    }
}
