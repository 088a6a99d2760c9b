//! Vulkan calls in any order and with many values, among them some that valid usage forbids: sizes and offsets that don't
//! fit, commands where they don't belong, counts of any size. Handles are always live ones of the right kind, pointers
//! are valid, and nothing is destroyed while it is in use: where those rules are broken, nothing can be promised.

mod create;
mod record;
mod run;
mod triangles;

use super::bytes::Bytes;
use run::Run;

pub use run::Ended;

/// Calls of a run at most.
const CALLS: usize = 120;

/// Makes the calls that bytes say, on a device of its own.
///
/// # Panics
/// If the driver cannot do what doesn't depend on the bytes.
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
        20 | 21 => record::set_state(run, bytes),
        22..24 => record::bind_vertex_buffers(run, bytes),
        24 => record::clear(run, bytes),
        _ => record::draw(run, bytes),
    }
}
