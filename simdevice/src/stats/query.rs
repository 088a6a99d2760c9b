//! Query pools: results that packets write and the host reads.

use crate::stats::counters::Counters;
use devmem::host;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

pub use isa::clock::host_time;

/// The quantity that the queries of a pool measure.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum QueryKind {
    /// The device's counters, except those that need a model of the hardware.
    Performance,
    /// As [`QueryKind::Performance`], while all fragments are shaded that early tests leave, hidden ones too.
    Fragments,
    /// All of the device's counters.
    Simulated,
    /// The host's monotonic time in nanoseconds.
    Timestamp,
}

/// The result of a query.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum QueryResult {
    /// The differences of the counters between the end and the beginning.
    Performance(Box<Counters>),
    /// A time in nanoseconds.
    Timestamp(u64),
}

/// The state of a query.
#[derive(Clone, Debug, Default)]
enum Slot {
    #[default]
    Unavailable,
    /// Begun, with the counters at its beginning.
    Active(Box<Counters>),
    Available(QueryResult),
}

/// A pool of queries.
#[derive(Debug)]
pub struct QueryPool {
    kind: QueryKind,
    slots: Mutex<Vec<Slot>>,
    changed: Condvar,
}

impl QueryPool {
    /// Makes a pool of `count` unavailable queries.
    pub fn new(kind: QueryKind, count: u32) -> Self {
        Self { kind, slots: Mutex::new(host::filled(Slot::Unavailable, count as usize)), changed: Condvar::new() }
    }

    /// The quantity that its queries measure.
    pub fn kind(&self) -> QueryKind {
        self.kind
    }

    /// The number of queries.
    pub fn count(&self) -> u32 {
        self.lock().len() as u32
    }

    fn lock(&self) -> MutexGuard<'_, Vec<Slot>> {
        // A slot is replaced as a whole, so that a panic while the lock is held leaves no slot half-written.
        self.slots.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn set(&self, index: u32, slot: Slot) {
        if let Some(entry) = self.lock().get_mut(index as usize) {
            *entry = slot;
        }
        self.changed.notify_all();
    }

    /// Makes `count` queries from `first` on unavailable.
    pub fn reset(&self, first: u32, count: u32) {
        for slot in self.lock().iter_mut().skip(first as usize).take(count as usize) {
            *slot = Slot::Unavailable;
        }
    }

    /// Starts a query.
    pub(crate) fn begin(&self, index: u32, now: &Counters) {
        self.set(index, Slot::Active(Box::new(now.clone())));
    }

    /// Ends a query that was begun. Does nothing for a query that was not.
    pub(crate) fn end(&self, index: u32, now: &Counters) {
        let begun = match self.lock().get(index as usize) {
            Some(Slot::Active(begun)) => begun.clone(),
            _ => return,
        };
        let mut counted = now.since(&begun);
        counted.derive();
        self.set(index, Slot::Available(QueryResult::Performance(Box::new(counted))));
    }

    /// Writes a timestamp.
    pub(crate) fn write_timestamp(&self, index: u32, nanoseconds: u64) {
        self.set(index, Slot::Available(QueryResult::Timestamp(nanoseconds)));
    }

    /// The result of a query; `None` while it is unavailable or if `index` is out of range.
    pub fn result(&self, index: u32) -> Option<QueryResult> {
        match self.lock().get(index as usize)? {
            Slot::Available(result) => Some(result.clone()),
            Slot::Unavailable | Slot::Active(_) => None,
        }
    }

    /// As [`QueryPool::result`], but waits at most `timeout` for the query to become available.
    pub fn wait(&self, index: u32, timeout: std::time::Duration) -> Option<QueryResult> {
        let pending =
            |slots: &mut Vec<Slot>| slots.get(index as usize).is_some_and(|slot| !matches!(slot, Slot::Available(_)));
        let guard = self.lock();
        let waited = self.changed.wait_timeout_while(guard, timeout, pending);
        drop(waited);
        self.result(index)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stats::counters::Counter;

    #[gaurast_runner::test]
    fn a_query_is_available_only_between_its_end_and_a_reset() {
        let pool = QueryPool::new(QueryKind::Performance, 2);
        let mut counters = Counters::default();
        pool.begin(1, &counters);
        assert_eq!(pool.result(1), None);
        counters.add(Counter::TilePairs, 3);
        pool.end(1, &counters);
        let Some(QueryResult::Performance(result)) = pool.result(1) else {
            panic!("the query ended");
        };
        assert_eq!(result.get(Counter::TilePairs), 3);
        assert_eq!(pool.result(0), None);
        pool.reset(0, 2);
        assert_eq!(pool.result(1), None);
        assert_eq!(pool.result(9), None);
    }
}
