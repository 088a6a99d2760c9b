//! A primitive of triangles: positions, normals, colours.

use super::accessor::{BYTE, Component, Demand, FLOAT, SHORT, UNSIGNED_BYTE, UNSIGNED_SHORT, indices, values};
use super::buffers::Buffers;
use super::document::{Document, Primitive};
use super::primitive::POSITION;
use crate::error::{Fault, Place, Reason};
use crate::mesh::{Indexed, Mesh, PLAIN, fan, srgb};

/// The modes of primitives of triangles; the first one is the default.
const TRIANGLES: u32 = 4;
const STRIP: u32 = 5;
const FAN: u32 = 6;

const NORMAL: Demand = Demand {
    width: 3,
    components: &[Component::plain(FLOAT), Component::normalized(BYTE), Component::normalized(SHORT)],
    expected: "float, signed byte normalized or signed short normalized",
};

const COLOR: Demand = Demand {
    width: 3,
    components: &[Component::plain(FLOAT), Component::normalized(UNSIGNED_BYTE), Component::normalized(UNSIGNED_SHORT)],
    expected: "float, unsigned byte normalized or unsigned short normalized",
};

/// The triangles of `primitive`, in the frame of its mesh. None if it has points or lines. Messages name it `place`.
pub(super) fn mesh(buffers: &mut Buffers<'_>, primitive: &Primitive, place: &str) -> Result<Option<Mesh>, Fault> {
    let mode = primitive.mode.unwrap_or(TRIANGLES);
    if ![TRIANGLES, STRIP, FAN].contains(&mode) {
        return Ok(None);
    }
    let attribute = |name: &str| primitive.attributes.get(name).copied();
    let named = |name: &str| format!("{place}, {name}");
    // A primitive without positions, such as one that only an extension fills, is not drawn.
    let Some(positions) = attribute("POSITION") else {
        return Ok(None);
    };
    let positions = triples(&values(buffers, positions, &POSITION, &named("POSITION"))?, 3);
    let same = |triples: Vec<[f32; 3]>, name: &str| {
        if triples.len() == positions.len() {
            return Ok(triples);
        }
        let (found, expected) = (triples.len() as u64, positions.len() as u64);
        Err(Reason::Count { found, expected }.at(Place::Part(named(name))))
    };
    let normals = match attribute("NORMAL") {
        Some(index) => {
            let found = values(buffers, index, &NORMAL, &named("NORMAL"))?;
            same(triples(&found, 3), "NORMAL")?
        }
        None => Vec::new(),
    };
    let material = primitive.material.and_then(|index| buffers.document.materials.get(index));
    let factor = material.and_then(|material| material.pbr_metallic_roughness.base_color_factor);
    let colors = match attribute("COLOR_0") {
        Some(index) => {
            let shape = buffers.document.accessors.get(index).map(|accessor| &accessor.shape[..]);
            let width = if shape == Some("VEC4") { 4 } else { 3 };
            let found = values(buffers, index, &Demand { width, ..COLOR }, &named("COLOR_0"))?;
            same(triples(&found, width), "COLOR_0")?
        }
        None => Vec::new(),
    };
    let [red, green, blue, _] = factor.unwrap_or([1.0; 4]);
    let shaded = |[r, g, b]: [f32; 3]| [r * red, g * green, b * blue].map(srgb);
    let colors = match (colors.is_empty(), factor) {
        (false, _) => colors.into_iter().map(shaded).collect(),
        (true, Some(_)) => vec![shaded([1.0; 3]); positions.len()],
        (true, None) => vec![PLAIN; positions.len()],
    };
    let order = match primitive.indices {
        Some(index) => indices(buffers, index, &named("indices"))?,
        None => (0..u32::try_from(positions.len()).unwrap_or(u32::MAX)).collect(),
    };
    let triangles = match mode {
        STRIP => order
            .windows(3)
            .enumerate()
            // Every other triangle of a strip runs the other way round.
            .map(|(i, t)| if i % 2 == 0 { [t[0], t[1], t[2]] } else { [t[1], t[0], t[2]] })
            .collect(),
        FAN => fan(&order).collect(),
        _ => order.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect(),
    };
    let indexed = Indexed { positions, normals, colors, triangles };
    indexed.into_mesh(Place::Part(named("indices"))).map(Some)
}

/// Returns true if the material of `primitive` has a texture of colours.
pub(super) fn has_texture(document: &Document, primitive: &Primitive) -> bool {
    let material = primitive.material.and_then(|index| document.materials.get(index));
    material.is_some_and(|material| material.pbr_metallic_roughness.base_color_texture.is_some())
}

/// The first three of every `width` values.
fn triples(values: &[f32], width: usize) -> Vec<[f32; 3]> {
    let elements = values.chunks_exact(width);
    elements.map(|v| [v[0], v[1], v[2]]).collect()
}
