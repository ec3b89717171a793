//! What can go wrong between a robot and its service.

use std::time::Duration;

use cogmap_proto::NameError;

/// Why a robot's call failed.
#[derive(Debug, thiserror::Error)]
pub enum ClientError {
    /// The space's name cannot stand in a key.
    #[error("name of the space: {0}")]
    Space(#[source] NameError),
    /// The agent's name cannot stand in a key.
    #[error("name of the agent: {0}")]
    Agent(#[source] NameError),
    /// A setting is out of its range.
    #[error("settings: {0}")]
    Settings(&'static str),
    /// No router answered in time.
    #[error("no Zenoh router at {endpoints:?} let this robot in within {timeout:?}: {source}")]
    Connect {
        /// Where it was sought.
        endpoints: Vec<String>,
        /// For how long.
        timeout: Duration,
        /// What the last attempt said.
        #[source]
        source: zenoh::Error,
    },
    /// Zenoh refused a declaration.
    #[error("declare on Zenoh: {0}")]
    Declare(#[source] zenoh::Error),
    /// The thread that sends could not be started.
    #[error("start the sending thread: {0}")]
    Thread(#[source] std::io::Error),
    /// The sample is longer than any message may be. It was not taken.
    #[error("a sample of up to {bytes} bytes does not fit into a message")]
    SampleTooLong {
        /// Bound of its length \[bytes\].
        bytes: usize,
    },
    /// JSON cannot carry a NaN or infinity. The sample was not taken.
    #[error("JSON carries no NaN and no infinity")]
    NotFinite,
    /// The window stayed full for the whole `send_timeout`: the service does not acknowledge.
    /// Of a batch, the first `taken` samples are in the window; the others were not taken.
    #[error("window full: {pending} samples wait for the service; {taken} of this call were taken")]
    WindowFull {
        /// Samples that no watermark covers.
        pending: u64,
        /// Samples of this call that were taken.
        taken: usize,
    },
    /// Another run of the agent has a larger session number, or the same one: this run is over. Its
    /// samples beyond the last watermark are not acknowledged and never will be.
    #[error("{}", superseded(*session, *by))]
    SessionSuperseded {
        /// This robot's session.
        session: u64,
        /// The session that took over; this robot's own number when another run uses it too.
        by: u64,
    },
    /// The service does not let this run begin; none of its samples is taken.
    #[error("{detail}")]
    SessionRefused {
        /// What the service says.
        detail: String,
    },
    /// The Zenoh settings of the credentials cannot be used.
    #[error("Zenoh settings of the credentials: {0}")]
    Credentials(#[source] zenoh::Error),
    /// Not everything became durable in time. Nothing is lost: sending goes on.
    #[error("{pending} samples are not durable yet{}", silence(*is_heard))]
    FlushTimeout {
        /// Samples that no watermark covers.
        pending: u64,
        /// Whether the service has acknowledged anything of this run.
        is_heard: bool,
    },
    /// No estimate that includes all samples came in time. Sending goes on.
    #[error("no estimate that includes all samples came in time")]
    EstimateTimeout,
}

/// What may be wrong when the service says nothing at all: Zenoh tells nobody what its access rules
/// drop.
fn silence(is_heard: bool) -> &'static str {
    if is_heard {
        ""
    } else {
        ", and the service has not acknowledged any: it may not be running, it may have no such space, or the \
         access rules of Zenoh may not let this user publish under the agent's name or hear of it"
    }
}

fn superseded(session: u64, by: u64) -> String {
    if by == session {
        format!("session {session} is in use by another run of the agent")
    } else {
        format!("session {session} was taken over by session {by}")
    }
}
