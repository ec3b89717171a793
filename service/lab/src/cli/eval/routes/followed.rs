//! Routes that are followed.

use std::collections::VecDeque;

use cogmap_client::ApiError;
use cogmap_lab::routes::LocalPlanner;
use cogmap_proto::{
    BlockageRequest, FollowRequest, FollowedRoute, Place, RouteAvoid, RouteCost, RouteEnd,
    RouteReverse,
};
use cognitive_map::{CognitiveMap, PlaceId};
use nalgebra::{Point2, Rotation2};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

use crate::cli::eval::scout::{AGENT, Scout};

/// Steps of a message while a route is followed.
const BATCH_STEPS: u64 = 3;
/// How near the goal one must come \[m\].
const ARRIVED_M: f64 = 0.3;
/// Steps after which a robot that has not arrived is given up.
const STEPS_MAX: u64 = 2000;
/// Steps on a route before ways are blocked.
const UNDERWAY_STEPS: u64 = 30;
/// Messages without progress after which a robot reports that it does not get through.
const STUCK_MESSAGES: usize = 20;
/// What is progress \[m\].
const PROGRESS_M: f64 = 0.1;
/// How often it sets out anew after reports of its own.
const TRIALS: usize = 5;
/// Radius of the ball that a robot reports as blocked \[m\], and for how long \[ns\].
const REPORTED_M: f64 = 0.1;
const REPORTED_NS: i64 = 20_000_000_000;

/// What became of routes that were followed.
#[derive(Debug, Default, Serialize)]
pub(super) struct Followed {
    pub(super) routes: usize,
    /// Within 0.3 m of the goal when the service says that the route is over: as the map has both,
    /// and as the robot truly stands from where the goal's founder truly stood.
    pub(super) arrived: usize,
    pub(super) arrived_in_truth: usize,
    /// Told that no way is left, by the blockages of the experiment alone, as was asked again.
    pub(super) no_way: usize,
    /// Neither.
    pub(super) lost: usize,
    /// Blockages that the robot reported where it did not get through.
    pub(super) reported: usize,
    /// Largest error at the end of a route of the robot's position from where it started, and of
    /// the nearest place from the robot \[m\].
    pub(super) pose_off_m: f64,
    pub(super) place_off_m: f64,
}

/// One route that is followed.
#[derive(Default)]
struct Errand {
    planner: LocalPlanner,
    /// Rests of the route that were left with the latest messages \[m\].
    rests_m: VecDeque<f64>,
    /// Its reports that may still hold, and how many it has made.
    reports: Vec<u64>,
    reported: usize,
}

/// Lets the robot follow a route to a random place, and drives it.
pub(super) fn follow(
    scout: &mut Scout<'_>,
    map: &CognitiveMap,
    blocked: f64,
    random: &mut ChaCha8Rng,
    told: &mut Followed,
) -> anyhow::Result<()> {
    let places: Vec<_> = map.places().map(|(id, _)| id).collect();
    let goal = places[random.random_range(0..places.len())];
    let request = FollowRequest {
        to: RouteEnd::Place(goal.0.into()),
        cost: RouteCost::Length,
        reverse: RouteReverse::Allowed,
        avoid: RouteAvoid::default(),
    };
    told.routes += 1;
    let mut errand = Errand::default();
    let first = scout.robot.steps();
    let mut blockages = Vec::new();
    let mut is_over = false;
    for _ in 0..TRIALS {
        is_over = match scout.api.follow_route(scout.space, AGENT, &request) {
            Ok(_) => false,
            Err(ApiError::Problem(problem)) if problem.status == 409 => true,
            Err(error) => return Err(error.into()),
        };
        while !is_over && scout.robot.steps() < first + STEPS_MAX {
            let is_underway = scout.robot.steps() > first + UNDERWAY_STEPS;
            if blocked > 0.0 && blockages.is_empty() && is_underway {
                blockages = block(scout, map, blocked, random)?;
            }
            is_over = errand.drive(scout)?;
        }
        // What it reported may be why no way is left: it looks again.
        if errand.withdraw(scout) == 0 {
            break;
        }
    }
    told.reported += errand.reported;
    told.count(scout, goal, is_over)?;
    for blockage in blockages {
        // Somebody may have travelled there.
        let _ = scout.api.unblock(scout.space, blockage);
    }
    Ok(())
}

impl Followed {
    /// Counts what came of a route.
    fn count(&mut self, scout: &Scout<'_>, goal: PlaceId, is_over: bool) -> anyhow::Result<()> {
        let (at, truly_at) = (scout.estimate()?.0, scout.robot.position());
        let places = scout.api.places(scout.space)?;
        // How a place lies from the robot, as the map has both and in truth.
        let from_robot = |place: &Place| {
            let [x, y, _] = place.translation_m;
            let truly = scout.robot.was_at(place.first_stamp_ns)?;
            Some((Point2::new(x, y) - at, truly - truly_at))
        };
        let known = places.iter().find(|place| place.id == u64::from(goal.0));
        let (told_m, true_m) = known
            .and_then(from_robot)
            .map_or((f64::INFINITY, f64::INFINITY), |(told, truly)| {
                (told.norm(), truly.norm())
            });
        let offsets = places.iter().filter_map(from_robot);
        let nearest = offsets.min_by(|a, b| a.0.norm().total_cmp(&b.0.norm()));
        let drift_m = nearest.map_or(0.0, |(told, truly)| (told - truly).norm());
        self.place_off_m = self.place_off_m.max(drift_m);
        let started_at = scout.robot.started_at();
        let pose_off_m = ((truly_at - started_at) - at.coords).norm();
        self.pose_off_m = self.pose_off_m.max(pose_off_m);
        let arrived = is_over && told_m <= ARRIVED_M;
        self.arrived += usize::from(arrived);
        self.arrived_in_truth += usize::from(arrived && true_m <= ARRIVED_M);
        if !arrived {
            let is_cut_off = is_over && scout.is_cut_off(goal)?;
            self.no_way += usize::from(is_cut_off);
            self.lost += usize::from(!is_cut_off);
        }
        Ok(())
    }
}

/// Blocks a share of the ways.
fn block(
    scout: &Scout<'_>,
    map: &CognitiveMap,
    share: f64,
    random: &mut ChaCha8Rng,
) -> anyhow::Result<Vec<u64>> {
    let mut blockages = Vec::new();
    for way in map.ways() {
        if random.random::<f64>() < share {
            let [from, to] = way.ends().map(|end| Some(u64::from(end.0)));
            let request = BlockageRequest {
                from,
                to,
                ..BlockageRequest::default()
            };
            blockages.push(scout.api.block(scout.space, &request)?.id);
        }
    }
    Ok(blockages)
}

impl Errand {
    /// Goes some steps of the route by what the service says of it and the feelers say of the
    /// floor; answers whether it is over.
    fn drive(&mut self, scout: &mut Scout<'_>) -> anyhow::Result<bool> {
        let route = match scout.api.followed_route(scout.space, AGENT) {
            Ok(route) => route,
            Err(ApiError::Problem(problem)) if problem.status == 404 => return Ok(true),
            Err(error) => return Err(error.into()),
        };
        let Some(step) = route.steps.first() else {
            return Ok(true);
        };
        let (at, heading_rad) = scout.estimate()?;
        let target = Point2::new(step.translation_m[0], step.translation_m[1]);
        self.report_if_stuck(scout, &route, &target, (at - target).norm())?;
        let mut to = Rotation2::new(-heading_rad) * (target - at);
        for _ in 0..BATCH_STEPS {
            // In the robot's frame after the step, by what it meant to do.
            let (turn_rad, length_m) = self.planner.step(&mut scout.robot, &scout.floor, &to);
            to = Rotation2::new(-turn_rad) * to;
            to.x -= length_m;
            if to.norm() < PROGRESS_M {
                break;
            }
        }
        scout.send()?;
        Ok(false)
    }

    /// Reports a blockage where the rest of the route has not become shorter for long.
    fn report_if_stuck(
        &mut self,
        scout: &Scout<'_>,
        route: &FollowedRoute,
        target: &Point2<f64>,
        to_target_m: f64,
    ) -> anyhow::Result<()> {
        let later = route.steps.iter().skip(1).map(|step| step.length_m);
        let rest_m = to_target_m + later.sum::<f64>();
        self.rests_m.push_back(rest_m);
        if self.rests_m.len() <= STUCK_MESSAGES {
            return Ok(());
        }
        let before_m = self.rests_m.pop_front().unwrap_or(rest_m);
        let least_m = self.rests_m.iter().copied().fold(f64::INFINITY, f64::min);
        if before_m - least_m >= PROGRESS_M {
            return Ok(());
        }
        self.rests_m.clear();
        self.reported += 1;
        let request = BlockageRequest {
            at_m: Some([target.x, target.y, 0.0]),
            radius_m: Some(REPORTED_M),
            until_ns: Some(scout.robot.stamp_ns() + REPORTED_NS),
            ..BlockageRequest::default()
        };
        let blockage = scout.api.block(scout.space, &request)?;
        self.reports.push(blockage.id);
        Ok(())
    }

    /// Withdraws its reports; answers how many there were.
    fn withdraw(&mut self, scout: &Scout<'_>) -> usize {
        for report in &self.reports {
            // Its time may have come before.
            let _ = scout.api.unblock(scout.space, *report);
        }
        std::mem::take(&mut self.reports).len()
    }
}
