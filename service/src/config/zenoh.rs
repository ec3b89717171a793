//! Settings of the Zenoh session.

use std::path::PathBuf;

use cogmap_proto::Codec;
use serde::{Deserialize, Serialize};

use super::ConfigError;
use super::setting::{COUNT, Rule, any, section};

/// Endpoints, each with a link that the service is built with.
const ENDPOINTS: Rule<Vec<String>> = Rule {
    words: "endpoints that begin with tcp/ or tls/",
    holds: |endpoints| endpoints.iter().all(|endpoint| is_endpoint(endpoint)),
    shown: |endpoints| {
        let mut refused = endpoints.iter().filter(|endpoint| !is_endpoint(endpoint));
        refused
            .next()
            .map_or_else(String::new, |endpoint| format!("{endpoint:?}"))
    },
};

section! {
    /// Settings of the Zenoh session.
    pub struct ZenohConfig of "zenoh" {
        /// Whether there is a session; without one, samples come over HTTP alone.
        enabled: bool = true, any("true or false");
        /// Part that the service plays in the network.
        mode: ZenohMode = ZenohMode::Peer, any("peer, client or router");
        /// Endpoints that the service listens on, like `tcp/0.0.0.0:7447`. A client listens on none
        /// unless it is told to.
        listen: Vec<String> = vec!["tcp/127.0.0.1:7447".to_owned()], ENDPOINTS;
        /// Endpoints that it connects to.
        connect: Vec<String> = Vec::new(), ENDPOINTS;
        /// Zenoh's own configuration (JSON5), which the keys above are put over.
        #[serde(skip_serializing_if = "Option::is_none")]
        config_file: Option<PathBuf> = None, any("the path of a file");
        /// Most sessions of others: robots, and whoever listens or asks.
        sessions_max: usize = 1000, COUNT;
        /// Codec of what the service publishes.
        encoding: ZenohEncoding = ZenohEncoding::Cbor, any("postcard, cbor or json");
    }
}

fn is_endpoint(endpoint: &str) -> bool {
    let mut links = ["tcp/", "tls/"].iter();
    links.any(|link| {
        endpoint
            .strip_prefix(link)
            .is_some_and(|rest| !rest.is_empty())
    })
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

impl ZenohConfig {
    /// The endpoints that the service listens on: a client, which has a router to meet others, does
    /// not take the default one.
    pub fn endpoints(&self) -> &[String] {
        if self.mode == ZenohMode::Client && self.listen == Self::default().listen {
            &[]
        } else {
            &self.listen
        }
    }

    pub(super) fn check(&self) -> Result<(), ConfigError> {
        self.check_values()?;
        let alone =
            self.mode == ZenohMode::Client && self.connect.is_empty() && self.config_file.is_none();
        if alone {
            return Err(ConfigError::Invalid {
                key: "zenoh.connect",
                value: "empty".to_owned(),
                rule: "at least one router in client mode",
            });
        }
        Ok(())
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
