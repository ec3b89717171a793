//! The index beside a search through all.

use nalgebra::{Isometry3, Point3, Vector3};
use random::Seeded;

use super::*;
use crate::keyframes::SampleKey;

/// Views along a way, on two channels.
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
            vector: vec![1.0, 0.0].into(),
        }
    };
    (0..count).map(view).collect()
}

#[test]
fn views_of_a_channel_are_numbered_among_all() {
    let mut draws = Seeded(10);
    let views = views(300, &mut draws);
    let index = ViewIndex::of(views.iter(), 1);
    let expected: Vec<usize> = (0..300).filter(|number| number % 3 == 2).collect();
    assert_eq!(index.of_channel(1).collect::<Vec<_>>(), expected);
    assert_eq!([0, 1, 2].map(|channel| index.count(channel)), [200, 100, 0]);
    let copies = index.copies(1).expect("views of the channel");
    assert_eq!(copies.alike(&views[101].vector, -1.0, 100), expected[33..]);
    assert!(index.copies(2).is_none());
}

#[test]
fn who_saw_a_view_and_when_is_known_of_each() {
    let mut draws = Seeded(11);
    let mut views = views(200, &mut draws);
    views[150].sample.session = 2;
    views[160].sample.agent = 1;
    let index = ViewIndex::of(views.iter(), 1);
    let is_recent = |number: &usize| index.is_recent(*number, &views[0].sample, 120);
    let found: Vec<usize> = (0..201).filter(is_recent).collect();
    let is_own = |number: &usize| ![150, 160].contains(number);
    let expected: Vec<usize> = (120..200).filter(is_own).collect();
    assert_eq!(found, expected);
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
