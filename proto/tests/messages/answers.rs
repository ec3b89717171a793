//! Answers of the HTTP interface, and the settings of a space.

use cogmap_proto::{
    AgentDetail, AgentPage, AgentSummary, Channel, ChannelKind, ChannelList, Compass, Evidence,
    ExpectedPercept, GridModuleState, GridState, IngestAnswer, Landmark, LandmarkPage,
    LearnedChannel, Leg, NoiseSettings, Place, PlacePage, PlacePercepts, PredictAnswer,
    PredictedPercept, Problem, RecallAnswer, RecalledPlace, Recruitment, RememberedPercept, Rivals,
    SpaceInfo, SpaceList, SpaceSettings, StampedPose, Status, Trajectory, Trip, TripDetail,
    TripPage,
};

use super::Visit;
use super::published::{ENDS, estimate, upper_triangle, watermark};

pub(super) fn each(visit: &mut impl Visit) {
    visit.message("space_settings_bernoulli", &bernoulli());
    visit.message("space_settings_novelty", &novelty());
    visit.message("space_list", &spaces());
    visit.message("agent_page", &agents());
    visit.message("agent_detail", &agent());
    visit.message("agent_detail_before_first_sample", &silent_agent());
    visit.message("grid_state", &grid());
    visit.message("trajectory", &trajectory());
    visit.message(
        "ingest_answer",
        &IngestAnswer {
            watermark: watermark(),
            duplicates: 4,
            refused: vec![
                "samples[1].body.level.value NaN: a number is NaN, infinite or beyond its limit"
                    .to_owned(),
            ],
        },
    );
    visit.message("place_page", &places());
    visit.message("place_percepts", &remembered());
    visit.message("recall_answer", &recalled());
    visit.message("recall_answer_without_cue", &recalled_without_cue());
    visit.message("predict_answer", &predicted());
    visit.message("predict_answer_nowhere", &predicted_nowhere());
    visit.message("trip_page", &trips());
    visit.message("trip_detail", &trip_detail());
    visit.message("landmark_page", &landmarks());
    visit.message("channel_list", &channels());
    visit.message("problem", &problem());
}

fn novelty() -> SpaceSettings {
    SpaceSettings {
        grid_ratio: 1.5,
        ..SpaceSettings::default()
    }
}

/// No setting has its default.
fn bernoulli() -> SpaceSettings {
    SpaceSettings {
        seed: u64::MAX,
        grid_modules: 7,
        grid_spacing_m: 0.5,
        grid_ratio: 1.75,
        field_radius_m: 0.4,
        recruitment: Recruitment::Bernoulli { probability: 0.05 },
        odometry_noise: NoiseSettings {
            translation_sd_per_sqrt_m: 0.03,
            rotation_sd_per_sqrt_m: 0.04,
            rotation_sd_per_sqrt_rad: 0.05,
            length_error_sd: 0.01,
            angle_error_sd: 0.02,
            bias_sd_rad_s: 0.001,
        },
        lasting_range_error: 0.2,
        localized_sd_m: 0.6,
        lost_sd_m: 6.0,
        trip_stillness_s: 7.0,
        trip_gap_s: 3.0,
        places_max: 100_000,
        legs_max: 1_000_000,
        keyframes_max: 200_000,
        strength_half_life_samples: 360_000,
        trajectory_interval_s: 0.25,
        sighting_gate_sd: 5.0,
        sighting_huber_sd: 1.5,
        closure_gate_chi2: 16.0,
        keyframe_spacing_m: 0.5,
        keyframe_spacing_rad: 0.2,
        restart_sd_m: 0.25,
        restart_sd_rad: 0.125,
        object_answer_probability: 0.999,
        ways_max: 2_000_000,
        learns_unknown_objects: false,
    }
}

fn spaces() -> SpaceList {
    let space = SpaceInfo {
        name: "lab".to_owned(),
        settings: novelty(),
        map_revision: 4_711,
        digest: "00000000deadbeef".to_owned(),
        agents: 2,
        places: 30,
        trips: 4,
        landmarks: 1,
    };
    SpaceList {
        spaces: vec![space],
    }
}

fn agents() -> AgentPage {
    AgentPage {
        agents: vec![
            AgentSummary {
                name: "robot-1".to_owned(),
                estimate: Some(estimate(Status::Localized)),
                session_ended: true,
                heard_ago_s: Some(75.5),
            },
            AgentSummary {
                name: "robot-2".to_owned(),
                estimate: None,
                session_ended: false,
                heard_ago_s: None,
            },
        ],
        next: Some("robot-2".to_owned()),
    }
}

fn agent() -> AgentDetail {
    AgentDetail {
        name: "robot-1".to_owned(),
        estimate: Some(estimate(Status::Localized)),
        odometry: Some(pose(1_800_000_000_610_000_000)),
        evidence: Evidence {
            accepted: 4_000,
            refused: 31,
            refused_in_a_row: 2,
            nis_mean: Some(1.125),
        },
        watermark: watermark(),
        lag_samples: 12,
        travelled_m: 31.75,
        forgotten_matches: 3,
        session_ended: true,
        heard_ago_s: Some(0.25),
    }
}

fn silent_agent() -> AgentDetail {
    AgentDetail {
        estimate: None,
        odometry: None,
        evidence: Evidence::default(),
        lag_samples: 0,
        travelled_m: 0.0,
        forgotten_matches: 0,
        session_ended: false,
        heard_ago_s: None,
        ..agent()
    }
}

fn pose(stamp_ns: i64) -> StampedPose {
    StampedPose {
        stamp_ns,
        translation_m: [12.5, -7.25, 0.1],
        rotation_xyzw: [0.0, 0.0, 0.6, 0.8],
    }
}

fn grid() -> GridState {
    let module = GridModuleState {
        spacing_m: 1.0,
        reference: [12, -8, 0],
        reference_m: [8.0, -7.0, 0.0],
        phase: [0.25, 0.5, 0.875],
        activation: vec![0.0, 0.125, 1.0],
        octant_activation: 0.625,
    };
    GridState {
        agent: "robot-1".to_owned(),
        stamp_ns: 1_800_000_000_610_000_000,
        modules: vec![
            module.clone(),
            GridModuleState {
                spacing_m: 1.5,
                ..module
            },
        ],
        decoded_m: [12.5, -7.25, 0.1],
        interference_m: [12.25, -7.5, 0.125],
        octant: Some(8),
        displacement_m: 0.015,
        turning_rad: -0.25,
        heading_rad: 3.125,
    }
}

fn trajectory() -> Trajectory {
    Trajectory {
        agent: "robot-1".to_owned(),
        session: 1_800_000_000_000_000_000,
        frame: "map".to_owned(),
        kind: "causal".to_owned(),
        map_revision: None,
        poses: vec![
            pose(1_800_000_000_610_000_000),
            pose(1_800_000_000_620_000_000),
        ],
        next_from_ns: Some(1_800_000_000_620_000_001),
    }
}

fn place() -> Place {
    Place {
        id: 3,
        translation_m: [12.5, -7.0, 0.3],
        rotation_xyzw: [0.0, 0.0, 0.6, 0.8],
        position_sd_m: [0.1, 0.2, 0.3],
        code: vec![[0.0, 0.25, 0.5], [0.75, 0.125, 0.875]],
        visits: 5,
        founder: "robot-1".to_owned(),
        first_stamp_ns: 1_800_000_000_510_000_000,
        last_stamp_ns: 1_800_000_000_610_000_000,
        strength: 1.75,
    }
}

fn places() -> PlacePage {
    PlacePage {
        frame: "map".to_owned(),
        map_revision: 4_711,
        places: vec![place()],
        next: Some(3),
    }
}

fn recalled() -> RecallAnswer {
    let best = RecalledPlace {
        place: place(),
        cosine: Some(0.9375),
        confidence: Some(0.875),
        distance_m: Some(0.25),
        percept_match: Some(0.96875),
    };
    RecallAnswer {
        space: "lab".to_owned(),
        frame: "map".to_owned(),
        map_revision: 4_711,
        places: vec![best],
        rivals: Some(Rivals {
            count: 2,
            place: 17,
            cosine: 0.90625,
            distance_m: 31.5,
        }),
    }
}

fn recalled_without_cue() -> RecallAnswer {
    let latest = RecalledPlace {
        place: place(),
        cosine: None,
        confidence: None,
        distance_m: None,
        percept_match: None,
    };
    RecallAnswer {
        places: vec![latest],
        rivals: None,
        ..recalled()
    }
}

fn remembered() -> PlacePercepts {
    let percepts = predicted().percepts.into_iter();
    let remembered = percepts.map(|predicted| RememberedPercept {
        channel: predicted.channel,
        expected: predicted.expected,
        percepts: predicted.percepts,
        strength: predicted.strength,
    });
    PlacePercepts {
        space: "lab".to_owned(),
        place: 3,
        map_revision: 4_711,
        percepts: remembered.collect(),
    }
}

fn predicted() -> PredictAnswer {
    PredictAnswer {
        space: "lab".to_owned(),
        agent: "robot-1".to_owned(),
        frame: "map".to_owned(),
        map_revision: 4_711,
        translation_m: [12.5, -7.25, 0.1],
        rotation_xyzw: [0.0, 0.0, 0.6, 0.8],
        place: Some(3),
        confidence: 0.875,
        percepts: vec![
            PredictedPercept {
                channel: "touch".to_owned(),
                expected: ExpectedPercept::Level {
                    mean: 0.75,
                    sd: 0.125,
                },
                place: 4,
                confidence: 0.625,
                percepts: 9,
                strength: 7.5,
            },
            PredictedPercept {
                channel: "camera".to_owned(),
                expected: ExpectedPercept::Descriptor {
                    vector: vec![0.5, -0.5, 0.25, 0.0, 0.625, -0.125, 0.1875, 0.0],
                },
                place: 3,
                confidence: 0.875,
                percepts: 2,
                strength: 1.5,
            },
        ],
    }
}

fn predicted_nowhere() -> PredictAnswer {
    PredictAnswer {
        place: None,
        confidence: 0.0,
        percepts: Vec::new(),
        ..predicted()
    }
}

fn trip() -> Trip {
    Trip {
        id: 0,
        agent: "robot-1".to_owned(),
        session: 1_800_000_000_000_000_000,
        start_stamp_ns: 1_800_000_000_500_000_000,
        end_stamp_ns: 1_800_000_000_610_000_000,
        ended: None,
        leg_count: 1,
        length_m: 0.75,
        strength: 0.625,
        pinned: false,
    }
}

/// A trip for each end, and one that goes on.
fn trips() -> TripPage {
    let ends = ENDS.into_iter().map(Some).chain([None]);
    let trips = (0..)
        .zip(ends)
        .map(|(id, ended)| Trip {
            id,
            ended,
            pinned: id == 1,
            ..trip()
        })
        .collect();
    TripPage { trips, next: None }
}

fn trip_detail() -> TripDetail {
    let leg = Leg {
        from: 3,
        to: 4,
        translation_m: [0.5, 0.25, 0.0],
        rotation_xyzw: [0.0, 0.0, -0.6, 0.8],
        covariance: upper_triangle(),
        phase_displacement: vec![[0.5, -0.25, 0.0], [1.25, 0.0, -3.5]],
        octant: 1,
        duration_s: 1.1,
        length_m: 0.75,
    };
    TripDetail {
        trip: trip(),
        legs: vec![leg],
    }
}

fn landmarks() -> LandmarkPage {
    let landmark = Landmark {
        id: "porte 3, étage α".to_owned(),
        translation_m: [2.0, -1.5, 0.25],
        covariance: [0.01, 0.001, 0.002, 0.02, 0.003, 0.03],
        sightings: 9,
        first_stamp_ns: 1_800_000_000_540_000_000,
        last_stamp_ns: 1_800_000_000_610_000_000,
    };
    LandmarkPage {
        frame: "map".to_owned(),
        landmarks: vec![landmark],
        next: None,
    }
}

fn channels() -> ChannelList {
    let learned = LearnedChannel {
        views: 512,
        range_m: 2.5,
        information_nats: 3.25,
        independence: 0.5,
        turned: [1.0, 0.75, 0.5, 0.25, 0.125],
        coarse: true,
    };
    let view = Channel {
        name: "laser".to_owned(),
        kind: ChannelKind::Descriptor,
        dimension: Some(60),
        views: Some(700),
        learned: Some(learned),
        compass: None,
    };
    let level = Channel {
        name: "lumière".to_owned(),
        kind: ChannelKind::Level,
        dimension: None,
        views: None,
        learned: None,
        compass: None,
    };
    let compass = Channel {
        name: "compass".to_owned(),
        compass: Some(Compass {
            rad_per_unit: -0.017_453_292_519_943_295,
            offset_rad: 1.5,
            lasting_sd_rad: 0.25,
            noise_sd_rad: 0.125,
            agent: Some("r1".to_owned()),
        }),
        ..level.clone()
    };
    ChannelList {
        channels: vec![view, level, compass],
    }
}

fn problem() -> Problem {
    Problem {
        kind: "/problems/no-such-space".to_owned(),
        title: "No such space".to_owned(),
        status: 404,
        detail: "there is no space \"lab2\"".to_owned(),
    }
}
