//! Merging of a frame into another one: members, landmarks, covariance.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::sync::Arc;

use nalgebra::{Matrix3, SMatrix, Vector3};

use super::frame::{Frame, LANDMARK_DIM, LandmarkState, Member};
use super::frame_alignment::{FrameAlignment, PointPair, point_by_alignment, pose_by_alignment};
use super::jacobian::Block;
use super::landmark_archive::LandmarkArchive;
use super::measurement_update::point_block;
use super::parameters::Parameters;
use super::tuning::SAME_LANDMARK_VARIANCE_M2;
use crate::input::Label;
use geometry::symmetric;

impl Frame {
    /// The landmarks known in both frames.
    pub(super) fn shared(&self, newer: &Self) -> Vec<PointPair> {
        let pair = |(label, landmark): (&Label, &LandmarkState)| {
            let (position, covariance) = self.known_landmark(label)?;
            let spread = covariance.trace() + newer.landmark_covariance(landmark).trace();
            let variance = spread / 3.0 + SAME_LANDMARK_VARIANCE_M2;
            Some(PointPair {
                older: position,
                newer: landmark.position,
                variance,
            })
        };
        newer.landmarks.iter().filter_map(pair).collect()
    }

    /// A landmark is called by another name, which is not known here.
    pub(super) fn rename(&mut self, from: &Label, to: &Label) {
        if self.landmarks.contains_key(from) {
            let landmarks = Arc::make_mut(&mut self.landmarks);
            if let Some(landmark) = landmarks.remove(from) {
                landmarks.insert(to.clone(), landmark);
            }
        }
        if let Some(landmark) = self.archive.remove(from) {
            self.archive.insert(to.clone(), landmark);
        }
    }

    /// Merges a newer frame into this one. Landmarks known in both become one.
    ///
    /// With the newer frame's pose T in this one, whose error is τ, a body's error gains `Ad(T_b⁻¹)
    /// τ` and a landmark's error δ becomes R (δ + ρ − l × φ). The landmarks known in both then say
    /// how T really lies, so that its covariance need only be wide.
    pub(super) fn merge(
        &mut self,
        newer: Self,
        alignment: &FrameAlignment,
        parameters: &Parameters,
    ) {
        self.merge_with_parameters(newer, alignment, Some(parameters));
    }

    /// The same for a newer frame whose agents are doubted: landmarks known in both stay as they
    /// are here.
    pub(super) fn merge_doubted(&mut self, newer: Self, alignment: &FrameAlignment) {
        self.merge_with_parameters(newer, alignment, None);
    }

    /// Merges a newer frame into this one. With parameters, the landmarks known in both are
    /// equated.
    fn merge_with_parameters(
        &mut self,
        mut newer: Self,
        alignment: &FrameAlignment,
        parameters: Option<&Parameters>,
    ) {
        self.flush();
        newer.flush();
        if parameters.is_some() {
            for label in newer.landmarks.keys() {
                self.restore(label);
            }
        }
        let first_number = self.numbered;
        self.numbered = self.numbered.saturating_add(newer.numbered);
        let start = self.covariance.grow(newer.covariance.dim());
        self.covariance.place(start, &newer.covariance);
        let tau = self.covariance.grow(6);
        self.covariance
            .set_diagonal::<6>(tau, &alignment.covariance);
        let newcomers = self.members.len();
        self.add_members(std::mem::take(&mut newer.members), alignment, start, tau);
        let landmarks = Arc::unwrap_or_clone(newer.landmarks);
        let mut duplicates = self.add_landmarks(landmarks, alignment, [start, tau], first_number);
        for member in &mut self.members[newcomers..] {
            let own = self.covariance.block(member.offset, member.offset);
            *member.state_mut().filter.covariance_mut() = own;
        }
        if let Some(parameters) = parameters {
            for index in 0..duplicates.len() {
                self.equate(&mut duplicates, index, parameters);
            }
        }
        // From the end, so that the offsets of the others stay as they are.
        duplicates.sort_by_key(|(_, duplicate)| std::cmp::Reverse(duplicate.offset));
        self.drop_components(tau, 6);
        for (_, duplicate) in duplicates {
            self.drop_components(duplicate.offset, LANDMARK_DIM);
        }
        self.take_over(&newer.archive, alignment, first_number);
        self.population += newer.population;
        self.make_room();
    }

    /// Adds the members of a newer frame, whose components begin at `start` and those of the
    /// alignment's error at `tau`.
    fn add_members(
        &mut self,
        members: Vec<Member>,
        alignment: &FrameAlignment,
        start: usize,
        tau: usize,
    ) {
        for mut member in members {
            member.offset += start;
            member.used = self.sightings;
            let by_alignment = pose_by_alignment(&member.filter().pose);
            self.covariance.add(member.offset, 6, tau, &by_alignment);
            let state = member.state_mut();
            state.filter.pose = alignment.pose * state.filter.pose;
            // Numbers of landmarks change.
            state.forget_targets();
            self.members.push(member);
        }
    }

    /// Adds the landmarks of a newer frame likewise, numbered from `first_number` on; answers those
    /// that are known here.
    fn add_landmarks(
        &mut self,
        added: BTreeMap<Label, LandmarkState>,
        alignment: &FrameAlignment,
        [start, tau]: [usize; 2],
        first_number: u64,
    ) -> Vec<(Label, LandmarkState)> {
        let rotation = alignment.pose.rotation.to_rotation_matrix().into_inner();
        let mut duplicates = Vec::new();
        let landmarks = Arc::make_mut(&mut self.landmarks);
        for (label, mut landmark) in added {
            landmark.offset += start;
            let by_alignment = point_by_alignment(&landmark.position);
            self.covariance.add(landmark.offset, 3, tau, &by_alignment);
            let own = self
                .covariance
                .block::<3, 3>(landmark.offset, landmark.offset);
            let turned = rotation * own * rotation.transpose();
            let turned = symmetric(&turned);
            self.covariance
                .transform::<3>(landmark.offset, &rotation, &turned);
            landmark.position = alignment.pose * landmark.position;
            landmark.used = self.sightings;
            landmark.evidence.rival = None; // its position was one of the other frame
            landmark.number = landmark.number.saturating_add(first_number);
            landmark.is_anchor = false;
            if self.archive.contains(&label) {
                duplicates.push((label, landmark));
                continue;
            }
            match landmarks.entry(label) {
                Entry::Occupied(entry) => duplicates.push((entry.key().clone(), landmark)),
                Entry::Vacant(entry) => {
                    entry.insert(landmark);
                }
            }
        }
        duplicates
    }

    /// Archives the archived landmarks of a newer frame here, unless they are known here, numbered
    /// from `first_number` on.
    fn take_over(
        &mut self,
        newer: &LandmarkArchive,
        alignment: &FrameAlignment,
        first_number: u64,
    ) {
        for (label, landmark) in newer.iter() {
            if self.landmarks.contains_key(label) || self.archive.contains(label) {
                continue;
            }
            let mut archived = landmark.aligned(alignment);
            archived.left = self.sightings;
            archived.number = archived.number.saturating_add(first_number);
            for tie in &mut archived.ties {
                // An anchor that is known here, too, keeps its number here, and ties nothing.
                tie.number = tie.number.saturating_add(first_number);
            }
            self.archive.insert(label.clone(), archived);
        }
    }

    /// Two landmarks are one.
    pub(super) fn equate(
        &mut self,
        duplicates: &mut [(Label, LandmarkState)],
        index: usize,
        parameters: &Parameters,
    ) {
        if self.members.is_empty() {
            return; // errors are counted relative to the rotation of a member
        }
        let (label, other) = &duplicates[index];
        if let Some(one) = Arc::make_mut(&mut self.landmarks).get_mut(label) {
            one.observers.join(&other.observers);
        }
        let Some(one) = self.landmarks.get(label) else {
            return;
        };
        let blocks: [Block<3>; 2] = [
            point_block(one.offset, &Matrix3::identity()),
            point_block(other.offset, &-Matrix3::identity()),
        ];
        let innovation = other.position - one.position;
        let projection = self.covariance.project(&blocks);
        let mut variance = SMatrix::<f64, 3, 1>::repeat(SAME_LANDMARK_VARIANCE_M2);
        let mut agree = true;
        for k in 0..3 {
            let expected = projection.spread[(k, k)] + variance[k];
            let square = innovation[k] * innovation[k] / expected;
            // A contradiction counts little: the points do not agree, or the label is not one
            // landmark's.
            let excess = square / parameters.soft.powi(2) - 1.0;
            variance[k] += expected * excess.max(0.0);
            agree &= excess <= 0.0;
        }
        if agree {
            let label = label.clone();
            self.confirm(&label);
        }
        let s = projection.spread + Matrix3::from_diagonal(&variance);
        let all = self.covariance.all();
        if let Some(correction) = self.covariance.update(projection, &innovation, &s, &all) {
            let arc = self.correct(0, &correction, parameters);
            for (_, duplicate) in duplicates {
                duplicate.position +=
                    arc * Vector3::from_fn(|k, _| correction[duplicate.offset + k]);
            }
        }
    }
}
