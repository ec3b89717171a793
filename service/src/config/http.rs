//! Settings of the HTTP interface.

use std::net::{Ipv4Addr, SocketAddr};
use std::path::PathBuf;
use std::time::Duration;

use serde::{Deserialize, Serialize};

use super::rule::{INTERVAL_S, check, is_interval_s};
use super::{ConfigError, Token};
use crate::http::{HostRule, HttpSettings};

/// Settings of the HTTP interface.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct HttpConfig {
    /// Address and port; port 0 takes a free one.
    pub listen: SocketAddr,
    /// Bearer token that every request but those for health and the pages must carry; absent, none is
    /// asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub token: Option<Token>,
    /// File whose first line is the token, instead of `token`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub token_file: Option<PathBuf>,
    /// Names of hosts by which the service is asked, beside its addresses and `localhost`; `*` stands for any.
    pub hosts: Vec<String>,
    /// Longest time from a request's head to the head of its answer \[s\].
    pub request_timeout_s: f64,
    /// Most requests under way; further ones are told to come back.
    pub requests_max: usize,
    /// Most open event streams; further ones are told to come back.
    pub streams_max: usize,
    /// Most connections; for a further one, the one that has waited longest without a request under
    /// way is closed.
    pub connections_max: usize,
    /// Longest time for the head of a request, from its first byte or the connection's begin \[s\].
    pub head_timeout_s: f64,
    /// A connection on which nothing passes for as long is closed \[s\].
    pub idle_timeout_s: f64,
    /// Longest wait for open requests when the service stops \[s\].
    pub shutdown_timeout_s: f64,
}

impl Default for HttpConfig {
    fn default() -> Self {
        Self {
            listen: SocketAddr::from((Ipv4Addr::LOCALHOST, 8080)),
            token: None,
            token_file: None,
            hosts: Vec::new(),
            request_timeout_s: 30.0,
            requests_max: 1024,
            streams_max: 256,
            connections_max: 4096,
            head_timeout_s: 10.0,
            idle_timeout_s: 60.0,
            shutdown_timeout_s: 5.0,
        }
    }
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
            let rule = "absent when http.token is set";
            return check(false, "http.token_file", &shown, rule);
        }
        let source = format!("http.token_file {shown}");
        let text =
            std::fs::read_to_string(path).map_err(|error| ConfigError::source(&source, &error))?;
        self.token = Some(Token::new(text.lines().next().unwrap_or_default().trim()));
        Ok(())
    }

    pub(super) fn check(&self) -> Result<(), ConfigError> {
        if let Some(token) = &self.token {
            let rule = "visible ASCII without spaces, at least one character";
            check(token.is_presentable(), "http.token", &"(hidden)", rule)?;
        }
        for name in &self.hosts {
            let is_name = |name: &str| {
                let legal = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '.' | '_');
                !name.is_empty() && name.chars().all(legal)
            };
            let rule = "names of hosts, without scheme and port, or \"*\"";
            check(name == "*" || is_name(name), "http.hosts", name, rule)?;
        }
        let bounds = [
            ("http.requests_max", self.requests_max),
            ("http.streams_max", self.streams_max),
            ("http.connections_max", self.connections_max),
        ];
        for (key, value) in bounds {
            check(
                (1..=1_000_000).contains(&value),
                key,
                &value,
                "1 to 1000000",
            )?;
        }
        let times = [
            ("http.request_timeout_s", self.request_timeout_s),
            ("http.head_timeout_s", self.head_timeout_s),
            ("http.idle_timeout_s", self.idle_timeout_s),
            ("http.shutdown_timeout_s", self.shutdown_timeout_s),
        ];
        for (key, value) in times {
            check(is_interval_s(value), key, &value, INTERVAL_S)?;
        }
        check(
            self.idle_timeout_s > self.request_timeout_s,
            "http.idle_timeout_s",
            &self.idle_timeout_s,
            "above http.request_timeout_s",
        )
    }
}
