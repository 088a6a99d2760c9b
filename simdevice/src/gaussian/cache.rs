//! Which draws have chunks. Those of a draw are made when it is drawn for the second time, since a picture that is drawn
//! once is drawn faster without them. They live in the memory that they are derived from: when that is freed or written,
//! they are gone.

use super::chunks::{self, Chunks};
use crate::format::Format;
use crate::packet::{AttributeStream, GaussianAppend};
use devmem::Allocation;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};

/// Draws of fewer Gaussians have no chunks.
const LEAST_COUNT: u32 = 512;

/// Draws that are remembered.
const MAX_ENTRIES: usize = 256;

/// What an attribute is read from.
#[derive(Debug)]
struct Stream {
    memory: Weak<Allocation>,
    generation: u64,
    /// Offset and size of the buffer, stride and offset of the attribute.
    place: [u64; 4],
    format: Format,
}

/// A draw that was seen.
#[derive(Debug)]
struct Entry {
    streams: [Stream; 4],
    first: u32,
    count: u32,
    /// When it was last drawn.
    used: u64,
    /// Its chunks, if they were made; they belong to the memory of its positions.
    chunks: Weak<Chunks>,
}

#[derive(Debug, Default)]
struct Entries {
    entries: Vec<Entry>,
    /// Counts the draws.
    now: u64,
}

/// The draws of a device that were seen, and their chunks.
#[derive(Debug, Default)]
pub(crate) struct ChunkCache(Mutex<Entries>);

impl Stream {
    fn new(stream: &AttributeStream) -> Self {
        let buffer = &stream.buffer;
        Self {
            memory: Arc::downgrade(&buffer.memory),
            generation: buffer.memory.generation(),
            place: [
                buffer.offset,
                buffer.size,
                stream.stride.into(),
                stream.offset.into(),
            ],
            format: stream.format,
        }
    }

    /// Whether the memory still holds what it held.
    fn is_current(&self) -> bool {
        let memory = self.memory.upgrade();
        memory.is_some_and(|memory| memory.generation() == self.generation)
    }

    fn is_same(&self, other: &Self) -> bool {
        self.memory.ptr_eq(&other.memory)
            && (self.generation, self.place, self.format)
                == (other.generation, other.place, other.format)
    }
}

impl Entry {
    fn new(append: &GaussianAppend) -> Self {
        let attributes = &append.attributes;
        let streams = [
            &attributes.position,
            &attributes.scale,
            &attributes.rotation,
            &attributes.opacity,
        ];
        Self {
            streams: streams.map(Stream::new),
            first: append.first,
            count: append.count,
            used: 0,
            chunks: Weak::new(),
        }
    }

    fn is_same(&self, other: &Self) -> bool {
        let mut streams = self.streams.iter().zip(&other.streams);
        (self.first, self.count) == (other.first, other.count) && streams.all(|(a, b)| a.is_same(b))
    }

    /// Bytes that its chunks take.
    fn memory_bytes(&self) -> u64 {
        match self.chunks.strong_count() {
            0 => 0,
            _ => chunks::memory_bytes(self.count),
        }
    }

    /// Frees its chunks.
    fn release(&self) {
        if let Some((memory, chunks)) = self.streams[0].memory.upgrade().zip(self.chunks.upgrade())
        {
            memory.drop_derived(&(chunks as _));
        }
    }
}

impl Entries {
    /// Makes room for `bytes` more by freeing the chunks that were not used for longest, and those whose memory has
    /// changed.
    fn make_room(&mut self, bytes: u64, budget: u64) {
        self.entries.sort_by_key(|entry| entry.used);
        let held: u64 = self.entries.iter().map(Entry::memory_bytes).sum();
        let mut excess = held.saturating_add(bytes).saturating_sub(budget);
        let mut entries = self.entries.len();
        self.entries.retain(|entry| {
            let keep = excess == 0 && entries <= MAX_ENTRIES;
            if !keep {
                excess = excess.saturating_sub(entry.memory_bytes());
                entries -= 1;
                entry.release();
            }
            keep
        });
    }
}

impl ChunkCache {
    fn lock(&self) -> MutexGuard<'_, Entries> {
        // What a panic left behind is only forgotten sooner.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The chunks of what `append` draws, if it has any; `build` makes them. All chunks together take at most `budget`
    /// bytes.
    pub(super) fn get(
        &self,
        append: &GaussianAppend,
        budget: u64,
        build: impl FnOnce() -> Chunks,
    ) -> Option<Arc<Chunks>> {
        if !is_eligible(append) || chunks::memory_bytes(append.count) > budget {
            return None;
        }
        // Generations are read before the memory, so that what is written meanwhile makes them old.
        let mut drawn = Entry::new(append);
        {
            let mut entries = self.lock();
            entries.now += 1;
            drawn.used = entries.now;
            entries.entries.retain(|entry| {
                let current = entry.streams.iter().all(Stream::is_current);
                if !current {
                    entry.release();
                }
                current
            });
            let mut all = entries.entries.iter_mut();
            let Some(seen) = all.find(|entry| entry.is_same(&drawn)) else {
                entries.entries.push(drawn);
                entries.make_room(0, budget);
                return None;
            };
            seen.used = drawn.used;
            if let Some(chunks) = seen.chunks.upgrade() {
                return Some(chunks);
            }
            entries.entries.retain(|entry| !entry.is_same(&drawn));
            entries.make_room(chunks::memory_bytes(append.count), budget);
        }
        let chunks = Arc::new(build());
        drawn.chunks = Arc::downgrade(&chunks);
        let memory = &append.attributes.position.buffer.memory;
        memory.keep_derived(Arc::clone(&chunks) as _);
        self.lock().entries.push(drawn);
        Some(chunks)
    }
}

/// Whether what is drawn is in memory that only the device writes, and all of it by vertex.
fn is_eligible(append: &GaussianAppend) -> bool {
    let attributes = &append.attributes;
    let streams = [
        &attributes.position,
        &attributes.scale,
        &attributes.rotation,
        &attributes.opacity,
    ];
    let fixed = |stream: &&AttributeStream| {
        !stream.buffer.memory.is_host_visible() && stream.instance_divisor.is_none()
    };
    append.indices.is_none() && append.count >= LEAST_COUNT && streams.iter().all(fixed)
}
