//! Lines to entries.

use std::collections::{BTreeMap, BTreeSet};

use crate::{PoseInformation, PositionInformation};
use geometry::{ALL_AXES, PLANAR_AXES, from_upper_triangle, rotation_from_xyzw};
use nalgebra::{Isometry3, Matrix3, Matrix6, Point3, Translation3, UnitQuaternion, Vector3};

use super::error::{G2oError, LineReason};
use super::graph::{Edge, G2oGraph, PointEdge};

/// What the lines so far have said.
#[derive(Default)]
struct Reader {
    is_planar: Option<bool>,
    poses: BTreeMap<u64, Isometry3<f64>>,
    points: BTreeMap<u64, Point3<f64>>,
    edges: Vec<Edge>,
    point_edges: Vec<PointEdge>,
    held: BTreeSet<u64>,
    sensors: BTreeMap<u64, Isometry3<f64>>,
    /// Of every node that was named, whether it is a point.
    is_point: BTreeMap<u64, bool>,
}

impl G2oGraph {
    /// Reads a text. A node that has edges and no entry of its own begins where the first edge to
    /// it from an earlier node puts it, or else at the origin.
    ///
    /// # Errors
    /// A line is no entry of the format, or there is no edge.
    pub fn read(text: &str) -> Result<Self, G2oError> {
        let mut graph = parse(text)?;
        graph.edges.sort_by_key(|edge| edge.from.max(edge.to));
        for edge in &graph.edges {
            let from = *graph
                .poses
                .entry(edge.from)
                .or_insert_with(Isometry3::identity);
            graph
                .poses
                .entry(edge.to)
                .or_insert_with(|| from * edge.transform);
        }
        for edge in &graph.point_edges {
            graph
                .poses
                .entry(edge.pose)
                .or_insert_with(Isometry3::identity);
        }
        Ok(graph)
    }
}

/// The graph of a text, with the nodes and edges that have a line.
fn parse(text: &str) -> Result<G2oGraph, G2oError> {
    let mut reader = Reader::default();
    for (index, line) in text.lines().enumerate() {
        let content = line.split('#').next().unwrap_or_default();
        let columns: Vec<&str> = content.split_whitespace().collect();
        if !columns.is_empty() {
            reader.line(&columns).map_err(|reason| G2oError::Line {
                line: index + 1,
                reason,
            })?;
        }
    }
    if reader.edges.is_empty() && reader.point_edges.is_empty() {
        return Err(G2oError::NoEdge);
    }
    let nowhere = |id: &&u64| !reader.is_point.contains_key(id);
    if let Some(&id) = reader.held.iter().find(nowhere) {
        return Err(G2oError::HeldNowhere(id));
    }
    Ok(G2oGraph {
        is_planar: reader.is_planar.unwrap_or(false),
        poses: reader.poses,
        edges: reader.edges,
        points: reader.points,
        point_edges: reader.point_edges,
        held: reader.held,
    })
}

impl Reader {
    fn line(&mut self, columns: &[&str]) -> Result<(), LineReason> {
        match columns[0] {
            kind if kind.starts_with("VERTEX_") => self.vertex(kind, columns)?,
            kind if kind.starts_with("EDGE_") => self.edge(kind, columns)?,
            "PARAMS_SE3OFFSET" => {
                self.planar(false)?;
                let numbers = numbers::<7>(columns, 2)?;
                self.sensors
                    .insert(id(columns, 1)?, spatial_pose(&numbers)?);
            }
            "FIX" => {
                for column in 1..columns.len() {
                    self.held.insert(id(columns, column)?);
                }
            }
            other => return Err(LineReason::Kind(other.to_owned())),
        }
        Ok(())
    }

    /// A pose or a point.
    fn vertex(&mut self, kind: &str, columns: &[&str]) -> Result<(), LineReason> {
        match kind {
            "VERTEX_SE2" => {
                self.planar(true)?;
                let numbers = numbers::<3>(columns, 2)?;
                let id = self.node(columns, 1, false)?;
                self.poses.insert(id, planar_pose(&numbers));
            }
            "VERTEX_SE3:QUAT" => {
                self.planar(false)?;
                let numbers = numbers::<7>(columns, 2)?;
                let id = self.node(columns, 1, false)?;
                self.poses.insert(id, spatial_pose(&numbers)?);
            }
            "VERTEX_XY" => {
                self.planar(true)?;
                let [x, y] = numbers::<2>(columns, 2)?;
                let id = self.node(columns, 1, true)?;
                self.points.insert(id, Point3::new(x, y, 0.0));
            }
            "VERTEX_TRACKXYZ" => {
                self.planar(false)?;
                let numbers = numbers::<3>(columns, 2)?;
                let id = self.node(columns, 1, true)?;
                self.points.insert(id, Point3::from(numbers));
            }
            other => return Err(LineReason::Kind(other.to_owned())),
        }
        Ok(())
    }

    /// A relative pose, or a sighting of a point.
    fn edge(&mut self, kind: &str, columns: &[&str]) -> Result<(), LineReason> {
        match kind {
            "EDGE_SE2" => {
                self.planar(true)?;
                let numbers = numbers::<9>(columns, 3)?;
                let information = from_upper_triangle(&PLANAR_AXES, &numbers[3..]);
                self.pose_edge(columns, planar_pose(&numbers), &information)
            }
            "EDGE_SE3:QUAT" => {
                self.planar(false)?;
                let numbers = numbers::<28>(columns, 3)?;
                let information = from_upper_triangle(&ALL_AXES, &numbers[7..]);
                self.pose_edge(columns, spatial_pose(&numbers)?, &information)
            }
            "EDGE_SE2_XY" => {
                self.planar(true)?;
                let numbers = numbers::<5>(columns, 3)?;
                let position = Vector3::new(numbers[0], numbers[1], 0.0);
                let information = from_upper_triangle(&[0, 1], &numbers[2..]);
                self.point_edge(columns, position, &information)
            }
            "EDGE_SE3_TRACKXYZ" => {
                self.planar(false)?;
                let numbers = numbers::<9>(columns, 4)?;
                let sensor = id(columns, 3)?;
                let on_body = self.sensors.get(&sensor);
                let on_body = *on_body.ok_or(LineReason::UnknownSensor(sensor))?;
                let seen = on_body * Point3::new(numbers[0], numbers[1], numbers[2]);
                let turn = on_body.rotation.to_rotation_matrix().into_inner();
                let information = from_upper_triangle(&[0, 1, 2], &numbers[3..]);
                let information = turn * information * turn.transpose();
                self.point_edge(columns, seen.coords, &information)
            }
            other => Err(LineReason::Kind(other.to_owned())),
        }
    }

    /// Says whether a line is planar: all are, or none.
    fn planar(&mut self, is_planar: bool) -> Result<(), LineReason> {
        if *self.is_planar.get_or_insert(is_planar) == is_planar {
            return Ok(());
        }
        Err(LineReason::Mixed {
            so_far: if is_planar { "spatial" } else { "planar" },
        })
    }

    /// The node of a column.
    fn node(&mut self, columns: &[&str], column: usize, is_point: bool) -> Result<u64, LineReason> {
        let id = id(columns, column)?;
        if *self.is_point.entry(id).or_insert(is_point) == is_point {
            Ok(id)
        } else {
            Err(LineReason::PoseAndPoint(id))
        }
    }

    fn pose_edge(
        &mut self,
        columns: &[&str],
        transform: Isometry3<f64>,
        information: &Matrix6<f64>,
    ) -> Result<(), LineReason> {
        let (from, to) = (self.node(columns, 1, false)?, self.node(columns, 2, false)?);
        if from == to {
            return Err(LineReason::Loop);
        }
        self.edges.push(Edge {
            from,
            to,
            transform,
            information: PoseInformation::new(information)?,
        });
        Ok(())
    }

    fn point_edge(
        &mut self,
        columns: &[&str],
        position: Vector3<f64>,
        information: &Matrix3<f64>,
    ) -> Result<(), LineReason> {
        let edge = PointEdge {
            pose: self.node(columns, 1, false)?,
            point: self.node(columns, 2, true)?,
            position,
            information: PositionInformation::new(information)?,
        };
        self.point_edges.push(edge);
        Ok(())
    }
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
    let quaternion = [numbers[3], numbers[4], numbers[5], numbers[6]];
    let rotation = rotation_from_xyzw(quaternion).ok_or(LineReason::NoDirection)?;
    let shift = Translation3::new(numbers[0], numbers[1], numbers[2]);
    Ok(Isometry3::from_parts(shift, rotation))
}
