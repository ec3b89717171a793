//! Trips and their legs.

use cogmap_proto as wire;
use cognitive_map::{CognitiveMap, Leg, Trip, TripEnd, TripId};
use geometry::upper_triangle;

use super::place::agent_name;

/// A trip as the wire has it in a list.
pub fn trip(map: &CognitiveMap, id: TripId, trip: &Trip) -> wire::Trip {
    wire::Trip {
        id: id.0.into(),
        agent: agent_name(map, trip.agent()),
        session: trip.session(),
        start_stamp_ns: trip.start_stamp_ns(),
        end_stamp_ns: trip.end_stamp_ns(),
        ended: trip.ended().map(trip_end),
        leg_count: trip.leg_count() as u64,
        length_m: trip.length_m(),
        strength: map.trip_strength(id),
        pinned: map.is_pinned(id),
    }
}

/// A trip with its legs.
pub fn trip_detail(map: &CognitiveMap, id: TripId, of: &Trip) -> wire::TripDetail {
    wire::TripDetail {
        trip: trip(map, id, of),
        legs: of.legs().map(|of| leg(map, of)).collect(),
    }
}

/// A leg as the wire has it.
pub fn leg(map: &CognitiveMap, leg: &Leg) -> wire::Leg {
    let phases = leg.phase_displacement(map.modules());
    wire::Leg {
        from: leg.from().0.into(),
        to: leg.to().0.into(),
        translation_m: leg.relative().translation.vector.into(),
        rotation_xyzw: leg.relative().rotation.coords.into(),
        covariance: upper_triangle(leg.covariance().matrix()),
        phase_displacement: phases.into_iter().map(Into::into).collect(),
        octant: leg.octant(),
        duration_s: leg.duration_s(),
        length_m: leg.length_m(),
    }
}

/// Why a trip ended, as the wire has it.
pub(super) fn trip_end(reason: TripEnd) -> wire::TripEnd {
    match reason {
        TripEnd::Stillness => wire::TripEnd::Stillness,
        TripEnd::Gap => wire::TripEnd::Gap,
        TripEnd::SessionEnd => wire::TripEnd::SessionEnd,
        TripEnd::Marker => wire::TripEnd::Marker,
        TripEnd::Full => wire::TripEnd::Full,
        TripEnd::StartPose => wire::TripEnd::StartPose,
    }
}
