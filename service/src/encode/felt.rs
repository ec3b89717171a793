//! What was felt near a point.

use cogmap_proto as wire;
use cognitive_map::{ChannelKind, CognitiveMap, Felt, FeltPercept, FeltPlace, Looked};

use super::FRAME;

/// What was felt near a point, and who was there.
pub fn felt(space: &str, map: &CognitiveMap, felt: &Felt) -> wire::FeltAnswer {
    wire::FeltAnswer {
        space: space.to_owned(),
        frame: FRAME.to_owned(),
        map_revision: map.revision(),
        looked: looked(felt.looked),
        last_seen_ns: felt.last_seen_ns,
        last_felt_ns: felt.last_felt_ns,
        near: felt.near as u64,
        places: felt.places.iter().map(|at| place(map, at)).collect(),
    }
}

fn place(map: &CognitiveMap, at: &FeltPlace) -> wire::FeltPlace {
    let percepts = at.percepts.iter();
    wire::FeltPlace {
        place: at.place.0.into(),
        distance_m: at.distance_m,
        looked: looked(at.looked),
        last_seen_ns: at.last_seen_ns,
        percepts: percepts.filter_map(|felt| percept(map, felt)).collect(),
    }
}

fn percept(map: &CognitiveMap, felt: &FeltPercept) -> Option<wire::FeltPercept> {
    let channel = map.channel(felt.channel)?;
    let (mean, sd) = felt.level.unzip();
    Some(wire::FeltPercept {
        channel: channel.label().as_str().to_owned(),
        last_stamp_ns: felt.last_stamp_ns,
        percepts: felt.percepts,
        strength: felt.strength,
        mean,
        sd,
        dimension: match channel.kind() {
            ChannelKind::Level => None,
            ChannelKind::Descriptor { dimension } => Some(dimension.into()),
        },
    })
}

fn looked(looked: Looked) -> wire::Looked {
    match looked {
        Looked::Never => wire::Looked::Never,
        Looked::NothingFelt => wire::Looked::NothingFelt,
        Looked::Felt => wire::Looked::Felt,
    }
}
