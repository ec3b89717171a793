//! Agents that are removed, and sessions that may begin, as everyone but the writer sees them.

use cogmap_proto::Name;
use tokio::sync::oneshot;

use super::message::{Call, IngestError, RemovalRequest};
use super::space::Space;

impl Space {
    /// Whether an agent of that name was removed that had been in the map, and none has come since.
    pub fn has_removed(&self, name: &str) -> bool {
        self.agent(name).is_none() && !self.shared().former(name).is_empty()
    }

    /// Whether a session of an agent may begin now, or has begun.
    ///
    /// # Errors
    /// It lies too far in the future.
    pub fn check_session(&self, agent: &str, session: u64) -> Result<(), IngestError> {
        let current = self.agent(agent).map(|view| view.watermark().session);
        match current {
            Some(current) if session <= current => Ok(()),
            _ => self.shared().sessions.check(session),
        }
    }

    /// Removes an agent and answers when that is durable. What it did in the map stays, and its
    /// name is free.
    ///
    /// # Errors
    /// See [`IngestError`].
    pub async fn remove_agent(&self, agent: &Name) -> Result<(), IngestError> {
        let (reply, answer) = oneshot::channel();
        self.call(Call::Removal(RemovalRequest {
            agent: agent.as_str().into(),
            reply,
        }))?;
        answer.await.unwrap_or(Err(IngestError::Closed))
    }
}
