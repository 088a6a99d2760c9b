//! The parts of a glTF document that Gaussians need.

use std::collections::BTreeMap;

use serde::Deserialize;
use serde::de::IgnoredAny;

use crate::error::{Fault, Place, Reason};

/// The extension's name.
pub(super) const EXTENSION: &str = "KHR_gaussian_splatting";

/// Names of draft extensions that store Gaussians as SPZ: in an object of the extension or, for the last one, next to
/// it.
pub(super) const DRAFTS: [&str; 3] = [
    "KHR_gaussian_splatting_compression_spz_2",
    "KHR_gaussian_splatting_compression_spz",
    "KHR_spz_gaussian_splats_compression",
];

/// Extensions that a document may require: those that this reader supports, and those that don't concern Gaussians.
const FOLLOWED: [&str; 5] =
    [EXTENSION, "KHR_mesh_quantization", "KHR_lights_punctual", "KHR_xmp_json_ld", "KHR_animation_pointer"];

/// Prefixes of names of extensions that don't concern Gaussians, nor triangles without textures.
const IRRELEVANT: [&str; 3] = ["KHR_materials_", "KHR_texture_", "EXT_texture_"];

/// The extension that stores a primitive's triangles compressed.
const DRACO: &str = "KHR_draco_mesh_compression";

/// A document.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Document {
    asset: Asset,
    scene: Option<usize>,
    #[serde(default)]
    extensions_required: Vec<String>,
    #[serde(default)]
    pub(super) scenes: Vec<SceneNodes>,
    #[serde(default)]
    pub(super) nodes: Vec<Node>,
    #[serde(default)]
    pub(super) meshes: Vec<Mesh>,
    #[serde(default)]
    pub(super) materials: Vec<Material>,
    #[serde(default)]
    pub(super) accessors: Vec<Accessor>,
    #[serde(default)]
    pub(super) buffer_views: Vec<BufferView>,
    #[serde(default)]
    pub(super) buffers: Vec<Buffer>,
    #[serde(default)]
    pub(super) animations: Vec<IgnoredAny>,
}

#[derive(Deserialize)]
struct Asset {
    version: String,
}

#[derive(Deserialize)]
pub(super) struct SceneNodes {
    #[serde(default)]
    nodes: Vec<usize>,
}

/// A node of the tree.
#[derive(Deserialize)]
pub(super) struct Node {
    pub(super) mesh: Option<usize>,
    #[serde(default)]
    pub(super) children: Vec<usize>,
    pub(super) matrix: Option<[f64; 16]>,
    pub(super) translation: Option<[f64; 3]>,
    /// The quaternion x, y, z, w.
    pub(super) rotation: Option<[f64; 4]>,
    pub(super) scale: Option<[f64; 3]>,
}

#[derive(Deserialize)]
pub(super) struct Mesh {
    pub(super) primitives: Vec<Primitive>,
}

#[derive(Deserialize)]
pub(super) struct Primitive {
    pub(super) attributes: BTreeMap<String, usize>,
    pub(super) mode: Option<u32>,
    pub(super) indices: Option<usize>,
    pub(super) material: Option<usize>,
    #[serde(default)]
    pub(super) extensions: BTreeMap<String, serde_json::Value>,
}

/// The surface of triangles.
#[derive(Default, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Material {
    #[serde(default)]
    pub(super) pbr_metallic_roughness: Surface,
}

#[derive(Default, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Surface {
    /// Linear red, green and blue, and alpha.
    pub(super) base_color_factor: Option<[f32; 4]>,
    pub(super) base_color_texture: Option<IgnoredAny>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Accessor {
    pub(super) buffer_view: Option<usize>,
    #[serde(default)]
    pub(super) byte_offset: usize,
    pub(super) component_type: u32,
    #[serde(default)]
    pub(super) normalized: bool,
    pub(super) count: usize,
    #[serde(rename = "type")]
    pub(super) shape: String,
    pub(super) sparse: Option<Sparse>,
}

/// The elements of an accessor that replace others.
#[derive(Deserialize)]
pub(super) struct Sparse {
    pub(super) count: usize,
    /// The indices of the elements that are replaced, which grow.
    pub(super) indices: SparseIndices,
    /// The elements that replace them, of the accessor's type.
    pub(super) values: SparseValues,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct SparseIndices {
    pub(super) buffer_view: usize,
    #[serde(default)]
    pub(super) byte_offset: usize,
    pub(super) component_type: u32,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct SparseValues {
    pub(super) buffer_view: usize,
    #[serde(default)]
    pub(super) byte_offset: usize,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct BufferView {
    pub(super) buffer: usize,
    #[serde(default)]
    pub(super) byte_offset: usize,
    pub(super) byte_length: usize,
    pub(super) byte_stride: Option<usize>,
    #[serde(default)]
    pub(super) extensions: BTreeMap<String, IgnoredAny>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Buffer {
    pub(super) uri: Option<String>,
    pub(super) byte_length: usize,
}

impl Document {
    /// Refuses unsupported versions and required extensions.
    pub(super) fn check(&self) -> Result<(), Fault> {
        if !self.asset.version.starts_with("2.") {
            let text = format!("version {:?} is not one of those read (2.x)", self.asset.version);
            return Err(Reason::Unsupported(text).at(Place::Part("asset.version".to_owned())));
        }
        let unknown = self.extensions_required.iter().find(|name| {
            !FOLLOWED.contains(&name.as_str())
                && !DRAFTS.contains(&name.as_str())
                && !IRRELEVANT.iter().any(|start| name.starts_with(start))
        });
        match unknown {
            Some(name) => {
                let text = format!("the extension {name:?} is required and not read");
                Err(Reason::Unsupported(text).at(Place::Part("extensionsRequired".to_owned())))
            }
            None => Ok(()),
        }
    }

    /// Refuses a primitive whose triangles are nowhere but in a compressed buffer view. Messages name it `place`.
    pub(super) fn check_primitive(&self, primitive: &Primitive, place: &str) -> Result<(), Fault> {
        let has_no_data = |index: &usize| {
            let accessor = self.accessors.get(*index);
            accessor.is_some_and(|accessor| accessor.buffer_view.is_none())
        };
        let mut accessors = primitive.attributes.values().chain(&primitive.indices);
        if primitive.extensions.contains_key(DRACO) && accessors.any(has_no_data) {
            let text = format!("its data is compressed by {DRACO:?}, which is not read");
            return Err(Reason::Unsupported(text).at(Place::Part(place.to_owned())));
        }
        Ok(())
    }

    /// The root nodes of the default scene; of the first one if none is default, and of all trees if there is none.
    pub(super) fn roots(&self) -> Result<Vec<usize>, Fault> {
        if self.scenes.is_empty() {
            let mut roots = vec![true; self.nodes.len()];
            for child in self.nodes.iter().flat_map(|node| &node.children) {
                if let Some(root) = roots.get_mut(*child) {
                    *root = false;
                }
            }
            return Ok((0..roots.len()).filter(|node| roots[*node]).collect());
        }
        let index = self.scene.unwrap_or(0);
        match self.scenes.get(index) {
            Some(scene) => Ok(scene.nodes.clone()),
            None => Err(Reason::Missing.at(Place::Part(format!("scene {index}")))),
        }
    }
}
