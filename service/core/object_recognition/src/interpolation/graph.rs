//! Links between neighbouring places, without normals and whatever the dimension.

use std::f64::consts::TAU;

use nalgebra::{Matrix3, Point3, Vector3};

use super::outline::in_order;
use super::plane::plane_normal;
use super::tuning::{
    BETWEEN_MIN, CHORD_CHAIN, CHORD_LINK, CHORD_PLACES, CHORD_SHARE, DENSE_LINK, END_LINKS,
    LINK_BALL, LINK_LENGTH_MAX, LINK_NEIGHBOURS, OPEN_CURVE_COS, OPEN_SURFACE_RAD, RIM_MIN,
};
use crate::numeric::median;
use crate::tuning::NODE_STEP;

/// Places that neighbour one another.
///
/// Two places are linked if a ball about the middle of their segment holds no other place (a
/// β-skeleton, Kirkpatrick and Radke 1985, with β below one): a closed polygon along a curve, a
/// triangulation with few holes on a surface. Places of an outline in a plane that are in order
/// ([`in_order`]) are linked to the next ones alone. Elsewhere a chord of a curve is no link: a
/// chain of much shorter links leads about it. Links across what is narrow stay there. Nor is a
/// link one that is much longer than the typical one: what lies across was not explored.
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
        let is_flat = plane_normal(positions).is_some();
        // Few places are in order by chance.
        let has_order = is_flat && positions.len() >= BETWEEN_MIN;
        if let Some(outline) = has_order.then(|| in_order(positions, &near)).flatten() {
            links = outline;
        } else {
            let without = without_chords(positions, &links);
            let kept = without.iter().map(Vec::len).sum::<usize>() as f64;
            let all = links.iter().map(Vec::len).sum::<usize>() as f64;
            let has_chords = is_flat && all - kept > CHORD_SHARE * all;
            if has_chords || are_lines(without.len(), &triangles(&without)) {
                links = without;
            }
        }
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

    /// Mean length of the links of a place \[m\]; none of one without links.
    pub(crate) fn mean_link_m(&self, own: usize, positions: &[Point3<f64>]) -> Option<f64> {
        let links = &self.links[own];
        let lengths = links
            .iter()
            .map(|other| (positions[*other as usize] - positions[own]).norm());
        (!links.is_empty()).then(|| lengths.sum::<f64>() / links.len() as f64)
    }

    /// Whether the places lie along lines, for the most part.
    pub(crate) fn is_curve(&self) -> bool {
        are_lines(self.links.len(), &self.triangles)
    }

    /// Whether a contact between two places is beside one of them anyway.
    pub(crate) fn is_dense(&self, spacing_m: f64) -> bool {
        if self.is_curve() {
            self.longest_m <= NODE_STEP * spacing_m
        } else {
            self.typical_m <= DENSE_LINK * spacing_m
        }
    }

    /// Places beyond which nothing was felt, in pieces that hang together.
    ///
    /// Of a surface they are the ends of links that are the side of one triangle only, of a curve
    /// the places from which all others about lie on one side.
    pub(super) fn edges(&self, positions: &[Point3<f64>], is_curve: bool) -> Vec<Vec<u32>> {
        let mut rim: Vec<Vec<u32>> = vec![Vec::new(); positions.len()];
        if is_curve {
            let ends = (0..positions.len()).filter(|own| self.is_end(positions, *own));
            let ends = ends.filter_map(|own| u32::try_from(own).ok());
            return ends.map(|end| vec![end]).collect();
        }
        let is_side: Vec<bool> = (0..positions.len())
            .map(|own| self.largest_gap_rad(positions, own) > OPEN_SURFACE_RAD)
            .collect();
        for (own, others) in (0u32..).zip(&self.links) {
            let is_rim = |other: &&u32| is_side[own as usize] && is_side[**other as usize];
            let above = others.iter().filter(|other| **other > own);
            for &other in above.filter(is_rim) {
                let third = |third: &&u32| self.links[other as usize].binary_search(third).is_ok();
                if others.iter().filter(third).count() == 1 {
                    rim[own as usize].push(other);
                    rim[other as usize].push(own);
                }
            }
        }
        let mut pieces: Vec<Vec<u32>> = Vec::new();
        let mut is_met = vec![false; positions.len()];
        for own in 0..rim.len() {
            let mut open = vec![u32::try_from(own).unwrap_or(u32::MAX)];
            let mut piece = Vec::new();
            while let Some(next) = open.pop() {
                if rim[next as usize].is_empty() || is_met[next as usize] {
                    continue;
                }
                is_met[next as usize] = true;
                piece.push(next);
                open.extend(&rim[next as usize]);
            }
            if piece.len() >= RIM_MIN {
                piece.sort_unstable();
                pieces.push(piece);
            }
        }
        pieces
    }

    /// Largest angle between neighbouring links of a place, over the plane that fits them \[rad\].
    fn largest_gap_rad(&self, positions: &[Point3<f64>], own: usize) -> f64 {
        let to = |other: &u32| positions[*other as usize] - positions[own];
        let links: Vec<Vector3<f64>> = self.links[own].iter().map(to).collect();
        let Some(first) = links.first() else {
            return TAU;
        };
        let spread = links
            .iter()
            .map(|link| link * link.transpose() / link.norm_squared());
        let eigen = spread.sum::<Matrix3<f64>>().symmetric_eigen();
        let normal: Vector3<f64> = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into();
        let x = first - normal * normal.dot(first);
        let y = normal.cross(&x);
        let mut angles: Vec<f64> = { links.iter() }
            .map(|link| link.dot(&y).atan2(link.dot(&x)))
            .collect();
        angles.sort_by(f64::total_cmp);
        let last = angles.last().map_or(0.0, |last| last - TAU);
        let before = std::iter::once(&last).chain(&angles);
        let gaps = before.zip(&angles).map(|(before, angle)| angle - before);
        gaps.fold(0.0, f64::max)
    }

    /// Whether a curve ends at a place: of the places that a few links lead to, no two lie on
    /// opposite sides.
    fn is_end(&self, positions: &[Point3<f64>], own: usize) -> bool {
        let mut met = vec![u32::try_from(own).unwrap_or(u32::MAX)];
        let mut from = 0;
        for _ in 0..END_LINKS {
            let until = met.len();
            for at in from..until {
                for other in &self.links[met[at] as usize] {
                    if !met.contains(other) {
                        met.push(*other);
                    }
                }
            }
            from = until;
        }
        let to = |other: &u32| (positions[*other as usize] - positions[own]).normalize();
        let to: Vec<Vector3<f64>> = met[1..].iter().map(to).collect();
        let mut pairs = to.iter().enumerate();
        !pairs.any(|(number, a)| to[..number].iter().any(|b| a.dot(b) < OPEN_CURVE_COS))
    }
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
    for links in links {
        links.sort_unstable();
    }
}

/// Whether so many places with these triangles lie along lines, for the most part.
fn are_lines(places: usize, triangles: &[[u32; 3]]) -> bool {
    2 * triangles.len() < places
}

/// The links without those that a chain of others leads about: each of them at most [`CHORD_LINK`]
/// as long, and all together at most [`CHORD_CHAIN`], by no more than [`CHORD_PLACES`].
fn without_chords(positions: &[Point3<f64>], links: &[Vec<u32>]) -> Vec<Vec<u32>> {
    let mut kept = links.to_vec();
    for (own, others) in (0u32..).zip(links) {
        for &other in others.iter().filter(|other| **other > own) {
            if is_chord(positions, links, [own, other]) {
                kept[own as usize].retain(|to| *to != other);
                kept[other as usize].retain(|to| *to != own);
            }
        }
    }
    kept
}

/// Whether a chain of other links leads about one, as [`without_chords`] has it.
fn is_chord(positions: &[Point3<f64>], links: &[Vec<u32>], [from, to]: [u32; 2]) -> bool {
    let apart_m =
        |own: u32, other: u32| (positions[own as usize] - positions[other as usize]).norm();
    let length_m = apart_m(from, to);
    let (link_m, most_m) = (CHORD_LINK * length_m, CHORD_CHAIN * length_m);
    // Ways from the one end, the shortest first (Dijkstra 1959).
    let mut ways = vec![(0.0_f64, from)];
    let mut met = Vec::new();
    while let Some(next) = (0..ways.len()).min_by(|a, b| ways[*a].0.total_cmp(&ways[*b].0)) {
        let (way_m, at) = ways.swap_remove(next);
        if at == to {
            return true;
        }
        if met.contains(&at) {
            continue;
        }
        met.push(at);
        if met.len() > CHORD_PLACES {
            return false;
        }
        for &step in &links[at as usize] {
            let step_m = apart_m(at, step);
            let all_m = way_m + step_m;
            // A link of no length leads about nothing.
            if step_m <= link_m && step_m < length_m && all_m + apart_m(step, to) <= most_m {
                ways.push((all_m, step));
            }
        }
    }
    false
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

#[cfg(test)]
mod tests {
    use super::*;

    /// So many places about a ring, each off it by up to 1 mm.
    fn ring(count: u32, radius_m: f64) -> Vec<Point3<f64>> {
        let off = |k, axis| 0.002 * (random::uniform(21, [k, axis, 0]) - 0.5);
        let place = |k: u32| {
            let (sin, cos) = (TAU * f64::from(k) / f64::from(count)).sin_cos();
            let k = u64::from(k);
            Point3::new(
                radius_m * cos + off(k, 0),
                radius_m * sin + off(k, 1),
                off(k, 2),
            )
        };
        (0..count).map(place).collect()
    }

    #[test]
    fn places_of_a_ring_are_linked_to_their_neighbours_alone() {
        for count in [5, 6, 7, 8, 12, 16, 18, 20, 24, 40] {
            let places = ring(count, 0.06);
            let graph = LinkGraph::new(&places);
            assert!(graph.links.iter().all(|own| own.len() == 2), "{count}");
            let step_m = 0.12 * (std::f64::consts::PI / f64::from(count)).sin();
            let off = graph.typical_m / step_m;
            assert!((0.9..1.1).contains(&off), "{count}: {off}");
            assert!(graph.is_curve(), "{count}");
        }
    }

    #[test]
    fn a_plate_that_was_felt_all_over_keeps_its_links() {
        for plate in 0..8 {
            for count in [20, 30, 60, 120] {
                let at = |k: u64, axis| 0.16 * random::uniform(22, [plate, k, axis]);
                let place = |k: u64| Point3::new(at(k, 0), at(k, 1), 0.0);
                let places: Vec<Point3<f64>> = (0..count).map(place).collect();
                let graph = LinkGraph::new(&places);
                let linked = |(own, near): (usize, &Vec<u32>)| linked(&places, own, near);
                let mut all: Vec<Vec<u32>> = graph.near.iter().enumerate().map(linked).collect();
                symmetrise(&mut all);
                // But for links that are too long.
                let count_of = |links: &[Vec<u32>]| links.iter().map(Vec::len).sum::<usize>();
                let (kept, all) = (count_of(&graph.links), count_of(&all));
                assert!(100 * kept >= 98 * all, "{plate}, {count}: {kept} of {all}");
                assert!(!graph.is_curve(), "{plate}, {count}");
            }
        }
    }

    #[test]
    fn a_raster_is_no_outline() {
        for (columns, rows) in [(4_u32, 4_u32), (5, 5), (8, 8), (15, 15), (10, 4), (20, 5)] {
            for (apart, off_m) in [
                (1.0, 0.0),
                (1.0, 2e-3),
                (1.5, 0.0),
                (1.5, 1e-3),
                (1.9, 1e-3),
                (3.0, 1e-3),
            ] {
                let off =
                    |k: u32, axis| off_m * (random::uniform(23, [u64::from(k), axis, 0]) - 0.5);
                let place = |k: u32| {
                    let (x, y) = (f64::from(k % columns), f64::from(k / columns));
                    Point3::new(0.02 * x + off(k, 0), 0.02 * apart * y + off(k, 1), 0.0)
                };
                let places: Vec<Point3<f64>> = (0..columns * rows).map(place).collect();
                let graph = LinkGraph::new(&places);
                let about = format!("{columns} by {rows}, {apart} apart, off {off_m}");
                assert!(!graph.is_curve(), "{about}");
            }
        }
    }

    #[test]
    fn two_rings_in_a_plane_are_not_linked() {
        for (apart_m, count) in [(0.15, 20_u32), (0.15, 24), (0.15, 30)] {
            let mut places = ring(count, 0.06);
            let beside = ring(count, 0.06);
            places.extend(beside.iter().map(|at| at + Vector3::x() * apart_m));
            let graph = LinkGraph::new(&places);
            let is_first = |own: usize| own < count as usize;
            for (own, links) in graph.links.iter().enumerate() {
                let mut links = links.iter();
                let stays = links.all(|other| is_first(*other as usize) == is_first(own));
                assert!(stays, "{apart_m}, {count}: {own}");
            }
        }
    }

    #[test]
    fn places_of_a_narrow_outline_are_linked_to_their_neighbours_alone() {
        for (count, width) in [(20_u32, 0.5), (20, 0.33), (24, 0.25), (30, 0.2), (60, 0.1)] {
            // The angles of places that are equally far from one another.
            let at = |angle: f64| Point3::new(0.08 * angle.cos(), 0.08 * width * angle.sin(), 0.0);
            let fine: Vec<Point3<f64>> =
                (0..20_000).map(|k| at(TAU * f64::from(k) / 2e4)).collect();
            let length_m: f64 = fine.windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum();
            let mut places = vec![fine[0]];
            let mut way_m = 0.0;
            for pair in fine.windows(2) {
                way_m += (pair[1] - pair[0]).norm();
                if way_m >= length_m * places.len() as f64 / f64::from(count) {
                    places.push(pair[1]);
                }
            }
            places.truncate(count as usize);
            let graph = LinkGraph::new(&places);
            for (own, links) in (0..count).zip(&graph.links) {
                let mut expected = [own + count - 1, own + 1].map(|other| other % count);
                expected.sort_unstable();
                assert_eq!(links[..], expected, "{count}, {width}: {own}");
            }
        }
    }

    #[test]
    fn no_link_leads_through_a_ball() {
        for count in [24_u32, 40, 80, 200] {
            let golden = TAU * 0.618_033_988_749_895;
            let place = |k: u32| {
                let z = 1.0 - (2.0 * f64::from(k) + 1.0) / f64::from(count);
                let (sin, cos) = (golden * f64::from(k)).sin_cos();
                let across = (1.0 - z * z).sqrt();
                Point3::new(across * cos, across * sin, z)
            };
            let places: Vec<Point3<f64>> = (0..count).map(place).collect();
            let graph = LinkGraph::new(&places);
            assert!(!graph.is_curve(), "{count}");
            assert!(graph.longest_m < 1.5, "{count}: {}", graph.longest_m);
            // A closed triangulation has three links for each place, and a diagonal of some faces.
            let links = graph.links.iter().map(Vec::len).sum::<usize>();
            let each = links as f64 / f64::from(count);
            assert!((5.0..9.0).contains(&each), "{count}: {each}");
        }
    }
}
