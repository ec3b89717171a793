//! A set as the car would have sent it.

use std::collections::BTreeMap;

use cogmap_proto::{Relation, Target};
use nalgebra::{Matrix2, Vector2, Vector6};

use super::data_set::{Sighting, Victoria};
use crate::stream::{Stream, motion_noise};

/// Time between two poses \[ns\].
const PERIOD_NS: i64 = 1_000_000_000;
/// Least distance at which a tree has a direction \[m\].
const NEAREST_M: f64 = 0.01;

impl Victoria {
    /// The set in the order of its motion, from the origin on, with the noise that it states. Trees
    /// keep their numbers as names, and are sighted by range and bearing; those seen from a pose
    /// follow the motion that reaches it. The set has no time: poses are a second apart.
    pub fn stream(&self) -> Stream {
        let mut seen: BTreeMap<u64, Vec<&Sighting>> = BTreeMap::new();
        for sighting in &self.sightings {
            seen.entry(sighting.pose).or_default().push(sighting);
        }
        let mut stream = Stream::default();
        let mut look = |stream: &mut Stream, stamp_ns: i64, pose: u64| {
            for sighting in seen.remove(&pose).unwrap_or_default() {
                let target = Target::Landmark(sighting.landmark.to_string());
                stream.sighting(stamp_ns, target, relation(sighting));
            }
        };
        for (odometry, stamp_ns) in self.odometry.iter().zip((1..).map(|k: i64| k * PERIOD_NS)) {
            if stream.reckoned().is_empty() {
                stream.begin(0);
                look(&mut stream, 0, odometry.from);
            }
            let sd = odometry.covariance.diagonal().map(f64::sqrt);
            let noise = motion_noise(&Vector6::new(sd[0], sd[1], 0.0, 0.0, 0.0, sd[2]));
            stream.increment(stamp_ns, &odometry.motion, Some(noise));
            look(&mut stream, stamp_ns, odometry.to);
        }
        stream
    }

    /// Numbers of the poses, in the order of the way: that of each row of
    /// [`Stream::reckoned`].
    pub fn poses(&self) -> impl Iterator<Item = u64> {
        let first = self.odometry.first().map(|motion| motion.from);
        first
            .into_iter()
            .chain(self.odometry.iter().map(|motion| motion.to))
    }
}

/// Distance and direction of a tree, with their standard deviations to first order.
fn relation(sighting: &Sighting) -> Relation {
    let range_m = sighting.position.norm();
    let along = sighting.position.try_normalize(0.0).unwrap_or(Vector2::x());
    let across = Vector2::new(-along.y, along.x);
    let sd = |axis: &Vector2<f64>, covariance: &Matrix2<f64>| axis.dot(&(covariance * axis)).sqrt();
    Relation::RangeBearing {
        range_m,
        azimuth_rad: along.y.atan2(along.x),
        elevation_rad: 0.0,
        range_sd_m: sd(&along, &sighting.covariance),
        bearing_sd_rad: sd(&across, &sighting.covariance) / range_m.max(NEAREST_M),
    }
}
