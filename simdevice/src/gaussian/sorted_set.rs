//! Sorted sets: the result of preprocessing, sorting and binning Gaussians, and the input of the tile engine.

use super::bin::tile_lists::TileLists;
use super::set::GaussianSet;
use super::splats::group::ProjectedGroup;
use super::splats::identity::{Identity, Origins};
use super::splats::ray_depth::{PixelRays, RayDepth, RayDepths};
use super::splats::splat::Splat;
use super::splats::surfel::Surfel;
use super::view::camera::period;
use super::view::center_depth::DepthTrend;
use super::view::cut_off::list_cut_off;
use crate::format::depth::DepthEncoding;
use crate::packet::GaussianFragmentStage;
use crate::runtime::Runtime;
use crate::state::Rect;
use crate::state::gaussian::{Camera, GaussianOrder, GaussianState};
use crate::stats::counters::Counters;
use crate::stats::optimizations::Optimizations;
use crate::stats::recorder::DrawRecord;
use devmem::host;
use rayon::prelude::*;
use std::sync::Arc;

/// The least number of groups per task, where little is done for each group.
const LEAST_GROUPS: usize = 64;

/// A set after projection, sort and binning. Rasterization does not change it.
#[derive(Debug)]
pub(crate) struct SortedSet {
    /// The splats by group; see [`SplatIndex`](super::splats::splat::SplatIndex).
    pub(crate) splats: Vec<Vec<Splat>>,
    pub(crate) tiles: TileLists,
    /// The 2D Gaussians by group, in the order of the splats, if the set has them.
    pub(crate) surfels: Option<Vec<Vec<Surfel>>>,
    /// The coefficients of depths along rays by group, in the order of the splats, if the order is per pixel.
    pub(crate) ray_depths: Option<Vec<Vec<RayDepth>>>,
    /// By group, as the splats, if a fragment program reads which they are.
    pub(crate) identities: Option<Vec<Vec<Identity>>>,
    /// The counts of the set's Gaussians, by their fate.
    pub(crate) counters: Counters,
}

/// A set that is sorted, binned and immutable, with the state to draw it.
#[derive(Debug)]
pub struct BinnedDraw {
    /// The fixed state of the pipeline.
    pub state: Arc<GaussianState>,
    /// The pixels that it may touch.
    pub bounds: Rect,
    /// The layer that it is drawn to.
    pub(crate) layer: u32,
    pub(crate) sorted: Arc<SortedSet>,
    /// The optimizations that are enabled in its tiles.
    pub(crate) optimizations: Optimizations,
    /// The fragment program that computes colours, if there is one.
    pub(crate) fragment_stage: Option<GaussianFragmentStage>,
    /// The encoding of depths.
    pub(crate) depth_unit: DepthEncoding,
    /// The trend of depths along a tile's list.
    pub(crate) depth_trend: DepthTrend,
    /// Half the number of pixels after which the picture repeats, or infinity.
    pub(crate) half_period: f64,
    /// The pixels' rays.
    rays: PixelRays,
    /// The camera that it is seen by, if the device projects.
    pub(crate) camera: Camera,
    /// The upper left corner of the viewport's area, in pixels.
    pub(crate) viewport_corner: [f64; 2],
    /// True if the lists of tiles already apply the cut-off.
    pub(crate) are_lists_cut: bool,
    /// The draws of the set, if a fragment program reads which Gaussians there are.
    pub(crate) origins: Option<Origins>,
    /// The record of its tiles' work, if one is kept.
    pub(crate) record: Option<Arc<DrawRecord>>,
    /// True if the record has the ids of lists: those of a program's trace, and not those of queries.
    pub(crate) keeps_ids: bool,
}

impl SortedSet {
    /// The sorted set of the groups of `set`, whose lists are `tiles`. Its counters are zero.
    pub(crate) fn new(set: &GaussianSet, groups: Vec<ProjectedGroup>, tiles: TileLists) -> Self {
        let mut splats = host::with_capacity(groups.len());
        let mut others = host::with_capacity(groups.len());
        // The groups' other data are freed here. With many groups that takes time.
        groups
            .into_par_iter()
            .with_min_len(LEAST_GROUPS)
            .map(|group| {
                let more = (group.surfels, group.ray_depths, group.identities);
                (group.splats, more)
            })
            .unzip_into_vecs(&mut splats, &mut others);
        let surfels = others.iter_mut().map(|others| std::mem::take(&mut others.0));
        let surfels = set.has_surfels().then(|| host::collect(surfels));
        let is_per_pixel = set.begin.state.order == GaussianOrder::PerPixel;
        let identities = others.iter_mut().map(|others| std::mem::take(&mut others.2));
        let identities = set.is_tracked().then(|| host::collect(identities));
        let depths = others.into_iter().map(|others| others.1);
        let ray_depths = is_per_pixel.then(|| host::collect(depths));
        Self { splats, tiles, surfels, ray_depths, identities, counters: Counters::default() }
    }

    /// Bytes of host memory that it holds.
    pub(crate) fn memory_bytes(&self) -> u64 {
        let splats = self.splats.iter().map(|group| size_of_val(&**group) as u64);
        let depths = self.ray_depths.iter().flatten();
        let depths = depths.map(|group| size_of_val(&**group) as u64);
        let surfels = self.surfels.iter().flatten();
        let surfels = surfels.map(|group| size_of_val(&**group) as u64);
        let identities = self.identities.iter().flatten();
        let identities = identities.map(|group| size_of_val(&**group) as u64);
        let lists = self.tiles.memory_bytes();
        let others = depths.sum::<u64>() + surfels.sum::<u64>() + identities.sum::<u64>();
        splats.sum::<u64>() + others + lists
    }
}

impl BinnedDraw {
    /// The draw of `set`, which was sorted to `sorted`.
    pub(crate) fn new(
        set: GaussianSet,
        sorted: Arc<SortedSet>,
        record: Option<Arc<DrawRecord>>,
        runtime: &Runtime,
    ) -> Self {
        let origins = set.is_tracked().then(|| Origins::new(&set));
        let begin = set.begin;
        Self {
            origins,
            camera: begin.camera,
            are_lists_cut: list_cut_off(&begin.state, &begin.camera, &begin.viewport).is_some(),
            viewport_corner: [begin.viewport.x, begin.viewport.y].map(f64::from),
            depth_trend: match (set.depth, begin.state.order) {
                // The sort keys of a vertex program are independent of its depths.
                (Some(depth), GaussianOrder::ViewDepth) if set.draws.is_empty() => depth.trend(),
                _ => DepthTrend::None,
            },
            depth_unit: set.depth.map_or(DepthEncoding::Float, |depth| depth.unit()),
            fragment_stage: set.fragment_stage,
            half_period: period(&begin.camera).map_or(f64::INFINITY, |p| 0.5 * p),
            rays: PixelRays::new(&begin.camera, &begin.viewport),
            state: begin.state,
            bounds: set.bounds,
            layer: set.layer,
            sorted,
            optimizations: runtime.config().optimizations,
            keeps_ids: record.is_some() && runtime.config().recorder.is_some(),
            record,
        }
    }

    /// Bytes of host memory that it holds while it waits to be rendered.
    pub fn memory_bytes(&self) -> u64 {
        self.sorted.memory_bytes()
    }

    /// The 2D Gaussians of the splats, if the set has them.
    pub(crate) fn surfels(&self) -> Option<&[Vec<Surfel>]> {
        self.sorted.surfels.as_deref()
    }

    /// The identities of the splats, if a fragment program reads them.
    pub(crate) fn identities(&self) -> Option<&[Vec<Identity>]> {
        self.sorted.identities.as_deref()
    }

    /// The depths that pixels sort by, if each pixel sorts for itself.
    pub(crate) fn ray_depths(&self) -> Option<RayDepths<'_>> {
        let by_group = self.sorted.ray_depths.as_ref()?;
        Some(RayDepths { by_group, rays: self.rays })
    }

    /// True if it may touch a pixel of `rect`.
    pub fn touches(&self, rect: Rect) -> bool {
        let shared = self.bounds.intersect(rect);
        !shared.is_empty() && self.sorted.tiles.any_in(shared)
    }
}
