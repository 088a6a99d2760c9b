//! Replay of recorded commands: one match converts a recording to the packets that the device executes.

mod decoding;
mod descriptors;
mod draw;
mod gaussian;
mod state;

use self::draw::DrawError;
use self::state::{SharedSet, State, slot};
use super::{Command, DrawByteCount, DrawIndirect, DrawParameters, HarmonicsBuffer, query};
use crate::abi::error::Error;
use crate::device_sync::{DeviceSync, Outside, WaitResult};
use crate::instance::Instance;
use crate::pipeline::PipelineKind;
use ash::vk;
use simdevice::command_processor::ExecutionError;
use simdevice::transform_feedback::{CounterBuffers, TransformFeedback};
use simdevice::{CommandProcessor, Packet};
use std::sync::Arc;

/// The execution of commands on a queue's thread.
pub(super) struct Execution<'a> {
    /// The queue's command processor.
    pub(super) processor: &'a mut CommandProcessor,
    /// The state that can be waited for on the device, and its loss.
    pub(super) sync: &'a DeviceSync,
    /// The instance, to which errors in the recording are reported.
    pub(super) instance: &'a Instance,
}

impl Execution<'_> {
    /// Waits until `ready`. What others than the device change is `outside`.
    ///
    /// # Errors
    /// [`Error::DeviceLost`] if the device was lost meanwhile.
    pub(super) fn wait(&self, outside: Option<Outside<'_>>, ready: impl Fn() -> bool) -> Result<(), Error> {
        match self.sync.wait_for(None, outside, ready) {
            WaitResult::Ready => Ok(()),
            WaitResult::TimedOut | WaitResult::Lost => {
                Err(Error::DeviceLost("it was lost while a queue waited".into()))
            }
        }
    }

    /// Executes a packet, after everything before it has been executed.
    fn execute(&mut self, packet: &Packet) -> Result<(), Error> {
        match self.processor.execute(packet) {
            // The draw draws nothing, and execution continues after it.
            Err(error @ ExecutionError::TooManyGaussians(_)) => {
                self.report(&format!("a draw draws nothing: {error}"));
                Ok(())
            }
            executed => executed.map_err(|error| Error::DeviceLost(error.to_string())),
        }
    }

    /// Reports an error in the recording to the application.
    fn report(&self, message: &str) {
        log::warn!("{message}");
        self.instance.report(
            vk::DebugUtilsMessageSeverityFlagsEXT::WARNING,
            vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION,
            "GAURAST-draw-skipped",
            message,
        );
    }
}

/// Replays a command buffer.
///
/// # Errors
/// [`Error::DeviceLost`] if the device is lost during execution; the rest of the command buffer is then not executed.
pub(super) fn replay(commands: &[Command], execution: &mut Execution<'_>) -> Result<(), Error> {
    replay_from(State::default(), commands, execution)
}

/// Replays commands from a state on.
fn replay_from(mut state: State, commands: &[Command], execution: &mut Execution<'_>) -> Result<(), Error> {
    commands.iter().try_for_each(|command| execute(command, &mut state, execution))
}

fn execute(command: &Command, state: &mut State, execution: &mut Execution<'_>) -> Result<(), Error> {
    if state.discards && is_conditional(command) {
        return Ok(());
    }
    match command {
        Command::Packet(packet) => execution.execute(packet)?,
        Command::BindPipeline(pipeline) => {
            state.pipeline = Some(pipeline.clone());
            state.draw_state = None;
        }
        Command::BindVertexBuffer { binding, buffer } => {
            *slot(&mut state.vertex_buffers, *binding) = Some(buffer.clone());
        }
        Command::BindIndexBuffer(buffer) => state.index_buffer = Some(buffer.clone()),
        Command::SetPrimitiveRestartIndex(index) => {
            if let Some(bound) = &mut state.index_buffer {
                bound.restart = Some(*index);
            }
        }
        Command::SetViewport { index, viewport } => {
            *slot(&mut state.viewports, *index) = Some(*viewport);
            state.draw_state = None;
        }
        Command::SetViewportCount(count) => {
            state.viewport_count = Some(*count);
            state.draw_state = None;
        }
        Command::SetScissor { index, scissor } => {
            *slot(&mut state.scissors, *index) = Some(*scissor);
            state.draw_state = None;
        }
        Command::SetScissorCount(count) => {
            state.scissor_count = Some(*count);
            state.draw_state = None;
        }
        Command::SetDynamicState(dynamic_state) => {
            state.dynamic_states.set(*dynamic_state);
            state.draw_state = None;
        }
        Command::SetCameras(cameras) => state.cameras.clone_from(cameras),
        Command::BindHarmonics(buffer) => state.harmonics = Some(HarmonicsBuffer::clone(buffer)),
        Command::BindDecodingTables(tables) => state.decoding_tables = Some(tables.clone()),
        Command::BeginGaussianSet => state.gaussian_set = Some(SharedSet::default()),
        Command::EndGaussianSet => {
            let set = state.gaussian_set.take();
            // A set without draws was never begun on the device.
            if set.is_some_and(|set| set.first.is_some()) {
                execution.execute(&Packet::GaussianEnd)?;
            }
        }
        Command::Draw(parameters) => draw(state, parameters, 0, execution)?,
        Command::DrawMulti(draws) => {
            for (index, parameters) in (0..).zip(draws) {
                draw(state, parameters, index, execution)?;
            }
        }
        Command::SetVertexInput(input) => state.set_vertex_input(input),
        Command::DrawIndirect(indirect) => draw_indirect(state, indirect, execution)?,
        Command::BindComputePipeline(pipeline) => state.compute_pipeline = Some(pipeline.clone()),
        Command::BindSets(bind) => state.sets_mut(bind.bind_point).bind(bind.first, &bind.sets),
        Command::PushDescriptors(push) => {
            let sets = state.sets_mut(push.bind_point);
            if let Err(error) = sets.push(push.set, &push.layout, &push.writes) {
                execution.report(&format!("descriptors are not pushed: {error}"));
            }
        }
        Command::PushConstants { offset, bytes } => state.push_constants(*offset, bytes),
        Command::Dispatch { base, count } => dispatch(state, *base, *count, execution)?,
        Command::DispatchIndirect(range) => {
            let mut count = [0; 3];
            // The range was checked when the command was recorded.
            if range.memory.read(range.offset, &mut count).is_ok() {
                dispatch(state, [0; 3], count, execution)?;
            }
        }
        Command::BeginConditional { predicate, is_inverted } => {
            let mut word = [0u32];
            // The range was checked when the command was recorded.
            let is_read = predicate.memory.read(predicate.offset, &mut word).is_ok();
            state.discards = is_read && (word == [0]) != *is_inverted;
        }
        Command::EndConditional => state.discards = false,
        Command::BindTransformFeedbackBuffer { binding, buffer } => {
            if let Some(bound) = state.captured_buffers.get_mut(*binding as usize) {
                *bound = Some(buffer.clone());
            }
        }
        Command::BeginTransformFeedback(counters) => {
            let feedback = Arc::new(TransformFeedback::new(state.captured_buffers.clone()));
            state.transform_feedback = Some(Arc::clone(&feedback));
            let counters = CounterBuffers::clone(counters);
            execution.execute(&Packet::BeginTransformFeedback { feedback, counters })?;
        }
        Command::EndTransformFeedback(counters) => {
            if let Some(feedback) = state.transform_feedback.take() {
                let counters = CounterBuffers::clone(counters);
                execution.execute(&Packet::EndTransformFeedback { feedback, counters })?;
            }
        }
        Command::DrawByteCount(drawn) => draw_byte_count(state, drawn, execution)?,
        Command::BeginStreamQuery { pool, query, stream } => {
            pool.set_stream(*query, *stream);
            execution.execute(&Packet::BeginQuery { pool: Arc::clone(&pool.queries), index: *query })?;
        }
        Command::SetEvent(event, value) => event.set(*value),
        Command::WaitEvents(events) => {
            for event in events {
                execution.wait(None, || event.is_set())?;
            }
        }
        Command::CopyQueryResults(copy) => {
            // Everything before has been executed, so this queue will not make another query available.
            for packet in query::copy_packets(copy) {
                execution.execute(&packet)?;
            }
        }
        Command::Execute(secondaries) => {
            // They inherit the condition, and no bound state, which is undefined after them.
            let inherited = State { discards: state.discards, ..State::default() };
            for commands in secondaries {
                replay_from(inherited.clone(), commands, execution)?;
            }
            *state = inherited;
        }
    }
    Ok(())
}

/// Tells if conditional rendering decides whether a command is executed.
fn is_conditional(command: &Command) -> bool {
    matches!(
        command,
        Command::Draw(_)
            | Command::DrawMulti(_)
            | Command::DrawIndirect(_)
            | Command::DrawByteCount(_)
            | Command::Dispatch { .. }
            | Command::DispatchIndirect(_)
            | Command::Packet(Packet::ClearAttachments(_))
    )
}

fn draw(
    state: &mut State,
    parameters: &DrawParameters,
    draw_index: u32,
    execution: &mut Execution<'_>,
) -> Result<(), Error> {
    if parameters.count == 0 || parameters.instance_count == 0 {
        return Ok(());
    }
    let packets = packets(state, parameters, draw_index);
    let unset = state.unset_dynamic.take();
    match packets {
        Ok(packets) => {
            if let Some(sentence) = gaussian::beyond_buffers(&packets) {
                execution.report(&sentence);
            }
            if let Some(unset) = unset {
                execution.report(&format!(
                    "the pipeline's {unset:?} is dynamic and was not set: the draw takes its default"
                ));
            }
            packets.iter().try_for_each(|packet| execution.execute(packet))
        }
        Err(reason) => {
            execution.report(&format!("a draw draws nothing: {reason}"));
            Ok(())
        }
    }
}

/// The packets of a draw.
fn packets(state: &mut State, parameters: &DrawParameters, draw_index: u32) -> Result<Vec<Packet>, DrawError> {
    let pipeline = state.pipeline.clone().ok_or(DrawError::Pipeline)?;
    match &pipeline.kind {
        PipelineKind::Gaussian(gaussian) => {
            let begin = gaussian::begin(state, gaussian)?;
            let append = gaussian::append(state, &pipeline, gaussian, &begin.set, parameters, draw_index)?;
            // A set has one fragment in a pixel, which may read what earlier draws have left there.
            let mut packets = Vec::from_iter(gaussian.fixed.draw.reads_attachments.then_some(Packet::Barrier));
            let Some(set) = &mut state.gaussian_set else {
                packets.extend(begin.packets());
                packets.extend([append, Packet::GaussianEnd]);
                return Ok(packets);
            };
            match &set.first {
                None => {
                    set.first = Some((Arc::clone(&pipeline), Box::new(begin.set.clone())));
                    packets.extend(begin.packets());
                    packets.push(append);
                    Ok(packets)
                }
                Some((first, _)) if !Arc::ptr_eq(first, &pipeline) => Err(DrawError::OtherPipelineInSet),
                Some((_, first)) if **first != begin.set => Err(DrawError::OtherStateInSet),
                Some(_) => Ok(vec![append]),
            }
        }
        PipelineKind::Primitive(primitives) => {
            draw::primitives(state, &pipeline, primitives, parameters, draw_index).map(|packet| vec![packet])
        }
    }
}

/// Draws the vertices that transform feedback has written.
fn draw_byte_count(state: &mut State, drawn: &DrawByteCount, execution: &mut Execution<'_>) -> Result<(), Error> {
    let written = draw::read_count(&drawn.counter).unwrap_or(0);
    let parameters = DrawParameters {
        vertex_offset: None,
        first: 0,
        count: written.saturating_sub(drawn.counter_offset) / drawn.vertex_stride.max(1),
        first_instance: drawn.first_instance,
        instance_count: drawn.instance_count,
    };
    draw(state, &parameters, 0, execution)
}

fn dispatch(state: &State, base: [u32; 3], count: [u32; 3], execution: &mut Execution<'_>) -> Result<(), Error> {
    match descriptors::dispatch(state, base, count) {
        Ok(packet) => execution.execute(&packet),
        Err(reason) => {
            execution.report(&format!("a dispatch does nothing: {reason}"));
            Ok(())
        }
    }
}

fn draw_indirect(state: &mut State, indirect: &DrawIndirect, execution: &mut Execution<'_>) -> Result<(), Error> {
    let draw_count = match indirect.count.as_ref().map(draw::read_count) {
        None => indirect.draw_count,
        Some(count) => count.unwrap_or(0).min(indirect.draw_count),
    };
    for index in 0..draw_count {
        let offset = u64::from(index) * u64::from(indirect.stride);
        match draw::read_draw(&indirect.parameters, offset, indirect.indexed) {
            Some(parameters) => draw(state, &parameters, index, execution)?,
            None => {
                execution.report("an indirect draw's parameters lie outside their buffer");
                break;
            }
        }
    }
    Ok(())
}
