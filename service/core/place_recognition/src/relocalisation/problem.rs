//! A search as points and ranges.

use nalgebra::{Isometry3, Point3};

use super::positions::Positions;
use super::search::Search;
use crate::appearance::Prior;
use crate::keyframes::Keyframes;
use crate::sequences::ViewMemory;
use crate::tuning::problem as tuning;
use crate::views::SimilarView;

/// The position of a query in the frame of the body at the newest query.
#[derive(Clone, Debug)]
pub(super) struct QueryPoint {
    /// Number of the query.
    pub(super) query: usize,
    pub(super) at: Point3<f64>,
    /// Standard deviation of that, from odometry between the query and the newest one \[m\].
    pub(super) drift_m: f64,
    /// Ranges to similar views.
    pub(super) cues: Vec<RangeCue>,
}

/// The range from a query to a remembered view, by their similarity.
#[derive(Clone, Copy, Debug)]
pub(super) struct RangeCue {
    /// Position of the remembered view in the map.
    pub(super) target: Point3<f64>,
    /// Mean range \[m\].
    pub(super) mean_m: f64,
    pub(super) sd_m: f64,
}

/// All that is known of the pose of an agent.
#[derive(Clone, Debug)]
pub(crate) struct Problem {
    pub(super) points: Vec<QueryPoint>,
    /// Whether the agent and the map move in one plane.
    pub(super) is_planar: bool,
    /// Distance from which on two views are no more similar than any \[m\].
    pub(super) reach_m: f64,
}

impl Problem {
    pub(crate) fn of(
        search: &Search,
        views: &ViewMemory,
        keyframes: &dyn Keyframes,
        positions: &Positions<'_>,
    ) -> Option<Self> {
        let newest = search.queries.last()?;
        let back = newest.in_odom.inverse();
        let points = search
            .queries
            .iter()
            .enumerate()
            .map(|(query, each)| QueryPoint {
                query,
                at: back * Point3::from(each.in_odom.translation.vector),
                drift_m: tuning::ODOMETRY_SHARE * (newest.travelled_m - each.travelled_m),
                cues: each
                    .similar
                    .iter()
                    .filter_map(|similar| RangeCue::of(similar, positions))
                    .collect(),
            });
        let is_planar = keyframes.is_planar(search.agent);
        Some(Self {
            points: points.collect(),
            is_planar,
            reach_m: views.reach_m(newest.channel)?,
        })
    }

    /// A weak prior \[m⁻², rad⁻²\]: a pose lies within some reaches of its seed.
    pub(crate) fn prior(&self) -> Prior {
        let open = Prior::unknown(self.reach_m);
        Prior {
            pose: None,
            information: open,
            open,
        }
    }

    /// The positions of the queries for a pose of the body in the map.
    pub(super) fn way(&self, pose: &Isometry3<f64>) -> Vec<Point3<f64>> {
        self.points.iter().map(|point| pose * point.at).collect()
    }
}

impl RangeCue {
    fn of(similar: &SimilarView, positions: &Positions<'_>) -> Option<Self> {
        Some(Self {
            target: positions.at(similar.sample)?,
            mean_m: similar.distance.mean_m,
            sd_m: similar.distance.sd_m,
        })
    }
}
