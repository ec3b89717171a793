//! Recall by a percept, alone or together with a position and a code.

use std::cmp::Ordering;

use crate::memory::ids::PlaceId;
use crate::memory::place::confidence;
use grid::PartialCode;
use grid::similarity::CodeCue;

use super::by_code::CodeRecall;
use super::{Asked, RecallCue, Recalled};

/// How well a place answers.
struct Fit {
    confidence: f64,
    matching: f64,
    distance_m: Option<f64>,
    cosine: Option<f64>,
}

impl Asked<'_> {
    /// How many of the percept's best matches decide the answer; unknown where the best by the
    /// percept alone may be left out, or beaten by others.
    pub(super) fn few_by_percept(&self) -> Option<usize> {
        let RecallCue {
            position: None,
            code: None,
            founder: None,
            since_ns: None,
            until_ns: None,
            limit,
            ..
        } = self.cue
        else {
            return None;
        };
        Some(*limit)
    }

    /// Of the places that remember something of the percept's channel, ranked by the product of all
    /// confidences, and where they have faded to nothing by how well the percept fits, then by
    /// distance. `matches` are those places and how well it fits each of them.
    pub(super) fn by_percept(&self, mut matches: Vec<(PlaceId, f64)>) -> Vec<Recalled> {
        let cue = self.cue;
        // Looking at every place costs as much as the search among descriptors itself.
        if cue.founder.is_some() || cue.since_ns.is_some() || cue.until_ns.is_some() {
            matches.retain(|&(place, _)| self.passes(place));
        }
        if cue.position.is_none() && cue.code.is_none() {
            matches = self.best(matches, |a, b| b.total_cmp(a));
        }
        let code = cue.code.as_ref().map(|code| CodeRecall::new(self, code));
        let fits = matches.into_iter().filter_map(|(place, matching)| {
            Some((place, self.fit(place, matching, code.as_ref())?))
        });
        let ranked = self.best(fits.collect(), better);
        let here = cue
            .position
            .map(|position| PartialCode::from(&self.modules.code_at(&position)));
        let here = here.as_ref().map(|code| CodeCue::new(self.modules, code));
        let recalled = ranked.into_iter().map(|(place, fit)| Recalled {
            place,
            cosine: fit.cosine.or_else(|| self.kernel(here.as_ref()?, place)),
            confidence: Some(fit.confidence),
            distance_m: fit.distance_m,
            percept_match: Some(fit.matching),
        });
        recalled.collect()
    }

    /// How well a place answers the whole cue; none if it lies beyond the radius.
    fn fit(&self, place: PlaceId, matching: f64, code: Option<&CodeRecall<'_>>) -> Option<Fit> {
        // A descriptor that points away speaks against the place, no more than an unrelated one.
        let mut product = matching.max(0.0);
        let mut distance_m = None;
        if let Some(position) = &self.cue.position {
            let squared = (self.places.get(place)?.position() - position).norm_squared();
            if self
                .cue
                .radius_m
                .is_some_and(|radius_m| squared > radius_m * radius_m)
            {
                return None;
            }
            let distance = squared.sqrt();
            product *= confidence(distance, self.settings.field_radius_m);
            distance_m = Some(distance);
        }
        let mut cosine = None;
        if let Some(code) = code {
            let kernel = self.kernel(&code.cue, place)?;
            product *= code.confidence(kernel);
            cosine = Some(kernel);
        }
        Some(Fit {
            confidence: product,
            matching,
            distance_m,
            cosine,
        })
    }
}

/// The better fit first.
fn better(a: &Fit, b: &Fit) -> Ordering {
    let distance_m = |fit: &Fit| fit.distance_m.unwrap_or(0.0);
    b.confidence
        .total_cmp(&a.confidence)
        .then_with(|| b.matching.total_cmp(&a.matching))
        .then_with(|| distance_m(a).total_cmp(&distance_m(b)))
}
