//! The folder of scenes and pictures is what the program writes, tells the renderers apart, and agrees with `reference.py`.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use gaurast_compliance::{Expected, Level, Pipeline};
use gaurast_runner::{Missing, ignore};

fn main() -> ExitCode {
    gaurast_runner::main()
}

/// The folder.
fn folder() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The files that the program writes to `folder`, by their names.
fn written(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let read = |path: &Path| std::fs::read(folder.join(path)).expect("a file");
    let mut files: BTreeMap<PathBuf, Vec<u8>> =
        ["manifest.json", "cameras.json"].map(|name| (name.into(), read(Path::new(name)))).into();
    for part in ["scenes", "expected"] {
        for entry in folder.join(part).read_dir().expect("a folder") {
            let path = Path::new(part).join(entry.expect("an entry").file_name());
            files.insert(path.clone(), read(&path));
        }
    }
    files
}

#[gaurast_runner::test]
fn the_folder_is_what_the_program_writes() {
    let fresh = tempfile::tempdir().expect("a folder");
    gaurast_compliance::write(fresh.path(), &gaurast_compliance::cases()).expect("every case tells its misreading");
    let (stored, fresh_files) = (written(folder()), written(fresh.path()));
    assert!(stored.keys().eq(fresh_files.keys()), "write the folder anew: gaurast-compliance tests/compliance");
    for (path, bytes) in &stored {
        if path.extension().is_some_and(|extension| extension == "exr") {
            // The last bit of an exponential in binary64 may differ between machines.
            let [a, b] =
                [folder(), fresh.path()].map(|folder| gaurast_picture::read(&folder.join(path)).expect("a picture"));
            let pairs = a.pixels.as_flattened().iter().zip(b.pixels.as_flattened());
            assert!(pairs.into_iter().all(|(a, b)| (a - b).abs() < 2e-7), "{}", path.display());
        } else {
            assert!(*bytes == fresh_files[path], "{}", path.display());
        }
    }
    let bytes: usize = stored.values().map(Vec::len).sum();
    assert!(stored.len() > 120 && bytes < 3 << 20, "{} files, {bytes} bytes", stored.len());
}

#[gaurast_runner::test]
fn there_are_cases_of_each_level() {
    let cases = gaurast_compliance::cases();
    let count = |level: Level| cases.iter().filter(|case| case.level == level).count();
    let counts = [Level::Normative, Level::Recommended, Level::Choice].map(count);
    assert!(cases.len() >= 60 && counts[0] >= 30 && counts.iter().all(|count| *count >= 5), "{counts:?}");
    let mut names: Vec<_> = cases.iter().map(|case| &case.name).collect();
    names.sort();
    names.dedup();
    assert_eq!(names.len(), cases.len());
}

/// The renderers whose pictures of a scene are equal, as far as a step of 255 goes.
fn groups(scene: &str) -> Vec<Vec<&'static str>> {
    let cases = gaurast_compliance::cases();
    let mut groups: Vec<(Vec<[f64; 4]>, Vec<&'static str>)> = Vec::new();
    for pipeline in Pipeline::ALL {
        let name = format!("{scene}-{}", pipeline.name().replace('.', "-"));
        let case = cases.iter().find(|case| case.name == name).expect("a case");
        let picture = Expected::of(case).expect("a picture").pixels;
        let is_equal = |other: &[[f64; 4]]| {
            let pairs = picture.as_flattened().iter().zip(other.as_flattened());
            pairs.into_iter().all(|(a, b)| (a - b).abs() < 2.0 / 255.0)
        };
        match groups.iter_mut().find(|(other, _)| is_equal(other)) {
            Some((_, names)) => names.push(pipeline.name()),
            None => groups.push((picture, vec![pipeline.name()])),
        }
    }
    groups.into_iter().map(|(_, names)| names).collect()
}

#[gaurast_runner::test]
fn the_renderers_are_told_apart() {
    assert_eq!(groups("cut-off"), [vec!["inria"], vec!["gsplat", "gsplat-1.5", "usd"], vec!["gltf"]]);
    assert_eq!(groups("ceiling"), [vec!["inria", "gsplat", "gltf", "usd"], vec!["gsplat-1.5"]]);
    assert_eq!(groups("near"), [vec!["inria", "gltf", "usd"], vec!["gsplat", "gsplat-1.5"]]);
    assert_eq!(groups("order"), [vec!["inria", "gsplat", "gsplat-1.5", "usd"], vec!["gltf"]]);
    assert_eq!(groups("compensation"), [vec!["inria", "gsplat"], vec!["gsplat-1.5", "gltf", "usd"]]);
}

/// A Python that has NumPy: the one in the path, or the system's, for which Debian packages NumPy.
fn python_with_numpy() -> Option<&'static str> {
    let has_numpy = |python: &&str| {
        let output = Command::new(python).args(["-c", "import numpy"]).output();
        output.is_ok_and(|output| output.status.success())
    };
    ["python3", "/usr/bin/python3"].into_iter().find(has_numpy)
}

#[gaurast_runner::test]
fn numpy_draws_the_same_pictures() {
    let Some(python) = python_with_numpy() else { ignore(Missing::Program, "there is no Python with NumPy") };
    let output = Command::new(python).arg(folder().join("reference.py")).output().expect("it starts");
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{text}{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(text.lines().count(), gaurast_compliance::cases().len() + 1, "{text}");
}
