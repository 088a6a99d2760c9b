//! A SPIR-V module in rspirv's data representation, decoded so that hostile input can't make the decoder panic.
//!
//! rspirv trusts two things that this module therefore checks or rewrites first:
//!
//! - An instruction's word count may lead beyond the end of the binary, where decoding a string would index out of
//!   range. All word counts are walked through before rspirv sees the words.
//! - `OpSpecConstantOp` is decoded recursively, with each operand of the inner instruction once, so shuffles and
//!   composite extractions of more than one index would be refused. These instructions are kept aside as words, and
//!   rspirv sees an `OpUndef` with the same type and id in their place.
//!
//! Its loader also has no place for `OpExecutionModeId` and for extended instructions outside functions (debug
//! information); [`Loader`] takes these out of its way.

use std::collections::HashMap;

use rspirv::binary::{Consumer, ParseAction, parse_words};
use rspirv::dr::{self, Instruction, Operand};
use rspirv::spirv::{self, BuiltIn, Decoration, Op};

use super::error::{Error, Fault};

/// The most words of a module.
const MAX_WORDS: usize = 1 << 20;
/// The most decorations after groups are expanded.
const MAX_DECORATIONS: usize = 1 << 20;
/// The words before the first instruction.
const HEADER_WORDS: usize = 5;

/// An `OpSpecConstantOp`.
#[derive(Clone, Debug)]
pub(super) struct SpecOp {
    /// The operation, as a number.
    pub opcode: u32,
    /// Its operands: ids and literals.
    pub operands: Vec<u32>,
}

/// A decoration and its parameters.
#[derive(Clone, Debug)]
struct Decorated {
    decoration: Decoration,
    parameters: Vec<Operand>,
}

/// What extended instructions an import gives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ExtendedSet {
    /// `GLSL.std.450`.
    Glsl,
    /// `NonSemantic.*` and debug information: nothing to do.
    NonSemantic,
    /// Any other.
    Unknown,
}

/// A shader module: decoded, indexed, but not yet checked beyond that.
#[derive(Debug)]
pub struct Module {
    pub(super) data: dr::Module,
    pub(super) spec_ops: HashMap<u32, SpecOp>,
    pub(super) extended_sets: HashMap<u32, ExtendedSet>,
    /// Indices into `data.functions` by id.
    pub(super) functions: HashMap<u32, usize>,
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
        let (words, spec_ops) = set_spec_ops_aside(words)?;
        let mut loader = Loader::default();
        parse_words(&words, &mut loader).map_err(|state| Error::Binary {
            reason: state.to_string(),
        })?;
        let mut data = loader.loader.module();
        data.execution_modes.append(&mut loader.mode_ids);
        let mut module = Self {
            spec_ops,
            extended_sets: extended_sets(&data),
            functions: HashMap::new(),
            decorations: HashMap::new(),
            member_decorations: HashMap::new(),
            names: names(&data),
            version,
            data,
        };
        for (index, function) in module.data.functions.iter().enumerate() {
            if let Some(id) = function.def.as_ref().and_then(|def| def.result_id) {
                module.functions.insert(id, index);
            }
        }
        module.index_decorations()?;
        Ok(module)
    }

    /// SPIR-V's major and minor version.
    pub fn version(&self) -> (u8, u8) {
        self.version
    }

    /// The name that debug information gives an id.
    pub fn name(&self, id: u32) -> Option<&str> {
        self.names.get(&id).map(String::as_str)
    }

    /// Names and execution models of all entry points.
    pub fn entry_points(&self) -> Vec<(String, spirv::ExecutionModel)> {
        self.data
            .entry_points
            .iter()
            .filter_map(|entry| match entry.operands.as_slice() {
                [
                    Operand::ExecutionModel(model),
                    _,
                    Operand::LiteralString(name),
                    ..,
                ] => Some((name.clone(), *model)),
                _ => None,
            })
            .collect()
    }

    /// Whether an id is decorated so.
    pub(super) fn has(&self, id: u32, decoration: Decoration) -> bool {
        self.decorations
            .get(&id)
            .is_some_and(|all| all.iter().any(|one| one.decoration == decoration))
    }

    /// The number that an id is decorated with.
    pub(super) fn literal(&self, id: u32, decoration: Decoration) -> Option<u32> {
        literal(self.decorations.get(&id)?, decoration)
    }

    /// The built-in that an id is decorated as.
    pub(super) fn built_in(&self, id: u32) -> Option<BuiltIn> {
        built_in(self.decorations.get(&id)?)
    }

    /// Whether a struct's member is decorated so.
    pub(super) fn member_has(&self, id: u32, member: u32, decoration: Decoration) -> bool {
        self.member_decorations
            .get(&(id, member))
            .is_some_and(|all| all.iter().any(|one| one.decoration == decoration))
    }

    /// The number that a struct's member is decorated with.
    pub(super) fn member_literal(
        &self,
        id: u32,
        member: u32,
        decoration: Decoration,
    ) -> Option<u32> {
        literal(self.member_decorations.get(&(id, member))?, decoration)
    }

    /// The built-in that a struct's member is decorated as.
    pub(super) fn member_built_in(&self, id: u32, member: u32) -> Option<BuiltIn> {
        built_in(self.member_decorations.get(&(id, member))?)
    }

    fn index_decorations(&mut self) -> Result<(), Error> {
        let annotations = std::mem::take(&mut self.data.annotations);
        let mut count = 0;
        for annotation in &annotations {
            let operands = annotation.operands.as_slice();
            match annotation.class.opcode {
                Op::Decorate | Op::DecorateId => {
                    if let [
                        Operand::IdRef(id),
                        Operand::Decoration(decoration),
                        rest @ ..,
                    ] = operands
                    {
                        count += 1;
                        self.decorations.entry(*id).or_default().push(Decorated {
                            decoration: *decoration,
                            parameters: rest.to_vec(),
                        });
                    }
                }
                Op::MemberDecorate => {
                    if let [
                        Operand::IdRef(id),
                        Operand::LiteralBit32(member),
                        Operand::Decoration(decoration),
                        rest @ ..,
                    ] = operands
                    {
                        count += 1;
                        let entry = self.member_decorations.entry((*id, *member)).or_default();
                        entry.push(Decorated {
                            decoration: *decoration,
                            parameters: rest.to_vec(),
                        });
                    }
                }
                Op::GroupDecorate => count += self.apply_group(operands, MAX_DECORATIONS - count),
                Op::GroupMemberDecorate => {
                    count += self.apply_member_group(operands, MAX_DECORATIONS - count);
                }
                _ => {}
            }
            if count >= MAX_DECORATIONS {
                return Err(Error::TooLarge {
                    what: "decorations",
                    limit: MAX_DECORATIONS as u64,
                });
            }
        }
        self.data.annotations = annotations;
        Ok(())
    }

    /// Decorates each target as the group is; returns how many decorations that were, stopping at `limit`.
    fn apply_group(&mut self, operands: &[Operand], limit: usize) -> usize {
        let Some(group) = operands.first().and_then(Operand::id_ref_any) else {
            return 0;
        };
        let group = self.decorations.get(&group).cloned().unwrap_or_default();
        let mut applied = 0;
        for target in operands[1..].iter().filter_map(Operand::id_ref_any) {
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
        let Some(group) = operands.first().and_then(Operand::id_ref_any) else {
            return 0;
        };
        let group = self.decorations.get(&group).cloned().unwrap_or_default();
        let mut applied = 0;
        for pair in operands[1..].chunks_exact(2) {
            if let [Operand::IdRef(id), Operand::LiteralBit32(member)] = pair {
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

/// rspirv's loader, spared what it has no place for.
#[derive(Default)]
struct Loader {
    loader: dr::Loader,
    mode_ids: Vec<Instruction>,
    in_function: bool,
}

impl Consumer for Loader {
    fn initialize(&mut self) -> ParseAction {
        self.loader.initialize()
    }

    fn finalize(&mut self) -> ParseAction {
        self.loader.finalize()
    }

    fn consume_header(&mut self, header: dr::ModuleHeader) -> ParseAction {
        self.loader.consume_header(header)
    }

    fn consume_instruction(&mut self, it: Instruction) -> ParseAction {
        match it.class.opcode {
            Op::ExecutionModeId => {
                self.mode_ids.push(it);
                return ParseAction::Continue;
            }
            Op::ExtInst if !self.in_function => return ParseAction::Continue,
            Op::Function => self.in_function = true,
            Op::FunctionEnd => self.in_function = false,
            _ => {}
        }
        self.loader.consume_instruction(it)
    }
}

fn literal(all: &[Decorated], decoration: Decoration) -> Option<u32> {
    let found = all.iter().find(|one| one.decoration == decoration)?;
    match found.parameters.first()? {
        Operand::LiteralBit32(value) => Some(*value),
        _ => None,
    }
}

fn built_in(all: &[Decorated]) -> Option<BuiltIn> {
    all.iter().find_map(|one| match one.parameters.first() {
        Some(Operand::BuiltIn(built_in)) => Some(*built_in),
        _ => None,
    })
}

fn extended_sets(data: &dr::Module) -> HashMap<u32, ExtendedSet> {
    let set = |import: &Instruction| match import.operands.first() {
        Some(Operand::LiteralString(name)) if name == "GLSL.std.450" => ExtendedSet::Glsl,
        Some(Operand::LiteralString(name))
            if name.starts_with("NonSemantic.") || name == "OpenCL.DebugInfo.100" =>
        {
            ExtendedSet::NonSemantic
        }
        _ => ExtendedSet::Unknown,
    };
    data.ext_inst_imports
        .iter()
        .filter_map(|import| Some((import.result_id?, set(import))))
        .collect()
}

fn names(data: &dr::Module) -> HashMap<u32, String> {
    data.debug_names
        .iter()
        .filter_map(|name| match name.operands.as_slice() {
            [Operand::IdRef(id), Operand::LiteralString(name)] if !name.is_empty() => {
                Some((*id, name.clone()))
            }
            _ => None,
        })
        .collect()
}

fn check_header(words: &[u32]) -> Result<(u8, u8), Error> {
    let wrong = |reason: &str| {
        Err(Error::Binary {
            reason: reason.into(),
        })
    };
    if words.len() > MAX_WORDS {
        return Err(Error::TooLarge {
            what: "words of a module",
            limit: MAX_WORDS as u64,
        });
    }
    let [magic, version, ..] = words else {
        return wrong("there is no header");
    };
    if words.len() < HEADER_WORDS {
        return wrong("the header is cut off");
    }
    if *magic != spirv::MAGIC_NUMBER {
        return wrong("the magic number is wrong");
    }
    let (major, minor) = ((version >> 16) as u8, (version >> 8) as u8);
    if version & 0xff00_00ff != 0 || major != 1 || minor > 6 {
        return wrong("only versions 1.0 to 1.6 are supported");
    }
    Ok((major, minor))
}

/// Checks that instructions fill the words exactly, and replaces `OpSpecConstantOp`.
fn set_spec_ops_aside(words: &[u32]) -> Result<(Vec<u32>, HashMap<u32, SpecOp>), Error> {
    let mut kept = words[..HEADER_WORDS].to_vec();
    let mut spec_ops = HashMap::new();
    let mut rest = &words[HEADER_WORDS..];
    while let Some(first) = rest.first() {
        let (count, opcode) = ((first >> 16) as usize, first & 0xffff);
        if count == 0 || count > rest.len() {
            return Err(Error::Binary {
                reason: format!(
                    "the instruction at word {} has a word count of {count}",
                    words.len() - rest.len()
                ),
            });
        }
        let (instruction, after) = rest.split_at(count);
        match instruction {
            [_, ty, id, inner, operands @ ..] if opcode == Op::SpecConstantOp as u32 => {
                spec_ops.insert(
                    *id,
                    SpecOp {
                        opcode: *inner,
                        operands: operands.to_vec(),
                    },
                );
                kept.extend([3 << 16 | Op::Undef as u32, *ty, *id]);
            }
            _ => kept.extend_from_slice(instruction),
        }
        rest = after;
    }
    Ok((kept, spec_ops))
}

/// Operands of an instruction by position, checked.
pub(super) trait Operands {
    /// The id at a position.
    fn id(&self, index: usize) -> Result<u32, Fault>;
    /// The literal at a position.
    fn number(&self, index: usize) -> Result<u32, Fault>;
    /// All literals from a position on.
    fn numbers(&self, from: usize) -> Vec<u32>;
    /// All ids from a position on.
    fn ids(&self, from: usize) -> Vec<u32>;
    /// The result's type.
    fn ty(&self) -> Result<u32, Fault>;
    /// The result.
    fn result(&self) -> Result<u32, Fault>;
}

impl Operands for Instruction {
    fn id(&self, index: usize) -> Result<u32, Fault> {
        self.operands
            .get(index)
            .and_then(Operand::id_ref_any)
            .ok_or_else(|| Fault::Malformed(format!("operand {index} isn't an id")))
    }

    fn number(&self, index: usize) -> Result<u32, Fault> {
        match self.operands.get(index) {
            Some(Operand::LiteralBit32(value) | Operand::LiteralExtInstInteger(value)) => {
                Ok(*value)
            }
            _ => Err(Fault::Malformed(format!("operand {index} isn't a number"))),
        }
    }

    fn numbers(&self, from: usize) -> Vec<u32> {
        (from..self.operands.len())
            .map_while(|index| self.number(index).ok())
            .collect()
    }

    fn ids(&self, from: usize) -> Vec<u32> {
        (from..self.operands.len())
            .map_while(|index| self.id(index).ok())
            .collect()
    }

    fn ty(&self) -> Result<u32, Fault> {
        self.result_type
            .ok_or_else(|| Fault::Malformed("there is no result type".into()))
    }

    fn result(&self) -> Result<u32, Fault> {
        self.result_id
            .ok_or_else(|| Fault::Malformed("there is no result".into()))
    }
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
    fn specialization_operations_are_set_aside() {
        let mut words = vec![spirv::MAGIC_NUMBER, 0x0001_0300, 0, 8, 0];
        words.extend([
            7 << 16 | Op::SpecConstantOp as u32,
            1,
            2,
            Op::CompositeExtract as u32,
            3,
            0,
            1,
        ]);
        let module = Module::parse(&words).unwrap();
        assert_eq!(module.spec_ops[&2].operands, [3, 0, 1]);
        assert_eq!(module.version(), (1, 3));
    }
}
