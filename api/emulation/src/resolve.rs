//! Resolve shaders: the application's fragment shaders, whose inputs are loaded from what a set has made. The SPIR-V is rewritten: inputs
//! become private variables, and a new entry point fills them in and calls the application's.

use std::collections::{BTreeMap, BTreeSet};
use std::ffi::CStr;

use gaurast::vk::GaussianResolveInputLocationsGAURAST as Locations;

use crate::made::Covering;

/// Opcodes of SPIR-V.
mod op {
    use spirv::Op;

    pub(super) const SOURCE_CONTINUED: u32 = Op::SourceContinued as u32;
    pub(super) const STRING: u32 = Op::String as u32;
    pub(super) const MODULE_PROCESSED: u32 = Op::ModuleProcessed as u32;
    pub(super) const DECORATE_ID: u32 = Op::DecorateId as u32;
    pub(super) const DECORATE_STRING: u32 = Op::DecorateString as u32;
    pub(super) const MEMBER_DECORATE_STRING: u32 = Op::MemberDecorateString as u32;
    pub(super) const EXTENSION: u32 = Op::Extension as u32;
    pub(super) const EXT_INST_IMPORT: u32 = Op::ExtInstImport as u32;
    pub(super) const EXT_INST: u32 = Op::ExtInst as u32;
    pub(super) const MEMORY_MODEL: u32 = Op::MemoryModel as u32;
    pub(super) const ENTRY_POINT: u32 = Op::EntryPoint as u32;
    pub(super) const EXECUTION_MODE: u32 = Op::ExecutionMode as u32;
    pub(super) const CAPABILITY: u32 = Op::Capability as u32;
    pub(super) const TYPE_BOOL: u32 = Op::TypeBool as u32;
    pub(super) const TYPE_INT: u32 = Op::TypeInt as u32;
    pub(super) const TYPE_FLOAT: u32 = Op::TypeFloat as u32;
    pub(super) const TYPE_VECTOR: u32 = Op::TypeVector as u32;
    pub(super) const TYPE_MATRIX: u32 = Op::TypeMatrix as u32;
    pub(super) const TYPE_ARRAY: u32 = Op::TypeArray as u32;
    pub(super) const TYPE_RUNTIME_ARRAY: u32 = Op::TypeRuntimeArray as u32;
    pub(super) const TYPE_STRUCT: u32 = Op::TypeStruct as u32;
    pub(super) const TYPE_POINTER: u32 = Op::TypePointer as u32;
    pub(super) const CONSTANT: u32 = Op::Constant as u32;
    pub(super) const CONSTANT_NULL: u32 = Op::ConstantNull as u32;
    pub(super) const SPEC_CONSTANT: u32 = Op::SpecConstant as u32;
    pub(super) const FUNCTION: u32 = Op::Function as u32;
    pub(super) const FUNCTION_END: u32 = Op::FunctionEnd as u32;
    pub(super) const FUNCTION_CALL: u32 = Op::FunctionCall as u32;
    pub(super) const VARIABLE: u32 = Op::Variable as u32;
    pub(super) const LOAD: u32 = Op::Load as u32;
    pub(super) const STORE: u32 = Op::Store as u32;
    pub(super) const ACCESS_CHAIN: u32 = Op::AccessChain as u32;
    pub(super) const IN_BOUNDS_ACCESS_CHAIN: u32 = Op::InBoundsAccessChain as u32;
    pub(super) const DECORATE: u32 = Op::Decorate as u32;
    pub(super) const MEMBER_DECORATE: u32 = Op::MemberDecorate as u32;
    pub(super) const GROUP_DECORATE: u32 = Op::GroupDecorate as u32;
    pub(super) const GROUP_MEMBER_DECORATE: u32 = Op::GroupMemberDecorate as u32;
    pub(super) const VECTOR_SHUFFLE: u32 = Op::VectorShuffle as u32;
    pub(super) const COMPOSITE_CONSTRUCT: u32 = Op::CompositeConstruct as u32;
    pub(super) const COMPOSITE_EXTRACT: u32 = Op::CompositeExtract as u32;
    pub(super) const COPY_OBJECT: u32 = Op::CopyObject as u32;
    pub(super) const CONVERT_F_TO_U: u32 = Op::ConvertFToU as u32;
    pub(super) const BITCAST: u32 = Op::Bitcast as u32;
    pub(super) const I_ADD: u32 = Op::IAdd as u32;
    pub(super) const I_SUB: u32 = Op::ISub as u32;
    pub(super) const I_MUL: u32 = Op::IMul as u32;
    pub(super) const ALL: u32 = Op::All as u32;
    pub(super) const LOGICAL_OR: u32 = Op::LogicalOr as u32;
    pub(super) const LOGICAL_AND: u32 = Op::LogicalAnd as u32;
    pub(super) const LOGICAL_NOT: u32 = Op::LogicalNot as u32;
    pub(super) const SELECT: u32 = Op::Select as u32;
    pub(super) const I_EQUAL: u32 = Op::IEqual as u32;
    pub(super) const I_NOT_EQUAL: u32 = Op::INotEqual as u32;
    pub(super) const U_LESS_THAN: u32 = Op::ULessThan as u32;
    pub(super) const F_ORD_GREATER_THAN_EQUAL: u32 = Op::FOrdGreaterThanEqual as u32;
    pub(super) const SHIFT_RIGHT_LOGICAL: u32 = Op::ShiftRightLogical as u32;
    pub(super) const SHIFT_LEFT_LOGICAL: u32 = Op::ShiftLeftLogical as u32;
    pub(super) const BITWISE_OR: u32 = Op::BitwiseOr as u32;
    pub(super) const BITWISE_AND: u32 = Op::BitwiseAnd as u32;
    pub(super) const SELECTION_MERGE: u32 = Op::SelectionMerge as u32;
    pub(super) const LABEL: u32 = Op::Label as u32;
    pub(super) const BRANCH: u32 = Op::Branch as u32;
    pub(super) const BRANCH_CONDITIONAL: u32 = Op::BranchConditional as u32;
    pub(super) const RETURN: u32 = Op::Return as u32;
    pub(super) const EXECUTION_MODE_ID: u32 = Op::ExecutionModeId as u32;
    pub(super) const DEMOTE_TO_HELPER_INVOCATION: u32 = Op::DemoteToHelperInvocation as u32;
}

/// Storage classes.
const INPUT: u32 = spirv::StorageClass::Input as u32;
const OUTPUT: u32 = spirv::StorageClass::Output as u32;
const PRIVATE: u32 = spirv::StorageClass::Private as u32;
const PHYSICAL_STORAGE_BUFFER: u32 = spirv::StorageClass::PhysicalStorageBuffer as u32;

/// Decorations.
const BLOCK: u32 = spirv::Decoration::Block as u32;
const ARRAY_STRIDE: u32 = spirv::Decoration::ArrayStride as u32;
const BUILT_IN: u32 = spirv::Decoration::BuiltIn as u32;
const FLAT: u32 = spirv::Decoration::Flat as u32;
const NON_WRITABLE: u32 = spirv::Decoration::NonWritable as u32;
const LOCATION: u32 = spirv::Decoration::Location as u32;
const COMPONENT: u32 = spirv::Decoration::Component as u32;
const OFFSET: u32 = spirv::Decoration::Offset as u32;
/// Decorations of a variable of an interface.
const OF_INTERFACES: [u32; 7] = [
    BUILT_IN,
    spirv::Decoration::NoPerspective as u32,
    FLAT,
    spirv::Decoration::Centroid as u32,
    spirv::Decoration::Sample as u32,
    LOCATION,
    COMPONENT,
];

/// Built-ins.
const PRIMITIVE_ID: u32 = spirv::BuiltIn::PrimitiveId as u32;
const LAYER: u32 = spirv::BuiltIn::Layer as u32;
const VIEWPORT_INDEX: u32 = spirv::BuiltIn::ViewportIndex as u32;
const FRAG_COORD: u32 = spirv::BuiltIn::FragCoord as u32;
const POINT_COORD: u32 = spirv::BuiltIn::PointCoord as u32;
const FRONT_FACING: u32 = spirv::BuiltIn::FrontFacing as u32;
const SAMPLE_ID: u32 = spirv::BuiltIn::SampleId as u32;
const SAMPLE_POSITION: u32 = spirv::BuiltIn::SamplePosition as u32;
const SAMPLE_MASK: u32 = spirv::BuiltIn::SampleMask as u32;
const FRAG_DEPTH: u32 = spirv::BuiltIn::FragDepth as u32;
const HELPER_INVOCATION: u32 = spirv::BuiltIn::HelperInvocation as u32;
const VIEW_INDEX: u32 = spirv::BuiltIn::ViewIndex as u32;

/// Execution modes.
const EARLY_FRAGMENT_TESTS: u32 = spirv::ExecutionMode::EarlyFragmentTests as u32;
const DEPTH_REPLACING: u32 = spirv::ExecutionMode::DepthReplacing as u32;
/// Execution modes that bound the change of a depth.
const DEPTH_MODES: [u32; 3] = [
    spirv::ExecutionMode::DepthGreater as u32,
    spirv::ExecutionMode::DepthLess as u32,
    spirv::ExecutionMode::DepthUnchanged as u32,
];

/// Opcodes that read the pixels beside: derivatives, implicit levels of detail, and exchanges within quads.
const BESIDE: [std::ops::RangeInclusive<u32>; 4] = [
    spirv::Op::DPdx as u32..=spirv::Op::FwidthCoarse as u32,
    spirv::Op::ImageSampleImplicitLod as u32..=spirv::Op::ImageDrefGather as u32,
    spirv::Op::ImageSparseSampleImplicitLod as u32..=spirv::Op::ImageSparseDrefGather as u32,
    spirv::Op::GroupNonUniformQuadBroadcast as u32..=spirv::Op::GroupNonUniformQuadSwap as u32,
];

/// The execution model of fragment shaders.
const FRAGMENT: u32 = spirv::ExecutionModel::Fragment as u32;

/// A fragment shader, and what its pipeline does.
pub(crate) struct Request<'a> {
    pub(crate) words: &'a [u32],
    pub(crate) entry: &'a CStr,
    pub(crate) locations: Locations,
    /// Depths or stencils may be tested.
    pub(crate) may_be_tested: bool,
    /// Rasterization samples.
    pub(crate) samples: u32,
    /// Sample shading is enabled.
    pub(crate) is_sample_shaded: bool,
}

/// A fragment shader that loads its inputs.
pub(crate) struct Rewritten {
    pub(crate) words: Vec<u32>,
    /// True if it reads depths or Gaussians.
    pub(crate) has_inputs: bool,
    pub(crate) has_camera: bool,
    /// True if it runs for each sample.
    pub(crate) is_sample_shaded: bool,
    pub(crate) covering: Covering,
}

/// Reports whether a module has a fragment shader.
pub(crate) fn has_fragment_shader(words: &[u32]) -> bool {
    instructions(words)
        .any(|instruction| opcode(instruction) == op::ENTRY_POINT && instruction.get(1) == Some(&FRAGMENT))
}

fn opcode(instruction: &[u32]) -> u32 {
    instruction.first().map_or(0, |word| word & 0xFFFF)
}

/// The instructions of a module. What is not whole ends them.
fn instructions(words: &[u32]) -> impl Iterator<Item = &[u32]> {
    let mut rest = words.get(5..).unwrap_or_default();
    std::iter::from_fn(move || {
        let length = (rest.first()? >> 16) as usize;
        let (instruction, after) = rest.split_at_checked(length).filter(|_| length > 0)?;
        rest = after;
        Some(instruction)
    })
}

/// The words of a string, with its end.
fn literal(text: &str) -> Vec<u32> {
    let mut bytes = text.as_bytes().to_vec();
    bytes.resize(text.len() / 4 * 4 + 4, 0);
    bytes.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect()
}

/// The number of words of a literal string at the beginning of others, if those are the string.
fn literal_length(words: &[u32], text: &[u8]) -> Option<usize> {
    let bytes: Vec<u8> = words.iter().take(text.len() / 4 + 1).flat_map(|word| word.to_le_bytes()).collect();
    let is_it = bytes.get(..text.len()) == Some(text) && bytes.get(text.len()) == Some(&0);
    is_it.then_some(text.len() / 4 + 1)
}

/// A type, as far as inputs have it.
#[derive(Clone, Debug)]
enum Type {
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
type Components = [u32; 4];

/// A module that is being rewritten, by its sections.
struct Module {
    version: u32,
    generator: u32,
    bound: u32,
    capabilities: Vec<Vec<u32>>,
    extensions: Vec<Vec<u32>>,
    imports: Vec<Vec<u32>>,
    memory_model: Vec<u32>,
    entry: Vec<u32>,
    modes: Vec<Vec<u32>>,
    debug: Vec<Vec<u32>>,
    annotations: Vec<Vec<u32>>,
    types: Vec<Vec<u32>>,
    functions: Vec<Vec<u32>>,
    known_types: BTreeMap<u32, Type>,
    /// 32-bit constants.
    constants: BTreeMap<u32, u32>,
}

impl Module {
    fn read(words: &[u32], name: &CStr) -> Result<Self, String> {
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
            own.take(instruction, name);
        }
        let [_, _, function, ..] = own.entry[..] else {
            return Err(format!("the resolve shader's module has no entry point {}", name.to_string_lossy()));
        };
        own.modes.retain(|mode| mode.get(1) == Some(&function));
        if own.memory_model.len() != 3 {
            return Err("the resolve shader's module has no memory model".to_owned());
        }
        Ok(own)
    }

    fn take(&mut self, instruction: &[u32], name: &CStr) {
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
                let is_it = instruction.get(1) == Some(&FRAGMENT)
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

    fn id(&mut self) -> u32 {
        self.bound += 1;
        self.bound - 1
    }

    /// The id of a type, which is added if it is not there.
    fn type_of(&mut self, opcode_: u32, operands: &[u32]) -> u32 {
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
    fn new_type(&mut self, opcode_: u32, operands: &[u32]) -> u32 {
        let id = self.id();
        let mut words = vec![id];
        words.extend_from_slice(operands);
        self.types.push(assembled(opcode_, &words));
        id
    }

    fn variable(&mut self, pointer: u32, class: u32) -> u32 {
        let id = self.id();
        self.types.push(assembled(op::VARIABLE, &[pointer, id, class]));
        self.entry.push(id);
        id
    }

    fn decorate(&mut self, id: u32, decoration: &[u32]) {
        let mut words = vec![id];
        words.extend_from_slice(decoration);
        self.annotations.push(assembled(op::DECORATE, &words));
    }

    fn need(&mut self, capability: u32) {
        if !self.capabilities.iter().any(|known| known.get(1) == Some(&capability)) {
            self.capabilities.push(assembled(op::CAPABILITY, &[capability]));
        }
    }

    fn need_extension(&mut self, name: &str) {
        let words = assembled(op::EXTENSION, &literal(name));
        if !self.extensions.contains(&words) {
            self.extensions.push(words);
        }
    }

    /// A decoration of an id, or of a structure's member.
    fn decoration(&self, id: u32, member: Option<u32>, decoration: u32) -> Option<u32> {
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
    fn interface(&self, class: u32) -> Vec<(u32, u32)> {
        let listed: BTreeSet<u32> = self.entry.get(self.names_end()..).unwrap_or_default().iter().copied().collect();
        let variables = self.types.iter().filter(|known| opcode(known) == op::VARIABLE);
        let own = variables.filter(|known| listed.contains(&known[2]) && known[3] == class);
        own.filter_map(|known| Some((known[2], self.pointee(known[1])?))).collect()
    }

    fn pointee(&self, pointer: u32) -> Option<u32> {
        let mut types = self.types.iter().filter(|known| opcode(known) == op::TYPE_POINTER);
        types.find(|known| known[1] == pointer).map(|known| known[3])
    }

    /// The place in the entry point's words at which its variables begin.
    fn names_end(&self) -> usize {
        let name = self.entry.get(3..).unwrap_or_default();
        3 + name.iter().position(|word| word.to_le_bytes().contains(&0)).map_or(name.len(), |at| at + 1)
    }

    /// Removes what decorates a structure as one of an interface.
    fn strip(&mut self, ty: u32) {
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

    fn words(mut self) -> Vec<u32> {
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
fn assembled(opcode: u32, operands: &[u32]) -> Vec<u32> {
    let mut words = vec![(operands.len() as u32 + 1) << 16 | opcode];
    words.extend_from_slice(operands);
    words
}

/// An input that becomes a private variable.
struct Input {
    id: u32,
    ty: u32,
    meaning: Meaning,
}

/// The meaning of an input.
#[derive(Clone, Copy)]
enum Meaning {
    /// At a location and a component; `None` where members have locations of their own.
    Located(Option<u32>, u32),
    BuiltIn(u32),
}

/// The inputs of a module, and what they need.
struct Inputs {
    all: Vec<Input>,
    has_inputs: bool,
    has_camera: bool,
    reads_samples: bool,
    /// The application's variable of the sample's number.
    sample_id: Option<u32>,
}

/// The locations of the camera.
fn camera_locations(locations: &Locations) -> std::ops::Range<u32> {
    let first = locations.first_camera;
    first..first.saturating_add(6)
}

impl Inputs {
    fn of(module: &Module, locations: &Locations) -> Self {
        let mut own =
            Self { all: Vec::new(), has_inputs: false, has_camera: false, reads_samples: false, sample_id: None };
        for (id, ty) in module.interface(INPUT) {
            if let Some(built_in) = module.decoration(id, None, BUILT_IN) {
                if [SAMPLE_ID, SAMPLE_POSITION].contains(&built_in) {
                    own.reads_samples = true;
                }
                if built_in == SAMPLE_ID {
                    own.sample_id = Some(id);
                }
                let is_made = [
                    PRIMITIVE_ID,
                    LAYER,
                    VIEWPORT_INDEX,
                    FRAG_COORD,
                    POINT_COORD,
                    FRONT_FACING,
                    SAMPLE_MASK,
                    HELPER_INVOCATION,
                    VIEW_INDEX,
                ];
                if is_made.contains(&built_in) {
                    // The depth of a fragment is the median's.
                    own.has_inputs |= built_in == FRAG_COORD;
                    own.all.push(Input { id, ty, meaning: Meaning::BuiltIn(built_in) });
                }
                continue;
            }
            let location = module.decoration(id, None, LOCATION);
            let component = module.decoration(id, None, COMPONENT).unwrap_or(0);
            own.all.push(Input { id, ty, meaning: Meaning::Located(location, component) });
        }
        let of_sets = [locations.depth, locations.linear_depth, locations.median_gaussian, locations.nearest_gaussian];
        for input in &own.all {
            if let Meaning::Located(location, _) = input.meaning {
                let mut slots = BTreeSet::new();
                locations_of(module, input.ty, location.unwrap_or(0), &mut slots);
                own.has_inputs |= of_sets.iter().any(|one| slots.contains(one));
                own.has_camera |= camera_locations(locations).any(|one| slots.contains(&one));
            }
        }
        own
    }
}

/// Adds the locations of a type; gives the next one.
fn locations_of(module: &Module, ty: u32, location: u32, slots: &mut BTreeSet<u32>) -> u32 {
    match module.known_types.get(&ty) {
        Some(Type::Matrix(of, count)) => (0..*count).fold(location, |at, _| locations_of(module, *of, at, slots)),
        Some(Type::Array(of, count)) => {
            let count = module.constants.get(count).copied().unwrap_or(1).min(64);
            (0..count).fold(location, |at, _| locations_of(module, *of, at, slots))
        }
        Some(Type::Structure(members)) => (0..).zip(members).fold(location, |at, (index, member)| {
            let at = module.decoration(ty, Some(index), LOCATION).unwrap_or(at);
            locations_of(module, *member, at, slots)
        }),
        _ => {
            slots.insert(location);
            location.saturating_add(1)
        }
    }
}

/// The types that the new entry point uses.
struct Types {
    void: u32,
    function: u32,
    boolean: u32,
    booleans_2: u32,
    booleans_4: u32,
    uint: u32,
    uints_2: u32,
    uints_4: u32,
    float: u32,
    floats_4: u32,
    /// Addresses of `uvec4` and of `uint`, and of arrays of these.
    rows: u32,
    row: u32,
    words: u32,
    word: u32,
}

impl Types {
    fn new(module: &mut Module) -> Self {
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
            for decoration in [&[0, OFFSET, 0][..], &[0, NON_WRITABLE]] {
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
struct Body<'a> {
    module: &'a mut Module,
    types: Types,
    code: Vec<Vec<u32>>,
    made: BTreeMap<u32, u32>,
}

impl Body<'_> {
    /// The id of a constant.
    fn constant(&mut self, value: u32) -> u32 {
        if let Some(id) = self.made.get(&value) {
            return *id;
        }
        let id = self.module.id();
        self.module.types.push(assembled(op::CONSTANT, &[self.types.uint, id, value]));
        self.made.insert(value, id);
        id
    }

    /// An instruction with a result.
    fn run(&mut self, opcode: u32, ty: u32, operands: &[u32]) -> u32 {
        let id = self.module.id();
        let mut words = vec![ty, id];
        words.extend_from_slice(operands);
        self.code.push(assembled(opcode, &words));
        id
    }

    fn write(&mut self, opcode: u32, operands: &[u32]) {
        self.code.push(assembled(opcode, operands));
    }

    fn load(&mut self, ty: u32, variable: u32) -> u32 {
        self.run(op::LOAD, ty, &[variable])
    }

    fn component(&mut self, vector: u32, index: u32) -> u32 {
        let uint = self.types.uint;
        self.run(op::COMPOSITE_EXTRACT, uint, &[vector, index])
    }

    /// Two components of a vector, from one on.
    fn half(&mut self, vector: u32, first: u32) -> u32 {
        let ty = self.types.uints_2;
        self.run(op::VECTOR_SHUFFLE, ty, &[vector, vector, first, first + 1])
    }

    fn both(&mut self, value: u32) -> u32 {
        let ty = self.types.uints_2;
        self.run(op::COMPOSITE_CONSTRUCT, ty, &[value, value])
    }

    fn uint(&mut self, opcode: u32, a: u32, b: u32) -> u32 {
        let ty = self.types.uint;
        self.run(opcode, ty, &[a, b])
    }

    /// A `uvec4` of an array at an address, which is two components.
    fn row_at(&mut self, address: u32, index: u32) -> u32 {
        let (rows, row, value) = (self.types.rows, self.types.row, self.types.uints_4);
        let zero = self.constant(0);
        let pointer = self.run(op::BITCAST, rows, &[address]);
        let place = self.run(op::ACCESS_CHAIN, row, &[pointer, zero, index]);
        self.run(op::LOAD, value, &[place, 2, 16])
    }

    fn word_at(&mut self, address: u32, index: u32) -> u32 {
        let (words, word, value) = (self.types.words, self.types.word, self.types.uint);
        let zero = self.constant(0);
        let pointer = self.run(op::BITCAST, words, &[address]);
        let place = self.run(op::ACCESS_CHAIN, word, &[pointer, zero, index]);
        self.run(op::LOAD, value, &[place, 2, 4])
    }

    /// A vector where a condition holds, elsewhere zeros.
    fn only_where(&mut self, condition: u32, vector: u32) -> u32 {
        let (booleans, ty) = (self.types.booleans_4, self.types.uints_4);
        let zero = self.constant(0);
        let zeros = self.run(op::COMPOSITE_CONSTRUCT, ty, &[zero; 4]);
        let conditions = self.run(op::COMPOSITE_CONSTRUCT, booleans, &[condition; 4]);
        self.run(op::SELECT, ty, &[conditions, vector, zeros])
    }

    fn components(&mut self, vector: u32) -> Components {
        [0, 1, 2, 3].map(|index| self.component(vector, index))
    }

    /// A built-in or located variable of the new entry point.
    fn interface(&mut self, class: u32, ty: u32, decorations: &[&[u32]]) -> u32 {
        let pointer = self.module.type_of(op::TYPE_POINTER, &[class, ty]);
        let id = self.module.variable(pointer, class);
        for decoration in decorations {
            self.module.decorate(id, decoration);
        }
        id
    }

    /// The value of a type at a location. Gives the next location.
    fn value(&mut self, ty: u32, at: Slot, slots: &BTreeMap<u32, Components>) -> (u32, u32) {
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

    /// Zeros of a type.
    fn nothing(&mut self, ty: u32) -> u32 {
        let id = self.module.id();
        self.module.types.push(assembled(op::CONSTANT_NULL, &[ty, id]));
        id
    }
}

/// A location and a component.
#[derive(Clone, Copy)]
struct Slot {
    location: u32,
    component: u32,
}

/// Makes inputs private: their types, their variables, and all that points at them.
fn make_private(module: &mut Module, inputs: &[Input]) -> Result<(), String> {
    let mut private: BTreeSet<u32> = inputs.iter().map(|input| input.id).collect();
    let of_groups = [op::GROUP_DECORATE, op::GROUP_MEMBER_DECORATE];
    if module.annotations.iter().any(|known| of_groups.contains(&opcode(known))) {
        return Err("the resolve shader has groups of decorations, which are not emulated".to_owned());
    }
    module.annotations.retain(|known| {
        let is_of_interface = known.get(2).is_some_and(|decoration| OF_INTERFACES.contains(decoration));
        !(opcode(known) == op::DECORATE && private.contains(&known[1]) && is_of_interface)
    });
    // A pointer to private memory follows each to inputs.
    let mut pointers = BTreeMap::new();
    let mut types = Vec::new();
    for mut known in std::mem::take(&mut module.types) {
        match opcode(&known) {
            op::TYPE_POINTER if known[2] == INPUT => {
                let id = module.id();
                pointers.insert(known[1], id);
                let added = assembled(op::TYPE_POINTER, &[id, PRIVATE, known[3]]);
                types.extend([known, added]);
                continue;
            }
            op::VARIABLE if private.contains(&known[2]) => {
                known[1] = pointers.get(&known[1]).copied().unwrap_or(known[1]);
                known[3] = PRIVATE;
            }
            _ => {}
        }
        types.push(known);
    }
    module.types = types;
    for known in &mut module.functions {
        match opcode(known) {
            op::ACCESS_CHAIN | op::IN_BOUNDS_ACCESS_CHAIN | op::COPY_OBJECT if private.contains(&known[3]) => {
                known[1] = pointers.get(&known[1]).copied().unwrap_or(known[1]);
                private.insert(known[2]);
            }
            // Interpolation has no effect.
            op::EXT_INST if (76..=78).contains(&known[4]) && known.get(5).is_some_and(|of| private.contains(of)) => {
                *known = assembled(op::LOAD, &[known[1], known[2], known[5]]);
            }
            op::FUNCTION_CALL if known[4..].iter().any(|argument| private.contains(argument)) => {
                return Err(
                    "the resolve shader gives a function the address of an input, which is not emulated".to_owned()
                );
            }
            _ => {}
        }
    }
    // From version 1.4 on, the entry point lists all variables, before that inputs and outputs alone.
    if module.version < 0x0001_0400 {
        let begin = module.names_end();
        let own: BTreeSet<u32> = inputs.iter().map(|input| input.id).collect();
        let kept = module.entry.split_off(begin);
        module.entry.extend(kept.into_iter().filter(|id| !own.contains(id)));
    }
    Ok(())
}

/// Rewrites a fragment shader so that it loads what it reads of a set from the addresses that `shaders/tiles.vert` passes on.
///
/// # Errors
/// A sentence that says what is not emulated.
pub(crate) fn rewrite(request: &Request<'_>) -> Result<Rewritten, String> {
    let mut module = Module::read(request.words, request.entry)?;
    let mut inputs = Inputs::of(&module, &request.locations);
    let is_early = module.modes.iter().any(|mode| mode.get(2) == Some(&EARLY_FRAGMENT_TESTS));
    if is_early && request.may_be_tested {
        return Err(
            "a resolve shader has early fragment tests of depths or stencils, which are not emulated".to_owned()
        );
    }
    let has_derivatives = module.functions.iter().any(|known| BESIDE.iter().any(|ops| ops.contains(&opcode(known))));
    let outputs = module.interface(OUTPUT);
    let output = |module: &Module, wanted: u32| {
        outputs.iter().find(|(id, _)| module.decoration(*id, None, BUILT_IN) == Some(wanted)).copied()
    };
    if output(&module, FRAG_DEPTH).is_some() {
        return Err("a resolve shader writes FragDepth".to_owned());
    }
    let written_mask = output(&module, SAMPLE_MASK);
    inputs.has_inputs |= request.may_be_tested;
    let is_sample_shaded = request.is_sample_shaded || inputs.reads_samples;
    let tells_samples = request.may_be_tested && request.samples > 1;
    make_private(&mut module, &inputs.all)?;
    if module.memory_model[1] == 0 {
        module.memory_model[1] = spirv::AddressingModel::PhysicalStorageBuffer64 as u32;
    }
    // PhysicalStorageBufferAddresses, DemoteToHelperInvocation.
    module.need(5347);
    module.need(5379);
    module.need_extension("SPV_KHR_physical_storage_buffer");
    module.need_extension("SPV_EXT_demote_to_helper_invocation");

    let types = Types::new(&mut module);
    let original = module.entry[2];
    let entry = module.id();
    module.entry[2] = entry;
    for mode in &mut module.modes {
        mode[1] = entry;
    }
    if request.may_be_tested {
        module.modes.retain(|mode| mode.get(2).is_none_or(|mode| !DEPTH_MODES.contains(mode)));
        module.modes.push(assembled(op::EXECUTION_MODE, &[entry, DEPTH_REPLACING]));
    }

    let mut body = Body { module: &mut module, types, code: Vec::new(), made: BTreeMap::new() };
    let label = body.module.id();
    let (void, function) = (body.types.void, body.types.function);
    body.write(op::FUNCTION, &[void, entry, 0, function]);
    body.write(op::LABEL, &[label]);
    let fragment = Fragment::load(&mut body, request, &inputs, is_sample_shaded && tells_samples);
    fragment.demote(&mut body);
    fragment.fill(&mut body, request, &inputs);
    if request.may_be_tested {
        let float = body.types.float;
        let depth = body.interface(OUTPUT, float, &[&[BUILT_IN, FRAG_DEPTH]]);
        body.write(op::STORE, &[depth, fragment.median_depth]);
    }
    let called = body.module.id();
    body.write(op::FUNCTION_CALL, &[void, called, original]);
    if let Some(mask) = fragment.mask {
        fragment.write_mask(&mut body, mask, written_mask);
    }
    body.write(op::RETURN, &[]);
    body.write(op::FUNCTION_END, &[]);
    let code = body.code;
    module.functions.extend(code);
    for input in &inputs.all {
        module.strip(input.ty);
    }
    Ok(Rewritten {
        words: module.words(),
        has_inputs: inputs.has_inputs,
        has_camera: inputs.has_camera,
        is_sample_shaded,
        covering: match (is_early, has_derivatives || request.samples > 1) {
            // What it discards has been counted.
            (true, _) => Covering::Pixels,
            (false, true) => Covering::Triangle,
            (false, false) => Covering::Quads,
        },
    })
}

/// The ids of what an invocation has loaded.
struct Fragment {
    /// The fragment's place in the results.
    place: u32,
    view: u32,
    /// The condition that the invocation has a fragment to make.
    runs: u32,
    color: u32,
    /// Depths and linear depths, and Gaussians.
    depths: u32,
    gaussians: u32,
    /// A float.
    median_depth: u32,
    camera: Vec<u32>,
    /// The samples that have the fragment, where samples are told apart.
    mask: Option<u32>,
}

impl Fragment {
    /// Loads what an invocation reads.
    fn load(body: &mut Body<'_>, request: &Request<'_>, inputs: &Inputs, is_by_sample: bool) -> Self {
        let (uint, uints_2, uints_4) = (body.types.uint, body.types.uints_2, body.types.uints_4);
        let (boolean, booleans_2, booleans_4) = (body.types.boolean, body.types.booleans_2, body.types.booleans_4);
        let (float, floats_4) = (body.types.float, body.types.floats_4);
        let passed: [u32; 4] = [0, 1, 2, 3].map(|location| {
            let variable = body.interface(INPUT, uints_4, &[&[LOCATION, location], &[FLAT]]);
            body.load(uints_4, variable)
        });
        let coordinate = body.interface(INPUT, floats_4, &[&[BUILT_IN, FRAG_COORD]]);
        let place = body.load(floats_4, coordinate);
        let (image, shown) = (body.half(passed[0], 0), body.half(passed[0], 2));
        let (made, cameras) = (body.half(passed[1], 0), body.half(passed[1], 2));
        let (origin, size) = (body.half(passed[2], 0), body.half(passed[2], 2));
        let [samples, mut sample, view, own_tile] = body.components(passed[3]);

        // The pixel, or another one of the area for those that lie beside it.
        let whole = body.run(op::CONVERT_F_TO_U, uints_4, &[place]);
        let whole = body.half(whole, 0);
        let at = body.run(op::I_SUB, uints_2, &[whole, origin]);
        let are_inside = body.run(op::U_LESS_THAN, booleans_2, &[at, size]);
        let is_inside = body.run(op::ALL, boolean, &[are_inside]);
        let zero = body.constant(0);
        let zeros = body.both(zero);
        let at = body.run(op::SELECT, uints_2, &[are_inside, at, zeros]);
        let (x, y, width, height) =
            (body.component(at, 0), body.component(at, 1), body.component(size, 0), body.component(size, 1));
        let (four, fifteen) = (body.constant(4), body.constant(15));
        let along = |body: &mut Body<'_>, length: u32| {
            let more = body.uint(op::I_ADD, length, fifteen);
            body.uint(op::SHIFT_RIGHT_LOGICAL, more, four)
        };
        let (across, down) = (along(body, width), along(body, height));
        let (tile_x, tile_y) =
            (body.uint(op::SHIFT_RIGHT_LOGICAL, x, four), body.uint(op::SHIFT_RIGHT_LOGICAL, y, four));
        let row = body.uint(op::I_MUL, view, down);
        let row = body.uint(op::I_ADD, row, tile_y);
        let row = body.uint(op::I_MUL, row, across);
        let tile = body.uint(op::I_ADD, row, tile_x);
        let word = body.word_at(shown, tile);
        let is_shown = body.run(op::I_NOT_EQUAL, boolean, &[word, zero]);

        let one = body.constant(1);
        let last = body.uint(op::I_SUB, samples, one);
        if is_by_sample {
            body.module.need(35);
            let id = match inputs.sample_id {
                Some(id) => {
                    let ty = body.module.types.iter().find(|known| opcode(known) == op::VARIABLE && known[2] == id);
                    let ty = ty.and_then(|known| body.module.pointee(known[1])).unwrap_or(uint);
                    let value = body.load(ty, id);
                    if ty == uint { value } else { body.run(op::BITCAST, uint, &[value]) }
                }
                None => {
                    let id = body.interface(INPUT, uint, &[&[BUILT_IN, SAMPLE_ID], &[FLAT]]);
                    body.load(uint, id)
                }
            };
            let is_less = body.run(op::U_LESS_THAN, boolean, &[id, last]);
            sample = body.run(op::SELECT, uint, &[is_less, id, last]);
        }
        let first_plane = body.uint(op::I_MUL, view, samples);
        let pixel = |body: &mut Body<'_>, sample: u32| {
            let plane = body.uint(op::I_ADD, first_plane, sample);
            let row = body.uint(op::I_MUL, plane, height);
            let row = body.uint(op::I_ADD, row, y);
            let row = body.uint(op::I_MUL, row, width);
            body.uint(op::I_ADD, row, x)
        };
        let has_inputs = inputs.has_inputs;
        let record = |body: &mut Body<'_>, sample: u32| {
            let pixel = pixel(body, sample);
            let mut rows = vec![body.row_at(image, pixel)];
            if has_inputs {
                let first = body.uint(op::SHIFT_LEFT_LOGICAL, pixel, one);
                let second = body.uint(op::I_ADD, first, one);
                rows.extend([body.row_at(made, first), body.row_at(made, second)]);
            }
            rows
        };
        let own = record(body, sample);
        let alpha = body.component(own[0], 3);
        let alpha = body.run(op::BITCAST, float, &[alpha]);
        let nothing = body.run(op::BITCAST, float, &[zero]);
        let has_color = body.run(op::F_ORD_GREATER_THAN_EQUAL, boolean, &[alpha, nothing]);
        let is_there = body.run(op::LOGICAL_AND, boolean, &[is_inside, is_shown]);
        let is_there = body.run(op::LOGICAL_AND, boolean, &[is_there, has_color]);
        let is_own = body.run(op::I_EQUAL, boolean, &[tile, own_tile]);
        let mut runs = body.run(op::LOGICAL_AND, boolean, &[is_there, is_own]);
        let mut mask = None;
        if request.may_be_tested && request.samples > 1 && !is_by_sample {
            // The first of the samples that have the same runs for them.
            let mut all = zero;
            for index in 0..request.samples {
                let other = body.constant(index);
                let is_less = body.run(op::U_LESS_THAN, boolean, &[other, last]);
                let other = body.run(op::SELECT, uint, &[is_less, other, last]);
                let rows = record(body, other);
                let mut bit = body.constant(1 << index);
                for (a, b) in own.iter().zip(rows) {
                    let are_equal = body.run(op::I_EQUAL, booleans_4, &[*a, b]);
                    let is_equal = body.run(op::ALL, boolean, &[are_equal]);
                    bit = body.run(op::SELECT, uint, &[is_equal, bit, zero]);
                }
                all = body.uint(op::BITWISE_OR, all, bit);
            }
            let bit = body.uint(op::SHIFT_LEFT_LOGICAL, one, sample);
            let before = body.uint(op::I_SUB, bit, one);
            let before = body.uint(op::BITWISE_AND, all, before);
            let is_first = body.run(op::I_EQUAL, boolean, &[before, zero]);
            runs = body.run(op::LOGICAL_AND, boolean, &[runs, is_first]);
            mask = Some(all);
        }
        let color = body.only_where(is_there, own[0]);
        let [depths, gaussians] = [1, 2].map(|index| match own.get(index) {
            Some(row) => body.only_where(is_there, *row),
            None => body.run(op::COMPOSITE_CONSTRUCT, uints_4, &[zero; 4]),
        });
        let median = body.component(depths, 1);
        let median_depth = body.run(op::BITCAST, float, &[median]);
        let mut camera = Vec::new();
        if inputs.has_camera {
            let six = body.constant(6);
            let first = body.uint(op::I_MUL, view, six);
            for index in 0..6 {
                let index = body.constant(index);
                let row = body.uint(op::I_ADD, first, index);
                camera.push(body.row_at(cameras, row));
            }
        }
        Self { place, view, runs, color, depths, gaussians, median_depth, camera, mask }
    }

    /// Makes the invocation a helper where there is no fragment.
    fn demote(&self, body: &mut Body<'_>) {
        let [without, merged] = [(); 2].map(|()| body.module.id());
        body.write(op::SELECTION_MERGE, &[merged, 0]);
        body.write(op::BRANCH_CONDITIONAL, &[self.runs, merged, without]);
        body.write(op::LABEL, &[without]);
        body.write(op::DEMOTE_TO_HELPER_INVOCATION, &[]);
        body.write(op::BRANCH, &[merged]);
        body.write(op::LABEL, &[merged]);
    }

    /// Fills the application's inputs in.
    fn fill(&self, body: &mut Body<'_>, request: &Request<'_>, inputs: &Inputs) {
        let zero = body.constant(0);
        let locations = &request.locations;
        let (depths, gaussians) = (body.components(self.depths), body.components(self.gaussians));
        let mut slots = BTreeMap::from([
            (locations.accumulated_color, body.components(self.color)),
            (locations.depth, [depths[0], depths[1], zero, zero]),
            (locations.linear_depth, [depths[2], depths[3], zero, zero]),
            (locations.median_gaussian, [gaussians[0], gaussians[1], zero, zero]),
            (locations.nearest_gaussian, [gaussians[2], gaussians[3], zero, zero]),
        ]);
        for (location, row) in camera_locations(locations).zip(&self.camera) {
            let components = body.components(*row);
            slots.insert(location, components);
        }
        slots.remove(&!0);
        for input in &inputs.all {
            let value = match input.meaning {
                Meaning::Located(location, component) => {
                    let at = Slot { location: location.unwrap_or(0), component };
                    body.value(input.ty, at, &slots).0
                }
                Meaning::BuiltIn(built_in) => self.built_in(body, built_in, input.ty),
            };
            body.write(op::STORE, &[input.id, value]);
        }
    }

    /// The value of a built-in.
    fn built_in(&self, body: &mut Body<'_>, built_in: u32, ty: u32) -> u32 {
        let (uint, float, boolean) = (body.types.uint, body.types.float, body.types.boolean);
        match built_in {
            FRAG_COORD => {
                let [x, y] = [0, 1].map(|index| body.run(op::COMPOSITE_EXTRACT, float, &[self.place, index]));
                let one = body.constant(1.0_f32.to_bits());
                let one = body.run(op::BITCAST, float, &[one]);
                body.run(op::COMPOSITE_CONSTRUCT, ty, &[x, y, self.median_depth, one])
            }
            LAYER | VIEW_INDEX if ty == uint => self.view,
            LAYER | VIEW_INDEX => body.run(op::BITCAST, ty, &[self.view]),
            FRONT_FACING => {
                let zero = body.constant(0);
                body.run(op::I_EQUAL, boolean, &[zero, zero])
            }
            HELPER_INVOCATION => {
                let own = body.interface(INPUT, ty, &[&[BUILT_IN, HELPER_INVOCATION]]);
                let own = body.load(boolean, own);
                let does_not_run = body.run(op::LOGICAL_NOT, boolean, &[self.runs]);
                body.run(op::LOGICAL_OR, boolean, &[own, does_not_run])
            }
            SAMPLE_MASK => {
                let own = body.interface(INPUT, ty, &[&[BUILT_IN, SAMPLE_MASK], &[FLAT]]);
                let value = body.load(ty, own);
                let Some(mask) = self.mask else {
                    return value;
                };
                let Some(Type::Array(of, _)) = body.module.known_types.get(&ty).cloned() else {
                    return value;
                };
                let word = body.run(op::COMPOSITE_EXTRACT, of, &[value, 0]);
                let mask = if of == uint { mask } else { body.run(op::BITCAST, of, &[mask]) };
                let word = body.run(op::BITWISE_AND, of, &[word, mask]);
                body.run(op::COMPOSITE_CONSTRUCT, ty, &[word])
            }
            _ => body.nothing(ty),
        }
    }

    /// Keeps the samples of a mask, of those that the application's shader keeps.
    fn write_mask(&self, body: &mut Body<'_>, mask: u32, written: Option<(u32, u32)>) {
        let uint = body.types.uint;
        let zero = body.constant(0);
        let (variable, of) = match written {
            Some((id, ty)) => match body.module.known_types.get(&ty) {
                Some(Type::Array(of, _)) => (id, *of),
                _ => return,
            },
            None => {
                let one = body.constant(1);
                let ty = body.module.new_type(op::TYPE_ARRAY, &[uint, one]);
                (body.interface(OUTPUT, ty, &[&[BUILT_IN, SAMPLE_MASK]]), uint)
            }
        };
        let pointer = body.module.type_of(op::TYPE_POINTER, &[OUTPUT, of]);
        let place = body.run(op::ACCESS_CHAIN, pointer, &[variable, zero]);
        let mut value = if of == uint { mask } else { body.run(op::BITCAST, of, &[mask]) };
        if written.is_some() {
            let own = body.load(of, place);
            value = body.run(op::BITWISE_AND, of, &[own, value]);
        }
        body.write(op::STORE, &[place, value]);
    }
}
