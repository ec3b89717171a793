//! Which places tell where the surface lies about a point.

use nalgebra::{Matrix3, Point3, Unit, Vector3};

use super::field::{LeftOut, Site};
use super::graph::LinkGraph;
use super::row::Row;
use super::sides::{Sides, along};
use crate::model::ModelPlace;

/// The places that tell where the surface lies about a point.
#[derive(Clone, Debug)]
pub(super) enum Neighbours {
    /// The nearest ones, over the plane or the line through them.
    Near,
    /// Those on its own side of an edge.
    OnSide(Sides),
    /// Those before and after it along a curve; the nearest where that branches or ends.
    InRow,
}

impl Neighbours {
    /// Each place, as the others tell it.
    pub(super) fn left_out(&self, places: &[ModelPlace], graph: &LinkGraph) -> Vec<LeftOut> {
        if let Self::OnSide(sides) = self {
            return sides.left_out(places, graph);
        }
        let positions: Vec<Point3<f64>> = places.iter().map(|place| place.position_m).collect();
        let of = |own: u32| {
            let row = self.is_in_row().then(|| Row::about(own, &positions, graph));
            let own = own as usize;
            let site = Site {
                row: row.flatten(),
                ..plane_or_line(own, &positions, graph)?
            };
            let from = vec![(site, graph.near[own].clone())];
            Some(LeftOut { own, from })
        };
        (0u32..)
            .zip(places)
            .filter_map(|(own, _)| of(own))
            .collect()
    }

    /// The segments and triangles that are bridged, with their corners. A triangle over an edge is
    /// one for each side.
    pub(super) fn sites(&self, places: &[ModelPlace], graph: &LinkGraph) -> Vec<(Site, Vec<u32>)> {
        let positions: Vec<Point3<f64>> = places.iter().map(|place| place.position_m).collect();
        let mut sites = Vec::new();
        for corners in &graph.triangles {
            if let Self::OnSide(sides) = self {
                let groups = sides.groups(places, corners);
                if groups.len() > 1 {
                    let of_groups = groups.iter().filter_map(|of| sides.site(places, of));
                    sites.extend(of_groups.map(|site| (site, corners.to_vec())));
                    continue;
                }
            }
            let at = corners.map(|corner| positions[corner as usize]);
            sites.extend(triangle(at, corners).map(|site| (site, corners.to_vec())));
        }
        for (own, links) in (0u32..).zip(&graph.links) {
            for &other in links.iter().filter(|other| **other > own) {
                let mut thirds = graph.links[other as usize].iter();
                if thirds.any(|third| links.binary_search(third).is_ok()) {
                    continue;
                }
                let ends = [own, other];
                let row = self
                    .is_in_row()
                    .then(|| Row::between(ends, &positions, graph));
                let site = segment(ends.map(|end| positions[end as usize]), row.flatten());
                sites.extend(site.map(|site| (site, ends.to_vec())));
            }
        }
        sites
    }

    /// Those of the nearest places of a site that tell where the surface lies there.
    pub(super) fn of_site(&self, places: &[ModelPlace], site: &Site, near: &[u32]) -> Vec<u32> {
        match self {
            Self::OnSide(sides) => sides.near(places, site, near),
            Self::Near | Self::InRow => near.to_vec(),
        }
    }

    fn is_in_row(&self) -> bool {
        matches!(self, Self::InRow)
    }
}

/// The plane through the corners of a triangle.
fn triangle([a, b, c]: [Point3<f64>; 3], corners: &[u32; 3]) -> Option<Site> {
    let along = (b - a).normalize();
    let across = (c - a) - along * along.dot(&(c - a));
    Some(Site {
        middle: Point3::from((a.coords + b.coords + c.coords) / 3.0),
        axes: vec![along, across.try_normalize(1e-9)?],
        of: corners.to_vec(),
        row: None,
    })
}

/// The line through both ends of a segment.
fn segment([a, b]: [Point3<f64>; 2], row: Option<Row>) -> Option<Site> {
    Some(Site {
        middle: nalgebra::center(&a, &b),
        axes: vec![(b - a).try_normalize(1e-12)?],
        of: Vec::new(),
        row,
    })
}

/// The surface about a place: a plane where it has triangles, a line where it has two links.
fn plane_or_line(own: usize, positions: &[Point3<f64>], graph: &LinkGraph) -> Option<Site> {
    let middle = positions[own];
    let links = graph.links[own].iter();
    let to: Vec<Vector3<f64>> = links
        .map(|other| positions[*other as usize] - middle)
        .collect();
    if to.len() < 2 {
        return None;
    }
    let has_triangle = graph
        .triangles
        .iter()
        .any(|triangle| triangle.iter().any(|corner| *corner as usize == own));
    let axes = if has_triangle {
        let spread: Matrix3<f64> = to.iter().map(|to| to * to.transpose()).sum();
        let eigen = spread.symmetric_eigen();
        let across: Vector3<f64> = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into();
        along(&Unit::new_normalize(across))
    } else {
        vec![Unit::try_new(to[1] - to[0], 1e-12)?.into_inner()]
    };
    Some(Site {
        middle,
        axes,
        of: Vec::new(),
        row: None,
    })
}
