//! The device's counters, read by `VK_KHR_performance_query`.

use std::sync::Arc;

use ash::vk;

use crate::device::{CounterDescription, Device};
use crate::error::{During, RenderError};

/// The time to wait for the profiling lock, in nanoseconds.
const LOCK_TIMEOUT: u64 = 10_000_000_000;

/// The value of a device's counter for a draw.
#[derive(Clone, Debug, PartialEq)]
pub struct Counter {
    /// The group it belongs to.
    pub category: String,
    /// Its name.
    pub name: String,
    /// A sentence about its meaning.
    pub description: String,
    /// The unit of `value`.
    pub unit: vk::PerformanceCounterUnitKHR,
    /// The value; whole numbers are exact up to 2^53.
    pub value: f64,
}

/// A query of all counters of the device. It holds the device's profiling lock as long as it exists, because the lock
/// must be held from recording to execution.
pub(super) struct CounterQuery {
    pool: vk::QueryPool,
    counters: Vec<CounterDescription>,
    locked: bool,
    device: Arc<Device>,
}

impl CounterQuery {
    /// Creates the query. None if the device has no counters or can't count all of them in one pass. Counters that
    /// affect performance are included only if `impacting`.
    pub(super) fn new(device: &Arc<Device>, impacting: bool) -> Result<Option<Self>, RenderError> {
        let Some(performance_query) = device.performance() else {
            return Ok(None);
        };
        let counters: Vec<_> = device.counters()?.into_iter().zip(0u32..).collect();
        let counted = counters.into_iter().filter(|(counter, _)| impacting || !counter.impacting);
        let (counters, indices): (Vec<_>, Vec<u32>) = counted.unzip();
        let mut performance = vk::QueryPoolPerformanceCreateInfoKHR::default()
            .queue_family_index(device.queue_family())
            .counter_indices(&indices);
        if counters.is_empty() || device.counter_passes(&performance) != 1 {
            return Ok(None);
        }
        let create_info = vk::QueryPoolCreateInfo::default()
            .query_type(vk::QueryType::PERFORMANCE_QUERY_KHR)
            .query_count(1)
            .push_next(&mut performance);
        // SAFETY: the structures are valid, and the feature is enabled.
        let pool = unsafe { device.raw().create_query_pool(&create_info, None) }.during("vkCreateQueryPool")?;
        let mut query = Self { pool, counters, locked: false, device: device.clone() };
        let info = vk::AcquireProfilingLockInfoKHR::default().timeout(LOCK_TIMEOUT);
        // SAFETY: the feature is enabled, and the one query of a device doesn't hold the lock yet.
        unsafe { performance_query.acquire_profiling_lock(&info) }.during("vkAcquireProfilingLockKHR")?;
        query.locked = true;
        Ok(Some(query))
    }

    /// Records the query's reset.
    pub(super) fn reset(&self, commands: vk::CommandBuffer) {
        // SAFETY: the command buffer is recording, outside a render pass.
        unsafe {
            self.device.raw().cmd_reset_query_pool(commands, self.pool, 0, 1);
        };
    }

    /// Records the query's begin.
    pub(super) fn begin(&self, commands: vk::CommandBuffer) {
        let flags = vk::QueryControlFlags::empty();
        // SAFETY: the command buffer is recording and holds nothing yet, the profiling lock is
        // held, and the query is reset before.
        unsafe {
            self.device.raw().cmd_begin_query(commands, self.pool, 0, flags);
        };
    }

    /// Records the query's end.
    pub(super) fn end(&self, commands: vk::CommandBuffer) {
        // SAFETY: the command buffer is recording, and the query is active in it.
        unsafe { self.device.raw().cmd_end_query(commands, self.pool, 0) };
    }

    /// The values of the counters, after the query's submission has ended.
    pub(super) fn read(&self) -> Result<Vec<Counter>, RenderError> {
        let zero = vk::PerformanceCounterResultKHR { uint64: 0 };
        let mut results = vec![zero; self.counters.len()];
        let size = size_of_val(&results[..]);
        // ash's wrapper takes one value per query, and this query has many.
        // SAFETY: the pool is the device's, its one query is available, and `results` has room
        // for one result of each of its counters.
        unsafe {
            (self.device.raw().fp_v1_0().get_query_pool_results)(
                self.device.raw().handle(),
                self.pool,
                0,
                1,
                size,
                results.as_mut_ptr().cast(),
                size as u64,
                vk::QueryResultFlags::WAIT,
            )
        }
        .result()
        .during("vkGetQueryPoolResults")?;
        Ok(self
            .counters
            .iter()
            .zip(results)
            .map(|(counter, result)| Counter {
                category: counter.category.clone(),
                name: counter.name.clone(),
                description: counter.description.clone(),
                unit: counter.unit,
                value: value(counter.storage, result),
            })
            .collect())
    }
}

/// The number in a counter's result.
fn value(storage: vk::PerformanceCounterStorageKHR, result: vk::PerformanceCounterResultKHR) -> f64 {
    use vk::PerformanceCounterStorageKHR as Storage;
    // SAFETY: all eight bytes were initialised, and every pattern is a number of each type.
    unsafe {
        match storage {
            Storage::INT32 => result.int32.into(),
            Storage::INT64 => result.int64 as f64,
            Storage::UINT32 => result.uint32.into(),
            Storage::UINT64 => result.uint64 as f64,
            Storage::FLOAT32 => result.float32.into(),
            Storage::FLOAT64 => result.float64,
            _ => f64::NAN,
        }
    }
}

impl Drop for CounterQuery {
    fn drop(&mut self) {
        // SAFETY: every submission has been waited for.
        unsafe { self.device.raw().destroy_query_pool(self.pool, None) };
        if let Some(performance) = self.device.performance().filter(|_| self.locked) {
            // SAFETY: the lock is held.
            unsafe { performance.release_profiling_lock() };
        }
    }
}
