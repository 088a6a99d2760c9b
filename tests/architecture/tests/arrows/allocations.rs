//! Checks that what packets add to the device is allocated by functions that can fail.
//!
//! An application decides how often a public method of the device is called. A method that adds to a vector of its own object on each
//! call must therefore do so by `devmem::host`, so that a failure is reported and does not abort the process. The sizes that
//! a single call works with are checked by tests of failing allocations.

use std::path::{Path, PathBuf};

use syn::visit::{self, Visit};
use syn::{Expr, ExprCall, ExprMethodCall, ImplItem, ImplItemFn, ItemImpl, Visibility};

use crate::workspace;

/// The methods by which a vector grows.
const GROWING: &[&str] = &["push", "extend", "extend_from_slice", "append", "resize", "resize_with"];

/// Methods that add to a vector of a fixed greatest length, each with the type of the index that limits it.
const BOUNDED: &[(&str, &str)] =
    &[("raster/triangle/batch.rs: add_primitive", "u16"), ("raster/triangle/whole_tile.rs: add", "u8")];

/// A visitor that collects the public methods that grow vectors of `self`.
#[derive(Default)]
struct Methods {
    found: Vec<String>,
}

impl<'ast> Visit<'ast> for Methods {
    fn visit_item_impl(&mut self, item: &'ast ItemImpl) {
        for item in &item.items {
            if let ImplItem::Fn(method) = item
                && matches!(method.vis, Visibility::Public(_))
                && grows_its_own(method)
            {
                self.found.push(method.sig.ident.to_string());
            }
        }
    }
}

/// A visitor of a method's calls.
#[derive(Default)]
struct Calls {
    grows: bool,
    reserves: bool,
}

impl<'ast> Visit<'ast> for Calls {
    fn visit_expr_method_call(&mut self, call: &'ast ExprMethodCall) {
        let name = call.method.to_string();
        self.grows |= GROWING.contains(&name.as_str()) && is_field_of_self(&call.receiver);
        visit::visit_expr_method_call(self, call);
    }

    fn visit_expr_call(&mut self, call: &'ast ExprCall) {
        if let Expr::Path(function) = &*call.func {
            let names: Vec<String> = function.path.segments.iter().map(|part| part.ident.to_string()).collect();
            self.reserves |= names.ends_with(&["host".to_owned(), "reserve".to_owned()]);
        }
        visit::visit_expr_call(self, call);
    }
}

/// Returns true if an expression is a field of `self`, or of one of its fields.
fn is_field_of_self(expression: &Expr) -> bool {
    match expression {
        Expr::Field(field) => {
            matches!(&*field.base, Expr::Path(path) if path.path.is_ident("self")) || is_field_of_self(&field.base)
        }
        _ => false,
    }
}

/// Returns true if a method grows a vector of `self` without `devmem::host`.
fn grows_its_own(method: &ImplItemFn) -> bool {
    let mut calls = Calls::default();
    calls.visit_block(&method.block);
    calls.grows && !calls.reserves
}

/// The public methods of a source text that grow vectors of `self` without `devmem::host`.
fn offenders(text: &str) -> Vec<String> {
    let mut methods = Methods::default();
    methods.visit_file(&syn::parse_file(text).expect("Rust"));
    methods.found
}

fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
}

#[gaurast_runner::test]
fn what_packets_add_can_fail() {
    let folder = workspace::root().join("simdevice/src");
    let mut files = Vec::new();
    sources(&folder, &mut files);
    assert!(files.len() > 100, "{}", files.len());
    let mut found = Vec::new();
    for file in files {
        let text = std::fs::read_to_string(&file).expect("a source file");
        let path = file.strip_prefix(&folder).expect("a file of the folder").display();
        found.extend(offenders(&text).into_iter().map(|method| format!("{path}: {method}")));
    }
    let (bounded, found): (Vec<String>, Vec<String>) =
        found.into_iter().partition(|method| BOUNDED.iter().any(|(name, _)| method == name));
    assert_eq!(bounded.len(), BOUNDED.len(), "methods that are gone leave the list");
    assert!(found.is_empty(), "use devmem::host in {found:#?}");
}

#[gaurast_runner::test]
fn additions_that_abort_are_found() {
    let method =
        |visibility: &str, body: &str| offenders(&format!("impl A {{ {visibility} fn f(&mut self) {{ {body} }} }}"));
    assert_eq!(method("pub", "self.draws.push(1);"), ["f"]);
    assert_eq!(method("pub", "if a { self.inner.draws.extend(more) }"), ["f"]);
    assert!(method("pub", "host::push(&mut self.draws, 1);").is_empty());
    assert!(method("pub", "host::reserve(&mut self.draws, 2); self.draws.extend(more);").is_empty());
    assert!(method("pub", "let mut own = Vec::new(); own.push(1);").is_empty());
    assert!(method("pub(crate)", "self.batch.push(1);").is_empty());
}
