//! The house rules that no compiler knows: sizes, walls between the parts, reasons beside
//! dependencies.
//!
//! Each rule reads the project's own text. A failure lists every place that breaks the rule, and
//! says what to do about it.

use std::fs;
use std::path::{Path, PathBuf};

#[path = "tidy/columns.rs"]
mod columns; // how wide a line may be
#[path = "tidy/documents.rs"]
mod documents; // what documents name is there
#[path = "tidy/service.rs"]
mod service; // walls within the service
#[path = "tidy/walls.rs"]
mod walls; // walls between the crates

/// Directories that are built or fetched, wherever they stand.
const NOT_OURS: [&str; 13] = [
    "target",
    ".git",
    ".venv",
    "node_modules",
    "__pycache__",
    ".mypy_cache",
    ".pytest_cache",
    ".hypothesis",
    ".schemathesis",
    ".ruff_cache",
    "cogmap-data",
    "corpus",
    "artifacts",
];

/// What stands at the top of the project.
const TOP: [&str; 22] = [
    ".ci",
    ".config",
    ".gitattributes",
    ".gitignore",
    "ARCHITECTURE.md",
    "CHANGELOG.md",
    "CONTRIBUTING.md",
    "Cargo.lock",
    "Cargo.toml",
    "LICENSE-APACHE",
    "LICENSE-MIT",
    "Makefile",
    "README.md",
    "SECURITY.md",
    "clients",
    "clippy.toml",
    "deny.toml",
    "docker",
    "docs",
    "proto",
    "service",
    "tests",
];

/// Most lines of a source file.
const LINES_MAX: usize = 500;

/// A text file of the project.
struct Source {
    /// Path from the root.
    path: String,
    text: String,
}

impl Source {
    fn has_extension(&self, extensions: &[&str]) -> bool {
        let extension = Path::new(&self.path).extension();
        extensions
            .iter()
            .any(|wanted| extension.is_some_and(|found| found == *wanted))
    }

    /// The lines that contain one of the words, each as `path:line: word`.
    fn mentions(&self, words: &[&str]) -> Vec<String> {
        let mut found = Vec::new();
        for (index, line) in self.text.lines().enumerate() {
            for word in words.iter().filter(|word| line.contains(**word)) {
                found.push(format!("{}:{}: {word}", self.path, index + 1));
            }
        }
        found
    }
}

fn root() -> PathBuf {
    let tests = Path::new(env!("CARGO_MANIFEST_DIR"));
    tests
        .parent()
        .expect("the tests stand in the project")
        .to_owned()
}

/// What stands in a directory.
fn entries(directory: &Path) -> Vec<fs::DirEntry> {
    let entries = fs::read_dir(directory).and_then(Iterator::collect);
    entries.unwrap_or_else(|error| panic!("{}: {error}", directory.display()))
}

/// The project's text files, in the order of their paths. Binary fixtures are left out.
fn sources() -> Vec<Source> {
    let (root, mut open, mut sources) = (root(), vec![root()], Vec::new());
    while let Some(directory) = open.pop() {
        for entry in entries(&directory) {
            let (path, name) = (
                entry.path(),
                entry.file_name().to_string_lossy().into_owned(),
            );
            if path.is_dir() {
                if !NOT_OURS.contains(&&*name) && !name.ends_with(".egg-info") {
                    open.push(path);
                }
            } else if let Ok(text) = fs::read_to_string(&path) {
                let path = path
                    .strip_prefix(&root)
                    .expect("the walk began at the root");
                let path = path.to_string_lossy().into_owned();
                sources.push(Source { path, text });
            }
        }
    }
    sources.sort_by(|a, b| a.path.cmp(&b.path));
    assert!(sources.len() > 100, "the walk has found the project");
    sources
}

fn read(path: &str) -> String {
    fs::read_to_string(root().join(path)).unwrap_or_else(|error| panic!("{path}: {error}"))
}

fn assert_none(found: &[String], advice: &str) {
    assert!(found.is_empty(), "{}\n{advice}", found.join("\n"));
}

#[test]
fn source_files_are_short() {
    let long: Vec<_> = sources()
        .iter()
        .filter(|source| source.has_extension(&["rs", "py", "html"]))
        .map(|source| (source, source.text.lines().count()))
        .filter(|(_, lines)| *lines > LINES_MAX)
        .map(|(source, lines)| format!("{}: {lines} lines", source.path))
        .collect();
    assert_none(
        &long,
        "A file is one noun: give what does not belong to it a file of its own.",
    );
}

#[test]
fn nothing_unfinished_is_left() {
    // Put together here, so that this file does not break its own rule.
    let words = [
        concat!("todo", "!("),
        concat!("unimplemented", "!("),
        concat!("dbg", "!("),
        concat!("FIX", "ME"),
        concat!("TO", "DO"),
        concat!("XX", "X"),
        concat!("#[ig", "nore"),
        concat!("break", "point()"),
        concat!("pytest.mark.", "skip"),
        concat!("pytest.mark.", "xfail"),
    ];
    let found: Vec<_> = sources()
        .iter()
        .filter(|source| !source.has_extension(&["lock"]))
        .flat_map(|source| source.mentions(&words))
        .collect();
    assert_none(
        &found,
        "Finish it, or say what is missing where the user looks for it.",
    );
}

#[test]
fn punctuation_can_be_typed() {
    // Quotes that code and shells do not take, spaces that look like others, and a byte order mark.
    let marks = [
        "\u{2018}", "\u{2019}", "\u{201c}", "\u{201d}", "\u{a0}", "\u{200b}", "\u{feff}", "\r",
    ];
    let found: Vec<_> = sources()
        .iter()
        .flat_map(|source| source.mentions(&marks))
        .map(|line| line.escape_unicode().to_string())
        .collect();
    assert_none(
        &found,
        "Use ' and \", plain spaces and line feeds (the lines above are escaped).",
    );
}

#[test]
fn the_top_of_the_project_is_as_described() {
    let mut found = Vec::new();
    for entry in entries(&root()) {
        let name = entry.file_name().to_string_lossy().into_owned();
        if !NOT_OURS.contains(&&*name) && !TOP.contains(&&*name) {
            found.push(format!("{name} is new"));
        }
    }
    found.extend(
        TOP.iter()
            .filter(|name| !root().join(name).exists())
            .map(|name| format!("{name} is gone")),
    );
    assert_none(
        &found,
        "The front door is read first. Put it into the part that it belongs to, or change the list \
         here together with the table in ARCHITECTURE.md.",
    );
}
