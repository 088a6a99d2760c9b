//! A row of a test table: one instruction, its operands and its expected results.

use super::assembler::{Assembler, Id};
use super::inputs::{self, Domain};
use super::precision::{Interval, Maybe, format};
use super::types::{Kind, Ty};
use gaurast_workloads::kernels::{Context, Kernel, Refused};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use spirv::{BuiltIn, Capability, ExecutionMode, Op, StorageClass};
use std::borrow::Cow;

/// The number of invocations that run each row.
pub const LANES: usize = 1024;
/// The number of invocations of a workgroup.
pub const WORKGROUP: usize = 64;
/// The number of rows of a shader.
const ROWS_PER_MODULE: usize = 24;

/// The expected value of a component.
#[derive(Clone, Debug)]
pub enum Expect {
    /// It is undefined.
    Any,
    /// These bits; if they are a NaN, any NaN.
    Is(u64),
    /// One of these.
    OneOf(Vec<u64>),
    /// A float within an interval.
    Within(Interval),
}

impl From<Maybe> for Expect {
    fn from(maybe: Maybe) -> Self {
        maybe.map_or(Self::Any, Self::Within)
    }
}

impl Expect {
    fn allows(&self, kind: Kind, found: u64, flush: bool) -> bool {
        let is = |bits: u64| {
            let zero = |bits: u64| bits << 1 & kind.mask() == 0;
            let denormal = |bits: u64| kind.float(bits).abs() < kind.least_normal();
            found == bits
                || kind.is_float()
                    && (kind.float(bits).is_nan() && kind.float(found).is_nan()
                        || flush && denormal(bits) && zero(found))
        };
        match self {
            Self::Any => true,
            Self::Is(bits) => is(*bits),
            Self::OneOf(all) => all.iter().any(|bits| is(*bits)),
            Self::Within(interval) => {
                let number = kind.float(found);
                let least = kind.least_normal();
                let flushed = flush && number == 0.0 && interval.low < least && interval.high > -least;
                flushed || format(kind).permits(*interval, number)
            }
        }
    }
}

/// An invocation's operands: for each, the bits of its components.
pub type Lane = Vec<Vec<u64>>;

type LaneModel = dyn Fn(&[Vec<u64>]) -> Vec<Expect>;
type SubgroupModel = dyn Fn(&[Lane], usize) -> Vec<Expect>;

/// A function that gives the expected components of all results of a row, in order.
pub enum Model {
    /// The results depend on the invocation's own operands.
    Lane(Box<LaneModel>),
    /// The results depend on the operands of the whole subgroup, and on the invocation's index in it.
    Subgroup(Box<SubgroupModel>),
}

/// The function body into which a row's instructions are emitted.
pub struct Body {
    /// The module.
    pub asm: Assembler,
    /// The invocation's number.
    pub lane: Id,
    scratch: [Id; 2],
    cells: u32,
}

impl Body {
    /// The id of a type.
    pub fn ty(&mut self, ty: Ty) -> Id {
        ty.declare(&mut self.asm)
    }

    /// A pointer to a private cell of the invocation, in a storage buffer, of a kind of 32 or 64 bits.
    pub fn cell(&mut self, kind: Kind) -> Id {
        let wide = kind.bits() == 64;
        let element = self.ty(Ty::scalar(if wide { Kind::U64 } else { Kind::U32 }));
        let first = self.asm.u32(self.cells * LANES as u32);
        // The unit is 64 bits, so that a cell of either size fits.
        self.cells += 1;
        let u32_ty = self.ty(Ty::scalar(Kind::U32));
        let mut index = self.asm.emit(Op::IAdd, u32_ty, &[first, self.lane]);
        if !wide {
            let two = self.asm.u32(2);
            index = self.asm.emit(Op::IMul, u32_ty, &[index, two]);
        }
        let scratch = self.scratch(wide);
        let pointer = self.asm.pointer(StorageClass::StorageBuffer, element);
        let zero = self.asm.u32(0);
        self.asm.emit(Op::AccessChain, pointer, &[scratch, zero, index])
    }

    fn scratch(&mut self, wide: bool) -> Id {
        let at = usize::from(wide);
        if self.scratch[at] == 0 {
            let kind = if wide { Kind::U64 } else { Kind::U32 };
            let element = self.ty(Ty::scalar(kind));
            self.scratch[at] = self.asm.storage_buffer(2 + at as u32, element, kind.bits() / 8);
        }
        self.scratch[at]
    }
}

type Emit = dyn Fn(&mut Body, &[Id]) -> Vec<Id>;

/// An instruction, its operands and its expected results.
pub struct Row {
    /// Its name.
    pub name: String,
    /// Its operands' types and domains.
    pub operands: Vec<(Ty, Domain)>,
    /// Its results' types.
    pub results: Vec<Ty>,
    /// Emits the instruction: takes the ids of the operands and returns the ids of the results.
    pub emit: Box<Emit>,
    /// The expected results.
    pub model: Model,
    /// True if denormal operands and results may be flushed to zero on a device that does not preserve them.
    pub flushes: bool,
}

impl Row {
    /// The same, with another domain for an operand.
    pub fn of(mut self, operand: usize, domain: Domain) -> Self {
        self.operands[operand].1 = domain;
        self
    }

    fn expected(&self, lanes: &[Lane], lane: usize, subgroup: usize) -> Vec<Expect> {
        match &self.model {
            Model::Lane(model) => model(&lanes[lane]),
            Model::Subgroup(model) => {
                let first = lane / subgroup * subgroup;
                model(&lanes[first..first + subgroup], lane - first)
            }
        }
    }

    /// The operands of the lanes, the same ones each time.
    fn inputs(&self) -> Vec<Lane> {
        let seed = self.name.bytes().fold(7, |seed: u64, byte| seed.wrapping_mul(31) + u64::from(byte));
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let operand = |lane, index, (ty, domain): (Ty, Domain), random: &mut _| -> Vec<u64> {
            (0..ty.count()).map(|component| inputs::value(ty.kind, domain, [lane, index, component], random)).collect()
        };
        (0..LANES)
            .map(|lane| {
                let operands = self.operands.iter().enumerate();
                operands.map(|(index, it)| operand(lane, index, *it, &mut random)).collect()
            })
            .collect()
    }
}

fn words_of(types: impl Iterator<Item = Ty>) -> usize {
    types.map(|ty| ty.count() * ty.kind.words() as usize).sum::<usize>()
}

/// A row with wrong results.
#[derive(Clone, Debug)]
pub struct Failure {
    /// The row's name.
    pub row: String,
    /// The number of lanes with wrong results.
    pub lanes: usize,
    /// A description of the first of them.
    pub example: String,
}

/// Runs all rows on a device.
///
/// # Errors
/// The error of Vulkan, with the rows of the refused shader.
pub fn check(context: &Context, rows: &[Row]) -> Result<Vec<Failure>, (Refused, Vec<String>)> {
    let mut failures = Vec::new();
    for rows in rows.chunks(ROWS_PER_MODULE) {
        let refused = |error| (error, rows.iter().map(|row| row.name.clone()).collect());
        failures.extend(check_module(context, rows).map_err(refused)?);
    }
    Ok(failures)
}

fn check_module(context: &Context, rows: &[Row]) -> Result<Vec<Failure>, Refused> {
    let lanes: Vec<Vec<Lane>> = rows.iter().map(Row::inputs).collect();
    let mut input = Vec::new();
    for (row, lanes) in rows.iter().zip(&lanes) {
        for (operand, (ty, _)) in row.operands.iter().enumerate() {
            for component in 0..ty.count() {
                let bits = || lanes.iter().map(|lane| lane[operand][component]);
                input.extend(bits().map(|bits| bits as u32));
                if ty.kind.words() == 2 {
                    input.extend(bits().map(|bits| (bits >> 32) as u32));
                }
            }
        }
    }
    let (spirv, cells) = assemble(rows, context.preserves_denormals);
    let results = rows.iter().flat_map(|row| row.results.iter().copied());
    let output = LANES * words_of(results);
    let scratch = vec![0; 2 * LANES * cells.max(1) as usize];
    let kernel = Kernel {
        name: "rows",
        spirv: Cow::Owned(bytemuck::pod_collect_to_vec(&spirv)),
        specialization: Vec::new(),
        buffers: vec![input, vec![0; output], scratch.clone(), scratch],
        uniform: None,
        push: Vec::new(),
        groups: [(LANES / WORKGROUP) as u32, 1, 1],
        expected: Vec::new(),
    };
    let prepared = context.prepare(&kernel)?;
    prepared.run()?;
    let found = prepared.read(1);
    let mut at = 0;
    let mut failures = Vec::new();
    for (row, lanes) in rows.iter().zip(&lanes) {
        let size = LANES * words_of(row.results.iter().copied());
        failures.extend(compare(context, row, lanes, &found[at..at + size]));
        at += size;
    }
    Ok(failures)
}

/// The components of all results of a lane.
fn results(row: &Row, found: &[u32], lane: usize) -> Vec<(Kind, u64)> {
    let mut at = lane;
    let mut all = Vec::new();
    for ty in &row.results {
        for _ in 0..ty.count() {
            let mut bits = u64::from(found[at]);
            if ty.kind.words() == 2 {
                at += LANES;
                bits |= u64::from(found[at]) << 32;
            }
            at += LANES;
            all.push((ty.kind, bits));
        }
    }
    all
}

fn compare(context: &Context, row: &Row, lanes: &[Lane], found: &[u32]) -> Option<Failure> {
    let subgroup = (context.subgroup_size as usize).min(WORKGROUP);
    let flush = row.flushes && !context.preserves_denormals;
    let flushed: Vec<Lane> = lanes.iter().map(|lane| flush_lane(row, lane)).collect();
    let mut failure: Option<Failure> = None;
    for lane in 0..LANES {
        let found = results(row, found, lane);
        let agrees = |lanes: &[Lane]| {
            let expected = row.expected(lanes, lane, subgroup);
            assert_eq!(expected.len(), found.len(), "{}", row.name);
            let mut pairs = expected.iter().zip(&found);
            pairs.all(|(expected, (kind, found))| expected.allows(*kind, *found, flush))
        };
        if agrees(lanes) || flush && agrees(&flushed) {
            continue;
        }
        let failure = failure.get_or_insert_with(|| Failure {
            row: row.name.clone(),
            lanes: 0,
            example: describe(row, &lanes[lane], &found, &row.expected(lanes, lane, subgroup)),
        });
        failure.lanes += 1;
    }
    failure
}

fn flush_lane(row: &Row, lane: &Lane) -> Lane {
    let operands = row.operands.iter().zip(lane);
    operands
        .map(|((ty, _), components)| {
            let flush = |bits: &u64| match ty.kind {
                kind if kind.is_float() && kind.float(*bits).abs() < kind.least_normal() => {
                    bits & 1 << (kind.bits() - 1)
                }
                _ => *bits,
            };
            components.iter().map(flush).collect()
        })
        .collect()
}

fn describe(row: &Row, lane: &Lane, found: &[(Kind, u64)], expected: &[Expect]) -> String {
    let text = |kind: Kind, bits: u64| match kind {
        Kind::Bool => (bits != 0).to_string(),
        kind if kind.is_float() => format!("{:e} ({bits:#x})", kind.float(bits)),
        kind => kind.integer(bits).to_string(),
    };
    let operands: Vec<String> = row
        .operands
        .iter()
        .zip(lane)
        .map(|((ty, _), components)| {
            let all: Vec<_> = components.iter().map(|bits| text(ty.kind, *bits)).collect();
            all.join(" ")
        })
        .collect();
    let found: Vec<String> = found.iter().map(|(kind, bits)| text(*kind, *bits)).collect();
    let one = |(expected, ty): (&Expect, Kind)| match expected {
        Expect::Is(bits) => text(ty, *bits),
        Expect::OneOf(all) => {
            let all: Vec<_> = all.iter().map(|bits| text(ty, *bits)).collect();
            all.join(" or ")
        }
        other => format!("{other:?}"),
    };
    let kinds = row.results.iter().flat_map(|ty| vec![ty.kind; ty.count()]);
    let expected: Vec<String> = expected.iter().zip(kinds).map(one).collect();
    format!("of ({}) came [{}] instead of [{}]", operands.join("; "), found.join(", "), expected.join(", "))
}

/// The shader of some rows, and the number of scratch cells of an invocation.
fn assemble(rows: &[Row], preserve_denormals: bool) -> (Vec<u32>, u32) {
    let mut asm = Assembler::new(WORKGROUP as u32);
    asm.extension("SPV_KHR_float_controls");
    asm.capability(Capability::SignedZeroInfNanPreserve);
    asm.capability(Capability::RoundingModeRTE);
    let word = Ty::scalar(Kind::U32).declare(&mut asm);
    let (input, output) = (asm.storage_buffer(0, word, 4), asm.storage_buffer(1, word, 4));
    let triple = Ty::vector(Kind::U32, 3).declare(&mut asm);
    let id = asm.built_in(BuiltIn::GlobalInvocationId, triple);
    let id = asm.emit(Op::Load, triple, &[id]);
    let lane = asm.emit(Op::CompositeExtract, word, &[id, 0]);
    let mut body = Body { asm, lane, scratch: [0; 2], cells: 0 };
    let mut memory = Memory { input, output, read: 0, written: 0 };
    for row in rows {
        let operands: Vec<Id> = row.operands.iter().map(|(ty, _)| memory.load(&mut body, *ty)).collect();
        let results = (row.emit)(&mut body, &operands);
        assert_eq!(results.len(), row.results.len(), "{}", row.name);
        for (ty, value) in row.results.iter().zip(results) {
            memory.store(&mut body, *ty, value);
        }
    }
    let types = rows.iter().flat_map(|row| row.operands.iter().map(|it| it.0).chain(row.results.clone()));
    let mut widths: Vec<u32> = types.filter(|ty| ty.kind.is_float()).map(|ty| ty.kind.bits()).chain([32]).collect();
    widths.sort_unstable();
    widths.dedup();
    for width in widths {
        let asm = &mut body.asm;
        asm.mode(ExecutionMode::SignedZeroInfNanPreserve, &[width]);
        asm.mode(ExecutionMode::RoundingModeRTE, &[width]);
        if preserve_denormals {
            asm.capability(Capability::DenormPreserve);
            asm.mode(ExecutionMode::DenormPreserve, &[width]);
        }
    }
    let mut asm = body.asm;
    asm.act(Op::Return, &[]);
    let nothing = asm.declare(Op::TypeVoid, None, &[]);
    asm.function(asm.main(), nothing, &[]);
    (asm.finish(), body.cells)
}

/// The layout of the buffers of operands and results: word k of all lanes, then word k + 1.
struct Memory {
    input: Id,
    output: Id,
    read: u32,
    written: u32,
}

impl Memory {
    fn word(body: &mut Body, buffer: Id, number: u32) -> Id {
        let ty = body.ty(Ty::scalar(Kind::U32));
        let pointer = body.asm.pointer(StorageClass::StorageBuffer, ty);
        let (zero, first) = (body.asm.u32(0), body.asm.u32(number * LANES as u32));
        let index = body.asm.emit(Op::IAdd, ty, &[first, body.lane]);
        body.asm.emit(Op::AccessChain, pointer, &[buffer, zero, index])
    }

    fn load_word(&mut self, body: &mut Body) -> Id {
        let pointer = Self::word(body, self.input, self.read);
        self.read += 1;
        let ty = body.ty(Ty::scalar(Kind::U32));
        body.asm.emit(Op::Load, ty, &[pointer])
    }

    fn load(&mut self, body: &mut Body, ty: Ty) -> Id {
        let components: Vec<Id> = (0..ty.count()).map(|_| self.load_scalar(body, ty.kind)).collect();
        ty.construct(&mut body.asm, &components)
    }

    fn load_scalar(&mut self, body: &mut Body, kind: Kind) -> Id {
        let word = self.load_word(body);
        let ty = body.ty(Ty::scalar(kind));
        match kind {
            Kind::Bool => {
                let zero = body.asm.u32(0);
                body.asm.emit(Op::INotEqual, ty, &[word, zero])
            }
            Kind::U32 => word,
            kind if kind.words() == 2 => {
                let high = self.load_word(body);
                let pair = body.ty(Ty::vector(Kind::U32, 2));
                let pair = body.asm.emit(Op::CompositeConstruct, pair, &[word, high]);
                body.asm.emit(Op::Bitcast, ty, &[pair])
            }
            kind if kind.bits() < 32 => {
                let unsigned = integer_of(kind);
                let narrow = body.ty(Ty::scalar(unsigned));
                let value = body.asm.emit(Op::UConvert, narrow, &[word]);
                if kind == unsigned {
                    return value;
                }
                body.asm.emit(Op::Bitcast, ty, &[value])
            }
            _ => body.asm.emit(Op::Bitcast, ty, &[word]),
        }
    }

    fn store_word(&mut self, body: &mut Body, word: Id) {
        let pointer = Self::word(body, self.output, self.written);
        self.written += 1;
        body.asm.act(Op::Store, &[pointer, word]);
    }

    fn store(&mut self, body: &mut Body, ty: Ty, value: Id) {
        for component in ty.take_apart(&mut body.asm, value) {
            self.store_scalar(body, ty.kind, component);
        }
    }

    fn store_scalar(&mut self, body: &mut Body, kind: Kind, value: Id) {
        let word = body.ty(Ty::scalar(Kind::U32));
        match kind {
            Kind::Bool => {
                let (one, zero) = (body.asm.u32(1), body.asm.u32(0));
                let value = body.asm.emit(Op::Select, word, &[value, one, zero]);
                self.store_word(body, value);
            }
            Kind::U32 => self.store_word(body, value),
            kind if kind.words() == 2 => {
                let pair = body.ty(Ty::vector(Kind::U32, 2));
                let pair = body.asm.emit(Op::Bitcast, pair, &[value]);
                for half in 0..2 {
                    let half = body.asm.emit(Op::CompositeExtract, word, &[pair, half]);
                    self.store_word(body, half);
                }
            }
            kind if kind.bits() < 32 => {
                let unsigned = integer_of(kind);
                let narrow = body.ty(Ty::scalar(unsigned));
                let value = match kind == unsigned {
                    true => value,
                    false => body.asm.emit(Op::Bitcast, narrow, &[value]),
                };
                let value = body.asm.emit(Op::UConvert, word, &[value]);
                self.store_word(body, value);
            }
            _ => {
                let value = body.asm.emit(Op::Bitcast, word, &[value]);
                self.store_word(body, value);
            }
        }
    }
}

/// The unsigned integer kind with the same number of bits.
fn integer_of(kind: Kind) -> Kind {
    match kind {
        Kind::F16 => Kind::U16,
        Kind::F32 => Kind::U32,
        Kind::F64 => Kind::U64,
        kind => kind.with_sign(false),
    }
}
