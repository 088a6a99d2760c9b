//! Files with triangles.

use gaurast_runner::{Need, data};
use gaurast_scene::{Mesh, Place, Reason, Scene, Transform};
use glam::{DQuat, DVec3};
use serde_json::{Value, json};

use super::support::*;

/// The header of a square of one face, with colours, in `format`.
fn header(format: &str) -> String {
    format!(
        "ply\nformat {format} 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
         property uchar red\nproperty uchar green\nproperty uchar blue\n\
         element face 2\nproperty uchar flags\nproperty list uchar int vertex_indices\nend_header\n"
    )
}

const CORNERS: [[f32; 3]; 4] = [[0., 0., 1.], [2., 0., 1.], [2., 2., 1.], [0., 2., 1.]];

/// The square as text.
fn text() -> String {
    let corners = CORNERS.map(|[x, y, z]| format!("{x} {y} {z} 255 51 0\n"));
    header("ascii") + &corners.concat() + "7 4 0 1 2 3\n7 3 0 2 1\n"
}

/// The square in a binary PLY file.
pub fn binary(big_endian: bool) -> Vec<u8> {
    let format = if big_endian { "binary_big_endian" } else { "binary_little_endian" };
    let mut file = header(format).into_bytes();
    let word = |bytes: [u8; 4]| {
        let mut bytes = bytes;
        if big_endian {
            bytes.reverse();
        }
        bytes
    };
    for corner in CORNERS {
        file.extend(corner.map(|c| word(c.to_le_bytes())).as_flattened());
        file.extend([255, 51, 0]);
    }
    for face in [&[0, 1, 2, 3][..], &[0, 2, 1]] {
        file.extend([7, face.len() as u8]);
        file.extend(face.iter().flat_map(|index: &i32| word(index.to_le_bytes())));
    }
    file
}

/// A binary glTF file: a strip of two triangles, with linear colours of a material, moved by its node.
fn strip(mode: u32, indices: &[u16]) -> Vec<u8> {
    strip_with(mode, indices, |_| {})
}

/// The same file after a change of its document.
fn strip_with(mode: u32, indices: &[u16], change: impl FnOnce(&mut Value)) -> Vec<u8> {
    let strip = [CORNERS[0], CORNERS[1], CORNERS[3], CORNERS[2]];
    let mut bytes: Vec<u8> = strip.as_flattened().iter().flat_map(|c| c.to_le_bytes()).collect();
    let at = bytes.len();
    bytes.extend(indices.iter().flat_map(|index| index.to_le_bytes()));
    let mut document = json!({
        "asset": {"version": "2.0"}, "nodes": [{"mesh": 0, "translation": [10, 0, 0]}],
        "meshes": [{"primitives": [{"mode": mode, "attributes": {"POSITION": 0}, "indices": 1, "material": 0}]}],
        "materials": [{"pbrMetallicRoughness": {"baseColorFactor": [1.0, 0.21404114, 0.0, 1.0],
                                                "baseColorTexture": {"index": 0}}}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5123, "count": indices.len(), "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": at},
            {"buffer": 0, "byteOffset": at, "byteLength": bytes.len() - at},
        ],
        "buffers": [{"byteLength": bytes.len()}],
    });
    change(&mut document);
    let mut json = document.to_string().into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut file = b"glTF".to_vec();
    let words = |words: &[usize]| -> Vec<u8> { words.iter().flat_map(|w| (*w as u32).to_le_bytes()).collect() };
    file.extend(words(&[2, 12 + 8 + json.len() + 8 + bytes.len(), json.len()]));
    file.extend(b"JSON");
    file.extend(json);
    file.extend(words(&[bytes.len()]));
    file.extend(b"BIN\0");
    file.extend(bytes);
    file
}

/// A valid file.
pub fn glb() -> Vec<u8> {
    strip(5, &[0, 1, 2, 3])
}

/// The positions of the triangles, three by three.
fn positions(mesh: &Mesh) -> Vec<[f32; 3]> {
    mesh.vertices().iter().map(|vertex| vertex.position).collect()
}

#[gaurast_runner::test]
fn faces_of_ply_files_are_triangles() {
    let expected = [0, 1, 2, 0, 2, 3, 0, 2, 1].map(|corner: usize| CORNERS[corner]);
    for file in [text().into_bytes(), binary(false), binary(true)] {
        let scene = read("a.ply", &file).expect("a good file");
        assert!(scene.is_empty());
        assert_eq!(positions(scene.mesh()), expected);
        let vertex = scene.mesh().vertices()[0];
        close(&vertex.color, &[1.0, 0.2, 0.0], 1e-6);
        assert_eq!(vertex.normal, [0., 0., 1.]);
    }
    let (place, reason) = refusal("a.ply", text().replace("7 3 0 2 1", "7 3 0 2 4").as_bytes());
    let face = Place::Property { element: "face".to_owned(), property: "vertex_indices".to_owned() };
    assert_eq!(place, face);
    assert!(reason.to_string().contains("vertex 4 is not one of the 4"), "{reason}");
    let negative = text().replace("7 3 0 2 1", "7 3 0 2 -1");
    assert_eq!(refusal("a.ply", negative.as_bytes()).0, face);
    let scalar = text().replace("list uchar int", "int");
    assert!(matches!(refusal("a.ply", scalar.as_bytes()).1, Reason::Type { .. }));
    // Faces do not make a mesh of Gaussians.
    let (properties, rows) = distinct(0, 1);
    let gaussians = String::from_utf8(ply(Encoding::Ascii, &properties, &rows)).expect("text");
    let faces = "element face 0\nproperty list uchar int vertex_indices\nend_header";
    let scene = read("a.ply", gaussians.replace("end_header", faces).as_bytes()).expect("a good file");
    assert_eq!((scene.len(), scene.mesh().triangles()), (1, 0));
}

#[gaurast_runner::test]
fn triangles_of_gltf_files_are_in_the_scenes_frame() {
    let scene = read("a.glb", &glb()).expect("a good file");
    let at = |corner: usize| {
        let [x, y, z] = CORNERS[corner];
        [x + 10.0, -y, -z]
    };
    // The second triangle of a strip runs the other way round.
    assert_eq!(positions(scene.mesh()), [0, 1, 3, 3, 1, 2].map(at));
    let vertex = scene.mesh().vertices()[0];
    assert_eq!(vertex.normal, [0., 0., -1.]);
    close(&vertex.color, &[1.0, 0.5, 0.0], 1e-5);
    assert_eq!(scene.metadata().notes, ["textures of meshes are ignored, and their materials' colours are taken"]);
    let list = read("a.glb", &strip(4, &[0, 1, 2, 3])).expect("a good file");
    assert_eq!(positions(list.mesh()), [0, 1, 3].map(at));
    let fan = read("a.glb", &strip(6, &[0, 1, 3, 2])).expect("a good file");
    assert_eq!(positions(fan.mesh()), [0, 1, 2, 0, 2, 3].map(at));
    // The same file with a sparse accessor of its indices: the second and the third are replaced by 3 and 0.
    let sparse = strip_with(4, &[0, 1, 2, 3, 0], |document| {
        document["accessors"][1] = json!({
            "bufferView": 1, "componentType": 5123, "count": 3, "type": "SCALAR",
            "sparse": {
                "count": 2,
                "indices": {"bufferView": 1, "byteOffset": 2, "componentType": 5123},
                "values": {"bufferView": 1, "byteOffset": 6},
            },
        });
    });
    let list = read("a.glb", &sparse).expect("a good file");
    assert_eq!(positions(list.mesh()), [0, 2, 0].map(at));
    let (place, reason) = refusal("a.glb", &strip(4, &[0, 1, 9]));
    assert_eq!(place, Place::Part("mesh 0, primitive 0, indices".to_owned()));
    assert!(reason.to_string().contains("vertex 9"), "{reason}");
    assert!(matches!(refusal("a.glb", &strip(1, &[0, 1])).1, Reason::Unsupported(_)));
}

#[gaurast_runner::test]
fn meshes_are_placed_among_gaussians() {
    let (properties, rows) = distinct(1, 2);
    let gaussians = read("a.ply", &ply(Encoding::Little, &properties, &rows)).expect("a good file");
    let mesh = read("b.ply", &binary(false)).expect("a good file");
    let transform =
        Transform { scale: 2.0, rotation: DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2), translation: DVec3::X };
    let check = |scene: &Scene| {
        assert_eq!((scene.positions(), scene.sh_degree()), (gaussians.positions(), 1));
        assert_eq!(scene.mesh().triangles(), 3);
        // The corner (2, 0, 1) becomes (4, 0, 2), then (0, 4, 2), then (1, 4, 2).
        close(&scene.mesh().vertices()[1].position, &[1., 4., 2.], 1e-5);
        assert!(scene.metadata().notes.is_empty());
    };
    let mut scene = gaussians.clone();
    scene.append(&mesh, &transform);
    check(&scene);
    let mut scene = Scene::default();
    scene.append(&mesh, &transform);
    scene.append(&gaussians, &Transform::default());
    check(&scene);
    let extent = gaurast_scene::Extent::of(&scene);
    assert!(extent.centre[1] + extent.half[1] >= 4.0 - 1e-5, "{extent:?}");
    assert_eq!(gaurast_scene::info::Info::new(&scene).triangles, 3);
}

#[gaurast_runner::test(needs = [Need::Data("meshes/bunny.ply"), Need::Data("meshes/Duck.glb")])]
fn real_meshes_are_read() {
    let bunny = gaurast_scene::open(data("meshes/bunny.ply")).expect("a good file");
    assert_eq!(bunny.mesh().triangles(), 16_301);
    let duck = gaurast_scene::open(data("meshes/Duck.glb")).expect("a good file");
    assert_eq!(duck.mesh().triangles(), 4212);
    let unit = |vertex: &gaurast_scene::MeshVertex| {
        let squares: f32 = vertex.normal.iter().map(|c| c * c).sum();
        (squares - 1.0).abs() < 1e-3
    };
    for scene in [bunny, duck] {
        let lengths = scene.mesh().vertices().iter().filter(|vertex| unit(vertex));
        assert!(lengths.count() > 2 * scene.mesh().triangles());
    }
}
