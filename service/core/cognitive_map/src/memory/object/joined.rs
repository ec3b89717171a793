//! What was joined to an object, as long as it may prove wrong.

use object_recognition::{ObjectModel, PoseEstimate};

/// Share of the evidence that such a pose holds.
const CLEAR_SHARE: f64 = 0.9;

/// What was joined to an object last, while that may still prove wrong.
#[derive(Clone, Debug)]
pub(super) struct Joining {
    /// The object as it was.
    pub(super) before: ObjectModel,
    /// What was joined to it, in its frame.
    pub(super) added: ObjectModel,
    /// Visits and contacts that taught what was joined.
    pub(super) taught: (u64, u64),
}

/// Whether a pose is clear enough for something to be laid into an object by it.
pub(super) fn is_clear(pose: &PoseEstimate) -> bool {
    pose.share > CLEAR_SHARE
}
