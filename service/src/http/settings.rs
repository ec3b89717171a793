//! What the HTTP interface needs to know.

use std::time::Duration;

use super::hosts::HostRule;
use super::token::Token;

/// Settings of the HTTP interface. The settings file explains them.
#[derive(Clone, Debug)]
pub struct HttpSettings {
    /// Bearer token that requests must carry; absent, none is asked for.
    pub token: Option<Token>,
    /// Which hosts the service answers as.
    pub hosts: HostRule,
    /// Origins of pages that may ask and change everything as the service's own page may.
    pub cors_origins: Vec<String>,
    /// Longest time from a request's head to the head of its answer.
    pub request_timeout: Duration,
    /// Most requests under way.
    pub requests_max: usize,
    /// Most open event streams.
    pub streams_max: usize,
    /// Most connections; for a further one, the one that has waited longest without a request under
    /// way is closed.
    pub connections_max: usize,
    /// Longest time for the head of a request.
    pub head_timeout: Duration,
    /// A connection on which nothing passes for this time is closed.
    pub idle_timeout: Duration,
    /// Longest wait for open requests when the service stops.
    pub shutdown_timeout: Duration,
}
