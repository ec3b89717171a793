//! What an agent's latest record announced: where it is, its grid state, and its latest movements.

use nalgebra::{Isometry3, Vector3};

use crate::estimator::Evidence;
use grid::{GridModules, GridState};
use state::state_of_struct;

/// The estimate of an agent as of its latest record, and the grid state that goes with it.
///
/// The estimator owns the estimate, and goes on correcting it with the samples of other agents.
/// Grid state, events, trips and answers follow these copies: the agent's next record brings them
/// up to date, with an event for whatever has changed, so that each change has a record of the
/// agent that it belongs to.
#[derive(Clone, Debug)]
pub(crate) struct Announced {
    /// Whether the agent is in the map.
    placed: bool,
    /// Pose by motion alone since the session began.
    pub(super) in_odom: Isometry3<f64>,
    /// Pose in `map`.
    pub(super) in_map: Isometry3<f64>,
    pub(super) grid: GridState,
    /// The session's latest movement, along the axes of `map` \[m\].
    pub(super) latest: Option<Vector3<f64>>,
    /// The movement before it.
    pub(super) before_latest: Option<Vector3<f64>>,
    pub(super) travelled_m: f64,
    /// Sum of its turns, whichever way \[rad\].
    turned_rad: f64,
    /// Samples that were lost.
    lost: u64,
    /// What became of its sightings.
    evidence: Evidence,
}

state_of_struct!(Announced {
    placed,
    in_odom,
    in_map,
    grid,
    latest,
    before_latest,
    travelled_m,
    turned_rad,
    lost,
    evidence,
});

impl Announced {
    /// Of a new agent: at identity, in no map.
    pub(crate) fn new(modules: &GridModules) -> Self {
        let in_map = Isometry3::identity();
        Self {
            placed: false,
            in_odom: Isometry3::identity(),
            in_map,
            grid: modules.locate(&in_map.translation.vector.into()),
            latest: None,
            before_latest: None,
            travelled_m: 0.0,
            turned_rad: 0.0,
            lost: 0,
            evidence: Evidence::default(),
        }
    }

    /// Whether the agent is in the map.
    pub(crate) fn placed(&self) -> bool {
        self.placed
    }

    /// What became of its sightings.
    pub(crate) fn evidence(&self) -> &Evidence {
        &self.evidence
    }

    /// Pose in `map`.
    pub(crate) fn in_map(&self) -> &Isometry3<f64> {
        &self.in_map
    }

    /// Whether the grid state has as many modules as the space.
    pub(crate) fn fits(&self, modules: &GridModules) -> bool {
        self.grid.modules().len() == modules.lattices().len()
    }

    /// Moves the agent to where odometry has it now, after a path of `path_m` by odometry and a
    /// displacement along the axes of its frame by the estimate. Calls `entered` with each grid
    /// module that came into a new lattice cell.
    ///
    /// The cost depends neither on the path so far nor on the places known.
    pub(crate) fn step(
        &mut self,
        in_odom: &Isometry3<f64>,
        path_m: f64,
        displacement: &Vector3<f64>,
        modules: &GridModules,
        entered: impl FnMut(usize, [i64; 3]),
    ) {
        self.turned_rad += self.in_odom.rotation.angle_to(&in_odom.rotation);
        self.in_odom = *in_odom;
        // The grid moves by the displacement, not by a difference of positions, which far away from
        // the origin would have lost digits.
        self.in_map.translation.vector += displacement;
        self.grid.advance(modules, displacement, entered);
        if path_m > 0.0 {
            self.before_latest = self.latest.replace(*displacement);
            self.travelled_m += path_m;
        }
    }

    /// Goes to where the estimate has the agent now, and the grid with it. Without a correction
    /// since the latest step the position is the same to the last bit.
    pub(crate) fn follow(
        &mut self,
        pose: &Isometry3<f64>,
        evidence: Option<&Evidence>,
        modules: &GridModules,
        entered: impl FnMut(usize, [i64; 3]),
    ) {
        let correction = pose.translation.vector - self.in_map.translation.vector;
        self.in_map = *pose;
        if correction != Vector3::zeros() {
            self.grid.advance(modules, &correction, entered);
        }
        self.evidence = evidence.copied().unwrap_or(self.evidence);
    }

    /// Puts the agent where it turned out to be, without a way there.
    pub(crate) fn place(&mut self, pose: &Isometry3<f64>, modules: &GridModules) {
        self.in_map = *pose;
        self.grid = modules.locate(&self.in_map.translation.vector.into());
    }

    /// The agent is in the map from now on, or in it no more.
    pub(crate) fn set_placed(&mut self, placed: bool) {
        self.placed = placed;
    }

    /// Starts a session where the one before ended.
    pub(crate) fn restart(&mut self) {
        self.in_odom = Isometry3::identity();
        self.latest = None;
        self.before_latest = None;
        self.travelled_m = 0.0;
        self.turned_rad = 0.0;
        self.lost = 0;
    }

    /// So many samples are lost, after `before` of its session. Answers how far it goes and turns
    /// with as many on average \[m, rad\].
    pub(crate) fn lose(&mut self, samples: u64, before: u64) -> (f64, f64) {
        let came = before.saturating_sub(self.lost).max(1);
        self.lost = self.lost.saturating_add(samples);
        let part = samples as f64 / came as f64;
        (self.travelled_m * part, self.turned_rad * part)
    }
}
