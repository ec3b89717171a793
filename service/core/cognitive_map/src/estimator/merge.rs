//! Two frames become one.

use std::collections::btree_map::Entry;
use std::sync::Arc;

use nalgebra::{Matrix3, SMatrix, Vector3};

use super::covariance::Block;
use super::dormant::{Dormant, DormantMarks};
use super::frame::{Frame, MARK_DIM, Mark, symmetric};
use super::parameters::Parameters;
use super::sight::point_block;
use super::tie::{Pair, Tie, body_by_tie, point_by_tie};
use crate::input::Label;

/// Variance of the distance between the two estimates of one landmark, beside their own \[m²\].
const SAME_VARIANCE_M2: f64 = 1e-4;

impl Frame {
    /// The landmarks known in both frames.
    pub(super) fn shared(&self, newer: &Self) -> Vec<Pair> {
        let pair = |(label, mark): (&Label, &Mark)| {
            let other = newer.marks.get(label)?;
            let spread = self.mark_covariance(mark).trace() + newer.mark_covariance(other).trace();
            let variance = spread / 3.0 + SAME_VARIANCE_M2;
            Some(Pair {
                older: mark.position,
                newer: other.position,
                variance,
            })
        };
        self.marks.iter().filter_map(pair).collect()
    }

    /// A landmark is called by another name, which is not known here.
    pub(super) fn rename(&mut self, from: &Label, to: &Label) {
        if self.marks.contains_key(from) {
            let marks = Arc::make_mut(&mut self.marks);
            if let Some(mark) = marks.remove(from) {
                marks.insert(to.clone(), mark);
            }
        }
        if let Some(mark) = self.dormant.remove(from) {
            self.dormant.insert(to.clone(), mark);
        }
    }

    /// Lays a newer frame into this one. Landmarks known in both become one.
    ///
    /// With the newer frame's pose T in this one, whose error is τ, a body's error gains `Ad(T_b⁻¹) τ` and
    /// a landmark's error δ becomes R (δ + ρ − l × φ). The landmarks known in both then say how T really
    /// lies, so that its covariance need only be wide.
    pub(super) fn merge(&mut self, newer: Self, tie: &Tie, parameters: &Parameters) {
        self.lay(newer, tie, Some(parameters));
    }

    /// The same for a newer frame whose agents are doubted: landmarks known in both stay as they
    /// are here.
    pub(super) fn take_in_doubted(&mut self, newer: Self, tie: &Tie) {
        self.lay(newer, tie, None);
    }

    /// Lays a newer frame into this one, and equates the landmarks known in both if there are
    /// parameters for that.
    fn lay(&mut self, mut newer: Self, tie: &Tie, parameters: Option<&Parameters>) {
        self.flush();
        newer.flush();
        let start = self.covariance.grow(newer.covariance.dim());
        self.covariance.place(start, &newer.covariance);
        let tau = self.covariance.grow(6);
        self.covariance.set_diagonal::<6>(tau, &tie.covariance);
        let rotation = tie.pose.rotation.to_rotation_matrix().into_inner();
        let newcomers = self.members.len();
        for mut member in std::mem::take(&mut newer.members) {
            member.offset += start;
            member.used = self.sightings;
            let by_tie = body_by_tie(&member.mover().pose);
            self.covariance.add(member.offset, 6, tau, &by_tie);
            let traveller = member.traveller_mut();
            traveller.mover.pose = tie.pose * traveller.mover.pose;
            // Numbers of landmarks change.
            traveller.sensor.latest.clear();
            self.members.push(member);
        }
        let mut twins = Vec::new();
        let marks = Arc::make_mut(&mut self.marks);
        for (label, mut mark) in Arc::unwrap_or_clone(newer.marks) {
            mark.offset += start;
            let by_tie = point_by_tie(&mark.position);
            self.covariance.add(mark.offset, 3, tau, &by_tie);
            let own = self.covariance.block::<3, 3>(mark.offset, mark.offset);
            let turned = rotation * own * rotation.transpose();
            let turned = (turned + turned.transpose()) * 0.5;
            self.covariance
                .transform::<3>(mark.offset, &rotation, &turned);
            mark.position = tie.pose * mark.position;
            mark.used = self.sightings;
            mark.number = self.numbered;
            self.numbered += 1;
            match marks.entry(label) {
                Entry::Occupied(entry) => twins.push((entry.key().clone(), mark)),
                Entry::Vacant(entry) => {
                    entry.insert(mark);
                }
            }
        }
        for member in &mut self.members[newcomers..] {
            let own = self.covariance.block(member.offset, member.offset);
            *member.traveller_mut().mover.covariance_mut() = own;
        }
        if let Some(parameters) = parameters {
            for index in 0..twins.len() {
                self.equate(&mut twins, index, parameters);
            }
        }
        // From the end, so that the offsets of the others stay as they are.
        twins.sort_by_key(|(_, twin)| std::cmp::Reverse(twin.offset));
        self.drop_components(tau, 6);
        for (_, twin) in twins {
            self.drop_components(twin.offset, MARK_DIM);
        }
        self.take_over(&newer.dormant, tie);
        self.population += newer.population;
        self.make_room();
    }

    /// The landmarks that sleep in a newer frame sleep here, unless they are known here.
    fn take_over(&mut self, newer: &DormantMarks, tie: &Tie) {
        let rotation = tie.pose.rotation.to_rotation_matrix().into_inner();
        for (label, mark) in newer.iter() {
            if self.marks.contains_key(label) || self.dormant.contains(label) {
                continue;
            }
            let by_tie: SMatrix<f64, 3, 6> = point_by_tie(&mark.position)
                .fixed_view::<3, 6>(0, 0)
                .into_owned();
            let spread = mark.covariance + by_tie * tie.covariance * by_tie.transpose();
            let dormant = Dormant {
                position: tie.pose * mark.position,
                covariance: symmetric(&(rotation * spread * rotation.transpose())),
                left: self.sightings,
                only: mark.only,
            };
            self.dormant.insert(label.clone(), dormant);
        }
    }

    /// Two landmarks are one.
    pub(super) fn equate(
        &mut self,
        twins: &mut [(Label, Mark)],
        index: usize,
        parameters: &Parameters,
    ) {
        if self.members.is_empty() {
            return; // of nobody is there a rotation by which errors could be counted
        }
        let (label, other) = &twins[index];
        if let Some(one) = Arc::make_mut(&mut self.marks).get_mut(label) {
            one.observers.join(&other.observers);
        }
        let Some(one) = self.marks.get(label) else {
            return;
        };
        let blocks: [Block<3>; 2] = [
            point_block(one.offset, &Matrix3::identity()),
            point_block(other.offset, &-Matrix3::identity()),
        ];
        let innovation = other.position - one.position;
        let projection = self.covariance.project(&blocks);
        let mut variance = SMatrix::<f64, 3, 1>::repeat(SAME_VARIANCE_M2);
        for k in 0..3 {
            let expected = projection.spread[(k, k)] + variance[k];
            let square = innovation[k] * innovation[k] / expected;
            // A contradiction counts little: the points do not agree, or the label is not one landmark's.
            variance[k] += expected * (square / parameters.soft.powi(2) - 1.0).max(0.0);
        }
        let s = projection.spread + Matrix3::from_diagonal(&variance);
        let all = self.covariance.all();
        if let Some(correction) = self.covariance.update(projection, &innovation, &s, &all) {
            let arc = self.correct(0, &correction, parameters);
            for (_, twin) in twins {
                twin.position += arc * Vector3::from_fn(|k, _| correction[twin.offset + k]);
            }
        }
    }
}
