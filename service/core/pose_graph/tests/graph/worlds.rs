//! Maps with a known truth.

use geometry::PoseCovariance;
use nalgebra::{Isometry3, Matrix3, Vector3, Vector6};
use pose_graph::{Freedom, Kernel, Link, PoseGraph, PoseId, PoseInformation, PositionInformation};

/// Numbers in [−1, 1) from a fixed sequence (splitmix64).
pub(crate) struct Noise(pub(crate) u64);

impl Noise {
    pub(crate) fn next(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    /// One of 0 … `n` − 1.
    pub(crate) fn index(&mut self, n: usize) -> usize {
        usize::try_from(self.bits() % n as u64).unwrap()
    }

    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut bits = self.0;
        bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        bits ^ (bits >> 31)
    }

    /// A small motion: up to these in each component.
    pub(crate) fn motion(&mut self, shift: f64, turn: f64, freedom: Freedom) -> Isometry3<f64> {
        let mut components = [0.0; 6];
        for (k, component) in components.iter_mut().enumerate() {
            let scale = if k < 3 { shift } else { turn };
            let moves = freedom == Freedom::Full || matches!(k, 0 | 1 | 5);
            *component = if moves { scale * self.next() } else { 0.0 };
        }
        let [x, y, z, roll, pitch, yaw] = components;
        Isometry3::new(Vector3::new(x, y, z), Vector3::new(roll, pitch, yaw))
    }
}

/// Twice round a loop of which every place is seen again on the second round.
pub(crate) struct Rounds {
    pub(crate) truth: Vec<Isometry3<f64>>,
    /// From, to, measured.
    pub(crate) measured: Vec<(usize, usize, Isometry3<f64>)>,
    pub(crate) freedom: Freedom,
}

/// Poses of one round.
pub(crate) const ROUND: usize = 24;

impl Rounds {
    /// `noise` is the largest error of a measurement \[m, and a tenth of it in rad\].
    pub(crate) fn new(seed: u64, freedom: Freedom, noise: f64) -> Self {
        let mut random = Noise(seed);
        let mut truth = vec![Isometry3::identity()];
        for k in 0..2 * ROUND {
            let turn = 2.0 * std::f64::consts::PI / ROUND as f64;
            let tilt = if freedom == Freedom::Full {
                0.1 * (k as f64).sin()
            } else {
                0.0
            };
            let forward = Isometry3::new(Vector3::x(), Vector3::new(tilt, -tilt, turn));
            truth.push(truth[k] * forward * random.motion(0.05, 0.05, freedom));
        }
        let mut measured = Vec::new();
        for to in 1..truth.len() {
            let mut from = vec![to - 1];
            if to >= ROUND {
                from.push(to - ROUND);
            }
            for from in from {
                let error = random.motion(noise, 0.1 * noise, freedom);
                measured.push((from, to, truth[from].inv_mul(&truth[to]) * error));
            }
        }
        Self {
            truth,
            measured,
            freedom,
        }
    }

    /// Information of every measurement.
    pub(crate) fn information() -> PoseInformation {
        let sd = Vector6::new(0.1, 0.1, 0.1, 0.01, 0.01, 0.01);
        PoseInformation::of_covariance(&PoseCovariance::from_sd(&sd)).unwrap()
    }

    pub(crate) fn link(&self, index: usize, nodes: &[PoseId]) -> Link {
        let (from, to, transform) = self.measured[index];
        let information = Self::information();
        Link::Between {
            from: nodes[from],
            to: nodes[to],
            transform,
            information,
        }
    }

    /// The map with its nodes at `start`, the first of them held.
    pub(crate) fn map(&self, start: &[Isometry3<f64>]) -> (PoseGraph, Vec<PoseId>) {
        let mut map = PoseGraph::new();
        let mut nodes = Vec::new();
        for (k, pose) in start.iter().enumerate() {
            nodes.push(map.add_pose(*pose, if k == 0 { Freedom::Held } else { self.freedom }));
        }
        for index in 0..self.measured.len() {
            map.add_link(self.link(index, &nodes), Kernel::Gaussian)
                .unwrap();
        }
        (map, nodes)
    }

    /// Where odometry alone puts the nodes.
    pub(crate) fn dead_reckoned(&self) -> Vec<Isometry3<f64>> {
        let mut poses = vec![self.truth[0]];
        for &(from, to, motion) in &self.measured {
            if to == from + 1 {
                poses.push(poses[from] * motion);
            }
        }
        poses
    }
}

/// The largest distance between poses: metres and radians together.
pub(crate) fn distance(map: &PoseGraph, nodes: &[PoseId], poses: &[Isometry3<f64>]) -> f64 {
    let mut largest = 0.0_f64;
    for (&node, pose) in nodes.iter().zip(poses) {
        let error = map.pose(node).inv_mul(pose);
        largest = largest.max(error.translation.vector.norm() + error.rotation.angle());
    }
    largest
}

/// The same in every direction.
pub(crate) fn position_information(sd_m: f64) -> PositionInformation {
    PositionInformation::new(&(Matrix3::identity() / (sd_m * sd_m))).unwrap()
}
