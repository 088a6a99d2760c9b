//! C programs under ThreadSanitizer, AddressSanitizer and Valgrind's Helgrind hear nothing of the driver, and still hear of
//! themselves.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use gaurast_runner::{Case, Need, Variant, built_library};
use tempfile::TempDir;

/// The flag with which the compiler instruments a program for ThreadSanitizer.
const THREAD: &str = "-fsanitize=thread";

/// A program in C.
struct Program {
    name: &'static str,
    source: &'static str,
}

const PROGRAMS: [Program; 2] = [
    Program { name: "hello_gaussians", source: "../samples/c/hello_gaussians.c" },
    Program { name: "recording_threads", source: "robustness/sanitizers/recording_threads.c" },
];

impl Program {
    /// The program of a test's variant.
    fn of(case: &Case) -> &'static Self {
        PROGRAMS.iter().find(|program| program.name == case.variant()).expect("a program")
    }

    /// Compiles it.
    fn compile(&self, folder: &Path, flags: &[&str]) -> PathBuf {
        let root = Path::new(env!("CARGO_MANIFEST_DIR"));
        let program = folder.join(self.name);
        let output = Command::new("cc")
            .args(["-std=c11", "-g", "-O1"])
            .args(flags)
            .arg("-I")
            .arg(root.join("../api/include"))
            .arg(root.join(self.source))
            .args(["-lvulkan", "-lpthread", "-lm", "-o"])
            .arg(&program)
            .output()
            .expect("the compiler starts");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        program
    }
}

/// Runs a command with the built library as the loader's only driver.
fn run(command: &mut Command, folder: &TempDir) -> Output {
    let manifest = folder.path().join("gaurast_icd.json");
    let text = serde_json::json!({
        "file_format_version": "1.0.0",
        "ICD": {
            "library_path": built_library("gaurast-icd", "libvulkan_gaurast.so"),
            "api_version": "1.3.281",
        },
    });
    std::fs::write(&manifest, text.to_string()).expect("written");
    command
        .current_dir(folder)
        .env("VK_DRIVER_FILES", &manifest)
        .env("VK_ICD_FILENAMES", &manifest)
        .env_remove("VK_INSTANCE_LAYERS")
        .env_remove("TSAN_OPTIONS")
        // More workers than processors, so that work is handed over.
        .env("GAURAST_THREADS", "4")
        .output()
        .expect("the command starts")
}

/// Runs a program under ThreadSanitizer, in an address space without randomization, which older runtimes need.
fn under_thread_sanitizer(program: &Program, arguments: &[&str]) -> (Output, String) {
    let folder = tempfile::tempdir().expect("a folder");
    let program = program.compile(folder.path(), &[THREAD]);
    let output = run(Command::new("setarch").arg("-R").arg(program).args(arguments), &folder);
    let errors = String::from_utf8_lossy(&output.stderr).into_owned();
    (output, errors)
}

fn programs() -> Vec<Variant> {
    PROGRAMS.iter().map(|program| Variant::new(program.name)).collect()
}

const C: [Need; 3] = [Need::Program("cc"), Need::File("/usr/include/vulkan/vulkan.h"), Need::VulkanLoader];

#[gaurast_runner::test(needs = [C[0], C[1], C[2], Need::Program("setarch")], each = programs())]
fn thread_sanitizer_reports_nothing(case: &Case) {
    let (output, errors) = under_thread_sanitizer(Program::of(case), &[]);
    assert!(output.status.success() && !errors.contains("ThreadSanitizer"), "{errors}");
}

/// The driver hides no race of the program itself, and reports of it name the program's line.
#[gaurast_runner::test(needs = [C[0], C[1], C[2], Need::Program("setarch")])]
fn thread_sanitizer_finds_the_programs_own_race() {
    let (output, errors) = under_thread_sanitizer(&PROGRAMS[1], &["race"]);
    assert!(!output.status.success(), "{errors}");
    let reports: Vec<&str> = errors.lines().filter(|line| line.starts_with("SUMMARY")).collect();
    assert!(!reports.is_empty(), "{errors}");
    assert!(reports.iter().all(|report| report.contains("recording_threads.c")), "{errors}");
}

/// The program destroys its objects, so that nothing leaks. (The C sample leaves that to the end of its process.)
#[gaurast_runner::test(needs = C)]
fn address_sanitizer_reports_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    let program = PROGRAMS[1].compile(folder.path(), &["-fsanitize=address,undefined"]);
    let output = run(&mut Command::new(program), &folder);
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && errors.is_empty(), "{errors}");
}

/// Runs a program under Helgrind with the driver's suppressions. It exits with 9 if Helgrind reports an error.
fn under_helgrind(program: &Program, arguments: &[&str]) -> (Output, String) {
    let folder = tempfile::tempdir().expect("a folder");
    let program = program.compile(folder.path(), &[]);
    let suppressions = Path::new(env!("CARGO_MANIFEST_DIR")).join("../driver/icd/helgrind.supp");
    let output = run(
        Command::new("valgrind")
            .args(["--tool=helgrind", "--error-exitcode=9"])
            .arg(format!("--suppressions={}", suppressions.display()))
            .arg(program)
            .args(arguments)
            // Valgrind does not know AVX-512, and is slow.
            .env("GAURAST_SIMD", "sse2")
            .env("GAURAST_TIMEOUT_MS", "600000"),
        &folder,
    );
    let errors = String::from_utf8_lossy(&output.stderr).into_owned();
    (output, errors)
}

#[gaurast_runner::test(needs = [C[0], C[1], C[2], Need::Program("valgrind")], each = programs())]
fn helgrind_reports_nothing_with_the_suppressions(case: &Case) {
    let (output, errors) = under_helgrind(Program::of(case), &[]);
    assert!(output.status.success() && errors.contains("ERROR SUMMARY: 0 errors"), "{errors}");
}

#[gaurast_runner::test(needs = [C[0], C[1], C[2], Need::Program("valgrind")])]
fn helgrind_finds_the_programs_own_race() {
    let (output, errors) = under_helgrind(&PROGRAMS[1], &["race"]);
    assert_eq!(output.status.code(), Some(9), "{errors}");
    assert!(errors.contains("recording_threads.c"), "{errors}");
}
