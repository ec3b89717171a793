//! Recall by grid code: the places whose codes are most like the cue's.

use super::Asked;
use super::best::Best;
use crate::memory::ids::PlaceId;
use crate::memory::place::{Place, confidence};
use grid::similarity::CodeCue;
use grid::{PartialCode, Search};

/// How much the terms of the known modules may together lack of their number while a search is
/// worth trying. At one and more a module may be wholly wrong, and the search has no bound.
const DEFICIT_MAX: f64 = 0.9;
/// Steps of a search over and above one for every [`PLACES_PER_STEP`] places. One takes about as
/// long as comparing one place, so a search that is given up adds a little to the scan that
/// follows.
const STEPS_MIN: u64 = 400;
/// See [`STEPS_MIN`].
const PLACES_PER_STEP: u64 = 8;
/// Up to this many places a scan is quicker.
const SCAN_MAX: usize = 16;
/// Longer answers are gathered from all places at once.
const RANKED_MAX: usize = 64;
/// Another place answers nearly as well when its cosine is at most this much lower. With a phase
/// noise of 5 % (0.05 turns along each axis) the right place's own cosine varies by about this
/// much.
const NEARLY: f64 = 0.05;

/// The places elsewhere that answer nearly as well as the best one: more than a field radius from
/// it, with a cosine at most 0.05 lower.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rivals {
    /// How many there are, one at least.
    pub count: usize,
    /// The best of them, of equally good ones that with the lowest identifier.
    pub place: PlaceId,
    /// Its cosine.
    pub cosine: f64,
    /// Its distance from the best place \[m\].
    pub distance_m: f64,
}

/// A cue's code and what it is put to.
pub(super) struct CodeRecall<'a> {
    pub(super) cue: CodeCue<'a>,
    code: &'a PartialCode,
    asked: &'a Asked<'a>,
}

impl<'a> CodeRecall<'a> {
    /// A code of the cue that is asked.
    pub(super) fn new(asked: &'a Asked<'a>, code: &'a PartialCode) -> Self {
        Self {
            cue: CodeCue::new(asked.modules, code),
            code,
            asked,
        }
    }

    /// The most similar places, as many as asked for, in order, with their cosines.
    ///
    /// The answer is that of a scan over all places, to the last bit. A search looks only where the
    /// code says that a place may be, but leaves out nothing that can be in the answer: it visits
    /// every place whose cosine is at least that of the last place of the answer so far, and at
    /// least a floor. If the answer is then full, all others are worse than its last place; if it
    /// is not, a scan follows.
    pub(super) fn best(&self) -> Vec<(PlaceId, f64)> {
        let limit = self.asked.cue.limit;
        let places = self.asked.places.len();
        if limit == 0 {
            return Vec::new();
        }
        if limit > RANKED_MAX {
            return self.best_of_all();
        }
        let mut best = Best::new(limit);
        let floor = 1.0 - DEFICIT_MAX / self.cue.known() as f64;
        let searched = places > SCAN_MAX
            && limit < places
            && self.search(floor, |place, id| {
                let least = best.least(floor);
                if let Some(cosine) = self.cosine(place, least) {
                    best.offer(id, cosine);
                }
                best.least(floor)
            });
        if !(searched && best.is_full()) {
            for (id, place) in self.asked.places.iter() {
                // Places that the search has found come again, and stay once.
                if let Some(cosine) = self.cosine(place, best.least(0.0)) {
                    best.offer(id, cosine);
                }
            }
        }
        best.into_ranked()
    }

    /// The places elsewhere that are nearly as similar as `best` with its cosine.
    pub(super) fn rivals(&self, best: PlaceId, cosine: f64) -> Option<Rivals> {
        let here = *self.asked.places.get(best)?.position();
        let least = cosine - NEARLY;
        let mut rivals: Vec<(PlaceId, f64)> = Vec::new();
        let note = |rivals: &mut Vec<(PlaceId, f64)>, id: PlaceId, place: &Place| {
            let distance_m = (place.position() - here).norm();
            if distance_m > self.asked.settings.field_radius_m
                && let Some(cosine) = self.cosine(place, least)
            {
                rivals.push((id, cosine));
            }
        };
        let searched = self.search(least, |place, id| {
            note(&mut rivals, id, place);
            least
        });
        if !searched {
            rivals.clear();
            for (id, place) in self.asked.places.iter() {
                note(&mut rivals, id, place);
            }
        }
        rivals.sort_unstable_by_key(|(id, _)| *id);
        rivals.dedup_by_key(|(id, _)| *id);
        let (place, cosine) = rivals.iter().copied().reduce(|best, other| {
            // In order of identifier, so the first of equals stays.
            if other.1 > best.1 { other } else { best }
        })?;
        Some(Rivals {
            count: rivals.len(),
            place,
            cosine,
            distance_m: (self.asked.places.get(place)?.position() - here).norm(),
        })
    }

    /// Confidence of a similarity: that of the distance at which two codes are on average so
    /// similar.
    pub(super) fn confidence(&self, cosine: f64) -> f64 {
        let field_radius_m = self.asked.settings.field_radius_m;
        // Beyond five field radii the confidence is below 1e-7: as good as none.
        let far_m = 5.0 * field_radius_m;
        let distance_m = self.cue.mean_distance_m(cosine, far_m);
        if distance_m < far_m {
            confidence(distance_m, field_radius_m)
        } else {
            0.0
        }
    }

    /// Calls `visit` with every place whose cosine is `least` or more, and with some others,
    /// perhaps more than once. `visit` returns the least cosine that is of interest from then on.
    /// False when not all were visited, as that would have been more work than a scan.
    pub(super) fn search(&self, least: f64, mut visit: impl FnMut(&Place, PlaceId) -> f64) -> bool {
        if self.cue.known() as f64 * (1.0 - least) > DEFICIT_MAX + 1e-9 {
            return false;
        }
        let Some(tolerance) = self.cue.tolerance(least) else {
            return false;
        };
        let places = self.asked.places;
        let steps_max = STEPS_MIN + places.len() as u64 / PLACES_PER_STEP;
        let mut left = (least, tolerance);
        let search = places.matching(self.asked.modules, self.code, tolerance, steps_max, |id| {
            if let Some(place) = places.get(id) {
                let least = visit(place, id);
                if least > left.0 {
                    left = (least, self.cue.tolerance(least).unwrap_or(left.1));
                }
            }
            left.1
        });
        search == Search::Complete
    }

    /// Similarity of the cue and a place, if the place passes the filters and it is `least` or
    /// more.
    fn cosine(&self, place: &Place, least: f64) -> Option<f64> {
        if self.asked.admits(place) {
            self.cue.kernel_at(place.position(), least)
        } else {
            None
        }
    }

    /// [`CodeRecall::best`] by comparing and ranking everything.
    fn best_of_all(&self) -> Vec<(PlaceId, f64)> {
        let all = self.asked.places.iter();
        let scored = all.filter_map(|(id, place)| Some((id, self.cosine(place, 0.0)?)));
        self.asked.best(scored.collect(), |a, b| b.total_cmp(a))
    }
}
