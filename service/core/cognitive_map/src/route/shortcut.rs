//! Shortcuts: straight lines beside the ways, where bodies have swept all of them.

use std::collections::BTreeMap;

use nalgebra::{Point3, Vector3};

use super::path::{Hop, Path};
use super::{Region, tuning};
use crate::fold::CognitiveMap;
use crate::memory::blockage::{Blockage, Blocked};
use crate::memory::ids::PlaceId;
use crate::memory::way::{Way, micrometres};

/// A straight piece of a way.
type Piece = (Point3<f64>, Point3<f64>);
/// A cube in which ways are looked up together.
type Cell = [i64; 3];

/// The corridor that was swept along the ways, as far as it was asked for.
pub(super) struct Corridor<'a> {
    map: &'a CognitiveMap,
    radius_m: f64,
    avoided: &'a [Region],
    blockages: &'a [Blockage],
    cells: BTreeMap<Cell, Vec<Piece>>,
}

impl<'a> Corridor<'a> {
    /// The corridor of bodies of a radius, without what is avoided.
    pub(super) fn new(map: &'a CognitiveMap, radius_m: f64, avoided: &'a [Region]) -> Self {
        Self {
            map,
            radius_m,
            avoided,
            blockages: &[],
            cells: BTreeMap::new(),
        }
    }

    /// Keeps lines clear of blockages: no blocked way says that bodies get through.
    pub(super) fn keep_clear_of(&mut self, blockages: &'a [Blockage]) {
        self.blockages = blockages;
    }

    /// Shortens a path by straight lines between its places: of all ways to do so the shortest one,
    /// where a step fewer is worth a millimetre (dynamic programming over its places, with lines up
    /// to the length within which codes are unambiguous). Where `gives_up` says so, the path stays
    /// as it is.
    pub(super) fn shorten(&mut self, path: &Path, gives_up: &mut dyn FnMut() -> bool) -> Path {
        let at: Vec<_> = path
            .iter()
            .map(|(number, _)| self.position(*number))
            .collect();
        // The length from the start with what its steps are worth, and the place before.
        let mut best = vec![(0.0, 0)];
        for to in 1..path.len() {
            let along_um = path[to].1.edge().map_or(0, |edge| edge.length_um);
            let along = along_um as f64 / tuning::MICRO;
            let mut shortest = (best[to - 1].0 + along + tuning::STEP_M, to - 1);
            for from in (to.saturating_sub(tuning::SHORTCUT_PLACES_MAX)..to - 1).rev() {
                let length_m = (at[to] - at[from]).norm();
                let whole = best[from].0 + length_m + tuning::STEP_M;
                if whole < shortest.0
                    && length_m <= self.unambiguous_m()
                    && !self.leads_into_avoided(&at[from], &at[to])
                    && self.covers(&at[from], &at[to])
                {
                    shortest = (whole, from);
                }
            }
            if gives_up() {
                return path.clone();
            }
            best.push(shortest);
        }
        self.taken(path, &best)
    }

    /// The path by way of the places that were chosen.
    fn taken(&self, path: &Path, best: &[(f64, usize)]) -> Path {
        let mut taken = Vec::new();
        let mut to = path.len() - 1;
        while to > 0 {
            let from = best[to].1;
            let hop = if from + 1 == to {
                path[to].1
            } else {
                self.bypass(&path[from..=to])
            };
            taken.push((path[to].0, hop));
            to = from;
        }
        taken.push(path[0]);
        taken.reverse();
        taken
    }

    /// A straight line in place of a piece of a path: it is as uncertain, and takes as long for its
    /// length.
    fn bypass(&self, path: &[(u32, Hop)]) -> Hop {
        let (mut variance_m2, mut duration_s, mut length_m) = (0.0, 0.0, 0.0);
        for pair in path.windows(2) {
            let before = self.map.ways.waypoint(pair[0].0);
            if let (Some(before), Hop::Way(edge)) = (before, &pair[1].1)
                && let Some(way) = self.map.ways.way(edge.way)
            {
                variance_m2 += way.position_variance_m2();
                duration_s += super::cost::duration_s(way, before);
                length_m += edge.length_um as f64 / tuning::MICRO;
            }
        }
        let s_per_m = if length_m > 0.0 {
            duration_s / length_m
        } else {
            0.0
        };
        Hop::Shortcut {
            variance_m2,
            s_per_m,
        }
    }

    /// Length up to which two codes say how their places lie \[m\]: half the coarsest spacing,
    /// beyond which a phase difference means several displacements.
    fn unambiguous_m(&self) -> f64 {
        let settings = self.map.settings();
        let coarser = settings.grid_modules.saturating_sub(1);
        let coarser = i32::try_from(coarser).unwrap_or(i32::MAX);
        0.5 * settings.grid_spacing_m * settings.grid_ratio.powi(coarser)
    }

    fn leads_into_avoided(&self, from: &Point3<f64>, to: &Point3<f64>) -> bool {
        // One may leave a region in which the route starts.
        let leads_into = |region: &Region| !region.contains(from) && region.meets(from, to);
        let crosses = |blockage: &Blockage| match &blockage.blocked {
            Blocked::Ball(ball) => !ball.contains(from) && ball.meets(from, to),
            Blocked::Place(_) | Blocked::Way(_) => false,
        };
        self.avoided.iter().any(leads_into) || self.blockages.iter().any(crosses)
    }

    /// Length of a path \[µm\].
    pub(super) fn length_um(&self, path: &Path) -> u64 {
        let hops = path.windows(2).map(|pair| match &pair[1].1 {
            Hop::Way(edge) => edge.length_um,
            Hop::Start | Hop::Shortcut { .. } => {
                let [from, to] = [pair[0].0, pair[1].0].map(|number| self.position(number));
                micrometres((to - from).norm())
            }
        });
        hops.sum()
    }

    /// Where a waypoint is.
    fn position(&self, number: u32) -> Point3<f64> {
        let waypoint = self.map.ways.waypoint(number);
        waypoint.map_or_else(Point3::origin, |w| w.pose().translation.vector.into())
    }

    /// Whether a straight line lies wholly within the corridor.
    fn covers(&mut self, from: &Point3<f64>, to: &Point3<f64>) -> bool {
        let way = to - from;
        let length_m = way.norm();
        let mut covered = Vec::new();
        // Half a cell at a time, so that no cell on the line is left out by much.
        let steps = (length_m / (0.5 * tuning::CORRIDOR_CELL_M)).ceil().max(1.0);
        let mut last = None;
        let mut step = 0.0;
        while step <= steps {
            let cell = cell_of(&(from + way * (step / steps)));
            if last != Some(cell) {
                let radius_m = self.radius_m;
                for piece in self.cell(cell) {
                    covered.extend(within(from, &way, piece, radius_m));
                }
                last = Some(cell);
            }
            step += 1.0;
        }
        covered.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut until = 0.0;
        for (begins, ends) in covered {
            if begins > until {
                return false;
            }
            until = f64::max(until, ends);
        }
        until >= 1.0
    }

    /// The ways in and about a cell.
    fn cell(&mut self, cell: Cell) -> &[Piece] {
        let (map, radius_m, blockages) = (self.map, self.radius_m, self.blockages);
        self.cells.entry(cell).or_insert_with(|| {
            let centre = cell.map(|index| (index as f64 + 0.5) * tuning::CORRIDOR_CELL_M);
            let half_m = 0.5 * 3.0_f64.sqrt() * tuning::CORRIDOR_CELL_M;
            let reach_m = half_m + radius_m + map.places.reach_m();
            let places = map.places.within(&centre.into(), reach_m).into_iter();
            let mut pieces: BTreeMap<[PlaceId; 2], Piece> = BTreeMap::new();
            for (place, _) in places {
                for way in map.ways_at(place) {
                    if let Some(piece) = swept(map, way)
                        && !is_blocked(blockages, way, &piece)
                    {
                        pieces.insert(way.ends(), piece);
                    }
                }
            }
            pieces.into_values().collect()
        })
    }
}

/// The straight line of a way, if it was travelled nearly straight.
fn swept(map: &CognitiveMap, way: &Way) -> Option<Piece> {
    let ends = way.ends().map(|end| map.waypoint(end));
    let [from, to] = [ends[0]?, ends[1]?].map(|end| Point3::from(end.pose().translation.vector));
    let straight_m = (to - from).norm();
    // Agents enter a place up to a field radius from where it lies.
    (way.shortest_m() <= straight_m + map.settings().field_radius_m).then_some((from, to))
}

/// Whether nobody gets through a way, in one direction or the other.
fn is_blocked(blockages: &[Blockage], way: &Way, (a, b): &Piece) -> bool {
    let ends = way.ends();
    let (first, second) = ((ends[0], a), (ends[1], b));
    let mut blocked = blockages.iter().map(|blockage| &blockage.blocked);
    blocked.any(|what| what.blocks(first, second) || what.blocks(second, first))
}

fn cell_of(point: &Point3<f64>) -> Cell {
    #[expect(
        clippy::cast_possible_truncation,
        reason = "the cast saturates, and beyond nothing is near"
    )]
    [0, 1, 2].map(|k| (point[k] / tuning::CORRIDOR_CELL_M).floor() as i64)
}

/// The part of the line from `from` along `way` that lies within a distance of a piece, as a share
/// of it; `None` where nothing does. What lies within a distance of a line segment is convex, so it
/// is one part: found by those of the segment's cylinder and of the balls at its ends.
fn within(
    from: &Point3<f64>,
    way: &Vector3<f64>,
    (a, b): &Piece,
    radius_m: f64,
) -> Option<(f64, f64)> {
    let axis = b - a;
    let mut parts = [a, b]
        .map(|end| ball(&(from - end), way, radius_m))
        .to_vec();
    let square = axis.norm_squared();
    if square > 0.0 {
        // Of the line's points: where along the axis they lie, and how far beside it.
        let offset = from - a;
        let beside = |v: &Vector3<f64>| v - axis * (v.dot(&axis) / square);
        let cylinder = ball(&beside(&offset), &beside(way), radius_m);
        let (at, slope) = (offset.dot(&axis) / square, way.dot(&axis) / square);
        let slab = slab(at, slope);
        parts.push(cylinder.zip(slab).and_then(|(a, b)| common(a, b)));
    }
    let parts = parts.into_iter().flatten();
    let whole = parts.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))?;
    common(whole, (0.0, 1.0))
}

/// Where |offset + t · way| ≤ radius.
fn ball(offset: &Vector3<f64>, way: &Vector3<f64>, radius_m: f64) -> Option<(f64, f64)> {
    let (a, half_b) = (way.norm_squared(), offset.dot(way));
    let c = offset.norm_squared() - radius_m * radius_m;
    if a < f64::MIN_POSITIVE {
        return (c <= 0.0).then_some((f64::NEG_INFINITY, f64::INFINITY));
    }
    let root = half_b * half_b - a * c;
    (root >= 0.0).then(|| {
        let root = root.sqrt();
        ((-half_b - root) / a, (-half_b + root) / a)
    })
}

/// Where 0 ≤ at + t · slope ≤ 1.
fn slab(at: f64, slope: f64) -> Option<(f64, f64)> {
    if slope == 0.0 {
        return (0.0..=1.0)
            .contains(&at)
            .then_some((f64::NEG_INFINITY, f64::INFINITY));
    }
    let ends = [-at / slope, (1.0 - at) / slope];
    Some((ends[0].min(ends[1]), ends[0].max(ends[1])))
}

fn common(a: (f64, f64), b: (f64, f64)) -> Option<(f64, f64)> {
    let both = (a.0.max(b.0), a.1.min(b.1));
    (both.0 <= both.1).then_some(both)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn distance(point: &Point3<f64>, (a, b): &Piece) -> f64 {
        let axis = b - a;
        let square = axis.norm_squared();
        let at = if square > 0.0 {
            (point - a).dot(&axis) / square
        } else {
            0.0
        };
        (point - (a + axis * at.clamp(0.0, 1.0))).norm()
    }

    /// Coordinates that coincide now and then.
    fn point() -> impl Strategy<Value = Point3<f64>> {
        let x = || prop_oneof![(-4i32..4).prop_map(|x| f64::from(x) * 0.25), -1.0..1.0f64];
        [x(), x(), x()].prop_map(Point3::from)
    }

    proptest! {
        /// Against the distances of points along the line.
        #[test]
        fn the_part_within_is_where_points_are_near(
            ends in (point(), point()),
            piece in (point(), point()),
            radius_m in 0.05..0.5f64,
        ) {
            let way = ends.1 - ends.0;
            let part = within(&ends.0, &way, &piece, radius_m);
            for k in 0..=200 {
                let t = f64::from(k) / 200.0;
                let off = distance(&(ends.0 + way * t), &piece) - radius_m;
                if off.abs() > 1e-9 {
                    let inside = part.is_some_and(|(begins, ends)| (begins..=ends).contains(&t));
                    prop_assert_eq!(inside, off < 0.0, "{} {:?} {}", t, part, off);
                }
            }
        }
    }
}
