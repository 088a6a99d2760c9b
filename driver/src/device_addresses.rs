//! Device addresses of buffers: numbers that are unrelated to host pointers. An access by a program is looked up among
//! the live buffers, and bounded by the buffer that it finds.

use simdevice::BufferRange;
use simdevice::program::bindings::AddressTable;
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// The first address. Null and addresses near it belong to no buffer.
const FIRST: u64 = 1 << 32;

/// The alignment of buffers' addresses, and the least distance from one buffer's end to the next.
const GAP: u64 = 1 << 16;

/// The addresses of a device's buffers. No address is used twice.
#[derive(Debug)]
pub(crate) struct Addresses(Mutex<Given>);

#[derive(Debug)]
struct Given {
    next: u64,
    buffers: BTreeMap<u64, BufferRange>,
    /// The table in which programs look up addresses; None after a buffer was added or removed.
    table: Option<Arc<AddressTable>>,
}

impl Default for Addresses {
    fn default() -> Self {
        Self(Mutex::new(Given { next: FIRST, buffers: BTreeMap::new(), table: None }))
    }
}

impl Addresses {
    fn lock(&self) -> MutexGuard<'_, Given> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Assigns an address to a buffer's bytes.
    pub(crate) fn add(&self, range: BufferRange) -> u64 {
        let mut given = self.lock();
        let address = given.next;
        let end = address.saturating_add(range.size).saturating_add(GAP);
        given.next = end.checked_next_multiple_of(GAP).unwrap_or(end);
        given.buffers.insert(address, range);
        given.table = None;
        address
    }

    /// Removes the buffer at an address.
    pub(crate) fn remove(&self, address: u64) {
        let mut given = self.lock();
        given.buffers.remove(&address);
        given.table = None;
    }

    /// The `size` bytes at an address, if a buffer has them.
    pub(crate) fn range(&self, address: u64, size: u64) -> Option<BufferRange> {
        let table = self.table();
        let (range, start) = table.find(address)?;
        let offset = address - start;
        (size <= range.size - offset).then(|| BufferRange {
            memory: Arc::clone(&range.memory),
            offset: range.offset + offset,
            size,
        })
    }

    /// The table of the present buffers.
    pub(crate) fn table(&self) -> Arc<AddressTable> {
        let mut given = self.lock();
        if let Some(table) = &given.table {
            return Arc::clone(table);
        }
        let buffers = given.buffers.iter();
        let buffers = buffers.map(|(&address, range)| (address, range.clone()));
        let table = Arc::new(AddressTable::new(simdevice::host::collect(buffers)));
        given.table = Some(Arc::clone(&table));
        table
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use simdevice::Allocation;

    #[test]
    fn addresses_are_of_buffers_that_live() {
        let addresses = Addresses::default();
        let memory = Allocation::new_zeroed(4096).unwrap();
        let range = |offset, size| BufferRange { memory: memory.clone(), offset, size };
        let first = addresses.add(range(0, 100));
        let second = addresses.add(range(512, 64));
        let found = |address| {
            let table = addresses.table();
            let found = table.find(address);
            found.map(|(range, start)| (range.offset, address - start))
        };
        assert_eq!(found(first), Some((0, 0)));
        assert_eq!(found(first + 99), Some((0, 99)));
        assert_eq!(found(first + 100), None);
        assert_eq!(found(first - 1), None);
        assert_eq!(found(second + 10), Some((512, 10)));
        assert_eq!(found(0), None);
        addresses.remove(first);
        assert_eq!(found(first), None);
        let third = addresses.add(range(0, 100));
        assert!(third > second, "an address is not given again");
    }
}
