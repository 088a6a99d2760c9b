//! Image instructions: gathers operands of 16 lanes and calls the image unit once for each image among them.

use super::batch::Batch;
use super::masks::lanes_of;
use crate::compiler::step::MaskId;
use crate::ir::{Binding, ImageAtomic, ImageQuery, ImageRead, ImageShape, ImageWrite, Lod, Reg, Sample, VECTOR_LANES};
use crate::resources::{LaneWords, LodRequest, SampleRequest, TexelRequest};

/// The bind point that means none.
const UNBOUND: u32 = u32::MAX;

#[inline(always)]
fn words(batch: &Batch<'_>, reg: Reg, vector: usize) -> LaneWords {
    batch.file.lanes(batch.slot(reg), vector)
}

#[inline(always)]
fn words_or_zero(batch: &Batch<'_>, reg: Option<Reg>, vector: usize) -> LaneWords {
    match reg {
        Some(reg) => words(batch, reg, vector),
        None => [0; VECTOR_LANES],
    }
}

#[inline(always)]
fn all_words<const N: usize>(batch: &Batch<'_>, regs: &[Reg], vector: usize) -> [LaneWords; N] {
    let mut all = [[0; VECTOR_LANES]; N];
    for (words_of_one, reg) in all.iter_mut().zip(regs) {
        *words_of_one = words(batch, *reg, vector);
    }
    all
}

/// The bind points of 16 lanes.
fn bind_points(batch: &Batch<'_>, binding: &Binding, vector: usize) -> LaneWords {
    let indices = words_or_zero(batch, binding.index, vector);
    indices.map(|index| if index < binding.count { binding.slot + index } else { UNBOUND })
}

/// Calls `ask(image, sampler, lanes)` for each pair of bind points among `lanes`.
fn for_each_binding(images: &LaneWords, samplers: &LaneWords, mut lanes: u16, mut ask: impl FnMut(u32, u32, u16)) {
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
fn put_texel(batch: &Batch<'_>, dst: &[Option<Reg>; 4], vector: usize, texel: &[LaneWords; 4]) {
    for (index, lanes) in texel.iter().enumerate() {
        if let Some(reg) = dst[index] {
            batch.file.set(batch.slot(reg), vector, *lanes);
        }
    }
}

fn lod_request(batch: &Batch<'_>, lod: &Lod, vector: usize) -> LodRequest {
    match lod {
        Lod::Implicit { bias, minimum } => LodRequest::Implicit {
            bias: words_or_zero(batch, *bias, vector),
            minimum: words_or_zero(batch, *minimum, vector),
        },
        Lod::Explicit(level) => LodRequest::Explicit(words(batch, *level, vector)),
        Lod::Gradient { dx, dy, minimum } => LodRequest::Gradient {
            dx: all_words(batch, dx, vector),
            dy: all_words(batch, dy, vector),
            minimum: words_or_zero(batch, *minimum, vector),
        },
    }
}

#[inline(always)]
pub fn sample(batch: &Batch<'_>, sample: &Sample) {
    // Fields that aren't operands keep these values for all vectors.
    let mut request = SampleRequest {
        mask: 0,
        shape: sample.shape,
        coordinate: [[0; VECTOR_LANES]; 4],
        lod: LodRequest::Automatic,
        offset: [[0; VECTOR_LANES]; 3],
        compare: None,
        gather: sample.gather,
    };
    let bound = fixed_point(&sample.image).zip(fixed_point(&sample.sampler));
    let mut texel = [[0; VECTOR_LANES]; 4];
    for vector in 0..batch.file.width() {
        let active = batch.masks.bits(MaskId::ACTIVE, vector);
        if active == 0 {
            continue;
        }
        for (index, reg) in sample.coordinate.iter().enumerate().take(4) {
            request.coordinate[index] = words(batch, *reg, vector);
        }
        for (index, reg) in sample.offset.iter().enumerate().take(3) {
            request.offset[index] = words(batch, *reg, vector);
        }
        if !is_automatic(&sample.lod) {
            request.lod = lod_request(batch, &sample.lod, vector);
        }
        if let Some(reg) = sample.compare {
            request.compare = Some(words(batch, reg, vector));
        }
        match bound {
            Some((image, sampler)) => {
                request.mask = active;
                batch.resources.images.sample(image, sampler, &request, &mut texel);
            }
            None => texel = sample_each(batch, sample, &mut request, vector, active),
        }
        put_texel(batch, &sample.dst, vector, &texel);
    }
}

/// Samples for 16 lanes that may use different images or samplers.
#[inline(never)]
fn sample_each(
    batch: &Batch<'_>,
    sample: &Sample,
    request: &mut SampleRequest,
    vector: usize,
    active: u16,
) -> [LaneWords; 4] {
    let images = bind_points(batch, &sample.image, vector);
    let samplers = bind_points(batch, &sample.sampler, vector);
    let (mut texel, mut found) = ([[0; VECTOR_LANES]; 4], [[0; VECTOR_LANES]; 4]);
    for_each_binding(&images, &samplers, active, |image, sampler, lanes| {
        request.mask = lanes;
        batch.resources.images.sample(image, sampler, request, &mut found);
        merge(&mut texel, &found, lanes);
    });
    texel
}

/// A request for texels. Coordinates, levels and samples that are not operands keep these values for all vectors.
fn no_texels(shape: ImageShape) -> TexelRequest {
    let zero = [0; VECTOR_LANES];
    TexelRequest { mask: 0, shape, coordinate: [zero; 4], level: zero, sample: zero }
}

/// Sets the position of the texels that 16 lanes access.
#[inline(always)]
fn place(
    request: &mut TexelRequest,
    batch: &Batch<'_>,
    coordinate: &[Reg],
    level: Option<Reg>,
    sample: Option<Reg>,
    vector: usize,
) {
    for (lanes, reg) in request.coordinate.iter_mut().zip(coordinate) {
        *lanes = words(batch, *reg, vector);
    }
    if let Some(level) = level {
        request.level = words(batch, level, vector);
    }
    if let Some(sample) = sample {
        request.sample = words(batch, sample, vector);
    }
}

#[inline(always)]
pub fn read(batch: &Batch<'_>, read: &ImageRead) {
    let mut request = no_texels(read.shape);
    let bound = fixed_point(&read.image);
    let mut texel = [[0; VECTOR_LANES]; 4];
    for vector in 0..batch.file.width() {
        let active = batch.masks.bits(MaskId::ACTIVE, vector);
        if active == 0 {
            continue;
        }
        place(&mut request, batch, &read.coordinate, read.level, read.sample, vector);
        match bound {
            Some(image) => {
                request.mask = active;
                batch.resources.images.read(image, &request, &mut texel);
            }
            None => texel = read_each(batch, read, &mut request, vector, active),
        }
        put_texel(batch, &read.dst, vector, &texel);
    }
}

/// Reads for 16 lanes that may use different images.
#[inline(never)]
fn read_each(
    batch: &Batch<'_>,
    read: &ImageRead,
    request: &mut TexelRequest,
    vector: usize,
    active: u16,
) -> [LaneWords; 4] {
    let images = bind_points(batch, &read.image, vector);
    let (mut texel, mut found) = ([[0; VECTOR_LANES]; 4], [[0; VECTOR_LANES]; 4]);
    for_each_binding(&images, &[0; VECTOR_LANES], active, |image, _, lanes| {
        request.mask = lanes;
        batch.resources.images.read(image, request, &mut found);
        merge(&mut texel, &found, lanes);
    });
    texel
}

#[inline(always)]
pub fn write(batch: &Batch<'_>, write: &ImageWrite) {
    let mut request = no_texels(write.shape);
    let bound = fixed_point(&write.image);
    for vector in 0..batch.file.width() {
        let lanes = batch.masks.writing(vector);
        if lanes == 0 {
            continue;
        }
        place(&mut request, batch, &write.coordinate, None, write.sample, vector);
        let texel = all_words(batch, &write.texel, vector);
        if let Some(image) = bound {
            request.mask = lanes;
            batch.resources.images.write(image, &request, &texel);
            continue;
        }
        write_each(batch, write, &mut request, vector, &texel);
    }
}

/// Writes for 16 lanes that may use different images.
#[inline(never)]
fn write_each(
    batch: &Batch<'_>,
    write: &ImageWrite,
    request: &mut TexelRequest,
    vector: usize,
    texel: &[LaneWords; 4],
) {
    let images = bind_points(batch, &write.image, vector);
    for_each_binding(&images, &[0; VECTOR_LANES], batch.masks.writing(vector), |image, _, lanes| {
        request.mask = lanes;
        batch.resources.images.write(image, request, texel);
    });
}

pub fn atomic(batch: &Batch<'_>, atomic: &ImageAtomic) {
    let mut request = no_texels(atomic.shape);
    for vector in 0..batch.file.width() {
        let lanes = batch.masks.writing(vector);
        let images = bind_points(batch, &atomic.image, vector);
        place(&mut request, batch, &atomic.coordinate, None, atomic.sample, vector);
        let value = words(batch, atomic.value, vector);
        let comparator = words_or_zero(batch, atomic.comparator, vector);
        let mut old = [[0; VECTOR_LANES]];
        for_each_binding(&images, &[0; VECTOR_LANES], lanes, |image, _, lanes| {
            request.mask = lanes;
            let found = batch.resources.images.atomic(image, &request, atomic.op, &value, &comparator);
            merge(&mut old, &[found], lanes);
        });
        if let Some(dst) = atomic.dst {
            batch.file.set(batch.slot(dst), vector, old[0]);
        }
    }
}

pub fn query(batch: &Batch<'_>, dst: &[Reg], image: &Binding, shape: ImageShape, query: &ImageQuery) {
    let images = batch.resources.images;
    let varying = dst.iter().any(|reg| batch.slot(*reg).is_varying());
    for vector in 0..if varying { batch.file.width() } else { 1 } {
        let bound = bind_points(batch, image, vector);
        let answers: [LaneWords; 4] = match query {
            ImageQuery::Lod { sampler, coordinate } => query_lod(batch, &bound, sampler, coordinate, shape, vector),
            ImageQuery::Size { level } => {
                let levels = words_or_zero(batch, *level, vector);
                let sizes: [[u32; 4]; VECTOR_LANES] =
                    std::array::from_fn(|lane| images.size(bound[lane], shape, levels[lane]));
                std::array::from_fn(|axis| sizes.map(|size| size[axis]))
            }
            ImageQuery::Levels => [bound.map(|image| images.levels(image)); 4],
            ImageQuery::Samples => [bound.map(|image| images.samples(image)); 4],
        };
        for (reg, answer) in dst.iter().zip(answers) {
            batch.file.set(batch.slot(*reg), vector, answer);
        }
    }
}

fn query_lod(
    batch: &Batch<'_>,
    images: &LaneWords,
    sampler: &Binding,
    coordinate: &[Reg],
    shape: ImageShape,
    vector: usize,
) -> [LaneWords; 4] {
    let samplers = bind_points(batch, sampler, vector);
    let mut request = SampleRequest {
        mask: 0,
        shape,
        coordinate: all_words(batch, coordinate, vector),
        lod: LodRequest::Implicit { bias: [0; VECTOR_LANES], minimum: [0; VECTOR_LANES] },
        offset: [[0; VECTOR_LANES]; 3],
        compare: None,
        gather: None,
    };
    let mut answers = [[0; VECTOR_LANES]; 4];
    let active = batch.masks.bits(MaskId::ACTIVE, vector);
    for_each_binding(images, &samplers, active, |image, sampler, lanes| {
        request.mask = lanes;
        let [clamped, unclamped] = batch.resources.images.lod(image, sampler, &request);
        merge(&mut answers, &[clamped, unclamped, [0; VECTOR_LANES], [0; VECTOR_LANES]], lanes);
    });
    answers
}

/// The bind point of all lanes, if the binding has no index.
#[inline(always)]
fn fixed_point(binding: &Binding) -> Option<u32> {
    (binding.index.is_none() && binding.count > 0).then_some(binding.slot)
}

/// Reports whether the level of detail comes from differences alone.
fn is_automatic(lod: &Lod) -> bool {
    matches!(lod, Lod::Implicit { bias: None, minimum: None })
}

/// Copies the found values of some lanes into the result.
fn merge<const N: usize>(into: &mut [LaneWords; N], found: &[LaneWords; N], lanes: u16) {
    for (into, found) in into.iter_mut().zip(found) {
        lanes_of(lanes).for_each(|lane| into[lane] = found[lane]);
    }
}
