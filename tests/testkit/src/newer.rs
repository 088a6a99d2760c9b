//! Structures that are newer than ash, and SPIR-V that is newer than the compiler of GLSL.

use ash::vk;
use spirv::{Capability, Op};

/// A structure of `N` features, or properties of 32 bits, whose type has this number.
#[repr(C)]
#[derive(Debug)]
pub struct Flags<const TYPE: i32, const N: usize> {
    /// Its type.
    pub s_type: vk::StructureType,
    /// The next structure of the chain.
    pub p_next: *mut std::ffi::c_void,
    /// The members.
    pub values: [vk::Bool32; N],
}

impl<const TYPE: i32, const N: usize> Flags<TYPE, N> {
    /// A structure with these members.
    pub fn new(values: [vk::Bool32; N]) -> Self {
        Self { s_type: vk::StructureType::from_raw(TYPE), p_next: std::ptr::null_mut(), values }
    }
}

// SAFETY: the members are those of a structure that an extension puts in this chain, as tests say.
unsafe impl<const TYPE: i32, const N: usize> vk::ExtendsDeviceCreateInfo for Flags<TYPE, N> {}
// SAFETY: as above.
unsafe impl<const TYPE: i32, const N: usize> vk::ExtendsPhysicalDeviceFeatures2 for Flags<TYPE, N> {}
// SAFETY: as above.
unsafe impl<const TYPE: i32, const N: usize> vk::ExtendsPhysicalDeviceProperties2 for Flags<TYPE, N> {}

/// The words before the first instruction.
const HEADER: usize = 5;

/// A module with more capabilities, in which `replace` puts other instructions in the place of each: those that it
/// appends to the list. It is given an instruction's words; where it returns false, the instruction remains.
///
/// # Panics
/// If the module is no SPIR-V.
pub fn rewritten(
    words: &[u32],
    capabilities: &[Capability],
    mut replace: impl FnMut(Op, &[u32], &mut Vec<u32>) -> bool,
) -> Vec<u32> {
    let (header, mut rest) = words.split_at(HEADER);
    let mut module = header.to_vec();
    for &capability in capabilities {
        module.extend(instruction(Op::Capability, &[capability as u32]));
    }
    while let [first, ..] = rest {
        let (own, after) = rest.split_at((first >> 16) as usize);
        let op = Op::from_u32(first & 0xffff).expect("an opcode");
        if !replace(op, own, &mut module) {
            module.extend_from_slice(own);
        }
        rest = after;
    }
    module
}

/// The words of an instruction.
pub fn instruction(op: Op, operands: &[u32]) -> Vec<u32> {
    let mut words = vec![(operands.len() as u32 + 1) << 16 | op as u32];
    words.extend_from_slice(operands);
    words
}

/// The result of a module's first instruction of an operation of which `is_it` is true: the word at index `result`.
///
/// # Panics
/// If there is none.
pub fn result_of(words: &[u32], op: Op, result: usize, is_it: impl Fn(&[u32]) -> bool) -> u32 {
    let mut found = None;
    rewritten(words, &[], |other, own, _| {
        if other == op && found.is_none() && is_it(own) {
            found = Some(own[result]);
        }
        false
    });
    found.expect("such an instruction")
}
