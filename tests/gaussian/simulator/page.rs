//! Tables of `docs/simulator.md`, which tests make.

use std::path::Path;

/// Compares a table with that of the page, which lies between two lines that name it. With `GAURAST_BLESS` set, it is
/// written instead.
pub fn hold_table(name: &str, table: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/simulator.md");
    let page = std::fs::read_to_string(&path).expect("the page");
    let begin = format!("<!-- The table of {name}; GAURAST_BLESS=1 writes it. -->\n");
    let end = format!("<!-- The end of the table of {name}. -->\n");
    let (before, rest) = page.split_once(&begin).expect("the table's beginning");
    let (stored, after) = rest.split_once(&end).expect("the table's end");
    if std::env::var_os("GAURAST_BLESS").is_some() {
        std::fs::write(path, format!("{before}{begin}{table}{end}{after}")).expect("the page is written");
        return;
    }
    let first = table.lines().zip(stored.lines()).find(|(now, then)| now != then);
    assert!(table == stored, "GAURAST_BLESS=1 writes the table anew; first difference: {first:#?}");
}
