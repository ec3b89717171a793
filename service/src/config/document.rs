//! `docs/settings.md`, written from the settings themselves.

use std::fmt::Write;
use std::path::Path;

use cogmap_proto::{NoiseSettings, SpaceSettings};
use serde_json::Value;
use utoipa::PartialSchema;

use super::*;
use crate::decode::setting_bounds;

const HEAD: &str = "# Settings

<!-- Written by a test from the settings themselves: see service/src/config/document.rs. -->

A setting is given in a file (`cogmap serve --config cogmap.toml`), in the environment or by a flag
(`--set http.listen=127.0.0.1:8080`); the later of these wins. `cogmap check-config` prints those in
effect. The reasons behind the defaults stand in [`cogmap.toml`](../service/cogmap.toml).
";

const SPACES: &str = "
## Spaces

Settings of a space are fixed when it is created: in the file under `[spaces.NAME]`, in the
environment as `COGMAP_SPACES__NAME__…`, over HTTP as the body of `PUT /v1/spaces/NAME`.

| setting | default | may be | meaning |
|---|---|---|---|
";

/// The page.
fn page() -> String {
    let mut page = HEAD.to_owned();
    let defaults = Config::default().to_toml();
    let defaults: toml::Table = toml::from_str(&defaults).expect("settings are TOML");
    let sections = [
        ("HTTP", HttpConfig::SETTINGS),
        ("Zenoh", ZenohConfig::SETTINGS),
        ("Store", StoreConfig::SETTINGS),
        ("Cluster", ClusterConfig::SETTINGS),
        ("Engine", EngineConfig::SETTINGS),
        ("Log", LogConfig::SETTINGS),
    ];
    for (title, settings) in sections {
        write!(page, "\n## {title}\n\n| setting | in the environment | default | may be | meaning |\n|---|---|---|---|---|\n")
            .expect("a text takes it");
        for setting in settings {
            let (section, name) = setting.key.split_once('.').expect("a section and a name");
            let variable = format!("COGMAP_{section}__{name}").to_ascii_uppercase();
            let default = defaults[section].get(name);
            let default = default.map_or_else(|| "absent".to_owned(), |value| format!("`{value}`"));
            let (key, rule) = (setting.key, setting.rule);
            let doc = plain(&setting.doc.concat());
            writeln!(
                page,
                "| `{key}` | `{variable}` | {default} | {rule} | {doc} |"
            )
            .expect("a text takes it");
        }
    }
    page.push_str(SPACES);
    page.push_str(&space_rows());
    page
}

/// The rows of a space's settings.
fn space_rows() -> String {
    let mut page = String::new();
    let defaults = serde_json::to_value(SpaceSettings::default()).expect("plain data");
    let bounds: BTreeMap<_, _> = setting_bounds().collect();
    let bound = |name: &str| {
        let bound = bounds.get(name);
        bound.unwrap_or_else(|| panic!("the map's settings say nothing of {name}"))
    };
    for (name, doc) in described::<SpaceSettings>() {
        if name == "odometry_noise" {
            for (part, doc) in described::<NoiseSettings>() {
                let default = &defaults["odometry_noise"][&part];
                let rule = bound(&part);
                writeln!(page, "| `{name}.{part}` | `{default}` | {rule} | {doc} |")
                    .expect("a text takes it");
            }
            continue;
        }
        let rule = match &*name {
            "seed" => "any whole number".to_owned(),
            "learns_unknown_objects" => "true or false".to_owned(),
            "recruitment" => {
                "`{ novelty = {} }`, or `{ bernoulli = { probability = 0.1 } }`".to_owned()
            }
            _ => bound(&name).to_string(),
        };
        let default = &defaults[&name];
        let above = if name == "lost_sd_m" {
            ", above localized_sd_m"
        } else {
            ""
        };
        writeln!(page, "| `{name}` | `{default}` | {rule}{above} | {doc} |")
            .expect("a text takes it");
    }
    page
}

/// The fields of a message, each with what its documentation says.
fn described<T: PartialSchema>() -> Vec<(String, String)> {
    let schema = serde_json::to_value(T::schema()).expect("a schema is plain data");
    let fields = schema["properties"]
        .as_object()
        .expect("a message has fields");
    let doc = |field: &Value| {
        // A field that is a message itself has its documentation beside the reference.
        let doc = field.pointer("/description").and_then(Value::as_str);
        plain(doc.unwrap_or_default())
    };
    fields
        .iter()
        .map(|(name, field)| (name.clone(), doc(field)))
        .collect()
}

/// Text of a documentation comment in one line, as a table takes it.
fn plain(doc: &str) -> String {
    let words: Vec<_> = doc.split_whitespace().collect();
    words.join(" ").replace("\\[", "[").replace("\\]", "]")
}

/// To write the page anew: `COGMAP_WRITE_DOCS=1 cargo test -p cogmap the_page_of_settings`.
#[test]
fn the_page_of_settings_is_what_the_settings_say() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/settings.md");
    let page = page();
    if std::env::var_os("COGMAP_WRITE_DOCS").is_some() {
        std::fs::write(&path, &page).expect("the page is written");
    }
    let there = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(
        there == page,
        "docs/settings.md is not what the settings say. Write it anew: \
         COGMAP_WRITE_DOCS=1 cargo test -p cogmap the_page_of_settings"
    );
}
