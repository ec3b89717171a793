//! Coarse copies beside a comparison of the views themselves.

use random::Seeded;

use super::*;
use crate::descriptor::cosine;

const NUMBERS: usize = 72;

/// Unit vectors, some of them near one another.
fn vectors(count: u32, draws: &mut Seeded) -> Vec<Vec<f32>> {
    let vector = |number| {
        let phase = f64::from(number) * 0.02;
        let numbers = (0..NUMBERS).map(|k| {
            let wave = (phase * (1.0 + k as f64) + k as f64 * 2.4).sin();
            wave + 0.5 * (draws.uniform() - 0.5)
        });
        let numbers: Vec<f64> = numbers.collect();
        let length = numbers.iter().map(|x| x * x).sum::<f64>().sqrt();
        #[expect(clippy::cast_possible_truncation, reason = "a view")]
        let short = |x: &f64| (x / length) as f32;
        numbers.iter().map(short).collect()
    };
    (0..count).map(vector).collect()
}

/// Their copies, at every third number.
fn copies(vectors: &[Vec<f32>]) -> CoarseCopies {
    let mut copies = CoarseCopies::default();
    for (number, vector) in (0..).step_by(3).zip(vectors) {
        copies.push(number, vector, 1);
    }
    copies
}

#[test]
fn no_view_that_is_alike_is_ruled_out_and_most_others_are() {
    let vectors = vectors(500, &mut Seeded(7));
    let copies = copies(&vectors);
    for (cosine_min, from) in [(0.3, 0), (0.8, 300), (0.95, 961), (-1.0, 192), (1.0, 0)] {
        let (mut alike, mut found) = (0, 0);
        for query in vectors.iter().step_by(9) {
            let numbers = copies.alike(query, cosine_min, from);
            let all = (0..).step_by(3).zip(&vectors);
            let expected: Vec<usize> = all
                .filter(|(number, other)| {
                    *number >= from && cosine(other, query) >= f64::from(cosine_min)
                })
                .map(|(number, _)| number)
                .collect();
            assert!(expected.iter().all(|number| numbers.contains(number)));
            assert!(numbers.is_sorted() && numbers.first().is_none_or(|first| *first >= from));
            (alike, found) = (alike + expected.len(), found + numbers.len());
        }
        let most = alike + alike / 10 + 56;
        assert!(found <= most, "{found} of {alike} at {cosine_min}");
    }
}

#[test]
fn copies_have_about_the_angles_of_their_views() {
    let vectors = vectors(300, &mut Seeded(10));
    let copies = copies(&vectors);
    for (first, step) in [(0, 1), (64, 1), (4, 7), (200, 90), (300, 1)] {
        let mut numbers = Vec::new();
        for (number, angle_rad) in copies.angles_rad(&vectors[100], first, step) {
            let off = angle_rad.cos() - cosine(&vectors[number / 3], &vectors[100]);
            assert!(off.abs() < 0.01, "{off}");
            numbers.push(number);
        }
        let expected: Vec<usize> = (3 * first..900).step_by(3 * step).collect();
        assert_eq!(numbers, expected);
    }
}

#[test]
fn a_vector_of_zeros_is_like_none_and_breaks_nothing() {
    let mut vectors = vectors(3, &mut Seeded(8));
    vectors[0] = vec![0.0; NUMBERS];
    let copies = copies(&vectors);
    assert_eq!(copies.alike(&[0.0; NUMBERS], 0.5, 0), []);
    assert_eq!(copies.alike(&vectors[1], 0.99, 0), [3]);
    assert_eq!(copies.alike(&[], 0.5, 0), []);
}
