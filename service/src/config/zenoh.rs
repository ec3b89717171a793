//! Settings of the Zenoh session.

use std::path::PathBuf;

use cogmap_proto::Codec;
use serde::{Deserialize, Serialize};

use super::ConfigError;
use super::rule::check;

/// Settings of the Zenoh session.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ZenohConfig {
    /// Whether there is a session; without one, samples come over HTTP alone.
    pub enabled: bool,
    /// Part that the service plays in the network.
    pub mode: ZenohMode,
    /// Endpoints that the service listens on, like `tcp/0.0.0.0:7447`.
    pub listen: Vec<String>,
    /// Endpoints that it connects to.
    pub connect: Vec<String>,
    /// Zenoh's own configuration (JSON5), which the keys above are put over.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub config_file: Option<PathBuf>,
    /// Most sessions of others: robots, and whoever listens or asks.
    pub sessions_max: usize,
    /// Codec of what the service publishes.
    pub encoding: ZenohEncoding,
}

/// Part of a Zenoh node in its network.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ZenohMode {
    /// Talks with any other node directly.
    Peer,
    /// Talks through one router.
    Client,
    /// Routes for others too.
    Router,
}

/// Codec of what the service publishes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ZenohEncoding {
    /// postcard: shortest, for Rust clients.
    Postcard,
    /// CBOR: short, for every language.
    Cbor,
    /// JSON: readable.
    Json,
}

impl Default for ZenohConfig {
    fn default() -> Self {
        Self {
            enabled: true,
            mode: ZenohMode::Peer,
            listen: vec!["tcp/127.0.0.1:7447".to_owned()],
            connect: Vec::new(),
            config_file: None,
            sessions_max: 1000,
            encoding: ZenohEncoding::Cbor,
        }
    }
}

impl ZenohConfig {
    pub(super) fn check(&self) -> Result<(), ConfigError> {
        let rule = "endpoints that begin with tcp/ or tls/";
        for (key, endpoints) in [
            ("zenoh.listen", &self.listen),
            ("zenoh.connect", &self.connect),
        ] {
            for endpoint in endpoints {
                let known = ["tcp/", "tls/"].iter().any(|link| {
                    endpoint
                        .strip_prefix(link)
                        .is_some_and(|rest| !rest.is_empty())
                });
                check(known, key, &format_args!("{endpoint:?}"), rule)?;
            }
        }
        let sessions = self.sessions_max;
        let in_range = (1..=1_000_000).contains(&sessions);
        check(in_range, "zenoh.sessions_max", &sessions, "1 to 1000000")?;
        let alone =
            self.mode == ZenohMode::Client && self.connect.is_empty() && self.config_file.is_none();
        check(
            !alone,
            "zenoh.connect",
            &"empty",
            "at least one router in client mode",
        )
    }
}

impl ZenohMode {
    /// The word that Zenoh's own configuration has for it.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Peer => "peer",
            Self::Client => "client",
            Self::Router => "router",
        }
    }
}

impl ZenohEncoding {
    /// The codec.
    pub fn codec(self) -> Codec {
        match self {
            Self::Postcard => Codec::Postcard,
            Self::Cbor => Codec::Cbor,
            Self::Json => Codec::Json,
        }
    }
}
