//! Columns of a PLY file's vertices that the reader does not know.

use super::table::Table;

/// Columns that change nothing, or repeat what others say: normals, colours of points, labels.
const HARMLESS: [&str; 17] = [
    "nx",
    "ny",
    "nz",
    "red",
    "green",
    "blue",
    "alpha",
    "r",
    "g",
    "b",
    "label",
    "class",
    "semantic",
    "instance",
    "object_id",
    "id",
    "confidence",
];

/// A warning that names the columns of `element` that are neither `known` nor harmless, if there are any.
pub(super) fn warning(table: &Table<'_, '_>, element: &str, known: impl Fn(&str) -> bool) -> Option<String> {
    let names = table.element(element)?.properties.keys().map(String::as_str);
    let unknown: Vec<&str> = names.filter(|name| !known(name) && !HARMLESS.contains(name)).collect();
    if unknown.is_empty() {
        return None;
    }
    let names = ranges(&unknown).join(", ");
    Some(match unknown.len() {
        1 => format!("the column {names} is unknown and ignored, and the picture may lack what it says"),
        _ => format!("the columns {names} are unknown and ignored, and the picture may lack what they say"),
    })
}

/// Names with consecutive numbers at their ends become the first and the last one.
fn ranges(names: &[&str]) -> Vec<String> {
    fn numbered(name: &str) -> Option<(&str, u64)> {
        let stem = name.trim_end_matches(|c: char| c.is_ascii_digit());
        Some((stem, name[stem.len()..].parse().ok()?))
    }
    let mut ranges: Vec<[&str; 2]> = Vec::new();
    for name in names {
        let follows = |last: &str| match (numbered(last), numbered(name)) {
            (Some((a, i)), Some((b, j))) => a == b && i + 1 == j,
            _ => false,
        };
        match ranges.last_mut() {
            Some([_, last]) if follows(last) => *last = name,
            _ => ranges.push([name, name]),
        }
    }
    let text = |[first, last]: [&str; 2]| if first == last { first.to_owned() } else { format!("{first} to {last}") };
    ranges.into_iter().map(text).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn consecutive_names_are_ranges() {
        assert_eq!(ranges(&["t", "m_0", "m_1", "m_2", "n_0", "n_2"]), ["t", "m_0 to m_2", "n_0", "n_2"]);
        assert_eq!(ranges(&[]), Vec::<String>::new());
    }
}
