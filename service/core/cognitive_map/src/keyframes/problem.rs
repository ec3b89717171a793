//! The keyframe graph as a problem of nonlinear least squares.

use nalgebra::{Isometry3, Matrix3, Matrix6, Point3, Vector3, Vector6};

use super::calibrations::{Calibrations, Told};
use super::constraint::{ClosureState, Constraint};
use super::graph::KeyframeGraph;
use super::keyframe::Keyframe;
use super::observation::Observation;
use super::sighting::{Seen, Sighting};
use super::tuning;
use crate::estimator::{Calibration, LastingErrors};
use geometry::{PoseCovariance, from_planar_part, planar_part};
use pose_graph::{
    Freedom, Kernel, Lengths, Link, LinkId, Marginals, PointId, PoseGraph, PoseId, PoseInformation,
    PositionInformation, RangeInformation, Scale, SightingTarget, Veer,
};
use state::NONE;

/// The loop closures that count.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Among {
    /// The accepted ones.
    Accepted,
    /// All, as far as they agree.
    All,
}

/// Whether the calibrations of odometry stay as they are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Calibrating {
    /// They stay. While closures are doubted, odometry is all there is to judge them by: free to be
    /// scaled, a path shrinks to a point at which all closures agree.
    Held,
    /// They are estimated.
    Free,
}

/// The keyframe graph as a pose graph.
#[derive(Debug)]
pub(super) struct Problem {
    pub(super) map: PoseGraph,
    /// The node of each keyframe.
    poses: Vec<Option<PoseId>>,
    /// The node of each landmark.
    points: Vec<Option<PointId>>,
    /// The link of each constraint.
    links: Vec<Option<LinkId>>,
    /// The link of each match of views.
    pub(super) matches: Vec<Option<LinkId>>,
    /// The calibrations of odometry.
    pub(super) calibrations: Calibrations,
}

impl Problem {
    /// The graph of all agents that are in the map.
    pub(super) fn new(graph: &KeyframeGraph, among: Among, calibrating: Calibrating) -> Self {
        let (chains, constraints) = (&graph.chains, &graph.constraints.slab);
        let landmarks = &graph.sightings.landmarks.slots;
        let mut problem = Self {
            map: PoseGraph::new(),
            poses: vec![None; chains.keyframes.numbers() as usize],
            points: vec![None; landmarks.numbers() as usize],
            links: vec![None; constraints.numbers() as usize],
            matches: Vec::new(),
            calibrations: Calibrations::default(),
        };
        for (number, keyframe) in chains.keyframes.iter() {
            problem.poses[number as usize] = problem.add_pose(graph, number, keyframe);
        }
        if calibrating == Calibrating::Free {
            let prior_sd = &graph.settings.calibration_sd;
            let has_closures = graph.constraints.n_accepted() > 0 || !graph.matches.is_empty();
            let told = Told {
                lengths: if has_closures || among == Among::All {
                    Lengths::Known
                } else {
                    Lengths::Estimated
                },
                veer: if graph.matches.is_empty() {
                    Veer::Known
                } else {
                    Veer::Estimated
                },
                by_landmarks: graph.n_sightings() > 0,
            };
            problem.calibrations = Calibrations::add(chains, prior_sd, told, &mut problem.map);
        }
        for (number, keyframe) in chains.keyframes.iter() {
            problem.add_motion(graph, number, keyframe);
        }
        for (number, constraint) in constraints.iter() {
            problem.links[number as usize] = problem.add_constraint(graph, constraint, among);
        }
        for (_, sighting) in graph.sightings.slab.iter() {
            problem.add_landmark(sighting);
        }
        for (_, sighting) in graph.sightings.slab.iter() {
            problem.add_sighting(sighting);
        }
        problem.add_matches(graph);
        problem
    }

    /// The node of a keyframe, if its agent is in the map.
    pub(super) fn node(&self, keyframe: u32) -> Option<PoseId> {
        self.poses.get(keyframe as usize).copied().flatten()
    }

    /// The pose of a keyframe, if its agent is in the map.
    pub(super) fn pose(&self, keyframe: u32) -> Option<&Isometry3<f64>> {
        Some(self.map.pose(self.node(keyframe)?))
    }

    /// The node of a landmark, if an agent of the map has seen it.
    pub(super) fn point(&self, landmark: u32) -> Option<PointId> {
        self.points.get(landmark as usize).copied().flatten()
    }

    /// Squared error of a constraint, if it counts.
    pub(super) fn squared_error(&self, constraint: u32) -> Option<f64> {
        let link = self.links.get(constraint as usize).copied().flatten()?;
        Some(self.map.squared_error(link))
    }

    /// The latest calibration of an agent, with the variances of its components.
    pub(super) fn calibration(
        &self,
        agent: u32,
        marginals: &Marginals<'_>,
    ) -> Option<(Calibration, LastingErrors)> {
        let latest = self.calibrations.latest(agent)?;
        let (length, angle, veer, bias) = marginals.calibration(latest)?;
        let variances = LastingErrors::from([length, angle, bias.x, bias.y, bias.z, veer]);
        Some((
            Calibration::of_graph(&self.map.calibration(latest)),
            variances,
        ))
    }

    /// Adds a node for a keyframe in the map.
    fn add_pose(
        &mut self,
        graph: &KeyframeGraph,
        number: u32,
        keyframe: &Keyframe,
    ) -> Option<PoseId> {
        let track = graph.chains.track(keyframe.agent)?;
        if !track.is_in_map() {
            return None;
        }
        let pose = graph.chains.in_map(number)?;
        let mut constraints = graph.constraints.of(number, keyframe);
        let freedom = if constraints.any(|one| one.state == ClosureState::Origin) {
            Freedom::Held
        } else if track.is_planar {
            Freedom::Planar
        } else {
            Freedom::Full
        };
        Some(self.map.add_pose(pose, freedom))
    }

    /// Adds a link for the motion to a keyframe.
    fn add_motion(&mut self, graph: &KeyframeGraph, number: u32, keyframe: &Keyframe) {
        let Some(track) = graph.chains.track(keyframe.agent) else {
            return;
        };
        let ends = self.node(keyframe.previous).zip(self.node(number));
        let Some((from, to)) = ends.filter(|_| !keyframe.begins) else {
            return;
        };
        let calibration = self.calibrations.of_motion(number);
        let covariance = with_turn_noise(&keyframe.covariance, track.turn_noise);
        let information = information(&covariance, track.is_planar);
        let link = match calibration {
            Some(calibration) => Link::Odometry {
                from,
                to,
                calibration,
                reading: keyframe.calibrated.reading(&keyframe.motion),
                information,
            },
            None => Link::Between {
                from,
                to,
                transform: keyframe.motion,
                information,
            },
        };
        self.map.add_link(link, Kernel::Gaussian).ok();
    }

    /// Adds a link that ties a node to a pose, the less the farther it is from there.
    pub(super) fn hold_pose(
        &mut self,
        pose: PoseId,
        at: &Isometry3<f64>,
        covariance: &PoseCovariance,
        is_planar: bool,
    ) {
        let link = Link::PosePrior {
            pose,
            at: *at,
            information: information(covariance, is_planar),
        };
        self.map.add_link(link, sighting_kernel()).ok();
    }

    /// The same of a point.
    pub(super) fn hold_point(
        &mut self,
        point: PointId,
        at: Point3<f64>,
        covariance: &Matrix3<f64>,
    ) {
        if let Ok(information) = PositionInformation::of_covariance(covariance) {
            let link = Link::PointPrior {
                point,
                at,
                information,
            };
            self.map.add_link(link, sighting_kernel()).ok();
        }
    }

    fn add_constraint(
        &mut self,
        graph: &KeyframeGraph,
        constraint: &Constraint,
        among: Among,
    ) -> Option<LinkId> {
        let to = self.node(constraint.to)?;
        let agent = graph.chains.keyframes.get(constraint.to)?.agent;
        let is_planar = graph.chains.track(agent)?.is_planar;
        let is_left_out = constraint.state == ClosureState::Origin
            || (constraint.is_candidate() && among == Among::Accepted);
        if is_left_out {
            return None;
        }
        let information = information(&constraint.covariance, is_planar);
        let link = if constraint.from == NONE {
            Link::PosePrior {
                pose: to,
                at: constraint.transform,
                information,
            }
        } else {
            Link::Between {
                from: self.node(constraint.from)?,
                to,
                transform: constraint.transform,
                information,
            }
        };
        let kernel = if constraint.is_closure() {
            Kernel::GemanMcClure(Scale::new(tuning::CLOSURE_SCALE).expect("a positive constant"))
        } else {
            Kernel::Gaussian
        };
        self.map.add_link(link, kernel).ok()
    }

    /// Adds a node for the landmark of a sighting that says where it is.
    fn add_landmark(&mut self, sighting: &Sighting) -> Option<()> {
        let Seen::Landmark(number) = sighting.shown else {
            return None;
        };
        let from = self.node(sighting.keyframe)?;
        let position = match &sighting.seen {
            Observation::Point(point) => point.position,
            Observation::Range(range) => range.at?,
        };
        if self.point(number).is_none() {
            let at = self.map.pose(from) * Point3::from(position);
            let point = self.map.add_point(at, Freedom::Full);
            self.points[number as usize] = Some(point);
            if matches!(sighting.seen, Observation::Range(_)) {
                self.add_point_prior(point, at);
            }
        }
        Some(())
    }

    /// Adds a prior of a point of which perhaps distances alone are known: of what lies in their
    /// plane, robots that stay in it do not see the height.
    fn add_point_prior(&mut self, point: PointId, at: Point3<f64>) {
        let (across, height) = tuning::RANGED_POINT_SD_M;
        let variances = Vector3::new(across, across, height).map(|sd| sd * sd);
        let covariance = Matrix3::from_diagonal(&variances);
        let prior =
            PositionInformation::of_covariance(&covariance).map(|information| Link::PointPrior {
                point,
                at,
                information,
            });
        if let Ok(prior) = prior {
            self.map.add_link(prior, Kernel::Gaussian).ok();
        }
    }

    fn add_sighting(&mut self, sighting: &Sighting) -> Option<LinkId> {
        let from = self.node(sighting.keyframe)?;
        let target = match sighting.shown {
            Seen::Agent(target, lever) => SightingTarget::PointOf(self.node(target)?, lever),
            Seen::Landmark(number) => SightingTarget::Point(self.point(number)?),
        };
        let link = match &sighting.seen {
            Observation::Point(point) => Link::Sighting {
                from,
                target,
                position: point.position,
                information: PositionInformation::of_covariance(&point.covariance()).ok()?,
            },
            Observation::Range(range) => Link::Range {
                from,
                antenna: range.antenna,
                target,
                range_m: range.range_m,
                information: RangeInformation::of_variance(range.variance()).ok()?,
            },
        };
        self.map.add_link(link, sighting_kernel()).ok()
    }
}

/// The kernel of what may be mistaken now and then.
fn sighting_kernel() -> Kernel {
    Kernel::Cauchy(Scale::new(tuning::SIGHTING_SCALE).expect("a positive constant"))
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

/// A covariance of a motion, with a factor of the rotation's deviation.
fn with_turn_noise(covariance: &PoseCovariance, factor: f64) -> PoseCovariance {
    let scale = Vector6::new(1.0, 1.0, 1.0, factor, factor, factor);
    let scale = Matrix6::from_diagonal(&scale);
    PoseCovariance::from_upper_part(&(scale * covariance.matrix() * scale))
}
