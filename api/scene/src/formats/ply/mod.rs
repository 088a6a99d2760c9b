//! PLY files: the layout of the original 3DGS code, PlayCanvas's compressed one, meshes, and points.

mod columns;
mod comments;
mod compressed;
mod inria;
mod mesh;
mod points;
mod table;

use super::input::{Format, Input};
use crate::error::Fault;
use crate::scene::Scene;

/// The format. The header's elements tell the layout.
pub(in crate::formats) struct Ply;

impl Format for Ply {
    fn name(&self) -> &'static str {
        "PLY"
    }

    fn extensions(&self) -> &'static [&'static str] {
        &["ply"]
    }

    fn magic(&self) -> Option<&'static [u8]> {
        Some(b"ply")
    }

    fn load(&self, input: &mut Input<'_>) -> Result<Scene, Fault> {
        let options = input.origin().options;
        let table = table::Table::open(input)?;
        let mut said = comments::metadata(table.comments());
        let mut scene = if table.element("chunk").is_some() {
            compressed::load(table)?
        } else if mesh::is_one(&table) {
            mesh::load(table)?
        } else if points::is_one(&table) {
            points::load(table, options.points)?
        } else {
            inria::load(table)?
        };
        let metadata = scene.metadata_mut();
        // The absence of a third scale is more reliable than a comment.
        metadata.geometry = metadata.geometry.or(said.geometry);
        metadata.antialiasing = said.antialiasing;
        metadata.axes = said.axes;
        metadata.take_messages(&mut said);
        Ok(scene)
    }
}
