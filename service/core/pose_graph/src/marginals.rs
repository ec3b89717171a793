//! Marginal covariances of nodes.

use nalgebra::{Matrix3, Matrix6, Vector3};

use super::elimination::{CliqueTree, HalfSolution};
use super::equations::NormalEquations;
use super::graph::PoseGraph;
use super::node::{CalibrationId, PointId, PoseId};
use geometry::{PoseCovariance, se3, symmetric};

/// Covariances of nodes, given all links.
///
/// They are blocks of the inverse of the normal equations at the places where these were
/// linearised, read from their factor: the cost of one is that of the way from the node to the root
/// of the elimination, and does not grow with the map where the graph is narrow. A link that a
/// robust kernel has discounted counts as little here as there.
#[derive(Clone, Debug)]
pub struct Marginals<'a> {
    map: &'a PoseGraph,
    tree: CliqueTree,
}

impl PoseGraph {
    /// Covariances about the nodes' present places. Factors the whole graph once.
    pub fn marginals(&self) -> Marginals<'_> {
        let poses: Vec<_> = self.nodes.iter().map(|node| node.pose).collect();
        let equations = NormalEquations::new(self, &poses, 1.0);
        let mut tree = CliqueTree::structured(&equations, self.nodes.len());
        tree.refactor(&equations, &tree.all());
        Marginals { map: self, tree }
    }
}

impl Marginals<'_> {
    /// Covariance of a pose T = T̂ exp(ξ). `None` if the links leave it free, as those do that
    /// nothing connects with `map`.
    pub fn pose(&self, pose: PoseId) -> Option<PoseCovariance> {
        let half = self.half(pose.0)?;
        let covariance = self.placed(pose.0, pose.0, &half.product(&half));
        Some(PoseCovariance::from_upper_part(&covariance))
    }

    /// Covariance of a point in the axes of `map` \[m²\]. `None` if the links leave it free.
    pub fn point(&self, point: PointId) -> Option<Matrix3<f64>> {
        let half = self.half(point.0)?;
        let covariance = self.placed(point.0, point.0, &half.product(&half));
        let block = covariance.fixed_view::<3, 3>(0, 0).into_owned();
        Some(symmetric(&block))
    }

    /// Variances of a calibration's length, angle, veer and bias \[1, 1, rad²/m², rad²/s²\]; of a
    /// planar robot, the bias about z alone. `None` if the links leave it free.
    pub fn calibration(&self, calibration: CalibrationId) -> Option<(f64, f64, f64, Vector3<f64>)> {
        let half = self.half(calibration.0)?;
        let variances = self
            .placed(calibration.0, calibration.0, &half.product(&half))
            .diagonal();
        Some((
            variances[0],
            variances[1],
            variances[2],
            variances.fixed_rows::<3>(3).into_owned(),
        ))
    }

    /// Log of the determinant of the normal equations, without directions that the links leave
    /// free.
    pub fn log_determinant(&self) -> f64 {
        self.tree.log_determinant()
    }

    /// Covariance of the pose of `to` in the frame of `from`, with what the errors of the two have
    /// in common: what a match between them is to be judged by. `None` if the links leave one of
    /// them free.
    ///
    /// ```text
    /// ξ = ξ_to − Ad(T_to⁻¹ T_from) ξ_from
    /// ```
    pub fn relative_pose(&self, from: PoseId, to: PoseId) -> Option<PoseCovariance> {
        let (from_half, to_half) = (self.half(from.0)?, self.half(to.0)?);
        let from_from = self.placed(from.0, from.0, &from_half.product(&from_half));
        let to_to = self.placed(to.0, to.0, &to_half.product(&to_half));
        let to_from = self.placed(to.0, from.0, &to_half.product(&from_half));
        let moved = se3::adjoint(&self.map.pose(to).inv_mul(self.map.pose(from)));
        let common = to_from * moved.transpose();
        let covariance =
            to_to - common - common.transpose() + moved * from_from * moved.transpose();
        Some(PoseCovariance::from_upper_part(&covariance))
    }

    fn half(&self, node: u32) -> Option<HalfSolution> {
        let dimension = self.map.nodes[node as usize].axes().len();
        self.tree.half_solution(node, dimension)
    }

    /// A block with the unknowns in their places in a twist.
    fn placed(&self, row: u32, column: u32, block: &Matrix6<f64>) -> Matrix6<f64> {
        let mut placed = Matrix6::zeros();
        for (r, &row_axis) in self.map.nodes[row as usize].axes().iter().enumerate() {
            for (c, &column_axis) in self.map.nodes[column as usize].axes().iter().enumerate() {
                placed[(row_axis, column_axis)] = block[(r, c)];
            }
        }
        placed
    }
}
