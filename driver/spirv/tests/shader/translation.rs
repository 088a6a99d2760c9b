//! Tests that all checked-in shaders can be translated, and that they are up to date with their sources.

use std::path::Path;
use std::process::Command;

use crate::common::{OPTIONS, all_shaders, folder, rewritten, translated, words_of};
use gaurast_runner::{Missing, Need, ignore};
use gaurast_spirv::{Module, Specialization, Stage, translate};
use spirv::{Decoration, MemoryAccess, MemoryModel, Op};

#[gaurast_runner::test]
fn every_kept_shader_translates() {
    let names = all_shaders();
    assert!(names.len() >= 18);
    for name in names {
        let shader = translated(&name, &Specialization::default());
        assert!(!shader.program.body.is_empty(), "{name}");
    }
}

/// A module of which the first instruction of an operation is replaced by what `change` makes of its words.
fn changed(name: &str, op: Op, change: impl Fn(&[u32]) -> Vec<u32>) -> Module {
    let mut is_first = true;
    let words = rewritten(&words_of(name), |instruction| {
        if instruction[0] & 0xffff == op as u32 && std::mem::take(&mut is_first) {
            change(instruction)
        } else {
            instruction.to_vec()
        }
    });
    Module::parse(&words).unwrap()
}

#[gaurast_runner::test]
fn coherent_and_volatile_accesses_are_noticed() {
    let name = "blur.comp";
    let is_coherent = |module: &Module| {
        let shader = translate(module, "main", Stage::Compute, &Specialization::default(), &OPTIONS).unwrap();
        shader.program.has_coherent_accesses
    };
    assert!(!is_coherent(&Module::parse(&words_of(name)).unwrap()));
    let opening = |words: u32, op: Op| words << 16 | op as u32;
    for decoration in [Decoration::Volatile, Decoration::Coherent] {
        let decoration = decoration as u32;
        // Another decoration of the same thing is added before the first one.
        let variable =
            changed(name, Op::Decorate, |first| [&[opening(3, Op::Decorate), first[1], decoration], first].concat());
        assert!(is_coherent(&variable));
        let member = changed(name, Op::MemberDecorate, |first| {
            [&[opening(4, Op::MemberDecorate), first[1], first[2], decoration], first].concat()
        });
        assert!(is_coherent(&member));
    }
    let volatile = MemoryAccess::VOLATILE.bits();
    let load = changed(name, Op::Load, |load| [&[opening(5, Op::Load)], &load[1..4], &[volatile]].concat());
    assert!(is_coherent(&load));
    let vulkan = MemoryModel::Vulkan as u32;
    let model = changed(name, Op::MemoryModel, |model| vec![model[0], model[1], vulkan]);
    assert!(is_coherent(&model));
}

/// Everything but the header's generator word, which changes with glslang's version.
fn comparable(bytes: &[u8]) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    if let Some(generator) = bytes.get_mut(8..12) {
        generator.fill(0);
    }
    bytes
}

/// A program that made the checked-in binaries, and its version.
struct Tool {
    program: &'static str,
    version: &'static str,
}

const COMPILER: Tool = Tool { program: "glslangValidator", version: "Glslang Version: 11:12." };
const ASSEMBLER: Tool = Tool { program: "spirv-as", version: "SPIRV-Tools v2023.1" };
const OPTIMIZER: Tool = Tool { program: "spirv-opt", version: "SPIRV-Tools v2023.1" };

impl Tool {
    const fn need(&self) -> Need {
        Need::Program(self.program)
    }

    /// Ends the test as ignored if the program has another version, whose output may differ.
    fn require_version(&self) {
        let output = Command::new(self.program).arg("--version").output().unwrap();
        // spirv-opt prints it to standard error.
        let text = String::from_utf8_lossy(&output.stdout) + String::from_utf8_lossy(&output.stderr);
        if !text.contains(self.version) {
            let found = text.lines().next().unwrap_or_default();
            let reason = format!("the kept binaries are of \"{}\", not {found}", self.version);
            ignore(Missing::Capability, reason);
        }
    }

    /// Runs the program, which must succeed. Returns the contents of its output file.
    fn output(&self, arguments: &[&str], input: &Path) -> Vec<u8> {
        let file = tempfile::NamedTempFile::new().unwrap();
        let output = Command::new(self.program).args(arguments).arg(input).arg("-o").arg(file.path()).output().unwrap();
        let message = String::from_utf8_lossy(&output.stdout);
        assert!(output.status.success(), "{}: {message}", input.display());
        std::fs::read(file.path()).unwrap()
    }
}

/// The assembly file of a shader, if it is written in assembly.
fn assembly(name: &str) -> Option<std::path::PathBuf> {
    let path = folder().join(format!("{name}.spvasm"));
    path.exists().then_some(path)
}

/// Compiles a shader's source to SPIR-V.
fn compiled(name: &str) -> Vec<u8> {
    if let Some(path) = assembly(name) {
        return ASSEMBLER.output(&["--target-env", "spv1.5"], &path);
    }
    COMPILER.output(&["-V", "--target-env", "vulkan1.3"], &folder().join(name))
}

/// Asserts that a checked-in binary equals `fresh`.
fn assert_kept(name: &str, fresh: &[u8]) {
    let kept = std::fs::read(folder().join(format!("{name}.spv"))).unwrap();
    assert!(comparable(&kept) == comparable(fresh), "{name}.spv isn't what its source compiles to");
}

#[gaurast_runner::test(needs = [COMPILER.need(), ASSEMBLER.need()])]
fn kept_binaries_match_their_sources() {
    COMPILER.require_version();
    ASSEMBLER.require_version();
    for name in all_shaders() {
        if !name.ends_with(".opt") {
            assert_kept(&name, &compiled(&name));
        }
    }
}

#[gaurast_runner::test(needs = [COMPILER.need(), OPTIMIZER.need()])]
fn kept_optimized_binaries_match_their_sources() {
    COMPILER.require_version();
    OPTIMIZER.require_version();
    let folder = tempfile::tempdir().unwrap();
    let binary = folder.path().join("compiled.spv");
    for name in all_shaders() {
        if let Some(source) = name.strip_suffix(".opt") {
            std::fs::write(&binary, compiled(source)).unwrap();
            let arguments = ["-O", "--target-env=vulkan1.3"];
            assert_kept(&name, &OPTIMIZER.output(&arguments, &binary));
        }
    }
}

/// Shaders whose disassemblies are checked in, to be reviewed when the translation changes.
const KEPT: [&str; 3] = ["triangle.vert", "mandelbrot.comp", "matrix_product.comp"];

#[gaurast_runner::test]
fn disassemblies_are_as_kept() {
    for name in KEPT {
        let text = translated(name, &Specialization::default()).program.to_string();
        let path = folder().join(format!("{name}.ir"));
        if std::env::var_os("GAURAST_BLESS").is_some() {
            std::fs::write(&path, &text).unwrap();
        }
        let kept = std::fs::read_to_string(&path).unwrap();
        assert_eq!(text, kept, "{name}: run with GAURAST_BLESS=1 to keep the new disassembly");
    }
}
