//! What of an agent is to be published and has not been.

use std::sync::atomic::{AtomicU8, Ordering};

/// Which of an agent's two messages are due. Told again before it is published, a message is due
/// once.
#[derive(Debug, Default)]
pub(crate) struct Due(AtomicU8);

/// One of the messages that are published of an agent, or both.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Messages(u8);

impl Messages {
    pub(crate) const ESTIMATE: Self = Self(1);
    pub(crate) const WATERMARK: Self = Self(2);
    pub(crate) const BOTH: Self = Self(3);

    /// Whether all of `other` are among them.
    pub(crate) fn contain(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }
}

impl Due {
    /// Makes messages due. Says whether none was before.
    pub(crate) fn add(&self, messages: Messages) -> bool {
        self.0.fetch_or(messages.0, Ordering::AcqRel) == 0
    }

    /// Takes those of `messages` that are due.
    pub(crate) fn take(&self, messages: Messages) -> Messages {
        Messages(self.0.fetch_and(!messages.0, Ordering::AcqRel) & messages.0)
    }
}
