//! A case, and the chapter to which it belongs.

use crate::draw::Draw;

/// A case: a draw with a name.
pub struct Case {
    /// The chapter, a word.
    pub chapter: &'static str,
    /// The name within the chapter: words and their values, separated by full stops.
    pub name: String,
    make: Box<dyn Fn() -> Draw + Send + Sync>,
}

impl Case {
    /// The chapter and the name.
    pub fn path(&self) -> String {
        format!("{}.{}", self.chapter, self.name)
    }

    /// Makes the draw; each call makes a new one.
    pub fn draw(&self) -> Draw {
        (self.make)()
    }
}

/// A chapter under construction.
pub(super) struct Chapter<'a> {
    name: &'static str,
    cases: &'a mut Vec<Case>,
}

impl<'a> Chapter<'a> {
    /// A chapter whose cases are appended to `cases`.
    pub(super) fn new(name: &'static str, cases: &'a mut Vec<Case>) -> Self {
        Self { name, cases }
    }

    /// Adds a case.
    pub(super) fn add(&mut self, name: impl Into<String>, make: impl Fn() -> Draw + Send + Sync + 'static) {
        self.cases.push(Case { chapter: self.name, name: name.into(), make: Box::new(make) });
    }
}
