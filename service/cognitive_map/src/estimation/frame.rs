//! One frame: the agents and landmarks whose errors are estimated together.

use std::collections::BTreeMap;

use nalgebra::{Matrix3, Point3, SMatrix, SVector, Vector3};

use super::covariance::JointCovariance;
use super::mover::{BODY_DIM, Mover};
use super::sensor::Sensor;
use crate::sample::Label;

/// Landmarks that are estimated jointly; of more, those seen longest ago leave.
pub(super) const MARKS_MAX: usize = 96;
/// Components of a landmark.
pub(super) const MARK_DIM: usize = 3;

/// An agent in a frame.
#[derive(Clone, Debug)]
pub(super) struct Member {
    /// Its number.
    pub(super) agent: u32,
    pub(super) mover: Mover,
    /// Where its error begins.
    pub(super) offset: usize,
    pub(super) sensor: Sensor,
    /// Sightings refused one after the other.
    pub(super) refused: u32,
}

/// A landmark in a frame.
#[derive(Clone, Debug)]
pub(super) struct Mark {
    /// Its number in the frame, never given twice.
    pub(super) number: u64,
    pub(super) position: Point3<f64>,
    /// Where its error begins.
    pub(super) offset: usize,
    /// The sighting of the frame that saw it last.
    pub(super) used: u64,
    /// Its sightings refused one after the other.
    pub(super) refused: u32,
}

/// One frame.
#[derive(Clone, Debug, Default)]
pub(super) struct Frame {
    pub(super) members: Vec<Member>,
    pub(super) marks: BTreeMap<Label, Mark>,
    /// Landmarks that left the joint estimate, with the covariance that they had.
    pub(super) dormant: BTreeMap<Label, (Point3<f64>, Matrix3<f64>)>,
    pub(super) covariance: JointCovariance,
    /// Landmarks numbered so far.
    pub(super) numbered: u64,
    /// Sightings so far.
    pub(super) sightings: u64,
}

impl Frame {
    /// Takes in an agent that nothing ties to the others yet.
    pub(super) fn join(&mut self, agent: u32, mover: Mover, sensor: Sensor) {
        let offset = self.covariance.grow(BODY_DIM);
        self.covariance.set_diagonal(offset, &mover.covariance);
        self.members.push(Member {
            agent,
            mover,
            offset,
            sensor,
            refused: 0,
        });
    }

    /// Lets an agent go, with what was learned about its odometry and its sensor.
    pub(super) fn leave(&mut self, agent: u32) -> Option<(Mover, Sensor)> {
        let index = self.member(agent)?;
        let member = self.members.remove(index);
        self.drop_components(member.offset, BODY_DIM);
        Some((member.mover, member.sensor))
    }

    /// Where an agent is in the list of members.
    pub(super) fn member(&self, agent: u32) -> Option<usize> {
        self.members.iter().position(|member| member.agent == agent)
    }

    /// Covariance of a landmark \[m²\].
    pub(super) fn mark_covariance(&self, mark: &Mark) -> Matrix3<f64> {
        self.covariance.block(mark.offset, mark.offset)
    }

    /// Whether all motion was in the plane.
    pub(super) fn is_planar(&self) -> bool {
        self.members.iter().all(|member| member.mover.is_planar)
    }

    /// Removes components and closes the gap.
    pub(super) fn drop_components(&mut self, offset: usize, width: usize) {
        self.covariance.remove(offset, width);
        let behind = |own: &mut usize| {
            if *own > offset {
                *own -= width;
            }
        };
        for member in &mut self.members {
            behind(&mut member.offset);
        }
        for mark in self.marks.values_mut() {
            behind(&mut mark.offset);
        }
    }

    /// Forgets where a landmark is.
    pub(super) fn forget(&mut self, label: &Label) {
        if let Some(mark) = self.marks.remove(label) {
            self.drop_components(mark.offset, MARK_DIM);
        }
        self.dormant.remove(label);
    }

    /// Makes room for one more landmark: those seen longest ago keep their own covariance only.
    pub(super) fn make_room(&mut self) {
        while self.marks.len() >= MARKS_MAX {
            let oldest = self.marks.iter().min_by_key(|(_, mark)| mark.used);
            let Some(label) = oldest.map(|(label, _)| label.clone()) else {
                return;
            };
            if let Some(mark) = self.marks.remove(&label) {
                let covariance = self.mark_covariance(&mark);
                self.drop_components(mark.offset, MARK_DIM);
                self.dormant.insert(label, (mark.position, covariance));
            }
        }
    }

    /// Brings all cross terms up to date.
    ///
    /// Between sightings a moving body keeps only its own covariance and its transition; what ties it to
    /// the others waits until it is needed.
    pub(super) fn flush(&mut self) {
        for member in &mut self.members {
            if member.mover.is_stale {
                let transition = member.mover.flush();
                let own = &member.mover.covariance;
                self.covariance.transform(member.offset, &transition, own);
            }
        }
    }

    /// Adds to the uncertainty of an agent's pose: it is not where it should be.
    pub(super) fn widen(&mut self, index: usize, sd_m: f64, sd_rad: f64) {
        self.flush();
        let member = &mut self.members[index];
        let is_planar = member.mover.is_planar;
        for k in 0..6 {
            let out_of_plane = matches!(k, 2..=4);
            if !(is_planar && out_of_plane) {
                let sd = if k < 3 { sd_m } else { sd_rad };
                member.mover.covariance[(k, k)] += sd * sd;
            }
        }
        self.covariance
            .set_diagonal(member.offset, &member.mover.covariance);
    }

    /// Corrects everything by what an observer's sighting tells, and carries the errors over to the
    /// corrected estimate.
    ///
    /// What nobody can know is where the whole map lies: an error θ of the observer's rotation goes with
    /// errors θ × (x − x̂₀) of all positions. Errors are therefore counted relative to the observer's
    /// rotation (the right-invariant error of Barrau & Bonnabel 2015), which makes them independent of
    /// the estimate: a correction Δ of a position changes its error by θ × Δ. Without this, corrections
    /// would feign knowledge of the whole map's direction (Huang, Mourikis & Roumeliotis 2010).
    pub(super) fn correct(&mut self, index: usize, correction: &[f64]) {
        let observer = &self.members[index];
        let world = observer
            .mover
            .pose
            .rotation
            .to_rotation_matrix()
            .into_inner();
        let source = observer.offset + 3;
        let mut levers: [Vec<f64>; 3] = std::array::from_fn(|_| vec![0.0; correction.len()]);
        let mut lever = |offset: usize, matrix: Matrix3<f64>| {
            for (column, lever) in levers.iter_mut().enumerate() {
                for row in 0..3 {
                    lever[offset + row] = matrix[(row, column)];
                }
            }
        };
        let mut turns = Vec::with_capacity(self.members.len());
        for member in &mut self.members {
            let error = SVector::from_fn(|k, _| correction[member.offset + k]);
            let before = member.mover.pose;
            member.mover.correct(&error);
            let moved = member.mover.pose.translation.vector - before.translation.vector;
            let to_body = before
                .rotation
                .to_rotation_matrix()
                .into_inner()
                .transpose();
            lever(member.offset, -(to_body * moved.cross_matrix() * world));
            turns.push(member.mover.pose.rotation.inverse() * before.rotation);
        }
        for mark in self.marks.values_mut() {
            let moved = Vector3::from_fn(|k, _| correction[mark.offset + k]);
            mark.position += moved;
            lever(mark.offset, -(moved.cross_matrix() * world));
        }
        self.covariance.shear(source, &levers);
        // Errors of a body are stated along its axes, which a correction has turned.
        for (member, turn) in self.members.iter_mut().zip(turns) {
            let turn = turn.to_rotation_matrix().into_inner();
            let mut axes = SMatrix::<f64, BODY_DIM, BODY_DIM>::identity();
            axes.fixed_view_mut::<3, 3>(0, 0).copy_from(&turn);
            axes.fixed_view_mut::<3, 3>(3, 3).copy_from(&turn);
            let own = self.covariance.block(member.offset, member.offset);
            let own = axes * own * axes.transpose();
            self.covariance.transform(member.offset, &axes, &own);
            member.mover.covariance = self.covariance.block(member.offset, member.offset);
        }
    }
}

/// Derivative of d = Rᵀ (p − x) by the error of the observer's pose: | −I  d× |.
pub(super) fn point_by_pose(point: &Vector3<f64>) -> SMatrix<f64, 3, 6> {
    let mut jacobian = SMatrix::<f64, 3, 6>::zeros();
    jacobian
        .fixed_view_mut::<3, 3>(0, 0)
        .copy_from(&-Matrix3::identity());
    jacobian
        .fixed_view_mut::<3, 3>(0, 3)
        .copy_from(&point.cross_matrix());
    jacobian
}

/// Without the asymmetry of rounding.
pub(super) fn symmetric(matrix: &Matrix3<f64>) -> Matrix3<f64> {
    (matrix + matrix.transpose()) * 0.5
}
