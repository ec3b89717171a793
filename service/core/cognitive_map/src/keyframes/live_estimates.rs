//! Where live estimates have agents and landmarks: what the map is held by while the agents are not
//! told of it.

use nalgebra::{Isometry3, Matrix3, Point3};

use super::constraint::composed;
use super::graph::KeyframeGraph;
use super::problem::Problem;
use crate::input::Label;
use geometry::{PoseCovariance, is_somewhere};

/// Where the live estimate has agents and landmarks of the map.
///
/// How a map lies to its frame is hardly known once it is large: what was seen near its origin says
/// so alone, and less of it is left with time. A relaxation of which the agents are told nothing
/// therefore takes their estimate in. It rests on the same sightings, and turns or shifts the map
/// as a whole where nothing else does.
#[derive(Clone, Debug, Default)]
pub struct LiveEstimates {
    /// Agents by number: their poses, and the covariances of these (right perturbation).
    pub agents: Vec<(u32, Isometry3<f64>, PoseCovariance)>,
    /// Landmarks by label: their positions \[m\], and the covariances of these \[m²\].
    pub landmarks: Vec<(Label, Point3<f64>, Matrix3<f64>)>,
}

impl Problem {
    /// Ties the latest keyframes of agents, and landmarks, to where live estimates have them.
    pub(super) fn hold_by(&mut self, graph: &KeyframeGraph, live: &LiveEstimates) {
        for (agent, pose, covariance) in &live.agents {
            let Some(track) = graph.chains.track(*agent).filter(|one| !one.needs_keyframe) else {
                continue;
            };
            let Some(node) = self.node(track.newest) else {
                continue;
            };
            let back = track.since.motion().inverse();
            let covariance = composed(covariance, &back, &track.since.covariance());
            if is_somewhere(&pose.translation.vector) {
                self.hold_pose(node, &(pose * back), &covariance, track.is_planar);
            }
        }
        for (label, position, covariance) in &live.landmarks {
            let number = graph.sightings.landmarks.number(label);
            let point = number.and_then(|number| self.point(number));
            if let Some(point) = point.filter(|_| is_somewhere(&position.coords)) {
                self.hold_point(point, *position, covariance);
            }
        }
    }
}

#[cfg(test)]
mod tests;
