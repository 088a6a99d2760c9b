//! glTF files with Gaussians.

use gaurast_runner::data;
use gaurast_scene::{Axes, ColorSpace, Options, Place, Reason, Scene, SortOrder};
use serde_json::{Value, json};

use super::support::*;

const EXTENSION: &str = "KHR_gaussian_splatting";

/// Attributes of two Gaussians of degree 1 as floats, element after element.
const POSITIONS: [f32; 6] = [1.0, 2.0, 3.0, -4.0, 5.0, 0.5];
const ROTATIONS: [f32; 8] = [0.1, 0.2, 0.3, 0.9, 0.0, 0.0, 0.0, 1.0];
const SCALES: [f32; 6] = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6];
const OPACITIES: [f32; 2] = [0.25, 1.0];

/// Coefficient `k` of both Gaussians.
fn coefficient(k: usize) -> [f32; 6] {
    std::array::from_fn(|i| 0.1 * (k as f32 + 1.0) + 0.01 * i as f32)
}

/// A document to which attributes are added one by one, with its buffer.
struct Builder {
    document: Value,
    bytes: Vec<u8>,
}

impl Builder {
    fn new() -> Self {
        let document = json!({
            "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": [{"mode": 0, "attributes": {}, "extensions": {
                EXTENSION: {"kernel": "ellipse", "colorSpace": "srgb_rec709_display"}
            }}]}],
            "accessors": [], "bufferViews": [], "buffers": [{"byteLength": 0}],
        });
        let bytes = Vec::new();
        let mut builder = Self { document, bytes };
        builder.floats("POSITION", 3, &POSITIONS);
        builder.floats("KHR_gaussian_splatting:ROTATION", 4, &ROTATIONS);
        builder.floats("KHR_gaussian_splatting:SCALE", 3, &SCALES);
        builder.floats("KHR_gaussian_splatting:OPACITY", 1, &OPACITIES);
        for k in 0..4 {
            let (l, n) = if k == 0 { (0, 0) } else { (1, k - 1) };
            let name = format!("KHR_gaussian_splatting:SH_DEGREE_{l}_COEF_{n}");
            builder.floats(&name, 3, &coefficient(k));
        }
        builder
    }

    fn floats(&mut self, name: &str, width: usize, values: &[f32]) {
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        self.attribute(name, width, (5126, false), &bytes);
    }

    /// Adds an attribute or replaces it: two elements of `width` components of a type, in `bytes`.
    fn attribute(&mut self, name: &str, width: usize, (kind, normalized): (u32, bool), bytes: &[u8]) {
        let shape = ["", "SCALAR", "VEC2", "VEC3", "VEC4"][width];
        let view = self.view(bytes);
        let accessors = self.document["accessors"].as_array_mut().expect("accessors");
        accessors.push(json!({
            "bufferView": view, "componentType": kind, "normalized": normalized, "count": 2, "type": shape,
        }));
        let accessor = accessors.len() - 1;
        self.primitive()["attributes"][name] = json!(accessor);
    }

    fn view(&mut self, bytes: &[u8]) -> usize {
        let views = self.document["bufferViews"].as_array_mut().expect("views");
        views.push(json!({"buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len()}));
        self.bytes.extend(bytes);
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        views.len() - 1
    }

    fn primitive(&mut self) -> &mut Value {
        &mut self.document["meshes"][0]["primitives"][0]
    }

    fn splatting(&mut self) -> &mut Value {
        &mut self.primitive()["extensions"][EXTENSION]
    }

    fn node(&mut self) -> &mut Value {
        &mut self.document["nodes"][0]
    }

    /// The document as a binary file.
    fn glb(mut self) -> Vec<u8> {
        self.document["buffers"][0]["byteLength"] = json!(self.bytes.len());
        let mut json = self.document.to_string().into_bytes();
        json.resize(json.len().next_multiple_of(4), b' ');
        let mut file = b"glTF".to_vec();
        let len = 12 + 8 + json.len() + 8 + self.bytes.len();
        file.extend([2, len as u32, json.len() as u32].map(u32::to_le_bytes).as_flattened());
        file.extend(b"JSON");
        file.extend(json);
        file.extend((self.bytes.len() as u32).to_le_bytes());
        file.extend(b"BIN\0");
        file.extend(self.bytes);
        file
    }

    fn load(self) -> Scene {
        read("a.glb", &self.glb()).expect("a good file")
    }

    #[track_caller]
    fn refusal(self) -> (Place, Reason) {
        refusal("a.glb", &self.glb())
    }
}

/// A valid binary file.
pub fn glb() -> Vec<u8> {
    Builder::new().glb()
}

/// A valid document.
pub fn gltf() -> Vec<u8> {
    let builder = Builder::new();
    let mut document = builder.document;
    let base64 = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/".as_bytes();
    let mut data = String::from("data:application/octet-stream;base64,");
    for bytes in builder.bytes.chunks(3) {
        let word = (0..3).fold(0, |word, i| word << 8 | u32::from(bytes.get(i).copied().unwrap_or(0)));
        for i in 0..4 {
            let digit = base64[(word >> (18 - 6 * i) & 63) as usize];
            data.push(if i > bytes.len() { '=' } else { digit.into() });
        }
    }
    document["buffers"][0] = json!({"byteLength": builder.bytes.len(), "uri": data});
    document.to_string().into_bytes()
}

#[gaurast_runner::test]
fn gltf_values() {
    for (name, file) in [("a.glb", glb()), ("a.gltf", gltf()), ("a", glb())] {
        let scene = read(name, &file).expect("a good file");
        assert_eq!((scene.len(), scene.sh_degree()), (2, 1), "{name}");
        // Rotated half a turn around x.
        assert_eq!(scene.positions(), [[1.0, -2.0, -3.0], [-4.0, -5.0, -0.5]]);
        let shapes = scene.shapes();
        assert_eq!(shapes[0].scale, [0.1, 0.2, 0.3]);
        assert_eq!(shapes[0].rotation, [0.9, 0.1, -0.2, -0.3]);
        assert_eq!([shapes[0].opacity, shapes[1].opacity], OPACITIES);
        for i in 0..2 {
            for k in 0..4 {
                let sign = if k == 0 { 1.0 } else { TURN[k - 1] };
                let expected: [f32; 3] = std::array::from_fn(|c| sign * coefficient(k)[3 * i + c]);
                assert_eq!(scene.sh()[4 * i + k], expected, "{name}");
            }
        }
        let metadata = scene.metadata();
        assert_eq!(metadata.color_space, Some(ColorSpace::SrgbRec709Display));
        assert_eq!(metadata.order, Some(SortOrder::Distance));
        assert!(metadata.notes.is_empty(), "{:?}", metadata.notes);
    }
}

/// `values` as bytes of integers of `size` bytes.
fn whole(size: usize, values: &[i32]) -> Vec<u8> {
    values.iter().flat_map(|v| v.to_le_bytes()[..size].to_vec()).collect()
}

#[gaurast_runner::test]
fn every_component_type_of_gltf() {
    const ROTATION: &str = "KHR_gaussian_splatting:ROTATION";
    for (kind, size, max) in [(5120, 1, 127), (5122, 2, 32767)] {
        let mut file = Builder::new();
        let values = whole(size, &[0, -max, 0, max, -max - 1, 0, 0, 0]);
        file.attribute(ROTATION, 4, (kind, true), &values);
        let scene = file.load();
        assert_eq!(scene.shapes()[0].rotation, [1.0, 0.0, 1.0, 0.0]);
        assert_eq!(scene.shapes()[1].rotation, [0.0, -1.0, 0.0, 0.0]);
        // Integers are refused.
        let mut file = Builder::new();
        file.attribute(ROTATION, 4, (kind, false), &values);
        assert!(matches!(file.refusal().1, Reason::Type { .. }));
    }
    const SCALE: &str = "KHR_gaussian_splatting:SCALE";
    for (kind, size, max) in [(5121, 1, 255), (5123, 2, 65535)] {
        for normalized in [false, true] {
            let mut file = Builder::new();
            let values = whole(size, &[0, max, 1, 2, 3, 4]);
            file.attribute(SCALE, 3, (kind, normalized), &values);
            let unit = if normalized { 1.0 / max as f32 } else { 1.0 };
            let scene = file.load();
            close(&scene.shapes()[0].scale, &[0.0, max as f32 * unit, unit], 1e-6);
        }
    }
    for (kind, size) in [(5120, 1), (5122, 2)] {
        for normalized in [false, true] {
            let mut file = Builder::new();
            file.attribute(SCALE, 3, (kind, normalized), &whole(size, &[1; 6]));
            let (place, reason) = file.refusal();
            assert_eq!(place, Place::Part(format!("mesh 0, primitive 0, {SCALE}")));
            assert!(matches!(reason, Reason::Type { found, .. } if found.starts_with("signed")));
        }
    }
    const OPACITY: &str = "KHR_gaussian_splatting:OPACITY";
    for (kind, size, max) in [(5121, 1, 255), (5123, 2, 65535)] {
        let mut file = Builder::new();
        file.attribute(OPACITY, 1, (kind, true), &whole(size, &[max, 0]));
        let scene = file.load();
        assert_eq!(scene.shapes()[0].opacity, 1.0);
        assert_eq!(scene.shapes()[1].opacity, 0.0);
        let mut file = Builder::new();
        file.attribute(OPACITY, 1, (kind, false), &whole(size, &[max, 0]));
        assert!(matches!(file.refusal().1, Reason::Type { .. }));
    }
}

#[gaurast_runner::test]
fn nodes_move_gaussians_and_their_colours() {
    // A quarter turn around z, a scale of two, and a translation.
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let trs = json!({
        "mesh": 0, "translation": [10, 20, 30], "rotation": [0, 0, half, half], "scale": [2, 2, 2],
    });
    let matrix = json!({
        "mesh": 0, "matrix": [0, 2, 0, 0, -2, 0, 0, 0, 0, 0, 2, 0, 10, 20, 30, 1],
    });
    for node in [trs, matrix] {
        let mut file = Builder::new();
        *file.node() = node;
        let scene = file.load();
        // (x, y, z) becomes (10 - 2y, 20 + 2x, 30 + 2z), which is rotated half a turn around x.
        close(&scene.positions()[0], &[6.0, -22.0, -36.0], 1e-5);
        close(&scene.shapes()[0].scale, &[0.2, 0.4, 0.6], 1e-6);
        // x becomes y: the coefficients are those of -y, z and -x.
        let [y, z, x] = [1, 2, 3].map(coefficient);
        let c = |values: [f32; 6], sign: f32| [sign * values[0], sign * values[1], sign * values[2]];
        close(&scene.sh()[1], &c(x, -1.0), 1e-6);
        close(&scene.sh()[2], &c(z, -1.0), 1e-6);
        close(&scene.sh()[3], &c(y, -1.0), 1e-6);
    }
    // A child's transform is relative to its parent's.
    let mut file = Builder::new();
    *file.node() = json!({"children": [1], "translation": [1, 0, 0]});
    let nodes = file.document["nodes"].as_array_mut().expect("nodes");
    nodes.push(json!({"mesh": 0, "scale": [1, 3, 1]}));
    let scene = file.load();
    close(&scene.positions()[0], &[2.0, -6.0, -3.0], 1e-6);
    close(&scene.shapes()[1].scale, &[0.4, 1.5, 0.6], 1e-6);
}

#[gaurast_runner::test]
fn what_gltf_says_is_told_or_refused() {
    let mut file = Builder::new();
    file.splatting()["colorSpace"] = json!("lin_rec709_display");
    assert_eq!(file.load().metadata().color_space, Some(ColorSpace::LinearRec709Display));
    for (field, value) in [("kernel", "customShape"), ("colorSpace", "custom"), ("projection", "fisheye")] {
        let mut file = Builder::new();
        file.splatting()[field] = json!(value);
        let (place, reason) = file.refusal();
        assert_eq!(place, Place::Part("mesh 0, primitive 0, KHR_gaussian_splatting".to_owned()));
        assert!(matches!(reason, Reason::Unsupported(text) if text.contains(value)));
    }
    let mut file = Builder::new();
    file.splatting()["sortingMethod"] = json!("random");
    let scene = file.load();
    assert_eq!(scene.metadata().order, None);
    assert_eq!(scene.metadata().notes.len(), 1);

    let refused = |edit: fn(&mut Builder)| {
        let mut file = Builder::new();
        edit(&mut file);
        file.refusal().1
    };
    assert!(matches!(refused(|f| f.primitive()["mode"] = json!(4)), Reason::Unsupported(_)));
    assert!(matches!(refused(|f| f.document["asset"]["version"] = json!("1.0")), Reason::Unsupported(_)));
    assert!(matches!(refused(|f| f.document["extensionsRequired"] = json!(["EXT_unknown"])), Reason::Unsupported(_)));
    assert!(matches!(refused(|f| f.node()["children"] = json!([0])), Reason::Unsupported(_)));
    assert!(matches!(refused(|f| f.node()["mesh"] = json!(9)), Reason::Missing));
    assert!(matches!(refused(|f| f.node()["scale"] = json!([0, 1, 1])), Reason::Unsupported(_)));
    assert!(matches!(refused(|f| f.document["accessors"][0]["count"] = json!(3)), Reason::TooShort { .. }));
    assert!(matches!(refused(|f| f.document["accessors"][1]["count"] = json!(1)), Reason::Count { .. }));
    assert!(matches!(refused(|f| f.document["accessors"][0]["count"] = json!(u64::MAX)), Reason::TooShort { .. }));
    assert!(matches!(
        refused(|f| f.document["bufferViews"][0]["byteLength"] = json!(1_u64 << 40)),
        Reason::TooShort { .. }
    ));
    let name = "KHR_gaussian_splatting:SH_DEGREE_1_COEF_1";
    let mut file = Builder::new();
    file.primitive()["attributes"].as_object_mut().expect("attributes").remove(name);
    let (place, reason) = file.refusal();
    assert_eq!(place, Place::Part(format!("mesh 0, primitive 0, {name}")));
    assert!(matches!(reason, Reason::Missing));
    // Lines are ignored, and a file with nothing else is refused.
    let mut file = Builder::new();
    file.primitive()["extensions"] = json!({});
    assert!(matches!(file.refusal().1, Reason::Unsupported(_)));
    let mut file = Builder::new();
    let primitives = file.document["meshes"][0]["primitives"].as_array_mut().expect("primitives");
    primitives.push(json!({"mode": 1, "attributes": {"POSITION": 0}}));
    assert_eq!(file.load().metadata().notes.len(), 1);
}

/// A valid binary file with sparse positions that have no data of their own.
pub fn sparse_glb() -> Vec<u8> {
    let mut file = sparse((5123, 2), &[1], &[7.0, 8.0, 9.0]);
    let accessor = file.document["accessors"][0].as_object_mut();
    accessor.expect("an object").remove("bufferView");
    file.glb()
}

/// A file of which sparse `values` replace the positions of `indices`, which have a type.
fn sparse((kind, size): (u32, usize), indices: &[i32], values: &[f32]) -> Builder {
    let mut file = Builder::new();
    let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
    // The elements that replace others need not begin a view.
    let indices_view = file.view(&[&[0; 4][..], &whole(size, indices)].concat());
    let values_view = file.view(&[&[0; 8][..], &bytes].concat());
    let sparse = json!({
        "count": indices.len(),
        "indices": {"bufferView": indices_view, "byteOffset": 4, "componentType": kind},
        "values": {"bufferView": values_view, "byteOffset": 8},
    });
    file.document["accessors"][0]["sparse"] = sparse;
    file
}

#[gaurast_runner::test]
fn sparse_accessors_of_gltf_replace_elements() {
    const REPLACED: [f32; 3] = [7.0, 8.0, 9.0];
    for kind in [(5121, 1), (5123, 2), (5125, 4)] {
        let scene = sparse(kind, &[1], &REPLACED).load();
        assert_eq!(scene.positions(), [[1.0, -2.0, -3.0], [7.0, -8.0, -9.0]]);
        // Elements without data are zeros.
        let mut file = sparse(kind, &[1], &REPLACED);
        let accessor = file.document["accessors"][0].as_object_mut();
        accessor.expect("an object").remove("bufferView");
        let scene = file.load();
        assert_eq!(scene.positions(), [[0.0; 3], [7.0, -8.0, -9.0]]);
    }
    let mut file = Builder::new();
    let accessor = file.document["accessors"][5].as_object_mut();
    accessor.expect("an object").remove("bufferView");
    let scene = file.load();
    assert_eq!([scene.sh()[1], scene.sh()[5]], [[0.0; 3]; 2]);
    assert_ne!(scene.sh()[2], [0.0; 3]);

    let part = |part: &str| Place::Part(format!("mesh 0, primitive 0, POSITION{part}"));
    let two = [REPLACED, REPLACED].concat();
    for (indices, message) in [
        (&[2][..], "element 2 is not one of the accessor's 2"),
        (&[1, 0], "they must grow, and 0 follows 1"),
        (&[1, 1], "they must grow, and 1 follows 1"),
    ] {
        let values = &two[..3 * indices.len()];
        let (place, reason) = sparse((5121, 1), indices, values).refusal();
        assert_eq!(place, part(", sparse, indices"));
        assert_eq!(reason.to_string(), message);
    }
    let (place, reason) = sparse((5126, 4), &[1], &REPLACED).refusal();
    assert_eq!(place, part(", sparse, indices"));
    assert!(matches!(reason, Reason::Type { .. }));
    let (place, reason) = sparse((5121, 1), &[0, 1], &REPLACED).refusal();
    assert_eq!(place, part(", sparse, values"));
    assert!(matches!(reason, Reason::TooShort { .. }));
    // Zeros take no bytes of the file, and still don't take all memory.
    let mut file = Builder::new();
    file.document["accessors"][0] = json!({"componentType": 5126, "count": 1_u64 << 40, "type": "VEC3"});
    let (place, reason) = file.refusal();
    assert_eq!(place, part(""));
    assert!(reason.to_string().contains("1099511627776 elements"));
}

/// Tests that what is compressed by an extension is read from the buffer for other readers, if there is one.
#[gaurast_runner::test]
fn compressed_gltf_is_refused_by_the_name_of_its_extension() {
    for extension in ["EXT_meshopt_compression", "KHR_meshopt_compression"] {
        let mut file = Builder::new();
        file.document["bufferViews"][0]["extensions"][extension] = json!({"buffer": 0});
        assert_eq!(file.load().positions()[0], [1.0, -2.0, -3.0]);

        let mut file = Builder::new();
        let buffers = file.document["buffers"].as_array_mut().expect("buffers");
        buffers.push(json!({"byteLength": 24, "extensions": {extension: {"fallback": true}}}));
        file.document["bufferViews"][0]["extensions"][extension] = json!({"buffer": 0});
        file.document["bufferViews"][0]["buffer"] = json!(1);
        let (place, reason) = file.refusal();
        let expected = "mesh 0, primitive 0, POSITION, bufferView";
        assert_eq!(place, Place::Part(expected.to_owned()));
        let expected = format!("its data is compressed by {extension:?}, which is not read");
        assert_eq!(reason.to_string(), expected);
    }
    for extension in ["EXT_meshopt_compression", "KHR_meshopt_compression", "KHR_draco_mesh_compression"] {
        let mut file = Builder::new();
        file.document["extensionsRequired"] = json!([extension]);
        let (place, reason) = file.refusal();
        assert_eq!(place, Place::Part("extensionsRequired".to_owned()));
        let expected = format!("the extension {extension:?} is required and not read");
        assert_eq!(reason.to_string(), expected);
    }
    const DRACO: &str = "KHR_draco_mesh_compression";
    let mut file = Builder::new();
    *file.primitive() = json!({
        "attributes": {"POSITION": 0}, "indices": 1,
        "extensions": {DRACO: {"bufferView": 0, "attributes": {"POSITION": 0}}},
    });
    file.document["accessors"][1] = json!({"componentType": 5121, "count": 3, "type": "SCALAR"});
    let (place, reason) = file.refusal();
    assert_eq!(place, Place::Part("mesh 0, primitive 0".to_owned()));
    assert!(reason.to_string().contains(DRACO), "{reason}");
}

#[gaurast_runner::test]
fn the_default_scene_of_gltf_is_read() {
    let mut file = Builder::new();
    file.document["scenes"] = json!([{"nodes": []}, {"nodes": [0]}, {"nodes": []}]);
    file.document["scene"] = json!(1);
    // Extensions of textures concern nothing that is read.
    file.document["extensionsRequired"] = json!(["EXT_texture_webp", "KHR_mesh_quantization"]);
    let scene = file.load();
    assert_eq!(scene.len(), 2);
    let note = "scenes other than the default one are ignored: 2";
    assert_eq!(scene.metadata().notes, [note]);
}

#[gaurast_runner::test]
fn spz_in_gltf_is_a_draft_that_is_read() {
    let body = [spz_header(2, 1, 1, 1), (0..28).map(|i| 9 * i).collect()].concat();
    let plain = read("a.spz", &gzip(&body)).expect("a good file");
    for name in [
        "KHR_gaussian_splatting_compression_spz_2",
        "KHR_gaussian_splatting_compression_spz",
        "KHR_spz_gaussian_splats_compression",
    ] {
        let mut file = Builder::new();
        let view = file.view(&gzip(&body));
        let inside = json!({name: {"bufferView": view}});
        if name.starts_with("KHR_spz") {
            file.primitive()["extensions"] = inside;
        } else {
            *file.splatting() = json!({"extensions": inside});
        }
        file.document["extensionsRequired"] = json!([name]);
        let scene = file.load();
        // The drafts use left-up-front, which is half a turn around y from SPZ's own frame.
        let [x, y, z] = plain.positions()[0];
        assert_eq!(scene.positions(), [[-x, y, -z]]);
        assert_eq!(scene.shapes()[0].scale, plain.shapes()[0].scale);
        let [r, g, b]: [[f32; 3]; 3] = plain.sh()[1..].try_into().expect("three");
        let negated = |c: [f32; 3]| c.map(|v| -v);
        assert_eq!(scene.sh()[1..], [r, negated(g), negated(b)]);
        assert_eq!(scene.metadata().antialiasing, plain.metadata().antialiasing);
        assert!(scene.metadata().notes.iter().any(|note| note.contains(name)));
    }
}

#[gaurast_runner::test]
fn malformed_binary_gltf_is_refused() {
    let good = glb();
    for (at, is_reason) in [
        (0, (|r| matches!(r, Reason::Magic { .. })) as IsReason),
        (4, |r| matches!(r, Reason::Version { .. })),
        (9, |r| matches!(r, Reason::TooShort { .. })),
        (15, |r| matches!(r, Reason::TooShort { .. })),
        (16, |r| matches!(r, Reason::Missing)),
        (20, |r| matches!(r, Reason::Json(_))),
    ] {
        let mut file = good.clone();
        file[at] = 0x7f;
        let (_, reason) = refusal("a.glb", &file);
        assert!(is_reason(&reason), "byte {at}: {reason:?}");
    }
}

/// Tests a real file, which has signed scales in four of its primitives; the extension doesn't allow them.
#[gaurast_runner::test]
fn scales_of_a_draft_are_logarithms() {
    let mut builder = Builder::new();
    builder.floats("KHR_gaussian_splatting:SCALE", 3, &SCALES.map(f32::ln));
    let scene = builder.load();
    let plain = Builder::new().load();
    for (shape, expected) in scene.shapes().iter().zip(plain.shapes()) {
        close(&shape.scale, &expected.scale, 1e-6);
    }
    assert!(scene.metadata().notes[0].contains("scales are logarithms"), "{:?}", scene.metadata().notes);
    assert!(plain.metadata().notes.is_empty());
}

#[gaurast_runner::test]
fn axes_that_are_given_replace_gltfs_own() {
    let file = Builder::new().glb();
    let options = Options { axes: Some(Axes::RIGHT_DOWN_FRONT), ..Options::default() };
    let path = std::path::Path::new("a.glb");
    let scene = gaurast_scene::read_with(path, &mut &file[..], file.len() as u64, &options).expect("a good file");
    assert_eq!(scene.positions().as_flattened(), POSITIONS);
    assert_eq!(scene.metadata().axes.map(|axes| axes.of_cameras), Some(false));
}

#[gaurast_runner::test]
fn a_node_far_away_and_unknown_attributes() {
    let mut builder = Builder::new();
    builder.node()["translation"] = json!([4_000_000.25, 300_000.5, -5_000_000.125]);
    builder.floats("_TIME", 1, &[0.0, 1.0]);
    let scene = builder.load();
    // From right, up, back to right, down, forward.
    assert_eq!(scene.origin(), [4_000_000.25, -300_000.5, 5_000_000.125]);
    assert_eq!(scene.positions(), Builder::new().load().positions());
    assert!(scene.metadata().warnings[0].contains("_TIME"));
}

#[gaurast_runner::test]
fn a_real_gltf_is_read_without_its_signed_scales() {
    for name in ["splats/khr_conformance_matrix.gltf", "splats/khr_conformance_matrix.glb"] {
        let error = gaurast_scene::open(data(name)).expect_err("signed scales").to_string();
        assert!(
            error.contains("mesh 4, primitive 0, KHR_gaussian_splatting:SCALE: its type is signed byte"),
            "{error}"
        );
    }
    let text = std::fs::read(data("splats/khr_conformance_matrix.gltf")).expect("text");
    let mut document: Value = serde_json::from_slice(&text).expect("JSON");
    document["scenes"][0]["nodes"] = json!([0, 1, 2, 3, 8, 9, 10, 11, 12, 13, 14, 15]);
    let scene = read("a.gltf", document.to_string().as_bytes()).expect("a good file");
    assert_eq!((scene.len(), scene.sh_degree()), (11, 3));
    for i in 0..11 {
        assert_eq!(scene.positions()[i], [1.0, -2.0, -3.0]);
        let sh = &scene.sh()[16 * i..16 * (i + 1)];
        assert_eq!(sh[0], [0.1, 0.2, 0.3], "{i}");
        if i >= 7 {
            // Coefficient k is k + 0.1, k + 0.2, k + 0.3.
            let known = [1, 4, 9, 16][i - 7];
            for (k, rgb) in sh.iter().enumerate() {
                let sign = if k == 0 { 1.0 } else { TURN[k - 1] };
                let base = if k < known { k as f32 } else { 0.0 };
                let step = if k < known { 0.1 } else { 0.0 };
                close(rgb, &[1.0, 2.0, 3.0].map(|c| sign * (base + step * c)), 1e-5);
            }
        }
    }
    let opacities: Vec<_> = scene.shapes().iter().map(|shape| shape.opacity).collect();
    close(&opacities[..4], &[0.25; 4], 1e-6);
    let error = gaurast_scene::open(data("splats/khr_extensible_fallback.gltf")).expect_err("a kernel");
    assert!(error.to_string().contains("customShape"), "{error}");
}
