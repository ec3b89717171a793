//! Samples of a team in the order in which they are sent.

use cogmap_proto::Sample;

/// Consecutive samples of one robot, in the order in which the team sends.
#[derive(Clone, Debug)]
pub(super) struct TeamBatch {
    pub(super) robot: String,
    pub(super) samples: Vec<Sample>,
}
