//! More descriptors than a search compares one by one.

use super::*;

/// Beyond this many descriptors a search compares sketches first.
const SCANNED_MAX: u32 = 100_000;
const DIMENSION: usize = 32;

/// Numbers from −1 to 1 that are the same on every run.
fn noise(key: u32) -> [f32; DIMENSION] {
    let mut state = u64::from(key) << 8;
    [(); DIMENSION].map(|()| {
        // The constants of SplitMix64.
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let bits = (state ^ (state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        f32::from(i16::from_le_bytes(
            bits.to_be_bytes()[..2].try_into().unwrap(),
        )) / 32768.0
    })
}

/// What is seen at a place: something of its own, and something that it has in common with its 99
/// neighbours.
fn view(place: u32) -> [f32; DIMENSION] {
    let (own, common) = (noise(place), noise(u32::MAX - place / 100));
    std::array::from_fn(|k| own[k] + common[k])
}

#[test]
fn one_of_very_many_places_is_recalled_by_what_was_seen_there() {
    // Places as close as they may be, so that a small map has many.
    let mut map = CognitiveMap::new(settings(|settings| {
        settings.field_radius_m = 0.001;
        settings.places_max = u32::MAX;
    }));
    let mut robot = Robot::enrol(&mut map);
    let places = SCANNED_MAX + 500;
    for place in 0..places {
        let at = [f64::from(place) * 0.01, 0.0, 0.0];
        robot.sample(&mut map, start_pose(at, [0.0; 3]));
        robot.ahead(&mut map, 0.0, 1);
        robot.sample(&mut map, descriptor("camera", &view(place)));
    }
    assert_eq!(map.place_count(), places as usize);
    let mut missed = 0;
    for query in 0..200_u32 {
        let place = query * 501 % places;
        let blur = noise(7_000_000 + query);
        let seen: [f32; DIMENSION] = std::array::from_fn(|k| view(place)[k] + 0.3 * blur[k]);
        let mut cue = view_cue(&seen);
        cue.limit = 3;
        let found = map.recall(&cue);
        assert_eq!(found.len(), 3);
        // A filter that lets all pass is put to every place.
        cue.since_ns = Some(i64::MIN);
        let exact = map.recall(&cue);
        let same = found.iter().filter(|found| exact.contains(found));
        missed += 3 - same.count();
        for recalled in &found {
            let again = exact.iter().find(|exact| exact.place == recalled.place);
            assert!(
                again.is_none_or(|again| again == recalled),
                "as likely either way"
            );
        }
    }
    assert!(
        missed <= 2,
        "{missed} of 600 answers of the scan were missed"
    );
}
