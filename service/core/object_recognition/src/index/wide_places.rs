//! Wide places: those whose variance would widen every search for all others.

use nalgebra::Point3;

use crate::index::lattice_index::LatticeIndex;
use crate::tuning::{GATE_SQUARED, SHARE_SAMPLES};

/// The few places of a model that are far less exact than the rest. They are searched one by one,
/// so that an index has to reach only as far as the others could be meant.
#[derive(Clone, Debug)]
pub(crate) struct WidePlaces {
    /// Their numbers among the packed places.
    pub(crate) numbers: Vec<u32>,
    /// Largest variance of the others \[m²\].
    pub(crate) narrow_max_m2: f32,
}

impl WidePlaces {
    /// Of places at these positions with these variances, in the order of their index: as many as
    /// it takes so that a touch with a variance of `touch_m2`, of an even sample of them, meets the
    /// fewest.
    pub(crate) fn new(
        lattice_index: &LatticeIndex,
        places: &[(Point3<f64>, f32)],
        touch_m2: f64,
    ) -> Self {
        let mut variances: Vec<f32> = places.iter().map(|(_, variance_m2)| *variance_m2).collect();
        variances.sort_unstable_by(|a, b| b.total_cmp(a));
        let step = places.len().div_ceil(SHARE_SAMPLES).max(1);
        let mut runs = Vec::new();
        let mut met = |variance_m2: f32| {
            let reach_m = (GATE_SQUARED * (touch_m2 + f64::from(variance_m2))).sqrt();
            let mut sum = 0;
            for (position, _) in places.iter().step_by(step) {
                lattice_index.runs(position, reach_m, &mut runs);
                let own = runs.iter().map(|run| (run.end - run.start) as usize);
                sum += own.sum::<usize>() * step;
            }
            sum
        };
        let widest = variances.first().copied().unwrap_or_default();
        let (mut narrow_max_m2, mut least) = (widest, met(widest));
        // Half of the places at most are one by one.
        let mut wide = 1;
        while 2 * wide < places.len() && wide * places.len() < least {
            let cost = wide * places.len() + met(variances[wide]);
            if cost < least {
                (narrow_max_m2, least) = (variances[wide], cost);
            }
            wide *= 2;
        }
        let is_wide = |(_, place): &(u32, &(Point3<f64>, f32))| place.1 > narrow_max_m2;
        let numbers = (0..).zip(places).filter(is_wide);
        Self {
            numbers: numbers.map(|(number, _)| number).collect(),
            narrow_max_m2,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tuning::GATE_SQUARED;

    /// A plate of so many places a side, 1 cm apart; every `wide`-th is known to 5 cm only.
    fn plate(side: u32, wide: u32) -> (LatticeIndex, Vec<(Point3<f64>, f32)>) {
        let at = |k: u32| Point3::new(f64::from(k % side), f64::from(k / side), 0.0) * 0.01;
        let positions: Vec<Point3<f64>> = (0..side * side).map(at).collect();
        let (lattice_index, order) = LatticeIndex::new(&positions);
        let variance = |k: u32| if k.is_multiple_of(wide) { 25e-4 } else { 1e-6 };
        let places = order.iter().map(|k| (positions[*k as usize], variance(*k)));
        (lattice_index, places.collect())
    }

    #[test]
    fn a_few_places_that_are_far_less_exact_stand_apart() {
        let (lattice_index, places) = plate(30, 100);
        let wide = WidePlaces::new(&lattice_index, &places, 1e-6);
        assert_eq!(wide.numbers.len(), 9);
        for (number, (_, variance_m2)) in (0..).zip(&places) {
            let is_wide = wide.numbers.contains(&number);
            assert_eq!(is_wide, *variance_m2 > 1e-3);
        }
        // What is left is searched no farther than it reaches.
        let reach_m = (GATE_SQUARED * f64::from(wide.narrow_max_m2)).sqrt();
        assert!(reach_m < 0.01, "{reach_m}");
    }

    #[test]
    fn places_that_are_all_alike_are_found_by_their_index() {
        for every in [1, 1000] {
            let (lattice_index, places) = plate(30, every);
            let wide = WidePlaces::new(&lattice_index, &places, 1e-6);
            assert!(wide.numbers.len() <= 1, "{wide:?}");
        }
        let none = WidePlaces::new(&LatticeIndex::new(&[]).0, &[], 1e-6);
        assert!(none.numbers.is_empty());
    }
}
