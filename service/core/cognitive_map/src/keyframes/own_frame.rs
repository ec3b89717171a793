//! Pose of an agent's own frame in the map.

use nalgebra::Isometry3;

use state::{CorruptState, State, StateReader, StateWriter};

/// Pose of an agent's own frame in the map; `None` while the agent is not in the map.
///
/// The estimator decides whether an agent is in the map; [`Effect`](crate::estimator::Effect)s
/// bring that here. The graph keeps the pose, since the estimator forgets it once it has merged
/// the frames, and keyframes are transformed only when they are needed.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct OwnFrame(pub(super) Option<Isometry3<f64>>);

impl State for OwnFrame {
    /// A flag stands before the pose, and repeats whether there is one.
    fn write(&self, out: &mut StateWriter) {
        (self.0.is_some(), self.0).write(out);
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        let (is_in_map, pose): (bool, Option<_>) = State::read(input)?;
        if is_in_map == pose.is_some() {
            Ok(Self(pose))
        } else {
            Err(CorruptState::Invalid)
        }
    }
}
