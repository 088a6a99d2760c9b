//! Query pools.

use crate::abi::error::Error;
use crate::abi::handle::objects;
use crate::abi::valid;
use crate::device::Device;
use crate::device_sync::DeviceSync;
use ash::vk;
use ash::vk::{QueryPipelineStatisticFlags as Statistic, QueryResultFlags};
use simdevice::host;
use simdevice::limits::MAX_VERTEX_STREAMS;
use simdevice::stats::counters::Counter;
use simdevice::stats::query;
use simdevice::stats::query::{QueryKind, QueryResult};
use std::mem::MaybeUninit;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};
use std::time::Duration;

/// The period in which a wait for a query checks whether the device was lost.
const POLL: Duration = Duration::from_millis(20);

/// A query pool.
#[derive(Debug)]
pub(crate) struct QueryPool {
    /// The device's query pool.
    pub(crate) queries: Arc<query::QueryPool>,
    /// The kind of values in results.
    query_type: QueryType,
    /// The vertex stream of each query, if the pool's queries are of streams.
    streams: Box<[AtomicU32]>,
}

/// The kind of values in the results of a pool's queries.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum QueryType {
    /// The host's time, or the simulated hardware's.
    Timestamp,
    /// Counters as `VkPerformanceCounterResultKHR`s, in order.
    Performance(Vec<u32>),
    /// Counters of a vertex stream as words, in order: transform feedback, and the number of primitives.
    OfStream(&'static [[Counter; MAX_VERTEX_STREAMS]]),
    /// Counters as words, in order: occlusion and pipeline statistics. `None` is a statistic that is always zero on
    /// this device.
    Words(Vec<Option<Counter>>),
}

impl QueryType {
    /// Samples that passed all tests. They are always counted exactly.
    pub(crate) fn occlusion() -> Self {
        Self::Words(vec![Some(Counter::SamplesPassed)])
    }

    /// Pipeline statistics, from the lowest flag to the highest.
    pub(crate) fn statistics(flags: Statistic) -> Self {
        const ALL: [(Statistic, Option<Counter>); 11] = [
            (Statistic::INPUT_ASSEMBLY_VERTICES, Some(Counter::InputVertices)),
            (Statistic::INPUT_ASSEMBLY_PRIMITIVES, Some(Counter::InputPrimitives)),
            (Statistic::VERTEX_SHADER_INVOCATIONS, Some(Counter::VertexInvocations)),
            (Statistic::GEOMETRY_SHADER_INVOCATIONS, Some(Counter::GeometryInvocations)),
            (Statistic::GEOMETRY_SHADER_PRIMITIVES, Some(Counter::GeometryPrimitives)),
            (Statistic::CLIPPING_INVOCATIONS, Some(Counter::ClippingInvocations)),
            (Statistic::CLIPPING_PRIMITIVES, Some(Counter::ClippingPrimitives)),
            (Statistic::FRAGMENT_SHADER_INVOCATIONS, Some(Counter::FragmentInvocations)),
            (Statistic::TESSELLATION_CONTROL_SHADER_PATCHES, Some(Counter::TessellationPatches)),
            (Statistic::TESSELLATION_EVALUATION_SHADER_INVOCATIONS, Some(Counter::TessellationInvocations)),
            (Statistic::COMPUTE_SHADER_INVOCATIONS, Some(Counter::ComputeInvocations)),
        ];
        let counted = ALL.iter().filter(|(flag, _)| flags.contains(*flag));
        Self::Words(counted.map(|(_, counter)| *counter).collect())
    }

    fn kind(&self) -> QueryKind {
        match self {
            Self::Timestamp => QueryKind::Timestamp,
            Self::Performance(counters) if counters.iter().any(is_simulated) => QueryKind::Simulated,
            Self::Words(counters) if counters.contains(&Some(Counter::FragmentInvocations)) => QueryKind::Fragments,
            Self::Performance(_) | Self::Words(_) | Self::OfStream(_) => QueryKind::Performance,
        }
    }

    /// The number of values in a result.
    fn count(&self) -> usize {
        match self {
            Self::Timestamp => 1,
            Self::Performance(counters) => counters.len(),
            Self::Words(counters) => counters.len(),
            Self::OfStream(counters) => counters.len(),
        }
    }
}

/// Reports whether a counter needs a model of the hardware.
fn is_simulated(index: &u32) -> bool {
    let counter = Counter::ALL.get(*index as usize);
    counter.is_some_and(|counter| counter.is_simulated())
}

objects! { vk::QueryPool => QueryPool; }

impl QueryPool {
    /// A pool of `count` queries.
    pub(crate) fn new(query_type: QueryType, count: u32) -> Self {
        let of_streams = matches!(query_type, QueryType::OfStream(_));
        let streams = if of_streams { count } else { 0 };
        let streams = host::collect((0..streams).map(|_| AtomicU32::new(0)));
        Self {
            queries: Arc::new(query::QueryPool::new(query_type.kind(), count)),
            query_type,
            streams: streams.into_boxed_slice(),
        }
    }

    /// Reports whether its queries count primitives of a vertex stream.
    pub(crate) fn is_of_streams(&self) -> bool {
        matches!(self.query_type, QueryType::OfStream(_))
    }

    /// Sets the vertex stream that a query counts.
    pub(crate) fn set_stream(&self, query: u32, stream: u32) {
        if let Some(slot) = self.streams.get(query as usize) {
            slot.store(stream, Relaxed);
        }
    }

    /// Reports whether it has queries `first..first + count`.
    pub(crate) fn has(&self, first: u32, count: u32) -> bool {
        u64::from(first) + u64::from(count) <= u64::from(self.queries.count())
    }

    /// The bytes that Vulkan writes for a query with a result: its values, as words of 32 or 64 bits, if it is available; then its
    /// availability, if the flags ask for it. Each is an offset from the query's place, and bytes.
    pub(crate) fn written(
        &self,
        query: u32,
        result: Option<&QueryResult>,
        flags: QueryResultFlags,
    ) -> Vec<(u64, Vec<u8>)> {
        // A VkPerformanceCounterResultKHR has eight bytes, whatever the flags say.
        let wide = flags.contains(QueryResultFlags::TYPE_64) || matches!(self.query_type, QueryType::Performance(_));
        let word = |value: u64| {
            if wide { value.to_ne_bytes().to_vec() } else { (value as u32).to_ne_bytes().to_vec() }
        };
        let mut written = Vec::new();
        let values = match result {
            Some(result) => Some(self.values(query, result)),
            // The partial result is zero: counters are only known when the query ends.
            None if flags.contains(QueryResultFlags::PARTIAL) => Some(vec![0; self.query_type.count()]),
            None => None,
        };
        if let Some(values) = values {
            written.push((0, values.into_iter().flat_map(word).collect()));
        }
        if flags.contains(QueryResultFlags::WITH_AVAILABILITY) {
            let place = self.query_type.count() as u64 * if wide { 8 } else { 4 };
            written.push((place, word(result.is_some().into())));
        }
        written
    }

    fn values(&self, query: u32, result: &QueryResult) -> Vec<u64> {
        let counters = match result {
            QueryResult::Timestamp(nanoseconds) => return vec![*nanoseconds],
            QueryResult::Performance(counters) => counters,
        };
        match &self.query_type {
            QueryType::Timestamp => vec![0],
            QueryType::OfStream(counted) => {
                let stream = self.streams.get(query as usize);
                let stream = stream.map_or(0, |stream| stream.load(Relaxed)) as usize;
                counted.iter().map(|of| counters.get(of[stream])).collect()
            }
            QueryType::Performance(indices) => {
                let value = |&index: &u32| counters.values().get(index as usize).copied();
                indices.iter().map(|index| value(index).unwrap_or(0)).collect()
            }
            QueryType::Words(counted) => {
                counted.iter().map(|counter| counter.map_or(0, |counter| counters.get(counter))).collect()
            }
        }
    }
}

/// A query's result, after a wait if the flags ask for it.
fn result(
    pool: &QueryPool,
    index: u32,
    flags: QueryResultFlags,
    sync: &DeviceSync,
) -> Result<Option<QueryResult>, Error> {
    loop {
        let result = pool.queries.result(index);
        if result.is_some() || !flags.contains(QueryResultFlags::WAIT) {
            return Ok(result);
        }
        sync.check()?;
        pool.queries.wait(index, POLL);
    }
}

/// Fails unless the pool has the queries.
///
/// # Errors
/// [`Error::InvalidUsage`] with the id `vuid`.
pub(crate) fn require_queries(pool: &QueryPool, first: u32, count: u32, vuid: &'static str) -> Result<(), Error> {
    if pool.has(first, count) {
        return Ok(());
    }
    Err(Error::usage(vuid, format!("{count} queries from {first} on of a pool of {}", pool.queries.count())))
}

/// The pool of a create info.
///
/// # Safety
/// The create info's chain is valid.
unsafe fn new_pool(info: &vk::QueryPoolCreateInfo<'_>) -> Result<QueryPool, Error> {
    let query_type = match info.query_type {
        vk::QueryType::TIMESTAMP => QueryType::Timestamp,
        vk::QueryType::OCCLUSION => QueryType::occlusion(),
        vk::QueryType::PIPELINE_STATISTICS => QueryType::statistics(info.pipeline_statistics),
        vk::QueryType::TRANSFORM_FEEDBACK_STREAM_EXT => {
            QueryType::OfStream(&[Counter::CAPTURED, Counter::CAPTURE_NEEDED])
        }
        vk::QueryType::PRIMITIVES_GENERATED_EXT => QueryType::OfStream(&[Counter::PRIMITIVES_OF_STREAMS]),
        vk::QueryType::PERFORMANCE_QUERY_KHR => {
            // SAFETY: the caller's promise.
            let counters = unsafe {
                valid::find_in_chain::<vk::QueryPoolPerformanceCreateInfoKHR>(info.p_next)
                    .map(|info| valid::slice(info.p_counter_indices, info.counter_index_count))
                    .transpose()?
            };
            let counters = counters.ok_or_else(|| {
                Error::usage(
                    "VUID-VkQueryPoolCreateInfo-queryType-03222",
                    "a performance query pool must chain a VkQueryPoolPerformanceCreateInfoKHR",
                )
            })?;
            let is_known = |&index: &u32| (index as usize) < Counter::ALL.len();
            if let Some(index) = counters.iter().find(|index| !is_known(index)) {
                return Err(Error::usage(
                    "VUID-VkQueryPoolPerformanceCreateInfoKHR-pCounterIndices-03321",
                    format!("there is no performance counter {index}"),
                ));
            }
            QueryType::Performance(counters.to_vec())
        }
        other => {
            return Err(Error::FeatureNotPresent(format!("a query pool of type {other:?}")));
        }
    };
    Ok(QueryPool::new(query_type, info.query_count))
}

/// # Safety
/// The create info's chain is valid.
#[doc(alias = "vkCreateQueryPool")]
pub(crate) unsafe fn create_query_pool(create_info: &vk::QueryPoolCreateInfo<'_>) -> Result<Arc<QueryPool>, Error> {
    // SAFETY: the caller's promise.
    unsafe { new_pool(create_info) }.map(Arc::new)
}

#[doc(alias = "vkResetQueryPool")]
pub(crate) fn reset_query_pool(query_pool: &QueryPool, first_query: u32, query_count: u32) -> Result<(), Error> {
    query_pool.queries.reset(first_query, query_count);
    Ok(())
}

#[doc(alias = "vkGetQueryPoolResults")]
pub(crate) fn get_query_pool_results(
    device: &Device,
    query_pool: &QueryPool,
    first_query: u32,
    query_count: u32,
    data: &mut [MaybeUninit<u8>],
    stride: vk::DeviceSize,
    flags: QueryResultFlags,
) -> Result<vk::Result, Error> {
    require_queries(query_pool, first_query, query_count, "VUID-vkGetQueryPoolResults-firstQuery-00816")?;
    let mut all_available = true;
    for index in 0..query_count {
        let result = result(query_pool, first_query + index, flags, device.sync())?;
        all_available &= result.is_some();
        for (place, bytes) in query_pool.written(first_query + index, result.as_ref(), flags) {
            let offset = (u64::from(index) * stride + place) as usize;
            let Some(target) = data.get_mut(offset..offset + bytes.len()) else {
                return Err(Error::usage(
                    "VUID-vkGetQueryPoolResults-dataSize-00817",
                    format!("dataSize is {}, too small for {query_count} queries", data.len()),
                ));
            };
            for (byte, value) in target.iter_mut().zip(bytes) {
                byte.write(value);
            }
        }
    }
    Ok(if all_available { vk::Result::SUCCESS } else { vk::Result::NOT_READY })
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
        let order = vec![Counter::GaussiansDrawn as u32, Counter::GaussiansRead as u32];
        let pool = QueryPool::new(QueryType::Performance(order), 1);
        let result = QueryResult::Performance(Box::new(counters));
        let written = pool.written(0, Some(&result), QueryResultFlags::empty());
        let expected = [5u64.to_ne_bytes(), 7u64.to_ne_bytes()].concat();
        assert_eq!(written, [(0, expected)]);
    }

    #[test]
    fn availability_follows_the_values() {
        let pool = QueryPool::new(QueryType::Timestamp, 3);
        let flags = QueryResultFlags::WITH_AVAILABILITY;
        let result = QueryResult::Timestamp((1 << 32) + 9);
        assert_eq!(
            pool.written(0, Some(&result), flags),
            [(0, 9u32.to_ne_bytes().to_vec()), (4, 1u32.to_ne_bytes().to_vec())]
        );
        assert_eq!(pool.written(0, None, flags | QueryResultFlags::TYPE_64), [(8, 0u64.to_ne_bytes().to_vec())]);
        assert!(pool.written(0, None, QueryResultFlags::TYPE_64).is_empty());
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
        let pool = QueryPool::new(QueryType::statistics(flags), 1);
        let result = QueryResult::Performance(Box::new(counters));
        let words = |words: [u32; 3]| words.map(u32::to_ne_bytes).concat();
        let none = QueryResultFlags::empty();
        assert_eq!(pool.written(0, Some(&result), none), [(0, words([3, 0, 7]))]);
        assert!(pool.written(0, None, none).is_empty());
        let partial = pool.written(0, None, QueryResultFlags::PARTIAL);
        assert_eq!(partial, [(0, words([0; 3]))]);
    }
}
