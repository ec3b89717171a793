//! The neighbour to which the lists of a removed keyframe move.

use nalgebra::{Isometry3, Point3, UnitQuaternion};

use super::chains::Chains;
use super::constraint::{Constraint, composed};
use super::keyframe::Keyframe;
use super::seen_point::lever_covariance;
use super::sighting::{Seen, Sighting};
use super::tuning;
use geometry::{PoseCovariance, se3, symmetric};
use state::NONE;

/// A keyframe beside one that is removed, in the same stretch.
pub(super) struct Neighbour {
    pub(super) number: u32,
    /// Whether it is the earlier one of the two.
    is_previous: bool,
    /// Motion from the earlier one to the later one, with the covariance of its error.
    motion: Isometry3<f64>,
    pub(super) covariance: PoseCovariance,
}

impl Chains {
    /// The neighbour in the same stretch to which the motion is more certain. `None` for an agent's
    /// latest keyframe.
    pub(super) fn neighbour(&self, keyframe: &Keyframe) -> Option<Neighbour> {
        let next = self.keyframes.get(keyframe.next)?;
        let (before, after) = (keyframe.covariance.matrix(), next.covariance.matrix());
        let is_first = keyframe.begins || keyframe.previous == NONE;
        if is_first && next.begins {
            return None;
        }
        let is_previous = !is_first && (next.begins || before.trace() <= after.trace());
        let (number, later) = if is_previous {
            (keyframe.previous, keyframe)
        } else {
            (keyframe.next, next)
        };
        Some(Neighbour {
            number,
            is_previous,
            motion: later.motion,
            covariance: later.covariance,
        })
    }

    /// Deviation of the way past a keyframe from an even motion if the keyframe were removed \[m\].
    pub(super) fn unevenness_without(&self, keyframe: &Keyframe) -> f64 {
        let Some(next) = self.keyframes.get(keyframe.next) else {
            return 0.0;
        };
        let known = keyframe.unevenness_m.max(next.unevenness_m);
        let previous = self.keyframes.get(keyframe.previous);
        let Some(previous) = previous.filter(|_| !keyframe.begins && !next.begins) else {
            return known;
        };
        let whole = keyframe.motion * next.motion;
        let way_ns = next.stamp_ns.saturating_sub(previous.until_ns).max(1) as f64;
        let off = |stamp_ns: i64| {
            let share = stamp_ns.saturating_sub(previous.until_ns) as f64 / way_ns;
            // Interpolated as readers of trajectories do, which is much quicker than along a screw.
            let shift = whole.translation.vector * share - keyframe.motion.translation.vector;
            let even = UnitQuaternion::identity().nlerp(&whole.rotation, share);
            shift.norm() + tuning::ROTATION_LEVER_M * even.angle_to(&keyframe.motion.rotation)
        };
        known + off(keyframe.stamp_ns).max(off(keyframe.until_ns))
    }
}

impl Neighbour {
    /// The motion from the neighbour to the removed keyframe.
    pub(super) fn motion_to_removed(&self) -> Isometry3<f64> {
        if self.is_previous {
            self.motion
        } else {
            self.motion.inverse()
        }
    }

    /// The motion from the removed keyframe to the neighbour.
    fn motion_from_removed(&self) -> Isometry3<f64> {
        if self.is_previous {
            self.motion.inverse()
        } else {
            self.motion
        }
    }
}

impl Sighting {
    /// The sighting as the neighbour of its keyframe would have made it.
    pub(super) fn seen_from(&self, neighbour: &Neighbour) -> Self {
        let (motion, covariance) = (&neighbour.motion, &neighbour.covariance);
        let seen = if neighbour.is_previous {
            self.seen.before(motion, covariance)
        } else {
            self.seen.after(motion, covariance)
        };
        Self {
            keyframe: neighbour.number,
            seen,
            ..self.clone()
        }
    }

    /// The sighting as one of the neighbour of the keyframe that it shows; `turn` is the rotation
    /// of that keyframe as seen by the observer.
    pub(super) fn shown_at(&self, neighbour: &Neighbour, turn: &UnitQuaternion<f64>) -> Self {
        let mut moved = self.clone();
        let Seen::Agent(_, lever) = self.shown else {
            return moved;
        };
        let (motion, covariance) = (&neighbour.motion, &neighbour.covariance);
        let turn = turn.to_rotation_matrix().into_inner();
        // The noise of the motion moves the point in the frame of the removed keyframe, or of its
        // neighbour.
        let (place, noise) = if neighbour.is_previous {
            let noise = turn * lever_covariance(&lever, covariance) * turn.transpose();
            (motion * Point3::from(lever), noise)
        } else {
            let place = motion.inverse() * Point3::from(lever);
            let turn = turn * motion.rotation.to_rotation_matrix().into_inner();
            let noise = turn * lever_covariance(&place.coords, covariance) * turn.transpose();
            (place, noise)
        };
        moved.shown = Seen::Agent(neighbour.number, place.coords);
        moved.seen.add_noise(&symmetric(&noise));
        moved
    }
}

impl Constraint {
    /// The constraint with the neighbour of a keyframe for that keyframe.
    pub(super) fn moved_to(mut self, number: u32, neighbour: &Neighbour) -> Self {
        let (motion, near) = (&neighbour.motion, neighbour.covariance);
        // T_keyframe = T_neighbour · there, both ways with the error of the motion.
        let adjoint = se3::adjoint(motion);
        let far = PoseCovariance::from_matrix(&(adjoint * near.matrix() * adjoint.transpose()));
        let (there, back) = (
            neighbour.motion_to_removed(),
            neighbour.motion_from_removed(),
        );
        let (before, after) = if neighbour.is_previous {
            (near, far)
        } else {
            (far, near)
        };
        if self.to == number {
            self.to = neighbour.number;
            self.transform *= back;
            self.covariance = composed(&self.covariance, &back, &after);
        }
        if self.from == number {
            self.from = neighbour.number;
            self.covariance = composed(&before, &self.transform, &self.covariance);
            self.transform = there * self.transform;
        }
        self.transform.rotation.renormalize_fast();
        self
    }
}
