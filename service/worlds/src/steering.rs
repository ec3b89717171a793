//! Which way to turn when the way ahead is blocked.

use nalgebra::{UnitQuaternion, UnitVector3, Vector3};

use super::obstacle::ObstacleWorld;

/// Number of directions that are considered.
const N_DIRECTIONS: u32 = 64;
/// A direction that is free for this far is as good as any longer one \[m\].
const FAR_M: f64 = 3.0;
/// A direction must be free for this far to be taken at all, if there is one \[m\].
const NEAR_M: f64 = 0.5;
/// What a direction straight ahead is worth against one straight back, in units of [`FAR_M`].
const AHEAD_SHARE: f64 = 0.5;

/// The free direction that costs the least turn and leads the farthest, in the room's frame.
pub(super) fn way_out(
    world: &ObstacleWorld,
    position_m: &Vector3<f64>,
    ahead: &UnitVector3<f64>,
    clearance_m: f64,
) -> UnitVector3<f64> {
    let candidates = (0..N_DIRECTIONS).map(|index| {
        let direction = direction(index);
        (
            direction,
            world.free_distance_m(position_m, &direction, clearance_m, FAR_M),
        )
    });
    let score = |direction: &UnitVector3<f64>, free_m: f64| {
        let passable = if free_m >= NEAR_M { 2.0 } else { 0.0 }; // more than any other merit
        passable + free_m / FAR_M + AHEAD_SHARE * direction.dot(ahead)
    };
    candidates
        .map(|(direction, free_m)| (direction, score(&direction, free_m)))
        .max_by(|a, b| a.1.total_cmp(&b.1))
        .map_or(*ahead, |(direction, _)| direction)
}

/// The turn \[rad\] about the body's y and z axes that brings its x axis towards a direction, of
/// `turn_rad_max` at most.
pub(super) fn turn_towards(
    rotation: &UnitQuaternion<f64>,
    direction: &UnitVector3<f64>,
    turn_rad_max: f64,
) -> Vector3<f64> {
    let seen = rotation.inverse() * direction.into_inner();
    let sideways = Vector3::new(0.0, -seen.z, seen.y); // x × seen
    let sine = sideways.norm();
    let angle = sine.atan2(seen.x).min(turn_rad_max);
    if sine > 1e-9 {
        sideways * (angle / sine)
    } else if seen.x < 0.0 {
        Vector3::z() * angle // straight back: either side will do
    } else {
        Vector3::zeros()
    }
}

/// One of the directions spread evenly over the sphere (a Fibonacci lattice).
fn direction(index: u32) -> UnitVector3<f64> {
    let golden_angle = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let z = 1.0 - (2.0 * f64::from(index) + 1.0) / f64::from(N_DIRECTIONS);
    let (sin, cos) = (golden_angle * f64::from(index)).sin_cos();
    let radius = (1.0 - z * z).sqrt();
    UnitVector3::new_normalize(Vector3::new(radius * cos, radius * sin, z))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn turns_lead_to_the_direction(
            turn in prop::array::uniform3(-2.0..2.0_f64),
            index in 0..N_DIRECTIONS,
        ) {
            let mut rotation = UnitQuaternion::from_scaled_axis(Vector3::from(turn));
            let target = direction(index);
            for _ in 0..40 {
                let step = turn_towards(&rotation, &target, 0.1);
                prop_assert!(step.norm() <= 0.1 + 1e-12 && step.x == 0.0);
                rotation *= UnitQuaternion::from_scaled_axis(step);
            }
            prop_assert!((rotation * Vector3::x()).dot(&target) > 1.0 - 1e-9);
        }
    }

    #[test]
    fn straight_back_is_not_a_dead_end() {
        let back = -Vector3::x_axis();
        let step = turn_towards(&UnitQuaternion::identity(), &back, 0.3);
        assert!((step.norm() - 0.3).abs() < 1e-12);
        let none = turn_towards(&UnitQuaternion::identity(), &Vector3::x_axis(), 0.3);
        assert_eq!(none, Vector3::zeros());
    }

    #[test]
    fn the_way_out_of_a_corner_is_free() {
        let world = ObstacleWorld::new(3);
        let corner = Vector3::repeat(0.2);
        if world.is_free(&corner, 0.15) {
            let ahead = UnitVector3::new_normalize(-Vector3::repeat(1.0));
            let out = way_out(&world, &corner, &ahead, 0.15);
            assert!(world.free_distance_m(&corner, &out, 0.15, FAR_M) >= NEAR_M);
        }
    }
}
