//! Prediction: what will be sensed after a motion.

use nalgebra::{Isometry3, Matrix3, Point3, Vector3};

use super::CognitiveMap;
use super::tuning::ANSWER_MIN;
use crate::input::AgentId;
use crate::input::{Label, Motion};
use crate::memory::percept::{ChannelKind, Remembered};
use crate::memory::place::{PlaceId, confidence};
use geometry::PoseCovariance;

/// Where a motion leads and what is expected there.
#[derive(Clone, Debug, PartialEq)]
pub struct Prediction {
    /// Pose in `map` at the end of the motion.
    pub pose: Isometry3<f64>,
    /// The place that answers there, with its confidence; none where none answers with one half.
    pub place: Option<(PlaceId, f64)>,
    /// What is expected, in the order of the channels.
    pub percepts: Vec<Predicted>,
}

/// A percept that is expected.
#[derive(Clone, Debug, PartialEq)]
pub struct Predicted {
    /// What the place remembers that answers where the percept will be sensed.
    pub remembered: Remembered,
    /// That place's confidence, in \[0, 1\]: the mean over the positions to which the motion may
    /// have led. How well the agent is localised when it starts is not in it; its status says that.
    pub confidence: f64,
}

/// A point where something will be sensed.
struct Point {
    position: Point3<f64>,
    /// Covariance of the position by the motion alone, along the axes of `map` \[m²\].
    covariance: Matrix3<f64>,
}

impl CognitiveMap {
    /// What an agent would sense after a motion: the motion is integrated from its pose, as
    /// [`CognitiveMap::apply`] would do it, the place asked that answers there, and its memory
    /// read.
    ///
    /// Levels are those of a sensor at `offset_m` in the body frame, descriptors those at the body.
    /// With a `channel` only what is sensed on that one. None for an agent that is not there or not
    /// placed.
    pub fn predict(
        &self,
        agent: AgentId,
        motion: &Motion,
        offset_m: &Vector3<f64>,
        channel: Option<&Label>,
    ) -> Option<Prediction> {
        let agent = self.agent(agent).filter(|agent| agent.placed())?;
        let pose = agent.pose() * motion.increment();
        // Of the motion alone: it begins at a pose that is taken for known.
        let noise_sd = self.estimator.parameters().motion_noise_sd(motion);
        let covariance = PoseCovariance::zero().after_motion(motion.increment(), &noise_sd);
        let at_body = Point::of(&pose, &covariance, &Vector3::zeros());
        let at_sensor = Point::of(&pose, &covariance, offset_m);
        let body_answer = self.answer(&at_body);
        let sensor_answer = self.answer(&at_sensor);
        let mut percepts: Vec<_> = [(body_answer, false), (sensor_answer, true)]
            .into_iter()
            .filter_map(|(answer, levels)| Some((answer?, levels)))
            .flat_map(|((place, confidence), levels)| {
                let remembered = self.percepts.of_place(place);
                let asked = remembered.filter(move |remembered| {
                    let known = self.channel(remembered.channel);
                    known.is_some_and(|known| {
                        (known.kind() == ChannelKind::Level) == levels
                            && channel.is_none_or(|channel| channel == known.label())
                    })
                });
                asked.map(move |remembered| Predicted {
                    remembered,
                    confidence,
                })
            })
            .collect();
        percepts.sort_by_key(|predicted| predicted.remembered.channel);
        Some(Prediction {
            pose,
            place: body_answer,
            percepts,
        })
    }

    /// The place that answers at a point, with the mean of its confidence.
    fn answer(&self, point: &Point) -> Option<(PlaceId, f64)> {
        let (place, distance_m) = self.places.winner(&point.position)?;
        let radius_m = self.settings.field_radius_m;
        if confidence(distance_m, radius_m) < ANSWER_MIN {
            return None;
        }
        let off = point.position - self.places.get(place)?.position();
        Some((place, mean_confidence(&off, &point.covariance, radius_m)))
    }
}

impl Point {
    /// A point at `offset_m` in the frame of a pose.
    ///
    /// ```text
    /// A = R | I  −o× |,   covariance = A P Aᵀ
    /// ```
    fn of(pose: &Isometry3<f64>, covariance: &PoseCovariance, offset_m: &Vector3<f64>) -> Self {
        let covariance = covariance.matrix();
        let lever = -offset_m.cross_matrix();
        let position = covariance.fixed_view::<3, 3>(0, 0);
        let cross = covariance.fixed_view::<3, 3>(0, 3) * lever.transpose();
        let turn = lever * covariance.fixed_view::<3, 3>(3, 3) * lever.transpose();
        let in_body = position + cross + cross.transpose() + turn;
        let rotation = *pose.rotation.to_rotation_matrix().matrix();
        Self {
            position: pose * Point3::from(*offset_m),
            covariance: rotation * in_body * rotation.transpose(),
        }
    }
}

/// Mean of a place's confidence over a normal distribution of positions, `off` its mean's distance
/// from the place.
///
/// ```text
/// κ = ln 2 / field_radius²
/// E[exp(−κ ‖d + ε‖²)] = det(I + 2κΣ)^(−1/2) exp(−κ dᵀ (I + 2κΣ)⁻¹ d),   ε ~ N(0, Σ)
/// ```
fn mean_confidence(off: &Vector3<f64>, covariance: &Matrix3<f64>, field_radius_m: f64) -> f64 {
    let sharpness = std::f64::consts::LN_2 / field_radius_m.powi(2);
    let widened = Matrix3::identity() + covariance * (2.0 * sharpness);
    let determinant = widened.determinant();
    // A motion so uncertain that the matrix cannot be inverted leads nowhere in particular.
    let Some(inverse) = widened.try_inverse().filter(|_| determinant.is_finite()) else {
        return 0.0;
    };
    let exponent = -sharpness * off.dot(&(inverse * off));
    (exponent.exp() / determinant.max(1.0).sqrt()).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_certain_position_has_the_plain_confidence() {
        for off in [[0.0; 3], [0.1, -0.2, 0.05], [3.0, 0.0, 0.0]] {
            let off = Vector3::from(off);
            let mean = mean_confidence(&off, &Matrix3::zeros(), 0.25);
            assert!((mean - confidence(off.norm(), 0.25)).abs() < 1e-12);
        }
    }

    /// Against the sum over a fine lattice of positions.
    #[test]
    fn the_mean_is_the_integral() {
        let off = Vector3::new(0.1, -0.05, 0.02);
        let sd_m = Vector3::new(0.1, 0.2, 0.05);
        let turn = nalgebra::Rotation3::from_euler_angles(0.3, -0.8, 1.1);
        let covariance = turn.matrix()
            * Matrix3::from_diagonal(&sd_m.component_mul(&sd_m))
            * turn.matrix().transpose();
        let (mut sum, mut weights) = (0.0, 0.0);
        let steps: Vec<f64> = (-30..=30).map(|k| f64::from(k) * 0.2).collect();
        for &x in &steps {
            for &y in &steps {
                for &z in &steps {
                    let weight = (-0.5 * (x * x + y * y + z * z)).exp();
                    let error = turn * Vector3::new(x, y, z).component_mul(&sd_m);
                    sum += weight * confidence((off + error).norm(), 0.25);
                    weights += weight;
                }
            }
        }
        let mean = mean_confidence(&off, &covariance, 0.25);
        assert!(
            (mean - sum / weights).abs() < 1e-6,
            "{mean} {}",
            sum / weights
        );
    }

    #[test]
    fn absurd_uncertainty_is_no_harm() {
        for variance in [1e30, 1e200, f64::INFINITY, f64::NAN] {
            let covariance = Matrix3::identity() * variance;
            let mean = mean_confidence(&Vector3::new(0.1, 0.0, 0.0), &covariance, 0.25);
            assert!((0.0..=1e-6).contains(&mean), "{variance}: {mean}");
        }
    }
}
