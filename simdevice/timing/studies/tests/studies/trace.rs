//! Tests that the format of traces is documented field by field.

use serde_json::Value;
use std::collections::BTreeSet;
use timing::Trace;
use timing::work::{DrawWork, FrameWork, Run, TRACE_VERSION, TileWork};

/// All names of fields within a value.
fn names(value: &Value, found: &mut BTreeSet<String>) {
    match value {
        Value::Object(fields) => {
            for (name, value) in fields {
                found.insert(name.clone());
                names(value, found);
            }
        }
        Value::Array(values) => values.iter().for_each(|value| names(value, found)),
        _ => (),
    }
}

#[gaurast_runner::test]
fn every_field_of_a_trace_is_documented() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../docs/simulator.md");
    let text = std::fs::read_to_string(path).expect("the document");
    let (_, chapter) = text.split_once("\n## Traces\n").expect("a chapter of traces");
    let (chapter, _) = chapter.split_once("\n## ").expect("a chapter after it");
    let tile = TileWork { runs: vec![Run::default()], ..TileWork::default() };
    let draw = DrawWork { tiles: vec![tile], ..DrawWork::default() };
    let frame = FrameWork { draws: vec![draw], ..FrameWork::default() };
    let trace = Trace { version: TRACE_VERSION, frames: vec![frame] };
    let mut found = BTreeSet::new();
    names(&serde_json::to_value(trace).expect("JSON"), &mut found);
    assert!(found.len() > 30, "{found:?}");
    for name in found {
        assert!(chapter.contains(&format!("`{name}`")), "{name}");
    }
    assert!(chapter.contains(&format!("| `version` | {TRACE_VERSION} |")));
}
