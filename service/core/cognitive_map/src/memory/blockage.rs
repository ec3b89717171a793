//! Blockages: where nobody gets through for now.

use nalgebra::Point3;

use super::ids::PlaceId;
use state::{state_of_enum, state_of_newtype, state_of_struct};

/// Most blockages at a time: balls among them are compared with every way that a search looks at.
pub const BLOCKAGES_MAX: usize = 256;

/// A blockage, by a number that no other one has had.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct BlockageId(pub u64);

/// Somewhere nobody gets through, until that is taken back, its time has come, or somebody does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Blockage {
    /// Its number.
    pub id: BlockageId,
    /// What is blocked.
    pub blocked: Blocked,
    /// It ends with the first sample of any agent that has this stamp or a later one \[ns\].
    pub until_ns: Option<i64>,
}

/// What is blocked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Blocked {
    /// A place, with all ways to it.
    Place(PlaceId),
    /// The way between two places, in both directions.
    Way([PlaceId; 2]),
    /// All ways whose straight lines come near a point.
    Ball(Ball),
}

/// The points within a distance of one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ball {
    /// The middle, in `map`.
    pub at: Point3<f64>,
    /// The distance \[m\].
    pub radius_m: f64,
}

impl Ball {
    /// Whether a point lies within.
    pub fn contains(&self, point: &Point3<f64>) -> bool {
        (point - self.at).norm() <= self.radius_m
    }

    /// Whether the straight line between two points has a point within.
    pub fn meets(&self, from: &Point3<f64>, to: &Point3<f64>) -> bool {
        distance_to_line(&self.at, from, to) <= self.radius_m
    }
}

impl Blocked {
    /// Whether nobody gets from one place to another. One may leave where one is.
    pub fn blocks(&self, from: (PlaceId, &Point3<f64>), to: (PlaceId, &Point3<f64>)) -> bool {
        match self {
            Self::Place(place) => to.0 == *place,
            Self::Way([a, b]) => (from.0, to.0) == (*a, *b) || (from.0, to.0) == (*b, *a),
            Self::Ball(ball) => !ball.contains(from.1) && ball.meets(from.1, to.1),
        }
    }
}

/// Distance of a point from the straight line between two others \[m\].
pub(crate) fn distance_to_line(point: &Point3<f64>, a: &Point3<f64>, b: &Point3<f64>) -> f64 {
    let axis = b - a;
    let square = axis.norm_squared();
    let at = if square > 0.0 {
        ((point - a).dot(&axis) / square).clamp(0.0, 1.0)
    } else {
        0.0
    };
    (point - (a + axis * at)).norm()
}

state_of_newtype!(BlockageId);
state_of_struct!(Ball { at, radius_m });
state_of_struct!(Blockage {
    id,
    blocked,
    until_ns
});
state_of_enum!(Blocked {
    Place(place) = 0,
    Way(ends) = 1,
    Ball(ball) = 2,
});
