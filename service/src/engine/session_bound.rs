//! Which sessions may begin: none whose number lies in the future.

use std::time::{Duration, SystemTime, UNIX_EPOCH};

use super::message::IngestError;

/// A clock that shows less than this has not been set since its machine started: 2023-11-14.
const CLOCK_SET: Duration = Duration::from_secs(1_700_000_000);

/// The bound of the numbers of sessions. These are Unix times of a start \[ns\], and the larger one
/// takes over: one in the far future would own its agent's name for good.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SessionBound {
    /// How far ahead of the service's clock a number may be.
    ahead_max: Duration,
}

impl SessionBound {
    pub(crate) fn new(ahead_max: Duration) -> Self {
        Self { ahead_max }
    }

    /// Whether a session may begin now.
    ///
    /// # Errors
    /// It lies too far in the future.
    pub(crate) fn check(self, session: u64) -> Result<(), IngestError> {
        let clock = SystemTime::now().duration_since(UNIX_EPOCH);
        self.check_at(session, clock.unwrap_or_default())
    }

    fn check_at(self, session: u64, clock: Duration) -> Result<(), IngestError> {
        // Robots may know better than such a clock what time it is.
        if clock < CLOCK_SET {
            return Ok(());
        }
        let latest = (clock + self.ahead_max).as_nanos();
        let latest = u64::try_from(latest).unwrap_or(u64::MAX);
        if session <= latest {
            Ok(())
        } else {
            Err(IngestError::SessionInFuture { session, latest })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sessions_up_to_a_day_ahead_may_begin_and_later_ones_may_not() {
        let day = Duration::from_secs(86_400);
        let bound = SessionBound::new(day);
        let clock = Duration::from_secs(1_800_000_000);
        let latest = 1_800_086_400_000_000_000;
        for session in [0, 7, 1_799_999_999_999_999_999, latest] {
            assert_eq!(bound.check_at(session, clock), Ok(()));
        }
        for session in [latest + 1, u64::MAX - 1] {
            let refused = Err(IngestError::SessionInFuture { session, latest });
            assert_eq!(bound.check_at(session, clock), refused);
            // Who does not know the time cannot say what is in the future.
            assert_eq!(bound.check_at(session, day), Ok(()));
        }
    }
}
