//! The device's counters for `VK_KHR_performance_query`, in the order of [`Counter::ALL`].

use crate::convert;
use ash::vk;
use simdevice::stats::counters::{Counter, Unit};
use std::ffi::{CString, c_char};

/// The number of counters.
pub(crate) const COUNT: usize = Counter::ALL.len();

/// Writes the unit, scope, storage and UUID of counter `index`.
pub(crate) fn fill(index: usize, out: &mut vk::PerformanceCounterKHR<'_>) {
    let info = Counter::ALL[index].info();
    out.unit = match info.unit {
        // Vulkan has no unit of energy; descriptions say that these are nanojoules.
        Unit::Count | Unit::Nanojoules => vk::PerformanceCounterUnitKHR::GENERIC,
        Unit::Nanoseconds | Unit::SimulatedNanoseconds => vk::PerformanceCounterUnitKHR::NANOSECONDS,
        Unit::Cycles => vk::PerformanceCounterUnitKHR::CYCLES,
        Unit::Bytes => vk::PerformanceCounterUnitKHR::BYTES,
        Unit::Percent => vk::PerformanceCounterUnitKHR::PERCENTAGE,
    };
    out.scope = vk::PerformanceCounterScopeKHR::COMMAND;
    out.storage = vk::PerformanceCounterStorageKHR::UINT64;
    out.uuid = uuid(info.category, info.name);
}

/// Writes the texts that describe counter `index`.
pub(crate) fn describe(index: usize, out: &mut vk::PerformanceCounterDescriptionKHR<'_>) {
    let info = Counter::ALL[index].info();
    // The hardware model runs only if one of its counters is requested.
    out.flags = if Counter::ALL[index].is_simulated() {
        vk::PerformanceCounterDescriptionFlagsKHR::PERFORMANCE_IMPACTING
    } else {
        vk::PerformanceCounterDescriptionFlagsKHR::empty()
    };
    write(&mut out.name, info.name);
    write(&mut out.category, info.category);
    write(&mut out.description, info.description);

    fn write(array: &mut [c_char], text: &str) {
        convert::write_string(array, &CString::new(text).unwrap_or_default());
    }
}

/// A UUID from the counter's names, which stays the same when counters are added (128-bit FNV-1a).
fn uuid(category: &str, name: &str) -> [u8; vk::UUID_SIZE] {
    const OFFSET: u128 = 0x6c62_272e_07bb_0142_62b8_2175_6295_c58d;
    const PRIME: u128 = 0x0000_0000_0100_0000_0000_0000_0000_013b;
    let bytes = category.bytes().chain([0]).chain(name.bytes());
    bytes.fold(OFFSET, |hash, byte| (hash ^ u128::from(byte)).wrapping_mul(PRIME)).to_be_bytes()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    #[test]
    fn counters_have_uuids_of_their_own() {
        let uuids: HashSet<_> = (0..COUNT)
            .map(|index| {
                let mut counter = vk::PerformanceCounterKHR::default();
                fill(index, &mut counter);
                counter.uuid
            })
            .collect();
        assert_eq!(uuids.len(), COUNT);
    }
}
