//! Writes the grammar of SPIR-V.

use crate::error::Error;
use crate::file::File;
use crate::{registry, rust};
use serde::Deserialize;
use spirv::{Decoration, ExecutionMode, Op};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::path::Path;

/// The version of SPIR-V's headers whose grammar is read.
const VERSION: &str = "1.4.335";

/// The SHA-256 of that version's `spirv.core.grammar.json`.
const SHA256: &str = "2768cbed9533c61dc9fe06e3a85b0c3533352a8c5f3d627302fb2678db880f71";

/// The parts of the machine-readable grammar that are used.
#[derive(Deserialize)]
struct Grammar {
    instructions: Vec<Instruction>,
    operand_kinds: Vec<OperandKind>,
}

#[derive(Deserialize)]
struct Instruction {
    opcode: u32,
    #[serde(default)]
    operands: Vec<Operand>,
}

#[derive(Deserialize)]
struct Operand {
    kind: String,
    /// `?` for an optional operand, `*` for one that may occur any number of times.
    #[serde(default)]
    quantifier: String,
}

#[derive(Deserialize)]
struct OperandKind {
    category: String,
    kind: String,
    #[serde(default)]
    enumerants: Vec<Enumerant>,
}

#[derive(Deserialize)]
struct Enumerant {
    /// A number, or a string in hexadecimal.
    value: serde_json::Value,
    #[serde(default)]
    parameters: Vec<Operand>,
}

impl Enumerant {
    fn value(&self) -> Option<u32> {
        match &self.value {
            serde_json::Value::String(text) => u32::from_str_radix(text.strip_prefix("0x")?, 16).ok(),
            number => number.as_u64()?.try_into().ok(),
        }
    }
}

/// Generates the table of SPIR-V's grammar from `spirv.core.grammar.json`.
///
/// # Errors
/// [`Error::OtherRegistry`], and the errors of reading and parsing.
pub fn generate(json: &Path) -> Result<File, Error> {
    let text = registry::read_version(json, VERSION, SHA256)?;
    let grammar: Grammar = serde_json::from_str(&text)
        .map_err(|error| Error::Registry { path: json.to_owned(), reason: error.to_string() })?;
    let used = used_kinds(&grammar);
    let enumerations: Vec<&OperandKind> = grammar
        .operand_kinds
        .iter()
        .filter(|kind| is_mask(kind) || kind.category == "ValueEnum")
        .filter(|kind| used.contains(kind.kind.as_str()))
        .collect();
    let code = format!(
        "use spirv::*;

        /// A kind of operand. Those after [`IdPair`](Self::IdPair) are SPIR-V's enumerations.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub(crate) enum Kind {{
            /// The id of the result's type.
            IdResultType,
            /// The result's id.
            IdResult,
            /// An id.
            Id,
            /// A word.
            Literal,
            /// A literal of the result's type, of one word or two.
            TypedLiteral,
            /// A string that ends with a zero byte.
            String,
            /// The opcode of an operation on constants. Words of any meaning follow.
            SpecConstantOp,
            /// A literal of the first operand's type, and an id.
            TypedLiteralIdPair,
            /// An id and a word.
            IdLiteralPair,
            /// Two ids.
            IdPair,
            {kinds}
        }}

        /// The operands of an operation, in order.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub(crate) struct Operands {{
            /// Operands that are always there.
            pub required: &'static [Kind],
            /// Operands of which the last may be missing.
            pub optional: &'static [Kind],
            /// The kind of which there may be any number more.
            pub repeated: Option<Kind>,
        }}

        const fn operands_of(
            required: &'static [Kind],
            optional: &'static [Kind],
            repeated: Option<Kind>,
        ) -> Operands {{
            Operands {{ required, optional, repeated }}
        }}

        /// The operands of an operation; `None` where the grammar doesn't have it.
        #[rustfmt::skip]
        pub(crate) fn operands(op: Op) -> Option<Operands> {{
    use Kind as K;
    use operands_of as o;
    Some(match op {{
{operations}        _ => return None,
    }})
}}

        impl Kind {{
            /// Tells an enumeration of bits from others.
            pub fn is_mask(self) -> bool {{
                matches!(self, {masks})
            }}

            /// Tells if an enumeration has a value, or all bits of it.
            pub fn has(self, value: u32) -> bool {{
                match self {{ {values} _ => false }}
            }}

            /// The parameters that follow a value or a bit of an enumeration.
            pub fn parameters(self, value: u32) -> &'static [Self] {{
                use Kind as K;
                match self {{ {parameters} _ => &[] }}
            }}
        }}",
        kinds = kinds(&enumerations),
        operations = operations(&grammar.instructions),
        masks = masks(&enumerations),
        values = values(&enumerations),
        parameters = parameters(&enumerations),
    );
    Ok(File {
        path: "driver/spirv/src/grammar.rs",
        text: rust::format(&format!(
            "// Generated by `cargo run -p registry-gen` from the grammar in version {VERSION} of SPIR-V's headers.\n\n\
             //! SPIR-V's grammar: the operands of each operation, and the parameters of each enumerant.\n\n{code}"
        ))?,
    })
}

/// The kinds of the operands of operations, and of the parameters of enumerants.
fn used_kinds(grammar: &Grammar) -> BTreeSet<&str> {
    let operands = grammar.instructions.iter().flat_map(|it| &it.operands);
    let enumerants = grammar.operand_kinds.iter().flat_map(|it| &it.enumerants);
    let parameters = enumerants.flat_map(|it| &it.parameters);
    operands.chain(parameters).map(|it| it.kind.as_str()).collect()
}

fn kinds(enumerations: &[&OperandKind]) -> String {
    enumerations.iter().fold(String::new(), |mut text, it| {
        let _ = writeln!(text, "{},", it.kind);
        text
    })
}

fn is_mask(kind: &OperandKind) -> bool {
    kind.category == "BitEnum"
}

fn masks(enumerations: &[&OperandKind]) -> String {
    let masks = enumerations.iter().filter(|it| is_mask(it));
    let names: Vec<String> = masks.map(|it| format!("Self::{}", it.kind)).collect();
    names.join(" | ")
}

fn values(enumerations: &[&OperandKind]) -> String {
    enumerations.iter().fold(String::new(), |mut text, it| {
        let from = if is_mask(it) { "from_bits" } else { "from_u32" };
        let _ = writeln!(text, "Self::{0} => {0}::{from}(value).is_some(),", it.kind);
        text
    })
}

/// The match arms of operations. Operations with equal operands share an arm.
fn operations(instructions: &[Instruction]) -> String {
    let mut arms: BTreeMap<String, Vec<Op>> = BTreeMap::new();
    let mut seen = BTreeSet::new();
    for instruction in instructions {
        // The enumeration may be older or newer than the grammar.
        if let Some(op) = Op::from_u32(instruction.opcode)
            && seen.insert(instruction.opcode)
        {
            let operands = row(&instruction.operands);
            arms.entry(operands).or_default().push(op);
        }
    }
    let mut arms: Vec<(String, Vec<Op>)> = arms.into_iter().collect();
    arms.sort_by_key(|(_, operations)| operations.first().map(|op| *op as u32));
    arms.iter().fold(String::new(), |mut text, (operands, operations)| {
        text += &arm(operations, operands);
        text
    })
}

/// A match arm in lines of limited length: rustfmt would give each pattern a line.
fn arm(operations: &[Op], operands: &str) -> String {
    const WIDTH: usize = 116;
    let mut text = String::new();
    let mut line = "        ".to_owned();
    for (index, op) in operations.iter().enumerate() {
        let separator = if index > 0 { "| " } else { "" };
        let name = format!("{separator}Op::{op:?} ");
        if line.len() + name.len() > WIDTH {
            let _ = writeln!(text, "{}", line.trim_end());
            line = "        ".to_owned();
        }
        line += &name;
    }
    if line.len() + operands.len() > WIDTH {
        let _ = writeln!(text, "{}", line.trim_end());
        line = "            ".to_owned();
    }
    let _ = writeln!(text, "{line}=> {operands},");
    text
}

/// An expression for the operands of an operation.
fn row(operands: &[Operand]) -> String {
    let list = |quantifier| {
        let kinds = operands.iter().filter(|it| it.quantifier == quantifier);
        let kinds: Vec<String> = kinds.map(|it| format!("K::{}", kind(&it.kind))).collect();
        kinds.join(", ")
    };
    let repeated = match list("*") {
        none if none.is_empty() => "None".to_owned(),
        one => format!("Some({one})"),
    };
    format!("o(&[{}], &[{}], {repeated})", list(""), list("?"))
}

/// The match arms of enumerations with enumerants that have parameters.
fn parameters(enumerations: &[&OperandKind]) -> String {
    let mut text = String::new();
    for enumeration in enumerations {
        let mut arms: BTreeMap<Vec<&str>, BTreeSet<u32>> = BTreeMap::new();
        for enumerant in &enumeration.enumerants {
            if let Some(value) = enumerant.value()
                && !enumerant.parameters.is_empty()
            {
                let kinds = enumerant.parameters.iter().map(|it| kind(&it.kind));
                arms.entry(kinds.collect()).or_default().insert(value);
            }
        }
        if arms.is_empty() {
            continue;
        }
        let (value, open, close) = match is_mask(enumeration) {
            true => ("value".to_owned(), "", ""),
            false => (format!("{}::from_u32(value)", enumeration.kind), "Some(", ")"),
        };
        let _ = writeln!(text, "Self::{} => match {value} {{", enumeration.kind);
        for (kinds, values) in arms {
            let values: Vec<String> = values.iter().map(|value| pattern(&enumeration.kind, *value)).collect();
            let kinds: Vec<String> = kinds.iter().map(|kind| format!("K::{kind}")).collect();
            let (values, kinds) = (values.join(" | "), kinds.join(", "));
            let _ = writeln!(text, "{open}{values}{close} => &[{kinds}],");
        }
        text += "_ => &[],\n},\n";
    }
    text
}

/// The pattern for a value with parameters: its name, or the bit of a mask.
fn pattern(enumeration: &str, value: u32) -> String {
    match enumeration {
        "Decoration" => Decoration::from_u32(value).map(|it| format!("Decoration::{it:?}")),
        "ExecutionMode" => ExecutionMode::from_u32(value).map(|it| format!("ExecutionMode::{it:?}")),
        _ => None,
    }
    .unwrap_or_else(|| format!("{value:#x}"))
}

/// The name in Rust of an operand's kind.
fn kind(name: &str) -> &str {
    match name {
        "IdRef" | "IdScope" | "IdMemorySemantics" => "Id",
        "LiteralInteger" | "LiteralFloat" | "LiteralExtInstInteger" => "Literal",
        "LiteralString" => "String",
        "LiteralContextDependentNumber" => "TypedLiteral",
        "LiteralSpecConstantOpInteger" => "SpecConstantOp",
        "PairLiteralIntegerIdRef" => "TypedLiteralIdPair",
        "PairIdRefLiteralInteger" => "IdLiteralPair",
        "PairIdRefIdRef" => "IdPair",
        enumeration => enumeration,
    }
}
