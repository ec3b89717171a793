//! Sequences and stamps: what is asked about and what is answered.

use cogmap_proto::{
    AgentAt, Level, NextPlace, PerceptCue, SequenceAnswer, SequenceElement, SequenceQuery,
    SequenceTrip,
};

use super::Visit;

pub(super) fn each(visit: &mut impl Visit) {
    let plain = SequenceQuery {
        cue: vec![SequenceElement::Place(3), SequenceElement::Place(4)],
        error_rate: None,
        none_prior: None,
        limit: None,
    };
    visit.message("sequence_query", &plain);
    let level = PerceptCue::Level(Level {
        channel: "touch".to_owned(),
        value: 0.75,
        offset_m: [0.0; 3],
        normal: None,
    });
    let full = SequenceQuery {
        cue: vec![
            SequenceElement::Place(u64::MAX),
            SequenceElement::Percept(level),
        ],
        error_rate: Some(0.25),
        none_prior: Some(0.5),
        limit: Some(3),
    };
    visit.message("sequence_query_full", &full);
    let answer = SequenceAnswer {
        space: "lab".to_owned(),
        map_revision: 4_711,
        next: vec![NextPlace {
            place: 5,
            probability: 0.75,
        }],
        others: 0.125,
        none: 0.125,
        trips: vec![SequenceTrip {
            trip: 17,
            agent: "robot-1".to_owned(),
            probability: 0.875,
            leg: 6,
        }],
    };
    visit.message("sequence_answer", &answer);
    let causal = AgentAt {
        agent: "robot-1".to_owned(),
        session: 3,
        frame: "map".to_owned(),
        trajectory: "causal".to_owned(),
        stamp_ns: 1_800_000_000_610_000_000,
        translation_m: [12.5, -7.25, 0.125],
        rotation_xyzw: [0.0, 0.0, 0.6, 0.8],
        before_ns: 1_800_000_000_600_000_000,
        after_ns: 1_800_000_000_700_000_000,
        map_revision: None,
    };
    visit.message("agent_at", &causal);
    let refined = AgentAt {
        trajectory: "refined".to_owned(),
        map_revision: Some(4_711),
        ..causal
    };
    visit.message("agent_at_refined", &refined);
}
