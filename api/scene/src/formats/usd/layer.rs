//! A layer of USD: its prims and the values of their attributes, as both encodings hold them.

use std::collections::BTreeMap;

/// A layer. Prims are in the file's order, each after its parent.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Layer {
    /// Fields of the layer itself, such as `upAxis`.
    pub(super) fields: BTreeMap<String, Value>,
    pub(super) prims: Vec<Prim>,
}

/// The greatest number of prims above a prim, which is far beyond real files.
pub(super) const MAX_DEPTH: usize = 256;

/// A prim: a node of the tree, with attributes.
#[derive(Debug, PartialEq)]
pub(super) struct Prim {
    /// The index of the prim that contains it. None for the roots.
    pub(super) parent: Option<usize>,
    /// The names from the root to it, with a slash before each.
    pub(super) path: String,
    /// The name of its schema; empty if it has none.
    pub(super) kind: String,
    pub(super) specifier: Specifier,
    /// False of a prim that is switched off, with all below it.
    pub(super) is_active: bool,
    /// True if other prims or layers are composed into it: by references, payloads, inherits, specializes or variants.
    pub(super) is_composed: bool,
    /// Values by the attributes' names. A value that varies with time is the first one.
    pub(super) attributes: BTreeMap<String, Value>,
    /// True if the value of an attribute varies with time.
    pub(super) is_animated: bool,
}

impl Prim {
    /// A prim without attributes.
    pub(super) fn new(parent: Option<usize>, path: String, specifier: Specifier) -> Self {
        Self {
            parent,
            path,
            kind: String::new(),
            specifier,
            is_active: true,
            is_composed: false,
            attributes: BTreeMap::new(),
            is_animated: false,
        }
    }
}

/// The way in which a layer states a prim.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Specifier {
    /// The prim is defined.
    Def,
    /// Opinions on a prim that another layer defines.
    Over,
    /// A prim that others inherit.
    Class,
}

impl Specifier {
    /// The specifier with number `number` in binary files.
    pub(super) fn numbered(number: u64) -> Option<Self> {
        [Self::Def, Self::Over, Self::Class].get(usize::try_from(number).ok()?).copied()
    }

    /// The specifier with name `name` in text files.
    pub(super) fn named(name: &str) -> Option<Self> {
        match name {
            "def" => Some(Self::Def),
            "over" => Some(Self::Over),
            "class" => Some(Self::Class),
            _ => None,
        }
    }
}

/// A value, as far as Gaussians and their transforms need it.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Value {
    Bool(bool),
    /// A number, or the components of a vector, of a quaternion (the real part first), or of a matrix row by row.
    Numbers(Vec<f64>),
    /// A string or a token.
    Text(String),
    Texts(Vec<String>),
    /// An array of numbers, vectors or quaternions.
    Array(Array),
    /// A value of another type.
    Other,
}

/// An array of elements of `width` numbers each. Quaternions have the real part first.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Array {
    pub(super) width: usize,
    pub(super) values: Vec<f32>,
}

impl Value {
    /// The number, if it is a single one.
    pub(super) fn number(&self) -> Option<f64> {
        match self {
            Self::Numbers(numbers) if numbers.len() == 1 => Some(numbers[0]),
            _ => None,
        }
    }

    /// The text, if it is one.
    pub(super) fn text(&self) -> Option<&str> {
        match self {
            Self::Text(text) => Some(text),
            _ => None,
        }
    }
}
