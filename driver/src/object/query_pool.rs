//! Query pools.

use crate::command::record::CopyQueryResults;
use ash::vk::QueryResultFlags;
use simdevice::Packet;
use simdevice::packet::BufferRange;
use simdevice::query::{self, QueryKind, QueryResult};
use std::sync::Arc;

/// A query pool.
#[derive(Debug)]
pub(crate) struct QueryPool {
    /// The device's half.
    pub(crate) queries: Arc<query::QueryPool>,
    /// For a performance pool, the counters that results hold, in order.
    counters: Vec<u32>,
}

crate::objects! { ash::vk::QueryPool => QueryPool; }

impl QueryPool {
    /// A pool of `count` queries.
    pub(crate) fn new(kind: QueryKind, count: u32, counters: Vec<u32>) -> Self {
        Self {
            queries: Arc::new(query::QueryPool::new(kind, count)),
            counters,
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
        let (values, wide) = match self.queries.kind() {
            // A VkPerformanceCounterResultKHR has eight bytes whatever the flags.
            QueryKind::Performance => (self.counters.len(), true),
            QueryKind::Timestamp => (1, flags.contains(QueryResultFlags::TYPE_64)),
        };
        let word = |value: u64| {
            if wide {
                value.to_ne_bytes().to_vec()
            } else {
                (value as u32).to_ne_bytes().to_vec()
            }
        };
        let mut written = Vec::new();
        if let Some(result) = result {
            let values = self.values(result);
            written.push((0, values.into_iter().flat_map(word).collect()));
        }
        if flags.contains(QueryResultFlags::WITH_AVAILABILITY) {
            let place = values as u64 * if wide { 8 } else { 4 };
            written.push((place, word(result.is_some().into())));
        }
        written
    }

    fn values(&self, result: &QueryResult) -> Vec<u64> {
        match result {
            QueryResult::Performance(counters) => {
                let value = |&index: &u32| counters.values().get(index as usize).copied();
                self.counters
                    .iter()
                    .map(|index| value(index).unwrap_or(0))
                    .collect()
            }
            QueryResult::Timestamp(nanoseconds) => vec![*nanoseconds],
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
    use simdevice::counters::{Counter, Counters};

    #[test]
    fn counters_come_in_the_pools_order() {
        let mut counters = Counters::default();
        counters.add(Counter::GaussiansRead, 7);
        counters.add(Counter::GaussiansDrawn, 5);
        let order = vec![
            Counter::GaussiansDrawn as u32,
            Counter::GaussiansRead as u32,
        ];
        let pool = QueryPool::new(QueryKind::Performance, 1, order);
        let result = QueryResult::Performance(Box::new(counters));
        let written = pool.written(Some(&result), QueryResultFlags::empty());
        let expected = [5u64.to_ne_bytes(), 7u64.to_ne_bytes()].concat();
        assert_eq!(written, [(0, expected)]);
    }

    #[test]
    fn availability_follows_the_values() {
        let pool = QueryPool::new(QueryKind::Timestamp, 3, Vec::new());
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
}
