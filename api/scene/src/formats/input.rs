//! The trait of a scene format, and the input that it reads.

use std::io::{self, BufRead, ErrorKind, Read};

use crate::error::{Fault, Place, Reason};
use crate::scene::Scene;

/// A format of scene files.
pub(super) trait Format: Sync {
    /// The name, as messages show it.
    fn name(&self) -> &'static str;

    /// Extensions of file names, lower case, without the first dot.
    fn extensions(&self) -> &'static [&'static str];

    /// First bytes that only this format has, where there are any.
    fn magic(&self) -> Option<&'static [u8]>;

    /// Reads a whole scene.
    ///
    /// # Errors
    /// If the input is malformed; nothing of a size that the input cannot hold is allocated.
    fn load(&self, input: &mut Input<'_>) -> Result<Scene, Fault>;
}

/// What a [`Format`] reads from: bytes in order, how many there are, and how many have been read.
pub(super) struct Input<'a> {
    reader: &'a mut dyn BufRead,
    len: u64,
    position: u64,
}

impl<'a> Input<'a> {
    /// An input of `len` bytes.
    pub fn new(reader: &'a mut dyn BufRead, len: u64) -> Self {
        Self {
            reader,
            len,
            position: 0,
        }
    }

    /// The size in bytes.
    pub fn size(&self) -> u64 {
        self.len
    }

    /// Bytes that have not been read.
    pub fn remaining(&self) -> u64 {
        self.len.saturating_sub(self.position)
    }

    /// Fills `buffer`.
    pub(super) fn fill(&mut self, buffer: &mut [u8]) -> Result<(), Fault> {
        let position = self.position;
        self.read_exact(buffer)
            .map_err(|error| read_fault(error, position))
    }

    /// Appends the next line to `line`, its end included; at most `limit` bytes.
    pub(super) fn line(&mut self, line: &mut Vec<u8>, limit: u64) -> Result<(), Fault> {
        let position = self.position;
        self.take(limit)
            .read_until(b'\n', line)
            .map_err(|error| read_fault(error, position))?;
        Ok(())
    }
}

/// The fault of an `error` met when reading at byte `position`.
pub(super) fn read_fault(error: io::Error, position: u64) -> Fault {
    match error.kind() {
        ErrorKind::UnexpectedEof => Reason::Truncated.at(Place::Byte(position)),
        _ => Reason::Io(error).at(Place::Byte(position)),
    }
}

impl Read for Input<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let read = self.reader.read(buffer)?;
        self.position += read as u64;
        Ok(read)
    }
}

impl BufRead for Input<'_> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        self.reader.fill_buf()
    }

    fn consume(&mut self, amount: usize) {
        self.reader.consume(amount);
        self.position += amount as u64;
    }
}
