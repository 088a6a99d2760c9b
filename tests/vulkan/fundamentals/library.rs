//! The shared library's code: nothing in it depends on the processor's vendor or on the C library's mathematics.

use gaurast_runner::built_library;
use iced_x86::{Decoder, DecoderOptions, Instruction, Mnemonic};
use object::{Object, ObjectSection, ObjectSymbol};
use std::collections::BTreeMap;

/// The functions of C's mathematics, without the `f` and `l` of their types.
const MATHEMATICS: &[&str] = &[
    "acos",
    "acosh",
    "asin",
    "asinh",
    "atan",
    "atan2",
    "atanh",
    "cbrt",
    "ceil",
    "copysign",
    "cos",
    "cosh",
    "erf",
    "erfc",
    "exp",
    "exp10",
    "exp2",
    "expm1",
    "fabs",
    "fdim",
    "floor",
    "fma",
    "fmax",
    "fmin",
    "fmod",
    "frexp",
    "hypot",
    "ilogb",
    "ldexp",
    "lgamma",
    "llrint",
    "llround",
    "log",
    "log10",
    "log1p",
    "log2",
    "logb",
    "lrint",
    "lround",
    "modf",
    "nearbyint",
    "nextafter",
    "pow",
    "remainder",
    "remquo",
    "rint",
    "round",
    "roundeven",
    "scalbln",
    "scalbn",
    "sin",
    "sincos",
    "sinh",
    "sqrt",
    "tan",
    "tanh",
    "tgamma",
    "trunc",
];

/// True if a symbol is a function of C's mathematics.
fn is_mathematics(symbol: &str) -> bool {
    let stem = symbol.strip_suffix(['f', 'l']).unwrap_or(symbol);
    MATHEMATICS.contains(&symbol) || MATHEMATICS.contains(&stem)
}

/// True if processors differ in an instruction's result: estimates of reciprocals, roots and exponentials, and all
/// arithmetic of the x87, whose precision is a mode.
fn is_forbidden(mnemonic: Mnemonic) -> bool {
    let name = format!("{mnemonic:?}").to_lowercase();
    let name = name.strip_prefix('v').unwrap_or(&name);
    let estimates = [
        "rcpps", "rcpss", "rsqrtps", "rsqrtss", "rcp14", "rsqrt14", "rcp28", "rsqrt28", "rcpph", "rcpsh", "rsqrtph",
        "rsqrtsh", "exp2p",
    ];
    let x87 = [
        "f2xm1", "fadd", "faddp", "fcos", "fdiv", "fdivp", "fdivr", "fdivrp", "fiadd", "fidiv", "fidivr", "fimul",
        "fisub", "fisubr", "fmul", "fmulp", "fpatan", "fprem", "fprem1", "fptan", "frndint", "fscale", "fsin",
        "fsincos", "fsqrt", "fsub", "fsubp", "fsubr", "fsubrp", "fyl2x", "fyl2xp1",
    ];
    estimates.iter().any(|estimate| name.starts_with(estimate)) || x87.contains(&name)
}

/// The forbidden instructions of machine code, with their addresses.
fn forbidden(code: &[u8], address: u64) -> Vec<(u64, Mnemonic)> {
    let mut decoder = Decoder::with_ip(64, code, address, DecoderOptions::NONE);
    let mut instruction = Instruction::default();
    let mut found = Vec::new();
    let mut known = BTreeMap::new();
    while decoder.can_decode() {
        decoder.decode_out(&mut instruction);
        let mnemonic = instruction.mnemonic();
        if *known.entry(mnemonic as usize).or_insert_with(|| is_forbidden(mnemonic)) {
            found.push((instruction.ip(), mnemonic));
        }
    }
    found
}

/// The driver's library.
fn library() -> Vec<u8> {
    std::fs::read(built_library("gaurast-icd", "libvulkan_gaurast.so")).expect("the library is read")
}

#[gaurast_runner::test]
fn the_library_imports_no_mathematics_of_the_c_library() {
    let bytes = library();
    let file = object::File::parse(&*bytes).expect("an ELF file");
    let symbols = file.dynamic_symbols().filter(|symbol| symbol.is_undefined());
    let names: Vec<_> = symbols.filter_map(|symbol| symbol.name().ok()).collect();
    assert!(names.contains(&"memcpy"), "a library imports something: {names:?}");
    let imported: Vec<_> = names.into_iter().filter(|name| is_mathematics(name)).collect();
    assert!(imported.is_empty(), "{imported:?}");
}

#[cfg(target_arch = "x86_64")]
#[gaurast_runner::test]
fn the_library_has_no_instruction_whose_result_depends_on_the_processor() {
    let bytes = library();
    let file = object::File::parse(&*bytes).expect("an ELF file");
    let text = file.section_by_name(".text").expect("the library has code");
    let code = text.data().expect("the code is in the file");
    assert!(code.len() > 1 << 20, "{} bytes of code", code.len());
    let found = forbidden(code, text.address());
    assert!(found.is_empty(), "{found:x?}");
}

/// The scan finds what it looks for: `rcpps`, `vrsqrt14ps` and `fsin`, between instructions that are allowed.
#[gaurast_runner::test]
fn the_scan_finds_forbidden_instructions() {
    let code = [
        0x0f, 0x53, 0xc1, // rcpps xmm0, xmm1
        0x0f, 0x58, 0xc1, // addps xmm0, xmm1
        0x62, 0xf2, 0x7d, 0x48, 0x4e, 0xc1, // vrsqrt14ps zmm0, zmm1
        0x0f, 0x51, 0xc1, // sqrtps xmm0, xmm1
        0xd9, 0xfe, // fsin
    ];
    let found: Vec<_> = forbidden(&code, 0).into_iter().map(|(address, _)| address).collect();
    assert_eq!(found, [0, 6, 15]);
    assert!(is_mathematics("expf") && is_mathematics("floor") && !is_mathematics("memcpy"));
}
