//! Imports between modules as a graph of arrows, and its cycles.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

/// An import among the children of one module.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Arrow {
    /// The path of the parent module of both children.
    pub parent: Vec<String>,
    /// The child that imports; `mod` means the parent's own file.
    pub from: String,
    /// The child that is imported.
    pub to: String,
}

impl fmt::Display for Arrow {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:: {} -> {}", self.parent.join("::"), self.from, self.to)
    }
}

/// The arrow of an import from module `from` of module `to`, between two children of their last common ancestor.
pub fn arrow(from: &[String], to: &[String]) -> Option<Arrow> {
    let common = from.iter().zip(to).take_while(|(a, b)| a == b).count();
    if common == from.len() && common == to.len() {
        return None;
    }
    let child = |path: &[String]| path.get(common).map_or("mod", String::as_str).to_owned();
    Some(Arrow { parent: from[..common].to_vec(), from: child(from), to: child(to) })
}

/// The arrows that are part of a cycle.
pub fn arrows_in_cycles(arrows: &BTreeSet<Arrow>) -> BTreeSet<Arrow> {
    let mut next: BTreeMap<(&[String], &str), BTreeSet<&str>> = BTreeMap::new();
    for arrow in arrows {
        next.entry((&arrow.parent, &arrow.from)).or_default().insert(&arrow.to);
    }
    let reaches = |arrow: &Arrow| {
        let (mut seen, mut open) = (BTreeSet::new(), vec![arrow.to.as_str()]);
        while let Some(node) = open.pop() {
            if node == arrow.from {
                return true;
            }
            if seen.insert(node) {
                open.extend(next.get(&(arrow.parent.as_slice(), node)).into_iter().flatten());
            }
        }
        false
    };
    arrows.iter().filter(|arrow| reaches(arrow)).cloned().collect()
}

#[gaurast_runner::test]
fn cycles_are_found_among_children() {
    let path = |text: &str| text.split("::").map(str::to_owned).collect::<Vec<_>>();
    let arrow = |from: &str, to: &str| arrow(&path(from), &path(to)).expect("an arrow");
    let arrows = BTreeSet::from([
        arrow("c::a::x", "c::b"),
        arrow("c::b", "c::a::y"),
        arrow("c::a", "c::d"),
        arrow("c::a::x", "c::a"),
        arrow("c::a", "c::a::y"),
    ]);
    let found: Vec<String> = arrows_in_cycles(&arrows).iter().map(Arrow::to_string).collect();
    assert_eq!(found, ["c:: a -> b", "c:: b -> a"]);
}
