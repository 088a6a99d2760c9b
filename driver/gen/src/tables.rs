//! The tables of features and properties: each once, in the first structure that holds it.

use crate::rust::MAX_WIDTH;
use std::collections::BTreeSet;
use std::fmt::Write;

/// A feature or property as a member of a structure.
pub(crate) struct Row<'a> {
    /// Its name in the registry.
    pub(crate) name: &'a str,
    /// The structure's member.
    pub(crate) member: &'a str,
    /// Its name in Rust: the member's, but for properties that another structure names otherwise.
    pub(crate) field: &'a str,
    /// The part of the row after the names.
    pub(crate) value: String,
}

/// The rows of a table by structure.
#[derive(Default)]
pub(crate) struct Table<'a> {
    /// The fields that have rows.
    seen: BTreeSet<&'a str>,
    /// Structures with their rows.
    structures: String,
    /// Structures that hold fields of other structures, with their members.
    repeated: String,
}

impl<'a> Table<'a> {
    /// Adds a structure. `heading` stands before its rows, if no structure before it holds all its members.
    pub(crate) fn add(&mut self, ty: &str, heading: &str, rows: impl Iterator<Item = Row<'a>>) {
        let (first, again): (Vec<_>, Vec<_>) = rows.partition(|row| self.seen.insert(row.field));
        if !first.is_empty() {
            let _ = writeln!(self.structures, "    {heading} {{");
            for Row { name, field, value, .. } in &first {
                self.structures.push_str(&line(name, " =>", &format!("{field}: {value}")));
            }
            self.structures.push_str("    }\n");
        }
        if !again.is_empty() {
            let _ = writeln!(self.repeated, "    repeated {} {{{}}}", path(ty), members(path(ty), &again));
        }
    }

    /// The call of the macro that makes a type of the table.
    pub(crate) fn text(&self, makes: &str) -> String {
        format!("{makes}! {{\n{}{}}}\n", self.structures, self.repeated)
    }
}

/// The path of a structure, without the lifetime.
pub(crate) fn path(ty: &str) -> &str {
    ty.trim_end_matches("<'_>")
}

/// A row, on a line of its own, or on two.
pub(crate) fn line(name: &str, operator: &str, value: &str) -> String {
    let line = format!("        {name}{operator} {value};\n");
    if line.len() <= MAX_WIDTH + 1 { line } else { format!("        {name}{operator}\n            {value};\n") }
}

/// The members of a structure that holds fields of others, behind its name or on lines of their own.
fn members(ty: &str, rows: &[Row<'_>]) -> String {
    let renamed = |row: &Row<'_>| match row.member == row.field {
        true => row.member.to_owned(),
        false => format!("{}: {}", row.member, row.field),
    };
    let members: Vec<String> = rows.iter().map(renamed).collect();
    let line = format!(" {} ", members.join(", "));
    if "    repeated  {}".len() + ty.len() + line.len() <= MAX_WIDTH {
        return line;
    }
    let mut lines = vec![String::new()];
    for member in line.trim().split_inclusive(", ") {
        let last = lines.len() - 1;
        if "        ".len() + lines[last].len() + member.trim_end().len() <= MAX_WIDTH {
            lines[last].push_str(member);
        } else {
            lines.push(member.to_owned());
        }
    }
    let lines: String = lines.iter().map(|line| format!("\n        {}", line.trim_end())).collect();
    lines + "\n    "
}
