//! What is forgotten first: anchors from which next to nothing is lost.

use nalgebra::{Isometry3, UnitQuaternion};

use super::anchor::Anchor;
use super::graph::KeyframeGraph;
use super::sighting::{Shown, swing};
use super::tie::Standing;
use geometry::{PoseCovariance, se3};
use state::NONE;

/// Anchors among which the one with least to say goes.
const COMPARED: u32 = 16;
/// Anchors looked at until there is one that may go.
const LOOKED_AT_MAX: u32 = 1024;
/// Unevenness of a way that counts as much as a sighting whose variance doubles \[m\].
const UNEVENNESS_M: f64 = 0.05;
/// Lever of a turn, in that respect \[m\].
const LEVER_M: f64 = 0.5;

/// Where what hangs on an anchor goes when the anchor goes.
#[derive(Clone, Copy)]
enum Neighbour {
    Previous(u32),
    Next(u32),
}

impl KeyframeGraph {
    /// Removes an anchor if that loses little: of the next few, the one with least to say.
    ///
    /// The motions to and from it are composed, and what hangs on it goes to the neighbour that is nearer, with the
    /// noise of the way there: so no loop is lost, and nothing becomes surer than it was.
    pub(super) fn thin(&mut self) {
        let numbers = self.anchors.numbers();
        let mut least = (f64::INFINITY, NONE);
        for looked_at in 0..LOOKED_AT_MAX.min(numbers) {
            if looked_at >= COMPARED && least.1 != NONE {
                break;
            }
            let number = self.hand;
            self.hand = (self.hand + 1) % numbers;
            if let Some(loss) = self.loss(number)
                && loss < least.0
            {
                least = (loss, number);
            }
        }
        self.dissolve(least.1);
    }

    /// Forgets a sighting: of the next few anchors from which something was seen, the vaguest one of that from which most was.
    ///
    /// Anchors may go without a sighting less, and then what is seen anew would find no room, and the way on from there would
    /// be known by its motion alone.
    pub(super) fn forget_vaguest(&mut self) {
        let numbers = self.anchors.numbers();
        let (mut most, mut compared) = ((1, NONE), 0);
        for _ in 0..LOOKED_AT_MAX.min(numbers) {
            if compared >= COMPARED && most.1 != NONE {
                break;
            }
            let number = self.hand;
            self.hand = (self.hand + 1) % numbers;
            let (count, vaguest) = self.seen_from(number);
            compared += u32::from(count > 0);
            if count > most.0 {
                most = (count, vaguest);
            }
        }
        self.detach(most.1);
    }

    /// How many sightings hang on an anchor, and which is the vaguest.
    fn seen_from(&self, anchor: u32) -> (u32, u32) {
        let (mut count, mut vaguest) = (0, (0.0, NONE));
        let mut at = self
            .anchors
            .get(anchor)
            .map_or(NONE, |anchor| anchor.sightings);
        while let Some(sighting) = self.sightings.get(at) {
            let spread = sighting.point.covariance().trace();
            if spread > vaguest.0 {
                vaguest = (spread, at);
            }
            count += 1;
            at = sighting.next;
        }
        (count, vaguest.1)
    }

    /// How much is lost with an anchor; `None` if it must stay.
    fn loss(&self, number: u32) -> Option<f64> {
        let anchor = self.anchors.get(number)?;
        let neighbour = self.neighbour(anchor)?;
        let (motion, covariance) = match neighbour {
            Neighbour::Previous(_) => (anchor.motion, anchor.covariance),
            Neighbour::Next(next) => {
                let next = self.anchors.get(next)?;
                (next.motion.inverse(), next.covariance)
            }
        };
        let mut loss = self.unevenness_without(anchor) / UNEVENNESS_M;
        let mut at = anchor.sightings;
        while let Some(sighting) = self.sightings.get(at) {
            let spread = swing(&sighting.point.position, &covariance).trace();
            loss += spread / sighting.point.covariance().trace();
            at = sighting.next;
        }
        at = anchor.shown;
        while let Some(sighting) = self.sightings.get(at) {
            let spread = covariance.matrix().fixed_view::<3, 3>(0, 0).trace();
            loss += spread / sighting.point.covariance().trace();
            at = sighting.next_shown;
        }
        at = anchor.ties;
        while let Some(tie) = self.ties.get(at) {
            if tie.standing == Standing::Origin {
                return None;
            }
            let lever = motion.translation.vector.norm();
            let spread = covariance.matrix().trace() * (1.0 + lever * lever);
            loss += spread / tie.covariance.matrix().trace().max(f64::MIN_POSITIVE);
            at = self.next_tie(at, number);
        }
        Some(loss)
    }

    /// The neighbour to which the way is surer, of the same stretch. `None` for an agent's latest anchor.
    fn neighbour(&self, anchor: &Anchor) -> Option<Neighbour> {
        let next = self.anchors.get(anchor.next)?;
        let (before, after) = (anchor.covariance.matrix(), next.covariance.matrix());
        if anchor.begins || anchor.previous == NONE {
            return (!next.begins).then_some(Neighbour::Next(anchor.next));
        }
        if next.begins || before.trace() <= after.trace() {
            Some(Neighbour::Previous(anchor.previous))
        } else {
            Some(Neighbour::Next(anchor.next))
        }
    }

    /// How far the way past an anchor would deviate from an even motion if the anchor were not there \[m\].
    fn unevenness_without(&self, anchor: &Anchor) -> f64 {
        let Some(next) = self.anchors.get(anchor.next) else {
            return 0.0;
        };
        let known = anchor.unevenness_m.max(next.unevenness_m);
        let previous = self.anchors.get(anchor.previous);
        let Some(previous) = previous.filter(|_| !anchor.begins && !next.begins) else {
            return known;
        };
        let whole = anchor.motion * next.motion;
        let way_ns = next.stamp_ns.saturating_sub(previous.until_ns).max(1) as f64;
        let off = |stamp_ns: i64| {
            let share = stamp_ns.saturating_sub(previous.until_ns) as f64 / way_ns;
            // As whoever reads a trajectory interpolates, and much quicker than along a screw.
            let shift = whole.translation.vector * share - anchor.motion.translation.vector;
            let even = UnitQuaternion::identity().nlerp(&whole.rotation, share);
            shift.norm() + LEVER_M * even.angle_to(&anchor.motion.rotation)
        };
        known + off(anchor.stamp_ns).max(off(anchor.until_ns))
    }

    /// Takes an anchor out of its chain.
    pub(super) fn dissolve(&mut self, number: u32) {
        let revision = self.revision;
        let Some(anchor) = self.anchors.get(number).cloned() else {
            return;
        };
        let Some(neighbour) = self.neighbour(&anchor) else {
            return;
        };
        let unevenness_m = self.unevenness_without(&anchor);
        self.hand_over(number, &anchor, neighbour);
        if let Some(next) = self.anchors.get_mut(anchor.next, revision) {
            let (motion, covariance) = (next.motion, next.covariance);
            let calibrated = next.calibrated;
            next.previous = anchor.previous;
            next.unevenness_m = unevenness_m;
            if anchor.begins {
                next.begins = true;
                next.motion = Isometry3::identity();
                next.covariance = PoseCovariance::zero();
                next.calibrated = calibrated.without_motion();
            } else if !next.begins {
                let before =
                    { anchor.calibrated }.corrected_by(&anchor.motion, &calibrated.calibration);
                next.motion = before * motion;
                next.calibrated = anchor.calibrated.then(&calibrated);
                next.motion.rotation.renormalize_fast();
                next.covariance = composed(&anchor.covariance, &motion, &covariance);
            }
        }
        if let Some(previous) = self.anchors.get_mut(anchor.previous, revision) {
            previous.next = anchor.next;
        }
        for waiting in &mut self.waiting {
            if waiting.anchor == number {
                let (to, point) = match neighbour {
                    Neighbour::Previous(to) => {
                        (to, waiting.point.before(&anchor.motion, &anchor.covariance))
                    }
                    // An agent's latest anchors are its nearest ones: what waits here waits for long.
                    Neighbour::Next(to) => (to, waiting.point),
                };
                (waiting.anchor, waiting.point) = (to, point);
            }
        }
        self.anchors.remove(number, revision);
    }

    /// Hangs on a neighbour what hung on an anchor.
    fn hand_over(&mut self, number: u32, anchor: &Anchor, neighbour: Neighbour) {
        let (to, way, spread) = match neighbour {
            Neighbour::Previous(to) => (to, anchor.motion, anchor.covariance),
            Neighbour::Next(to) => {
                let Some(next) = self.anchors.get(to) else {
                    return;
                };
                (to, next.motion, next.covariance)
            }
        };
        let is_previous = matches!(neighbour, Neighbour::Previous(_));
        self.moor_beside(number, to);
        while let Some(mut sighting) = self.take_sighting(number) {
            sighting.anchor = to;
            sighting.point = if is_previous {
                sighting.point.before(&way, &spread)
            } else {
                sighting.point.after(&way, &spread)
            };
            let landmark = match sighting.shown {
                Shown::Landmark(landmark) => landmark,
                Shown::Agent(..) => NONE,
            };
            // An agent that was seen where it was seen from has left nothing to say.
            let sees_itself = matches!(sighting.shown, Shown::Agent(target, _) if target == to);
            if sees_itself || !self.attach(sighting) {
                self.landmarks.release(landmark, self.revision);
            }
        }
        while let Some(sighting) = self.take_shown(number) {
            self.show_beside(sighting, to, &way, &spread, is_previous);
        }
        // The first motion leads from the neighbour to the anchor, or from the anchor to the neighbour.
        loop {
            let at = self.anchors.get(number).map_or(NONE, |anchor| anchor.ties);
            let Some(mut tie) = self.untie(at) else {
                break;
            };
            let (there, back) = if is_previous {
                (way, way.inverse())
            } else {
                (way.inverse(), way)
            };
            // T_anchor = T_neighbour · there, both ways with the error of the way.
            let moved = se3::adjoint(&way);
            let on_its_other_side =
                PoseCovariance::from_matrix(&(moved * spread.matrix() * moved.transpose()));
            if tie.to == number {
                tie.to = to;
                tie.transform *= back;
                let noise = if is_previous {
                    on_its_other_side
                } else {
                    spread
                };
                tie.covariance = composed(&tie.covariance, &back, &noise);
            }
            if tie.from == number {
                tie.from = to;
                let noise = if is_previous {
                    spread
                } else {
                    on_its_other_side
                };
                tie.covariance = composed(&noise, &tie.transform, &tie.covariance);
                tie.transform = there * tie.transform;
            }
            tie.transform.rotation.renormalize_fast();
            self.tie(tie);
        }
    }

    /// A sighting that showed an anchor shows a place beside another one from now on.
    fn show_beside(
        &mut self,
        mut sighting: super::sighting::Sighting,
        to: u32,
        way: &Isometry3<f64>,
        spread: &PoseCovariance,
        is_previous: bool,
    ) {
        let Shown::Agent(was, lever) = sighting.shown else {
            return;
        };
        let (Some(observer), Some(target)) =
            (self.anchors.get(sighting.anchor), self.anchors.get(was))
        else {
            return;
        };
        let turn = observer.pose.rotation.inverse() * target.pose.rotation;
        let turn = turn.to_rotation_matrix().into_inner();
        // The noise of the way moves the place in the frame of the anchor that goes, or of the one that comes.
        let (place, noise) = if is_previous {
            let noise = turn * swing(&lever, spread) * turn.transpose();
            (way * nalgebra::Point3::from(lever), noise)
        } else {
            let place = way.inverse() * nalgebra::Point3::from(lever);
            let turn = turn * way.rotation.to_rotation_matrix().into_inner();
            let noise = turn * swing(&place.coords, spread) * turn.transpose();
            (place, noise)
        };
        sighting.shown = Shown::Agent(to, place.coords);
        sighting.point.fresh += super::sighting::symmetric(&noise);
        if sighting.anchor != to {
            self.attach(sighting);
        }
    }

    fn take_sighting(&mut self, anchor: u32) -> Option<super::sighting::Sighting> {
        let number = self.anchors.get(anchor)?.sightings;
        // The landmark stays in memory while its sighting is on the way.
        if let Shown::Landmark(landmark) = self.sightings.get(number)?.shown {
            self.landmarks.count(landmark, self.revision);
        }
        self.detach(number)
    }

    fn take_shown(&mut self, anchor: u32) -> Option<super::sighting::Sighting> {
        let number = self.anchors.get(anchor)?.shown;
        self.detach(number)
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
