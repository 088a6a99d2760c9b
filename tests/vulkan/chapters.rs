//! The table of the tests by chapter in `docs/testing.md`. It is made of the folders of `tests/vulkan` and `tests/gaussian`
//! and of the first sentences of their files.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// The folders of the chapters, in the order of the specification.
const CHAPTERS: [&str; 23] = [
    "fundamentals",
    "initialization",
    "devices_and_queues",
    "command_buffers",
    "synchronization",
    "render_pass",
    "shaders",
    "pipelines",
    "memory_and_resources",
    "samplers",
    "resource_descriptors",
    "shader_interfaces",
    "image_operations",
    "queries",
    "clear_and_copy_commands",
    "drawing_commands",
    "tessellation_and_geometry",
    "vertex_post_processing",
    "rasterization",
    "fragment_operations",
    "dispatching_commands",
    "window_system_integration",
    "features",
];

/// The lines around the table.
const BEGIN: &str = "<!-- The tests by chapter; GAURAST_BLESS=1 writes them. -->\n";
const END: &str = "<!-- The end of the tests by chapter. -->\n";

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn read(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// A paragraph of a module's documentation, as one line.
fn paragraph(text: &str, number: usize) -> String {
    let lines = text.lines().map_while(|line| line.strip_prefix("//!"));
    let joined = lines.map(str::trim).collect::<Vec<_>>().join("\n");
    joined.split("\n\n").nth(number).unwrap_or_default().replace('\n', " ")
}

/// The first sentence of a module's documentation, without its full stop.
fn first_sentence(text: &str) -> String {
    let first = paragraph(text, 0);
    let end = first.find(". ").unwrap_or(first.len());
    first[..end].trim_end_matches('.').to_owned()
}

/// The files and folders of a folder, by name.
fn entries(folder: &Path) -> Vec<PathBuf> {
    let read = std::fs::read_dir(folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    let mut paths: Vec<_> = read.map(|entry| entry.expect("an entry").path()).collect();
    paths.sort();
    paths
}

/// A chapter: its titles, and the file whose documentation says so.
struct Chapter {
    titles: String,
    folder: PathBuf,
    text: String,
}

impl Chapter {
    fn of_vulkan(name: &str) -> Self {
        let folder = root().join("tests/vulkan").join(name);
        let text = read(&folder.join("mod.rs"));
        let first = first_sentence(&text);
        let titles: Vec<_> = first.split('*').skip(1).step_by(2).collect();
        assert!(!titles.is_empty(), "{name}/mod.rs names its chapter in asterisks");
        Self { titles: titles.join("; "), folder, text }
    }

    fn of_the_extension() -> Self {
        let folder = root().join("tests/gaussian");
        let text = read(&folder.join("main.rs"));
        Self { titles: "`VK_GAURAST_gaussian_primitive_topology`".to_owned(), folder, text }
    }

    fn all() -> Vec<Self> {
        CHAPTERS.map(Self::of_vulkan).into_iter().chain([Self::of_the_extension()]).collect()
    }

    /// The subjects: the name and the first sentence of each file, and of each folder's `mod.rs`.
    fn subjects(&self) -> Vec<(String, String)> {
        let subject = |path: PathBuf| {
            let name = path.file_stem()?.to_string_lossy().into_owned();
            let file = if path.is_dir() { path.join("mod.rs") } else { path };
            let is_source = file.extension().is_some_and(|extension| extension == "rs") && file.is_file();
            (is_source && name != "mod" && name != "main").then(|| (name, first_sentence(&read(&file))))
        };
        entries(&self.folder).into_iter().filter_map(subject).collect()
    }

    /// The files and folders of unit tests, which the chapter's documentation names in backquotes.
    fn unit_tests(&self) -> Vec<String> {
        let paragraphs = (0..4).map(|number| paragraph(&self.text, number));
        let named = paragraphs.filter_map(|text| Some(text.strip_prefix("Unit tests: ")?.to_owned())).next();
        let named = named.unwrap_or_default();
        named.split('`').skip(1).step_by(2).map(str::to_owned).collect()
    }
}

/// The table, one row for each subject.
fn table() -> String {
    let mut table = "| chapter | file | tests |\n|---|---|---|\n".to_owned();
    for chapter in Chapter::all() {
        let mut titles = chapter.titles.as_str();
        let prefix = chapter.folder.strip_prefix(root().join("tests")).expect("a folder of tests").display();
        for (name, sentence) in chapter.subjects() {
            assert!(!sentence.is_empty(), "{prefix}/{name} has no documentation");
            writeln!(table, "| {titles} | `{prefix}/{name}` | {sentence} |").expect("a string");
            titles = "";
        }
        let units = chapter.unit_tests();
        if !units.is_empty() {
            let units: Vec<_> = units.iter().map(|path| format!("`{path}`")).collect();
            writeln!(table, "| | unit tests | {} |", units.join(", ")).expect("a string");
        }
    }
    table.replace("|  |", "| |")
}

/// The table in `docs/testing.md` is that of the files. With `GAURAST_BLESS` set, it is written instead.
#[gaurast_runner::test]
fn the_table_lists_all_files() {
    let path = root().join("docs/testing.md");
    let page = read(&path);
    let (before, rest) = page.split_once(BEGIN).expect("the table's beginning");
    let (stored, after) = rest.split_once(END).expect("the table's end");
    let table = table();
    if std::env::var_os("GAURAST_BLESS").is_some() {
        std::fs::write(path, format!("{before}{BEGIN}{table}{END}{after}")).expect("the page is written");
        return;
    }
    let first = table.lines().zip(stored.lines()).find(|(now, then)| now != then);
    assert!(table == stored, "GAURAST_BLESS=1 writes the table anew; first difference: {first:#?}");
}

#[gaurast_runner::test]
fn every_folder_is_a_chapter() {
    let folders = entries(&root().join("tests/vulkan")).into_iter().filter(|path| path.is_dir());
    let found: BTreeSet<_> =
        folders.map(|path| path.file_name().expect("a name").to_string_lossy().into_owned()).collect();
    assert_eq!(found, CHAPTERS.map(str::to_owned).into());
}

/// Each file of the driver that has unit tests is named by a chapter's `mod.rs`, or its folder is.
#[gaurast_runner::test]
fn unit_tests_belong_to_a_chapter() {
    let named: Vec<_> = Chapter::all().iter().flat_map(Chapter::unit_tests).collect();
    for path in &named {
        assert!(root().join(path).exists(), "there is no {path}");
    }
    let mut folders = vec![root().join("driver/src")];
    while let Some(folder) = folders.pop() {
        for path in entries(&folder) {
            if path.is_dir() {
                folders.push(path);
            } else if read(&path).contains("#[cfg(test)]\nmod tests") {
                let file = path.strip_prefix(root()).expect("within the project");
                let has_chapter = named.iter().any(|path| file.starts_with(path));
                assert!(has_chapter, "a mod.rs of tests/vulkan has to name {}", file.display());
            }
        }
    }
}
