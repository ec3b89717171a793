//! The Zenoh session and its settings.

use std::fmt::Display;
use std::fs::File;
use std::path::{Path, PathBuf};

use zenoh::{Config, Session};

use crate::ports::is_reachable;

/// How the service takes part in a Zenoh network.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TransportSettings {
    /// `router` (robots connect here and see each other too), `peer` or `client`.
    pub mode: String,
    /// Endpoints to listen on, such as `tcp/127.0.0.1:7447`.
    pub listen: Vec<String>,
    /// Endpoints to connect to.
    pub connect: Vec<String>,
    /// A Zenoh configuration file (JSON5) underneath these settings: TLS, passwords, access
    /// control.
    pub config_file: Option<PathBuf>,
    /// Most sessions of others.
    pub sessions_max: usize,
    /// Most connections that are not yet a session.
    pub handshakes_max: usize,
}

/// Key of the file with users and their passwords.
const PASSWORDS: &str = "transport/auth/usrpwd/dictionary_file";
/// Key that says whether whoever connects over TLS shows a certificate.
const MTLS: &str = "transport/link/tls/enable_mtls";
/// Keys of the service's own certificate and key, each as a file or as it is.
const CERTIFICATE: [&str; 2] = [
    "transport/link/tls/listen_certificate",
    "transport/link/tls/listen_certificate_base64",
];
const PRIVATE_KEY: [&str; 2] = [
    "transport/link/tls/listen_private_key",
    "transport/link/tls/listen_private_key_base64",
];
/// Key of Zenoh's bound on sessions.
const SESSIONS: &str = "transport/unicast/max_sessions";
/// Key of Zenoh's bound on connections that are not yet a session.
const HANDSHAKES: &str = "transport/unicast/accept_pending";

/// What keeps whoever does not read from holding up others, where the configuration file says
/// nothing else. The threads that receive for the whole session also pass messages on, and would
/// wait for a congested link.
const PATIENCE: [(&str, &str); 3] = [
    // Samples that someone else listens to are passed on as far as its link takes them, after
    // everything that the service itself says. Answers get the priority of their query, so that of
    // the queries is fixed: no answer stands in the way of estimates and watermarks.
    (
        "qos/network",
        r#"[
            {
                id: "cogmap_pass_on",
                messages: ["put", "delete"],
                flows: ["egress"],
                qos: { congestion_control: "block" },
                overwrite: { congestion_control: "drop", priority: "data_low" },
            },
            {
                id: "cogmap_ask",
                messages: ["query"],
                flows: ["ingress"],
                overwrite: { priority: "data" },
            },
        ]"#,
    ),
    // Declarations and answers are never dropped: a link that takes none for a second is closed
    // [us].
    (
        "transport/link/tx/queue/congestion_control/block/wait_before_close",
        "1000000",
    ),
    // A connection has three seconds to become a session [ms]: silent ones make room for others.
    ("transport/unicast/accept_timeout", "3000"),
];

/// Why the transport does not work.
#[derive(Debug, thiserror::Error)]
#[error("zenoh: {0}")]
pub struct TransportError(String);

impl From<zenoh::Error> for TransportError {
    fn from(error: zenoh::Error) -> Self {
        Self(without_sources(&error.to_string()))
    }
}

/// What Zenoh says, without the lines of its source (` at /…/utils.rs:532.`).
fn without_sources(text: &str) -> String {
    let is_source = |part: &str| {
        let (file, line) = part.trim_end_matches('.').rsplit_once(".rs:")?;
        let is_line = line.bytes().all(|byte| byte.is_ascii_digit());
        (is_line && !file.contains(' ')).then_some(())
    };
    let parts = text.split(" at ");
    let kept: Vec<_> = parts.filter(|part| is_source(part).is_none()).collect();
    kept.join(" at ")
}

/// Endpoints that others than this machine reach, where nobody has to say who it is: neither by a
/// password nor by a certificate.
///
/// # Errors
/// The configuration file cannot be read.
pub(crate) fn open_endpoints(settings: &TransportSettings) -> Result<Vec<&str>, TransportError> {
    let config = config(settings)?;
    let is_set = |key| config.get_json(key).is_ok_and(|value| value != "null");
    let asks_certificates = config.get_json(MTLS).is_ok_and(|value| value == "true");
    if is_set(PASSWORDS) {
        return Ok(Vec::new());
    }
    let is_open = |endpoint: &&str| {
        let shows_certificate = asks_certificates && endpoint.starts_with("tls/");
        is_reachable(endpoint) && !shows_certificate
    };
    let listen = settings.listen.iter().map(String::as_str);
    Ok(listen.filter(is_open).collect())
}

/// Opens the session. Scouting by multicast is off: who talks to whom is written down.
///
/// # Errors
/// The configuration is refused, an endpoint cannot be listened on, or, in client mode, nobody
/// answers.
pub async fn open(settings: &TransportSettings) -> Result<Session, TransportError> {
    Ok(zenoh::open(config(settings)?).await?)
}

fn config(settings: &TransportSettings) -> Result<Config, TransportError> {
    let mut config = match &settings.config_file {
        Some(file) => read(file)?,
        None => Config::default(),
    };
    check_certificate(settings, &config)?;
    let quoted = |value: &[String]| serde_json::json!(value).to_string();
    config.insert_json5("mode", &serde_json::json!(settings.mode).to_string())?;
    config.insert_json5("listen/endpoints", &quoted(&settings.listen))?;
    config.insert_json5("connect/endpoints", &quoted(&settings.connect))?;
    config.insert_json5("scouting/multicast/enabled", "false")?;
    let defaults = Config::default();
    for (key, value) in PATIENCE {
        if config.get_json(key)? == defaults.get_json(key)? {
            config.insert_json5(key, value)?;
        }
    }
    config.insert_json5(SESSIONS, &settings.sessions_max.to_string())?;
    let (handshakes, most) = (config.get_json(HANDSHAKES)?, settings.handshakes_max);
    let fewer = handshakes.parse().is_ok_and(|own: usize| own <= most);
    if handshakes == defaults.get_json(HANDSHAKES)? || !fewer {
        config.insert_json5(HANDSHAKES, &most.to_string())?;
    }
    Ok(config)
}

/// Refuses to listen over TLS without a certificate. An endpoint may bring its own after `#`.
fn check_certificate(settings: &TransportSettings, config: &Config) -> Result<(), TransportError> {
    let is_set = |key: &&str| config.get_json(key).is_ok_and(|value| value != "null");
    let has_own = |keys: [&str; 2]| keys.iter().any(is_set);
    if has_own(CERTIFICATE) && has_own(PRIVATE_KEY) {
        return Ok(());
    }
    let mut over_tls = { settings.listen.iter() }
        .filter(|endpoint| endpoint.starts_with("tls/") && !endpoint.contains('#'));
    over_tls.next().map_or(Ok(()), |endpoint| {
        Err(TransportError(format!(
            "{endpoint} needs a certificate and its key: name them in zenoh.config_file as {} and \
             {} (docs/security.md)",
            CERTIFICATE[0], PRIVATE_KEY[0]
        )))
    })
}

/// Reads a configuration file. An error names it, where Zenoh's names a line of Zenoh's source.
fn read(file: &Path) -> Result<Config, TransportError> {
    let of_file =
        |error: &dyn Display| TransportError(format!("config_file {}: {error}", file.display()));
    File::open(file).map_err(|error| of_file(&error))?;
    Config::from_file(file).map_err(|error| of_file(&error))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_cannot_be_read_is_named() {
        let file = Path::new("/absent/zenoh.json5");
        let error = read(file).expect_err("there is no such file").to_string();
        assert_eq!(
            error,
            "zenoh: config_file /absent/zenoh.json5: No such file or directory (os error 2)"
        );
    }

    #[test]
    fn a_message_of_zenoh_names_no_line_of_its_source() {
        let said = "Cannot listen on 127.0.0.1:1. No key. at /a/zenoh-1.10.2/src/utils.rs:532. \
            at /a/unicast.rs:426.";
        assert_eq!(
            without_sources(said),
            "Cannot listen on 127.0.0.1:1. No key."
        );
        assert_eq!(without_sources("look at this"), "look at this");
    }

    fn settings(listen: &str, config_file: Option<PathBuf>) -> TransportSettings {
        TransportSettings {
            mode: "peer".to_owned(),
            listen: vec![listen.to_owned()],
            connect: Vec::new(),
            config_file,
            sessions_max: 50,
            handshakes_max: 10,
        }
    }

    #[test]
    fn an_endpoint_is_open_unless_whoever_comes_has_to_say_who_it_is() {
        let file = tempfile::NamedTempFile::with_suffix(".json5").expect("a file");
        let text = "{transport: {auth: {usrpwd: {dictionary_file: \"/users.txt\"}}}}";
        std::fs::write(file.path(), text).expect("written");
        let open =
            |settings: &TransportSettings| open_endpoints(settings).expect("a configuration").len();
        assert_eq!(open(&settings("tcp/0.0.0.0:7447", None)), 1);
        assert_eq!(open(&settings("tcp/127.0.0.1:7447", None)), 0);
        let own = Some(file.path().to_owned());
        assert_eq!(open(&settings("tcp/0.0.0.0:7447", own)), 0);
    }

    #[test]
    fn an_endpoint_over_tls_without_a_certificate_says_where_to_name_it() {
        let error = config(&settings("tls/0.0.0.0:7447", None)).expect_err("no certificate");
        let text = error.to_string();
        assert!(
            text.contains("transport/link/tls/listen_certificate"),
            "{text}"
        );
    }

    fn of_file(text: &str) -> Config {
        let file = tempfile::NamedTempFile::with_suffix(".json5").expect("a file");
        std::fs::write(file.path(), text).expect("written");
        config(&TransportSettings {
            mode: "peer".to_owned(),
            listen: Vec::new(),
            connect: Vec::new(),
            config_file: Some(file.path().to_owned()),
            sessions_max: 50,
            handshakes_max: 10,
        })
        .expect("a configuration")
    }

    #[test]
    fn what_the_file_says_stays() {
        let close = "transport/link/tx/queue/congestion_control/block/wait_before_close";
        let plain = of_file("{}");
        assert_eq!(plain.get_json(close).expect("a key"), "1000000");
        assert_eq!(plain.get_json(SESSIONS).expect("a key"), "50");
        assert!(
            plain
                .get_json("qos/network")
                .expect("a key")
                .contains("drop")
        );
        let own = of_file(
            "{transport: {unicast: {accept_pending: 7}, link: {tx: {queue: {\
             congestion_control: {block: {wait_before_close: 3000000}}}}}}}",
        );
        assert_eq!(own.get_json(close).expect("a key"), "3000000");
        assert_eq!(own.get_json(HANDSHAKES).expect("a key"), "7");
        let many = of_file("{transport: {unicast: {accept_pending: 70}}}");
        assert_eq!(many.get_json(HANDSHAKES).expect("a key"), "10");
    }
}
