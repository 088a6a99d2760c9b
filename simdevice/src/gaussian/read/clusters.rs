//! The frustum: planes that bound the part of space that a picture can show. A few operations show that a Gaussian, or
//! a cluster of them, is off the screen. The test is conservative: whatever is not certainly outside counts as inside.

use super::attributes::{Attributes, Fetcher, GroupVertices};
use super::fingerprint::SourceFingerprint;
use super::harmonics::{CoefficientReader, Harmonics, floats};
use super::morton::morton_order;
use crate::gaussian::lanes::GROUP;
use crate::gaussian::spherical_harmonics::COEFFICIENT_FLOATS;
use crate::packet::GaussianAppend;
use devmem::host;
use rayon::prelude::*;

/// Bounds of the Gaussians of a cluster. Gaussians that are never drawn are left out.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bounds {
    /// The least coordinates of the means.
    pub(crate) low: [f32; 3],
    /// The greatest coordinates of the means.
    pub(crate) high: [f32; 3],
    /// The greatest scale.
    pub(crate) scale: f32,
    /// The greatest opacity.
    pub(crate) opacity: f32,
}

/// A group of Gaussians that are near one another.
#[derive(Debug)]
pub(crate) struct Cluster {
    /// The vertices' numbers, relative to the draw's first vertex.
    pub(crate) numbers: Vec<u32>,
    pub(crate) attributes: Attributes,
    /// Spherical harmonics, if the budget allows them: for each Gaussian as many floats as
    /// [`CoefficientReader::floats`] says.
    harmonics: Vec<f32>,
    pub(crate) bounds: Bounds,
    /// True if the attributes of all its Gaussians are valid, so that none is skipped because of them.
    pub(crate) is_sound: bool,
}

/// The clusters of all Gaussians of a draw without indices.
#[derive(Debug)]
pub(crate) struct Clusters {
    /// The sources of the spherical harmonics that the clusters hold, in the order of coefficients.
    harmonics: Vec<SourceFingerprint>,
    pub(crate) clusters: Vec<Cluster>,
    /// Copies of the large and opaque Gaussians, which hide others best.
    pub(crate) occluders: Vec<Cluster>,
    /// The greatest opacity.
    pub(crate) opacity: f32,
}

/// The least opacity of an occluder.
const OCCLUDER_OPACITY: f32 = 0.5;

/// The most occluders of a draw of `count` Gaussians. More would cost more time than they save.
fn max_occluders(count: usize) -> usize {
    (count / 16).min(8 * 1024)
}

/// The bytes of host memory that clusters of `append`'s Gaussians take, with or without spherical harmonics.
pub(crate) fn memory_bytes(append: &GaussianAppend, with_harmonics: bool) -> u64 {
    let floats = if with_harmonics { floats(&append.attributes.spherical_harmonics) } else { 0 };
    let cluster = size_of::<Cluster>() + 4 * GROUP * (1 + floats);
    let occluder = size_of::<Cluster>() + 4 * GROUP;
    let clusters = |count: u64| count.div_ceil(GROUP as u64);
    let occluders = clusters(max_occluders(append.count as usize) as u64);
    clusters(append.count.into()) * cluster as u64 + occluders * occluder as u64
}

/// The most Gaussians of a draw whose clusters are built in one piece. More would delay a picture noticeably.
const AT_ONCE: usize = 64 * 1024;

/// The number of Gaussians in a piece. That of a larger draw is so small that a picture takes about a tenth longer, but
/// there are at most sixteen pieces, since pictures take longer until all exist.
fn piece_size(count: usize) -> usize {
    if count <= AT_ONCE {
        return AT_ONCE;
    }
    let sixteenth = count.div_ceil(16).next_multiple_of(GROUP);
    sixteenth.max(AT_ONCE / 2)
}

/// The input of a cluster builder, the same for every piece.
#[derive(Clone, Copy)]
pub(crate) struct ClusterSource<'a> {
    /// An append without indices. Its model's transform is not applied, and has no attribute per vertex.
    pub(crate) append: &'a GaussianAppend,
    /// True for 2D Gaussians: their third scales are taken as zero.
    pub(crate) is_surfel: bool,
    pub(crate) with_harmonics: bool,
}

/// Builds clusters a piece at a time.
#[derive(Debug, Default)]
pub(crate) struct ClusterBuilder {
    /// The order of Gaussians in the clusters, once it is computed.
    order: Option<Vec<u32>>,
    clusters: Vec<Cluster>,
}

impl ClusterBuilder {
    /// Builds the next piece: the order first, then some clusters each time; both at once if there are at most
    /// [`AT_ONCE`] Gaussians. Returns the number of clusters that it built.
    pub(crate) fn advance(&mut self, source: ClusterSource<'_>) -> usize {
        let count = source.append.count as usize;
        let order = match &self.order {
            Some(order) => order,
            None => {
                let order = self.order.insert(morton_order(source.append));
                if count > AT_ONCE {
                    return 0;
                }
                order
            }
        };
        let done = self.clusters.len();
        let rest = order.get(done * GROUP..).unwrap_or_default();
        let piece = &rest[..rest.len().min(piece_size(count))];
        let mut clusters = host::with_capacity(piece.len().div_ceil(GROUP));
        piece
            .par_chunks(GROUP)
            .map_init(Fetcher::default, |fetcher, numbers| Cluster::read(source, fetcher, numbers))
            .collect_into_vec(&mut clusters);
        host::reserve(&mut self.clusters, count.div_ceil(GROUP) - done);
        self.clusters.extend(clusters);
        self.clusters.len() - done
    }

    /// All clusters, once the last of them is built.
    pub(crate) fn finish(&mut self, source: ClusterSource<'_>) -> Option<Clusters> {
        let count = source.append.count as usize;
        if self.clusters.len() < count.div_ceil(GROUP) {
            return None;
        }
        let clusters = std::mem::take(self).clusters;
        let opacities = clusters.iter().map(|cluster| cluster.bounds.opacity);
        let occluders = occluders(&clusters, max_occluders(count));
        let shapes = ClusterSource { with_harmonics: false, ..source };
        let occluders = occluders.chunks(GROUP).map(|numbers| Cluster::read(shapes, &mut Fetcher::default(), numbers));
        let harmonics = &source.append.attributes.spherical_harmonics;
        Some(Clusters {
            harmonics: match source.with_harmonics {
                true => harmonics.iter().map(SourceFingerprint::new).collect(),
                false => Vec::new(),
            },
            opacity: opacities.fold(0.0, f32::max),
            occluders: host::collect(occluders),
            clusters,
        })
    }
}

impl Clusters {
    /// True if the clusters hold the spherical harmonics of `append`, perhaps with those of higher degrees.
    pub(crate) fn have_harmonics_of(&self, append: &GaussianAppend) -> bool {
        let drawn = &append.attributes.spherical_harmonics;
        let mut both = drawn.iter().zip(&self.harmonics);
        drawn.len() <= self.harmonics.len() && both.all(|(a, b)| SourceFingerprint::new(a).is_same(b))
    }
}

/// The numbers of at most `most` Gaussians that may hide others, in the order of clusters: of those that are opaque
/// enough, the ones with the greatest second largest scale.
fn occluders(clusters: &[Cluster], most: usize) -> Vec<u32> {
    let opaque = || {
        clusters.iter().flat_map(|cluster| {
            (0..cluster.numbers.len())
                .filter(|&lane| cluster.attributes.opacity[lane] >= OCCLUDER_OPACITY)
                .map(|lane| (cluster.attributes.second_scale(lane), cluster.numbers[lane]))
        })
    };
    let mut seconds: Vec<f32> = host::collect(opaque().map(|(second, _)| second));
    let mut least = 0.0;
    if let Some(rest) = seconds.len().checked_sub(most).filter(|_| most > 0) {
        least = *seconds.select_nth_unstable_by(rest, f32::total_cmp).1;
    }
    let large = opaque().filter(|(second, _)| *second >= least);
    host::collect(large.take(most).map(|(_, number)| number))
}

impl Cluster {
    fn read(source: ClusterSource<'_>, fetcher: &mut Fetcher, numbers: &[u32]) -> Self {
        let ClusterSource { append, is_surfel, with_harmonics } = source;
        let group = GroupVertices::of_cluster(append, append.first_instance, numbers);
        let mut attributes = Attributes::default();
        fetcher.read_own(&append.attributes, &group, &mut attributes);
        if is_surfel {
            attributes.scale[2].fill(0.0);
        }
        let mut bounds = Bounds { low: [f32::INFINITY; 3], high: [f32::NEG_INFINITY; 3], scale: 0.0, opacity: 0.0 };
        let mut is_sound = true;
        for lane in 0..numbers.len() {
            let at = |lanes: &[f32; GROUP]| lanes[lane];
            let position = attributes.position.each_ref().map(at);
            let scale = attributes.scale.each_ref().map(at);
            let rotation = attributes.rotation.each_ref().map(at);
            let opacity = attributes.opacity[lane];
            let finite = |values: &[f32]| values.iter().all(|value| value.is_finite());
            let sound = finite(&position)
                && finite(&scale)
                && finite(&rotation)
                && opacity.is_finite()
                && rotation.iter().any(|&part| part != 0.0)
                && scale.iter().all(|&scale| scale >= 0.0);
            if !sound {
                is_sound = false;
                continue;
            }
            for (axis, position) in position.into_iter().enumerate() {
                bounds.low[axis] = bounds.low[axis].min(position);
                bounds.high[axis] = bounds.high[axis].max(position);
            }
            bounds.scale = scale.into_iter().fold(bounds.scale, f32::max);
            bounds.opacity = bounds.opacity.max(opacity);
        }
        let mut harmonics = Vec::new();
        if with_harmonics {
            let reader = CoefficientReader::new(&append.attributes, &mut fetcher.codebooks);
            let mut coefficients = [0.0; COEFFICIENT_FLOATS];
            host::reserve(&mut harmonics, reader.floats() * numbers.len());
            for lane in 0..numbers.len() {
                reader.read(&group, lane, &mut coefficients);
                harmonics.extend(&coefficients[..reader.floats()]);
            }
        }
        Self { numbers: numbers.to_vec(), attributes, harmonics, bounds, is_sound }
    }
}

impl Cluster {
    /// The spherical harmonics of all lanes; empty if the cluster does not hold them.
    pub(crate) fn harmonics(&self) -> Harmonics<'_> {
        let stride = self.harmonics.len() / self.numbers.len().max(1);
        Harmonics::new(&self.harmonics, stride)
    }

    /// A cluster of one lane of another, with the other's bounds and without harmonics.
    pub(crate) fn of_one(from: &Self, lane: usize) -> Self {
        let mut cluster = Self {
            numbers: host::with_capacity(GROUP),
            attributes: Attributes::default(),
            harmonics: Vec::new(),
            bounds: from.bounds,
            is_sound: true,
        };
        cluster.push(from, lane);
        cluster
    }

    /// Adds a lane of another cluster. `bounds` stays as it is.
    pub(crate) fn push(&mut self, from: &Self, lane: usize) {
        self.attributes.copy_lane(self.numbers.len(), &from.attributes, lane);
        host::push(&mut self.numbers, from.numbers[lane]);
        self.is_sound &= from.is_sound;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::Format;
    use crate::packet::{AttributeStream, GaussianAttributes, ModelAttributes};
    use devmem::Allocation;
    use devmem::BufferRange;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use std::sync::Arc;

    /// A draw of `count` Gaussians with random attributes.
    fn append(count: usize) -> GaussianAppend {
        const FLOATS: usize = 14;
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let floats: Vec<f32> = (0..FLOATS * count).map(|_| rng.random()).collect();
        let size = 4 * floats.len() as u64;
        let memory = Allocation::new(size, false).unwrap();
        memory.write(0, &floats).unwrap();
        let stream = |float: u32, format| AttributeStream {
            buffer: BufferRange { memory: Arc::clone(&memory), offset: 0, size },
            stride: 4 * FLOATS as u32,
            offset: 4 * float,
            format,
            instance_divisor: None,
        };
        GaussianAppend {
            attributes: GaussianAttributes {
                position: stream(0, Format::R32G32B32Sfloat),
                scale: stream(3, Format::R32G32B32Sfloat),
                rotation: stream(6, Format::R32G32B32A32Sfloat),
                opacity: stream(10, Format::R32Sfloat),
                model: ModelAttributes::default(),
                activations: Default::default(),
                tables: None,
                spherical_harmonics: vec![stream(11, Format::R32G32B32Sfloat)],
            },
            indices: None,
            first: 0,
            count: count as u32,
            first_instance: 0,
            instance_count: 1,
        }
    }

    /// The number of clusters that each piece made, and all clusters.
    fn pieces(append: &GaussianAppend) -> (Vec<usize>, Clusters) {
        let source = ClusterSource { append, is_surfel: false, with_harmonics: true };
        let (mut builder, mut made) = (ClusterBuilder::default(), Vec::new());
        loop {
            made.push(builder.advance(source));
            if let Some(clusters) = builder.finish(source) {
                return (made, clusters);
            }
        }
    }

    #[gaurast_runner::test]
    fn pieces_make_a_cluster_of_every_gaussian() {
        for (count, expected) in
            [(700, vec![3]), (AT_ONCE, vec![AT_ONCE / GROUP]), (140_000, vec![0, 128, 128, 128, 128, 35])]
        {
            let append = append(count);
            let (made, clusters) = pieces(&append);
            assert_eq!(made, expected);
            let numbers = clusters.clusters.iter().flat_map(|own| &own.numbers);
            let mut numbers: Vec<u32> = numbers.copied().collect();
            assert_eq!(numbers, morton_order(&append));
            numbers.sort_unstable();
            assert!(numbers.into_iter().eq(0..count as u32));
            for cluster in &clusters.clusters {
                let number = u64::from(cluster.numbers[0]);
                let memory = &append.attributes.position.buffer.memory;
                let mut floats = [0.0f32; 14];
                memory.read(number * 56, &mut floats).unwrap();
                let position = cluster.attributes.position.each_ref().map(|x| x[0]);
                assert_eq!(position, floats[..3]);
                assert_eq!(cluster.attributes.opacity[0], floats[10]);
                assert_eq!(cluster.harmonics().from(0)[..3], floats[11..]);
            }
        }
    }

    #[gaurast_runner::test]
    fn pieces_are_sixteen_at_most() {
        for count in [AT_ONCE + 1, 1_000_000, 6_000_001] {
            assert!(count.div_ceil(piece_size(count)) <= 16, "{count}");
            assert_eq!(piece_size(count) % GROUP, 0);
        }
    }
}
