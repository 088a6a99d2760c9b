//! Handles by which devices, of one process or of several, share memory, semaphores and fences.
//!
//! An opaque file descriptor is a file of shared memory (`devmem::shared`) whose label says which object of which driver it
//! has. What an application gives is checked before it is used: another process may have made it, and may write to it.

use crate::abi::error::Error;
use crate::physical_device::limits;
use ash::vk;
use simdevice::Allocation;
use simdevice::shared::{self, ImportError, Label};
use std::ffi::c_int;
use std::os::fd::{BorrowedFd, FromRawFd, IntoRawFd, OwnedFd};
use std::sync::Arc;

/// The object whose payload a file has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Memory of a type.
    Memory {
        /// The index of the type.
        memory_type: u32,
    },
    /// A binary semaphore.
    BinarySemaphore,
    /// A timeline semaphore.
    TimelineSemaphore,
    /// A fence.
    Fence,
}

impl Kind {
    /// The numbers by which a label names it.
    fn numbers(self) -> [u32; 2] {
        match self {
            Self::Memory { memory_type } => [1, memory_type],
            Self::BinarySemaphore => [2, 0],
            Self::TimelineSemaphore => [3, 0],
            Self::Fence => [4, 0],
        }
    }

    /// The object that a label's numbers name.
    fn of_numbers(numbers: [u32; 2]) -> String {
        match numbers {
            [1, memory_type] => format!("memory of type {memory_type}"),
            [2, _] => "a binary semaphore".to_owned(),
            [3, _] => "a timeline semaphore".to_owned(),
            [4, _] => "a fence".to_owned(),
            _ => "nothing known".to_owned(),
        }
    }
}

/// The part of a label that names the driver and the device, in bytes.
const IDENTITY: usize = 2 * vk::UUID_SIZE;

/// The label of the file of an object with `size` bytes.
pub(crate) fn label(kind: Kind, size: u64) -> Label {
    let mut label = [0; shared::LABEL_SIZE];
    let [driver, device] = limits::identity();
    label[..vk::UUID_SIZE].copy_from_slice(&driver);
    label[vk::UUID_SIZE..IDENTITY].copy_from_slice(&device);
    label[IDENTITY..][..8].copy_from_slice(&size.to_le_bytes());
    let [first, second] = kind.numbers();
    label[IDENTITY + 8..][..4].copy_from_slice(&first.to_le_bytes());
    label[IDENTITY + 12..][..4].copy_from_slice(&second.to_le_bytes());
    label
}

/// The reason that a descriptor is refused.
fn refuse(fd: c_int, reason: impl std::fmt::Display) -> Error {
    Error::InvalidExternalHandle(format!("file descriptor {fd} cannot be imported: {reason}"))
}

/// Borrows a descriptor for the time of a command.
///
/// # Errors
/// [`Error::InvalidExternalHandle`] for a negative number.
pub(crate) fn borrow<'a>(fd: c_int) -> Result<BorrowedFd<'a>, Error> {
    if fd < 0 {
        return Err(refuse(fd, "it is negative"));
    }
    // SAFETY: the application leaves the descriptor open while the command uses it. One that is closed already is refused
    // by the host, with whose functions alone it is used.
    Ok(unsafe { BorrowedFd::borrow_raw(fd) })
}

/// Closes a descriptor that has been imported, and that Vulkan thereby gives to the driver.
///
/// # Safety
/// The application gave the descriptor away, and it is open.
pub(crate) unsafe fn close(fd: c_int) {
    // SAFETY: the caller's promise.
    drop(unsafe { OwnedFd::from_raw_fd(fd) });
}

/// Maps the memory of an object of this driver. The descriptor stays the application's.
///
/// # Errors
/// [`Error::InvalidExternalHandle`] if the descriptor is of something else.
pub(crate) fn import(fd: c_int, kind: Kind, size: u64) -> Result<Arc<Allocation>, Error> {
    let file = borrow(fd)?;
    let failed = |error: ImportError| match error {
        ImportError::Host(host) if is_exhausted(&host) => Error::OutOfHostMemory(host.to_string()),
        error => refuse(fd, error),
    };
    let found = shared::label(file).map_err(failed)?;
    let wanted = label(kind, size);
    if found != wanted {
        return Err(refuse(fd, difference(&found, kind, size)));
    }
    Allocation::import(file, size).map_err(failed)
}

/// Reports whether the host has no more memory or descriptors.
fn is_exhausted(error: &std::io::Error) -> bool {
    use rustix::io::Errno;
    Errno::from_io_error(error).is_some_and(|code| [Errno::MFILE, Errno::NFILE, Errno::NOMEM].contains(&code))
}

/// The difference between a label and that of an object.
fn difference(found: &Label, kind: Kind, size: u64) -> String {
    let [driver, device] = limits::identity();
    if found[..vk::UUID_SIZE] != driver || found[vk::UUID_SIZE..IDENTITY] != device {
        return "it is of another driver, or of another version of this one (driverUUID, deviceUUID)".to_owned();
    }
    let number = |at: usize| u32::from_le_bytes([found[at], found[at + 1], found[at + 2], found[at + 3]]);
    let numbers = [number(IDENTITY + 8), number(IDENTITY + 12)];
    if numbers != kind.numbers() {
        return format!("it is {} and not {}", Kind::of_numbers(numbers), Kind::of_numbers(kind.numbers()));
    }
    let low = u64::from(number(IDENTITY)) | u64::from(number(IDENTITY + 4)) << 32;
    format!("its allocationSize is {low} and not {size} (VUID-VkMemoryAllocateInfo-allocationSize-01742)")
}

/// A new descriptor of a file, which is the application's.
///
/// # Errors
/// [`Error::TooManyObjects`] if the process has none left.
pub(crate) fn export(file: BorrowedFd<'_>) -> Result<c_int, Error> {
    file.try_clone_to_owned().map(OwnedFd::into_raw_fd).map_err(|error| Error::TooManyObjects(error.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_object_is_imported_as_what_it_is() {
        let kind = Kind::Memory { memory_type: 1 };
        let memory = Allocation::new_shared(100, &label(kind, 100)).unwrap();
        let fd = export(memory.file().unwrap()).unwrap();
        memory.store_u32(8, 5).unwrap();
        let imported = import(fd, kind, 100).unwrap();
        assert_eq!(imported.load_u32(8), Some(5));
        for (kind, size, text) in [
            (kind, 101, "its allocationSize is 100 and not 101"),
            (Kind::Memory { memory_type: 0 }, 100, "it is memory of type 1 and not memory of type 0"),
            (Kind::BinarySemaphore, 100, "and not a binary semaphore"),
            (Kind::TimelineSemaphore, 100, "and not a timeline semaphore"),
            (Kind::Fence, 100, "and not a fence"),
        ] {
            let error = import(fd, kind, size).unwrap_err();
            assert_eq!(error.result(), vk::Result::ERROR_INVALID_EXTERNAL_HANDLE);
            assert!(error.to_string().contains(text), "{error}");
        }
        // SAFETY: the descriptor is this test's.
        unsafe { close(fd) };
    }

    #[test]
    fn files_of_others_are_refused() {
        let kind = Kind::Memory { memory_type: 1 };
        let mut other = label(kind, 100);
        other[0] ^= 1;
        let memory = Allocation::new_shared(100, &other).unwrap();
        let error = import(std::os::fd::AsRawFd::as_raw_fd(&memory.file().unwrap()), kind, 100).unwrap_err();
        assert!(error.to_string().contains("another driver"), "{error}");
        assert!(import(-1, kind, 100).unwrap_err().to_string().contains("it is negative"));
        let null = std::fs::File::open("/dev/null").unwrap();
        let error = import(std::os::fd::AsRawFd::as_raw_fd(&null), kind, 100).unwrap_err();
        assert!(error.to_string().contains("not a file of memory"), "{error}");
    }
}
