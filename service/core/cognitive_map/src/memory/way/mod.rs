//! Ways: how one gets from place to place, as the team has gone.

mod bridge;
mod map;
mod removal;
mod traversals;
mod tuning;
mod waypoint;

use nalgebra::{Isometry3, Vector6};

pub(crate) use map::{WayMap, micrometres};
pub(crate) use traversals::Traversal;
pub use traversals::Traversals;
pub(crate) use waypoint::Edge;
pub use waypoint::Waypoint;

use crate::input::RememberedWay;
use crate::memory::ids::PlaceId;
use crate::memory::strength::{Clock, Strength};
use geometry::se3;
use state::state_of_struct;

/// The one way between two places that legs have joined.
///
/// The trips that led along it may have been forgotten. All poses and lengths are those between
/// the places, not between the poses at which agents entered them.
#[derive(Clone, Debug, PartialEq)]
pub struct Way {
    /// The lower number first.
    pub(super) ends: [PlaceId; 2],
    /// The waypoints at these places.
    pub(super) waypoints: [u32; 2],
    /// From the first end to the second, and back.
    pub(super) travelled: [Traversals; 2],
    /// Mean pose of the second place in the frame of the first.
    relative: Isometry3<f64>,
    /// Mean variances of the measurements in that mean \[m², rad²\].
    variance: Vector6<f64>,
    /// Sum of the squared deviations of the measurements from the mean.
    scatter: Vector6<f64>,
    /// Number of measurements in the mean.
    measurements: u32,
    /// Shortest path that was travelled \[m\].
    shortest_m: f64,
    /// Number of the record with the latest traversal.
    last_revision: u64,
    pub(crate) strength: Strength,
    /// How often forgetting has spared it, as a bridge.
    pub(super) spared: u32,
}

state_of_struct!(Way {
    ends,
    waypoints,
    travelled,
    relative,
    variance,
    scatter,
    measurements,
    shortest_m,
    last_revision,
    strength,
    spared,
});

impl Way {
    /// A way that is travelled for the first time, between two waypoints.
    pub(super) fn new(first: &Traversal, waypoints: [u32; 2], now: Clock, revision: u64) -> Self {
        Self {
            ends: first.ends(),
            waypoints,
            travelled: [Traversals::default(), Traversals::default()],
            relative: *first.relative(),
            variance: *first.variance(),
            scatter: Vector6::zeros(),
            measurements: 0,
            shortest_m: f64::INFINITY,
            last_revision: revision,
            strength: Strength::new(now),
            spared: 0,
        }
    }

    /// One that another map has had.
    pub(super) fn remembered(
        was: &RememberedWay,
        waypoints: [u32; 2],
        now: Clock,
        revision: u64,
    ) -> Self {
        Self {
            ends: was.ends,
            waypoints,
            travelled: was.travelled.each_ref().map(Traversals::remembered),
            relative: was.relative,
            variance: was.variance,
            scatter: Vector6::zeros(),
            measurements: was.measurements,
            shortest_m: was.shortest_m,
            last_revision: revision,
            strength: Strength::left(now, was.strength),
            spared: 0,
        }
    }

    /// It was travelled. `places` is the second place's pose in the frame of the first as the map
    /// has it now: a mean from before the past was relaxed begins anew.
    pub(super) fn travel(
        &mut self,
        traversal: &Traversal,
        places: &Isometry3<f64>,
        now: Clock,
        revision: u64,
    ) {
        if self.measurements > 0 {
            self.strength.used(now, 1.0);
            if self.disagrees_with(places) {
                (self.measurements, self.scatter) = (0, Vector6::zeros());
                self.shortest_m = f64::INFINITY;
            }
        }
        self.last_revision = revision;
        self.shortest_m = self.shortest_m.min(traversal.length_m());
        self.measure(traversal.relative(), traversal.variance());
        self.travelled[usize::from(!traversal.is_upward())].count(traversal);
    }

    /// Takes a measurement into the mean (Welford 1962, along the tangent at the mean).
    fn measure(&mut self, relative: &Isometry3<f64>, variance: &Vector6<f64>) {
        self.measurements = (self.measurements + 1).min(tuning::MEASUREMENTS_MAX);
        let share = 1.0 / f64::from(self.measurements);
        if self.measurements == 1 {
            (self.relative, self.variance) = (*relative, *variance);
            return;
        }
        let deviation = se3::twist(&self.relative.inv_mul(relative));
        // Once the count has its bound, what is old fades out of the sum as out of the mean.
        if self.measurements == tuning::MEASUREMENTS_MAX {
            self.scatter *= 1.0 - share;
        }
        self.scatter += deviation.component_mul(&deviation) * (1.0 - share);
        self.relative = se3::plus(&self.relative, &(deviation * share));
        self.variance += (variance - self.variance) * share;
    }

    /// Whether the mean measured pose lies more than five standard deviations from where the places
    /// are, along or about an axis: the past was relaxed since, and the places count.
    pub fn disagrees_with(&self, places: &Isometry3<f64>) -> bool {
        let deviation = se3::twist(&self.relative.inv_mul(places));
        let variance = self.measurement_variance();
        (0..6).any(|k| {
            let noticed = if k < 3 {
                tuning::NOTICED_M
            } else {
                tuning::NOTICED_RAD
            };
            let variance = variance[k] + noticed * noticed;
            deviation[k] * deviation[k] > tuning::DISAGREEMENT_SD.powi(2) * variance
        })
    }

    /// Variances of one measurement along and about the axes of the second place \[m², rad²\]: as
    /// the motion said, or as the measurements scatter, whichever is more.
    pub fn measurement_variance(&self) -> Vector6<f64> {
        let others = f64::from(self.measurements.saturating_sub(1));
        if others < 1.0 {
            return self.variance;
        }
        self.variance.sup(&(self.scatter / others))
    }

    /// The places that it joins, the lower number first.
    pub fn ends(&self) -> [PlaceId; 2] {
        self.ends
    }

    /// The place at its other end.
    pub fn other_end(&self, place: PlaceId) -> PlaceId {
        let [first, second] = self.ends;
        if place == first { second } else { first }
    }

    /// How it was travelled from one of its ends to the other.
    pub fn travelled_from(&self, place: PlaceId) -> &Traversals {
        &self.travelled[usize::from(place != self.ends[0])]
    }

    /// Times that it was travelled in either direction.
    pub fn traversals(&self) -> u64 {
        self.travelled.iter().map(Traversals::times).sum()
    }

    /// Mean measured pose of the second place in the frame of the first: `places` apart, with the
    /// orientations of their founders.
    pub fn relative(&self) -> &Isometry3<f64> {
        &self.relative
    }

    /// Number of measurements in the mean.
    pub fn measurements(&self) -> u32 {
        self.measurements
    }

    /// Variance of the mean position along it, summed over the axes \[m²\].
    pub fn position_variance_m2(&self) -> f64 {
        let variance = self.measurement_variance().fixed_rows::<3>(0).sum();
        variance / f64::from(self.measurements.max(1))
    }

    /// Shortest path that was travelled along it \[m\], from entering one place to entering the
    /// other.
    pub fn shortest_m(&self) -> f64 {
        self.shortest_m
    }

    /// Length of the way between places that lie like this \[m\]: the shortest path that was
    /// travelled, but no less than their distance. Where measurement and places disagree, the
    /// places count.
    pub fn length_m(&self, places: &Isometry3<f64>) -> f64 {
        let distance_m = places.translation.vector.norm();
        if self.disagrees_with(places) || !self.shortest_m.is_finite() {
            distance_m
        } else {
            distance_m.max(self.shortest_m)
        }
    }

    /// Number of the record with the latest traversal.
    pub fn last_revision(&self) -> u64 {
        self.last_revision
    }

    /// Latest stamp of a traversal \[ns\].
    pub fn last_stamp_ns(&self) -> i64 {
        let stamps = self.travelled.iter().filter_map(Traversals::last_stamp_ns);
        stamps.max().unwrap_or(0)
    }
}

#[cfg(test)]
mod tests;
