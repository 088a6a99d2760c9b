//! PLY files: the layout of the original 3DGS code, PlayCanvas's compressed one, meshes, and points.

mod columns;
mod comments;
mod compressed;
mod inria;
mod mesh;
mod points;
mod table;

use super::input::{Format, Input, Loaded};
use crate::error::Fault;

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

    fn load(&self, input: &mut Input<'_>) -> Result<Loaded, Fault> {
        let options = input.origin().options;
        let table = table::Table::open(input)?;
        let mut said = comments::metadata(table.comments());
        let mut loaded = if table.element("chunk").is_some() {
            Loaded::from(compressed::load(table)?)
        } else if mesh::is_one(&table) {
            mesh::load(table)?.into()
        } else if points::is_one(&table) {
            points::load(table, options.points)?.into()
        } else {
            inria::load(table)?.into()
        };
        let metadata = loaded.metadata_mut();
        // The absence of a third scale is more reliable than a comment.
        metadata.geometry = metadata.geometry.or(said.geometry);
        metadata.antialiasing = said.antialiasing;
        metadata.axes = said.axes;
        metadata.take_messages(&mut said);
        Ok(loaded)
    }
}
