//! Following: how far along its route an agent has come.

use nalgebra::Point3;

use super::{Route, RouteOptions, RouteStep, tuning};
use crate::input::Errand;
use crate::memory::blockage::distance_to_line;
use state::state_of_struct;

/// A route that an agent follows.
#[derive(Clone, Debug)]
pub struct Following {
    pub(crate) errand: Errand,
    /// The session in which it was told to.
    pub(crate) session: u64,
    start: Point3<f64>,
    steps: Vec<RouteStep>,
    /// The step that it is on.
    next: u32,
}

state_of_struct!(Following {
    errand,
    session,
    start,
    steps,
    next,
});

/// What came of a movement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Progress {
    /// The step that the agent is on now; as many as there are where it has arrived.
    pub(crate) next: usize,
    /// How far off the route it is \[m\], where that is too far.
    pub(crate) off_m: Option<f64>,
}

impl Errand {
    /// What a route is to be like.
    pub(crate) fn options(&self) -> RouteOptions {
        RouteOptions {
            cost: self.cost,
            reverse: self.reverse,
            avoid_places: self.avoid_places.iter().copied().collect(),
            avoid_regions: self.avoid_regions.clone(),
            ..RouteOptions::default()
        }
    }
}

impl Following {
    pub(crate) fn new(errand: Errand, session: u64, route: Route) -> Self {
        Self {
            errand,
            session,
            start: route.start,
            steps: route.steps,
            next: 0,
        }
    }

    /// Where the agent is to go, and how.
    pub fn errand(&self) -> &Errand {
        &self.errand
    }

    /// Number of steps that it has gone of this route.
    pub fn steps_done(&self) -> usize {
        self.next as usize
    }

    /// The steps that are left.
    pub fn rest(&self) -> &[RouteStep] {
        self.steps.get(self.next as usize..).unwrap_or_default()
    }

    /// Length of the way that is left from a position on, as the steps were measured \[m\].
    pub fn rest_m(&self, from: &Point3<f64>) -> f64 {
        let rest = self.rest();
        let Some(first) = rest.first() else {
            return 0.0;
        };
        let straight_m = (first.position - from).norm();
        let later = rest[1..].iter().map(|step| step.length_m);
        straight_m.min(first.length_m) + later.sum::<f64>()
    }

    pub(crate) fn is_sound(&self) -> bool {
        self.next as usize <= self.steps.len()
    }

    pub(crate) fn go_on(&mut self, next: usize) {
        self.next = u32::try_from(next).unwrap_or(u32::MAX);
    }

    /// The step that led to a step, if it is not the first.
    pub(crate) fn reached(&self, next: usize) -> Option<&RouteStep> {
        self.steps.get(next.checked_sub(1)?)
    }

    /// How far an agent has come that is at a position; `now_at` says where a step leads now, for
    /// the past may have been relaxed since the route was made. How unsure the agent is does not
    /// count: one that is would arrive long before it is there.
    pub(crate) fn progress(
        &self,
        at: &Point3<f64>,
        field_radius_m: f64,
        now_at: impl Fn(&RouteStep) -> Point3<f64>,
    ) -> Progress {
        let (mut next, count) = (self.next as usize, self.steps.len());
        let within = |next: usize| {
            let step = &self.steps[next];
            (now_at(step) - at).norm() <= tuning::TOLERANCE_PER_FIELD_RADIUS * field_radius_m
        };
        while next < count && within(next) {
            next += 1;
        }
        if next == count {
            return Progress { next, off_m: None };
        }
        let last = count.min(next + tuning::STEPS_AHEAD);
        let off_m = |k: usize| {
            let from = k
                .checked_sub(1)
                .map_or(self.start, |k| now_at(&self.steps[k]));
            self.steps[k].off_m(&from, &now_at(&self.steps[k]), at)
        };
        // The first of the steps ahead on whose way the agent is: routes may cross themselves.
        let on = (next..last).find(|&k| off_m(k) <= field_radius_m);
        if let Some(next) = on {
            return Progress { next, off_m: None };
        }
        let off_m = (next..last).map(off_m).fold(f64::INFINITY, f64::min);
        let leaves = tuning::LEFT_FIELD_RADII * field_radius_m;
        Progress {
            next,
            off_m: (off_m > leaves).then_some(off_m),
        }
    }
}

impl RouteStep {
    /// How far a position is off the way to this step \[m\]. The way may have been as far from the
    /// straight line as its length allows.
    fn off_m(&self, from: &Point3<f64>, to: &Point3<f64>, at: &Point3<f64>) -> f64 {
        let straight_m = (to - from).norm();
        let square = self.length_m * self.length_m - straight_m * straight_m;
        let bulge_m = 0.5 * square.max(0.0).sqrt();
        (distance_to_line(at, from, to) - bulge_m).max(0.0)
    }
}
