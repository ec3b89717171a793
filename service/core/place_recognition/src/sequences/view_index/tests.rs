//! The index beside a comparison with all.

use nalgebra::{Isometry3, Point3, Vector3};
use random::Seeded;

use super::*;
use crate::descriptor::cosine;
use crate::keyframes::SampleKey;

const NUMBERS: usize = 24;

/// Unit vectors, some of them near one another, on two channels.
fn views(count: u32, draws: &mut Seeded) -> Vec<StoredView> {
    let view = |ordinal: u32| {
        let at = Point3::new(f64::from(ordinal) * 0.1, draws.uniform(), 0.0);
        StoredView {
            channel: u8::from(ordinal % 3 == 2),
            sample: SampleKey {
                agent: 0,
                session: 1,
                seq: ordinal.into(),
            },
            ordinal,
            in_odom: Isometry3::identity(),
            in_map: at,
            spread: [0.0; 2],
            vector: vector(f64::from(ordinal) * 0.02, draws),
        }
    };
    (0..count).map(view).collect()
}

fn vector(phase: f64, draws: &mut Seeded) -> Box<[f32]> {
    let numbers = (0..NUMBERS).map(|k| {
        let wave = (phase * (1.0 + k as f64) + k as f64 * 2.4).sin();
        wave + 0.5 * (draws.uniform() - 0.5)
    });
    let numbers: Vec<f64> = numbers.collect();
    let length = numbers.iter().map(|x| x * x).sum::<f64>().sqrt();
    #[expect(clippy::cast_possible_truncation, reason = "a view")]
    let short = |x: &f64| (x / length) as f32;
    numbers.iter().map(short).collect()
}

#[test]
fn no_view_that_is_alike_is_ruled_out_and_most_others_are() {
    let mut draws = Seeded(7);
    let views = views(500, &mut draws);
    let index = ViewIndex::of(views.iter(), 1);
    for (cosine_min, from) in [(0.3, 0), (0.8, 100), (0.95, 321), (-1.0, 64), (1.0, 0)] {
        let (mut alike, mut found) = (0, 0);
        for query in views.iter().step_by(9) {
            let numbers = index.alike(query.channel, &query.vector, cosine_min, from);
            let is_alike = |number: &usize| {
                let other = &views[*number];
                other.channel == query.channel
                    && cosine(&other.vector, &query.vector) >= f64::from(cosine_min)
            };
            let expected: Vec<usize> = (from..views.len()).filter(is_alike).collect();
            assert!(expected.iter().all(|number| numbers.contains(number)));
            assert!(numbers.is_sorted());
            (alike, found) = (alike + expected.len(), found + numbers.len());
        }
        let most = alike + alike / 10 + 56;
        assert!(found <= most, "{found} of {alike} at {cosine_min}");
    }
}

#[test]
fn a_vector_of_zeros_is_like_none_and_breaks_nothing() {
    let mut draws = Seeded(8);
    let mut views = views(3, &mut draws);
    views[0].vector = vec![0.0; NUMBERS].into();
    let index = ViewIndex::of(views.iter(), 1);
    assert_eq!(index.alike(0, &[0.0; NUMBERS], 0.5, 0), Vec::<usize>::new());
    assert_eq!(index.alike(0, &views[1].vector, 0.9, 0), [1]);
}

#[test]
fn views_about_a_point_and_of_ordinals_are_all_there() {
    let mut draws = Seeded(9);
    let views = views(400, &mut draws);
    let index = ViewIndex::of(views.iter(), 1);
    let (at, apart) = (Point3::new(12.0, 0.5, 0.0), Vector3::repeat(2.0));
    let near: Vec<usize> = index.within([at - apart, at + apart]).collect();
    let expected = (0..views.len()).filter(|n| (views[*n].in_map - at).norm() <= 2.0);
    assert!({ expected }.all(|number| near.contains(&number)));
    assert!(near.len() <= 2 * VIEWS);
    let among: Vec<usize> = index.among(100..=130).collect();
    assert!((100..=130).all(|number| among.contains(&number)));
    assert!(among.len() <= 2 * VIEWS);
}
