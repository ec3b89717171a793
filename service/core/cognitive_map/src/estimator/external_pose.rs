//! Fusion of an external estimate, which may rest on the same samples: an agent's pose, and the
//! lasting errors of its odometry.

use std::sync::Arc;

use nalgebra::{Isometry3, Matrix6, SMatrix, Vector6};

use super::agent_filter::AgentFilter;
use super::calibration::{Calibration, LastingErrors, VEER};
use super::effect::Effect;
use super::frame::Frame;
use super::jacobian::Block;
use super::joint::Estimator;
use super::parameters::Parameters;
use super::tuning::{
    INTERSECTION_GAIN_MAX, INTERSECTION_GAIN_MIN, INTERSECTION_STEPS, INTERSECTION_VARIANCE_MIN,
};
use geometry::{OUT_OF_PLANE, PoseCovariance, is_somewhere, se3, symmetric};

/// What another estimate says of an agent.
#[derive(Clone, Copy, Debug)]
pub struct ExternalEstimate {
    /// Its pose, in the frame of the agent.
    pub pose: Isometry3<f64>,
    /// Covariance of the pose's error (right perturbation).
    pub covariance: PoseCovariance,
    /// The lasting errors of its odometry, and their variances in the order of the components.
    pub calibration: Option<(Calibration, LastingErrors)>,
    /// Whether it prevails where the pose contradicts the present one, because it knows of more:
    /// odometry was worse than it said, and the present pose is widened first. Otherwise it does
    /// not count then.
    pub prevails: bool,
}

impl Estimator {
    /// Takes in what an outside estimate says of an agent; answers whether it counts.
    ///
    /// How its error is correlated with that of the present estimate is not known: both may rest
    /// upon the same samples. The pose becomes the covariance intersection (Julier & Uhlmann 1997)
    /// of the two, and everything correlated with it follows; to say the same twice adds nothing.
    ///
    /// The lasting errors of odometry's rotations are taken over, and no longer correlated with
    /// anything.
    pub fn fuse(
        &mut self,
        agent: u32,
        external: &ExternalEstimate,
        effects: &mut Vec<Effect>,
    ) -> bool {
        if !is_somewhere(&external.pose.translation.vector) {
            return false;
        }
        self.alter(agent, effects, |frame, index, parameters| {
            frame.fuse(index, external, parameters)
        })
    }

    /// An agent of the map is where another estimate has it, in place of the present one; its error
    /// on the right has this covariance. It is no longer correlated with anything.
    pub fn settle(
        &mut self,
        agent: u32,
        pose: &Isometry3<f64>,
        covariance: &PoseCovariance,
        effects: &mut Vec<Effect>,
    ) {
        let is_known = covariance.matrix().iter().all(|entry| entry.is_finite());
        if is_known && is_somewhere(&pose.translation.vector) {
            self.alter(agent, effects, |frame, index, _| {
                frame.settle(index, pose, covariance.matrix());
                true
            });
        }
    }

    /// Alters an agent in its frame, or by itself where it is detached; answers what `alter` does,
    /// with `false` meaning that nothing has changed.
    fn alter(
        &mut self,
        agent: u32,
        effects: &mut Vec<Effect>,
        alter: impl FnOnce(&mut Frame, usize, &Parameters) -> bool,
    ) -> bool {
        let Some(number) = self.frame_of(agent) else {
            return false;
        };
        if let Some(detached) = &mut self.slot_mut(agent).detached {
            let state = Arc::clone(&detached.state);
            let mut alone = Frame::default();
            alone.join(agent, state);
            let is_altered = alter(&mut alone, 0, &self.parameters);
            if let Some(state) = alone.leave(agent)
                && is_altered
                && let Some(detached) = &mut self.slot_mut(agent).detached
            {
                detached.state = state;
                // The outside estimate may rest upon what the others saw.
                detached.was_joint = true;
            }
            return is_altered;
        }
        let Some(frame) = self.frames.get_mut(number, 0) else {
            return false;
        };
        let is_altered = frame
            .member(agent)
            .is_some_and(|index| alter(frame, index, &self.parameters));
        self.sweep(number, effects);
        is_altered
    }
}

impl Frame {
    /// Fuses an external estimate of a member; answers whether it counts.
    ///
    /// With the member's own P and the external Σ, in units of the own deviations, and the
    /// innovation ν:
    ///
    /// ```text
    /// ω of the largest det(ω P⁻¹ + (1 − ω) Σ⁻¹)      G = (1 − ω) (Σ⁻¹ − P⁻¹) = V Λ Vᵀ
    /// a measurement Vᵀ ξ = Λ⁻¹ Vᵀ (1 − ω) Σ⁻¹ ν of covariance Λ⁻¹, where Λ is large enough
    /// ```
    fn fuse(&mut self, index: usize, external: &ExternalEstimate, parameters: &Parameters) -> bool {
        self.flush();
        if let Some((calibration, variances)) = &external.calibration {
            self.recalibrate(index, calibration, variances, parameters);
        }
        let mut intersection = Intersection::new(self.members[index].filter(), external);
        if !intersection.is_near(parameters.gate) {
            if !external.prevails {
                return false;
            }
            self.put(index, &intersection);
            intersection = Intersection::new(self.members[index].filter(), external);
        }
        let member = &self.members[index];
        let Some((jacobian, residual, variance)) = intersection.measurement() else {
            return false;
        };
        let block = Block {
            offset: member.offset,
            width: 6,
            jacobian,
        };
        let projection = self.covariance.project(&[block]);
        let s = projection.spread + SMatrix::from_diagonal(&variance);
        let all = self.covariance.all();
        if let Some(correction) = self.covariance.update(projection, &residual, &s, &all) {
            self.correct(index, &correction, parameters);
        }
        true
    }
}

impl Frame {
    /// Sets the lasting errors of a member's rotations, and makes all of its odometry uncorrelated
    /// with everything: the length's, too, or the pose that comes with them would be taken for a
    /// measurement of it.
    fn recalibrate(
        &mut self,
        index: usize,
        calibration: &Calibration,
        variances: &LastingErrors,
        parameters: &Parameters,
    ) {
        let member = &mut self.members[index];
        let (offset, mut variances) = (member.offset + 6, *variances);
        let own = &member.filter().calibration;
        let mut calibration = Calibration {
            length: own.length,
            ..*calibration
        };
        variances[0] = self.covariance.variance(offset);
        // Until a landmark was seen, the veer is as the past has it. From then on it stays where
        // the past does not say what it is.
        let veer_variance = self.covariance.variance(offset + VEER);
        if veer_variance == 0.0 {
            variances[VEER] = 0.0;
        } else if variances[VEER] == 0.0 {
            calibration.veer_rad_m = own.veer_rad_m;
            variances[VEER] = veer_variance;
        }
        self.covariance.isolate(offset, &variances);
        member
            .state_mut()
            .filter
            .set_calibration(&calibration, parameters);
        self.tell_members();
    }

    /// Puts a member where another estimate has it, with a covariance of its own.
    fn settle(&mut self, index: usize, pose: &Isometry3<f64>, covariance: &Matrix6<f64>) {
        self.flush();
        let member = &mut self.members[index];
        member.state_mut().filter.pose = *pose;
        let offset = member.offset;
        self.covariance.isolate(offset, &covariance.diagonal());
        self.covariance.set_diagonal(offset, &symmetric(covariance));
        self.tell_members();
    }

    /// Puts a member somewhere else, as unsure as that makes its own pose. Nobody else moves.
    pub(super) fn move_unsure(&mut self, index: usize, pose: &Isometry3<f64>) {
        self.flush();
        let member = &mut self.members[index];
        let moved = member.filter().pose.inv_mul(pose);
        let is_planar = member.filter().is_planar;
        member.state_mut().filter.pose = *pose;
        let offset = member.offset;
        let own: Matrix6<f64> = self.covariance.block(offset, offset);
        // Errors that it shares with the map go with that: they are the same about other axes.
        let turned = se3::adjoint(&moved.inverse());
        let own = symmetric(&(turned * own * turned.transpose()));
        // How far it was off says nothing of the axis.
        let off_m2 = moved.translation.vector.norm_squared();
        let off_rad2 = moved.rotation.angle().powi(2);
        let missing = Vector6::from_fn(|k, _| match k {
            _ if is_planar && OUT_OF_PLANE.contains(&k) => 0.0,
            0..3 => off_m2,
            _ => off_rad2,
        });
        let own = own + Matrix6::from_diagonal(&missing);
        self.covariance.transform(offset, &turned, &own);
        self.tell_members();
    }

    /// Puts a member where an external pose is, far from where it was thought to be, as unsure as
    /// that makes its own pose. Nobody else moves: an update would, by a derivative that means
    /// nothing so far away.
    fn put(&mut self, index: usize, intersection: &Intersection) {
        let member = &mut self.members[index];
        let pose = &mut member.state_mut().filter.pose;
        *pose = se3::plus(pose, &intersection.off());
        let offset = member.offset;
        let own: Matrix6<f64> = self.covariance.block(offset, offset);
        let wider = own + Matrix6::from_diagonal(&intersection.missing());
        self.covariance.set_diagonal(offset, &wider);
        self.tell_members();
    }
}

/// Covariance intersection of an own and an external pose, in units of the own deviations.
struct Intersection {
    /// Inverse of each own deviation; zero for what is known without error and so is left alone,
    /// e.g. the height of a robot on a floor.
    scale: Vector6<f64>,
    own: Matrix6<f64>,
    external: Matrix6<f64>,
    innovation: Vector6<f64>,
}

impl Intersection {
    fn new(filter: &AgentFilter, external: &ExternalEstimate) -> Self {
        let own: Matrix6<f64> = filter.covariance().fixed_view::<6, 6>(0, 0).into_owned();
        let innovation = se3::twist(&filter.pose.inv_mul(&external.pose));
        let scale = own.diagonal().map(|variance| {
            let is_open = variance.is_normal() && variance > 0.0;
            if is_open {
                variance.sqrt().recip()
            } else {
                0.0
            }
        });
        let scaled = |matrix: &Matrix6<f64>| {
            Matrix6::from_fn(|row, column| {
                let entry = matrix[(row, column)] * scale[row] * scale[column];
                match (row == column, scale[row] == 0.0) {
                    (true, true) => 1.0,
                    (true, false) => entry + INTERSECTION_VARIANCE_MIN,
                    _ => entry,
                }
            })
        };
        Self {
            own: scaled(&own),
            external: scaled(external.covariance.matrix()),
            innovation: innovation.component_mul(&scale),
            scale,
        }
    }

    /// Whether the innovation is within so many deviations.
    fn is_near(&self, gate: f64) -> bool {
        (0..6).all(|k| {
            // Of two errors that may be correlated in any way, the variances' sum counts twice.
            let expected = 2.0 * (self.own[(k, k)] + self.external[(k, k)]);
            self.innovation[k].powi(2) <= gate.powi(2) * expected
        })
    }

    /// How far the external pose is from the own one, where that is not known without error.
    fn off(&self) -> Vector6<f64> {
        let off = |scale: f64, off: f64| if scale > 0.0 { off / scale } else { 0.0 };
        self.scale.zip_map(&self.innovation, off)
    }

    /// The variances that the own pose lacks for the innovation to be what is expected of the two.
    fn missing(&self) -> Vector6<f64> {
        Vector6::from_fn(|k, _| {
            let expected = self.own[(k, k)] + self.external[(k, k)];
            let missing = (self.innovation[k].powi(2) - expected).max(0.0);
            if self.scale[k] > 0.0 {
                missing / self.scale[k].powi(2)
            } else {
                0.0
            }
        })
    }

    /// The measurement that brings the own pose to the intersection: Jacobian, residual and
    /// variances.
    fn measurement(&self) -> Option<(Matrix6<f64>, Vector6<f64>, Vector6<f64>)> {
        let own = self.own.cholesky()?.inverse();
        let external = self.external.cholesky()?.inverse();
        let weights =
            (0..=INTERSECTION_STEPS).map(|step| f64::from(step) / f64::from(INTERSECTION_STEPS));
        let known = |weight: f64| (own * weight + external * (1.0 - weight)).determinant();
        // Of equal ones the last, so that what adds nothing moves nothing.
        let weight = weights.max_by(|a, b| known(*a).total_cmp(&known(*b)));
        let share = 1.0 - weight.unwrap_or(1.0);
        let gain = symmetric(&((external - own) * share));
        if !gain.iter().all(|entry| entry.is_finite()) {
            return None;
        }
        let gain = gain.symmetric_eigen();
        let axes = gain.eigenvectors.transpose();
        let pull = axes * external * self.innovation * share;
        let mut jacobian = axes * Matrix6::from_diagonal(&self.scale);
        let mut residual = Vector6::zeros();
        let mut variance = Vector6::repeat(1.0);
        for (k, &information) in gain.eigenvalues.iter().enumerate() {
            if information < INTERSECTION_GAIN_MIN {
                jacobian.row_mut(k).fill(0.0);
            } else {
                residual[k] = pull[k] / information;
                variance[k] = 1.0 / information.min(INTERSECTION_GAIN_MAX);
            }
        }
        Some((jacobian, residual, variance))
    }
}
