//! What a code tells, as a user sees it.

use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicU64, Ordering};

use cognitive_map::Settings;
use grid::decode;

use super::*;
use crate::eval::InvalidProtocol;

fn small() -> CodeProtocol {
    CodeProtocol {
        places: 2000,
        queries: 60,
        ..CodeProtocol::default()
    }
}

#[test]
fn exact_and_partly_erased_codes_recall_the_right_place() {
    let recalled = AtomicU64::new(0);
    let watch = |queries| {
        recalled.fetch_add(queries, Ordering::Relaxed);
    };
    let report = CodeReport::measure(&small(), NonZeroUsize::MIN, &watch).unwrap();
    assert_eq!(report.rows.len(), Condition::ALL.len());
    for condition in ["whole", "one erased", "two erased"] {
        let row = report.row(condition).unwrap();
        assert!(row.right >= 1.0 && row.right_worst >= 1.0, "{row:?}");
        assert!(row.beyond_half_m <= 0.0);
    }
    assert!(report.row("whole").unwrap().rivals <= 0.0);
    // Noise of 5 % is claimed to leave 99.9 % right, and 97 % with two modules erased.
    for (condition, least) in [
        ("jittered", 1.0),
        ("noisy", 0.95),
        ("noisy, two erased", 0.9),
    ] {
        let row = report.row(condition).unwrap();
        assert!(
            row.right >= least && row.right_worst <= row.right,
            "{row:?}"
        );
    }
    let queries: u64 = report.rows.iter().map(|row| row.queries).sum();
    assert_eq!(recalled.into_inner(), queries);
    assert_eq!(CodeReport::queries(&Condition::ALL, &small()), queries);
    let text = report.to_string();
    assert!(text.contains("noisy, two erased") && !text.contains("NaN"));
}

#[test]
fn the_report_does_not_depend_on_the_number_of_threads() {
    let measure = |threads| {
        let threads = NonZeroUsize::new(threads).unwrap();
        CodeReport::measure(&small(), threads, &|_| {}).unwrap()
    };
    assert_eq!(measure(1), measure(3));
    let other = CodeProtocol { seed: 2, ..small() };
    let other = CodeReport::measure(&other, NonZeroUsize::MIN, &|_| {}).unwrap();
    assert_ne!(measure(1).rows, other.rows);
}

/// Least squares is efficient while the noise is small, so decoding comes as close as the Fisher
/// information allows.
#[test]
fn decoding_is_as_precise_as_the_fisher_information_says() {
    let settings = Settings::default();
    let map = survey(50, settings.clone(), 3).unwrap();
    let s = 0.02;
    let damage = Damage {
        phase_noise_turns: s,
        ..Damage::default()
    };
    let mut cues = CueSource::new(3, 0);
    let mut squared = 0.0;
    for _ in 0..2000 {
        let drawn = cues.draw(&map, &damage).unwrap();
        let code = drawn.cue.code.unwrap();
        let found = decode(map.modules(), &code, Some(drawn.position), 0.5);
        squared += (found.position - drawn.position).norm_squared();
    }
    let sd_m = (squared / 6000.0_f64).sqrt();
    let theory = CodeTheory::of(&settings, s, 1);
    // 6000 numbers give a standard deviation to 0.9 %; four times that, and the second order of s.
    assert!(
        (sd_m / theory.position_sd_m - 1.0).abs() < 0.05,
        "{sd_m} {}",
        theory.position_sd_m
    );
}

#[test]
fn a_survey_keeps_its_distances_and_its_density() {
    let map = survey(1000, Settings::default(), 5).unwrap();
    assert_eq!(map.place_count(), 1000);
    let places: Vec<_> = map.places().map(|(_, place)| *place.position()).collect();
    for (k, place) in places.iter().enumerate() {
        assert!(place.iter().all(|x| x.abs() <= 2.5));
        assert!(
            places[..k]
                .iter()
                .all(|other| (place - other).norm() >= 0.25)
        );
    }
}

#[test]
fn codes_side_by_side_end_with_the_one_asked_for() {
    let protocol = CodeProtocol {
        places: 100,
        queries: 15,
        ..CodeProtocol::default()
    };
    let comparison = CodeComparison::measure(&protocol, 1, NonZeroUsize::MIN, &|_| {}).unwrap();
    assert_eq!(comparison.rows.len(), CANDIDATES.len() + 1);
    let own = comparison.rows.last().unwrap();
    assert_eq!(own.code.grid_modules, protocol.settings.grid_modules);
    for row in &comparison.rows {
        assert!(row.recall_over_nearest.iter().all(|ratio| *ratio >= 1.0));
    }
    assert!(!comparison.to_string().contains("NaN"));
}

#[test]
fn senseless_protocols_are_refused() {
    let refused = |protocol: CodeProtocol| protocol.check().unwrap_err();
    let none = CodeProtocol {
        places: 0,
        ..small()
    };
    assert_eq!(refused(none), InvalidProtocol::Places);
    let none = CodeProtocol {
        queries: 0,
        ..small()
    };
    assert_eq!(refused(none), InvalidProtocol::Queries);
    for phase_noise_turns in [0.0, -0.1, f64::NAN, 1.5] {
        let wild = CodeProtocol {
            phase_noise_turns,
            ..small()
        };
        assert_eq!(refused(wild), InvalidProtocol::Damage);
    }
    let mut flat = small();
    flat.settings.grid_ratio = 1.0;
    assert!(matches!(refused(flat), InvalidProtocol::Settings(_)));
}
