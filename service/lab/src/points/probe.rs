//! How contacts with an object come about.

use nalgebra::{Isometry3, Vector3};
use object_recognition::NextTouch;
use rand::RngExt;
use rand_chacha::ChaCha12Rng;

use super::cloud::Cloud;

/// Length of a step of a walk \[m\].
const STEP_M: f64 = 0.010;
/// Standard deviation of a walk's change of heading per step \[rad\].
const TURN_RAD: f64 = 0.5;
/// A touch along a line feels what lies within this distance of it \[m\]: half a fingertip.
const LINE_M: f64 = 0.004;

/// Where the next contact comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Exploration {
    /// Anywhere on the surface, each independent of the others.
    Independent,
    /// Along a blind random walk on the surface: steps of 10 mm whose heading changes by 0.5 rad
    /// (one standard deviation) from step to step.
    Walk,
    /// Where the recogniser asks for it, after three independent ones.
    Policy,
}

/// A probe upon a cloud's points `held` back from learning.
#[derive(Debug)]
pub(super) struct Probe<'a> {
    cloud: &'a Cloud,
    held: &'a [usize],
    at: Option<usize>,
    heading: Vector3<f64>,
}

impl<'a> Probe<'a> {
    pub(super) fn new(cloud: &'a Cloud, held: &'a [usize]) -> Self {
        Self {
            cloud,
            held,
            at: None,
            heading: Vector3::zeros(),
        }
    }

    /// A point anywhere.
    pub(super) fn anywhere(&mut self, rng: &mut ChaCha12Rng) -> usize {
        let at = self.held[rng.random_range(0..self.held.len())];
        self.at = Some(at);
        at
    }

    /// A step along the walk.
    pub(super) fn step(&mut self, rng: &mut ChaCha12Rng) -> usize {
        let Some(at) = self.at else {
            return self.anywhere(rng);
        };
        let (position, normal) = self.cloud.points[at];
        let level = |v: Vector3<f64>| v - normal.into_inner() * v.dot(&normal);
        let mut random = || rng.random_range(-1.0..1.0);
        let fresh = Vector3::new(random(), random(), random());
        let mut heading = level(self.heading);
        if heading.norm() < 0.1 {
            heading = level(fresh);
        }
        let side = normal.cross(&heading.normalize());
        // The sum of three uniform numbers has variance one.
        let turn = TURN_RAD * (random() + random() + random());
        let heading = heading.normalize() * turn.cos() + side * turn.sin();
        let goal = position + heading * STEP_M;
        let next = self.nearest(|point, n| {
            // Through something thin is no way along the surface.
            let through = if n.dot(&normal) < -0.3 { 1.0 } else { 0.0 };
            let still = if (point - position).norm() < 0.2 * STEP_M {
                1.0
            } else {
                0.0
            };
            (point - goal).norm() + through + still
        });
        let moved = self.cloud.points[next].0 - position;
        // The heading follows the surface, and turns back where it goes on no farther.
        self.heading = if moved.dot(&heading) > 0.0 {
            moved.normalize()
        } else {
            -heading
        };
        self.at = Some(next);
        next
    }

    /// The first point along the line that was asked for, from outside; if nothing lies on it, the
    /// nearest beside it. `object_from_episode` is the truth.
    pub(super) fn asked(
        &mut self,
        next: &NextTouch,
        object_from_episode: &Isometry3<f64>,
    ) -> usize {
        let target = object_from_episode * next.point_m;
        let at = if let Some(approach) = next.approach {
            let along = object_from_episode * approach;
            self.nearest(|point, normal| {
                let apart = point - target;
                let depth = apart.dot(&along);
                let aside = (apart - along.into_inner() * depth).norm();
                let away = if normal.dot(&along) > 0.0 { 10.0 } else { 0.0 };
                // Whatever is on the line comes before whatever is not.
                away + if aside <= LINE_M {
                    -1.0 + 1e-3 * depth
                } else {
                    aside
                }
            })
        } else {
            self.nearest(|point, _| (point - target).norm())
        };
        self.at = Some(at);
        at
    }

    fn nearest(
        &self,
        cost: impl Fn(&nalgebra::Point3<f64>, &nalgebra::Unit<Vector3<f64>>) -> f64,
    ) -> usize {
        let cost = |at: usize| cost(&self.cloud.points[at].0, &self.cloud.points[at].1);
        let costs = self.held.iter().map(|&at| (cost(at), at));
        costs
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .map_or(0, |best| best.1)
    }
}
