//! A link's residual and what it adds to the normal equations.

use nalgebra::{Isometry3, Matrix3, Matrix6, Vector3, Vector6};

use super::link::{Link, SightingTarget};
use geometry::{from_blocks, log_jacobian, se3};

/// Normal equations of one link at given poses: to second order in the motions δ of its nodes the
/// link costs
///
/// ```text
/// s + 2 Σ gₐᵀ δₐ + Σ δₐᵀ Hₐᵦ δᵦ
/// ```
///
/// Points fill the first three rows.
#[derive(Clone, Debug)]
pub(super) struct NormalBlocks {
    pub(super) from_from: Matrix6<f64>,
    /// Rows of the node that was measured, columns of the one that measured.
    pub(super) to_from: Matrix6<f64>,
    pub(super) to_to: Matrix6<f64>,
    pub(super) from_gradient: Vector6<f64>,
    pub(super) to_gradient: Vector6<f64>,
}

impl Link {
    /// s = rᵀ Ω r at these poses of its nodes.
    pub(super) fn squared_error(&self, from: &Isometry3<f64>, to: &Isometry3<f64>) -> f64 {
        match self {
            Self::PosePrior {
                at, information, ..
            } => {
                let residual = se3::twist(&at.inv_mul(to));
                residual.dot(&(information.matrix() * residual))
            }
            Self::Between {
                transform,
                information,
                ..
            } => {
                let residual = se3::twist(&transform.inv_mul(&from.inv_mul(to)));
                residual.dot(&(information.matrix() * residual))
            }
            Self::PointPrior {
                at, information, ..
            } => {
                let residual = to.translation.vector - at.coords;
                residual.dot(&(information.matrix() * residual))
            }
            Self::Sighting {
                position,
                information,
                target,
                ..
            } => {
                let residual = seen(from, to, &target.lever()) - position;
                residual.dot(&(information.matrix() * residual))
            }
        }
    }

    /// The squared error, and the normal equations multiplied by the weight that `weigh` gives it.
    pub(super) fn normal_blocks(
        &self,
        from: &Isometry3<f64>,
        to: &Isometry3<f64>,
        weigh: impl Fn(f64) -> f64,
    ) -> NormalBlocks {
        match self {
            Self::PosePrior {
                at, information, ..
            } => {
                let residual = se3::twist(&at.inv_mul(to));
                let (to_to, to_gradient) = pose_blocks(&residual, information.matrix(), weigh);
                NormalBlocks {
                    to_to,
                    to_gradient,
                    ..NormalBlocks::zero()
                }
            }
            Self::Between {
                transform,
                information,
                ..
            } => {
                let between = from.inv_mul(to);
                let residual = se3::twist(&transform.inv_mul(&between));
                let (to_to, to_gradient) = pose_blocks(&residual, information.matrix(), weigh);
                // r(T_from exp δ) = r(T_to exp(−Ad(T_to⁻¹ T_from) δ)).
                let moved = -se3::adjoint(&between.inverse());
                let to_from = to_to * moved;
                NormalBlocks {
                    from_from: moved.tr_mul(&to_from),
                    to_from,
                    to_to,
                    from_gradient: moved.tr_mul(&to_gradient),
                    to_gradient,
                }
            }
            Self::PointPrior {
                at, information, ..
            } => {
                let residual = to.translation.vector - at.coords;
                let (information, force) = weighted(&residual, information.matrix(), weigh);
                NormalBlocks {
                    to_to: corner(&information),
                    to_gradient: top(&force),
                    ..NormalBlocks::zero()
                }
            }
            Self::Sighting {
                position,
                information,
                target,
                ..
            } => sighting_blocks((from, to), *target, position, information.matrix(), weigh),
        }
    }
}

impl NormalBlocks {
    fn zero() -> Self {
        Self {
            from_from: Matrix6::zeros(),
            to_from: Matrix6::zeros(),
            to_to: Matrix6::zeros(),
            from_gradient: Vector6::zeros(),
            to_gradient: Vector6::zeros(),
        }
    }
}

/// The blocks of a sighting.
fn sighting_blocks(
    (from, to): (&Isometry3<f64>, &Isometry3<f64>),
    target: SightingTarget,
    position: &Vector3<f64>,
    information: &Matrix3<f64>,
    weigh: impl Fn(f64) -> f64,
) -> NormalBlocks {
    let in_target = target.lever();
    let seen = seen(from, to, &in_target);
    let (information, force) = weighted(&(seen - position), information, weigh);
    // The target's motion in the axes of the pose that saw it.
    let turn = match target {
        SightingTarget::Point(_) => from.rotation.inverse(),
        SightingTarget::Pose(_) | SightingTarget::PointOf(..) => {
            from.rotation.inverse() * to.rotation
        }
    };
    let turn = turn.to_rotation_matrix().into_inner();
    let turned = turn.tr_mul(&information);
    // What that pose's own motion does to the target in its frame: −ρ − φ×seen.
    let lever = seen.cross_matrix();
    let with_lever = information * lever;
    let lever_lever = lever.tr_mul(&with_lever);
    let zeros = Matrix3::zeros();
    let mut blocks = NormalBlocks {
        from_from: from_blocks(
            &information,
            &-with_lever,
            &-with_lever.transpose(),
            &lever_lever,
        ),
        to_from: from_blocks(&-turned, &(turned * lever), &zeros, &zeros),
        to_to: corner(&(turned * turn)),
        from_gradient: se3::join(&-force, &lever.tr_mul(&force)),
        to_gradient: top(&turn.tr_mul(&force)),
    };
    if in_target != Vector3::zeros() {
        blocks.swing(&in_target, &turned, &turn, &lever, &force);
    }
    blocks
}

impl NormalBlocks {
    /// Adds the rotation of a target whose point lies beside its origin: it moves by ρ + φ×l, with
    /// l = `in_target`.
    fn swing(
        &mut self,
        in_target: &Vector3<f64>,
        turned: &Matrix3<f64>,
        turn: &Matrix3<f64>,
        lever: &Matrix3<f64>,
        force: &Vector3<f64>,
    ) {
        let swing = in_target.cross_matrix();
        let swung = swing * turned;
        let cross = swung * turn;
        let put = |matrix: &mut Matrix6<f64>, row, column, block: &Matrix3<f64>| {
            matrix.fixed_view_mut::<3, 3>(row, column).copy_from(block);
        };
        put(&mut self.to_from, 3, 0, &-swung);
        put(&mut self.to_from, 3, 3, &(swung * lever));
        put(&mut self.to_to, 3, 0, &cross);
        put(&mut self.to_to, 0, 3, &cross.transpose());
        put(&mut self.to_to, 3, 3, &-(cross * swing));
        self.to_gradient
            .fixed_rows_mut::<3>(3)
            .copy_from(&(swing * turn.tr_mul(force)));
    }
}

/// The target's position in the frame of the pose that sees it.
fn seen(from: &Isometry3<f64>, to: &Isometry3<f64>, lever: &Vector3<f64>) -> Vector3<f64> {
    let point = to.translation.vector + to.rotation * lever;
    from.rotation
        .inverse_transform_vector(&(point - from.translation.vector))
}

/// Aᵀ w Ω A and Aᵀ w Ω r with the derivative A of r = log(E exp δ).
fn pose_blocks(
    residual: &Vector6<f64>,
    information: &Matrix6<f64>,
    weigh: impl Fn(f64) -> f64,
) -> (Matrix6<f64>, Vector6<f64>) {
    let force = information * residual;
    let weight = weigh(residual.dot(&force));
    let (linear, angular) = se3::split(residual);
    let jacobian = log_jacobian(&linear, &angular);
    let blocks = jacobian.tr_mul(&(information * jacobian)) * weight;
    (blocks, jacobian.tr_mul(&force) * weight)
}

/// w Ω and w Ω r.
fn weighted(
    residual: &Vector3<f64>,
    information: &Matrix3<f64>,
    weigh: impl Fn(f64) -> f64,
) -> (Matrix3<f64>, Vector3<f64>) {
    let force = information * residual;
    let weight = weigh(residual.dot(&force));
    (information * weight, force * weight)
}

fn corner(block: &Matrix3<f64>) -> Matrix6<f64> {
    let zeros = Matrix3::zeros();
    from_blocks(block, &zeros, &zeros, &zeros)
}

fn top(part: &Vector3<f64>) -> Vector6<f64> {
    se3::join(part, &Vector3::zeros())
}

#[cfg(test)]
mod tests;
