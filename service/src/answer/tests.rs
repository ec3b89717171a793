//! Answers about a small map: one agent that drove ten metres along x, saw a post, and felt and saw
//! something where it stopped.

use cogmap_proto::{Increment, MotionBody, PredictQuery};
use cognitive_map::{
    AgentId, CognitiveMap, Descriptor, Label, Level, Motion, PlaceId, Record, Relation,
    RelativePosition, Sample, SampleBody, Settings, Sighting, Target, TripId,
};

use super::*;
use crate::encode::{grid_state, landmark, place, trip_detail};

mod prediction; // what would be felt after a motion
mod recall; // places by a cue

fn label(text: &str) -> Label {
    Label::new(text).expect("a label")
}

fn map() -> CognitiveMap {
    let mut map = CognitiveMap::new(Settings::default());
    let mut events = Vec::new();
    let agent = AgentId(0);
    map.apply(
        &Record::Enrol {
            agent,
            name: label("rover"),
        },
        &mut events,
    );
    let felt = [
        SampleBody::Level(Level::new(label("touch"), 3.0, [0.0; 3], None).expect("a level")),
        SampleBody::Level(Level::new(label("touch"), 5.0, [0.0; 3], None).expect("a level")),
        SampleBody::Descriptor(Descriptor::new(label("camera"), &[1.0; 16]).expect("a direction")),
    ];
    for seq in 0..105 {
        let percept = usize::try_from(seq).expect("small").checked_sub(102);
        let body = if let Some(percept) = percept {
            felt[percept].clone()
        } else if seq == 101 {
            SampleBody::Sighting(Sighting {
                target: Target::Landmark(label("post")),
                relation: Relation::Position(
                    RelativePosition::new([2.0, 1.0, 0.0], [0.1; 3]).expect("a position"),
                ),
            })
        } else {
            let step = if seq == 0 { 0.0 } else { 0.1 };
            let motion = Motion::from_increment([step, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0], None);
            SampleBody::Motion(motion.expect("a motion"))
        };
        let stamp_ns = 100_000_000 * i64::try_from(seq).expect("small");
        let sample = Sample { stamp_ns, body };
        map.apply(
            &Record::Sample {
                agent,
                session: 1,
                seq,
                sample,
            },
            &mut events,
        );
    }
    map
}

/// What would be felt after a motion ahead.
fn question(ahead_m: f64) -> PredictQuery {
    PredictQuery {
        agent: None,
        motion: MotionBody::Increment(Increment {
            translation_m: [ahead_m, 0.0, 0.0],
            rotation_xyzw: [0.0, 0.0, 0.0, 1.0],
            noise: None,
        }),
        offset_m: [0.0; 3],
        channel: None,
    }
}

#[test]
fn a_place_is_told_with_its_position_code_and_founder() {
    let map = map();
    let id = PlaceId(1);
    let told = place(
        &map,
        id,
        map.place(id).expect("ten metres hold many places"),
    );
    assert_eq!((told.id, told.founder.as_str()), (1, "rover"));
    assert!(
        told.translation_m[0] > 0.2 && told.translation_m[1].abs() < 1e-9,
        "{told:?}"
    );
    let [x, y, z, w] = told.rotation_xyzw;
    assert!(
        x.abs() + y.abs() + z.abs() < 1e-12 && (w - 1.0).abs() < 1e-12,
        "{told:?}"
    );
    assert_eq!(told.code.len(), 6);
    assert!(
        told.code
            .iter()
            .flatten()
            .all(|turn| (0.0..1.0).contains(turn))
    );
    assert!(told.visits >= 1);
}

#[test]
fn a_trip_leads_from_place_to_place() {
    let map = map();
    let detail = trip_detail(
        &map,
        TripId(0),
        map.trip(TripId(0)).expect("the agent moved"),
    );
    assert_eq!(detail.trip.agent, "rover");
    assert_eq!(detail.trip.leg_count, detail.legs.len() as u64);
    assert!(detail.trip.ended.is_none());
    for pair in detail.legs.windows(2) {
        assert_eq!(pair[0].to, pair[1].from);
    }
    let first = detail.legs.first().expect("a leg");
    assert!(first.translation_m[0] > 0.0 && first.length_m >= first.translation_m[0] - 1e-9);
    assert_eq!(first.phase_displacement.len(), 6);
    assert!((1..=8).contains(&first.octant));
}

#[test]
fn the_grid_state_decodes_to_where_the_agent_is() {
    let map = map();
    let state = grid_state(&map, map.agent(AgentId(0)).expect("enrolled")).expect("has moved");
    assert!(
        (state.decoded_m[0] - 10.0).abs() < 1e-6,
        "{:?}",
        state.decoded_m
    );
    assert!(
        (state.interference_m[0] - 10.0).abs() < 0.5,
        "{:?}",
        state.interference_m
    );
    assert_eq!(state.modules.len(), 6);
    assert!((state.displacement_m - 0.1).abs() < 1e-9);
    assert!(state.heading_rad.abs() < 1e-9);
    let finest = &state.modules[0];
    assert_eq!(finest.activation.len(), 27);
    assert!(finest.activation.iter().all(|a| (0.0..=1.0).contains(a)));
}

#[test]
fn a_landmark_stands_where_it_was_seen() {
    let map = map();
    let (_, post) = map.landmark_by_label("post").expect("it was seen");
    let told = landmark(post);
    assert_eq!((told.id.as_str(), told.sightings), ("post", 1));
    assert!(
        (told.translation_m[0] - 12.0).abs() < 0.2,
        "{:?}",
        told.translation_m
    );
    assert!(
        (told.translation_m[1] - 1.0).abs() < 0.2,
        "{:?}",
        told.translation_m
    );
    let [xx, _, _, yy, _, zz] = told.covariance;
    assert!(xx > 0.0 && yy > 0.0 && zz > 0.0);
}
