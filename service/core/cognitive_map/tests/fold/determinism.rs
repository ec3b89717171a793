//! The same records give the same map, whatever else happens meanwhile.

use cognitive_map::{CognitiveMap, Motion, Record, SampleBody, Settings};
use proptest::prelude::*;

use crate::any_journal::{any_settings, journals};
use crate::journal::run;

/// The records that had an effect, in order.
fn effective(settings: &Settings, records: &[Record]) -> Vec<Record> {
    let mut map = CognitiveMap::new(settings.clone());
    let mut effective = Vec::new();
    for record in records {
        let before = (map.revision(), map.digest());
        let events = run(&mut map, std::slice::from_ref(record));
        if map.revision() > before.0 {
            assert_eq!(map.revision(), before.0 + 1);
            effective.push(record.clone());
        } else {
            assert!(events.is_empty(), "a record without effect has no events");
            assert_eq!(map.digest(), before.1, "nor does it change the digest");
        }
    }
    effective
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// However far motions lead and however sure sightings are of themselves, the past can be
    /// relaxed, and a map that goes on from a checkpoint has the same one.
    #[test]
    fn the_past_of_any_journal_can_be_refined(
        settings in any_settings(), records in journals(),
    ) {
        let mut map = CognitiveMap::new(settings.clone());
        run(&mut map, &records);
        let refined = map.refined();
        for pose in refined.agents.iter().flat_map(|agent| &agent.poses) {
            let (position, rotation) = (pose.pose.translation.vector, pose.pose.rotation.coords);
            let numbers = position.iter().chain(rotation.iter());
            prop_assert!(numbers.copied().all(f64::is_finite), "{:?}", pose);
        }
        for (_, agent) in map.agents() {
            prop_assert!(agent.pose().translation.vector.iter().all(|x| x.is_finite()));
        }
        let restored = CognitiveMap::restore(settings, map.checkpoint(0)).unwrap();
        prop_assert!(restored.refined() == refined);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    #[test]
    fn duplicates_change_nothing(
        settings in any_settings(),
        records in journals(),
        repeats in prop::collection::vec((any::<prop::sample::Index>(), 0usize..9), 0..60),
    ) {
        let once = effective(&settings, &records);
        let mut map = CognitiveMap::new(settings.clone());
        let events = run(&mut map, &once);

        // After each record some of the records up to it come again, singly or as a whole batch.
        let mut repeated = CognitiveMap::new(settings.clone());
        let mut repeated_events = Vec::new();
        let mut repeats = repeats.iter().cycle();
        for end in 1..=once.len() {
            repeated.apply(&once[end - 1], &mut repeated_events);
            if let Some((start, len)) = repeats.next() {
                let start = start.index(end);
                for record in &once[start..(start + len).min(end)] {
                    repeated.apply(record, &mut repeated_events);
                }
            }
        }
        prop_assert_eq!(repeated_events, events);
        prop_assert_eq!(repeated.digest(), map.digest());
        prop_assert_eq!(repeated.revision(), once.len() as u64);

        let mut whole = CognitiveMap::new(settings);
        run(&mut whole, &records);
        prop_assert_eq!(whole.digest(), map.digest());
    }

    #[test]
    fn snapshots_stand_still_while_the_map_goes_on(
        settings in any_settings(),
        records in journals(),
        other in journals(),
        every in 1usize..20,
    ) {
        let mut plain = CognitiveMap::new(settings.clone());
        let plain_events = run(&mut plain, &records);

        let mut map = CognitiveMap::new(settings);
        let mut events = Vec::new();
        let mut snapshots = Vec::new();
        for chunk in records.chunks(every) {
            let snapshot = map.clone();
            let pages: Vec<_> = snapshot.checkpoint(0).collect();
            snapshots.push((snapshot, pages));
            // Another branch of time grows from the same memory, and must not be felt.
            let mut branch = map.clone();
            run(&mut branch, &other);
            events.extend(run(&mut map, chunk));
        }
        prop_assert_eq!(events, plain_events);
        prop_assert_eq!(map.digest(), plain.digest());
        for (snapshot, pages) in snapshots {
            prop_assert_eq!(snapshot.checkpoint(0).collect::<Vec<_>>(), pages);
        }
    }

    #[test]
    fn a_changed_motion_changes_the_digest(
        settings in any_settings(),
        records in journals(),
        which in any::<prop::sample::Index>(),
    ) {
        let mut once = effective(&settings, &records);
        let is_motion = |record: &Record| {
            let Record::Sample { sample, .. } = record else {
                return false;
            };
            matches!(sample.body, SampleBody::Motion(_))
        };
        let motions: Vec<_> = (0..once.len()).filter(|&at| is_motion(&once[at])).collect();
        prop_assume!(!motions.is_empty());
        let changed = motions[which.index(motions.len())];
        let mut map = CognitiveMap::new(settings.clone());
        run(&mut map, &once[..=changed]);
        if let Record::Sample { sample, .. } = &mut once[changed] {
            let body = Motion::from_increment([0.125, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0], None);
            sample.body = SampleBody::Motion(body.unwrap());
        }
        let mut other = CognitiveMap::new(settings);
        run(&mut other, &once[..=changed]);
        prop_assert_eq!(other.revision(), map.revision());
        prop_assert_ne!(other.digest(), map.digest());
    }
}

#[test]
fn settings_are_part_of_the_digest() {
    let digest = |seed| {
        let settings = crate::journal::settings(|values| values.seed = seed);
        CognitiveMap::new(settings).digest()
    };
    assert_eq!(digest(1), digest(1));
    assert_ne!(digest(1), digest(2));
}
