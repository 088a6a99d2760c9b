//! What there is to project: batches of vertices and chunks, without the chunks that no picture needs.

use super::chunks::{Chunk, Chunks, Harmonics};
use super::fetch::{BATCH, Batch, CoefficientReader, Fetcher};
use super::frustum::{Frustum, Outside};
use super::hidden::Hidden;
use super::instances::{Matrices, Model};
use super::project::{Projection, Source};
use super::scratch::Attributes;
use super::{GaussianSet, MAX_BATCHES, TooManyGaussians, shaded};
use crate::packet::GaussianAppend;
use crate::stats::counters::{Counter, Counters};
use devmem::host;
use std::sync::Arc;

impl GaussianSet {
    /// What is to be projected, in the order of draw, instance and, but for chunks, position in the draw. What is left
    /// out already is counted.
    pub(super) fn jobs<'a>(
        &'a self,
        chunks: &'a [Option<Arc<Chunks>>],
        projection: &Projection,
        hidden: Option<&Hidden>,
        counters: &mut Counters,
    ) -> Result<Vec<Job<'a>>, TooManyGaussians> {
        let batches = |append: &GaussianAppend| {
            let per_instance = append.count.div_ceil(BATCH as u32);
            u64::from(per_instance) * u64::from(append.instance_count)
        };
        let batches = self.appends.iter().map(batches);
        let batches = batches.chain(self.draws.iter().map(shaded::batches));
        let batches = batches.fold(0, u64::saturating_add);
        // A picture that repeats has copies on both sides.
        let sides = if projection.period.is_some() { 3 } else { 1 };
        let batches = batches.saturating_mul(sides);
        if batches > MAX_BATCHES {
            return Err(TooManyGaussians { batches });
        }
        let mut jobs = Vec::new();
        // There are no more Gaussians than places in batches, so that this stays within 32 bits but at the very end.
        let mut sequence = 0u32;
        let mut first_number = 0u32;
        for (append, chunks) in self.appends.iter().zip(chunks) {
            let opacity = chunks.as_ref().map_or(1.0, |chunks| chunks.opacity);
            let view = View::new(projection, opacity);
            let has_harmonics = chunks.as_ref().map(|all| all.have_harmonics_of(append));
            for instance in 0..append.instance_count {
                let instance = append.first_instance.saturating_add(instance);
                let of_instance;
                let mut view = &view;
                let hidden = hidden.filter(|_| !append.attributes.model.is_some());
                if chunks.is_some() && append.attributes.model.is_some() {
                    of_instance = View::of_instance(projection, append, instance, opacity);
                    view = &of_instance;
                }
                let job = Job {
                    append,
                    instance,
                    sequence,
                    part: Part::From(0),
                    number: 0,
                    has_harmonics: has_harmonics.unwrap_or(false),
                    frustum: Arc::clone(&view.frustum),
                };
                let batches = match chunks {
                    None => append.count.div_ceil(BATCH as u32) as usize,
                    Some(chunks) => chunks.chunks.len(),
                };
                host::reserve(&mut jobs, batches);
                match chunks {
                    None => {
                        let starts = (0..append.count).step_by(BATCH).zip(first_number..);
                        jobs.extend(starts.map(|(start, number)| Job {
                            part: Part::From(start),
                            number,
                            ..job.clone()
                        }));
                    }
                    Some(chunks) => jobs.extend(
                        chunks
                            .chunks
                            .iter()
                            .zip(first_number..)
                            .filter(|(chunk, _)| {
                                !view.leaves_out(chunk, counters)
                                    && !hidden
                                        .is_some_and(|hidden| hidden.leaves_out(chunk, counters))
                            })
                            .map(|(chunk, number)| Job {
                                part: Part::Chunk(chunk),
                                number,
                                ..job.clone()
                            }),
                    ),
                }
                sequence = sequence.wrapping_add(append.count);
                first_number += batches as u32;
            }
        }
        Ok(jobs)
    }
}

/// How an instance is seen.
struct View {
    frustum: Arc<Frustum>,
    /// The same in the instance's own space, unless nothing is certain there.
    own: Option<Arc<Frustum>>,
    model: Model,
}

impl View {
    /// Of instances whose opacities are at most `opacity`.
    fn new(projection: &Projection, opacity: f32) -> Self {
        let frustum = Arc::new(Frustum::new(projection, opacity));
        Self {
            own: Some(Arc::clone(&frustum)),
            frustum,
            model: Model::default(),
        }
    }

    /// Of an instance that a model places and fades.
    fn of_instance(
        projection: &Projection,
        append: &GaussianAppend,
        instance: u32,
        opacity: f32,
    ) -> Self {
        let model = Model::read(append, instance);
        let frustum = Arc::new(Frustum::new(projection, model.greatest_opacity(opacity)));
        let own = match model.matrix {
            None => Some(Arc::clone(&frustum)),
            Some(matrix) => frustum.within(matrix).map(Arc::new),
        };
        Self {
            frustum,
            own,
            model,
        }
    }

    /// Whether a whole chunk is outside; its Gaussians are counted then.
    fn leaves_out(&self, chunk: &Chunk, counters: &mut Counters) -> bool {
        let mut bounds = chunk.bounds;
        bounds.opacity = self.model.greatest_opacity(bounds.opacity);
        let Some(reason) = self.own.as_ref().and_then(|own| own.excludes(&bounds)) else {
            return false;
        };
        let reason = match reason {
            Outside::Faint => Counter::SkippedFaint,
            Outside::Near => Counter::SkippedNear,
            Outside::Far => Counter::SkippedFar,
            Outside::Beside => Counter::SkippedOffScreen,
        };
        for counter in [reason, Counter::GaussiansRead, Counter::OutsideByChunks] {
            counters.add(counter, chunk.numbers.len() as u64);
        }
        true
    }
}

/// A batch to project.
#[derive(Clone)]
pub(super) struct Job<'a> {
    pub(super) append: &'a GaussianAppend,
    pub(super) instance: u32,
    /// Which Gaussian of the set the instance's first is.
    pub(super) sequence: u32,
    pub(super) part: Part<'a>,
    /// Which of the set's batches it is, those that are left out counted, too.
    pub(super) number: u32,
    /// Whether the chunk holds its spherical harmonics.
    pub(super) has_harmonics: bool,
    pub(super) frustum: Arc<Frustum>,
}

#[derive(Clone, Copy)]
pub(super) enum Part<'a> {
    /// The vertices from this one on.
    From(u32),
    Chunk(&'a Chunk),
}

impl<'a> Job<'a> {
    /// Reads the batch, if it lies in no chunk, and what its model does to it.
    pub(super) fn read<'b>(
        &'b self,
        fetcher: &mut Fetcher,
        attributes: &'b mut Attributes,
        matrices: &'b mut Option<Box<Matrices>>,
        is_flat: bool,
    ) -> Source<'b> {
        let streams = &self.append.attributes;
        let batch = match self.part {
            Part::From(start) => {
                let len = (self.append.count - start).min(BATCH as u32) as usize;
                Batch::new(self.append, self.instance, start, len)
            }
            Part::Chunk(chunk) => Batch::of_chunk(self.append, self.instance, &chunk.numbers),
        };
        let matrices = streams.model.matrix.as_ref().map(|rows| {
            let matrices = matrices.get_or_insert_default();
            matrices.read(fetcher, rows, &batch);
            &**matrices
        });
        let is_faded = streams.model.opacity.is_some();
        let (harmonics, degree) = match self.part {
            Part::Chunk(chunk) if self.has_harmonics => (chunk.harmonics(), chunk.degree),
            _ => (Harmonics::default(), u32::MAX),
        };
        let (attributes, is_sound) = match self.part {
            Part::Chunk(chunk) if !is_faded => (&chunk.attributes, chunk.is_sound),
            Part::Chunk(chunk) => {
                attributes.clone_from(&chunk.attributes);
                fetcher.fade(streams, &batch, attributes);
                // Products need not be finite.
                (&*attributes, false)
            }
            Part::From(_) => {
                fetcher.read_own(streams, &batch, attributes);
                fetcher.fade(streams, &batch, attributes);
                if is_flat {
                    attributes.scale[2][..batch.len].fill(0.0);
                }
                (&*attributes, false)
            }
        };
        Source {
            reader: CoefficientReader::new(&streams.spherical_harmonics),
            batch,
            attributes,
            matrices,
            is_sound,
            harmonics,
            degree,
            frustum: None,
        }
    }
}
