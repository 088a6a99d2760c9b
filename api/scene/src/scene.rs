//! A set of 3D Gaussians, as parallel arrays, and triangles among them.

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use crate::error::{Fault, Place, Reason};
use crate::harmonics::{MAX_SH_DEGREE, sh_coefficients};
use crate::mesh::Mesh;
use crate::metadata::{Antialiasing, Geometry, Metadata};
use crate::shape::GaussianShape;
use crate::transform::{Motion, Transform};

/// The least number of Gaussians for a thread.
const PARALLEL: usize = 1 << 12;

/// Positions are relative to an origin of their own if they are at least this far from zero. Nearer ones have steps of
/// less than a thousandth.
const FAR: f64 = 10_000.0;

/// A set of 3D Gaussians, held as parallel arrays ready for upload, and the triangles among them.
///
/// Values may be non-finite if the file has such values: the device skips and counts these Gaussians.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scene {
    /// The point to which positions and triangles are relative.
    origin: [f64; 3],
    positions: Vec<[f32; 3]>,
    shapes: Vec<GaussianShape>,
    sh_degree: u32,
    sh: Vec<[f32; 3]>,
    mesh: Mesh,
    metadata: Metadata,
}

/// The arrays of a scene: see [`Scene::positions`], [`Scene::shapes`] and [`Scene::sh`].
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct SceneArrays {
    /// Centres.
    pub positions: Vec<[f32; 3]>,
    /// Scale, rotation and opacity of each Gaussian.
    pub shapes: Vec<GaussianShape>,
    /// The coefficients of all Gaussians.
    pub sh: Vec<[f32; 3]>,
}

impl Scene {
    /// An empty scene of spherical harmonics degree `sh_degree`, with memory reserved for `count` Gaussians.
    ///
    /// # Panics
    /// Panics if `sh_degree` exceeds [`MAX_SH_DEGREE`].
    pub fn with_capacity(sh_degree: u32, count: usize) -> Self {
        assert!(sh_degree <= MAX_SH_DEGREE, "spherical harmonics degree {sh_degree} exceeds {MAX_SH_DEGREE}");
        Self {
            origin: [0.0; 3],
            positions: Vec::with_capacity(count),
            shapes: Vec::with_capacity(count),
            sh_degree,
            sh: Vec::with_capacity(count.saturating_mul(sh_coefficients(sh_degree))),
            mesh: Mesh::default(),
            metadata: Metadata::default(),
        }
    }

    /// As [`Scene::with_capacity`], for a count that a file claims.
    ///
    /// # Errors
    /// If there is not enough memory.
    pub(crate) fn try_with_capacity(sh_degree: u32, count: usize) -> Result<Self, Fault> {
        let mut scene = Self::with_capacity(sh_degree, 0);
        let coefficients = count.checked_mul(scene.sh_stride());
        let reserved = coefficients.is_some_and(|coefficients| {
            scene.positions.try_reserve_exact(count).is_ok()
                && scene.shapes.try_reserve_exact(count).is_ok()
                && scene.sh.try_reserve_exact(coefficients).is_ok()
        });
        if reserved {
            return Ok(scene);
        }
        let each = size_of::<[f32; 3]>() * (1 + scene.sh_stride()) + size_of::<GaussianShape>();
        let bytes = (each as u64).saturating_mul(count as u64);
        Err(Reason::Memory(bytes).at(Place::File))
    }

    /// A scene of `count` Gaussians made in parallel, as by [`Scene::extend`].
    ///
    /// # Errors
    /// If there is not enough memory.
    pub(crate) fn try_generate(
        sh_degree: u32,
        count: usize,
        each: impl Fn(usize, &mut [[f32; 3]]) -> ([f32; 3], GaussianShape) + Sync,
    ) -> Result<Self, Fault> {
        let mut scene = Self::try_with_capacity(sh_degree, count)?;
        scene.extend(count, each);
        Ok(scene)
    }

    /// Appends `count` Gaussians made in parallel. `each` gets the index of a Gaussian among them, and its
    /// coefficients, which are zero and which it fills. It returns the Gaussian's position and shape.
    pub(crate) fn extend(
        &mut self,
        count: usize,
        each: impl Fn(usize, &mut [[f32; 3]]) -> ([f32; 3], GaussianShape) + Sync,
    ) {
        let (first, stride) = (self.len(), self.sh_stride());
        self.positions.resize(first + count, [0.0; 3]);
        self.shapes.resize(first + count, GaussianShape::default());
        self.sh.resize((first + count) * stride, [0.0; 3]);
        let positions = &mut self.positions[first..];
        let shapes = &mut self.shapes[first..];
        let sh = &mut self.sh[first * stride..];
        let make = |(index, ((position, shape), sh)): (usize, ((&mut _, &mut _), &mut [_]))| {
            (*position, *shape) = each(index, sh);
        };
        // Few Gaussians, such as a row of a text file, are not worth another thread.
        if count < PARALLEL {
            let gaussians = positions.iter_mut().zip(shapes);
            let gaussians = gaussians.zip(sh.chunks_exact_mut(stride));
            return gaussians.enumerate().for_each(make);
        }
        positions
            .par_iter_mut()
            .zip(shapes)
            .zip(sh.par_chunks_exact_mut(stride))
            .with_min_len(PARALLEL)
            .enumerate()
            .for_each(make);
    }

    /// Transforms every Gaussian and triangle. A translation that is so large that positions would lose digits becomes the
    /// origin.
    pub(crate) fn apply(&mut self, motion: &Motion) {
        let moved = motion.image(DVec3::from_array(self.origin));
        let keeps = self.origin == [0.0; 3] && moved.abs().max_element() < FAR;
        let origin = if keeps { DVec3::ZERO } else { moved };
        let shift = moved - origin;
        self.origin = origin.to_array();
        motion.apply_to_mesh(&mut self.mesh, shift);
        let stride = self.sh_stride();
        self.positions
            .par_iter_mut()
            .zip(&mut self.shapes)
            .zip(self.sh.par_chunks_exact_mut(stride))
            .with_min_len(PARALLEL)
            .for_each(|((position, shape), sh)| motion.apply(shift, position, shape, sh));
    }

    /// Replaces the positions by `positions`, which are in binary64, relative to an origin among them if they are far from
    /// zero: the median of each coordinate, rounded to a whole number.
    pub(crate) fn recentre(&mut self, positions: &[[f64; 3]]) {
        let median = |axis: usize| {
            let mut values: Vec<f64> = positions.iter().map(|p| p[axis]).filter(|value| value.is_finite()).collect();
            let middle = values.len() / 2;
            if values.is_empty() { 0.0 } else { libm::round(*values.select_nth_unstable_by(middle, f64::total_cmp).1) }
        };
        let origin = DVec3::new(median(0), median(1), median(2));
        if origin.abs().max_element() < FAR {
            return;
        }
        self.origin = origin.to_array();
        for (position, wide) in self.positions.iter_mut().zip(positions) {
            *position = (DVec3::from_array(*wide) - origin).as_vec3().to_array();
        }
    }

    /// Makes positions and triangles relative to another origin.
    fn move_origin(&mut self, origin: [f64; 3]) {
        let shift = DVec3::from_array(self.origin) - DVec3::from_array(origin);
        self.origin = origin;
        if shift == DVec3::ZERO {
            return;
        }
        self.mesh.apply(DMat3::IDENTITY, shift);
        for position in &mut self.positions {
            *position = (DVec3::from_array(position.map(f64::from)) + shift).as_vec3().to_array();
        }
    }

    /// Appends the Gaussians and triangles of `other`, transformed by `transform`. Metadata on which the two disagree are dropped,
    /// and a note says so. The spherical harmonics degree becomes the greater one.
    pub fn append(&mut self, other: &Self, transform: &Transform) {
        let mut moved = other.clone();
        moved.apply(&transform.motion(other.sh_degree));
        self.join(moved);
    }

    /// Appends like [`Scene::join`], but reports a lack of memory: a file may name a scene many times.
    ///
    /// # Errors
    /// If there is not enough memory.
    pub(crate) fn try_join(&mut self, other: Self) -> Result<(), Fault> {
        let (degree, count) = (self.sh_degree.max(other.sh_degree), other.len());
        let stride = sh_coefficients(degree);
        let fits = self.is_empty()
            || self.positions.try_reserve(count).is_ok()
                && self.shapes.try_reserve(count).is_ok()
                && self.sh.try_reserve(count * stride).is_ok();
        if !fits {
            let each = size_of::<[f32; 3]>() * (1 + stride) + size_of::<GaussianShape>();
            let bytes = (each as u64).saturating_mul((self.len() + count) as u64);
            return Err(Reason::Memory(bytes).at(Place::File));
        }
        self.join(other);
        Ok(())
    }

    /// Appends `other` without a transform. There is one origin, the first that is not zero.
    fn join(&mut self, mut other: Self) {
        if self.origin == [0.0; 3] {
            self.move_origin(other.origin);
        } else {
            other.move_origin(self.origin);
        }
        self.mesh.append(std::mem::take(&mut other.mesh));
        if self.is_empty() {
            let mut metadata = std::mem::take(&mut self.metadata);
            other.mesh = std::mem::take(&mut self.mesh);
            *self = other;
            self.metadata.take_messages(&mut metadata);
            return;
        }
        if other.is_empty() {
            // Triangles alone state nothing of Gaussians.
            self.metadata.take_messages(&mut other.metadata);
            return;
        }
        let degree = self.sh_degree.max(other.sh_degree);
        self.raise_degree(degree);
        other.raise_degree(degree);
        self.positions.append(&mut other.positions);
        self.shapes.append(&mut other.shapes);
        self.sh.append(&mut other.sh);
        self.metadata.join(other.metadata);
    }

    /// The Gaussians `range`, with the scene's metadata and without its triangles.
    pub(crate) fn range(&self, range: std::ops::Range<usize>) -> Self {
        let stride = self.sh_stride();
        Self {
            origin: self.origin,
            positions: self.positions[range.clone()].to_vec(),
            shapes: self.shapes[range.clone()].to_vec(),
            sh: self.sh[range.start * stride..range.end * stride].to_vec(),
            sh_degree: self.sh_degree,
            mesh: Mesh::default(),
            metadata: self.metadata.clone(),
        }
    }

    /// Leaves out the Gaussians for whose position `keep` is false.
    pub(crate) fn retain(&mut self, keep: impl Fn([f32; 3]) -> bool) {
        let stride = self.sh_stride();
        let mut kept = 0;
        for index in 0..self.len() {
            if keep(self.positions[index]) {
                self.positions[kept] = self.positions[index];
                self.shapes[kept] = self.shapes[index];
                self.sh.copy_within(index * stride..(index + 1) * stride, kept * stride);
                kept += 1;
            }
        }
        self.positions.truncate(kept);
        self.shapes.truncate(kept);
        self.sh.truncate(kept * stride);
    }

    /// Raises the degree to `degree`; new coefficients are zero.
    fn raise_degree(&mut self, degree: u32) {
        if degree == self.sh_degree {
            return;
        }
        let (old, new) = (self.sh_stride(), sh_coefficients(degree));
        let mut sh = Vec::with_capacity(self.len() * new);
        for coefficients in self.sh.chunks_exact(old) {
            sh.extend_from_slice(coefficients);
            sh.resize(sh.len() + new - old, [0.0; 3]);
        }
        (self.sh, self.sh_degree) = (sh, degree);
    }

    /// Warns of Gaussians that the device does not draw because of numbers that are not finite.
    pub(crate) fn warn_of_dropped(&mut self) {
        let is_dropped = |(position, shape): (&[f32; 3], &GaussianShape)| {
            let mut numbers = position.iter().chain(&shape.scale).chain(&shape.rotation).chain([&shape.opacity]);
            !numbers.all(|number| number.is_finite())
        };
        let gaussians = self.positions.par_iter().zip(&self.shapes);
        let dropped = gaussians.filter(|gaussian| is_dropped(*gaussian)).count();
        if dropped > 0 {
            let all = self.len();
            self.metadata.warn(format!(
                "{dropped} of {all} Gaussians have a position, scale, rotation or opacity that is not finite, and are not drawn"
            ));
        }
    }

    /// The point in the file's coordinates to which positions and triangles are relative: zero, unless they lie so far from
    /// there that binary32 would lose their digits. Cameras are not relative to it.
    pub fn origin(&self) -> [f64; 3] {
        self.origin
    }

    /// Declares the point to which positions and triangles are relative. It leaves their numbers as they are.
    pub fn set_origin(&mut self, origin: [f64; 3]) {
        self.origin = origin;
    }

    /// The triangles among the Gaussians.
    pub fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// The triangles, for changes.
    pub fn mesh_mut(&mut self) -> &mut Mesh {
        &mut self.mesh
    }

    /// The metadata of the scene's file.
    pub fn metadata(&self) -> &Metadata {
        &self.metadata
    }

    /// The metadata, for changes.
    pub fn metadata_mut(&mut self) -> &mut Metadata {
        &mut self.metadata
    }

    /// The compensation for the screen filter: the file's, or none as in 3DGS.
    pub fn antialiasing(&self) -> Antialiasing {
        self.metadata.antialiasing.unwrap_or_default()
    }

    /// The shape of the scene's Gaussians: the file's, or volumes.
    pub fn geometry(&self) -> Geometry {
        self.metadata.geometry.unwrap_or_default()
    }

    /// Appends a Gaussian. `sh` holds its spherical harmonics coefficients, (degree + 1)^2 RGB
    /// triples with the constant one first.
    ///
    /// # Panics
    /// If `sh` is of any other length.
    pub fn push(&mut self, position: [f32; 3], shape: GaussianShape, sh: &[[f32; 3]]) {
        assert_eq!(sh.len(), self.sh_stride(), "coefficients of one Gaussian");
        self.positions.push(position);
        self.shapes.push(shape);
        self.sh.extend_from_slice(sh);
    }

    /// The number of Gaussians.
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// True if there is no Gaussian.
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// Centres, relative to [`Scene::origin`], in the scene's units.
    pub fn positions(&self) -> &[[f32; 3]] {
        &self.positions
    }

    /// Scale, rotation and opacity of each Gaussian.
    pub fn shapes(&self) -> &[GaussianShape] {
        &self.shapes
    }

    /// The positions, the shapes and the coefficients, which are taken out of the scene: it is empty then.
    pub fn take_arrays(&mut self) -> SceneArrays {
        SceneArrays {
            positions: std::mem::take(&mut self.positions),
            shapes: std::mem::take(&mut self.shapes),
            sh: std::mem::take(&mut self.sh),
        }
    }

    /// The spherical harmonics degree stored, 0 to [`MAX_SH_DEGREE`].
    pub fn sh_degree(&self) -> u32 {
        self.sh_degree
    }

    /// The number of coefficients (RGB triples) of each Gaussian, (degree + 1)^2.
    pub fn sh_stride(&self) -> usize {
        sh_coefficients(self.sh_degree)
    }

    /// The coefficients of all Gaussians, [`Scene::sh_stride`] RGB triples each, in 3DGS's order and signs. A colour is
    /// 0.5 plus their sum weighted by the basis functions.
    pub fn sh(&self) -> &[[f32; 3]] {
        &self.sh
    }
}
