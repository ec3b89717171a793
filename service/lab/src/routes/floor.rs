//! Floors: walls, what is free between them, and how one gets from here to there.

use std::collections::VecDeque;

use nalgebra::Point2;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Edge of a floor \[m\].
const SIDE_M: f64 = 12.0;
/// Distance of the points between which paths are looked for \[m\].
const CELL_M: f64 = 0.3;
/// Distance that a body keeps from walls \[m\].
const CLEARANCE_M: f64 = 0.2;
/// Points along an edge.
const CELLS: usize = 40;

/// A kind of floor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FloorKind {
    /// A hall with pillars.
    Hall,
    /// Offices with walls of 0.1 m and doors.
    Office,
    /// A maze without circles.
    Maze,
}

/// A box that is not free: least and largest coordinates \[m\].
type Wall = [f64; 4];

/// A floor.
#[derive(Clone, Debug)]
pub struct Floor {
    walls: Vec<Wall>,
}

impl FloorKind {
    /// All kinds.
    pub const ALL: [Self; 3] = [Self::Hall, Self::Office, Self::Maze];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Hall => "hall",
            Self::Office => "office",
            Self::Maze => "maze",
        }
    }
}

impl Floor {
    /// The floor of a kind and seed.
    pub fn new(kind: FloorKind, seed: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let walls = match kind {
            FloorKind::Hall => (0..25).map(|k| pillar(k, &mut random)).collect(),
            FloorKind::Office => office(),
            FloorKind::Maze => maze(&mut random),
        };
        Self { walls }
    }

    /// Whether a body may be at a position.
    pub fn is_free(&self, at: &Point2<f64>) -> bool {
        let inside = |x: f64| (CLEARANCE_M..=SIDE_M - CLEARANCE_M).contains(&x);
        let hits = |wall: &Wall| {
            at.x > wall[0] - CLEARANCE_M
                && at.x < wall[2] + CLEARANCE_M
                && at.y > wall[1] - CLEARANCE_M
                && at.y < wall[3] + CLEARANCE_M
        };
        inside(at.x) && inside(at.y) && !self.walls.iter().any(hits)
    }

    /// A free position.
    pub fn any_free(&self, random: &mut ChaCha8Rng) -> Point2<f64> {
        loop {
            let cell = random.random_range(0..CELLS * CELLS);
            if self.is_free(&point(cell)) {
                return point(cell);
            }
        }
    }

    /// Points on the way from one position to another; none where there is no way.
    pub fn path(&self, from: &Point2<f64>, to: &Point2<f64>) -> Vec<Point2<f64>> {
        let (Some(start), Some(goal)) = (self.near(from), self.near(to)) else {
            return Vec::new();
        };
        let mut next = vec![usize::MAX; CELLS * CELLS];
        let mut open = VecDeque::from([goal]);
        next[goal] = goal;
        while let Some(cell) = open.pop_front() {
            for neighbour in neighbours(cell) {
                if next[neighbour] == usize::MAX && self.is_free(&point(neighbour)) {
                    next[neighbour] = cell;
                    open.push_back(neighbour);
                }
            }
        }
        let (mut path, mut at) = (vec![point(start)], start);
        while at != goal {
            if next[at] == usize::MAX {
                return Vec::new();
            }
            at = next[at];
            path.push(point(at));
        }
        path
    }

    /// The free point nearest to a position.
    fn near(&self, at: &Point2<f64>) -> Option<usize> {
        let free = (0..CELLS * CELLS).filter(|cell| self.is_free(&point(*cell)));
        free.min_by(|a, b| (point(*a) - at).norm().total_cmp(&(point(*b) - at).norm()))
    }
}

fn point(cell: usize) -> Point2<f64> {
    let along = |index: usize| (index as f64 + 0.5) * CELL_M;
    Point2::new(along(cell % CELLS), along(cell / CELLS))
}

fn neighbours(cell: usize) -> impl Iterator<Item = usize> {
    let (x, y) = (cell % CELLS, cell / CELLS);
    let left = (x > 0).then(|| cell - 1);
    let right = (x + 1 < CELLS).then(|| cell + 1);
    let below = (y > 0).then(|| cell - CELLS);
    let above = (y + 1 < CELLS).then(|| cell + CELLS);
    [left, right, below, above].into_iter().flatten()
}

fn pillar(number: usize, random: &mut ChaCha8Rng) -> Wall {
    let at = |index: usize| (index as f64 + 0.5) * SIDE_M / 5.0;
    let mut shift = || random.random_range(-0.4..0.4);
    let (x, y) = (at(number % 5) + shift(), at(number / 5) + shift());
    [x - 0.25, y - 0.25, x + 0.25, y + 0.25]
}

/// Rooms of 4 m by 4.5 m on both sides of a corridor, each with a door onto it.
fn office() -> Vec<Wall> {
    let mut walls = Vec::new();
    for y in [4.5, 7.5] {
        for room in 0..3 {
            let x = f64::from(room) * 4.0;
            walls.push([x, y - 0.05, x + 1.5, y + 0.05]);
            walls.push([x + 2.5, y - 0.05, x + 4.0, y + 0.05]);
        }
    }
    for x in [4.0, 8.0] {
        walls.push([x - 0.05, 0.0, x + 0.05, 4.5]);
        walls.push([x - 0.05, 7.5, x + 0.05, SIDE_M]);
    }
    walls
}

/// Cells of 1.5 m, joined by a random tree.
fn maze(random: &mut ChaCha8Rng) -> Vec<Wall> {
    const EDGE: usize = 8;
    let size_m = SIDE_M / EDGE as f64;
    let mut opened = std::collections::BTreeSet::new();
    let mut seen = [false; EDGE * EDGE];
    let mut open = vec![0_usize];
    seen[0] = true;
    while let Some(&cell) = open.last() {
        let (x, y) = (cell % EDGE, cell / EDGE);
        let mut others = Vec::new();
        others.extend((x > 0).then(|| cell - 1));
        others.extend((x + 1 < EDGE).then(|| cell + 1));
        others.extend((y > 0).then(|| cell - EDGE));
        others.extend((y + 1 < EDGE).then(|| cell + EDGE));
        others.retain(|other| !seen[*other]);
        if others.is_empty() {
            open.pop();
            continue;
        }
        let next = others[random.random_range(0..others.len())];
        seen[next] = true;
        opened.insert((cell.min(next), cell.max(next)));
        open.push(next);
    }
    let mut walls = Vec::new();
    for cell in 0..EDGE * EDGE {
        let (x, y) = ((cell % EDGE) as f64 * size_m, (cell / EDGE) as f64 * size_m);
        if !opened.contains(&(cell, cell + 1)) {
            walls.push([
                x + size_m - 0.05,
                y - 0.05,
                x + size_m + 0.05,
                y + size_m + 0.05,
            ]);
        }
        if !opened.contains(&(cell, cell + EDGE)) {
            walls.push([
                x - 0.05,
                y + size_m - 0.05,
                x + size_m + 0.05,
                y + size_m + 0.05,
            ]);
        }
    }
    walls
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn from_everywhere_there_is_a_way_along_free_points() {
        for kind in FloorKind::ALL {
            let floor = Floor::new(kind, 1);
            let mut random = ChaCha8Rng::seed_from_u64(2);
            for _ in 0..20 {
                let ends = [floor.any_free(&mut random), floor.any_free(&mut random)];
                let path = floor.path(&ends[0], &ends[1]);
                assert_eq!(path.last(), Some(&ends[1]), "{kind:?}");
                assert!(path.iter().all(|at| floor.is_free(at)));
                let steps = path.windows(2).map(|pair| (pair[1] - pair[0]).norm());
                assert!(steps.fold(0.0, f64::max) < CELL_M + 1e-9);
            }
        }
    }
}
