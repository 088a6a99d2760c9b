//! Files of glTF with `KHR_gaussian_splatting`.

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use gaurast_scene::Camera;
use serde_json::{Map, Value, json};

use crate::gaussian::Gaussian;

/// The components of an attribute.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Component {
    /// binary32.
    Float,
    /// Signed bytes, normalized.
    Byte,
    /// Signed 16-bit integers, normalized.
    Short,
    /// Bytes, as they are.
    UnsignedByte,
    /// Bytes, normalized.
    UnsignedByteNormalized,
    /// 16-bit integers, as they are.
    UnsignedShort,
    /// 16-bit integers, normalized.
    UnsignedShortNormalized,
}

impl Component {
    /// glTF's number, and whether values are normalized.
    fn named(self) -> (u32, bool) {
        match self {
            Self::Float => (5126, false),
            Self::Byte => (5120, true),
            Self::Short => (5122, true),
            Self::UnsignedByte => (5121, false),
            Self::UnsignedByteNormalized => (5121, true),
            Self::UnsignedShort => (5123, false),
            Self::UnsignedShortNormalized => (5123, true),
        }
    }

    fn bytes(self, value: f32) -> Vec<u8> {
        let rounded = |factor: f32| libm::roundf(value * factor);
        match self {
            Self::Float => value.to_le_bytes().to_vec(),
            Self::Byte => (rounded(127.0) as i8).to_le_bytes().to_vec(),
            Self::Short => (rounded(32_767.0) as i16).to_le_bytes().to_vec(),
            Self::UnsignedByte => vec![rounded(1.0) as u8],
            Self::UnsignedByteNormalized => vec![rounded(255.0) as u8],
            Self::UnsignedShort => (rounded(1.0) as u16).to_le_bytes().to_vec(),
            Self::UnsignedShortNormalized => (rounded(65_535.0) as u16).to_le_bytes().to_vec(),
        }
    }
}

/// A scene as a glTF file has it.
#[derive(Clone, Debug)]
pub struct Gltf {
    /// The Gaussians of the one mesh.
    pub gaussians: Vec<Gaussian>,
    /// The components of `POSITION`.
    pub position: Component,
    /// The components of `ROTATION`.
    pub rotation: Component,
    /// The components of `SCALE`.
    pub scale: Component,
    /// The components of `OPACITY`.
    pub opacity: Component,
    /// The nodes, of which those of `roots` are the scene's.
    pub nodes: Vec<Value>,
    /// The scene's nodes.
    pub roots: Vec<usize>,
    /// The members of the extension's object.
    pub extension: Map<String, Value>,
    /// True if all attributes share a buffer view, element by element.
    pub is_interleaved: bool,
    /// True if the positions are an accessor without data, whose elements a sparse one replaces.
    pub is_sparse: bool,
    /// The colour of each Gaussian for renderers without the extension.
    pub fallback: Option<[f32; 4]>,
    /// The linear colour of the primitive's material.
    pub material: Option<[f32; 4]>,
}

impl Gltf {
    /// Gaussians in a node without a transform, with attributes in binary32.
    pub fn new(gaussians: Vec<Gaussian>) -> Self {
        let mut extension = Map::new();
        extension.insert("kernel".to_owned(), json!("ellipse"));
        extension.insert("colorSpace".to_owned(), json!("srgb_rec709_display"));
        Self {
            gaussians,
            position: Component::Float,
            rotation: Component::Float,
            scale: Component::Float,
            opacity: Component::Float,
            nodes: vec![json!({"mesh": 0})],
            roots: vec![0],
            extension,
            is_interleaved: false,
            is_sparse: false,
            fallback: None,
            material: None,
        }
    }

    /// The same in a node with these members.
    #[must_use]
    pub fn in_node(self, mut node: Value) -> Self {
        node["mesh"] = json!(0);
        Self { nodes: vec![node], ..self }
    }

    /// The same with a member of the extension's object.
    #[must_use]
    pub fn with(mut self, name: &str, value: &str) -> Self {
        self.extension.insert(name.to_owned(), json!(value));
        self
    }

    /// The file, with `camera`, whose coordinates are those of 3DGS, as a node.
    pub fn bytes(&self, camera: &Camera) -> Vec<u8> {
        let mut buffer = Buffer::default();
        let mut attributes = Map::new();
        let columns = self.columns();
        if self.is_interleaved {
            buffer.interleaved(&columns, &mut attributes);
        } else {
            for column in &columns {
                let is_sparse = self.is_sparse && column.name == "POSITION";
                let accessor = if is_sparse { buffer.sparse(column) } else { buffer.plain(column) };
                attributes.insert(column.name.clone(), json!(accessor));
            }
        }
        let mut primitive = json!({
            "attributes": attributes,
            "mode": 0,
            "extensions": {"KHR_gaussian_splatting": self.extension},
        });
        let mut nodes = self.nodes.clone();
        let mut roots = self.roots.clone();
        roots.push(nodes.len());
        nodes.push(json!({"camera": 0, "matrix": node_matrix(camera)}));
        let height = f64::from(camera.height);
        let mut used = vec!["KHR_gaussian_splatting"];
        let is_quantized = self.position != Component::Float;
        if is_quantized {
            used.push("KHR_mesh_quantization");
        }
        let mut file = json!({
            "asset": {"version": "2.0", "generator": "gaurast-compliance", "copyright": "CC0"},
            "extensionsUsed": used,
            "cameras": [{
                "type": "perspective",
                "perspective": {
                    "aspectRatio": f64::from(camera.width) / height,
                    "yfov": 2.0 * libm::atan(0.5 * height / camera.focal[1]),
                    "znear": camera.near,
                },
            }],
            "scene": 0,
            "scenes": [{"nodes": roots}],
            "nodes": nodes,
        });
        if is_quantized {
            file["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
        }
        if let Some(color) = self.material {
            primitive["material"] = json!(0);
            file["materials"] = json!([{"pbrMetallicRoughness": {"baseColorFactor": color}}]);
        }
        file["meshes"] = json!([{"primitives": [primitive]}]);
        file["accessors"] = json!(buffer.accessors);
        file["bufferViews"] = json!(buffer.views);
        let encoded = BASE64_STANDARD.encode(&buffer.bytes);
        file["buffers"] = json!([{
            "byteLength": buffer.bytes.len(),
            "uri": format!("data:application/octet-stream;base64,{encoded}"),
        }]);
        let mut bytes = serde_json::to_vec_pretty(&file).expect("JSON of numbers and strings");
        bytes.push(b'\n');
        bytes
    }

    fn columns(&self) -> Vec<Column> {
        let each = |name: &str, component, width, of: &dyn Fn(&Gaussian) -> Vec<f32>| Column {
            name: name.to_owned(),
            component,
            width,
            values: self.gaussians.iter().map(of).collect(),
        };
        let own = |name: &str| format!("KHR_gaussian_splatting:{name}");
        let mut columns = vec![
            each("POSITION", self.position, 3, &|one| one.position.to_vec()),
            each(&own("ROTATION"), self.rotation, 4, &|one| one.rotation.to_vec()),
            each(&own("SCALE"), self.scale, 3, &|one| one.scale.to_vec()),
            each(&own("OPACITY"), self.opacity, 1, &|one| vec![one.opacity]),
        ];
        let coefficients = self.gaussians.first().map_or(1, |one| one.harmonics.len());
        let names = (0_usize..).flat_map(|degree| (0..2 * degree + 1).map(move |index| (degree, index)));
        for (at, (degree, index)) in names.take(coefficients).enumerate() {
            let name = own(&format!("SH_DEGREE_{degree}_COEF_{index}"));
            columns.push(each(&name, Component::Float, 3, &|one| one.harmonics[at].to_vec()));
        }
        if let Some(color) = self.fallback {
            columns.push(each("COLOR_0", Component::Float, 4, &|_| color.to_vec()));
        }
        columns
    }
}

/// The values of an attribute.
struct Column {
    name: String,
    component: Component,
    width: usize,
    /// Those of each Gaussian.
    values: Vec<Vec<f32>>,
}

impl Column {
    fn accessor(&self, view: Option<usize>, offset: usize) -> Value {
        let (component, is_normalized) = self.component.named();
        let shape = ["SCALAR", "VEC2", "VEC3", "VEC4"][self.width - 1];
        let mut accessor = json!({"componentType": component, "count": self.values.len(), "type": shape});
        if let Some(view) = view {
            accessor["bufferView"] = json!(view);
        }
        if offset > 0 {
            accessor["byteOffset"] = json!(offset);
        }
        if is_normalized {
            accessor["normalized"] = json!(true);
        }
        if self.name == "POSITION" {
            let of = |pick: fn(f32, f32) -> f32| -> Vec<f32> {
                let column = |axis: usize| self.values.iter().map(move |values| values[axis]);
                (0..self.width).map(|axis| column(axis).reduce(pick).unwrap_or_default()).collect()
            };
            let stored = |values: Vec<f32>| -> Vec<f32> {
                let factor = if self.component == Component::Short { 32_767.0 } else { 1.0 };
                values
                    .into_iter()
                    .map(|value| if factor > 1.0 { libm::roundf(value * factor) } else { value })
                    .collect()
            };
            accessor["min"] = json!(stored(of(f32::min)));
            accessor["max"] = json!(stored(of(f32::max)));
        }
        accessor
    }

    /// The bytes of an element, a multiple of four of them.
    fn element(&self, values: &[f32]) -> Vec<u8> {
        let mut bytes: Vec<u8> = values.iter().flat_map(|value| self.component.bytes(*value)).collect();
        bytes.resize(bytes.len().next_multiple_of(4), 0);
        bytes
    }
}

/// A buffer with its views and accessors.
#[derive(Default)]
struct Buffer {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Buffer {
    fn view(&mut self, bytes: &[u8], stride: Option<usize>) -> usize {
        let mut view = json!({"buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len()});
        if let Some(stride) = stride {
            view["byteStride"] = json!(stride);
            view["target"] = json!(34_962);
        }
        self.bytes.extend(bytes);
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        self.views.push(view);
        self.views.len() - 1
    }

    fn plain(&mut self, column: &Column) -> usize {
        let elements: Vec<Vec<u8>> = column.values.iter().map(|values| column.element(values)).collect();
        let stride = elements.first().map_or(4, Vec::len);
        let view = self.view(&elements.concat(), Some(stride));
        self.accessors.push(column.accessor(Some(view), 0));
        self.accessors.len() - 1
    }

    /// An accessor of zeros, all of whose elements are replaced.
    fn sparse(&mut self, column: &Column) -> usize {
        let count = column.values.len();
        let indices: Vec<u8> = (0..count as u16).flat_map(u16::to_le_bytes).collect();
        let elements: Vec<Vec<u8>> = column.values.iter().map(|values| column.element(values)).collect();
        let indices = self.view(&indices, None);
        let values = self.view(&elements.concat(), None);
        let mut accessor = column.accessor(None, 0);
        accessor["sparse"] = json!({
            "count": count,
            "indices": {"bufferView": indices, "componentType": 5123},
            "values": {"bufferView": values},
        });
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    fn interleaved(&mut self, columns: &[Column], attributes: &mut Map<String, Value>) {
        let count = columns.first().map_or(0, |column| column.values.len());
        let mut bytes = Vec::new();
        for index in 0..count {
            bytes.extend(columns.iter().flat_map(|column| column.element(&column.values[index])));
        }
        let view = self.view(&bytes, Some(bytes.len() / count.max(1)));
        let mut offset = 0;
        for column in columns {
            self.accessors.push(column.accessor(Some(view), offset));
            attributes.insert(column.name.clone(), json!(self.accessors.len() - 1));
            offset += column.values.first().map_or(0, |values| column.element(values).len());
        }
    }
}

/// The matrix of a node with glTF's camera, column by column: x right, y up, z back, in glTF's axes.
fn node_matrix(camera: &Camera) -> Vec<f64> {
    let turned = |[x, y, z]: [f64; 3]| [x, -y, -z];
    let [right, down, forward] = camera.rotation;
    let columns = [right, down.map(|part| -part), forward.map(|part| -part)];
    let mut matrix = Vec::new();
    for column in columns {
        matrix.extend(turned(column));
        matrix.push(0.0);
    }
    matrix.extend(turned(camera.eye));
    matrix.push(1.0);
    matrix.into_iter().map(|value| value + 0.0).collect()
}
