//! Whether the engine can do its work.

use std::sync::Arc;

use super::{Engine, Space};

/// Whether the service can do its work.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Readiness {
    /// It can.
    Ready,
    /// It can, but for these spaces, which are stopped because they are damaged.
    ReadyBut {
        /// Their names, each with the reason.
        stopped: Vec<(String, String)>,
    },
    /// These spaces are still loading.
    Recovering {
        /// Their names.
        spaces: Vec<String>,
    },
    /// It takes no samples.
    Failed {
        /// Why.
        detail: String,
    },
}

impl Engine {
    /// Whether the service can do its work.
    pub fn readiness(&self) -> Readiness {
        let (spaces, shards) = (self.0.spaces.load(), self.0.shards.load());
        if let Some(detail) = shards.values().find_map(|shard| shard.health().failed()) {
            return Readiness::Failed { detail };
        }
        if let Some(detail) = spaces.values().find_map(|space| space.failure()) {
            return Readiness::Failed { detail };
        }
        let recovering: Vec<_> = spaces
            .values()
            .filter(|space| space.recovering())
            .map(|space| space.name().to_owned())
            .collect();
        if !recovering.is_empty() {
            return Readiness::Recovering { spaces: recovering };
        }
        let reason = |space: &Arc<Space>| {
            let reason = space.stop_reason()?;
            Some((space.name().to_owned(), reason.to_owned()))
        };
        let stopped: Vec<_> = spaces.values().filter_map(reason).collect();
        match &*stopped {
            [] => Readiness::Ready,
            [(_, reason), ..] if stopped.len() == spaces.len() => Readiness::Failed {
                detail: format!("all spaces are stopped; {reason}"),
            },
            _ => Readiness::ReadyBut { stopped },
        }
    }
}
