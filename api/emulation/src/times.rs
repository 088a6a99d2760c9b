//! The times of a set's stages on the device, by timestamps.

use std::sync::Arc;

use ash::vk;

use crate::next::Next;
use crate::report::tell;

/// The most timestamps of a set: further stages are not told.
const MOST: u32 = 256;

/// Timestamps between the stages of a set, which are told when the command buffer is reset or freed, if it has been executed.
pub(crate) struct Times {
    next: Arc<Next>,
    pool: vk::QueryPool,
    /// The stage before each timestamp.
    stages: Vec<&'static str>,
}

impl Times {
    /// Begins to measure, where the environment's `GAURAST_EMULATION_TIMES` is 1.
    ///
    /// # Safety
    /// The command buffer is being recorded, outside of a render pass; here and below.
    pub(crate) unsafe fn begin(next: &Arc<Next>, commands: vk::CommandBuffer) -> Option<Self> {
        if std::env::var_os("GAURAST_EMULATION_TIMES").is_none_or(|value| value != "1") {
            return None;
        }
        let info = vk::QueryPoolCreateInfo::default().query_type(vk::QueryType::TIMESTAMP).query_count(MOST);
        // SAFETY: the caller's promise.
        unsafe {
            let pool = next.create_query_pool(&info, None).ok()?;
            next.cmd_reset_query_pool(commands, pool, 0, MOST);
            let mut own = Self { next: Arc::clone(next), pool, stages: Vec::new() };
            own.end_stage(commands, "");
            Some(own)
        }
    }

    /// Notes that what was recorded since the last note is a stage.
    ///
    /// # Safety
    /// See [`Self::begin`].
    pub(crate) unsafe fn end_stage(&mut self, commands: vk::CommandBuffer, stage: &'static str) {
        let index = self.stages.len() as u32;
        if index < MOST {
            self.stages.push(stage);
            let all = vk::PipelineStageFlags::ALL_COMMANDS;
            // SAFETY: the caller's promise.
            unsafe { self.next.cmd_write_timestamp(commands, all, self.pool, index) };
        }
    }

    /// Milliseconds of each stage, if the device has written all timestamps. Stages of one name are added.
    fn read(&self) -> Option<Vec<(&'static str, f64)>> {
        let mut stamps = vec![0_u64; self.stages.len()];
        // SAFETY: the pool has as many queries.
        unsafe { self.next.get_query_pool_results(self.pool, 0, &mut stamps, vk::QueryResultFlags::TYPE_64).ok()? };
        let mut rows: Vec<(&'static str, f64)> = Vec::new();
        for (stage, two) in self.stages[1..].iter().zip(stamps.windows(2)) {
            let spent = two[1].wrapping_sub(two[0]) as f64 * f64::from(self.next.timestamp_period) / 1e6;
            match rows.iter_mut().find(|(other, _)| other == stage) {
                Some((_, sum)) => *sum += spent,
                None => rows.push((stage, spent)),
            }
        }
        Some(rows)
    }
}

impl Drop for Times {
    fn drop(&mut self) {
        if let Some(rows) = self.read() {
            let all: f64 = rows.iter().map(|(_, spent)| spent).sum();
            let parts: Vec<String> = rows.iter().map(|(stage, spent)| format!("{stage} {spent:.3}")).collect();
            tell(&format!("a set took {all:.3} ms: {}", parts.join(", ")));
        }
        // SAFETY: what was recorded with the pool is executed no more: it was reset or freed.
        unsafe { self.next.destroy_query_pool(self.pool, None) };
    }
}
