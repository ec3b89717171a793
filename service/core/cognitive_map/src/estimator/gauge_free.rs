//! How well it is known how a frame's landmarks lie to one another, wherever the frame lies.

use nalgebra::{Matrix3, Matrix6, SMatrix};

use super::frame::{Frame, LandmarkState};
use super::tuning::LANDMARK_VARIANCE_MIN_M2;

impl Frame {
    /// Variance of each landmark along an axis, but for what a rigid motion of them all would
    /// explain \[m²\].
    ///
    /// A frame begins with a robot, so that what lies far from there shares the error of how the
    /// robot was turned: seen from the landmarks themselves that is none. With the errors e, of
    /// covariance C, the rigid motions J, and weights W:
    ///
    /// ```text
    /// e' = e − J G e      G = (Jᵀ W J)⁻¹ Jᵀ W      K = C Gᵀ
    /// C'ᵢᵢ = Cᵢᵢ − Kᵢ Jᵢᵀ − Jᵢ Kᵢᵀ + Jᵢ G K Jᵢᵀ
    /// ```
    ///
    /// Of planar frames only motions in the plane, and errors along it. Landmarks in a line have
    /// their whole variances.
    pub(super) fn gauge_free_variances(
        &self,
        landmarks: &[&LandmarkState],
        is_planar: bool,
    ) -> Vec<f64> {
        let along = |own: &Matrix3<f64>| variance_along(own, is_planar);
        let own: Vec<Matrix3<f64>> = landmarks
            .iter()
            .map(|landmark| self.landmark_covariance(landmark))
            .collect();
        let weight = |own: &Matrix3<f64>| 1.0 / along(own).max(LANDMARK_VARIANCE_MIN_M2);
        let modes: Vec<SMatrix<f64, 3, 6>> = landmarks
            .iter()
            .map(|landmark| rigid(landmark, is_planar))
            .collect();
        let mut normal = Matrix6::zeros();
        if is_planar {
            // Along what is not sought there is no motion.
            for k in geometry::OUT_OF_PLANE {
                normal[(k, k)] = 1.0;
            }
        }
        for (own, mode) in own.iter().zip(&modes) {
            normal += mode.transpose() * mode * weight(own);
        }
        let whole = || own.iter().map(along).collect();
        let Some(inverse) = normal.try_inverse() else {
            return whole();
        };
        let gain = own.iter().zip(&modes);
        let gain: Vec<SMatrix<f64, 6, 3>> = gain
            .map(|(own, mode)| inverse * mode.transpose() * weight(own))
            .collect();
        let product = |one: &&LandmarkState| {
            let mut product = SMatrix::<f64, 3, 6>::zeros();
            for (other, gain) in landmarks.iter().zip(&gain) {
                let block: Matrix3<f64> = self.covariance.block(one.offset, other.offset);
                product += block * gain.transpose();
            }
            product
        };
        let products: Vec<SMatrix<f64, 3, 6>> = landmarks.iter().map(product).collect();
        let mut motion = Matrix6::zeros();
        for (gain, product) in gain.iter().zip(&products) {
            motion += gain * product;
        }
        let rest = own.iter().zip(&modes).zip(&products);
        rest.map(|((own, mode), product)| {
            let mixed = product * mode.transpose();
            let rest = own - mixed - mixed.transpose() + mode * motion * mode.transpose();
            along(&rest).max(0.0)
        })
        .collect()
    }
}

/// Variance of a point along an axis \[m²\], of a planar frame one in the plane.
pub(super) fn variance_along(covariance: &Matrix3<f64>, is_planar: bool) -> f64 {
    if is_planar {
        f64::midpoint(covariance[(0, 0)], covariance[(1, 1)])
    } else {
        covariance.trace() / 3.0
    }
}

/// How a rigid motion of all moves a landmark: | I  −l× |, of the plane's motions where there are
/// no others.
fn rigid(landmark: &LandmarkState, is_planar: bool) -> SMatrix<f64, 3, 6> {
    let mut mode = SMatrix::<f64, 3, 6>::identity();
    let lever = -landmark.position.coords.cross_matrix();
    mode.fixed_view_mut::<3, 3>(0, 3).copy_from(&lever);
    if is_planar {
        mode.fixed_view_mut::<3, 3>(0, 2).fill(0.0);
        mode.row_mut(2).fill(0.0);
    }
    mode
}
