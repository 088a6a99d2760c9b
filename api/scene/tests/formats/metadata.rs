//! Tests of the metadata of scene files.

use gaurast_runner::data;
use gaurast_scene::{Antialiasing, Geometry};

use super::support::*;

/// A PLY file of one Gaussian with `comments` in its header, and without the properties `absent`.
fn commented(comments: &[&str], absent: &str) -> Vec<u8> {
    let (properties, rows) = distinct(1, 1);
    let kept = |property: &&String| *property != absent;
    let row = properties.iter().zip(&rows[0]);
    let row = row.filter(|(property, _)| kept(property)).map(|(_, v)| *v);
    let rows = [row.collect()];
    let properties: Vec<_> = properties.iter().filter(kept).cloned().collect();
    let file = String::from_utf8(ply(Encoding::Ascii, &properties, &rows)).expect("text");
    let lines: Vec<_> = comments.iter().map(|c| format!("comment {c}\n")).collect();
    file.replace("element vertex", &(lines.concat() + "element vertex")).into_bytes()
}

#[gaurast_runner::test]
fn ply_comments_say_how_a_scene_was_trained() {
    use Antialiasing::{Compensated, Off};
    use Geometry::{Surfel, Volume};
    for (comments, antialiasing, geometry) in [
        (&[][..], None, None),
        (&["Exported from Brush"], None, None),
        (&["SplatRenderMode: default"], Some(Off), Some(Volume)),
        (&["SplatRenderMode: mip"], Some(Compensated), Some(Volume)),
        (&["splatrendermode:  MIP "], Some(Compensated), Some(Volume)),
        (&["SplatRenderMode: 2dgs"], Some(Off), Some(Surfel)),
        (&["antialiased 0"], Some(Off), Some(Volume)),
        (&["antialiased 1"], Some(Compensated), Some(Volume)),
        (&["antialiased maybe"], None, None),
        (&["antialiased 1", "SplatRenderMode: default"], Some(Off), Some(Volume)),
        (&["SplatRenderMode: default", "antialiased 1"], Some(Compensated), Some(Volume)),
    ] {
        let scene = read("a.ply", &commented(comments, "")).expect("a good file");
        let metadata = scene.metadata();
        assert_eq!(metadata.antialiasing, antialiasing, "{comments:?}");
        assert_eq!(metadata.geometry, geometry, "{comments:?}");
        assert!(metadata.notes.is_empty());
        assert_eq!(scene.antialiasing(), antialiasing.unwrap_or(Off));
        assert_eq!(scene.geometry(), geometry.unwrap_or(Volume));
    }
    let unknown = commented(&["antialiased 1", "SplatRenderMode: wavy"], "");
    let scene = read("a.ply", &unknown).expect("a good file");
    assert_eq!(scene.antialiasing(), Compensated);
    assert_eq!(scene.metadata().notes, [r#"the render mode "wavy" is unknown and ignored"#]);
}

#[gaurast_runner::test]
fn a_ply_without_a_third_scale_holds_surfels() {
    let whole = read("a.ply", &commented(&[], "")).expect("a good file");
    // A comment that says otherwise doesn't matter.
    for comments in [&[][..], &["SplatRenderMode: default"]] {
        let flat = read("a.ply", &commented(comments, "scale_2")).expect("a good file");
        assert_eq!(flat.geometry(), Geometry::Surfel);
        let (flat_shape, shape) = (flat.shapes()[0], whole.shapes()[0]);
        assert_eq!(flat_shape.scale, [shape.scale[0], shape.scale[1], 0.0]);
        assert_eq!(flat_shape.rotation, shape.rotation);
        assert_eq!(flat_shape.opacity, shape.opacity);
        assert_eq!(flat.sh(), whole.sh());
    }
}

#[gaurast_runner::test]
fn the_antialiased_bit_of_spz_is_told() {
    for (flags, expected) in [(0, Antialiasing::Off), (1, Antialiasing::Compensated)] {
        let file = [spz_header(2, 1, 0, flags), vec![7; 19]].concat();
        let scene = read("a.spz", &gzip(&file)).expect("a good file");
        assert_eq!(scene.metadata().antialiasing, Some(expected));
    }
}

#[gaurast_runner::test]
fn real_spz_files_are_antialiased() {
    for file in ["splats/yashica-t4-top8192.spz", "splats/leica-sofort-top8192.spz"] {
        let scene = gaurast_scene::open(data(file)).expect(file);
        assert_eq!(scene.antialiasing(), Antialiasing::Compensated, "{file}");
    }
}
