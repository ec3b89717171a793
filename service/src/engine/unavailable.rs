//! Why a space, or a trajectory in it, cannot be read.

use crate::store::DerivedError;

/// Why a space cannot be read now.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Unavailable {
    /// It is still loading.
    #[error("the space is recovering")]
    Recovering,
    /// It is closing.
    #[error("the space is closing")]
    Closing,
    /// The work on it ended with a panic.
    #[error("the work was interrupted")]
    Interrupted,
    /// It could not be loaded: its journal is damaged.
    #[error("{0}")]
    Stopped(String),
    /// Its writer has failed.
    #[error("{0}")]
    Failed(String),
}

/// Why a trajectory cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum TrajectoryError {
    /// There is no such agent.
    #[error("unknown agent")]
    UnknownAgent,
    /// It has been removed.
    #[error(
        "the agent has been removed; causal trajectories of its sessions can be read by their number"
    )]
    RemovedAgent,
    /// The trajectory does not reach to the stamp: the stamps of its first and last pose \[ns\].
    #[error("{}", out_of_range(.0.as_ref()))]
    OutOfRange(Option<(i64, i64)>),
    /// The stored part cannot be read.
    #[error(transparent)]
    Derived(#[from] DerivedError),
    /// The reading was interrupted.
    #[error("the reading was interrupted")]
    Interrupted,
    /// The map cannot be read.
    #[error(transparent)]
    Unavailable(#[from] Unavailable),
}

fn out_of_range(range: Option<&(i64, i64)>) -> String {
    match range {
        Some((first, last)) => format!("stamp_ns must be {first} to {last}, which is known"),
        None => "nothing is known of where the agent was in that session".to_owned(),
    }
}
