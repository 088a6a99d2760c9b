//! Runs a tessellation or geometry program on batches: its vertices and inputs.

use crate::program::interface::PrimitiveInput;
use crate::program::pool::PooledMachine;
use crate::program::primitive::PrimitiveStage;
use isa::machine::{LaneMask, Stopped, Watchdog};
use isa::resources::Resources;
use std::sync::atomic::AtomicU32;

/// The number of vertices after which they go on to the next stage, or to set-up.
pub(super) const ENOUGH_VERTICES: usize = 8192;

/// The surroundings that the programs of a draw share.
#[derive(Clone, Copy)]
pub(super) struct Environment<'a> {
    pub watchdog: Watchdog<'a>,
    /// The number of the view that is drawn.
    pub view: u32,
    /// The number of primitives that tessellation has made of the instance, if their numbers are read. The segments are
    /// then processed one after the other.
    pub presented: Option<&'a AtomicU32>,
}

/// A machine for the program of a stage.
pub(super) struct StageRunner<'a> {
    pub stage: &'a PrimitiveStage,
    pub machine: PooledMachine<'a>,
    resources: &'a Resources<'a>,
    environment: Environment<'a>,
}

impl<'a> StageRunner<'a> {
    pub(super) fn new(stage: &'a PrimitiveStage, resources: &'a Resources<'a>, environment: Environment<'a>) -> Self {
        Self { stage, machine: stage.machines.lend(), resources, environment }
    }

    /// Sets the vertices of primitive or patch number `group` of the batch, and the values of the patch. Each vertex has
    /// its values by number.
    pub(super) fn set_vertices<'v>(&mut self, group: usize, vertices: impl Iterator<Item = &'v [u32]>, patch: &[u32]) {
        let memory = &self.stage.input_memory;
        let first = memory.start as usize + group * memory.stride as usize;
        let of = |values: &[u32], number: u32| values.get(number as usize).copied().unwrap_or(0);
        for (number, vertex) in vertices.enumerate() {
            for value in &memory.values {
                if let Some(stride) = value.vertex_stride {
                    let byte = first + value.offset as usize + number * stride as usize;
                    self.machine.set_workgroup_word(byte / 4, of(vertex, value.number));
                }
            }
        }
        let of_patch = memory.values.iter().filter(|value| value.vertex_stride.is_none());
        for value in of_patch {
            let byte = first + value.offset as usize;
            self.machine.set_workgroup_word(byte / 4, of(patch, value.number));
        }
    }

    /// Runs the program in the first lanes. `input` gives the value of an input in a lane.
    pub(super) fn run(&mut self, lanes: usize, input: impl Fn(PrimitiveInput, usize) -> u32) -> Result<(), Stopped> {
        for &(slot, meaning) in &self.stage.inputs {
            match meaning {
                PrimitiveInput::ViewIndex => self.machine.fill_input(slot, self.environment.view),
                PrimitiveInput::PatchVertices => self.machine.fill_input(slot, input(meaning, 0)),
                _ => {
                    let vectors = self.machine.input_mut(slot);
                    for (lane, bits) in vectors.iter_mut().flat_map(|it| &mut it.0).enumerate() {
                        *bits = if lane < lanes { input(meaning, lane) } else { 0 };
                    }
                }
            }
        }
        self.machine.run(&LaneMask::first(lanes), &LaneMask::none(), self.resources, self.environment.watchdog)
    }

    /// A word of the program's output, by its first byte.
    pub(super) fn output_word(&self, byte: u32) -> u32 {
        self.machine.workgroup_word(byte as usize / 4)
    }
}
