//! Key expressions.
//!
//! ```text
//! cogmap/{space}/{agent}/samples     in   SampleBatch
//! cogmap/{space}/{agent}/estimate    out  Estimate
//! cogmap/{space}/{agent}/durable     out  Watermark
//! cogmap/{space}/events              out  Event
//! …/estimate, durable, events + /@json   out  the same as JSON, while somebody listens
//! cogmap/{space}/query/{verb}        queryables, bodies as in HTTP
//! ```

use std::str::FromStr;

use crate::name::{Name, NameError};

/// First chunk of every key.
const ROOT: &str = "cogmap";

/// Parameter of a watermark query's selector (`…/query/watermark?session=7`): the session that a
/// robot asks as. The answer is then the problem `session-in-future` where that session would not
/// be taken.
pub const SESSION_PARAMETER: &str = "session";

/// Where an agent publishes its samples; `space` and `agent` may be `*`.
pub fn samples_key(space: &str, agent: &str) -> String {
    format!("{ROOT}/{space}/{agent}/samples")
}

/// Where an agent's estimates are published.
pub fn estimate_key(space: &str, agent: &str) -> String {
    format!("{ROOT}/{space}/{agent}/estimate")
}

/// Where an agent's watermarks are published.
pub fn durable_key(space: &str, agent: &str) -> String {
    format!("{ROOT}/{space}/{agent}/durable")
}

/// Where a space's events are published.
pub fn events_key(space: &str) -> String {
    format!("{ROOT}/{space}/events")
}

/// Where the same is published as JSON, whatever the service's own encoding, while somebody listens
/// there. Wildcards do not match the last chunk, so who listens to `cogmap/**` gets nothing twice.
pub fn json_key(key: &str) -> String {
    format!("{key}/@json")
}

/// Where a space answers a query.
pub fn query_key(space: &str, verb: &str) -> String {
    format!("{ROOT}/{space}/query/{verb}")
}

/// Space and agent of a samples key.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AgentKey {
    /// Space.
    pub space: Name,
    /// Agent.
    pub agent: Name,
}

/// Why a key is not a samples key.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum KeyError {
    /// The chunks are not `cogmap/{space}/{agent}/samples`.
    #[error("a samples key is cogmap/{{space}}/{{agent}}/samples")]
    Shape,
    /// The space's name is not valid.
    #[error("space: {0}")]
    Space(NameError),
    /// The agent's name is not valid.
    #[error("agent: {0}")]
    Agent(NameError),
}

impl FromStr for AgentKey {
    type Err = KeyError;

    fn from_str(key: &str) -> Result<Self, KeyError> {
        let mut chunks = key.split('/');
        match (
            chunks.next(),
            chunks.next(),
            chunks.next(),
            chunks.next(),
            chunks.next(),
        ) {
            (Some(ROOT), Some(space), Some(agent), Some("samples"), None) => Ok(Self {
                space: space.parse().map_err(KeyError::Space)?,
                agent: agent.parse().map_err(KeyError::Agent)?,
            }),
            _ => Err(KeyError::Shape),
        }
    }
}
