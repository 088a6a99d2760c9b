//! The page of mistakes, `docs/mistakes.md`.

use std::path::Path;

use gaurast_testkit::Message;

use crate::before::BEFORE;

/// A row: chapter, mistake, and what the driver and the layer say.
type Row = (&'static str, &'static str, Option<Message>, Message);

const HEAD: &str = "# Mistakes\n\n\
    What this driver and the layer [`VK_LAYER_GAURAST_validation`](layer.md) say of mistakes. The layer's ids that begin with\n\
    `GAURAST` are of what is valid and surely not meant; so is most of what the driver says nothing of. Each row is made by\n\
    `tests/layer`, which compares the page; `GAURAST_BLESS=1` has it written. The driver is strict here (`GAURAST_STRICT=1`): otherwise\n\
    what is not enabled is a warning ([refusals.md](refusals.md)).\n";

fn cell(text: &str) -> String {
    text.replace('|', "\\|").replace('\n', " ")
}

fn page(rows: &[Row]) -> String {
    let mut page = HEAD.to_owned();
    let mut current = "";
    for (chapter, name, driver, layer) in rows {
        if *chapter != current {
            current = chapter;
            page += &format!("\n## {chapter}\n\n| mistake | the driver says | the layer says |\n|---|---|---|\n");
        }
        let driver = driver.as_ref().map_or("nothing".to_owned(), |message| cell(&message.text));
        page += &format!("| {} | {driver} | `{}`: {} |\n", cell(name), layer.id, cell(&layer.text));
    }
    page + &before(rows)
}

const BEFORE_HEAD: &str = "\n## Before and after\n\n\
    These were tried with revision 1 of the extension, when there was no layer. Of most of them the driver said nothing, or what\n\
    did not help; what it and the layer say now is above.\n\n\
    | mistake | the driver said | the driver now | the layer |\n|---|---|---|---|\n";

/// The section of what was said of mistakes with revision 1.
fn before(rows: &[Row]) -> String {
    let mut section = BEFORE_HEAD.to_owned();
    for (name, said) in BEFORE {
        let row = rows.iter().find(|(_, mistake, ..)| mistake == name);
        let (.., driver, layer) = row.unwrap_or_else(|| panic!("{name} is no mistake"));
        let now = if driver.is_some() { "says it" } else { "nothing" };
        section += &format!("| {} | {said} | {now} | `{}` |\n", cell(name), layer.id);
    }
    section
}

/// Compares the page with what was said. With `GAURAST_BLESS` set, writes it instead.
pub fn check(rows: &[Row]) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/mistakes.md");
    let page = page(rows);
    if std::env::var_os("GAURAST_BLESS").is_some() {
        std::fs::write(path, page).expect("the page is written");
        return;
    }
    let stored = std::fs::read_to_string(path).expect("docs/mistakes.md");
    let mut lines = page.lines().zip(stored.lines()).filter(|(now, then)| now != then);
    let first = lines.next();
    assert!(page == stored, "GAURAST_BLESS=1 writes docs/mistakes.md anew; first difference: {first:#?}");
}
