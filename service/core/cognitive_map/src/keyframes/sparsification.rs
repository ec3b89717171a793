//! Sparsification: keyframes are removed from which next to nothing is lost.

use nalgebra::Isometry3;

use super::constraint::{ClosureState, composed};
use super::graph::KeyframeGraph;
use super::keyframe::Keyframe;
use super::neighbour::Neighbour;
use super::sighting::{Seen, Sighting};
use super::tuning;
use geometry::PoseCovariance;
use state::NONE;

impl KeyframeGraph {
    /// Removes a keyframe if that loses little: of the next few, the one whose loss is least.
    ///
    /// The motions to and from it are composed, and its sightings and constraints move to the
    /// neighbour that is nearer, with the noise of the motion there: so no loop is lost, and
    /// nothing becomes more certain than it was.
    pub(super) fn sparsify(&mut self) {
        let numbers = self.chains.keyframes.numbers();
        let mut least = (f64::INFINITY, NONE);
        for looked_at in 0..tuning::KEYFRAMES_EXAMINED_MAX.min(numbers) {
            if looked_at >= tuning::KEYFRAMES_COMPARED && least.1 != NONE {
                break;
            }
            let number = self.chains.next_of_sweep();
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
        let numbers = self.chains.keyframes.numbers();
        let (mut most, mut compared) = ((1, NONE), 0);
        for _ in 0..tuning::KEYFRAMES_EXAMINED_MAX.min(numbers) {
            if compared >= tuning::KEYFRAMES_COMPARED && most.1 != NONE {
                break;
            }
            let number = self.chains.next_of_sweep();
            let Some(keyframe) = self.chains.keyframes.get(number) else {
                continue;
            };
            let crowd = self.sightings.crowd(keyframe);
            compared += u32::from(crowd.count > 0);
            if crowd.count > most.0 {
                most = (crowd.count, crowd.least_certain);
            }
        }
        self.remove_sighting(most.1);
    }

    /// The loss of removing a keyframe; `None` if it must stay.
    fn loss(&self, number: u32) -> Option<f64> {
        let keyframe = self.chains.keyframes.get(number)?;
        let neighbour = self.chains.neighbour(keyframe)?;
        let covariance = &neighbour.covariance;
        let mut loss = self.chains.unevenness_without(keyframe) / tuning::UNEVENNESS_M;
        for (_, sighting) in self.sightings.made_at(keyframe) {
            loss += sighting.seen.loss(covariance);
        }
        for sighting in self.sightings.showing(keyframe) {
            let spread = covariance.matrix().fixed_view::<3, 3>(0, 0).trace();
            loss += spread / sighting.seen.spread();
        }
        let lever = neighbour.motion_to_removed().translation.vector.norm();
        for constraint in self.constraints.of(number, keyframe) {
            if constraint.state == ClosureState::Origin {
                return None;
            }
            let spread = covariance.matrix().trace() * (1.0 + lever * lever);
            let own = constraint.covariance.matrix().trace();
            loss += spread / own.max(f64::MIN_POSITIVE);
        }
        Some(loss)
    }

    /// Removes a keyframe from its chain.
    pub(super) fn dissolve(&mut self, number: u32) {
        let revision = self.revision;
        let Some(keyframe) = self.chains.keyframes.get(number).cloned() else {
            return;
        };
        let Some(neighbour) = self.chains.neighbour(&keyframe) else {
            return;
        };
        let unevenness_m = self.chains.unevenness_without(&keyframe);
        self.move_to_neighbour(number, &neighbour);
        let keyframes = &mut self.chains.keyframes;
        if let Some(next) = keyframes.get_mut(keyframe.next, revision) {
            next.previous = keyframe.previous;
            next.unevenness_m = unevenness_m;
            join_motions(&keyframe, next);
        }
        if let Some(previous) = keyframes.get_mut(keyframe.previous, revision) {
            previous.next = keyframe.next;
        }
        keyframes.remove(number, revision);
    }

    /// Moves the lists of a keyframe to a neighbour.
    fn move_to_neighbour(&mut self, number: u32, neighbour: &Neighbour) {
        let revision = self.revision;
        self.attachments
            .move_all(number, neighbour.number, &mut self.chains, revision);
        while let Some(sighting) = self.take_sighting(number, |keyframe| keyframe.sightings) {
            let moved = sighting.seen_from(neighbour);
            // A sighting of an agent from its own keyframe says nothing.
            let shows_itself = moved.shown_keyframe() == neighbour.number;
            if (shows_itself || !self.add_sighting(moved))
                && let Seen::Landmark(landmark) = sighting.shown
            {
                self.sightings.landmarks.release(landmark, revision);
            }
        }
        while let Some(sighting) = self.take_sighting(number, |keyframe| keyframe.shown) {
            let keyframes = &self.chains.keyframes;
            let pose = |number: u32| keyframes.get(number).map(|keyframe| keyframe.pose);
            let (Some(observer), Some(target)) = (pose(sighting.keyframe), pose(number)) else {
                continue;
            };
            let turn = observer.rotation.inverse() * target.rotation;
            let moved = sighting.shown_at(neighbour, &turn);
            if moved.keyframe != neighbour.number {
                self.add_sighting(moved);
            }
        }
        loop {
            let keyframe = self.chains.keyframes.get(number);
            let first = keyframe.map_or(NONE, |keyframe| keyframe.constraints);
            let Some(constraint) = self.remove_constraint(first) else {
                return;
            };
            self.put_constraint(constraint.moved_to(number, neighbour));
        }
    }

    /// Takes the first sighting out of a list of a keyframe.
    fn take_sighting(
        &mut self,
        keyframe: u32,
        first: impl Fn(&Keyframe) -> u32,
    ) -> Option<Sighting> {
        let number = first(self.chains.keyframes.get(keyframe)?);
        let keyframes = &mut self.chains.keyframes;
        self.sightings.take(number, keyframes, self.revision)
    }
}

/// Lets the motion to the next keyframe begin where that to a removed one began.
fn join_motions(removed: &Keyframe, next: &mut Keyframe) {
    if removed.begins {
        next.begins = true;
        next.motion = Isometry3::identity();
        next.covariance = PoseCovariance::zero();
        next.calibrated = next.calibrated.without_motion();
    } else if !next.begins {
        let calibration = &next.calibrated.calibration;
        let before = removed
            .calibrated
            .corrected_by(&removed.motion, calibration);
        let covariance = composed(&removed.covariance, &next.motion, &next.covariance);
        next.calibrated = { removed.calibrated }.then(&next.calibrated, &next.motion.rotation);
        next.motion = before * next.motion;
        next.motion.rotation.renormalize_fast();
        next.covariance = covariance;
    }
}
