//! An agent that does not know where it is sees something.

use geometry::PoseCovariance;
use nalgebra::Isometry3;

use super::PlaceRecognition;
use crate::keyframes::{Keyframes, SampleKey};
use crate::relocalisation::{Candidate, Search, candidates, turn_sd_rad};
use crate::view::View;

/// Motion between two looks \[m, rad\].
pub(super) const MOVED: (f64, f64) = (0.05, 0.2);
/// Looks after which poses are sought anew, before and after the agent was found.
const FRESH: (u32, u32) = (2, 3);
/// One that is not found for long asks more rarely: after so many looks it waits for one more each time.
const PATIENCE: usize = 12;
/// Looks that there must be.
const LOOKS_MIN: usize = 6;
/// Odds at which a pose is believed: one wrong claim in a thousand [nats].
const SURE: f64 = 6.9;
/// Deviation of the heading from which on an agent is not put anywhere \[rad\].
const HEADING_SD_MAX_RAD: f64 = 0.3;
/// Deviation of the heading up to which the agent goes on looking around after it was found, so that its way does not lead it
/// astray \[rad\].
const HEADING_SD_RAD: f64 = 0.02;
/// Way after which it stops that in any case \[m\].
const ON_M: f64 = 5.0;
/// How much less surely look by look than by all looks at once a place may be known: where that is little, the map is thin, and
/// what all looks at once say rests upon what the map leaves open.
const ROUGHLY: f64 = 2.0;
/// How far all looks at once may be off what is expected, in squares, 1 on average: beyond that the map contradicts them, or itself.
const WIDER_MAX: f64 = 2.0;
/// Guesses that are told.
const GUESSES_MAX: usize = 8;

/// Where an agent turned out to be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Relocalised {
    /// Of the body in the map.
    pub pose: Isometry3<f64>,
    /// Of the error on its right.
    pub covariance: PoseCovariance,
    /// Whether it was not known before.
    pub is_first: bool,
    /// Whether that is all: the agent goes on by itself.
    pub is_last: bool,
}

/// Where an agent may be that does not know where it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Guess {
    /// Of the body in the map, at its latest look.
    pub pose: Isometry3<f64>,
    /// Of the error on its right.
    pub covariance: PoseCovariance,
    /// Its share of the evidence, all other guesses and "somewhere that nobody has seen" included.
    pub probability: f64,
    /// Looks that can be judged by what is remembered there.
    pub queries: u32,
}

impl PlaceRecognition {
    /// An agent that does not know where it is saw something. Answers where it is, once that is known to better than `sd_max_m`.
    pub fn seek(
        &mut self,
        view: &View<'_>,
        sd_max_m: f64,
        keyframes: &dyn Keyframes,
    ) -> Option<Relocalised> {
        let number = self.search_of(view.sample);
        let revision = self.revision;
        let channel = self.views.known_channel(view)?;
        let search = self.searches.get_mut(number, revision)?;
        let has_moved = search.queries.last().is_none_or(|last| {
            let way = last.in_odom.inv_mul(&view.in_odom);
            !geometry::is_within(&way, MOVED.0, MOVED.1)
        });
        if !has_moved {
            return None;
        }
        search.catch_up(&self.views);
        let alike = self
            .views
            .likes(channel, view.vector, 0, |stored| search.is_own(stored));
        search.push(view.in_odom, channel, view.vector, alike);
        let queries = search.queries.len();
        let fresh = if search.found_m.is_some() {
            FRESH.1
        } else {
            FRESH
                .0
                .max(u32::try_from(queries / PATIENCE).unwrap_or(u32::MAX))
        };
        if search.fresh < fresh || queries < LOOKS_MIN {
            return None;
        }
        search.fresh = 0;
        let search = self.searches.get(number)?;
        let places = candidates(search, &self.views, keyframes);
        let best = places.first()?;
        let views = (self.views.stored.len() as f64).max(1.0);
        let is_sure = best.evidence.total() >= SURE + views.ln()
            && places[1..]
                .iter()
                .all(|other| best.evidence.against(&other.evidence) >= SURE);
        let covariance = PoseCovariance::from_matrix(&best.covariance);
        let turn_sd_rad = turn_sd_rad(&best.covariance);
        // To one that was found, an answer from where the map is thin still says something.
        let is_rough = search.found_m.is_none()
            && (best.rough_sd_m > ROUGHLY * sd_max_m || turn_sd_rad > HEADING_SD_MAX_RAD);
        let is_known =
            covariance.position_sd_m() <= sd_max_m && best.wider <= WIDER_MAX && !is_rough;
        if !is_sure || !is_known {
            return None;
        }
        let pose = best.mean;
        let way_m = search.queries.last().map_or(0.0, |query| query.travelled_m);
        let search = self.searches.get_mut(number, revision)?;
        let is_first = search.found_m.is_none();
        let found_m = *search.found_m.get_or_insert(way_m);
        Some(Relocalised {
            pose,
            covariance,
            is_first,
            is_last: turn_sd_rad <= HEADING_SD_RAD || way_m - found_m >= ON_M,
        })
    }

    /// Whether an agent still looks around to find out how it is turned.
    pub fn is_seeking(&self, agent: u32, session: u32) -> bool {
        let number = self.search_number(agent);
        let search = number.and_then(|number| self.searches.get(number));
        search.is_some_and(|search| {
            let is_found = search.found_m.is_some();
            is_found && !search.is_over(ON_M) && search.session == session
        })
    }

    /// The remembered sample that the latest queries of an agent are most like, if any; `None` for an
    /// agent without a search.
    pub fn most_similar(&self, agent: u32) -> Option<Option<SampleKey>> {
        let search = self.searches.get(self.search_number(agent)?)?;
        let mut newest = search.queries.iter().rev().flat_map(|query| &query.alike);
        Some(newest.next().map(|similar| similar.sample))
    }

    /// An agent knows where it is, or begins anew: what it has looked for is over.
    pub fn end_search(&mut self, agent: u32) {
        let revision = self.revision;
        if let Some(number) = self.search_number(agent)
            && let Some(search) = self.searches.get_mut(number, revision)
            && !search.queries.is_empty()
        {
            search.queries.clear();
            search.found_m = None;
            search.fresh = 0;
        }
    }

    /// Where an agent may be that searches, the most probable first.
    pub fn guesses(&self, agent: u32, keyframes: &dyn Keyframes) -> Vec<Guess> {
        let search = self
            .search_number(agent)
            .and_then(|number| self.searches.get(number));
        let Some(search) = search.filter(|search| !search.queries.is_empty()) else {
            return Vec::new();
        };
        let places = candidates(search, &self.views, keyframes);
        let Some(best) = places.first() else {
            return Vec::new();
        };
        let views = (self.views.stored.len() as f64).max(1.0);
        let weight = |place: &Candidate| (-best.evidence.against(&place.evidence)).exp();
        // Against somewhere that nobody has seen, as likely as any place before something was seen.
        let nowhere = (views.ln() - best.evidence.total()).exp();
        let whole: f64 = places.iter().map(weight).sum::<f64>() + nowhere;
        places
            .iter()
            .take(GUESSES_MAX)
            .map(|place| Guess {
                pose: place.mean,
                covariance: PoseCovariance::from_matrix(&place.covariance),
                probability: weight(place) / whole,
                queries: u32::try_from(place.evidence.queries.iter().flatten().count())
                    .unwrap_or(u32::MAX),
            })
            .collect()
    }

    /// The number of the search of an agent in its present session; a new one if it has none.
    pub(super) fn search_of(&mut self, sample: SampleKey) -> usize {
        let fresh = Search::new(sample);
        let revision = self.revision;
        let Some(number) = self.search_number(sample.agent) else {
            self.searches.push(fresh, revision);
            return self.searches.len() - 1;
        };
        if let Some(search) = self.searches.get_mut(number, revision)
            && (search.session != sample.session
                || search.queries.is_empty()
                || search.is_over(ON_M))
        {
            *search = fresh;
        }
        number
    }

    pub(super) fn search_number(&self, agent: u32) -> Option<usize> {
        self.searches
            .iter()
            .position(|search| search.agent == agent)
    }
}
