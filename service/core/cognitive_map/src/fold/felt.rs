//! What was felt near a point, and whether anybody was there to feel it.

use std::collections::BTreeMap;

use nalgebra::Point3;

use super::CognitiveMap;
use crate::agent::Status;
use crate::input::Label;
use crate::memory::percept::FeltPercept;
use crate::memory::place::{Place, PlaceId};

/// Asks what was felt near a point.
#[derive(Clone, Debug, PartialEq)]
pub struct FeltCue {
    /// The point, in `map`.
    pub position: Point3<f64>,
    /// Places within this distance of it are near \[m\].
    pub radius_m: f64,
    /// Only what was felt, and who was there, at or after this stamp \[ns\].
    pub since_ns: Option<i64>,
    /// Only percepts of channels with these labels; of all without any.
    pub channels: Vec<Label>,
    /// Most places of the answer.
    pub limit: usize,
}

/// Whether somebody looked, and what came of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Looked {
    /// Nobody is known to have been there.
    Never,
    /// Somebody was there, and no percept is known from then.
    NothingFelt,
    /// A percept is known.
    Felt,
}

/// What was felt near a point.
#[derive(Clone, Debug, PartialEq)]
pub struct Felt {
    /// Of all places near together.
    pub looked: Looked,
    /// Latest stamp at which somebody is known to have been near, whenever that was \[ns\].
    pub last_seen_ns: Option<i64>,
    /// Latest stamp of the percepts that are asked for \[ns\].
    pub last_felt_ns: Option<i64>,
    /// Number of places near, also beyond the limit.
    pub near: usize,
    /// The nearest places, the nearest first, equally near ones by number.
    pub places: Vec<FeltPlace>,
}

/// What was felt at a place.
#[derive(Clone, Debug, PartialEq)]
pub struct FeltPlace {
    /// The place.
    pub place: PlaceId,
    /// Its distance from the point \[m\].
    pub distance_m: f64,
    /// Whether somebody looked.
    pub looked: Looked,
    /// Latest stamp at which somebody is known to have been there, whenever that was \[ns\].
    pub last_seen_ns: i64,
    /// The percepts that are asked for, channel by channel.
    pub percepts: Vec<FeltPercept>,
}

impl CognitiveMap {
    /// What was felt near a point, by what its places remember: of each channel the latest stamp,
    /// and how often and what like it was since the place was founded. Somebody was there when an
    /// agent came to a place, when a place learned a percept of any channel, and while an agent
    /// that is localised stays in a place; what happened at forgotten places is not known.
    pub fn felt(&self, cue: &FeltCue) -> Felt {
        let mut near = self.places.within(&cue.position, cue.radius_m);
        near.sort_unstable_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
        let stays = self.stays();
        let mut felt = Felt {
            looked: Looked::Never,
            last_seen_ns: None,
            last_felt_ns: None,
            near: near.len(),
            places: Vec::new(),
        };
        for (id, distance_m) in near {
            let Some(place) = self.place(id) else {
                continue;
            };
            let stay_ns = stays.get(&id).copied();
            let at = self.felt_at(cue, (id, place), distance_m, stay_ns);
            felt.looked = felt.looked.max(at.looked);
            felt.last_seen_ns = felt.last_seen_ns.max(Some(at.last_seen_ns));
            let stamps = at.percepts.iter().map(|percept| percept.last_stamp_ns);
            felt.last_felt_ns = felt.last_felt_ns.max(stamps.max());
            if felt.places.len() < cue.limit {
                felt.places.push(at);
            }
        }
        felt
    }

    fn felt_at(
        &self,
        cue: &FeltCue,
        (id, place): (PlaceId, &Place),
        distance_m: f64,
        stay_ns: Option<i64>,
    ) -> FeltPlace {
        let is_wanted = |stamp_ns: i64| cue.since_ns.is_none_or(|since| stamp_ns >= since);
        let is_asked = |percept: &FeltPercept| {
            let channel = self.channel(percept.channel);
            let is_named = channel.is_some_and(|known| cue.channels.contains(known.label()));
            cue.channels.is_empty() || is_named
        };
        let mut last_seen_ns = place.last_stamp_ns().max(stay_ns.unwrap_or(i64::MIN));
        let mut percepts = Vec::new();
        for percept in self.percepts.felt_at(id) {
            last_seen_ns = last_seen_ns.max(percept.last_stamp_ns);
            if is_wanted(percept.last_stamp_ns) && is_asked(&percept) {
                percepts.push(percept);
            }
        }
        let looked = match (percepts.is_empty(), is_wanted(last_seen_ns)) {
            (false, _) => Looked::Felt,
            (true, true) => Looked::NothingFelt,
            (true, false) => Looked::Never,
        };
        FeltPlace {
            place: id,
            distance_m,
            looked,
            last_seen_ns,
            percepts,
        }
    }

    /// The places in which localised agents are, with the latest of their stamps \[ns\].
    fn stays(&self) -> BTreeMap<PlaceId, i64> {
        let mut stays = BTreeMap::new();
        for (id, agent) in self.agents() {
            let inside = agent.entered.filter(|_| agent.place().is_some());
            let known = inside.zip(agent.stamp_ns());
            if let Some((place, stamp_ns)) = known
                && self.status(id) != Some(Status::Lost)
            {
                let latest = stays.entry(place).or_insert(stamp_ns);
                *latest = stamp_ns.max(*latest);
            }
        }
        stays
    }
}
