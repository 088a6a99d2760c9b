//! A layer of USD: its prims and the values of their attributes, as both encodings hold them.

use std::collections::BTreeMap;
use std::rc::Rc;

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
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Prim {
    /// The index of the prim that contains it. None for the roots.
    pub(super) parent: Option<usize>,
    /// The names from the root to it, with a slash before each.
    pub(super) path: String,
    /// The name of its schema; empty if it has none.
    pub(super) kind: String,
    pub(super) specifier: Specifier,
    /// False of a prim that is switched off, with all below it. None if the layer does not say so.
    pub(super) is_active: Option<bool>,
    /// The names of the schemas that are applied to it.
    pub(super) schemas: Vec<String>,
    /// The prims that are composed into it, the strongest kind first.
    pub(super) arcs: BTreeMap<ArcKind, Vec<Target>>,
    /// The names of its variants that are chosen, by their sets.
    pub(super) selections: BTreeMap<String, String>,
    /// The variant that it is of the prim above. Variants are no prims until they are chosen.
    pub(super) variant: Option<Variant>,
    /// Values by the attributes' names. A value that varies with time is the first one.
    pub(super) attributes: BTreeMap<String, Rc<Value>>,
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
            is_active: None,
            schemas: Vec::new(),
            arcs: BTreeMap::new(),
            selections: BTreeMap::new(),
            variant: None,
            attributes: BTreeMap::new(),
            is_animated: false,
        }
    }

    /// The last name of its path.
    pub(super) fn name(&self) -> &str {
        self.path.rsplit('/').next().unwrap_or_default()
    }

    /// The value of the attribute `name`.
    pub(super) fn value(&self, name: &str) -> Option<&Value> {
        self.attributes.get(name).map(Rc::as_ref)
    }

    /// Takes a field, by its name in either encoding.
    pub(super) fn take_field(&mut self, name: &str, value: Value) {
        let kind = match name {
            "active" => {
                self.is_active = Some(!matches!(value.number(), Some(0.0)) && value != Value::Bool(false));
                return;
            }
            "apiSchemas" => {
                if let Value::Texts(schemas) = value {
                    self.schemas.extend(schemas);
                }
                return;
            }
            "variants" | "variantSelection" => {
                if let Value::Selections(selections) = value {
                    self.selections.extend(selections);
                }
                return;
            }
            "inherits" | "inheritPaths" => ArcKind::Inherit,
            "references" => ArcKind::Reference,
            "payload" => ArcKind::Payload,
            "specializes" => ArcKind::Specialize,
            _ => return,
        };
        if let Value::Targets(targets) = value {
            self.arcs.entry(kind).or_default().extend(targets);
        }
    }
}

/// The way in which a prim is composed into another one, the strongest first. Variants are between inherits and references.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum ArcKind {
    Inherit,
    Reference,
    Payload,
    Specialize,
}

/// A prim that is composed into another one.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Target {
    /// The layer's file; empty for the layer that names it.
    pub(super) asset: String,
    /// The prim's path; empty for the layer's default prim.
    pub(super) path: String,
}

/// A variant: its set and its name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Variant {
    pub(super) set: String,
    pub(super) name: String,
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
    /// Paths of prims, files, or both.
    Targets(Vec<Target>),
    /// Names of variants by their sets.
    Selections(BTreeMap<String, String>),
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
