//! Decodes words to instructions by the grammar. It accepts any words.

use std::collections::HashMap;

use spirv::Op;

use super::error::Error;
use super::grammar::{self, Kind};
use super::instruction::{Instruction, Operand};

/// The words before the first instruction.
pub(crate) const HEADER_WORDS: usize = 5;

/// Decodes the instructions of a module, in order, and passes each to `each`.
///
/// # Errors
/// [`Error::Binary`] names the first word that violates the grammar. An error of `each` is returned.
pub(crate) fn decode(words: &[u32], mut each: impl FnMut(Instruction) -> Result<(), Error>) -> Result<(), Error> {
    let mut literal_widths = HashMap::new();
    let mut at = HEADER_WORDS;
    while let Some(first) = words.get(at) {
        let (count, opcode) = ((first >> 16) as usize, first & 0xffff);
        if count == 0 || count > words.len() - at {
            return invalid(at, format!("the instruction has a word count of {count}"));
        }
        let Some((opcode, layout)) = Op::from_u32(opcode).and_then(|op| Some((op, grammar::operands(op)?))) else {
            return invalid(at, format!("there is no opcode {opcode}"));
        };
        let mut decoder = Decoder {
            words: &words[..at + count],
            at: at + 1,
            literal_widths: &literal_widths,
            instruction: Instruction { opcode, result_type: None, result_id: None, operands: Vec::new() },
        };
        decoder.operands(layout)?;
        let instruction = decoder.instruction;
        if let (Some(id), Some(width)) = (instruction.result_id, literal_width(&instruction, &literal_widths)) {
            literal_widths.insert(id, width);
        }
        each(instruction)?;
        at += count;
    }
    Ok(())
}

fn invalid<T>(word: usize, reason: impl std::fmt::Display) -> Result<T, Error> {
    Err(Error::Binary { reason: format!("word {word}: {reason}") })
}

/// The number of bits of a literal of a type, or of a value's type.
fn literal_width(instruction: &Instruction, widths: &HashMap<u32, u32>) -> Option<u32> {
    match instruction.opcode {
        Op::TypeInt | Op::TypeFloat => instruction.number(0).ok(),
        _ => widths.get(&instruction.result_type?).copied(),
    }
}

/// Decodes one instruction.
struct Decoder<'a> {
    /// All words, up to the instruction's end.
    words: &'a [u32],
    /// The next word.
    at: usize,
    /// The number of bits of literals, by the ids of types and values.
    literal_widths: &'a HashMap<u32, u32>,
    instruction: Instruction,
}

impl Decoder<'_> {
    fn operands(&mut self, layout: grammar::Operands) -> Result<(), Error> {
        for kind in layout.required {
            self.operand(*kind)?;
        }
        for kind in layout.optional {
            if self.is_at_end() {
                return Ok(());
            }
            self.operand(*kind)?;
        }
        if let Some(kind) = layout.repeated {
            while !self.is_at_end() {
                self.operand(kind)?;
            }
        }
        match self.is_at_end() {
            true => Ok(()),
            false => self.invalid("there are more operands than the instruction takes"),
        }
    }

    fn is_at_end(&self) -> bool {
        self.at == self.words.len()
    }

    fn invalid<T>(&self, reason: impl std::fmt::Display) -> Result<T, Error> {
        invalid(self.at, format!("Op{:?}: {reason}", self.instruction.opcode))
    }

    fn word(&mut self) -> Result<u32, Error> {
        let Some(word) = self.words.get(self.at) else {
            return self.invalid("an operand is missing");
        };
        self.at += 1;
        Ok(*word)
    }

    fn operand(&mut self, kind: Kind) -> Result<(), Error> {
        match kind {
            Kind::IdResultType => self.instruction.result_type = Some(self.word()?),
            Kind::IdResult => self.instruction.result_id = Some(self.word()?),
            Kind::Id => self.id()?,
            Kind::Literal => self.literal()?,
            Kind::TypedLiteral => self.typed_literal(self.instruction.result_type)?,
            Kind::TypedLiteralIdPair => {
                let selector = self.instruction.operands.first().and_then(Operand::id);
                self.typed_literal(selector)?;
                self.id()?;
            }
            Kind::IdLiteralPair => {
                self.id()?;
                self.literal()?;
            }
            Kind::IdPair => {
                self.id()?;
                self.id()?;
            }
            Kind::String => self.string()?,
            Kind::SpecConstantOp => {
                self.literal()?;
                while !self.is_at_end() {
                    self.literal()?;
                }
            }
            enumeration => self.enumerant(enumeration)?,
        }
        Ok(())
    }

    fn id(&mut self) -> Result<(), Error> {
        let id = self.word()?;
        self.instruction.operands.push(Operand::Id(id));
        Ok(())
    }

    fn literal(&mut self) -> Result<(), Error> {
        let value = self.word()?;
        self.instruction.operands.push(Operand::Literal(value));
        Ok(())
    }

    /// Decodes a literal of a type, or of a value's type; one word if that is unknown.
    fn typed_literal(&mut self, of: Option<u32>) -> Result<(), Error> {
        match of.and_then(|id| self.literal_widths.get(&id)) {
            None | Some(8 | 16 | 32) => self.literal(),
            Some(64) => {
                let (low, high) = (self.word()?, self.word()?);
                let value = u64::from(high) << 32 | u64::from(low);
                self.instruction.operands.push(Operand::Literal64(value));
                Ok(())
            }
            Some(width) => self.invalid(format!("there are no literals of {width} bits")),
        }
    }

    /// Decodes a string, up to the word with its zero byte. What is not UTF-8 becomes U+FFFD, since names for debugging
    /// may be any bytes.
    fn string(&mut self) -> Result<(), Error> {
        let mut bytes = Vec::new();
        loop {
            let word = self.word()?.to_le_bytes();
            let end = word.iter().position(|byte| *byte == 0);
            bytes.extend_from_slice(&word[..end.unwrap_or(4)]);
            if end.is_some() {
                break;
            }
        }
        let string = String::from_utf8_lossy(&bytes).into_owned();
        self.instruction.operands.push(Operand::String(string));
        Ok(())
    }

    /// Decodes a value of an enumeration and its parameters, or a mask and the parameters of its bits.
    fn enumerant(&mut self, enumeration: Kind) -> Result<(), Error> {
        let value = self.word()?;
        if !enumeration.has(value) {
            self.at -= 1;
            return self.invalid(format!("{enumeration:?} has no {value}"));
        }
        self.instruction.operands.push(Operand::Enumerant(value));
        if !enumeration.is_mask() {
            return self.parameters(enumeration.parameters(value));
        }
        (0..u32::BITS)
            .map(|bit| value & 1 << bit)
            .filter(|bit| *bit != 0)
            .try_for_each(|bit| self.parameters(enumeration.parameters(bit)))
    }

    fn parameters(&mut self, kinds: &[Kind]) -> Result<(), Error> {
        kinds.iter().try_for_each(|kind| self.operand(*kind))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Decodes instructions without a header: each an opcode and operands.
    fn decoded(instructions: &[(u32, &[u32])]) -> Result<Vec<Instruction>, String> {
        let mut words = vec![0; HEADER_WORDS];
        for (opcode, operands) in instructions {
            words.push((operands.len() as u32 + 1) << 16 | opcode);
            words.extend_from_slice(operands);
        }
        let mut all = Vec::new();
        let done = decode(&words, |it| {
            all.push(it);
            Ok(())
        });
        done.map(|()| all).map_err(|error| error.to_string())
    }

    #[test]
    fn operands_are_as_the_grammar_says() {
        let float = (Op::TypeFloat as u32, [7, 64]);
        let all = decoded(&[
            (float.0, &float.1),
            (Op::Constant as u32, &[7, 8, 1, 2]),
            (Op::Decorate as u32, &[8, 11, 6]),
            (Op::Load as u32, &[7, 9, 8, 2, 16]),
        ])
        .unwrap();
        assert_eq!(all[1].operands, [Operand::Literal64(2 << 32 | 1)]);
        assert_eq!((all[1].result_type, all[1].result_id), (Some(7), Some(8)));
        let built_in = [Operand::Id(8), Operand::Enumerant(11), Operand::Enumerant(6)];
        assert_eq!(all[2].operands, built_in);
        // The alignment that a bit of the mask requires.
        let aligned = [Operand::Id(8), Operand::Enumerant(2), Operand::Literal(16)];
        assert_eq!(all[3].operands, aligned);
    }

    #[test]
    fn errors_name_the_word_and_the_instruction() {
        let refused = |opcode: u32, operands: &[u32]| decoded(&[(opcode, operands)]).unwrap_err();
        let name = Op::Name as u32;
        for (found, expected) in [
            (refused(0xffff, &[]), "word 5: there is no opcode 65535"),
            (refused(Op::MemoryModel as u32, &[0]), "word 7: OpMemoryModel: an operand is missing"),
            (refused(Op::Nop as u32, &[1]), "word 6: OpNop: there are more operands than the instruction takes"),
            (refused(Op::Capability as u32, &[9999]), "word 6: OpCapability: Capability has no 9999"),
            (refused(name, &[1, 0x6161_6161]), "word 8: OpName: an operand is missing"),
        ] {
            assert_eq!(found, format!("not SPIR-V: {expected}"));
        }
    }

    #[test]
    fn names_need_not_be_utf_8() {
        let all = decoded(&[(Op::Name as u32, &[1, 0x0041_ff41])]).unwrap();
        let name = Operand::String("A\u{fffd}A".to_owned());
        assert_eq!(all[0].operands, [Operand::Id(1), name]);
    }
}
