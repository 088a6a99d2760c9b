//! Fragment programs that are compiled for draws of primitives and of Gaussians.

use super::pool::{MachinePool, PooledMachine};
use crate::limits::DRAW_SUBGROUP_SIZE;
use crate::program::interface::{FragmentInput, FragmentOutput, FragmentPrograms, Interpolation, Sampling, resolve};
use crate::stats::counters::Counters;
use fearless_simd::Level;
use isa::Options;
use isa::machine::{Executable, Machine};
use isa::validate::InvalidProgram;

/// The number of lanes of the two sizes of batches. The smaller size is for few fragments.
pub(crate) const BATCH_LANES: [usize; 2] = [64, 256];

/// The output slots of a colour attachment, by source (two for dual-source blending) and component.
pub(crate) type ColorSlots = [[Option<u32>; 4]; 2];

/// A fragment program that is compiled for batches of quads.
#[derive(Debug)]
pub struct FragmentStage {
    /// The machines, by size of batch.
    machines: [MachinePool; 2],
    pub(crate) interface: Interface,
}

/// The inputs, outputs and properties of a fragment program.
#[derive(Debug, Default)]
pub(crate) struct Interface {
    /// The inputs that the program reads: the slot, the meaning, and for varyings the index in `varyings`.
    pub inputs: Vec<(u32, FragmentInput, usize)>,
    /// The numbers of the varyings that are read, each once for each of its interpolations.
    pub varyings: Vec<(u32, Interpolation)>,
    /// The output slots, by colour attachment.
    pub colors: Vec<ColorSlots>,
    /// The output slot of the alpha of alpha to coverage.
    pub coverage_alpha: Option<u32>,
    pub depth: Option<u32>,
    pub sample_mask: Option<u32>,
    pub stencil_reference: Option<u32>,
    pub early_tests: bool,
    pub post_depth_coverage: bool,
    pub discards: bool,
    pub per_sample: bool,
    pub has_side_effects: bool,
}

/// The machines of one worker. Each is taken from its pool at its first use.
#[derive(Debug)]
pub(crate) struct FragmentMachines<'a> {
    pools: &'a [MachinePool; 2],
    lent: [Option<PooledMachine<'a>>; 2],
}

impl FragmentMachines<'_> {
    /// The machine for a size of batch: an index of [`BATCH_LANES`].
    #[inline]
    pub(crate) fn of_size(&mut self, size: usize) -> &mut Machine {
        self.lent[size].get_or_insert_with(|| self.pools[size].lend())
    }

    /// Returns the machines to their pools, and adds their work to the counters.
    pub(crate) fn give_back(self, counters: &mut Counters) {
        for mut machine in self.lent.into_iter().flatten() {
            counters.add_work(&machine.take_work());
        }
    }
}

impl FragmentStage {
    /// Compiles a program.
    ///
    /// # Errors
    /// [`InvalidProgram`] if it cannot run on the device.
    pub fn new(level: Level, programs: &FragmentPrograms) -> Result<Self, InvalidProgram> {
        let executable = |lanes| {
            let options =
                Options { lanes, subgroup_size: DRAW_SUBGROUP_SIZE as usize, count_work: true, ..Options::new(level) };
            Executable::new(programs.program.clone(), &options)
        };
        let executables = [executable(BATCH_LANES[0])?, executable(BATCH_LANES[1])?];
        let interface = Interface::new(programs, &executables[0]);
        Ok(Self { machines: executables.map(MachinePool::new), interface })
    }

    /// Makes the machines of one worker.
    pub(crate) fn machines(&self) -> FragmentMachines<'_> {
        FragmentMachines { pools: &self.machines, lent: [None, None] }
    }
}

impl Interface {
    /// True if the program reads varyings only.
    pub fn takes_varyings_alone(&self) -> bool {
        let is_varying = |kind| matches!(kind, FragmentInput::Varying { .. });
        self.inputs.iter().all(|&(_, kind, _)| is_varying(kind))
    }

    fn new(programs: &FragmentPrograms, executable: &Executable) -> Self {
        let mut interface = Self {
            early_tests: programs.early_tests,
            post_depth_coverage: programs.post_depth_coverage,
            discards: programs.discards,
            per_sample: programs.per_sample,
            has_side_effects: programs.has_side_effects,
            ..Self::default()
        };
        for input in executable.inputs() {
            let Some(&Some(kind)) = programs.inputs.get(input.slot as usize) else {
                continue;
            };
            let mut place = 0;
            match kind {
                FragmentInput::Varying { index, interpolation, sampling } => {
                    interface.per_sample |= sampling == Sampling::Sample;
                    let varying = (index, interpolation);
                    let known = interface.varyings.iter().position(|&other| other == varying);
                    place = known.unwrap_or(interface.varyings.len());
                    if known.is_none() {
                        interface.varyings.push(varying);
                    }
                }
                FragmentInput::SampleId | FragmentInput::SamplePosition(_) => {
                    interface.per_sample = true;
                }
                _ => {}
            }
            interface.inputs.push((input.slot, kind, place));
        }
        for output in executable.outputs() {
            let Some(&Some(kind)) = programs.outputs.get(output.slot as usize) else {
                continue;
            };
            match kind {
                FragmentOutput::Color { attachment, component, index } => {
                    if interface.colors.len() <= attachment {
                        interface.colors.resize(attachment + 1, ColorSlots::default());
                    }
                    let sources = &mut interface.colors[attachment];
                    if let Some(slot) = sources.get_mut(index).and_then(|s| s.get_mut(component)) {
                        *slot = Some(output.slot);
                    }
                }
                FragmentOutput::CoverageAlpha => interface.coverage_alpha = Some(output.slot),
                FragmentOutput::Depth => interface.depth = Some(output.slot),
                FragmentOutput::SampleMask => interface.sample_mask = Some(output.slot),
                FragmentOutput::StencilReference => interface.stencil_reference = Some(output.slot),
            }
        }
        let alpha_of_first = interface.colors.first().and_then(|[first, _]| first[3]);
        interface.coverage_alpha = interface.coverage_alpha.or(alpha_of_first);
        interface
    }
}

/// The program of a resolve shader, compiled for one device. Its varyings are those of [`resolve`].
#[derive(Debug)]
pub struct GaussianFragmentProgram {
    pub(crate) stage: FragmentStage,
    pub(crate) reads_depth: bool,
    /// True if it reads indices of Gaussians, or depth variables.
    pub(crate) is_tracking: bool,
}

impl GaussianFragmentProgram {
    /// Compiles a program.
    ///
    /// # Errors
    /// [`InvalidProgram`] if it cannot run on the device.
    pub fn new(level: Level, programs: &FragmentPrograms) -> Result<Self, InvalidProgram> {
        let stage = FragmentStage::new(level, programs)?;
        let is_depth = |input: FragmentInput| match input {
            FragmentInput::Varying { index, .. } => (resolve::EXPECTED_DEPTH..=resolve::MEDIAN_DEPTH).contains(&index),
            FragmentInput::FragCoord(axis) => axis == 2,
            _ => false,
        };
        let is_tracked = |input: FragmentInput| match input {
            FragmentInput::Varying { index, .. } => (resolve::EXPECTED_LINEAR_DEPTH..resolve::CAMERA).contains(&index),
            _ => false,
        };
        let inputs = &stage.interface.inputs;
        Ok(Self {
            reads_depth: inputs.iter().any(|&(_, input, _)| is_depth(input)),
            is_tracking: inputs.iter().any(|&(_, input, _)| is_tracked(input)),
            stage,
        })
    }

    /// True if the program reads a depth.
    pub fn reads_depth(&self) -> bool {
        self.reads_depth
    }

    /// True if it reads indices of Gaussians, or depth variables.
    pub fn is_tracking(&self) -> bool {
        self.is_tracking
    }
}
