//! The Zenoh session and its settings.

use std::path::PathBuf;

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
    /// A Zenoh configuration file (JSON5) underneath these settings: TLS, passwords, access control.
    pub config_file: Option<PathBuf>,
}

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
        Some(file) => Config::from_file(file)?,
        None => Config::default(),
    };
    let quoted = |value: &[String]| serde_json::json!(value).to_string();
    config.insert_json5("mode", &serde_json::json!(settings.mode).to_string())?;
    config.insert_json5("listen/endpoints", &quoted(&settings.listen))?;
    config.insert_json5("connect/endpoints", &quoted(&settings.connect))?;
    config.insert_json5("scouting/multicast/enabled", "false")?;
    Ok(config)
}
