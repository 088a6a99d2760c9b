//! The payloads of fences and semaphores: states that are signaled and waited for. A payload is of one device, or shared
//! with other devices and processes, or a sync file of the host's.

use crate::abi::error::Error;
use crate::abi::sanitizer::{acquire, release};
use crate::device_sync::{DeviceSync, Outside};
use crate::external::{self, Kind};
use simdevice::Allocation;
use simdevice::shared;
use std::ffi::c_int;
use std::os::fd::{AsFd, BorrowedFd, IntoRawFd, OwnedFd};
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, Ordering, fence};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

/// A payload. Submissions keep those that they wait for and signal.
#[derive(Debug)]
pub(crate) struct Payload {
    sync: Arc<DeviceSync>,
    state: State,
    /// The number of submitted operations that will signal it.
    pending: AtomicU32,
    /// The exported sync file that is signaled with it.
    exported: OnceLock<OwnedFd>,
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
            || self.file.as_ref().is_none_or(|file| sync_file::is_signaled(file.as_fd()))
    }
}

impl Payload {
    fn of(sync: &Arc<DeviceSync>, state: State) -> Arc<Self> {
        let (pending, exported) = (AtomicU32::new(0), OnceLock::new());
        Arc::new(Self { sync: Arc::clone(sync), state, pending, exported })
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

    /// A sync file that is signaled with the payload: -1 if it is signaled already. None if nothing submitted will signal
    /// it.
    ///
    /// # Errors
    /// [`Error::TooManyObjects`] if the process has no file descriptor left.
    pub(crate) fn export_sync_file(&self) -> Result<Option<c_int>, Error> {
        // It ceases to be pending after it is signaled.
        let is_pending = self.pending.load(Ordering::Acquire) > 0;
        match &self.state {
            _ if self.is_reached(1) => Ok(Some(-1)),
            State::SyncFile(SyncFile { file: Some(file), .. }) => external::export(file.as_fd()).map(Some),
            _ if !is_pending => Ok(None),
            _ => {
                let file = sync_file::new()?;
                let own = file.try_clone().map_err(|error| Error::TooManyObjects(error.to_string()))?;
                // It may be signaled meanwhile.
                let is_reached = self.sync.update(|| {
                    let _ = self.exported.set(own);
                    self.is_reached(1)
                });
                Ok(Some(if is_reached { -1 } else { file.into_raw_fd() }))
            }
        }
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
        self.sync.update(|| {
            match &self.state {
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
            }
            self.signal_exported();
        });
    }

    /// Ends an operation of [`Payloads::submit_signal`].
    pub(crate) fn end_signal(&self, value: u64) {
        self.signal(value);
        self.pending.fetch_sub(1, Ordering::AcqRel);
    }

    fn signal_exported(&self) {
        if let Some(file) = self.exported.get() {
            sync_file::signal(file.as_fd());
        }
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

    /// Where the payload changes without this device.
    pub(crate) fn outside(&self) -> Option<Outside<'_>> {
        match &self.state {
            State::Binary(_) | State::Timeline(_) => None,
            State::Shared { word, .. } => Some(word.changes().map_or(Outside::Several, Outside::Word)),
            State::SyncFile(file) => file.file.as_ref().map(|file| Outside::File(file.as_fd())),
        }
    }
}

impl Drop for Payload {
    fn drop(&mut self) {
        // Nothing will signal it any more; who waits for the file goes on, as after a lost device.
        self.signal_exported();
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

/// Sync files. The host makes them for its own drivers alone, so those that this driver makes are event counters: they are
/// polled in the same way.
#[cfg(target_os = "linux")]
mod sync_file {
    use crate::abi::error::Error;
    use crate::external;
    use rustix::event::{EventfdFlags, PollFd, PollFlags, Timespec, eventfd, poll};
    use std::ffi::c_int;
    use std::os::fd::{BorrowedFd, OwnedFd};

    /// A sync file that is not signaled.
    pub(super) fn new() -> Result<OwnedFd, Error> {
        eventfd(0, EventfdFlags::CLOEXEC | EventfdFlags::NONBLOCK)
            .map_err(|error| Error::TooManyObjects(error.to_string()))
    }

    /// Signals a sync file of [`new`].
    pub(super) fn signal(file: BorrowedFd<'_>) {
        // It fails only if the counter is full, and then it is signaled.
        let _ = rustix::io::write(file, &1u64.to_ne_bytes());
    }

    /// Reports whether a sync file is signaled, or broken.
    pub(super) fn is_signaled(file: BorrowedFd<'_>) -> bool {
        let mut files = [PollFd::from_borrowed_fd(file, PollFlags::IN)];
        let none = Timespec { tv_sec: 0, tv_nsec: 0 };
        poll(&mut files, Some(&none)).is_ok_and(|count| count > 0)
    }

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
        file.try_clone_to_owned().map_err(|error| Error::TooManyObjects(error.to_string()))
    }
}

/// Hosts without sync files.
#[cfg(not(target_os = "linux"))]
mod sync_file {
    use crate::abi::error::Error;
    use std::ffi::c_int;
    use std::os::fd::{BorrowedFd, OwnedFd};

    pub(super) fn new() -> Result<OwnedFd, Error> {
        Err(Error::TooManyObjects("the host has no sync files".to_owned()))
    }

    pub(super) fn signal(_: BorrowedFd<'_>) {}

    pub(super) fn is_signaled(_: BorrowedFd<'_>) -> bool {
        true
    }

    pub(super) fn duplicate(_: c_int) -> Result<OwnedFd, Error> {
        Err(Error::InvalidExternalHandle("the host has no sync files".to_owned()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device_sync::{WaitResult, deadline};
    use std::time::{Duration, Instant};

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
    fn a_sync_file_is_signaled_with_its_payload() {
        let sync = Arc::<DeviceSync>::default();
        let payloads = Payloads::new(Payload::binary(&sync, false));
        assert_eq!(payloads.current().export_sync_file().unwrap(), None, "nothing will signal it");
        let payload = payloads.submit_signal();
        let fd = payload.export_sync_file().unwrap().unwrap();
        let imported = Payload::import_sync_file(&sync, fd).unwrap();
        // SAFETY: the descriptor is this test's.
        unsafe { external::close(fd) };
        assert_eq!(wait(&sync, &imported, 2_000_000), WaitResult::TimedOut);
        std::thread::scope(|scope| {
            scope.spawn(|| payload.end_signal(0));
            assert_eq!(wait(&sync, &imported, 60_000_000_000), WaitResult::Ready);
        });
        assert_eq!(payload.export_sync_file().unwrap(), Some(-1));
        assert_eq!(imported.export_sync_file().unwrap(), Some(-1));
        payload.reset();
        assert_eq!(payload.export_sync_file().unwrap(), None, "nothing will signal it again");
        assert!(Payload::import_sync_file(&sync, -1).unwrap().is_reached(1));
    }

    #[test]
    fn what_is_dropped_signals_its_sync_file() {
        let sync = Arc::<DeviceSync>::default();
        let payloads = Payloads::new(Payload::binary(&sync, false));
        let fd = payloads.submit_signal().export_sync_file().unwrap().unwrap();
        let imported = Payload::import_sync_file(&sync, fd).unwrap();
        // SAFETY: the descriptor is this test's.
        unsafe { external::close(fd) };
        assert!(!imported.is_reached(1));
        drop(payloads);
        assert!(imported.is_reached(1));
    }

    #[test]
    fn other_files_are_no_sync_files() {
        let sync = Arc::<DeviceSync>::default();
        let null = std::fs::File::open("/dev/null").unwrap();
        let (pipe, _writer) = std::io::pipe().unwrap();
        for fd in [std::os::fd::AsRawFd::as_raw_fd(&null), std::os::fd::AsRawFd::as_raw_fd(&pipe), -2, i32::MAX] {
            assert!(matches!(Payload::import_sync_file(&sync, fd), Err(Error::InvalidExternalHandle(_))), "{fd}");
        }
    }

    #[test]
    fn a_temporary_payload_ends() {
        let sync = Arc::<DeviceSync>::default();
        let payloads = Payloads::new(Payload::binary(&sync, false));
        payloads.replace(Payload::binary(&sync, true), true);
        assert!(payloads.current().is_reached(1));
        let (taken, was_temporary) = payloads.take();
        assert!(taken.is_reached(1) && was_temporary);
        assert!(!payloads.current().is_reached(1) && !payloads.take().1);
        payloads.replace(Payload::binary(&sync, true), false);
        assert!(payloads.take().0.is_reached(1) && payloads.current().is_reached(1));
    }
}
