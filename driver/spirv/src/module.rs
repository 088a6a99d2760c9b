//! A SPIR-V module: its instructions by section and function, and its decorations by id.

use std::collections::HashMap;

use spirv::{
    BuiltIn, Capability, Decoration, ExecutionModel, FPFastMathMode, FPRoundingMode, MemoryAccess, MemoryModel, Op,
};

use super::decoder::{HEADER_WORDS, decode};
use super::error::Error;
use super::instruction::{Instruction, Operand};

/// The most words of a module.
const MAX_WORDS: usize = 1 << 20;
/// The most decorations after groups are expanded.
const MAX_DECORATIONS: usize = 1 << 20;

/// A decoration and its parameters.
#[derive(Clone, Debug)]
struct Decorated {
    decoration: Decoration,
    parameters: Vec<Operand>,
}

/// The set of extended instructions that an import names.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ExtendedSet {
    /// `GLSL.std.450`.
    Glsl,
    /// `NonSemantic.*` and debug information, which are ignored.
    NonSemantic,
    /// Any other.
    Unknown,
}

/// A basic block: its last instruction is its terminator.
#[derive(Clone, Debug)]
pub(crate) struct Block {
    pub label: Option<u32>,
    pub instructions: Vec<Instruction>,
}

/// A function.
#[derive(Clone, Debug)]
pub(crate) struct Function {
    pub definition: Instruction,
    pub parameters: Vec<Instruction>,
    pub blocks: Vec<Block>,
}

/// The relevant instructions of a module, by their section.
#[derive(Clone, Debug, Default)]
pub(crate) struct Sections {
    pub capabilities: Vec<Instruction>,
    pub imports: Vec<Instruction>,
    pub memory_model: Option<Instruction>,
    pub entry_points: Vec<Instruction>,
    pub execution_modes: Vec<Instruction>,
    pub names: Vec<Instruction>,
    pub annotations: Vec<Instruction>,
    /// Types, constants and variables outside functions.
    pub globals: Vec<Instruction>,
    pub functions: Vec<Function>,
}

/// Sorts instructions into sections and functions.
#[derive(Default)]
struct Loader {
    sections: Sections,
    function: Option<Function>,
    block: Option<Block>,
}

impl Loader {
    fn add(&mut self, instruction: Instruction) -> Result<(), Error> {
        let sections = &mut self.sections;
        match instruction.opcode {
            Op::Capability => sections.capabilities.push(instruction),
            Op::ExtInstImport => sections.imports.push(instruction),
            Op::MemoryModel => sections.memory_model = Some(instruction),
            Op::EntryPoint => sections.entry_points.push(instruction),
            Op::ExecutionMode | Op::ExecutionModeId => sections.execution_modes.push(instruction),
            Op::Name => sections.names.push(instruction),
            Op::Extension
            | Op::String
            | Op::SourceExtension
            | Op::Source
            | Op::SourceContinued
            | Op::MemberName
            | Op::ModuleProcessed
            | Op::Line
            | Op::NoLine => {}
            // Debug information.
            Op::ExtInst | Op::ExtInstWithForwardRefsKHR if self.function.is_none() => {}
            op if op.is_annotation() => sections.annotations.push(instruction),
            op if op.is_type() || op.is_constant() => sections.globals.push(instruction),
            Op::Variable | Op::Undef if self.function.is_none() => sections.globals.push(instruction),
            Op::Function => {
                let function = Function { definition: instruction, parameters: Vec::new(), blocks: Vec::new() };
                if self.function.replace(function).is_some() {
                    return invalid("a function begins within another");
                }
            }
            Op::FunctionParameter => match &mut self.function {
                Some(function) => function.parameters.push(instruction),
                None => return invalid("a parameter outside functions"),
            },
            Op::Label => {
                let block = Block { label: instruction.result_id, instructions: Vec::new() };
                if self.function.is_none() {
                    return invalid("a block outside functions");
                }
                if self.block.replace(block).is_some() {
                    return invalid("a block begins within another");
                }
            }
            Op::FunctionEnd => self.end_function()?,
            op => {
                let Some(block) = &mut self.block else {
                    return invalid(format!("Op{op:?} outside blocks"));
                };
                block.instructions.push(instruction);
                if is_terminator(op)
                    && let (Some(function), Some(block)) = (&mut self.function, self.block.take())
                {
                    function.blocks.push(block);
                }
            }
        }
        Ok(())
    }

    fn end_function(&mut self) -> Result<(), Error> {
        if self.block.is_some() {
            return invalid("a block without a terminator");
        }
        match self.function.take() {
            Some(function) => self.sections.functions.push(function),
            None => return invalid("a function ends that didn't begin"),
        }
        Ok(())
    }

    fn finish(self) -> Result<Sections, Error> {
        match self.function {
            Some(_) => invalid("a function without an end"),
            None => Ok(self.sections),
        }
    }
}

/// Tells if an operation ends a block.
fn is_terminator(op: Op) -> bool {
    matches!(
        op,
        Op::Branch
            | Op::BranchConditional
            | Op::Switch
            | Op::Return
            | Op::ReturnValue
            | Op::Kill
            | Op::TerminateInvocation
            | Op::TerminateRayKHR
            | Op::IgnoreIntersectionKHR
            | Op::EmitMeshTasksEXT
            | Op::Unreachable
    )
}

fn invalid<T>(reason: impl Into<String>) -> Result<T, Error> {
    Err(Error::Binary { reason: reason.into() })
}

/// A shader module: decoded and indexed, but not checked beyond that.
#[derive(Debug)]
pub struct Module {
    pub(crate) sections: Sections,
    pub(crate) extended_sets: HashMap<u32, ExtendedSet>,
    /// Indices into the sections' functions by id.
    pub(crate) functions: HashMap<u32, usize>,
    decorations: HashMap<u32, Vec<Decorated>>,
    member_decorations: HashMap<(u32, u32), Vec<Decorated>>,
    names: HashMap<u32, String>,
    version: (u8, u8),
}

impl Module {
    /// Decodes a module of SPIR-V 1.0 to 1.6.
    ///
    /// # Errors
    /// [`Error::Binary`] or [`Error::TooLarge`].
    pub fn parse(words: &[u32]) -> Result<Self, Error> {
        let version = check_header(words)?;
        let mut loader = Loader::default();
        decode(words, |it| loader.add(it))?;
        let sections = loader.finish()?;
        let functions = sections.functions.iter().enumerate();
        let mut module = Self {
            extended_sets: extended_sets(&sections),
            functions: functions
                .filter_map(|(index, function)| Some((function.definition.result_id?, index)))
                .collect(),
            decorations: HashMap::new(),
            member_decorations: HashMap::new(),
            names: names(&sections),
            version,
            sections,
        };
        module.index_decorations()?;
        Ok(module)
    }

    /// SPIR-V's major and minor version.
    pub fn version(&self) -> (u8, u8) {
        self.version
    }

    /// The name of an id in debug information.
    pub fn name(&self, id: u32) -> Option<&str> {
        self.names.get(&id).map(String::as_str)
    }

    /// Names and execution models of all entry points.
    pub fn entry_points(&self) -> Vec<(String, ExecutionModel)> {
        self.sections
            .entry_points
            .iter()
            .filter_map(|entry| {
                let model = entry.enumerant(0, ExecutionModel::from_u32)?;
                Some((entry.string(2)?.to_owned(), model))
            })
            .collect()
    }

    /// Tells if the module declares a capability.
    pub(crate) fn declares(&self, capability: Capability) -> bool {
        let mut declared = self.sections.capabilities.iter();
        declared.any(|it| it.enumerant(0, Capability::from_u32) == Some(capability))
    }

    /// Reports whether some accesses may see what other invocations write meanwhile: any by Vulkan's memory model, those to
    /// coherent or volatile variables, and volatile loads.
    pub(crate) fn has_coherent_accesses(&self) -> bool {
        let model = self.sections.memory_model.as_ref();
        let is_coherent =
            |decorated: &Decorated| matches!(decorated.decoration, Decoration::Coherent | Decoration::Volatile);
        let is_volatile = |instruction: &Instruction| {
            let access = match instruction.opcode {
                Op::Load => instruction.enumerant(1, MemoryAccess::from_bits),
                Op::CopyMemory => instruction.enumerant(2, MemoryAccess::from_bits),
                _ => None,
            };
            access.is_some_and(|access| access.contains(MemoryAccess::VOLATILE))
        };
        let mut decorations = self.decorations.values().chain(self.member_decorations.values()).flatten();
        let blocks = self.sections.functions.iter().flat_map(|function| &function.blocks);
        model.and_then(|model| model.enumerant(1, MemoryModel::from_u32)) == Some(MemoryModel::Vulkan)
            || decorations.any(is_coherent)
            || blocks.flat_map(|block| &block.instructions).any(is_volatile)
    }

    /// Reports whether an id has a decoration.
    pub(crate) fn has(&self, id: u32, decoration: Decoration) -> bool {
        self.decorations.get(&id).is_some_and(|all| all.iter().any(|one| one.decoration == decoration))
    }

    /// The number that an id is decorated with.
    pub(crate) fn literal(&self, id: u32, decoration: Decoration) -> Option<u32> {
        literal(self.decorations.get(&id)?, decoration)
    }

    /// The built-in that an id is decorated as.
    pub(crate) fn built_in(&self, id: u32) -> Option<BuiltIn> {
        built_in(self.decorations.get(&id)?)
    }

    /// Reports whether a result is decorated to be rounded towards zero.
    pub(crate) fn rounds_towards_zero(&self, id: u32) -> bool {
        let mode = self.decorations.get(&id).and_then(|all| enumerant(all, Decoration::FPRoundingMode));
        mode.and_then(FPRoundingMode::from_u32) == Some(FPRoundingMode::RTZ)
    }

    /// The bits of the fast-math mode that a result is decorated with.
    pub(crate) fn fast_math(&self, id: u32) -> Option<FPFastMathMode> {
        enumerant(self.decorations.get(&id)?, Decoration::FPFastMathMode).map(FPFastMathMode::from_bits_truncate)
    }

    /// Reports whether a struct's member has a decoration.
    pub(crate) fn member_has(&self, id: u32, member: u32, decoration: Decoration) -> bool {
        self.member_decorations.get(&(id, member)).is_some_and(|all| all.iter().any(|one| one.decoration == decoration))
    }

    /// The number that a struct's member is decorated with.
    pub(crate) fn member_literal(&self, id: u32, member: u32, decoration: Decoration) -> Option<u32> {
        literal(self.member_decorations.get(&(id, member))?, decoration)
    }

    /// The built-in that a struct's member is decorated as.
    pub(crate) fn member_built_in(&self, id: u32, member: u32) -> Option<BuiltIn> {
        built_in(self.member_decorations.get(&(id, member))?)
    }

    fn index_decorations(&mut self) -> Result<(), Error> {
        let annotations = std::mem::take(&mut self.sections.annotations);
        let mut count = 0;
        for annotation in &annotations {
            let operands = annotation.operands.as_slice();
            match annotation.opcode {
                Op::Decorate | Op::DecorateId => {
                    if let ([Operand::Id(id), _, parameters @ ..], Some(decoration)) =
                        (operands, annotation.enumerant(1, Decoration::from_u32))
                    {
                        count += 1;
                        self.decorations
                            .entry(*id)
                            .or_default()
                            .push(Decorated { decoration, parameters: parameters.to_vec() });
                    }
                }
                Op::MemberDecorate => {
                    if let ([Operand::Id(id), Operand::Literal(member), _, parameters @ ..], Some(decoration)) =
                        (operands, annotation.enumerant(2, Decoration::from_u32))
                    {
                        count += 1;
                        let entry = self.member_decorations.entry((*id, *member)).or_default();
                        entry.push(Decorated { decoration, parameters: parameters.to_vec() });
                    }
                }
                Op::GroupDecorate => count += self.apply_group(operands, MAX_DECORATIONS - count),
                Op::GroupMemberDecorate => {
                    count += self.apply_member_group(operands, MAX_DECORATIONS - count);
                }
                _ => {}
            }
            if count >= MAX_DECORATIONS {
                return Err(Error::TooLarge { what: "decorations", limit: MAX_DECORATIONS as u64 });
            }
        }
        self.sections.annotations = annotations;
        Ok(())
    }

    /// Decorates each target of a group. Returns the number of added decorations; stops at `limit`.
    fn apply_group(&mut self, operands: &[Operand], limit: usize) -> usize {
        let Some(group) = operands.first().and_then(Operand::id) else {
            return 0;
        };
        let group = self.decorations.get(&group).cloned().unwrap_or_default();
        let mut applied = 0;
        for target in operands[1..].iter().filter_map(Operand::id) {
            applied += group.len();
            if applied >= limit {
                return limit;
            }
            let entry = self.decorations.entry(target).or_default();
            entry.extend_from_slice(&group);
        }
        applied
    }

    fn apply_member_group(&mut self, operands: &[Operand], limit: usize) -> usize {
        let Some(group) = operands.first().and_then(Operand::id) else {
            return 0;
        };
        let group = self.decorations.get(&group).cloned().unwrap_or_default();
        let mut applied = 0;
        for pair in operands[1..].chunks_exact(2) {
            if let [Operand::Id(id), Operand::Literal(member)] = pair {
                applied += group.len();
                if applied >= limit {
                    return limit;
                }
                let entry = self.member_decorations.entry((*id, *member)).or_default();
                entry.extend_from_slice(&group);
            }
        }
        applied
    }
}

fn literal(all: &[Decorated], decoration: Decoration) -> Option<u32> {
    let found = all.iter().find(|one| one.decoration == decoration)?;
    match found.parameters.first()? {
        Operand::Literal(value) => Some(*value),
        _ => None,
    }
}

fn built_in(all: &[Decorated]) -> Option<BuiltIn> {
    enumerant(all, Decoration::BuiltIn).and_then(BuiltIn::from_u32)
}

fn enumerant(all: &[Decorated], decoration: Decoration) -> Option<u32> {
    let found = all.iter().find(|one| one.decoration == decoration)?;
    match found.parameters.first()? {
        Operand::Enumerant(value) => Some(*value),
        _ => None,
    }
}

fn extended_sets(sections: &Sections) -> HashMap<u32, ExtendedSet> {
    let set = |import: &Instruction| match import.string(0) {
        Some("GLSL.std.450") => ExtendedSet::Glsl,
        Some(name) if name.starts_with("NonSemantic.") || name == "OpenCL.DebugInfo.100" => ExtendedSet::NonSemantic,
        _ => ExtendedSet::Unknown,
    };
    sections.imports.iter().filter_map(|import| Some((import.result_id?, set(import)))).collect()
}

fn names(sections: &Sections) -> HashMap<u32, String> {
    sections
        .names
        .iter()
        .filter_map(|it| {
            let name = it.string(1).filter(|name| !name.is_empty())?;
            Some((it.id(0).ok()?, name.to_owned()))
        })
        .collect()
}

fn check_header(words: &[u32]) -> Result<(u8, u8), Error> {
    if words.len() > MAX_WORDS {
        return Err(Error::TooLarge { what: "words of a module", limit: MAX_WORDS as u64 });
    }
    let [magic, version, ..] = words else {
        return invalid("there is no header");
    };
    if words.len() < HEADER_WORDS {
        return invalid("the header is cut off");
    }
    if *magic != spirv::MAGIC_NUMBER {
        return invalid("the magic number is wrong");
    }
    let (major, minor) = ((version >> 16) as u8, (version >> 8) as u8);
    if version & 0xff00_00ff != 0 || major != 1 || minor > 6 {
        return invalid("only versions 1.0 to 1.6 are supported");
    }
    Ok((major, minor))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn binaries_that_are_cut_off_are_errors() {
        let header = [spirv::MAGIC_NUMBER, 0x0001_0000, 0, 8, 0];
        assert!(Module::parse(&[]).is_err());
        assert!(Module::parse(&header[..4]).is_err());
        assert!(Module::parse(&header).is_ok());
        // An OpString that claims to be longer than the binary.
        let mut long = header.to_vec();
        long.extend([40 << 16 | Op::String as u32, 1, 0x6161_6161]);
        assert!(matches!(Module::parse(&long), Err(Error::Binary { .. })));
        long[5] = 3 << 16 | Op::String as u32;
        assert!(matches!(Module::parse(&long), Err(Error::Binary { .. })));
    }

    #[test]
    fn operations_on_constants_keep_all_words() {
        let mut words = vec![spirv::MAGIC_NUMBER, 0x0001_0300, 0, 8, 0];
        words.extend([7 << 16 | Op::SpecConstantOp as u32, 1, 2, Op::CompositeExtract as u32, 3, 0, 1]);
        let module = Module::parse(&words).unwrap();
        let it = &module.sections.globals[0];
        assert_eq!(it.numbers(0), [Op::CompositeExtract as u32, 3, 0, 1]);
        assert_eq!(module.version(), (1, 3));
    }
}
