//! Whole experiments, as a user sees them.

use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicU64, Ordering};

use cognitive_map::Recruitment;

use super::run::{Keep, Run};
use super::*;
use cogmap_worlds::{BODY_RADIUS_M, OdometryNoise};

const ENVIRONMENTS: [Environment; 2] = [Environment::GridAligned, Environment::ObstacleRich];

fn experiment(protocol: &Protocol, runs: u32, threads: usize) -> Experiment {
    let threads = NonZeroUsize::new(threads).unwrap();
    Experiment::run(protocol, runs, 1, threads, &|_| {}).unwrap()
}

fn novelty(environment: Environment) -> Protocol {
    let mut protocol = Protocol::of_paper(environment);
    protocol.settings.recruitment = Recruitment::Novelty;
    protocol
}

fn noisy(environment: Environment) -> Protocol {
    Protocol {
        odometry: OdometryNoise::default(),
        walk: Walk::Persistent,
        ..Protocol::of_paper(environment)
    }
}

#[test]
fn without_noise_every_estimate_of_the_pose_is_exact() {
    for environment in ENVIRONMENTS {
        for walk in [Walk::Pure, Walk::Persistent] {
            let protocol = Protocol {
                steps: 300,
                walk,
                ..Protocol::of_paper(environment)
            };
            let report = Report::of(&experiment(&protocol, 2, 2));
            for measure in [
                "decoded_ate_max_m",
                "causal_ate_rmse_m",
                "dead_reckoning_ate_rmse_m",
            ] {
                let largest_m = report.measures[measure].unwrap().max;
                assert!(largest_m < 1e-9, "{measure} {largest_m} {walk:?}");
            }
        }
    }
}

#[test]
fn a_budget_makes_the_number_of_places_level() {
    for walk in [Walk::Pure, Walk::Persistent] {
        let mut protocol = novelty(Environment::GridAligned);
        (protocol.walk, protocol.steps) = (walk, 2000);
        let unbounded = Run::new(&protocol, 1, Keep::Path, |_| {}).unwrap();
        assert!(unbounded.growth_last_quarter.unwrap() > 0.1);
        protocol.settings.places_max = 100;
        let bounded = Run::new(&protocol, 1, Keep::Path, |_| {}).unwrap();
        assert!(bounded.growth_last_quarter.unwrap().abs() < f64::EPSILON);
        assert_eq!(bounded.path.unwrap().places_m.len(), 100);
    }
}

#[test]
fn no_recall_is_nearer_than_the_nearest_place_at_any_step() {
    for protocol in [
        Protocol::of_paper(Environment::ObstacleRich),
        novelty(Environment::GridAligned),
        noisy(Environment::ObstacleRich),
    ] {
        // As many points as steps, so that each bin of a curve is one step.
        let protocol = Protocol {
            steps: 400,
            ..protocol
        };
        for seed in 0..3 {
            let run = Run::new(&protocol, seed, Keep::Measures, |_| {}).unwrap();
            let at = |quantity, step| run.curves[quantity].mean(step);
            let mut n_recalled = 0;
            for step in 0..400 {
                let oracle_m = at(Quantity::OracleError, step);
                let recall_m = at(Quantity::RecallError, step);
                assert_eq!(oracle_m.is_some(), recall_m.is_some());
                let (Some(oracle_m), Some(recall_m)) = (oracle_m, recall_m) else {
                    continue;
                };
                n_recalled += 1;
                assert!(oracle_m <= recall_m, "step {step}: {oracle_m} > {recall_m}");
                if let Some(live_m) = at(Quantity::LiveError, step) {
                    assert!(oracle_m <= live_m, "step {step}: {oracle_m} > {live_m}");
                }
                if let Some(prediction_m) = at(Quantity::PredictionError, step) {
                    assert!(oracle_m <= prediction_m);
                }
                for score in [
                    Quantity::Cosine,
                    Quantity::PseudoActivation,
                    Quantity::Confidence,
                    Quantity::InterferenceScore,
                ] {
                    let value = at(score, step).unwrap();
                    assert!((0.0..=1.0).contains(&value), "{score:?} = {value}");
                }
            }
            assert!(n_recalled > 300, "{n_recalled}");
        }
    }
}

#[test]
fn bernoulli_recruits_as_often_as_stated_and_novelty_keeps_its_distance() {
    let report = Report::of(&experiment(
        &Protocol::of_paper(Environment::ObstacleRich),
        8,
        2,
    ));
    // 8000 draws at 5 %: 400 expected, with a deviation of 19.5; a few fall where a place is
    // already.
    let places = report.mean("places").unwrap() * 8.0;
    assert!((300.0..500.0).contains(&places), "{places}");

    let experiment = experiment(&novelty(Environment::ObstacleRich), 1, 1);
    let path = experiment.path().unwrap();
    for (k, place) in path.places_m.iter().enumerate() {
        for other in &path.places_m[..k] {
            assert!((place - other).norm() >= 0.25 - 1e-12);
        }
    }
    let recall_m = Report::of(&experiment).mean("recall_ate_mean_m").unwrap();
    assert!(recall_m < 0.25, "{recall_m}");
}

#[test]
fn certain_recruitment_at_every_step_recalls_the_step_itself() {
    let mut protocol = Protocol::of_paper(Environment::GridAligned);
    protocol.settings.recruitment = Recruitment::Bernoulli { probability: 1.0 };
    let report = Report::of(&experiment(&protocol, 1, 1));
    // Where another place lies within 1/32 m none is recruited, and that one is recalled.
    assert!(report.mean("recall_ate_mean_m").unwrap() < 1.0 / 32.0);
    assert!(report.mean("prediction_error_mean_m").unwrap() > 0.05);
    assert!(report.mean("cosine_mean").unwrap() > 0.99);

    protocol.settings.recruitment = Recruitment::Bernoulli { probability: 0.0 };
    let report = Report::of(&experiment(&protocol, 3, 2));
    assert_eq!(report.runs_without_recall, 3);
    assert_eq!(report.measures["recall_ate_mean_m"], None);
    assert_eq!(report.mean("places"), Some(0.0));
}

#[test]
fn every_step_is_a_new_location_or_a_revisit() {
    let protocol = Protocol::of_paper(Environment::GridAligned);
    let report = Report::of(&experiment(&protocol, 3, 2));
    let [unique, revisits] =
        ["unique_locations", "revisits"].map(|measure| report.mean(measure).unwrap());
    assert!((unique + revisits - 100.0).abs() < 1e-9);
    assert!(unique > 1.0);
}

#[test]
fn walls_are_never_crossed() {
    for environment in ENVIRONMENTS {
        for walk in [Walk::Pure, Walk::Persistent] {
            let protocol = Protocol {
                steps: 2000,
                walk,
                ..Protocol::of_paper(environment)
            };
            let run = Run::new(&protocol, 3, Keep::Path, |_| {}).unwrap();
            let world = environment.world(3);
            let path = run.path.unwrap();
            assert_eq!(path.truth.len(), 2000);
            for pose in path.truth {
                assert!(world.is_free(&pose.pose.translation.vector, BODY_RADIUS_M));
            }
        }
    }
}

#[test]
fn the_report_does_not_depend_on_the_number_of_threads() {
    for protocol in [
        Protocol::of_paper(Environment::GridAligned),
        noisy(Environment::ObstacleRich),
    ] {
        let protocol = Protocol {
            steps: 150,
            ..protocol
        };
        let json = |threads| {
            let experiment = experiment(&protocol, 7, threads);
            let figures = figures(&experiment).unwrap();
            let report = serde_json::to_string(&Report::of(&experiment)).unwrap();
            (report, figures)
        };
        let alone = json(1);
        assert_eq!(alone, json(2));
        assert_eq!(alone, json(16));
    }
}

#[test]
fn all_steps_are_told_to_who_watches() {
    let protocol = Protocol {
        steps: 130,
        ..Protocol::of_paper(Environment::GridAligned)
    };
    let steps = AtomicU64::new(0);
    let watch = |walked| {
        steps.fetch_add(walked, Ordering::Relaxed);
    };
    let threads = NonZeroUsize::new(3).unwrap();
    Experiment::run(&protocol, 5, 1, threads, &watch).unwrap();
    assert_eq!(steps.into_inner(), 650);
}

#[test]
fn noise_makes_the_published_pose_drift_but_leaves_the_walk() {
    let exact = Protocol {
        walk: Walk::Persistent,
        ..Protocol::of_paper(Environment::ObstacleRich)
    };
    let noisy = noisy(Environment::ObstacleRich);
    let walk = |protocol| experiment(protocol, 1, 1).path().unwrap().truth.clone();
    assert_eq!(walk(&exact), walk(&noisy));
    let report = Report::of(&experiment(&noisy, 4, 2));
    let drift_m = report.mean("dead_reckoning_ate_rmse_m").unwrap();
    assert!((0.05..5.0).contains(&drift_m), "{drift_m}");
    // The grid code holds the believed position, and nothing corrects it.
    let decoded_m = report.mean("decoded_ate_rmse_m").unwrap();
    assert!((decoded_m - drift_m).abs() < 0.1 * drift_m);
}

#[test]
fn sighted_obstacles_become_landmarks() {
    let protocol = Protocol {
        percept: Percept::Sightings(SightingSettings {
            range_max_m: 40.0,
            ..SightingSettings::default()
        }),
        ..Protocol::of_paper(Environment::ObstacleRich)
    };
    let report = Report::of(&experiment(&protocol, 2, 2));
    assert_eq!(report.mean("landmarks"), Some(50.0));
}

#[test]
fn views_recall_places_that_are_near() {
    let of = |noise, recruitment| {
        let mut protocol = Protocol::of_paper(Environment::ObstacleRich);
        protocol.percept = Percept::Descriptor(ViewSettings { every: 5, noise });
        protocol.settings.recruitment = recruitment;
        Report::of(&experiment(&protocol, 3, 2))
    };
    let report = of(0.0, Recruitment::Novelty);
    let error_m = |report: &Report| report.mean("view_recall_ate_mean_m").unwrap();
    // Most steps of a random walk lead back to where something has been seen before.
    assert!(error_m(&report) < 0.5, "{report:?}");
    assert!(report.mean("view_surprise_mean").unwrap() < 0.1);
    let noisy = of(0.5, Recruitment::Novelty);
    assert!(error_m(&noisy) > error_m(&report));
    let surprise = noisy.mean("view_surprise_mean").unwrap();
    assert!(surprise > report.mean("view_surprise_mean").unwrap());
}

#[test]
fn senseless_protocols_are_refused() {
    let paper = Protocol::of_paper(Environment::GridAligned);
    let refused = |protocol: &Protocol| protocol.check().unwrap_err();
    let still = Protocol {
        steps: 0,
        ..paper.clone()
    };
    assert_eq!(refused(&still), InvalidProtocol::Steps);
    let sightings = Percept::Sightings(SightingSettings::default());
    let blind = Protocol {
        percept: sightings,
        ..paper.clone()
    };
    assert_eq!(refused(&blind), InvalidProtocol::NothingToSight);
    for (every, noise) in [(0, 0.1), (5, 1.5), (5, f64::NAN)] {
        let seeing = Protocol {
            percept: Percept::Descriptor(ViewSettings { every, noise }),
            ..paper.clone()
        };
        assert_eq!(refused(&seeing), InvalidProtocol::View);
    }
    let never = Protocol {
        environment: Environment::ObstacleRich,
        percept: Percept::Sightings(SightingSettings {
            every: 0,
            ..SightingSettings::default()
        }),
        ..paper.clone()
    };
    assert_eq!(refused(&never), InvalidProtocol::Sighting);
    let mut unlikely = paper.clone();
    unlikely.settings.recruitment = Recruitment::Bernoulli { probability: 1.5 };
    assert!(matches!(refused(&unlikely), InvalidProtocol::Settings(_)));
    let wild = Protocol {
        odometry: OdometryNoise {
            gyro_bias_rad: f64::NAN,
            ..OdometryNoise::none()
        },
        ..paper.clone()
    };
    assert_eq!(refused(&wild), InvalidProtocol::Odometry);
    let run = |runs, seed| Experiment::run(&paper, runs, seed, NonZeroUsize::MIN, &|_| {}).err();
    assert_eq!(run(0, 1), Some(ExperimentError::NoRuns));
    assert_eq!(
        run(2, u64::MAX),
        Some(ExperimentError::Seeds { seed: u64::MAX })
    );
}

#[test]
fn figures_are_whole_and_name_the_paper() {
    let protocol = Protocol::of_paper(Environment::ObstacleRich);
    let experiment = experiment(&protocol, 2, 2);
    let figures = figures(&experiment).unwrap();
    assert_eq!(figures.len(), 10);
    for figure in &figures {
        assert!(figure.svg.trim_end().ends_with("</svg>"), "{}", figure.name);
        assert!(!figure.svg.contains("NaN") && !figure.svg.contains("inf"));
    }
    let errors = figures
        .iter()
        .find(|figure| figure.name == "error-over-time");
    assert!(errors.unwrap().svg.contains("0.42 m"));
    let table = Table::of(&experiment).to_string();
    assert!(table.contains("ORB-SLAM2") && table.contains("0.42"));
}

#[test]
fn views_of_places_seen_before_refine_the_walk_and_its_graph_can_be_read() {
    let mut protocol = protocol_with_views();
    protocol.steps = 2000;
    let experiment = Experiment::run(&protocol, 2, 11, NonZeroUsize::MIN, &|_| {}).unwrap();
    let report = Report::of(&experiment);
    let mean = |measure: &str| report.mean(measure).unwrap();
    // Ways hardly meet in three dimensions; what is found of them halves the drift.
    assert!(mean("closures") >= 10.0, "{report:?}");
    let [drift_m, causal_m, refined_m] = [
        "dead_reckoning_ate_rmse_m",
        "causal_ate_rmse_m",
        "refined_ate_rmse_m",
    ]
    .map(mean);
    assert!(causal_m < 0.75 * drift_m, "{report:?}");
    assert!(refined_m < 0.6 * drift_m, "{report:?}");
    let path = experiment.path().unwrap();
    let text = pose_graph::g2o::write_g2o(&path.experience);
    let graph = pose_graph::g2o::G2oGraph::read(&text).unwrap();
    assert_eq!(graph.poses().len(), path.experience.poses().count());
    let between = path.experience.links().filter(|link| {
        let is_closure = matches!(link, pose_graph::Link::Between { .. });
        is_closure || matches!(link, pose_graph::Link::Odometry { .. })
    });
    assert_eq!(graph.edges().len(), between.count());
}

fn protocol_with_views() -> Protocol {
    let mut protocol = Protocol::of_paper(Environment::ObstacleRich);
    protocol.walk = Walk::Persistent;
    protocol.percept = Percept::Descriptor(ViewSettings {
        every: 5,
        noise: 0.05,
    });
    protocol.odometry = OdometryNoise::default();
    protocol
}
