//! Settings of a robot's connection.

use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use cogmap_proto::Codec;
use cogmap_proto::limits::BATCH_SAMPLES_MAX;

use crate::error::ClientError;

/// Longest wait, some thirty years: whoever waits for ever gets that, for a clock can only add so
/// much.
const WAIT_MAX: Duration = Duration::from_secs(1_000_000_000);

/// When a wait from now on is over.
pub(crate) fn deadline(timeout: Duration) -> Instant {
    Instant::now() + timeout.min(WAIT_MAX)
}

/// How a robot numbers, batches and holds its samples. The defaults suit one robot of up to a few
/// kilohertz.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RobotSettings {
    /// The run of the agent; the Unix time at connecting \[ns\] when absent. A larger number takes
    /// the agent's name over from a smaller one.
    pub session: Option<u64>,
    /// A batch leaves when it has this many samples, 1 to [`BATCH_SAMPLES_MAX`] …
    pub batch_samples: usize,
    /// … or when its first sample has waited this long.
    pub batch_delay: Duration,
    /// Most samples held for the service's acknowledgement: at 1 kHz, the default is a minute.
    pub window_samples: usize,
    /// Most bytes held, counted as an upper bound of their length on the wire.
    pub window_bytes: usize,
    /// How long `send` waits for room in a full window.
    pub send_timeout: Duration,
    /// How long connecting waits for a router that is not up yet.
    pub connect_timeout: Duration,
    /// How long the first batch waits for a service to subscribe. After that it is sent whether or
    /// not anyone listens; it is held, and sent again, in any case.
    pub match_timeout: Duration,
    /// Codec of samples and queries.
    pub codec: Codec,
    /// Whether closing the robot ends the session, and the trip under way, by a last sample.
    /// Without it they end when the agent's next session begins.
    pub ends_session: bool,
}

impl Default for RobotSettings {
    fn default() -> Self {
        Self {
            session: None,
            batch_samples: 64,
            batch_delay: Duration::from_millis(20),
            window_samples: 65_536,
            window_bytes: 64 << 20,
            send_timeout: Duration::from_secs(10),
            connect_timeout: Duration::from_secs(10),
            match_timeout: Duration::from_secs(3),
            codec: Codec::Postcard,
            ends_session: true,
        }
    }
}

impl RobotSettings {
    pub(crate) fn check(&self) -> Result<(), ClientError> {
        if !(1..=BATCH_SAMPLES_MAX).contains(&self.batch_samples) {
            return Err(ClientError::Settings("batch_samples is 1 to 4096"));
        }
        if self.window_samples == 0 || self.window_bytes == 0 {
            return Err(ClientError::Settings(
                "the window holds at least one sample",
            ));
        }
        Ok(())
    }

    pub(crate) fn session_or_now(&self) -> u64 {
        self.session.unwrap_or_else(|| {
            SystemTime::now()
                .duration_since(UNIX_EPOCH)
                .ok()
                .and_then(|since| u64::try_from(since.as_nanos()).ok())
                .unwrap_or_default()
        })
    }
}
