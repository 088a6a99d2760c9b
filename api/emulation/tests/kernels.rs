//! The kernels that are checked in: they are what the sources compile to, and nothing contracts the operations on pairs.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use gaurast_runner::{Case, Need};

fn main() -> ExitCode {
    gaurast_runner::main()
}

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("shaders")
}

/// The names of the compiled kernels in a folder.
fn compiled(folder: &Path) -> BTreeSet<String> {
    let entries = std::fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").file_name());
    let names = entries.map(|name| name.into_string().expect("a name of Unicode"));
    names.filter(|name| name.ends_with(".spv")).collect()
}

fn words(path: &Path) -> Vec<u32> {
    let bytes = std::fs::read(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    bytes.chunks_exact(4).map(|word| u32::from_le_bytes([word[0], word[1], word[2], word[3]])).collect()
}

/// The instructions of a module: opcode and operands.
fn instructions(words: &[u32]) -> Vec<(u32, &[u32])> {
    let mut found = Vec::new();
    let mut rest = &words[5..];
    while let [first, ..] = rest {
        let (instruction, after) = rest.split_at((first >> 16) as usize);
        found.push((first & 0xFFFF, &instruction[1..]));
        rest = after;
    }
    found
}

/// The checked-in kernels are those that the compiler makes of the sources. The word of the generator's version does not count.
#[gaurast_runner::test(needs = [Need::Program("glslangValidator")])]
fn kernels_are_what_the_sources_say(_case: &Case) {
    let temporary = tempfile::tempdir().expect("a temporary folder");
    let script = folder().join("compile.sh");
    let status = Command::new("sh").arg(&script).arg(temporary.path()).status().expect("a shell");
    assert!(status.success(), "{status}");
    let names = compiled(&folder());
    assert_eq!(names, compiled(temporary.path()));
    assert!(names.len() >= 15, "{names:?}");
    for name in names {
        let (mut own, mut new) = (words(&folder().join(&name)), words(&temporary.path().join(&name)));
        own[2] = 0;
        new[2] = 0;
        assert!(own == new, "{name} is not what compile.sh makes of its source");
    }
}

/// Functions of `pair.glsl`, as SPIR-V names them.
const PAIRS: &[&str] = &[
    "two_sum(",
    "whole_two_sum(",
    "quick_two_sum(",
    "split(",
    "two_product(",
    "whole_two_product(",
    "add(",
    "whole_add(",
    "sub(",
    "mul(",
    "whole_mul(",
    "div(",
    "whole_div(",
    "root(",
    "whole_root(",
    "dot3(",
    "cross2(",
];

/// Every sum, difference, product and quotient in functions of pairs is decorated `NoContraction`.
#[gaurast_runner::test]
fn no_operation_of_a_pair_is_contracted() {
    const NAME: u32 = 5;
    const FUNCTION: u32 = 54;
    const FUNCTION_END: u32 = 56;
    const DECORATE: u32 = 71;
    const NO_CONTRACTION: u32 = 42;
    // OpFAdd, OpFSub, OpFMul, OpFDiv.
    const OPERATIONS: [u32; 4] = [129, 131, 133, 136];
    let mut seen = BTreeSet::new();
    for name in compiled(&folder()) {
        let words = words(&folder().join(&name));
        let all = instructions(&words);
        let mut names = BTreeMap::new();
        let mut fixed = BTreeSet::new();
        for (opcode, operands) in &all {
            match *opcode {
                NAME => {
                    let bytes: Vec<u8> = operands[1..].iter().flat_map(|word| word.to_le_bytes()).collect();
                    let end = bytes.iter().position(|byte| *byte == 0).unwrap_or(bytes.len());
                    names.insert(operands[0], String::from_utf8_lossy(&bytes[..end]).into_owned());
                }
                DECORATE if operands[1] == NO_CONTRACTION => {
                    fixed.insert(operands[0]);
                }
                _ => {}
            }
        }
        let mut function = None;
        for (opcode, operands) in &all {
            match *opcode {
                FUNCTION => {
                    let called = names.get(&operands[1]);
                    function = called.and_then(|called| PAIRS.iter().find(|pair| called.starts_with(*pair)));
                }
                FUNCTION_END => function = None,
                operation if OPERATIONS.contains(&operation) => {
                    if let Some(pair) = function {
                        assert!(fixed.contains(&operands[1]), "{name}: an operation in {pair}...) may be contracted");
                        seen.insert(*pair);
                    }
                }
                _ => {}
            }
        }
    }
    // The root of pairs is in the function for both classes of precision.
    let arithmetic = PAIRS.iter().filter(|pair| !["sub(", "root(", "dot3(", "cross2("].contains(pair));
    let missing: Vec<_> = arithmetic.filter(|pair| !seen.contains(*pair)).collect();
    assert!(missing.is_empty(), "{missing:?}");
}
