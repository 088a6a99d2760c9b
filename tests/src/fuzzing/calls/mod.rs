//! Vulkan calls in any order and with many values. Some of them violate valid usage: sizes and offsets that do not fit,
//! commands in wrong places, counts of any size. Handles are always valid and of the right type, pointers are valid,
//! and no object is destroyed while it is in use, because the driver guarantees nothing otherwise.

mod create;
mod record;
mod run;
mod triangles;

use super::bytes::Bytes;
use run::Run;

pub use run::Ended;

/// The greatest number of calls of a run.
const CALLS: usize = 120;

/// Makes the calls that `data` encodes, on a device of its own.
///
/// # Panics
/// If the driver fails at something that does not depend on `data`.
pub fn run(data: &[u8]) -> Ended {
    let mut bytes = Bytes::new(data);
    let mut run = Run::new();
    for _ in 0..CALLS {
        if bytes.is_empty() || run.ended.lost.is_some() {
            break;
        }
        call(&mut run, &mut bytes);
    }
    run.ended.clone()
}

fn call(run: &mut Run, bytes: &mut Bytes<'_>) {
    match bytes.below(32) {
        0 | 1 => create::create_buffer(run, bytes),
        2 | 3 => create::create_image(run, bytes),
        4 if bytes.rarely(2) => triangles::create_pipeline(run, bytes),
        4 => create::create_pipeline(run, bytes),
        5 => create::map(run, bytes),
        6 => run.destroy(bytes),
        7 | 8 => run.begin(bytes),
        9 | 10 => run.submit(),
        11 | 12 => record::begin_rendering(run, bytes),
        // SAFETY: see `run`.
        13 => unsafe { run.device.cmd_end_rendering(run.commands) },
        14..18 => record::copy(run, bytes),
        18 | 19 => record::query(run, bytes),
        20 => {
            let _ = record::set_state(run, bytes);
        }
        21 => record::set_state_with_lens(run, bytes),
        22..24 => record::bind_vertex_buffers(run, bytes),
        24 => record::clear(run, bytes),
        _ => record::draw(run, bytes),
    }
}
