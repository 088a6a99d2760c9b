//! The composition of a stage: sublayers, inherits, variants, references, payloads and specializes, in the order of strength
//! that OpenUSD calls LIVRPS. Opinions on values by time are not told apart by layers.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::rc::Rc;

use super::layer::{ArcKind, Layer, MAX_DEPTH, Prim, Specifier, Target, Value};
use crate::error::{Fault, Place, Reason};

/// The most prims that a stage has more than its layers have.
const MAX_COPIES: usize = 1 << 16;

/// A composed stage.
pub(super) struct Stage {
    /// All prims in one layer, with the fields of the root layer.
    pub(super) layer: Layer,
    /// Layers and prims that could not be composed, a sentence each.
    pub(super) problems: BTreeSet<String>,
}

/// A layer and the name of its file, to which names of files in it are relative. A layer in an archive is named as in
/// `archive.usdz[layer.usdc]`.
pub(super) struct NamedLayer {
    pub(super) name: String,
    pub(super) layer: Layer,
}

/// Opens the layer of a file.
type Open<'a> = dyn Fn(&str) -> Result<NamedLayer, Fault> + 'a;

/// Composes the stage of the layer `root`. Other layers are opened by `open`.
pub(super) fn compose(root: NamedLayer, open: &Open<'_>) -> Result<Stage, Fault> {
    let mut composer = Composer { open, sources: BTreeMap::new(), problems: BTreeSet::new(), loaded: 0, composed: 0 };
    let name = root.name.clone();
    let source = composer.stack(root);
    composer.sources.insert(name, Some(Rc::clone(&source)));
    let mut layer = Layer { fields: source.layer.fields.clone(), prims: Vec::new() };
    for index in source.children(None) {
        let choices = Choices::of(&source, index);
        let node = composer.node(&source, index, &choices, 0)?;
        node.flatten(None, &mut layer);
    }
    Ok(Stage { layer, problems: composer.problems })
}

/// A layer with its sublayers merged into it.
struct Source {
    layer: Layer,
    /// The indices of the prims below each prim, variants among them; last those of the roots.
    below: Vec<Vec<usize>>,
    paths: HashMap<String, usize>,
}

impl Source {
    fn new(layer: Layer) -> Self {
        let count = layer.prims.len();
        let mut below = vec![Vec::new(); count + 1];
        let mut paths = HashMap::new();
        for (index, prim) in layer.prims.iter().enumerate() {
            below[prim.parent.unwrap_or(count)].push(index);
            paths.entry(prim.path.clone()).or_insert(index);
        }
        Self { layer, below, paths }
    }

    /// The prims and variants below a prim, or the roots.
    fn below(&self, prim: Option<usize>) -> &[usize] {
        &self.below[prim.unwrap_or(self.layer.prims.len())]
    }

    /// The prims below a prim, or the roots.
    fn children(&self, prim: Option<usize>) -> impl Iterator<Item = usize> {
        let is_prim = |index: &usize| self.layer.prims[*index].variant.is_none();
        self.below(prim).iter().copied().filter(is_prim)
    }
}

/// The variants that are chosen for a prim and those below it, by layers that are stronger than the one with the variants.
#[derive(Clone, Default)]
struct Choices {
    selections: BTreeMap<String, String>,
    children: BTreeMap<String, Choices>,
}

impl Choices {
    /// The choices that a layer states.
    fn of(source: &Source, index: usize) -> Self {
        let prim = &source.layer.prims[index];
        let children = source.children(Some(index)).map(|child| {
            let name = source.layer.prims[child].name().to_owned();
            (name, Self::of(source, child))
        });
        let children = children.filter(|(_, choices)| !choices.is_empty()).collect();
        Self { selections: prim.selections.clone(), children }
    }

    fn is_empty(&self) -> bool {
        self.selections.is_empty() && self.children.is_empty()
    }

    /// These choices, and those of `weaker` where there are none.
    fn over(&self, mut weaker: Self) -> Self {
        weaker.selections.extend(self.selections.clone());
        for (name, choices) in &self.children {
            let below = weaker.children.remove(name).unwrap_or_default();
            weaker.children.insert(name.clone(), choices.over(below));
        }
        weaker
    }
}

/// A composed prim and those below it.
struct Node {
    prim: Prim,
    children: Vec<Node>,
    by_name: HashMap<String, usize>,
}

impl Node {
    fn new(prim: Prim) -> Self {
        Self { prim, children: Vec::new(), by_name: HashMap::new() }
    }

    /// Adds a prim below this one, which is weaker than one of its name.
    fn add(&mut self, name: String, child: Self) {
        if let Some(index) = self.by_name.get(&name) {
            self.children[*index].merge(child);
        } else {
            self.by_name.insert(name, self.children.len());
            self.children.push(child);
        }
    }

    /// Takes from `weaker` what this prim does not state.
    fn merge(&mut self, weaker: Self) {
        merge(&mut self.prim, weaker.prim);
        let mut names: Vec<(String, usize)> = weaker.by_name.into_iter().collect();
        names.sort_unstable_by_key(|(_, index)| *index);
        for ((name, _), child) in names.into_iter().zip(weaker.children) {
            self.add(name, child);
        }
    }

    /// Adds this prim and those below it to `layer`.
    fn flatten(self, parent: Option<usize>, layer: &mut Layer) {
        let path = parent.map_or("", |parent| layer.prims[parent].path.as_str());
        let path = format!("{path}/{}", self.prim.name());
        let index = layer.prims.len();
        layer.prims.push(Prim { parent, path, ..self.prim });
        for child in self.children {
            child.flatten(Some(index), layer);
        }
    }
}

/// Takes from `weaker` what `prim` does not state.
fn merge(prim: &mut Prim, weaker: Prim) {
    if prim.kind.is_empty() {
        prim.kind = weaker.kind;
    }
    if prim.specifier == Specifier::Over {
        prim.specifier = weaker.specifier;
    }
    prim.is_active = prim.is_active.or(weaker.is_active);
    prim.schemas.extend(weaker.schemas);
    for (name, value) in weaker.attributes {
        prim.attributes.entry(name).or_insert(value);
    }
    prim.is_animated |= weaker.is_animated;
}

struct Composer<'a> {
    open: &'a Open<'a>,
    /// Layers by the names of their files; None of one that can't be read.
    sources: BTreeMap<String, Option<Rc<Source>>>,
    problems: BTreeSet<String>,
    /// The number of prims in all layers.
    loaded: usize,
    composed: usize,
}

impl Composer<'_> {
    /// The layer with its sublayers.
    fn stack(&mut self, named: NamedLayer) -> Rc<Source> {
        let mut above = vec![named.name.clone()];
        let layer = self.merged(named, &mut above);
        self.loaded += layer.prims.len();
        Rc::new(Source::new(layer))
    }

    /// The layer with its sublayers merged into it. `above` are the layers of which it is a sublayer, and itself.
    fn merged(&mut self, NamedLayer { name, mut layer }: NamedLayer, above: &mut Vec<String>) -> Layer {
        let targets = layer.prims.iter_mut().flat_map(|prim| prim.arcs.values_mut()).flatten();
        for target in targets.filter(|target| !target.asset.is_empty()) {
            target.asset = anchored(&name, &target.asset);
        }
        let sublayers: Vec<String> = match layer.fields.get("subLayers") {
            Some(Value::Targets(targets)) => targets.iter().map(|target| target.asset.clone()).collect(),
            Some(Value::Texts(texts)) => texts.clone(),
            _ => Vec::new(),
        };
        for sublayer in sublayers {
            let file = anchored(&name, &sublayer);
            if above.contains(&file) {
                self.problems.insert(format!("sublayer {file} is not composed, since it is above itself"));
                continue;
            }
            match (self.open)(&file) {
                Ok(weaker) => {
                    above.push(file);
                    let weaker = self.merged(weaker, above);
                    above.pop();
                    merge_layers(&mut layer, weaker);
                }
                Err(fault) => {
                    self.problems.insert(format!("sublayer {file} is not composed: {}", reason(&fault)));
                }
            }
        }
        layer
    }

    /// The prim with index `index` of `source`, with all that is composed into it.
    fn node(&mut self, source: &Rc<Source>, index: usize, choices: &Choices, depth: usize) -> Result<Node, Fault> {
        let prim = &source.layer.prims[index];
        self.composed += 1;
        if depth > MAX_DEPTH || self.composed > self.loaded + MAX_COPIES {
            let text = "it is composed of too many prims, or of itself";
            return Err(Reason::Unsupported(text.to_owned()).at(Place::Part(format!("prim {}", prim.path))));
        }
        let mut node = Node::new(prim.clone());
        let none = Choices::default();
        for child in source.children(Some(index)) {
            let name = source.layer.prims[child].name().to_owned();
            let below = choices.children.get(&name).unwrap_or(&none);
            let child = self.node(source, child, below, depth + 1)?;
            node.add(name, child);
        }
        self.compose(&mut node, ArcKind::Inherit, source, choices, depth)?;
        for variant in source.below(Some(index)) {
            let Some(of) = &source.layer.prims[*variant].variant else { continue };
            if choices.selections.get(&of.set) == Some(&of.name) {
                let below = choices.over(Choices::of(source, *variant));
                node.merge(self.node(source, *variant, &below, depth + 1)?);
            }
        }
        for kind in [ArcKind::Reference, ArcKind::Payload, ArcKind::Specialize] {
            self.compose(&mut node, kind, source, choices, depth)?;
        }
        Ok(node)
    }

    /// Composes the prims that `node`, which is of `source`, names in this way into it.
    fn compose(
        &mut self,
        node: &mut Node,
        kind: ArcKind,
        source: &Rc<Source>,
        choices: &Choices,
        depth: usize,
    ) -> Result<(), Fault> {
        for target in node.prim.arcs.get(&kind).cloned().unwrap_or_default() {
            if let Some((source, index)) = self.find(source, &target, &node.prim.path) {
                let below = choices.over(Choices::of(&source, index));
                let weaker = self.node(&source, index, &below, depth + 1)?;
                node.merge(weaker);
            }
        }
        Ok(())
    }

    /// The layer and the prim that `target` names, for the prim `path` of `source`.
    fn find(&mut self, source: &Rc<Source>, target: &Target, path: &str) -> Option<(Rc<Source>, usize)> {
        let source = if target.asset.is_empty() { Rc::clone(source) } else { self.source(&target.asset, path)? };
        let wanted = if target.path.is_empty() {
            source.layer.fields.get("defaultPrim").and_then(Value::text).map(|name| format!("/{name}"))
        } else {
            Some(target.path.clone())
        };
        let found = wanted.as_ref().and_then(|wanted| source.paths.get(wanted)).copied();
        if found.is_none() {
            let wanted = wanted.as_deref().unwrap_or("a default prim");
            let file = if target.asset.is_empty() { "its own layer" } else { &target.asset };
            self.problems.insert(format!("prim {path} is incomplete: there is no {wanted} in {file}"));
        }
        Some((source, found?))
    }

    /// The layer of the file `name`, for the prim `path`.
    fn source(&mut self, name: &str, path: &str) -> Option<Rc<Source>> {
        if let Some(source) = self.sources.get(name) {
            return source.clone();
        }
        let source = match (self.open)(name) {
            Ok(named) => Some(self.stack(named)),
            Err(fault) => {
                self.problems.insert(format!("prim {path} is incomplete: {name}: {}", reason(&fault)));
                None
            }
        };
        self.sources.insert(name.to_owned(), source.clone());
        source
    }
}

/// The reason of a fault in another layer, with its place if that says more.
fn reason(fault: &Fault) -> String {
    match fault.place {
        Place::File | Place::Entry(_) => fault.reason.to_string(),
        _ => format!("{}: {}", fault.place, fault.reason),
    }
}

/// Merges a weaker layer into `layer`, prim by prim.
fn merge_layers(layer: &mut Layer, weaker: Layer) {
    let mut paths: HashMap<String, usize> =
        layer.prims.iter().enumerate().map(|(index, prim)| (prim.path.clone(), index)).collect();
    // The indices in `layer` of the weaker layer's prims.
    let mut merged: Vec<usize> = Vec::with_capacity(weaker.prims.len());
    for mut prim in weaker.prims {
        if let Some(index) = paths.get(&prim.path).copied() {
            merged.push(index);
            let stronger = &mut layer.prims[index];
            for (kind, targets) in std::mem::take(&mut prim.arcs) {
                stronger.arcs.entry(kind).or_default().extend(targets);
            }
            for (set, name) in std::mem::take(&mut prim.selections) {
                stronger.selections.entry(set).or_insert(name);
            }
            merge(stronger, prim);
        } else {
            prim.parent = prim.parent.map(|parent| merged[parent]);
            let index = layer.prims.len();
            merged.push(index);
            paths.insert(prim.path.clone(), index);
            layer.prims.push(prim);
        }
    }
}

/// The name of the file `asset`, which the layer `base` names: relative to its folder.
fn anchored(base: &str, asset: &str) -> String {
    if let Some((archive, entry)) = base.strip_suffix(']').and_then(|base| base.split_once('[')) {
        return format!("{archive}[{}]", joined(entry, asset));
    }
    match asset.split_once('[') {
        Some((archive, entry)) => format!("{}[{entry}", joined(base, archive)),
        None => joined(base, asset),
    }
}

/// The file `name` in the folder of the file `base`.
fn joined(base: &str, name: &str) -> String {
    if name.starts_with('/') {
        return name.to_owned();
    }
    let mut parts: Vec<&str> = base.split('/').collect();
    parts.pop();
    for part in name.split('/') {
        match part {
            "" | "." => {}
            ".." if parts.last().is_some_and(|last| *last != "..") => {
                parts.pop();
            }
            part => parts.push(part),
        }
    }
    parts.join("/")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_relative_to_the_layer_that_has_them() {
        for (base, asset, name) in [
            ("", "./b.usda", "b.usda"),
            ("sub/a.usda", "b.usda", "sub/b.usda"),
            ("sub/a.usda", "../b.usda", "b.usda"),
            ("a.usda", "../b.usda", "../b.usda"),
            ("a.usda", "./b.usdz[c.usd]", "b.usdz[c.usd]"),
            ("sub/b.usdz[in/c.usd]", "./d.usd", "sub/b.usdz[in/d.usd]"),
            ("a.usda", "/b.usda", "/b.usda"),
        ] {
            assert_eq!(anchored(base, asset), name, "{base} {asset}");
        }
    }
}
