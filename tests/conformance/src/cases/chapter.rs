//! A case, and the chapter that it is written in.

use crate::draw::Draw;

/// A case: a draw with a name.
pub struct Case {
    /// The chapter, a word.
    pub chapter: &'static str,
    /// The name within the chapter: words and their values, with full stops between.
    pub name: String,
    make: Box<dyn Fn() -> Draw + Send + Sync>,
}

impl Case {
    /// Chapter and name.
    pub fn path(&self) -> String {
        format!("{}.{}", self.chapter, self.name)
    }

    /// The draw, which is made anew each time.
    pub fn draw(&self) -> Draw {
        (self.make)()
    }
}

/// A chapter that is being written.
pub(super) struct Chapter<'a> {
    name: &'static str,
    cases: &'a mut Vec<Case>,
}

impl<'a> Chapter<'a> {
    /// A chapter whose cases go behind others.
    pub(super) fn new(name: &'static str, cases: &'a mut Vec<Case>) -> Self {
        Self { name, cases }
    }

    /// Adds a case.
    pub(super) fn add(
        &mut self,
        name: impl Into<String>,
        make: impl Fn() -> Draw + Send + Sync + 'static,
    ) {
        self.cases.push(Case {
            chapter: self.name,
            name: name.into(),
            make: Box::new(make),
        });
    }
}
