//! The cases, chapter by chapter, each made from a table.

mod attachments;
mod input;
mod modes;
mod numerics;
mod scenes;

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
struct Chapter<'a> {
    name: &'static str,
    cases: &'a mut Vec<Case>,
}

impl Chapter<'_> {
    fn add(&mut self, name: impl Into<String>, make: impl Fn() -> Draw + Send + Sync + 'static) {
        self.cases.push(Case {
            chapter: self.name,
            name: name.into(),
            make: Box::new(make),
        });
    }
}

type Write = fn(&mut Chapter<'_>);

/// The chapters in their order.
const CHAPTERS: [(&str, Write); 15] = [
    ("topology", input::topology),
    ("attributes", input::attributes),
    ("instances", input::instances),
    ("camera", modes::camera),
    ("order", modes::order),
    ("surfel", modes::surfel),
    ("unscented", modes::unscented),
    ("state", modes::state),
    ("harmonics", modes::harmonics),
    ("binary16", modes::binary16),
    ("approximation", modes::approximation),
    ("depth", attachments::depth),
    ("stencil", attachments::stencil),
    ("interactions", attachments::interactions),
    ("numerics", numerics::numerics),
];

/// Names of the chapters.
pub fn chapters() -> impl Iterator<Item = &'static str> {
    CHAPTERS.iter().map(|(name, _)| *name)
}

/// All cases, in the order of the chapters.
pub fn all() -> Vec<Case> {
    let mut cases = Vec::new();
    for (name, write) in CHAPTERS {
        write(&mut Chapter {
            name,
            cases: &mut cases,
        });
    }
    cases
}

/// Reports whether a path fits a pattern, in which `*` stands for anything; a pattern without one need only be contained.
pub fn fits(path: &str, pattern: &str) -> bool {
    let Some((first, rest)) = pattern.split_once('*') else {
        return path.contains(pattern);
    };
    let Some(mut path) = path.strip_prefix(first) else {
        return false;
    };
    let mut parts: Vec<&str> = rest.split('*').collect();
    let last = parts.pop().unwrap_or_default();
    for part in parts {
        match path.find(part) {
            Some(at) => path = &path[at + part.len()..],
            None => return false,
        }
    }
    path.ends_with(last)
}
