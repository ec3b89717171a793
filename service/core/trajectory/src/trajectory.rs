//! Positions over time.

use geometry::se3;
use nalgebra::{Isometry3, Vector3};

/// Step of the grid on which trajectories are compared: 10 Hz \[ns\].
pub const GRID_STEP_NS: i64 = 100_000_000;

/// A pose at a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StampedPose {
    /// When \[ns\].
    pub stamp_ns: i64,
    /// Pose of the body in the frame of the trajectory.
    pub pose: Isometry3<f64>,
}

impl StampedPose {
    /// The pose at a stamp between this one and a later one: the body moves evenly, along a screw.
    /// At a stamp beside them, and where they have the same stamp, it is that of the nearer one.
    #[must_use]
    pub fn between(&self, later: &Self, stamp_ns: i64) -> Self {
        let share = fraction(self.stamp_ns, later.stamp_ns, stamp_ns);
        let pose = if stamp_ns <= self.stamp_ns || self.stamp_ns >= later.stamp_ns {
            self.pose
        } else if stamp_ns >= later.stamp_ns {
            later.pose
        } else {
            let twist = se3::twist(&self.pose.inv_mul(&later.pose));
            se3::plus(&self.pose, &(twist * share))
        };
        Self { stamp_ns, pose }
    }
}

/// A position at a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StampedPosition {
    /// When \[ns\].
    pub stamp_ns: i64,
    /// Position in the frame of the trajectory \[m\].
    pub position_m: Vector3<f64>,
}

impl From<&StampedPose> for StampedPosition {
    fn from(stamped: &StampedPose) -> Self {
        Self {
            stamp_ns: stamped.stamp_ns,
            position_m: stamped.pose.translation.vector,
        }
    }
}

/// Why positions make no trajectory.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum InvalidTrajectory {
    /// There is no position.
    #[error("a trajectory needs at least one position")]
    Empty,
    /// A position has a number that is not finite.
    #[error("the position at {stamp_ns} ns is not finite")]
    NotFinite {
        /// Its stamp \[ns\].
        stamp_ns: i64,
    },
}

/// A stretch of time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Span {
    /// First instant \[ns\].
    pub start_ns: i64,
    /// Last instant \[ns\].
    pub end_ns: i64,
}

impl Span {
    /// What all spans have in common; `None` without a common stretch longer than an instant.
    pub fn common(spans: impl IntoIterator<Item = Self>) -> Option<Self> {
        spans
            .into_iter()
            .reduce(|a, b| Self {
                start_ns: a.start_ns.max(b.start_ns),
                end_ns: a.end_ns.min(b.end_ns),
            })
            .filter(|span| span.start_ns < span.end_ns)
    }
}

/// At least one finite position, stamps strictly increasing, linear in between.
#[derive(Clone, Debug, PartialEq)]
pub struct Trajectory(Vec<StampedPosition>);

impl Trajectory {
    /// Sorts by stamp. Of several positions with one stamp the last one given holds: what was
    /// known after everything of that instant had been taken in.
    ///
    /// # Errors
    /// There is no position, or one is not finite.
    pub fn new(
        positions: impl IntoIterator<Item = StampedPosition>,
    ) -> Result<Self, InvalidTrajectory> {
        let mut sorted: Vec<_> = positions.into_iter().collect();
        sorted.sort_by_key(|position| position.stamp_ns);
        let mut kept: Vec<StampedPosition> = Vec::with_capacity(sorted.len());
        for position in sorted {
            if !position.position_m.iter().all(|x| x.is_finite()) {
                return Err(InvalidTrajectory::NotFinite {
                    stamp_ns: position.stamp_ns,
                });
            }
            match kept.last_mut() {
                Some(last) if last.stamp_ns == position.stamp_ns => *last = position,
                _ => kept.push(position),
            }
        }
        if kept.is_empty() {
            Err(InvalidTrajectory::Empty)
        } else {
            Ok(Self(kept))
        }
    }

    /// The positions of poses; as [`Trajectory::new`].
    ///
    /// # Errors
    /// There is no pose, or one is not finite.
    pub fn from_poses<'a>(
        poses: impl IntoIterator<Item = &'a StampedPose>,
    ) -> Result<Self, InvalidTrajectory> {
        Self::new(poses.into_iter().map(StampedPosition::from))
    }

    /// The positions, by stamp.
    pub fn positions(&self) -> &[StampedPosition] {
        &self.0
    }

    /// From the first stamp to the last.
    pub fn span(&self) -> Span {
        Span {
            start_ns: self.0[0].stamp_ns,
            end_ns: self.0[self.0.len() - 1].stamp_ns,
        }
    }

    /// The position at an instant, linearly interpolated; `None` before the first stamp and after
    /// the last, since nothing is extrapolated.
    pub fn at(&self, stamp_ns: i64) -> Option<Vector3<f64>> {
        let after = self
            .0
            .partition_point(|position| position.stamp_ns <= stamp_ns);
        let before = self.0.get(after.checked_sub(1)?)?;
        if before.stamp_ns == stamp_ns {
            return Some(before.position_m);
        }
        let next = self.0.get(after)?;
        let share = fraction(before.stamp_ns, next.stamp_ns, stamp_ns);
        Some(before.position_m + share * (next.position_m - before.position_m))
    }
}

/// Which share of the way from `start_ns` to `end_ns` has passed at `stamp_ns`.
///
/// The differences are taken in 128 bits, so no two stamps are too far apart.
pub fn fraction(start_ns: i64, end_ns: i64, stamp_ns: i64) -> f64 {
    let passed = i128::from(stamp_ns) - i128::from(start_ns);
    let whole = i128::from(end_ns) - i128::from(start_ns);
    passed as f64 / whole as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn between_two_poses_the_body_moves_evenly() {
        let pose = |stamp_ns, x_m: f64, y_m: f64, yaw_rad: f64| StampedPose {
            stamp_ns,
            pose: Isometry3::new(Vector3::new(x_m, y_m, 0.0), Vector3::z() * yaw_rad),
        };
        // A quarter of a circle of radius 1, to the left.
        let quarter = std::f64::consts::FRAC_PI_2;
        let (start, end) = (pose(100, 0.0, 0.0, 0.0), pose(300, 1.0, 1.0, quarter));
        for stamp_ns in [100, 150, 200, 299, 300] {
            let angle = quarter * (stamp_ns - 100) as f64 / 200.0;
            let expected = pose(stamp_ns, angle.sin(), 1.0 - angle.cos(), angle);
            let found = start.between(&end, stamp_ns);
            assert_eq!(found.stamp_ns, stamp_ns);
            let off = found.pose.to_homogeneous() - expected.pose.to_homogeneous();
            assert!(off.norm() < 1e-12, "{stamp_ns}: {off}");
        }
        assert_eq!(start.between(&end, 0).pose, start.pose);
        assert_eq!(start.between(&end, i64::MAX).pose, end.pose);
        assert_eq!(start.between(&start, 100).pose, start.pose);
    }

    fn at(stamp_ns: i64, x: f64) -> StampedPosition {
        StampedPosition {
            stamp_ns,
            position_m: Vector3::new(x, -x, 2.0 * x),
        }
    }

    #[test]
    fn positions_are_linear_in_between_and_absent_outside() {
        let trajectory = Trajectory::new([at(10, 1.0), at(0, 0.0), at(30, -1.0)]).unwrap();
        assert_eq!(trajectory.at(5), Some(Vector3::new(0.5, -0.5, 1.0)));
        assert_eq!(trajectory.at(10), Some(Vector3::new(1.0, -1.0, 2.0)));
        assert_eq!(trajectory.at(20), Some(Vector3::zeros()));
        assert_eq!(trajectory.at(30), Some(Vector3::new(-1.0, 1.0, -2.0)));
        assert_eq!(trajectory.at(-1), None);
        assert_eq!(trajectory.at(31), None);
        assert_eq!(
            trajectory.span(),
            Span {
                start_ns: 0,
                end_ns: 30
            }
        );
    }

    #[test]
    fn the_last_word_on_an_instant_holds() {
        let trajectory = Trajectory::new([at(0, 0.0), at(1, 5.0), at(1, 7.0)]).unwrap();
        assert_eq!(trajectory.positions(), [at(0, 0.0), at(1, 7.0)]);
    }

    #[test]
    fn the_whole_range_of_stamps_interpolates() {
        let trajectory = Trajectory::new([at(i64::MIN, -1.0), at(i64::MAX, 1.0)]).unwrap();
        assert!(trajectory.at(0).unwrap().norm() < 1e-15);
    }

    #[test]
    fn empty_and_infinite_are_refused() {
        assert_eq!(Trajectory::new([]), Err(InvalidTrajectory::Empty));
        assert_eq!(
            Trajectory::new([at(0, 0.0), at(4, f64::NAN)]),
            Err(InvalidTrajectory::NotFinite { stamp_ns: 4 })
        );
    }

    #[test]
    fn spans_meet_or_not() {
        let span = |start_ns, end_ns| Span { start_ns, end_ns };
        assert_eq!(
            Span::common([span(0, 9), span(3, 20), span(-5, 8)]),
            Some(span(3, 8))
        );
        assert_eq!(Span::common([span(0, 3), span(3, 8)]), None);
        assert_eq!(Span::common([]), None);
    }
}
