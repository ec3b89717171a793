//! Routes along a trip, and to where an agent was.

use super::path::{Hop, Path};
use super::{NoRoute, NoRouteEnd, Route, RouteBounds, RouteEnd, RouteOptions};
use crate::fold::CognitiveMap;
use crate::input::{AgentId, Retrace};
use crate::memory::ids::{PlaceId, TripId};
use crate::memory::trip::{Leg, LegUnderWay, Trip};

/// How far back.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Back {
    /// So long ago by the agent's stamps \[s\].
    Seconds(f64),
    /// So far by its path \[m\].
    Metres(f64),
}

impl CognitiveMap {
    /// The end of a trip to which a retraced one leads.
    ///
    /// # Errors
    /// The trip is unknown or forgotten.
    pub fn route_end_of_retrace(&self, retrace: &Retrace) -> Result<RouteEnd, NoRouteEnd> {
        let trip = self.trip(retrace.trip);
        let last = trip.and_then(|trip| {
            if retrace.backward {
                trip.leg(0).map(Leg::from)
            } else {
                trip.legs().last().map(Leg::to)
            }
        });
        match last {
            Some(place) => Ok(RouteEnd {
                place,
                position: None,
                variance_m2: 0.0,
            }),
            None if self.is_forgotten_trip(retrace.trip) => Err(NoRouteEnd::Forgotten),
            None => Err(NoRouteEnd::Unknown),
        }
    }

    /// The route to the point of a trip that is nearest, and along its legs to one of its ends. Of
    /// the options, the cost counts on the way to the trip only, and there are no alternatives and
    /// no shortcuts.
    ///
    /// # Errors
    /// No way leads there: to the trip, or along it, for ways that were forgotten or are blocked.
    pub fn retraced(
        &self,
        from: &RouteEnd,
        retrace: &Retrace,
        options: &RouteOptions,
        bounds: Option<&RouteBounds>,
        gives_up: &mut dyn FnMut() -> bool,
    ) -> Result<Route, NoRoute> {
        let costs = self.costs(options);
        let along = self.along(*retrace);
        let at = self.position_of(from);
        let distances = (0..).zip(&along).filter_map(|(rank, place): (usize, _)| {
            let there = self.waypoint(*place)?.pose().translation.vector;
            Some(((there - at.coords).norm(), rank))
        });
        let nearest = distances.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let ends_at = |place| RouteEnd {
            place,
            position: None,
            variance_m2: 0.0,
        };
        let last = ends_at(along.last().copied().unwrap_or(from.place));
        let Some((_, rank)) = nearest else {
            return Err(self.nearest_reachable(&costs, from, &last, gives_up));
        };
        let joined = ends_at(along[rank]);
        let ends = self.ways.at(from.place).zip(self.ways.at(along[rank]));
        let found = match ends {
            Some((start, goal)) if start == goal => Some((vec![(start, Hop::Start)], 0)),
            Some((start, goal)) => self.cheapest_path(&costs, [start, goal], bounds, gives_up)?,
            None => None,
        };
        let Some((mut path, mut cost)) = found else {
            return Err(self.nearest_reachable(&costs, from, &joined, gives_up));
        };
        for pair in along[rank..].windows(2) {
            let before = self.waypoint(pair[0]);
            let edge = before.and_then(|before| Some((before, before.edge_to(pair[1])?)));
            let step = edge.and_then(|(before, edge)| Some((edge, costs.of(before, edge)?)));
            let Some((edge, more)) = step else {
                let nearest = (pair[0], self.distance_m(pair[0], last.place));
                let blocked = edge.map(|(before, edge)| costs.blocked(before, edge));
                let blockages = blocked.into_iter().flatten().map(|blockage| blockage.id);
                return Err(NoRoute::NoWay {
                    nearest,
                    blockages: blockages.collect(),
                });
            };
            path.push((edge.to, Hop::Way(*edge)));
            cost += more;
        }
        Ok(self.route_along(&path_from(path), cost, from, &last))
    }

    /// Distance of two waypoints \[m\].
    fn distance_m(&self, a: PlaceId, b: PlaceId) -> f64 {
        let at = |place| Some(self.waypoint(place)?.pose().translation.vector);
        let ends = at(a).zip(at(b));
        ends.map_or(0.0, |(a, b): (nalgebra::Vector3<f64>, _)| (a - b).norm())
    }

    /// The places of a trip, in the order in which they are to be come to.
    fn along(&self, retrace: Retrace) -> Vec<PlaceId> {
        let legs = self.trip(retrace.trip).into_iter().flat_map(Trip::legs);
        let mut places: Vec<_> = legs.flat_map(|leg| [leg.from(), leg.to()]).collect();
        places.dedup();
        if retrace.backward {
            places.reverse();
        }
        places
    }

    /// Where an agent was so long ago, or so far back along its path: the place of its trips that
    /// it came to or left next to that; where its session began, if that is later.
    ///
    /// # Errors
    /// It has not come from any place to another one in this session, or the place has been
    /// forgotten.
    pub fn route_end_back(&self, agent: AgentId, back: Back) -> Result<RouteEnd, NoRouteEnd> {
        let known = self.agent(agent).ok_or(NoRouteEnd::Unknown)?;
        let own = |(_, trip): &(TripId, &Trip)| {
            trip.agent() == agent && trip.session() == known.session()
        };
        let mut trips: Vec<_> = self.trips().filter(own).collect();
        trips.reverse();
        let under_way = known.recorder.leg.as_ref();
        let mut left = match back {
            Back::Seconds(seconds) => seconds,
            Back::Metres(metres) => metres - under_way.map_or(0.0, LegUnderWay::length_m),
        };
        let mut place = None;
        let mut until_ns = known.stamp_ns().unwrap_or(0);
        for (_, trip) in trips {
            if let Back::Seconds(_) = back {
                left -= until_ns.saturating_sub(trip.end_stamp_ns()).max(0) as f64 * 1e-9;
            }
            until_ns = trip.start_stamp_ns();
            for index in (0..trip.leg_count()).rev() {
                let Some(leg) = trip.leg(index) else { continue };
                let part = match back {
                    Back::Seconds(_) => leg.duration_s(),
                    Back::Metres(_) => leg.length_m(),
                };
                if left <= 0.5 * part {
                    return self.route_end_at(leg.to());
                }
                place = Some(leg.from());
                left -= part;
            }
        }
        self.route_end_at(place.ok_or(NoRouteEnd::Unknown)?)
    }
}

/// A path of one waypoint leads nowhere.
fn path_from(path: Path) -> Path {
    if path.len() > 1 { path } else { Vec::new() }
}
