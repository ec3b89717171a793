//! How a way was travelled.

use nalgebra::{Isometry3, Vector6};

use crate::input::RememberedTraversals;
use crate::memory::ids::{PlaceId, TripId};
use crate::memory::trip::Leg;
use geometry::se3;
use state::state_of_struct;

/// A way travelled once: what a leg measured of how its places lie.
#[derive(Clone, Debug)]
pub(crate) struct Traversal {
    from: PlaceId,
    to: PlaceId,
    /// Pose of the place of the higher number in the frame of the other one.
    relative: Isometry3<f64>,
    variance: Vector6<f64>,
    duration_s: f64,
    length_m: f64,
    stamp_ns: i64,
    /// The trip and its leg, where it was recorded.
    pub(crate) leg: Option<(TripId, u32)>,
}

impl Traversal {
    /// That of a leg between poses in the frames of its places: `start` in that of the first,
    /// `end` in that of the second.
    ///
    /// ```text
    /// relative = start · leg · end⁻¹        covariance = Ad(end) Σ Ad(end)ᵀ
    /// ```
    pub(crate) fn of(
        leg: &Leg,
        start: &Isometry3<f64>,
        end: &Isometry3<f64>,
        stamp_ns: i64,
    ) -> Self {
        let mut relative = start * leg.relative() * end.inverse();
        relative.rotation.renormalize();
        let mut across = se3::adjoint(end);
        if leg.from() > leg.to() {
            // (M exp(ξ))⁻¹ = M⁻¹ exp(−Ad(M) ξ)
            across = se3::adjoint(&relative) * across;
            relative = relative.inverse();
        }
        let covariance = across * leg.covariance().matrix() * across.transpose();
        Self {
            from: leg.from(),
            to: leg.to(),
            relative,
            variance: covariance.diagonal(),
            duration_s: leg.duration_s(),
            length_m: leg.length_m(),
            stamp_ns,
            leg: None,
        }
    }

    /// Whether it led from the lower to the higher number.
    pub(super) fn is_upward(&self) -> bool {
        self.from < self.to
    }

    /// The places, the lower number first.
    pub(super) fn ends(&self) -> [PlaceId; 2] {
        let (from, to) = (self.from, self.to);
        [from.min(to), from.max(to)]
    }

    pub(super) fn relative(&self) -> &Isometry3<f64> {
        &self.relative
    }

    pub(super) fn variance(&self) -> &Vector6<f64> {
        &self.variance
    }

    pub(super) fn length_m(&self) -> f64 {
        self.length_m
    }
}

/// How a way was travelled in one direction.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Traversals {
    times: u64,
    fastest_s: f64,
    mean_s: f64,
    last_stamp_ns: i64,
    leg: Option<(TripId, u32)>,
}

state_of_struct!(Traversals {
    times,
    fastest_s,
    mean_s,
    last_stamp_ns,
    leg,
});

impl Traversals {
    /// Those of a way that another map has had.
    pub(super) fn remembered(were: &RememberedTraversals) -> Self {
        Self {
            times: were.times,
            fastest_s: were.fastest_s,
            mean_s: were.mean_s,
            last_stamp_ns: were.last_stamp_ns,
            leg: None,
        }
    }

    /// Counts one more.
    pub(super) fn count(&mut self, traversal: &Traversal) {
        let duration_s = traversal.duration_s;
        let is_first = self.times == 0;
        self.times += 1;
        self.mean_s += (duration_s - self.mean_s) / self.times as f64;
        if is_first || duration_s < self.fastest_s {
            self.fastest_s = duration_s;
        }
        // The clocks of two agents may differ, so a later one may carry an earlier stamp.
        if is_first || traversal.stamp_ns > self.last_stamp_ns {
            self.last_stamp_ns = traversal.stamp_ns;
        }
        self.leg = traversal.leg.or(self.leg);
    }

    /// How often.
    pub fn times(&self) -> u64 {
        self.times
    }

    /// Shortest duration \[s\]; `None` where it never was.
    pub fn fastest_s(&self) -> Option<f64> {
        (self.times > 0).then_some(self.fastest_s)
    }

    /// Mean duration \[s\]; `None` where it never was.
    pub fn mean_s(&self) -> Option<f64> {
        (self.times > 0).then_some(self.mean_s)
    }

    /// Latest stamp of an end \[ns\]; `None` where it never was.
    pub fn last_stamp_ns(&self) -> Option<i64> {
        (self.times > 0).then_some(self.last_stamp_ns)
    }

    /// The trip recorded last that led along it, with the number of its leg, counted from 0. The
    /// trip may have been forgotten since.
    pub fn leg(&self) -> Option<(TripId, u32)> {
        self.leg
    }
}

impl Traversal {
    /// One that lasts a second, for tests.
    #[cfg(test)]
    pub(super) fn made(
        from: PlaceId,
        to: PlaceId,
        relative: Isometry3<f64>,
        length_m: f64,
    ) -> Self {
        Self {
            from,
            to,
            relative,
            variance: Vector6::repeat(1e-6),
            duration_s: 1.0,
            length_m,
            stamp_ns: 0,
            leg: None,
        }
    }
}
