//! The seed's octant model: Algorithm 1, the octants, and the measures of a step.

use nalgebra::{Point3, Vector3};

/// What Algorithm 1 computes at a position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OctantActivation {
    /// Grid indices (I, J, K).
    pub index: [i64; 3],
    /// The eight centres (Gx, Gy, Gz) \[m\], in the algorithm's order: z fastest, −1 before 1.
    pub centres: [Point3<f64>; 8],
    /// The final activation, in \[0, 1\]: the largest of the eight.
    pub activation: f64,
}

/// Algorithm 1 of the seed, literally: the activation of the grid neuron nearest to `position`
/// \[m\].
///
/// ```text
/// I = ROUND(X / W)    J = CEIL(Y / H) − 1    K = FLOOR(Z / D)
/// G = (I W ± W/2, J H ± H/2, K D ± D/2)                          eight centres
/// activation = max over G of  exp(−d² / (2 σ²)) if d < R else 0     d = |position − G|
/// ```
///
/// `lattice_size_m` = (W, H, D), `sigma_m` = σ and `cutoff_radius_m` = R are positive. ROUND takes
/// halves away from zero. The three indices are rounded differently, as the paper has it, but on
/// every axis one of the two centres is the odd multiple of half the size that is nearest: the
/// activation is that of a simple cubic lattice, shifted by half a cell.
pub fn octant_activation(
    position: &Point3<f64>,
    lattice_size_m: &Vector3<f64>,
    sigma_m: f64,
    cutoff_radius_m: f64,
) -> OctantActivation {
    let index = Vector3::new(
        (position.x / lattice_size_m.x).round(),
        (position.y / lattice_size_m.y).ceil() - 1.0,
        (position.z / lattice_size_m.z).floor(),
    );
    let mut centres = [Point3::origin(); 8];
    let mut activation = 0.0_f64;
    for (octant, centre) in centres.iter_mut().enumerate() {
        let side = |bit: usize| if octant & bit == 0 { -1.0 } else { 1.0 };
        let offset = Vector3::new(side(4), side(2), side(1)).component_mul(lattice_size_m) / 2.0;
        *centre = Point3::from(index.component_mul(lattice_size_m) + offset);
        let distance_m = displacement_m(position, centre);
        if distance_m < cutoff_radius_m {
            activation =
                activation.max((-distance_m * distance_m / (2.0 * sigma_m * sigma_m)).exp());
        }
    }
    #[expect(
        clippy::cast_possible_truncation,
        reason = "no legal position is 2⁶³ cells away"
    )]
    let index = [index.x as i64, index.y as i64, index.z as i64];
    OctantActivation {
        index,
        centres,
        activation,
    }
}

/// The octant, 1 to 8, of a direction by the signs of its components (seed section 3.1 B):
/// 1 (+++), 2 (−++), 3 (−−+), 4 (+−+), 5 (++−), 6 (−+−), 7 (−−−), 8 (+−−).
///
/// The seed leaves the planes between octants open; here zero counts as plus.
pub fn octant_of(direction: &Vector3<f64>) -> u8 {
    let quadrant = match (direction.x >= 0.0, direction.y >= 0.0) {
        (true, true) => 1,
        (false, true) => 2,
        (false, false) => 3,
        (true, false) => 4,
    };
    if direction.z >= 0.0 {
        quadrant
    } else {
        quadrant + 4
    }
}

/// Displacement between two positions \[m\] (seed Eq. 2): their Euclidean distance.
pub fn displacement_m(from: &Point3<f64>, to: &Point3<f64>) -> f64 {
    (to - from).norm()
}

/// Turning angle between two consecutive movements, in \[0, π\] (seed Eq. 3).
///
/// ```text
/// θ = arccos(v₁·v₂ / (|v₁| |v₂|)) = atan2(|v₁ × v₂|, v₁·v₂)
/// ```
///
/// The second form is computed: near 0 and π the arccos loses half the digits, and rounding can
/// push its argument past one. A movement of zero length has no direction: the angle is then 0.
pub fn turning_angle_rad(before: &Vector3<f64>, after: &Vector3<f64>) -> f64 {
    before.cross(after).norm().atan2(before.dot(after))
}
