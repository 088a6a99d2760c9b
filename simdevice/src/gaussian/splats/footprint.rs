//! Footprints: the tiles that a splat reaches.

use devmem::host;

/// A run of consecutive tiles in one row of tiles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct TileSpan {
    /// The first tile.
    pub first: u16,
    /// One past the last tile.
    pub end: u16,
}

impl TileSpan {
    /// The number of tiles.
    #[inline(always)]
    pub(crate) fn len(self) -> usize {
        usize::from(self.end.saturating_sub(self.first))
    }
}

/// The most rows of tiles whose spans a [`TileFootprint`] stores inline.
pub(crate) const HELD_ROWS: usize = 3;

/// The number of words of a [`TileFootprint`].
pub(crate) const FOOTPRINT_WORDS: usize = 1 + HELD_ROWS;

/// The tiles that a Gaussian reaches: a span for each of some consecutive rows of tiles. It is small, since most
/// Gaussians reach few tiles, and all of them are read in depth order.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct TileFootprint {
    /// The first row (low 16 bits) and the number of rows (high 16 bits), and then the packed spans of the rows, if they
    /// fit. Otherwise the second word is the index of the first row's span in the group's list of spans.
    words: [u32; FOOTPRINT_WORDS],
}

impl TileFootprint {
    /// A footprint of `rows` rows of tiles from `row` on, with empty spans. If they do not fit inline, `others` is
    /// extended by them.
    #[inline(always)]
    pub(crate) fn new(row: u16, rows: u16, others: &mut Vec<TileSpan>) -> Self {
        let mut words = [0; FOOTPRINT_WORDS];
        words[0] = u32::from(row) | u32::from(rows) << 16;
        if usize::from(rows) > HELD_ROWS {
            words[1] = others.len() as u32;
            let len = others.len() + usize::from(rows);
            host::resize(others, len, TileSpan::default());
        }
        Self { words }
    }

    /// The footprint as words, for storage: its rows, then its spans.
    #[inline(always)]
    pub(crate) fn words(&self) -> [u32; FOOTPRINT_WORDS] {
        self.words
    }

    /// The footprint that [`TileFootprint::words`] made these words of.
    #[inline(always)]
    pub(crate) fn from_words(words: [u32; FOOTPRINT_WORDS]) -> Self {
        Self { words }
    }

    /// The first row.
    #[inline(always)]
    fn row(&self) -> u32 {
        self.words[0] & 0xFFFF
    }

    /// The number of rows.
    #[inline(always)]
    fn len(&self) -> usize {
        (self.words[0] >> 16) as usize
    }

    /// Sets the span of its row `number`, counted from its first row.
    #[inline(always)]
    pub(crate) fn set(&mut self, others: &mut [TileSpan], number: u16, span: TileSpan) {
        let at = usize::from(number);
        if self.len() > HELD_ROWS {
            others[self.words[1] as usize + at] = span;
        } else {
            self.words[1 + at % HELD_ROWS] = PackedSpan::from(span).0;
        }
    }

    /// The rows of the footprint, each with its span, which may be empty.
    #[inline(always)]
    pub(crate) fn spans<'a>(&'a self, others: &'a [TileSpan]) -> impl Iterator<Item = (u32, TileSpan)> {
        (self.row()..).zip((0..self.len()).map(|number| self.span(others, number)))
    }

    /// The span of its row `number`, counted from its first row.
    #[inline(always)]
    fn span(&self, others: &[TileSpan], number: usize) -> TileSpan {
        if self.len() > HELD_ROWS {
            others[self.words[1] as usize + number]
        } else {
            PackedSpan(self.words[1 + number]).into()
        }
    }

    /// True if the footprint has this tile.
    #[inline(always)]
    pub(crate) fn covers(&self, others: &[TileSpan], column: u32, row: u32) -> bool {
        let number = row.wrapping_sub(self.row()) as usize;
        if number >= self.len() {
            return false;
        }
        let span = self.span(others, number);
        (u32::from(span.first)..u32::from(span.end)).contains(&column)
    }

    /// The first row and the inline spans, always [`HELD_ROWS`] of them: those beyond the footprint's rows are empty.
    /// `None` if the spans are in the group's list.
    #[inline(always)]
    pub(crate) fn held(&self) -> Option<(u32, [PackedSpan; HELD_ROWS])> {
        let [_, held @ ..] = self.words;
        (self.len() <= HELD_ROWS).then(|| (self.row(), held.map(PackedSpan)))
    }
}

/// The bits of a [`PackedSpan`] that hold its first tile. A row has at most 4096 tiles.
pub(crate) const FIRST_TILE_BITS: u32 = 19;

/// A span as a number: its first tile in the low [`FIRST_TILE_BITS`] bits, the number of its tiles in the others. If
/// a number is added to it, the first tile moves on by as much, as long as it fits into its bits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct PackedSpan(u32);

impl From<TileSpan> for PackedSpan {
    #[inline(always)]
    fn from(span: TileSpan) -> Self {
        Self(u32::from(span.first) | (span.len() as u32) << FIRST_TILE_BITS)
    }
}

impl From<PackedSpan> for TileSpan {
    #[inline(always)]
    fn from(span: PackedSpan) -> Self {
        let [first, end] = span.tiles();
        Self { first: first as u16, end: end as u16 }
    }
}

impl PackedSpan {
    /// The span that these bits encode.
    #[inline(always)]
    pub(crate) fn from_bits(bits: u32) -> Self {
        Self(bits)
    }

    /// The number of tiles.
    #[inline(always)]
    pub(crate) fn len(self) -> u32 {
        self.0 >> FIRST_TILE_BITS
    }

    /// True if it has no tiles.
    #[inline(always)]
    pub(crate) fn is_empty(self) -> bool {
        self.len() == 0
    }

    /// The span whose tiles have numbers that are greater by `tiles`. The sum must fit into [`FIRST_TILE_BITS`] bits,
    /// unless the span has no tiles.
    #[inline(always)]
    pub(crate) fn moved_by(self, tiles: u32) -> Self {
        Self(self.0.wrapping_add(tiles))
    }

    /// The first tile, and one past the last.
    #[inline(always)]
    pub(crate) fn tiles(self) -> [u32; 2] {
        let first = self.0 & ((1 << FIRST_TILE_BITS) - 1);
        [first, first + self.len()]
    }
}
