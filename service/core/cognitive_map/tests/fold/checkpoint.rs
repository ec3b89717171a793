//! Checkpoints: a restored map is the map, and damage is found.

use std::collections::BTreeMap;

use cognitive_map::{
    CheckpointPage, CognitiveMap, CorruptCheckpoint, Lesson, ObjectMark, Record, SampleBody,
    Settings, Spacing, Touch, TouchNoise,
};
use object_recognition::Orientation;
use proptest::prelude::*;

use crate::any_journal::{any_settings, journals};
use crate::journal::{Robot, descriptor, label, level, run, settings, sighting};

type Store = BTreeMap<(u8, u32), Vec<u8>>;

/// Lays pages over those stored, as a store does; those of no bytes remove one.
fn keep(store: &mut Store, pages: impl Iterator<Item = CheckpointPage>) {
    for page in pages {
        if page.bytes.is_empty() {
            store.remove(&(page.kind, page.index));
        } else {
            store.insert((page.kind, page.index), page.bytes);
        }
    }
}

/// All pages that hold something.
fn whole(map: &CognitiveMap) -> Vec<CheckpointPage> {
    let pages = map.checkpoint(0);
    pages.filter(|page| !page.bytes.is_empty()).collect()
}

fn pages(store: &Store) -> Vec<CheckpointPage> {
    let page = |(&(kind, index), bytes): (&(u8, u32), &Vec<u8>)| CheckpointPage {
        kind,
        index,
        bytes: bytes.clone(),
    };
    store.iter().map(page).collect()
}

/// A map in which there is something of everything, in several pages.
fn rich_map() -> CognitiveMap {
    let mut map = CognitiveMap::new(Settings::default());
    let mut robots: Vec<_> = (0..6).map(|_| Robot::enrol(&mut map)).collect();
    for (row, robot) in (0i32..).zip(&mut robots) {
        robot.sample(
            &mut map,
            crate::journal::start_pose([0.0, f64::from(row), 0.0], [0.0; 3]),
        );
        for step in 0..60 {
            robot.go(&mut map, [0.3, 0.0, 0.0], [0.0; 3]);
            let label = format!("landmark-{row}-{}", step % 20);
            robot.sample(&mut map, sighting(&label, [1.0, 2.0, 0.0], 0.1));
            robot.sample(&mut map, level("touch", f64::from(step), [0.0; 3]));
            let view: Vec<f32> = (0i16..32)
                .map(|k| f32::from(k % 7 - i16::try_from(row).unwrap()))
                .collect();
            robot.sample(&mut map, descriptor("camera", &view));
        }
    }
    let noise = TouchNoise::new(0.002, 0.03, 0.1).unwrap();
    for (name, number) in [("cup", 0), ("ball", 1)].map(|(name, number)| (label(name), number)) {
        let touches = (0..9).map(|k| Touch::new([f64::from(k), 0.0, 0.0], noise).unwrap());
        let lesson = Lesson::new(Spacing::default(), touches.collect());
        run(
            &mut map,
            &[Record::TeachObject {
                number,
                name,
                lesson,
            }],
        );
    }
    robots[0].sample(
        &mut map,
        SampleBody::Object(ObjectMark::Identify {
            orientation: Orientation::Known,
            noise,
            learns: true,
        }),
    );
    robots[0].sample(&mut map, level("touch", 1.0, [0.0; 3]));
    assert!(map.place_count() > 64 && map.landmark_count() > 64 && map.trip_count() >= 6);
    let remembering = map
        .places()
        .filter(|(place, _)| map.remembered(*place).count() == 2);
    assert!(remembering.count() > 64);
    map
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    /// Full once, then only what changed; restored at every cut, and carried on from there.
    #[test]
    fn a_restored_map_goes_on_like_the_original(
        settings in any_settings(),
        records in journals(),
        every in 1usize..40,
    ) {
        let mut map = CognitiveMap::new(settings.clone());
        let mut store = Store::new();
        let mut saved = 0;
        for chunk in records.chunks(every) {
            let mut restored = if store.is_empty() {
                map.clone()
            } else {
                CognitiveMap::restore(settings.clone(), pages(&store)).unwrap()
            };
            prop_assert_eq!(restored.digest(), map.digest());
            prop_assert_eq!(restored.revision(), map.revision());
            prop_assert_eq!(run(&mut restored, chunk), run(&mut map, chunk));
            prop_assert_eq!(restored.digest(), map.digest());
            // What the restored map has to save is what the original has to save.
            let since_restart: Vec<_> = restored.checkpoint(saved).collect();
            prop_assert_eq!(&since_restart, &map.checkpoint(saved).collect::<Vec<_>>());
            keep(&mut store, since_restart.into_iter());
            let mut whole = whole(&map);
            whole.sort_by_key(|page| (page.kind, page.index));
            prop_assert_eq!(pages(&store), whole);
            saved = map.revision();
        }
    }

    #[test]
    fn arbitrary_pages_are_refused(
        noise in prop::collection::vec(
            (
                0u8..10,
                prop_oneof![0u32..3, any::<u32>()],
                prop::collection::vec(any::<u8>(), 0..99),
            ),
            0..9,
        ),
        with_header in any::<bool>(),
    ) {
        let mut store = Store::new();
        if with_header {
            keep(&mut store, rich_map().checkpoint(0).take(1));
        }
        for (kind, index, bytes) in noise {
            store.insert((kind, index), bytes);
        }
        prop_assert!(CognitiveMap::restore(Settings::default(), pages(&store)).is_err());
    }
}

#[test]
fn any_damage_is_found() {
    let map = rich_map();
    let whole: Vec<_> = map.checkpoint(0).collect();
    let restore = |pages: Vec<CheckpointPage>| CognitiveMap::restore(Settings::default(), pages);
    assert_eq!(restore(whole.clone()).unwrap().digest(), map.digest());
    for (at, page) in whole.iter().enumerate() {
        let with = |bytes: Vec<u8>| {
            let mut pages = whole.clone();
            pages[at].bytes = bytes;
            restore(pages)
        };
        // A prime stride visits all offsets within the items over the pages.
        for place in (0..page.bytes.len())
            .step_by(499)
            .chain([page.bytes.len() - 1])
        {
            assert!(
                with(page.bytes[..place].to_vec()).is_err(),
                "truncated at {place}"
            );
            let mut bytes = page.bytes.clone();
            bytes[place] ^= 1;
            assert!(with(bytes).is_err(), "a bit of byte {place} of page {at}");
        }
        assert!(
            with([&page.bytes[..], &[0]].concat()).is_err(),
            "a byte too many"
        );
        let mut missing = whole.clone();
        missing.remove(at);
        assert!(restore(missing).is_err(), "page {at} is missing");
        let mut extra = whole.clone();
        extra.push(CheckpointPage {
            index: page.index + 999,
            ..page.clone()
        });
        assert!(restore(extra).is_err(), "page {at} twice");
    }
}

#[test]
fn pages_of_another_time_are_found() {
    let mut map = rich_map();
    let before: Vec<_> = map.checkpoint(0).collect();
    let mut robot = Robot::enrol(&mut map);
    robot.sample(&mut map, crate::journal::start_pose([0.0; 3], [0.0; 3]));
    robot.go(&mut map, [0.1, 0.0, 0.0], [0.0; 3]);
    let mut after: Vec<_> = map.checkpoint(0).collect();
    after.truncate(before.len());
    after[0] = before[0].clone();
    let result = CognitiveMap::restore(Settings::default(), after);
    assert_eq!(result.unwrap_err(), CorruptCheckpoint::DigestMismatch);
}

#[test]
fn only_what_changed_is_saved_again() {
    let mut map = rich_map();
    let saved = map.revision();
    assert_eq!(map.checkpoint(saved).count(), 1, "the header alone");
    let mut robot = Robot {
        id: cognitive_map::AgentId(0),
        session: 1,
        seq: 243,
        stamp_ns: 24_300_000_000,
    };
    robot.sample(&mut map, crate::journal::marker("here", false));
    let kinds: Vec<_> = map
        .checkpoint(saved)
        .map(|page| (page.kind, page.index))
        .collect();
    let expected = [(0, 0), (1, 0), (9, 0), (10, 0), (32, 0)];
    let named = "header, agent's page, estimate, keyframes, head of the objects";
    assert_eq!(kinds, expected, "{named}");
}

#[test]
fn wrong_headers_are_told_apart() {
    let map = rich_map();
    let mut pages: Vec<_> = map.checkpoint(0).collect();
    let other = settings(|values| values.seed = 1);
    assert_eq!(
        CognitiveMap::restore(other, pages.clone()).unwrap_err(),
        CorruptCheckpoint::OtherSettings
    );
    assert_eq!(
        CognitiveMap::restore(Settings::default(), pages[1..].to_vec()).unwrap_err(),
        CorruptCheckpoint::NoHeader
    );
    pages[0].bytes[0] = 1;
    assert_eq!(
        CognitiveMap::restore(Settings::default(), pages).unwrap_err(),
        CorruptCheckpoint::UnknownVersion { found: 1 }
    );
}
