//! The house rules that no compiler knows: sizes, walls between the parts, reasons beside
//! dependencies.
//!
//! Each rule reads the project's own text. A failure lists every place that breaks the rule, and
//! says what to do about it.

use std::fs;
use std::path::{Path, PathBuf};

#[path = "tidy/service.rs"]
mod service;

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

/// Manifests whose dependencies each have their reason beside them.
const MANIFESTS: [&str; 15] = [
    "proto/Cargo.toml",
    "service/Cargo.toml",
    "service/core/cognitive_map/Cargo.toml",
    "service/core/geometry/Cargo.toml",
    "service/core/grid/Cargo.toml",
    "service/core/object_recognition/Cargo.toml",
    "service/core/place_recognition/Cargo.toml",
    "service/core/pose_graph/Cargo.toml",
    "service/core/random/Cargo.toml",
    "service/core/state/Cargo.toml",
    "service/core/trajectory/Cargo.toml",
    "service/lab/Cargo.toml",
    "service/worlds/Cargo.toml",
    "clients/rust/Cargo.toml",
    "tests/Cargo.toml",
];

/// Crates of the core, each with all that it may depend on: the arrows of the core, and the wall
/// around it.
const CORE: [(&str, &[&str]); 9] = [
    ("random", &[]),
    ("state", &["nalgebra", "thiserror"]),
    ("trajectory", &["geometry", "nalgebra", "thiserror"]),
    ("geometry", &["nalgebra", "state"]),
    ("grid", &["nalgebra", "state", "thiserror"]),
    (
        "pose_graph",
        &["geometry", "nalgebra", "pulp", "state", "thiserror"],
    ),
    ("place_recognition", &["geometry", "nalgebra", "state"]),
    (
        "object_recognition",
        &["geometry", "grid", "nalgebra", "pulp", "state"],
    ),
    (
        "cognitive_map",
        &[
            "geometry",
            "grid",
            "nalgebra",
            "object_recognition",
            "place_recognition",
            "pose_graph",
            "random",
            "state",
            "thiserror",
        ],
    ),
];

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

/// Names and whole lines of a manifest's dependencies: those of all sections, or of one.
fn dependencies(manifest: &str, section: Option<&str>) -> Vec<(String, String)> {
    let (mut dependencies, mut inside) = (Vec::new(), false);
    for line in read(manifest).lines() {
        if let Some(header) = line.strip_prefix('[') {
            let header = header.trim_end_matches(']');
            inside = section.map_or(header.ends_with("dependencies"), |wanted| header == wanted);
        } else if inside && !line.is_empty() && !line.starts_with('#') {
            let end = line.find(['.', ' ', '=']).unwrap_or(line.len());
            dependencies.push((line[..end].to_owned(), line.to_owned()));
        }
    }
    dependencies
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

#[test]
fn every_dependency_has_its_reason_beside_it() {
    let mut found = Vec::new();
    for manifest in MANIFESTS {
        for (_, line) in dependencies(manifest, None) {
            if !line.contains(" # ") {
                found.push(format!("{manifest}: {line}"));
            }
        }
    }
    let python = "clients/python/pyproject.toml";
    let text = read(python);
    let list = text
        .split("\ndependencies = [\n")
        .nth(1)
        .expect("the list of dependencies");
    let lines = list.lines().take_while(|line| *line != "]");
    found.extend(
        lines
            .filter(|line| !line.contains(" # "))
            .map(|line| format!("{python}: {line}")),
    );
    assert_none(&found, "Say in the same line, after #, what it is for.");
}

#[test]
fn the_core_depends_on_mathematics_alone() {
    let folders = entries(&root().join("service/core"));
    let crates = folders.iter().filter(|entry| entry.path().is_dir());
    assert_eq!(
        crates.count(),
        CORE.len(),
        "a crate of the core has no wall here"
    );
    for (name, allowed) in CORE {
        let manifest = format!("service/core/{name}/Cargo.toml");
        let names = |section| -> Vec<_> {
            dependencies(&manifest, Some(section))
                .into_iter()
                .map(|(name, _)| name)
                .collect()
        };
        let advice = "This list is the wall around the crate, and its arrows. Do it outside, and pass the result in.";
        assert_eq!(names("dependencies"), allowed, "{manifest}: {advice}");
        let for_tests = names("dev-dependencies");
        let known = ["proptest", "random"];
        assert!(
            for_tests.iter().all(|name| known.contains(&&**name)),
            "{manifest}: {advice}"
        );
        assert!(
            names("build-dependencies").is_empty(),
            "{manifest}: {advice}"
        );
    }
}

#[test]
fn the_core_knows_no_world() {
    let words = [
        "std::env",
        "std::fs",
        "std::io",
        "std::net",
        "std::process",
        "std::thread",
        "std::time",
        "Instant::",
        "SystemTime",
        "HashMap",
        "HashSet",
        "RwLock",
        "thread_local!",
    ];
    let found: Vec<_> = sources()
        .iter()
        .filter(|source| source.path.starts_with("service/core/") && source.path.contains("/src/"))
        .flat_map(|source| source.mentions(&words))
        .collect();
    assert_none(
        &found,
        "Replay equals live because the core sees nothing but its records. Put what it needs into \
         the record, or do it in the engine.",
    );
}

#[test]
fn each_part_depends_only_on_what_it_may() {
    // What a manifest must not name, and why.
    let walls: [(&str, &[&str], &str); 5] = [
        (
            "proto/Cargo.toml",
            &[
                "cogmap",
                "cogmap-client",
                "cogmap-lab",
                "cogmap-worlds",
                "cognitive_map",
                "zenoh",
                "axum",
            ],
            "proto describes messages; who carries them is none of its business.",
        ),
        (
            "clients/rust/Cargo.toml",
            &["cogmap", "cogmap-lab", "cogmap-worlds", "cognitive_map"],
            "A client knows the wire and nothing behind it.",
        ),
        (
            "service/Cargo.toml",
            &["cogmap-lab", "plotters", "rand"],
            "The server serves: data sets, figures and benchmarks are the laboratory's.",
        ),
        (
            "service/worlds/Cargo.toml",
            &["cogmap", "cogmap-client", "cogmap-lab", "plotters", "zenoh"],
            "Worlds give readings, and know nobody who uses them.",
        ),
        (
            "tests/Cargo.toml",
            &[
                "cogmap",
                "cogmap-lab",
                "cogmap-worlds",
                "cognitive_map",
                "fjall",
                "axum",
            ],
            "The tests come through the doors: Zenoh, HTTP, the command line.",
        ),
    ];
    for (manifest, forbidden, why) in walls {
        for (name, _) in dependencies(manifest, None) {
            assert!(
                !forbidden.contains(&&*name),
                "{manifest} names {name}. {why}"
            );
        }
    }
}

#[test]
fn links_between_documents_lead_somewhere() {
    let mut found = Vec::new();
    for source in sources()
        .iter()
        .filter(|source| source.has_extension(&["md"]))
    {
        let folder = root()
            .join(&source.path)
            .parent()
            .expect("a file's folder")
            .to_owned();
        for target in source
            .text
            .split("](")
            .skip(1)
            .filter_map(|rest| rest.split(')').next())
        {
            let file = target.split('#').next().unwrap_or_default();
            if !target.contains("://") && !file.is_empty() && !folder.join(file).exists() {
                found.push(format!("{}: {target}", source.path));
            }
        }
    }
    assert_none(&found, "Correct the link, or write what it promises.");
}

#[test]
fn the_page_of_the_model_names_what_is_there() {
    let sources = sources();
    let page = read("docs/model.md");
    let rows = page.lines().filter(|line| line.starts_with("| "));
    let (mut found, mut named) = (Vec::new(), 0);
    for cells in rows.map(|row| row.split('|').skip(2).take(2)) {
        // Each of the two cells names a file and an item in it, in back quotes.
        for cell in cells.filter(|cell| cell.contains('`')) {
            let mut names = cell.split('`').skip(1).step_by(2);
            let (Some(file), Some(item)) = (names.next(), names.next()) else {
                found.push(format!("{cell}: no file and item"));
                continue;
            };
            named += 1;
            let end = format!("/{file}");
            let mut files = sources.iter().filter(|source| source.path.ends_with(&end));
            let defined = ["fn", "struct", "enum", "const"].map(|word| format!("{word} {item}"));
            let variant = format!("\n    {item},");
            let defines = |text: &str| {
                defined.iter().any(|line| text.contains(line)) || text.contains(&variant)
            };
            if !files.any(|source| defines(&source.text)) {
                found.push(format!("{file}: {item}"));
            }
        }
    }
    assert!(named > 40, "only {named} items were understood");
    assert_none(&found, "Name where it is now.");
}
