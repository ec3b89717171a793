//! A link's residual and what it adds to the normal equations.

use nalgebra::{Isometry3, Matrix3, Matrix6, Vector3, Vector6};

use super::calibration::{Calibration, Reading};
use super::link::{Link, SightingTarget};
use super::normal_blocks::{CalibrationBlocks, NormalBlocks};
use super::range_blocks::{RangeError, range_blocks};
use geometry::{from_blocks, log_jacobian, se3};

impl Link {
    /// s = rᵀ Ω r at these places of its nodes.
    pub(super) fn squared_error<'a>(&self, place: impl Fn(u32) -> &'a Isometry3<f64>) -> f64 {
        let (from, to) = self.nodes();
        let (from, to) = (place(from), place(to));
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
            Self::Range {
                antenna,
                target,
                range_m,
                information,
                ..
            } => {
                let residual = RangeError::new((from, to), antenna, *target).distance_m - range_m;
                residual * residual * information.matrix()[(0, 0)]
            }
            Self::Odometry {
                reading,
                calibration,
                information,
                ..
            } => {
                let calibration = Calibration::of_place(place(calibration.0));
                let motion = reading.motion(&calibration);
                let residual = se3::twist(&motion.inv_mul(&from.inv_mul(to)));
                residual.dot(&(information.matrix() * residual))
            }
            Self::CalibrationPrior {
                at, information, ..
            } => {
                let residual = Calibration::of_place(to).components() - at.components();
                residual.dot(&information.diagonal().component_mul(&residual))
            }
            Self::CalibrationWander { information, .. } => {
                let residual = change(from, to);
                residual.dot(&information.diagonal().component_mul(&residual))
            }
        }
    }

    /// The squared error, and the normal equations multiplied by the weight that `weigh` gives it.
    pub(super) fn normal_blocks<'a>(
        &self,
        place: impl Fn(u32) -> &'a Isometry3<f64>,
        weigh: impl Fn(f64) -> f64,
    ) -> NormalBlocks {
        let (from, to) = self.nodes();
        let (from, to) = (place(from), place(to));
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
                let error = transform.inv_mul(&from.inv_mul(to));
                between_blocks((from, to), &error, information.matrix(), weigh)
            }
            Self::Odometry {
                reading,
                calibration,
                information,
                ..
            } => {
                let calibration = Calibration::of_place(place(calibration.0));
                odometry_blocks(
                    (from, to),
                    (reading, &calibration),
                    information.matrix(),
                    weigh,
                )
            }
            Self::CalibrationPrior {
                at, information, ..
            } => {
                let residual = Calibration::of_place(to).components() - at.components();
                calibration_blocks(&residual, information.diagonal())
            }
            Self::CalibrationWander { information, .. } => {
                let blocks = calibration_blocks(&change(from, to), information.diagonal());
                NormalBlocks {
                    from_from: blocks.to_to,
                    to_from: -blocks.to_to,
                    from_gradient: -blocks.to_gradient,
                    ..blocks
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
            Self::Range {
                antenna,
                target,
                range_m,
                information,
                ..
            } => {
                let error = RangeError::new((from, to), antenna, *target);
                range_blocks(&error, *range_m, information.matrix()[(0, 0)], weigh)
            }
        }
    }
}

/// The blocks of a relative pose with this error.
fn between_blocks(
    (from, to): (&Isometry3<f64>, &Isometry3<f64>),
    error: &Isometry3<f64>,
    information: &Matrix6<f64>,
    weigh: impl Fn(f64) -> f64,
) -> NormalBlocks {
    let residual = se3::twist(error);
    let (to_to, to_gradient) = pose_blocks(&residual, information, weigh);
    // r(T_from exp δ) = r(T_to exp(−Ad(T_to⁻¹ T_from) δ)).
    let moved = -se3::adjoint(&to.inv_mul(from));
    let to_from = to_to * moved;
    NormalBlocks {
        from_from: moved.tr_mul(&to_from),
        to_from,
        to_to,
        from_gradient: moved.tr_mul(&to_gradient),
        to_gradient,
        by_calibration: None,
    }
}

/// The blocks of a motion by a reading and its calibration.
fn odometry_blocks(
    (from, to): (&Isometry3<f64>, &Isometry3<f64>),
    (reading, calibration): (&Reading, &Calibration),
    information: &Matrix6<f64>,
    weigh: impl Fn(f64) -> f64,
) -> NormalBlocks {
    let error = reading.motion(calibration).inv_mul(&from.inv_mul(to));
    let mut blocks = between_blocks((from, to), &error, information, weigh);
    let moved = reading.jacobian(calibration, &error);
    let to_calibration = blocks.to_to * moved;
    blocks.by_calibration = Some(CalibrationBlocks {
        own: moved.tr_mul(&to_calibration),
        from: blocks.to_from.tr_mul(&moved),
        to: to_calibration,
        gradient: moved.tr_mul(&blocks.to_gradient),
    });
    blocks
}

/// The blocks of an error of a calibration.
fn calibration_blocks(residual: &Vector6<f64>, information: &Vector6<f64>) -> NormalBlocks {
    NormalBlocks {
        to_to: Matrix6::from_diagonal(information),
        to_gradient: information.component_mul(residual),
        ..NormalBlocks::zero()
    }
}

/// By how much a calibration differs from an earlier one.
fn change(from: &Isometry3<f64>, to: &Isometry3<f64>) -> Vector6<f64> {
    Calibration::of_place(to).components() - Calibration::of_place(from).components()
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
        by_calibration: None,
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
