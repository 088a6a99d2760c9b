//! Replays the reads of a trace's last frame into a cache: `cargo run -p gaurast-timing --example cache -- work.json [KIB]`.
//! A module reads an entry of its tile's list, then the record that the entry names.

use timing::trace_file;
use timing::work::{ENTRY_BYTES, RECORD_BYTES};

const LINE_BYTES: u64 = 64;
const WAYS: usize = 8;

/// A cache whose sets replace the line that was used least recently.
struct Cache {
    sets: Vec<Vec<u64>>,
    reads: u64,
    misses: u64,
}

impl Cache {
    fn new(bytes: u64) -> Self {
        let sets = (bytes / LINE_BYTES / WAYS as u64).max(1);
        Self { sets: vec![Vec::new(); sets as usize], reads: 0, misses: 0 }
    }

    /// Reads `bytes` at an address, line by line.
    fn read(&mut self, address: u64, bytes: u64) {
        for line in address / LINE_BYTES..=(address + bytes - 1) / LINE_BYTES {
            let count = self.sets.len() as u64;
            let set = &mut self.sets[(line % count) as usize];
            self.reads += 1;
            match set.iter().position(|&known| known == line) {
                Some(place) => _ = set.remove(place),
                None => self.misses += 1,
            }
            set.truncate(WAYS - 1);
            set.insert(0, line);
        }
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let trace = trace_file::from_bytes(&std::fs::read(arguments.next().ok_or("no trace")?)?)?;
    let kib: u64 = arguments.next().map_or(Ok(512), |text| text.parse())?;
    let mut cache = Cache::new(kib * 1024);
    for draw in trace.frames.last().ok_or("no frame")?.draws.iter() {
        let mut entry = draw.places.lists;
        for tile in &draw.tiles {
            // Beyond the last run, entries are not read.
            for &id in tile.ids.iter().take(tile.needed() as usize) {
                cache.read(entry, ENTRY_BYTES);
                cache.read(draw.places.records + u64::from(id) * RECORD_BYTES, RECORD_BYTES);
                entry += ENTRY_BYTES;
            }
            entry += u64::from(tile.listed.saturating_sub(tile.needed())) * ENTRY_BYTES;
        }
    }
    let (reads, misses) = (cache.reads, cache.misses);
    println!("{kib} KiB: {reads} reads of lines, {misses} misses, {:.1} MB", misses as f64 * LINE_BYTES as f64 * 1e-6);
    Ok(())
}
