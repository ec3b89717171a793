//! Measurement of the bias of an agent's gyroscope, by what it reads while the body stands.

use std::sync::Arc;

use nalgebra::{SMatrix, SVector};

use super::agent_filter::{AgentFilter, BODY_DIM};
use super::calibration::LASTING_DIM;
use super::effect::Effect;
use super::frame::Frame;
use super::jacobian::Block;
use super::joint::Estimator;
use super::parameters::Parameters;
use super::standing::MeasuredBias;

impl Estimator {
    /// Takes in what an agent that stood has read of the bias of its gyroscope.
    pub(super) fn learn_bias(
        &mut self,
        agent: u32,
        measured: &MeasuredBias,
        effects: &mut Vec<Effect>,
    ) {
        let Some(number) = self.frame_of(agent) else {
            return;
        };
        if let Some(slot) = self.slots.get_mut(agent as usize, 0)
            && let Some(detached) = &mut slot.detached
        {
            let filter = &mut Arc::make_mut(&mut detached.state).filter;
            filter.learn_bias(measured, &self.parameters);
            return;
        }
        let Some(frame) = self.frames.get_mut(number, 0) else {
            return;
        };
        if let Some(index) = frame.member(agent) {
            frame.learn_bias(index, measured, &self.parameters);
            self.sweep(number, effects);
        }
    }
}

/// Number of the component of a body's error that is the bias about an axis.
fn component(axis: usize) -> usize {
    BODY_DIM - LASTING_DIM + 2 + axis
}

impl AgentFilter {
    /// A measurement of the bias of odometry. What the body has turned by meanwhile follows.
    fn learn_bias(&mut self, measured: &MeasuredBias, parameters: &Parameters) {
        for axis in measured.axes() {
            let k = component(axis);
            let own = *self.covariance_mut();
            let residual = measured.rate_rad_s[axis] - self.calibration.bias_rad_s[axis];
            let s = own[(k, k)] + measured.variance[axis];
            if residual * residual > parameters.gate.powi(2) * s {
                continue;
            }
            let gain = own.column(k) / s;
            *self.covariance_mut() -= gain * gain.transpose() * s;
            self.correct(&(gain * residual), parameters);
        }
    }
}

impl Frame {
    /// A measurement of the bias of a member's odometry. What it has turned by meanwhile, and what
    /// was seen since, follow.
    fn learn_bias(&mut self, index: usize, measured: &MeasuredBias, parameters: &Parameters) {
        self.flush();
        let corrected = self.corrected_by(index);
        for axis in measured.axes() {
            let member = &self.members[index];
            let block = Block {
                offset: member.offset + component(axis),
                width: 1,
                jacobian: SMatrix::<f64, 1, 6>::identity(),
            };
            let own = member.filter().calibration.bias_rad_s[axis];
            let residual = SVector::<f64, 1>::new(measured.rate_rad_s[axis] - own);
            let projection = self.covariance.project(&[block]);
            let s = projection.spread + SMatrix::<f64, 1, 1>::new(measured.variance[axis]);
            if residual[0] * residual[0] > parameters.gate.powi(2) * s[(0, 0)] {
                continue;
            }
            if let Some(correction) = self
                .covariance
                .update(projection, &residual, &s, &corrected)
            {
                self.correct(index, &correction, parameters);
            }
        }
    }
}
