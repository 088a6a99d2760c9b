//! The folder of scenes, pictures and the manifest that names them.

use std::collections::BTreeMap;
use std::path::Path;

use gaurast_picture::{OutputError, Picture};
use gaurast_scene::Camera;
use serde_json::{Value, json};
use thiserror::Error;

use crate::case::{Case, Source};
use crate::expected::{Expected, ExpectedError};
use crate::{gltf_cases, usd_cases};

/// The reason that the folder is not written.
#[derive(Debug, Error)]
pub enum WriteError {
    /// A case has no picture.
    #[error(transparent)]
    Expected(#[from] ExpectedError),
    /// A picture is not written.
    #[error(transparent)]
    Picture(#[from] OutputError),
    /// A file is not written.
    #[error("{0}")]
    Io(#[from] std::io::Error),
}

/// Writes the scenes, pictures, cameras and manifest of `cases` to `folder`.
///
/// # Errors
/// If a case has no picture, or a file can't be written.
pub fn write(folder: &Path, cases: &[Case]) -> Result<(), WriteError> {
    for part in ["scenes", "expected"] {
        std::fs::create_dir_all(folder.join(part))?;
    }
    let mut listed = Vec::new();
    let mut cameras = Vec::new();
    let mut scenes = BTreeMap::new();
    for (id, case) in cases.iter().enumerate() {
        let expected = Expected::of(case)?;
        let file = format!("scenes/{}.{}", case.scene, case.source.extension());
        let picture = format!("expected/{}.exr", case.name);
        scenes.insert(file.clone(), case.source.bytes(&case.camera));
        let pixels = expected.pixels.iter().map(|pixel| pixel.map(|channel| channel as f32)).collect();
        let [width, height] = [case.camera.width, case.camera.height];
        gaurast_picture::write(&folder.join(&picture), &Picture { width, height, pixels }, None)?;
        cameras.push(camera_of_3dgs(id, case));
        listed.push(entry(case, &expected, &file, &picture));
    }
    for (file, bytes) in scenes {
        std::fs::write(folder.join(file), bytes)?;
    }
    let manifest = json!({
        "version": 1,
        "license": "CC0-1.0",
        "texts": {
            "gltf": {"text": "KHR_gaussian_splatting, Release Candidate", "repository": "https://github.com/KhronosGroup/glTF", "commit": gltf_cases::TEXT},
            "usd": {"text": "UsdVol: ParticleField3DGaussianSplat and the schemas that it applies", "release": usd_cases::TEXT},
        },
        "pictures": "EXR, binary32: colours times alpha in the file's colour space, over nothing, and alpha; row 0 is the upper one",
        "cases": listed,
    });
    std::fs::write(folder.join("manifest.json"), pretty(&manifest))?;
    std::fs::write(folder.join("cameras.json"), pretty(&json!(cameras)))?;
    Ok(())
}

fn pretty(value: &Value) -> String {
    format!("{value:#}\n")
}

fn entry(case: &Case, expected: &Expected, file: &str, picture: &str) -> Value {
    let mut options = vec!["--as".to_owned(), case.pipeline.name().to_owned()];
    options.extend(["--near".to_owned(), case.camera.near.to_string()]);
    if case.is_compensated {
        options.extend(["--antialiasing".to_owned(), "compensated".to_owned()]);
    }
    let linear = matches!(&case.source, Source::Gltf(gltf) if gltf.extension["colorSpace"] == "lin_rec709_display");
    let mut entry = json!({
        "name": case.name,
        "as": case.pipeline.name(),
        "level": case.level.name(),
        "clause": case.clause,
        "shows": case.shows,
        "scene": file,
        "picture": picture,
        "colorSpace": if linear { "lin_rec709_display" } else { "srgb_rec709_display" },
        "options": options,
        "camera": camera_of_file(case),
        "tolerance": expected.tolerance,
        "derivation": expected.derivation,
    });
    if let (Some(mistake), Some(difference)) = (&case.mistake, expected.mistaken) {
        entry["mistake"] = json!({"what": mistake.what, "difference": rounded(difference)});
    }
    entry
}

/// The camera in the axes of the case's file: the rows of the matrix from it to x right, y down, z forward.
fn camera_of_file(case: &Case) -> Value {
    let Camera { rotation, eye, focal, principal, width, height, near, .. } = &case.camera;
    let axes = case.source.axes();
    let rows: Vec<Vec<f64>> = rotation
        .iter()
        .map(|row| {
            let turned = |column: usize| (0..3).map(|axis| row[axis] * axes[axis][column]).sum::<f64>();
            let moved: f64 = (0..3).map(|axis| row[axis] * eye[axis]).sum();
            vec![turned(0) + 0.0, turned(1) + 0.0, turned(2) + 0.0, 0.0 - moved]
        })
        .collect();
    json!({"world_to_camera": rows, "focal": focal, "principal": principal, "width": width, "height": height, "near": near})
}

/// The camera as 3DGS's `cameras.json` has it, in the axes of 3DGS.
fn camera_of_3dgs(id: usize, case: &Case) -> Value {
    let Camera { rotation, eye, focal, width, height, .. } = &case.camera;
    let to_world: Vec<Vec<f64>> = (0..3).map(|row| rotation.iter().map(|direction| direction[row]).collect()).collect();
    json!({
        "id": id,
        "img_name": case.name,
        "width": width,
        "height": height,
        "position": eye,
        "rotation": to_world,
        "fx": focal[0],
        "fy": focal[1],
    })
}

/// A number with four digits.
fn rounded(value: f64) -> f64 {
    libm::round(value * 1e4) / 1e4
}
