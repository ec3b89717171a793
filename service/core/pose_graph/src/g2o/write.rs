//! Pose graph to text.

use std::fmt::Write as _;

use crate::{Link, PoseGraph, SightingTarget};
use geometry::{ALL_AXES, PLANAR_AXES};
use nalgebra::Isometry3;

/// The poses, points and links of a graph, for other programs. A pose that is held, or has a
/// prior, is written as one that stays where it is; a sighting of a place on another pose has no
/// entry in the format, and is left out.
pub fn write_g2o(graph: &PoseGraph) -> String {
    let is_planar = graph.is_planar();
    let mut text = String::new();
    // Writing to a string cannot fail.
    if !is_planar {
        let _ = writeln!(text, "PARAMS_SE3OFFSET 0 0 0 0 0 0 0 1");
    }
    for (id, pose) in graph.poses() {
        let kind = if is_planar { "SE2" } else { "SE3:QUAT" };
        let _ = writeln!(
            text,
            "VERTEX_{kind} {}{}",
            id.number(),
            columns(pose, is_planar)
        );
        if graph.is_held(id) {
            let _ = writeln!(text, "FIX {}", id.number());
        }
    }
    for (id, point) in graph.points() {
        let number = id.number();
        let _ = if is_planar {
            writeln!(text, "VERTEX_XY {number} {} {}", point.x, point.y)
        } else {
            writeln!(
                text,
                "VERTEX_TRACKXYZ {number} {} {} {}",
                point.x, point.y, point.z
            )
        };
    }
    for link in graph.links() {
        let _ = match motion(graph, link) {
            Some(between) => line(&between, is_planar, &mut text),
            None => line(link, is_planar, &mut text),
        };
    }
    text
}

/// A motion by odometry as a link between two poses, by its calibration as it is.
fn motion(graph: &PoseGraph, link: &Link) -> Option<Link> {
    let Link::Odometry {
        from,
        to,
        calibration,
        reading,
        information,
    } = link
    else {
        return None;
    };
    Some(Link::Between {
        from: *from,
        to: *to,
        transform: reading.motion(&graph.calibration(*calibration)),
        information: *information,
    })
}

/// The line of a link.
fn line(link: &Link, is_planar: bool, text: &mut String) -> std::fmt::Result {
    match link {
        Link::Between {
            from,
            to,
            transform,
            information,
        } => {
            let kind = if is_planar { "SE2" } else { "SE3:QUAT" };
            let (from, to) = (from.number(), to.number());
            write!(
                text,
                "EDGE_{kind} {from} {to}{}",
                columns(transform, is_planar)
            )?;
            let axes: &[usize] = if is_planar { &PLANAR_AXES } else { &ALL_AXES };
            for (index, &row) in axes.iter().enumerate() {
                for &column in &axes[index..] {
                    write!(text, " {}", information.matrix()[(row, column)])?;
                }
            }
            writeln!(text)
        }
        Link::PosePrior { pose, .. } => writeln!(text, "FIX {}", pose.number()),
        Link::Sighting {
            from,
            target: SightingTarget::Point(point),
            position,
            information,
        } => {
            let (from, point) = (from.number(), point.number());
            let matrix = information.matrix();
            let entry = |row, column| matrix[(row, column)];
            if is_planar {
                let [a, b, c] = [entry(0, 0), entry(0, 1), entry(1, 1)];
                return writeln!(
                    text,
                    "EDGE_SE2_XY {from} {point} {} {} {a} {b} {c}",
                    position.x, position.y
                );
            }
            write!(
                text,
                "EDGE_SE3_TRACKXYZ {from} {point} 0 {} {} {}",
                position.x, position.y, position.z
            )?;
            for row in 0..3 {
                for column in row..3 {
                    write!(text, " {}", entry(row, column))?;
                }
            }
            writeln!(text)
        }
        _ => Ok(()),
    }
}

/// A pose as the format has it, a space before each column.
fn columns(pose: &Isometry3<f64>, is_planar: bool) -> String {
    let at = pose.translation.vector;
    if is_planar {
        let (_, _, heading) = pose.rotation.euler_angles();
        return format!(" {} {} {heading}", at.x, at.y);
    }
    let [x, y, z, w] = pose.rotation.coords.into();
    format!(" {} {} {} {x} {y} {z} {w}", at.x, at.y, at.z)
}
