//! Known positions of poses without time, as a trajectory.

use cogmap_lab::stream::Stream;
use nalgebra::Vector3;
use trajectory::{InvalidTrajectory, StampedPosition, Trajectory};

/// The positions with the stamps of a robot's poses, each with that of the same number.
pub(super) fn of_stream(
    stream: &Stream,
    positions: &[Option<Vector3<f64>>],
) -> Result<Trajectory, InvalidTrajectory> {
    let rows = stream.reckoned().iter().zip(positions);
    let known = rows.filter_map(|(row, position)| {
        Some(StampedPosition {
            stamp_ns: row.stamp_ns,
            position_m: (*position)?,
        })
    });
    Trajectory::new(known)
}
