//! The inputs and outputs of a shader's entry point by location, from its SPIR-V.

use std::collections::BTreeMap;

/// The storage classes of inputs and outputs.
pub(crate) const INPUT: u32 = 1;
/// See [`INPUT`].
pub(crate) const OUTPUT: u32 = 3;
/// The storage class of push constants.
const PUSH_CONSTANT: u32 = 9;
/// `OpFunction`.
const FUNCTION: u32 = 54;
/// Instructions of functions that take pointers to variables: a call, a load, a copy, and the access chains.
const POINTING: [u32; 6] = [57, 61, 63, 65, 66, 67];
/// The decoration `BuiltIn`'s value for the depth that a fragment shader writes.
const FRAG_DEPTH: u32 = 22;

/// The slots of an interface by location and component; true is 32-bit floating point.
pub(crate) type Slots = BTreeMap<(u32, u32), bool>;

enum Type {
    Float(u32),
    Other,
    Vector(u32, u32),
    Matrix(u32, u32),
    Array(u32, u32),
    Structure(Vec<u32>),
    Pointer(u32),
}

/// A module, as far as its interface goes.
#[derive(Default)]
struct Module {
    types: BTreeMap<u32, Type>,
    constants: BTreeMap<u32, u32>,
    /// Decorations of an id, and of a structure's member.
    decorations: BTreeMap<(u32, Option<u32>), BTreeMap<u32, u32>>,
    /// Type and storage class of variables.
    variables: BTreeMap<u32, (u32, u32)>,
    /// Names and variables of entry points.
    entries: Vec<(Vec<u8>, Vec<u32>)>,
}

const LOCATION: u32 = 30;
const COMPONENT: u32 = 31;
const BUILT_IN: u32 = 11;

impl Module {
    fn parse(words: &[u32]) -> Self {
        let mut module = Self::default();
        let mut rest = words.get(5..).unwrap_or_default();
        while let Some(&first) = rest.first() {
            let count = (first >> 16) as usize;
            if count == 0 || count > rest.len() {
                break;
            }
            let (instruction, after) = rest.split_at(count);
            module.take(first & 0xFFFF, &instruction[1..]);
            rest = after;
        }
        module
    }

    fn take(&mut self, opcode: u32, operands: &[u32]) {
        match (opcode, operands) {
            // OpEntryPoint: model, id, name, interface.
            (15, [_, _, rest @ ..]) => {
                let bytes: Vec<u8> = rest.iter().flat_map(|word| word.to_le_bytes()).collect();
                let length = bytes.iter().position(|&byte| byte == 0).unwrap_or(bytes.len());
                let after = rest.get(length / 4 + 1..).unwrap_or_default();
                self.entries.push((bytes[..length].to_vec(), after.to_vec()));
            }
            (71, [id, decoration, rest @ ..]) => {
                let value = rest.first().copied().unwrap_or(0);
                self.decorations.entry((*id, None)).or_default().insert(*decoration, value);
            }
            (72, [id, member, decoration, rest @ ..]) => {
                let value = rest.first().copied().unwrap_or(0);
                let key = (*id, Some(*member));
                self.decorations.entry(key).or_default().insert(*decoration, value);
            }
            (22, [id, width, ..]) => self.define(*id, Type::Float(*width)),
            (20 | 21, [id, ..]) => self.define(*id, Type::Other),
            (23, [id, of, count]) => self.define(*id, Type::Vector(*of, *count)),
            (24, [id, of, count]) => self.define(*id, Type::Matrix(*of, *count)),
            (28, [id, of, length]) => self.define(*id, Type::Array(*of, *length)),
            (30, [id, members @ ..]) => self.define(*id, Type::Structure(members.to_vec())),
            (32, [id, _, of]) => self.define(*id, Type::Pointer(*of)),
            (43 | 50, [_, id, value, ..]) => {
                self.constants.insert(*id, *value);
            }
            (59, [pointer, id, class, ..]) => {
                self.variables.insert(*id, (*pointer, *class));
            }
            _ => {}
        }
    }

    fn define(&mut self, id: u32, ty: Type) {
        self.types.insert(id, ty);
    }

    fn decoration(&self, id: u32, member: Option<u32>, decoration: u32) -> Option<u32> {
        self.decorations.get(&(id, member))?.get(&decoration).copied()
    }

    /// The variables of an entry point in a storage class, with what they point at.
    fn interface(&self, entry: &[u8], class: u32) -> impl Iterator<Item = (u32, u32)> {
        let found = self.entries.iter().find(|(name, _)| name == entry);
        let ids = found.map(|(_, ids)| ids.as_slice()).unwrap_or_default();
        ids.iter().filter_map(move |&id| {
            let &(pointer, of) = self.variables.get(&id)?;
            match self.types.get(&pointer)? {
                Type::Pointer(pointee) if of == class => Some((id, *pointee)),
                _ => None,
            }
        })
    }

    /// Adds the slots of a type at a location; gives the next location.
    fn place(&self, id: u32, location: u32, component: u32, slots: &mut Slots) -> u32 {
        match self.types.get(&id) {
            Some(&Type::Vector(of, count)) => {
                for index in 0..count {
                    self.place(of, location, component + index, slots);
                }
                location + 1
            }
            Some(&Type::Matrix(of, count)) => (0..count).fold(location, |at, _| self.place(of, at, component, slots)),
            Some(&Type::Array(of, length)) => {
                let length = self.constants.get(&length).copied().unwrap_or(1).min(64);
                (0..length).fold(location, |at, _| self.place(of, at, component, slots))
            }
            Some(Type::Structure(members)) => (0..).zip(members).fold(location, |at, (index, &member)| {
                let at = self.decoration(id, Some(index), LOCATION).unwrap_or(at);
                self.place(member, at, component, slots)
            }),
            Some(&Type::Float(width)) => {
                slots.insert((location, component), width == 32);
                location + 1
            }
            _ => {
                slots.insert((location, component), false);
                location + 1
            }
        }
    }

    fn slots(&self, entry: &[u8], class: u32) -> Slots {
        let mut slots = Slots::new();
        for (id, of) in self.interface(entry, class) {
            let component = self.decoration(id, None, COMPONENT).unwrap_or(0);
            let own = self.decoration(id, None, LOCATION);
            let of_members = self.decoration(of, Some(0), LOCATION);
            if let Some(location) = own.or(of_members) {
                self.place(of, location, component, &mut slots);
            }
        }
        slots
    }

    fn writes_depth(&self, entry: &[u8]) -> bool {
        let mut outputs = self.interface(entry, OUTPUT);
        outputs.any(|(id, _)| self.decoration(id, None, BUILT_IN) == Some(FRAG_DEPTH))
    }
}

/// The inputs or outputs of an entry point.
pub(crate) struct Interface {
    /// By location.
    pub(crate) slots: Slots,
    /// It writes `FragDepth`.
    pub(crate) writes_depth: bool,
}

impl Interface {
    /// The interface of an entry point in a storage class.
    pub(crate) fn of(words: &[u32], entry: &[u8], class: u32) -> Self {
        let module = Module::parse(words);
        Self { slots: module.slots(entry, class), writes_depth: module.writes_depth(entry) }
    }
}

/// Reports whether a module reads push constants: whether an instruction of a function names them.
pub(crate) fn reads_constants(words: &[u32]) -> bool {
    let module = Module::parse(words);
    let pushed = |id: &u32| module.variables.get(id).is_some_and(|&(_, class)| class == PUSH_CONSTANT);
    let mut rest = words.get(5..).unwrap_or_default();
    let mut is_in_function = false;
    while let Some(&first) = rest.first() {
        let (opcode, count) = (first & 0xFFFF, (first >> 16) as usize);
        if count == 0 || count > rest.len() {
            break;
        }
        let (instruction, after) = rest.split_at(count);
        is_in_function |= opcode == FUNCTION;
        if is_in_function && POINTING.contains(&opcode) && instruction[1..].iter().any(pushed) {
            return true;
        }
        rest = after;
    }
    false
}
