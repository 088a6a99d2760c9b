//! Commands that use query pools.

use super::buffer::Recorder;
use super::{Command, CopyQueryResults};
use crate::abi::error::Error;
use crate::query_pool::{QueryPool, require_queries};
use crate::resource::buffer::{Buffer, BufferRules};
use ash::vk;
use simdevice::BufferRange;
use simdevice::Packet;
use simdevice::limits::MAX_VERTEX_STREAMS;
use std::sync::Arc;

#[doc(alias = "vkCmdBeginQuery")]
pub(crate) fn cmd_begin_query(recorder: &mut Recorder, query_pool: &Arc<QueryPool>, query: u32) -> Result<(), Error> {
    require_queries(query_pool, query, 1, "VUID-vkCmdBeginQuery-query-00802")?;
    begin_query(recorder, query_pool, query, 0)
}

/// Begins a query of a vertex stream, or of all work if the pool's queries aren't of streams.
///
/// # Errors
/// [`Error::InvalidUsage`] for a stream that there isn't.
pub(super) fn begin_query(
    recorder: &mut Recorder,
    query_pool: &Arc<QueryPool>,
    query: u32,
    stream: u32,
) -> Result<(), Error> {
    let streams = match query_pool.is_of_streams() {
        true => MAX_VERTEX_STREAMS,
        false => 1,
    };
    if stream as usize >= streams {
        return Err(Error::usage(
            match query_pool.is_of_streams() {
                true => "VUID-vkCmdBeginQueryIndexedEXT-queryType-02339",
                false => "VUID-vkCmdBeginQueryIndexedEXT-queryType-06692",
            },
            format!("the index is {stream}, and must be less than {streams}"),
        ));
    }
    if query_pool.is_of_streams() {
        recorder.push(Command::BeginStreamQuery { pool: Arc::clone(query_pool), query, stream });
    } else {
        recorder.packet(Packet::BeginQuery { pool: Arc::clone(&query_pool.queries), index: query });
    }
    Ok(())
}

#[doc(alias = "vkCmdEndQuery")]
pub(crate) fn cmd_end_query(recorder: &mut Recorder, query_pool: &Arc<QueryPool>, query: u32) -> Result<(), Error> {
    require_queries(query_pool, query, 1, "VUID-vkCmdEndQuery-query-00810")?;
    recorder.packet(Packet::EndQuery { pool: Arc::clone(&query_pool.queries), index: query });
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
    require_queries(query_pool, first_query, query_count, "VUID-vkCmdResetQueryPool-firstQuery-00797")?;
    recorder.packet(Packet::ResetQueries {
        pool: Arc::clone(&query_pool.queries),
        first: first_query,
        count: query_count,
    });
    Ok(())
}

#[doc(alias = "vkCmdWriteTimestamp")]
#[doc(alias = "vkCmdWriteTimestamp2")]
pub(crate) fn cmd_write_timestamp(recorder: &mut Recorder, query_pool: &QueryPool, query: u32) -> Result<(), Error> {
    require_queries(query_pool, query, 1, "VUID-vkCmdWriteTimestamp-query-04904")?;
    recorder.packet(Packet::WriteTimestamp { pool: Arc::clone(&query_pool.queries), index: query });
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
    require_queries(query_pool, first_query, query_count, "VUID-vkCmdCopyQueryPoolResults-firstQuery-00821")?;
    recorder.push(Command::CopyQueryResults(CopyQueryResults {
        pool: Arc::clone(query_pool),
        first: first_query,
        count: query_count,
        target: dst_buffer.range(dst_offset, None, &TARGET)?,
        stride,
        flags,
    }));
    Ok(())
}

/// The rules on the target of `vkCmdCopyQueryPoolResults`.
const TARGET: BufferRules = BufferRules {
    memory: "VUID-vkCmdCopyQueryPoolResults-dstBuffer-00826",
    range: "VUID-vkCmdCopyQueryPoolResults-dstOffset-00819",
};

/// The packets of `vkCmdCopyQueryPoolResults`, with the queries' present results. Bytes outside the buffer are not
/// written.
pub(crate) fn copy_packets(copy: &CopyQueryResults) -> Vec<Packet> {
    let mut packets = Vec::new();
    for index in 0..u64::from(copy.count) {
        let query = copy.first + index as u32;
        let result = copy.pool.queries.result(query);
        for (place, bytes) in copy.pool.written(query, result.as_ref(), copy.flags) {
            let offset = index.saturating_mul(copy.stride).saturating_add(place);
            let size = bytes.len() as u64;
            if offset.saturating_add(size) <= copy.target.size {
                packets.push(Packet::UpdateBuffer {
                    target: BufferRange { offset: copy.target.offset + offset, size, ..copy.target.clone() },
                    data: bytes.into(),
                });
            }
        }
    }
    packets
}
