//! The walls between the parts of the service.

use super::{assert_none, sources};

/// Crates of the core whose types decode/ makes and encode/ reads.
const TRANSLATED: [&str; 4] = ["cognitive_map", "geometry", "grid", "object_recognition"];

/// Files of `service/src` beside decode/ and encode/ that name messages of the wire and types of
/// the core, each with what it needs both for. None of them makes one from the other.
const NAMES_BOTH: [(&str, &str); 20] = [
    (
        "answer/mod.rs",
        "asks the map what decode has read, and hands encode what it says",
    ),
    (
        "answer/route.rs",
        "does the same with routes, beside the bounds that the space keeps",
    ),
    ("answer/sequence.rs", "does the same with sequences"),
    (
        "cli/export.rs",
        "reads the settings that a space was stored with, and folds its journal",
    ),
    (
        "cli/import.rs",
        "checks a space's name, and folds what it journals",
    ),
    (
        "engine/agent_view.rs",
        "keeps an agent's messages beside its number in the map",
    ),
    (
        "engine/counters.rs",
        "counts refusals as clients are told of them, and events of the map",
    ),
    (
        "engine/message.rs",
        "carries a lesson as it came, for the journal, and as it was read",
    ),
    (
        "engine/mod.rs",
        "keeps a space's settings as they came and as they were read",
    ),
    (
        "engine/repair/mod.rs",
        "reads the settings that a space was stored with, and restores its map",
    ),
    (
        "engine/shard.rs",
        "creates spaces by settings as they came and as they were read",
    ),
    (
        "engine/space.rs",
        "takes samples and lessons in, and hands snapshots of the map out",
    ),
    (
        "engine/writer/agents.rs",
        "keeps each agent's samples in order beside its number in the map",
    ),
    (
        "engine/writer/journal.rs",
        "journals samples as they came, and gathers them as they were read",
    ),
    (
        "engine/writer/mod.rs",
        "owns the map, and what is to be published of it",
    ),
    (
        "engine/writer/receive.rs",
        "journals batches as they came, and gathers them as they were read",
    ),
    (
        "http/export.rs",
        "walks the map, and names its messages for the OpenAPI document",
    ),
    (
        "http/objects.rs",
        "pages through the map, and names its messages for the OpenAPI document",
    ),
    (
        "http/places.rs",
        "pages through the map, and names its messages for the OpenAPI document",
    ),
    (
        "http/trips.rs",
        "pages through the map, and names its messages for the OpenAPI document",
    ),
];

/// Words, the paths in `service/src` that may have them, and where the rest belongs.
const WALLS: [(&[&str], &[&str], &str); 9] = [
    (
        &["zenoh::", "use zenoh"],
        &[
            "transport/",
            "service.rs",
            "service/",
            "cli/demo/",
            "config/mod.rs", // its own module of that name
        ],
        "Only the transport speaks Zenoh, the composition root opens it, and commands that play \
         robots use it from outside. Go through engine::Publisher or Engine::offer.",
    ),
    (
        &["axum::", "use axum"],
        &["http/"],
        "Only http speaks axum.",
    ),
    (
        &["fjall::", "use fjall", "slatedb::", "use slatedb"],
        &["store/"],
        "Only the store knows the disk format. Go through the trait Store.",
    ),
    (
        &[
            "crate::http",
            "crate::transport",
            "crate::cli",
            "crate::service",
            "crate::config",
        ],
        &[
            "http/",
            "transport/",
            "cli/",
            "service.rs",
            "service/",
            "config/",
        ],
        "The engine, its store and what they are made of know nobody who uses them. Pass it \
         in.",
    ),
    (
        &["crate::engine", "crate::answer", "crate::problem"],
        &[
            "http/",
            "transport/",
            "cli/",
            "service.rs",
            "service/",
            "config/",
            "answer/",
            "cluster/",
            "engine/",
            "problem/",
        ],
        "decode/, encode/ and the journal's blocks translate; the store keeps bytes and knows \
         not whose. Pass in what they need of the engine.",
    ),
    (
        &["crate::decode", "crate::encode"],
        &[
            "http/",
            "transport/",
            "cli/",
            "service.rs",
            "service/",
            "config/",
            "answer/",
            "engine/",
            "decode/",
            "encode/",
            "problem/",
        ],
        "The store keeps bytes and knows not whose.",
    ),
    (
        &["crate::cluster"],
        &["http/", "transport/", "service.rs", "service/", "cluster/"],
        "An engine opens and closes shards as it is told, and does not know by whom.",
    ),
    (
        &["crate::transport"],
        &["transport/", "service.rs", "service/"],
        "HTTP and Zenoh are two doors of one engine and do not know one another.",
    ),
    (
        &["crate::http"],
        &["http/", "service.rs", "service/", "config/"],
        "HTTP and Zenoh are two doors of one engine and do not know one another.",
    ),
];

#[test]
fn each_part_of_the_service_knows_only_its_neighbours() {
    let sources = sources();
    for (words, allowed, advice) in WALLS {
        let found: Vec<_> = sources
            .iter()
            .filter_map(|source| Some((source, source.path.strip_prefix("service/src/")?)))
            .filter(|(source, path)| {
                source.has_extension(&["rs"]) && !allowed.iter().any(|part| path.starts_with(part))
            })
            .flat_map(|(source, _)| source.mentions(words))
            .collect();
        assert_none(&found, advice);
    }
}

#[test]
fn decode_and_encode_alone_translate() {
    let names = |line: &str, name: &str| {
        line.contains(&format!("use {name}")) || line.contains(&format!("{name}::"))
    };
    let sources = sources();
    let mut both: Vec<_> = sources
        .iter()
        .filter_map(|source| Some((source.path.strip_prefix("service/src/")?, &source.text)))
        .filter(|(path, _)| !path.starts_with("decode/") && !path.starts_with("encode/"))
        .filter(|(path, _)| !path.contains("/tests"))
        .filter(|(_, text)| {
            let code = text
                .split("#[cfg(test)]\nmod tests {")
                .next()
                .unwrap_or_default();
            let mentions = |name: &str| code.lines().any(|line| names(line, name));
            mentions("cogmap_proto") && TRANSLATED.iter().any(|name| mentions(name))
        })
        .map(|(path, _)| path)
        .collect();
    both.sort_unstable();
    let allowed: Vec<_> = NAMES_BOTH.iter().map(|(path, _)| *path).collect();
    assert_eq!(
        both, allowed,
        "decode/ makes what the core takes of messages, encode/ makes messages of what the core has. Let \
         them do it; a file that only passes both on has its reason in the list."
    );
}
