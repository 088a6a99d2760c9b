//! Instructions of SPIR-V.

use spirv::Op;

use super::error::{InstructionRef, Result, malformed};

/// An operand: the meaning of its words by the grammar.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Operand {
    /// An id.
    Id(u32),
    /// A literal of one word.
    Literal(u32),
    /// A literal of two words.
    Literal64(u64),
    /// A string.
    String(String),
    /// A value of an enumeration, or a mask, as in the grammar. Its parameters are the operands that follow.
    Enumerant(u32),
}

impl Operand {
    /// The id, if it is one.
    pub fn id(&self) -> Option<u32> {
        match self {
            Self::Id(id) => Some(*id),
            _ => None,
        }
    }
}

/// An instruction, with operands as the grammar defines them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Instruction {
    pub opcode: Op,
    pub result_type: Option<u32>,
    pub result_id: Option<u32>,
    /// All operands but the result's type and id.
    pub operands: Vec<Operand>,
}

impl Instruction {
    /// The id at a position.
    pub fn id(&self, index: usize) -> Result<u32> {
        match self.operands.get(index).and_then(Operand::id) {
            Some(id) => Ok(id),
            None => malformed(format!("operand {index} isn't an id")),
        }
    }

    /// The literal at a position.
    pub fn number(&self, index: usize) -> Result<u32> {
        match self.operands.get(index) {
            Some(Operand::Literal(value)) => Ok(*value),
            _ => malformed(format!("operand {index} isn't a number")),
        }
    }

    /// All literals from a position on.
    pub fn numbers(&self, from: usize) -> Vec<u32> {
        (from..self.operands.len()).map_while(|index| self.number(index).ok()).collect()
    }

    /// All ids from a position on.
    pub fn ids(&self, from: usize) -> Vec<u32> {
        let operands = self.operands.get(from..).unwrap_or_default();
        operands.iter().map_while(Operand::id).collect()
    }

    /// The string at a position.
    pub fn string(&self, index: usize) -> Option<&str> {
        match self.operands.get(index) {
            Some(Operand::String(string)) => Some(string),
            _ => None,
        }
    }

    /// The value of an enumeration at a position, by the enumeration's conversion.
    pub fn enumerant<T>(&self, index: usize, from: fn(u32) -> Option<T>) -> Option<T> {
        match self.operands.get(index) {
            Some(Operand::Enumerant(value)) => from(*value),
            _ => None,
        }
    }

    /// The result's type.
    pub fn ty(&self) -> Result<u32> {
        match self.result_type {
            Some(ty) => Ok(ty),
            None => malformed("there is no result type"),
        }
    }

    /// The result.
    pub fn result(&self) -> Result<u32> {
        match self.result_id {
            Some(id) => Ok(id),
            None => malformed("there is no result"),
        }
    }

    /// The reference by which errors name the instruction.
    pub fn reference(&self) -> InstructionRef {
        let named = || self.operands.iter().find_map(Operand::id);
        InstructionRef { opcode: self.opcode, id: self.result_id.or_else(named) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_name_the_instruction() {
        let instruction =
            Instruction { opcode: Op::FAdd, result_type: Some(1), result_id: Some(12), operands: vec![Operand::Id(7)] };
        let diagnostic = malformed::<()>("operand %7 isn't defined").unwrap_err();
        assert_eq!(
            diagnostic.locate(instruction.reference()).to_string(),
            "malformed SPIR-V: OpFAdd %12: operand %7 isn't defined"
        );
    }
}
