//! The places of vertices' values in workgroup memory; `vertex_memory` assigns them.

use std::collections::HashMap;

use isa::ir::Reg;

use super::value::MemoryRef;

/// A variable with values for each vertex, or for the whole patch.
#[derive(Clone, Copy, Debug)]
pub struct Array {
    pub variable: u32,
    /// The type of the values of one vertex, or of the patch.
    pub ty: u32,
    /// Its first byte in the memory of its primitive or patch.
    pub offset: u32,
    /// The bytes of a vertex; `None` for values of the patch.
    pub vertex_stride: Option<u32>,
}

/// The memory of a stage's inputs or outputs.
#[derive(Debug, Default)]
pub struct Region {
    pub arrays: Vec<Array>,
    pub start: u32,
    /// The bytes of a primitive or patch.
    pub stride: u32,
}

/// The emission of vertices by a geometry stage.
#[derive(Debug)]
pub struct Emission {
    /// The output variables.
    pub variables: Vec<u32>,
    pub max_vertices: u32,
    /// The bytes of a vertex.
    pub vertex_bytes: u32,
    /// The byte where the lane's next vertex begins: a variable.
    pub next: Reg,
    /// The number of vertices that the lane emitted: an output.
    pub count: Reg,
    /// 1 if the next vertex of a stream is the first of a strip: a variable for each stream.
    pub begins_strip: Vec<Reg>,
}

/// The places of vertices' values in workgroup memory.
#[derive(Debug, Default)]
pub struct VertexPlaces {
    pub inputs: Region,
    pub outputs: Region,
    pub places: HashMap<u32, MemoryRef>,
    pub emission: Option<Emission>,
}

impl VertexPlaces {
    /// The place of a variable, if it is in this memory.
    pub fn place(&self, variable: u32) -> Option<MemoryRef> {
        self.places.get(&variable).copied()
    }
}
