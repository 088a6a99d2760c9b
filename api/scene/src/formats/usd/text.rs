//! The text encoding of a layer (`.usda`).

use std::collections::BTreeMap;
use std::rc::Rc;

use super::layer::{Array, Layer, MAX_DEPTH, Prim, Specifier, Target, Value, Variant};
use crate::error::{Fault, Place, Reason};

/// The first bytes.
pub(super) const MAGIC: &[u8] = b"#usda";

/// Words before an attribute's type, or before a field's name, that change nothing here.
const MODIFIERS: [&str; 9] =
    ["custom", "uniform", "varying", "config", "prepend", "append", "add", "delete", "reorder"];

/// A brace that is open.
enum Open {
    /// The block of the prim with this index.
    Prim(usize),
    /// The block of a set of variants of a prim.
    Variants { prim: usize, set: String },
}

/// Reads the layer `bytes`.
pub(super) fn layer(bytes: &[u8]) -> Result<Layer, Fault> {
    let mut parser = Parser { bytes, at: 0 };
    let mut layer = Layer::default();
    // The first line is a comment.
    if parser.next_is(b'(') {
        parser.fields(|name, value| {
            layer.fields.insert(name.to_owned(), value);
        })?;
    }
    let mut open: Vec<Open> = Vec::new();
    loop {
        parser.skip_space();
        match parser.peek() {
            None if open.is_empty() => return Ok(layer),
            None => return Err(Reason::Truncated.at(Place::Line(parser.line()))),
            Some(b'}') if open.pop().is_some() => parser.at += 1,
            Some(b';') => parser.at += 1,
            Some(_) => match open.last() {
                Some(Open::Variants { prim, set }) => {
                    let (prim, set) = (*prim, set.clone());
                    parser.variant(prim, set, &mut layer, &mut open)?;
                }
                Some(Open::Prim(prim)) => parser.item(Some(*prim), &mut layer, &mut open)?,
                None => parser.item(None, &mut layer, &mut open)?,
            },
        }
    }
}

/// A position in the text.
struct Parser<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Parser<'a> {
    /// The number of the line, from 1.
    fn line(&self) -> u64 {
        let before = &self.bytes[..self.at.min(self.bytes.len())];
        1 + before.iter().filter(|byte| **byte == b'\n').count() as u64
    }

    fn wrong(&self, text: impl Into<String>) -> Fault {
        Reason::Unsupported(text.into()).at(Place::Line(self.line()))
    }

    fn peek(&self) -> Option<u8> {
        self.bytes.get(self.at).copied()
    }

    /// Skips white space and comments.
    fn skip_space(&mut self) {
        while let Some(byte) = self.peek() {
            match byte {
                b'#' => self.skip_while(|byte| byte != b'\n'),
                byte if byte.is_ascii_whitespace() => self.at += 1,
                _ => return,
            }
        }
    }

    fn skip_while(&mut self, is_skipped: impl Fn(u8) -> bool) {
        let rest = self.bytes.get(self.at..).unwrap_or_default();
        self.at += rest.iter().position(|byte| !is_skipped(*byte)).unwrap_or(rest.len());
    }

    /// The bytes that are `taken`, which may be none.
    fn take_while(&mut self, taken: impl Fn(u8) -> bool) -> &'a [u8] {
        let start = self.at;
        self.skip_while(taken);
        &self.bytes[start..self.at]
    }

    /// True if `byte` is next, after white space.
    fn next_is(&mut self, byte: u8) -> bool {
        self.skip_space();
        self.peek() == Some(byte)
    }

    /// Takes `byte` if it is next.
    fn accept(&mut self, byte: u8) -> bool {
        let is_next = self.next_is(byte);
        self.at += usize::from(is_next);
        is_next
    }

    fn expect(&mut self, byte: u8) -> Result<(), Fault> {
        if self.accept(byte) { Ok(()) } else { Err(self.wrong(format!("{:?} is expected here", char::from(byte)))) }
    }

    /// A name, with colons and points in it; empty if there is none.
    fn word(&mut self) -> &'a str {
        self.skip_space();
        let word = self.take_while(|byte| byte.is_ascii_alphanumeric() || b"_:.".contains(&byte) || byte >= 0x80);
        std::str::from_utf8(word).unwrap_or_default()
    }

    /// A name that must be there.
    fn name(&mut self, what: &str) -> Result<&'a str, Fault> {
        let name = self.word();
        if name.is_empty() { Err(self.wrong(format!("{what} is expected here"))) } else { Ok(name) }
    }

    /// A text in quotes, one or three.
    fn text(&mut self) -> Result<String, Fault> {
        self.skip_space();
        let start = self.at;
        let quote = self.peek().filter(|byte| b"\"'".contains(byte));
        let quote = quote.ok_or_else(|| self.wrong("a text in quotes is expected here"))?;
        let is_long = self.bytes[self.at..].starts_with(&[quote; 3]);
        let end: &[u8] = if is_long { &[quote; 3] } else { &[quote] };
        self.at += end.len();
        let mut text = Vec::new();
        loop {
            let rest = &self.bytes[self.at..];
            if rest.starts_with(end) {
                self.at += end.len();
                return Ok(String::from_utf8_lossy(&text).into_owned());
            }
            // Only long texts have several lines.
            let rest = if !is_long && rest.starts_with(b"\n") { &[] } else { rest };
            let (byte, taken) = match rest {
                [] => {
                    self.at = start;
                    return Err(self.wrong("this text does not end"));
                }
                [b'\\', b'n', ..] => (b'\n', 2),
                [b'\\', b't', ..] => (b'\t', 2),
                [b'\\', escaped, ..] => (*escaped, 2),
                [byte, ..] => (*byte, 1),
            };
            text.push(byte);
            self.at += taken;
        }
    }

    /// A path in angle brackets, or an asset's in signs `@`.
    fn path(&mut self) -> Result<&'a str, Fault> {
        let (end, start): (&[u8], usize) = match self.bytes.get(self.at..).unwrap_or_default() {
            [b'@', b'@', b'@', ..] => (b"@@@", 3),
            [b'@', ..] => (b"@", 1),
            _ => (b">", 1),
        };
        let rest = self.bytes.get(self.at + start..).unwrap_or_default();
        let len = rest.windows(end.len()).position(|window| window == end);
        let len = len.ok_or_else(|| self.wrong("this path does not end"))?;
        self.at += start + len + end.len();
        Ok(std::str::from_utf8(&rest[..len]).unwrap_or_default())
    }

    /// The path of an asset, of a prim, or of a prim in an asset. The offset of its time is skipped.
    fn target(&mut self) -> Result<Target, Fault> {
        let mut target = Target::default();
        if self.next_is(b'@') {
            self.path()?.clone_into(&mut target.asset);
        }
        if self.next_is(b'<') {
            self.path()?.clone_into(&mut target.path);
        }
        if self.next_is(b'(') {
            self.skip_brackets()?;
        }
        Ok(target)
    }

    /// Names of variants by their sets: a dictionary of strings.
    fn selections(&mut self) -> Result<BTreeMap<String, String>, Fault> {
        let mut selections = BTreeMap::new();
        self.expect(b'{')?;
        while !self.accept(b'}') {
            self.name("a type")?;
            self.skip_space();
            let is_quoted = self.peek().is_some_and(|byte| b"\"'".contains(&byte));
            let set = if is_quoted { self.text()? } else { self.name("a set of variants")?.to_owned() };
            self.expect(b'=')?;
            selections.insert(set, self.text()?);
            while self.accept(b';') || self.accept(b',') {}
        }
        Ok(selections)
    }

    /// Skips a bracket and everything up to the one that closes it.
    fn skip_brackets(&mut self) -> Result<(), Fault> {
        let start = self.at;
        let mut depth = 0usize;
        loop {
            self.skip_space();
            match self.peek() {
                None => {
                    self.at = start;
                    return Err(self.wrong("this bracket is not closed"));
                }
                Some(b'"' | b'\'') => {
                    self.text()?;
                    continue;
                }
                Some(b'@' | b'<') => {
                    self.path()?;
                    continue;
                }
                Some(b'(' | b'[' | b'{') => depth += 1,
                Some(b')' | b']' | b'}') => depth = depth.saturating_sub(1),
                Some(_) => {}
            }
            self.at += 1;
            if depth == 0 {
                return Ok(());
            }
        }
    }

    /// Reads the fields in parentheses.
    fn fields(&mut self, mut each: impl FnMut(&str, Value)) -> Result<(), Fault> {
        self.expect(b'(')?;
        loop {
            self.skip_space();
            match self.peek() {
                Some(b')') => {
                    self.at += 1;
                    return Ok(());
                }
                Some(b';' | b',') => self.at += 1,
                Some(b'"' | b'\'') => {
                    let text = self.text()?;
                    each("documentation", Value::Text(text));
                }
                _ => {
                    let mut name = self.name("a field")?;
                    // What is deleted from lists is in other layers.
                    let is_deleted = name == "delete";
                    while MODIFIERS.contains(&name) {
                        name = self.name("a field")?;
                    }
                    let name = if name == "doc" { "documentation" } else { name };
                    self.expect(b'=')?;
                    let value = if name == "variants" { Value::Selections(self.selections()?) } else { self.value()? };
                    if !is_deleted {
                        each(name, value);
                    }
                }
            }
        }
    }

    /// Reads an item of the layer, or of the prim `above`: a prim or a set of variants up to its brace, or a property.
    fn item(&mut self, above: Option<usize>, layer: &mut Layer, open: &mut Vec<Open>) -> Result<(), Fault> {
        let word = self.name("a prim or a property")?;
        if let Some(specifier) = Specifier::named(word) {
            let kind = self.word().to_owned();
            let name = self.text()?;
            let path = above.map_or("", |above| layer.prims[above].path.as_str());
            let prim = Prim { kind, ..Prim::new(above, format!("{path}/{name}"), specifier) };
            return self.prim(prim, layer, open);
        }
        if let ("variantSet", Some(prim)) = (word, above) {
            let set = self.text()?;
            self.expect(b'=')?;
            self.expect(b'{')?;
            return self.open(Open::Variants { prim, set }, open);
        }
        let prim = above.map(|prim| &mut layer.prims[prim]);
        let mut word = word;
        while MODIFIERS.contains(&word) {
            word = self.name("a property")?;
            // The order of children or of properties.
            if matches!(word, "nameChildren" | "properties" | "rootPrims") && self.next_is(b'=') {
                break;
            }
        }
        let is_order = matches!(word, "nameChildren" | "properties" | "rootPrims") && self.next_is(b'=');
        let property = if is_order {
            word
        } else {
            if self.accept(b'[') {
                self.expect(b']')?;
            }
            self.name("a property's name")?
        };
        let value = if self.accept(b'=') { Some(self.value()?) } else { None };
        if self.next_is(b'(') {
            self.skip_brackets()?;
        }
        let (Some(value), Some(prim)) = (value, prim) else { return Ok(()) };
        match property.rsplit_once('.') {
            None if word != "rel" && !is_order => {
                prim.attributes.insert(property.to_owned(), Rc::new(value));
            }
            Some((name, "timeSamples")) => {
                prim.is_animated = true;
                prim.attributes.entry(name.to_owned()).or_insert_with(|| Rc::new(value));
            }
            _ => {}
        }
        Ok(())
    }

    /// Reads a variant of a set of the prim `above` up to its brace.
    fn variant(&mut self, above: usize, set: String, layer: &mut Layer, open: &mut Vec<Open>) -> Result<(), Fault> {
        let name = self.text()?;
        let path = format!("{}{{{set}={name}}}", layer.prims[above].path);
        let variant = Some(Variant { set, name });
        self.prim(Prim { variant, ..Prim::new(Some(above), path, Specifier::Over) }, layer, open)
    }

    /// Reads the fields of `prim`, and its brace.
    fn prim(&mut self, mut prim: Prim, layer: &mut Layer, open: &mut Vec<Open>) -> Result<(), Fault> {
        if self.next_is(b'(') {
            self.fields(|name, value| prim.take_field(name, value))?;
        }
        self.expect(b'{')?;
        self.open(Open::Prim(layer.prims.len()), open)?;
        layer.prims.push(prim);
        Ok(())
    }

    fn open(&self, brace: Open, open: &mut Vec<Open>) -> Result<(), Fault> {
        if open.len() >= MAX_DEPTH {
            return Err(self.wrong("prims are nested too deeply"));
        }
        open.push(brace);
        Ok(())
    }

    fn value(&mut self) -> Result<Value, Fault> {
        self.skip_space();
        match self.peek() {
            Some(b'"' | b'\'') => self.text().map(Value::Text),
            Some(b'@' | b'<') => Ok(Value::Targets(vec![self.target()?])),
            Some(b'(') => self.tuple(),
            Some(b'[') => self.list(),
            Some(b'{') => self.first_sample(),
            _ => {
                let start = self.at;
                if let Ok(number) = self.number::<f64>() {
                    return Ok(Value::Numbers(vec![number]));
                }
                self.at = start;
                Ok(match self.name("a value")? {
                    "true" => Value::Bool(true),
                    "false" => Value::Bool(false),
                    _ => Value::Other,
                })
            }
        }
    }

    /// The first value of those by time; [`Value::Other`] of another dictionary.
    fn first_sample(&mut self) -> Result<Value, Fault> {
        let start = self.at;
        self.at += 1;
        let has_time = self.number::<f64>().is_ok() && self.accept(b':');
        let value = if has_time { self.value()? } else { Value::Other };
        self.at = start;
        self.skip_brackets()?;
        Ok(value)
    }

    fn number<T: std::str::FromStr>(&mut self) -> Result<T, Fault> {
        self.skip_space();
        let start = self.at;
        let text = self.take_while(|byte| byte.is_ascii_alphanumeric() || b"+-.".contains(&byte));
        let text = std::str::from_utf8(text).unwrap_or_default();
        text.parse().map_err(|_| {
            self.at = start;
            Reason::Number(text.to_owned()).at(Place::Line(self.line()))
        })
    }

    /// A vector, a quaternion or a matrix, row by row.
    fn tuple(&mut self) -> Result<Value, Fault> {
        let mut numbers = Vec::new();
        let mut depth = 0;
        loop {
            self.skip_space();
            match self.peek() {
                Some(b'(') => depth += 1,
                Some(b')') => depth -= 1,
                Some(b',') => {}
                _ => {
                    numbers.push(self.number()?);
                    continue;
                }
            }
            self.at += 1;
            if depth == 0 {
                return Ok(Value::Numbers(numbers));
            }
        }
    }

    /// A list of texts or of targets, or an array of numbers, vectors or quaternions.
    fn list(&mut self) -> Result<Value, Fault> {
        let start = self.at;
        self.expect(b'[')?;
        self.skip_space();
        match self.peek() {
            Some(b'"' | b'\'') => {
                let mut texts = Vec::new();
                while !self.accept(b']') {
                    texts.push(self.text()?);
                    self.accept(b',');
                }
                Ok(Value::Texts(texts))
            }
            Some(b'@' | b'<') => {
                let mut targets = Vec::new();
                while !self.accept(b']') {
                    if !self.next_is(b'@') && !self.next_is(b'<') {
                        return Err(self.wrong("a path is expected here"));
                    }
                    targets.push(self.target()?);
                    self.accept(b',');
                }
                Ok(Value::Targets(targets))
            }
            Some(byte) if byte.is_ascii_digit() || b"(-+.]in".contains(&byte) => self.array().map(Value::Array),
            _ => {
                self.at = start;
                self.skip_brackets()?;
                Ok(Value::Other)
            }
        }
    }

    /// The elements of an array up to its bracket.
    fn array(&mut self) -> Result<Array, Fault> {
        let (mut width, mut values) = (1, Vec::new());
        while !self.accept(b']') {
            let before = values.len();
            if self.accept(b'(') {
                while !self.accept(b')') {
                    values.push(self.number()?);
                    self.accept(b',');
                }
            } else {
                values.push(self.number()?);
            }
            let found = values.len() - before;
            if before == 0 {
                width = found.max(1);
            } else if found != width {
                return Err(self.wrong(format!("an element has {found} numbers, and the first one has {width}")));
            }
            self.accept(b',');
        }
        Ok(Array { width, values })
    }
}
