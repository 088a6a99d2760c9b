//! Small good and malformed scene files.

use std::collections::BTreeSet;

use super::render;

/// Files that are drawn.
const GOOD: &[&str] = &[
    "decode-degree1-v2.spz",
    "decode-degree4-v2.spz",
    "decode-v1.spz",
    "degree-2-sh.ply",
    "degree-4-sh.ply",
    "degree3-v2.spz",
    "equiv-degree1-offgrid-binary-le.ply",
    "equiv-degree3-exact-v2.spz",
    "minimal-v1.spz",
    "minimal-v3.spz",
    "one-gaussian-binary-le.ply",
    // Its Gaussian is one that the device skips.
    "overflow-scale.ply",
    "three-gaussian-binary-le.ply",
    "three-points-degree1-v2.spz",
];

/// Files that are refused, and why: place and reason as the command says them.
const MALFORMED: &[(&str, &str)] = &[
    ("bad-fhcrc-v2.spz", "the gzip stream is damaged"),
    ("corrupt-deflate.spz", "the gzip stream is damaged"),
    ("empty-points-v2.spz", "it holds no Gaussians"),
    ("empty-vertex.ply", "element vertex: it holds no Gaussians"),
    ("gzip-not-spz.spz", "this is not"),
    ("huge-count-v2.spz", "bytes are claimed"),
    (
        "list-property.ply",
        "element vertex, property opacity: it is a list",
    ),
    (
        "missing-opacity.ply",
        "element vertex, property opacity: it is missing",
    ),
    (
        "non-contiguous-sh.ply",
        "element vertex, property f_rest_2: it is missing",
    ),
    ("plaintext-v2.spz", "this is not"),
    (
        "sh-count-not-rgb.ply",
        "element vertex: 2 f_rest properties",
    ),
    (
        "sh-degree-5-v2.spz",
        "spherical harmonics degree 5 exceeds 4",
    ),
    (
        "trailing-decompressed-v2.spz",
        "there is data after the end of the scene",
    ),
    ("truncated-gzip-header.spz", "the data ends here, too early"),
    ("version-0.spz", "version 0 is not one of those read"),
];

/// What the command says of a file of a format that it has no reader for.
const NOT_READ: &[(&str, &str)] = &[(".sog", "SOG files are not read yet")];

#[gaurast_runner::test]
fn good_files_are_drawn() {
    let fixtures = gaurast_runner::data("fixtures");
    for name in GOOD {
        let folder = tempfile::tempdir().expect("a folder");
        let scene = fixtures.join(name);
        let output = render(
            folder.path(),
            [
                scene.as_os_str(),
                "--size".as_ref(),
                "32x24".as_ref(),
                "-o".as_ref(),
                "a.png".as_ref(),
            ],
        );
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{name}: {stderr}");
        let picture = image::open(folder.path().join("a.png")).expect("a PNG");
        assert_eq!((picture.width(), picture.height()), (32, 24), "{name}");
    }
}

#[gaurast_runner::test]
fn every_other_file_is_refused_in_one_sentence_and_leaves_nothing() {
    let fixtures = gaurast_runner::data("fixtures");
    let files: BTreeSet<String> = fixtures
        .read_dir()
        .expect("readable")
        .map(|entry| {
            entry
                .expect("an entry")
                .file_name()
                .into_string()
                .expect("text")
        })
        .filter(|name| !GOOD.contains(&name.as_str()))
        .collect();
    assert!(MALFORMED.iter().all(|(name, _)| files.contains(*name)));
    for name in &files {
        let by_name = MALFORMED.iter().find(|(known, _)| known == name);
        let by_format = || NOT_READ.iter().find(|(kind, _)| name.ends_with(kind));
        let Some((_, reason)) = by_name.or_else(by_format) else {
            panic!("nothing is said of {name}");
        };
        let folder = tempfile::tempdir().expect("a folder");
        let scene = fixtures.join(name);
        let outputs = ["-o", "a.png", "-o", "a.exr"].map(AsRef::as_ref);
        let output = render(
            folder.path(),
            [scene.as_os_str()].into_iter().chain(outputs),
        );
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{name}: {stderr}");
        assert_eq!(stderr.lines().count(), 1, "{name}: {stderr}");
        let file = format!("gaurast: {}: ", scene.display());
        assert!(stderr.starts_with(&file), "{name}: {stderr}");
        assert!(stderr.contains(reason), "{name}: {stderr}");
        assert!(output.stdout.is_empty(), "{name}");
        let left = folder.path().read_dir().expect("readable").count();
        assert_eq!(left, 0, "{name} left a file");
    }
}
