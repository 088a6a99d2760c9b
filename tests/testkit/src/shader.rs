//! Shaders in GLSL. `glslangValidator` compiles them when a test needs them, and the result is kept for later runs.

use ash::vk;
use gaurast_runner::Need;
use std::collections::HashMap;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{LazyLock, Mutex, PoisonError};

/// The compiler of the shaders that are written in GLSL, which tests need.
pub const GLSLANG: Need = Need::Program("glslangValidator");

/// The folder of the shaders of the compiler's tests.
const TRANSLATED: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../driver/spirv/tests/shaders");

/// The SPIR-V of a shader of the compiler's tests, such as `colored.vert`.
///
/// # Panics
/// If there is no such shader.
pub fn spirv(name: &str) -> Vec<u32> {
    let path = Path::new(TRANSLATED).join(format!("{name}.spv"));
    words(&std::fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display())))
}

/// Bytes as SPIR-V's words.
pub fn words(bytes: &[u8]) -> Vec<u32> {
    bytemuck::pod_collect_to_vec(bytes)
}

/// A shader stage.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Stage {
    /// Vertex shaders.
    Vertex,
    /// Tessellation control shaders.
    TessellationControl,
    /// Tessellation evaluation shaders.
    TessellationEvaluation,
    /// Geometry shaders.
    Geometry,
    /// Fragment shaders.
    Fragment,
    /// Compute shaders.
    Compute,
}

impl Stage {
    /// Vulkan's flag of the stage.
    pub fn flag(self) -> vk::ShaderStageFlags {
        match self {
            Self::Vertex => vk::ShaderStageFlags::VERTEX,
            Self::TessellationControl => vk::ShaderStageFlags::TESSELLATION_CONTROL,
            Self::TessellationEvaluation => vk::ShaderStageFlags::TESSELLATION_EVALUATION,
            Self::Geometry => vk::ShaderStageFlags::GEOMETRY,
            Self::Fragment => vk::ShaderStageFlags::FRAGMENT,
            Self::Compute => vk::ShaderStageFlags::COMPUTE,
        }
    }

    fn suffix(self) -> &'static str {
        match self {
            Self::Vertex => "vert",
            Self::TessellationControl => "tesc",
            Self::TessellationEvaluation => "tese",
            Self::Geometry => "geom",
            Self::Fragment => "frag",
            Self::Compute => "comp",
        }
    }
}

/// The SPIR-V of GLSL `source`, which is preceded by `#version 450`.
///
/// # Panics
/// If the source is wrong, or there is no compiler.
pub fn compile(stage: Stage, source: &str) -> Vec<u32> {
    type Compiled = Mutex<HashMap<(Stage, String), Vec<u32>>>;
    static COMPILED: LazyLock<Compiled> = LazyLock::new(Mutex::default);
    // The lock is held while compiling, so that nothing is compiled twice.
    let mut compiled = COMPILED.lock().unwrap_or_else(PoisonError::into_inner);
    let key = (stage, source.to_owned());
    compiled.entry(key).or_insert_with(|| kept_or_compiled(stage, source)).clone()
}

fn kept_or_compiled(stage: Stage, source: &str) -> Vec<u32> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../target/triangle-shaders");
    let mut hasher = DefaultHasher::new();
    (stage, source).hash(&mut hasher);
    let path = folder.join(format!("{:016x}.{}", hasher.finish(), stage.suffix()));
    let kept = path.with_extension("spv");
    // The source is compared too, so that a hash collision cannot exchange shaders.
    if std::fs::read_to_string(&path).is_ok_and(|text| text == whole(source))
        && let Ok(bytes) = std::fs::read(&kept)
    {
        return bytemuck::pod_collect_to_vec(&bytes);
    }
    std::fs::create_dir_all(&folder).expect("a folder for shaders");
    compile_to(stage, source, &path, &kept)
}

fn whole(source: &str) -> String {
    format!("#version 450\n{source}")
}

/// Compiles to file names of this process alone, then moves the files to their final names.
fn compile_to(stage: Stage, source: &str, path: &Path, kept: &Path) -> Vec<u32> {
    let mine = |path: &Path| -> PathBuf {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        path.with_file_name(format!("{}-{name}", std::process::id()))
    };
    let (my_source, my_spirv) = (mine(path), mine(kept));
    std::fs::write(&my_source, whole(source)).expect("a shader is written");
    let output = Command::new("glslangValidator")
        .args(["--target-env", "vulkan1.1", "-S", stage.suffix(), "-o"])
        .arg(&my_spirv)
        .arg(&my_source)
        .output()
        .expect("glslangValidator starts");
    assert!(
        output.status.success(),
        "{source}\n{}{}",
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr)
    );
    let bytes = std::fs::read(&my_spirv).expect("SPIR-V is there");
    // The source is moved last; its presence means that the SPIR-V is complete.
    std::fs::rename(&my_spirv, kept).expect("it is kept");
    std::fs::rename(&my_source, path).expect("it is kept");
    bytemuck::pod_collect_to_vec(&bytes)
}
