//! A set as the car recorded it.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::Isometry3;
use pose_graph::Freedom;

use super::data_set::Victoria;
use crate::mapping::{Landmark, Matches, Measured, Recording, Step};

/// Nanoseconds in a second.
const NS_PER_S: u64 = 1_000_000_000;

impl Victoria {
    /// The set pose by pose, in the order of their numbers, from the origin on. The stamp is the
    /// pose's number in seconds.
    pub fn recording(&self) -> Recording {
        let of_motion = self.odometry.iter().flat_map(|step| [step.from, step.to]);
        let of_sightings = self.sightings.iter().map(|sighting| sighting.pose);
        let ids: BTreeSet<u64> = of_motion.chain(of_sightings).collect();
        let mut steps: Vec<Step> = ids
            .iter()
            .enumerate()
            .map(|(index, id)| Step {
                stamp_ns: i64::try_from(id.saturating_mul(NS_PER_S)).unwrap_or(i64::MAX),
                guess: Isometry3::identity(),
                is_held: index == 0,
                measured: Vec::new(),
            })
            .collect();
        let poses: BTreeMap<u64, usize> = ids.into_iter().zip(0..).collect();
        for odometry in &self.odometry {
            let (from, to) = (poses[&odometry.from], poses[&odometry.to]);
            steps[from.max(to)].measured.push(Measured::Relative {
                from,
                to,
                transform: odometry.motion,
                information: odometry.information,
                is_motion: true,
            });
        }
        let seen: BTreeSet<u64> = self.sightings.iter().map(|s| s.landmark).collect();
        let landmarks: BTreeMap<u64, usize> = seen.into_iter().zip(0..).collect();
        for sighting in &self.sightings {
            let from = poses[&sighting.pose];
            steps[from].measured.push(Measured::Sighting {
                from,
                landmark: landmarks[&sighting.landmark],
                position: sighting.position,
                information: sighting.information,
            });
        }
        Recording {
            freedom: Freedom::Planar,
            steps,
            landmarks: vec![Landmark::default(); landmarks.len()],
            matches: Matches::Measurements,
        }
    }
}
