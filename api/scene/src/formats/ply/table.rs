//! A PLY file as a sequence of tables: named elements with named columns of numbers.
//!
//! The crate `ply-rs-bw` parses the header. This module reads the payload, because the crate returns every number with
//! its property's name: the 62 name look-ups per Gaussian cost several times as much as everything else, and its text
//! grammar accepts neither `nan` nor `inf`.

use std::io::Cursor;

use ply_rs_bw::parser::{Parser, Reader};
use ply_rs_bw::ply::{DefaultElement, ElementDef, Encoding, Header, PropertyType, ScalarType};

use crate::error::{Fault, Place, Reason};
use crate::formats::input::Input;

/// The longest header that is read, in bytes. Real ones have a few thousand.
const MAX_HEADER: usize = 1 << 20;

/// The longest line of a text payload that is read, in bytes.
const MAX_LINE: u64 = 1 << 16;

/// The approximate number of bytes read at once from a binary payload: enough for several threads to share.
const BLOCK: usize = 1 << 23;

/// An opened PLY file, whose elements are read in the order of the file.
pub(super) struct Table<'i, 'a> {
    input: &'i mut Input<'a>,
    header: Header,
    /// The header's comments, without the keyword, in the order of the file.
    comments: Vec<String>,
    /// The index of the next element.
    next: usize,
    /// The lines read so far, in a text file.
    lines: u64,
}

/// A column of an element: its position in a row and the type of its numbers.
#[derive(Clone)]
pub(super) struct Column {
    index: usize,
    offset: usize,
    kind: ScalarType,
}

impl Column {
    /// Returns true if the numbers are floats.
    pub(super) fn is_float(&self) -> bool {
        matches!(self.kind, ScalarType::Float | ScalarType::Double)
    }

    /// Returns true if the numbers are binary64.
    pub(super) fn is_double(&self) -> bool {
        self.kind == ScalarType::Double
    }

    /// The greatest value of the column's type, if it is an integer.
    pub(super) fn max(&self) -> f64 {
        match self.kind {
            ScalarType::Char => i8::MAX.into(),
            ScalarType::UChar => u8::MAX.into(),
            ScalarType::Short => i16::MAX.into(),
            ScalarType::UShort => u16::MAX.into(),
            ScalarType::Int => i32::MAX.into(),
            ScalarType::UInt => u32::MAX.into(),
            ScalarType::Float | ScalarType::Double => f64::MAX,
        }
    }
}

impl<'i, 'a> Table<'i, 'a> {
    /// Reads the header and checks that the file is large enough for it.
    pub(super) fn open(input: &'i mut Input<'a>) -> Result<Self, Fault> {
        let text = header_text(input)?;
        let header =
            Parser::<DefaultElement>::new().read_header(&mut Reader::new(Cursor::new(&text))).map_err(|error| {
                let place = error.line().map_or(Place::Header("its text"), |line| Place::Line(line as u64));
                Reason::Header(first_sentence(&error.to_string())).at(place)
            })?;
        // The library keeps the last of two declarations of one name.
        let declared = |keyword: &[u8]| {
            text.split(|byte| *byte == b'\n').filter(|line| line.trim_ascii_start().starts_with(keyword)).count()
        };
        let properties: usize = header.elements.values().map(|e| e.properties.len()).sum();
        if declared(b"element ") > header.elements.len() || declared(b"property ") > properties {
            return Err(Reason::Twice.at(Place::Header("its declarations")));
        }
        let comments = text
            .split(|byte| *byte == b'\n')
            .filter_map(|line| line.trim_ascii().strip_prefix(b"comment "))
            .map(|comment| String::from_utf8_lossy(comment.trim_ascii()).into_owned())
            .collect();
        let lines = text.iter().filter(|byte| **byte == b'\n').count() as u64;
        Ok(Self { input, header, comments, next: 0, lines })
    }

    /// The header's comments, without the keyword, in the order of the file.
    pub(super) fn comments(&self) -> &[String] {
        &self.comments
    }

    /// The element `name`, if there is one.
    pub(super) fn element(&self, name: &str) -> Option<&ElementDef> {
        self.header.elements.get(name)
    }

    /// The number of rows of element `name`. An error if the rest of the file is too short for it and everything before
    /// it.
    pub(super) fn count(&self, name: &str) -> Result<usize, Fault> {
        let element = || Place::Element(name.to_owned());
        let index = self.header.elements.get_index_of(name).ok_or_else(|| Reason::Missing.at(element()))?;
        let mut claimed = 0_u64;
        let coming = self.header.elements.values().take(index + 1);
        for definition in coming.skip(self.next) {
            let row = match self.header.encoding {
                // A digit and a separator each; the last line may lack its end.
                Encoding::Ascii => 2 * definition.properties.len() as u64,
                _ => stride(definition)? as u64,
            };
            claimed = row
                .max(1)
                .checked_mul(definition.count as u64)
                .and_then(|bytes| bytes.checked_add(claimed))
                .unwrap_or(u64::MAX);
        }
        let claimed = claimed - u64::from(self.header.encoding == Encoding::Ascii && claimed > 0);
        let available = self.input.remaining();
        if claimed > available {
            return Err(Reason::TooShort { claimed, available }.at(element()));
        }
        Ok(self.header.elements[index].count)
    }

    /// Column `property` of element `element`.
    pub(super) fn column(&self, element: &str, property: &str) -> Result<Column, Fault> {
        let place = || Place::Property { element: element.to_owned(), property: property.to_owned() };
        let definition = self.element(element).ok_or_else(|| Reason::Missing.at(Place::Element(element.to_owned())))?;
        let mut offset = 0;
        for (index, found) in definition.properties.values().enumerate() {
            let wanted = found.name == property;
            match &found.data_type {
                PropertyType::Scalar(kind) if wanted => {
                    let kind = kind.clone();
                    return Ok(Column { index, offset, kind });
                }
                PropertyType::List(..) if wanted => return Err(Reason::List.at(place())),
                PropertyType::Scalar(kind) => offset += size(kind),
                // `read` refuses this element; until then the offset doesn't matter.
                PropertyType::List(..) => {}
            }
        }
        Err(Reason::Missing.at(place()))
    }

    /// Column `property` of element `element`, which must have type `kind`.
    pub(super) fn column_of(
        &self,
        element: &str,
        property: &str,
        kind: &ScalarType,
        expected: &'static str,
    ) -> Result<Column, Fault> {
        let column = self.column(element, property)?;
        if column.kind == *kind {
            return Ok(column);
        }
        let found = format!("{:?}", column.kind).to_lowercase();
        Err(Reason::Type { found, expected }
            .at(Place::Property { element: element.to_owned(), property: property.to_owned() }))
    }

    /// Reads element `name`: calls `each` with a row's index and its values of `columns`. Elements before it are
    /// skipped; those before the last element read can't be read any more.
    pub(super) fn read(
        &mut self,
        name: &str,
        columns: &[Column],
        mut each: impl FnMut(usize, &[f64]),
    ) -> Result<(), Fault> {
        let mut values = vec![0.0; columns.len()];
        let mut index = 0;
        self.read_blocks(name, columns, |rows| {
            for row in 0..rows.count {
                rows.get(row, &mut values);
                each(index, &values);
                index += 1;
            }
        })
    }

    /// Reads element `name`, with many rows for each call.
    pub(super) fn read_blocks(
        &mut self,
        name: &str,
        columns: &[Column],
        mut each: impl FnMut(&Rows<'_>),
    ) -> Result<(), Fault> {
        self.count(name)?;
        let index = self.header.elements.get_index_of(name).filter(|index| *index >= self.next).ok_or_else(|| {
            Reason::Header("it stands before an element that it depends on".to_owned())
                .at(Place::Element(name.to_owned()))
        })?;
        for passed in self.next..index {
            self.read_element(passed, &[], &mut |_| {})?;
        }
        self.next = index + 1;
        self.read_element(index, columns, &mut each)
    }

    /// Reads element `name`, the next one of the file: calls `each` with the values of a row's list `property`. Other
    /// properties are skipped.
    pub(super) fn read_lists(&mut self, name: &str, property: &str, mut each: impl FnMut(&[u32])) -> Result<(), Fault> {
        let place = || Place::Property { element: name.to_owned(), property: property.to_owned() };
        let index = (self.header.elements.get_index_of(name))
            .filter(|index| *index >= self.next)
            .ok_or_else(|| Reason::Missing.at(Place::Element(name.to_owned())))?;
        for passed in self.next..index {
            self.read_element(passed, &[], &mut |_| {})?;
        }
        self.next = index + 1;
        let element = self.header.elements[index].clone();
        match element.properties.get(property).map(|found| &found.data_type) {
            Some(PropertyType::List(..)) => {}
            Some(PropertyType::Scalar(_)) => {
                let (found, expected) = ("a number".to_owned(), "a list");
                return Err(Reason::Type { found, expected }.at(place()));
            }
            None => return Err(Reason::Missing.at(place())),
        }
        let big_endian = match self.header.encoding {
            Encoding::Ascii => None,
            Encoding::BinaryLittleEndian => Some(false),
            Encoding::BinaryBigEndian => Some(true),
        };
        let (mut line, mut list) = (Vec::new(), Vec::new());
        for _ in 0..element.count {
            let mut numbers = match big_endian {
                None => {
                    self.lines += 1;
                    line.clear();
                    self.input.line(&mut line, MAX_LINE)?;
                    Numbers::Text(line.split(u8::is_ascii_whitespace), self.lines)
                }
                Some(big_endian) => Numbers::Binary(self.input, big_endian),
            };
            for found in element.properties.values() {
                let (kind, count) = match &found.data_type {
                    PropertyType::Scalar(kind) => (kind, 1),
                    PropertyType::List(count, kind) => (kind, numbers.next(count)? as u64),
                };
                list.clear();
                for _ in 0..count {
                    let value = numbers.next(kind)?;
                    if found.name == property {
                        // A negative index is out of range, as the greatest one is.
                        list.push(if value < 0.0 { u32::MAX } else { value as u32 });
                    }
                }
                if found.name == property {
                    each(&list);
                }
            }
        }
        Ok(())
    }

    fn read_element(&mut self, index: usize, columns: &[Column], each: &mut dyn FnMut(&Rows<'_>)) -> Result<(), Fault> {
        let element = self.header.elements[index].clone();
        match self.header.encoding {
            Encoding::Ascii => self.read_text(&element, columns, each),
            Encoding::BinaryLittleEndian => self.read_binary(&element, columns, each, false),
            Encoding::BinaryBigEndian => self.read_binary(&element, columns, each, true),
        }
    }

    fn read_binary(
        &mut self,
        element: &ElementDef,
        columns: &[Column],
        each: &mut dyn FnMut(&Rows<'_>),
        big_endian: bool,
    ) -> Result<(), Fault> {
        let stride = stride(element)?;
        if stride == 0 {
            return Ok(());
        }
        let rows_per_block = (BLOCK / stride).clamp(1, element.count.max(1));
        let mut block = vec![0; rows_per_block * stride];
        let mut row = 0;
        while row < element.count {
            let count = rows_per_block.min(element.count - row);
            let bytes = &mut block[..count * stride];
            self.input.fill(bytes)?;
            let source = Source::Binary { bytes, stride, big_endian };
            each(&Rows { count, columns, source });
            row += count;
        }
        Ok(())
    }

    fn read_text(
        &mut self,
        element: &ElementDef,
        columns: &[Column],
        each: &mut dyn FnMut(&Rows<'_>),
    ) -> Result<(), Fault> {
        stride(element)?;
        let mut line = Vec::new();
        let mut values = vec![0.0; columns.len()];
        for _ in 0..element.count {
            self.lines += 1;
            let at_line = |reason: Reason, line| reason.at(Place::Line(line));
            line.clear();
            self.input.line(&mut line, MAX_LINE)?;
            if line.is_empty() {
                return Err(at_line(Reason::Truncated, self.lines));
            }
            let text = String::from_utf8_lossy(&line);
            let words: Vec<&str> = text.split_ascii_whitespace().collect();
            if words.len() != element.properties.len() {
                let (found, expected) = (words.len(), element.properties.len());
                return Err(at_line(Reason::Values { found, expected }, self.lines));
            }
            for (value, column) in values.iter_mut().zip(columns) {
                let word = words[column.index];
                *value = text_number(&column.kind, word)
                    .ok_or_else(|| at_line(Reason::Number(word.to_owned()), self.lines))?;
            }
            each(&Rows { count: 1, columns, source: Source::Values(&values) });
        }
        Ok(())
    }
}

/// The numbers of a row, one after the other.
enum Numbers<'r, 'a, P: FnMut(&u8) -> bool> {
    /// The words of a line, and its number.
    Text(std::slice::Split<'r, u8, P>, u64),
    /// The payload, and true if it is big-endian.
    Binary(&'r mut Input<'a>, bool),
}

impl<P: FnMut(&u8) -> bool> Numbers<'_, '_, P> {
    /// The next number, of type `kind`.
    fn next(&mut self, kind: &ScalarType) -> Result<f64, Fault> {
        match self {
            Self::Text(words, line) => {
                let word = words.find(|word| !word.is_empty());
                let word = word.ok_or_else(|| Reason::Truncated.at(Place::Line(*line)))?;
                let word = String::from_utf8_lossy(word);
                text_number(kind, &word).ok_or_else(|| Reason::Number(word.into_owned()).at(Place::Line(*line)))
            }
            Self::Binary(input, big_endian) => {
                let mut bytes = [0; 8];
                let bytes = &mut bytes[..size(kind)];
                input.fill(bytes)?;
                let column = Column { index: 0, offset: 0, kind: kind.clone() };
                Ok(if *big_endian { number::<true>(&column, bytes) } else { number::<false>(&column, bytes) })
            }
        }
    }
}

/// Rows of an element that were read at once.
pub(super) struct Rows<'a> {
    /// The number of rows.
    pub(super) count: usize,
    columns: &'a [Column],
    source: Source<'a>,
}

/// The data of rows.
enum Source<'a> {
    Binary {
        bytes: &'a [u8],
        stride: usize,
        big_endian: bool,
    },
    /// The values of one row.
    Values(&'a [f64]),
}

impl Rows<'_> {
    /// Writes the values of row `row`, of as many columns as `values` has, to `values`. A binary64 holds the values of every type
    /// exactly.
    pub(super) fn get(&self, row: usize, values: &mut [f64]) {
        match self.source {
            Source::Binary { bytes, stride, big_endian } => {
                let bytes = &bytes[row * stride..][..stride];
                let number = if big_endian { number::<true> } else { number::<false> };
                for (value, column) in values.iter_mut().zip(self.columns) {
                    *value = number(column, bytes);
                }
            }
            Source::Values(found) => values.copy_from_slice(&found[..values.len()]),
        }
    }

    /// Appends the integers of every row to `bytes`. The columns have 8 bits each.
    pub(super) fn append_bytes(&self, bytes: &mut Vec<u8>) {
        match self.source {
            Source::Binary { bytes: rows, stride, .. } => {
                let first = self.columns.first().map_or(0, |column| column.offset);
                let follow = self.columns.iter().zip(first..).all(|(column, offset)| column.offset == offset);
                for row in rows.chunks_exact(stride) {
                    if follow {
                        bytes.extend_from_slice(&row[first..][..self.columns.len()]);
                    } else {
                        bytes.extend(self.columns.iter().map(|column| row[column.offset]));
                    }
                }
            }
            Source::Values(found) => bytes.extend(found[..self.columns.len()].iter().map(|value| *value as u8)),
        }
    }
}

/// The header's bytes, up to and including the line `end_header`.
fn header_text(input: &mut Input<'_>) -> Result<Vec<u8>, Fault> {
    let mut text = Vec::new();
    loop {
        let start = text.len();
        input.line(&mut text, (MAX_HEADER - start) as u64)?;
        let line = text[start..].trim_ascii();
        if start == 0 && line != b"ply" {
            let expected = "a PLY file";
            return Err(Reason::Magic { expected }.at(Place::Byte(0)));
        }
        if line == b"end_header" {
            return Ok(text);
        }
        if text.len() == start {
            return Err(Reason::Truncated.at(Place::Header("before end_header")));
        }
    }
}

/// The first sentence of a message of the library, without the line's text and the parser's state that follow.
fn first_sentence(message: &str) -> String {
    let message = message.lines().next().unwrap_or_default();
    let message =
        message.strip_prefix("Line ").and_then(|rest| rest.split_once(": ")).map_or(message, |(_, rest)| rest);
    message.trim_end_matches('.').to_owned()
}

/// The size of a row in bytes. An error for an element with lists.
fn stride(element: &ElementDef) -> Result<usize, Fault> {
    element
        .properties
        .values()
        .map(|property| match &property.data_type {
            PropertyType::Scalar(kind) => Ok(size(kind)),
            PropertyType::List(..) => {
                Err(Reason::List.at(Place::Property { element: element.name.clone(), property: property.name.clone() }))
            }
        })
        .sum()
}

fn size(kind: &ScalarType) -> usize {
    match kind {
        ScalarType::Char | ScalarType::UChar => 1,
        ScalarType::Short | ScalarType::UShort => 2,
        ScalarType::Int | ScalarType::UInt | ScalarType::Float => 4,
        ScalarType::Double => 8,
    }
}

/// The value of `column` in a binary row.
#[inline]
fn number<const BIG_ENDIAN: bool>(column: &Column, row: &[u8]) -> f64 {
    fn bytes<const N: usize, const BIG_ENDIAN: bool>(column: &Column, row: &[u8]) -> [u8; N] {
        let mut bytes = [0; N];
        bytes.copy_from_slice(&row[column.offset..][..N]);
        if BIG_ENDIAN {
            bytes.reverse();
        }
        bytes
    }
    match column.kind {
        ScalarType::Float => f64::from(f32::from_le_bytes(bytes::<4, BIG_ENDIAN>(column, row))),
        ScalarType::Double => f64::from_le_bytes(bytes::<8, BIG_ENDIAN>(column, row)),
        ScalarType::Char => f64::from(i8::from_le_bytes(bytes::<1, BIG_ENDIAN>(column, row))),
        ScalarType::UChar => f64::from(u8::from_le_bytes(bytes::<1, BIG_ENDIAN>(column, row))),
        ScalarType::Short => f64::from(i16::from_le_bytes(bytes::<2, BIG_ENDIAN>(column, row))),
        ScalarType::UShort => f64::from(u16::from_le_bytes(bytes::<2, BIG_ENDIAN>(column, row))),
        ScalarType::Int => f64::from(i32::from_le_bytes(bytes::<4, BIG_ENDIAN>(column, row))),
        ScalarType::UInt => f64::from(u32::from_le_bytes(bytes::<4, BIG_ENDIAN>(column, row))),
    }
}

/// The value of `word` as a number of type `kind`; `nan` and `inf` are allowed.
fn text_number(kind: &ScalarType, word: &str) -> Option<f64> {
    match kind {
        ScalarType::Float => word.parse::<f32>().ok().map(f64::from),
        ScalarType::Double => word.parse().ok(),
        ScalarType::Char => word.parse::<i8>().ok().map(f64::from),
        ScalarType::UChar => word.parse::<u8>().ok().map(f64::from),
        ScalarType::Short => word.parse::<i16>().ok().map(f64::from),
        ScalarType::UShort => word.parse::<u16>().ok().map(f64::from),
        ScalarType::Int => word.parse::<i32>().ok().map(f64::from),
        ScalarType::UInt => word.parse::<u32>().ok().map(f64::from),
    }
}
