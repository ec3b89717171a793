//! Objects: lessons, questions and answers.

use cogmap_proto::{
    AgentObject, Contact, ContactLevel, Descriptor, EndedEpisode, EpisodeKind, Identification,
    IdentifyQuery, NextTouch, ObjectDetail, ObjectLesson, ObjectLevel, ObjectPage, ObjectPlace,
    ObjectPose, ObjectProbability, ObjectSummary, ObjectVerdict, Orientation, OtherPose, Reached,
    RivalObject, TouchNoise,
};

use super::Visit;
use super::published::upper_triangle;

const LEFT_XYZW: [f64; 4] = [0.0, 0.0, 0.6, 0.8];

pub(super) fn each(visit: &mut impl Visit) {
    visit.message("object_lesson", &lesson());
    visit.message("identify_query", &query());
    visit.message("object_page", &page());
    visit.message("object_detail", &detail());
    visit.message("identification", &recognised());
    visit.message("identification_undecided", &undecided());
    visit.message("agent_object", &episode());
    visit.message("agent_object_none", &no_episode());
    visit.message("agent_object_ended", &ended());
}

fn contacts() -> Vec<Contact> {
    vec![
        Contact {
            position_m: [0.125, -0.25, 0.5],
            ..Contact::default()
        },
        Contact {
            position_m: [0.0, 0.0, 0.03],
            normal: Some([0.0, -0.6, 0.8]),
            levels: vec![ContactLevel {
                channel: "touch".to_owned(),
                value: -4.5,
            }],
            descriptors: vec![Descriptor {
                channel: "camera".to_owned(),
                vector: vec![0.5, -0.5, 0.25, 0.0, 1.0, 0.0, 0.0, 0.125],
            }],
            drift_sd_m: 0.004,
            reached: Reached::Aimed,
        },
    ]
}

fn lesson() -> ObjectLesson {
    ObjectLesson {
        spacing_m: 0.01,
        noise: TouchNoise::default(),
        contacts: contacts(),
    }
}

fn query() -> IdentifyQuery {
    IdentifyQuery {
        orientation: Orientation::Free {},
        noise: TouchNoise {
            position_sd_m: 0.001,
            normal_sd_rad: 0.02,
            level_sd: 0.5,
        },
        contacts: contacts(),
    }
}

fn summary() -> ObjectSummary {
    ObjectSummary {
        name: "mug".to_owned(),
        places: 412,
        spacing_m: 0.004,
        min_m: [-0.05, -0.04, 0.0],
        max_m: [0.05, 0.08, 0.11],
        contacts: 1000,
        visits: 3,
        gap_m: Some(0.0075),
        advised_gap_m: Some(0.005),
        alike: Some(ObjectProbability {
            name: "bowl".to_owned(),
            probability: 0.996_093_75,
        }),
    }
}

fn page() -> ObjectPage {
    ObjectPage {
        objects: vec![summary()],
        next: Some("mug".to_owned()),
    }
}

fn detail() -> ObjectDetail {
    ObjectDetail {
        summary: summary(),
        places: vec![
            ObjectPlace {
                position_m: [0.05, 0.0, 0.02],
                normal: Some([1.0, 0.0, 0.0]),
                contacts: 3.0,
                levels: vec![ObjectLevel {
                    channel: "touch".to_owned(),
                    mean: 2.5,
                    sd: 0.25,
                }],
            },
            ObjectPlace {
                position_m: [0.0, 0.04, 0.11],
                normal: None,
                contacts: 1.0,
                levels: Vec::new(),
            },
        ],
    }
}

fn recognised() -> Identification {
    Identification {
        space: "lab".to_owned(),
        map_revision: 4711,
        verdict: ObjectVerdict::Object {
            name: "mug".to_owned(),
        },
        objects: vec![
            ObjectProbability {
                name: "mug".to_owned(),
                probability: 0.992_187_5,
            },
            ObjectProbability {
                name: "bowl".to_owned(),
                probability: 0.007_812_5,
            },
        ],
        unknown: 0.0,
        live_objects: 1,
        live_hypotheses: 2,
        entropy_nats: 0.0625,
        contacts: 9,
        fit: -0.5,
        pose: Some(ObjectPose {
            object: "mug".to_owned(),
            translation_m: [0.5, -0.25, 0.125],
            rotation_xyzw: LEFT_XYZW,
            covariance: upper_triangle(),
            share: 0.5,
            others: vec![OtherPose {
                translation_m: [-0.5, 0.25, 0.125],
                rotation_xyzw: [0.0, 0.0, 0.0, 1.0],
                share: 0.5,
            }],
        }),
        next_touch: Some(NextTouch {
            position_m: [0.0, 0.0625, 0.03125],
            approach: Some([0.0, 0.0, -1.0]),
            gain_nats: 0.5,
        }),
        explored: Some(0.375),
        rival: Some(RivalObject {
            name: "bowl".to_owned(),
            contacts_nats: vec![0.0, 2.5, -0.25],
        }),
    }
}

fn undecided() -> Identification {
    Identification {
        verdict: ObjectVerdict::Undecided {},
        objects: Vec::new(),
        unknown: 1.0,
        pose: None,
        next_touch: None,
        explored: None,
        rival: None,
        ..recognised()
    }
}

fn episode() -> AgentObject {
    AgentObject {
        space: "lab".to_owned(),
        agent: "arm-1".to_owned(),
        episode: Some(EpisodeKind::Identify),
        identification: Some(Identification {
            verdict: ObjectVerdict::Unknown {},
            ..undecided()
        }),
        last: None,
        contacts: contacts(),
    }
}

fn ended() -> AgentObject {
    AgentObject {
        last: Some(EndedEpisode {
            episode: EpisodeKind::Identify,
            session: 7,
            stamp_ns: 1_700_000_000_000_000_000,
            identification: Some(recognised()),
        }),
        ..no_episode()
    }
}

fn no_episode() -> AgentObject {
    AgentObject {
        episode: None,
        identification: None,
        contacts: Vec::new(),
        ..episode()
    }
}
