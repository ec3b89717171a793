//! A robot on a floor whose samples go to a service.

use anyhow::Context;
use cogmap_client::{Api, ApiError};
use cogmap_lab::routes::{Floor, PlanarRobot};
use cogmap_proto::{
    RouteAvoid, RouteCost, RouteEnd, RouteFormat, RouteQuery, RouteReverse, SampleBatch,
};
use cognitive_map::PlaceId;
use nalgebra::{Point2, Vector2};
use rand_chacha::ChaCha8Rng;

/// Its name.
pub(super) const AGENT: &str = "scout";
/// Steps of a message while the floor is explored.
const BATCH_STEPS: u64 = 100;

/// The robot.
pub(super) struct Scout<'a> {
    pub(super) api: &'a Api,
    pub(super) space: &'static str,
    pub(super) floor: Floor,
    pub(super) robot: PlanarRobot,
    seq: u64,
}

impl<'a> Scout<'a> {
    /// A robot at a position of a floor.
    pub(super) fn new(
        api: &'a Api,
        space: &'static str,
        floor: Floor,
        start: Point2<f64>,
        seed: u64,
    ) -> Self {
        Self {
            api,
            space,
            floor,
            robot: PlanarRobot::new(start, seed),
            seq: 0,
        }
    }

    /// Length of the route between two places \[m\].
    pub(super) fn route(&self, from: PlaceId, to: PlaceId) -> Result<f64, ApiError> {
        self.length_m(RouteEnd::Place(from.0.into()), to)
    }

    /// Whether no way leads from where it is to a place.
    pub(super) fn is_cut_off(&self, to: PlaceId) -> Result<bool, ApiError> {
        match self.length_m(RouteEnd::Agent(AGENT.to_owned()), to) {
            Ok(_) => Ok(false),
            Err(ApiError::Problem(problem)) if problem.status == 409 => Ok(true),
            Err(error) => Err(error),
        }
    }

    fn length_m(&self, from: RouteEnd, to: PlaceId) -> Result<f64, ApiError> {
        let query = RouteQuery {
            from,
            to: RouteEnd::Place(to.0.into()),
            cost: RouteCost::Length,
            reverse: RouteReverse::Allowed,
            avoid: RouteAvoid::default(),
            shortcuts: false,
            body_radius_m: None,
            alternatives: 0,
            format: RouteFormat::Steps,
            spacing_m: None,
        };
        Ok(self.api.route(self.space, &query)?.length_m)
    }

    /// Goes from one random position to the next.
    pub(super) fn explore(&mut self, steps: u64, random: &mut ChaCha8Rng) -> anyhow::Result<()> {
        while self.robot.steps() < steps {
            let goal = self.floor.any_free(random);
            self.go_to(&goal)?;
        }
        self.send()
    }

    /// Goes to a position by the plan of the floor, and sends now and then.
    pub(super) fn go_to(&mut self, goal: &Point2<f64>) -> anyhow::Result<()> {
        for point in self.floor.path(&self.robot.position(), goal) {
            while (point - self.robot.position()).norm() > 1e-6 {
                let to = point - self.robot.position();
                let turn_rad = turn_to(self.robot.heading_rad(), &to);
                // Beside the points the way to them may be cut off by a corner.
                if !self.robot.step(&self.floor, turn_rad, to.norm()) {
                    break;
                }
                if self.robot.steps().is_multiple_of(BATCH_STEPS) {
                    self.send()?;
                }
            }
        }
        Ok(())
    }

    /// Samples that were sent.
    pub(super) fn sent(&self) -> u64 {
        self.seq
    }

    pub(super) fn send(&mut self) -> anyhow::Result<()> {
        let samples = self.robot.take();
        let count = samples.len() as u64;
        if count > 0 {
            let batch = SampleBatch {
                session: 1,
                first_seq: self.seq,
                samples,
            };
            self.api.post_samples(self.space, AGENT, &batch)?;
            self.seq += count;
        }
        Ok(())
    }

    /// Where the service has the robot, and which way it faces \[rad\].
    pub(super) fn estimate(&self) -> anyhow::Result<(Point2<f64>, f64)> {
        let estimate = self.api.agent(self.space, AGENT)?.estimate;
        let estimate = estimate.context("an agent with samples has an estimate")?;
        let [x, y, _] = estimate.translation_m;
        let [_, _, sine, cosine] = estimate.rotation_xyzw;
        Ok((Point2::new(x, y), 2.0 * sine.atan2(cosine)))
    }
}

/// The turn after which one faces along a vector \[rad\].
fn turn_to(heading_rad: f64, to: &Vector2<f64>) -> f64 {
    let turn_rad = to.y.atan2(to.x) - heading_rad;
    turn_rad.sin().atan2(turn_rad.cos())
}
