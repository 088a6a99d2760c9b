//! Identities of Gaussians, for resolve shaders that ask which ones a pixel shows, and how far away they are.

use crate::gaussian::set::GaussianSet;
use crate::packet::IndexStream;
use devmem::host;

/// A Gaussian that is drawn, among those of its set.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Identity {
    /// The depth variable, rounded to binary32; finite.
    pub(crate) z: f32,
    /// Its number in the set.
    pub(crate) sequence: u32,
}

impl Identity {
    /// The identity of a Gaussian with a depth variable and a number in the set. Sums add products of depth variables and weights
    /// that may be zero, so that none is infinite.
    pub(crate) fn new(z: f64, sequence: u32) -> Self {
        Self { z: (z as f32).clamp(f32::MIN, f32::MAX), sequence }
    }
}

/// The draws of a set, by which the number of a Gaussian becomes a vertex and an instance.
#[derive(Debug)]
pub(crate) struct Origins(Vec<Origin>);

/// A draw of a set.
#[derive(Debug)]
struct Origin {
    /// The number of its first Gaussian in the set.
    start: u64,
    /// The first vertex, or the first index.
    first: u32,
    /// Vertices of an instance.
    count: u32,
    first_instance: u32,
    indices: Option<IndexStream>,
}

impl Origins {
    /// The draws of a set, in the order of the numbers of their Gaussians.
    pub(crate) fn new(set: &GaussianSet) -> Self {
        let mut origins = host::with_capacity(set.appends.len() + set.draws.len());
        let mut start = 0;
        let appends = set.appends.iter().map(|append| {
            let indices = append.indices.clone();
            let instances = [append.first_instance, append.instance_count];
            (append.first, append.count, instances, indices)
        });
        let draws = set.draws.iter().map(|draw| {
            let instances = [draw.first_instance, draw.instance_count];
            (draw.first, draw.count, instances, draw.indices.clone())
        });
        for (first, count, [first_instance, instance_count], indices) in appends.chain(draws) {
            origins.push(Origin { start, first, count, first_instance, indices });
            start += u64::from(count) * u64::from(instance_count);
        }
        Self(origins)
    }

    /// The vertex index and the instance index of Gaussian `sequence` of the set, as vertex shaders have them.
    pub(crate) fn locate(&self, sequence: u32) -> [u32; 2] {
        let sequence = u64::from(sequence);
        let after = self.0.partition_point(|origin| origin.start <= sequence);
        let Some(origin) = after.checked_sub(1).and_then(|at| self.0.get(at)) else {
            return [0; 2];
        };
        let within = sequence - origin.start;
        let count = u64::from(origin.count.max(1));
        let instance = origin.first_instance.wrapping_add((within / count) as u32);
        let place = u64::from(origin.first) + within % count;
        let vertex = match &origin.indices {
            None => place as u32,
            Some(stream) => {
                let mut index = Vec::new();
                stream.read(place, 1, &mut index);
                let index = index.first().copied().unwrap_or(0);
                index.wrapping_add_signed(stream.vertex_offset)
            }
        };
        [vertex, instance]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use devmem::Allocation;
    use devmem::BufferRange;

    #[gaurast_runner::test]
    fn depth_variables_are_finite() {
        let z = [1e300, -1e300, f64::INFINITY, 0.1].map(|z| Identity::new(z, 0).z);
        assert_eq!(z, [f32::MAX, f32::MIN, f32::MAX, 0.1]);
    }

    #[gaurast_runner::test]
    fn numbers_become_vertices_and_instances_of_their_draws() {
        let memory = Allocation::new(16, true).expect("memory");
        let indices: [u32; 4] = [7, 5, 3, 1];
        memory.write(0, &indices).expect("it fits");
        let stream = IndexStream {
            buffer: BufferRange { memory, offset: 0, size: 16 },
            index_size: 4,
            vertex_offset: -1,
            restart: None,
        };
        let origin =
            |start, first, count, first_instance, indices| Origin { start, first, count, first_instance, indices };
        let origins = Origins(vec![origin(0, 10, 3, 4, None), origin(6, 1, 2, 0, Some(stream))]);
        let expected = [[10, 4], [11, 4], [12, 4], [10, 5], [11, 5], [12, 5], [4, 0], [2, 0]];
        for (sequence, expected) in (0..).zip(expected) {
            assert_eq!(origins.locate(sequence), expected, "{sequence}");
        }
    }
}
