//! The spaces and agents that questions name.

use std::sync::Arc;

use cogmap_proto::Name;

use crate::decode::unknown_agent;
use crate::engine::{AgentView, Engine, Space};
use crate::problem::{Kind, Problem};

/// The space of a name in a path or a key.
///
/// # Errors
/// There is none, it is stopped, or the name is none that a space can have.
pub fn space_named(engine: &Engine, name: &str) -> Result<Arc<Space>, Problem> {
    let space = any_space_named(engine, name)?;
    match space.stop_reason() {
        Some(reason) => Err(Problem::space_stopped(reason)),
        None => Ok(space),
    }
}

/// The space of a name, stopped or not.
///
/// # Errors
/// There is none, or the name is none that a space can have.
pub fn any_space_named(engine: &Engine, name: &str) -> Result<Arc<Space>, Problem> {
    // Only what was not found needs the name's rules: what exists has a valid one.
    engine.space(name).ok_or_else(|| match Name::check(name) {
        Ok(()) if !engine.owns(name) => Problem::moving(name),
        Ok(()) => Problem::unknown_space(name),
        Err(error) => Problem::new(Kind::InvalidPath, format!("{name:?}: {error}")),
    })
}

/// The agent that a question names.
///
/// # Errors
/// There is none, or the name is none that an agent can have; or the space is still loading, and
/// nobody knows.
pub fn agent_named(space: &Space, name: &str) -> Result<Arc<AgentView>, Problem> {
    if let Some(view) = space.agent(name) {
        return Ok(view);
    }
    Err(nobody_named(space, name))
}

/// Checks that a question names an agent, or one that has been removed.
///
/// # Errors
/// There was never one, or the name is none that an agent can have; or the space is still loading,
/// and nobody knows.
pub fn agent_once_named(space: &Space, name: &str) -> Result<(), Problem> {
    if space.agent(name).is_some() || space.has_removed(name) {
        return Ok(());
    }
    Err(nobody_named(space, name))
}

/// Why there is no agent of a name; there may have been one.
pub fn nobody_named(space: &Space, name: &str) -> Problem {
    if let Err(error) = space.available() {
        error.into()
    } else if space.has_removed(name) {
        let detail = format!("the agent {name:?} has been removed");
        Problem::new(Kind::RemovedAgent, detail)
    } else {
        unknown_agent(name).into()
    }
}
