//! Where on an object contacts fall.

use nalgebra::{Point3, Vector3};

use super::graph::LinkGraph;
use super::tuning::UNEXPLORED_MIN;
use crate::model::ModelPlace;
use crate::tuning::EVEN_SHARE_MIN;

/// Parts of the side of a triangle whose area is sampled by the middles of its parts.
const PARTS: u32 = 4;

/// Where contacts fall, as far as the learned ones tell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Spread {
    /// All over the surface, between the places too.
    Even,
    /// On the places, as those of a hand that reaches for the same points again.
    OnPlaces,
}

impl Spread {
    /// By how many visits made a place of their own. A finger that rests or slides makes many
    /// contacts on one visit.
    ///
    /// Let a share e of the visits fall evenly over the surface, and the others on places. One
    /// makes a new place if it is farther than a spacing from all others. Of the even ones it is
    /// the share q of the surface that lies so far from its places. Of all n visits it is
    /// u = n₁/n, where n₁ places have one visit only (Good 1953, The population frequencies of
    /// species and the estimation of population parameters). So e = u/q. One place more is counted
    /// in n₁, so that few visits do not tell that none falls between.
    ///
    /// Contacts that fall evenly give e = 1 while places are few. Then it falls, since a new place
    /// in a small gap takes the contacts beside it too: so a surface that is covered tells nothing.
    pub(crate) fn learned(places: &[ModelPlace], graph: &LinkGraph, spacing_m: f64) -> Self {
        let visits: f64 = places.iter().map(|place| place.visits).sum();
        let single = places.iter().filter(|place| place.is_single()).count() as f64;
        let uncovered = uncovered_share(places, graph, spacing_m);
        let is_covered = uncovered < UNEXPLORED_MIN;
        if !is_covered && single + 1.0 < EVEN_SHARE_MIN * uncovered * visits {
            Self::OnPlaces
        } else {
            Self::Even
        }
    }
}

/// Probability that a contact with one of the points at which an object is felt is with none of
/// those that were learned: about as many were never visited as were visited once (Good 1953). One
/// place more is counted on both sides, so that few do not tell that none is missing.
pub(crate) fn missed_share(places: &[ModelPlace]) -> f64 {
    let single = places.iter().filter(|place| place.is_single()).count();
    (single as f64 + 1.0) / (places.len() as f64 + 2.0)
}

/// Share of the surface, or of the curve, that lies farther than a spacing from every place.
fn uncovered_share(places: &[ModelPlace], graph: &LinkGraph, spacing_m: f64) -> f64 {
    let at = |number: u32| places[number as usize].position_m;
    let (mut uncovered, mut all) = (0.0, 0.0);
    if graph.is_curve() {
        for (own, others) in (0u32..).zip(&graph.links) {
            for other in others {
                let length_m = (at(*other) - at(own)).norm();
                uncovered += (length_m - 2.0 * spacing_m).max(0.0);
                all += length_m;
            }
        }
    } else {
        for corners in &graph.triangles {
            let corners = corners.map(at);
            let [a, b, c] = corners;
            let area_m2 = 0.5 * (b - a).cross(&(c - a)).norm();
            let middles = middles(&corners);
            let is_far = |point: &&Point3<f64>| {
                let mut to = corners.iter().map(|corner| (corner - **point).norm());
                to.all(|apart_m| apart_m > spacing_m)
            };
            let far = middles.iter().filter(is_far).count();
            uncovered += area_m2 * far as f64 / middles.len() as f64;
            all += area_m2;
        }
    }
    uncovered / f64::max(all, f64::MIN_POSITIVE)
}

/// Middles of the equal parts of a triangle.
fn middles(corners: &[Point3<f64>; 3]) -> Vec<Point3<f64>> {
    let mut middles = Vec::new();
    // Parts that lie as the whole does, then those that are turned around.
    for offset in [1, 2] {
        let sum = PARTS - offset;
        for (a, b) in (0..=sum).flat_map(|a| (0..=sum - a).map(move |b| (a, b))) {
            let shares = [a, b, sum - a - b];
            let shares = shares.map(|k| f64::from(3 * k + offset) / f64::from(3 * PARTS));
            let parts = corners.iter().zip(shares);
            let parts = parts.map(|(corner, share)| corner.coords * share);
            middles.push(Point3::from(parts.sum::<Vector3<f64>>()));
        }
    }
    middles
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Contact, ModelSettings, ObjectModel};

    const SPACING_M: f64 = 0.004;

    fn spread(points: impl Iterator<Item = Point3<f64>>) -> Spread {
        let settings = ModelSettings {
            spacing_m: SPACING_M,
            ..ModelSettings::default()
        };
        let mut model = ObjectModel::new(settings);
        for point in points {
            model.learn(&Contact::at(point, 0.0005));
        }
        let places: Vec<_> = { model.places().iter() }
            .map(|place| place.position_m)
            .collect();
        Spread::learned(model.places(), &LinkGraph::new(&places), SPACING_M)
    }

    /// A contact with a plate, of all that `key` numbers.
    fn anywhere(key: u64) -> Point3<f64> {
        let [x, y] = [0, 1].map(|axis| 0.16 * random::uniform(5, [key, axis, 0]));
        Point3::new(x, y, 0.0)
    }

    #[test]
    fn contacts_that_fall_anywhere_fall_between_places() {
        for contacts in [60, 240, 1000, 2000, 3000, 4000, 10_000] {
            assert_eq!(spread((0..contacts).map(anywhere)), Spread::Even);
        }
        let ring = |key: u64| {
            let angle_rad = 6.2 * random::uniform(6, [key, 0, 0]);
            Point3::new(0.1 * angle_rad.cos(), 0.1 * angle_rad.sin(), 0.0)
        };
        for contacts in [60, 120, 240, 500, 1000, 4000] {
            assert_eq!(spread((0..contacts).map(ring)), Spread::Even);
        }
    }

    #[test]
    fn a_finger_that_rests_or_slides_is_between_places_all_the_same() {
        for times in [2, 3, 10] {
            let rests = (0..300).flat_map(|key| (0..times).map(move |_| anywhere(key)));
            assert_eq!(spread(rests), Spread::Even, "{times} times");
        }
        for along_m in [0.001, 0.002, 0.003] {
            let strokes = (0..14_u32).flat_map(|stroke| {
                let contacts = (0..).map(move |number| along_m * f64::from(number));
                let contacts = contacts.take_while(|x| *x < 0.16);
                contacts.map(move |x| Point3::new(x, 0.012 * f64::from(stroke), 0.0))
            });
            assert_eq!(spread(strokes), Spread::Even, "{along_m}");
        }
    }

    #[test]
    fn contacts_with_the_same_points_again_fall_on_places() {
        let raster = |visits: u64| {
            (0..16 * 16 * visits).map(|key| {
                let [x, y] = [key % 16, key / 16 % 16].map(|at| 0.01 * at as f64);
                let [dx, dy] = [0, 1].map(|axis| 1e-3 * random::uniform(7, [key, axis, 0]));
                Point3::new(x + dx, y + dy, 0.0)
            })
        };
        // Who has been everywhere once may come between next.
        assert_eq!(spread(raster(1)), Spread::Even);
        assert_eq!(spread(raster(3)), Spread::OnPlaces);
        // A raster within a spacing leaves nothing uncovered.
        let dense = raster(3).map(|point| Point3::from(0.45 * point.coords));
        assert_eq!(spread(dense), Spread::Even);
    }

    #[test]
    fn parts_of_a_triangle_have_its_middle() {
        let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 3.0, 1.0]].map(Point3::from);
        let middles = middles(&corners);
        assert_eq!(middles.len(), 16);
        let mean = middles.iter().map(|own| own.coords).sum::<Vector3<f64>>() / 16.0;
        let middle = corners.iter().map(|own| own.coords).sum::<Vector3<f64>>() / 3.0;
        assert!((mean - middle).norm() < 1e-12);
    }
}
