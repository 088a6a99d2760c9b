//! Memory that is shared with the server of a window system.

use crate::error::lost;
use driver::window::WindowLost;
use memmap2::MmapMut;
use rustix::fs::{MemfdFlags, ftruncate, memfd_create};
use std::fs::File;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};

/// Anonymous memory with a file descriptor.
pub(crate) struct SharedMemory {
    file: File,
    map: MmapMut,
}

impl SharedMemory {
    /// Creates `size` bytes, which are zero.
    ///
    /// # Errors
    /// [`WindowLost`] if the system can't provide them.
    pub(crate) fn new(size: usize) -> Result<Self, WindowLost> {
        let file = memfd_create("gaurast-picture", MemfdFlags::CLOEXEC).map_err(lost)?;
        ftruncate(&file, size as u64).map_err(lost)?;
        let file = File::from(file);
        // SAFETY: the file is this process's own and never shrinks; the server that it is sent to only reads it.
        let map = unsafe { MmapMut::map_mut(&file) }.map_err(lost)?;
        Ok(Self { file, map })
    }

    /// Its bytes.
    pub(crate) fn bytes(&mut self) -> &mut [u8] {
        &mut self.map
    }

    /// Its file descriptor, to be sent to a server.
    pub(crate) fn descriptor(&self) -> BorrowedFd<'_> {
        self.file.as_fd()
    }

    /// A copy of its file descriptor, for a receiver that closes it.
    ///
    /// # Errors
    /// [`WindowLost`] if the process has no descriptors left.
    pub(crate) fn own_descriptor(&self) -> Result<OwnedFd, WindowLost> {
        self.descriptor().try_clone_to_owned().map_err(lost)
    }
}
