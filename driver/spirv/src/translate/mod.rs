//! From SPIR-V to the device's IR.
//!
//! A function's blocks become a tree of constructs first ([`structure`]); then the tree is walked and each instruction
//! is taken apart into scalar ones. Calls are inlined. Variables of a function, `Private` variables, inputs and outputs
//! are never stored to by an instruction of the IR: a store only notes the registers that hold the variable now, and
//! where control flow comes together a variable that differs becomes a variable of the IR ([`control`]). Those that are
//! arrays indexed at run time live in per-lane memory instead.
//!
//! All sizes are bounded: scalars of a value, nesting, calls, and the instructions made.

mod access;
mod analysis;
mod arithmetic;
mod assign;
mod atomic;
mod built_in;
mod cases;
mod composite;
mod control;
mod convert;
mod glsl;
mod image;
mod instruction;
mod matrix;
mod memory;
mod output;
mod resource;
mod structure;
mod subgroup;
mod variable;

use std::collections::HashMap;
use std::rc::Rc;

use isa::builder::Builder;
use isa::ir::{self, Binding, Reg};
use isa::op::Op as Ir;
use spirv::{AddressingModel, Capability, ExecutionMode, ExecutionModel, MemoryModel};

use super::error::{Diagnostic, Error, Result, malformed, unsupported};
use super::globals::{Globals, Specialization};
use super::instruction::Instruction;
use super::interface::{DepthMode, Interface, Shader, Stage};
use super::module::Module;
use super::types::{ImageType, Scalar};
use analysis::Analysis;

/// The most instructions that a shader may become.
const MAX_STATEMENTS: u64 = 1 << 22;

/// The stack that a translation runs on.
const STACK_BYTES: usize = 16 << 20;

/// How a shader is translated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Options {
    /// Invocations of a subgroup: a power of two, at most 128.
    pub subgroup_size: u32,
    /// Samples of a pixel that `interpolateAtSample` may name, at the standard positions.
    pub samples: u32,
    /// The length that a descriptor array without one is given.
    pub unsized_descriptors: u32,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            subgroup_size: 64,
            samples: 1,
            unsized_descriptors: 1,
        }
    }
}

/// Translates an entry point.
///
/// That is done on a thread of its own, whose stack is large enough for all nesting that is allowed, whatever the
/// application's stack is.
///
/// # Errors
/// What is malformed, unsupported or too large.
pub fn translate(
    module: &Module,
    name: &str,
    stage: Stage,
    specialization: &Specialization,
    options: &Options,
) -> Result<Shader, Error> {
    std::thread::scope(|scope| {
        let thread = std::thread::Builder::new()
            .name("gaurast-shader".into())
            .stack_size(STACK_BYTES);
        let translation = thread
            .spawn_scoped(scope, || {
                translate_here(module, name, stage, specialization, options)
            })
            .map_err(|error| Error::NoThread {
                reason: error.to_string(),
            })?;
        translation
            .join()
            .unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    })
}

fn translate_here(
    module: &Module,
    name: &str,
    stage: Stage,
    specialization: &Specialization,
    options: &Options,
) -> Result<Shader, Error> {
    check_capabilities(module)?;
    let globals = Globals::new(module, specialization)?;
    let entry = find_entry(module, name, stage)?;
    let function = module
        .functions
        .get(&entry)
        .copied()
        .ok_or_else(|| no_entry(name, stage))?;
    let analysis = Analysis::new(module, &globals, function)?;
    let mut translator = Translator {
        module,
        globals: &globals,
        analysis,
        options: *options,
        builder: Builder::new(),
        interface: empty_interface(stage),
        values: HashMap::new(),
        types: HashMap::new(),
        slots: Vec::new(),
        slot_of: HashMap::new(),
        constants: HashMap::new(),
        products: HashMap::new(),
        phis: HashMap::new(),
        calls: Vec::new(),
        inputs: HashMap::new(),
        io_locations: HashMap::new(),
        next_resource_slot: 0,
        depth: 0,
        statements: 0,
    };
    translator.modes(entry)?;
    translator.run(function)?;
    translator.finish()
}

/// What an id stands for.
#[derive(Clone, Debug)]
enum Value {
    /// A value: a register for each scalar.
    Regs(Rc<[Reg]>),
    Pointer(Rc<access::Pointer>),
    Image(Binding, ImageType),
    Sampler(Binding),
    SampledImage(Binding, ImageType, Binding),
}

struct Translator<'a> {
    module: &'a Module,
    globals: &'a Globals,
    analysis: Analysis,
    options: Options,
    builder: Builder,
    interface: Interface,
    values: HashMap<u32, Value>,
    /// Types of the ids in `values`.
    types: HashMap<u32, u32>,
    /// Variables held in registers.
    slots: Vec<variable::PromotedVariable>,
    slot_of: HashMap<u32, usize>,
    /// Bits of the registers that hold constants.
    constants: HashMap<Reg, u64>,
    /// Factors of products that may be fused with an addition.
    products: HashMap<Reg, (Reg, Reg)>,
    /// IR variables of phis.
    phis: HashMap<u32, Rc<[Reg]>>,
    /// Functions being inlined, innermost last.
    calls: Vec<control::Call>,
    inputs: HashMap<super::interface::InputSource, Reg>,
    /// Where the scalars of inputs and outputs belong.
    io_locations: HashMap<u32, Rc<[built_in::IoLocation]>>,
    next_resource_slot: u32,
    /// Lists of nodes around the one being translated.
    depth: usize,
    statements: u64,
}

impl Translator<'_> {
    /// Counts instructions about to be made.
    fn charge_budget(&mut self, count: usize) -> Result<()> {
        self.statements += count as u64;
        if self.statements > MAX_STATEMENTS {
            return Err(Diagnostic::Located(Error::TooLarge {
                what: "instructions of a translated shader",
                limit: MAX_STATEMENTS,
            }));
        }
        Ok(())
    }

    /// `op(src...)`. What one instruction of SPIR-V can become is bounded, so the count is checked by instruction.
    fn op(&mut self, op: Ir, src: &[Reg]) -> Reg {
        self.statements += 1;
        if let Some(folded) = self.fold(op, src) {
            return folded;
        }
        self.builder.compute(op, src)
    }

    fn constant(&mut self, ty: ir::Type, bits: u64) -> Reg {
        let reg = self.builder.constant(ty, bits);
        self.constants.insert(reg, bits);
        reg
    }

    fn u32(&mut self, value: u32) -> Reg {
        self.constant(ir::Type::B32, u64::from(value))
    }

    fn f32(&mut self, value: f32) -> Reg {
        self.u32(value.to_bits())
    }

    fn u64(&mut self, value: u64) -> Reg {
        self.constant(ir::Type::B64, value)
    }

    fn f64(&mut self, value: f64) -> Reg {
        self.u64(value.to_bits())
    }

    /// The bits of a register that holds a constant of 32 bits.
    fn known(&self, reg: Reg) -> Option<u32> {
        self.constants.get(&reg).map(|bits| *bits as u32)
    }

    /// Integer arithmetic on constants, as addresses need it.
    fn fold(&mut self, op: Ir, src: &[Reg]) -> Option<Reg> {
        let [a, b] = src else {
            return None;
        };
        let (known_a, known_b) = (self.known(*a), self.known(*b));
        match (op, known_a, known_b) {
            (Ir::IAdd, Some(0), _) | (Ir::IMul, Some(1), _) => return Some(*b),
            (Ir::IAdd | Ir::ISub, _, Some(0)) | (Ir::IMul, _, Some(1)) => return Some(*a),
            _ => {}
        }
        let (a, b) = known_a.zip(known_b)?;
        let bits = match op {
            Ir::IAdd => a.wrapping_add(b),
            Ir::ISub => a.wrapping_sub(b),
            Ir::IMul => a.wrapping_mul(b),
            _ => return None,
        };
        Some(self.u32(bits))
    }

    /// The type of an id.
    fn type_of(&self, id: u32) -> Result<u32> {
        let constant = || self.globals.constants.get(&id).map(|constant| constant.ty);
        match self.types.get(&id).copied().or_else(constant) {
            Some(ty) => Ok(ty),
            None => malformed(format!("%{id} has no type here")),
        }
    }

    /// What an id stands for.
    fn value(&mut self, id: u32) -> Result<Value> {
        if let Some(value) = self.values.get(&id) {
            return Ok(value.clone());
        }
        if let Some(constant) = self.globals.constants.get(&id) {
            let scalars = self.globals.types.flatten(constant.ty)?;
            self.charge_budget(scalars.len())?;
            let bits = constant.bits.clone();
            let regs: Rc<[Reg]> = scalars
                .iter()
                .zip(bits.iter())
                .map(|(scalar, bits)| self.constant(scalar.register(), *bits))
                .collect();
            self.values.insert(id, Value::Regs(regs.clone()));
            self.types.insert(id, constant.ty);
            return Ok(Value::Regs(regs));
        }
        if self.globals.variables.contains_key(&id) {
            return self.global_variable(id);
        }
        malformed(format!("%{id} isn't defined before its use"))
    }

    /// The registers of a value; a device address counts as one.
    fn regs(&mut self, id: u32) -> Result<Rc<[Reg]>> {
        match self.value(id)? {
            Value::Regs(regs) => Ok(regs),
            Value::Pointer(pointer) => match pointer.address() {
                Some(address) => {
                    let address = self.pointer_to_address(address)?;
                    Ok([address].into())
                }
                None => unsupported(format!("pointer %{id} as a value")),
            },
            _ => malformed(format!("%{id} isn't a value")),
        }
    }

    /// The register of a scalar.
    fn reg(&mut self, id: u32) -> Result<Reg> {
        match *self.regs(id)? {
            [reg] => Ok(reg),
            _ => malformed(format!("%{id} isn't a scalar")),
        }
    }

    /// The scalar type of a scalar or vector, and its registers.
    fn vector(&mut self, id: u32) -> Result<(Scalar, Rc<[Reg]>)> {
        let (scalar, _) = self.globals.types.vector(self.type_of(id)?)?;
        Ok((scalar, self.regs(id)?))
    }

    /// A constant 32-bit operand.
    fn literal(&self, id: u32) -> Result<u32> {
        match self.globals.constant_u32(id) {
            Some(value) => Ok(value),
            None => unsupported(format!("%{id} isn't a constant")),
        }
    }

    /// Gives an instruction's result its registers, which must fit its type.
    fn define(&mut self, it: &Instruction, regs: Vec<Reg>) -> Result<()> {
        let (id, ty) = (it.result()?, it.ty()?);
        self.charge_budget(regs.len())?;
        let scalars = self.globals.types.flatten(ty)?;
        let fits = scalars.len() == regs.len()
            && scalars
                .iter()
                .zip(&regs)
                .all(|(scalar, reg)| scalar.register() == self.builder.type_of(*reg));
        if !fits {
            return malformed("the operands don't fit the result type");
        }
        self.define_as(it, Value::Regs(regs.into()))?;
        self.types.insert(id, ty);
        Ok(())
    }

    fn define_as(&mut self, it: &Instruction, value: Value) -> Result<()> {
        let id = it.result()?;
        self.values.insert(id, value);
        self.types.insert(id, it.ty()?);
        Ok(())
    }

    /// Reads the entry point's execution modes.
    fn modes(&mut self, entry: u32) -> Result<(), Error> {
        for it in &self.module.sections.execution_modes {
            if it.id(0).ok() == Some(entry) {
                self.mode(it)
                    .map_err(|diagnostic| diagnostic.locate(it.reference()))?;
            }
        }
        if self.interface.stage == Stage::Compute {
            self.built_in_workgroup_size();
            let [x, y, z] = self.interface.workgroup_size.map(u64::from);
            let limit = ir::MAX_LANES as u64;
            if x.saturating_mul(y).saturating_mul(z) > limit || x * y * z == 0 {
                return Err(Error::TooLarge {
                    what: "invocations of a workgroup",
                    limit,
                });
            }
        }
        Ok(())
    }

    fn mode(&mut self, it: &Instruction) -> Result<()> {
        let Some(mode) = it.enumerant(1, ExecutionMode::from_u32) else {
            return malformed("there is no mode");
        };
        match mode {
            ExecutionMode::LocalSize => {
                self.interface.workgroup_size = [it.number(2)?, it.number(3)?, it.number(4)?];
            }
            ExecutionMode::LocalSizeId => {
                self.interface.workgroup_size = [
                    self.literal(it.id(2)?)?,
                    self.literal(it.id(3)?)?,
                    self.literal(it.id(4)?)?,
                ];
            }
            ExecutionMode::EarlyFragmentTests => self.interface.early_fragment_tests = true,
            ExecutionMode::DepthReplacing if self.interface.depth == DepthMode::NotWritten => {
                self.interface.depth = DepthMode::Replacing;
            }
            ExecutionMode::DepthGreater => self.interface.depth = DepthMode::Greater,
            ExecutionMode::DepthLess => self.interface.depth = DepthMode::Less,
            ExecutionMode::DepthUnchanged => self.interface.depth = DepthMode::Unchanged,
            ExecutionMode::OriginLowerLeft => {
                return unsupported("an io_location at the lower left");
            }
            _ => {}
        }
        Ok(())
    }

    fn finish(mut self) -> Result<Shader, Error> {
        self.declare_push_constants()?;
        let program = self.builder.finish()?;
        Ok(Shader {
            program,
            interface: self.interface,
        })
    }
}

fn empty_interface(stage: Stage) -> Interface {
    Interface {
        stage,
        inputs: Vec::new(),
        outputs: Vec::new(),
        descriptors: Vec::new(),
        push_constants: None,
        workgroup_size: [1; 3],
        early_fragment_tests: false,
        depth: DepthMode::NotWritten,
        discards: false,
        per_sample: false,
        has_side_effects: false,
        uses_subgroups: false,
    }
}

fn no_entry(name: &str, stage: Stage) -> Error {
    Error::NoEntryPoint {
        name: name.into(),
        stage,
    }
}

/// The function of an entry point.
fn find_entry(module: &Module, name: &str, stage: Stage) -> Result<u32, Error> {
    let model = match stage {
        Stage::Vertex => ExecutionModel::Vertex,
        Stage::Fragment => ExecutionModel::Fragment,
        Stage::Compute => ExecutionModel::GLCompute,
    };
    let mut entries = module.sections.entry_points.iter();
    entries
        .find(|it| {
            it.enumerant(0, ExecutionModel::from_u32) == Some(model) && it.string(2) == Some(name)
        })
        .and_then(|it| it.id(1).ok())
        .ok_or_else(|| no_entry(name, stage))
}

/// Refuses modules that declare what isn't supported.
fn check_capabilities(module: &Module) -> Result<(), Error> {
    for it in &module.sections.capabilities {
        if let Some(capability) = it.enumerant(0, Capability::from_u32)
            && !is_supported(capability)
        {
            let diagnostic = Diagnostic::Unsupported(format!("capability {capability:?}"));
            return Err(diagnostic.locate(it.reference()));
        }
    }
    let model = module.sections.memory_model.as_ref();
    let Some(model) = model else {
        return Err(Error::Binary {
            reason: "there is no memory model".into(),
        });
    };
    let addressing = model.enumerant(0, AddressingModel::from_u32);
    let memory = model.enumerant(1, MemoryModel::from_u32);
    match (addressing, memory) {
        (
            Some(AddressingModel::Logical | AddressingModel::PhysicalStorageBuffer64),
            Some(MemoryModel::GLSL450 | MemoryModel::Vulkan),
        ) => Ok(()),
        _ => Err(Diagnostic::Unsupported("this memory model".into()).locate(model.reference())),
    }
}

/// Whether a capability's instructions and decorations are translated.
pub fn is_supported(capability: Capability) -> bool {
    use Capability as C;
    matches!(
        capability,
        C::Matrix
            | C::Shader
            | C::Float16
            | C::Float64
            | C::Int64
            | C::Int64Atomics
            | C::Int16
            | C::Int8
            | C::ImageGatherExtended
            | C::StorageImageMultisample
            | C::UniformBufferArrayDynamicIndexing
            | C::SampledImageArrayDynamicIndexing
            | C::StorageBufferArrayDynamicIndexing
            | C::StorageImageArrayDynamicIndexing
            | C::ClipDistance
            | C::CullDistance
            | C::ImageCubeArray
            | C::SampleRateShading
            | C::SampledCubeArray
            | C::InputAttachment
            | C::MinLod
            | C::Sampled1D
            | C::Image1D
            | C::SampledBuffer
            | C::ImageBuffer
            | C::ImageMSArray
            | C::StorageImageExtendedFormats
            | C::ImageQuery
            | C::DerivativeControl
            | C::InterpolationFunction
            | C::StorageImageReadWithoutFormat
            | C::StorageImageWriteWithoutFormat
            | C::MultiViewport
            | C::GroupNonUniform
            | C::GroupNonUniformVote
            | C::GroupNonUniformArithmetic
            | C::GroupNonUniformBallot
            | C::GroupNonUniformShuffle
            | C::GroupNonUniformShuffleRelative
            | C::GroupNonUniformClustered
            | C::GroupNonUniformQuad
            | C::ShaderLayer
            | C::ShaderViewportIndex
            | C::ShaderViewportIndexLayerEXT
            | C::SubgroupBallotKHR
            | C::SubgroupVoteKHR
            | C::DrawParameters
            | C::DeviceGroup
            | C::StorageBuffer16BitAccess
            | C::UniformAndStorageBuffer16BitAccess
            | C::StoragePushConstant16
            | C::StorageInputOutput16
            | C::StorageBuffer8BitAccess
            | C::UniformAndStorageBuffer8BitAccess
            | C::StoragePushConstant8
            | C::SignedZeroInfNanPreserve
            | C::DenormPreserve
            | C::RoundingModeRTE
            | C::ShaderNonUniform
            | C::RuntimeDescriptorArray
            | C::InputAttachmentArrayDynamicIndexing
            | C::UniformTexelBufferArrayDynamicIndexing
            | C::StorageTexelBufferArrayDynamicIndexing
            | C::UniformBufferArrayNonUniformIndexing
            | C::SampledImageArrayNonUniformIndexing
            | C::StorageBufferArrayNonUniformIndexing
            | C::StorageImageArrayNonUniformIndexing
            | C::InputAttachmentArrayNonUniformIndexing
            | C::UniformTexelBufferArrayNonUniformIndexing
            | C::StorageTexelBufferArrayNonUniformIndexing
            | C::PhysicalStorageBufferAddresses
            | C::VulkanMemoryModel
            | C::VulkanMemoryModelDeviceScope
            | C::DemoteToHelperInvocation
            | C::AtomicFloat32AddEXT
            | C::AtomicFloat32MinMaxEXT
    )
}
