//! The workspace as its manifests describe it: packages, their targets and their dependencies.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use toml::{Table, Value};

/// The root of the workspace.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// A package.
#[derive(Debug)]
pub struct Package {
    pub name: String,
    /// Its folder, relative to the root.
    pub folder: String,
    pub manifest: Table,
}

/// A package's dependency on another of the workspace.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Dependency {
    /// The folder of the package that depends.
    pub from: String,
    /// The folder of the package that it depends on.
    pub to: String,
    /// True if it is only for tests, examples and benchmarks.
    pub is_dev: bool,
}

fn read(path: &Path) -> Table {
    let text = std::fs::read_to_string(path).expect("a manifest");
    toml::from_str(&text).expect("TOML")
}

fn text<'a>(table: &'a Table, key: &str) -> Option<&'a str> {
    table.get(key).and_then(Value::as_str)
}

/// All packages of the workspace.
pub fn packages() -> Vec<Package> {
    let root = root();
    let members = read(&root.join("Cargo.toml"))["workspace"]["members"].clone();
    let members = members.as_array().expect("members").iter();
    members
        .map(|member| {
            let folder = member.as_str().expect("a path").to_owned();
            let manifest = read(&root.join(&folder).join("Cargo.toml"));
            let package = manifest["package"].as_table().expect("a package");
            Package { name: text(package, "name").expect("a name").to_owned(), folder, manifest }
        })
        .collect()
}

/// The name of the package that a manifest depends on by `key`: dependencies may have other names than their packages,
/// which the manifest says, or the root's.
fn package_name<'a>(key: &'a str, dependency: &'a Value, inherited: &'a Table) -> &'a str {
    let name = |value: &'a Value| value.get("package").and_then(Value::as_str);
    name(dependency).or_else(|| inherited.get(key).and_then(name)).unwrap_or(key)
}

/// The dependencies of the workspace's packages on each other.
pub fn dependencies() -> Vec<Dependency> {
    let packages = packages();
    let manifest = read(&root().join("Cargo.toml"));
    let inherited = manifest["workspace"]["dependencies"].as_table().expect("dependencies");
    let folders: BTreeMap<&str, &str> =
        packages.iter().map(|package| (package.name.as_str(), package.folder.as_str())).collect();
    let mut found = Vec::new();
    for package in &packages {
        let targets = package.manifest.get("target").and_then(Value::as_table);
        let targets = targets.into_iter().flat_map(|targets| targets.values());
        let tables = targets.filter_map(Value::as_table);
        for table in tables.chain([&package.manifest]) {
            for kind in ["dependencies", "dev-dependencies", "build-dependencies"] {
                let listed = table.get(kind).and_then(Value::as_table);
                for (key, value) in listed.into_iter().flatten() {
                    if let Some(to) = folders.get(package_name(key, value, inherited)) {
                        found.push(Dependency {
                            from: package.folder.clone(),
                            to: (*to).to_owned(),
                            is_dev: kind == "dev-dependencies",
                        });
                    }
                }
            }
        }
    }
    found
}

/// The `.rs` files below a folder, without those of other packages and of `left_out`.
pub fn sources(folder: &Path, left_out: &[PathBuf], found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            let is_other = path.join("Cargo.toml").exists() || path.ends_with("target");
            if !is_other && !left_out.contains(&path) {
                sources(&path, left_out, found);
            }
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
}

/// A crate that cargo builds: a library, a program, an example, a benchmark or a test executable.
#[derive(Clone, Debug)]
pub struct Target {
    /// The package's name, and the target's unless it is the library.
    pub name: String,
    /// The file of its root module.
    pub root: PathBuf,
}

impl Package {
    /// The crates that cargo builds from it.
    pub fn targets(&self) -> Vec<Target> {
        let folder = root().join(&self.folder);
        let mut found: BTreeMap<PathBuf, String> = BTreeMap::new();
        let library = folder.join("src/lib.rs");
        if library.exists() {
            found.insert(library, self.name.clone());
        }
        for (kind, place) in [("bin", "src/bin"), ("test", "tests"), ("example", "examples"), ("bench", "benches")] {
            let listed = self.manifest.get(kind).and_then(Value::as_array);
            let tables = listed.into_iter().flatten().filter_map(Value::as_table);
            for path in tables.filter_map(|table| text(table, "path")) {
                found.insert(folder.join(path), self.target_name(Path::new(path)));
            }
            let automatic = std::fs::read_dir(folder.join(place)).into_iter().flatten();
            for entry in automatic {
                let path = entry.expect("an entry").path();
                let root = path.join("main.rs");
                if root.exists() {
                    found.insert(root, self.target_name(&path));
                } else if path.extension().is_some_and(|extension| extension == "rs")
                    && !self.is_part_of_a_folder(&path)
                {
                    found.insert(path.clone(), self.target_name(&path));
                }
            }
        }
        let program = folder.join("src/main.rs");
        if program.exists() {
            found.insert(program.clone(), self.target_name(&program));
        }
        found.into_iter().map(|(root, name)| Target { name, root }).collect()
    }

    fn target_name(&self, path: &Path) -> String {
        let stem = path.file_stem().expect("a name").to_string_lossy();
        let folder = path.parent().and_then(Path::file_name).map(|name| name.to_string_lossy());
        match folder {
            Some(folder) if stem == "main" && folder != "src" => format!("{}/{folder}", self.name),
            _ => format!("{}/{stem}", self.name),
        }
    }

    /// Returns true if the file is next to a manifest. The package of all tests has its root in the folder where cargo
    /// looks for tests.
    fn is_part_of_a_folder(&self, path: &Path) -> bool {
        let parent = path.parent().expect("a folder");
        parent.join("Cargo.toml").exists()
    }
}
