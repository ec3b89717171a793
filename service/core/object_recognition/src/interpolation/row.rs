//! Places in a row along a curve.

use nalgebra::{Point3, Vector3};

use super::graph::LinkGraph;
use super::tuning::{ROW_MIN, ROW_SIDE};

/// The places to either side of a point of a curve, each with its distance from that along the
/// curve \[m\]: the length of the links between them.
///
/// Over a straight line, two places of a bend may lie above one point, and those of the far side
/// near it. Along the curve each has its own.
#[derive(Clone, Debug)]
pub(super) struct Row(Vec<(u32, f64)>);

impl Row {
    /// About the middle of a link.
    pub(super) fn between(
        [from, to]: [u32; 2],
        positions: &[Point3<f64>],
        graph: &LinkGraph,
    ) -> Option<Self> {
        let half_m = 0.5 * (positions[from as usize] - positions[to as usize]).norm();
        Self::of([(from, to, half_m), (to, from, half_m)], positions, graph)
    }

    /// About a place with one neighbour on either side, by the others.
    pub(super) fn about(own: u32, positions: &[Point3<f64>], graph: &LinkGraph) -> Option<Self> {
        let [before, after] = graph.links[own as usize][..] else {
            return None;
        };
        let apart_m = |of: u32| (positions[own as usize] - positions[of as usize]).norm();
        let sides = [before, after].map(|of| (of, own, apart_m(of)));
        Self::of(sides, positions, graph)
    }

    /// From two places with these distances on, each away from another place. None where the row
    /// is too short to tell a bend.
    fn of(
        sides: [(u32, u32, f64); 2],
        positions: &[Point3<f64>],
        graph: &LinkGraph,
    ) -> Option<Self> {
        let mut row: Vec<(u32, f64)> = vec![(sides[0].0, -sides[0].2), (sides[1].0, sides[1].2)];
        let mut ends = sides.map(Some);
        for _ in 1..ROW_SIDE {
            // Both sides in turn: about a short ring they meet on its far side.
            for (end, sign) in ends.iter_mut().zip([-1.0, 1.0]) {
                let next = end.and_then(|(own, before, along_m)| {
                    // A curve leads on where a place has two links.
                    let next = match graph.links[own as usize][..] {
                        [a, b] if a == before => b,
                        [a, b] if b == before => a,
                        _ => return None,
                    };
                    let step_m = (positions[next as usize] - positions[own as usize]).norm();
                    let is_new = row.iter().all(|(place, _)| *place != next);
                    is_new.then_some((next, own, along_m + step_m))
                });
                row.extend(next.map(|(place, _, along_m)| (place, sign * along_m)));
                *end = next;
            }
        }
        row.sort_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
        (row.len() >= ROW_MIN).then_some(Self(row))
    }

    /// Its places, nearest first, each with its distance along the curve on the first axis \[m\].
    pub(super) fn iter(&self) -> impl Iterator<Item = (u32, Vector3<f64>)> + '_ {
        let own = self.0.iter();
        own.map(|(place, along_m)| (*place, Vector3::x() * *along_m))
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::Contact;
    use crate::indexed_model::IndexedModel;
    use crate::model::{ModelSettings, ObjectModel};

    /// A point of an outline of 6.5 cm with so many lobes of 1.5 cm.
    fn on_outline(lobes: u32, angle_rad: f64) -> Point3<f64> {
        let radius_m = 0.065 + 0.015 * (f64::from(lobes) * angle_rad).cos();
        Point3::new(radius_m * angle_rad.cos(), radius_m * angle_rad.sin(), 0.0)
    }

    /// So many places along it, equally far from one another.
    fn along(lobes: u32, count: usize) -> Vec<Point3<f64>> {
        let fine = (0..=20_000).map(|k| on_outline(lobes, TAU * f64::from(k) / 20_000.0));
        let fine: Vec<Point3<f64>> = fine.collect();
        let steps_m = fine.windows(2).map(|pair| (pair[1] - pair[0]).norm());
        let length_m: f64 = steps_m.clone().sum();
        let mut way_m = 0.0;
        let mut places = Vec::new();
        for (at, step_m) in fine.iter().zip(steps_m) {
            if way_m >= length_m * places.len() as f64 / count as f64 {
                places.push(*at);
            }
            way_m += step_m;
        }
        places.truncate(count);
        places
    }

    #[test]
    fn bends_of_an_outline_are_predicted_from_a_few_places() {
        for lobes in 0..=5 {
            let mut model = ObjectModel::new(ModelSettings::default());
            for (key, at) in (0_u64..).zip(along(lobes, 20)) {
                let off = |axis| 0.002 * (random::uniform(31, [u64::from(lobes), key, axis]) - 0.5);
                let at = at + Vector3::new(off(0), off(1), off(2));
                model.learn(&Contact::at(at, 0.001).with_level(0, at.x, 0.01));
            }
            let (indexed, _) = IndexedModel::variants(&model);
            let predicted = { indexed.places.iter() }.filter(|place| place.prediction.is_some());
            let offs = predicted.map(|place| {
                let all = (0..4_000).map(|k| on_outline(lobes, TAU * f64::from(k) / 4_000.0));
                all.map(|at| (at - place.position).norm())
                    .fold(f64::INFINITY, f64::min)
            });
            let offs: Vec<f64> = offs.collect();
            let square = offs.iter().map(|off| off * off).sum::<f64>() / offs.len() as f64;
            assert!(square.sqrt() < 0.0015, "{lobes}: {}", square.sqrt());
        }
    }

    #[test]
    fn a_row_ends_where_a_curve_branches_or_its_other_side_begins() {
        let at = |k: f64| Point3::new(0.01 * k, 0.0, 0.0);
        let mut places: Vec<Point3<f64>> = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0].map(at).to_vec();
        let graph = LinkGraph::new(&places);
        let row = Row::between([2, 3], &places, &graph).expect("a row");
        let mut along: Vec<(u32, f64)> = row.iter().map(|(place, at)| (place, at.x)).collect();
        assert_eq!(
            along[..2].iter().map(|own| own.0).sum::<u32>(),
            5,
            "{along:?}"
        );
        along.sort_by_key(|own| own.0);
        for (number, (place, along_m)) in (0u32..).zip(along) {
            let expected_m = 0.01 * (f64::from(number) - 2.5);
            let is_there = place == number && (along_m - expected_m).abs() < 1e-12;
            assert!(is_there, "{place}: {along_m}");
        }
        // Without itself, and not beyond its end.
        let row = Row::about(1, &places, &graph).expect("a row");
        let mut places_of_row: Vec<u32> = row.iter().map(|own| own.0).collect();
        places_of_row.sort_unstable();
        assert_eq!(places_of_row, [0, 2, 3, 4, 5]);
        assert!(Row::about(0, &places, &graph).is_none());
        // On a ring the sides meet.
        for count in [5_u32, 6, 7, 8, 9, 12] {
            let at = |k: u32| {
                let (sin, cos) = (TAU * f64::from(k) / f64::from(count)).sin_cos();
                Point3::new(0.05 * cos, 0.05 * sin, 0.0)
            };
            let ring: Vec<Point3<f64>> = (0..count).map(at).collect();
            let row = Row::between([0, 1], &ring, &LinkGraph::new(&ring)).expect("a row");
            let mut of_row: Vec<(u32, f64)> = row.iter().map(|(own, at)| (own, at.x)).collect();
            of_row.sort_by_key(|own| own.0);
            of_row.dedup_by_key(|own| own.0);
            assert_eq!(of_row.len(), count.min(8) as usize, "{of_row:?}");
            let step_m = 0.1 * (0.5 * TAU / f64::from(count)).sin();
            for (own, along_m) in of_row {
                // No place is nearer the other way round.
                let steps = along_m.abs() / step_m;
                assert!(
                    steps < 0.5 * f64::from(count) + 0.1,
                    "{count}: {own} {along_m}"
                );
            }
        }
        // From the place in the middle a third way leads on.
        places.extend([1.0, 2.0].map(|k| Point3::new(0.03, 0.01 * k, 0.0)));
        let graph = LinkGraph::new(&places);
        assert!(Row::about(3, &places, &graph).is_none());
        assert!(Row::between([1, 2], &places, &graph).is_none());
    }
}
