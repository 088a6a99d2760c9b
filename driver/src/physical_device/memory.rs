//! Memory heaps and types, and the accounting of a device's heap.
//!
//! There is one heap, in the host's memory, with two types. Memory of one is accessed only by the device, which may
//! cache data derived from its contents; memory of the other may be mapped by the host.

use crate::abi::error::Error;
use ash::vk;
use std::sync::LazyLock;
use std::sync::atomic::{AtomicU64, Ordering};

/// The alignment of every allocation in bytes, in the device's and in the host's addresses.
pub(crate) const ALIGNMENT: u64 = 4096;

/// The size of the heap if the host's memory is unknown.
const FALLBACK_HEAP_SIZE: u64 = 2 << 30;

/// The types, in the order of their indices: Vulkan requires a type to precede those with more properties.
const TYPES: [vk::MemoryPropertyFlags; 2] = [
    vk::MemoryPropertyFlags::DEVICE_LOCAL,
    vk::MemoryPropertyFlags::from_raw(
        vk::MemoryPropertyFlags::DEVICE_LOCAL.as_raw()
            | vk::MemoryPropertyFlags::HOST_VISIBLE.as_raw()
            | vk::MemoryPropertyFlags::HOST_COHERENT.as_raw()
            | vk::MemoryPropertyFlags::HOST_CACHED.as_raw(),
    ),
];

/// The `memoryTypeBits` of a resource that may use any type.
pub(crate) const ALL_TYPE_BITS: u32 = (1 << TYPES.len()) - 1;

/// The `memoryTypeBits` of the type that the host may map.
pub(crate) const HOST_VISIBLE_TYPE_BITS: u32 = 1 << 1;

/// The properties of a memory type; `None` if there is no such index.
pub(crate) fn type_properties(index: u32) -> Option<vk::MemoryPropertyFlags> {
    TYPES.get(index as usize).copied()
}

/// The size of the heap in bytes: three quarters of the host's memory.
pub(crate) fn heap_size() -> u64 {
    static SIZE: LazyLock<u64> = LazyLock::new(|| host_memory().map_or(FALLBACK_HEAP_SIZE, |bytes| bytes / 4 * 3));
    *SIZE
}

fn host_memory() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/meminfo").ok()?;
    total_memory(&text)
}

/// The bytes of `MemTotal`.
fn total_memory(meminfo: &str) -> Option<u64> {
    kibibytes(meminfo, "MemTotal:")
}

/// The bytes of a row of `/proc/meminfo`, which gives them in KiB.
fn kibibytes(meminfo: &str, name: &str) -> Option<u64> {
    let line = meminfo.lines().find_map(|line| line.strip_prefix(name))?;
    let kibibytes: u64 = line.split_whitespace().next()?.parse().ok()?;
    kibibytes.checked_mul(1024)
}

/// `VkPhysicalDeviceMemoryProperties`.
pub(crate) fn properties() -> vk::PhysicalDeviceMemoryProperties {
    let mut properties = vk::PhysicalDeviceMemoryProperties {
        memory_type_count: TYPES.len() as u32,
        memory_heap_count: 1,
        ..Default::default()
    };
    for (place, flags) in properties.memory_types.iter_mut().zip(TYPES) {
        *place = vk::MemoryType { property_flags: flags, heap_index: 0 };
    }
    properties.memory_heaps[0] = vk::MemoryHeap { size: heap_size(), flags: vk::MemoryHeapFlags::DEVICE_LOCAL };
    properties
}

/// The bytes that all devices of the process have allocated.
static TAKEN: AtomicU64 = AtomicU64::new(0);

/// Writes the budget of each heap for the process, and its usage, in bytes.
pub(crate) fn write_budget(out: &mut vk::PhysicalDeviceMemoryBudgetPropertiesEXT<'_>) {
    out.heap_budget = [0; vk::MAX_MEMORY_HEAPS];
    out.heap_usage = [0; vk::MAX_MEMORY_HEAPS];
    out.heap_usage[0] = TAKEN.load(Ordering::Acquire);
    let free = std::fs::read_to_string("/proc/meminfo").ok().and_then(|text| kibibytes(&text, "MemAvailable:"));
    // Memory that other processes use is not available.
    let available = free.map_or(u64::MAX, |free| free.saturating_add(out.heap_usage[0]));
    out.heap_budget[0] = available.min(heap_size());
}

/// The accounting of a memory heap.
#[derive(Debug)]
pub(crate) struct Heap {
    size: u64,
    used: AtomicU64,
}

impl Heap {
    /// An unused heap of `size` bytes.
    pub(crate) fn new(size: u64) -> Self {
        Self { size, used: AtomicU64::new(0) }
    }

    /// Allocates `size` bytes of the heap, or none.
    ///
    /// # Errors
    /// [`Error::OutOfDeviceMemory`].
    pub(crate) fn take(&self, size: u64) -> Result<(), Error> {
        let within_budget = |used: u64| used.checked_add(size).filter(|&used| used <= self.size);
        self.used
            .fetch_update(Ordering::AcqRel, Ordering::Acquire, within_budget)
            .map(|_| {
                TAKEN.fetch_add(size, Ordering::AcqRel);
            })
            .map_err(|used| {
                Error::OutOfDeviceMemory(format!(
                    "{size} bytes asked for, and {used} of the heap's {} are taken",
                    self.size
                ))
            })
    }

    /// Frees bytes of the heap.
    pub(crate) fn give_back(&self, size: u64) {
        self.used.fetch_sub(size, Ordering::AcqRel);
        TAKEN.fetch_sub(size, Ordering::AcqRel);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_type_comes_before_those_with_more_properties() {
        for (index, later) in TYPES.iter().enumerate() {
            for earlier in &TYPES[..index] {
                assert!(!earlier.contains(*later));
            }
        }
    }

    #[test]
    fn one_type_is_for_the_host() {
        let is_visible = |flags: &vk::MemoryPropertyFlags| flags.contains(vk::MemoryPropertyFlags::HOST_VISIBLE);
        let visible = (0..).zip(TYPES).filter(|(_, flags)| is_visible(flags));
        assert_eq!(visible.map(|(index, _)| 1 << index).sum::<u32>(), HOST_VISIBLE_TYPE_BITS);
    }

    #[test]
    fn host_memory_is_read() {
        assert_eq!(total_memory("MemTotal:  16 kB\nMemFree: 1 kB"), Some(16384));
        assert_eq!(total_memory("MemTotal: ? kB"), None);
        assert_eq!(total_memory(""), None);
        assert!(heap_size() > 0);
    }
}
