//! Path integration: where motion has brought a body.

use nalgebra::{Isometry3, Vector3, Vector6};

use crate::geometry::PoseCovariance;
use crate::grid::{GridModules, GridState};
use crate::sample::{Motion, StartPose};
use crate::settings::Settings;
use crate::state::state_of_struct;

/// What a restart between two sessions adds to the uncertainty of a pose: 1 m and 0.5 rad about
/// each axis. A robot usually restarts where it stopped, but nobody knows.
const RESTART_SD: [f64; 6] = [1.0, 1.0, 1.0, 0.5, 0.5, 0.5];

/// Poses, their uncertainty, and the grid state that goes with them.
#[derive(Clone, Debug)]
pub(crate) struct Body {
    /// Pose by motion alone since the session began.
    pub(super) in_odom: Isometry3<f64>,
    /// Pose in `map`.
    pub(super) in_map: Isometry3<f64>,
    /// Covariance of the pose in `map`.
    pub(super) covariance: PoseCovariance,
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
    covariance,
    grid,
    latest,
    before_latest,
    travelled_m,
});

/// A step that a body has taken.
#[derive(Debug)]
pub(crate) struct Step {
    /// Length of its path \[m\].
    pub(crate) path_m: f64,
    /// Standard deviations of its noise.
    pub(crate) noise_sd: Vector6<f64>,
}

impl Body {
    /// A body at identity, without any uncertainty.
    pub(crate) fn new(modules: &GridModules) -> Self {
        let in_map = Isometry3::identity();
        Self {
            in_odom: Isometry3::identity(),
            in_map,
            covariance: PoseCovariance::zero(),
            grid: modules.locate(&in_map.translation.vector.into()),
            latest: None,
            before_latest: None,
            travelled_m: 0.0,
        }
    }

    /// Pose in `odom`.
    pub(crate) fn in_odom(&self) -> &Isometry3<f64> {
        &self.in_odom
    }

    /// Pose in `map`.
    pub(crate) fn in_map(&self) -> &Isometry3<f64> {
        &self.in_map
    }

    /// Covariance of the pose in `map`.
    pub(crate) fn covariance(&self) -> &PoseCovariance {
        &self.covariance
    }

    /// Whether the grid state has as many modules as the space.
    pub(crate) fn fits(&self, modules: &GridModules) -> bool {
        self.grid.modules().len() == modules.lattices().len()
    }

    /// Moves the body, and calls `entered` with each grid module that came into a new lattice cell.
    ///
    /// Costs the same whatever the path so far and the places known.
    pub(crate) fn step(
        &mut self,
        motion: &Motion,
        settings: &Settings,
        modules: &GridModules,
        entered: impl FnMut(usize, [i64; 3]),
    ) -> Step {
        let increment = motion.increment();
        let path_m = increment.translation.vector.norm();
        let noise_sd = match motion.noise() {
            Some(noise) => *noise.sd(),
            None => odometry_noise_sd(increment, path_m, settings),
        };
        let displacement = append(&mut self.in_map, increment);
        append(&mut self.in_odom, increment);
        self.covariance = self.covariance.after_motion(increment, &noise_sd);
        // The grid moves by the displacement, not by a difference of positions, which far away from
        // the origin would have lost digits.
        self.grid.advance(modules, &displacement, entered);
        if path_m > 0.0 {
            self.before_latest = self.latest.replace(displacement);
            self.travelled_m += path_m;
        }
        Step { path_m, noise_sd }
    }

    /// The body after a motion that begins at a pose known without error: its covariance is that of
    /// the motion alone.
    pub(crate) fn after(
        &self,
        motion: &Motion,
        settings: &Settings,
        modules: &GridModules,
    ) -> Self {
        let mut body = self.clone();
        body.covariance = PoseCovariance::zero();
        body.step(motion, settings, modules, |_, _| {});
        body
    }

    /// Puts the body where it was told that it stands.
    pub(crate) fn place(&mut self, start: &StartPose, modules: &GridModules) {
        self.in_map = *start.pose();
        self.covariance = PoseCovariance::from_sd(start.noise().sd());
        self.grid = modules.locate(&self.in_map.translation.vector.into());
    }

    /// Starts a session where the one before ended.
    pub(crate) fn restart(&mut self) {
        self.in_odom = Isometry3::identity();
        self.covariance.inflate(&RESTART_SD.into());
        self.latest = None;
        self.before_latest = None;
        self.travelled_m = 0.0;
    }
}

/// Moves a pose by an increment in its own frame; answers the displacement along the outer axes.
fn append(pose: &mut Isometry3<f64>, increment: &Isometry3<f64>) -> Vector3<f64> {
    let displacement = pose.rotation * increment.translation.vector;
    pose.translation.vector += displacement;
    pose.rotation *= increment.rotation;
    // One Newton step: products of unit quaternions leave the unit sphere by rounding alone.
    pose.rotation.renormalize_fast();
    displacement
}

/// The noise of motion that carries none: a random walk in translation and rotation.
///
/// ```text
/// σ_t² = s_t² · path      σ_r² = r_m² · path + r_rad² · angle
/// ```
fn odometry_noise_sd(increment: &Isometry3<f64>, path_m: f64, settings: &Settings) -> Vector6<f64> {
    let angle_rad = increment.rotation.angle();
    let translation = settings.translation_sd_per_sqrt_m * path_m.sqrt();
    let rotation = (settings.rotation_sd_per_sqrt_m.powi(2) * path_m
        + settings.rotation_sd_per_sqrt_rad.powi(2) * angle_rad)
        .sqrt();
    Vector6::new(
        translation,
        translation,
        translation,
        rotation,
        rotation,
        rotation,
    )
}
