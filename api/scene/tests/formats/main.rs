//! Tests of scene and camera files: real ones, small ones with known values, malformed ones, and damaged ones.

mod dialects;
mod gltf;
mod ksplat;
mod lenses;
mod meshes;
mod metadata;
mod ply;
mod scenes;
mod sog;
mod spz;
mod support;
mod usd;

use std::path::Path;
use std::sync::LazyLock;

use gaurast_runner::{Case, Need, Variant};
use gaurast_scene::{Reason, SceneError};
use proptest::prelude::*;

use support::*;

#[gaurast_runner::test]
fn splat_values() {
    let mut file = Vec::new();
    for value in [1.0_f32, -2.0, 3.0, 0.1, 0.2, 0.3] {
        file.extend(value.to_le_bytes());
    }
    file.extend([255, 0, 51, 102]);
    file.extend([192, 128, 64, 0]);
    let scene = read("a.splat", &file).expect("a good file");
    assert_eq!(scene.positions(), [[1.0, -2.0, 3.0]]);
    let shape = scene.shapes()[0];
    assert_eq!(shape.scale, [0.1, 0.2, 0.3]);
    assert_eq!(shape.rotation, [0.5, 0.0, -0.5, -1.0]);
    assert_eq!(shape.opacity, 0.4);
    let colour = scene.sh()[0].map(|c| 0.5 + SH_C0 * c);
    close(&colour, &[1.0, 0.0, 0.2], 1e-6);

    file.pop();
    assert!(matches!(refusal("a.splat", &file).1, Reason::Records { len: 31, record: 32 }));
    assert!(matches!(refusal("a.splat", &[]).1, Reason::Empty));
}

/// Real scenes with their numbers of Gaussians and degrees of spherical harmonics.
const REAL_SCENES: [(&str, usize, u32); 10] = [
    ("splats/skull.sog", 94_936, 3),
    ("splats/yashica-t4-top8192.sog", 8192, 3),
    ("splats/skull.ply", 94_936, 3),
    ("splats/playbot-125k.ply", 125_000, 2),
    ("splats/plant.splat", 14_007, 0),
    ("splats/guitar.compressed.ply", 90_854, 0),
    ("splats/yashica-t4-top8192.ply", 8192, 3),
    ("splats/yashica-t4-top8192.spz", 8192, 3),
    ("splats/leica-sofort-top8192.ply", 8192, 3),
    ("splats/leica-sofort-top8192.spz", 8192, 3),
];

fn real_scenes() -> Vec<Variant> {
    let variant =
        |(file, ..): (&'static str, usize, u32)| Variant { name: file.to_owned(), needs: vec![Need::Data(file)] };
    REAL_SCENES.map(variant).into()
}

#[gaurast_runner::test(each = real_scenes())]
fn real_scenes_are_read(case: &Case) {
    let (file, count, degree) = REAL_SCENES.into_iter().find(|(file, ..)| *file == case.variant()).expect("a scene");
    let scene = gaurast_scene::open(gaurast_runner::data(file)).expect("a good file");
    assert_eq!((scene.len(), scene.sh_degree()), (count, degree));
    let sane = scene.positions().iter().zip(scene.shapes()).filter(|(p, s)| {
        p.iter().all(|c| c.abs() < 1e3)
            && s.scale.iter().all(|c| (0.0..1e2).contains(c))
            && (0.0..=1.0).contains(&s.opacity)
            && s.rotation.iter().any(|c| c.abs() > 1e-3)
    });
    assert!(sane.count() > count * 99 / 100);
}

#[gaurast_runner::test]
fn formats_that_are_not_read_and_unknown_ones_are_named() {
    let not_read = |name: &str, bytes: &[u8]| match read(name, bytes) {
        Err(SceneError::NotRead { format, .. }) => format,
        other => panic!("{name}: {other:?}"),
    };
    assert_eq!(not_read("a.lcc", b"{}"), "LCC");
    assert_eq!(not_read("A.LCC2", b"{}"), "LCC");
    let error = read("a.lcc", b"{}").expect_err("no reader").to_string();
    assert!(error.contains("splat-transform converts them"), "{error}");
    assert!(!gaurast_scene::known_extensions().contains("lcc"));
    let error = read("a.txt", b"hello").expect_err("unknown");
    assert!(matches!(error, SceneError::UnknownFormat { .. }));
    assert!(error.to_string().contains(".splat"), "{error}");
    // Without a name, some formats cannot be told.
    let error = read("standard input", b"hello").expect_err("unknown");
    let hint = "of these, .splat, .ksplat, .json, .gltf, .usdz are known by the names of their files alone";
    assert!(error.to_string().contains(hint), "{error}");
    let (properties, rows) = distinct(0, 1);
    let file = ply(Encoding::Little, &properties, &rows);
    assert_eq!(read("no extension", &file).expect("by its first bytes").len(), 1);
    let missing = gaurast_scene::open(Path::new("no/such/file.ply")).expect_err("missing");
    assert!(matches!(missing, SceneError::Io { .. }));
}

/// Small valid files of every kind.
fn good_files() -> Vec<(&'static str, Vec<u8>)> {
    let (properties, rows) = distinct(1, 2);
    let spz = [spz_header(3, 2, 1, 0), vec![99; 2 * 29]].concat();
    vec![
        ("ascii.ply", ply(Encoding::Ascii, &properties, &rows)),
        ("little.ply", ply(Encoding::Little, &properties, &rows)),
        ("big.ply", ply(Encoding::Big, &properties, &rows)),
        ("compressed.ply", compressed_ply(true, true)),
        ("a.spz", gzip(&spz)),
        ("a.splat", vec![77; 64]),
        ("4.spz", spz::version_4(1, 0)),
        ("a.ply.gz", gzip(&ply(Encoding::Little, &properties, &rows))),
        ("0.ksplat", ksplat::file(0)),
        ("1.ksplat", ksplat::file(1)),
        ("2.ksplat", ksplat::file(2)),
        ("a.sog", sog::archive(2)),
        ("1.sog", sog::archive(1)),
        ("a.glb", gltf::glb()),
        ("a.glb", gltf::sparse_glb()),
        ("a.gltf", gltf::gltf()),
        ("mesh.ply", meshes::binary(false)),
        ("mesh.glb", meshes::glb()),
    ]
}

static GOOD_FILES: LazyLock<Vec<(&str, Vec<u8>)>> = LazyLock::new(good_files);

#[gaurast_runner::test]
fn every_truncation_of_a_good_file_is_refused() {
    for (name, file) in good_files() {
        let whole = read(name, &file).expect("a good file");
        let last_word = file.trim_ascii_end().iter().rposition(|b| *b == b' ');
        for len in 0..file.len() {
            match read(name, &file[..len]) {
                Err(_) => {}
                // Fewer records, or a text whose last number may have lost digits.
                Ok(part) => assert!(
                    name == "a.splat" && part.len() < whole.len()
                        || name == "ascii.ply" && Some(len) > last_word.map(|i| i + 1),
                    "{name} cut to {len} bytes of {}",
                    file.len()
                ),
            }
        }
    }
}

#[gaurast_runner::test]
fn compressed_files_are_what_they_hold() {
    let (properties, rows) = distinct(2, 3);
    let plain = ply(Encoding::Little, &properties, &rows);
    let scene = read("a.ply", &plain).expect("a good file");
    for name in ["a.ply.gz", "a.gz", "A.PLY.GZ", "a"] {
        assert_eq!(read(name, &gzip(&plain)).expect(name), scene);
    }
    let splats = vec![77; 96];
    assert_eq!(read("a.splat.gz", &gzip(&splats)).expect("good").len(), 3);
    let spz = gzip(&[spz_header(2, 1, 0, 0), vec![7; 19]].concat());
    assert_eq!(read("a", &spz).expect("by what it holds").len(), 1);

    let mut bad_sum = gzip(&plain);
    let sum = bad_sum.len() - 8;
    bad_sum[sum] ^= 0xff;
    assert!(matches!(refusal("a.ply.gz", &bad_sum).1, Reason::Gzip(_)));
    let junk = [gzip(&plain), b"JUNK".to_vec()].concat();
    assert!(matches!(refusal("a.ply.gz", &junk).1, Reason::Trailing));
    // A header that claims more than the file can hold, and a gzip bomb after a valid scene.
    let text = String::from_utf8_lossy(&plain[..60]).replace("vertex 3", "vertex 99999999");
    let claim = gzip(&[text.as_bytes(), &plain[60..]].concat());
    assert!(matches!(refusal("a.ply.gz", &claim).1, Reason::TooShort { .. }));
    let bomb = gzip(&[plain, vec![0; 64 << 20]].concat());
    assert!(matches!(refusal("a.ply.gz", &bomb).1, Reason::Trailing));
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 4000,
        rng_seed: proptest::test_runner::RngSeed::Fixed(3),
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    /// Tests that no change of bytes makes a reader panic, or use more memory than the file could need.
    #[gaurast_runner::test]
    fn flipped_bytes_never_panic(
        which in 0..GOOD_FILES.len(),
        flips in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
    ) {
        let (name, mut file) = GOOD_FILES[which].clone();
        for (index, byte) in flips {
            let index = index.index(file.len());
            file[index] = byte;
        }
        if let Ok(scene) = read(name, &file) {
            // An image's pixel may take less than a byte.
            prop_assert!(scene.len() <= 1032 * file.len());
        }
    }

    /// Tests the same inside of files with checksums, where a change from outside rarely gets past the checksum.
    #[gaurast_runner::test]
    fn flipped_bytes_within_archives_never_panic(
        which in 0_usize..PARTS.len(),
        entry in any::<prop::sample::Index>(),
        flips in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
    ) {
        let (name, pack, mut parts) = PARTS[which].clone();
        let part = &mut parts[entry.index(PARTS[which].2.len())].1;
        for (index, byte) in flips {
            let index = index.index(part.len());
            part[index] = byte;
        }
        if let Ok(scene) = read(name, &pack(&parts)) {
            prop_assert!(scene.len() <= 1 << 20);
        }
    }
}

/// A packer of named parts into a file.
type Pack = fn(&[(String, Vec<u8>)]) -> Vec<u8>;

/// A file's name, its packer, and its parts.
type Packed = (&'static str, Pack, Vec<(String, Vec<u8>)>);

/// Valid files as their parts.
static PARTS: LazyLock<[Packed; 5]> = LazyLock::new(|| {
    let (properties, rows) = distinct(1, 2);
    let spz = |degree, stride: usize| {
        let body = [spz_header(3, 2, degree, 2), vec![99; 2 * stride], vec![1; 20]].concat();
        vec![(String::new(), body)]
    };
    let ply = vec![(String::new(), ply(Encoding::Little, &properties, &rows))];
    let gzipped: Pack = |parts| gzip(&parts[0].1);
    [
        ("a.sog", sog::stored, sog::entries(2)),
        ("a.sog", sog::stored, sog::entries(1)),
        ("a.spz", gzipped, spz(1, 29)),
        ("a.spz", gzipped, spz(4, 92)),
        ("a.ply.gz", gzipped, ply),
    ]
});

fn main() -> std::process::ExitCode {
    gaurast_runner::main()
}
