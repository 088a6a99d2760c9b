//! glTF 2.0 with `KHR_gaussian_splatting`, as JSON (`.gltf`) and as a binary file (`.glb`).
//!
//! Every primitive with the extension becomes Gaussians, and every one of triangles a mesh, transformed by its node. The
//! axes are right, up, back. Draft extensions that store a primitive's Gaussians as SPZ are read, and a note names them as
//! drafts.

mod accessor;
mod buffers;
mod document;
mod primitive;
mod triangles;

use glam::{DAffine3, DMat3, DQuat, DVec3};

use super::input::{Format, Input, Loaded, Origin};
use super::spz::one_line;
use crate::axes::{Axes, AxesReason, FileAxes};
use crate::error::{Fault, Place, Reason};
use crate::scene::Scene;
use crate::transform::Motion;
use buffers::Buffers;
use document::{Document, Node};

/// The format as JSON.
pub(super) struct Gltf;

/// The format as a binary file.
pub(super) struct Glb;

const MAGIC: &[u8; 4] = b"glTF";

/// Bytes of a binary file's header, and of the header of each of its chunks.
const HEADER: usize = 12;
const CHUNK_HEADER: usize = 8;

impl Format for Gltf {
    fn name(&self) -> &'static str {
        "glTF"
    }

    fn extensions(&self) -> &'static [&'static str] {
        &["gltf"]
    }

    fn has_axes_of_cameras(&self) -> bool {
        false
    }

    fn load(&self, input: &mut Input<'_>) -> Result<Loaded, Fault> {
        let json = input.rest()?;
        Ok(load(&json, None, input.origin())?.into())
    }
}

impl Format for Glb {
    fn name(&self) -> &'static str {
        "binary glTF"
    }

    fn extensions(&self) -> &'static [&'static str] {
        &["glb"]
    }

    fn magic(&self) -> Option<&'static [u8]> {
        Some(MAGIC)
    }

    fn has_axes_of_cameras(&self) -> bool {
        false
    }

    fn load(&self, input: &mut Input<'_>) -> Result<Loaded, Fault> {
        let bytes = input.rest()?;
        let word = |at: usize| {
            let word = bytes.get(at..at + 4)?;
            Some(u32::from_le_bytes(word.try_into().ok()?))
        };
        let truncated = || Reason::Truncated.at(Place::Byte(bytes.len() as u64));
        if !bytes.starts_with(MAGIC) {
            let expected = "a binary glTF file";
            return Err(Reason::Magic { expected }.at(Place::Byte(0)));
        }
        let found = word(4).ok_or_else(truncated)?;
        if found != 2 {
            let read = "2";
            return Err(Reason::Version { found, read }.at(Place::Header("version")));
        }
        let len = word(8).ok_or_else(truncated)?;
        let (claimed, available) = (len.into(), bytes.len() as u64);
        if claimed > available {
            return Err(Reason::TooShort { claimed, available }.at(Place::Header("length")));
        }
        let mut chunks = [None; 2];
        let mut rest = bytes[..len as usize].get(HEADER..).unwrap_or_default();
        while let Some((head, after)) = rest.split_first_chunk::<CHUNK_HEADER>() {
            let [size, kind] = [0, 4].map(|at| u32::from_le_bytes(std::array::from_fn(|i| head[at + i])));
            let Some((chunk, after)) = after.split_at_checked(size as usize) else {
                let (claimed, available) = (size.into(), after.len() as u64);
                return Err(Reason::TooShort { claimed, available }.at(Place::Header("chunkLength")));
            };
            match &kind.to_le_bytes() {
                b"JSON" => chunks[0] = chunks[0].or(Some(chunk)),
                b"BIN\0" => chunks[1] = chunks[1].or(Some(chunk)),
                // Chunks of extensions are skipped.
                _ => {}
            }
            rest = after;
        }
        let json = chunks[0].ok_or_else(|| Reason::Missing.at(Place::Header("the JSON chunk")))?;
        Ok(load(json, chunks[1], input.origin())?.into())
    }
}

/// Reads the scene of the document `json`, whose first buffer may be a binary file's chunk `binary`.
fn load(json: &[u8], binary: Option<&[u8]>, origin: Origin<'_>) -> Result<Scene, Fault> {
    let document: Document =
        serde_json::from_slice(json).map_err(|error| Reason::Json(one_line(&error)).at(Place::File))?;
    document.check()?;
    let mut reader = Reader {
        document: &document,
        buffers: Buffers::new(&document, binary, origin),
        scene: Scene::default(),
        visited: vec![false; document.nodes.len()],
        other_primitives: 0,
        has_textures: false,
    };
    let to_scene = DAffine3::from_mat3(origin.options.axes.unwrap_or(Axes::RIGHT_UP_BACK).matrix());
    for root in document.roots()? {
        reader.visit(root, to_scene)?;
    }
    let Reader { mut scene, other_primitives, has_textures, .. } = reader;
    let named = origin.options.axes;
    scene.metadata_mut().axes = named.map(|axes| FileAxes { axes, reason: AxesReason::Given, of_cameras: false });
    if scene.is_empty() && scene.mesh().is_empty() {
        let text = "no node of its scene has Gaussians (KHR_gaussian_splatting) or triangles";
        return Err(Reason::Unsupported(text.to_owned()).at(Place::File));
    }
    if other_primitives > 0 {
        scene
            .metadata_mut()
            .note(format!("what are neither Gaussians nor triangles is ignored: {other_primitives} primitives"));
    }
    if has_textures {
        scene.metadata_mut().note("textures of meshes are ignored, and their materials' colours are taken");
    }
    if document.scenes.len() > 1 {
        let others = document.scenes.len() - 1;
        scene.metadata_mut().note(format!("scenes other than the default one are ignored: {others}"));
    }
    if !document.animations.is_empty() {
        scene.metadata_mut().note("animations are ignored");
    }
    Ok(scene)
}

/// Reads a document into a scene, node by node.
struct Reader<'a> {
    document: &'a Document,
    buffers: Buffers<'a>,
    scene: Scene,
    /// True for each node that has been visited; each is in a tree once.
    visited: Vec<bool>,
    other_primitives: usize,
    /// True if triangles have a texture.
    has_textures: bool,
}

/// The affine map of `node`.
fn local(node: &Node) -> DAffine3 {
    if let Some(matrix) = node.matrix {
        let column = |i: usize| DVec3::from_slice(&matrix[4 * i..4 * i + 3]);
        return DAffine3 { matrix3: DMat3::from_cols(column(0), column(1), column(2)), translation: column(3) };
    }
    DAffine3::from_scale_rotation_translation(
        node.scale.map_or(DVec3::ONE, DVec3::from_array),
        node.rotation.map_or(DQuat::IDENTITY, |q| DQuat::from_array(q).normalize()),
        node.translation.map_or(DVec3::ZERO, DVec3::from_array),
    )
}

impl Reader<'_> {
    /// Reads the Gaussians and triangles of node `root` and its descendants, transformed by `above` and by their nodes.
    fn visit(&mut self, root: usize, above: DAffine3) -> Result<(), Fault> {
        let mut stack = vec![(root, above)];
        while let Some((index, above)) = stack.pop() {
            let place = || Place::Part(format!("node {index}"));
            let document = self.document;
            let node = document.nodes.get(index).ok_or_else(|| Reason::Missing.at(place()))?;
            if std::mem::replace(&mut self.visited[index], true) {
                let text = "it is in the tree of nodes twice";
                return Err(Reason::Unsupported(text.to_owned()).at(place()));
            }
            let map = above * local(node);
            if let Some(mesh) = node.mesh {
                if !map.is_finite() || map.matrix3.determinant() == 0.0 {
                    let text = "its transform cannot be inverted";
                    return Err(Reason::Unsupported(text.to_owned()).at(place()));
                }
                self.mesh(mesh, &map)?;
            }
            // In the order of the file.
            stack.extend(node.children.iter().rev().map(|child| (*child, map)));
        }
        Ok(())
    }

    /// Reads the Gaussians and triangles of mesh `index`, transformed by `map`.
    fn mesh(&mut self, index: usize, map: &DAffine3) -> Result<(), Fault> {
        let document = self.document;
        let mesh =
            document.meshes.get(index).ok_or_else(|| Reason::Missing.at(Place::Part(format!("mesh {index}"))))?;
        for (number, primitive) in mesh.primitives.iter().enumerate() {
            let place = format!("mesh {index}, primitive {number}");
            document.check_primitive(primitive, &place)?;
            let mut scene = if let Some(scene) = primitive::gaussians(&mut self.buffers, primitive, &place)? {
                scene
            } else if let Some(mesh) = triangles::mesh(&mut self.buffers, primitive, &place)? {
                self.has_textures |= triangles::has_texture(document, primitive);
                let mut scene = Scene::default();
                *scene.mesh_mut() = mesh;
                scene
            } else {
                self.other_primitives += 1;
                continue;
            };
            scene.apply(&Motion::new(map.matrix3, map.translation, scene.sh_degree()));
            self.scene.try_join(scene)?;
        }
        Ok(())
    }
}
