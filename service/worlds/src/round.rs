//! A round: a closed way of straight legs through a room.

use nalgebra::{UnitVector3, Vector3};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::obstacle::ObstacleWorld;

/// Corners of a round.
const CORNERS: usize = 4;
/// Shortest leg \[m\]: a robot flies straight on it for a while.
const LEG_M_MIN: f64 = 3.0;
/// Farthest from a corner to the next one along an axis \[m\].
const LEG_M_MAX: f64 = 5.5;
/// Shortest and longest round \[m\]: a lap at 1 m/s is over before the first robot wakes up.
const LENGTH_M: std::ops::RangeInclusive<f64> = 14.0..=18.0;
/// What is free about every leg \[m\].
const CLEARANCE_M: f64 = 0.5;
/// Cosine of the sharpest turn at a corner: 120°.
const TURN_COS_MIN: f64 = -0.5;
/// Corners that are drawn before a round is given up.
const TRIALS: u32 = 200_000;

/// A closed way.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Round {
    corners_m: Vec<Vector3<f64>>,
}

/// A point of a round.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Waypoint {
    /// Where it is \[m\].
    pub(super) position_m: Vector3<f64>,
    /// Where its leg leads.
    pub(super) ahead: UnitVector3<f64>,
    /// How far its leg goes on \[m\].
    pub(super) straight_m: f64,
}

impl Round {
    /// A random round whose legs are free and keep `apart_m` away from a place; `None` when none
    /// was found.
    pub(super) fn draw(
        world: &ObstacleWorld,
        away_from_m: &Vector3<f64>,
        apart_m: f64,
        random: &mut ChaCha8Rng,
    ) -> Option<Self> {
        let span = CLEARANCE_M..world.side_m() - CLEARANCE_M;
        (0..TRIALS).find_map(|_| {
            let mut corner_m = Vector3::from_fn(|_, _| random.random_range(span.clone()));
            let mut corners_m = vec![corner_m];
            while corners_m.len() < CORNERS {
                corner_m += Vector3::from_fn(|_, _| random.random_range(-LEG_M_MAX..LEG_M_MAX));
                corners_m.push(corner_m);
            }
            let round = Self { corners_m };
            let is_far = || {
                round
                    .legs()
                    .all(|(from_m, to_m)| distance_to_leg_m(away_from_m, &from_m, &to_m) >= apart_m)
            };
            (round.is_even() && is_far() && round.is_free(world)).then_some(round)
        })
    }

    /// Length \[m\].
    pub(super) fn length_m(&self) -> f64 {
        self.legs()
            .map(|(from_m, to_m)| (to_m - from_m).norm())
            .sum()
    }

    /// The point so far \[m\] from the first corner; a lap on it is the same point.
    pub(super) fn at(&self, way_m: f64) -> Waypoint {
        let mut rest_m = way_m.rem_euclid(self.length_m());
        for (from_m, to_m) in self.legs() {
            let (ahead, length_m) = UnitVector3::new_and_get(to_m - from_m);
            if rest_m < length_m {
                return Waypoint {
                    position_m: from_m + ahead.into_inner() * rest_m,
                    ahead,
                    straight_m: length_m - rest_m,
                };
            }
            rest_m -= length_m;
        }
        // Rounding may leave nothing of the last leg.
        Waypoint {
            straight_m: 0.0,
            ..self.at(0.0)
        }
    }

    fn legs(&self) -> impl Iterator<Item = (Vector3<f64>, Vector3<f64>)> + '_ {
        let next = self.corners_m.iter().cycle().skip(1);
        self.corners_m.iter().copied().zip(next.copied())
    }

    /// Whether lengths and turns are within their bounds.
    fn is_even(&self) -> bool {
        let legs: Vec<_> = self.legs().map(|(from_m, to_m)| to_m - from_m).collect();
        let turn_cos = |k: usize| {
            let (leg, next) = (legs[k], legs[(k + 1) % legs.len()]);
            leg.dot(&next) / (leg.norm() * next.norm())
        };
        legs.iter().all(|leg| leg.norm() >= LEG_M_MIN)
            && LENGTH_M.contains(&self.length_m())
            && (0..legs.len()).all(|k| turn_cos(k) >= TURN_COS_MIN)
    }

    fn is_free(&self, world: &ObstacleWorld) -> bool {
        self.legs().all(|(from_m, to_m)| {
            let (ahead, length_m) = UnitVector3::new_and_get(to_m - from_m);
            world.free_distance_m(&from_m, &ahead, CLEARANCE_M, length_m) >= length_m
        })
    }
}

fn distance_to_leg_m(point_m: &Vector3<f64>, from_m: &Vector3<f64>, to_m: &Vector3<f64>) -> f64 {
    let leg = to_m - from_m;
    let share = ((point_m - from_m).dot(&leg) / leg.norm_squared()).clamp(0.0, 1.0);
    (from_m + leg * share - point_m).norm()
}
