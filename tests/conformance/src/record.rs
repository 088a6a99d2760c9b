//! Execution of a [`Draw`] on a device.

use gaurast_oracle::oracle::Stored;
use gaurast_testkit::{Buffer, Commands, Gpu};

use crate::draw::{Call, Draw};
use crate::picture::Picture;
use crate::stage::Stage;

/// Draws on a device.
///
/// # Panics
/// If a command fails.
pub(crate) fn record(gpu: &Gpu, draw: &Draw, stored: &Stored) -> Picture {
    let stage = Stage::over(gpu, draw, stored, &|_| {});
    let parameters: Vec<Buffer> = (draw.calls.iter())
        .map(|call| match *call {
            Call::Indirect { vertices: [first, count] } => Buffer::of(gpu, &[count, 1, first, 0]),
            _ => Buffer::new(gpu, 16),
        })
        .collect();
    stage.run(|commands| {
        let calls: Vec<_> = draw.calls.iter().zip(&parameters).collect();
        for set in calls.split(|(call, _)| matches!(call, Call::EndSet)) {
            let all = || set.iter().for_each(|(call, at)| issue(commands, call, at));
            if draw.merged {
                commands.gaussian_set(all);
            } else {
                all();
            }
        }
    });
    stage.picture()
}

/// Records a draw command. `parameters` is the buffer of an indirect one.
fn issue(commands: &Commands, call: &Call, parameters: &Buffer) {
    match *call {
        Call::Draw { vertices: [vertex, vertices], instances: [instance, instances] } => {
            commands.draw_instances(vertex..vertex + vertices, instance..instance + instances);
        }
        Call::Indexed { indices: [first, count], offset } => commands.draw_indexed(first..first + count, offset),
        Call::Indirect { .. } => commands.draw_indirect(parameters, 1),
        Call::EndSet => {}
    }
}
