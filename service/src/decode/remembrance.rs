//! Places and ways that another map has had.

use cogmap_proto::limits::METRES_MAX;
use cognitive_map::{
    AgentId, PlaceId, RememberedPlace, RememberedTraversals, RememberedWay, Remembrance,
};
use nalgebra::{Isometry3, Quaternion, UnitQuaternion, Vector6};

use crate::journal::{
    JournaledPlace, JournaledPose, JournaledRemembrance, JournaledTraversals, JournaledWay,
};

/// How far the length of an exported quaternion may be from one. Source: as of samples.
const UNIT_TOLERANCE: f64 = 1e-6;

/// What another map has had; `None` of what makes no sense.
pub(super) fn journaled_remembrance(journaled: &JournaledRemembrance) -> Option<Remembrance> {
    Some(match journaled {
        JournaledRemembrance::Place(was) => Remembrance::Place(place(was)?),
        JournaledRemembrance::Way(was) => Remembrance::Way(Box::new(way(was)?)),
    })
}

fn place(was: &JournaledPlace) -> Option<RememberedPlace> {
    let known = was.position_sd_m.iter().all(|sd| is_size(*sd)) && is_size(was.strength);
    let place = known && was.visits > 0 && was.place < u32::MAX;
    place.then_some(RememberedPlace {
        place: PlaceId(was.place),
        pose: pose(&was.pose)?,
        position_sd_m: was.position_sd_m.into(),
        founder: AgentId(was.founder),
        visits: was.visits,
        first_stamp_ns: was.first_stamp_ns,
        last_stamp_ns: was.last_stamp_ns,
        strength: was.strength,
    })
}

fn way(was: &JournaledWay) -> Option<RememberedWay> {
    let [first, second] = was.ends;
    let sizes = was.sd.iter().chain([&was.shortest_m, &was.strength]);
    let is_way = first < second && second < u32::MAX && was.measurements > 0;
    if !is_way || !sizes.copied().all(is_size) {
        return None;
    }
    let [there, back] = was.travelled.each_ref().map(|of| traversals(of.as_ref()));
    Some(RememberedWay {
        ends: was.ends.map(PlaceId),
        poses: [pose(&was.poses[0])?, pose(&was.poses[1])?],
        travelled: [there?, back?],
        relative: pose(&was.relative)?,
        variance: Vector6::from(was.sd).map(|sd| sd * sd),
        measurements: was.measurements,
        shortest_m: was.shortest_m,
        strength: was.strength,
    })
}

fn traversals(were: Option<&JournaledTraversals>) -> Option<RememberedTraversals> {
    let Some(were) = were else {
        return Some(RememberedTraversals::default());
    };
    let is_known = were.times > 0 && is_size(were.fastest_s) && is_size(were.mean_s);
    is_known.then_some(RememberedTraversals {
        times: were.times,
        fastest_s: were.fastest_s,
        mean_s: were.mean_s,
        last_stamp_ns: were.last_stamp_ns,
    })
}

fn pose(pose: &JournaledPose) -> Option<Isometry3<f64>> {
    let rotation = Quaternion::from(pose.rotation_xyzw);
    let mut metres = pose.translation_m.iter();
    // A comparison with NaN is false.
    let is_pose = metres.all(|metre| metre.abs() <= METRES_MAX)
        && (rotation.norm() - 1.0).abs() <= UNIT_TOLERANCE;
    // As it was, to the last bit.
    let rotation = UnitQuaternion::new_unchecked(rotation);
    is_pose.then(|| Isometry3::from_parts(pose.translation_m.into(), rotation))
}

/// Whether a number is finite and not negative.
fn is_size(number: f64) -> bool {
    (0.0..f64::INFINITY).contains(&number)
}
