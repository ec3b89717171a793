//! An agent's body: its pose as of its latest record, its grid state, and its latest movements.

use nalgebra::{Isometry3, Vector3};

use grid::{GridModules, GridState};
use state::state_of_struct;

/// Poses as of the agent's latest record, and the grid state that goes with them.
///
/// The estimator holds the poses and goes on correcting them with the samples of other agents; the
/// agent's next record brings these copies up to date. Grid state and events follow the copies.
#[derive(Clone, Debug)]
pub(crate) struct Body {
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
}

state_of_struct!(Body {
    in_odom,
    in_map,
    grid,
    latest,
    before_latest,
    travelled_m,
});

impl Body {
    /// A body at identity.
    pub(crate) fn new(modules: &GridModules) -> Self {
        let in_map = Isometry3::identity();
        Self {
            in_odom: Isometry3::identity(),
            in_map,
            grid: modules.locate(&in_map.translation.vector.into()),
            latest: None,
            before_latest: None,
            travelled_m: 0.0,
        }
    }

    /// Pose in `map`.
    pub(crate) fn in_map(&self) -> &Isometry3<f64> {
        &self.in_map
    }

    /// Whether the grid state has as many modules as the space.
    pub(crate) fn fits(&self, modules: &GridModules) -> bool {
        self.grid.modules().len() == modules.lattices().len()
    }

    /// Moves the body to where odometry has it now, after a path of `path_m` by odometry and a
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

    /// Goes to where the estimate has the body now, and the grid with it. Without a correction
    /// since the latest step the position is the same to the last bit.
    pub(crate) fn follow(
        &mut self,
        pose: &Isometry3<f64>,
        modules: &GridModules,
        entered: impl FnMut(usize, [i64; 3]),
    ) {
        let correction = pose.translation.vector - self.in_map.translation.vector;
        self.in_map = *pose;
        if correction != Vector3::zeros() {
            self.grid.advance(modules, &correction, entered);
        }
    }

    /// Puts the body where it turned out to stand.
    pub(crate) fn place(&mut self, pose: &Isometry3<f64>, modules: &GridModules) {
        self.in_map = *pose;
        self.grid = modules.locate(&self.in_map.translation.vector.into());
    }

    /// Starts a session where the one before ended.
    pub(crate) fn restart(&mut self) {
        self.in_odom = Isometry3::identity();
        self.latest = None;
        self.before_latest = None;
        self.travelled_m = 0.0;
    }
}
