//! A device that runs shader modules and then checks that nothing outside the bound ranges was written.

use ash::vk;
use gaurast_spirv::{DescriptorKind, Module, Options, Specialization, Stage, translate};
use gaurast_testkit::descriptors::write;
use gaurast_testkit::{Binding, Buffer, Driver, Gpu, Kernel, Opening, Sets, Settings, whole};
use std::time::Duration;

/// Bytes of each bound range, and of the guards before and after it.
const RANGE: u64 = 1024;
/// The greatest number of bindings.
const MOST_BINDINGS: usize = 16;
const GUARD: u8 = 0xa5;
const PUSH_BYTES: usize = 128;

/// The result of running a module.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// The shader module or the pipeline was refused.
    Refused,
    /// The dispatch completed.
    Ran,
    /// The dispatch took too long or failed, and the device was lost.
    Lost,
}

/// The descriptors that a module requires, by set and binding.
#[derive(Clone, Debug, Default)]
pub struct Layout(Vec<(u32, u32, u32, vk::DescriptorType)>);

impl Layout {
    /// The descriptors that a module requires; `None` if the words are no module or it requires other descriptors than
    /// buffers.
    pub fn of(words: &[u32]) -> Option<Self> {
        let module = Module::parse(words).ok()?;
        let (specialization, options) = (Specialization::default(), Options::default());
        let shader = translate(&module, "main", Stage::Compute, &specialization, &options).ok()?;
        let mut all = Vec::new();
        for it in &shader.interface.descriptors {
            let ty = match it.kind {
                DescriptorKind::UniformBuffer => vk::DescriptorType::UNIFORM_BUFFER,
                DescriptorKind::StorageBuffer => vk::DescriptorType::STORAGE_BUFFER,
                _ => return None,
            };
            all.push((it.set, it.binding, it.count, ty));
        }
        let count: u32 = all.iter().map(|it| it.2).sum();
        // No layout has two types of one binding.
        let is_single = |at: usize| all[..at].iter().all(|it| (it.0, it.1) != (all[at].0, all[at].1));
        let fits = count as usize <= MOST_BINDINGS && all.iter().all(|it| it.0 < 4) && (0..all.len()).all(is_single);
        fits.then_some(Self(all))
    }
}

/// A device, and memory with guarded ranges.
#[derive(Default)]
pub struct Harness {
    open: Option<Open>,
}

impl Harness {
    /// Opens this driver's device.
    pub fn new() -> Self {
        Self::default()
    }

    /// Creates a shader module and a pipeline of the words, and dispatches two workgroups.
    ///
    /// # Panics
    /// If memory outside the bound ranges was written, or the device fails at something that does not depend on the
    /// words.
    pub fn run(&mut self, words: &[u32], layout: &Layout) -> Outcome {
        let open = self.open.get_or_insert_with(Open::new);
        let outcome = open.run(words, layout);
        if outcome == Outcome::Lost {
            self.open = None;
        }
        outcome
    }
}

/// Bytes of all ranges with their guards.
const BYTES: usize = (2 * MOST_BINDINGS + 1) * RANGE as usize;

/// The longest time of a workgroup. It is short, because many modules have infinite loops.
const TIMEOUT: Duration = Duration::from_millis(20);

struct Open {
    gpu: Gpu,
    buffer: Buffer,
}

impl Open {
    fn new() -> Self {
        let settings = Settings { timeout: Some(TIMEOUT), ..Settings::default() };
        let opening = Opening { settings, robust: true, bare: true, ..Opening::of(Driver::Embedded) };
        let gpu = Gpu::open(&opening).expect("a device");
        Self { buffer: Buffer::new(&gpu, BYTES as u64), gpu }
    }

    /// Writes the guard pattern everywhere, and small numbers in the ranges.
    fn fill(&self) {
        let mut bytes = vec![GUARD; BYTES];
        for range in bytes.chunks_mut(RANGE as usize).skip(1).step_by(2) {
            for (index, byte) in range.iter_mut().enumerate() {
                *byte = if index % 4 == 0 { index as u8 % 23 } else { 0 };
            }
        }
        self.buffer.write(&bytes);
    }

    fn check_guards(&self) {
        let bytes = self.buffer.read();
        for (index, guard) in bytes.chunks(RANGE as usize).step_by(2).enumerate() {
            let written = guard.iter().position(|byte| *byte != GUARD);
            assert_eq!(written, None, "guard {index} was written to");
        }
    }

    fn run(&self, words: &[u32], layout: &Layout) -> Outcome {
        let count = layout.0.iter().map(|it| it.0 + 1).max().unwrap_or(0);
        let bindings: Vec<Vec<Binding>> = (0..count)
            .map(|set| {
                let of_set = layout.0.iter().filter(|it| it.0 == set);
                of_set.map(|&(_, binding, count, ty)| (binding, ty, count)).collect()
            })
            .collect();
        let bindings: Vec<&[Binding]> = bindings.iter().map(Vec::as_slice).collect();
        let sets = Sets::new(&self.gpu, &bindings);
        let Ok(kernel) = Kernel::specialized(&self.gpu, words, &sets.layouts, &[]) else {
            return Outcome::Refused;
        };
        self.fill();
        let ran = self.dispatch(&kernel, &self.bound(&sets, layout));
        self.check_guards();
        match ran {
            Ok(()) => Outcome::Ran,
            Err(vk::Result::ERROR_DEVICE_LOST) => Outcome::Lost,
            Err(error) => panic!("the dispatch gave {error}"),
        }
    }

    /// Allocates sets whose descriptors are the guarded ranges, one after another.
    fn bound(&self, sets: &Sets, layout: &Layout) -> Vec<vk::DescriptorSet> {
        if sets.layouts.is_empty() {
            return Vec::new();
        }
        let bound = sets.allocate();
        let mut offset = RANGE;
        for &(set, binding, count, ty) in &layout.0 {
            for element in 0..count {
                let range = whole(&self.buffer).offset(offset).range(RANGE);
                offset += 2 * RANGE;
                write(&self.gpu, bound[set as usize], (binding, element), ty, &[range]);
            }
        }
        bound
    }

    fn dispatch(&self, kernel: &Kernel, sets: &[vk::DescriptorSet]) -> Result<(), vk::Result> {
        let push: [u32; PUSH_BYTES / 4] = std::array::from_fn(|index| 4 * index as u32 % 9);
        let info = vk::CommandBufferBeginInfo::default();
        let level = vk::CommandBufferLevel::PRIMARY;
        let recorded = self.gpu.record_as(level, &info, |commands| {
            kernel.dispatch(commands, sets, &push, [2, 1, 1]);
        })?;
        recorded.try_submit()
    }
}
