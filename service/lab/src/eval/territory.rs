//! Which locations have been visited before.

use std::collections::BTreeMap;

use nalgebra::Vector3;

/// Locations that lie farther than a threshold from each other (seed paper, Section 5.2 A).
///
/// "A point is said to be unique when the distance to all the previously known points is greater
/// than epsilon." Known points are the unique ones: if every point of the path were known, no step
/// shorter than epsilon could ever lead to a new location.
#[derive(Clone, Debug)]
pub(super) struct Territory {
    epsilon_m: f64,
    count: u64,
    /// By cells of epsilon's size, so that only neighbouring cells need to be looked at.
    known_m: BTreeMap<[i64; 3], Vec<Vector3<f64>>>,
}

impl Territory {
    /// Nothing visited yet.
    pub(super) fn new(epsilon_m: f64) -> Self {
        Self {
            epsilon_m,
            count: 0,
            known_m: BTreeMap::new(),
        }
    }

    /// Visits a position; whether it is a new location.
    pub(super) fn visit(&mut self, position_m: &Vector3<f64>) -> bool {
        #[expect(clippy::cast_possible_truncation, reason = "rooms have few cells")]
        let cell = (position_m / self.epsilon_m).map(|x| x.floor() as i64);
        let around = (0..27).map(|k| {
            let offset = Vector3::new(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1);
            <[i64; 3]>::from(cell + offset)
        });
        let near = |key| self.known_m.get(&key).into_iter().flatten();
        let epsilon_squared = self.epsilon_m * self.epsilon_m;
        let is_known =
            |known: &Vector3<f64>| (known - position_m).norm_squared() <= epsilon_squared;
        if around.flat_map(near).any(is_known) {
            return false;
        }
        self.count += 1;
        self.known_m
            .entry(cell.into())
            .or_default()
            .push(*position_m);
        true
    }

    /// Number of locations.
    pub(super) fn count(&self) -> u64 {
        self.count
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn equals_the_exhaustive_rule(
            path in prop::collection::vec(prop::array::uniform3(-1.0..1.0_f64), 1..200),
            epsilon in 0.05..0.8_f64,
        ) {
            let mut territory = Territory::new(epsilon);
            let mut known: Vec<Vector3<f64>> = Vec::new();
            for position in path.into_iter().map(Vector3::from) {
                let new = known.iter().all(|k| (k - position).norm() > epsilon);
                if new {
                    known.push(position);
                }
                prop_assert_eq!(territory.visit(&position), new);
                prop_assert_eq!(territory.count(), known.len() as u64);
            }
        }
    }

    #[test]
    fn going_back_and_forth_finds_nothing_new() {
        let mut territory = Territory::new(0.25);
        for _ in 0..3 {
            for k in (0..=10).chain((0..10).rev()) {
                territory.visit(&Vector3::new(f64::from(k) * 0.1, 0.0, 0.0));
            }
        }
        assert_eq!(territory.count(), 4); // at 0, 0.3, 0.6 and 0.9 m
    }
}
