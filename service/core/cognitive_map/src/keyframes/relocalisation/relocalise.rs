//! An agent that does not know where it is sees something.

use nalgebra::Isometry3;

use super::places::{Place, turn_sd_rad};
use super::search::Search;
use crate::keyframes::graph::{Beside, KeyframeGraph, Moment};
use crate::keyframes::revisited::Viewed;
use crate::keyframes::tie::Standing;
use geometry::PoseCovariance;
use geometry::se3;

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
    pub looks: u32,
}

impl KeyframeGraph {
    /// An agent that does not know where it is saw something. Answers where it is, once that is known to better than `sd_max_m`.
    pub fn seek(
        &mut self,
        moment: &Moment,
        viewed: &Viewed<'_>,
        sd_max_m: f64,
    ) -> Option<Relocalised> {
        self.note(moment);
        let number = self.search_of(moment);
        let revision = self.revision;
        let channel = self.revisits.known_channel(viewed.descriptor)?;
        let search = self.searches.get_mut(number, revision)?;
        let has_moved = search.looks.last().is_none_or(|last| {
            let way = last.in_odom.inv_mul(&viewed.in_odom);
            !crate::keyframes::life::is_within(&way, MOVED.0, MOVED.1)
        });
        if !has_moved {
            return None;
        }
        search.catch_up(&self.revisits);
        let alike = self
            .revisits
            .likes(channel, viewed.descriptor.vector(), 0, |view| {
                search.is_own(view)
            });
        search.look(viewed.in_odom, channel, viewed.descriptor.vector(), alike);
        let looks = search.looks.len();
        let fresh = if search.found_m.is_some() {
            FRESH.1
        } else {
            FRESH
                .0
                .max(u32::try_from(looks / PATIENCE).unwrap_or(u32::MAX))
        };
        if search.fresh < fresh || looks < LOOKS_MIN {
            return None;
        }
        search.fresh = 0;
        let search = self.searches.get(number)?;
        let places = self.places_of(search);
        let best = places.first()?;
        let views = (self.revisits.views.len() as f64).max(1.0);
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
        let way_m = search.looks.last().map_or(0.0, |look| look.travelled_m);
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
    pub fn is_seeking(&self, agent: u32) -> bool {
        let number = self.search_number(agent);
        let search = number.and_then(|number| self.searches.get(number));
        search.is_some_and(|search| {
            let is_found = search.found_m.is_some();
            is_found && !search.is_over(ON_M) && search.session == self.session(agent)
        })
    }

    /// The agent knows where it is, from now on. `is_elsewhere` says that it was thought to be in the map, but somewhere else.
    /// What comes next hangs on what was recognised.
    pub fn relocalised(&mut self, moment: &Moment, found: &Relocalised, is_elsewhere: bool) {
        let Some(search) = self
            .search_number(moment.agent)
            .and_then(|number| self.searches.get(number))
        else {
            return;
        };
        let mut newest = search.looks.iter().rev().flat_map(|look| &look.alike);
        let like = newest.next().copied();
        let revision = self.revision;
        if is_elsewhere {
            if let Some(life) = self.lives.get_mut(moment.agent as usize, revision) {
                life.is_cut = true;
                life.pose = found.pose;
            }
            self.revisits.cut(moment.agent, revision);
            self.anchor_anew(moment.agent);
        }
        if found.is_last {
            self.end_search(moment.agent);
        }
        let then = like.and_then(|like| self.at_seq(like.agent, like.session, like.seq));
        let (Some(now), Some(then)) = (self.here(moment.agent), then) else {
            return;
        };
        let Some(there) = self.pose_of(&then) else {
            return;
        };
        let seen = found.pose.inv_mul(&there);
        let adjoint = se3::adjoint(&seen.inverse());
        let covariance = adjoint * found.covariance.matrix() * adjoint.transpose();
        let covariance =
            PoseCovariance::from_matrix(&((covariance + covariance.transpose()) * 0.5));
        let is_kept = self.tie_beside(&now, &then, &seen, &covariance, Standing::Accepted);
        self.fresh_matches += u32::from(is_kept);
        self.agreed += u32::from(is_kept);
    }

    /// An agent knows where it is, or begins anew: what it has looked for is over.
    pub fn end_search(&mut self, agent: u32) {
        let revision = self.revision;
        if let Some(number) = self.search_number(agent)
            && let Some(search) = self.searches.get_mut(number, revision)
            && !search.looks.is_empty()
        {
            search.looks.clear();
            search.found_m = None;
            search.fresh = 0;
        }
    }

    /// Where an agent may be that searches, the most probable first.
    pub fn guesses(&self, agent: u32) -> Vec<Guess> {
        let search = self
            .search_number(agent)
            .and_then(|number| self.searches.get(number));
        let Some(search) = search.filter(|search| !search.looks.is_empty()) else {
            return Vec::new();
        };
        let places = self.places_of(search);
        let Some(best) = places.first() else {
            return Vec::new();
        };
        let views = (self.revisits.views.len() as f64).max(1.0);
        let weight = |place: &Place| (-best.evidence.against(&place.evidence)).exp();
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
                looks: u32::try_from(place.evidence.looks.iter().flatten().count())
                    .unwrap_or(u32::MAX),
            })
            .collect()
    }

    /// The number of the search of an agent in its present session; a new one if it has none.
    pub(super) fn search_of(&mut self, moment: &Moment) -> usize {
        let session = self.session(moment.agent);
        let fresh = Search::new(moment.agent, session, moment.seq);
        let revision = self.revision;
        let Some(number) = self.search_number(moment.agent) else {
            self.searches.push(fresh, revision);
            return self.searches.len() - 1;
        };
        if let Some(search) = self.searches.get_mut(number, revision)
            && (search.session != session || search.looks.is_empty() || search.is_over(ON_M))
        {
            *search = fresh;
        }
        number
    }

    fn search_number(&self, agent: u32) -> Option<usize> {
        self.searches
            .iter()
            .position(|search| search.agent == agent)
    }

    /// Where an agent was at a sample, in the map.
    pub(super) fn pose_at(&self, agent: u32, session: u32, seq: u64) -> Option<Isometry3<f64>> {
        let beside = self.at_seq(agent, session, seq)?;
        self.pose_of(&beside)
    }

    fn pose_of(&self, beside: &Beside) -> Option<Isometry3<f64>> {
        let anchor = self.anchors.get(beside.anchor)?;
        let life = self.lives.get(anchor.agent as usize)?;
        let pose = anchor.pose * beside.motion;
        if anchor.is_in_map {
            Some(pose)
        } else {
            Some(life.own_frame? * pose)
        }
    }

    /// Whether an agent and all that are in the map move in one plane.
    pub(in crate::keyframes) fn is_planar(&self, agent: u32) -> bool {
        let own = self
            .lives
            .get(agent as usize)
            .is_some_and(|life| life.is_planar);
        own && self
            .lives
            .iter()
            .all(|life| life.is_planar || !life.is_in_map)
    }
}
