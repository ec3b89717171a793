//! Similar views of a memory, beside a comparison with all.

use geometry::PoseCovariance;
use random::Seeded;

use super::*;

const NUMBERS: usize = 24;
const PLACES: u32 = 700;

/// Views of two channels, some of each place: three of four of the first one.
fn memory(count: u32, draws: &mut Seeded) -> ViewMemory {
    let mut memory = ViewMemory::default();
    for channel in ["laser", "camera"] {
        let vector = view(0, draws);
        let seen = View {
            sample: SampleKey {
                agent: 0,
                session: 0,
                seq: 0,
            },
            in_odom: Isometry3::identity(),
            pose: Isometry3::identity(),
            covariance: PoseCovariance::zero(),
            channel,
            vector: &vector,
        };
        let channel = memory.channel_of(&seen).unwrap();
        for step in 0..4000_u32 {
            let apart = f64::from(step % 100) * 0.015;
            memory.channels[usize::from(channel)].learn(0, apart, apart);
        }
    }
    for ordinal in 0..count {
        let channel = u8::from(ordinal % 4 == 3);
        memory.remember(stored(channel, ordinal, draws), 1);
    }
    memory
}

/// Unit vectors of a place, off by noise.
fn view(place: u32, draws: &mut Seeded) -> Vec<f32> {
    let mut of_place = Seeded(place.into());
    let numbers: Vec<f64> = (0..NUMBERS)
        .map(|_| of_place.normal() + 0.1 * draws.normal())
        .collect();
    let length = numbers.iter().map(|x| x * x).sum::<f64>().sqrt();
    #[expect(clippy::cast_possible_truncation, reason = "a view")]
    let short = |x: &f64| (x / length) as f32;
    numbers.iter().map(short).collect()
}

fn stored(channel: u8, ordinal: u32, draws: &mut Seeded) -> StoredView {
    StoredView {
        channel,
        sample: SampleKey {
            agent: 0,
            session: 0,
            seq: ordinal.into(),
        },
        ordinal,
        in_odom: Isometry3::identity(),
        in_map: Point3::origin(),
        spread: [0.0; 2],
        vector: view(ordinal % PLACES, draws).into(),
    }
}

/// Each similar view is found once, in order, and no other one.
fn assert_all_are_found(memory: &mut ViewMemory, draws: &mut Seeded) {
    // What unrelated views are like is not known before there are any.
    for channel in [0, 1] {
        let mut first = stored(channel, 0, draws);
        first.sample.session = 1;
        memory.similar_earlier(&first);
    }
    let mut n_found = 0;
    for query in 0..40_u32 {
        let channel = u8::from(query % 2 == 1);
        let mut view = stored(channel, 17 * query + u32::from(query % 2 == 0), draws);
        view.sample.session = 1;
        let (similar, _) = memory.similar_earlier(&view);
        let similar: Vec<usize> = similar.iter().map(|(number, _)| *number).collect();
        assert!(similar.is_sorted_by(|a, b| a < b), "{similar:?}");
        let model = &memory.channels[usize::from(channel)];
        let is_similar = |(number, other): (usize, &StoredView)| {
            let angle_rad = angle_rad(&other.vector, &view.vector);
            let is_similar = other.channel == channel && model.distance(angle_rad).is_some();
            is_similar.then_some(number)
        };
        let expected = memory.stored.iter().enumerate().filter_map(is_similar);
        assert_eq!(similar, expected.collect::<Vec<_>>(), "query {query}");
        n_found += similar.len();
    }
    assert!(n_found > 10, "{n_found}");
}

#[test]
fn all_similar_views_are_found_among_few_and_among_many() {
    let mut draws = Seeded(3);
    for count in [1200, 6000] {
        let mut memory = memory(count, &mut draws);
        assert_all_are_found(&mut memory, &mut draws);
        // Numbers change where views are forgotten.
        let since = SampleKey {
            agent: 0,
            session: 0,
            seq: u64::from(count) / 2,
        };
        memory.forget_since(since, 1);
        assert_all_are_found(&mut memory, &mut draws);
        for ordinal in 0..count / 2 {
            memory.remember(stored(0, ordinal, &mut draws), 1);
        }
        assert_all_are_found(&mut memory, &mut draws);
    }
}

#[test]
fn few_views_of_a_channel_are_all_compared_beside_many_of_another() {
    let mut draws = Seeded(4);
    let mut memory = memory(0, &mut draws);
    for ordinal in 0..5000 {
        memory.remember(stored(u8::from(ordinal % 50 == 0), ordinal, &mut draws), 1);
    }
    let mut view = stored(1, 0, &mut draws);
    view.sample.session = 1;
    // A hundred views say what unrelated ones are like.
    memory.similar_earlier(&view);
    assert!(memory.channels[1].reach_m().is_some());
    assert!(memory.channels[0].reach_m().is_none());
}

/// What unrelated views are like is learned from every so many of them, others with each view, as
/// if these were compared themselves.
#[test]
fn what_unrelated_views_are_like_is_learned_from_some_of_many() {
    let mut draws = Seeded(5);
    let mut memory = memory(0, &mut draws);
    let count = 2600_usize;
    for ordinal in 0..2600 {
        memory.remember(stored(0, ordinal, &mut draws), 1);
    }
    let stride = count.div_ceil(tuning::DRAWN);
    let mut expected = memory.channels[0].clone();
    for ordinal in [2600_u32, 2601, 2610] {
        let view = stored(0, ordinal, &mut draws);
        let first = ordinal as usize % stride;
        for number in (first..count).step_by(stride) {
            if number + (tuning::EARLIER as usize) < ordinal as usize {
                let other = memory.stored.get(number).unwrap();
                let angle_rad = angle_rad(&other.vector, &view.vector);
                expected.learn_unrelated(angle_rad, Pairs::new(stride));
            }
        }
        memory.similar_earlier(&view);
        let learned = &memory.channels[0];
        let off = learned.news_rad() - expected.news_rad();
        assert!(off.abs() < 1e-3, "{ordinal}: {off}");
        let cosines = [learned, &expected].map(|model| model.similar_cosine().unwrap());
        assert!((cosines[0] - cosines[1]).abs() < 3e-3, "{cosines:?}");
    }
}
