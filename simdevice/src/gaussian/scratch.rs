//! What a worker needs to project a batch of Gaussians.

use super::fetch::{BATCH, Batch, Fetcher};
use super::lanes::{Bits, Lanes, NO_LANES};
use crate::packet::GaussianAttributes;

/// What a batch's Gaussians are, and what becomes of them. Structures of arrays.
pub(crate) struct Scratch {
    pub(super) fetcher: Fetcher,
    pub(super) attributes: Box<Attributes>,
    /// The mean from the eye, in world axes.
    pub(super) offset: Box<[Lanes; 3]>,
    /// The mean from the eye, in camera axes.
    pub(super) camera: Box<[Lanes; 3]>,
    /// The depth variable, where that is not the camera axis.
    pub(super) distance: Box<Lanes>,
    /// The lanes that were kept; what follows is dense in their order.
    pub(super) lanes: Vec<usize>,
    pub(super) dense: Box<Attributes>,
    pub(super) dense_camera: Box<[Lanes; 3]>,
    pub(super) dense_offset: Box<[Lanes; 3]>,
    /// The Jacobian's rows in world axes, of cameras that are no pinholes.
    pub(super) jacobian: Box<[[Lanes; 3]; 2]>,
    pub(super) flat: Box<Flat>,
}

/// Vertex attributes by lane.
pub(super) struct Attributes {
    pub(super) position: [Lanes; 3],
    pub(super) scale: [Lanes; 3],
    pub(super) rotation: [Lanes; 4],
    pub(super) opacity: Lanes,
}

/// Gaussians on the screen.
pub(super) struct Flat {
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
    /// The unit vector from the eye, in world axes.
    pub(super) direction: [Lanes; 3],
}

impl Default for Attributes {
    fn default() -> Self {
        Self {
            position: [NO_LANES; 3],
            scale: [NO_LANES; 3],
            rotation: [NO_LANES; 4],
            opacity: NO_LANES,
        }
    }
}

impl Default for Flat {
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
            fetcher: Fetcher::default(),
            attributes: Box::default(),
            offset: Box::new([NO_LANES; 3]),
            camera: Box::new([NO_LANES; 3]),
            distance: Box::new(NO_LANES),
            lanes: Vec::with_capacity(BATCH),
            dense: Box::default(),
            dense_camera: Box::new([NO_LANES; 3]),
            dense_offset: Box::new([NO_LANES; 3]),
            jacobian: Box::new([[NO_LANES; 3]; 2]),
            flat: Box::default(),
        }
    }

    pub(super) fn fetch(&mut self, attributes: &GaussianAttributes, batch: &Batch) {
        let to = &mut *self.attributes;
        self.fetcher
            .read(&attributes.position, batch, to.position.each_mut());
        self.fetcher
            .read(&attributes.scale, batch, to.scale.each_mut());
        self.fetcher
            .read(&attributes.rotation, batch, to.rotation.each_mut());
        self.fetcher
            .read(&attributes.opacity, batch, [&mut to.opacity]);
    }

    /// Packs the kept lanes densely.
    #[inline(always)]
    pub(super) fn gather(&mut self, kept: &Bits) {
        self.lanes.clear();
        kept.for_each(|lane| self.lanes.push(lane));
        let pack = |from: &Lanes, to: &mut Lanes| {
            for (to, &lane) in to.iter_mut().zip(&self.lanes) {
                *to = from[lane % BATCH];
            }
        };
        let (from, to) = (&*self.attributes, &mut *self.dense);
        for (from, to) in from.scale.iter().zip(&mut to.scale) {
            pack(from, to);
        }
        for (from, to) in from.rotation.iter().zip(&mut to.rotation) {
            pack(from, to);
        }
        pack(&from.opacity, &mut to.opacity);
        for (from, to) in self.camera.iter().zip(&mut *self.dense_camera) {
            pack(from, to);
        }
        for (from, to) in self.offset.iter().zip(&mut *self.dense_offset) {
            pack(from, to);
        }
    }
}
