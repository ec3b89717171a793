//! A local planner: towards a point, around what is in the way.

use std::f64::consts::PI;

use nalgebra::Vector2;

use super::{Floor, PlanarRobot};

/// Angle between the headings that are tried \[rad\].
const BETWEEN_RAD: f64 = PI / 12.0;
/// Headings on either side of the straight one: all around.
const HEADINGS: i32 = 12;
/// How far feelers reach \[m\].
const FEELERS_M: [f64; 2] = [0.1, 0.2];
/// What another side of the obstacle than before costs, beside the angle from the straight line.
const CHANGE: f64 = 0.5;

/// Goes towards points by what its robot feels around it, as a vector field histogram does with
/// more sensors (Borenstein & Koren 1991). It knows nothing of the floor but what the feelers
/// touch, and remembers on which side it last went around something.
#[derive(Clone, Copy, Debug, Default)]
pub struct LocalPlanner {
    /// How far from the straight line it went last \[rad\].
    aside_rad: f64,
}

impl LocalPlanner {
    /// Goes one step towards a point in the robot's frame; answers how it turned \[rad\] and how
    /// far it was to go \[m\]. Where every heading is blocked the robot turns around.
    pub fn step(
        &mut self,
        robot: &mut PlanarRobot,
        floor: &Floor,
        to: &Vector2<f64>,
    ) -> (f64, f64) {
        let straight_rad = to.y.atan2(to.x);
        let length_m = to.norm().min(FEELERS_M[0]);
        let is_free = |aside_rad: &f64| {
            let heading_rad = straight_rad + aside_rad;
            // Nobody need look beyond the point.
            let mut reaches = FEELERS_M.iter().map(|reach_m| reach_m.min(to.norm()));
            reaches.all(|reach_m| robot.feels_free(floor, heading_rad, reach_m))
        };
        let headings = (-HEADINGS..=HEADINGS).map(|k| f64::from(k) * BETWEEN_RAD);
        let price = |aside_rad: &f64| aside_rad.abs() + CHANGE * (aside_rad - self.aside_rad).abs();
        let free = headings.filter(is_free);
        let best = free.min_by(|a, b| price(a).total_cmp(&price(b)));
        self.aside_rad = best.unwrap_or(PI);
        let turn_rad = straight_rad + self.aside_rad;
        let turn_rad = turn_rad.sin().atan2(turn_rad.cos());
        robot.step(floor, turn_rad, length_m);
        (turn_rad, length_m)
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry2, Point2};
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::routes::FloorKind;

    /// Around a pillar that is on the straight line.
    #[test]
    fn goes_around_what_it_feels() {
        for seed in 0..10 {
            let floor = Floor::new(FloorKind::Hall, seed);
            let mut random = ChaCha8Rng::seed_from_u64(seed);
            let (start, goal) = (floor.any_free(&mut random), floor.any_free(&mut random));
            let mut robot = PlanarRobot::new(start, seed);
            let mut planner = LocalPlanner::default();
            for _ in 0..600 {
                let body = Isometry2::new(robot.position().coords, robot.heading_rad());
                let to: Point2<f64> = body.inverse_transform_point(&goal);
                if to.coords.norm() < 0.05 {
                    break;
                }
                planner.step(&mut robot, &floor, &to.coords);
                assert!(floor.is_free(&robot.position()), "never into a wall");
            }
            let off_m = (robot.position() - goal).norm();
            assert!(off_m < 0.05, "{off_m} m from the goal with seed {seed}");
        }
    }
}
