//! The order of places along outlines in a plane.

use nalgebra::Point3;

use super::tuning::{OUTLINE_BESIDE, OUTLINE_BESIDE_SHARE, OUTLINE_LINK, OUTLINE_PLACES};
use crate::numeric::median;

/// Links of places of a plane that lie along an outline, each to the next: the shortest ones of
/// which no place has more than two, and that close a ring only when no others are left (the greedy
/// matching of Bentley 1992, Fast algorithms for geometric traveling salesman problems). Of several
/// outlines each is a ring.
///
/// None where places lie all over the plane: the last links are then far longer than the rest, or
/// many places have others beside them that are as near as some are along the outline.
pub(super) fn in_order(positions: &[Point3<f64>], near: &[Vec<u32>]) -> Option<Vec<Vec<u32>>> {
    let apart_m =
        |own: u32, other: u32| (positions[own as usize] - positions[other as usize]).norm();
    let mut pairs: Vec<(f64, u32, u32)> = Vec::new();
    for (own, others) in (0u32..).zip(near) {
        let is_once = |other: &&u32| own < **other || !near[**other as usize].contains(&own);
        let others = others.iter().filter(is_once);
        pairs.extend(others.map(|other| (apart_m(own, *other), own, *other)));
    }
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    let mut links: Vec<Vec<u32>> = vec![Vec::new(); positions.len()];
    // The other end of the chain that ends at a place.
    let mut far_end: Vec<u32> = (0u32..).zip(positions).map(|(own, _)| own).collect();
    let mut lengths_m = Vec::with_capacity(positions.len());
    for (length_m, own, other) in pairs {
        let [a, b] = [own, other].map(|end| end as usize);
        if links[a].len() == 2 || links[b].len() == 2 || far_end[a] == other {
            continue;
        }
        let [from, to] = [far_end[a], far_end[b]];
        links[a].push(other);
        links[b].push(own);
        (far_end[from as usize], far_end[to as usize]) = (to, from);
        lengths_m.push(length_m);
    }
    let mut longest_m = lengths_m.last().copied()?;
    let typical_m = median(lengths_m);
    let most_m = OUTLINE_LINK * typical_m;
    let shortest = shortest_chain(&links);
    if longest_m > most_m || shortest < OUTLINE_PLACES {
        return None;
    }
    for (own, end) in (0u32..).zip(far_end) {
        let is_end = own < end && links[own as usize].len() == 1 && links[end as usize].len() == 1;
        let gap_m = apart_m(own, end);
        if is_end && gap_m <= most_m {
            links[own as usize].push(end);
            links[end as usize].push(own);
            longest_m = longest_m.max(gap_m);
        }
    }
    // Rows of a raster are no outlines: of several each is a ring.
    let is_open = links.iter().any(|own| own.len() < 2);
    if is_open && shortest < positions.len() {
        return None;
    }
    // Across a raster it is no farther than its rows are apart, which the longest link spans.
    let beside_m = f64::max(OUTLINE_BESIDE * typical_m, 1.001 * longest_m);
    let has_beside = |own: &u32| {
        let along = along(*own, &links);
        let mut others = near[*own as usize].iter();
        others.any(|other| apart_m(*own, *other) < beside_m && !along.contains(other))
    };
    let own = (0u32..).zip(&links).map(|(own, _)| own);
    let beside = own.filter(has_beside).count() as f64;
    if beside > OUTLINE_BESIDE_SHARE * positions.len() as f64 {
        return None;
    }
    for own in &mut links {
        own.sort_unstable();
    }
    Some(links)
}

/// Places of the chain that has the fewest.
fn shortest_chain(links: &[Vec<u32>]) -> usize {
    let mut is_met = vec![false; links.len()];
    let mut shortest = links.len();
    for own in 0..links.len() {
        let (mut open, mut count) = (vec![own], 0);
        while let Some(next) = open.pop() {
            if !std::mem::replace(&mut is_met[next], true) {
                count += 1;
                open.extend(links[next].iter().map(|other| *other as usize));
            }
        }
        if count > 0 {
            shortest = shortest.min(count);
        }
    }
    shortest
}

/// The places that one or two links lead to.
fn along(own: u32, links: &[Vec<u32>]) -> Vec<u32> {
    let next = &links[own as usize];
    let after = next.iter().flat_map(|next| &links[*next as usize]);
    next.iter().chain(after).copied().collect()
}
