//! Query pools, and the commands that use them.

use crate::command::record::{Command, CopyQueryResults};
use crate::command::recorder::Recorder;
use crate::error::Error;
use crate::object::buffer::Buffer;
use crate::object::query_pool::{Contents, QueryPool};
use crate::object::signals::Signals;
use crate::{handle, pnext, pointer};
use ash::vk;
use simdevice::Packet;
use simdevice::stats::counters::Counter;
use simdevice::stats::query::QueryResult;
use std::ffi::c_void;
use std::sync::Arc;
use std::time::Duration;

/// How often a wait for a query looks whether the device was lost.
const POLL: Duration = Duration::from_millis(20);

crate::entry_points! {
    #[doc(alias = "vkCreateQueryPool")]
    fn create_query_pool(
        _device: vk::Device,
        create_info: *const vk::QueryPoolCreateInfo<'_>,
        _allocator: *const vk::AllocationCallbacks<'_>,
        query_pool: *mut vk::QueryPool,
    ) -> vk::Result {
        let object = new_pool(pointer::input(create_info)?)?;
        pointer::output(query_pool, handle::create(Arc::new(object)))
    }

    #[doc(alias = "vkResetQueryPool")]
    fn reset_query_pool(
        _device: vk::Device,
        query_pool: vk::QueryPool,
        first_query: u32,
        query_count: u32,
    ) {
        handle::get(query_pool)?.queries.reset(first_query, query_count);
        Ok(())
    }

    #[doc(alias = "vkGetQueryPoolResults")]
    fn get_query_pool_results(
        device: vk::Device,
        query_pool: vk::QueryPool,
        first_query: u32,
        query_count: u32,
        data_size: usize,
        data: *mut c_void,
        stride: vk::DeviceSize,
        flags: vk::QueryResultFlags,
    ) -> vk::Result {
        let signals = handle::get(device)?.signals();
        let pool = handle::get(query_pool)?;
        require_queries(pool, first_query, query_count)?;
        let mut all_available = true;
        for index in 0..query_count {
            let result = result(pool, first_query + index, flags, signals)?;
            all_available &= result.is_some();
            for (place, bytes) in pool.written(result.as_ref(), flags) {
                let offset = u64::from(index) * stride + place;
                if offset + bytes.len() as u64 > data_size as u64 || data.is_null() {
                    return Err(Error::usage(
                        "VUID-vkGetQueryPoolResults-dataSize-00817",
                        format!("dataSize is {data_size}, too small for {query_count} queries"),
                    ));
                }
                let target = data.cast::<u8>().add(offset as usize);
                std::ptr::copy_nonoverlapping(bytes.as_ptr(), target, bytes.len());
            }
        }
        Ok(if all_available { vk::Result::SUCCESS } else { vk::Result::NOT_READY })
    }
}

#[doc(alias = "vkCmdBeginQuery")]
pub(crate) fn cmd_begin_query(
    recorder: &mut Recorder,
    query_pool: &Arc<QueryPool>,
    query: u32,
) -> Result<(), Error> {
    require_queries(query_pool, query, 1)?;
    recorder.packet(Packet::BeginQuery {
        pool: Arc::clone(&query_pool.queries),
        index: query,
    });
    Ok(())
}

#[doc(alias = "vkCmdEndQuery")]
pub(crate) fn cmd_end_query(
    recorder: &mut Recorder,
    query_pool: &Arc<QueryPool>,
    query: u32,
) -> Result<(), Error> {
    require_queries(query_pool, query, 1)?;
    recorder.packet(Packet::EndQuery {
        pool: Arc::clone(&query_pool.queries),
        index: query,
    });
    Ok(())
}

#[doc(alias = "vkCmdResetQueryPool")]
pub(crate) fn cmd_reset_query_pool(
    recorder: &mut Recorder,
    query_pool: &Arc<QueryPool>,
    first_query: u32,
    query_count: u32,
) -> Result<(), Error> {
    recorder.require_outside_pass()?;
    require_queries(query_pool, first_query, query_count)?;
    recorder.packet(Packet::ResetQueries {
        pool: Arc::clone(&query_pool.queries),
        first: first_query,
        count: query_count,
    });
    Ok(())
}

#[doc(alias = "vkCmdWriteTimestamp")]
#[doc(alias = "vkCmdWriteTimestamp2")]
pub(crate) fn cmd_write_timestamp(
    recorder: &mut Recorder,
    query_pool: &QueryPool,
    query: u32,
) -> Result<(), Error> {
    require_queries(query_pool, query, 1)?;
    recorder.packet(Packet::WriteTimestamp {
        pool: Arc::clone(&query_pool.queries),
        index: query,
    });
    Ok(())
}

#[doc(alias = "vkCmdCopyQueryPoolResults")]
#[expect(clippy::too_many_arguments, reason = "Vulkan's signature")]
pub(crate) fn cmd_copy_query_pool_results(
    recorder: &mut Recorder,
    query_pool: &Arc<QueryPool>,
    first_query: u32,
    query_count: u32,
    dst_buffer: &Arc<Buffer>,
    dst_offset: vk::DeviceSize,
    stride: vk::DeviceSize,
    flags: vk::QueryResultFlags,
) -> Result<(), Error> {
    recorder.require_outside_pass()?;
    require_queries(query_pool, first_query, query_count)?;
    recorder.push(Command::CopyQueryResults(CopyQueryResults {
        pool: Arc::clone(query_pool),
        first: first_query,
        count: query_count,
        target: dst_buffer.range(dst_offset, None)?,
        stride,
        flags,
    }));
    Ok(())
}

/// A query's result, after a wait where that is asked for.
fn result(
    pool: &QueryPool,
    index: u32,
    flags: vk::QueryResultFlags,
    signals: &Signals,
) -> Result<Option<QueryResult>, Error> {
    loop {
        let result = pool.queries.result(index);
        if result.is_some() || !flags.contains(vk::QueryResultFlags::WAIT) {
            return Ok(result);
        }
        signals.check()?;
        pool.queries.wait(index, POLL);
    }
}

/// Fails unless the pool has the queries.
///
/// # Errors
/// [`Error::Usage`].
fn require_queries(pool: &QueryPool, first: u32, count: u32) -> Result<(), Error> {
    if pool.has(first, count) {
        return Ok(());
    }
    Err(Error::usage(
        "VUID-vkCmd-query-queryCount",
        format!(
            "{count} queries from {first} on of a pool of {}",
            pool.queries.count()
        ),
    ))
}

/// The pool that a create info asks for.
///
/// # Safety
/// The create info's chain is valid.
unsafe fn new_pool(info: &vk::QueryPoolCreateInfo<'_>) -> Result<QueryPool, Error> {
    let contents = match info.query_type {
        vk::QueryType::TIMESTAMP => Contents::Timestamp,
        vk::QueryType::OCCLUSION => Contents::occlusion(),
        vk::QueryType::PIPELINE_STATISTICS => Contents::statistics(info.pipeline_statistics),
        vk::QueryType::PERFORMANCE_QUERY_KHR => {
            // SAFETY: the caller's promise.
            let counters = unsafe {
                pnext::find::<vk::QueryPoolPerformanceCreateInfoKHR>(info.p_next)
                    .map(|info| pointer::slice(info.p_counter_indices, info.counter_index_count))
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
            Contents::Performance(counters.to_vec())
        }
        other => {
            return Err(Error::FeatureNotPresent(format!(
                "a query pool of type {other:?}"
            )));
        }
    };
    Ok(QueryPool::new(contents, info.query_count))
}
