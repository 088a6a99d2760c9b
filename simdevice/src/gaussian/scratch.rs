//! What a worker needs to project a group of Gaussians.

use super::attributes::Attributes;
use super::footprint::TileFootprint;
use super::instances::{Matrices, Placed};
use super::lanes::{GROUP, Bits, F32_LANES, Lanes, NO_LANES};

/// The reach of each lane, as the two words of [`TileFootprint::words`].
pub(super) struct TileFootprints(pub(super) [[u64; GROUP + 8]; 2]);

impl Default for TileFootprints {
    fn default() -> Self {
        Self([[0; GROUP + 8]; 2])
    }
}

impl TileFootprints {
    /// A lane's.
    #[inline(always)]
    pub(super) fn get(&self, at: usize) -> TileFootprint {
        TileFootprint::from_words([self.0[0][at], self.0[1][at]])
    }

    pub(super) fn set(&mut self, at: usize, reach: &TileFootprint) {
        let [first, second] = reach.words();
        self.0[0][at] = first;
        self.0[1][at] = second;
    }
}

/// What becomes of a group's Gaussians: of those that were kept, densely, in structures of arrays.
pub(crate) struct Scratch {
    /// The lanes that were kept; what follows is in their order.
    pub(super) lanes: Vec<usize>,
    pub(super) position: Box<[Lanes; 3]>,
    pub(super) scale: Box<[Lanes; 3]>,
    pub(super) rotation: Box<[Lanes; 4]>,
    pub(super) opacity: Box<Lanes>,
    /// The mean from the eye, in world axes.
    pub(super) offset: Box<[Lanes; 3]>,
    /// The mean from the eye, in camera axes.
    pub(super) camera: Box<[Lanes; 3]>,
    /// The depth variable.
    pub(super) depth: Box<Lanes>,
    /// What model matrices make of them, if there are any.
    pub(super) placed: Option<Box<Placed>>,
    /// The Jacobian's rows in the axes of the Gaussians' space, unless a pinhole sees the world itself.
    pub(super) jacobian: Box<[[Lanes; 3]; 2]>,
    /// Of covariances in the picture: xx, xy, yy and the determinant, where the unscented transform finds them.
    pub(super) moments: Box<[Lanes; 4]>,
    pub(super) flat: Box<ScreenGaussians>,
    /// Which of them reach tiles.
    pub(super) reached: Vec<usize>,
    /// Which tiles, of those that do.
    pub(super) reaches: Box<TileFootprints>,
    /// The same of their copies a period beside, in the same order: which side's, 0 or 1, in the middle.
    pub(super) copies: Vec<(usize, usize, TileFootprint)>,
}

/// Gaussians on the screen.
pub(super) struct ScreenGaussians {
    pub(super) mean: [Lanes; 2],
    pub(super) determinant: Lanes,
    pub(super) log2_opacity: Lanes,
    /// See [`Splat::factor`](super::project::Splat::factor).
    pub(super) factor: [Lanes; 3],
    /// See [`Ellipse`](super::footprint::Ellipse).
    pub(super) half: [Lanes; 2],
    pub(super) slope: Lanes,
    pub(super) narrowing: Lanes,
    pub(super) peak: Lanes,
    /// The unit vector from the eye, in the axes of the Gaussians' space.
    pub(super) direction: [Lanes; 3],
}

impl Default for ScreenGaussians {
    fn default() -> Self {
        Self {
            mean: [NO_LANES; 2],
            determinant: NO_LANES,
            log2_opacity: NO_LANES,
            factor: [NO_LANES; 3],
            half: [NO_LANES; 2],
            slope: NO_LANES,
            narrowing: NO_LANES,
            peak: NO_LANES,
            direction: [NO_LANES; 3],
        }
    }
}

impl Scratch {
    /// Scratch for one worker.
    pub(crate) fn new() -> Self {
        Self {
            lanes: Vec::with_capacity(GROUP),
            position: Box::new([NO_LANES; 3]),
            scale: Box::new([NO_LANES; 3]),
            rotation: Box::new([NO_LANES; 4]),
            opacity: Box::new(NO_LANES),
            offset: Box::new([NO_LANES; 3]),
            camera: Box::new([NO_LANES; 3]),
            depth: Box::new(NO_LANES),
            placed: None,
            jacobian: Box::new([[NO_LANES; 3]; 2]),
            moments: Box::new([NO_LANES; 4]),
            flat: Box::default(),
            reached: Vec::with_capacity(GROUP),
            reaches: Box::default(),
            copies: Vec::new(),
        }
    }

    /// Packs the kept lanes densely, as binary64.
    #[inline(always)]
    pub(super) fn gather(&mut self, attributes: &Attributes, kept: &Bits) {
        self.lanes.clear();
        kept.for_each(|lane| self.lanes.push(lane));
        let lanes = &*self.lanes;
        let whole = lanes.len() == GROUP;
        let pack = |from: &[f32; F32_LANES], to: &mut Lanes| {
            if whole {
                for (to, &from) in to.iter_mut().zip(from) {
                    *to = from.into();
                }
                return;
            }
            for (to, &lane) in to.iter_mut().zip(lanes) {
                *to = from[lane % GROUP].into();
            }
        };
        for (from, to) in attributes.position.iter().zip(&mut *self.position) {
            pack(from, to);
        }
        for (from, to) in attributes.scale.iter().zip(&mut *self.scale) {
            pack(from, to);
        }
        for (from, to) in attributes.rotation.iter().zip(&mut *self.rotation) {
            pack(from, to);
        }
        pack(&attributes.opacity, &mut self.opacity);
    }

    /// Packs the kept lanes' matrices densely.
    pub(super) fn gather_matrices(&mut self, matrices: &Matrices) {
        let placed = self.placed.get_or_insert_with(|| {
            Box::new(Placed {
                matrix: [[NO_LANES; 4]; 3],
                toward: [NO_LANES; 3],
            })
        });
        let to = placed.matrix.as_flattened_mut().iter_mut();
        for (from, to) in matrices.rows.as_flattened().iter().zip(to) {
            for (to, &lane) in to.iter_mut().zip(&self.lanes) {
                *to = from[lane % GROUP].into();
            }
        }
    }
}
