//! SPIR-V modules that are rewritten: their sections, and the code of a new entry point that calls the application's.

use std::collections::{BTreeMap, BTreeSet};
use std::ffi::CStr;

/// Opcodes of SPIR-V.
pub(crate) mod op {
    use spirv::Op;

    pub(crate) const SOURCE_CONTINUED: u32 = Op::SourceContinued as u32;
    pub(crate) const STRING: u32 = Op::String as u32;
    pub(crate) const MODULE_PROCESSED: u32 = Op::ModuleProcessed as u32;
    pub(crate) const DECORATE_ID: u32 = Op::DecorateId as u32;
    pub(crate) const DECORATE_STRING: u32 = Op::DecorateString as u32;
    pub(crate) const MEMBER_DECORATE_STRING: u32 = Op::MemberDecorateString as u32;
    pub(crate) const EXTENSION: u32 = Op::Extension as u32;
    pub(crate) const EXT_INST_IMPORT: u32 = Op::ExtInstImport as u32;
    pub(crate) const EXT_INST: u32 = Op::ExtInst as u32;
    pub(crate) const MEMORY_MODEL: u32 = Op::MemoryModel as u32;
    pub(crate) const ENTRY_POINT: u32 = Op::EntryPoint as u32;
    pub(crate) const EXECUTION_MODE: u32 = Op::ExecutionMode as u32;
    pub(crate) const CAPABILITY: u32 = Op::Capability as u32;
    pub(crate) const TYPE_BOOL: u32 = Op::TypeBool as u32;
    pub(crate) const TYPE_INT: u32 = Op::TypeInt as u32;
    pub(crate) const TYPE_FLOAT: u32 = Op::TypeFloat as u32;
    pub(crate) const TYPE_VECTOR: u32 = Op::TypeVector as u32;
    pub(crate) const TYPE_MATRIX: u32 = Op::TypeMatrix as u32;
    pub(crate) const TYPE_ARRAY: u32 = Op::TypeArray as u32;
    pub(crate) const TYPE_RUNTIME_ARRAY: u32 = Op::TypeRuntimeArray as u32;
    pub(crate) const TYPE_STRUCT: u32 = Op::TypeStruct as u32;
    pub(crate) const TYPE_POINTER: u32 = Op::TypePointer as u32;
    pub(crate) const CONSTANT: u32 = Op::Constant as u32;
    pub(crate) const CONSTANT_NULL: u32 = Op::ConstantNull as u32;
    pub(crate) const SPEC_CONSTANT: u32 = Op::SpecConstant as u32;
    pub(crate) const FUNCTION: u32 = Op::Function as u32;
    pub(crate) const FUNCTION_END: u32 = Op::FunctionEnd as u32;
    pub(crate) const FUNCTION_CALL: u32 = Op::FunctionCall as u32;
    pub(crate) const VARIABLE: u32 = Op::Variable as u32;
    pub(crate) const LOAD: u32 = Op::Load as u32;
    pub(crate) const STORE: u32 = Op::Store as u32;
    pub(crate) const ACCESS_CHAIN: u32 = Op::AccessChain as u32;
    pub(crate) const IN_BOUNDS_ACCESS_CHAIN: u32 = Op::InBoundsAccessChain as u32;
    pub(crate) const DECORATE: u32 = Op::Decorate as u32;
    pub(crate) const MEMBER_DECORATE: u32 = Op::MemberDecorate as u32;
    pub(crate) const GROUP_DECORATE: u32 = Op::GroupDecorate as u32;
    pub(crate) const GROUP_MEMBER_DECORATE: u32 = Op::GroupMemberDecorate as u32;
    pub(crate) const VECTOR_SHUFFLE: u32 = Op::VectorShuffle as u32;
    pub(crate) const COMPOSITE_CONSTRUCT: u32 = Op::CompositeConstruct as u32;
    pub(crate) const COMPOSITE_EXTRACT: u32 = Op::CompositeExtract as u32;
    pub(crate) const COPY_OBJECT: u32 = Op::CopyObject as u32;
    pub(crate) const CONVERT_F_TO_U: u32 = Op::ConvertFToU as u32;
    pub(crate) const BITCAST: u32 = Op::Bitcast as u32;
    pub(crate) const I_ADD: u32 = Op::IAdd as u32;
    pub(crate) const I_SUB: u32 = Op::ISub as u32;
    pub(crate) const I_MUL: u32 = Op::IMul as u32;
    pub(crate) const ALL: u32 = Op::All as u32;
    pub(crate) const LOGICAL_OR: u32 = Op::LogicalOr as u32;
    pub(crate) const LOGICAL_AND: u32 = Op::LogicalAnd as u32;
    pub(crate) const LOGICAL_NOT: u32 = Op::LogicalNot as u32;
    pub(crate) const SELECT: u32 = Op::Select as u32;
    pub(crate) const I_EQUAL: u32 = Op::IEqual as u32;
    pub(crate) const I_NOT_EQUAL: u32 = Op::INotEqual as u32;
    pub(crate) const U_LESS_THAN: u32 = Op::ULessThan as u32;
    pub(crate) const F_ORD_GREATER_THAN_EQUAL: u32 = Op::FOrdGreaterThanEqual as u32;
    pub(crate) const SHIFT_RIGHT_LOGICAL: u32 = Op::ShiftRightLogical as u32;
    pub(crate) const SHIFT_LEFT_LOGICAL: u32 = Op::ShiftLeftLogical as u32;
    pub(crate) const BITWISE_OR: u32 = Op::BitwiseOr as u32;
    pub(crate) const BITWISE_AND: u32 = Op::BitwiseAnd as u32;
    pub(crate) const SELECTION_MERGE: u32 = Op::SelectionMerge as u32;
    pub(crate) const LABEL: u32 = Op::Label as u32;
    pub(crate) const BRANCH: u32 = Op::Branch as u32;
    pub(crate) const BRANCH_CONDITIONAL: u32 = Op::BranchConditional as u32;
    pub(crate) const RETURN: u32 = Op::Return as u32;
    pub(crate) const EXECUTION_MODE_ID: u32 = Op::ExecutionModeId as u32;
    pub(crate) const DEMOTE_TO_HELPER_INVOCATION: u32 = Op::DemoteToHelperInvocation as u32;
}

/// Storage classes.
pub(crate) const INPUT: u32 = spirv::StorageClass::Input as u32;
pub(crate) const OUTPUT: u32 = spirv::StorageClass::Output as u32;
pub(crate) const PRIVATE: u32 = spirv::StorageClass::Private as u32;
pub(crate) const PHYSICAL_STORAGE_BUFFER: u32 = spirv::StorageClass::PhysicalStorageBuffer as u32;

/// Decorations.
pub(crate) const BLOCK: u32 = spirv::Decoration::Block as u32;
pub(crate) const ARRAY_STRIDE: u32 = spirv::Decoration::ArrayStride as u32;
pub(crate) const BUILT_IN: u32 = spirv::Decoration::BuiltIn as u32;
pub(crate) const FLAT: u32 = spirv::Decoration::Flat as u32;
pub(crate) const NON_WRITABLE: u32 = spirv::Decoration::NonWritable as u32;
pub(crate) const NON_READABLE: u32 = spirv::Decoration::NonReadable as u32;
pub(crate) const LOCATION: u32 = spirv::Decoration::Location as u32;
pub(crate) const COMPONENT: u32 = spirv::Decoration::Component as u32;
pub(crate) const OFFSET: u32 = spirv::Decoration::Offset as u32;
/// Decorations of a variable of an interface.
const OF_INTERFACES: [u32; 8] = [
    BUILT_IN,
    spirv::Decoration::Invariant as u32,
    spirv::Decoration::NoPerspective as u32,
    FLAT,
    spirv::Decoration::Centroid as u32,
    spirv::Decoration::Sample as u32,
    LOCATION,
    COMPONENT,
];

pub(crate) fn opcode(instruction: &[u32]) -> u32 {
    instruction.first().map_or(0, |word| word & 0xFFFF)
}

/// The instructions of a module. What is not whole ends them.
pub(crate) fn instructions(words: &[u32]) -> impl Iterator<Item = &[u32]> {
    let mut rest = words.get(5..).unwrap_or_default();
    std::iter::from_fn(move || {
        let length = (rest.first()? >> 16) as usize;
        let (instruction, after) = rest.split_at_checked(length).filter(|_| length > 0)?;
        rest = after;
        Some(instruction)
    })
}

/// The words of a string, with its end.
pub(crate) fn literal(text: &str) -> Vec<u32> {
    let mut bytes = text.as_bytes().to_vec();
    bytes.resize(text.len() / 4 * 4 + 4, 0);
    bytes.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect()
}

/// The number of words of a literal string at the beginning of others, if those are the string.
pub(crate) fn literal_length(words: &[u32], text: &[u8]) -> Option<usize> {
    let bytes: Vec<u8> = words.iter().take(text.len() / 4 + 1).flat_map(|word| word.to_le_bytes()).collect();
    let is_it = bytes.get(..text.len()) == Some(text) && bytes.get(text.len()) == Some(&0);
    is_it.then_some(text.len() / 4 + 1)
}

/// A type, as far as inputs have it.
#[derive(Clone, Debug)]
pub(crate) enum Type {
    Bool,
    /// An integer or a float, of a number of bits.
    Number(u32),
    Vector(u32, u32),
    Matrix(u32, u32),
    /// An array: the type of its elements, and the constant of their number.
    Array(u32, u32),
    Structure(Vec<u32>),
    Other,
}

/// The value of a location: its components' ids, which are 32-bit unsigned integers.
pub(crate) type Components = [u32; 4];

/// A module that is being rewritten, by its sections.
pub(crate) struct Module {
    pub(crate) version: u32,
    pub(crate) generator: u32,
    pub(crate) bound: u32,
    pub(crate) capabilities: Vec<Vec<u32>>,
    pub(crate) extensions: Vec<Vec<u32>>,
    pub(crate) imports: Vec<Vec<u32>>,
    pub(crate) memory_model: Vec<u32>,
    pub(crate) entry: Vec<u32>,
    pub(crate) modes: Vec<Vec<u32>>,
    pub(crate) debug: Vec<Vec<u32>>,
    pub(crate) annotations: Vec<Vec<u32>>,
    pub(crate) types: Vec<Vec<u32>>,
    pub(crate) functions: Vec<Vec<u32>>,
    pub(crate) known_types: BTreeMap<u32, Type>,
    /// 32-bit constants.
    pub(crate) constants: BTreeMap<u32, u32>,
}

impl Module {
    /// Reads a module with an entry point of an execution model.
    ///
    /// # Errors
    /// A sentence about the shader, which it calls what it is: "the resolve shader".
    pub(crate) fn read(words: &[u32], model: u32, name: &CStr, shader: &'static str) -> Result<Self, String> {
        let mut own = Self {
            version: words.get(1).copied().unwrap_or(0),
            generator: words.get(2).copied().unwrap_or(0),
            bound: words.get(3).copied().unwrap_or(0),
            capabilities: Vec::new(),
            extensions: Vec::new(),
            imports: Vec::new(),
            memory_model: Vec::new(),
            entry: Vec::new(),
            modes: Vec::new(),
            debug: Vec::new(),
            annotations: Vec::new(),
            types: Vec::new(),
            functions: Vec::new(),
            known_types: BTreeMap::new(),
            constants: BTreeMap::new(),
        };
        for instruction in instructions(words) {
            own.take(instruction, model, name);
        }
        let [_, _, function, ..] = own.entry[..] else {
            return Err(format!("the module of {shader} has no entry point {}", name.to_string_lossy()));
        };
        own.modes.retain(|mode| mode.get(1) == Some(&function));
        if own.memory_model.len() != 3 {
            return Err(format!("the module of {shader} has no memory model"));
        }
        Ok(own)
    }

    fn take(&mut self, instruction: &[u32], model: u32, name: &CStr) {
        let owned = instruction.to_vec();
        if !self.functions.is_empty() {
            self.functions.push(owned);
            return;
        }
        match opcode(instruction) {
            op::CAPABILITY => self.capabilities.push(owned),
            op::EXTENSION => self.extensions.push(owned),
            op::EXT_INST_IMPORT => self.imports.push(owned),
            op::MEMORY_MODEL => self.memory_model = owned,
            op::ENTRY_POINT => {
                let is_it = instruction.get(1) == Some(&model)
                    && literal_length(instruction.get(3..).unwrap_or_default(), name.to_bytes()).is_some();
                if is_it {
                    self.entry = owned;
                }
            }
            op::EXECUTION_MODE | op::EXECUTION_MODE_ID => self.modes.push(owned),
            // Sources, names, strings and processes.
            op::SOURCE_CONTINUED..=op::STRING | op::MODULE_PROCESSED => self.debug.push(owned),
            op::DECORATE..=op::GROUP_MEMBER_DECORATE
            | op::DECORATE_ID
            | op::DECORATE_STRING
            | op::MEMBER_DECORATE_STRING => self.annotations.push(owned),
            op::FUNCTION => self.functions.push(owned),
            _ => {
                self.learn(instruction);
                self.types.push(owned);
            }
        }
    }

    fn learn(&mut self, instruction: &[u32]) {
        match (opcode(instruction), instruction) {
            (op::TYPE_BOOL, [_, id]) => self.know(*id, Type::Bool),
            (op::TYPE_INT | op::TYPE_FLOAT, [_, id, bits, ..]) => self.know(*id, Type::Number(*bits)),
            (op::TYPE_VECTOR, [_, id, of, count]) => self.know(*id, Type::Vector(*of, *count)),
            (op::TYPE_MATRIX, [_, id, of, count]) => self.know(*id, Type::Matrix(*of, *count)),
            (op::TYPE_ARRAY, [_, id, of, count]) => self.know(*id, Type::Array(*of, *count)),
            (op::TYPE_STRUCT, [_, id, members @ ..]) => self.know(*id, Type::Structure(members.to_vec())),
            (op::CONSTANT | op::SPEC_CONSTANT, [_, _, id, value]) => {
                self.constants.insert(*id, *value);
            }
            _ => {}
        }
    }

    fn know(&mut self, id: u32, ty: Type) {
        self.known_types.insert(id, ty);
    }

    pub(crate) fn id(&mut self) -> u32 {
        self.bound += 1;
        self.bound - 1
    }

    /// The id of a type, which is added if it is not there.
    pub(crate) fn type_of(&mut self, opcode_: u32, operands: &[u32]) -> u32 {
        let found = self.types.iter().find(|known| opcode(known) == opcode_ && known.get(2..) == Some(operands));
        if let Some(id) = found.and_then(|known| known.get(1)) {
            return *id;
        }
        let id = self.id();
        let mut words = vec![id];
        words.extend_from_slice(operands);
        let added = assembled(opcode_, &words);
        self.learn(&added);
        self.types.push(added);
        id
    }

    /// A new type, whatever others there are: those of buffers have decorations.
    pub(crate) fn new_type(&mut self, opcode_: u32, operands: &[u32]) -> u32 {
        let id = self.id();
        let mut words = vec![id];
        words.extend_from_slice(operands);
        self.types.push(assembled(opcode_, &words));
        id
    }

    pub(crate) fn variable(&mut self, pointer: u32, class: u32) -> u32 {
        let id = self.id();
        self.types.push(assembled(op::VARIABLE, &[pointer, id, class]));
        self.entry.push(id);
        id
    }

    pub(crate) fn decorate(&mut self, id: u32, decoration: &[u32]) {
        let mut words = vec![id];
        words.extend_from_slice(decoration);
        self.annotations.push(assembled(op::DECORATE, &words));
    }

    pub(crate) fn need(&mut self, capability: u32) {
        if !self.capabilities.iter().any(|known| known.get(1) == Some(&capability)) {
            self.capabilities.push(assembled(op::CAPABILITY, &[capability]));
        }
    }

    pub(crate) fn need_extension(&mut self, name: &str) {
        let words = assembled(op::EXTENSION, &literal(name));
        if !self.extensions.contains(&words) {
            self.extensions.push(words);
        }
    }

    /// Makes addresses of buffers usable.
    pub(crate) fn need_addresses(&mut self) {
        const PHYSICAL_STORAGE_BUFFER_ADDRESSES: u32 = 5347;
        if self.memory_model[1] == 0 {
            self.memory_model[1] = spirv::AddressingModel::PhysicalStorageBuffer64 as u32;
        }
        self.need(PHYSICAL_STORAGE_BUFFER_ADDRESSES);
        self.need_extension("SPV_KHR_physical_storage_buffer");
    }

    /// Makes a new function the entry point. Gives its id, and that of the application's.
    pub(crate) fn replace_entry(&mut self) -> (u32, u32) {
        let (entry, original) = (self.id(), self.entry[2]);
        self.entry[2] = entry;
        for mode in &mut self.modes {
            mode[1] = entry;
        }
        (entry, original)
    }

    /// Removes the decorations that only interfaces have from variables. Groups of decorations are refused in a sentence.
    ///
    /// # Errors
    /// A sentence about the shader.
    pub(crate) fn strip_variables(&mut self, variables: &BTreeSet<u32>, shader: &str) -> Result<(), String> {
        let of_groups = [op::GROUP_DECORATE, op::GROUP_MEMBER_DECORATE];
        if self.annotations.iter().any(|known| of_groups.contains(&opcode(known))) {
            return Err(format!("{shader} has groups of decorations, which are not emulated"));
        }
        self.annotations.retain(|known| {
            let is_of_interface = known.get(2).is_some_and(|decoration| OF_INTERFACES.contains(decoration));
            !(opcode(known) == op::DECORATE && variables.contains(&known[1]) && is_of_interface)
        });
        Ok(())
    }

    /// Takes private variables off the entry point's list. From version 1.4 on it has all variables, before that inputs and outputs alone.
    pub(crate) fn unlist(&mut self, variables: &BTreeSet<u32>) {
        if self.version < 0x0001_0400 {
            let kept = self.entry.split_off(self.names_end());
            self.entry.extend(kept.into_iter().filter(|id| !variables.contains(id)));
        }
    }

    /// A decoration of an id, or of a structure's member.
    pub(crate) fn decoration(&self, id: u32, member: Option<u32>, decoration: u32) -> Option<u32> {
        self.annotations.iter().find_map(|known| match (opcode(known), member, &known[1..]) {
            (op::DECORATE, None, [of, which, value, ..]) if (*of, *which) == (id, decoration) => Some(*value),
            (op::MEMBER_DECORATE, Some(index), [of, at, which, value, ..])
                if (*of, *at, *which) == (id, index, decoration) =>
            {
                Some(*value)
            }
            _ => None,
        })
    }

    /// Variables of the entry point in a storage class: their ids, and the ids of what they point at.
    pub(crate) fn interface(&self, class: u32) -> Vec<(u32, u32)> {
        let listed: BTreeSet<u32> = self.entry.get(self.names_end()..).unwrap_or_default().iter().copied().collect();
        let variables = self.types.iter().filter(|known| opcode(known) == op::VARIABLE);
        let own = variables.filter(|known| listed.contains(&known[2]) && known[3] == class);
        own.filter_map(|known| Some((known[2], self.pointee(known[1])?))).collect()
    }

    pub(crate) fn pointee(&self, pointer: u32) -> Option<u32> {
        let mut types = self.types.iter().filter(|known| opcode(known) == op::TYPE_POINTER);
        types.find(|known| known[1] == pointer).map(|known| known[3])
    }

    /// The place in the entry point's words at which its variables begin.
    pub(crate) fn names_end(&self) -> usize {
        let name = self.entry.get(3..).unwrap_or_default();
        3 + name.iter().position(|word| word.to_le_bytes().contains(&0)).map_or(name.len(), |at| at + 1)
    }

    /// Removes what decorates a structure as one of an interface.
    pub(crate) fn strip(&mut self, ty: u32) {
        match self.known_types.get(&ty).cloned() {
            Some(Type::Structure(members)) => {
                self.annotations.retain(|known| match (opcode(known), &known[1..]) {
                    (op::DECORATE, [id, decoration, ..]) => (*id, *decoration) != (ty, BLOCK),
                    (op::MEMBER_DECORATE, [id, _, decoration, ..]) => *id != ty || !OF_INTERFACES.contains(decoration),
                    _ => true,
                });
                members.iter().for_each(|member| self.strip(*member));
            }
            Some(Type::Array(of, _)) => self.strip(of),
            _ => {}
        }
    }

    pub(crate) fn words(mut self) -> Vec<u32> {
        self.entry[0] = (self.entry.len() as u32) << 16 | op::ENTRY_POINT;
        let mut words = vec![0x0723_0203, self.version, self.generator, self.bound, 0];
        let single = [vec![self.memory_model], vec![self.entry]];
        let [memory_model, entry] = single;
        let sections = [
            self.capabilities,
            self.extensions,
            self.imports,
            memory_model,
            entry,
            self.modes,
            self.debug,
            self.annotations,
            self.types,
            self.functions,
        ];
        for instruction in sections.iter().flatten() {
            words.extend_from_slice(instruction);
        }
        words
    }
}

/// An instruction.
pub(crate) fn assembled(opcode: u32, operands: &[u32]) -> Vec<u32> {
    let mut words = vec![(operands.len() as u32 + 1) << 16 | opcode];
    words.extend_from_slice(operands);
    words
}

/// The types that the new entry point uses.
pub(crate) struct Types {
    pub(crate) void: u32,
    pub(crate) function: u32,
    pub(crate) boolean: u32,
    pub(crate) booleans_2: u32,
    pub(crate) booleans_4: u32,
    pub(crate) uint: u32,
    pub(crate) uints_2: u32,
    pub(crate) uints_4: u32,
    pub(crate) float: u32,
    pub(crate) floats_4: u32,
    /// Addresses of `uvec4` and of `uint`, and of arrays of these.
    pub(crate) rows: u32,
    pub(crate) row: u32,
    pub(crate) words: u32,
    pub(crate) word: u32,
}

impl Types {
    /// Adds the types. `access` decorates what is reached by addresses: [`NON_WRITABLE`] or [`NON_READABLE`].
    pub(crate) fn new(module: &mut Module, access: u32) -> Self {
        let void = module.type_of(19, &[]);
        let boolean = module.type_of(op::TYPE_BOOL, &[]);
        let uint = module.type_of(op::TYPE_INT, &[32, 0]);
        let float = module.type_of(op::TYPE_FLOAT, &[32]);
        let uints_4 = module.type_of(op::TYPE_VECTOR, &[uint, 4]);
        let mut array = |of: u32, stride: u32| {
            let elements = module.new_type(op::TYPE_RUNTIME_ARRAY, &[of]);
            module.decorate(elements, &[ARRAY_STRIDE, stride]);
            let block = module.new_type(op::TYPE_STRUCT, &[elements]);
            module.decorate(block, &[BLOCK]);
            for decoration in [&[0, OFFSET, 0][..], &[0, access]] {
                let mut words = vec![block];
                words.extend_from_slice(decoration);
                module.annotations.push(assembled(op::MEMBER_DECORATE, &words));
            }
            let pointer = module.new_type(op::TYPE_POINTER, &[PHYSICAL_STORAGE_BUFFER, block]);
            (pointer, module.new_type(op::TYPE_POINTER, &[PHYSICAL_STORAGE_BUFFER, of]))
        };
        let ((rows, row), (words, word)) = (array(uints_4, 16), array(uint, 4));
        Self {
            void,
            function: module.type_of(33, &[void]),
            boolean,
            booleans_2: module.type_of(op::TYPE_VECTOR, &[boolean, 2]),
            booleans_4: module.type_of(op::TYPE_VECTOR, &[boolean, 4]),
            uint,
            uints_2: module.type_of(op::TYPE_VECTOR, &[uint, 2]),
            uints_4,
            float,
            floats_4: module.type_of(op::TYPE_VECTOR, &[float, 4]),
            rows,
            row,
            words,
            word,
        }
    }
}

/// The new entry point, as it is written.
pub(crate) struct Body<'a> {
    pub(crate) module: &'a mut Module,
    pub(crate) types: Types,
    pub(crate) code: Vec<Vec<u32>>,
    pub(crate) made: BTreeMap<u32, u32>,
}

impl Body<'_> {
    /// The id of a constant.
    pub(crate) fn constant(&mut self, value: u32) -> u32 {
        if let Some(id) = self.made.get(&value) {
            return *id;
        }
        let id = self.module.id();
        self.module.types.push(assembled(op::CONSTANT, &[self.types.uint, id, value]));
        self.made.insert(value, id);
        id
    }

    /// An instruction with a result.
    pub(crate) fn run(&mut self, opcode: u32, ty: u32, operands: &[u32]) -> u32 {
        let id = self.module.id();
        let mut words = vec![ty, id];
        words.extend_from_slice(operands);
        self.code.push(assembled(opcode, &words));
        id
    }

    pub(crate) fn write(&mut self, opcode: u32, operands: &[u32]) {
        self.code.push(assembled(opcode, operands));
    }

    pub(crate) fn load(&mut self, ty: u32, variable: u32) -> u32 {
        self.run(op::LOAD, ty, &[variable])
    }

    pub(crate) fn component(&mut self, vector: u32, index: u32) -> u32 {
        let uint = self.types.uint;
        self.run(op::COMPOSITE_EXTRACT, uint, &[vector, index])
    }

    /// Two components of a vector, from one on.
    pub(crate) fn half(&mut self, vector: u32, first: u32) -> u32 {
        let ty = self.types.uints_2;
        self.run(op::VECTOR_SHUFFLE, ty, &[vector, vector, first, first + 1])
    }

    pub(crate) fn both(&mut self, value: u32) -> u32 {
        let ty = self.types.uints_2;
        self.run(op::COMPOSITE_CONSTRUCT, ty, &[value, value])
    }

    pub(crate) fn uint(&mut self, opcode: u32, a: u32, b: u32) -> u32 {
        let ty = self.types.uint;
        self.run(opcode, ty, &[a, b])
    }

    /// A `uvec4` of an array at an address, which is two components.
    pub(crate) fn row_at(&mut self, address: u32, index: u32) -> u32 {
        let (rows, row, value) = (self.types.rows, self.types.row, self.types.uints_4);
        let zero = self.constant(0);
        let pointer = self.run(op::BITCAST, rows, &[address]);
        let place = self.run(op::ACCESS_CHAIN, row, &[pointer, zero, index]);
        self.run(op::LOAD, value, &[place, 2, 16])
    }

    /// Stores a `uvec4` in an array at an address, which is two components.
    pub(crate) fn store_row(&mut self, address: u32, index: u32, value: u32) {
        let (rows, row) = (self.types.rows, self.types.row);
        let zero = self.constant(0);
        let pointer = self.run(op::BITCAST, rows, &[address]);
        let place = self.run(op::ACCESS_CHAIN, row, &[pointer, zero, index]);
        self.write(op::STORE, &[place, value, 2, 16]);
    }

    pub(crate) fn word_at(&mut self, address: u32, index: u32) -> u32 {
        let (words, word, value) = (self.types.words, self.types.word, self.types.uint);
        let zero = self.constant(0);
        let pointer = self.run(op::BITCAST, words, &[address]);
        let place = self.run(op::ACCESS_CHAIN, word, &[pointer, zero, index]);
        self.run(op::LOAD, value, &[place, 2, 4])
    }

    /// A vector where a condition holds, elsewhere zeros.
    pub(crate) fn only_where(&mut self, condition: u32, vector: u32) -> u32 {
        let (booleans, ty) = (self.types.booleans_4, self.types.uints_4);
        let zero = self.constant(0);
        let zeros = self.run(op::COMPOSITE_CONSTRUCT, ty, &[zero; 4]);
        let conditions = self.run(op::COMPOSITE_CONSTRUCT, booleans, &[condition; 4]);
        self.run(op::SELECT, ty, &[conditions, vector, zeros])
    }

    pub(crate) fn components(&mut self, vector: u32) -> Components {
        [0, 1, 2, 3].map(|index| self.component(vector, index))
    }

    /// A built-in or located variable of the new entry point.
    pub(crate) fn interface(&mut self, class: u32, ty: u32, decorations: &[&[u32]]) -> u32 {
        let pointer = self.module.type_of(op::TYPE_POINTER, &[class, ty]);
        let id = self.module.variable(pointer, class);
        for decoration in decorations {
            self.module.decorate(id, decoration);
        }
        id
    }

    /// The value of a type at a location. Gives the next location.
    pub(crate) fn value(&mut self, ty: u32, at: Slot, slots: &BTreeMap<u32, Components>) -> (u32, u32) {
        let known = self.module.known_types.get(&ty).cloned().unwrap_or(Type::Other);
        let zero = self.constant(0);
        let components = slots.get(&at.location).copied().unwrap_or([zero; 4]);
        let one = |index: u32| components.get(index as usize).copied().unwrap_or(zero);
        match known {
            Type::Number(32) => {
                let value = if ty == self.types.uint {
                    one(at.component)
                } else {
                    self.run(op::BITCAST, ty, &[one(at.component)])
                };
                (value, at.location.saturating_add(1))
            }
            Type::Vector(of, count) if matches!(self.module.known_types.get(&of), Some(Type::Number(32))) => {
                let parts: Vec<u32> = (0..count).map(|index| one(at.component + index)).collect();
                let uint = self.types.uint;
                let vector = self.module.type_of(op::TYPE_VECTOR, &[uint, count]);
                let bits = self.run(op::COMPOSITE_CONSTRUCT, vector, &parts);
                let value = if of == uint { bits } else { self.run(op::BITCAST, ty, &[bits]) };
                (value, at.location.saturating_add(1))
            }
            Type::Matrix(of, count) => self.composite(ty, &vec![of; count as usize], at, slots),
            Type::Array(of, count) => {
                let count = self.module.constants.get(&count).copied().unwrap_or(1).min(64);
                self.composite(ty, &vec![of; count as usize], at, slots)
            }
            Type::Structure(members) => self.composite(ty, &members, at, slots),
            _ => (self.nothing(ty), at.location.saturating_add(1)),
        }
    }

    fn composite(&mut self, ty: u32, parts: &[u32], at: Slot, slots: &BTreeMap<u32, Components>) -> (u32, u32) {
        let mut location = at.location;
        let mut values = Vec::new();
        for (index, part) in (0..).zip(parts) {
            location = self.module.decoration(ty, Some(index), LOCATION).unwrap_or(location);
            let component = self.module.decoration(ty, Some(index), COMPONENT).unwrap_or(at.component);
            let (value, next) = self.value(*part, Slot { location, component }, slots);
            values.push(value);
            location = next;
        }
        (self.run(op::COMPOSITE_CONSTRUCT, ty, &values), location)
    }

    /// Adds what a value has at its locations. Gives the next location.
    pub(crate) fn flatten(&mut self, value: u32, ty: u32, at: Slot, slots: &mut BTreeMap<u32, Components>) -> u32 {
        let known = self.module.known_types.get(&ty).cloned().unwrap_or(Type::Other);
        let (uint, zero) = (self.types.uint, self.constant(0));
        match known {
            Type::Number(32) => {
                let bits = if ty == uint { value } else { self.run(op::BITCAST, uint, &[value]) };
                if let Some(component) = slots.entry(at.location).or_insert([zero; 4]).get_mut(at.component as usize) {
                    *component = bits;
                }
                at.location.saturating_add(1)
            }
            Type::Vector(of, count) if matches!(self.module.known_types.get(&of), Some(Type::Number(32))) => {
                for index in 0..count {
                    let part = self.run(op::COMPOSITE_EXTRACT, of, &[value, index]);
                    self.flatten(part, of, Slot { component: at.component + index, ..at }, slots);
                }
                at.location.saturating_add(1)
            }
            Type::Matrix(of, count) => self.flatten_parts(value, ty, &vec![of; count as usize], at, slots),
            Type::Array(of, count) => {
                let count = self.module.constants.get(&count).copied().unwrap_or(1).min(64);
                self.flatten_parts(value, ty, &vec![of; count as usize], at, slots)
            }
            Type::Structure(members) => self.flatten_parts(value, ty, &members, at, slots),
            _ => at.location.saturating_add(1),
        }
    }

    fn flatten_parts(
        &mut self,
        value: u32,
        ty: u32,
        parts: &[u32],
        at: Slot,
        slots: &mut BTreeMap<u32, Components>,
    ) -> u32 {
        let mut location = at.location;
        for (index, part) in (0..).zip(parts) {
            location = self.module.decoration(ty, Some(index), LOCATION).unwrap_or(location);
            let component = self.module.decoration(ty, Some(index), COMPONENT).unwrap_or(at.component);
            let own = self.run(op::COMPOSITE_EXTRACT, *part, &[value, index]);
            location = self.flatten(own, *part, Slot { location, component }, slots);
        }
        location
    }

    /// The value of an integer that is built in: of the application's variable, if it has one.
    pub(crate) fn built_in(&mut self, built_in: u32) -> u32 {
        let uint = self.types.uint;
        let known = self.module.interface(INPUT);
        let own = known.into_iter().find(|(id, _)| self.module.decoration(*id, None, BUILT_IN) == Some(built_in));
        match own {
            Some((id, ty)) if ty == uint => self.load(uint, id),
            Some((id, ty)) => {
                let value = self.load(ty, id);
                self.run(op::BITCAST, uint, &[value])
            }
            None => {
                let id = self.interface(INPUT, uint, &[&[BUILT_IN, built_in]]);
                self.load(uint, id)
            }
        }
    }

    /// Zeros of a type.
    pub(crate) fn nothing(&mut self, ty: u32) -> u32 {
        let id = self.module.id();
        self.module.types.push(assembled(op::CONSTANT_NULL, &[ty, id]));
        id
    }
}

/// A location and a component.
#[derive(Clone, Copy)]
pub(crate) struct Slot {
    pub(crate) location: u32,
    pub(crate) component: u32,
}
