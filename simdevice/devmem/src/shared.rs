//! Memory that processes share: files without a name, whose size is sealed, so that no process can take away pages that
//! another one has mapped.
//!
//! A page at the end of the file has a label, by which the owner tells its own files from others. It is not mapped.

use crate::hints::PAGE_SIZE;
use std::os::fd::{BorrowedFd, OwnedFd};
use std::sync::atomic::AtomicU32;
use std::time::Duration;

/// The size of a label in bytes.
pub const LABEL_SIZE: usize = 64;

/// The owner's description of a file of shared memory. Another process may write there, so it is not to be trusted.
pub type Label = [u8; LABEL_SIZE];

/// The reason that a file can't be imported as memory.
#[derive(Debug, thiserror::Error)]
pub enum ImportError {
    /// A descriptor that is closed, or of something else than sealable memory.
    #[error("it is not a file of memory, which can be sealed")]
    NotMemory,
    /// A file that another process could shrink, so that accesses would end this process.
    #[error("its size is not sealed")]
    NotSealed,
    /// A file of another size.
    #[error("it has {found} bytes in place of {expected}")]
    WrongSize {
        /// The size of the file in bytes.
        found: u64,
        /// The size of a file for the memory in bytes.
        expected: u64,
    },
    /// The host refuses.
    #[error("the host cannot map it: {0}")]
    Host(#[from] std::io::Error),
}

/// The size of the mapped part of a file in bytes; None if it is too large.
pub(crate) fn mapped_size(len: u64) -> Option<u64> {
    len.checked_next_multiple_of(PAGE_SIZE).filter(|&size| size <= isize::MAX as u64 - PAGE_SIZE)
}

/// The label of a file whose size is sealed.
///
/// # Errors
/// [`ImportError`] if it is not such a file.
pub fn label(file: BorrowedFd<'_>) -> Result<Label, ImportError> {
    let size = sealed_size(file)?;
    let start = size.checked_sub(PAGE_SIZE).ok_or(ImportError::WrongSize { found: size, expected: PAGE_SIZE })?;
    read_label(file, start)
}

/// Checks that a file is for `len` bytes of memory.
pub(crate) fn check(file: BorrowedFd<'_>, len: u64) -> Result<(), ImportError> {
    let found = sealed_size(file)?;
    let expected = mapped_size(len).map_or(u64::MAX, |size| size + PAGE_SIZE);
    if found != expected {
        return Err(ImportError::WrongSize { found, expected });
    }
    Ok(())
}

/// The type of the file system of memory with pages of the common size. A page of a file of huge pages may be missing
/// when it is touched, which ends the process.
#[cfg(target_os = "linux")]
const TMPFS: i128 = 0x0102_1994;

/// The seals by which the size stays what it is. No further seal can forbid writing.
#[cfg(target_os = "linux")]
fn seals() -> rustix::fs::SealFlags {
    use rustix::fs::SealFlags;
    SealFlags::SHRINK | SealFlags::GROW | SealFlags::SEAL
}

/// The size of a file of memory, which is sealed.
#[cfg(target_os = "linux")]
fn sealed_size(file: BorrowedFd<'_>) -> Result<u64, ImportError> {
    use rustix::fs::{fcntl_get_seals, fstat, fstatfs};
    let found = fcntl_get_seals(file).map_err(|_| ImportError::NotMemory)?;
    let system = fstatfs(file).map_err(|_| ImportError::NotMemory)?;
    if i128::from(system.f_type) != TMPFS {
        return Err(ImportError::NotMemory);
    }
    if !found.contains(seals()) {
        return Err(ImportError::NotSealed);
    }
    let status = fstat(file).map_err(|_| ImportError::NotMemory)?;
    Ok(status.st_size.unsigned_abs())
}

/// Fails: hosts without such files share nothing.
#[cfg(not(target_os = "linux"))]
fn sealed_size(_: BorrowedFd<'_>) -> Result<u64, ImportError> {
    Err(ImportError::NotMemory)
}

/// The label that a file has from byte `start` on.
#[cfg(target_os = "linux")]
fn read_label(file: BorrowedFd<'_>, start: u64) -> Result<Label, ImportError> {
    let mut label = [0; LABEL_SIZE];
    let read = rustix::io::pread(file, &mut label, start).map_err(|error| ImportError::Host(error.into()))?;
    if read == LABEL_SIZE { Ok(label) } else { Err(ImportError::NotMemory) }
}

#[cfg(not(target_os = "linux"))]
fn read_label(_: BorrowedFd<'_>, _: u64) -> Result<Label, ImportError> {
    Err(ImportError::NotMemory)
}

/// Creates the file for `size` bytes of memory, a multiple of pages.
///
/// # Errors
/// The host's, and on hosts without such files that there are none.
#[cfg(target_os = "linux")]
pub(crate) fn create(size: u64, label: &Label) -> std::io::Result<OwnedFd> {
    use rustix::fs::{MemfdFlags, fcntl_add_seals, ftruncate, memfd_create};
    let file = memfd_create(c"gaurast", MemfdFlags::CLOEXEC | MemfdFlags::ALLOW_SEALING)?;
    ftruncate(&file, size + PAGE_SIZE)?;
    if rustix::io::pwrite(&file, label, size)? != LABEL_SIZE {
        return Err(std::io::ErrorKind::WriteZero.into());
    }
    fcntl_add_seals(&file, seals())?;
    Ok(file)
}

#[cfg(not(target_os = "linux"))]
pub(crate) fn create(_: u64, _: &Label) -> std::io::Result<OwnedFd> {
    Err(std::io::ErrorKind::Unsupported.into())
}

/// Waits until a word that processes share is woken, at most for `timeout`. Returns at once if it is not `seen`; may
/// return early.
pub fn wait(word: &AtomicU32, seen: u32, timeout: Duration) {
    #[cfg(target_os = "linux")]
    {
        use rustix::thread::futex;
        // A timeout that the clock can't represent is longer than any wait.
        let timeout = futex::Timespec::try_from(timeout).ok();
        // Every result has the caller look again.
        let _ = futex::wait(word, futex::Flags::empty(), seen, timeout.as_ref());
    }
    #[cfg(not(target_os = "linux"))]
    {
        let _ = (word, seen);
        std::thread::sleep(timeout.min(Duration::from_millis(1)));
    }
}

/// Wakes all threads of all processes that wait for a word.
pub fn wake(word: &AtomicU32) {
    #[cfg(target_os = "linux")]
    {
        use rustix::thread::futex;
        // The word is aligned and mapped, so nothing can fail.
        let _ = futex::wake(word, futex::Flags::empty(), i32::MAX.unsigned_abs());
    }
    #[cfg(not(target_os = "linux"))]
    let _ = word;
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;
    use crate::Allocation;
    use rustix::fs::{MemfdFlags, SealFlags, fcntl_add_seals, ftruncate, memfd_create};
    use std::os::fd::AsFd;
    use std::sync::atomic::Ordering;

    const LABEL: Label = [7; LABEL_SIZE];

    #[test]
    fn what_one_writes_the_other_reads() {
        let own = Allocation::new_shared(5000, &LABEL).unwrap();
        let file = own.file().unwrap();
        assert_eq!(label(file).unwrap(), LABEL);
        let imported = Allocation::import(file, 5000).unwrap();
        own.write(4990, &[1u8, 2, 3]).unwrap();
        let mut bytes = [0u8; 3];
        imported.read(4990, &mut bytes).unwrap();
        assert_eq!(bytes, [1, 2, 3]);
        assert!(imported.read(4999, &mut bytes).is_err());
        assert!(imported.is_host_visible() && own.is_host_visible(), "nothing derived is kept");
        drop(own);
        imported.fill(0, 5000, 9).unwrap();
        let again = Allocation::import(imported.file().unwrap(), 5000).unwrap();
        assert_eq!(again.load_u8(4999), Some(9));
    }

    /// A file of `size` bytes with these seals.
    fn file(size: u64, seals: SealFlags) -> OwnedFd {
        let file = memfd_create(c"test", MemfdFlags::ALLOW_SEALING).unwrap();
        ftruncate(&file, size).unwrap();
        fcntl_add_seals(&file, seals).unwrap();
        file
    }

    #[test]
    fn what_could_end_the_process_is_refused() {
        let all = SealFlags::SHRINK | SealFlags::GROW | SealFlags::SEAL;
        let import = |file: OwnedFd, len| Allocation::import(file.as_fd(), len);
        assert!(import(file(8192, all), 4096).is_ok());
        for seals in [SealFlags::empty(), SealFlags::GROW | SealFlags::SEAL, SealFlags::SHRINK | SealFlags::GROW] {
            assert!(matches!(import(file(8192, seals), 4096), Err(ImportError::NotSealed)), "{seals:?}");
        }
        for size in [0, 4096, 8191, 8193, 1 << 20] {
            let found = import(file(size, all), 4096);
            assert!(matches!(found, Err(ImportError::WrongSize { found, .. }) if found == size), "{size}");
        }
        for len in [0, 4097, u64::MAX] {
            assert!(import(file(8192, all), len).is_err(), "{len}");
        }
        // Nobody may write there, not even this process.
        assert!(matches!(import(file(8192, all | SealFlags::WRITE), 4096), Err(ImportError::Host(_))));
        let null = std::fs::File::open("/dev/null").unwrap();
        assert!(matches!(Allocation::import(null.as_fd(), 4096), Err(ImportError::NotMemory)));
        let plain = tempfile();
        assert!(matches!(
            Allocation::import(plain.as_fd(), 4096),
            Err(ImportError::NotMemory | ImportError::NotSealed)
        ));
    }

    /// A file with a name, of the size that memory of a page needs.
    fn tempfile() -> std::fs::File {
        let file = std::fs::File::options().read(true).open(std::env::current_exe().unwrap()).unwrap();
        assert!(file.metadata().unwrap().len() > 8192);
        file
    }

    #[test]
    fn the_size_stays_what_it_is() {
        let memory = Allocation::new_shared(4096, &LABEL).unwrap();
        let file = memory.file().unwrap();
        assert!(ftruncate(file, 0).is_err());
        assert!(ftruncate(file, 1 << 20).is_err());
        assert!(fcntl_add_seals(file, SealFlags::FUTURE_WRITE).is_err());
        memory.fill(0, 4096, 1).unwrap();
    }

    #[test]
    fn a_waiter_is_woken_through_another_mapping() {
        let own = Allocation::new_shared(4096, &LABEL).unwrap();
        let other = Allocation::import(own.file().unwrap(), 4096).unwrap();
        let start = std::time::Instant::now();
        std::thread::scope(|scope| {
            scope.spawn(|| {
                while own.words()[0].load(Ordering::Acquire) == 0 {
                    wait(&own.words()[0], 0, Duration::from_secs(60));
                }
            });
            other.words()[0].store(1, Ordering::Release);
            wake(&other.words()[0]);
        });
        assert!(start.elapsed() < Duration::from_secs(30));
        wait(&own.words()[0], 1, Duration::from_millis(1));
        wait(&own.words()[0], 0, Duration::from_secs(60));
    }
}
