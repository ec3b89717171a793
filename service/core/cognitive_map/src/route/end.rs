//! Where routes begin and end.

use nalgebra::Point3;

use crate::fold::CognitiveMap;
use crate::input::{AgentId, Goal};
use crate::memory::ids::{PlaceId, TripId};

/// Where a route begins or ends: at a place, or beside one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RouteEnd {
    pub(super) place: PlaceId,
    /// Where it is, if it is not the place itself.
    pub(super) position: Option<Point3<f64>>,
    /// Variance of what is there, summed over the axes \[m²\].
    pub(super) variance_m2: f64,
}

/// Why a route cannot begin or end somewhere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum NoRouteEnd {
    /// There never was such a place or trip.
    Unknown,
    /// It has been forgotten.
    Forgotten,
    /// No place answers there.
    NothingNear {
        /// The nearest place with its distance \[m\]; `None` where there are no places.
        nearest: Option<(PlaceId, f64)>,
    },
}

impl RouteEnd {
    /// The same as the goal of an errand.
    pub fn goal(&self) -> Goal {
        self.position
            .map_or(Goal::Place(self.place), Goal::Position)
    }

    /// The place, or that beside which it is.
    pub fn place(&self) -> PlaceId {
        self.place
    }
}

impl CognitiveMap {
    /// A place as the end of a route.
    ///
    /// # Errors
    /// It is unknown or forgotten.
    pub fn route_end_at(&self, place: PlaceId) -> Result<RouteEnd, NoRouteEnd> {
        if self.place(place).is_none() {
            return Err(if self.is_forgotten_place(place) {
                NoRouteEnd::Forgotten
            } else {
                NoRouteEnd::Unknown
            });
        }
        Ok(RouteEnd {
            place,
            position: None,
            variance_m2: 0.0,
        })
    }

    /// A position in `map` as the end of a route: beside the nearest place with a way, of those
    /// that answer there; beside the nearest where none has any.
    ///
    /// # Errors
    /// No place answers there: none is within two field radii.
    pub fn route_end_near(&self, position: &Point3<f64>) -> Result<RouteEnd, NoRouteEnd> {
        let reach_m = self.places.reach_m();
        let answering = self.places.within(position, reach_m).into_iter();
        let nearest = answering.min_by(|(a, far_a), (b, far_b)| {
            let lonely = |place| self.ways.at(place).is_none();
            let order = lonely(*a).cmp(&lonely(*b));
            order.then(far_a.total_cmp(far_b)).then(a.cmp(b))
        });
        let Some((place, _)) = nearest else {
            let nearest = self.nearest_place(position);
            return Err(NoRouteEnd::NothingNear { nearest });
        };
        Ok(RouteEnd {
            place,
            position: Some(*position),
            variance_m2: 0.0,
        })
    }

    /// Where an agent is as the end of a route.
    ///
    /// # Errors
    /// No place answers there, or there is no such agent.
    pub fn route_end_of_agent(&self, agent: AgentId) -> Result<RouteEnd, NoRouteEnd> {
        let known = self.agent(agent).ok_or(NoRouteEnd::Unknown)?;
        let end = self.route_end_near(&known.pose().translation.vector.into())?;
        let variance = self.covariance(agent);
        let variance =
            variance.map(|covariance| covariance.matrix().fixed_view::<3, 3>(0, 0).trace());
        Ok(RouteEnd {
            variance_m2: variance.unwrap_or(0.0),
            ..end
        })
    }

    /// The place nearest to a position as the end of a route, at any distance: of what is seen from
    /// a place, and is none.
    ///
    /// # Errors
    /// There are no places.
    pub fn route_end_before(&self, position: &Point3<f64>) -> Result<RouteEnd, NoRouteEnd> {
        let nearest = self.nearest_place(position);
        let (place, _) = nearest.ok_or(NoRouteEnd::NothingNear { nearest: None })?;
        self.route_end_at(place)
    }

    /// The start of a trip as the end of a route.
    ///
    /// # Errors
    /// The trip or the place is unknown or forgotten.
    pub fn route_end_of_trip(&self, trip: TripId) -> Result<RouteEnd, NoRouteEnd> {
        match self.trip(trip).and_then(|trip| trip.leg(0)) {
            Some(leg) => self.route_end_at(leg.from()),
            None if self.is_forgotten_trip(trip) => Err(NoRouteEnd::Forgotten),
            None => Err(NoRouteEnd::Unknown),
        }
    }

    /// Where an agent's session began as the end of a route: the first place that answered then.
    ///
    /// # Errors
    /// None has yet, or it has been forgotten.
    pub fn route_end_home(&self, agent: AgentId) -> Result<RouteEnd, NoRouteEnd> {
        let home = self.agent(agent).and_then(|agent| agent.home);
        self.route_end_at(home.ok_or(NoRouteEnd::Unknown)?)
    }
}
