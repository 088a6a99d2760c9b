//! Groups of a set's Gaussians: where they are read from, and their attributes.

use super::attributes::{Attributes, Fetcher, GroupVertices};
use super::clusters::Cluster;
use super::harmonics::{CoefficientReader, Harmonics};
use super::models::Matrices;
use crate::gaussian::spherical_harmonics::{COEFFICIENT_FLOATS, coefficient_count};
use crate::packet::GaussianAppend;

/// The source of a group's attributes.
#[derive(Clone)]
pub(crate) struct GroupSource<'a> {
    pub(crate) append: &'a GaussianAppend,
    /// The instance of the first Gaussian.
    pub(crate) instance: u32,
    /// The number in the set of that instance's first Gaussian.
    pub(crate) sequence: u32,
    pub(crate) members: Members<'a>,
    /// True if the cluster holds the append's spherical harmonics.
    pub(crate) has_harmonics: bool,
}

/// The Gaussians of a group.
#[derive(Clone, Copy)]
pub(crate) enum Members<'a> {
    /// Consecutive Gaussians, which may go on in the next instances.
    Run(MemberRun),
    /// The Gaussians of a cluster of the instance.
    Cluster(&'a Cluster),
}

/// Consecutive Gaussians.
#[derive(Clone, Copy)]
pub(crate) struct MemberRun {
    /// The place of the first one in its instance.
    pub(crate) start: u32,
    /// The number of Gaussians, at most [`GROUP`].
    pub(crate) len: u32,
}

/// The numbers in the set of a group's Gaussians.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Sequence<'a> {
    /// Consecutive numbers, from this one on.
    From(u32),
    /// These numbers, counted from the first one.
    Listed(u32, &'a [u32]),
}

/// The attributes of a group of Gaussians.
pub(crate) struct GroupAttributes<'a> {
    /// The reader of the Gaussians' spherical harmonics.
    pub(crate) reader: CoefficientReader<'a>,
    pub(crate) vertices: GroupVertices<'a>,
    pub(crate) attributes: &'a Attributes,
    /// The model matrices of the Gaussians, if there are any.
    pub(crate) matrices: Option<&'a Matrices>,
    /// True if all attributes are valid, so that no Gaussian is skipped because of them.
    pub(crate) is_sound: bool,
    /// The spherical harmonics of the Gaussians, if they are in host memory already.
    pub(crate) harmonics: Harmonics<'a>,
}

impl<'a> GroupSource<'a> {
    /// Reads the group, unless its cluster holds the attributes, and the model's attributes.
    pub(crate) fn read<'b>(
        &'b self,
        fetcher: &mut Fetcher,
        attributes: &'b mut Attributes,
        matrices: &'b mut Option<Box<Matrices>>,
        is_surfel: bool,
    ) -> GroupAttributes<'b> {
        let streams = &self.append.attributes;
        let vertices = match self.members {
            Members::Run(run) => GroupVertices::new(self.append, self.instance, run.start, run.len as usize),
            Members::Cluster(cluster) => GroupVertices::of_cluster(self.append, self.instance, &cluster.numbers),
        };
        let matrices = streams.model.matrix.as_ref().map(|rows| {
            let matrices = matrices.get_or_insert_default();
            matrices.read(fetcher, rows, &vertices);
            &**matrices
        });
        let is_faded = streams.model.opacity.is_some();
        let harmonics = match self.members {
            Members::Cluster(cluster) if self.has_harmonics => cluster.harmonics(),
            _ => Harmonics::default(),
        };
        let (attributes, is_sound) = match self.members {
            Members::Cluster(cluster) if !is_faded => (&cluster.attributes, cluster.is_sound),
            Members::Cluster(cluster) => {
                attributes.clone_from(&cluster.attributes);
                fetcher.fade(streams, &vertices, attributes);
                // Products of finite numbers may overflow.
                (&*attributes, false)
            }
            Members::Run(_) => {
                fetcher.read_own(streams, &vertices, attributes);
                fetcher.fade(streams, &vertices, attributes);
                if is_surfel {
                    attributes.scale[2][..vertices.len].fill(0.0);
                }
                (&*attributes, false)
            }
        };
        let reader = CoefficientReader::new(streams, &mut fetcher.codebooks);
        GroupAttributes { reader, vertices, attributes, matrices, is_sound, harmonics }
    }

    /// The numbers of the group's Gaussians in the set.
    pub(crate) fn sequence(&self) -> Sequence<'a> {
        match self.members {
            Members::Run(run) => Sequence::From(self.sequence.wrapping_add(run.start)),
            Members::Cluster(cluster) => Sequence::Listed(self.sequence, &cluster.numbers),
        }
    }
}

impl GroupAttributes<'_> {
    /// Reads the spherical harmonics of a lane into `read`, and zeros where the draw has fewer, and returns `read`.
    #[inline(never)]
    pub(crate) fn read_harmonics<'b>(&self, lane: usize, read: &'b mut [f32; COEFFICIENT_FLOATS]) -> &'b [f32] {
        let floats = self.reader.floats();
        match self.harmonics.from(lane).get(..floats) {
            Some(last) if floats > 0 => read[..floats].copy_from_slice(last),
            _ => self.reader.read(&self.vertices, lane, read),
        }
        read
    }

    /// Starts to load the spherical harmonics of degrees 0 to `degree` into the processor's cache, for the lanes that
    /// have a bit in `kept`.
    #[inline(always)]
    pub(crate) fn prefetch_harmonics(&self, degree: u32, lanes: &[usize], kept: u64) {
        let count = coefficient_count(degree);
        if let [first, .., last] = *lanes
            && last - first == lanes.len() - 1
            && let Some(floats) = self.harmonics.of_all(first..=last, 3 * count)
        {
            return devmem::prefetch(floats);
        }
        for (number, &lane) in lanes.iter().enumerate() {
            if kept >> number & 1 == 0 {
                continue;
            }
            match self.harmonics.from(lane) {
                [] => self.reader.prefetch(&self.vertices, lane, count),
                floats => devmem::prefetch(&floats[..floats.len().min(3 * count)]),
            }
        }
    }
}
