//! The binary encoding of a layer (`.usdc`): the "crate" files of OpenUSD's `pxr/usd/sdf/crateFile.cpp`, versions 0.4 to 0.13.
//!
//! A file has tables of tokens, of paths, of fields (a name and a value), of sets of fields, and of specs: a path, what it is,
//! and its set of fields. Tables are compressed by LZ4; integers among them by their differences first.

use std::collections::BTreeMap;
use std::rc::Rc;

use half::f16;

use super::layer::{Array, Layer, MAX_DEPTH, Prim, Specifier, Target, Value, Variant};
use crate::error::{Fault, Place, Reason};

/// The first bytes.
pub(super) const MAGIC: &[u8] = b"PXR-USDC";

/// The tables' sections.
const SECTIONS: [&str; 6] = ["TOKENS", "STRINGS", "FIELDS", "FIELDSETS", "PATHS", "SPECS"];

/// The most bytes that a byte of LZ4 can become.
const MAX_LZ4: u64 = 255;

/// Arrays of fewer numbers are not compressed.
const MIN_COMPRESSED: u64 = 16;

/// Bits of a value's representation.
const ARRAY: u64 = 1 << 63;
const INLINED: u64 = 1 << 62;
const COMPRESSED: u64 = 1 << 61;
const PAYLOAD: u64 = (1 << 48) - 1;

/// Numbers of types.
mod kind {
    pub const BOOL: u8 = 1;
    pub const STRING: u8 = 10;
    pub const TOKEN: u8 = 11;
    pub const ASSET: u8 = 12;
    pub const MATRIX4: u8 = 15;
    pub const TOKEN_LIST: u8 = 32;
    pub const STRING_LIST: u8 = 33;
    pub const PATH_LIST: u8 = 34;
    pub const REFERENCE_LIST: u8 = 35;
    pub const TOKENS: u8 = 41;
    pub const SPECIFIER: u8 = 42;
    pub const SELECTIONS: u8 = 45;
    pub const TIME_SAMPLES: u8 = 46;
    pub const PAYLOAD: u8 = 47;
    pub const STRINGS: u8 = 50;
    pub const PAYLOAD_LIST: u8 = 55;
}

/// Numbers of specs' types.
mod spec {
    pub const ATTRIBUTE: u32 = 1;
    pub const PRIM: u32 = 6;
    pub const LAYER: u32 = 7;
    pub const VARIANT: u32 = 10;
}

/// The lists of an edited list, in the order in which they are stored, by the bits of those that are there, and true of those
/// whose items are composed.
const LISTS: [(u8, bool); 6] =
    [(1 << 1, true), (1 << 2, true), (1 << 5, true), (1 << 6, true), (1 << 3, false), (1 << 4, false)];

/// Reads the layer `bytes`.
pub(super) fn layer(bytes: &[u8]) -> Result<Layer, Fault> {
    File::new(bytes)?.layer()
}

/// A component of vectors.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Component {
    Half,
    Float,
    Double,
    Int,
}

impl Component {
    fn size(self) -> u64 {
        match self {
            Self::Half => 2,
            Self::Float | Self::Int => 4,
            Self::Double => 8,
        }
    }

    fn read(self, bytes: &[u8]) -> f64 {
        match self {
            Self::Half => f16::from_le_bytes([bytes[0], bytes[1]]).to_f64(),
            Self::Float => f32::from_le_bytes(std::array::from_fn(|i| bytes[i])).into(),
            Self::Int => i32::from_le_bytes(std::array::from_fn(|i| bytes[i])).into(),
            Self::Double => f64::from_le_bytes(std::array::from_fn(|i| bytes[i])),
        }
    }
}

/// The components of a type of numbers.
#[derive(Clone, Copy)]
struct Numbers {
    component: Component,
    width: usize,
    /// True if the real part of a quaternion is stored last.
    is_quaternion: bool,
}

impl Numbers {
    /// The components of type `kind`. None if it is of another sort.
    fn of(kind: u8) -> Option<Self> {
        use Component::{Double, Float, Half, Int};
        let (component, width) = match kind {
            3 => (Int, 1),
            7 => (Half, 1),
            8 => (Float, 1),
            9 => (Double, 1),
            kind::MATRIX4 => (Double, 16),
            16 | 27 => (Double, 4),
            17 | 28 => (Float, 4),
            18 | 29 => (Half, 4),
            19 => (Double, 2),
            20 => (Float, 2),
            21 => (Half, 2),
            22 => (Int, 2),
            23 => (Double, 3),
            24 => (Float, 3),
            25 => (Half, 3),
            26 => (Int, 3),
            30 => (Int, 4),
            _ => return None,
        };
        Some(Self { component, width, is_quaternion: (16..=18).contains(&kind) })
    }

    /// Moves the real part of a quaternion to the front.
    fn arrange<T>(self, element: &mut [T]) {
        if self.is_quaternion {
            element.rotate_right(1);
        }
    }
}

/// A position in the file.
#[derive(Clone, Copy)]
struct Cursor<'a> {
    bytes: &'a [u8],
    at: u64,
}

impl<'a> Cursor<'a> {
    fn fault(&self, reason: Reason) -> Fault {
        reason.at(Place::Byte(self.at))
    }

    fn malformed(&self, text: &str) -> Fault {
        self.fault(Reason::Unsupported(text.to_owned()))
    }

    fn take(&mut self, len: u64) -> Result<&'a [u8], Fault> {
        let end = self.at.checked_add(len);
        let taken = end.and_then(|end| self.bytes.get(usize::try_from(self.at).ok()?..usize::try_from(end).ok()?));
        let taken = taken.ok_or_else(|| self.fault(Reason::Truncated))?;
        self.at += len;
        Ok(taken)
    }

    fn word<const N: usize>(&mut self) -> Result<[u8; N], Fault> {
        let bytes = self.take(N as u64)?;
        Ok(std::array::from_fn(|i| bytes[i]))
    }

    fn u32(&mut self) -> Result<u32, Fault> {
        self.word().map(u32::from_le_bytes)
    }

    fn u64(&mut self) -> Result<u64, Fault> {
        self.word().map(u64::from_le_bytes)
    }

    /// Follows a distance from here.
    fn jump(&mut self) -> Result<(), Fault> {
        let from = *self;
        let distance = i64::from_le_bytes(self.word()?);
        self.at = from.at.checked_add_signed(distance).ok_or_else(|| from.fault(Reason::Truncated))?;
        Ok(())
    }

    /// Decompresses `compressed` bytes, in chunks if they are many, to at most `most` bytes.
    fn decompress(&mut self, compressed: u64, most: u64) -> Result<Vec<u8>, Fault> {
        let start = *self;
        let mut inner = Cursor { bytes: self.take(compressed)?, at: 0 };
        let damaged = || start.malformed("the LZ4 data are damaged");
        if most > compressed.saturating_mul(MAX_LZ4) {
            let (claimed, available) = (most, compressed.saturating_mul(MAX_LZ4));
            return Err(start.fault(Reason::TooShort { claimed, available }));
        }
        let most = usize::try_from(most).map_err(|_| damaged())?;
        let mut plain = Vec::new();
        plain.try_reserve_exact(most).map_err(|_| start.fault(Reason::Memory(most as u64)))?;
        plain.resize(most, 0);
        let [chunks] = inner.word::<1>().map_err(|_| damaged())?;
        let mut filled = 0;
        for _ in 0..chunks.max(1) {
            let size = if chunks == 0 { compressed - 1 } else { inner.u32().map_err(|_| damaged())?.into() };
            let chunk = inner.take(size).map_err(|_| damaged())?;
            filled += lz4_flex::block::decompress_into(chunk, &mut plain[filled..]).map_err(|_| damaged())?;
        }
        plain.truncate(filled);
        Ok(plain)
    }

    /// Reads `count` integers: the difference of each to the one before, compressed.
    fn integers(&mut self, count: u64) -> Result<Vec<u32>, Fault> {
        let start = *self;
        let damaged = || start.malformed("the integers are damaged");
        let compressed = self.u64()?;
        if compressed > (self.bytes.len() as u64).saturating_sub(self.at) {
            return Err(start.fault(Reason::Truncated));
        }
        // A difference takes two bits at least.
        if count / 4 > compressed.saturating_mul(MAX_LZ4) {
            let (claimed, available) = (count / 4, compressed.saturating_mul(MAX_LZ4));
            return Err(start.fault(Reason::TooShort { claimed, available }));
        }
        let codes = (2 * count).div_ceil(8);
        let most = (4 + codes + 4 * count).min(compressed.saturating_mul(MAX_LZ4));
        let plain = self.decompress(compressed, most)?;
        let mut words = Cursor { bytes: &plain, at: 0 };
        let common = i32::from_le_bytes(words.word().map_err(|_| damaged())?);
        let codes = words.take(codes).map_err(|_| damaged())?;
        let mut integers = Vec::with_capacity(count as usize);
        let mut last = 0i32;
        for i in 0..count as usize {
            let difference = match codes[i / 4] >> (2 * (i % 4)) & 3 {
                0 => Ok(common),
                1 => words.word().map(|word| i8::from_le_bytes(word).into()),
                2 => words.word().map(|word| i16::from_le_bytes(word).into()),
                _ => words.word().map(i32::from_le_bytes),
            };
            last = last.wrapping_add(difference.map_err(|_| damaged())?);
            integers.push(last as u32);
        }
        Ok(integers)
    }
}

/// The offsets of the sections of a file whose version ends at `head`.
fn sections(head: &mut Cursor<'_>) -> Result<BTreeMap<&'static str, u64>, Fault> {
    head.at = head.u64()?;
    let count = head.u64()?;
    let mut sections = BTreeMap::new();
    for _ in 0..count {
        let name = head.take(16)?;
        let (start, _size) = (head.u64()?, head.u64()?);
        let known = SECTIONS.iter().find(|known| name.starts_with(known.as_bytes()) && name[known.len()] == 0);
        if let Some(known) = known {
            sections.insert(*known, start);
        }
    }
    Ok(sections)
}

/// A name and the representation of a value.
struct Field {
    token: u32,
    value: u64,
}

/// A path: an element below another path.
#[derive(Clone, Copy)]
struct Path {
    parent: Option<usize>,
    token: u32,
    depth: usize,
}

/// A file and its tables.
#[derive(Default)]
struct File<'a> {
    bytes: &'a [u8],
    /// Offsets of sections by their names.
    sections: BTreeMap<&'static str, u64>,
    /// The minor number of version 0.x.
    version: u8,
    tokens: Vec<String>,
    /// Tokens of strings.
    strings: Vec<u32>,
    fields: Vec<Field>,
    /// Indices of fields; a set ends before `u32::MAX`.
    field_sets: Vec<u32>,
    /// Paths by their indices. None of an index that no path has.
    paths: Vec<Option<Path>>,
    /// The indices of paths, from the root on, a path after those above it.
    order: Vec<usize>,
}

impl<'a> File<'a> {
    fn new(bytes: &'a [u8]) -> Result<Self, Fault> {
        let mut head = Cursor { bytes, at: MAGIC.len() as u64 };
        let [major, version, ..] = head.word::<8>()?;
        if major != 0 || !(4..=13).contains(&version) {
            let found = u32::from(major) * 1000 + u32::from(version);
            return Err(Reason::Version { found, read: "0.4 to 0.13" }.at(Place::Header("version")));
        }
        let mut file = Self { bytes, version, ..Self::default() };
        file.sections = sections(&mut head)?;
        file.read_tokens(file.section("TOKENS")?)?;
        file.read_strings(file.section("STRINGS")?)?;
        file.read_fields(file.section("FIELDS")?)?;
        let mut sets = file.section("FIELDSETS")?;
        let count = sets.u64()?;
        file.field_sets = sets.integers(count)?;
        file.read_paths(file.section("PATHS")?)?;
        Ok(file)
    }

    /// The beginning of section `name`.
    fn section(&self, name: &'static str) -> Result<Cursor<'a>, Fault> {
        let at = self.sections.get(name);
        let at = at.ok_or_else(|| Reason::Missing.at(Place::Part(format!("section {name}"))))?;
        Ok(Cursor { bytes: self.bytes, at: *at })
    }

    fn read_tokens(&mut self, mut at: Cursor<'a>) -> Result<(), Fault> {
        let start = at;
        let (count, size, compressed) = (at.u64()?, at.u64()?, at.u64()?);
        let text = at.decompress(compressed, size)?;
        self.tokens = text.split(|byte| *byte == 0).map(|token| String::from_utf8_lossy(token).into_owned()).collect();
        // The last one ends with a zero too.
        self.tokens.pop();
        let found = self.tokens.len() as u64;
        if found < count {
            return Err(start.fault(Reason::Count { found, expected: count }));
        }
        Ok(())
    }

    fn read_strings(&mut self, mut at: Cursor<'a>) -> Result<(), Fault> {
        let count = at.u64()?;
        let bytes = at.take(count.saturating_mul(4))?;
        self.strings = bytes.as_chunks().0.iter().map(|word| u32::from_le_bytes(*word)).collect();
        Ok(())
    }

    fn read_fields(&mut self, mut at: Cursor<'a>) -> Result<(), Fault> {
        let count = at.u64()?;
        let tokens = at.integers(count)?;
        let compressed = at.u64()?;
        let start = at;
        let values = at.decompress(compressed, count.saturating_mul(8))?;
        let (values, _) = values.as_chunks();
        if values.len() < tokens.len() {
            let (found, expected) = (values.len() as u64, count);
            return Err(start.fault(Reason::Count { found, expected }));
        }
        let fields = tokens.into_iter().zip(values);
        self.fields = fields.map(|(token, value)| Field { token, value: u64::from_le_bytes(*value) }).collect();
        Ok(())
    }

    fn read_paths(&mut self, mut at: Cursor<'a>) -> Result<(), Fault> {
        let start = at;
        let (count, encoded) = (at.u64()?, at.u64()?);
        let [indices, tokens, jumps] = [at.integers(encoded)?, at.integers(encoded)?, at.integers(encoded)?];
        let count = usize::try_from(count).unwrap_or(usize::MAX);
        // The empty path is not in the tree.
        if count > indices.len() + 1 {
            let (found, expected) = (encoded, count as u64);
            return Err(start.fault(Reason::Count { found, expected }));
        }
        self.paths = vec![None; count];
        // Entries to go on with, and the paths that contain them.
        let mut pending = vec![(0, None)];
        while let Some((mut entry, mut parent)) = pending.pop() {
            loop {
                let wrong = || start.malformed("the tree of paths is damaged");
                let index = *indices.get(entry).ok_or_else(wrong)? as usize;
                let depth = match parent {
                    None => 0,
                    Some(parent) => self.paths.get(parent).copied().flatten().map_or(0, |path: Path| path.depth) + 1,
                };
                if depth > MAX_DEPTH {
                    return Err(start.malformed("prims are nested too deeply"));
                }
                let slot = self.paths.get_mut(index).ok_or_else(wrong)?;
                if slot.is_some() {
                    return Err(wrong());
                }
                // The token of a property is negated.
                *slot = Some(Path { parent, token: (tokens[entry] as i32).unsigned_abs(), depth });
                self.order.push(index);
                let jump = jumps[entry] as i32;
                let (has_child, has_sibling) = (jump > 0 || jump == -1, jump >= 0);
                if has_child {
                    if has_sibling {
                        pending.push((entry + jump as usize, parent));
                    }
                    parent = Some(index);
                } else if !has_sibling {
                    break;
                }
                entry += 1;
            }
        }
        Ok(())
    }

    fn token(&self, index: u32) -> &str {
        self.tokens.get(index as usize).map_or("", String::as_str)
    }

    /// The fields of set `set`.
    fn fields(&self, set: u32) -> impl Iterator<Item = &Field> {
        let set = self.field_sets.get(set as usize..).unwrap_or_default();
        let indices = set.iter().take_while(|index| **index != u32::MAX);
        indices.filter_map(|index| self.fields.get(*index as usize))
    }

    /// The layer of the file's specs.
    fn layer(&self) -> Result<Layer, Fault> {
        let mut at = self.section("SPECS")?;
        let count = at.u64()?;
        let [paths, sets, kinds] = [at.integers(count)?, at.integers(count)?, at.integers(count)?];
        // The set of fields and the type of each path that has a spec.
        let mut specs = vec![None; self.paths.len()];
        for ((path, set), kind) in paths.into_iter().zip(sets).zip(kinds) {
            if let Some(spec) = specs.get_mut(path as usize) {
                *spec = Some((kind, set));
            }
        }
        let mut layer = Layer::default();
        // The prims of paths.
        let mut prims: Vec<Option<usize>> = vec![None; self.paths.len()];
        for index in self.order.iter().copied() {
            let (Some((kind, set)), Some(path)) = (specs[index], self.paths[index]) else { continue };
            let parent = path.parent.and_then(|parent| prims[parent]);
            match kind {
                spec::LAYER => {
                    for field in self.fields(set) {
                        layer.fields.insert(self.token(field.token).to_owned(), self.value(field.value)?);
                    }
                }
                spec::PRIM | spec::VARIANT if parent.is_some() || path.depth == 1 => {
                    let above = parent.map_or("", |parent| layer.prims[parent].path.as_str());
                    let element = self.token(path.token);
                    let variant = variant(element).filter(|_| kind == spec::VARIANT);
                    let slash = if variant.is_some() { "" } else { "/" };
                    let prim = Prim::new(parent, format!("{above}{slash}{element}"), Specifier::Over);
                    prims[index] = Some(layer.prims.len());
                    layer.prims.push(self.prim(Prim { variant, ..prim }, set)?);
                }
                spec::ATTRIBUTE => {
                    let Some(parent) = parent else { continue };
                    let prim = &mut layer.prims[parent];
                    for field in self.fields(set) {
                        let name = self.token(field.token);
                        prim.is_animated |= name == "timeSamples";
                        if name == "default" || name == "timeSamples" {
                            let attribute = prim.attributes.entry(self.token(path.token).to_owned());
                            let value = self.value(field.value)?;
                            attribute.or_insert_with(|| Rc::new(value));
                        }
                    }
                }
                _ => {}
            }
        }
        Ok(layer)
    }

    /// `prim` with the fields of set `set`.
    fn prim(&self, mut prim: Prim, set: u32) -> Result<Prim, Fault> {
        for field in self.fields(set) {
            let name = self.token(field.token);
            match name {
                "specifier" => {
                    let specifier = Specifier::numbered(field.value & PAYLOAD);
                    prim.specifier = specifier.unwrap_or(Specifier::Over);
                }
                "typeName" => prim.kind = self.value(field.value)?.text().unwrap_or_default().to_owned(),
                name => prim.take_field(name, self.value(field.value)?),
            }
        }
        Ok(prim)
    }

    /// The value that `representation` stands for.
    fn value(&self, representation: u64) -> Result<Value, Fault> {
        let kind = (representation >> 48) as u8;
        let payload = representation & PAYLOAD;
        let (is_array, is_inlined) = (representation & ARRAY != 0, representation & INLINED != 0);
        let mut at = Cursor { bytes: self.bytes, at: payload };
        let text = |index: u32| Value::Text(self.token(index).to_owned());
        let string = |index: u32| self.strings.get(index as usize).copied().unwrap_or(u32::MAX);
        match (kind, is_array) {
            (kind::TOKEN | kind::STRING | kind::ASSET, false) => {
                let index = payload as u32;
                Ok(text(if kind == kind::STRING { string(index) } else { index }))
            }
            (kind::TOKEN, true) if payload == 0 => Ok(Value::Texts(Vec::new())),
            (kind::TOKEN, true) => {
                let count = self.count(&mut at)?;
                self.tokens_at(at, count)
            }
            (kind::TOKENS, false) => {
                let count = at.u64()?;
                self.tokens_at(at, count)
            }
            (kind::BOOL, false) => Ok(Value::Bool(payload != 0)),
            (kind::SPECIFIER, false) => Ok(Value::Other),
            (kind::TIME_SAMPLES, false) => self.first_sample(at),
            (kind::STRINGS, false) => {
                let count = at.u64()?;
                let texts = (0..count).map(|_| self.string(&mut at)).collect::<Result<_, _>>()?;
                Ok(Value::Texts(texts))
            }
            (kind::SELECTIONS, false) => {
                let count = at.u64()?;
                let pairs = (0..count).map(|_| Ok((self.string(&mut at)?, self.string(&mut at)?)));
                pairs.collect::<Result<_, Fault>>().map(Value::Selections)
            }
            (kind::TOKEN_LIST, false) => {
                self.list(at, |file, at| at.u32().map(|token| file.token(token).to_owned())).map(Value::Texts)
            }
            (kind::STRING_LIST, false) => self.list(at, Self::string).map(Value::Texts),
            (kind::PATH_LIST, false) => {
                let target = |file: &Self, at: &mut Cursor<'a>| {
                    Ok(Target { path: file.path_text(at.u32()?), ..Target::default() })
                };
                self.list(at, target).map(Value::Targets)
            }
            (kind::REFERENCE_LIST, false) => self.list(at, Self::reference).map(Value::Targets),
            (kind::PAYLOAD_LIST, false) => self.list(at, Self::payload).map(Value::Targets),
            (kind::PAYLOAD, false) => Ok(Value::Targets(vec![self.payload(&mut at)?])),
            _ => match Numbers::of(kind) {
                None => Ok(Value::Other),
                Some(numbers) if is_array => {
                    let is_compressed = representation & COMPRESSED != 0;
                    self.array(numbers, at, is_compressed).map(Value::Array)
                }
                Some(numbers) if is_inlined => Ok(Value::Numbers(inlined(kind, numbers, payload))),
                Some(numbers) => {
                    let size = numbers.component.size();
                    let bytes = at.take(size * numbers.width as u64)?;
                    let mut values: Vec<f64> =
                        bytes.chunks_exact(size as usize).map(|bytes| numbers.component.read(bytes)).collect();
                    numbers.arrange(&mut values);
                    Ok(Value::Numbers(values))
                }
            },
        }
    }

    /// The string with the index at `at`.
    fn string(&self, at: &mut Cursor<'a>) -> Result<String, Fault> {
        let index = at.u32()?;
        Ok(self.strings.get(index as usize).map_or("", |token| self.token(*token)).to_owned())
    }

    /// The text of the path with index `index`; empty if there is none.
    fn path_text(&self, index: u32) -> String {
        let mut elements = Vec::new();
        let mut next = Some(index as usize);
        while let Some(path) = next.and_then(|index| self.paths.get(index).copied().flatten()) {
            // The root has no name.
            if path.parent.is_some() {
                elements.push(self.token(path.token));
            }
            next = path.parent;
        }
        elements.iter().rev().fold(String::new(), |text, element| {
            let slash = if variant(element).is_some() { "" } else { "/" };
            text + slash + element
        })
    }

    /// The items of an edited list that are not deleted from it.
    fn list<T>(
        &self,
        mut at: Cursor<'a>,
        item: impl Fn(&Self, &mut Cursor<'a>) -> Result<T, Fault>,
    ) -> Result<Vec<T>, Fault> {
        let [bits] = at.word()?;
        let mut items = Vec::new();
        for (_, is_composed) in LISTS.into_iter().filter(|(bit, _)| bits & bit != 0) {
            for _ in 0..at.u64()? {
                let item = item(self, &mut at)?;
                if is_composed {
                    items.push(item);
                }
            }
        }
        Ok(items)
    }

    fn reference(&self, at: &mut Cursor<'a>) -> Result<Target, Fault> {
        let target = Target { asset: self.string(at)?, path: self.path_text(at.u32()?) };
        // The offset and the scale of its time, and a dictionary of the names and the places of values.
        at.take(16)?;
        for _ in 0..at.u64()? {
            self.string(at)?;
            at.jump()?;
            at.u64()?;
        }
        Ok(target)
    }

    fn payload(&self, at: &mut Cursor<'a>) -> Result<Target, Fault> {
        let target = Target { asset: self.string(at)?, path: self.path_text(at.u32()?) };
        if self.version >= 8 {
            at.take(16)?;
        }
        Ok(target)
    }

    fn tokens_at(&self, mut at: Cursor<'_>, count: u64) -> Result<Value, Fault> {
        let (tokens, _) = at.take(count.saturating_mul(4))?.as_chunks();
        Ok(Value::Texts(tokens.iter().map(|word| self.token(u32::from_le_bytes(*word)).to_owned()).collect()))
    }

    /// The first of the values of an attribute that varies with time.
    fn first_sample(&self, mut at: Cursor<'_>) -> Result<Value, Fault> {
        at.jump()?;
        let _times = at.u64()?;
        at.jump()?;
        if at.u64()? == 0 {
            return Ok(Value::Other);
        }
        let first = at.u64()?;
        // Samples of samples would not end.
        if (first >> 48) as u8 == kind::TIME_SAMPLES { Ok(Value::Other) } else { self.value(first) }
    }

    /// The number of elements of an array.
    fn count(&self, at: &mut Cursor<'_>) -> Result<u64, Fault> {
        if self.version < 5 {
            // The number of dimensions.
            at.u32()?;
        }
        if self.version < 7 { at.u32().map(u64::from) } else { at.u64() }
    }

    fn array(&self, numbers: Numbers, mut at: Cursor<'_>, is_compressed: bool) -> Result<Array, Fault> {
        let Numbers { component, width, .. } = numbers;
        // An empty array is stored nowhere.
        if at.at == 0 {
            return Ok(Array { width, values: Vec::new() });
        }
        let count = self.count(&mut at)?;
        if is_compressed && width == 1 && count >= MIN_COMPRESSED {
            return self.compressed(component, at, count).map(|values| Array { width, values });
        }
        let size = component.size();
        let bytes = at.take(count.saturating_mul(size * width as u64))?;
        let mut values: Vec<f32> =
            bytes.chunks_exact(size as usize).map(|bytes| component.read(bytes) as f32).collect();
        if numbers.is_quaternion {
            values.chunks_exact_mut(width).for_each(|element| numbers.arrange(element));
        }
        Ok(Array { width, values })
    }

    /// An array of `count` numbers that are stored as integers, or as indices of a table.
    fn compressed(&self, component: Component, mut at: Cursor<'_>, count: u64) -> Result<Vec<f32>, Fault> {
        let as_integers = |integers: Vec<u32>| integers.into_iter().map(|integer| integer as i32 as f32).collect();
        if component == Component::Int {
            return at.integers(count).map(as_integers);
        }
        let start = at;
        match at.word()? {
            [b'i'] => at.integers(count).map(as_integers),
            [b't'] => {
                let entries = at.u32()?;
                let table = at.take(u64::from(entries) * component.size())?;
                let table: Vec<f32> =
                    table.chunks_exact(component.size() as usize).map(|bytes| component.read(bytes) as f32).collect();
                let indices = at.integers(count)?;
                let entry = |index: u32| table.get(index as usize).copied();
                let values: Option<Vec<f32>> = indices.into_iter().map(entry).collect();
                values.ok_or_else(|| start.malformed("an index is outside its table"))
            }
            _ => Err(start.malformed("the compression of an array is unknown")),
        }
    }
}

/// The variant that an element of a path is, as in `{lod=high}`.
fn variant(element: &str) -> Option<Variant> {
    let (set, name) = element.strip_prefix('{')?.strip_suffix('}')?.split_once('=')?;
    Some(Variant { set: set.to_owned(), name: name.to_owned() })
}

/// The numbers of type `kind` that a representation's payload holds itself: one of at most four bytes, or small integers.
fn inlined(kind: u8, numbers: Numbers, payload: u64) -> Vec<f64> {
    let bytes = payload.to_le_bytes();
    let small = |i: usize| f64::from(bytes[i] as i8);
    match (numbers.component, numbers.width) {
        // A binary64 number that is one of binary32 too.
        (Component::Double, 1) => vec![Component::Float.read(&bytes)],
        (component, 1) => vec![component.read(&bytes)],
        // The diagonal.
        _ if kind == kind::MATRIX4 => (0..16).map(|i| if i % 5 == 0 { small(i / 5) } else { 0.0 }).collect(),
        (_, width) => (0..width).map(small).collect(),
    }
}
