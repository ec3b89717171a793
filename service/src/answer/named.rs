//! The spaces and agents that questions name.

use std::sync::Arc;

use cogmap_proto::Name;

use super::{Kind, Problem, unknown_agent};
use crate::engine::{AgentDesk, Engine, Space};

/// The space of a name in a path or a key.
///
/// # Errors
/// There is none, or the name is none that a space can have.
pub fn space_named(engine: &Engine, name: &str) -> Result<Arc<Space>, Problem> {
    // Only what was not found needs the name's rules: what exists has a valid one.
    engine.space(name).ok_or_else(|| match Name::check(name) {
        Ok(()) => Problem::unknown_space(name),
        Err(error) => Problem::new(Kind::InvalidPath, format!("{name:?}: {error}")),
    })
}

/// The agent that a question names.
///
/// # Errors
/// There is none, or the name is none that an agent can have; or the space is still loading, and nobody
/// knows.
pub fn agent_named(space: &Space, name: &str) -> Result<Arc<AgentDesk>, Problem> {
    if let Some(desk) = space.agent(name) {
        return Ok(desk);
    }
    space.available()?;
    Err(unknown_agent(name).into())
}
