//! Gaps of a model of which neighbours tell nothing: between its places may be anything.

use nalgebra::Point3;

use super::graph::LinkGraph;
use super::tuning::{BETWEEN_MIN, EXPLORED_REACH, UNPREDICTED_DEVIATIONS};
use crate::index::nearest_place::NearestPlace;
use crate::tuning::NODE_STEP;

/// The gaps between the places of a model that predicts nothing there.
#[derive(Clone, Debug)]
pub(crate) struct UnpredictedGaps {
    nearest: NearestPlace,
    /// Distance from a place from which on it tells nothing: half a spacing \[m\].
    field_m: f64,
    /// Distance from all places beyond which nothing was explored \[m\].
    reach_m: f64,
}

impl UnpredictedGaps {
    /// Of places that have these links; none where they are dense, or so few that a gap between
    /// two of them would be all there is.
    pub(crate) fn new(felt: &[Point3<f64>], graph: &LinkGraph, spacing_m: f64) -> Option<Self> {
        if felt.len() < BETWEEN_MIN || graph.typical_m <= NODE_STEP * spacing_m {
            return None;
        }
        Some(Self {
            nearest: NearestPlace::new(felt),
            field_m: 0.5 * spacing_m,
            reach_m: EXPLORED_REACH * graph.typical_m,
        })
    }

    /// Whether a point lies in a gap, of which each axis is known with this deviation \[m\].
    pub(crate) fn hold(&self, point: &Point3<f64>, sd_m: f64) -> bool {
        let Some((square, _)) = self.nearest.find(point) else {
            return false;
        };
        let from_m = self.field_m + UNPREDICTED_DEVIATIONS * sd_m;
        (from_m..self.reach_m.max(from_m)).contains(&square.sqrt())
    }
}
