//! Places: where the team has been.

mod code_search;
mod index;
mod map;
mod summary;

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};

pub use crate::memory::ids::PlaceId;
pub(crate) use map::PlaceMap;

use crate::input::{AgentId, RememberedPlace};
use crate::memory::ids::TripId;
use crate::memory::strength::{Clock, Strength};

use grid::{GridCode, GridModules};
use state::state_of_struct;

/// What a place has to move for it to be noted \[m, rad\].
const NOTICED: (f64, f64) = (0.01, 0.01);

/// A place cell.
///
/// Its grid code follows from its position and is not stored: a place takes about 170 bytes, its
/// entry in the spatial index included; recall by code needs no other.
#[derive(Clone, Debug, PartialEq)]
pub struct Place {
    position: Point3<f64>,
    rotation: UnitQuaternion<f64>,
    position_sd_m: Vector3<f64>,
    visits: u64,
    first_stamp_ns: i64,
    last_stamp_ns: i64,
    founder: AgentId,
    /// The first trip with a leg from or to here, or a later one if that has been forgotten.
    pub(crate) trip: Option<TripId>,
    /// By what it goes with the past of its founder.
    pub(crate) attachment: Option<u32>,
    pub(crate) strength: Strength,
}

state_of_struct!(Place {
    position,
    rotation,
    position_sd_m,
    visits,
    first_stamp_ns,
    last_stamp_ns,
    founder,
    trip,
    attachment,
    strength,
});

impl Place {
    /// A place that `founder` has just recruited where it is.
    pub(crate) fn found(
        position: Point3<f64>,
        rotation: UnitQuaternion<f64>,
        position_sd_m: Vector3<f64>,
        founder: AgentId,
        stamp_ns: i64,
        now: Clock,
    ) -> Self {
        Self {
            position,
            rotation,
            position_sd_m,
            visits: 1,
            first_stamp_ns: stamp_ns,
            last_stamp_ns: stamp_ns,
            founder,
            trip: None,
            attachment: None,
            strength: Strength::new(now),
        }
    }

    /// One that another map has had.
    pub(crate) fn remembered(was: &RememberedPlace, now: Clock) -> Self {
        Self {
            position: was.pose.translation.vector.into(),
            rotation: was.pose.rotation,
            position_sd_m: was.position_sd_m,
            visits: was.visits,
            first_stamp_ns: was.first_stamp_ns,
            last_stamp_ns: was.last_stamp_ns,
            founder: was.founder,
            trip: None,
            attachment: None,
            strength: Strength::left(now, was.strength),
        }
    }

    /// An agent came here.
    pub(crate) fn visit(&mut self, stamp_ns: i64, now: Clock) {
        self.visits += 1;
        self.strength.used(now, 1.0);
        // The clocks of two agents may differ, so a later visit may carry an earlier stamp.
        self.last_stamp_ns = self.last_stamp_ns.max(stamp_ns);
    }

    /// Whether what lies at a pose has moved noticeably when it lies at another.
    pub(crate) fn is_moved(from: &Isometry3<f64>, to: &Isometry3<f64>) -> bool {
        let way = to.translation.vector - from.translation.vector;
        way.norm_squared() >= NOTICED.0 * NOTICED.0
            || from.rotation.angle_to(&to.rotation) >= NOTICED.1
    }

    /// The place where it turned out to lie; none where that makes no difference.
    fn moved(&self, at: &Isometry3<f64>) -> Option<Self> {
        Self::is_moved(&self.pose(), at).then(|| Self {
            position: at.translation.vector.into(),
            rotation: UnitQuaternion::new_normalize(at.rotation.into_inner()),
            ..self.clone()
        })
    }

    /// Position in `map` \[m\]: where its founder was, by what is known of its way since.
    pub fn position(&self) -> &Point3<f64> {
        &self.position
    }

    /// Orientation of the founder at the founding, in `map`, likewise.
    pub fn rotation(&self) -> &UnitQuaternion<f64> {
        &self.rotation
    }

    /// Pose in `map`: position and orientation.
    pub(crate) fn pose(&self) -> Isometry3<f64> {
        Isometry3::from_parts(self.position.into(), self.rotation)
    }

    /// Standard deviation of the position at the founding, along the axes of `map` \[m\].
    pub fn position_sd_m(&self) -> &Vector3<f64> {
        &self.position_sd_m
    }

    /// Times an agent came here, the founding included.
    pub fn visits(&self) -> u64 {
        self.visits
    }

    /// The agent that founded it.
    pub fn founder(&self) -> AgentId {
        self.founder
    }

    /// Stamp of the founding \[ns\].
    pub fn first_stamp_ns(&self) -> i64 {
        self.first_stamp_ns
    }

    /// Latest stamp of a visit \[ns\].
    pub fn last_stamp_ns(&self) -> i64 {
        self.last_stamp_ns
    }

    /// Its grid code.
    pub fn code(&self, modules: &GridModules) -> GridCode {
        modules.code_at(&self.position)
    }
}

/// Confidence of a place at a distance, in \[0, 1\]; one half at a field radius.
///
/// ```text
/// confidence = 2^(−(d / field_radius)²)
/// ```
///
/// This is seed Eq. 8 with σ = `field_radius / √(2 ln 2)`, in a form that is exact at one half.
pub(crate) fn confidence(distance_m: f64, field_radius_m: f64) -> f64 {
    (-(distance_m / field_radius_m).powi(2)).exp2()
}

#[cfg(test)]
mod tests {
    use super::*;
    use grid::similarity::gaussian_confidence;

    #[test]
    fn confidence_is_the_seeds_gaussian() {
        let sigma_m = 0.25 / (2.0 * std::f64::consts::LN_2).sqrt();
        for distance_m in [0.0, 1e-9, 0.1, 0.25, 0.5, 3.0] {
            let expected = gaussian_confidence(distance_m, sigma_m);
            assert!((confidence(distance_m, 0.25) - expected).abs() < 1e-15);
        }
        assert!((confidence(0.25, 0.25) - 0.5).abs() < f64::MIN_POSITIVE);
    }
}
