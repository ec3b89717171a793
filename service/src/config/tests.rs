//! Settings through their sources.

use std::io::Write;

use super::*;
use crate::http::HostRule;

const DOCUMENTED: &str = include_str!("../../cogmap.toml");

fn load(text: &str, environment: &[(&str, &str)], flags: &[&str]) -> Result<Config, ConfigError> {
    let mut file = tempfile::NamedTempFile::new().expect("a temporary file");
    file.write_all(text.as_bytes()).expect("written");
    let environment = environment
        .iter()
        .map(|(name, value)| ((*name).to_owned(), (*value).to_owned()));
    let flags = flags
        .iter()
        .map(|flag| (*flag).to_owned())
        .collect::<Vec<_>>();
    Config::from_sources(Some(file.path()), environment, &flags)
}

fn refusal(text: &str, environment: &[(&str, &str)], flags: &[&str]) -> String {
    load(text, environment, flags)
        .expect_err("must be refused")
        .to_string()
}

#[test]
fn the_documented_file_has_the_defaults() {
    let documented: Config = toml::from_str(DOCUMENTED).expect("the file parses");
    assert_eq!(documented, Config::default());
    documented.check().expect("the defaults keep their rules");
}

/// The leaves of a table, with dots between the levels.
fn leaves(table: &toml::Table, prefix: &str, found: &mut Vec<String>) {
    for (key, value) in table {
        let path = format!("{prefix}{key}");
        match value {
            toml::Value::Table(below) if !below.is_empty() => {
                leaves(below, &format!("{path}."), found);
            }
            _ => found.push(path),
        }
    }
}

#[test]
fn the_documented_file_mentions_every_key() {
    // With the optional keys filled in, so that they count.
    let mut config = Config::default();
    config.http.token = Some(Token::new("t"));
    config.http.token_file = Some("t".into());
    config.zenoh.config_file = Some("t".into());
    let all: toml::Table = toml::from_str(&config.to_toml()).expect("parses");
    let mut keys = Vec::new();
    leaves(&all, "", &mut keys);
    assert!(keys.len() > 35, "only {} keys", keys.len());
    for key in keys {
        let name = key.rsplit('.').next().expect("a key has a name");
        let shown = [
            format!("\n{name} = "),
            format!("\n# {name} = "),
            format!("{{ {name} = "),
        ];
        let mentioned = shown.iter().any(|form| DOCUMENTED.contains(form));
        assert!(mentioned, "{key} is not in cogmap.toml");
    }
}

#[test]
fn no_file_gives_the_defaults() {
    let config = Config::from_sources(None, [], &[]).expect("loads");
    assert_eq!(config, Config::default());
}

#[test]
fn a_node_answers_by_the_name_that_other_nodes_ask_for() {
    let mut config = Config::default();
    config.cluster.address = "node-a.example:80".into();
    assert_eq!(config.http_settings().hosts, HostRule::new(&[], false));
    config.cluster.enabled = true;
    let named = HostRule::new(&["node-a.example".to_owned()], false);
    assert_eq!(config.http_settings().hosts, named);
}

#[test]
fn flags_stand_above_the_environment_and_that_above_the_file() {
    let text = "[http]\nlisten = '127.0.0.1:1'\nrequests_max = 7\nstreams_max = 7\n";
    let environment = [
        ("COGMAP_HTTP__LISTEN", "127.0.0.1:2"),
        ("COGMAP_HTTP__REQUESTS_MAX", "8"),
    ];
    let config = load(text, &environment, &["http.listen=127.0.0.1:3"]).expect("loads");
    assert_eq!(config.http.listen.port(), 3);
    assert_eq!(config.http.requests_max, 8);
    assert_eq!(config.http.streams_max, 7);
    assert_eq!(config.http.connections_max, 4096);
}

#[test]
fn values_from_outside_are_toml_where_that_fits_and_text_otherwise() {
    let environment = [
        ("COGMAP_ZENOH__CONNECT", "[\"tcp/a:1\", \"tls/b:2\"]"),
        ("COGMAP_ZENOH__MODE", "client"),
        ("COGMAP_ZENOH__ENABLED", "false"),
        ("COGMAP_HTTP__TOKEN", "0012"),
        ("COGMAP_STORE__DIRECTORY", "/data"),
        (
            "COGMAP_SPACES__LAB__RECRUITMENT",
            "{ bernoulli = { probability = 0.05 } }",
        ),
        ("COGMAP_SPACES__LAB__SEED", "3"),
    ];
    let config = load("", &environment, &["http.token=1234"]).expect("loads");
    assert_eq!(config.zenoh.connect, ["tcp/a:1", "tls/b:2"]);
    assert_eq!(config.zenoh.mode, ZenohMode::Client);
    assert!(!config.zenoh.enabled);
    assert_eq!(
        config.http.token,
        Some(Token::new("1234")),
        "digits are a text here"
    );
    assert_eq!(config.store.directory, Path::new("/data"));
    let lab = &config.spaces[&"lab".parse::<Name>().expect("a name")];
    assert_eq!(lab.seed, 3);
    assert_eq!(
        lab.recruitment,
        cogmap_proto::Recruitment::Bernoulli { probability: 0.05 }
    );
}

#[test]
fn a_value_cannot_smuggle_in_another_key() {
    let environment = [("COGMAP_HTTP__REQUESTS_MAX", "5\nother = 6")];
    assert!(refusal("", &environment, &[]).contains("COGMAP_HTTP__REQUESTS_MAX"));
}

#[test]
fn unknown_keys_are_refused_by_name_wherever_they_stand() {
    let cases = [
        refusal("[http]\nlisen = '127.0.0.1:1'\n", &[], &[]),
        refusal("", &[("COGMAP_HTTP__LISEN", "127.0.0.1:1")], &[]),
        refusal("", &[], &["http.lisen=127.0.0.1:1"]),
    ];
    for message in cases {
        assert!(message.to_lowercase().contains("lisen"), "{message}");
        assert!(
            message.contains("`listen`"),
            "{message} does not say what there is"
        );
    }
    assert!(refusal("[htp]\n", &[], &[]).contains("htp"));
    assert!(refusal("[spaces.a]\nsead = 1\n", &[], &[]).contains("sead"));
    assert!(refusal("[spaces.a.odometry_noise]\nx = 1\n", &[], &[]).contains('x'));
    assert!(refusal("", &[], &["http"]).contains("key=value"));
    assert!(refusal("", &[], &["http=1"]).contains("section"));
}

#[test]
fn a_variable_with_one_underscore_too_few_is_refused_and_others_are_not_settings() {
    let message = refusal("", &[("COGMAP_HTTP_LISTEN", "127.0.0.1:1")], &[]);
    assert!(message.contains("COGMAP_HTTP__LISTEN"), "{message}");
    let others = [
        ("COGMAP_CONFIG", "x"),
        ("COGMAP_BIN", "y"),
        ("COGMAPPER__X", "z"),
    ];
    assert_eq!(load("", &others, &[]).expect("loads"), Config::default());
}

#[test]
fn wrong_types_are_refused_not_rounded() {
    assert!(refusal("[http]\nrequests_max = 1.5\n", &[], &[]).contains("requests_max"));
    let message = refusal("", &[("COGMAP_HTTP__REQUESTS_MAX", "many")], &[]);
    assert!(message.contains("COGMAP_HTTP__REQUESTS_MAX"), "{message}");
    assert!(refusal("[http]\nrequests_max = -1\n", &[], &[]).contains("-1"));
    assert!(refusal("[zenoh]\nmode = 'star'\n", &[], &[]).contains("star"));
    assert!(refusal("[spaces.'no name']\n", &[], &[]).contains("name"));
}

#[test]
fn broken_rules_name_key_value_and_rule() {
    let cases = [
        ("http.requests_max=0", "0", "1 to"),
        ("http.request_timeout_s=0", "0", "0.001 to"),
        ("http.request_timeout_s=nan", "NaN", "0.001 to"),
        ("http.shutdown_timeout_s=1e300", "1000", "86400"),
        ("engine.queue_bytes=100", "100", "2097152"),
        ("engine.commit_interval_s=-1", "-1", "0.001 to"),
        ("zenoh.connect=['udp/a:1']", "udp/a:1", "tcp/"),
        ("zenoh.mode=client", "empty", "router in client mode"),
        ("log.filter=a=b=c", "a=b=c", "level"),
        ("store.directory=''", "empty", "directory"),
        ("http.token=''", "(hidden)", "visible ASCII"),
    ];
    for (flag, value, rule) in cases {
        let message = refusal("", &[], &[flag]);
        let section = flag.split('.').next().expect("a section");
        for part in [section, value, rule] {
            assert!(message.contains(part), "{flag}: {message}");
        }
    }
}

#[test]
fn senseless_settings_of_a_space_name_space_field_and_rule() {
    let message = refusal("[spaces.lab]\ngrid_ratio = 0.5\n", &[], &[]);
    for part in ["spaces.lab", "grid_ratio", "above 1"] {
        assert!(message.contains(part), "{message}");
    }
}

#[test]
fn a_missing_file_is_an_error_that_names_it() {
    let error = Config::from_sources(Some(Path::new("nowhere/cogmap.toml")), [], &[]);
    assert!(
        error
            .expect_err("no such file")
            .to_string()
            .contains("nowhere")
    );
}

#[test]
fn the_token_comes_from_its_file_and_is_never_shown() {
    let mut file = tempfile::NamedTempFile::new().expect("a temporary file");
    file.write_all(b"s3cret\nrest\n").expect("written");
    let flag = format!("http.token_file={}", file.path().display());
    let config = load("", &[], &[&flag]).expect("loads");
    assert_eq!(config.http.token, Some(Token::new("s3cret")));
    assert!(!config.to_toml().contains("s3cret"), "{}", config.to_toml());
    assert!(!format!("{config:?}").contains("s3cret"));
    assert!(refusal("", &[], &[&flag, "http.token=other"]).contains("http.token_file"));
}

#[test]
fn printed_settings_read_back() {
    let config = load("[spaces.a]\nseed = 9\n[log]\nformat = 'json'\n", &[], &[]).expect("loads");
    let again: Config = toml::from_str(&config.to_toml()).expect("parses");
    assert_eq!(again, config);
}

#[test]
fn other_defaults_lie_under_all_that_is_said() {
    let mut file = tempfile::NamedTempFile::new().expect("a temporary file");
    file.write_all(b"[http]\nrequests_max = 7\nstreams_max = 7\n")
        .expect("written");
    let defaults = "http = { listen = '127.0.0.1:1', requests_max = 9 }\nspaces = { demo = {} }\n";
    let defaults: toml::Table = toml::from_str(defaults).expect("settings are TOML");
    let load = |environment: &[(&str, &str)], flags: &[&str]| {
        let environment = environment
            .iter()
            .map(|(name, value)| ((*name).to_owned(), (*value).to_owned()));
        let flags: Vec<_> = flags.iter().map(|flag| (*flag).to_owned()).collect();
        let (defaults, path) = (defaults.clone(), Some(file.path()));
        Config::from_sources_over(defaults, path, environment, &flags).expect("loads")
    };
    let config = load(&[], &[]);
    assert_eq!(
        (config.http.listen.port(), config.http.requests_max),
        (1, 7)
    );
    let spaces: Vec<_> = config.spaces.keys().map(ToString::to_string).collect();
    assert_eq!(spaces, ["demo"]);
    let config = load(&[("COGMAP_HTTP__LISTEN", "127.0.0.1:2")], &[]);
    assert_eq!(config.http.listen.port(), 2);
    let config = load(&[], &["http.listen=127.0.0.1:3", "spaces.other.seed=4"]);
    assert_eq!(config.http.listen.port(), 3);
    assert_eq!(config.spaces.len(), 2);
}

#[test]
fn a_single_text_is_a_list_of_one() {
    let client = ["zenoh.mode=client", "zenoh.connect=tcp/127.0.0.1:7447"];
    let config = load("", &[], &client).expect("loads");
    assert_eq!(config.zenoh.connect, ["tcp/127.0.0.1:7447"]);
    // A client takes no port of its own unless it is told to.
    assert!(config.zenoh.endpoints().is_empty());
    let listens = [client[0], client[1], "zenoh.listen=tcp/127.0.0.1:7448"];
    let config = load("", &[], &listens).expect("loads");
    assert_eq!(config.zenoh.endpoints(), ["tcp/127.0.0.1:7448"]);
    assert_eq!(
        load("", &[], &[]).expect("loads").zenoh.endpoints().len(),
        1
    );
    // A list of numbers would not become one of texts.
    refusal("", &[], &["zenoh.connect=7"]);
}
