//! Tables of `docs/simulator.md`, which tests make.

use std::path::{Path, PathBuf};

/// A table of the page: what is before it, itself, and what is after it. It lies between two lines that name it.
struct Stored {
    path: PathBuf,
    before: String,
    table: String,
    after: String,
}

impl Stored {
    fn of(name: &str) -> Self {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/simulator.md");
        let page = std::fs::read_to_string(&path).expect("the page");
        let begin = format!("<!-- The table of {name}; GAURAST_BLESS=1 writes it. -->\n");
        let end = format!("<!-- The end of the table of {name}. -->\n");
        let (before, rest) = page.split_once(&begin).expect("the table's beginning");
        let (table, after) = rest.split_once(&end).expect("the table's end");
        Self { path, before: format!("{before}{begin}"), table: table.to_owned(), after: format!("{end}{after}") }
    }
}

/// Compares a table with that of the page. With `GAURAST_BLESS` set, it is written instead.
pub fn hold_table(name: &str, table: &str) {
    let Stored { path, before, table: stored, after } = Stored::of(name);
    if std::env::var_os("GAURAST_BLESS").is_some() {
        std::fs::write(path, format!("{before}{table}{after}")).expect("the page is written");
        return;
    }
    let first = table.lines().zip(stored.lines()).find(|(now, then)| now != then);
    assert!(table == stored, "GAURAST_BLESS=1 writes the table anew; first difference: {first:#?}");
}

/// Compares some rows of a table with those of the page.
pub fn hold_rows(name: &str, rows: &str) {
    let stored = Stored::of(name).table;
    for row in rows.lines() {
        assert!(stored.lines().any(|line| line == row), "the table of {name} lacks this row:\n{row}");
    }
}
