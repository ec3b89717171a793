//! Recall: which places answer a cue.

mod best;
mod by_code;
mod by_percept;
#[cfg(test)]
mod tests;

use std::cmp::Ordering;

use nalgebra::Point3;

use crate::input::AgentId;
use crate::memory::ids::PlaceId;
use crate::memory::percept::{PerceptCue, PerceptMap};
use crate::memory::place::{Place, PlaceMap, confidence};
use crate::settings::Settings;
use grid::similarity::CodeCue;
use grid::{GridModules, PartialCode};

use by_code::CodeRecall;
pub use by_code::Rivals;

/// Balls around a position in which its nearest places are sought before all places are looked at,
/// in reaches of a place.
const BALLS: [f64; 3] = [1.0, 2.0, 3.5];

/// What to recall places by. `position`, `code` and `percept` rank the places; the other fields
/// filter.
///
/// The answer is exact, but for a descriptor alone among more than 10⁵ of its channel, which asks
/// their sketches first. Its cost is as follows, where n is the number of places.
///
/// - By `position`: free of n when the places asked for lie within seven field radii, else O(n).
/// - By `code`: free of n when the least similar place of the answer is still much like the cue, so
///   that few positions of the world could be meant: the terms of the known modules may together
///   lack 0.9, which with six known modules is a cosine of 0.85. Else O(n): for a `limit` of many
///   places, a code of nowhere, or very few modules.
/// - By a percept: O(n), for a descriptor in the time of one pass over the descriptors of its
///   channel, or of one over their sketches where there are more than 10⁵.
/// - By several, or by none: O(n).
#[derive(Clone, Debug, PartialEq)]
pub struct RecallCue {
    /// A position in `map` \[m\].
    pub position: Option<Point3<f64>>,
    /// A grid code, perhaps with erased modules.
    pub code: Option<PartialCode>,
    /// A percept: only places that remember something of its channel answer.
    pub percept: Option<PerceptCue>,
    /// Only places within this distance of `position` \[m\]; without a position it has no effect.
    pub radius_m: Option<f64>,
    /// Only places that this agent founded.
    pub founder: Option<AgentId>,
    /// Only places visited at or after this stamp \[ns\].
    pub since_ns: Option<i64>,
    /// Only places founded before this stamp \[ns\].
    pub until_ns: Option<i64>,
    /// Most places in the answer.
    pub limit: usize,
}

/// A place and how well it answers the cue.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Recalled {
    /// The place.
    pub place: PlaceId,
    /// Cosine of the cue's and the place's population activation, in the limit of many cells (seed
    /// Eq. 5); `None` without a cue. The cue's code is `code`, or else the code of `position`.
    pub cosine: Option<f64>,
    /// Confidence, in \[0, 1\] (seed Eq. 8); `None` without a cue. By position it follows from the
    /// distance; by code from the distance at which two codes are on average as similar as the cue
    /// and the place's code; by a percept it is `percept_match`, at least 0; by several the
    /// product.
    pub confidence: Option<f64>,
    /// Distance from `position` \[m\]; `None` without it.
    pub distance_m: Option<f64>,
    /// How well the percept fits what the place remembers; `None` without one. For a descriptor the
    /// cosine. For a level its likelihood: the density of a normal distribution with the place's
    /// mean and deviation, as a part of the highest density that there could be on the channel.
    pub percept_match: Option<f64>,
}

/// The places that answer a cue, best first, equally good ones by identifier.
///
/// By position the nearest come first, by code the most similar. By both the confidences are
/// multiplied, as those of two independent witnesses, and so it is with a percept, by which only
/// places answer that remember something of its channel. Without a cue the place visited last comes
/// first.
pub(crate) fn recall(
    cue: &RecallCue,
    places: &PlaceMap,
    percepts: &PerceptMap,
    modules: &GridModules,
    settings: &Settings,
) -> Vec<Recalled> {
    let asked = Asked {
        cue,
        places,
        modules,
        settings,
    };
    if let Some(percept) = &cue.percept {
        return asked.by_percept(percepts.matches(percept, asked.few_by_percept()));
    }
    match (&cue.position, &cue.code) {
        (Some(position), None) => asked.by_position(position),
        (None, Some(code)) => asked.by_code(code),
        (Some(position), Some(code)) => asked.by_both(position, code),
        (None, None) => asked.latest(),
    }
}

/// The places elsewhere that answer a cue with a code nearly as well as its best answer does.
/// Exact.
///
/// `None` when there is no such place, no code in the cue, or a position or a percept in it, which
/// settles what a code leaves open.
pub(crate) fn rivals(
    cue: &RecallCue,
    best: &Recalled,
    places: &PlaceMap,
    modules: &GridModules,
    settings: &Settings,
) -> Option<Rivals> {
    let asked = Asked {
        cue,
        places,
        modules,
        settings,
    };
    let (None, None, Some(code)) = (&cue.position, &cue.percept, &cue.code) else {
        return None;
    };
    CodeRecall::new(&asked, code).rivals(best.place, best.cosine?)
}

/// A cue and what it is put to.
struct Asked<'a> {
    cue: &'a RecallCue,
    places: &'a PlaceMap,
    modules: &'a GridModules,
    settings: &'a Settings,
}

impl Asked<'_> {
    /// Ranked by distance.
    fn by_position(&self, position: &Point3<f64>) -> Vec<Recalled> {
        let ranked = self.best(self.nearest(position), f64::total_cmp);
        let code = PartialCode::from(&self.modules.code_at(position));
        let code = CodeCue::new(self.modules, &code);
        let recalled = ranked.into_iter().map(|(place, distance_m)| Recalled {
            place,
            cosine: self.kernel(&code, place),
            confidence: Some(confidence(distance_m, self.settings.field_radius_m)),
            distance_m: Some(distance_m),
            percept_match: None,
        });
        recalled.collect()
    }

    /// Ranked by the codes' similarity.
    fn by_code(&self, code: &PartialCode) -> Vec<Recalled> {
        let code = CodeRecall::new(self, code);
        let recalled = code.best().into_iter().map(|(place, cosine)| Recalled {
            place,
            cosine: Some(cosine),
            confidence: Some(code.confidence(cosine)),
            distance_m: None,
            percept_match: None,
        });
        recalled.collect()
    }

    /// Ranked by the product of both confidences, and where both have faded to nothing by distance.
    fn by_both(&self, position: &Point3<f64>, code: &PartialCode) -> Vec<Recalled> {
        let by_code = CodeRecall::new(self, code);
        let near = self
            .with_distances(position)
            .into_iter()
            .filter_map(|(place, distance_m)| {
                let cosine = self.kernel(&by_code.cue, place)?;
                let by_distance = confidence(distance_m, self.settings.field_radius_m);
                let confidence = by_distance * by_code.confidence(cosine);
                Some((place, (confidence, distance_m, cosine)))
            });
        let ranked = self.best(near.collect(), |a, b| {
            b.0.total_cmp(&a.0).then_with(|| a.1.total_cmp(&b.1))
        });
        let recalled = ranked
            .into_iter()
            .map(|(place, (confidence, distance_m, cosine))| Recalled {
                place,
                cosine: Some(cosine),
                confidence: Some(confidence),
                distance_m: Some(distance_m),
                percept_match: None,
            });
        recalled.collect()
    }

    /// The latest first.
    fn latest(&self) -> Vec<Recalled> {
        let stamped = self
            .all()
            .filter_map(|id| Some((id, self.places.get(id)?.last_stamp_ns())));
        let ranked = self.best(stamped.collect(), |a, b| b.cmp(a));
        let recalled = ranked.into_iter().map(|(place, _)| Recalled {
            place,
            cosine: None,
            confidence: None,
            distance_m: None,
            percept_match: None,
        });
        recalled.collect()
    }

    /// The places that pass the filters.
    fn all(&self) -> impl Iterator<Item = PlaceId> {
        self.places.ids().filter(|&id| self.passes(id))
    }

    /// The places that pass the filters, the radius among them, with their distances \[m\].
    fn with_distances(&self, position: &Point3<f64>) -> Vec<(PlaceId, f64)> {
        let mut near = self
            .places
            .within(position, self.cue.radius_m.unwrap_or(f64::INFINITY));
        near.retain(|&(id, _)| self.passes(id));
        near
    }

    /// The places that pass the filters with their distances \[m\], the nearest ones at least, as
    /// many as the answer may hold.
    fn nearest(&self, position: &Point3<f64>) -> Vec<(PlaceId, f64)> {
        let radius_m = self.cue.radius_m.unwrap_or(f64::INFINITY);
        for reaches in BALLS {
            let ball_m = reaches * self.places.reach_m();
            if ball_m >= radius_m {
                break;
            }
            let mut near = self.places.within(position, ball_m);
            near.retain(|&(id, _)| self.passes(id));
            if near.len() >= self.cue.limit {
                return near; // whatever is not in the ball is farther away
            }
        }
        self.with_distances(position)
    }

    /// Whether a place passes the filters on founder and time.
    fn passes(&self, place: PlaceId) -> bool {
        self.places
            .get(place)
            .is_some_and(|place| self.admits(place))
    }

    /// Whether a place passes the filters on founder and time.
    fn admits(&self, place: &Place) -> bool {
        let RecallCue {
            founder,
            since_ns,
            until_ns,
            ..
        } = self.cue;
        founder.is_none_or(|founder| place.founder() == founder)
            && since_ns.is_none_or(|since| place.last_stamp_ns() >= since)
            && until_ns.is_none_or(|until| place.first_stamp_ns() < until)
    }

    /// The best places, as many as asked for, in order; equal scores by identifier.
    fn best<S>(
        &self,
        mut scored: Vec<(PlaceId, S)>,
        compare: impl Fn(&S, &S) -> Ordering,
    ) -> Vec<(PlaceId, S)> {
        let order =
            |a: &(PlaceId, S), b: &(PlaceId, S)| compare(&a.1, &b.1).then_with(|| a.0.cmp(&b.0));
        let limit = self.cue.limit;
        if 0 < limit && limit < scored.len() {
            // Linear in the number of places; only the answer is sorted.
            scored.select_nth_unstable_by(limit - 1, order);
        }
        scored.truncate(limit);
        scored.sort_unstable_by(order);
        scored
    }

    /// Similarity of a code and a place's code.
    fn kernel(&self, code: &CodeCue<'_>, place: PlaceId) -> Option<f64> {
        code.kernel_at(self.places.get(place)?.position(), 0.0)
    }
}
