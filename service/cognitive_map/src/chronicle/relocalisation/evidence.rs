//! What speaks for a pose: along the way that it gives the agent, everything remembered looks as it should.
//!
//! A look whose pose is right is as far from each remembered view about it as their likeness says. Of the distances near a look
//! (e deviations off, or not alike at all where they should be), half as many as there are count as independent, two at most; each says
//!
//! ```text
//! l = ln((1 − w) exp(G − e²/2) + w)       alike          l = ln w        near, and not alike
//! s = ln((1 − ε) exp(Σ l) + ε)            of a look; 0 where no view is near
//! ```
//!
//! against "somewhere that nobody has seen": views are as like by chance with probability e^−G, a remembered view is a wrong
//! one with probability w, a look with probability ε. Where the map is thin nothing is said, so that a pose does not gain by
//! how well its surroundings are known.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Point3, Vector3};

use super::problem::Problem;
use super::search::Search;
use crate::chronicle::chronicle::Chronicle;
use crate::chronicle::revisit::angle_rad;

/// Probability of a look that has nothing to do with where it was made.
const WRONG: f64 = 0.05;
/// The same of a remembered view.
const STALE: f64 = 0.1;
/// −ln of the probability of being so like by chance.
const CHANCE: f64 = 3.0;
/// Distances of a look that count as independent: every second one, up to so many.
const INDEPENDENT_MAX: f64 = 2.0;
/// Views nearer than this are expected to be alike, in reaches.
const NEAR: f64 = 0.6;
/// How far relaxation may have moved a view since it was seen, for it to be found quickly \[m\].
const DISPLACED_M: f64 = 5.0;
/// How much a look may say for a pose against one that leaves it open.
const OPEN: f64 = 0.5;

/// What each look says for a pose; nothing where no view is near.
pub(super) struct Evidence {
    pub(super) looks: Vec<Option<f64>>,
}

/// Where remembered views lie, as far as that was asked for.
pub(super) struct Positions<'a> {
    chronicle: &'a Chronicle,
    known: BTreeMap<usize, Option<Point3<f64>>>,
}

impl<'a> Positions<'a> {
    pub(super) fn new(chronicle: &'a Chronicle) -> Self {
        Self {
            chronicle,
            known: BTreeMap::new(),
        }
    }

    fn of(&mut self, number: usize) -> Option<Point3<f64>> {
        let chronicle = self.chronicle;
        *self.known.entry(number).or_insert_with(|| {
            let view = chronicle.revisits.views.get(number)?;
            let pose = chronicle.pose_at(view.agent, view.session, view.seq)?;
            Some(pose.translation.vector.into())
        })
    }
}

impl Evidence {
    pub(super) fn of(
        pose: &Isometry3<f64>,
        problem: &Problem,
        search: &Search,
        positions: &mut Positions<'_>,
    ) -> Self {
        let revisits = &positions.chronicle.revisits;
        let way = problem.way(pose);
        let reach_m = problem.reach_m;
        // What lies farther from the way than this is of no interest.
        let (mut low, mut high) = (way[0], way[0]);
        for point in &way {
            low = low.inf(point);
            high = high.sup(point);
        }
        let margin = Vector3::repeat(reach_m);
        let (low, high) = (low - margin, high + margin);
        let mut sums = vec![(0.0, 0.0); way.len()];
        for (number, view) in revisits.views.iter().enumerate() {
            let roughly = view.in_map;
            let is_about = (0..3)
                .all(|k| roughly[k] >= low[k] - DISPLACED_M && roughly[k] <= high[k] + DISPLACED_M);
            if !is_about || search.is_own(view) {
                continue;
            }
            let Some(at) = positions.of(number) else {
                continue;
            };
            for (spot, (point, sum)) in problem.spots.iter().zip(way.iter().zip(&mut sums)) {
                let look = &search.looks[spot.look];
                let distance_m = (at - point).norm();
                if distance_m > reach_m || look.channel != view.channel {
                    continue;
                }
                let likeness =
                    revisits.distance(view.channel, angle_rad(&look.vector, &view.vector));
                let is_near = distance_m <= NEAR * reach_m;
                let says = match likeness {
                    Some(likeness) if is_near || likeness.mean_m <= NEAR * reach_m => {
                        let off =
                            (distance_m - likeness.mean_m) / likeness.sd_m.hypot(spot.drift_m);
                        ((1.0 - STALE) * (CHANCE - 0.5 * off * off).exp() + STALE).ln()
                    }
                    None if is_near => STALE.ln(),
                    _ => continue,
                };
                sum.0 += says;
                sum.1 += 1.0;
            }
        }
        let say = |&(sum, count): &(f64, f64)| {
            let independent = (0.5 + 0.5 * count).min(INDEPENDENT_MAX);
            (count > 0.0).then(|| {
                let like = (independent * sum / count).exp();
                ((1.0 - WRONG) * like + WRONG).ln()
            })
        };
        Self {
            looks: sums.iter().map(say).collect(),
        }
    }

    /// What all looks say for the pose, against somewhere that nobody has seen \[nats\].
    pub(super) fn total(&self) -> f64 {
        self.looks.iter().flatten().sum()
    }

    /// What they say for it against another pose. What only one of the two can be judged by counts little: a room that looks
    /// the same may be known less well.
    pub(super) fn against(&self, other: &Self) -> f64 {
        let say = |(own, other): (&Option<f64>, &Option<f64>)| match (own, other) {
            (Some(own), Some(other)) => own - other,
            (Some(own), None) => own.min(OPEN),
            (None, Some(other)) => -other.min(OPEN),
            (None, None) => 0.0,
        };
        self.looks.iter().zip(&other.looks).map(say).sum()
    }
}
