//! Settings of the HTTP interface.

use std::net::{Ipv4Addr, SocketAddr};
use std::path::PathBuf;
use std::time::Duration;

use serde::de::{Deserialize, Deserializer, Error};

use super::ConfigError;
use super::setting::{COUNT, INTERVAL_S, Rule, any, section};
use crate::http::{HostRule, HttpSettings, Token};

/// What a header can carry.
const TOKEN: Rule<Option<Token>> = Rule {
    words: "visible ASCII without spaces, at least one character",
    holds: |token| token.as_ref().is_none_or(Token::is_presentable),
    shown: |_| "(hidden)".to_owned(),
};

const HOSTS: Rule<Vec<String>> = Rule {
    words: "names of hosts, without scheme and port, or \"*\"",
    holds: |names| names.iter().all(|name| is_host(name)),
    shown: |names| {
        names
            .iter()
            .find(|name| !is_host(name))
            .cloned()
            .unwrap_or_default()
    },
};

const ORIGINS: Rule<Vec<String>> = Rule {
    words: "origins in lower case: http:// or https://, a host, and a port if it is not the usual one",
    holds: |origins| origins.iter().all(|origin| is_origin(origin)),
    shown: |origins| {
        origins
            .iter()
            .find(|origin| !is_origin(origin))
            .cloned()
            .unwrap_or_default()
    },
};

section! {
    /// Settings of the HTTP interface.
    pub struct HttpConfig of "http" {
        /// Address and port; port 0 takes a free one.
        #[serde(deserialize_with = "address")]
        listen: SocketAddr = SocketAddr::from((Ipv4Addr::LOCALHOST, 8080)), any("an address and a port");
        /// Bearer token that every request but those for health and the pages must carry; absent,
        /// none is asked for.
        #[serde(skip_serializing_if = "Option::is_none")]
        token: Option<Token> = None, TOKEN;
        /// File whose first line is the token, instead of `token`.
        #[serde(skip_serializing_if = "Option::is_none")]
        token_file: Option<PathBuf> = None,
            any("the path of a file, absent when http.token is set");
        /// Names of hosts by which the service is asked, beside its addresses, `localhost` and the
        /// host of `cluster.address`; `*` stands for any.
        hosts: Vec<String> = Vec::new(), HOSTS;
        /// Origins of pages, such as `https://map.example.org`, that may ask and change everything
        /// as the service's own page may.
        cors_origins: Vec<String> = Vec::new(), ORIGINS;
        /// Longest time from a request's head to the head of its answer \[s\].
        request_timeout_s: f64 = 30.0, INTERVAL_S;
        /// Most requests under way; further ones are told to come back.
        requests_max: usize = 1024, COUNT;
        /// Most open event streams; further ones are told to come back.
        streams_max: usize = 256, COUNT;
        /// Most connections; for a further one, the one that has waited longest without a request
        /// under way is closed.
        connections_max: usize = 4096, COUNT;
        /// Longest time for the head of a request, from its first byte or the connection's begin
        /// \[s\].
        head_timeout_s: f64 = 10.0, INTERVAL_S;
        /// A connection on which nothing passes for as long is closed \[s\]. Above
        /// `request_timeout_s`.
        idle_timeout_s: f64 = 60.0, INTERVAL_S;
        /// Longest wait for open requests when the service stops \[s\].
        shutdown_timeout_s: f64 = 5.0, INTERVAL_S;
    }
}

/// An address with its port, given as a text.
fn address<'de, D: Deserializer<'de>>(deserializer: D) -> Result<SocketAddr, D::Error> {
    const EXPECTED: &str = "expected an IP address and a port, like 127.0.0.1:8080 or [::1]:8080";
    let given = toml::Value::deserialize(deserializer)?;
    let text = given
        .as_str()
        .map_or_else(|| given.to_string(), str::to_owned);
    text.parse().map_err(|_| {
        let port = text.parse::<u16>();
        let also = port.map_or_else(
            |_| String::new(),
            |port| {
                format!(", a port alone; 127.0.0.1:{port} serves this machine, 0.0.0.0:{port} all")
            },
        );
        D::Error::custom(format!("{EXPECTED}, not {text}{also}"))
    })
}

fn is_host(name: &str) -> bool {
    let legal = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '.' | '_');
    name == "*" || (!name.is_empty() && name.chars().all(legal))
}

/// Whether a text is an origin as browsers write it (RFC 6454, section 6.2).
fn is_origin(text: &str) -> bool {
    let authority = text
        .strip_prefix("http://")
        .or_else(|| text.strip_prefix("https://"));
    let legal = |c: char| {
        c.is_ascii_lowercase() || c.is_ascii_digit() || matches!(c, '-' | '.' | ':' | '[' | ']')
    };
    authority.is_some_and(|authority| !authority.is_empty() && authority.chars().all(legal))
}

impl HttpConfig {
    /// Whether others than this machine can use the interface without a token.
    pub fn is_open(&self) -> bool {
        self.token.is_none() && !self.listen.ip().is_loopback()
    }

    /// What the HTTP interface itself needs to know. The times must have been checked.
    pub fn settings(&self) -> HttpSettings {
        HttpSettings {
            token: self.token.clone(),
            hosts: HostRule::new(&self.hosts, self.token.is_some()),
            cors_origins: self.cors_origins.clone(),
            request_timeout: Duration::from_secs_f64(self.request_timeout_s),
            requests_max: self.requests_max,
            streams_max: self.streams_max,
            connections_max: self.connections_max,
            head_timeout: Duration::from_secs_f64(self.head_timeout_s),
            idle_timeout: Duration::from_secs_f64(self.idle_timeout_s),
            shutdown_timeout: Duration::from_secs_f64(self.shutdown_timeout_s),
        }
    }

    pub(super) fn read_token_file(&mut self) -> Result<(), ConfigError> {
        let Some(path) = &self.token_file else {
            return Ok(());
        };
        let shown = path.display().to_string();
        if self.token.is_some() {
            return Err(ConfigError::Invalid {
                key: "http.token_file",
                value: shown,
                rule: "absent when http.token is set",
            });
        }
        let source = format!("http.token_file {shown}");
        let text =
            std::fs::read_to_string(path).map_err(|error| ConfigError::source(&source, &error))?;
        let token = Token::new(text.lines().next().unwrap_or_default().trim());
        if !token.is_presentable() {
            let detail = format!(
                "its first line, which is the token, must be {}",
                TOKEN.words
            );
            return Err(ConfigError::source(&source, &detail));
        }
        self.token = Some(token);
        Ok(())
    }

    pub(super) fn check(&self) -> Result<(), ConfigError> {
        self.check_values()?;
        // Nothing passes on a connection while an answer is made.
        if self.idle_timeout_s > self.request_timeout_s {
            return Ok(());
        }
        Err(ConfigError::Invalid {
            key: "http.idle_timeout_s",
            value: self.idle_timeout_s.to_string(),
            rule: "above http.request_timeout_s",
        })
    }
}
