//! Shortlist: the places about a point, of which searches at neighbouring points choose.

use nalgebra::{Point3, Vector3};

use crate::index::packed_places::PackedPlaces;
use crate::numeric::to_f32;
use crate::tuning::{GATE_SQUARED, SHORTLIST_SLACK, SHORTLIST_WIDEST};

/// Places that are compared at once.
const LANES: usize = 8;

/// A place near the point of a search.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct NearPlace {
    pub(crate) number: u32,
    /// Its number in the list.
    listed: u32,
    /// Squared distance from the point \[m²\].
    pub(crate) square: f32,
    /// Variance of that offset, per axis \[m²\].
    pub(crate) variance: f32,
}

/// Positions from the model's middle \[m\], axis by axis, and variances per axis \[m²\] of places
/// that are compared at once.
#[derive(Clone, Copy, Debug)]
struct Block {
    axes: [[f32; LANES]; 3],
    variances: [f32; LANES],
}

/// Places about a point, and those of them that were found last.
///
/// Hypotheses of one model mostly predict a touch near one another. So the places about one
/// prediction are listed once, and the next predictions search that list. What is found does not
/// depend on the searches before.
#[derive(Debug, Default)]
pub(crate) struct Shortlist {
    /// Every place in this ball is listed, and every wide place wherever it is. None before the
    /// first search in a model.
    ball: Option<(Point3<f64>, f64)>,
    /// Whether the next search is expected to have others beside it.
    has_slack: bool,
    numbers: Vec<u32>,
    blocks: Vec<Block>,
    /// Point of the last search, from the model's middle \[m\].
    at: [f32; 3],
    found: Vec<NearPlace>,
}

impl Shortlist {
    /// The searches that follow are elsewhere, or in another model: several beside one another, or
    /// one alone.
    pub(crate) fn begin(&mut self, several: bool) {
        self.ball = None;
        self.has_slack = several;
    }

    /// Finds the places that a point with this variance per axis \[m²\] could be of, in the order
    /// of their numbers, then the wide ones. Before the first search in another model,
    /// [`begin`](Self::begin) must come.
    pub(crate) fn find(&mut self, packed: &PackedPlaces, point: &Point3<f64>, variance_m2: f64) {
        let reach_m = packed.rounded_reach_m(variance_m2);
        let apart_m = self.ball.map(|(middle, _)| (point - middle).norm());
        let is_listed = { self.ball.zip(apart_m) }.is_some_and(|((_, radius_m), apart_m)| {
            apart_m + reach_m <= radius_m && radius_m <= SHORTLIST_WIDEST * reach_m
        });
        if !is_listed {
            let slack_m = SHORTLIST_SLACK * reach_m;
            // What lies apart from the search before does so from the next one, mostly.
            let has_slack = apart_m.map_or(self.has_slack, |apart_m| apart_m <= slack_m);
            let radius_m = reach_m + if has_slack { slack_m } else { 0.0 };
            self.list(packed, point, radius_m);
        }
        self.at = (point - packed.middle).map(to_f32).into();
        self.choose(to_f32(variance_m2));
    }

    /// The places that were found last.
    pub(crate) fn found(&self) -> &[NearPlace] {
        &self.found
    }

    /// Offset of one of them from the point of the search \[m\].
    pub(crate) fn apart(&self, near: &NearPlace) -> Vector3<f32> {
        let listed = near.listed as usize;
        let block = &self.blocks[listed / LANES];
        Vector3::from_fn(|axis, _| block.axes[axis][listed % LANES] - self.at[axis])
    }

    /// Lists all places within a ball, and some others.
    fn list(&mut self, packed: &PackedPlaces, middle: &Point3<f64>, radius_m: f64) {
        self.ball = Some((*middle, radius_m));
        let Self {
            numbers, blocks, ..
        } = self;
        numbers.clear();
        packed.lattice_index.for_each_run(middle, radius_m, |run| {
            numbers.extend(run);
        });
        let wide = &packed.wide;
        if !wide.numbers.is_empty() {
            let is_wide =
                |number: &u32| packed.all[*number as usize].variance_m2 > wide.narrow_max_m2;
            numbers.retain(|number| !is_wide(number));
            numbers.extend(&wide.numbers);
        }
        // Unused lanes hold NaN, which no comparison finds: `choose` must ask `<=`, not the
        // negation of `>`.
        let unused = Block {
            axes: [[f32::NAN; LANES]; 3],
            variances: [0.0; LANES],
        };
        blocks.clear();
        blocks.resize(numbers.len().div_ceil(LANES), unused);
        for (block, numbers) in blocks.iter_mut().zip(numbers.chunks(LANES)) {
            for (k, number) in numbers.iter().enumerate() {
                let own = &packed.all[*number as usize];
                for (axis, at) in block.axes.iter_mut().zip(own.at) {
                    axis[k] = at;
                }
                block.variances[k] = own.variance_m2;
            }
        }
    }

    /// Chooses the listed places within the gate.
    fn choose(&mut self, variance_m2: f32) {
        let Self {
            numbers,
            blocks,
            at,
            found,
            ..
        } = self;
        found.clear();
        let gate = to_f32(GATE_SQUARED);
        simd::dispatch(
            #[inline(always)]
            move || {
                for (block, first) in blocks.iter().zip((0_u32..).step_by(LANES)) {
                    let [x, y, z] = &block.axes;
                    let (mut squares, mut variances) = ([0.0; LANES], [0.0; LANES]);
                    let mut bits = [0_u32; LANES];
                    for k in 0..LANES {
                        let apart = [x[k] - at[0], y[k] - at[1], z[k] - at[2]];
                        squares[k] =
                            apart[0] * apart[0] + apart[1] * apart[1] + apart[2] * apart[2];
                        variances[k] = variance_m2 + block.variances[k];
                        let is_near = squares[k] <= gate * variances[k];
                        bits[k] = if is_near { 1 << k } else { 0 };
                    }
                    let mut near = 0;
                    for bit in bits {
                        near |= bit;
                    }
                    while near != 0 {
                        let k = near.trailing_zeros();
                        near &= near - 1;
                        let (listed, k) = (first + k, k as usize);
                        found.push(NearPlace {
                            number: numbers[listed as usize],
                            listed,
                            square: squares[k],
                            variance: variances[k],
                        });
                    }
                }
            },
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::indexed_model::IndexedModel;
    use crate::{Contact, ModelSettings, ObjectModel};

    #[test]
    fn what_is_found_is_all_within_the_gate_whatever_was_searched_before() {
        search_one_after_another(|_| 0.001, 0);
    }

    #[test]
    fn wide_places_are_found_once_and_after_the_others() {
        search_one_after_another(|k| if k % 100 == 0 { 0.02 } else { 0.001 }, 10);
    }

    /// Searches a model of places that are known so well \[m\], of which so many at least are wide.
    fn search_one_after_another(sd_m: impl Fn(u64) -> f64, wide_min: usize) {
        let noise = |k: u64| random::uniform(13, [0, 0, k]) * 0.1 - 0.05;
        let point = |k: u64| Point3::new(noise(3 * k), noise(3 * k + 1), 0.2 * noise(3 * k + 2));
        let mut model = ObjectModel::new(ModelSettings::default());
        for k in 0..2000 {
            model.learn(&Contact::at(point(k), sd_m(k)));
        }
        let packed = IndexedModel::variants(&model).0.packed;
        let wide = &packed.wide.numbers;
        assert!(wide.len() >= wide_min, "{}", wide.len());
        let mut shortlist = Shortlist::default();
        let (mut found, mut found_wide, mut reused, mut too_wide) = (0, 0, 0, 0);
        for (k, step_m) in (0..4000).zip([0.0, 0.001, 0.004, 0.03].into_iter().cycle()) {
            if k % 50 == 0 {
                shortlist.begin(k % 100 == 0);
            }
            // Walks in small and in large steps.
            let query = point(5000 + k / 20) + point(9000 + k).coords * (20.0 * step_m);
            let variance_m2 = [1e-7, 1e-6, 2e-6, 3e-5][(k / 7 % 4) as usize];
            let before = shortlist.ball;
            shortlist.find(&packed, &query, variance_m2);
            let reach_m = packed.rounded_reach_m(variance_m2);
            let is_inside = before
                .is_some_and(|(middle, radius_m)| (query - middle).norm() + reach_m <= radius_m);
            reused += usize::from(shortlist.ball == before);
            too_wide += usize::from(is_inside && shortlist.ball != before);
            let mut listed = shortlist.numbers.clone();
            listed.sort_unstable();
            assert!(listed.is_sorted_by(|a, b| a < b), "listed twice: {k}");
            let at = (query - packed.middle).map(to_f32);
            let is_near = |number: &u32| {
                let own = &packed.all[*number as usize];
                let apart = Vector3::from(own.at) - at;
                let gate = to_f32(GATE_SQUARED) * (to_f32(variance_m2) + own.variance_m2);
                apart.x * apart.x + apart.y * apart.y + apart.z * apart.z <= gate
            };
            let near = (0_u32..).take(packed.all.len()).filter(is_near);
            let (last, mut expected): (Vec<u32>, Vec<u32>) =
                near.partition(|number| wide.contains(number));
            found_wide += last.len();
            expected.extend(last);
            let numbers: Vec<u32> = { shortlist.found().iter() }
                .map(|near| near.number)
                .collect();
            assert_eq!(numbers, expected, "{k}");
            for near in shortlist.found() {
                let own = &packed.all[near.number as usize];
                assert_eq!(shortlist.apart(near), Vector3::from(own.at) - at, "{k}");
            }
            found += numbers.len();
        }
        assert!(found > 4000, "{found}");
        assert!(found_wide >= wide_min, "{found_wide}");
        assert!(reused > 400, "{reused}");
        assert!(too_wide > 10, "{too_wide}");
    }
}
