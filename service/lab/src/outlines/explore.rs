//! How solids are taught, and how they are touched again.

use nalgebra::{Rotation3, Unit, Vector3};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use super::solid::{Felt, Solid};

/// Standard deviation of a turn of the walk at each step \[rad\].
const WALK_TURN_RAD: f64 = 0.4;
/// Points by which the share of a surface that was touched is estimated.
const COVERAGE_POINTS: usize = 400;

/// The contacts by which a solid is taught: an outline evenly along one lap, another surface at
/// random all over.
pub(super) fn lesson(solid: &Solid, count: usize, random: &mut ChaCha8Rng) -> Vec<Felt> {
    if !solid.is_planar() {
        return (0..count).map(|_| solid.draw(random)).collect();
    }
    let start_m = random.random_range(0.0..solid.length_m());
    let step_m = solid.length_m() / count as f64;
    let felt = (0..count).map(|k| solid.along(start_m + k as f64 * step_m));
    felt.collect()
}

/// A run of neighbouring touches from an unknown start: along an outline one way round, elsewhere a
/// walk that turns a little at each step.
pub(super) fn walk(solid: &Solid, count: usize, step_m: f64, random: &mut ChaCha8Rng) -> Vec<Felt> {
    if solid.is_planar() {
        let start_m = random.random_range(0.0..solid.length_m());
        let step_m = if random.random::<bool>() {
            step_m
        } else {
            -step_m
        };
        let felt = (0..count).map(|k| solid.along(start_m + k as f64 * step_m));
        return felt.collect();
    }
    let mut here = solid.draw(random);
    let mut ahead = tangent(&here.normal, &gaussian(random));
    let mut felt = vec![here];
    while felt.len() < count {
        here = solid.felt(&(here.position_m.coords + ahead * step_m));
        felt.push(here);
        let turn_rad: f64 = WALK_TURN_RAD * random.sample::<f64, _>(StandardNormal);
        let turned = Rotation3::from_axis_angle(&here.normal, turn_rad) * ahead;
        ahead = tangent(&here.normal, &turned);
    }
    felt
}

/// Touches of a walk after which half of the surface lies within a step of one.
pub(super) fn half_covered(
    solid: &Solid,
    felt: &[Felt],
    step_m: f64,
    random: &mut ChaCha8Rng,
) -> usize {
    let mut open: Vec<Felt> = (0..COVERAGE_POINTS).map(|_| solid.draw(random)).collect();
    for (number, felt) in felt.iter().enumerate() {
        open.retain(|point| (point.position_m - felt.position_m).norm() > step_m);
        if 2 * open.len() <= COVERAGE_POINTS {
            return number + 1;
        }
    }
    felt.len()
}

/// A vector of three standard normal numbers.
pub(super) fn gaussian(random: &mut ChaCha8Rng) -> Vector3<f64> {
    Vector3::from_fn(|_, _| random.sample(StandardNormal))
}

/// The direction of a vector along a surface.
fn tangent(normal: &Unit<Vector3<f64>>, vector: &Vector3<f64>) -> Vector3<f64> {
    let along = vector - normal.into_inner() * normal.dot(vector);
    along.try_normalize(1e-9).unwrap_or_else(|| {
        let across = normal.cross(&Vector3::x());
        across.try_normalize(1e-9).unwrap_or_else(Vector3::y)
    })
}
