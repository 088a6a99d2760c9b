//! Image instructions: gathers operands for the image unit, which is asked once for each image among 16 lanes.

use super::super::ir::{
    Binding, CHUNK_LANES, ImageAtomic, ImageQuery, ImageRead, ImageShape, ImageWrite, Lod, Reg,
    Sample,
};
use super::super::resources::{Lanes, LodRequest, SampleRequest, TexelRequest};
use super::batch::Batch;
use super::mask::{MaskId, lanes_of};

/// A bind point that isn't bound to anything.
const UNBOUND: u32 = u32::MAX;

impl Batch<'_> {
    fn words(&self, reg: Reg, chunk: usize) -> Lanes {
        self.file.lanes(self.slot(reg), chunk)
    }

    fn words_or_zero(&self, reg: Option<Reg>, chunk: usize) -> Lanes {
        reg.map_or([0; CHUNK_LANES], |reg| self.words(reg, chunk))
    }

    fn all_words<const N: usize>(&self, regs: &[Reg], chunk: usize) -> [Lanes; N] {
        std::array::from_fn(|index| self.words_or_zero(regs.get(index).copied(), chunk))
    }

    /// The bind points that 16 lanes mean.
    fn bind_points(&self, binding: &Binding, chunk: usize) -> Lanes {
        let indices = self.words_or_zero(binding.index, chunk);
        indices.map(|index| {
            if index < binding.count {
                binding.slot + index
            } else {
                UNBOUND
            }
        })
    }

    /// Calls `ask(image, sampler, lanes)` for each pair of bind points among `lanes`.
    fn for_each_binding(
        &self,
        images: &Lanes,
        samplers: &Lanes,
        mut lanes: u16,
        mut ask: impl FnMut(u32, u32, u16),
    ) {
        while lanes != 0 {
            let first = lanes.trailing_zeros() as usize;
            let (image, sampler) = (images[first], samplers[first]);
            let same = lanes_of(lanes)
                .filter(|lane| images[*lane] == image && samplers[*lane] == sampler)
                .fold(0, |same, lane| same | 1 << lane);
            ask(image, sampler, same);
            lanes &= !same;
        }
    }

    #[inline(always)]
    fn put_texel(&self, dst: &[Option<Reg>; 4], chunk: usize, texel: &[Lanes; 4]) {
        for (index, lanes) in texel.iter().enumerate() {
            if let Some(reg) = dst[index] {
                self.file.set(self.slot(reg), chunk, *lanes);
            }
        }
    }

    fn lod_request(&self, lod: &Lod, chunk: usize) -> LodRequest {
        match lod {
            Lod::Implicit { bias, minimum } => LodRequest::Implicit {
                bias: self.words_or_zero(*bias, chunk),
                minimum: self.words_or_zero(*minimum, chunk),
            },
            Lod::Explicit(level) => LodRequest::Explicit(self.words(*level, chunk)),
            Lod::Gradient { dx, dy, minimum } => LodRequest::Gradient {
                dx: self.all_words(dx, chunk),
                dy: self.all_words(dy, chunk),
                minimum: self.words_or_zero(*minimum, chunk),
            },
        }
    }

    pub fn sample(&self, sample: &Sample) {
        // What isn't an operand stays as it is here for all chunks.
        let mut request = SampleRequest {
            mask: 0,
            shape: sample.shape,
            coordinate: [[0; CHUNK_LANES]; 4],
            lod: LodRequest::Automatic,
            offset: [[0; CHUNK_LANES]; 3],
            compare: None,
            gather: sample.gather,
        };
        let bound = fixed_point(&sample.image).zip(fixed_point(&sample.sampler));
        for chunk in 0..self.file.width() {
            let active = self.masks.chunk(MaskId::ACTIVE, chunk);
            if active == 0 {
                continue;
            }
            for (index, reg) in sample.coordinate.iter().enumerate().take(4) {
                request.coordinate[index] = self.words(*reg, chunk);
            }
            for (index, reg) in sample.offset.iter().enumerate().take(3) {
                request.offset[index] = self.words(*reg, chunk);
            }
            if !is_automatic(&sample.lod) {
                request.lod = self.lod_request(&sample.lod, chunk);
            }
            if let Some(reg) = sample.compare {
                request.compare = Some(self.words(reg, chunk));
            }
            let texel = match bound {
                Some((image, sampler)) => {
                    request.mask = active;
                    self.resources.images.sample(image, sampler, &request)
                }
                None => self.sample_each(sample, &mut request, chunk, active),
            };
            self.put_texel(&sample.dst, chunk, &texel);
        }
    }

    /// Samples of 16 lanes that may mean different images or samplers.
    fn sample_each(
        &self,
        sample: &Sample,
        request: &mut SampleRequest,
        chunk: usize,
        active: u16,
    ) -> [Lanes; 4] {
        let images = self.bind_points(&sample.image, chunk);
        let samplers = self.bind_points(&sample.sampler, chunk);
        let mut texel = [[0; CHUNK_LANES]; 4];
        self.for_each_binding(&images, &samplers, active, |image, sampler, lanes| {
            request.mask = lanes;
            let found = self.resources.images.sample(image, sampler, request);
            merge(&mut texel, &found, lanes);
        });
        texel
    }

    fn texel_request(
        &self,
        shape: ImageShape,
        coordinate: &[Reg],
        level: Option<Reg>,
        sample: Option<Reg>,
        chunk: usize,
    ) -> TexelRequest {
        TexelRequest {
            mask: 0,
            shape,
            coordinate: self.all_words(coordinate, chunk),
            level: self.words_or_zero(level, chunk),
            sample: self.words_or_zero(sample, chunk),
        }
    }

    pub fn image_read(&self, read: &ImageRead) {
        for chunk in 0..self.file.width() {
            let active = self.masks.chunk(MaskId::ACTIVE, chunk);
            let images = self.bind_points(&read.image, chunk);
            let mut request =
                self.texel_request(read.shape, &read.coordinate, read.level, read.sample, chunk);
            let mut texel = [[0; CHUNK_LANES]; 4];
            self.for_each_binding(&images, &[0; CHUNK_LANES], active, |image, _, lanes| {
                request.mask = lanes;
                merge(
                    &mut texel,
                    &self.resources.images.read(image, &request),
                    lanes,
                );
            });
            self.put_texel(&read.dst, chunk, &texel);
        }
    }

    pub fn image_write(&self, write: &ImageWrite) {
        for chunk in 0..self.file.width() {
            let lanes = self.masks.writing(chunk);
            let images = self.bind_points(&write.image, chunk);
            let mut request =
                self.texel_request(write.shape, &write.coordinate, None, write.sample, chunk);
            let texel = self.all_words(&write.texel, chunk);
            self.for_each_binding(&images, &[0; CHUNK_LANES], lanes, |image, _, lanes| {
                request.mask = lanes;
                self.resources.images.write(image, &request, &texel);
            });
        }
    }

    pub fn image_atomic(&self, atomic: &ImageAtomic) {
        for chunk in 0..self.file.width() {
            let lanes = self.masks.writing(chunk);
            let images = self.bind_points(&atomic.image, chunk);
            let mut request =
                self.texel_request(atomic.shape, &atomic.coordinate, None, atomic.sample, chunk);
            let value = self.words(atomic.value, chunk);
            let comparator = self.words_or_zero(atomic.comparator, chunk);
            let mut old = [[0; CHUNK_LANES]];
            self.for_each_binding(&images, &[0; CHUNK_LANES], lanes, |image, _, lanes| {
                request.mask = lanes;
                let found =
                    self.resources
                        .images
                        .atomic(image, &request, atomic.op, &value, &comparator);
                merge(&mut old, &[found], lanes);
            });
            if let Some(dst) = atomic.dst {
                self.file.set(self.slot(dst), chunk, old[0]);
            }
        }
    }

    pub fn image_query(&self, dst: &[Reg], image: &Binding, shape: ImageShape, query: &ImageQuery) {
        let images = self.resources.images;
        let varying = dst.iter().any(|reg| self.slot(*reg).is_varying());
        for chunk in 0..if varying { self.file.width() } else { 1 } {
            let bound = self.bind_points(image, chunk);
            let answers: [Lanes; 4] = match query {
                ImageQuery::Lod {
                    sampler,
                    coordinate,
                } => self.query_lod(&bound, sampler, coordinate, shape, chunk),
                ImageQuery::Size { level } => {
                    let levels = self.words_or_zero(*level, chunk);
                    let sizes: [[u32; 4]; CHUNK_LANES] =
                        std::array::from_fn(|lane| images.size(bound[lane], shape, levels[lane]));
                    std::array::from_fn(|axis| sizes.map(|size| size[axis]))
                }
                ImageQuery::Levels => [bound.map(|image| images.levels(image)); 4],
                ImageQuery::Samples => [bound.map(|image| images.samples(image)); 4],
            };
            for (reg, answer) in dst.iter().zip(answers) {
                self.file.set(self.slot(*reg), chunk, answer);
            }
        }
    }

    fn query_lod(
        &self,
        images: &Lanes,
        sampler: &Binding,
        coordinate: &[Reg],
        shape: ImageShape,
        chunk: usize,
    ) -> [Lanes; 4] {
        let samplers = self.bind_points(sampler, chunk);
        let mut request = SampleRequest {
            mask: 0,
            shape,
            coordinate: self.all_words(coordinate, chunk),
            lod: LodRequest::Implicit {
                bias: [0; CHUNK_LANES],
                minimum: [0; CHUNK_LANES],
            },
            offset: [[0; CHUNK_LANES]; 3],
            compare: None,
            gather: None,
        };
        let mut answers = [[0; CHUNK_LANES]; 4];
        let active = self.masks.chunk(MaskId::ACTIVE, chunk);
        self.for_each_binding(images, &samplers, active, |image, sampler, lanes| {
            request.mask = lanes;
            let [clamped, unclamped] = self.resources.images.lod(image, sampler, &request);
            merge(
                &mut answers,
                &[clamped, unclamped, [0; CHUNK_LANES], [0; CHUNK_LANES]],
                lanes,
            );
        });
        answers
    }
}

/// The bind point that all lanes mean, if no index tells.
fn fixed_point(binding: &Binding) -> Option<u32> {
    (binding.index.is_none() && binding.count > 0).then_some(binding.slot)
}

/// Whether the level of detail comes from differences alone.
fn is_automatic(lod: &Lod) -> bool {
    matches!(
        lod,
        Lod::Implicit {
            bias: None,
            minimum: None
        }
    )
}

/// Takes some lanes of what was found.
fn merge<const N: usize>(into: &mut [Lanes; N], found: &[Lanes; N], lanes: u16) {
    for (into, found) in into.iter_mut().zip(found) {
        lanes_of(lanes).for_each(|lane| into[lane] = found[lane]);
    }
}
