//! Replays recorded commands: the one match from what was recorded to what the device executes.

use super::record::{Command, CopyQueryResults, Draw, DrawIndirect};
use super::state::{State, bind};
use crate::lower::draw::Undrawn;
use crate::lower::{compute, gaussian, polygon};
use crate::object::event::Event;
use crate::object::pipeline::Primitive;
use simdevice::Packet;
use simdevice::packet::BufferRange;

/// What a replay needs of the queue that it runs on.
pub(crate) trait Executor {
    /// Executes a packet; everything before it has been executed.
    ///
    /// # Errors
    /// [`Lost`] if the device cannot go on.
    fn execute(&mut self, packet: &Packet) -> Result<(), Lost>;

    /// Waits until `event` is set.
    ///
    /// # Errors
    /// [`Lost`] if the device was lost meanwhile.
    fn wait_event(&mut self, event: &Event) -> Result<(), Lost>;

    /// Waits until what the copy reads is available, if it asks for that, and gives the bytes to be written.
    ///
    /// # Errors
    /// [`Lost`] if the device was lost meanwhile.
    fn query_results(&mut self, copy: &CopyQueryResults) -> Result<Vec<Packet>, Lost>;

    /// Tells the application of something that it should not have recorded.
    fn report(&mut self, message: &str);
}

/// The device cannot go on.
#[derive(Clone, Debug, thiserror::Error)]
#[error("the device is lost: {0}")]
pub(crate) struct Lost(pub String);

/// Replays a command buffer.
///
/// # Errors
/// [`Lost`] if the device is lost while it executes; what follows in the command buffer is then not executed.
pub(crate) fn replay(commands: &[Command], executor: &mut dyn Executor) -> Result<(), Lost> {
    let mut state = State::default();
    for command in commands {
        end_set(command, &mut state, executor)?;
        step(command, &mut state, executor)?;
    }
    close_set(&mut state, executor)
}

/// Ends the sorted set that draws are merged into, unless the command may come between them.
fn end_set(command: &Command, state: &mut State, executor: &mut dyn Executor) -> Result<(), Lost> {
    match command {
        Command::Draw(_)
        | Command::DrawIndirect(_)
        | Command::BindVertexBuffers { .. }
        | Command::BindIndexBuffer(_) => Ok(()),
        // What a vertex shader is bound to may change from draw to draw.
        Command::BindSets(_) | Command::PushDescriptors(_) | Command::PushConstants { .. }
            if state.shades_gaussians() =>
        {
            Ok(())
        }
        _ => close_set(state, executor),
    }
}

fn close_set(state: &mut State, executor: &mut dyn Executor) -> Result<(), Lost> {
    if std::mem::take(&mut state.set_is_open) {
        executor.execute(&Packet::GaussianResolve)?;
    }
    Ok(())
}

fn step(command: &Command, state: &mut State, executor: &mut dyn Executor) -> Result<(), Lost> {
    match command {
        Command::Packet(packet) => executor.execute(packet)?,
        Command::BindPipeline(pipeline) => {
            state.pipeline = Some(pipeline.clone());
            state.draw_state = None;
        }
        Command::BindVertexBuffers { first, buffers } => {
            bind(&mut state.vertex_buffers, *first, buffers);
        }
        Command::BindIndexBuffer(buffer) => state.index_buffer = Some(buffer.clone()),
        Command::SetViewports {
            first,
            viewports,
            with_count,
        } => {
            bind(&mut state.viewports, *first, viewports);
            if *with_count {
                state.viewport_count = Some(viewports.len() as u32);
            }
            state.draw_state = None;
        }
        Command::SetScissors {
            first,
            scissors,
            with_count,
        } => {
            bind(&mut state.scissors, *first, scissors);
            if *with_count {
                state.scissor_count = Some(scissors.len() as u32);
            }
            state.draw_state = None;
        }
        Command::Set(setting) => {
            state.settings.set(*setting);
            state.draw_state = None;
        }
        Command::SetCamera(camera) => state.camera = Some(**camera),
        Command::Draw(numbers) => draw(state, numbers, 0, executor)?,
        Command::DrawIndirect(indirect) => draw_indirect(state, indirect, executor)?,
        Command::BindComputePipeline(pipeline) => state.compute_pipeline = Some(pipeline.clone()),
        Command::BindSets(bind) => state.sets_mut(bind.bind_point).bind(bind.first, &bind.sets),
        Command::PushDescriptors(push) => {
            let sets = state.sets_mut(push.bind_point);
            if let Err(error) = sets.push(push.set, &push.layout, &push.writes) {
                executor.report(&format!("descriptors are not pushed: {error}"));
            }
        }
        Command::PushConstants { offset, bytes } => state.push_constants(*offset, bytes),
        Command::Dispatch { base, count } => dispatch(state, *base, *count, executor)?,
        Command::DispatchIndirect(range) => {
            let mut count = [0; 3];
            // The range was checked when the command was recorded.
            if range.memory.read(range.offset, &mut count).is_ok() {
                dispatch(state, [0; 3], count, executor)?;
            }
        }
        Command::SetEvent(event, value) => event.set(*value),
        Command::WaitEvents(events) => {
            for event in events {
                executor.wait_event(event)?;
            }
        }
        Command::CopyQueryResults(copy) => {
            for packet in executor.query_results(copy)? {
                executor.execute(&packet)?;
            }
        }
        Command::Execute(secondaries) => {
            for commands in secondaries {
                replay(commands, executor)?;
            }
            // Bound state is undefined after secondaries.
            *state = State::default();
        }
    }
    Ok(())
}

fn draw(
    state: &mut State,
    numbers: &Draw,
    draw_index: u32,
    executor: &mut dyn Executor,
) -> Result<(), Lost> {
    if numbers.count == 0 || numbers.instance_count == 0 {
        return Ok(());
    }
    match packets(state, numbers, draw_index) {
        Ok(packets) => packets
            .iter()
            .try_for_each(|packet| executor.execute(packet)),
        Err(reason) => {
            executor.report(&format!("a draw draws nothing: {reason}"));
            Ok(())
        }
    }
}

/// The packets of a draw.
fn packets(state: &mut State, numbers: &Draw, draw_index: u32) -> Result<Vec<Packet>, Undrawn> {
    let pipeline = state.pipeline.clone().ok_or(Undrawn::Pipeline)?;
    match &pipeline.primitive {
        Primitive::Gaussian(gaussian) => {
            let append = gaussian::append(state, &pipeline, gaussian, numbers, draw_index)?;
            if state.set_is_open {
                return Ok(vec![append]);
            }
            let mut packets = gaussian::begin(state, gaussian)?;
            state.set_is_open = gaussian.merges_draws;
            packets.push(append);
            if !gaussian.merges_draws {
                packets.push(Packet::GaussianResolve);
            }
            Ok(packets)
        }
        Primitive::Polygons(polygons) => {
            polygon::draw(state, &pipeline, polygons, numbers, draw_index)
                .map(|packet| vec![packet])
        }
    }
}

fn dispatch(
    state: &State,
    base: [u32; 3],
    count: [u32; 3],
    executor: &mut dyn Executor,
) -> Result<(), Lost> {
    match compute::dispatch(state, base, count) {
        Ok(packet) => executor.execute(&packet),
        Err(reason) => {
            executor.report(&format!("a dispatch does nothing: {reason}"));
            Ok(())
        }
    }
}

fn draw_indirect(
    state: &mut State,
    indirect: &DrawIndirect,
    executor: &mut dyn Executor,
) -> Result<(), Lost> {
    let draw_count = match indirect.count.as_ref().map(read_count) {
        None => indirect.draw_count,
        Some(count) => count.unwrap_or(0).min(indirect.draw_count),
    };
    for index in 0..draw_count {
        let offset = u64::from(index) * u64::from(indirect.stride);
        match read_draw(&indirect.parameters, offset, indirect.indexed) {
            Some(numbers) => draw(state, &numbers, index, executor)?,
            None => {
                executor.report("an indirect draw's numbers lie outside their buffer");
                break;
            }
        }
    }
    Ok(())
}

/// Reads how many draws there are.
fn read_count(range: &BufferRange) -> Option<u32> {
    let mut count = [0];
    range.memory.read(range.offset, &mut count).ok()?;
    Some(count[0])
}

/// Reads `VkDrawIndirectCommand` or `VkDrawIndexedIndirectCommand`.
fn read_draw(parameters: &BufferRange, offset: u64, indexed: bool) -> Option<Draw> {
    let mut words = [0u32; 5];
    let words = &mut words[..if indexed { 5 } else { 4 }];
    if offset.checked_add(size_of_val(words) as u64)? > parameters.size {
        return None;
    }
    let offset = parameters.offset.checked_add(offset)?;
    parameters.memory.read(offset, words).ok()?;
    Some(match *words {
        [count, instance_count, first, vertex_offset, first_instance] => Draw {
            vertex_offset: Some(vertex_offset as i32),
            first,
            count,
            first_instance,
            instance_count,
        },
        [count, instance_count, first, first_instance] => Draw {
            vertex_offset: None,
            first,
            count,
            first_instance,
            instance_count,
        },
        _ => return None,
    })
}
