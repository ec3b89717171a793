//! The two rooms of the paper's first two experiments.

use cogmap_worlds::{ObstacleWorld, SIDE_M};

/// Edge of the empty room \[m\] (seed paper, Section 4.1).
const GRID_ALIGNED_SIDE_M: f64 = 10.0;

/// A room of the seed paper.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Environment {
    /// Environment 1 (Section 4.1): an empty cube of 10 m, 100 steps.
    GridAligned,
    /// Environment 2 (Section 4.2): a cube of 15 m with 50 random cubes, 1000 steps.
    ObstacleRich,
}

impl Environment {
    /// Its short name: `env1` or `env2`.
    pub fn name(self) -> &'static str {
        match self {
            Self::GridAligned => "env1",
            Self::ObstacleRich => "env2",
        }
    }

    /// What it is, in a line.
    pub fn title(self) -> &'static str {
        match self {
            Self::GridAligned => "Environment 1: empty room of 10 × 10 × 10 m",
            Self::ObstacleRich => "Environment 2: room of 15 × 15 × 15 m with 50 cubes",
        }
    }

    /// Steps of the paper's walk in it.
    pub fn steps(self) -> u64 {
        match self {
            Self::GridAligned => 100,
            Self::ObstacleRich => 1000,
        }
    }

    /// The room; its cubes, if it has any, are those of the seed.
    pub fn world(self, seed: u64) -> ObstacleWorld {
        match self {
            Self::GridAligned => ObstacleWorld::empty(GRID_ALIGNED_SIDE_M),
            Self::ObstacleRich => ObstacleWorld::new(seed),
        }
    }

    /// Edge of the room \[m\].
    pub fn side_m(self) -> f64 {
        match self {
            Self::GridAligned => GRID_ALIGNED_SIDE_M,
            Self::ObstacleRich => SIDE_M,
        }
    }

    /// Mean and root mean square of the ATE that the paper states \[m\] (Table 1); it states none
    /// for the first environment.
    pub fn paper_ate_m(self) -> Option<(f64, f64)> {
        match self {
            Self::GridAligned => None,
            Self::ObstacleRich => Some((0.42, 0.46)),
        }
    }
}
