//! Sides of a surface: which places lie on the same side of an edge.

use nalgebra::{Matrix3, Point3, Unit, Vector3};

use super::field::{LeftOut, Site};
use super::graph::LinkGraph;
use super::tuning::{
    SIDE_COS, SIDE_FITS, SIDE_FITTED, SIDE_NOISES, SIDE_OFFSET, SIDE_PAIRS, SIDE_REACH,
    SIDE_THROUGH,
};
use crate::model::ModelPlace;

/// A point of a plane, and its normal.
type Plane = (Vector3<f64>, Unit<Vector3<f64>>);

/// The tangent planes of the places of a surface, each from its own side of an edge.
///
/// A plane fitted to all places about an edge cuts it off. So planes through a place and two of its
/// neighbours are compared: the tangent plane is the one by which most neighbours lie (the idea of
/// Fleishman, Cohen-Or and Silva 2005, Robust moving least-squares fitting with sharp features),
/// and it has the others on one side, where a plane through the body has some on either.
#[derive(Clone, Debug)]
pub(super) struct Sides {
    /// Normals, with either sign where none was felt.
    normals: Vec<Option<Unit<Vector3<f64>>>>,
    /// Distance from a plane within which a place lies by it \[m\].
    reach_m: f64,
}

impl Sides {
    /// Of places with these links; a curve has none.
    pub(super) fn new(places: &[ModelPlace], graph: &LinkGraph) -> Option<Self> {
        if graph.is_curve() {
            return None;
        }
        let count = places.len().max(1) as f64;
        let variance_m2 = places.iter().map(|place| place.variance_m2 / place.count);
        let noise_m = (variance_m2.sum::<f64>() / count).sqrt();
        let mut sides = Self {
            normals: Vec::new(),
            reach_m: f64::max(SIDE_REACH * graph.typical_m, SIDE_NOISES * noise_m),
        };
        let normals = (0..places.len()).map(|own| sides.normal(own, None, places, graph));
        sides.normals = normals.collect();
        Some(sides)
    }

    /// Each place, as the others on its own side tell it.
    pub(super) fn left_out(&self, places: &[ModelPlace], graph: &LinkGraph) -> Vec<LeftOut> {
        let of = |own: usize| LeftOut {
            own,
            from: self.about(own, places, graph),
        };
        (0..places.len()).map(of).collect()
    }

    /// The sides about a place, as if it were not there.
    fn about(&self, own: usize, places: &[ModelPlace], graph: &LinkGraph) -> Vec<(Site, Vec<u32>)> {
        let mut without = self.clone();
        without.normals[own] = None;
        for &near in &graph.near[own] {
            let normal = &mut without.normals[near as usize];
            let offset = places[own].position_m - places[near as usize].position_m;
            let counted = normal.is_some_and(|normal| self.is_by(&normal, &offset));
            if counted {
                *normal = self.normal(near as usize, Some(own), places, graph);
            }
        }
        let groups = without.groups(places, &graph.links[own]);
        let sites = groups.iter().filter_map(|of| without.site(places, of));
        let near = |site: Site| {
            let near = without.near(places, &site, &graph.near[own]);
            (site, near)
        };
        sites.map(near).collect()
    }

    /// Those of these places that lie on the side of a site; all of them where those are too few.
    pub(super) fn near(&self, places: &[ModelPlace], site: &Site, near: &[u32]) -> Vec<u32> {
        let holds = |near: &u32| {
            let of = site.of.iter();
            let same = of.filter(|own| self.is_same(places, **own, *near)).count();
            2 * same > site.of.len() || site.of.is_empty()
        };
        let own: Vec<u32> = near.iter().copied().filter(holds).collect();
        let is_enough = own.len() >= site.axes.len() + 2;
        if is_enough { own } else { near.to_vec() }
    }

    /// Corners of a triangle by the side on which they lie.
    pub(super) fn groups(&self, places: &[ModelPlace], corners: &[u32]) -> Vec<Vec<u32>> {
        let mut groups: Vec<Vec<u32>> = Vec::new();
        for &corner in corners {
            let is_own = |group: &&mut Vec<u32>| {
                let mut others = group.iter();
                others.all(|other| self.is_same(places, *other, corner))
            };
            match groups.iter_mut().find(is_own) {
                Some(group) => group.push(corner),
                None => groups.push(vec![corner]),
            }
        }
        groups
    }

    /// The plane of places on one side: through their middle, across their mean normal.
    pub(super) fn site(&self, places: &[ModelPlace], of: &[u32]) -> Option<Site> {
        let normals = of.iter().filter_map(|own| self.normals[*own as usize]);
        let first = normals.clone().next()?;
        let sum: Vector3<f64> = normals
            .map(|normal| normal.into_inner() * normal.dot(&first).signum())
            .sum();
        let normal = Unit::try_new(sum, 1e-9)?;
        let middle = of.iter().map(|own| places[*own as usize].position_m.coords);
        Some(Site {
            middle: Point3::from(middle.sum::<Vector3<f64>>() / of.len() as f64),
            axes: along(&normal),
            of: of.to_vec(),
            row: None,
        })
    }

    /// Whether two places lie on the same side of all edges: the surface turns little from one to
    /// the other. A place without a normal lies on any side.
    fn is_same(&self, places: &[ModelPlace], own: u32, other: u32) -> bool {
        let [own, other] = [own as usize, other as usize];
        let normal = |of: usize| self.normals.get(of).copied().flatten();
        let Some((a, b)) = normal(own).zip(normal(other)) else {
            return true;
        };
        let apart = places[other].position_m - places[own].position_m;
        let has_sign = places[own].normal().is_some() && places[other].normal().is_some();
        let cos = if has_sign { a.dot(&b) } else { a.dot(&b).abs() };
        let offset_m = f64::max(apart.dot(&a).abs(), apart.dot(&b).abs());
        cos >= SIDE_COS && offset_m <= SIDE_OFFSET * apart.norm()
    }

    /// Whether what has this offset from a plane lies by it.
    fn is_by(&self, normal: &Unit<Vector3<f64>>, offset: &Vector3<f64>) -> bool {
        offset.dot(normal).abs() < self.reach_m
    }

    /// The normal at a place: the one that was felt, or that of its tangent plane.
    fn normal(
        &self,
        own: usize,
        without: Option<usize>,
        places: &[ModelPlace],
        graph: &LinkGraph,
    ) -> Option<Unit<Vector3<f64>>> {
        let felt = places[own].normal();
        felt.or_else(|| {
            let near = graph.near[own].iter().map(|near| *near as usize);
            let to: Vec<Vector3<f64>> = { near.filter(|near| Some(*near) != without) }
                .map(|near| places[near].position_m - places[own].position_m)
                .collect();
            self.tangent(&to)
        })
    }

    /// Normal of the tangent plane of a place with neighbours at these offsets, nearest first.
    fn tangent(&self, to: &[Vector3<f64>]) -> Option<Unit<Vector3<f64>>> {
        let lengths: Vec<f64> = to.iter().map(Vector3::norm).collect();
        let some = &to[..to.len().min(SIDE_PAIRS)];
        let pairs = some.iter().enumerate();
        let planes = pairs.flat_map(|(number, a)| {
            let across = some[..number].iter().map(move |b| (a, b, a.cross(b)));
            // Three places on a line span no plane.
            across.filter(|(a, b, across)| {
                across.norm_squared() > 0.1 * a.norm_squared() * b.norm_squared()
            })
        });
        let scored = planes.map(|(_, _, across)| {
            let plane = (Vector3::zeros(), Unit::new_normalize(across));
            (self.score(&plane, to, &lengths), plane)
        });
        let mut scored: Vec<(f64, Plane)> = scored.collect();
        scored.sort_by(|a, b| b.0.total_cmp(&a.0));
        scored.truncate(SIDE_FITTED);
        // Planes by which the same places lie are fitted once: on a flat face all are.
        let mut fits: Vec<(u64, Option<Plane>)> = Vec::new();
        let mut fit = |plane: &Plane| {
            let by = self.places_by(plane, to);
            let known = fits.iter().find(|(of, _)| *of == by);
            let (_, fit) = known.copied().unwrap_or_else(|| {
                let own = to
                    .iter()
                    .enumerate()
                    .filter(|(number, _)| by >> number & 1 == 1);
                let fit = (by, fitted(own.map(|(_, to)| to)));
                fits.push(fit);
                fit
            });
            fit.unwrap_or(*plane)
        };
        let fitted = scored.iter().map(|(_, plane)| {
            let plane = (0..SIDE_FITS).fold(*plane, |plane, _| fit(&plane));
            (self.score(&plane, to, &lengths), plane.1)
        });
        let best = fitted.max_by(|a, b| a.0.total_cmp(&b.0));
        best.map(|(_, normal)| normal)
    }

    /// Which of the places at these offsets, 64 at most, lie by a plane.
    fn places_by(&self, (middle, normal): &Plane, to: &[Vector3<f64>]) -> u64 {
        let bits = to.iter().zip(0..64).map(|(to, number)| {
            let is_by = self.is_by(normal, &(to - middle));
            u64::from(is_by) << number
        });
        bits.sum()
    }

    /// How well a plane is tangent to a surface through these offsets: places by it, less those on
    /// the side where there are fewer, each by the sine of its elevation.
    fn score(&self, (middle, normal): &Plane, to: &[Vector3<f64>], lengths_m: &[f64]) -> f64 {
        let (mut by, mut above, mut below) = (0.0, 0.0, 0.0);
        for (to, length_m) in to.iter().zip(lengths_m) {
            let off_m = normal.dot(&(to - middle));
            let share = off_m / self.reach_m;
            let sine = (off_m / length_m.max(f64::MIN_POSITIVE)).clamp(-1.0, 1.0);
            if share.abs() < 1.0 {
                by += 1.0 - share * share;
            } else if sine > 0.0 {
                above += sine;
            } else {
                below -= sine;
            }
        }
        by - SIDE_THROUGH * f64::min(above, below)
    }
}

/// Two axes across a normal.
pub(super) fn along(normal: &Unit<Vector3<f64>>) -> Vec<Vector3<f64>> {
    let least = Vector3::ith(normal.iamin(), 1.0);
    let first = normal.cross(&least).normalize();
    vec![first, normal.cross(&first)]
}

/// The plane of least squares of the origin and these points.
fn fitted<'a>(to: impl Iterator<Item = &'a Vector3<f64>> + Clone) -> Option<Plane> {
    let count = 1.0 + to.clone().count() as f64;
    let middle = to.clone().sum::<Vector3<f64>>() / count;
    let spread: Matrix3<f64> = to.map(|to| to * to.transpose()).sum();
    let spread = spread - middle * middle.transpose() * count;
    let eigen = spread.symmetric_eigen();
    let across: Vector3<f64> = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into();
    Some((middle, Unit::try_new(across, 1e-9)?))
}
