//! Compasses: levels that tell the heading of an agent.

use nalgebra::{Isometry3, RowVector6, UnitQuaternion, Vector3};

use super::apply::Fold;
use super::tuning::{OWN_SURER, TEACHING_RAD2, UPRIGHT_MIN};
use crate::estimator::LevelRow;
use crate::keyframes::SensedTurn;
use geometry::PoseCovariance;

impl Fold<'_> {
    /// Takes in a level as that of a compass, if it is one; answers whether it is. Beside it, an
    /// agent that knows its heading teaches whether the channel is one.
    pub(super) fn head(&mut self, level: (u8, f64), in_odom: &Isometry3<f64>) -> bool {
        let number = self.agent_id.0;
        let is_known = |(_, covariance): &(Isometry3<f64>, PoseCovariance)| {
            self.agent.placed() && !self.is_lost(covariance) && !self.keyframes.is_kidnapped(number)
        };
        let known = self.estimator.pose(number).filter(is_known);
        let known = known.and_then(|(pose, covariance)| Heading::of(&pose, &covariance));
        let at = &in_odom.translation.vector;
        let model = self.percepts.heading_model(level.0, number).copied();
        // Who is held by the compass cannot say how it errs.
        let held = model.map_or(f64::INFINITY, |model| model.lasting_rad2() / OWN_SURER);
        let is_sure = |known: &Heading| known.variance_rad2 <= TEACHING_RAD2.min(held);
        if let Some(known) = known.filter(is_sure) {
            let stretch = self.agent.filter.teach_heading(level, known.rad, at);
            if let Some(stretch) = stretch {
                let taught = (number, &stretch);
                self.percepts.learn_heading(level.0, taught, self.revision);
            }
        }
        let Some(model) = model else {
            return false;
        };
        let Some((in_odom_rad, _)) = azimuth(&in_odom.rotation) else {
            return true;
        };
        let filter = &mut self.agent.filter;
        let turn_rad = filter.take_heading(level, &model, (in_odom_rad, at));
        // Below what lasts of a compass's error it says nothing new.
        let known = known.filter(|known| known.variance_rad2 > model.lasting_rad2());
        if let (Some(known), Some(turn_rad)) = (known, turn_rad) {
            let row = LevelRow {
                jacobian: known.jacobian,
                residual: wrapped(turn_rad + in_odom_rad - known.rad),
                variance: model.variance_rad2(),
                floor: model.lasting_rad2(),
            };
            self.estimator.levels(number, &[row], &mut self.effects);
            self.apply_effects();
            self.update_pose();
        }
        true
    }

    /// How the frame of the agent's odometry is turned in the map, as compasses tell it.
    pub(super) fn sensed_turn(&self) -> Option<SensedTurn> {
        let in_odom = self.estimator.in_odom(self.agent_id.0)?;
        let (rad, sd_rad) = self.agent.filter.turn_rad(&in_odom.translation.vector)?;
        Some(SensedTurn { rad, sd_rad })
    }
}

/// The heading of an agent.
#[derive(Clone, Copy)]
struct Heading {
    rad: f64,
    /// Its change with the error on the right of the pose.
    jacobian: RowVector6<f64>,
    variance_rad2: f64,
}

impl Heading {
    fn of(pose: &Isometry3<f64>, covariance: &PoseCovariance) -> Option<Self> {
        let (rad, jacobian) = azimuth(&pose.rotation)?;
        let variance = jacobian * covariance.matrix() * jacobian.transpose();
        Some(Self {
            rad,
            jacobian,
            variance_rad2: variance[(0, 0)],
        })
    }
}

/// Azimuth of the body's x axis \[rad\], and its change with the error on the right of a pose;
/// `None` where that axis is about vertical.
fn azimuth(rotation: &UnitQuaternion<f64>) -> Option<(f64, RowVector6<f64>)> {
    let [ahead, left, up] = [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| rotation * axis);
    let squared = ahead.xy().norm_squared();
    if squared < UPRIGHT_MIN * UPRIGHT_MIN {
        return None;
    }
    let along = |to: &Vector3<f64>| (ahead.x * to.y - ahead.y * to.x) / squared;
    let row = RowVector6::new(0.0, 0.0, 0.0, 0.0, -along(&up), along(&left));
    Some((ahead.y.atan2(ahead.x), row))
}

/// An angle within half a turn of zero \[rad\].
fn wrapped(angle_rad: f64) -> f64 {
    let (sin, cos) = angle_rad.sin_cos();
    sin.atan2(cos)
}
