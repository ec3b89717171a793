//! A start for the relaxation that does not depend on where the nodes are: rotations first, then
//! positions.
//!
//! Both are linear least squares, so they have one minimum each (Martinec & Pajdla 2007; Carlone et
//! al. 2015, Sec. IV, "chordal"): first over all 3×3 matrices instead of rotations, then, with the
//! nearest rotations held, over positions.

use nalgebra::{Isometry3, Matrix3, Matrix6, Rotation3, UnitQuaternion, Vector3};

use geometry::{planar_procrustes, procrustes};

use super::elimination::{CliqueTree, Equations, Front, slot};
use super::graph::PoseGraph;
use super::link::Link;
use super::node::{Freedom, Node};

/// Weight of what is held, against a weight of 1 for the link that is weighted most.
const HELD: f64 = 1e6;

/// Steps towards the nearest rotation; the error is squared in each.
const PROJECTION_STEPS: usize = 12;

/// Poses that the links agree on to first order. `tree` lends its structure.
pub(super) fn start(map: &PoseGraph, tree: &CliqueTree) -> Vec<Isometry3<f64>> {
    let mut poses: Vec<_> = map.nodes.iter().map(|node| node.pose).collect();
    let rotations = Rotations {
        map,
        held: held_weights(map, rotation_weight),
        poses: &poses,
    };
    let solution = solve(&rotations, tree);
    let turned: Vec<UnitQuaternion<f64>> = map
        .nodes
        .iter()
        .enumerate()
        .map(|(index, node)| {
            let column = |k| Vector3::from_column_slice(&solution[slot(index, k, 3)..][..3]);
            let transposed = Matrix3::from_columns(&[column(0), column(1), column(2)]);
            turned(node, &transposed.transpose())
        })
        .collect();
    for (pose, rotation) in poses.iter_mut().zip(turned) {
        pose.rotation = rotation;
    }
    let positions = Positions {
        map,
        held: held_weights(map, position_weight),
        poses: &poses,
    };
    let solution = solve(&positions, tree);
    for (index, node) in map.nodes.iter().enumerate() {
        let coordinate = |k| solution[slot(index, k, 3)];
        let position = Vector3::new(coordinate(0), coordinate(1), coordinate(2));
        poses[index].translation.vector = shifted(node, &position);
    }
    poses
}

fn solve<E: Equations>(equations: &E, tree: &CliqueTree) -> Vec<f64> {
    let mut tree = tree.restructured(equations);
    tree.refactor(equations, &tree.all());
    tree.solve()
}

/// The rotation next to a matrix that the node can have.
fn turned(node: &Node, matrix: &Matrix3<f64>) -> UnitQuaternion<f64> {
    if !node.is_pose() || node.freedom() == Freedom::Held {
        return node.pose.rotation;
    }
    if node.freedom() == Freedom::Planar {
        let relative = node
            .pose
            .rotation
            .to_rotation_matrix()
            .matrix()
            .tr_mul(matrix);
        return node.pose.rotation * planar_procrustes(&relative);
    }
    nearest_rotation(matrix)
}

/// The position next to another that the node can have.
fn shifted(node: &Node, position: &Vector3<f64>) -> Vector3<f64> {
    let old = node.pose.translation.vector;
    if !node.is_pose() && !node.is_point() {
        return old;
    }
    match node.freedom() {
        Freedom::Held => old,
        Freedom::Full => *position,
        Freedom::Planar => {
            let mut shift = node
                .pose
                .rotation
                .inverse_transform_vector(&(position - old));
            shift.z = 0.0;
            old + node.pose.rotation * shift
        }
    }
}

/// The rotation with the least Frobenius distance from a matrix.
fn nearest_rotation(matrix: &Matrix3<f64>) -> UnitQuaternion<f64> {
    // Newton's iteration for the orthogonal polar factor (Higham 1986) keeps the determinant's
    // sign.
    let mut factor = *matrix;
    if factor.determinant() > 1e-6 * factor.norm().powi(3) {
        for _ in 0..PROJECTION_STEPS {
            let Some(inverse) = factor.try_inverse() else {
                break;
            };
            let next = (factor + inverse.transpose()) * 0.5;
            let change = (next - factor).norm();
            factor = next;
            if change < 1e-12 {
                return UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(
                    factor,
                ));
            }
        }
    }
    procrustes(matrix)
}

/// How much a link says about rotations \[1/rad²\], and about positions \[1/m²\]: the sum over the
/// three axes.
fn rotation_weight(link: &Link) -> f64 {
    match link {
        Link::PosePrior { information, .. }
        | Link::Between { information, .. }
        | Link::Odometry { information, .. } => information.matrix().diagonal().rows(3, 3).sum(),
        Link::PointPrior { .. }
        | Link::Sighting { .. }
        | Link::Range { .. }
        | Link::CalibrationPrior { .. }
        | Link::CalibrationWander { .. } => 0.0,
    }
}

fn position_weight(link: &Link) -> f64 {
    match link {
        Link::PosePrior { information, .. }
        | Link::Between { information, .. }
        | Link::Odometry { information, .. } => information.matrix().diagonal().rows(0, 3).sum(),
        Link::PointPrior { information, .. } | Link::Sighting { information, .. } => {
            information.matrix().trace()
        }
        // A distance says nothing linear about positions.
        Link::Range { .. } | Link::CalibrationPrior { .. } | Link::CalibrationWander { .. } => 0.0,
    }
}

/// For each node the weight with which it is held where it is: of nodes that no prior connects
/// with `map`, even through others, the oldest.
fn held_weights(map: &PoseGraph, weight: impl Fn(&Link) -> f64) -> Vec<f64> {
    let mut parent: Vec<usize> = (0..map.nodes.len()).collect();
    let mut is_held: Vec<bool> = map
        .nodes
        .iter()
        .map(|n| n.freedom() == Freedom::Held)
        .collect();
    let mut most = 0.0_f64;
    let root_of = |parent: &mut Vec<usize>, mut node: usize| {
        while parent[node] != node {
            parent[node] = parent[parent[node]];
            node = parent[node];
        }
        node
    };
    let mut has_prior = is_held.clone();
    for slot in map
        .links
        .iter()
        .filter(|slot| slot.is_on && weight(&slot.link) > 0.0)
    {
        most = most.max(weight(&slot.link));
        let (from, to) = slot.link.nodes();
        let (a, b) = (
            root_of(&mut parent, from as usize),
            root_of(&mut parent, to as usize),
        );
        let (older, younger) = (a.min(b), a.max(b));
        parent[younger] = older;
        has_prior[older] |= has_prior[younger] || from == to;
    }
    for node in 0..map.nodes.len() {
        is_held[node] |= parent[node] == node && !has_prior[node];
    }
    let held = most.max(f64::MIN_POSITIVE) * HELD;
    is_held
        .iter()
        .map(|&is_held| if is_held { held } else { 0.0 })
        .collect()
}

/// Σ w ‖Yⱼ − Zᵀ Yᵢ‖² over the transposed rotations Y.
struct Rotations<'a> {
    map: &'a PoseGraph,
    held: Vec<f64>,
    poses: &'a [Isometry3<f64>],
}

/// The unknowns of three right-hand sides.
const ROWS: [usize; 3] = [0, 1, 2];

impl Equations for Rotations<'_> {
    const N_RIGHT: usize = 3;

    fn dimension(&self, variable: u32) -> usize {
        if self.map.nodes[variable as usize].is_pose() {
            3
        } else {
            0
        }
    }

    fn links(&self, variable: u32) -> &[(u32, [u32; 2])] {
        &self.map.links_of[variable as usize]
    }

    fn add_own(&self, variable: u32, front: &mut Front<'_>) {
        let held = self.held[variable as usize];
        if held > 0.0 && self.dimension(variable) > 0 {
            let rotation = self.poses[variable as usize].rotation;
            add_prior(variable, &rotation, held, front);
        }
    }

    fn add(&self, link: u32, front: &mut Front<'_>) {
        let slot = &self.map.links[link as usize];
        let weight = rotation_weight(&slot.link);
        if !slot.is_on || weight == 0.0 {
            return;
        }
        if let Link::PosePrior { pose, at, .. } = &slot.link {
            return add_prior(pose.0, &at.rotation, weight, front);
        }
        let Some(transform) = relative_pose(self.map, &slot.link) else {
            return;
        };
        let (from, to) = slot.link.nodes();
        let (from, to) = ((from, &ROWS[..]), (to, &ROWS[..]));
        let own = Matrix6::from_diagonal_element(weight);
        front.add(from, from, &own);
        front.add(to, to, &own);
        let mut cross = Matrix6::zeros();
        let rotation = transform.rotation.to_rotation_matrix();
        let block = rotation.matrix().transpose() * -weight;
        cross.fixed_view_mut::<3, 3>(0, 0).copy_from(&block);
        front.add(to, from, &cross);
    }
}

/// The relative pose that a link measured, of a motion by the calibration as it is.
fn relative_pose(map: &PoseGraph, link: &Link) -> Option<Isometry3<f64>> {
    match link {
        Link::Between { transform, .. } => Some(*transform),
        Link::Odometry {
            reading,
            calibration,
            ..
        } => Some(reading.motion(&map.calibration(*calibration))),
        _ => None,
    }
}

/// Adds weight · ‖Y − Rᵀ‖².
fn add_prior(variable: u32, rotation: &UnitQuaternion<f64>, weight: f64, front: &mut Front<'_>) {
    let matrix = rotation.to_rotation_matrix().into_inner();
    front.add(
        (variable, &ROWS),
        (variable, &ROWS),
        &Matrix6::from_diagonal_element(weight),
    );
    for k in 0..3 {
        let column = matrix.row(k).transpose() * weight;
        front.add_right(variable, &ROWS, k, column.as_slice());
    }
}

/// Σ w ‖tⱼ − tᵢ − Rᵢ z‖² over the positions t, one coordinate for each right-hand side.
struct Positions<'a> {
    map: &'a PoseGraph,
    held: Vec<f64>,
    poses: &'a [Isometry3<f64>],
}

impl Positions<'_> {
    fn add_prior(variable: u32, at: &Vector3<f64>, weight: f64, front: &mut Front<'_>) {
        let own = (variable, &ROWS[..1]);
        front.add(own, own, &Matrix6::from_diagonal_element(weight));
        for k in 0..3 {
            front.add_right(variable, &ROWS[..1], k, &[at[k] * weight]);
        }
    }
}

impl Equations for Positions<'_> {
    const N_RIGHT: usize = 3;

    fn dimension(&self, variable: u32) -> usize {
        let node = &self.map.nodes[variable as usize];
        usize::from(node.is_pose() || node.is_point())
    }

    fn links(&self, variable: u32) -> &[(u32, [u32; 2])] {
        &self.map.links_of[variable as usize]
    }

    fn add_own(&self, variable: u32, front: &mut Front<'_>) {
        let held = self.held[variable as usize];
        if held > 0.0 && self.dimension(variable) > 0 {
            let at = self.poses[variable as usize].translation.vector;
            Self::add_prior(variable, &at, held, front);
        }
    }

    fn add(&self, link: u32, front: &mut Front<'_>) {
        let slot = &self.map.links[link as usize];
        let weight = position_weight(&slot.link);
        if !slot.is_on || weight == 0.0 {
            return;
        }
        let seen = match &slot.link {
            Link::PosePrior { pose, at, .. } => {
                return Self::add_prior(pose.0, &at.translation.vector, weight, front);
            }
            Link::PointPrior { point, at, .. } => {
                return Self::add_prior(point.0, &at.coords, weight, front);
            }
            Link::Sighting { position, .. } => *position,
            link => match relative_pose(self.map, link) {
                Some(transform) => transform.translation.vector,
                None => return,
            },
        };
        let (from, to) = slot.link.nodes();
        let step = self.poses[from as usize].rotation * seen * weight;
        let (from, to) = ((from, &ROWS[..1]), (to, &ROWS[..1]));
        let mut block = Matrix6::zeros();
        block[(0, 0)] = weight;
        front.add(from, from, &block);
        front.add(to, to, &block);
        front.add(to, from, &-block);
        for k in 0..3 {
            front.add_right(to.0, to.1, k, &[step[k]]);
            front.add_right(from.0, from.1, k, &[-step[k]]);
        }
    }
}
