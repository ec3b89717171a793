//! Random solids of voxels.

use std::collections::BTreeSet;

use nalgebra::Vector3;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// Coordinates of a voxel, in edges.
pub(super) type Voxel = Vector3<i32>;

/// Fewest and most bodies of a solid.
const BODIES: std::ops::RangeInclusive<usize> = 2..=5;
/// Least and largest half extent of a body along an axis \[edges\].
const HALF_EXTENT: std::ops::RangeInclusive<f64> = 0.8..=4.2;

/// What a solid is put together from.
#[derive(Clone, Copy, Debug)]
enum Body {
    Box,
    Ellipsoid,
    /// A cylinder, by the number of the axis along which it lies.
    Cylinder(usize),
}

impl Body {
    fn draw(random: &mut ChaCha8Rng) -> Self {
        match random.random_range(0..3) {
            0 => Self::Box,
            1 => Self::Ellipsoid,
            _ => Self::Cylinder(random.random_range(0..3)),
        }
    }

    /// Whether a point is inside; half extents are ones.
    fn holds(self, point: &Vector3<f64>) -> bool {
        match self {
            Self::Box => point.amax() <= 1.0,
            Self::Ellipsoid => point.norm_squared() <= 1.0,
            Self::Cylinder(along) => {
                let across = point.norm_squared() - point[along].powi(2);
                point[along].abs() <= 1.0 && across <= 1.0
            }
        }
    }
}

/// A solid in one piece: boxes, ellipsoids and cylinders of random extents, the middle of each but
/// the first in a voxel of those before.
pub(super) fn solid(random: &mut ChaCha8Rng) -> BTreeSet<[i32; 3]> {
    let bodies = random.random_range(BODIES);
    solid_of(bodies, random)
}

/// The same of so many bodies.
pub(super) fn solid_of(bodies: usize, random: &mut ChaCha8Rng) -> BTreeSet<[i32; 3]> {
    let mut voxels: Vec<Voxel> = vec![Voxel::zeros()];
    let mut filled = BTreeSet::from([[0; 3]]);
    for _ in 0..bodies {
        let middle = voxels[random.random_range(0..voxels.len())];
        let body = Body::draw(random);
        let half: Vector3<f64> = Vector3::from_fn(|_, _| random.random_range(HALF_EXTENT));
        for offset in cube(reach(&half)) {
            let point = offset.cast::<f64>().component_div(&half);
            if body.holds(&point) && filled.insert((middle + offset).into()) {
                voxels.push(middle + offset);
            }
        }
    }
    filled
}

fn reach(half: &Vector3<f64>) -> i32 {
    #[expect(clippy::cast_possible_truncation, reason = "a few edges")]
    let reach = half.amax().ceil() as i32;
    reach
}

/// All offsets up to a reach along each axis.
fn cube(reach: i32) -> impl Iterator<Item = Voxel> {
    let axis = move || -reach..=reach;
    axis().flat_map(move |x| axis().flat_map(move |y| axis().map(move |z| Voxel::new(x, y, z))))
}
