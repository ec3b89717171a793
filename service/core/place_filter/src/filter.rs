//! The filter of an agent.

use geometry::PoseCovariance;
use nalgebra::{Isometry3, Point3, Vector3};
use state::state_of_struct;

use crate::compass::{HeadingModel, HeadingSenses, Stretch};
use crate::field::Field;
use crate::follow::{Measured, Measurement, Senses, measurements};
use crate::search::{Found, Search, Seeker};
use crate::tuning::{follow, window as tuning};
use crate::window::Window;

/// A level that an agent senses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensedLevel {
    /// Channel.
    pub channel: u8,
    /// The level.
    pub value: f64,
    /// Where the sensor is in the body \[m\].
    pub offset_m: Vector3<f64>,
    /// The body, by motion alone.
    pub in_odom: Isometry3<f64>,
}

/// What an agent sensed lately, and what that says of where it is.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PlaceFilter {
    window: Window,
    senses: Senses,
    search: Search,
    heading: HeadingSenses,
    unusual: Vec<UnusualAt>,
}

state_of_struct!(PlaceFilter {
    window,
    senses,
    search,
    heading,
    unusual
});

/// Where an unusual level of a channel counted last, by motion alone \[m\].
#[derive(Clone, Copy, Debug, PartialEq)]
struct UnusualAt {
    channel: u8,
    at: Vector3<f64>,
}

state_of_struct!(UnusualAt { channel, at });

impl PlaceFilter {
    /// Takes in a level; answers whether a node of the way is complete by it, about which the other
    /// methods can then be asked.
    pub fn take(&mut self, level: &SensedLevel, field: &dyn Field) -> bool {
        let at = level.in_odom * Point3::from(level.offset_m);
        let step_m = self.step_m(field);
        self.window
            .add(level.channel, &level.in_odom, &at, level.value, step_m)
    }

    /// Takes in that a level is unusual; whether it is the first one of its channel since the last
    /// node's step. Those sensed at rest are one.
    pub fn take_unusual(&mut self, level: &SensedLevel, field: &dyn Field) -> bool {
        let (channel, at) = (level.channel, level.in_odom.translation.vector);
        let step_m = self.step_m(field);
        match self.unusual.iter_mut().find(|last| last.channel == channel) {
            Some(last) if (last.at - at).norm() < step_m => return false,
            Some(last) => last.at = at,
            None => self.unusual.push(UnusualAt { channel, at }),
        }
        true
    }

    /// Takes in a level beside a known heading \[rad\], where the agent is by motion alone \[m\].
    /// Answers what its channel is to learn, at times.
    pub fn teach_heading(
        &mut self,
        level: (u8, f64),
        heading_rad: f64,
        in_odom: &Vector3<f64>,
    ) -> Option<Stretch> {
        self.heading.teach(level, heading_rad, in_odom)
    }

    /// Takes in a level of a compass, with the heading by motion alone \[rad\] and where the agent
    /// is by that \[m\]. Answers at times the turn of the frame of odometry in the map \[rad\], by
    /// which the heading is to be corrected.
    pub fn take_heading(
        &mut self,
        level: (u8, f64),
        model: &HeadingModel,
        in_odom: (f64, &Vector3<f64>),
    ) -> Option<f64> {
        self.heading.take(level, model, in_odom)
    }

    /// The turn of the frame of odometry in the map as compasses tell it, and its standard
    /// deviation \[rad\], of an agent that is somewhere by motion alone \[m\]; `None` where it has
    /// heard no compass on the way there.
    pub fn turn_rad(&self, in_odom: &Vector3<f64>) -> Option<(f64, f64)> {
        self.heading.turn_rad(in_odom)
    }

    /// What the latest node teaches of its channels: channel, level, and the levels before with
    /// their distances \[m\].
    pub fn lessons(&self) -> impl Iterator<Item = (u8, f64, impl Iterator<Item = (f64, f64)>)> {
        let nodes = self.window.complete();
        let (before, latest) = match nodes.split_last() {
            Some((latest, before)) => (before, latest.felt.as_slice()),
            None => (nodes, Default::default()),
        };
        latest.iter().map(move |felt| {
            let earlier = before.iter().flat_map(|node| &node.felt);
            let same = earlier.filter(|other| other.channel == felt.channel);
            let pairs = same.map(|other| ((other.at - felt.at).norm(), other.value));
            (felt.channel, felt.value, pairs)
        })
    }

    /// What the latest node says of the pose of an agent that is known about.
    pub fn measurements(
        &self,
        pose: (&Isometry3<f64>, &PoseCovariance),
        in_odom: &Isometry3<f64>,
        field: &dyn Field,
    ) -> Vec<Measurement> {
        let step_m = self.step_m(field);
        self.window.complete().last().map_or_else(Vec::new, |node| {
            measurements(node, pose, in_odom, step_m, field, &self.senses)
        })
    }

    /// Whether a position with this standard deviation along an axis \[m\] is too little known for
    /// the field to be straight about it, so that a search is due.
    pub fn is_vague(&self, sd_m: f64, field: &dyn Field) -> bool {
        self.length_m(field)
            .is_some_and(|length_m| sd_m > follow::NEAR * length_m)
    }

    /// Takes in what measurements met; answers whether together they contradict the pose.
    pub fn judge(&mut self, measured: &[(Measurement, Measured)]) -> bool {
        self.senses.judge(measured)
    }

    /// Whether a search goes on with the next record.
    pub fn is_searching(&self) -> bool {
        self.search.is_under_way()
    }

    /// Goes on to search an agent that is not known about, by a part of bounded work; answers where
    /// it is once that is sure.
    pub fn seek(&mut self, seeker: &Seeker<'_>, field: &dyn Field) -> Option<Found> {
        self.search.seek(&self.window, seeker, field)
    }

    /// The agent was put somewhere: what it sensed before does not count.
    pub fn cut(&mut self) {
        self.window = Window::default();
        self.search = Search::default();
        self.heading = HeadingSenses::default();
        self.senses.settle();
    }

    /// It is known where the agent is.
    pub fn end_search(&mut self) {
        if !self.search.is_empty() {
            self.search = Search::default();
        }
    }

    /// Motion between two nodes \[m\].
    fn step_m(&self, field: &dyn Field) -> f64 {
        let (least, most, unknown) = tuning::STEP_M;
        self.length_m(field).map_or(unknown, |length_m| {
            (tuning::STEP * length_m).clamp(least, most)
        })
    }

    /// Shortest correlation length of the channels that were sensed last \[m\].
    fn length_m(&self, field: &dyn Field) -> Option<f64> {
        let felt = self.window.nodes.last().map_or(&[][..], |node| &node.felt);
        let kernels = felt.iter().filter_map(|felt| field.kernel(felt.channel));
        kernels.map(|kernel| kernel.length_m).reduce(f64::min)
    }
}
