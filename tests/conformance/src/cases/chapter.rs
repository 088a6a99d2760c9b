//! A case, and the chapter to which it belongs.

use crate::draw::Draw;
use crate::features;
use crate::program::Program;

/// What a case is about.
pub enum Subject {
    /// A draw, which any implementation may draw.
    Draw(Box<Draw>),
    /// A program of Vulkan commands, which a device executes.
    Program(Program),
}

/// A case: a draw or a program, with a name.
pub struct Case {
    /// The chapter, a word.
    pub chapter: &'static str,
    /// The name within the chapter: words and their values, separated by full stops.
    pub name: String,
    /// True if it takes long, and runs only if asked for.
    pub is_large: bool,
    make: Box<dyn Fn() -> Subject + Send + Sync>,
}

impl Case {
    /// The chapter and the name.
    pub fn path(&self) -> String {
        format!("{}.{}", self.chapter, self.name)
    }

    /// Makes the draw or the program; each call makes a new one.
    pub fn subject(&self) -> Subject {
        (self.make)()
    }

    /// The draw, if it is one.
    pub fn draw(&self) -> Option<Draw> {
        match self.subject() {
            Subject::Draw(draw) => Some(*draw),
            Subject::Program(_) => None,
        }
    }

    /// The names of the features that it needs.
    pub fn needs(&self) -> Vec<&'static str> {
        match self.subject() {
            Subject::Draw(draw) => features::needs(&draw),
            Subject::Program(program) => program.needs(),
        }
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

    /// Adds a case that is a draw.
    pub(super) fn add(&mut self, name: impl Into<String>, make: impl Fn() -> Draw + Send + Sync + 'static) {
        self.push(name.into(), false, move || Subject::Draw(Box::new(make())));
    }

    /// Adds a case that is a large draw.
    pub(super) fn add_large(&mut self, name: impl Into<String>, make: impl Fn() -> Draw + Send + Sync + 'static) {
        self.push(name.into(), true, move || Subject::Draw(Box::new(make())));
    }

    /// Adds a case that is a program.
    pub(super) fn program(&mut self, name: impl Into<String>, make: impl Fn() -> Program + Send + Sync + 'static) {
        self.push(name.into(), false, move || Subject::Program(make()));
    }

    fn push(&mut self, name: String, is_large: bool, make: impl Fn() -> Subject + Send + Sync + 'static) {
        self.cases.push(Case { chapter: self.name, name, is_large, make: Box::new(make) });
    }
}
