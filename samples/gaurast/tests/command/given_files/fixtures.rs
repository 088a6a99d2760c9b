//! Small valid and malformed scene files.

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
    "equiv-degree1-offgrid.sog",
    "equiv-degree3-exact-v2.spz",
    "equiv-degree3-exact.sog",
    "kit-multi-degree3.sog",
    "labels-out-of-range.sog",
    "minimal-v1.spz",
    "minimal-v3.spz",
    "one-gaussian-binary-le.ply",
    // The device skips its Gaussian.
    "overflow-scale.ply",
    "three-gaussian-binary-le.ply",
    "three-points-degree1-v2.spz",
];

/// Files that are refused, each with the part of the message that gives place and reason.
const MALFORMED: &[(&str, &str)] = &[
    ("bad-bands.sog", "meta.json, shN.bands: 4 bands are not 0 to 3"),
    ("bad-zip.sog", "the zip archive is damaged"),
    ("count-exceeds-plane.sog", r#"entry "means_l.webp": 1x1 pixels are not what 4096 entries need"#),
    ("device-plane-name.sog", r#"entry "NUL.webp": this is not the name of a file"#),
    ("escaping-plane-name.sog", r#"entry "../scales.webp": this is not the name of a file"#),
    ("huge-count.sog", "meta.json, count: it is not a number"),
    ("huge-version.sog", "meta.json, version: version"),
    ("malformed-meta.sog", r#"entry "meta.json": the JSON is malformed"#),
    ("no-meta.sog", r#"entry "meta.json": it is missing"#),
    ("short-codebook.sog", "meta.json, scales.codebook: it holds 255"),
    ("version-3.sog", "meta.json, version: version 3 is not one of those read"),
    ("bad-fhcrc-v2.spz", "the gzip stream is damaged"),
    ("corrupt-deflate.spz", "the gzip stream is damaged"),
    ("empty-points-v2.spz", "it holds no Gaussians"),
    ("empty-vertex.ply", "element vertex: it holds no Gaussians"),
    ("gzip-not-spz.spz", "this is not"),
    ("huge-count-v2.spz", "bytes are claimed"),
    ("list-property.ply", "element vertex, property opacity: it is a list"),
    ("missing-opacity.ply", "element vertex, property opacity: it is missing"),
    ("non-contiguous-sh.ply", "element vertex, property f_rest_2: it is missing"),
    ("plaintext-v2.spz", "version 2 is not compressed with gzip"),
    ("sh-count-not-rgb.ply", "element vertex: 2 f_rest properties"),
    ("sh-degree-5-v2.spz", "spherical harmonics degree 5 exceeds 4"),
    ("trailing-decompressed-v2.spz", "there is data after the end of the scene"),
    ("truncated-gzip-header.spz", "the data ends here, too early"),
    ("version-0.spz", "version 0 is not one of those read"),
];

#[gaurast_runner::test]
fn good_files_are_drawn() {
    let fixtures = gaurast_runner::data("fixtures");
    for name in GOOD {
        let folder = tempfile::tempdir().expect("a folder");
        let scene = fixtures.join(name);
        let output = render(
            folder.path(),
            [scene.as_os_str(), "--size".as_ref(), "32x24".as_ref(), "-o".as_ref(), "a.png".as_ref()],
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
        .map(|entry| entry.expect("an entry").file_name().into_string().expect("text"))
        .filter(|name| !GOOD.contains(&name.as_str()))
        .collect();
    assert!(MALFORMED.iter().all(|(name, _)| files.contains(*name)));
    for name in &files {
        let Some((_, reason)) = MALFORMED.iter().find(|(known, _)| known == name) else {
            panic!("nothing is said of {name}");
        };
        let folder = tempfile::tempdir().expect("a folder");
        let scene = fixtures.join(name);
        let outputs = ["-o", "a.png", "-o", "a.exr"].map(AsRef::as_ref);
        let output = render(folder.path(), [scene.as_os_str()].into_iter().chain(outputs));
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
