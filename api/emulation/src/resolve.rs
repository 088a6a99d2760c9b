//! Resolve shaders: the application's fragment shaders, whose inputs are loaded from what a set has made. The SPIR-V is rewritten: inputs
//! become private variables, and a new entry point fills them in and calls the application's.

use std::collections::{BTreeMap, BTreeSet};
use std::ffi::CStr;

use gaurast::vk::GaussianResolveInputLocationsGAURAST as Locations;

use crate::made::Covering;
use crate::module::{
    BUILT_IN, Body, COMPONENT, FLAT, INPUT, LOCATION, Module, NON_WRITABLE, OUTPUT, PRIVATE, Slot, Type, Types,
    assembled, instructions, op, opcode,
};

/// Built-ins.
const PRIMITIVE_ID: u32 = spirv::BuiltIn::PrimitiveId as u32;
const LAYER: u32 = spirv::BuiltIn::Layer as u32;
const VIEWPORT_INDEX: u32 = spirv::BuiltIn::ViewportIndex as u32;
const FRAG_COORD: u32 = spirv::BuiltIn::FragCoord as u32;
const POINT_COORD: u32 = spirv::BuiltIn::PointCoord as u32;
const FRONT_FACING: u32 = spirv::BuiltIn::FrontFacing as u32;
const SAMPLE_ID: u32 = spirv::BuiltIn::SampleId as u32;
const SAMPLE_POSITION: u32 = spirv::BuiltIn::SamplePosition as u32;
const SAMPLE_MASK: u32 = spirv::BuiltIn::SampleMask as u32;
const FRAG_DEPTH: u32 = spirv::BuiltIn::FragDepth as u32;
const HELPER_INVOCATION: u32 = spirv::BuiltIn::HelperInvocation as u32;
const VIEW_INDEX: u32 = spirv::BuiltIn::ViewIndex as u32;

/// Execution modes.
const EARLY_FRAGMENT_TESTS: u32 = spirv::ExecutionMode::EarlyFragmentTests as u32;
const DEPTH_REPLACING: u32 = spirv::ExecutionMode::DepthReplacing as u32;
/// Execution modes that bound the change of a depth.
const DEPTH_MODES: [u32; 3] = [
    spirv::ExecutionMode::DepthGreater as u32,
    spirv::ExecutionMode::DepthLess as u32,
    spirv::ExecutionMode::DepthUnchanged as u32,
];

/// Opcodes that read the pixels beside: derivatives, implicit levels of detail, and exchanges within quads.
const BESIDE: [std::ops::RangeInclusive<u32>; 4] = [
    spirv::Op::DPdx as u32..=spirv::Op::FwidthCoarse as u32,
    spirv::Op::ImageSampleImplicitLod as u32..=spirv::Op::ImageDrefGather as u32,
    spirv::Op::ImageSparseSampleImplicitLod as u32..=spirv::Op::ImageSparseDrefGather as u32,
    spirv::Op::GroupNonUniformQuadBroadcast as u32..=spirv::Op::GroupNonUniformQuadSwap as u32,
];

/// The capability to make invocations helpers.
const DEMOTE_TO_HELPER_INVOCATION: u32 = 5379;

/// The execution model of fragment shaders.
const FRAGMENT: u32 = spirv::ExecutionModel::Fragment as u32;

/// A fragment shader, and what its pipeline does.
pub(crate) struct Request<'a> {
    pub(crate) words: &'a [u32],
    pub(crate) entry: &'a CStr,
    pub(crate) locations: Locations,
    /// Depths or stencils may be tested.
    pub(crate) may_be_tested: bool,
    /// Rasterization samples.
    pub(crate) samples: u32,
    /// Sample shading is enabled.
    pub(crate) is_sample_shaded: bool,
}

/// A fragment shader that loads its inputs.
pub(crate) struct Rewritten {
    pub(crate) words: Vec<u32>,
    /// True if it reads depths or Gaussians.
    pub(crate) has_inputs: bool,
    pub(crate) has_camera: bool,
    /// True if it runs for each sample.
    pub(crate) is_sample_shaded: bool,
    pub(crate) covering: Covering,
}

/// Reports whether a module has a fragment shader.
pub(crate) fn has_fragment_shader(words: &[u32]) -> bool {
    instructions(words)
        .any(|instruction| opcode(instruction) == op::ENTRY_POINT && instruction.get(1) == Some(&FRAGMENT))
}

/// An input that becomes a private variable.
struct Input {
    id: u32,
    ty: u32,
    meaning: Meaning,
}

/// The meaning of an input.
#[derive(Clone, Copy)]
enum Meaning {
    /// At a location and a component; `None` where members have locations of their own.
    Located(Option<u32>, u32),
    BuiltIn(u32),
}

/// The inputs of a module, and what they need.
struct Inputs {
    all: Vec<Input>,
    has_inputs: bool,
    has_camera: bool,
    reads_samples: bool,
    /// The application's variable of the sample's number.
    sample_id: Option<u32>,
}

/// The locations of the camera.
fn camera_locations(locations: &Locations) -> std::ops::Range<u32> {
    let first = locations.first_camera;
    first..first.saturating_add(6)
}

impl Inputs {
    fn of(module: &Module, locations: &Locations) -> Self {
        let mut own =
            Self { all: Vec::new(), has_inputs: false, has_camera: false, reads_samples: false, sample_id: None };
        for (id, ty) in module.interface(INPUT) {
            if let Some(built_in) = module.decoration(id, None, BUILT_IN) {
                if [SAMPLE_ID, SAMPLE_POSITION].contains(&built_in) {
                    own.reads_samples = true;
                }
                if built_in == SAMPLE_ID {
                    own.sample_id = Some(id);
                }
                let is_made = [
                    PRIMITIVE_ID,
                    LAYER,
                    VIEWPORT_INDEX,
                    FRAG_COORD,
                    POINT_COORD,
                    FRONT_FACING,
                    SAMPLE_MASK,
                    HELPER_INVOCATION,
                    VIEW_INDEX,
                ];
                if is_made.contains(&built_in) {
                    // The depth of a fragment is the median's.
                    own.has_inputs |= built_in == FRAG_COORD;
                    own.all.push(Input { id, ty, meaning: Meaning::BuiltIn(built_in) });
                }
                continue;
            }
            let location = module.decoration(id, None, LOCATION);
            let component = module.decoration(id, None, COMPONENT).unwrap_or(0);
            own.all.push(Input { id, ty, meaning: Meaning::Located(location, component) });
        }
        let of_sets = [locations.depth, locations.linear_depth, locations.median_gaussian, locations.nearest_gaussian];
        for input in &own.all {
            if let Meaning::Located(location, _) = input.meaning {
                let mut slots = BTreeSet::new();
                locations_of(module, input.ty, location.unwrap_or(0), &mut slots);
                own.has_inputs |= of_sets.iter().any(|one| slots.contains(one));
                own.has_camera |= camera_locations(locations).any(|one| slots.contains(&one));
            }
        }
        own
    }
}

/// Adds the locations of a type; gives the next one.
fn locations_of(module: &Module, ty: u32, location: u32, slots: &mut BTreeSet<u32>) -> u32 {
    match module.known_types.get(&ty) {
        Some(Type::Matrix(of, count)) => (0..*count).fold(location, |at, _| locations_of(module, *of, at, slots)),
        Some(Type::Array(of, count)) => {
            let count = module.constants.get(count).copied().unwrap_or(1).min(64);
            (0..count).fold(location, |at, _| locations_of(module, *of, at, slots))
        }
        Some(Type::Structure(members)) => (0..).zip(members).fold(location, |at, (index, member)| {
            let at = module.decoration(ty, Some(index), LOCATION).unwrap_or(at);
            locations_of(module, *member, at, slots)
        }),
        _ => {
            slots.insert(location);
            location.saturating_add(1)
        }
    }
}

/// Makes inputs private: their types, their variables, and all that points at them.
fn make_private(module: &mut Module, inputs: &[Input]) -> Result<(), String> {
    let mut private: BTreeSet<u32> = inputs.iter().map(|input| input.id).collect();
    module.strip_variables(&private, "the resolve shader")?;
    // A pointer to private memory follows each to inputs.
    let mut pointers = BTreeMap::new();
    let mut types = Vec::new();
    for mut known in std::mem::take(&mut module.types) {
        match opcode(&known) {
            op::TYPE_POINTER if known[2] == INPUT => {
                let id = module.id();
                pointers.insert(known[1], id);
                let added = assembled(op::TYPE_POINTER, &[id, PRIVATE, known[3]]);
                types.extend([known, added]);
                continue;
            }
            op::VARIABLE if private.contains(&known[2]) => {
                known[1] = pointers.get(&known[1]).copied().unwrap_or(known[1]);
                known[3] = PRIVATE;
            }
            _ => {}
        }
        types.push(known);
    }
    module.types = types;
    for known in &mut module.functions {
        match opcode(known) {
            op::ACCESS_CHAIN | op::IN_BOUNDS_ACCESS_CHAIN | op::COPY_OBJECT if private.contains(&known[3]) => {
                known[1] = pointers.get(&known[1]).copied().unwrap_or(known[1]);
                private.insert(known[2]);
            }
            // Interpolation has no effect.
            op::EXT_INST if (76..=78).contains(&known[4]) && known.get(5).is_some_and(|of| private.contains(of)) => {
                *known = assembled(op::LOAD, &[known[1], known[2], known[5]]);
            }
            op::FUNCTION_CALL if known[4..].iter().any(|argument| private.contains(argument)) => {
                return Err(
                    "the resolve shader gives a function the address of an input, which is not emulated".to_owned()
                );
            }
            _ => {}
        }
    }
    module.unlist(&inputs.iter().map(|input| input.id).collect());
    Ok(())
}

/// Rewrites a fragment shader so that it loads what it reads of a set from the addresses that `shaders/tiles.vert` passes on.
///
/// # Errors
/// A sentence that says what is not emulated.
pub(crate) fn rewrite(request: &Request<'_>) -> Result<Rewritten, String> {
    let mut module = Module::read(request.words, FRAGMENT, request.entry, "a resolve shader")?;
    let mut inputs = Inputs::of(&module, &request.locations);
    let is_early = module.modes.iter().any(|mode| mode.get(2) == Some(&EARLY_FRAGMENT_TESTS));
    if is_early && request.may_be_tested {
        return Err(
            "a resolve shader has early fragment tests of depths or stencils, which are not emulated".to_owned()
        );
    }
    let has_derivatives = module.functions.iter().any(|known| BESIDE.iter().any(|ops| ops.contains(&opcode(known))));
    let outputs = module.interface(OUTPUT);
    let output = |module: &Module, wanted: u32| {
        outputs.iter().find(|(id, _)| module.decoration(*id, None, BUILT_IN) == Some(wanted)).copied()
    };
    if output(&module, FRAG_DEPTH).is_some() {
        return Err("a resolve shader writes FragDepth".to_owned());
    }
    let written_mask = output(&module, SAMPLE_MASK);
    inputs.has_inputs |= request.may_be_tested;
    let is_sample_shaded = request.is_sample_shaded || inputs.reads_samples;
    let tells_samples = request.may_be_tested && request.samples > 1;
    make_private(&mut module, &inputs.all)?;
    module.need_addresses();
    module.need(DEMOTE_TO_HELPER_INVOCATION);
    module.need_extension("SPV_EXT_demote_to_helper_invocation");

    let types = Types::new(&mut module, NON_WRITABLE);
    let (entry, original) = module.replace_entry();
    if request.may_be_tested {
        module.modes.retain(|mode| mode.get(2).is_none_or(|mode| !DEPTH_MODES.contains(mode)));
        module.modes.push(assembled(op::EXECUTION_MODE, &[entry, DEPTH_REPLACING]));
    }

    let mut body = Body { module: &mut module, types, code: Vec::new(), made: BTreeMap::new() };
    let label = body.module.id();
    let (void, function) = (body.types.void, body.types.function);
    body.write(op::FUNCTION, &[void, entry, 0, function]);
    body.write(op::LABEL, &[label]);
    let fragment = Fragment::load(&mut body, request, &inputs, is_sample_shaded && tells_samples);
    fragment.demote(&mut body);
    fragment.fill(&mut body, request, &inputs);
    if request.may_be_tested {
        let float = body.types.float;
        let depth = body.interface(OUTPUT, float, &[&[BUILT_IN, FRAG_DEPTH]]);
        body.write(op::STORE, &[depth, fragment.median_depth]);
    }
    let called = body.module.id();
    body.write(op::FUNCTION_CALL, &[void, called, original]);
    if let Some(mask) = fragment.mask {
        fragment.write_mask(&mut body, mask, written_mask);
    }
    body.write(op::RETURN, &[]);
    body.write(op::FUNCTION_END, &[]);
    let code = body.code;
    module.functions.extend(code);
    for input in &inputs.all {
        module.strip(input.ty);
    }
    Ok(Rewritten {
        words: module.words(),
        has_inputs: inputs.has_inputs,
        has_camera: inputs.has_camera,
        is_sample_shaded,
        covering: match (is_early, has_derivatives || request.samples > 1) {
            // What it discards has been counted.
            (true, _) => Covering::Pixels,
            (false, true) => Covering::Triangle,
            (false, false) => Covering::Quads,
        },
    })
}

/// The ids of what an invocation has loaded.
struct Fragment {
    /// The fragment's place in the results.
    place: u32,
    view: u32,
    /// The condition that the invocation has a fragment to make.
    runs: u32,
    color: u32,
    /// Depths and linear depths, and Gaussians.
    depths: u32,
    gaussians: u32,
    /// A float.
    median_depth: u32,
    camera: Vec<u32>,
    /// The samples that have the fragment, where samples are told apart.
    mask: Option<u32>,
}

impl Fragment {
    /// Loads what an invocation reads.
    fn load(body: &mut Body<'_>, request: &Request<'_>, inputs: &Inputs, is_by_sample: bool) -> Self {
        let (uint, uints_2, uints_4) = (body.types.uint, body.types.uints_2, body.types.uints_4);
        let (boolean, booleans_2, booleans_4) = (body.types.boolean, body.types.booleans_2, body.types.booleans_4);
        let (float, floats_4) = (body.types.float, body.types.floats_4);
        let passed: [u32; 4] = [0, 1, 2, 3].map(|location| {
            let variable = body.interface(INPUT, uints_4, &[&[LOCATION, location], &[FLAT]]);
            body.load(uints_4, variable)
        });
        let coordinate = body.interface(INPUT, floats_4, &[&[BUILT_IN, FRAG_COORD]]);
        let place = body.load(floats_4, coordinate);
        let (image, shown) = (body.half(passed[0], 0), body.half(passed[0], 2));
        let (made, cameras) = (body.half(passed[1], 0), body.half(passed[1], 2));
        let (origin, size) = (body.half(passed[2], 0), body.half(passed[2], 2));
        let [samples, mut sample, view, own_tile] = body.components(passed[3]);

        // The pixel, or another one of the area for those that lie beside it.
        let whole = body.run(op::CONVERT_F_TO_U, uints_4, &[place]);
        let whole = body.half(whole, 0);
        let at = body.run(op::I_SUB, uints_2, &[whole, origin]);
        let are_inside = body.run(op::U_LESS_THAN, booleans_2, &[at, size]);
        let is_inside = body.run(op::ALL, boolean, &[are_inside]);
        let zero = body.constant(0);
        let zeros = body.both(zero);
        let at = body.run(op::SELECT, uints_2, &[are_inside, at, zeros]);
        let (x, y, width, height) =
            (body.component(at, 0), body.component(at, 1), body.component(size, 0), body.component(size, 1));
        let (four, fifteen) = (body.constant(4), body.constant(15));
        let along = |body: &mut Body<'_>, length: u32| {
            let more = body.uint(op::I_ADD, length, fifteen);
            body.uint(op::SHIFT_RIGHT_LOGICAL, more, four)
        };
        let (across, down) = (along(body, width), along(body, height));
        let (tile_x, tile_y) =
            (body.uint(op::SHIFT_RIGHT_LOGICAL, x, four), body.uint(op::SHIFT_RIGHT_LOGICAL, y, four));
        let row = body.uint(op::I_MUL, view, down);
        let row = body.uint(op::I_ADD, row, tile_y);
        let row = body.uint(op::I_MUL, row, across);
        let tile = body.uint(op::I_ADD, row, tile_x);
        let word = body.word_at(shown, tile);
        let is_shown = body.run(op::I_NOT_EQUAL, boolean, &[word, zero]);

        let one = body.constant(1);
        let last = body.uint(op::I_SUB, samples, one);
        if is_by_sample {
            body.module.need(35);
            let id = match inputs.sample_id {
                Some(id) => {
                    let ty = body.module.types.iter().find(|known| opcode(known) == op::VARIABLE && known[2] == id);
                    let ty = ty.and_then(|known| body.module.pointee(known[1])).unwrap_or(uint);
                    let value = body.load(ty, id);
                    if ty == uint { value } else { body.run(op::BITCAST, uint, &[value]) }
                }
                None => {
                    let id = body.interface(INPUT, uint, &[&[BUILT_IN, SAMPLE_ID], &[FLAT]]);
                    body.load(uint, id)
                }
            };
            let is_less = body.run(op::U_LESS_THAN, boolean, &[id, last]);
            sample = body.run(op::SELECT, uint, &[is_less, id, last]);
        }
        let first_plane = body.uint(op::I_MUL, view, samples);
        let pixel = |body: &mut Body<'_>, sample: u32| {
            let plane = body.uint(op::I_ADD, first_plane, sample);
            let row = body.uint(op::I_MUL, plane, height);
            let row = body.uint(op::I_ADD, row, y);
            let row = body.uint(op::I_MUL, row, width);
            body.uint(op::I_ADD, row, x)
        };
        let has_inputs = inputs.has_inputs;
        let record = |body: &mut Body<'_>, sample: u32| {
            let pixel = pixel(body, sample);
            let mut rows = vec![body.row_at(image, pixel)];
            if has_inputs {
                let first = body.uint(op::SHIFT_LEFT_LOGICAL, pixel, one);
                let second = body.uint(op::I_ADD, first, one);
                rows.extend([body.row_at(made, first), body.row_at(made, second)]);
            }
            rows
        };
        let own = record(body, sample);
        let alpha = body.component(own[0], 3);
        let alpha = body.run(op::BITCAST, float, &[alpha]);
        let nothing = body.run(op::BITCAST, float, &[zero]);
        let has_color = body.run(op::F_ORD_GREATER_THAN_EQUAL, boolean, &[alpha, nothing]);
        let is_there = body.run(op::LOGICAL_AND, boolean, &[is_inside, is_shown]);
        let is_there = body.run(op::LOGICAL_AND, boolean, &[is_there, has_color]);
        let is_own = body.run(op::I_EQUAL, boolean, &[tile, own_tile]);
        let mut runs = body.run(op::LOGICAL_AND, boolean, &[is_there, is_own]);
        let mut mask = None;
        if request.may_be_tested && request.samples > 1 && !is_by_sample {
            // The first of the samples that have the same runs for them.
            let mut all = zero;
            for index in 0..request.samples {
                let other = body.constant(index);
                let is_less = body.run(op::U_LESS_THAN, boolean, &[other, last]);
                let other = body.run(op::SELECT, uint, &[is_less, other, last]);
                let rows = record(body, other);
                let mut bit = body.constant(1 << index);
                for (a, b) in own.iter().zip(rows) {
                    let are_equal = body.run(op::I_EQUAL, booleans_4, &[*a, b]);
                    let is_equal = body.run(op::ALL, boolean, &[are_equal]);
                    bit = body.run(op::SELECT, uint, &[is_equal, bit, zero]);
                }
                all = body.uint(op::BITWISE_OR, all, bit);
            }
            let bit = body.uint(op::SHIFT_LEFT_LOGICAL, one, sample);
            let before = body.uint(op::I_SUB, bit, one);
            let before = body.uint(op::BITWISE_AND, all, before);
            let is_first = body.run(op::I_EQUAL, boolean, &[before, zero]);
            runs = body.run(op::LOGICAL_AND, boolean, &[runs, is_first]);
            mask = Some(all);
        }
        let color = body.only_where(is_there, own[0]);
        let [depths, gaussians] = [1, 2].map(|index| match own.get(index) {
            Some(row) => body.only_where(is_there, *row),
            None => body.run(op::COMPOSITE_CONSTRUCT, uints_4, &[zero; 4]),
        });
        let median = body.component(depths, 1);
        let median_depth = body.run(op::BITCAST, float, &[median]);
        let mut camera = Vec::new();
        if inputs.has_camera {
            let six = body.constant(6);
            let first = body.uint(op::I_MUL, view, six);
            for index in 0..6 {
                let index = body.constant(index);
                let row = body.uint(op::I_ADD, first, index);
                camera.push(body.row_at(cameras, row));
            }
        }
        Self { place, view, runs, color, depths, gaussians, median_depth, camera, mask }
    }

    /// Makes the invocation a helper where there is no fragment.
    fn demote(&self, body: &mut Body<'_>) {
        let [without, merged] = [(); 2].map(|()| body.module.id());
        body.write(op::SELECTION_MERGE, &[merged, 0]);
        body.write(op::BRANCH_CONDITIONAL, &[self.runs, merged, without]);
        body.write(op::LABEL, &[without]);
        body.write(op::DEMOTE_TO_HELPER_INVOCATION, &[]);
        body.write(op::BRANCH, &[merged]);
        body.write(op::LABEL, &[merged]);
    }

    /// Fills the application's inputs in.
    fn fill(&self, body: &mut Body<'_>, request: &Request<'_>, inputs: &Inputs) {
        let zero = body.constant(0);
        let locations = &request.locations;
        let (depths, gaussians) = (body.components(self.depths), body.components(self.gaussians));
        let mut slots = BTreeMap::from([
            (locations.accumulated_color, body.components(self.color)),
            (locations.depth, [depths[0], depths[1], zero, zero]),
            (locations.linear_depth, [depths[2], depths[3], zero, zero]),
            (locations.median_gaussian, [gaussians[0], gaussians[1], zero, zero]),
            (locations.nearest_gaussian, [gaussians[2], gaussians[3], zero, zero]),
        ]);
        for (location, row) in camera_locations(locations).zip(&self.camera) {
            let components = body.components(*row);
            slots.insert(location, components);
        }
        slots.remove(&!0);
        for input in &inputs.all {
            let value = match input.meaning {
                Meaning::Located(location, component) => {
                    let at = Slot { location: location.unwrap_or(0), component };
                    body.value(input.ty, at, &slots).0
                }
                Meaning::BuiltIn(built_in) => self.built_in(body, built_in, input.ty),
            };
            body.write(op::STORE, &[input.id, value]);
        }
    }

    /// The value of a built-in.
    fn built_in(&self, body: &mut Body<'_>, built_in: u32, ty: u32) -> u32 {
        let (uint, float, boolean) = (body.types.uint, body.types.float, body.types.boolean);
        match built_in {
            FRAG_COORD => {
                let [x, y] = [0, 1].map(|index| body.run(op::COMPOSITE_EXTRACT, float, &[self.place, index]));
                let one = body.constant(1.0_f32.to_bits());
                let one = body.run(op::BITCAST, float, &[one]);
                body.run(op::COMPOSITE_CONSTRUCT, ty, &[x, y, self.median_depth, one])
            }
            LAYER | VIEW_INDEX if ty == uint => self.view,
            LAYER | VIEW_INDEX => body.run(op::BITCAST, ty, &[self.view]),
            FRONT_FACING => {
                let zero = body.constant(0);
                body.run(op::I_EQUAL, boolean, &[zero, zero])
            }
            HELPER_INVOCATION => {
                let own = body.interface(INPUT, ty, &[&[BUILT_IN, HELPER_INVOCATION]]);
                let own = body.load(boolean, own);
                let does_not_run = body.run(op::LOGICAL_NOT, boolean, &[self.runs]);
                body.run(op::LOGICAL_OR, boolean, &[own, does_not_run])
            }
            SAMPLE_MASK => {
                let own = body.interface(INPUT, ty, &[&[BUILT_IN, SAMPLE_MASK], &[FLAT]]);
                let value = body.load(ty, own);
                let Some(mask) = self.mask else {
                    return value;
                };
                let Some(Type::Array(of, _)) = body.module.known_types.get(&ty).cloned() else {
                    return value;
                };
                let word = body.run(op::COMPOSITE_EXTRACT, of, &[value, 0]);
                let mask = if of == uint { mask } else { body.run(op::BITCAST, of, &[mask]) };
                let word = body.run(op::BITWISE_AND, of, &[word, mask]);
                body.run(op::COMPOSITE_CONSTRUCT, ty, &[word])
            }
            _ => body.nothing(ty),
        }
    }

    /// Keeps the samples of a mask, of those that the application's shader keeps.
    fn write_mask(&self, body: &mut Body<'_>, mask: u32, written: Option<(u32, u32)>) {
        let uint = body.types.uint;
        let zero = body.constant(0);
        let (variable, of) = match written {
            Some((id, ty)) => match body.module.known_types.get(&ty) {
                Some(Type::Array(of, _)) => (id, *of),
                _ => return,
            },
            None => {
                let one = body.constant(1);
                let ty = body.module.new_type(op::TYPE_ARRAY, &[uint, one]);
                (body.interface(OUTPUT, ty, &[&[BUILT_IN, SAMPLE_MASK]]), uint)
            }
        };
        let pointer = body.module.type_of(op::TYPE_POINTER, &[OUTPUT, of]);
        let place = body.run(op::ACCESS_CHAIN, pointer, &[variable, zero]);
        let mut value = if of == uint { mask } else { body.run(op::BITCAST, of, &[mask]) };
        if written.is_some() {
            let own = body.load(of, place);
            value = body.run(op::BITWISE_AND, of, &[own, value]);
        }
        body.write(op::STORE, &[place, value]);
    }
}
