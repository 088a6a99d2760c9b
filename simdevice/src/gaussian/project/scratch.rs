//! The buffers that a worker needs to project a group of Gaussians.

use super::screen::ScreenGaussians;
use crate::gaussian::lanes::{Bits, F32_LANES, GROUP, GroupF64, NO_GROUP_F64};
use crate::gaussian::linear_algebra::{Linear, dot, is_singular};
use crate::gaussian::read::attributes::Attributes;
use crate::gaussian::read::models::Matrices;
use crate::gaussian::splats::footprint::{FOOTPRINT_WORDS, TileFootprint};

/// The greatest share of culled lanes at which all lanes are processed is `1 / MOST`.
const MOST: usize = 4;

/// The tile footprint of each lane, as the words of [`TileFootprint::words`].
pub(crate) struct TileFootprints(pub(crate) [[u32; FOOTPRINT_WORDS]; GROUP + 8]);

impl Default for TileFootprints {
    fn default() -> Self {
        Self([[0; FOOTPRINT_WORDS]; GROUP + 8])
    }
}

impl TileFootprints {
    /// The footprint of a lane.
    #[inline(always)]
    pub(crate) fn get(&self, at: usize) -> TileFootprint {
        TileFootprint::from_words(self.0[at])
    }

    pub(crate) fn set(&mut self, at: usize, reach: &TileFootprint) {
        self.0[at] = reach.words();
    }
}

/// A copy of an element a period to the right or to the left.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PanoramaCopy {
    /// The element.
    pub(crate) at: usize,
    /// The side, as [`ProjectedGroup::copies`](crate::gaussian::splats::group::ProjectedGroup::copies) has them.
    pub(crate) side: usize,
    pub(crate) footprint: TileFootprint,
}

/// The intermediate results of a group's kept Gaussians, densely packed, as structures of arrays.
pub(crate) struct Scratch {
    /// The lanes of the group that the arrays below hold, in their order.
    pub(crate) lanes: Vec<usize>,
    /// The elements that were kept: all, unless so few lanes were culled that packing the others would take longer.
    pub(crate) kept: Bits,
    pub(crate) position: Box<[GroupF64; 3]>,
    pub(crate) scale: Box<[GroupF64; 3]>,
    pub(crate) rotation: Box<[GroupF64; 4]>,
    pub(crate) opacity: Box<GroupF64>,
    /// The mean from the eye, in world axes.
    pub(crate) offset: Box<[GroupF64; 3]>,
    /// The mean from the eye, in camera axes.
    pub(crate) camera: Box<[GroupF64; 3]>,
    /// The depth variable.
    pub(crate) depth: Box<GroupF64>,
    /// The model matrices and the directions in model space, if there are any.
    pub(crate) models: Option<Box<KeptModels>>,
    /// The Jacobian's rows in the axes of the Gaussians' space. Unused for a pinhole without models.
    pub(crate) jacobian: Box<[[GroupF64; 3]; 2]>,
    /// The covariances in the picture from the unscented transform: xx, xy, yy and the determinant.
    pub(crate) moments: Box<[GroupF64; 4]>,
    pub(crate) screen: Box<ScreenGaussians>,
    /// The elements that reach tiles.
    pub(crate) reached: Vec<usize>,
    /// The footprints of those that reach tiles.
    pub(crate) reaches: Box<TileFootprints>,
    /// The copies of those a period away. Elements ascend.
    pub(crate) copies: Vec<PanoramaCopy>,
    /// The sort key of each element, and its number in the set.
    pub(crate) keys: Box<[[u32; GROUP]; 2]>,
}

impl Scratch {
    /// Scratch for one worker.
    pub(crate) fn new() -> Self {
        Self {
            lanes: Vec::with_capacity(GROUP),
            kept: Bits::default(),
            position: Box::new([NO_GROUP_F64; 3]),
            scale: Box::new([NO_GROUP_F64; 3]),
            rotation: Box::new([NO_GROUP_F64; 4]),
            opacity: Box::new(NO_GROUP_F64),
            offset: Box::new([NO_GROUP_F64; 3]),
            camera: Box::new([NO_GROUP_F64; 3]),
            depth: Box::new(NO_GROUP_F64),
            models: None,
            jacobian: Box::new([[NO_GROUP_F64; 3]; 2]),
            moments: Box::new([NO_GROUP_F64; 4]),
            screen: Box::default(),
            reached: Vec::with_capacity(GROUP),
            reaches: Box::default(),
            copies: Vec::new(),
            keys: Box::new([[0; GROUP]; 2]),
        }
    }

    /// Packs the kept lanes of `len` densely, as binary64. If `may_have_others` and few lanes were culled, all lanes
    /// are copied in place instead.
    #[inline(always)]
    pub(crate) fn gather(&mut self, attributes: &Attributes, kept: &Bits, len: usize, may_have_others: bool) {
        self.lanes.clear();
        let count = kept.count() as usize;
        let whole = count == GROUP || may_have_others && MOST * count >= (MOST - 1) * len;
        if whole {
            self.lanes.extend(0..len.min(GROUP));
            self.kept = *kept;
        } else {
            kept.for_each(|lane| self.lanes.push(lane));
            self.kept = Bits::first(count);
        }
        let lanes = &*self.lanes;
        let pack = |from: &[f32; F32_LANES], to: &mut GroupF64| {
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
    pub(crate) fn gather_matrices(&mut self, matrices: &Matrices) {
        let models = self
            .models
            .get_or_insert_with(|| Box::new(KeptModels { matrix: [[NO_GROUP_F64; 4]; 3], toward: [NO_GROUP_F64; 3] }));
        let to = models.matrix.as_flattened_mut().iter_mut();
        for (from, to) in matrices.rows.as_flattened().iter().zip(to) {
            for (to, &lane) in to.iter_mut().zip(&self.lanes) {
                *to = from[lane % GROUP].into();
            }
        }
    }
}

/// The matrices of the kept Gaussians of a group in binary64, and the viewing directions in the Gaussians' own space.
#[derive(Clone, Debug)]
pub(crate) struct KeptModels {
    pub(crate) matrix: [[GroupF64; 4]; 3],
    /// A vector from the eye in the Gaussians' space, of any length.
    pub(crate) toward: [GroupF64; 3],
}

impl KeptModels {
    /// A kept Gaussian's matrix, without the translation.
    pub(crate) fn linear(&self, at: usize) -> Linear {
        [0, 1, 2].map(|row| [0, 1, 2].map(|column| self.matrix[row][column][at]))
    }

    /// A vector in the axes of a kept Gaussian's space, transformed to the axes of the world.
    pub(crate) fn to_world(&self, at: usize, vector: [f64; 3]) -> [f64; 3] {
        self.linear(at).map(|row| dot(row, vector))
    }

    /// A row vector in the world's axes, transformed to the axes of a kept Gaussian's space. NaN if the matrix is
    /// singular.
    pub(crate) fn row_from_world(&self, at: usize, row: [f64; 3]) -> [f64; 3] {
        let a = self.linear(at);
        if is_singular(a) {
            return [f64::NAN; 3];
        }
        [0, 1, 2].map(|column| row[0] * a[0][column] + row[1] * a[1][column] + row[2] * a[2][column])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[gaurast_runner::test]
    fn lanes_that_are_kept_are_the_same_among_others_and_alone() {
        let mut attributes = Attributes::default();
        for (lane, (x, opacity)) in (attributes.position[0].iter_mut()).zip(&mut attributes.opacity).enumerate() {
            (*x, *opacity) = (lane as f32, 0.5 + lane as f32);
        }
        for (len, left_out) in [(GROUP, 5), (GROUP, 3), (200, 5), (200, 3), (GROUP, GROUP)] {
            let mut kept = Bits::first(len);
            let out = (0..len).filter(|lane| lane % left_out == left_out - 1);
            let mut others = Bits::default();
            out.for_each(|lane| others.set_one(lane, true));
            if left_out < GROUP {
                kept = kept.without(&others);
            }
            let values = |may_have_others: bool| {
                let mut scratch = Scratch::new();
                scratch.gather(&attributes, &kept, len, may_have_others);
                let mut values = Vec::new();
                scratch.kept.for_each(|at| {
                    let (x, opacity) = (scratch.position[0][at], scratch.opacity[at]);
                    values.push((scratch.lanes[at], x, opacity));
                });
                (scratch.lanes.len(), values)
            };
            let [(among, of_all), (alone, of_kept)] = [true, false].map(values);
            assert_eq!(of_all, of_kept);
            let count = kept.count() as usize;
            assert_eq!(alone, count);
            assert_eq!(among, if 4 * count >= 3 * len { len } else { count });
            let expected = |lane: usize| (lane, lane as f64, 0.5 + lane as f64);
            let mut lanes = Vec::new();
            kept.for_each(|lane| lanes.push(expected(lane)));
            assert_eq!(of_kept, lanes);
        }
    }
}
