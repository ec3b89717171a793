//! The walls between the crates: what each may depend on, and why it does.

use super::{assert_none, entries, read, root, sources};

/// Manifests whose dependencies each have their reason beside them.
const MANIFESTS: [&str; 17] = [
    "proto/Cargo.toml",
    "service/Cargo.toml",
    "service/core/cognitive_map/Cargo.toml",
    "service/core/geometry/Cargo.toml",
    "service/core/grid/Cargo.toml",
    "service/core/object_recognition/Cargo.toml",
    "service/core/place_filter/Cargo.toml",
    "service/core/place_recognition/Cargo.toml",
    "service/core/pose_graph/Cargo.toml",
    "service/core/random/Cargo.toml",
    "service/core/simd/Cargo.toml",
    "service/core/state/Cargo.toml",
    "service/core/trajectory/Cargo.toml",
    "service/lab/Cargo.toml",
    "service/worlds/Cargo.toml",
    "clients/rust/Cargo.toml",
    "tests/Cargo.toml",
];

/// Crates of the core, each with all that it may depend on: the arrows of the core, and the wall
/// around it.
const CORE: [(&str, &[&str]); 11] = [
    ("random", &[]),
    ("simd", &["pulp", "wide"]),
    ("state", &["nalgebra", "thiserror"]),
    ("trajectory", &["geometry", "nalgebra", "thiserror"]),
    ("geometry", &["nalgebra", "state"]),
    ("grid", &["nalgebra", "state", "thiserror"]),
    (
        "pose_graph",
        &["geometry", "nalgebra", "simd", "state", "thiserror"],
    ),
    ("place_filter", &["geometry", "nalgebra", "simd", "state"]),
    (
        "place_recognition",
        &["geometry", "nalgebra", "random", "simd", "state"],
    ),
    (
        "object_recognition",
        &["geometry", "grid", "nalgebra", "simd", "state"],
    ),
    (
        "cognitive_map",
        &[
            "geometry",
            "grid",
            "nalgebra",
            "object_recognition",
            "place_filter",
            "place_recognition",
            "pose_graph",
            "random",
            "state",
            "thiserror",
        ],
    ),
];

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
        // Petgraph is an oracle that shares nothing with what it checks.
        let known = ["petgraph", "proptest", "random"];
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
