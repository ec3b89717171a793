//! Relocalisation of an agent that does not know where it is.

use geometry::PoseCovariance;
use nalgebra::Isometry3;

use super::PlaceRecognition;
use crate::keyframes::{Keyframes, SampleKey};
use crate::relocalisation::{Candidate, Search, candidates, turn_sd_rad};
use crate::tuning::relocalise as tuning;
use crate::view::View;

/// The pose of an agent that was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Relocalised {
    /// Pose of the body in the map.
    pub pose: Isometry3<f64>,
    /// Covariance of the error on its right.
    pub covariance: PoseCovariance,
    /// Whether the agent had not been found before.
    pub is_first: bool,
    /// Whether the search ends with this.
    pub is_last: bool,
}

/// A pose where an agent may be that does not know where it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Guess {
    /// Pose of the body in the map at its latest query.
    pub pose: Isometry3<f64>,
    /// Covariance of the error on its right.
    pub covariance: PoseCovariance,
    /// Posterior probability, with all other guesses and "a place that nobody has seen" as
    /// alternatives.
    pub probability: f64,
    /// Number of queries that can be judged there.
    pub queries: u32,
}

impl PlaceRecognition {
    /// A view of an agent that does not know where it is. Answers its pose, once that is known to
    /// better than `sd_max_m`.
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
        let last = search.queries.last();
        if last.is_some_and(|last| last.is_beside(&view.in_odom)) {
            return None;
        }
        search.catch_up(&self.views);
        let similar = self
            .views
            .similar_views(channel, view.vector, 0, |stored| search.is_own(stored));
        search.push(view.in_odom, channel, view.vector, similar);
        let queries = search.queries.len();
        let fresh = if search.found_m.is_some() {
            tuning::FRESH.1
        } else {
            tuning::FRESH
                .0
                .max(u32::try_from(queries / tuning::PATIENCE).unwrap_or(u32::MAX))
        };
        if search.fresh < fresh || queries < tuning::QUERIES_MIN {
            return None;
        }
        search.fresh = 0;
        let search = self.searches.get(number)?;
        let places = candidates(search, &self.views, keyframes);
        let best = places.first()?;
        let views = (self.views.stored.len() as f64).max(1.0);
        let is_sure = best.evidence.total() >= tuning::SURE + views.ln()
            && places[1..]
                .iter()
                .all(|other| best.evidence.against(&other.evidence) >= tuning::SURE);
        let covariance = PoseCovariance::from_matrix(&best.covariance);
        let turn_sd_rad = turn_sd_rad(&best.covariance);
        // After the agent was found, an answer where the map is thin is still useful.
        let is_rough = search.found_m.is_none()
            && (best.rough_sd_m > tuning::ROUGHLY * sd_max_m
                || turn_sd_rad > tuning::HEADING_SD_MAX_RAD);
        let is_known = covariance.position_sd_m() <= sd_max_m
            && best.inflation <= tuning::INFLATION_MAX
            && !is_rough;
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
            is_last: turn_sd_rad <= tuning::HEADING_SD_RAD || way_m - found_m >= tuning::ON_M,
        })
    }

    /// Whether an agent was found and still searches for its heading.
    pub fn is_seeking(&self, agent: u32, session: u32) -> bool {
        let number = self.search_number(agent);
        let search = number.and_then(|number| self.searches.get(number));
        search.is_some_and(|search| {
            let is_found = search.found_m.is_some();
            is_found && !search.is_over(tuning::ON_M) && search.session == session
        })
    }

    /// The remembered sample that the latest queries of an agent are most like, if any; `None` for
    /// an agent without a search.
    pub fn most_similar(&self, agent: u32) -> Option<Option<SampleKey>> {
        let search = self.searches.get(self.search_number(agent)?)?;
        let mut newest = search.queries.iter().rev().flat_map(|query| &query.similar);
        Some(newest.next().map(|similar| similar.sample))
    }

    /// Ends the search of an agent: it knows where it is, or begins anew.
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

    /// The guesses of an agent that searches, the most probable first.
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
        // A place that nobody has seen has the prior of any other place.
        let nowhere = (views.ln() - best.evidence.total()).exp();
        let whole: f64 = places.iter().map(weight).sum::<f64>() + nowhere;
        places
            .iter()
            .take(tuning::GUESSES_MAX)
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
                || search.is_over(tuning::ON_M))
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
