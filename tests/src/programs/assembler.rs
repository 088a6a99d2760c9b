//! A minimal SPIR-V assembler for tests, which writes modules word by word.

use spirv::{
    AddressingModel, BuiltIn, Capability, Decoration, ExecutionMode, ExecutionModel, FunctionControl, GlslStd450Op,
    MemoryModel, Op, StorageClass,
};
use std::collections::{BTreeSet, HashMap};

/// An id of a module.
pub type Id = u32;

/// Version 1.5, which Vulkan 1.2 and later accept.
const VERSION: u32 = 0x0001_0500;

/// A compute shader under construction.
pub struct Assembler {
    next: Id,
    main: Id,
    glsl: Id,
    capabilities: BTreeSet<u32>,
    extensions: BTreeSet<&'static str>,
    modes: Vec<u32>,
    decorations: Vec<u32>,
    globals: Vec<u32>,
    declared: HashMap<Vec<u32>, Id>,
    interface: Vec<Id>,
    functions: Vec<u32>,
    locals: Vec<u32>,
    body: Vec<u32>,
}

fn instruction(to: &mut Vec<u32>, op: Op, operands: &[u32]) {
    to.push((operands.len() as u32 + 1) << 16 | op as u32);
    to.extend_from_slice(operands);
}

/// A string as words: its bytes, a zero, and zeros up to a whole word.
fn string(text: &str) -> Vec<u32> {
    let mut bytes = text.as_bytes().to_vec();
    bytes.resize(text.len() / 4 * 4 + 4, 0);
    bytemuck::pod_collect_to_vec(&bytes)
}

impl Assembler {
    /// Creates a module whose entry point `main` has a workgroup of this many invocations in x.
    pub fn new(workgroup: u32) -> Self {
        let mut this = Self {
            next: 3,
            main: 1,
            glsl: 2,
            capabilities: BTreeSet::new(),
            extensions: BTreeSet::new(),
            modes: Vec::new(),
            decorations: Vec::new(),
            globals: Vec::new(),
            declared: HashMap::new(),
            interface: Vec::new(),
            functions: Vec::new(),
            locals: Vec::new(),
            body: Vec::new(),
        };
        this.capability(Capability::Shader);
        this.mode(ExecutionMode::LocalSize, &[workgroup, 1, 1]);
        this
    }

    /// A new id.
    pub fn id(&mut self) -> Id {
        self.next += 1;
        self.next - 1
    }

    /// The id of `main`.
    pub fn main(&self) -> Id {
        self.main
    }

    /// Declares a capability.
    pub fn capability(&mut self, capability: Capability) {
        self.capabilities.insert(capability as u32);
    }

    /// Declares an extension.
    pub fn extension(&mut self, name: &'static str) {
        self.extensions.insert(name);
    }

    /// Declares an execution mode of `main`.
    pub fn mode(&mut self, mode: ExecutionMode, parameters: &[u32]) {
        let operands = [&[self.main, mode as u32], parameters].concat();
        instruction(&mut self.modes, Op::ExecutionMode, &operands);
    }

    /// Decorates an id.
    pub fn decorate(&mut self, id: Id, decoration: Decoration, parameters: &[u32]) {
        let operands = [&[id, decoration as u32], parameters].concat();
        instruction(&mut self.decorations, Op::Decorate, &operands);
    }

    /// Decorates a member of a structure.
    pub fn decorate_member(&mut self, id: Id, member: u32, to: Decoration, parameters: &[u32]) {
        let operands = [&[id, member, to as u32], parameters].concat();
        instruction(&mut self.decorations, Op::MemberDecorate, &operands);
    }

    /// Declares a type or a constant; returns the existing one if it is declared already.
    pub fn declare(&mut self, op: Op, ty: Option<Id>, operands: &[u32]) -> Id {
        let mut key = vec![op as u32, ty.unwrap_or(0)];
        key.extend_from_slice(operands);
        if let Some(id) = self.declared.get(&key) {
            return *id;
        }
        let id = self.declare_anew(op, ty, operands);
        self.declared.insert(key, id);
        id
    }

    /// Declares a type or a constant that is not shared, so that it may be decorated.
    pub fn declare_anew(&mut self, op: Op, ty: Option<Id>, operands: &[u32]) -> Id {
        let id = self.id();
        let words: Vec<u32> = ty.into_iter().chain([id]).collect();
        instruction(&mut self.globals, op, &[&words, operands].concat());
        id
    }

    /// A 32-bit unsigned constant.
    pub fn u32(&mut self, value: u32) -> Id {
        let ty = self.declare(Op::TypeInt, None, &[32, 0]);
        self.declare(Op::Constant, Some(ty), &[value])
    }

    /// A pointer type.
    pub fn pointer(&mut self, class: StorageClass, pointee: Id) -> Id {
        self.declare(Op::TypePointer, None, &[class as u32, pointee])
    }

    /// A variable of the module.
    pub fn global(&mut self, class: StorageClass, pointee: Id) -> Id {
        let ty = self.pointer(class, pointee);
        let id = self.declare_anew(Op::Variable, Some(ty), &[class as u32]);
        self.interface.push(id);
        id
    }

    /// A storage buffer of set 0: a runtime array of elements of this type and size in bytes.
    pub fn storage_buffer(&mut self, binding: u32, element: Id, bytes: u32) -> Id {
        let array = self.declare_anew(Op::TypeRuntimeArray, None, &[element]);
        self.decorate(array, Decoration::ArrayStride, &[bytes]);
        let block = self.declare_anew(Op::TypeStruct, None, &[array]);
        self.decorate(block, Decoration::Block, &[]);
        self.decorate_member(block, 0, Decoration::Offset, &[0]);
        let variable = self.global(StorageClass::StorageBuffer, block);
        self.decorate(variable, Decoration::DescriptorSet, &[0]);
        self.decorate(variable, Decoration::Binding, &[binding]);
        variable
    }

    /// A built-in input of this type.
    pub fn built_in(&mut self, built_in: BuiltIn, ty: Id) -> Id {
        let variable = self.global(StorageClass::Input, ty);
        self.decorate(variable, Decoration::BuiltIn, &[built_in as u32]);
        variable
    }

    /// A variable of the function.
    pub fn local(&mut self, pointee: Id) -> Id {
        let class = StorageClass::Function;
        let ty = self.pointer(class, pointee);
        let id = self.id();
        instruction(&mut self.locals, Op::Variable, &[ty, id, class as u32]);
        id
    }

    /// An instruction with a result.
    pub fn emit(&mut self, op: Op, ty: Id, operands: &[u32]) -> Id {
        let id = self.id();
        instruction(&mut self.body, op, &[&[ty, id], operands].concat());
        id
    }

    /// An instruction of GLSL.std.450.
    pub fn glsl(&mut self, op: GlslStd450Op, ty: Id, operands: &[u32]) -> Id {
        let operands = [&[self.glsl, op as u32], operands].concat();
        self.emit(Op::ExtInst, ty, &operands)
    }

    /// An instruction without a result.
    pub fn act(&mut self, op: Op, operands: &[u32]) {
        instruction(&mut self.body, op, operands);
    }

    /// Begins a block.
    pub fn label(&mut self, id: Id) {
        self.act(Op::Label, &[id]);
    }

    /// Ends a function whose blocks have been emitted, the first one without its label. The function returns nothing,
    /// or the value that its last block returns. Its parameters have these ids and types.
    pub fn function(&mut self, id: Id, returns: Id, parameters: &[(Id, Id)]) {
        let types: Vec<Id> = [returns].into_iter().chain(parameters.iter().map(|(_, ty)| *ty)).collect();
        let ty = self.declare(Op::TypeFunction, None, &types);
        let control = FunctionControl::NONE.bits();
        let first = self.id();
        let to = &mut self.functions;
        instruction(to, Op::Function, &[returns, id, control, ty]);
        for (id, ty) in parameters {
            instruction(to, Op::FunctionParameter, &[*ty, *id]);
        }
        instruction(to, Op::Label, &[first]);
        to.append(&mut self.locals);
        to.append(&mut self.body);
        instruction(to, Op::FunctionEnd, &[]);
    }

    /// The module's words.
    pub fn finish(self) -> Vec<u32> {
        let mut words = vec![0x0723_0203, VERSION, 0, self.next, 0];
        for capability in &self.capabilities {
            instruction(&mut words, Op::Capability, &[*capability]);
        }
        for name in &self.extensions {
            instruction(&mut words, Op::Extension, &string(name));
        }
        let glsl = [vec![self.glsl], string("GLSL.std.450")].concat();
        instruction(&mut words, Op::ExtInstImport, &glsl);
        let model = [AddressingModel::Logical as u32, MemoryModel::GLSL450 as u32];
        instruction(&mut words, Op::MemoryModel, &model);
        let mut entry = vec![ExecutionModel::GLCompute as u32, self.main];
        entry.extend(string("main"));
        entry.extend(&self.interface);
        instruction(&mut words, Op::EntryPoint, &entry);
        for section in [self.modes, self.decorations, self.globals, self.functions] {
            words.extend(section);
        }
        words
    }
}
