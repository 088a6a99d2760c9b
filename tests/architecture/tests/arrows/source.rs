//! A crate's modules, read from its sources: what each defines, imports and names.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use proc_macro2::{TokenStream, TokenTree};
use syn::visit::{self, Visit};
use syn::{Attribute, Item, Meta, UseTree};

use crate::graph::{self, Arrow};

/// A path as the source has it, by its segments.
type Segments = Vec<String>;

/// An import.
#[derive(Debug)]
struct Import {
    path: Segments,
    /// The name that it is known by here; none for all names.
    name: Option<String>,
}

/// A module.
#[derive(Debug, Default)]
struct Module {
    /// Its path, the crate's name first.
    path: Segments,
    /// The names of its items, but for modules.
    items: BTreeSet<String>,
    imports: Vec<Import>,
    /// The paths that its code names.
    paths: BTreeSet<Segments>,
    /// The types that it has an `impl` of, and the trait if it is one of a trait.
    impls: Vec<(Segments, Option<Segments>)>,
}

/// A crate's modules by their paths.
#[derive(Debug)]
pub struct Crate {
    modules: BTreeMap<Segments, Module>,
}

impl Crate {
    /// Reads a crate from its root's file.
    pub fn read(name: &str, root: &Path) -> Self {
        let mut found = Self {
            modules: BTreeMap::new(),
        };
        let folder = root.parent().expect("a folder");
        found.read_file(vec![name.to_owned()], root, folder);
        found
    }

    /// Reads a module's file, whose children's files lie in `folder`.
    fn read_file(&mut self, path: Segments, file: &Path, folder: &Path) {
        let text = std::fs::read_to_string(file)
            .unwrap_or_else(|error| panic!("{}: {error}", file.display()));
        let parsed =
            syn::parse_file(&text).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
        self.read_items(path, &parsed.items, folder);
    }

    fn read_items(&mut self, path: Segments, items: &[Item], folder: &Path) {
        let mut module = Module {
            path: path.clone(),
            ..Module::default()
        };
        let mut collector = Collector {
            module: &mut module,
        };
        let mut children = Vec::new();
        for item in items.iter().filter(|item| !is_test(attributes(item))) {
            match item {
                Item::Mod(child) => children.push(child),
                other => collector.visit_item(other),
            }
        }
        self.modules.insert(path.clone(), module);
        for child in children {
            let name = child.ident.to_string();
            let child_path = [path.clone(), vec![name.clone()]].concat();
            let child_folder = folder.join(&name);
            if let Some((_, items)) = &child.content {
                self.read_items(child_path, items, &child_folder);
                continue;
            }
            let file = [
                folder.join(format!("{name}.rs")),
                child_folder.join("mod.rs"),
            ]
            .into_iter()
            .find(|file: &PathBuf| file.exists())
            .unwrap_or_else(|| panic!("no file of {}", child_path.join("::")));
            self.read_file(child_path, &file, &child_folder);
        }
    }

    /// All arrows between its modules.
    pub fn arrows(&self) -> BTreeSet<Arrow> {
        let mut arrows = BTreeSet::new();
        for module in self.modules.values() {
            let imports = module.imports.iter().map(|import| &import.path);
            for path in module.paths.iter().chain(imports) {
                let definition = self.definition(module, path);
                arrows.extend(definition.and_then(|to| graph::arrow(&module.path, &to)));
            }
            for (of, by) in &module.impls {
                let by = by.as_ref().and_then(|path| self.definition(module, path));
                let Some(of) = self.definition(module, of) else {
                    continue;
                };
                // A trait's own module may say what it is for every type.
                if by.as_ref() != Some(&module.path) {
                    arrows.extend(graph::arrow(&of, &module.path));
                }
            }
        }
        arrows
    }

    /// The module that defines what `path` names in `module`, if it is one of this crate.
    fn definition(&self, module: &Module, path: &[String]) -> Option<Segments> {
        let absolute = self.absolute(module, path, 0)?;
        self.follow(&absolute, 0)
    }

    /// `path` from the crate's root, if it leads there.
    fn absolute(&self, module: &Module, path: &[String], depth: usize) -> Option<Segments> {
        let (first, rest) = path.split_first()?;
        let root = &module.path[..1];
        match first.as_str() {
            "crate" => return Some([root, rest].concat()),
            "self" => return Some([&module.path, rest].concat()),
            "super" => {
                let mut of = &module.path[..module.path.len().checked_sub(1)?];
                let mut rest = rest;
                while let [first, others @ ..] = rest {
                    if first != "super" {
                        break;
                    }
                    (of, rest) = (&of[..of.len().checked_sub(1)?], others);
                }
                return Some([of, rest].concat());
            }
            _ => {}
        }
        let child = [module.path.clone(), vec![first.clone()]].concat();
        if module.items.contains(first) || self.modules.contains_key(&child) {
            return Some([&module.path, path].concat());
        }
        // Imports of imports end, since no sources import in circles.
        if depth > 8 {
            return None;
        }
        let named = module.imports.iter();
        if let Some(import) = named
            .clone()
            .find(|import| import.name.as_ref() == Some(first))
        {
            if import.path == path[..1] {
                return None;
            }
            let to = self.absolute(module, &import.path, depth + 1)?;
            return Some([to.as_slice(), rest].concat());
        }
        named
            .filter(|import| import.name.is_none())
            .filter_map(|import| {
                let of = self.absolute(module, &import.path, depth + 1)?;
                let of = self.modules.get(&of)?;
                self.has(of, first).then(|| [&of.path, path].concat())
            })
            .next()
    }

    /// Reports whether a name is known in a module.
    fn has(&self, module: &Module, name: &String) -> bool {
        let child = [module.path.clone(), vec![name.clone()]].concat();
        module.items.contains(name)
            || self.modules.contains_key(&child)
            || module
                .imports
                .iter()
                .any(|import| import.name.as_ref() == Some(name))
    }

    /// The module that defines what an absolute path names, through modules that export it again.
    fn follow(&self, path: &[String], depth: usize) -> Option<Segments> {
        let mut length = 1;
        while length < path.len() && self.modules.contains_key(&path[..=length]) {
            length += 1;
        }
        let module = self.modules.get(&path[..length])?;
        let Some(name) = path.get(length) else {
            return Some(module.path.clone());
        };
        if module.items.contains(name) || depth > 8 {
            return Some(module.path.clone());
        }
        match self.absolute(module, &path[length..], 0) {
            Some(further) if further != path => self.follow(&further, depth + 1),
            // What another crate defines, or a macro.
            _ if module
                .imports
                .iter()
                .any(|import| import.name.as_ref() == Some(name)) =>
            {
                None
            }
            _ => Some(module.path.clone()),
        }
    }
}

/// Collects what a module's items define and name.
struct Collector<'a> {
    module: &'a mut Module,
}

impl Collector<'_> {
    fn import(&mut self, mut path: Segments, tree: &UseTree) {
        match tree {
            UseTree::Path(tree) => {
                path.push(tree.ident.to_string());
                self.import(path, &tree.tree);
            }
            UseTree::Name(tree) => {
                let name = tree.ident.to_string();
                // `a::{self}` is `a`.
                let name = if name == "self" {
                    path.last().cloned().unwrap_or_default()
                } else {
                    path.push(name.clone());
                    name
                };
                self.module.imports.push(Import {
                    path,
                    name: Some(name),
                });
            }
            UseTree::Rename(tree) => {
                if tree.ident != "self" {
                    path.push(tree.ident.to_string());
                }
                self.module.imports.push(Import {
                    path,
                    name: Some(tree.rename.to_string()),
                });
            }
            UseTree::Glob(_) => self.module.imports.push(Import { path, name: None }),
            UseTree::Group(group) => {
                for tree in &group.items {
                    self.import(path.clone(), tree);
                }
            }
        }
    }

    /// Collects the paths in a macro's tokens.
    fn tokens(&mut self, tokens: TokenStream) {
        let mut path: Segments = Vec::new();
        let mut colons = 0;
        for token in tokens {
            match token {
                TokenTree::Ident(name) => {
                    if colons != 2 {
                        self.path(std::mem::take(&mut path));
                    }
                    path.push(name.to_string());
                    colons = 0;
                }
                TokenTree::Punct(mark) if mark.as_char() == ':' && !path.is_empty() => colons += 1,
                other => {
                    self.path(std::mem::take(&mut path));
                    colons = 0;
                    if let TokenTree::Group(group) = other {
                        self.tokens(group.stream());
                    }
                }
            }
        }
        self.path(path);
    }

    fn path(&mut self, path: Segments) {
        if !path.is_empty() {
            self.module.paths.insert(path);
        }
    }

    fn define(&mut self, name: &syn::Ident) {
        self.module.items.insert(name.to_string());
    }
}

impl<'ast> Visit<'ast> for Collector<'_> {
    fn visit_item(&mut self, item: &'ast Item) {
        if is_test(attributes(item)) {
            return;
        }
        match item {
            Item::Const(item) => self.define(&item.ident),
            Item::Enum(item) => self.define(&item.ident),
            Item::Fn(item) => self.define(&item.sig.ident),
            Item::Static(item) => self.define(&item.ident),
            Item::Struct(item) => self.define(&item.ident),
            Item::Trait(item) => self.define(&item.ident),
            Item::Type(item) => self.define(&item.ident),
            Item::Union(item) => self.define(&item.ident),
            Item::Macro(item) => {
                if let Some(name) = &item.ident {
                    self.define(name);
                }
            }
            Item::Use(item) => {
                self.import(Vec::new(), &item.tree);
                return;
            }
            _ => {}
        }
        visit::visit_item(self, item);
    }

    fn visit_item_impl(&mut self, item: &'ast syn::ItemImpl) {
        if let syn::Type::Path(of) = &*item.self_ty {
            let by = item.trait_.as_ref().map(|(_, path, _)| segments(path));
            self.module.impls.push((segments(&of.path), by));
        }
        visit::visit_item_impl(self, item);
    }

    fn visit_impl_item_fn(&mut self, item: &'ast syn::ImplItemFn) {
        if !is_test(&item.attrs) {
            visit::visit_impl_item_fn(self, item);
        }
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        self.path(segments(path));
        visit::visit_path(self, path);
    }

    fn visit_macro(&mut self, call: &'ast syn::Macro) {
        self.path(segments(&call.path));
        self.tokens(call.tokens.clone());
    }

    // `pub(crate)` says who may come here, not who is gone to.
    fn visit_visibility(&mut self, _: &'ast syn::Visibility) {}

    // Attributes name no modules.
    fn visit_attribute(&mut self, _: &'ast Attribute) {}
}

fn segments(path: &syn::Path) -> Segments {
    path.segments
        .iter()
        .map(|segment| segment.ident.to_string())
        .collect()
}

fn attributes(item: &Item) -> &[Attribute] {
    match item {
        Item::Const(item) => &item.attrs,
        Item::Enum(item) => &item.attrs,
        Item::Fn(item) => &item.attrs,
        Item::Impl(item) => &item.attrs,
        Item::Macro(item) => &item.attrs,
        Item::Mod(item) => &item.attrs,
        Item::Static(item) => &item.attrs,
        Item::Struct(item) => &item.attrs,
        Item::Trait(item) => &item.attrs,
        Item::Type(item) => &item.attrs,
        Item::Use(item) => &item.attrs,
        _ => &[],
    }
}

/// Reports whether an item is there for tests only.
fn is_test(attributes: &[Attribute]) -> bool {
    attributes.iter().any(|attribute| match &attribute.meta {
        Meta::List(list) if list.path.is_ident("cfg") => {
            let condition = list.tokens.to_string();
            condition == "test" || condition.starts_with("all (test")
        }
        Meta::Path(path) => path.is_ident("test"),
        _ => false,
    })
}
