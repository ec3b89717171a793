//! Sparsification: keyframes are removed from which next to nothing is lost.

use nalgebra::{Isometry3, UnitQuaternion};

use super::constraint::ClosureState;
use super::graph::KeyframeGraph;
use super::keyframe::Keyframe;
use super::sighting::{Seen, Sighting, lever_covariance, symmetric};
use super::tuning;
use geometry::{PoseCovariance, se3};
use state::NONE;

/// The neighbour to which the lists of a removed keyframe move.
#[derive(Clone, Copy)]
enum Neighbour {
    Previous(u32),
    Next(u32),
}

impl KeyframeGraph {
    /// Removes a keyframe if that loses little: of the next few, the one whose loss is least.
    ///
    /// The motions to and from it are composed, and its sightings and constraints move to the
    /// neighbour that is nearer, with the noise of the motion there: so no loop is lost, and
    /// nothing becomes more certain than it was.
    pub(super) fn sparsify(&mut self) {
        let numbers = self.keyframes.numbers();
        let mut least = (f64::INFINITY, NONE);
        for looked_at in 0..tuning::KEYFRAMES_EXAMINED_MAX.min(numbers) {
            if looked_at >= tuning::KEYFRAMES_COMPARED && least.1 != NONE {
                break;
            }
            let number = self.sweep;
            self.sweep = (self.sweep + 1) % numbers;
            if let Some(loss) = self.loss(number)
                && loss < least.0
            {
                least = (loss, number);
            }
        }
        self.dissolve(least.1);
    }

    /// Removes a sighting: of the next few keyframes with sightings, the least certain one of that
    /// with most.
    ///
    /// Without it, when all keyframes have few sightings, a new one would find no room, and later
    /// poses would be known by motion alone.
    pub(super) fn forget_least_certain(&mut self) {
        let numbers = self.keyframes.numbers();
        let (mut most, mut compared) = ((1, NONE), 0);
        for _ in 0..tuning::KEYFRAMES_EXAMINED_MAX.min(numbers) {
            if compared >= tuning::KEYFRAMES_COMPARED && most.1 != NONE {
                break;
            }
            let number = self.sweep;
            self.sweep = (self.sweep + 1) % numbers;
            let (count, least_certain) = self.seen_from(number);
            compared += u32::from(count > 0);
            if count > most.0 {
                most = (count, least_certain);
            }
        }
        self.remove_sighting(most.1);
    }

    /// Number of sightings of a keyframe, and the least certain one.
    fn seen_from(&self, keyframe: u32) -> (u32, u32) {
        let (mut count, mut least_certain) = (0, (0.0, NONE));
        let mut at = self
            .keyframes
            .get(keyframe)
            .map_or(NONE, |keyframe| keyframe.sightings);
        while let Some(sighting) = self.sightings.get(at) {
            let spread = sighting.point.covariance().trace();
            if spread > least_certain.0 {
                least_certain = (spread, at);
            }
            count += 1;
            at = sighting.next;
        }
        (count, least_certain.1)
    }

    /// The loss of removing a keyframe; `None` if it must stay.
    fn loss(&self, number: u32) -> Option<f64> {
        let keyframe = self.keyframes.get(number)?;
        let neighbour = self.neighbour(keyframe)?;
        let (motion, covariance) = match neighbour {
            Neighbour::Previous(_) => (keyframe.motion, keyframe.covariance),
            Neighbour::Next(next) => {
                let next = self.keyframes.get(next)?;
                (next.motion.inverse(), next.covariance)
            }
        };
        let mut loss = self.unevenness_without(keyframe) / tuning::UNEVENNESS_M;
        let mut at = keyframe.sightings;
        while let Some(sighting) = self.sightings.get(at) {
            let spread = lever_covariance(&sighting.point.position, &covariance).trace();
            loss += spread / sighting.point.covariance().trace();
            at = sighting.next;
        }
        at = keyframe.shown;
        while let Some(sighting) = self.sightings.get(at) {
            let spread = covariance.matrix().fixed_view::<3, 3>(0, 0).trace();
            loss += spread / sighting.point.covariance().trace();
            at = sighting.next_shown;
        }
        at = keyframe.constraints;
        while let Some(constraint) = self.constraints.get(at) {
            if constraint.state == ClosureState::Origin {
                return None;
            }
            let lever = motion.translation.vector.norm();
            let spread = covariance.matrix().trace() * (1.0 + lever * lever);
            loss += spread
                / constraint
                    .covariance
                    .matrix()
                    .trace()
                    .max(f64::MIN_POSITIVE);
            at = self.next_constraint(at, number);
        }
        Some(loss)
    }

    /// The neighbour in the same stretch to which the motion is more certain. `None` for an agent's
    /// latest keyframe.
    fn neighbour(&self, keyframe: &Keyframe) -> Option<Neighbour> {
        let next = self.keyframes.get(keyframe.next)?;
        let (before, after) = (keyframe.covariance.matrix(), next.covariance.matrix());
        if keyframe.begins || keyframe.previous == NONE {
            return (!next.begins).then_some(Neighbour::Next(keyframe.next));
        }
        if next.begins || before.trace() <= after.trace() {
            Some(Neighbour::Previous(keyframe.previous))
        } else {
            Some(Neighbour::Next(keyframe.next))
        }
    }

    /// Deviation of the way past a keyframe from an even motion if the keyframe were removed \[m\].
    fn unevenness_without(&self, keyframe: &Keyframe) -> f64 {
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

    /// Removes a keyframe from its chain.
    pub(super) fn dissolve(&mut self, number: u32) {
        let revision = self.revision;
        let Some(keyframe) = self.keyframes.get(number).cloned() else {
            return;
        };
        let Some(neighbour) = self.neighbour(&keyframe) else {
            return;
        };
        let unevenness_m = self.unevenness_without(&keyframe);
        self.move_to_neighbour(number, &keyframe, neighbour);
        if let Some(next) = self.keyframes.get_mut(keyframe.next, revision) {
            let (motion, covariance) = (next.motion, next.covariance);
            let calibrated = next.calibrated;
            next.previous = keyframe.previous;
            next.unevenness_m = unevenness_m;
            if keyframe.begins {
                next.begins = true;
                next.motion = Isometry3::identity();
                next.covariance = PoseCovariance::zero();
                next.calibrated = calibrated.without_motion();
            } else if !next.begins {
                let before =
                    { keyframe.calibrated }.corrected_by(&keyframe.motion, &calibrated.calibration);
                next.motion = before * motion;
                next.calibrated = keyframe.calibrated.then(&calibrated);
                next.motion.rotation.renormalize_fast();
                next.covariance = composed(&keyframe.covariance, &motion, &covariance);
            }
        }
        if let Some(previous) = self.keyframes.get_mut(keyframe.previous, revision) {
            previous.next = keyframe.next;
        }
        for pending in &mut self.pending {
            if pending.keyframe == number {
                let (to, point) = match neighbour {
                    Neighbour::Previous(to) => (
                        to,
                        pending.point.before(&keyframe.motion, &keyframe.covariance),
                    ),
                    // The latest keyframes of an agent are its nearest ones: a sighting that waits
                    // here has waited for long.
                    Neighbour::Next(to) => (to, pending.point),
                };
                (pending.keyframe, pending.point) = (to, point);
            }
        }
        self.keyframes.remove(number, revision);
    }

    /// Moves the lists of a keyframe to a neighbour.
    fn move_to_neighbour(&mut self, number: u32, keyframe: &Keyframe, neighbour: Neighbour) {
        let (to, way, spread) = match neighbour {
            Neighbour::Previous(to) => (to, keyframe.motion, keyframe.covariance),
            Neighbour::Next(to) => {
                let Some(next) = self.keyframes.get(to) else {
                    return;
                };
                (to, next.motion, next.covariance)
            }
        };
        let is_previous = matches!(neighbour, Neighbour::Previous(_));
        self.move_attachments(number, to);
        while let Some(mut sighting) = self.take_sighting(number) {
            sighting.keyframe = to;
            sighting.point = if is_previous {
                sighting.point.before(&way, &spread)
            } else {
                sighting.point.after(&way, &spread)
            };
            let landmark = match sighting.shown {
                Seen::Landmark(landmark) => landmark,
                Seen::Agent(..) => NONE,
            };
            // A sighting of an agent from its own keyframe says nothing.
            let sees_itself = matches!(sighting.shown, Seen::Agent(target, _) if target == to);
            if sees_itself || !self.add_sighting(sighting) {
                self.landmarks.release(landmark, self.revision);
            }
        }
        while let Some(sighting) = self.take_shown(number) {
            self.show_beside(sighting, to, &way, &spread, is_previous);
        }
        // The first motion leads from the neighbour to the keyframe, or from the keyframe to the
        // neighbour.
        loop {
            let at = self
                .keyframes
                .get(number)
                .map_or(NONE, |keyframe| keyframe.constraints);
            let Some(mut constraint) = self.remove_constraint(at) else {
                break;
            };
            let (there, back) = if is_previous {
                (way, way.inverse())
            } else {
                (way.inverse(), way)
            };
            // T_keyframe = T_neighbour · there, both ways with the error of the motion.
            let moved = se3::adjoint(&way);
            let on_its_other_side =
                PoseCovariance::from_matrix(&(moved * spread.matrix() * moved.transpose()));
            if constraint.to == number {
                constraint.to = to;
                constraint.transform *= back;
                let noise = if is_previous {
                    on_its_other_side
                } else {
                    spread
                };
                constraint.covariance = composed(&constraint.covariance, &back, &noise);
            }
            if constraint.from == number {
                constraint.from = to;
                let noise = if is_previous {
                    spread
                } else {
                    on_its_other_side
                };
                constraint.covariance =
                    composed(&noise, &constraint.transform, &constraint.covariance);
                constraint.transform = there * constraint.transform;
            }
            constraint.transform.rotation.renormalize_fast();
            self.add_constraint(constraint);
        }
    }

    /// Moves a sighting that shows a keyframe to a neighbour of that.
    fn show_beside(
        &mut self,
        mut sighting: Sighting,
        to: u32,
        way: &Isometry3<f64>,
        spread: &PoseCovariance,
        is_previous: bool,
    ) {
        let Seen::Agent(was, lever) = sighting.shown else {
            return;
        };
        let (Some(observer), Some(target)) = (
            self.keyframes.get(sighting.keyframe),
            self.keyframes.get(was),
        ) else {
            return;
        };
        let turn = observer.pose.rotation.inverse() * target.pose.rotation;
        let turn = turn.to_rotation_matrix().into_inner();
        // The noise of the motion moves the point in the frame of the removed keyframe, or of its
        // neighbour.
        let (place, noise) = if is_previous {
            let noise = turn * lever_covariance(&lever, spread) * turn.transpose();
            (way * nalgebra::Point3::from(lever), noise)
        } else {
            let place = way.inverse() * nalgebra::Point3::from(lever);
            let turn = turn * way.rotation.to_rotation_matrix().into_inner();
            let noise = turn * lever_covariance(&place.coords, spread) * turn.transpose();
            (place, noise)
        };
        sighting.shown = Seen::Agent(to, place.coords);
        sighting.point.fresh += symmetric(&noise);
        if sighting.keyframe != to {
            self.add_sighting(sighting);
        }
    }

    fn take_sighting(&mut self, keyframe: u32) -> Option<Sighting> {
        let number = self.keyframes.get(keyframe)?.sightings;
        // The landmark stays in memory while its sighting moves.
        if let Seen::Landmark(landmark) = self.sightings.get(number)?.shown {
            self.landmarks.count(landmark, self.revision);
        }
        self.remove_sighting(number)
    }

    fn take_shown(&mut self, keyframe: u32) -> Option<Sighting> {
        let number = self.keyframes.get(keyframe)?.shown;
        self.remove_sighting(number)
    }
}

/// The covariance of a motion after another one.
pub(super) fn composed(
    first: &PoseCovariance,
    second_motion: &Isometry3<f64>,
    second: &PoseCovariance,
) -> PoseCovariance {
    let moved = first.after_motion(second_motion, &nalgebra::Vector6::zeros());
    PoseCovariance::from_matrix(&(moved.matrix() + second.matrix()))
}
