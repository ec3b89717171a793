//! The refined map: the most likely poses and landmarks, given all that is remembered.

use nalgebra::{Isometry3, Matrix3, Matrix6, Point3};

use super::constraint::{ClosureState, Constraint};
use super::graph::KeyframeGraph;
use super::keyframe::Keyframe;
use super::sighting::{Seen, Sighting};
use super::tuning;
use crate::input::Label;
use geometry::{PoseCovariance, from_planar_part, is_somewhere, planar_part, positive};
use pose_graph::{
    Freedom, Kernel, Link, LinkId, PointId, PoseGraph, PoseId, PoseInformation,
    PositionInformation, Relaxed, Scale, SightingTarget,
};
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

/// The loop closures that count.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Among {
    /// The accepted ones.
    Believed,
    /// All, as far as they agree.
    All,
}

/// The keyframe graph as a pose graph.
#[derive(Debug)]
pub(super) struct Graph {
    pub(super) map: PoseGraph,
    /// The node of each keyframe.
    pub(super) poses: Vec<Option<PoseId>>,
    /// The node of each landmark.
    pub(super) points: Vec<Option<PointId>>,
    /// The link of each constraint.
    pub(super) constraints: Vec<Option<LinkId>>,
}

impl KeyframeGraph {
    /// Relaxes the whole past. A pure function of what was added.
    pub fn refine(&self) -> Refined {
        // Closures are judged in a copy, which shares all pages that do not change.
        let mut copy = self.clone();
        copy.accept_consistent();
        let (graph, relaxed, _) = copy.relaxed();
        let marginals = graph.map.marginals();
        let mut landmarks: Vec<RefinedLandmark> = Vec::new();
        for (number, landmark) in self.landmarks.slots.iter() {
            let Some(point) = graph.points[number as usize] else {
                continue;
            };
            let position = graph.map.point(point);
            if is_somewhere(&position.coords) {
                let covariance = marginals
                    .point(point)
                    .map(|covariance| positive(&covariance));
                landmarks.push(RefinedLandmark {
                    label: landmark.label.clone(),
                    position,
                    covariance: covariance.filter(|known| known.iter().all(|x| x.is_finite())),
                });
            }
        }
        landmarks.sort_by(|a, b| a.label.cmp(&b.label));
        let agents = (0..self.tracks.len()).map(|agent| self.refined_agent(agent, &graph));
        Refined {
            agents: agents.collect(),
            landmarks,
            relaxed,
        }
    }

    /// The relaxed pose graph: for other programs.
    pub fn experience_map(&self) -> PoseGraph {
        let mut copy = self.clone();
        copy.accept_consistent();
        copy.relaxed().0.map
    }

    /// The poses of an agent.
    fn refined_agent(&self, agent: usize, graph: &Graph) -> RefinedAgent {
        let Some(track) = self.tracks.get(agent) else {
            return RefinedAgent::default();
        };
        let mut poses = Vec::new();
        let mut number = track.newest;
        let mut later = RefinedPose {
            stamp_ns: track.stamp_ns,
            pose: self.now(track.newest, track.since.motion(), graph),
        };
        if track.newest != NONE {
            poses.push(later);
        }
        let mut until_ns = track.until_ns;
        while let Some(keyframe) = self.keyframes.get(number) {
            let pose = self.now(number, &Isometry3::identity(), graph);
            for stamp_ns in [until_ns, keyframe.stamp_ns] {
                if stamp_ns < later.stamp_ns {
                    later = RefinedPose { stamp_ns, pose };
                    poses.push(later);
                }
            }
            number = keyframe.previous;
            until_ns = self
                .keyframes
                .get(number)
                .map_or(0, |previous| previous.until_ns);
        }
        poses.retain(|refined| is_somewhere(&refined.pose.translation.vector));
        poses.reverse();
        RefinedAgent {
            is_in_map: track.is_in_map,
            poses,
        }
    }

    /// The pose of an instant after a keyframe.
    fn now(&self, keyframe: u32, motion: &Isometry3<f64>, graph: &Graph) -> Isometry3<f64> {
        let refined = graph.poses.get(keyframe as usize).copied().flatten();
        let pose = refined.map(|node| *graph.map.pose(node));
        let stored = || self.keyframes.get(keyframe).map(|keyframe| keyframe.pose);
        pose.or_else(stored).unwrap_or_default() * motion
    }

    /// The graph of all agents that are in the map.
    pub(super) fn graph(&self, among: Among) -> Graph {
        let mut graph = Graph {
            map: PoseGraph::new(),
            poses: vec![None; self.keyframes.numbers() as usize],
            points: vec![None; self.landmarks.slots.numbers() as usize],
            constraints: vec![None; self.constraints.numbers() as usize],
        };
        for (number, keyframe) in self.keyframes.iter() {
            graph.poses[number as usize] = self.pose_node(number, keyframe, &mut graph.map);
        }
        let motions = self.recalibrated();
        for (number, keyframe) in self.keyframes.iter() {
            self.motion_link(number, keyframe, motions[number as usize], &mut graph);
        }
        for (number, constraint) in self.constraints.iter() {
            graph.constraints[number as usize] =
                self.constraint_link(constraint, among, &mut graph);
        }
        for (_, sighting) in self.sightings.iter() {
            Self::sighting_link(sighting, &mut graph);
        }
        graph
    }

    /// A node for a keyframe in the map.
    fn pose_node(&self, number: u32, keyframe: &Keyframe, map: &mut PoseGraph) -> Option<PoseId> {
        let track = self.tracks.get(keyframe.agent as usize)?;
        if !track.is_in_map {
            return None;
        }
        let pose = self.in_map(number)?;
        let mut constraint = keyframe.constraints;
        let mut freedom = if track.is_planar {
            Freedom::Planar
        } else {
            Freedom::Full
        };
        while let Some(at) = self.constraints.get(constraint) {
            if at.state == ClosureState::Origin {
                freedom = Freedom::Held;
            }
            constraint = self.next_constraint(constraint, number);
        }
        Some(map.add_pose(pose, freedom))
    }

    fn motion_link(
        &self,
        number: u32,
        keyframe: &Keyframe,
        transform: Isometry3<f64>,
        graph: &mut Graph,
    ) {
        let Some(track) = self.tracks.get(keyframe.agent as usize) else {
            return;
        };
        let node = |number: u32| graph.poses.get(number as usize).copied().flatten();
        let (Some(from), Some(to), false) =
            (node(keyframe.previous), node(number), keyframe.begins)
        else {
            return;
        };
        let link = Link::Between {
            from,
            to,
            transform,
            information: information(&keyframe.covariance, track.is_planar),
        };
        graph.map.add_link(link, Kernel::Gaussian).ok();
    }

    fn constraint_link(
        &self,
        constraint: &Constraint,
        among: Among,
        graph: &mut Graph,
    ) -> Option<LinkId> {
        let node = |number: u32| graph.poses.get(number as usize).copied().flatten();
        let to = node(constraint.to)?;
        let agent = self.keyframes.get(constraint.to)?.agent;
        let is_planar = self.tracks.get(agent as usize)?.is_planar;
        let information = information(&constraint.covariance, is_planar);
        let link = match constraint.state {
            ClosureState::Origin => return None,
            ClosureState::Pending | ClosureState::Refuted if among == Among::Believed => {
                return None;
            }
            _ if constraint.from == NONE => Link::PosePrior {
                pose: to,
                at: constraint.transform,
                information,
            },
            _ => Link::Between {
                from: node(constraint.from)?,
                to,
                transform: constraint.transform,
                information,
            },
        };
        let kernel = if constraint.is_match() {
            Kernel::GemanMcClure(Scale::new(tuning::CLOSURE_SCALE).expect("a positive constant"))
        } else {
            Kernel::Gaussian
        };
        graph.map.add_link(link, kernel).ok()
    }

    fn sighting_link(sighting: &Sighting, graph: &mut Graph) -> Option<LinkId> {
        let node = |number: u32| graph.poses.get(number as usize).copied().flatten();
        let from = node(sighting.keyframe)?;
        let position = sighting.point.position;
        let target = match sighting.shown {
            Seen::Agent(target, lever) => SightingTarget::PointOf(node(target)?, lever),
            Seen::Landmark(number) => {
                let point = &mut graph.points[number as usize];
                let at = graph.map.pose(from) * Point3::from(position);
                let add = || graph.map.add_point(at, Freedom::Full);
                SightingTarget::Point(*point.get_or_insert_with(add))
            }
        };
        let information = PositionInformation::of_covariance(&sighting.point.covariance()).ok()?;
        let link = Link::Sighting {
            from,
            target,
            position,
            information,
        };
        let kernel =
            Kernel::Cauchy(Scale::new(tuning::SIGHTING_SCALE).expect("a positive constant"));
        graph.map.add_link(link, kernel).ok()
    }
}

/// The information of a covariance, of its planar part for planar motion.
fn information(covariance: &PoseCovariance, is_planar: bool) -> PoseInformation {
    let floor = tuning::MOTION_SD_MIN * tuning::MOTION_SD_MIN;
    let mut matrix = *covariance.matrix();
    for k in 0..6 {
        matrix[(k, k)] += floor;
    }
    let mut inverse = Matrix6::zeros();
    if is_planar {
        if let Some(planar) = planar_part(&matrix).try_inverse() {
            inverse = from_planar_part(&planar);
        }
    } else if let Some(whole) = matrix.try_inverse() {
        inverse = whole;
    }
    // A matrix too far from positive definite gives no information.
    PoseInformation::new(&inverse).unwrap_or_else(|_| {
        PoseInformation::new(&Matrix6::zeros()).expect("no information is no less than none")
    })
}
