//! Links between neighbouring places, without normals and whatever the dimension.

use nalgebra::{Point3, Vector3};

use crate::tuning::{
    LINK_BALL, LINK_LENGTH_MAX, LINK_NEIGHBOURS, OPEN_CURVE_COS, OPEN_SURFACE_RAD,
};

/// Places that neighbour one another.
///
/// Two places are linked if a ball about the middle of their segment holds no other place (a
/// β-skeleton, Kirkpatrick and Radke 1985, with β below one): a closed polygon along a curve, a
/// triangulation with few holes on a surface. Links that are much longer than the typical one are
/// none: what lies across was not explored.
#[derive(Clone, Debug)]
pub(crate) struct LinkGraph {
    /// The places linked to each, in ascending order.
    pub(super) links: Vec<Vec<u32>>,
    /// The nearest places of each, nearest first.
    pub(super) near: Vec<Vec<u32>>,
    /// Triangles of links, with ascending numbers.
    pub(super) triangles: Vec<[u32; 3]>,
    /// Length of the longest link \[m\].
    pub(super) longest_m: f64,
    /// Typical length of a link \[m\].
    pub(crate) typical_m: f64,
}

impl LinkGraph {
    /// Of these places.
    pub(crate) fn new(positions: &[Point3<f64>]) -> Self {
        let near: Vec<Vec<u32>> = (0..positions.len())
            .map(|own| nearest(positions, own))
            .collect();
        let mut links: Vec<Vec<u32>> = near
            .iter()
            .enumerate()
            .map(|(own, near)| linked(positions, own, near))
            .collect();
        symmetrise(&mut links);
        let lengths = |links: &[Vec<u32>]| -> Vec<f64> {
            let pairs = links.iter().enumerate();
            pairs
                .flat_map(|(own, others)| {
                    let length =
                        move |other: &u32| (positions[own] - positions[*other as usize]).norm();
                    others.iter().map(length)
                })
                .collect()
        };
        let typical_m = median(lengths(&links));
        for (own, others) in links.iter_mut().enumerate() {
            others.retain(|other| {
                let length_m = (positions[own] - positions[*other as usize]).norm();
                length_m <= LINK_LENGTH_MAX * typical_m
            });
        }
        let longest_m = lengths(&links).into_iter().fold(0.0, f64::max);
        Self {
            triangles: triangles(&links),
            links,
            near,
            longest_m,
            typical_m,
        }
    }

    /// Whether the surface goes on beyond a place to where nothing was felt.
    pub(crate) fn is_open(&self, positions: &[Point3<f64>], own: usize) -> bool {
        let to = |other: &u32| positions[*other as usize] - positions[own];
        let links: Vec<Vector3<f64>> = self.links[own].iter().map(to).collect();
        let has_triangle = self
            .triangles
            .iter()
            .any(|triangle| triangle.iter().any(|corner| *corner as usize == own));
        if has_triangle {
            return largest_gap_rad(&links) > OPEN_SURFACE_RAD;
        }
        // Along a curve one link leads on where the other came from.
        let cos = |a: &Vector3<f64>, b: &Vector3<f64>| {
            a.dot(b) / (a.norm() * b.norm()).max(f64::MIN_POSITIVE)
        };
        let goes_on = links
            .iter()
            .enumerate()
            .any(|(number, a)| links[..number].iter().any(|b| cos(a, b) < OPEN_CURVE_COS));
        !goes_on
    }
}

/// Largest angle between neighbouring links about a place, over the plane that fits them.
fn largest_gap_rad(links: &[Vector3<f64>]) -> f64 {
    let spread = links.iter().map(|link| {
        let unit = link.normalize();
        unit * unit.transpose()
    });
    let eigen = spread.sum::<nalgebra::Matrix3<f64>>().symmetric_eigen();
    let normal: Vector3<f64> = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into();
    let x = links[0] - normal * normal.dot(&links[0]);
    let y = normal.cross(&x);
    let mut angles: Vec<f64> = { links.iter() }
        .map(|link| link.dot(&y).atan2(link.dot(&x)))
        .collect();
    angles.sort_by(f64::total_cmp);
    let last = angles.last().copied().unwrap_or_default() - std::f64::consts::TAU;
    let mut before = last;
    let mut largest: f64 = 0.0;
    for angle in angles {
        largest = largest.max(angle - before);
        before = angle;
    }
    largest
}

/// The nearest places of one, nearest first.
fn nearest(positions: &[Point3<f64>], own: usize) -> Vec<u32> {
    let mut near: Vec<(f64, u32)> = (0u32..)
        .zip(positions)
        .filter(|(number, _)| *number as usize != own)
        .map(|(number, position)| ((position - positions[own]).norm_squared(), number))
        .collect();
    let most = LINK_NEIGHBOURS.min(near.len());
    let order = |a: &(f64, u32), b: &(f64, u32)| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1));
    if most < near.len() {
        near.select_nth_unstable_by(most, order);
        near.truncate(most);
    }
    near.sort_unstable_by(order);
    near.into_iter().map(|(_, number)| number).collect()
}

fn linked(positions: &[Point3<f64>], own: usize, near: &[u32]) -> Vec<u32> {
    let is_linked = |other: &&u32| {
        let ends = [positions[own], positions[**other as usize]];
        let middle = nalgebra::center(&ends[0], &ends[1]);
        let radius_m = LINK_BALL * 0.5 * (ends[1] - ends[0]).norm();
        near.iter()
            .filter(|third| third != other)
            .all(|third| (positions[*third as usize] - middle).norm() >= radius_m)
    };
    near.iter().filter(is_linked).copied().collect()
}

/// A link that one end has the other has too.
fn symmetrise(links: &mut [Vec<u32>]) {
    for own in 0..links.len() {
        let number = u32::try_from(own).unwrap_or(u32::MAX);
        for other in links[own].clone() {
            let back = &mut links[other as usize];
            if !back.contains(&number) {
                back.push(number);
            }
        }
    }
    links.iter_mut().for_each(|links| links.sort_unstable());
}

fn triangles(links: &[Vec<u32>]) -> Vec<[u32; 3]> {
    let mut triangles = Vec::new();
    for (own, others) in (0u32..).zip(links) {
        let above = others.partition_point(|other| *other <= own);
        for (at, second) in others[above..].iter().enumerate() {
            for third in &others[above + at + 1..] {
                if links[*second as usize].binary_search(third).is_ok() {
                    triangles.push([own, *second, *third]);
                }
            }
        }
    }
    triangles
}

/// The upper median; zero of no values.
pub(super) fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}
