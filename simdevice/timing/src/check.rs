//! Checks of a trace: no device makes one whose numbers contradict each other.

use crate::work::{DrawWork, FrameWork, Mode, Run, ShaderWork, TILE_GROUPS, TILE_PIXELS, TILE_SIDE, TRACE_VERSION};
use crate::work::{TileWork, Trace};
use std::collections::HashSet;

/// The most pairs of a tile and a primitive, and the most tiles of a draw, in a frame of a trace: 19 times as many as
/// the paper's largest scene has.
pub const MAX_PAIRS: u64 = 1 << 28;

/// The greatest width and height of a picture in pixels.
const MAX_SIDE: u32 = 1 << 24;

/// The reason that a trace can't be one of a device.
#[derive(Debug, PartialEq, thiserror::Error)]
pub enum TraceError {
    /// The layout has another version.
    #[error("version {0}; only traces of version {TRACE_VERSION} can be read")]
    Version(u32),
    /// The frame has more pairs than can be simulated in reasonable time.
    #[error("frame {frame} has {pairs} pairs of a tile and a primitive; it must be at most {MAX_PAIRS}")]
    TooLarge {
        /// The frame, from 0.
        frame: usize,
        /// Its pairs.
        pairs: u64,
    },
    /// A field of a frame contradicts others.
    #[error("frame {frame}, {}: {}", contradiction.field, contradiction.reason)]
    Frame {
        /// The frame, from 0.
        frame: usize,
        /// The contradiction.
        contradiction: Contradiction,
    },
    /// A field of a draw contradicts others.
    #[error("frame {frame}, draw {draw}, {}: {}", contradiction.field, contradiction.reason)]
    Draw {
        /// The frame, from 0.
        frame: usize,
        /// The draw, from 0.
        draw: usize,
        /// The contradiction.
        contradiction: Contradiction,
    },
    /// A field of a tile contradicts others.
    #[error("frame {frame}, draw {draw}, tile {at:?}, {}: {}", contradiction.field, contradiction.reason)]
    Tile {
        /// The frame, from 0.
        frame: usize,
        /// The draw, from 0.
        draw: usize,
        /// Column and row of the tile.
        at: [u32; 2],
        /// The contradiction.
        contradiction: Contradiction,
    },
}

/// A field, and the reason that no device writes its number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Contradiction {
    /// The field's name in JSON.
    pub field: &'static str,
    /// The reason.
    pub reason: &'static str,
}

/// Returns a contradiction unless something holds.
fn holds(it: bool, field: &'static str, reason: &'static str) -> Result<(), Contradiction> {
    if it { Ok(()) } else { Err(Contradiction { field, reason }) }
}

fn work_is_valid(work: &ShaderWork, field: &'static str) -> Result<(), Contradiction> {
    holds(work.is_valid(), field, "a count is negative, too large or no number")
}

/// Checks a trace read from a file.
///
/// # Errors
/// Returns a [`TraceError`] that names the first problem.
pub fn check(trace: &Trace) -> Result<(), TraceError> {
    if trace.version != TRACE_VERSION {
        return Err(TraceError::Version(trace.version));
    }
    for (number, frame) in trace.frames.iter().enumerate() {
        check_frame(frame, number)?;
    }
    Ok(())
}

fn check_frame(frame: &FrameWork, index: usize) -> Result<(), TraceError> {
    let squares = |draw: &DrawWork| draw.boxed_pairs.max(draw.pairs());
    let pairs = frame.draws.iter().map(squares).fold(0, u64::saturating_add);
    if pairs > MAX_PAIRS {
        return Err(TraceError::TooLarge { frame: index, pairs });
    }
    frame_fields(frame).map_err(|contradiction| TraceError::Frame { frame: index, contradiction })?;
    for (number, draw) in frame.draws.iter().enumerate() {
        draw_fields(draw).map_err(|contradiction| TraceError::Draw { frame: index, draw: number, contradiction })?;
        let mut places = HashSet::with_capacity(draw.tiles.len());
        for tile in &draw.tiles {
            let is_new = places.insert((tile.at, tile.layer));
            let checked = holds(is_new, "at", "the draw has the tile twice in a layer");
            let checked = checked.and_then(|()| tile_fields(tile, frame.size, draw.mode));
            let at = tile.at;
            checked.map_err(|contradiction| TraceError::Tile { frame: index, draw: number, at, contradiction })?;
        }
    }
    Ok(())
}

fn frame_fields(frame: &FrameWork) -> Result<(), Contradiction> {
    let has_tiles = frame.draws.iter().any(|draw| !draw.tiles.is_empty());
    let is_empty = frame.size.contains(&0);
    holds(!(has_tiles && is_empty), "size", "the picture has no pixels, and draws have tiles")?;
    holds(frame.size.iter().all(|&side| side <= MAX_SIDE), "size", "a side has more than 16777216 pixels")?;
    work_is_valid(&frame.compute, "compute")
}

fn draw_fields(draw: &DrawWork) -> Result<(), Contradiction> {
    work_is_valid(&draw.preprocess, "preprocess")?;
    work_is_valid(&draw.sort, "sort")?;
    work_is_valid(&draw.shade, "shade")?;
    let known = draw.sized_pairs.windows(2).filter(|pair| pair.iter().all(|&count| count > 0));
    // A tile of the next size has four of the size before.
    let is_possible = |pair: &[u64]| pair[1] <= pair[0] && pair[0] <= pair[1].saturating_mul(4);
    let reason = "pairs must not grow with the side of a tile, nor shrink by more than four";
    holds(known.into_iter().all(is_possible), "sized_pairs", reason)?;
    if draw.mode == Mode::Triangle {
        // Clipping and programs make more primitives than the draw names.
        return Ok(());
    }
    holds(draw.drawn <= draw.primitives, "drawn", "more Gaussians are drawn than the draw names")?;
    holds(draw.drawn == 0 || !draw.tiles.is_empty(), "tiles", "Gaussians are drawn, and no tile has a list")?;
    let is_large = draw.boxed_pairs == 0 || draw.boxed_pairs >= draw.pairs();
    holds(is_large, "boxed_pairs", "there are fewer than the pairs of the lists")
}

/// Checks the fields of a tile in a picture of `size` pixels.
fn tile_fields(tile: &TileWork, size: [u32; 2], mode: Mode) -> Result<(), Contradiction> {
    let is_inside = tile.at.iter().zip(size).all(|(&at, side)| at < side.div_ceil(TILE_SIDE));
    holds(is_inside, "at", "the tile is outside of the picture")?;
    let needed = tile.runs.iter().map(|run| u64::from(run.primitives)).sum::<u64>();
    holds(needed <= tile.listed.into(), "runs.primitives", "the runs have more primitives than the list")?;
    tile.runs.iter().try_for_each(run_fields)?;
    if mode == Mode::Gaussian {
        let shrink = |pair: &[Run]| pair[1].rows <= pair[0].rows && pair[1].blocks <= pair[0].blocks;
        let reason = "finished rows or blocks become unfinished again";
        holds(tile.runs.windows(2).all(shrink), "runs.rows", reason)?;
    }
    holds(tile.terminated <= TILE_PIXELS, "terminated", "more pixels are finished than a tile has")?;
    let most = u64::from(tile.listed) * u64::from(TILE_PIXELS);
    holds(tile.contributions <= most, "contributions", "more pixels are changed than the primitives have")?;
    let is_whole = tile.ids.is_empty() || tile.ids.len() as u64 == u64::from(tile.listed);
    holds(is_whole, "ids", "there are not as many as the list has primitives")
}

fn run_fields(run: &Run) -> Result<(), Contradiction> {
    let groups = TILE_GROUPS as u8;
    holds(run.rows <= groups, "runs.rows", "a tile has 16 rows")?;
    holds(run.blocks <= groups, "runs.blocks", "a tile has 16 blocks")?;
    let agree = (run.rows == 0) == (run.blocks == 0);
    holds(agree, "runs.blocks", "a row is unfinished and no block, or a block and no row")?;
    let reached = u64::from(run.reached) + u64::from(run.hidden_blocks);
    let most = u64::from(run.primitives) * u64::from(TILE_GROUPS);
    holds(reached <= most, "runs.reached", "more blocks are reached than the primitives have")?;
    holds(run.hidden <= run.primitives, "runs.hidden", "more primitives are hidden than the run has")?;
    let waits = run.waits.unwrap_or_default();
    holds(waits.is_sorted(), "runs.waits", "a longer interval waits for less")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::work::INTERVALS;

    fn tile() -> TileWork {
        let run = |primitives, rows, blocks, reached| Run { primitives, rows, blocks, reached, ..Run::default() };
        TileWork {
            at: [3, 2],
            listed: 10,
            runs: vec![run(3, 16, 16, 20), run(4, 9, 7, 8)],
            contributions: 100,
            terminated: 256,
            ..TileWork::default()
        }
    }

    /// A trace of a draw with a tile, changed.
    fn changed(change: impl FnOnce(&mut FrameWork)) -> Result<(), TraceError> {
        let draw = DrawWork { primitives: 20, drawn: 10, tiles: vec![tile()], ..DrawWork::default() };
        let mut frame = FrameWork { size: [64, 48], draws: vec![draw], ..FrameWork::default() };
        change(&mut frame);
        check(&Trace { version: TRACE_VERSION, frames: vec![frame] })
    }

    /// The message for a changed trace.
    fn message(change: impl FnOnce(&mut FrameWork)) -> String {
        changed(change).map_or_else(|error| error.to_string(), |()| "accepted".to_owned())
    }

    #[test]
    fn what_no_device_does_is_refused_with_its_field() {
        assert_eq!(changed(|_| ()), Ok(()));
        let pairs = 4_000_000_000;
        let large = changed(|frame| frame.draws[0].tiles[0].listed = 4_000_000_000);
        assert_eq!(large, Err(TraceError::TooLarge { frame: 0, pairs }));
        type Change = fn(&mut TileWork);
        let wrong: [(&str, Change); 17] = [
            ("at", |tile| tile.at = [4, 0]),
            ("at", |tile| tile.at = [0, u32::MAX]),
            ("runs.primitives", |tile| tile.runs[0].primitives = 10),
            ("runs.rows", |tile| tile.runs[0].rows = 17),
            ("runs.blocks", |tile| tile.runs[0].blocks = 17),
            ("runs.blocks", |tile| tile.runs[1].blocks = 0),
            ("runs.blocks", |tile| tile.runs[1].rows = 0),
            ("runs.reached", |tile| tile.runs[1].reached = 65),
            ("runs.hidden", |tile| tile.runs[1].hidden = 5),
            ("runs.rows", |tile| tile.runs[0].rows = 8),
            ("runs.rows", |tile| tile.runs[0].blocks = 6),
            ("runs.waits", |tile| tile.runs[0].waits = Some(std::array::from_fn(|k| (INTERVALS - k) as u32))),
            ("terminated", |tile| tile.terminated = 257),
            ("contributions", |tile| tile.contributions = 10 * 256 + 1),
            ("contributions", |tile| tile.contributions = u64::MAX),
            ("ids", |tile| tile.ids = vec![1]),
            ("ids", |tile| tile.ids = vec![1; 11]),
        ];
        for (field, change) in wrong {
            let said = message(|frame| change(&mut frame.draws[0].tiles[0]));
            let place = said.starts_with("frame 0, draw 0, tile [");
            assert!(place && said.contains(&format!("], {field}: ")), "{field}: {said}");
        }
    }

    #[test]
    fn a_tile_may_be_there_once_in_a_layer() {
        let twice = |layer| move |frame: &mut FrameWork| frame.draws[0].tiles.push(TileWork { layer, ..tile() });
        assert_eq!(message(twice(0)), "frame 0, draw 0, tile [3, 2], at: the draw has the tile twice in a layer");
        assert_eq!(changed(twice(1)), Ok(()));
    }

    #[test]
    fn frames_and_draws_are_checked() {
        assert!(message(|frame| frame.size = [0, 0]).starts_with("frame 0, size: the picture has no pixels"));
        assert!(message(|frame| frame.size[0] = u32::MAX).starts_with("frame 0, size: a side"));
        type Change = fn(&mut DrawWork);
        let wrong: [(&str, Change); 4] = [
            ("drawn", |draw| draw.drawn = 21),
            ("drawn", |draw| draw.primitives = 0),
            ("tiles", |draw| draw.tiles.clear()),
            ("boxed_pairs", |draw| draw.boxed_pairs = 9),
        ];
        for (field, change) in wrong {
            let said = message(|frame| change(&mut frame.draws[0]));
            assert!(said.starts_with(&format!("frame 0, draw 0, {field}: ")), "{field}: {said}");
        }
        // Clipping makes more triangles than the draw names, and those outside are in no list.
        let triangles = |frame: &mut FrameWork| {
            let draw = &mut frame.draws[0];
            (draw.mode, draw.primitives) = (Mode::Triangle, 1);
        };
        assert_eq!(changed(triangles), Ok(()));
        let nowhere = |frame: &mut FrameWork| (frame.draws[0].drawn, frame.draws[0].tiles) = (0, Vec::new());
        assert_eq!(changed(nowhere), Ok(()));
    }

    #[test]
    fn boxes_that_no_primitives_have_are_refused() {
        for right in [[0; 4], [400, 100, 25, 25], [0, 7, 0, 9]] {
            assert_eq!(changed(|frame| frame.draws[0].sized_pairs = right), Ok(()), "{right:?}");
        }
        for wrong in [[401, 100, 25, 25], [u64::MAX, 1, 1, 1], [7, 8, 8, 8]] {
            let said = message(|frame| frame.draws[0].sized_pairs = wrong);
            assert!(said.starts_with("frame 0, draw 0, sized_pairs: "), "{wrong:?}: {said}");
        }
    }

    #[test]
    fn shader_work_that_is_no_number_is_refused() {
        for wrong in [f64::NAN, f64::INFINITY, -1.0, 1e18] {
            let work = ShaderWork { bytes: wrong, ..ShaderWork::default() };
            assert!(message(|frame| frame.compute = work).starts_with("frame 0, compute: "));
            assert!(message(|frame| frame.draws[0].shade = work).starts_with("frame 0, draw 0, shade: "));
        }
    }
}
