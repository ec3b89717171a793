//! A data set as an experience map.

use std::collections::BTreeSet;

use cognitive_map::experience::{
    ExperienceMap, Freedom, Kernel, Link, LinkId, PoseId, PoseInformation, RelaxationSettings,
};
use cognitive_map::geometry::PoseCovariance;
use nalgebra::{Isometry3, Matrix6};

use super::data_set::{Match, Tuc};
use crate::metrics::StampedPose;

/// How far apart two samples may be that were taken at the same place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MatchNoise {
    /// Standard deviation along each axis \[m\].
    pub position_sd_m: f64,
    /// Standard deviation of the heading \[rad\].
    pub heading_sd_rad: f64,
    /// How a match that does not fit counts.
    pub kernel: Kernel,
}

/// A map with a node at every matched moment and at the first, odometry from each to the next, and the matches.
#[derive(Clone, Debug)]
pub struct MatchedMap {
    /// The map.
    pub map: ExperienceMap,
    /// The links of the matches, in their order.
    pub matches: Vec<LinkId>,
    /// Node and odometry since, for every step.
    steps: Vec<WalkedStep>,
}

/// When a step ended, the last node until then, and the odometry since that node.
type WalkedStep = (i64, PoseId, Isometry3<f64>);

impl MatchedMap {
    /// Of a data set with these matches, which need not be its own. A moment is put at the step next to it.
    pub fn new(set: &Tuc, matches: &[Match], noise: &MatchNoise) -> Self {
        let moments = matches
            .iter()
            .flat_map(|found| [found.earlier_ns, found.later_ns]);
        let wanted: BTreeSet<usize> = moments.map(|moment_ns| set.step_at(moment_ns)).collect();
        let (mut map, steps) = walk(set, &wanted);
        let mut variances = Matrix6::zeros();
        for (axis, sd) in [
            (0, noise.position_sd_m),
            (1, noise.position_sd_m),
            (5, noise.heading_sd_rad),
        ] {
            variances[(axis, axis)] = sd * sd;
        }
        let information = planar_information(&variances);
        let mut links = Vec::with_capacity(matches.len());
        for found in matches {
            let link = Link::Between {
                from: steps[set.step_at(found.earlier_ns)].1,
                to: steps[set.step_at(found.later_ns)].1,
                transform: Isometry3::identity(),
                information,
            };
            // Two moments next to the same step are one node, and say nothing.
            if let Ok(id) = map.add_link(link, noise.kernel) {
                links.push(id);
            }
        }
        Self {
            map,
            matches: links,
            steps,
        }
    }

    /// Relaxes the map and gives the pose at every step.
    pub fn relaxed(&mut self, settings: &RelaxationSettings) -> Vec<StampedPose> {
        self.map.relax(settings);
        self.trajectory()
    }

    /// The pose at every step.
    pub fn trajectory(&self) -> Vec<StampedPose> {
        let pose = |&(stamp_ns, node, since): &WalkedStep| StampedPose {
            stamp_ns,
            pose: self.map.pose(node) * since,
        };
        self.steps.iter().map(pose).collect()
    }
}

/// A map of the odometry alone, with a node at the first step and at each that is wanted.
fn walk(set: &Tuc, wanted: &BTreeSet<usize>) -> (ExperienceMap, Vec<WalkedStep>) {
    let mut map = ExperienceMap::new();
    let mut steps = Vec::with_capacity(set.steps().len());
    let mut node = map.add_pose(Isometry3::identity(), Freedom::Held);
    let (mut since, mut covariance) = (Isometry3::identity(), PoseCovariance::zero());
    for (index, step) in set.steps().iter().enumerate() {
        since *= step.motion;
        covariance = covariance.after_motion(&step.motion, &step.noise_sd);
        if index > 0 && wanted.contains(&index) {
            let next = map.add_pose(map.pose(node) * since, Freedom::Planar);
            let link = Link::Between {
                from: node,
                to: next,
                transform: since,
                information: planar_information(covariance.matrix()),
            };
            map.add_link(link, Kernel::Gaussian)
                .expect("two nodes of the map");
            node = next;
            (since, covariance) = (Isometry3::identity(), PoseCovariance::zero());
        }
        steps.push((step.stamp_ns, node, since));
    }
    (map, steps)
}

/// The inverse of the planar part of a covariance, and nothing about the other directions.
fn planar_information(covariance: &Matrix6<f64>) -> PoseInformation {
    let axes = [0, 1, 5];
    // A robot said to move without any error still has a micrometre and a microradian of it.
    let planar = nalgebra::Matrix3::from_fn(|r, c| covariance[(axes[r], axes[c])])
        + nalgebra::Matrix3::identity() * 1e-12;
    let inverse = planar
        .cholesky()
        .expect("the diagonal is above zero")
        .inverse();
    let mut matrix = Matrix6::zeros();
    for (r, &row) in axes.iter().enumerate() {
        for (c, &column) in axes.iter().enumerate() {
            matrix[(row, column)] = 0.5 * (inverse[(r, c)] + inverse[(c, r)]);
        }
    }
    PoseInformation::new(&matrix).expect("an inverse of a positive matrix is positive")
}
