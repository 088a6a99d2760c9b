//! Analysis of functions before they are translated: their calls, the variables that they store to, and those that are
//! indexed at run time.

use std::collections::{HashMap, HashSet};
use std::rc::Rc;

use spirv::Op;

use super::structurize::{Tree, structurize};
use crate::error::{Diagnostic, Error, Result, malformed, unsupported};
use crate::globals::Globals;
use crate::instruction::Instruction;
use crate::module::{Function, Module};
use crate::types::Type;

/// The greatest depth of nested calls.
const MAX_CALL_DEPTH: usize = 64;
/// The most parameters of a function, SPIR-V's own limit.
const MAX_PARAMETERS: usize = 255;
/// Arrays up to this length stay in registers even if they are indexed at run time.
const MAX_SELECTED_ELEMENTS: u32 = 4;

/// Facts about the functions that an entry point reaches.
#[derive(Debug, Default)]
pub struct Analysis {
    /// Variables (and pointer parameters) that must be in memory.
    pub in_memory: HashSet<u32>,
    /// Variables outside functions that are named anywhere.
    pub used: HashSet<u32>,
    trees: HashMap<usize, Rc<Tree>>,
    /// The variable or parameter to which a pointer points.
    roots: HashMap<u32, u32>,
    /// Arguments given to each pointer parameter.
    arguments: HashMap<u32, Vec<u32>>,
    /// The types of pointers within functions.
    pointer_types: HashMap<u32, u32>,
}

impl Analysis {
    /// Analyses a function and all that it calls.
    pub fn new(module: &Module, globals: &Globals, entry: usize) -> Result<Self, Error> {
        let mut analysis = Self::default();
        analysis.roots.extend(globals.variables.keys().map(|id| (*id, *id)));
        analysis.visit(module, globals, entry, &mut Vec::new())?;
        analysis.spread_memory();
        Ok(analysis)
    }

    /// The tree of a function.
    pub fn tree(&self, function: usize) -> Option<Rc<Tree>> {
        self.trees.get(&function).cloned()
    }

    fn visit(
        &mut self,
        module: &Module,
        globals: &Globals,
        index: usize,
        callers: &mut Vec<usize>,
    ) -> Result<(), Error> {
        let function = &module.sections.functions[index];
        let definition = &function.definition;
        if callers.contains(&index) {
            return Err(Diagnostic::Malformed("the function calls itself".into()).locate(definition.reference()));
        }
        if callers.len() >= MAX_CALL_DEPTH {
            return Err(Diagnostic::Unsupported("calls are nested too deeply".into()).locate(definition.reference()));
        }
        if self.trees.contains_key(&index) {
            return Ok(());
        }
        if function.parameters.len() > MAX_PARAMETERS {
            return Err(Diagnostic::Malformed("there are too many parameters".into()).locate(definition.reference()));
        }
        callers.push(index);
        let instructions = || function.blocks.iter().flat_map(|block| &block.instructions);
        for call in instructions().filter(|it| it.opcode == Op::FunctionCall) {
            let callee = call.id(0).map_err(|diagnostic| diagnostic.locate(call.reference()))?;
            match module.functions.get(&callee) {
                Some(callee) => self.visit(module, globals, *callee, callers)?,
                None => {
                    let diagnostic = Diagnostic::Malformed(format!("%{callee} isn't a function"));
                    return Err(diagnostic.locate(call.reference()));
                }
            }
        }
        callers.pop();
        for parameter in &function.parameters {
            let id = parameter.result_id.unwrap_or(0);
            self.roots.insert(id, id);
            self.pointer_types.extend(parameter.result_type.map(|ty| (id, ty)));
        }
        for instruction in instructions() {
            self.instruction(module, globals, instruction)
                .map_err(|diagnostic| diagnostic.locate(instruction.reference()))?;
        }
        let tree = self
            .structurize(module, globals, function)
            .map_err(|diagnostic| diagnostic.locate(definition.reference()))?;
        self.trees.insert(index, Rc::new(tree));
        Ok(())
    }

    fn instruction(&mut self, module: &Module, globals: &Globals, instruction: &Instruction) -> Result<()> {
        for index in 0..instruction.operands.len() {
            let mut used = instruction.id(index).ok();
            while let Some(id) = used
                && let Some(variable) = globals.variables.get(&id)
            {
                self.used.insert(id);
                used = variable.initial_variable;
            }
        }
        if let (Some(id), Some(ty)) = (instruction.result_id, instruction.result_type) {
            self.pointer_types.insert(id, ty);
        }
        match instruction.opcode {
            Op::Variable => {
                let id = instruction.result()?;
                self.roots.insert(id, id);
                let (_, pointee) = globals.types.pointer(instruction.ty()?)?;
                if !globals.types.is_value(pointee) {
                    self.in_memory.insert(id);
                }
            }
            Op::AccessChain | Op::InBoundsAccessChain => {
                if let Some(root) = self.roots.get(&instruction.id(0)?).copied() {
                    self.roots.insert(instruction.result()?, root);
                    if let Some(pointee) = self.pointee(globals, instruction.id(0)?)
                        && indexes_array(globals, pointee, &instruction.ids(1))
                    {
                        self.in_memory.insert(root);
                    }
                }
            }
            Op::CopyObject => {
                if let Some(root) = self.roots.get(&instruction.id(0)?).copied() {
                    self.roots.insert(instruction.result()?, root);
                }
            }
            Op::FunctionCall => {
                let Some(callee) = module.functions.get(&instruction.id(0)?) else {
                    return malformed("there is no such function");
                };
                let parameters = &module.sections.functions[*callee].parameters;
                for (parameter, argument) in parameters.iter().zip(instruction.ids(1)) {
                    if let (Some(parameter), Some(root)) = (parameter.result_id, self.roots.get(&argument)) {
                        self.arguments.entry(parameter).or_default().push(*root);
                    }
                }
            }
            _ => {}
        }
        Ok(())
    }

    /// The type that a pointer points to.
    fn pointee(&self, globals: &Globals, pointer: u32) -> Option<u32> {
        if let Some(variable) = globals.variables.get(&pointer) {
            return Some(variable.pointee);
        }
        let ty = self.pointer_types.get(&pointer)?;
        Some(globals.types.pointer(*ty).ok()?.1)
    }

    /// Moves to memory the variables whose pointers are passed to parameters in memory.
    fn spread_memory(&mut self) {
        let mut waiting: Vec<u32> = self.in_memory.iter().copied().collect();
        while let Some(parameter) = waiting.pop() {
            for argument in self.arguments.get(&parameter).into_iter().flatten() {
                if self.in_memory.insert(*argument) {
                    waiting.push(*argument);
                }
            }
        }
    }

    fn structurize(&self, module: &Module, globals: &Globals, function: &Function) -> Result<Tree> {
        let mut stores = Vec::with_capacity(function.blocks.len());
        for block in &function.blocks {
            let mut stored = Vec::new();
            for instruction in &block.instructions {
                self.stores(module, globals, instruction, &mut stored)?;
            }
            stored.sort_unstable();
            stored.dedup();
            stores.push(stored);
        }
        structurize(function, &stores)
    }

    /// Adds the variables and pointer parameters that an instruction stores to.
    fn stores(&self, module: &Module, globals: &Globals, instruction: &Instruction, into: &mut Vec<u32>) -> Result<()> {
        let root = |id: u32| self.roots.get(&id).copied();
        match instruction.opcode {
            Op::Store | Op::CopyMemory => into.extend(root(instruction.id(0)?)),
            // Modf and Frexp store through a pointer.
            Op::ExtInst => into.extend(instruction.ids(2).into_iter().filter_map(root)),
            Op::FunctionCall => {
                let Some(callee) = module.functions.get(&instruction.id(0)?) else {
                    return malformed("there is no such function");
                };
                let Some(tree) = self.trees.get(callee) else {
                    return unsupported("a call to a function that isn't translated");
                };
                let parameters = &module.sections.functions[*callee].parameters;
                let arguments = instruction.ids(1);
                for stored in tree.modified.iter() {
                    let position = parameters.iter().position(|parameter| parameter.result_id == Some(*stored));
                    into.extend(match position {
                        Some(position) => arguments.get(position).copied().and_then(root),
                        None => globals.variables.contains_key(stored).then_some(*stored),
                    });
                }
            }
            _ => {}
        }
        Ok(())
    }
}

/// Reports whether a chain of indices selects an element of a long array at run time.
fn indexes_array(globals: &Globals, mut ty: u32, indices: &[u32]) -> bool {
    for index in indices {
        let constant = globals.constant_u32(*index);
        let element = match globals.types.get(ty) {
            Ok(Type::Array { element, count, .. }) => {
                if constant.is_none() && *count > MAX_SELECTED_ELEMENTS {
                    return true;
                }
                *element
            }
            Ok(Type::Struct(members)) => match constant.and_then(|index| members.get(index as usize)) {
                Some(member) => member.ty,
                None => return false,
            },
            Ok(Type::RuntimeArray { element, .. }) => *element,
            Ok(Type::Matrix { column, .. }) => *column,
            _ => return false,
        };
        ty = element;
    }
    false
}
