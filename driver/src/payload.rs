//! The payloads of fences and semaphores: states that are signaled and waited for. A payload is of one device, or shared
//! with other devices and processes, or a sync file of the host's.

use crate::abi::error::Error;
use crate::abi::sanitizer::{acquire, release};
use crate::device_sync::{DeviceSync, Outside, is_readable};
use crate::external::{self, Kind};
use simdevice::Allocation;
use simdevice::shared;
use std::ffi::c_int;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, Ordering, fence};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// A payload. Submissions keep those that they wait for and signal.
#[derive(Debug)]
pub(crate) struct Payload {
    sync: Arc<DeviceSync>,
    state: State,
    /// The number of submitted operations that will signal it.
    pending: AtomicU32,
}

#[derive(Debug)]
enum State {
    Binary(AtomicBool),
    Timeline(AtomicU64),
    Shared { word: SharedWord, is_timeline: bool },
    SyncFile(SyncFile),
}

/// A word of 64 bits in memory that processes share; a binary state is 0 or 1. Another process may write anything there.
#[derive(Debug)]
struct SharedWord(Arc<Allocation>);

impl SharedWord {
    /// The size of the memory in bytes.
    const SIZE: u64 = 4096;

    /// The place of the value. The first word counts the changes, and is waited for.
    const VALUE: u64 = 8;

    fn new(kind: Kind, value: u64) -> Result<Self, Error> {
        let memory = Allocation::new_shared(Self::SIZE, &external::label(kind, Self::SIZE));
        let memory = memory.map_err(|error| Error::OutOfHostMemory(error.to_string()))?;
        let word = Self(memory);
        word.change(|_| value);
        Ok(word)
    }

    fn get(&self) -> u64 {
        let value = self.0.load_u64(Self::VALUE).unwrap_or(0);
        fence(Ordering::Acquire);
        value
    }

    /// Changes the value and wakes all threads that wait for a change. Returns the old value.
    fn change(&self, change: impl FnMut(u64) -> u64) -> u64 {
        fence(Ordering::Release);
        let old = self.0.update_u64(Self::VALUE, change).unwrap_or(0);
        fence(Ordering::Acquire);
        if let Some(changes) = self.changes() {
            changes.fetch_add(1, Ordering::Release);
            shared::wake(changes);
        }
        old
    }

    fn changes(&self) -> Option<&AtomicU32> {
        self.0.words().first()
    }
}

/// A file that becomes readable when it is signaled; none if that has happened.
#[derive(Debug)]
struct SyncFile {
    file: Option<OwnedFd>,
    /// True once this device has signaled what the file replaced.
    is_signaled: AtomicBool,
}

impl SyncFile {
    fn is_signaled(&self) -> bool {
        self.is_signaled.load(Ordering::Acquire)
            || self.file.as_ref().is_none_or(|file| is_readable(file.as_fd(), Duration::ZERO))
    }
}

impl Payload {
    fn of(sync: &Arc<DeviceSync>, state: State) -> Arc<Self> {
        Arc::new(Self { sync: Arc::clone(sync), state, pending: AtomicU32::new(0) })
    }

    /// A binary payload of one device.
    pub(crate) fn binary(sync: &Arc<DeviceSync>, is_signaled: bool) -> Arc<Self> {
        Self::of(sync, State::Binary(AtomicBool::new(is_signaled)))
    }

    /// A timeline of one device.
    pub(crate) fn timeline(sync: &Arc<DeviceSync>, value: u64) -> Arc<Self> {
        Self::of(sync, State::Timeline(AtomicU64::new(value)))
    }

    /// A payload that other devices and processes can import. The value of a binary one is 1 if it is signaled.
    ///
    /// # Errors
    /// [`Error::OutOfHostMemory`] if the host gives no memory or no file descriptor.
    pub(crate) fn shared(sync: &Arc<DeviceSync>, kind: Kind, value: u64) -> Result<Arc<Self>, Error> {
        let word = SharedWord::new(kind, value)?;
        Ok(Self::of(sync, State::Shared { word, is_timeline: kind == Kind::TimelineSemaphore }))
    }

    /// The payload that another device has exported. The descriptor stays the application's.
    ///
    /// # Errors
    /// [`Error::InvalidExternalHandle`] if the descriptor is of something else.
    pub(crate) fn import(sync: &Arc<DeviceSync>, kind: Kind, fd: c_int) -> Result<Arc<Self>, Error> {
        let word = SharedWord(external::import(fd, kind, SharedWord::SIZE)?);
        Ok(Self::of(sync, State::Shared { word, is_timeline: kind == Kind::TimelineSemaphore }))
    }

    /// The payload that a sync file has; it is signaled if the descriptor is -1. The descriptor stays the application's.
    ///
    /// # Errors
    /// [`Error::InvalidExternalHandle`] if the descriptor is of something else.
    pub(crate) fn import_sync_file(sync: &Arc<DeviceSync>, fd: c_int) -> Result<Arc<Self>, Error> {
        let file = match fd {
            -1 => None,
            _ => Some(sync_file::duplicate(fd)?),
        };
        Ok(Self::of(sync, State::SyncFile(SyncFile { file, is_signaled: AtomicBool::new(false) })))
    }

    /// The file by which other devices import the payload, if they can.
    pub(crate) fn file(&self) -> Option<BorrowedFd<'_>> {
        match &self.state {
            State::Shared { word, .. } => word.0.file(),
            State::Binary(_) | State::Timeline(_) | State::SyncFile(_) => None,
        }
    }

    /// Reports whether the payload can be exported as a sync file: one of its object, if that `exports` them, or one that
    /// was imported.
    pub(crate) fn has_sync_file(&self, exports: bool) -> bool {
        match &self.state {
            State::Binary(_) => exports,
            State::SyncFile(_) => true,
            State::Timeline(_) | State::Shared { .. } => false,
        }
    }

    /// The descriptor of a sync file with the payload; -1 stands for one that is signaled. A payload of this device is
    /// waited for, because the host makes such files for its own drivers alone. None if nothing submitted will signal it.
    ///
    /// # Errors
    /// [`Error::TooManyObjects`] if the process has no file descriptor left.
    pub(crate) fn export_sync_file(&self) -> Result<Option<c_int>, Error> {
        // It ceases to be pending after it is signaled.
        let is_pending = self.pending.load(Ordering::Acquire) > 0;
        if self.is_reached(1) {
            return Ok(Some(-1));
        }
        if let State::SyncFile(SyncFile { file: Some(file), .. }) = &self.state {
            return external::export(file.as_fd()).map(Some);
        }
        if !is_pending {
            return Ok(None);
        }
        // What waits for a payload of a lost device goes on.
        self.sync.wait(None, || self.is_reached(1));
        Ok(Some(-1))
    }

    /// The value of a timeline; `None` for a binary payload.
    pub(crate) fn value(&self) -> Option<u64> {
        let value = match &self.state {
            State::Timeline(value) => value.load(Ordering::Acquire),
            State::Shared { word, is_timeline: true } => word.get(),
            State::Binary(_) | State::Shared { .. } | State::SyncFile(_) => return None,
        };
        acquire(self);
        Some(value)
    }

    /// Reports whether a wait for `value` (which a binary payload ignores) has ended.
    pub(crate) fn is_reached(&self, value: u64) -> bool {
        let is_reached = match &self.state {
            State::Binary(signaled) => signaled.load(Ordering::Acquire),
            State::Timeline(current) => current.load(Ordering::Acquire) >= value,
            State::Shared { word, is_timeline: true } => word.get() >= value,
            State::Shared { word, is_timeline: false } => word.get() != 0,
            State::SyncFile(file) => file.is_signaled(),
        };
        if is_reached {
            acquire(self);
        }
        is_reached
    }

    /// Signals the payload; a timeline gets `value`.
    pub(crate) fn signal(&self, value: u64) {
        release(self);
        self.sync.update(|| match &self.state {
            State::Binary(signaled) => signaled.store(true, Ordering::Release),
            // A smaller value is the application's error; a timeline never decreases.
            State::Timeline(current) => {
                current.fetch_max(value, Ordering::AcqRel);
            }
            State::Shared { word, is_timeline: true } => {
                word.change(|current| current.max(value));
            }
            State::Shared { word, is_timeline: false } => {
                word.change(|_| 1);
            }
            State::SyncFile(file) => file.is_signaled.store(true, Ordering::Release),
        });
    }

    /// Ends an operation of [`Payloads::submit_signal`].
    pub(crate) fn end_signal(&self, value: u64) {
        self.signal(value);
        self.pending.fetch_sub(1, Ordering::AcqRel);
    }

    /// Makes a binary payload unsignaled.
    pub(crate) fn reset(&self) {
        match &self.state {
            State::Binary(signaled) => signaled.store(false, Ordering::Release),
            State::Shared { word, is_timeline: false } => {
                word.change(|_| 0);
            }
            State::Timeline(_) | State::Shared { .. } | State::SyncFile(_) => {}
        }
    }

    /// The place where the payload changes without this device.
    pub(crate) fn outside(&self) -> Option<Outside<'_>> {
        match &self.state {
            State::Binary(_) | State::Timeline(_) => None,
            State::Shared { word, .. } => Some(word.changes().map_or(Outside::Several, Outside::Word)),
            State::SyncFile(file) => file.file.as_ref().map(|file| Outside::File(file.as_fd())),
        }
    }
}

/// The place where several payloads change, of which a device waits for all or for any.
pub(crate) fn outside(payloads: &[Arc<Payload>]) -> Option<Outside<'_>> {
    match payloads {
        [only] => only.outside(),
        several => several.iter().any(|payload| payload.outside().is_some()).then_some(Outside::Several),
    }
}

/// The payload of a fence or a semaphore, and the one that replaces it for a while.
#[derive(Debug)]
pub(crate) struct Payloads(Mutex<Held>);

#[derive(Debug)]
struct Held {
    permanent: Arc<Payload>,
    temporary: Option<Arc<Payload>>,
}

impl Payloads {
    /// A permanent payload.
    pub(crate) fn new(permanent: Arc<Payload>) -> Self {
        Self(Mutex::new(Held { permanent, temporary: None }))
    }

    fn lock(&self) -> MutexGuard<'_, Held> {
        // Pointers are consistent after any panic.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The present payload.
    pub(crate) fn current(&self) -> Arc<Payload> {
        let held = self.lock();
        Arc::clone(held.temporary.as_ref().unwrap_or(&held.permanent))
    }

    /// The present payload, which a queue will signal by [`Payload::end_signal`].
    pub(crate) fn submit_signal(&self) -> Arc<Payload> {
        let payload = self.current();
        payload.pending.fetch_add(1, Ordering::AcqRel);
        payload
    }

    /// The present payload, and true if it was temporary, which ends.
    pub(crate) fn take(&self) -> (Arc<Payload>, bool) {
        let mut held = self.lock();
        match held.temporary.take() {
            Some(temporary) => (temporary, true),
            None => (Arc::clone(&held.permanent), false),
        }
    }

    /// The permanent payload; one that is temporary ends.
    pub(crate) fn restore(&self) -> Arc<Payload> {
        let mut held = self.lock();
        held.temporary = None;
        Arc::clone(&held.permanent)
    }

    /// Replaces the payload, temporarily or for ever.
    pub(crate) fn replace(&self, payload: Arc<Payload>, is_temporary: bool) {
        let mut held = self.lock();
        if is_temporary {
            held.temporary = Some(payload);
        } else {
            *held = Held { permanent: payload, temporary: None };
        }
    }
}

/// Sync files of the host's drivers.
#[cfg(target_os = "linux")]
mod sync_file {
    use crate::abi::error::Error;
    use crate::external;
    use std::ffi::c_int;
    use std::os::fd::OwnedFd;

    /// A descriptor of the application's sync file.
    pub(super) fn duplicate(fd: c_int) -> Result<OwnedFd, Error> {
        let refuse = |reason: &str| {
            Error::InvalidExternalHandle(format!("file descriptor {fd} cannot be imported as a sync file: {reason}"))
        };
        let file = external::borrow(fd)?;
        let status = rustix::fs::fstat(file).map_err(|error| refuse(&error.to_string()))?;
        // Files that the host makes of nothing, as sync files and event counters, have no type.
        if rustix::fs::FileType::from_raw_mode(status.st_mode) != rustix::fs::FileType::Unknown {
            return Err(refuse("it is of a file, a pipe, a socket or a device"));
        }
        file.try_clone_to_owned().map_err(|error| Error::OutOfHostMemory(error.to_string()))
    }
}

/// Hosts without sync files.
#[cfg(not(target_os = "linux"))]
mod sync_file {
    use crate::abi::error::Error;
    use std::ffi::c_int;
    use std::os::fd::OwnedFd;

    pub(super) fn duplicate(_: c_int) -> Result<OwnedFd, Error> {
        Err(Error::InvalidExternalHandle("the host has no sync files".to_owned()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device_sync::{WaitResult, deadline};
    use std::time::Instant;

    fn wait(sync: &DeviceSync, payload: &Payload, nanoseconds: u64) -> WaitResult {
        sync.wait_for(deadline(nanoseconds), payload.outside(), || payload.is_reached(1))
    }

    #[test]
    fn devices_share_a_payload() {
        let [one, two] = [Arc::default(), Arc::default()];
        for kind in [Kind::BinarySemaphore, Kind::Fence, Kind::TimelineSemaphore] {
            let own = Payload::shared(&one, kind, 0).unwrap();
            let fd = external::export(own.file().unwrap()).unwrap();
            let other = Payload::import(&two, kind, fd).unwrap();
            // SAFETY: the descriptor is this test's.
            unsafe { external::close(fd) };
            assert_eq!(wait(&two, &other, 2_000_000), WaitResult::TimedOut);
            let start = Instant::now();
            std::thread::scope(|scope| {
                scope.spawn(|| own.signal(1));
                assert_eq!(wait(&two, &other, 60_000_000_000), WaitResult::Ready);
            });
            assert!(start.elapsed() < Duration::from_secs(30));
            assert_eq!(other.value(), (kind == Kind::TimelineSemaphore).then_some(1));
            other.reset();
            assert_eq!(own.is_reached(1), kind == Kind::TimelineSemaphore);
        }
    }

    #[test]
    fn losing_the_device_ends_a_wait_for_another() {
        let sync = Arc::<DeviceSync>::default();
        let payload = Payload::shared(&sync, Kind::Fence, 0).unwrap();
        std::thread::scope(|scope| {
            let waiter = scope.spawn(|| sync.wait_for(None, payload.outside(), || payload.is_reached(1)));
            sync.lose(Error::DeviceLost("a test".to_owned()));
            assert_eq!(waiter.join().unwrap(), WaitResult::Lost);
        });
    }

    #[test]
    fn a_sync_file_is_exported_once_its_payload_is_signaled() {
        let sync = Arc::<DeviceSync>::default();
        let payloads = Payloads::new(Payload::binary(&sync, false));
        assert_eq!(payloads.current().export_sync_file().unwrap(), None, "nothing will signal it");
        let payload = payloads.submit_signal();
        std::thread::scope(|scope| {
            let exporter = scope.spawn(|| payload.export_sync_file().unwrap());
            std::thread::sleep(Duration::from_millis(5));
            assert!(!exporter.is_finished());
            payload.end_signal(0);
            assert_eq!(exporter.join().unwrap(), Some(-1));
        });
        assert_eq!(payload.export_sync_file().unwrap(), Some(-1));
        payload.reset();
        assert_eq!(payload.export_sync_file().unwrap(), None, "nothing will signal it again");
        assert!(Payload::import_sync_file(&sync, -1).unwrap().is_reached(1));
    }

    #[test]
    fn a_lost_device_ends_an_export() {
        let sync = Arc::<DeviceSync>::default();
        let payload = Payloads::new(Payload::binary(&sync, false)).submit_signal();
        std::thread::scope(|scope| {
            let exporter = scope.spawn(|| payload.export_sync_file().unwrap());
            sync.lose(Error::DeviceLost("a test".to_owned()));
            assert_eq!(exporter.join().unwrap(), Some(-1));
        });
    }

    /// An event counter is polled as a sync file is.
    #[cfg(target_os = "linux")]
    #[test]
    fn a_file_of_another_driver_is_waited_for() {
        use rustix::event::{EventfdFlags, eventfd};
        use std::os::fd::AsRawFd;
        let sync = Arc::<DeviceSync>::default();
        let file = eventfd(0, EventfdFlags::CLOEXEC).unwrap();
        let imported = Payload::import_sync_file(&sync, file.as_raw_fd()).unwrap();
        assert_eq!(wait(&sync, &imported, 2_000_000), WaitResult::TimedOut);
        let again = imported.export_sync_file().unwrap().unwrap();
        assert!(again >= 0);
        // SAFETY: the descriptor is this test's.
        unsafe { external::close(again) };
        std::thread::scope(|scope| {
            scope.spawn(|| rustix::io::write(&file, &1u64.to_ne_bytes()).unwrap());
            assert_eq!(wait(&sync, &imported, 60_000_000_000), WaitResult::Ready);
        });
        assert_eq!(imported.export_sync_file().unwrap(), Some(-1));
    }
}
