//! What a sighting does to a frame.

use std::ops::Range;
use std::sync::Arc;

use nalgebra::{Isometry3, Matrix3, Matrix6, Point3, SMatrix, SVector, Vector6};

use super::covariance::Block;
use super::dormant::Dormant;
use super::frame::{Frame, MARK_DIM, Mark, Member, point_by_pose, symmetric};
use super::innovation::{PointInnovation, pose_innovation, seen_at};
use super::observers::Observers;
use super::parameters::Parameters;
use super::seat::Traveller;
use super::sensor::Seen;
use crate::input::{Label, Relation, RelativePose};
use geometry::se3;

/// An agent whose sightings were refused this often in a row is not where it should be.
pub(super) const REFUSED_TO_WIDEN: u32 = 8;
/// By how much its pose then becomes less certain \[m, rad\].
const WIDENED: (f64, f64) = (1.0, 0.5);
/// A landmark whose sightings were refused this often in a row, by agents that are where they should
/// be, was moved or was never there.
const REFUSED_TO_FORGET: u32 = 8;
/// Least variance of a component that a dormant landmark gains \[m²\].
const GAIN_MIN_M2: f64 = 1e-9;

/// What became of a sighting.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Verdict {
    /// The target is new.
    Learned,
    /// It counted: normalised innovation squared, before any weighting, and number of components.
    Accepted {
        /// Normalised innovation squared.
        nis: f64,
        /// Number of components.
        components: u32,
    },
    /// It did not.
    Refused,
}

/// A sighting's verdict, and what it was weighed with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Weighed {
    pub(super) verdict: Verdict,
    /// Variances of its components, before those far from what is expected lose weight.
    pub(super) variance: Vector6<f64>,
}

impl Weighed {
    /// Of a sighting that says nothing.
    fn nothing() -> Self {
        Self {
            verdict: Verdict::Refused,
            variance: Vector6::zeros(),
        }
    }
}

/// A sighting of a frame's member: who, how it moved since, when, and what it saw.
#[derive(Clone, Copy, Debug)]
pub(super) struct Glance<'a> {
    /// Index of the observer among the members.
    pub(super) observer: usize,
    /// The observer's motion since then.
    pub(super) back: &'a Isometry3<f64>,
    pub(super) stamp_ns: i64,
    pub(super) relation: &'a Relation,
    pub(super) parameters: &'a Parameters,
}

impl Frame {
    /// A landmark was seen.
    pub(super) fn see_mark(&mut self, glance: &Glance<'_>, label: &Label) -> Weighed {
        self.flush();
        let side = Side::new(&self.members[glance.observer], glance.back);
        let Some(mark) = self.marks.get(label) else {
            return self.learn(glance, label);
        };
        let expected = side.pose.inverse_transform_point(&mark.position).coords;
        let Some(innovation) = PointInnovation::new(glance.relation, &expected) else {
            return Weighed::nothing();
        };
        let to_body = side
            .pose
            .rotation
            .to_rotation_matrix()
            .into_inner()
            .transpose();
        let blocks = [
            side.block(&(innovation.by_point * point_by_pose(&expected))),
            point_block(mark.offset, &(innovation.by_point * to_body)),
        ];
        let seen = Seen::Mark(mark.number);
        let scope = Scope {
            corrected: self.corrected_by(glance.observer),
            counts: true,
        };
        let weighed = self.take_in(glance, &blocks, &innovation, seen, &scope);
        let observer_refused = self.members[glance.observer].traveller.refused;
        let sightings = self.sightings;
        let agent = self.members[glance.observer].agent;
        let is_doubted = self.members[glance.observer].traveller.is_doubted();
        if let Some(mark) = Arc::make_mut(&mut self.marks).get_mut(label) {
            mark.used = sightings;
            // Who is doubted speaks neither against a landmark nor for it.
            if weighed.verdict != Verdict::Refused {
                mark.observers.note(agent);
            }
            if !is_doubted {
                let is_refused = weighed.verdict == Verdict::Refused;
                mark.refused = if is_refused { mark.refused + 1 } else { 0 };
            }
            // Of an agent that contradicts everything, the landmark is not to blame.
            if mark.refused >= REFUSED_TO_FORGET && observer_refused < REFUSED_TO_WIDEN / 2 {
                self.forget(label);
            }
        }
        self.recover(glance.observer);
        weighed
    }

    /// Another member was seen, which has moved by `back` since.
    pub(super) fn see_member(
        &mut self,
        glance: &Glance<'_>,
        target: usize,
        back: &Isometry3<f64>,
    ) -> Weighed {
        self.flush();
        let side = Side::new(&self.members[glance.observer], glance.back);
        let other = Side::new(&self.members[target], back);
        let (corrected, counts) = self.corrected_between(glance.observer, target);
        let scope = Scope { corrected, counts };
        let weighed = if let Relation::Pose(seen) = glance.relation {
            self.see_pose(glance, [&side, &other], seen, &scope)
        } else {
            let expected = side.pose.inv_mul(&other.pose).translation.vector;
            let Some(innovation) = PointInnovation::new(glance.relation, &expected) else {
                return Weighed::nothing();
            };
            let relative = side.pose.rotation.inverse() * other.pose.rotation;
            let turn = relative.to_rotation_matrix().into_inner();
            let mut by_target = SMatrix::<f64, 3, 6>::zeros();
            by_target
                .fixed_view_mut::<3, 3>(0, 0)
                .copy_from(&(innovation.by_point * turn));
            let blocks = [
                side.block(&(innovation.by_point * point_by_pose(&expected))),
                other.block(&by_target),
            ];
            let seen = Seen::Agent(self.members[target].agent);
            self.take_in(glance, &blocks, &innovation, seen, &scope)
        };
        self.recover(glance.observer);
        weighed
    }

    /// A landmark that is not among those estimated jointly.
    fn learn(&mut self, glance: &Glance<'_>, label: &Label) -> Weighed {
        self.make_room();
        if self.members[glance.observer].traveller.is_doubted()
            && let Some(dormant) = self.dormant.remove(label)
        {
            // It corrects itself by it, as by one that is awake.
            self.wake(label, &dormant);
            return self.see_mark(glance, label);
        }
        let member = &self.members[glance.observer];
        let side = Side::new(member, glance.back);
        let (point, stated) = seen_at(glance.relation);
        let mut variance = Vector6::zeros();
        let noise = PointInnovation::new(glance.relation, &point).and_then(|innovation| {
            let sensor = &member.traveller.sensor;
            let components = sensor.variance(&innovation, glance.parameters);
            variance.fixed_rows_mut::<3>(0).copy_from(&components);
            let inverse = innovation.by_point.try_inverse()?;
            Some(inverse * Matrix3::from_diagonal(&components) * inverse.transpose())
        });
        let world = side.pose.rotation.to_rotation_matrix().into_inner();
        let noise = world * noise.unwrap_or(stated) * world.transpose();
        let by_pose = -(world * point_by_pose(&point));
        let offset = self
            .covariance
            .append(&[side.block(&by_pose)], &symmetric(&noise));
        // Who saw one that was asleep is forgotten.
        let mut observers = if self.dormant.contains(label) {
            Observers::unknown()
        } else {
            Observers::default()
        };
        observers.note(self.members[glance.observer].agent);
        let mark = Mark {
            number: self.numbered,
            position: side.pose * Point3::from(point),
            offset,
            used: self.sightings,
            refused: 0,
            observers,
        };
        self.numbered += 1;
        Arc::make_mut(&mut self.marks).insert(label.clone(), mark);
        let verdict = match self.dormant.remove(label) {
            None => Verdict::Learned,
            Some(dormant) => self.recall(glance, offset, &dormant),
        };
        Weighed { verdict, variance }
    }

    /// A landmark wakes up as it was, and correlated with nothing.
    fn wake(&mut self, label: &Label, dormant: &Dormant) {
        let offset = self.covariance.grow(MARK_DIM);
        self.covariance.set_diagonal(offset, &dormant.covariance);
        let mut observers = Observers::default();
        match dormant.only {
            Some(agent) => observers.note(agent),
            None => observers = Observers::unknown(),
        }
        let mark = Mark {
            number: self.numbered,
            position: dormant.position,
            offset,
            used: self.sightings,
            refused: 0,
            observers,
        };
        self.numbered += 1;
        Arc::make_mut(&mut self.marks).insert(label.clone(), mark);
    }

    /// A landmark came back whose earlier estimate may be correlated with everything.
    ///
    /// Its own estimate becomes the covariance intersection (Julier & Uhlmann 1997) of the new and the
    /// old one, with the weight ½; what it gains by that is passed on to the rest:
    ///
    /// ```text
    /// R⁻¹ = ½ (Σ_old⁻¹ − Σ_new⁻¹), as far as that is positive
    /// ```
    fn recall(&mut self, glance: &Glance<'_>, offset: usize, dormant: &Dormant) -> Verdict {
        let accepted = Verdict::Accepted {
            nis: 0.0,
            components: 0,
        };
        let own: Matrix3<f64> = self.covariance.block(offset, offset);
        let inverses = own.try_inverse().zip(dormant.covariance.try_inverse());
        let Some((own_information, old_information)) = inverses else {
            return accepted;
        };
        let gain = symmetric(&((old_information - own_information) * 0.5));
        if !gain.iter().all(|entry| entry.is_finite()) {
            return accepted; // of such a matrix the search for eigenvalues need not end
        }
        let gain = gain.symmetric_eigen();
        let variances = gain
            .eigenvalues
            .map(|information| 1.0 / information.clamp(GAIN_MIN_M2, 1.0 / GAIN_MIN_M2));
        let axes = gain.eigenvectors;
        let block = point_block(offset, &axes.transpose());
        let projection = self.covariance.project(&[block]);
        let here = self.marks.values().find(|mark| mark.offset == offset);
        let Some(here) = here.map(|mark| mark.position) else {
            return accepted;
        };
        let innovation = axes.transpose() * (dormant.position - here);
        let spread = projection.spread;
        let far = (0..3).any(|k| {
            let expected = spread[(k, k)] + 2.0 * dormant.covariance.trace();
            innovation[k] * innovation[k] > 36.0 * expected
        });
        if far {
            return Verdict::Refused;
        }
        let s = spread + Matrix3::from_diagonal(&variances);
        let all = self.covariance.all();
        if let Some(correction) = self.covariance.update(projection, &innovation, &s, &all) {
            self.correct(glance.observer, &correction, glance.parameters);
        }
        accepted
    }

    /// Weighs an innovation and takes it in.
    fn take_in(
        &mut self,
        glance: &Glance<'_>,
        blocks: &[Block<3>],
        innovation: &PointInnovation,
        seen: Seen,
        scope: &Scope,
    ) -> Weighed {
        let parameters = glance.parameters;
        let projection = self.covariance.project(blocks);
        let member = self.members[glance.observer].traveller_mut();
        let mut variance = member.sensor.variance(innovation, parameters);
        let mut weighed = Weighed::nothing();
        weighed.variance.fixed_rows_mut::<3>(0).copy_from(&variance);
        let spread = projection.spread.diagonal();
        let squares = innovation
            .residual
            .component_mul(&innovation.residual)
            .component_div(&(spread + variance));
        // A square that is not a number is refused, too.
        if !squares
            .iter()
            .all(|square| square.sqrt() <= parameters.gate)
        {
            scope.weigh(member, true, false);
            return weighed;
        }
        let fits = squares
            .iter()
            .all(|square| square.sqrt() <= parameters.soft);
        scope.weigh(member, false, fits);
        member
            .sensor
            .note(seen, glance.stamp_ns, innovation, &spread, &variance);
        // A planar robot's elevations are no measurements.
        let is_flat =
            member.mover.is_planar && innovation.is_polar && innovation.residual[2] == 0.0;
        let components: usize = if is_flat { 2 } else { 3 };
        let nis = squares.iter().take(components).sum();
        for (variance, square) in variance.iter_mut().zip(squares.iter()) {
            *variance *= (square / parameters.soft.powi(2)).max(1.0);
        }
        let s = projection.spread + Matrix3::from_diagonal(&variance);
        let (joint, corrected) = (&mut self.covariance, &scope.corrected);
        let update = joint.update(projection, &innovation.residual, &s, corrected);
        if let Some(correction) = update {
            self.correct(glance.observer, &correction, parameters);
        }
        let components = if is_flat { 2 } else { 3 };
        weighed.verdict = Verdict::Accepted { nis, components };
        weighed
    }

    /// A full pose of another member was seen.
    fn see_pose(
        &mut self,
        glance: &Glance<'_>,
        [side, other]: [&Side; 2],
        seen: &RelativePose,
        scope: &Scope,
    ) -> Weighed {
        let (residual, by_observer, by_target, variance) =
            pose_innovation(seen, &side.pose, &other.pose);
        let blocks = [side.block(&by_observer), other.block(&by_target)];
        let projection = self.covariance.project(&blocks);
        let spread: SVector<f64, 6> = projection.spread.diagonal();
        let squares = residual
            .component_mul(&residual)
            .component_div(&(spread + variance));
        let parameters = glance.parameters;
        let member = self.members[glance.observer].traveller_mut();
        let mut weighed = Weighed {
            verdict: Verdict::Refused,
            variance,
        };
        if !squares
            .iter()
            .all(|square| square.sqrt() <= parameters.gate)
        {
            scope.weigh(member, true, false);
            return weighed;
        }
        let fits = squares
            .iter()
            .all(|square| square.sqrt() <= parameters.soft);
        scope.weigh(member, false, fits);
        let factors = squares.map(|square| (square / parameters.soft.powi(2)).max(1.0));
        let weighted = variance.component_mul(&factors);
        let s = projection.spread + SMatrix::from_diagonal(&weighted);
        let (joint, corrected) = (&mut self.covariance, &scope.corrected);
        let update = joint.update(projection, &residual, &s, corrected);
        if let Some(correction) = update {
            self.correct(glance.observer, &correction, parameters);
        }
        weighed.verdict = Verdict::Accepted {
            nis: squares.sum(),
            components: 6,
        };
        weighed
    }

    /// Lets an agent whose sightings contradict the estimate search farther around.
    fn recover(&mut self, observer: usize) {
        if self.members[observer].traveller.refused >= REFUSED_TO_WIDEN {
            self.members[observer].traveller_mut().refused = 0;
            self.widen(observer, WIDENED.0, WIDENED.1);
        }
    }
}

/// What a sighting may do.
#[derive(Clone, Debug)]
struct Scope {
    /// The components that it corrects.
    corrected: Range<usize>,
    /// Whether it speaks for or against its observer.
    counts: bool,
}

impl Scope {
    fn weigh(&self, observer: &mut Traveller, is_refused: bool, fits: bool) {
        if self.counts {
            observer.weigh(is_refused, fits);
        }
    }
}

/// A member at an instant.
#[derive(Clone, Debug)]
struct Side {
    pose: Isometry3<f64>,
    /// The pose's error now by that then.
    by_now: Matrix6<f64>,
    offset: usize,
}

impl Side {
    fn new(member: &Member, back: &Isometry3<f64>) -> Self {
        Self {
            pose: member.mover().pose * back.inverse(),
            by_now: se3::adjoint(back),
            offset: member.offset,
        }
    }

    fn block<const M: usize>(&self, jacobian: &SMatrix<f64, M, 6>) -> Block<M> {
        Block {
            offset: self.offset,
            width: 6,
            jacobian: jacobian * self.by_now,
        }
    }
}

/// The part of a Jacobian that belongs to a landmark.
pub(super) fn point_block(offset: usize, jacobian: &Matrix3<f64>) -> Block<3> {
    let mut wide = SMatrix::<f64, 3, 6>::zeros();
    wide.fixed_view_mut::<3, 3>(0, 0).copy_from(jacobian);
    Block {
        offset,
        width: MARK_DIM,
        jacobian: wide,
    }
}
