//! The calibrations of the agents' odometry over the past, as nodes of a pose graph.

use nalgebra::Vector3;

use super::agent_track::AgentTrack;
use super::chains::Chains;
use super::tuning;
use crate::estimator::LastingErrors;
use pose_graph::{
    CalibrationId, CalibrationInformation, Freedom, Kernel, Lengths, Link, PoseGraph, Veer,
};

/// What a graph tells of the calibrations.
#[derive(Clone, Copy, Debug)]
pub(super) struct Told {
    pub(super) lengths: Lengths,
    pub(super) veer: Veer,
    /// Whether it has landmarks, by which the estimator learns the veer.
    pub(super) by_landmarks: bool,
}

/// The calibration nodes of a pose graph.
#[derive(Debug, Default)]
pub(super) struct Calibrations {
    /// By keyframe, that of the motion to it.
    of_motion: Vec<Option<CalibrationId>>,
    /// By agent, the latest one.
    latest: Vec<Option<CalibrationId>>,
}

impl Calibrations {
    /// Adds the calibrations of all agents: one for every few motions of an agent, from the first
    /// one on, which is as the estimator has learned it by now, as far off as the space's settings
    /// admit; each later one as far from the one before as it may have changed since.
    ///
    /// Without lasting errors, by the settings, there are none. Where lengths are known, they are
    /// as the estimator has learned them by now.
    pub(super) fn add(
        chains: &Chains,
        prior_sd: &LastingErrors,
        told: Told,
        map: &mut PoseGraph,
    ) -> Self {
        let mut all = Self {
            of_motion: vec![None; chains.keyframes.numbers() as usize],
            latest: vec![None; chains.tracks.len()],
        };
        if prior_sd.iter().all(|sd| *sd == 0.0) {
            return all;
        }
        for (track, agent) in chains.tracks.iter().zip(0..) {
            if track.is_in_map() {
                let latest = all.add_agent(chains, (agent, track), prior_sd, told, map);
                all.latest[agent as usize] = latest;
            }
        }
        all
    }

    /// The calibration of the motion to a keyframe.
    pub(super) fn of_motion(&self, keyframe: u32) -> Option<CalibrationId> {
        self.of_motion.get(keyframe as usize).copied().flatten()
    }

    /// The latest calibration of an agent.
    pub(super) fn latest(&self, agent: u32) -> Option<CalibrationId> {
        self.latest.get(agent as usize).copied().flatten()
    }

    /// Adds the calibrations of an agent; answers the latest.
    fn add_agent(
        &mut self,
        chains: &Chains,
        (agent, track): (u32, &AgentTrack),
        prior_sd: &LastingErrors,
        told: Told,
        map: &mut PoseGraph,
    ) -> Option<CalibrationId> {
        let freedom = if track.is_planar {
            Freedom::Planar
        } else {
            Freedom::Full
        };
        let learned = track.calibrated.calibration.in_graph();
        let mut expected = match told.lengths {
            Lengths::Estimated if told.by_landmarks || !track.is_calibrated_by_views => learned,
            // What the estimator has learned of rotations may be by closures and matches that are
            // judged here.
            Lengths::Estimated | Lengths::Known => pose_graph::Calibration {
                length: learned.length,
                ..pose_graph::Calibration::default()
            },
        };
        // Without landmarks, what the estimator has learned of it is by matches that are judged
        // here.
        expected.veer_rad_m = match told.veer {
            Veer::Known if told.by_landmarks => learned.veer_rad_m,
            Veer::Known | Veer::Estimated => 0.0,
        };
        let prior = prior_sd.component_mul(prior_sd);
        let veer_variance = match told.veer {
            Veer::Known => f64::INFINITY,
            Veer::Estimated => tuning::VEER_SD_RAD_M * tuning::VEER_SD_RAD_M,
        };
        let mut newest = None;
        let (mut n_motions, mut wander) = (0, LastingErrors::zeros());
        let mut number = chains.first(agent);
        while let Some(keyframe) = chains.keyframes.get(number) {
            let calibrated = &keyframe.calibrated;
            let node = newest.filter(|_| n_motions < tuning::CALIBRATED_TOGETHER);
            let node = node.unwrap_or_else(|| {
                let node = map.add_calibration(&expected, freedom, told.lengths, told.veer);
                let link = match newest {
                    None => Link::CalibrationPrior {
                        calibration: node,
                        at: expected,
                        information: information(&prior, veer_variance),
                    },
                    Some(from) => Link::CalibrationWander {
                        from,
                        to: node,
                        information: information(
                            &(wander + prior * tuning::WANDER_MIN),
                            veer_variance * tuning::WANDER_MIN,
                        ),
                    },
                };
                map.add_link(link, Kernel::Gaussian).ok();
                (n_motions, wander) = (0, LastingErrors::zeros());
                node
            });
            n_motions += 1;
            wander += calibrated.wander;
            newest = Some(node);
            self.of_motion[number as usize] = newest;
            number = keyframe.next;
        }
        newest
    }
}

/// Information of variances of a calibration's components; those that the settings exclude are held
/// by a variance next to nothing.
fn information(variances: &LastingErrors, veer: f64) -> CalibrationInformation {
    let least = variances.map(|variance| variance.max(tuning::CALIBRATION_VARIANCE_MIN));
    let bias: Vector3<f64> = least.fixed_rows::<3>(2).into_owned();
    CalibrationInformation::of_variances(least[0], least[1], veer, &bias)
        .expect("variances above zero have an inverse")
}

#[cfg(test)]
mod tests;
