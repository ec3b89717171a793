//! Settings of a node in a cluster.

use std::net::SocketAddr;
use std::time::Duration;

use cogmap_proto::Name;

use super::setting::{INTERVAL_S, Rule, any, section};
use super::{Config, ConfigError};

const NODE: Rule<String> = Rule {
    words: "a name, or empty for that of the host",
    holds: |name| name.is_empty() || Name::check(name).is_ok(),
    shown: String::clone,
};

const ADDRESS: Rule<String> = Rule {
    words: "HOST:PORT, or empty for http.listen",
    holds: |address| address.is_empty() || is_address(address),
    shown: String::clone,
};

section! {
    /// Settings of a node in a cluster: several services that share the shards of one store.
    pub struct ClusterConfig of "cluster" {
        /// Whether the service is a node. It needs `store.url`, Zenoh with links to the other
        /// nodes or to routers that they have links to, and a build with the feature
        /// `object-storage`.
        enabled: bool = false, any("true or false");
        /// Name of the node, its own in the cluster; the host's where it is empty.
        node: String = String::new(), NODE;
        /// Where other nodes reach this one over HTTP, `HOST:PORT`; `http.listen` where it is
        /// empty.
        address: String = String::new(), ADDRESS;
        /// How often a node says in the storage that it is there, with one PUT and one LIST \[s\].
        beat_interval_s: f64 = 0.5, INTERVAL_S;
        /// Without contact to the storage for so long, a node gives up its part and answers no
        /// more \[s\].
        lease_s: f64 = 5.0, INTERVAL_S;
        /// Whether the node follows the shards of others, too, and answers questions about them
        /// where the request allows it by `max_age_ms`. It then holds all maps in memory.
        replicas: bool = false, any("true or false");
    }
}

fn is_address(address: &str) -> bool {
    let parts = address.rsplit_once(':');
    let is_of_host = |c: char| c.is_ascii_alphanumeric() || "-._:[]".contains(c);
    parts.is_some_and(|(host, port)| {
        !host.is_empty() && host.chars().all(is_of_host) && port.parse::<u16>().is_ok()
    })
}

impl ClusterConfig {
    /// How often a node says that it is there.
    pub fn beat_interval(&self) -> Duration {
        Duration::from_secs_f64(self.beat_interval_s)
    }

    /// How long a node does without contact to the storage.
    pub fn lease(&self) -> Duration {
        Duration::from_secs_f64(self.lease_s)
    }

    /// Where other nodes reach this one, which listens on an address.
    pub fn address(&self, listens: SocketAddr) -> String {
        if self.address.is_empty() {
            listens.to_string()
        } else {
            self.address.clone()
        }
    }

    /// The node's name.
    pub fn node(&self) -> String {
        if !self.node.is_empty() {
            return self.node.clone();
        }
        let host = rustix::system::uname();
        let host = host.nodename().to_string_lossy();
        let host: String = { host.chars() }
            .map(|c| if c.is_ascii_alphanumeric() { c } else { '-' })
            .collect();
        // A name begins with a letter or a digit.
        let host = host.trim_start_matches('-');
        if host.is_empty() { "node" } else { host }.to_owned()
    }

    pub(super) fn check(&self, config: &Config) -> Result<(), ConfigError> {
        self.check_values()?;
        let refused = |key, rule| {
            let value = "in force".to_owned();
            Err(ConfigError::Invalid { key, value, rule })
        };
        if !self.enabled {
            return Ok(());
        }
        if cfg!(not(feature = "object-storage")) {
            let rule = "off in a program built without --features object-storage";
            return refused("cluster.enabled", rule);
        }
        if config.store.url.is_empty() {
            return refused("cluster.enabled", "off without store.url");
        }
        if !config.zenoh.enabled {
            return refused("cluster.enabled", "off without zenoh.enabled");
        }
        if config.cluster.address.is_empty() && config.http.listen.ip().is_unspecified() {
            let rule = "off without cluster.address where http.listen is any address";
            return refused("cluster.enabled", rule);
        }
        if self.lease_s < 3.0 * self.beat_interval_s {
            return Err(ConfigError::Invalid {
                key: "cluster.lease_s",
                value: self.lease_s.to_string(),
                rule: "at least three times cluster.beat_interval_s",
            });
        }
        Ok(())
    }
}
