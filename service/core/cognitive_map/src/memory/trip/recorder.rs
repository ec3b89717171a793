//! What an agent keeps of the trip under way.

use crate::memory::ids::{PlaceId, TripId};
use nalgebra::{Isometry3, Point3, Vector6};

use super::Leg;
use geometry::MotionSum;
use state::state_of_struct;

/// The trip and the leg under way.
#[derive(Clone, Debug, Default)]
pub(crate) struct Recorder {
    /// The trip, once its first leg is complete.
    pub(crate) trip: Option<TripId>,
    /// The leg, once a place has been met.
    pub(crate) leg: Option<LegUnderWay>,
}

/// A leg that has a start and no end yet.
#[derive(Clone, Debug)]
pub(crate) struct LegUnderWay {
    from: PlaceId,
    start_stamp_ns: i64,
    /// Position in `map` at the start.
    start_in_map: Point3<f64>,
    /// Pose at the start in the frame of the place there.
    start_in_place: Isometry3<f64>,
    /// The motion since the start.
    motion: MotionSum,
    length_m: f64,
}

state_of_struct!(Recorder { trip, leg });
state_of_struct!(LegUnderWay {
    from,
    start_stamp_ns,
    start_in_map,
    start_in_place,
    motion,
    length_m,
});

impl LegUnderWay {
    /// A leg that starts at a place that lies at `place`, with the agent's present pose.
    pub(crate) fn start(
        from: PlaceId,
        place: &Isometry3<f64>,
        stamp_ns: i64,
        in_map: &Isometry3<f64>,
    ) -> Self {
        Self {
            from,
            start_stamp_ns: stamp_ns,
            start_in_map: in_map.translation.vector.into(),
            start_in_place: place.inv_mul(in_map),
            motion: MotionSum::default(),
            length_m: 0.0,
        }
    }

    /// The place at the start.
    pub(crate) fn from(&self) -> PlaceId {
        self.from
    }

    /// Pose at the start in the frame of the place there, as both were then.
    pub(crate) fn start_in_place(&self) -> &Isometry3<f64> {
        &self.start_in_place
    }

    /// Length of the path so far \[m\].
    pub(crate) fn length_m(&self) -> f64 {
        self.length_m
    }

    /// Stamp of the start \[ns\].
    pub(crate) fn start_stamp_ns(&self) -> i64 {
        self.start_stamp_ns
    }

    /// The agent moved, with noise of these variances.
    ///
    /// The covariance could also be had from the agent's covariances at both ends, but as a small
    /// difference of two numbers that grow without bound.
    pub(crate) fn extend(&mut self, increment: &Isometry3<f64>, variance: &Vector6<f64>) {
        self.motion.append(increment, variance);
        self.length_m += increment.translation.vector.norm();
    }

    /// The leg, now that the next place is reached.
    pub(crate) fn finish(&self, to: PlaceId, stamp_ns: i64, in_map: &Isometry3<f64>) -> Leg {
        Leg {
            from: self.from,
            to,
            relative: *self.motion.motion(),
            covariance: self.motion.covariance(),
            displacement: in_map.translation.vector - self.start_in_map.coords,
            duration_s: interval_s(self.start_stamp_ns, stamp_ns),
            length_m: self.length_m,
        }
    }
}

/// Time from one stamp to another \[s\]; zero when the clock ran backwards.
pub(crate) fn interval_s(from_ns: i64, to_ns: i64) -> f64 {
    to_ns.saturating_sub(from_ns).max(0) as f64 * 1e-9
}
