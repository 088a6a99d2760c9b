//! Projecting shaders: the application's vertex shaders, whose outputs are stored in memory. The SPIR-V is rewritten: outputs become private
//! variables, and a new entry point calls the application's and stores them at the place of its vertex and its instance.

use std::collections::{BTreeMap, BTreeSet};
use std::ffi::CStr;

use gaurast::vk::GaussianVertexOutputLocationsGAURAST as Locations;

use crate::module::{
    BUILT_IN, Body, COMPONENT, Components, INPUT, LOCATION, Module, NON_READABLE, OUTPUT, PRIVATE, Slot, Type, Types,
    instructions, op, opcode,
};

/// Built-ins.
const POSITION: u32 = spirv::BuiltIn::Position as u32;
const POINT_SIZE: u32 = spirv::BuiltIn::PointSize as u32;
const VERTEX_INDEX: u32 = spirv::BuiltIn::VertexIndex as u32;
const INSTANCE_INDEX: u32 = spirv::BuiltIn::InstanceIndex as u32;
const VIEW_INDEX: u32 = spirv::BuiltIn::ViewIndex as u32;

/// The capability to read the view's index.
const MULTI_VIEW: u32 = 4439;

/// The execution model of vertex shaders.
const VERTEX: u32 = spirv::ExecutionModel::Vertex as u32;

/// Bytes of the outputs of a vertex: three `vec4`, as `shaders/project_shaded.comp` reads them.
pub(crate) const OUTPUTS: u64 = 48;

/// A vertex shader, and what its pipeline does.
pub(crate) struct Request<'a> {
    pub(crate) words: &'a [u32],
    pub(crate) entry: &'a CStr,
    pub(crate) locations: Locations,
    /// The locations of the attributes that say where outputs are stored: `Shaded` of `shaders/set.glsl`, by four words.
    pub(crate) places: [u32; 2],
    pub(crate) has_views: bool,
}

/// Reports whether a module has a vertex shader.
pub(crate) fn has_vertex_shader(words: &[u32]) -> bool {
    instructions(words).any(|instruction| opcode(instruction) == op::ENTRY_POINT && instruction.get(1) == Some(&VERTEX))
}

/// An output that becomes a private variable.
struct Output {
    id: u32,
    ty: u32,
    meaning: Meaning,
}

/// The meaning of an output.
enum Meaning {
    /// At a location and a component; `None` where members have locations of their own.
    Located(Option<u32>, u32),
    /// The position is the variable, or one of its members.
    Position(Option<u32>),
    Unused,
}

impl Output {
    fn new(module: &Module, id: u32, ty: u32) -> Self {
        let built_in = |member: Option<u32>| match member {
            None => module.decoration(id, None, BUILT_IN),
            Some(_) => module.decoration(ty, member, BUILT_IN),
        };
        let members = match module.known_types.get(&ty) {
            Some(Type::Structure(members)) => members.len() as u32,
            _ => 0,
        };
        let meaning = if let Some(of_variable) = built_in(None) {
            if of_variable == POSITION { Meaning::Position(None) } else { Meaning::Unused }
        } else if (0..members).any(|member| built_in(Some(member)).is_some()) {
            let position = (0..members).find(|member| built_in(Some(*member)) == Some(POSITION));
            position.map_or(Meaning::Unused, |member| Meaning::Position(Some(member)))
        } else {
            let component = module.decoration(id, None, COMPONENT).unwrap_or(0);
            Meaning::Located(module.decoration(id, None, LOCATION), component)
        };
        Self { id, ty, meaning }
    }
}

/// Makes outputs private: their types and their variables.
fn make_private(module: &mut Module, outputs: &[Output]) -> Result<(), String> {
    let private: BTreeSet<u32> = outputs.iter().map(|output| output.id).collect();
    module.strip_variables(&private, "a projecting shader")?;
    for known in &mut module.types {
        match opcode(known) {
            op::TYPE_POINTER if known[2] == OUTPUT => known[2] = PRIVATE,
            op::VARIABLE if known[3] == OUTPUT => known[3] = PRIVATE,
            _ => {}
        }
    }
    module.unlist(&private);
    Ok(())
}

/// Rewrites a vertex shader so that it stores what it writes.
///
/// # Errors
/// A sentence that says what is not emulated.
pub(crate) fn rewrite(request: &Request<'_>) -> Result<Vec<u32>, String> {
    let mut module = Module::read(request.words, VERTEX, request.entry, "a projecting shader")?;
    let outputs = module.interface(OUTPUT);
    let outputs: Vec<Output> = outputs.into_iter().map(|(id, ty)| Output::new(&module, id, ty)).collect();
    make_private(&mut module, &outputs)?;
    module.need_addresses();
    if request.has_views {
        module.need(MULTI_VIEW);
        if module.version < 0x0001_0300 {
            module.need_extension("SPV_KHR_multiview");
        }
    }
    let types = Types::new(&mut module, NON_READABLE);
    let (entry, original) = module.replace_entry();
    let mut body = Body { module: &mut module, types, code: Vec::new(), made: BTreeMap::new() };
    let label = body.module.id();
    let (void, function) = (body.types.void, body.types.function);
    body.write(op::FUNCTION, &[void, entry, 0, function]);
    body.write(op::LABEL, &[label]);
    let called = body.module.id();
    body.write(op::FUNCTION_CALL, &[void, called, original]);
    // A list of points needs a size, also where nothing is rasterized.
    let float = body.types.float;
    let size = body.interface(OUTPUT, float, &[&[BUILT_IN, POINT_SIZE]]);
    let one = body.constant(1.0_f32.to_bits());
    let one = body.run(op::BITCAST, float, &[one]);
    body.write(op::STORE, &[size, one]);
    let rows = written(&mut body, &outputs, &request.locations);
    store(&mut body, request, rows);
    body.write(op::RETURN, &[]);
    body.write(op::FUNCTION_END, &[]);
    let code = body.code;
    module.functions.extend(code);
    for output in &outputs {
        module.strip(output.ty);
    }
    Ok(module.words())
}

/// The rows that are stored: position, covariance and opacity, colour and key. What the shader does not write is 0.
fn written(body: &mut Body<'_>, outputs: &[Output], locations: &Locations) -> [u32; 3] {
    let zero = body.constant(0);
    let mut slots: BTreeMap<u32, Components> = BTreeMap::new();
    let mut position = [zero; 4];
    for output in outputs {
        match output.meaning {
            Meaning::Unused => {}
            Meaning::Located(location, component) => {
                let value = body.load(output.ty, output.id);
                let at = Slot { location: location.unwrap_or(0), component };
                body.flatten(value, output.ty, at, &mut slots);
            }
            Meaning::Position(member) => {
                let mut value = body.load(output.ty, output.id);
                let mut ty = output.ty;
                if let (Some(member), Some(Type::Structure(members))) =
                    (member, body.module.known_types.get(&ty).cloned())
                {
                    ty = members[member as usize];
                    value = body.run(op::COMPOSITE_EXTRACT, ty, &[value, member]);
                }
                let mut own = BTreeMap::new();
                body.flatten(value, ty, Slot { location: 0, component: 0 }, &mut own);
                position = own.get(&0).copied().unwrap_or(position);
            }
        }
    }
    let at = |location: u32| slots.get(&location).copied().unwrap_or([zero; 4]);
    let ([xx, xy, yy, _], [opacity, ..], [red, green, blue, _]) =
        (at(locations.covariance), at(locations.opacity), at(locations.color));
    let key = if locations.depth_key == !0 { position[3] } else { at(locations.depth_key)[0] };
    let vector = body.types.uints_4;
    [position, [xx, xy, yy, opacity], [red, green, blue, key]]
        .map(|row| body.run(op::COMPOSITE_CONSTRUCT, vector, &row))
}

/// Stores rows at the place of the invocation's vertex, instance and view, if there is one.
fn store(body: &mut Body<'_>, request: &Request<'_>, rows: [u32; 3]) {
    let (uints_4, boolean) = (body.types.uints_4, body.types.boolean);
    let [place, limits] = request.places.map(|location| {
        let variable = body.interface(INPUT, uints_4, &[&[LOCATION, location]]);
        body.load(uints_4, variable)
    });
    let address = body.half(place, 0);
    let [_, _, first_vertex, vertices] = body.components(place);
    let [instances, first_instance, ..] = body.components(limits);
    let (vertex, instance) = (body.built_in(VERTEX_INDEX), body.built_in(INSTANCE_INDEX));
    let vertex = body.uint(op::I_SUB, vertex, first_vertex);
    let instance = body.uint(op::I_SUB, instance, first_instance);
    let is_vertex = body.run(op::U_LESS_THAN, boolean, &[vertex, vertices]);
    let is_instance = body.run(op::U_LESS_THAN, boolean, &[instance, instances]);
    let is_there = body.run(op::LOGICAL_AND, boolean, &[is_vertex, is_instance]);
    let mut row = instance;
    if request.has_views {
        let view = body.built_in(VIEW_INDEX);
        let before = body.uint(op::I_MUL, view, instances);
        row = body.uint(op::I_ADD, before, instance);
    }
    let first = body.uint(op::I_MUL, row, vertices);
    let first = body.uint(op::I_ADD, first, vertex);
    let three = body.constant(3);
    let first = body.uint(op::I_MUL, first, three);
    let indices = [0, 1, 2].map(|index| {
        let index = body.constant(index);
        body.uint(op::I_ADD, first, index)
    });
    let [within, merged] = [(); 2].map(|()| body.module.id());
    body.write(op::SELECTION_MERGE, &[merged, 0]);
    body.write(op::BRANCH_CONDITIONAL, &[is_there, within, merged]);
    body.write(op::LABEL, &[within]);
    for (index, value) in indices.into_iter().zip(rows) {
        body.store_row(address, index, value);
    }
    body.write(op::BRANCH, &[merged]);
    body.write(op::LABEL, &[merged]);
}
