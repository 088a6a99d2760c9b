//! Query pools.

use simdevice::query::{self, QueryKind, QueryResult};
use std::sync::Arc;

/// A query pool.
#[derive(Debug)]
pub(crate) struct QueryPool {
    /// The device's half.
    pub(crate) queries: Arc<query::QueryPool>,
    /// For a performance pool, the counters that results hold, in order.
    pub(crate) counters: Vec<u32>,
}

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

    /// How many values a query has.
    pub(crate) fn value_count(&self) -> usize {
        match self.queries.kind() {
            QueryKind::Performance => self.counters.len(),
            QueryKind::Timestamp => 1,
        }
    }

    /// The values of a result.
    pub(crate) fn values(&self, result: &QueryResult) -> Vec<u64> {
        match result {
            QueryResult::Performance(counters) => self
                .counters
                .iter()
                .map(|&index| counters.values().get(index as usize).copied().unwrap_or(0))
                .collect(),
            QueryResult::Timestamp(nanoseconds) => vec![*nanoseconds],
        }
    }
}
