//! cogmap: a shared spatial memory for robot teams.
//!
//! Samples come in over Zenoh or HTTP, are journaled, folded into the cognitive map, and answered
//! over HTTP and Zenoh. Data flow one way: decode → journal → apply → snapshot → answer.
//! ARCHITECTURE.md describes the house.

pub mod answer;
pub mod cli;
pub mod cluster;
pub mod config;
pub mod decode;
mod descriptors;
pub mod encode;
pub mod engine;
pub mod http;
pub mod journal;
pub mod metrics;
mod ports;
pub mod problem;
pub mod service;
pub mod store;
pub mod transport;
