//! The samples under the layer: right programs, in C and in Rust.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use gaurast_runner::{Case, Need, Variant, built_example};
use gaurast_testkit::loader::{layer_manifest, manifest};

/// The page that prints the settings of the Khronos layer.
const PAGE: &str = include_str!("../../docs/layer.md");
const KHRONOS: &str = "VK_LAYER_KHRONOS_validation";
const OWN: &str = "VK_LAYER_GAURAST_validation";

/// The file of settings that the page prints.
pub fn settings() -> &'static str {
    let (_, after) = PAGE.split_once("```ini\n").expect("docs/layer.md prints the file");
    after.split_once("```").expect("the block ends").0
}

/// Writes the page's file of settings to a folder.
fn write_settings(folder: &Path) -> PathBuf {
    let path = folder.join("vk_layer_settings.txt");
    std::fs::write(&path, settings()).expect("the settings are written");
    path
}

/// Compiles a C program.
fn compile(source: &str, folder: &Path) -> PathBuf {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let (file, program) = (folder.join("program.c"), folder.join("program"));
    std::fs::write(&file, source).expect("the program is written");
    let output = Command::new("cc")
        .arg("-std=c11")
        .arg("-I")
        .arg(root.join("api/include"))
        .arg(&file)
        .args(["-lvulkan", "-lm", "-o"])
        .arg(&program)
        .output()
        .expect("cc runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    program
}

/// Runs a program under layers.
fn run(program: &Path, arguments: &[&str], layers: &str, folder: &Path) -> Output {
    let (driver, _) = (manifest(folder), layer_manifest(folder));
    let settings = write_settings(folder);
    Command::new(program)
        .args(arguments)
        .current_dir(folder)
        .env("VK_DRIVER_FILES", &driver)
        .env("VK_ICD_FILENAMES", &driver)
        .env("VK_ADD_LAYER_PATH", folder)
        .env("VK_INSTANCE_LAYERS", layers)
        .env("VK_LAYER_SETTINGS_PATH", settings)
        .env_remove("VK_LAYER_CUSTOM_STYPE_LIST")
        .env_remove("VK_LAYER_MESSAGE_ID_FILTER")
        .output()
        .expect("the program runs")
}

/// A program's standard output and standard error.
fn said(output: &Output) -> String {
    assert!(output.status.success(), "{output:?}");
    let text = [&output.stdout[..], &output.stderr[..]].concat();
    String::from_utf8_lossy(&text).into_owned()
}

const HELLO: &str = include_str!("../../samples/c/hello_gaussians.c");

#[gaurast_runner::test(needs = [
    Need::Program("cc"),
    Need::File("/usr/include/vulkan/vulkan.h"),
    Need::ValidationLayer,
])]
fn nothing_is_said_of_the_c_program() {
    let folder = tempfile::tempdir().expect("a folder");
    let program = compile(HELLO, folder.path());
    for layers in [OWN.to_owned(), format!("{OWN}:{KHRONOS}")] {
        let text = said(&run(&program, &[], &layers, folder.path()));
        assert_eq!(text, "", "{layers}");
    }
}

/// A program without a messenger hears of its mistake on the standard error.
#[gaurast_runner::test(needs = [
    Need::Program("cc"),
    Need::File("/usr/include/vulkan/vulkan.h"),
    Need::VulkanLoader,
])]
fn a_mistake_of_the_c_program_is_told_on_the_standard_error() {
    let folder = tempfile::tempdir().expect("a folder");
    let right = "vkGaussianCameraLookAtGAURAST(eye, ahead, up";
    assert!(HELLO.contains(right));
    let away = HELLO.replace(right, "vkGaussianCameraLookAtGAURAST(ahead, eye, up");
    let program = compile(&away, folder.path());
    let text = said(&run(&program, &[], OWN, folder.path()));
    assert!(text.contains("none of 5 Gaussians is drawn: 5 are behind"), "{text}");
    assert!(text.contains("[GAURAST-Draw-behind-camera]"), "{text}");
    assert_eq!(text.lines().count(), 1, "{text}");
}

/// The samples in Rust, with their arguments, and what each leaves or says.
const SAMPLES: [(&str, &[&str], Left); 7] = [
    ("hello_gaussians", &[], Left::File("hello_gaussians.png")),
    ("hello_tessellation", &[], Left::File("hello_tessellation.png")),
    ("hello_triangle", &[], Left::File("hello_triangle.png")),
    ("picking", &[], Left::Text(": Gaussian ")),
    ("wobbling_gaussians", &[], Left::File("wobbling_gaussians.png")),
    ("tilted_plane", &["."], Left::File("surfels.png")),
    ("gallery", &["."], Left::File("GALLERY.md")),
];

/// A trace of a sample.
enum Left {
    File(&'static str),
    Text(&'static str),
}

fn samples() -> Vec<Variant> {
    SAMPLES.map(|(name, ..)| Variant::new(name)).into()
}

#[gaurast_runner::test(needs = [Need::ValidationLayer], each = samples())]
fn nothing_is_said_of_the_samples(case: &Case) {
    let sample = SAMPLES.iter().find(|(name, ..)| *name == case.variant());
    let (name, arguments, left) = sample.expect("a sample");
    let program = built_example("gaurast-examples", name);
    let arguments = [*arguments, &["--loader"][..]].concat();
    for layers in [OWN.to_owned(), format!("{OWN}:{KHRONOS}")] {
        let folder = tempfile::tempdir().expect("a folder");
        let output = run(&program, &arguments, &layers, folder.path());
        // The gallery shows a transmittance floor that ends pixels at once. The layer's warning of it is right.
        let shown = if *name == "gallery" { "[GAURAST-Pipeline-alpha-ceiling]" } else { "[]" };
        let text = said(&output);
        let text: String = text.split_inclusive('\n').filter(|line| !line.contains(shown)).collect();
        let is_silent = output.stderr.is_empty();
        assert!(is_silent || *name == "gallery", "{layers}: {text}");
        for layer in [OWN, KHRONOS, "VUID", "UNASSIGNED"] {
            assert!(!text.contains(layer), "{layers}: {text}");
        }
        match left {
            Left::File(file) => assert!(folder.path().join(file).exists(), "{file}"),
            Left::Text(words) => assert!(text.contains(words), "{text}"),
        }
    }
}

/// The renderer of the `gaurast` command, which uploads through a staging buffer.
#[gaurast_runner::test(needs = [Need::VulkanLoader])]
fn nothing_is_said_of_the_renderer(case: &Case) {
    let folder = tempfile::tempdir().expect("a folder");
    if !case.is_alone() {
        manifest(folder.path());
        layer_manifest(folder.path());
        let mut command = case.command();
        let driver = folder.path().join("gaurast_icd.json");
        command
            .env("VK_DRIVER_FILES", &driver)
            .env("VK_ICD_FILENAMES", &driver)
            .env("VK_ADD_LAYER_PATH", folder.path())
            .env("VK_INSTANCE_LAYERS", OWN);
        let output = command.output().expect("the test starts itself");
        let text = said(&output);
        assert!(text.contains(" 1 passed"), "{text}");
        assert!(!text.contains(OWN), "{text}");
        return;
    }
    // SAFETY: the loader is the system's own.
    let entry = unsafe { ash::Entry::load() }.expect("the loader");
    let mut renderer = gaurast_render::Renderer::new(entry).expect("a renderer");
    let scene = gaurast_scene::garden::scene(7, 2000);
    let camera = gaurast_scene::garden::camera(None, [96, 64]).expect("a camera");
    let picture = renderer.draw(&scene, &camera).expect("a picture");
    assert!(picture.pixels.iter().any(|pixel| pixel[3] > 0.5));
}
