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

/// Writes the page's file of settings to a folder, and further ones.
fn write_settings(folder: &Path, further: &str) -> PathBuf {
    let path = folder.join("vk_layer_settings.txt");
    std::fs::write(&path, format!("{}{further}\n", settings())).expect("the settings are written");
    path
}

/// The setting of the Khronos layer that has it validate synchronization.
const SYNCHRONIZATION: &str =
    "khronos_validation.enables = VK_VALIDATION_FEATURE_ENABLE_SYNCHRONIZATION_VALIDATION_EXT";

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
    run_with("", program, arguments, layers, folder)
}

/// Runs a program under layers with further settings.
fn run_with(further: &str, program: &Path, arguments: &[&str], layers: &str, folder: &Path) -> Output {
    let (driver, _) = (manifest(folder), layer_manifest(folder));
    let settings = write_settings(folder, further);
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
const SCENE: &str = include_str!("../../samples/c/gaussian_scene.c");

/// The messages of a C program like the scene's under layers; the Khronos layer validates synchronization.
fn scene_says(source: &str, layers: &str, folder: &Path) -> String {
    let program = compile(source, folder);
    let shaders = concat!(env!("CARGO_MANIFEST_DIR"), "/../samples/c/shaders");
    said(&run_with(SYNCHRONIZATION, &program, &[shaders], layers, folder))
}

/// The scene with one of its lines replaced.
fn changed(right: &str, wrong: &str) -> String {
    assert_eq!(SCENE.matches(right).count(), 1, "{right}");
    SCENE.replace(right, wrong)
}

/// The colour of a pixel of the picture that the scene's program leaves.
fn pixel(folder: &Path, [x, y]: [usize; 2]) -> [u8; 3] {
    let picture = std::fs::read(folder.join("gaussian_scene.ppm")).expect("the picture");
    let texels = picture.strip_prefix(b"P6\n320 240\n255\n").expect("its size");
    let texel = texels[3 * (320 * y + x)..].first_chunk().expect("its texels");
    *texel
}

/// The scene's program draws, culls and picks what it should, and nothing is said of it.
#[gaurast_runner::test(needs = [
    Need::Program("cc"),
    Need::File("/usr/include/vulkan/vulkan.h"),
    Need::ValidationLayer,
])]
fn nothing_is_said_of_the_c_scene() {
    let folder = tempfile::tempdir().expect("a folder");
    for layers in [OWN.to_owned(), format!("{OWN}:{KHRONOS}")] {
        let text = scene_says(SCENE, &layers, folder.path());
        let lines: Vec<_> = text.lines().collect();
        let &[clusters, middle, left, corner] = &lines[..] else {
            panic!("{layers}: {text}");
        };
        let drawn: u32 = clusters.strip_suffix(" of 12 clusters").expect("a count").parse().expect("a number");
        assert!((4..12).contains(&drawn), "some clusters are outside of the picture: {text}");
        assert!(middle.ends_with(", of the ball"), "{text}");
        assert!(left.ends_with(", of the tuft"), "{text}");
        assert!(corner.ends_with(": no Gaussian"), "{text}");
        let [red, _, blue] = pixel(folder.path(), [160, 100]);
        assert!(red > blue, "the ball is orange");
        let [red, green, blue] = pixel(folder.path(), [40, 210]);
        assert!(green > red && green > blue, "the tuft is green");
        assert_eq!(pixel(folder.path(), [4, 4]), [158, 173, 191], "fog, as it is cleared");
        let [red, _, blue] = pixel(folder.path(), [160, 80]);
        assert!(blue > red, "the box stands above the ball");
    }
}

/// A barrier of the scene, and none or another in its place: what the validation of synchronization is for.
#[gaurast_runner::test(needs = [
    Need::Program("cc"),
    Need::File("/usr/include/vulkan/vulkan.h"),
    Need::ValidationLayer,
])]
fn barriers_of_the_c_scene_are_heard_of_with_the_khronos_layer() {
    let folder = tempfile::tempdir().expect("a folder");
    let right = "VK_PIPELINE_STAGE_2_DRAW_INDIRECT_BIT, VK_ACCESS_2_INDIRECT_COMMAND_READ_BIT";
    let others = ["0, 0", "VK_PIPELINE_STAGE_2_VERTEX_INPUT_BIT, VK_ACCESS_2_VERTEX_ATTRIBUTE_READ_BIT"];
    for other in others {
        let text = scene_says(&changed(right, other), &format!("{OWN}:{KHRONOS}"), folder.path());
        assert!(text.contains("SYNC-HAZARD-READ-AFTER-WRITE"), "{other}: {text}");
        assert!(!text.contains(OWN), "{text}");
    }
}

/// A mistake in the scene's program: a line, what stands in its place, and the id of what the layer says.
struct Slip {
    right: &'static str,
    wrong: &'static str,
    id: &'static str,
}

const fn slip(right: &'static str, wrong: &'static str, id: &'static str) -> Slip {
    Slip { right, wrong, id }
}

const CAMERA: &str = "set_cameras(commands, 1, camera);";
const LOOK_AT: &str = "return vkGaussianCameraLookAtGAURAST(eye, target, up, 0.85, WIDTH, HEIGHT, 0.2f);";
const COLOR: &str = "at[11 + i] = (color[i] * (1.0f + 0.25f * number()) - 0.5f) / 0.28209479f;";
const SCALE: &str = "at[3 + i] = size * (1.0f + 0.5f * number());";

/// Mistakes of which nothing was said when a stranger's program of this kind made them.
const SLIPS: [Slip; 21] = [
    slip(
        LOOK_AT,
        "VkGaussianCameraGAURAST c = vkGaussianCameraLookAtGAURAST(eye, target, up, 0.85, WIDTH, HEIGHT, 0.2f); float t[9]; \
         for (int i = 0; i < 9; i++) t[i] = c.rotation[i % 3 * 3 + i / 3]; memcpy(c.rotation, t, sizeof t); return c;",
        "GAURAST-Draw-transposed-rotation",
    ),
    slip(
        LOOK_AT,
        "return vkGaussianCameraLookAtGAURAST(eye, target, up, 0.85, 2 * WIDTH, 2 * HEIGHT, 0.2f);",
        "GAURAST-Draw-picture-size",
    ),
    slip(
        LOOK_AT,
        "return vkGaussianCameraLookAtGAURAST(eye, target, up, 0.85, WIDTH, HEIGHT, 5.0f);",
        "GAURAST-Draw-behind-camera",
    ),
    slip(
        CAMERA,
        "VkGaussianCameraGAURAST c = *camera; c.depthCoefficients[0] = c.depthCoefficients[1] = 0; set_cameras(commands, 1, &c);",
        "GAURAST-Draw-depth-coefficients",
    ),
    slip(
        CAMERA,
        "VkGaussianCameraGAURAST c = *camera; c.depthCoefficients[1] *= 2; set_cameras(commands, 1, &c);",
        "GAURAST-Draw-depth-coefficients",
    ),
    slip(
        CAMERA,
        "VkGaussianCameraGAURAST c = *camera; c.depthCoefficients[0] = 0; c.depthCoefficients[1] = 0.2f; \
         set_cameras(commands, 1, &c);",
        "GAURAST-Draw-depth-compare",
    ),
    slip(
        CAMERA,
        "VkGaussianCameraGAURAST c = *camera; c.focalLength[0] = 1e38f; set_cameras(commands, 1, &c);",
        "GAURAST-Camera-focal-length",
    ),
    slip(COLOR, "at[11 + i] = fminf(1.0f, color[i] * (1.0f + 0.25f * number()));", "GAURAST-Draw-colors"),
    slip(COLOR, "at[11 + i] = floorf(200.0f * color[i] * (1.0f + 0.25f * number()));", "GAURAST-Draw-colors"),
    slip(SCALE, "at[3 + i] = 0.0f * size;", "GAURAST-Draw-zero-scale"),
    slip(
        "by_vertex.stride = FLOATS * sizeof(float);",
        "by_vertex.stride = FLOATS * sizeof(float); by_vertex.inputRate = VK_VERTEX_INPUT_RATE_INSTANCE;",
        "GAURAST-Draw-instance-rate",
    ),
    slip(
        "frame->draws.handle, FIRST_DRAW, frame->draws.handle, 0, CLUSTERS,",
        "frame->draws.handle, FIRST_DRAW, frame->draws.handle, 16, CLUSTERS,",
        "GAURAST-Draw-indirect-count",
    ),
    slip("frame->draws.handle, 0, CLUSTERS,", "frame->draws.handle, 0, 0,", "GAURAST-Draw-indirect-count"),
    slip("        sizeof(VkDrawIndirectCommand));", "        20);", "GAURAST-Draw-indirect-stride"),
    slip("{CLUSTERS, CLUSTER};", "{CLUSTERS, 10 * CLUSTER};", "GAURAST-Draw-vertices-past-buffer"),
    slip(
        ".depthCompareOp = VK_COMPARE_OP_LESS}",
        ".depthCompareOp = gaussian ? VK_COMPARE_OP_GREATER : VK_COMPARE_OP_LESS}",
        "GAURAST-Draw-depth-compare",
    ),
    slip(
        "create_pipeline(&gaussian, 1, &resolve",
        "create_pipeline(&gaussian, 0, &resolve",
        "GAURAST-Pipeline-integer-attachment",
    ),
    slip("{COLOR, PICK};", "{PICK, PICK};", "GAURAST-Pipeline-output-type"),
    slip(".depthStencil = {1.0f, 0}", ".depthStencil = {0.0f, 0}", "GAURAST-Draw-depth-clear"),
    slip("{0, 0, WIDTH, HEIGHT, 0, 1}", "{0, 0, WIDTH, HEIGHT, 1, 0}", "GAURAST-Draw-depth-compare"),
    slip(
        "    vkCmdPushConstants(commands, draw_layout, stages, 0, 64, projection);\n    \
         vkCmdPushConstants(commands, draw_layout, stages, 64, sizeof FOG, FOG);\n",
        "    (void)stages, (void)projection;\n",
        "GAURAST-Draw-push-constants",
    ),
];

/// Each slip is made alone, and heard of on the standard error.
#[gaurast_runner::test(needs = [
    Need::Program("cc"),
    Need::File("/usr/include/vulkan/vulkan.h"),
    Need::VulkanLoader,
])]
fn slips_in_the_c_scene_are_heard_of() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut silent = Vec::new();
    for Slip { right, wrong, id } in SLIPS {
        let text = scene_says(&changed(right, wrong), OWN, folder.path());
        if !text.contains(&format!("[{id}]")) {
            silent.push((wrong, id, text));
        }
    }
    assert!(silent.is_empty(), "{silent:#?}");
}

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
