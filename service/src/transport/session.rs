//! The Zenoh session and its settings.

use std::fmt::Display;
use std::fs::File;
use std::path::{Path, PathBuf};

use zenoh::{Config, Session};

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
        Self(error.to_string())
    }
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
