//! Runs translated shaders on the shader cores.

use std::path::PathBuf;
use std::sync::Arc;

use devmem::{Allocation, BufferRange};
use fearless_simd::Level;
use gaurast_spirv::{BuiltIn, InputSource, Module, Options, Shader, Specialization, Stage, translate};
use isa::Options as ExecOptions;
use isa::machine::{Executable, LaneMask, Machine, Stopped, Watchdog};
use isa::resources::{GlobalMemory, NoGlobalMemory, Resources, words};

/// The folder of the shaders.
pub fn folder() -> PathBuf {
    [env!("CARGO_MANIFEST_DIR"), "tests", "shaders"].iter().collect()
}

/// The checked-in SPIR-V of a shader; with `.opt` after its name, spirv-opt's output.
pub fn words_of(name: &str) -> Vec<u32> {
    let bytes = std::fs::read(folder().join(format!("{name}.spv"))).unwrap();
    bytes.chunks_exact(4).map(|word| u32::from_le_bytes(word.try_into().unwrap())).collect()
}

/// A module's words with each instruction replaced by what `change` makes of it.
pub fn rewritten(words: &[u32], mut change: impl FnMut(&[u32]) -> Vec<u32>) -> Vec<u32> {
    let (header, mut rest) = words.split_at(5);
    let mut all = header.to_vec();
    while let [first, ..] = rest {
        let (instruction, others) = rest.split_at((first >> 16) as usize);
        all.append(&mut change(instruction));
        rest = others;
    }
    all
}

/// The stage in a shader's file name.
pub fn stage_of(name: &str) -> Stage {
    match name.rsplit('.').next() {
        Some("vert") => Stage::Vertex,
        Some("tesc") => Stage::TessellationControl,
        Some("tese") => Stage::TessellationEvaluation,
        Some("geom") => Stage::Geometry,
        Some("frag") => Stage::Fragment,
        _ => Stage::Compute,
    }
}

/// The names of all checked-in shaders.
pub fn all_shaders() -> Vec<String> {
    let mut names: Vec<String> = std::fs::read_dir(folder())
        .unwrap()
        .filter_map(|entry| entry.unwrap().file_name().into_string().ok())
        .filter_map(|name| name.strip_suffix(".spv").map(str::to_owned))
        .collect();
    names.sort();
    names
}

/// The options of the tests' translations.
pub const OPTIONS: Options = Options { subgroup_size: 16, samples: 4, unsized_descriptors: 1, view_is_device: false };

/// Translates a checked-in shader.
pub fn translated(name: &str, specialization: &Specialization) -> Shader {
    let module = Module::parse(&words_of(name)).unwrap();
    translate(&module, "main", stage_of(name), specialization, &OPTIONS)
        .unwrap_or_else(|error| panic!("{name}: {error}"))
}

/// A buffer with these words.
pub fn buffer(data: &[u32]) -> BufferRange {
    let size = 4 * data.len() as u64;
    let memory = Allocation::new_zeroed(size.max(4)).unwrap();
    memory.write(0, data).unwrap();
    BufferRange { memory, offset: 0, size }
}

/// A buffer with these floats.
pub fn floats(data: &[f32]) -> BufferRange {
    let bits: Vec<u32> = data.iter().map(|value| value.to_bits()).collect();
    buffer(&bits)
}

/// A buffer's contents, as words.
pub fn contents(range: &BufferRange) -> Vec<u32> {
    let mut data = vec![0; (range.size / 4) as usize];
    range.memory.read(range.offset, &mut data).unwrap();
    data
}

/// A buffer's contents, as floats.
pub fn float_contents(range: &BufferRange) -> Vec<f32> {
    contents(range).into_iter().map(f32::from_bits).collect()
}

/// A dispatch of a compute shader: buffers by set and binding (and array element).
pub struct Dispatch<'a> {
    pub shader: &'a Shader,
    pub groups: [u32; 3],
    pub buffers: &'a [((u32, u32, u32), &'a BufferRange)],
    pub push: &'a [u8],
    pub global: &'a dyn GlobalMemory,
    pub limit: std::time::Duration,
}

impl<'a> Dispatch<'a> {
    pub fn new(shader: &'a Shader, groups: [u32; 3]) -> Self {
        Self {
            shader,
            groups,
            buffers: &[],
            push: &[],
            global: &NoGlobalMemory,
            limit: std::time::Duration::from_secs(5),
        }
    }

    /// Runs all workgroups, at the processor's best SIMD level.
    pub fn run(&self) -> Result<(), Stopped> {
        let invocations = self.shader.interface.workgroup_size.iter().product::<u32>() as usize;
        let options = ExecOptions {
            lanes: invocations.next_multiple_of(16),
            subgroup_size: OPTIONS.subgroup_size as usize,
            ..ExecOptions::new(Level::new())
        };
        let executable = Executable::new(self.shader.program.clone(), &options).unwrap();
        let mut machine = Machine::new(Arc::new(executable));
        let mut bound = Vec::new();
        for descriptor in &self.shader.interface.descriptors {
            for element in 0..descriptor.count {
                let slot = (descriptor.slot + element) as usize;
                bound.resize(bound.len().max(slot + 1), None);
                let key = (descriptor.set, descriptor.binding, element);
                let found = self.buffers.iter().find(|(place, _)| *place == key);
                bound[slot] = found.map(|(_, range)| (*range).clone());
            }
        }
        let push = words(self.push);
        let resources =
            Resources { buffers: &bound, push_constants: &push, global: self.global, ..Resources::default() };
        let watchdog = Watchdog { limit: self.limit, ..Watchdog::default() };
        let [x, y, z] = self.groups;
        for id in (0..x * y * z).map(|index| [index % x, index / x % y, index / x / y]) {
            for (slot, input) in (0..).zip(&self.shader.interface.inputs) {
                let InputSource::BuiltIn { built_in, component } = input.source else {
                    panic!("a compute shader with locations");
                };
                machine.fill_input(
                    slot,
                    match built_in {
                        BuiltIn::WorkgroupId => id[component as usize],
                        BuiltIn::NumWorkgroups => self.groups[component as usize],
                        other => panic!("{other:?} in a compute shader"),
                    },
                );
            }
            machine.run(&LaneMask::first(invocations), &LaneMask::none(), &resources, watchdog)?;
        }
        Ok(())
    }
}

/// Deterministic numbers (an xorshift generator).
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> u32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 32) as u32
    }

    pub fn below(&mut self, limit: usize) -> usize {
        self.next() as usize % limit.max(1)
    }

    pub fn unit(&mut self) -> f32 {
        self.next() as f32 / u32::MAX as f32
    }
}
