//! Where samples were taken: questions and answers.

use cogmap_proto::{
    Descriptor, Increment, Localization, LocalizationHypothesis, LocalizeQuery, LocalizedPose,
    Sample, SampleBody, Status,
};

use super::Visit;
use super::published::upper_triangle;

pub(super) fn each(visit: &mut impl Visit) {
    visit.message("localize_query", &query());
    visit.message("localization", &found());
    visit.message("localization_uncertain", &uncertain());
}

fn query() -> LocalizeQuery {
    let bodies = [
        SampleBody::Descriptor(Descriptor {
            channel: "camera".to_owned(),
            vector: vec![0.5, -0.5, 0.25, 0.0, 1.0, 0.0, 0.0, 0.125],
        }),
        SampleBody::Increment(Increment {
            translation_m: [0.25, 0.0, 0.0],
            rotation_xyzw: [0.0, 0.0, 0.6, 0.8],
            noise: None,
        }),
    ];
    let stamps_ns = [1_800_000_000_500_000_000, 1_800_000_000_600_000_000];
    let samples = stamps_ns.into_iter().zip(bodies);
    LocalizeQuery {
        samples: samples
            .map(|(stamp_ns, body)| Sample { stamp_ns, body })
            .collect(),
    }
}

fn pose(x: f64) -> LocalizedPose {
    LocalizedPose {
        translation_m: [x, -7.0, 0.25],
        rotation_xyzw: [0.0, 0.0, 0.6, 0.8],
        covariance: upper_triangle(),
    }
}

fn found() -> Localization {
    Localization {
        space: "lab".to_owned(),
        frame: "map".to_owned(),
        map_revision: 4711,
        status: Status::Localized,
        pose: Some(pose(12.5)),
        found_after: Some(41),
        hypotheses: Vec::new(),
    }
}

fn uncertain() -> Localization {
    let hypotheses = [(12.5, 0.5), (-3.25, 0.375)];
    Localization {
        status: Status::Uncertain,
        pose: None,
        found_after: None,
        hypotheses: hypotheses
            .into_iter()
            .map(|(x, probability)| LocalizationHypothesis {
                pose: pose(x),
                probability,
                looks: 9,
            })
            .collect(),
        ..found()
    }
}
