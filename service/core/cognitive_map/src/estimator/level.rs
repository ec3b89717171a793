//! Levels: measurements of one component of an agent's pose.

use std::sync::Arc;

use nalgebra::{Matrix1, RowVector6, Vector1};

use super::effect::Effect;
use super::frame::Frame;
use super::jacobian::Block;
use super::joint::Estimator;
use super::parameters::Parameters;
use super::tuning::LEVEL_HUBER_SD;
use geometry::se3;

/// A level that is off from what is expected.
#[derive(Clone, Copy, Debug)]
pub struct LevelRow {
    /// Change of the level with the error on the right of the pose.
    pub jacobian: RowVector6<f64>,
    /// The level less what is expected.
    pub residual: f64,
    /// Variance of that at a pose without error.
    pub variance: f64,
    /// Variance that nobody gets below by it.
    pub floor: f64,
}

impl Estimator {
    /// Takes in levels that an agent sensed together. Answers for each the variance by the error
    /// of the pose before.
    pub fn levels(&mut self, agent: u32, rows: &[LevelRow], effects: &mut Vec<Effect>) -> Vec<f64> {
        let Some(number) = self.frame_of(agent) else {
            return Vec::new();
        };
        let parameters = self.parameters.clone();
        if let Some(detached) = &mut self.slot_mut(agent).detached {
            let mut alone = Frame::default();
            alone.join(agent, Arc::clone(&detached.state));
            let spreads = alone.levels(0, rows, &parameters);
            if let Some(state) = alone.leave(agent)
                && let Some(detached) = &mut self.slot_mut(agent).detached
            {
                detached.state = state;
            }
            return spreads;
        }
        let Some(frame) = self.frames.get_mut(number, 0) else {
            return Vec::new();
        };
        let spreads = frame
            .member(agent)
            .map(|index| frame.levels(index, rows, &parameters));
        self.sweep(number, effects);
        spreads.unwrap_or_default()
    }
}

impl Frame {
    fn levels(&mut self, index: usize, rows: &[LevelRow], parameters: &Parameters) -> Vec<f64> {
        self.flush();
        let offset = self.members[index].offset;
        let block = |row: &LevelRow| Block {
            offset,
            width: 6,
            jacobian: row.jacobian,
        };
        let before = self.members[index].filter().pose;
        let spreads: Vec<f64> = rows
            .iter()
            .map(|row| self.covariance.project(&[block(row)]).spread[(0, 0)])
            .collect();
        for row in rows {
            let corrected = before.inv_mul(&self.members[index].filter().pose);
            let residual = row.residual - (row.jacobian * se3::twist(&corrected))[(0, 0)];
            let projection = self.covariance.project(&[block(row)]);
            let spread = projection.spread[(0, 0)];
            if !spread.is_normal() || spread <= row.floor {
                continue;
            }
            // Of what is no surer than the floor only the rest is news.
            let least = if row.floor > 0.0 {
                (row.floor.recip() - spread.recip()).recip()
            } else {
                0.0
            };
            let variance = row.variance.max(least);
            let deviations = residual.abs() / (spread + variance).sqrt();
            if deviations.is_nan() || deviations > parameters.gate {
                continue;
            }
            let total = spread + variance * (deviations / LEVEL_HUBER_SD).max(1.0);
            let all = self.covariance.all();
            let innovation = Vector1::new(residual);
            let s = Matrix1::new(total);
            if let Some(correction) = self.covariance.update(projection, &innovation, &s, &all) {
                self.correct(index, &correction, parameters);
            }
        }
        spreads
    }
}
