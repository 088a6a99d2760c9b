//! Query pools.

use crate::command::record::CopyQueryResults;
use ash::vk::{QueryPipelineStatisticFlags as Statistic, QueryResultFlags};
use simdevice::Packet;
use simdevice::packet::BufferRange;
use simdevice::stats::counters::Counter;
use simdevice::stats::query;
use simdevice::stats::query::{QueryKind, QueryResult};
use std::sync::Arc;

/// A query pool.
#[derive(Debug)]
pub(crate) struct QueryPool {
    /// The device's half.
    pub(crate) queries: Arc<query::QueryPool>,
    /// What results hold.
    contents: Contents,
}

/// What the results of a pool's queries hold.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Contents {
    /// The host's time, or the simulated hardware's.
    Timestamp,
    /// Counters as `VkPerformanceCounterResultKHR`s, in order.
    Performance(Vec<u32>),
    /// Counters as words, in order: occlusion and pipeline statistics. `None` counts what this device never does.
    Words(Vec<Option<Counter>>),
}

impl Contents {
    /// Samples that passed all tests. They are always counted exactly.
    pub(crate) fn occlusion() -> Self {
        Self::Words(vec![Some(Counter::SamplesPassed)])
    }

    /// Pipeline statistics, from the lowest flag to the highest.
    pub(crate) fn statistics(flags: Statistic) -> Self {
        const ALL: [(Statistic, Option<Counter>); 11] = [
            (
                Statistic::INPUT_ASSEMBLY_VERTICES,
                Some(Counter::InputVertices),
            ),
            (
                Statistic::INPUT_ASSEMBLY_PRIMITIVES,
                Some(Counter::InputPrimitives),
            ),
            (
                Statistic::VERTEX_SHADER_INVOCATIONS,
                Some(Counter::VertexInvocations),
            ),
            (Statistic::GEOMETRY_SHADER_INVOCATIONS, None),
            (Statistic::GEOMETRY_SHADER_PRIMITIVES, None),
            (
                Statistic::CLIPPING_INVOCATIONS,
                Some(Counter::ClippingInvocations),
            ),
            (
                Statistic::CLIPPING_PRIMITIVES,
                Some(Counter::ClippingPrimitives),
            ),
            (
                Statistic::FRAGMENT_SHADER_INVOCATIONS,
                Some(Counter::FragmentInvocations),
            ),
            (Statistic::TESSELLATION_CONTROL_SHADER_PATCHES, None),
            (Statistic::TESSELLATION_EVALUATION_SHADER_INVOCATIONS, None),
            (
                Statistic::COMPUTE_SHADER_INVOCATIONS,
                Some(Counter::ComputeInvocations),
            ),
        ];
        let counted = ALL.iter().filter(|(flag, _)| flags.contains(*flag));
        Self::Words(counted.map(|(_, counter)| *counter).collect())
    }

    fn kind(&self) -> QueryKind {
        match self {
            Self::Timestamp => QueryKind::Timestamp,
            Self::Performance(counters) if counters.iter().any(is_simulated) => {
                QueryKind::Simulated
            }
            Self::Performance(_) | Self::Words(_) => QueryKind::Performance,
        }
    }

    /// How many values a result has.
    fn count(&self) -> usize {
        match self {
            Self::Timestamp => 1,
            Self::Performance(counters) => counters.len(),
            Self::Words(counters) => counters.len(),
        }
    }
}

/// Whether a model of the hardware must run for a counter.
fn is_simulated(index: &u32) -> bool {
    let counter = Counter::ALL.get(*index as usize);
    counter.is_some_and(|counter| counter.is_simulated())
}

crate::objects! { ash::vk::QueryPool => QueryPool; }

impl QueryPool {
    /// A pool of `count` queries.
    pub(crate) fn new(contents: Contents, count: u32) -> Self {
        Self {
            queries: Arc::new(query::QueryPool::new(contents.kind(), count)),
            contents,
        }
    }

    /// Whether it has queries `first..first + count`.
    pub(crate) fn has(&self, first: u32, count: u32) -> bool {
        u64::from(first) + u64::from(count) <= u64::from(self.queries.count())
    }

    /// What Vulkan writes for a query: its values, as words of 32 or 64 bits, if it is available, and its availability
    /// after them, if that is asked for. Each is an offset from the query's place and the bytes there.
    pub(crate) fn written(
        &self,
        result: Option<&QueryResult>,
        flags: QueryResultFlags,
    ) -> Vec<(u64, Vec<u8>)> {
        // A VkPerformanceCounterResultKHR has eight bytes whatever the flags.
        let wide = flags.contains(QueryResultFlags::TYPE_64)
            || matches!(self.contents, Contents::Performance(_));
        let word = |value: u64| {
            if wide {
                value.to_ne_bytes().to_vec()
            } else {
                (value as u32).to_ne_bytes().to_vec()
            }
        };
        let mut written = Vec::new();
        let values = match result {
            Some(result) => Some(self.values(result)),
            // So far nothing was counted: what is between is only known when the query ends.
            None if flags.contains(QueryResultFlags::PARTIAL) => {
                Some(vec![0; self.contents.count()])
            }
            None => None,
        };
        if let Some(values) = values {
            written.push((0, values.into_iter().flat_map(word).collect()));
        }
        if flags.contains(QueryResultFlags::WITH_AVAILABILITY) {
            let place = self.contents.count() as u64 * if wide { 8 } else { 4 };
            written.push((place, word(result.is_some().into())));
        }
        written
    }

    fn values(&self, result: &QueryResult) -> Vec<u64> {
        let counters = match result {
            QueryResult::Timestamp(nanoseconds) => return vec![*nanoseconds],
            QueryResult::Performance(counters) => counters,
        };
        match &self.contents {
            Contents::Timestamp => vec![0],
            Contents::Performance(indices) => {
                let value = |&index: &u32| counters.values().get(index as usize).copied();
                indices
                    .iter()
                    .map(|index| value(index).unwrap_or(0))
                    .collect()
            }
            Contents::Words(counted) => counted
                .iter()
                .map(|counter| counter.map_or(0, |counter| counters.get(counter)))
                .collect(),
        }
    }
}

/// The packets of `vkCmdCopyQueryPoolResults`, as the queries are now. What lies outside the buffer is not written.
pub(crate) fn copy_packets(copy: &CopyQueryResults) -> Vec<Packet> {
    let mut packets = Vec::new();
    for index in 0..u64::from(copy.count) {
        let result = copy.pool.queries.result(copy.first + index as u32);
        for (place, bytes) in copy.pool.written(result.as_ref(), copy.flags) {
            let offset = index.saturating_mul(copy.stride).saturating_add(place);
            let size = bytes.len() as u64;
            if offset.saturating_add(size) <= copy.target.size {
                packets.push(Packet::UpdateBuffer {
                    target: BufferRange {
                        offset: copy.target.offset + offset,
                        size,
                        ..copy.target.clone()
                    },
                    data: bytes.into(),
                });
            }
        }
    }
    packets
}

#[cfg(test)]
mod tests {
    use super::*;
    use simdevice::stats::counters::Counters;

    #[test]
    fn counters_come_in_the_pools_order() {
        let mut counters = Counters::default();
        counters.add(Counter::GaussiansRead, 7);
        counters.add(Counter::GaussiansDrawn, 5);
        let order = vec![
            Counter::GaussiansDrawn as u32,
            Counter::GaussiansRead as u32,
        ];
        let pool = QueryPool::new(Contents::Performance(order), 1);
        let result = QueryResult::Performance(Box::new(counters));
        let written = pool.written(Some(&result), QueryResultFlags::empty());
        let expected = [5u64.to_ne_bytes(), 7u64.to_ne_bytes()].concat();
        assert_eq!(written, [(0, expected)]);
    }

    #[test]
    fn availability_follows_the_values() {
        let pool = QueryPool::new(Contents::Timestamp, 3);
        let flags = QueryResultFlags::WITH_AVAILABILITY;
        let result = QueryResult::Timestamp((1 << 32) + 9);
        assert_eq!(
            pool.written(Some(&result), flags),
            [
                (0, 9u32.to_ne_bytes().to_vec()),
                (4, 1u32.to_ne_bytes().to_vec())
            ]
        );
        assert_eq!(
            pool.written(None, flags | QueryResultFlags::TYPE_64),
            [(8, 0u64.to_ne_bytes().to_vec())]
        );
        assert!(pool.written(None, QueryResultFlags::TYPE_64).is_empty());
        assert!(pool.has(1, 2) && !pool.has(2, 2) && !pool.has(u32::MAX, 2));
    }

    #[test]
    fn statistics_are_words_in_the_order_of_their_flags() {
        let mut counters = Counters::default();
        counters.add(Counter::FragmentInvocations, 7);
        counters.add(Counter::InputVertices, 3);
        let flags = Statistic::FRAGMENT_SHADER_INVOCATIONS
            | Statistic::GEOMETRY_SHADER_PRIMITIVES
            | Statistic::INPUT_ASSEMBLY_VERTICES;
        let pool = QueryPool::new(Contents::statistics(flags), 1);
        let result = QueryResult::Performance(Box::new(counters));
        let words = |words: [u32; 3]| words.map(u32::to_ne_bytes).concat();
        let none = QueryResultFlags::empty();
        assert_eq!(pool.written(Some(&result), none), [(0, words([3, 0, 7]))]);
        assert!(pool.written(None, none).is_empty());
        let partial = pool.written(None, QueryResultFlags::PARTIAL);
        assert_eq!(partial, [(0, words([0; 3]))]);
    }
}
