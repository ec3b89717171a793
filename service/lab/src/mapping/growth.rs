//! A recording on its way into a map.

use nalgebra::{Isometry3, Point3};
use pose_graph::{Freedom, Kernel, Link, LinkId, PointId, PoseGraph, PoseId};
use pose_graph::{PoseInformation, SightingTarget};

use super::recording::{Matches, Measured, Recording};

/// The map of a recording's first steps.
#[derive(Clone, Debug)]
pub(super) struct Growth<'a> {
    pub(super) recording: &'a Recording,
    pub(super) map: PoseGraph,
    pub(super) poses: Vec<PoseId>,
    /// Landmarks that were seen.
    pub(super) landmarks: Vec<Option<PointId>>,
    /// What is judged: matches, and sightings of landmarks that were seen before.
    pub(super) judged: Vec<Judged>,
}

/// A link that is judged.
#[derive(Clone, Copy, Debug)]
pub(super) struct Judged {
    pub(super) link: LinkId,
    /// Directions that it measured.
    pub(super) degrees: usize,
}

/// The measurement by which a new pose is first put somewhere.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lead<'a> {
    /// Number of the measurement within its step.
    pub(super) index: usize,
    /// The earlier pose.
    pub(super) from: usize,
    /// The new pose in the frame of the earlier one.
    pub(super) transform: Isometry3<f64>,
    pub(super) information: &'a PoseInformation,
}

impl<'a> Growth<'a> {
    pub(super) fn new(recording: &'a Recording) -> Self {
        Self {
            recording,
            map: PoseGraph::new(),
            poses: Vec::with_capacity(recording.steps.len()),
            landmarks: vec![None; recording.landmarks.len()],
            judged: Vec::new(),
        }
    }

    /// The map of the first `n` steps, along motion alone, with all links.
    pub(super) fn whole(recording: &'a Recording, n: usize, kernel: Kernel) -> Self {
        let mut growth = Self::new(recording);
        for step in &recording.steps[..n] {
            growth.add_pose();
            for measured in &step.measured {
                growth.add(measured, kernel, true);
            }
        }
        growth
    }

    /// The kernel with which matches enter a map that is not in doubt.
    pub(super) fn kernel(&self) -> Kernel {
        match self.recording.matches {
            Matches::Measurements => Kernel::Gaussian,
            Matches::Recognised(kernel) => kernel,
        }
    }

    /// What puts the next pose first: motion, or else a measurement from an earlier pose.
    pub(super) fn lead(&self) -> Option<Lead<'a>> {
        let new = self.poses.len();
        let relatives = self.recording.steps[new].measured.iter().enumerate();
        let leads = relatives.filter_map(|(index, measured)| match measured {
            Measured::Relative {
                from,
                to,
                transform,
                information,
                is_motion,
            } if *to == new && *from < new => Some((
                *is_motion,
                Lead {
                    index,
                    from: *from,
                    transform: *transform,
                    information,
                },
            )),
            _ => None,
        });
        let mut first = None;
        for (is_motion, lead) in leads {
            if is_motion {
                return Some(lead);
            }
            first = first.or(Some(lead));
        }
        first
    }

    /// Adds the next pose where motion puts it, and returns what did.
    pub(super) fn add_pose(&mut self) -> Option<Lead<'a>> {
        let recording = self.recording;
        let step = &recording.steps[self.poses.len()];
        let lead = self.lead();
        let at = match &lead {
            Some(lead) if !step.is_held => self.map.pose(self.poses[lead.from]) * lead.transform,
            _ => step.guess,
        };
        let freedom = if step.is_held {
            Freedom::Held
        } else {
            self.recording.freedom
        };
        self.poses.push(self.map.add_pose(at, freedom));
        lead
    }

    /// Adds a measurement, of which all poses are there. One that is judged counts only if it
    /// holds; for it the answer is yes.
    pub(super) fn add(&mut self, measured: &Measured, kernel: Kernel, holds: bool) -> bool {
        let (link, degrees) = match measured {
            Measured::Relative {
                from,
                to,
                transform,
                information,
                is_motion,
            } => {
                let diagonal = information.matrix().diagonal();
                let degrees = diagonal.iter().filter(|entry| **entry > 0.0).count();
                let link = Link::Between {
                    from: self.poses[*from],
                    to: self.poses[*to],
                    transform: *transform,
                    information: *information,
                };
                (link, (!is_motion).then_some(degrees))
            }
            Measured::Sighting {
                from,
                landmark,
                position,
                information,
            } => {
                let is_new = self.landmarks[*landmark].is_none();
                let point = self.point(*landmark, *from, &Point3::from(*position));
                let diagonal = information.matrix().diagonal();
                let degrees = diagonal.iter().filter(|entry| **entry > 0.0).count();
                let link = Link::Sighting {
                    from: self.poses[*from],
                    target: SightingTarget::Point(point),
                    position: *position,
                    information: *information,
                };
                (link, (!is_new).then_some(degrees))
            }
        };
        let fits_the_map = "readers refuse links of a pose with itself";
        let Some(degrees) = degrees else {
            self.map
                .add_link(link, Kernel::Gaussian)
                .expect(fits_the_map);
            return false;
        };
        let link = if holds {
            self.map.add_link(link, kernel)
        } else {
            self.map.add_silent_link(link, kernel)
        };
        let link = link.expect(fits_the_map);
        self.judged.push(Judged { link, degrees });
        true
    }

    /// The node of a landmark; a new one lies where it is seen.
    fn point(&mut self, landmark: usize, from: usize, seen: &Point3<f64>) -> PointId {
        if let Some(point) = self.landmarks[landmark] {
            return point;
        }
        let point = if let Some(at) = self.recording.landmarks[landmark].held_at {
            self.map.add_point(at, Freedom::Held)
        } else {
            let at = self.map.pose(self.poses[from]) * seen;
            self.map.add_point(at, self.recording.freedom)
        };
        self.landmarks[landmark] = Some(point);
        point
    }

    /// Switches the judged links.
    pub(super) fn switch(&mut self, verdict: &[bool]) {
        for (judged, holds) in self.judged.iter().zip(verdict) {
            match (holds, self.map.is_on(judged.link)) {
                (true, false) => self.map.switch_on(judged.link),
                (false, true) => self.map.switch_off(judged.link),
                _ => {}
            }
        }
    }

    /// Puts all nodes where they are in another map of the same steps.
    pub(super) fn take_places(&mut self, other: &Self) {
        for (k, (&own, &there)) in self.poses.iter().zip(&other.poses).enumerate() {
            let freedom = if self.recording.steps[k].is_held {
                Freedom::Held
            } else {
                self.recording.freedom
            };
            self.map.place_pose(own, *other.map.pose(there), freedom);
        }
        for (k, points) in self.landmarks.iter().zip(&other.landmarks).enumerate() {
            if let (Some(own), Some(there)) = points {
                let freedom = match self.recording.landmarks[k].held_at {
                    Some(_) => Freedom::Held,
                    None => self.recording.freedom,
                };
                let at = other.map.point(*there);
                self.map.place_point(*own, at, freedom);
            }
        }
    }
}
