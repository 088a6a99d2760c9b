//! All techniques on a view, and the stored counts of the views that the page compares.

use super::axis_sharing::Sharing;
use super::conditional::Conditional;
use super::order_reuse::ReuseFigures;
use super::quad_merging::{Merging, MergingCounter};
use super::row_transform::RowWork;
use super::scaling::Scaling;
use super::shape_tests::{ChunkSorting, ShapeTests};
use super::tile::{View, composite};
use serde::{Deserialize, Serialize};
use timing::config::ConfigError;
use timing::work::{DrawWork, FrameWork, Mode};

/// The counts of a scene's view and of a path that begins there.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SceneWork {
    /// The scene's name.
    pub scene: String,
    /// Width and height of the picture in pixels.
    pub size: [u32; 2],
    /// Gaussians of the scene.
    pub gaussians: u64,
    /// The degree of its spherical harmonics.
    pub degree: u32,
    /// Gaussians that the device drew.
    pub drawn: u64,
    /// Pairs of a tile and a Gaussian in the device's trace, and those that were fetched.
    pub trace_pairs: [u64; 2],
    /// Pairs of the 3-sigma squares in the trace.
    pub trace_squares: u64,
    /// Fragments that changed a pixel in the trace.
    pub trace_contributions: u64,
    /// Fragments and quads.
    pub merging: Merging,
    /// Pixels, columns and rows of evaluations.
    pub sharing: Sharing,
    /// Pairs by shape.
    pub shape_tests: ShapeTests,
    /// Entries that are sorted.
    pub chunk_sorting: ChunkSorting,
    /// Rows of evaluations.
    pub row_work: RowWork,
    /// Gaussians that are fetched.
    pub conditional: Conditional,
    /// Times with more rasterizers.
    pub scaling: Scaling,
    /// Lists along a path, for several steps.
    pub reuse: Vec<ReuseFigures>,
}

/// The stored counts.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Stored {
    /// The command that measures them.
    pub command: String,
    /// The scenes.
    pub scenes: Vec<SceneWork>,
}

impl Stored {
    /// The counts in the repository.
    ///
    /// # Errors
    /// Returns an error if the file does not have them.
    pub fn load() -> serde_json::Result<Self> {
        serde_json::from_str(include_str!("../../rival_work.json"))
    }
}

/// The first draw of Gaussians of a frame.
fn gaussian_draw(frame: &FrameWork) -> Option<&DrawWork> {
    frame.draws.iter().find(|draw| draw.mode == Mode::Gaussian)
}

/// Measures a view by its projected Gaussians and by the trace of the device that drew it. None if the trace has no
/// Gaussians or no ids. The name, the degree and the path are the caller's.
///
/// # Errors
/// Returns a [`ConfigError`] if a preset can't be read.
pub fn measure(view: &View, frame: &FrameWork) -> Result<Option<SceneWork>, ConfigError> {
    let Some((draw, conditional)) = gaussian_draw(frame).and_then(|draw| Some((draw, Conditional::of(draw)?))) else {
        return Ok(None);
    };
    let mut counter = MergingCounter::default();
    let (mut sharing, mut row_work) = (Sharing::default(), RowWork::default());
    for list in view.exact_lists() {
        composite(view, &list, |pair| {
            counter.add(pair);
            sharing.add(pair);
            row_work.add(pair);
        });
        counter.end_tile();
    }
    Ok(Some(SceneWork {
        size: view.size,
        gaussians: draw.primitives,
        drawn: draw.drawn,
        trace_pairs: [draw.pairs(), draw.needed_pairs()],
        trace_squares: draw.boxed_pairs,
        trace_contributions: draw.tiles.iter().map(|tile| tile.contributions).sum(),
        merging: counter.merging(),
        sharing,
        shape_tests: ShapeTests::of(view),
        chunk_sorting: ChunkSorting::of(draw),
        row_work,
        conditional,
        scaling: Scaling::of(frame)?,
        ..SceneWork::default()
    }))
}

#[cfg(test)]
mod tests {
    use super::super::footprint::Footprint;
    use super::*;
    use timing::work::TileWork;

    #[test]
    fn a_view_is_counted_once_and_needs_ids() {
        let opaque = Footprint { id: 0, mean: [8.0; 2], covariance: [1e6, 0.0, 1e6], opacity: 1.0 };
        let view = View { size: [16, 16], footprints: vec![opaque; 5] };
        let mut tile = TileWork::open([0, 0], 5);
        tile.runs[0].primitives = 3;
        let draw = DrawWork { primitives: 9, drawn: 5, tiles: vec![tile], ..DrawWork::default() };
        let mut frame = FrameWork { size: view.size, draws: vec![draw], ..FrameWork::default() };
        assert_eq!(measure(&view, &frame).unwrap(), None);
        frame.draws[0].tiles[0].ids = (0..5).collect();
        let work = measure(&view, &frame).unwrap().unwrap();
        assert_eq!((work.gaussians, work.drawn, work.trace_pairs), (9, 5, [5, 3]));
        // Three layers finish the tile.
        assert_eq!((work.merging.fragments, work.merging.open_fragments), (5 * 256, 3 * 256));
        assert_eq!((work.sharing.pairs, work.row_work.rows), (3, 3 * 16));
        assert_eq!((work.conditional.listed, work.conditional.fetched), (5, 3));
    }
}
