//! The refined map: the most likely poses and landmarks, given all that is remembered.

use nalgebra::{Isometry3, Matrix3, Point3};
use place_recognition::ViewLog;

use super::agent_track::AgentTrack;
use super::chains::Chains;
use super::graph::KeyframeGraph;
use super::landmarks::Landmarks;
use super::problem::Problem;
use super::relaxation::RelaxationCopy;
use super::tuning;
use crate::input::Label;
use geometry::{is_somewhere, positive};
use pose_graph::{PoseGraph, Relaxed};
use state::NONE;

/// The past after relaxation.
#[derive(Clone, Debug, PartialEq)]
pub struct Refined {
    /// The agents, by number.
    pub agents: Vec<RefinedAgent>,
    /// The landmarks of the map, by label.
    pub landmarks: Vec<RefinedLandmark>,
    /// Statistics of the relaxation.
    pub relaxed: Relaxed,
}

/// The refined track of an agent.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RefinedAgent {
    /// Whether the poses are those of the map. Those in a frame of the agent's own are as the
    /// estimator had them.
    pub is_in_map: bool,
    /// Its poses, by stamp; between two of them it moved evenly.
    pub poses: Vec<RefinedPose>,
}

/// A pose at an instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RefinedPose {
    /// The instant \[ns\].
    pub stamp_ns: i64,
    /// The pose.
    pub pose: Isometry3<f64>,
}

/// A refined landmark.
#[derive(Clone, Debug, PartialEq)]
pub struct RefinedLandmark {
    /// Its label.
    pub label: Label,
    /// Position \[m\].
    pub position: Point3<f64>,
    /// Covariance of the position along the axes of the map \[m²\], as far as the sightings
    /// determine it.
    pub covariance: Option<Matrix3<f64>>,
}

impl KeyframeGraph {
    /// Relaxes the whole past. A pure function of what was added.
    pub fn refine(&self) -> Refined {
        self.refine_matched(&ViewLog::default())
    }

    /// The same, after views were matched anew.
    pub fn refine_matched(&self, views: &ViewLog) -> Refined {
        let (problem, relaxed) = self.relaxed_whole(views);
        let tracks = self.chains.tracks.iter();
        let agents = tracks.map(|track| RefinedAgent::new(track, &self.chains, &problem));
        Refined {
            agents: agents.collect(),
            landmarks: refined_landmarks(&self.sightings.landmarks, &problem),
            relaxed,
        }
    }

    /// The pose graph, relaxed after views were matched anew: for other programs.
    pub fn pose_graph(&self, views: &ViewLog) -> PoseGraph {
        self.relaxed_whole(views).0.map
    }

    /// The whole past relaxed, with the closures that are accepted by now, or with all of them
    /// judged anew by all that is known now: whichever makes the measurements more probable.
    fn relaxed_whole(&self, views: &ViewLog) -> (Problem, Relaxed) {
        let mut as_it_is = RelaxationCopy::whole(self);
        if !views.is_empty() && !self.is_tied_by_sightings() {
            as_it_is.match_views(views, &tuning::REFINED_MATCHING);
        }
        let mut all = Vec::new();
        if as_it_is.has_pending() {
            // What is accepted by views alone was judged by them.
            all = as_it_is.judged_anew();
            // Those that accept nothing have forgotten what views tell of the noise.
            all.retain(|copy| copy.accepted().next().is_some());
        }
        as_it_is.accept_consistent();
        let best = RelaxationCopy::most_probable(as_it_is, all);
        (best.problem, best.statistics)
    }
}

impl RefinedAgent {
    /// The poses of an agent in a relaxed graph.
    fn new(track: &AgentTrack, chains: &Chains, problem: &Problem) -> Self {
        let mut poses = Vec::new();
        let mut later = RefinedPose {
            stamp_ns: track.stamp_ns,
            pose: instant_after(track.newest, track.since.motion(), chains, problem),
        };
        if track.newest != NONE {
            poses.push(later);
        }
        let mut until_ns = track.until_ns;
        for (number, keyframe) in chains.back_from(track.newest) {
            let pose = instant_after(number, &Isometry3::identity(), chains, problem);
            for stamp_ns in [until_ns, keyframe.stamp_ns] {
                if stamp_ns < later.stamp_ns {
                    later = RefinedPose { stamp_ns, pose };
                    poses.push(later);
                }
            }
            let previous = chains.keyframes.get(keyframe.previous);
            until_ns = previous.map_or(0, |previous| previous.until_ns);
        }
        poses.retain(|refined| is_somewhere(&refined.pose.translation.vector));
        poses.reverse();
        Self {
            is_in_map: track.is_in_map(),
            poses,
        }
    }
}

/// The pose of an instant after a keyframe.
fn instant_after(
    keyframe: u32,
    motion: &Isometry3<f64>,
    chains: &Chains,
    problem: &Problem,
) -> Isometry3<f64> {
    let stored = || Some(&chains.keyframes.get(keyframe)?.pose);
    let pose = problem.pose(keyframe).or_else(stored);
    pose.copied().unwrap_or_default() * motion
}

/// The landmarks in a relaxed graph, by label.
fn refined_landmarks(landmarks: &Landmarks, problem: &Problem) -> Vec<RefinedLandmark> {
    let marginals = problem.map.marginals();
    let refined = |(number, label): (u32, &Label)| {
        let point = problem.point(number)?;
        let position = problem.map.point(point);
        if !is_somewhere(&position.coords) {
            return None;
        }
        let covariance = { marginals.point(point) }.map(|covariance| positive(&covariance));
        Some(RefinedLandmark {
            label: label.clone(),
            position,
            covariance: covariance.filter(|known| known.iter().all(|x| x.is_finite())),
        })
    };
    let numbered = { landmarks.slots.iter() }.map(|(number, landmark)| (number, &landmark.label));
    let mut refined: Vec<_> = numbered.filter_map(refined).collect();
    refined.sort_by(|a, b| a.label.cmp(&b.label));
    refined
}
