//! The ways as a search reads them: two lines of the processor's cache for each waypoint.

use super::tuning::{LINKS, PAGE, PIVOTS};
use crate::memory::way::{WayMap, Waypoint};
use state::PagedVec;

/// What a search of shortest routes needs of a waypoint.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(128))]
pub(super) struct Junction {
    /// Where it lies in `map`, rounded \[m\].
    pub(super) near: [f32; 3],
    /// Number of links; more than there is room for where the ways have to be looked up in the map.
    count: u32,
    links: [Link; LINKS],
    /// How far the pivots are, in coarse units that are the same for all.
    pub(super) far: [u16; PIVOTS],
}

/// A way from one waypoint to another.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Link {
    pub(super) to: u32,
    /// Length in whole micrometres, rounded up.
    pub(super) length_um: u32,
}

/// A waypoint that ways do not lead to, or no more.
const NOTHING: Junction = Junction {
    near: [0.0; 3],
    count: 0,
    links: [Link {
        to: 0,
        length_um: 0,
    }; LINKS],
    far: [0; PIVOTS],
};

impl Junction {
    fn of(waypoint: &Waypoint) -> Self {
        let at = waypoint.pose().translation.vector;
        #[expect(
            clippy::cast_possible_truncation,
            reason = "bounds allow for the rounding"
        )]
        let near = [at.x as f32, at.y as f32, at.z as f32];
        let mut junction = Self { near, ..NOTHING };
        let edges = waypoint.edges();
        for (link, edge) in junction.links.iter_mut().zip(edges) {
            // Lengths beyond 4 km are looked up in the map.
            let Ok(length_um) = u32::try_from(edge.length_um) else {
                junction.count = u32::MAX;
                return junction;
            };
            let to = edge.to;
            *link = Link { to, length_um };
        }
        junction.count = u32::try_from(edges.len()).unwrap_or(u32::MAX);
        junction
    }

    /// Whether one way leads here.
    pub(super) fn is_dead_end(&self) -> bool {
        self.count == 1
    }

    /// Its links; `None` where it has more than there is room for.
    pub(super) fn links(&self) -> Option<&[Link]> {
        self.links.get(..self.count as usize)
    }
}

/// The ways of a map. A clone shares what is not changed.
#[derive(Clone, Debug, Default)]
pub(super) struct Graph {
    junctions: PagedVec<Junction, PAGE>,
}

impl Graph {
    /// Has a junction for each number.
    pub(super) fn follow_numbers(&mut self, ways: &WayMap) {
        for number in self.junctions.len()..ways.waypoint_numbers() as usize {
            let waypoint = u32::try_from(number).ok().and_then(|at| ways.waypoint(at));
            self.junctions
                .push(waypoint.map_or(NOTHING, Junction::of), 0);
        }
    }

    /// Brings a waypoint up to date.
    pub(super) fn follow(&mut self, ways: &WayMap, number: u32) {
        if let Some(junction) = self.junctions.get_mut(number as usize, 0) {
            let far = junction.far;
            *junction = ways.waypoint(number).map_or(NOTHING, Junction::of);
            junction.far = far;
        }
    }

    /// Notes how far the pivots of a waypoint are.
    pub(super) fn set_far(&mut self, number: u32, far: [u16; PIVOTS]) {
        if let Some(junction) = self.junctions.get_mut(number as usize, 0) {
            junction.far = far;
        }
    }

    /// A waypoint.
    pub(super) fn junction(&self, number: u32) -> Option<&Junction> {
        self.junctions.get(number as usize)
    }

    /// Calls with the neighbours of a waypoint and the lengths of the ways there \[µm\].
    pub(super) fn for_each_link(&self, ways: &WayMap, from: u32, mut call: impl FnMut(u32, u64)) {
        let links = self.junction(from).and_then(Junction::links);
        if let Some(links) = links {
            for link in links {
                call(link.to, link.length_um.into());
            }
            return;
        }
        for edge in ways.waypoint(from).map(Waypoint::edges).unwrap_or_default() {
            call(edge.to, edge.length_um);
        }
    }
}
