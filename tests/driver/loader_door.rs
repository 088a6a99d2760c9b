//! Gaussian draws through the Vulkan loader: the shared library, found by its manifest.
//!
//! The loader and the layers read the environment, so each test starts itself again in a process
//! of its own, which leaves its findings in a folder. Without a loader the tests are skipped.

use std::ffi::CStr;
use std::path::{Path, PathBuf};
use std::process::Command;

use ash::vk::{self, TaggedStructure};
use gaurast::vk::{
    GaussianCameraGAURAST, PhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST,
    PhysicalDeviceGaussianPrimitiveTopologyPropertiesGAURAST,
    PipelineGaussianApproximationStateCreateInfoGAURAST, PipelineGaussianStateCreateInfoGAURAST,
};
use gaurast_tests::contexts::{
    Buffer, Context, DeviceScene, Message, Pass, PassObject, Pipeline, PipelineOptions, Settings,
    Target, over,
};
use gaurast_tests::scenes;

/// The folder for what the process inside finds; set there only.
const FINDINGS: &str = "GAURAST_TEST_FINDINGS";

const VALIDATION: &CStr = c"VK_LAYER_KHRONOS_validation";

/// What the validation layer says of valid Gaussian draws, since it does not know the extension:
/// the message's id, a part of its text, and why.
const EXPECTED: &[[&str; 3]] = &[
    [
        "VUID_Undefined",
        "VK_GAURAST_gaussian_primitive_topology is not supported by this layer",
        "the extension is not registered",
    ],
    [
        "VUID-VkPipelineInputAssemblyStateCreateInfo-topology-parameter",
        "topology",
        "the topology is the extension's",
    ],
    [
        "VUID-VkGraphicsPipelineCreateInfo-pStages-06896",
        "does not contain any pre-raster shaders",
        "fixed-function projection has no vertex stage",
    ],
    [
        "VUID-VkGraphicsPipelineCreateInfo-stageCount-06604",
        "stageCount is 0",
        "fixed-function projection has no vertex stage",
    ],
    [
        "VUID-VkGraphicsPipelineCreateInfo-pStages-06600",
        "stageCount must be greater than 0",
        "fixed-function projection has no vertex stage",
    ],
    [
        "VUID-VkGraphicsPipelineCreateInfo-stage-00727",
        "Vertex Shader required",
        "fixed-function projection has no vertex stage",
    ],
];

/// The shared library that was built with this test.
fn library() -> PathBuf {
    let test = std::env::current_exe().expect("the test's own path");
    // Tests lie in deps, the library there and, if it was asked for, above.
    let folders = test.ancestors().skip(1).take(2);
    folders
        .map(|folder| folder.join("libvulkan_gaurast.so"))
        .find(|library| library.exists())
        .expect("cargo builds the shared library with the driver")
}

/// Writes a manifest for the library.
fn manifest(folder: &Path) -> PathBuf {
    let manifest = serde_json::json!({
        "file_format_version": "1.0.0",
        "ICD": { "library_path": library(), "api_version": "1.3.281" },
    });
    let path = folder.join("gaurast_icd.json");
    std::fs::write(&path, manifest.to_string()).expect("written");
    path
}

/// Structures' types and sizes, as the validation layer wants to be told of those that it does not
/// know.
fn unregistered_structures() -> String {
    use PhysicalDeviceGaussianPrimitiveTopologyFeaturesGAURAST as Features;
    use PhysicalDeviceGaussianPrimitiveTopologyPropertiesGAURAST as Properties;
    use PipelineGaussianApproximationStateCreateInfoGAURAST as Approximation;
    use PipelineGaussianStateCreateInfoGAURAST as State;
    let separator = if cfg!(windows) { ";" } else { ":" };
    [
        (Features::STRUCTURE_TYPE, size_of::<Features<'_>>()),
        (Properties::STRUCTURE_TYPE, size_of::<Properties<'_>>()),
        (State::STRUCTURE_TYPE, size_of::<State<'_>>()),
        (
            Approximation::STRUCTURE_TYPE,
            size_of::<Approximation<'_>>(),
        ),
    ]
    .map(|(structure, size)| format!("{}{separator}{size}", structure.as_raw()))
    .join(separator)
}

/// Runs `inside` in a process where the loader finds this driver alone, then `outside`, both with
/// the folder of findings.
fn through_the_loader(
    test: &str,
    inside: impl FnOnce(ash::Entry, &Path),
    outside: impl FnOnce(&Path),
) {
    // SAFETY: the loader is the system's own.
    let entry = match unsafe { ash::Entry::load() } {
        Ok(entry) => entry,
        Err(error) => {
            eprintln!("skipped: there is no Vulkan loader here ({error})");
            return;
        }
    };
    if let Some(findings) = std::env::var_os(FINDINGS) {
        return inside(entry, Path::new(&findings));
    }
    let folder = tempfile::tempdir().expect("a folder");
    let manifest = manifest(folder.path());
    let output = Command::new(std::env::current_exe().expect("the test's own path"))
        .args(["--exact", &format!("loader_door::{test}"), "--nocapture"])
        .env(FINDINGS, folder.path())
        .env("VK_DRIVER_FILES", &manifest)
        .env("VK_ICD_FILENAMES", &manifest)
        .env("VK_LAYER_CUSTOM_STYPE_LIST", unregistered_structures())
        .env_remove("VK_INSTANCE_LAYERS")
        .output()
        .expect("the test starts itself");
    let text = String::from_utf8_lossy(&output.stdout) + String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{text}");
    assert!(text.contains("1 passed"), "{text}");
    for line in text.lines().filter(|line| line.starts_with("skipped:")) {
        eprintln!("{line}");
    }
    outside(folder.path());
}

const SIZE: [u32; 2] = [203, 139];

fn camera() -> GaussianCameraGAURAST<'static> {
    scenes::camera(SIZE[0], SIZE[1]).to_vulkan()
}

/// A picture that takes dynamic rendering, a render pass, indices and blending to draw.
fn picture(context: &Context) -> Vec<[f32; 4]> {
    let scene = scenes::cloud(31, 2000, 3);
    let on_device = DeviceScene::new(context, &scene);
    let indices: Vec<u32> = (0..on_device.count).rev().step_by(3).collect();
    let index_buffer = Buffer::of(context, &indices);
    let options = PipelineOptions {
        blend: over(),
        ..PipelineOptions::new(scene.degree)
    };
    let target = Target::new(context, options.format, SIZE);
    let object = PassObject::new(context, &target);
    let pipeline = Pipeline::new(context, &options);
    let pipeline_of_object = Pipeline::new(
        context,
        &PipelineOptions {
            render_pass: object.render_pass,
            ..options
        },
    );
    context.run(|commands| {
        let background = [0.1, 0.2, 0.3, 1.0];
        commands.pass(&target, &Pass::clear(background), || ());
        let pass = Pass {
            area: Some(vk::Rect2D::default().extent(target.extent)),
            object: Some(&object),
            ..Pass::clear(background)
        };
        commands.pass(&target, &pass, || {
            commands.bind(&pipeline_of_object, &on_device, &camera());
            commands.draw([500, 1, 1000, 0]);
        });
        commands.pass(&target, &Pass::default(), || {
            commands.bind(&pipeline, &on_device, &camera());
            commands.bind_indices(&index_buffer);
            commands.draw_indexed(indices.len() as u32, 0, 0);
        });
    });
    target.read()
}

#[test]
fn the_picture_is_that_of_the_embedded_door() {
    through_the_loader(
        "the_picture_is_that_of_the_embedded_door",
        |entry, findings| {
            let context = Context::new(entry, &[]);
            let picture = picture(&context);
            assert_eq!(context.messages(), []);
            let bytes: &[u8] = bytemuck::cast_slice(&picture);
            std::fs::write(findings.join("picture"), bytes).expect("written");
        },
        |findings| {
            let context = Context::embedded(&Settings::default());
            let embedded = picture(&context);
            let loaded = std::fs::read(findings.join("picture")).expect("the picture");
            let embedded: &[u8] = bytemuck::cast_slice(&embedded);
            assert!(loaded == embedded);
        },
    );
}

#[test]
fn the_validation_layer_says_what_is_expected() {
    through_the_loader(
        "the_validation_layer_says_what_is_expected",
        |entry, findings| {
            // SAFETY: the loader is loaded.
            let layers = unsafe { entry.enumerate_instance_layer_properties() };
            let layers = layers.expect("layers");
            if !layers
                .iter()
                .any(|layer| layer.layer_name_as_c_str() == Ok(VALIDATION))
            {
                eprintln!("skipped: there is no validation layer here");
                return;
            }
            let context = Context::new(entry, &[VALIDATION]);
            let picture = picture(&context);
            let messages = context.messages();
            let unexpected: Vec<_> = messages
                .iter()
                .filter(|message| !EXPECTED.iter().any(|expected| is(message, expected)))
                .collect();
            assert!(unexpected.is_empty(), "{unexpected:#?}");
            // Layers of other versions say less.
            for expected in EXPECTED {
                if !messages.iter().any(|message| is(message, expected)) {
                    eprintln!("not said by this layer: {}", expected[0]);
                }
            }
            let bytes: &[u8] = bytemuck::cast_slice(&picture);
            std::fs::write(findings.join("picture"), bytes).expect("written");
        },
        |findings| {
            // Not there where the layer isn't.
            let Ok(validated) = std::fs::read(findings.join("picture")) else {
                return;
            };
            let context = Context::embedded(&Settings::default());
            let embedded = picture(&context);
            let embedded: &[u8] = bytemuck::cast_slice(&embedded);
            assert!(validated == embedded);
        },
    );
}

fn is(message: &Message, [id, text, _]: &[&str; 3]) -> bool {
    message.id == *id && message.text.contains(text)
}
