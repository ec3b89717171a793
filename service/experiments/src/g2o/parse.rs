//! Lines to entries.

use std::collections::BTreeMap;

use cognitive_map::experience::PoseInformation;
use nalgebra::{Isometry3, Matrix6, Quaternion, Translation3, UnitQuaternion, Vector3};

use super::error::{G2oError, LineReason};
use super::graph::{Edge, PoseGraph};

/// Where the unknowns of a planar pose stand among those of a spatial one.
const PLANAR_AXES: [usize; 3] = [0, 1, 5];

/// One line.
enum Entry {
    Vertex(u64, Isometry3<f64>),
    Edge(Box<Edge>),
}

/// The graph of a text, with the poses and edges that have a line.
pub(super) fn parse(text: &str) -> Result<PoseGraph, G2oError> {
    let mut kind = None;
    let mut poses = BTreeMap::new();
    let mut edges = Vec::new();
    for (index, line) in text.lines().enumerate() {
        let content = line.split('#').next().unwrap_or_default();
        let columns: Vec<&str> = content.split_whitespace().collect();
        if columns.is_empty() {
            continue;
        }
        let at_line = |reason| G2oError::Line {
            line: index + 1,
            reason,
        };
        let (is_planar, entry) = entry(&columns).map_err(at_line)?;
        if *kind.get_or_insert(is_planar) != is_planar {
            return Err(at_line(LineReason::Mixed {
                so_far: if is_planar { "spatial" } else { "planar" },
            }));
        }
        match entry {
            Entry::Vertex(id, pose) => {
                poses.insert(id, pose);
            }
            Entry::Edge(edge) => edges.push(*edge),
        }
    }
    if edges.is_empty() {
        return Err(G2oError::NoEdge);
    }
    Ok(PoseGraph {
        is_planar: kind.unwrap_or(false),
        poses,
        edges,
    })
}

/// The entry of a line, and whether it is planar.
fn entry(columns: &[&str]) -> Result<(bool, Entry), LineReason> {
    match columns[0] {
        "VERTEX_SE2" => {
            let numbers = numbers::<3>(columns, 2)?;
            Ok((true, Entry::Vertex(id(columns, 1)?, planar_pose(&numbers))))
        }
        "VERTEX_SE3:QUAT" => {
            let numbers = numbers::<7>(columns, 2)?;
            Ok((
                false,
                Entry::Vertex(id(columns, 1)?, spatial_pose(&numbers)?),
            ))
        }
        "EDGE_SE2" => {
            let numbers = numbers::<9>(columns, 3)?;
            let transform = planar_pose(&numbers);
            let edge = edge(columns, transform, &PLANAR_AXES, &numbers[3..])?;
            Ok((true, Entry::Edge(Box::new(edge))))
        }
        "EDGE_SE3:QUAT" => {
            let numbers = numbers::<28>(columns, 3)?;
            let transform = spatial_pose(&numbers)?;
            let edge = edge(columns, transform, &[0, 1, 2, 3, 4, 5], &numbers[7..])?;
            Ok((false, Entry::Edge(Box::new(edge))))
        }
        other => Err(LineReason::Kind(other.to_owned())),
    }
}

fn edge(
    columns: &[&str],
    transform: Isometry3<f64>,
    axes: &[usize],
    upper_triangle: &[f64],
) -> Result<Edge, LineReason> {
    let (from, to) = (id(columns, 1)?, id(columns, 2)?);
    if from == to {
        return Err(LineReason::Loop);
    }
    let mut matrix = Matrix6::zeros();
    let mut entries = upper_triangle.iter();
    for (k, &row) in axes.iter().enumerate() {
        for (&column, entry) in axes[k..].iter().zip(&mut entries) {
            matrix[(row, column)] = *entry;
            matrix[(column, row)] = *entry;
        }
    }
    let information = PoseInformation::new(&matrix)?;
    Ok(Edge {
        from,
        to,
        transform,
        information,
    })
}

/// The `N` numbers from column `first` on, which end the line.
fn numbers<const N: usize>(columns: &[&str], first: usize) -> Result<[f64; N], LineReason> {
    if columns.len() != first + N {
        return Err(LineReason::Columns {
            expected: first + N,
            found: columns.len(),
        });
    }
    let mut numbers = [0.0; N];
    for (k, number) in numbers.iter_mut().enumerate() {
        let parsed = columns[first + k]
            .parse::<f64>()
            .ok()
            .filter(|number| number.is_finite());
        *number = parsed.ok_or(LineReason::NotANumber {
            column: first + k + 1,
        })?;
    }
    Ok(numbers)
}

fn id(columns: &[&str], column: usize) -> Result<u64, LineReason> {
    columns[column]
        .parse()
        .map_err(|_| LineReason::NotAnId { column: column + 1 })
}

/// x, y, heading.
fn planar_pose(numbers: &[f64]) -> Isometry3<f64> {
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), numbers[2]);
    Isometry3::from_parts(Translation3::new(numbers[0], numbers[1], 0.0), turn)
}

/// x, y, z, qx, qy, qz, qw.
fn spatial_pose(numbers: &[f64]) -> Result<Isometry3<f64>, LineReason> {
    let quaternion = Quaternion::new(numbers[6], numbers[3], numbers[4], numbers[5]);
    let rotation = UnitQuaternion::try_new(quaternion, f64::MIN_POSITIVE)
        .filter(|rotation| (rotation.coords.norm() - 1.0).abs() < 1e-6) // the norm may overflow
        .ok_or(LineReason::NoDirection)?;
    let shift = Translation3::new(numbers[0], numbers[1], numbers[2]);
    Ok(Isometry3::from_parts(shift, rotation))
}
