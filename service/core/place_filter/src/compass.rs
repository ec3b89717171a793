//! Compasses: channels whose levels tell the heading of an agent.

use std::f64::consts::{PI, TAU};

use nalgebra::Vector3;
use state::{NONE, state_of_struct};

use crate::tuning::compass as tuning;

/// Factors by which a level may be an angle: in radians or degrees, growing to the left or to the
/// right. With the last one it is none, whatever it is.
const FACTORS: [f64; 5] = [1.0, -1.0, PI / 180.0, -PI / 180.0, 0.0];

/// What is learned of a channel as a compass, from agents that know their heading: how well its
/// levels and their headings turn together (Mardia & Jupp 2000, "Directional Statistics").
///
/// Two errors are told apart: one that lasts, as by what an agent carries, and noise about that.
/// For that, levels of one agent at a time are taken together along a stretch of its way. Later
/// stretches of a session count less, for most of an error lasts as long as that.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Compass {
    /// The agent that taught first, and whether others did.
    first: u32,
    has_others: bool,
    /// Weight of the stretches lately.
    stretches: f64,
    /// Sums over them, for each factor: of the directions of their mean errors as unit vectors,
    /// and of the lengths of these means.
    lasting: [[f64; 2]; FACTORS.len()],
    about: [f64; FACTORS.len()],
    tells: Option<HeadingModel>,
}

state_of_struct!(Compass {
    first,
    has_others,
    stretches,
    lasting,
    about,
    tells
});

impl Default for Compass {
    fn default() -> Self {
        Self {
            first: NONE,
            has_others: false,
            stretches: 0.0,
            lasting: Default::default(),
            about: Default::default(),
            tells: None,
        }
    }
}

/// What has been learned of a compass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LearnedCompass {
    /// How levels tell a heading.
    pub model: HeadingModel,
    /// The agent that alone has taught it, and that alone it is true of.
    pub agent: Option<u32>,
}

/// Levels of a channel along a stretch of an agent's way, beside its heading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stretch {
    channel: u8,
    /// Its number in the session.
    number: u32,
    /// Where the latest level was, by motion alone, and the way so far \[m\].
    at: Vector3<f64>,
    way_m: f64,
    levels: u32,
    /// Sums of the errors as unit vectors, for each factor.
    errors: [[f64; 2]; FACTORS.len()],
}

state_of_struct!(Stretch {
    channel,
    number,
    at,
    way_m,
    levels,
    errors
});

impl Stretch {
    fn new(channel: u8, number: u32, at: &Vector3<f64>) -> Self {
        Self {
            channel,
            number,
            at: *at,
            way_m: 0.0,
            levels: 0,
            errors: Default::default(),
        }
    }

    fn take(&mut self, level: f64, heading_rad: f64, at: &Vector3<f64>) {
        self.way_m += (at - self.at).norm();
        self.at = *at;
        self.levels = self.levels.saturating_add(1);
        for (error, factor) in self.errors.iter_mut().zip(FACTORS) {
            let (sin, cos) = (angle_rad(factor, level) - heading_rad).sin_cos();
            *error = [error[0] + cos, error[1] + sin];
        }
    }
}

/// How the levels of a compass tell a heading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeadingModel {
    /// Angle for each unit of the level \[rad\].
    factor: f64,
    /// That angle at a heading of zero \[rad\].
    offset_rad: f64,
    /// Variance of an error that lasts, and of the noise about it \[rad²\].
    lasting_rad2: f64,
    noise_rad2: f64,
}

state_of_struct!(HeadingModel {
    factor,
    offset_rad,
    lasting_rad2,
    noise_rad2
});

impl HeadingModel {
    /// The heading that a level tells, any number of turns off \[rad\].
    pub fn heading_rad(&self, level: f64) -> f64 {
        angle_rad(self.factor, level) - self.offset_rad
    }

    /// Angle for each unit of the level \[rad\]: below zero where levels grow to the right.
    pub fn rad_per_unit(&self) -> f64 {
        self.factor
    }

    /// The level as an angle at a heading of zero \[rad\].
    pub fn offset_rad(&self) -> f64 {
        self.offset_rad
    }

    /// Variance of the noise about the part of its error that lasts \[rad²\].
    pub fn noise_rad2(&self) -> f64 {
        self.noise_rad2
    }

    /// Variance of the part of its error that lasts \[rad²\].
    pub fn lasting_rad2(&self) -> f64 {
        self.lasting_rad2
    }

    /// Variance of the error of one level \[rad²\].
    pub fn variance_rad2(&self) -> f64 {
        self.lasting_rad2 + self.noise_rad2
    }
}

impl Compass {
    /// How levels tell the heading of an agent; `None` while that is not known, or if they do not.
    /// What one agent alone has taught is true of that one.
    pub fn tells(&self, agent: u32) -> Option<&HeadingModel> {
        let is_for = self.has_others || self.first == agent;
        self.tells.as_ref().filter(|_| is_for)
    }

    /// What has been learned; `None` while levels are not known to tell a heading.
    pub fn learned(&self) -> Option<LearnedCompass> {
        self.tells.map(|model| LearnedCompass {
            model,
            agent: (!self.has_others).then_some(self.first),
        })
    }

    /// Learns from a stretch of an agent that knows its heading.
    pub fn learn(&mut self, agent: u32, stretch: &Stretch) {
        if self.first == NONE {
            self.first = agent;
        }
        self.has_others |= self.first != agent;
        let weight = 1.0 / (1.0 + f64::from(stretch.number));
        let kept = 1.0 - (1.0 - tuning::KEPT) * weight;
        self.stretches = self.stretches * kept + weight;
        let sums = self.lasting.iter_mut().zip(&mut self.about);
        for ((lasting, about), [cos, sin]) in sums.zip(stretch.errors) {
            let length = cos.hypot(sin).max(f64::MIN_POSITIVE);
            *lasting = [
                lasting[0] * kept + weight * cos / length,
                lasting[1] * kept + weight * sin / length,
            ];
            *about = *about * kept + weight * length / f64::from(stretch.levels);
        }
        self.tells = self.model();
    }

    /// The factor by which levels and headings turn together best, if they do.
    fn model(&self) -> Option<HeadingModel> {
        let count = self.stretches;
        let resultant = |index: usize| {
            let [cos, sin] = self.lasting[index];
            let lasting = (cos.hypot(sin) / count).min(1.0);
            let about = (self.about[index] / count).min(1.0);
            (index, lasting, about)
        };
        let last = FACTORS.len() - 1;
        let best = (0..last)
            .map(resultant)
            .max_by(|a, b| (a.1 * a.2).total_cmp(&(b.1 * b.2)))?;
        let (index, lasting, about) = best;
        let (_, same, same_about) = resultant(last);
        // Rayleigh's test that directions are not of all sides, and how much of the spread of the
        // headings themselves it explains.
        let is_sure = count * lasting * lasting >= tuning::SURE;
        let spread = 1.0 - lasting * about;
        let of_headings = 1.0 - same * same_about;
        let explains = of_headings >= tuning::HEADINGS && spread <= tuning::SPREAD * of_headings;
        let [cos, sin] = self.lasting[index];
        (is_sure && explains).then(|| HeadingModel {
            factor: FACTORS[index],
            offset_rad: sin.atan2(cos),
            lasting_rad2: variance(lasting).max(tuning::LASTING_MIN_RAD2),
            noise_rad2: variance(about).max(tuning::NOISE_MIN_RAD2),
        })
    }
}

/// Variance of a wrapped normal distribution whose mean unit vector has a length \[rad²\].
fn variance(length: f64) -> f64 {
    (-2.0 * length.max(f64::MIN_POSITIVE).ln()).max(0.0)
}

/// A level as an angle within a turn: of one that is far larger than a heading, no heading is left
/// to tell.
fn angle_rad(factor: f64, level: f64) -> f64 {
    (factor * level).rem_euclid(TAU)
}

/// What compasses have lately told an agent, and what it can tell about them.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct HeadingSenses {
    turn: SensedTurn,
    /// Way of the agent since its heading was corrected \[m\].
    since_m: f64,
    /// Stretches under way, a channel each.
    stretches: Vec<Stretch>,
}

state_of_struct!(HeadingSenses {
    turn,
    since_m,
    stretches
});

impl HeadingSenses {
    /// Takes in a level beside a known heading \[rad\], where the agent is by motion alone \[m\];
    /// answers the stretch that ends with it.
    pub(crate) fn teach(
        &mut self,
        (channel, level): (u8, f64),
        heading_rad: f64,
        in_odom: &Vector3<f64>,
    ) -> Option<Stretch> {
        let known = self.stretches.iter().position(|one| one.channel == channel);
        let index = known.or_else(|| {
            let is_room = self.stretches.len() < tuning::CHANNELS_MAX;
            is_room.then(|| {
                self.stretches.push(Stretch::new(channel, 0, in_odom));
                self.stretches.len() - 1
            })
        })?;
        let stretch = &mut self.stretches[index];
        stretch.take(level, heading_rad, in_odom);
        if stretch.way_m < tuning::STRETCH_M || stretch.levels < tuning::LEVELS_MIN {
            return None;
        }
        let next = Stretch::new(channel, stretch.number.saturating_add(1), in_odom);
        Some(std::mem::replace(stretch, next))
    }

    /// Takes in a level of a compass, with the heading by motion alone \[rad\] and where the agent
    /// is by that \[m\]. Answers the turn of odometry in the map \[rad\] where the heading is to be
    /// corrected by that: the errors of levels along a stretch are one.
    pub(crate) fn take(
        &mut self,
        (channel, level): (u8, f64),
        model: &HeadingModel,
        (in_odom_rad, at): (f64, &Vector3<f64>),
    ) -> Option<f64> {
        let turn_rad = model.heading_rad(level) - in_odom_rad;
        let way_m = self.turn.take(channel, model, turn_rad, at)?;
        self.since_m += way_m;
        if self.since_m < tuning::STRETCH_M {
            return None;
        }
        self.since_m = 0.0;
        Some(self.turn.turn_rad(at)?.0)
    }

    /// The turn of odometry in the map, and its standard deviation \[rad\], of an agent that is
    /// somewhere by motion alone \[m\]; `None` where no compass was heard on the way there.
    pub(crate) fn turn_rad(&self, in_odom: &Vector3<f64>) -> Option<(f64, f64)> {
        self.turn.turn_rad(in_odom)
    }
}

/// The turn of the frame of an agent's odometry in the map, as compasses tell it lately.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct SensedTurn {
    /// Number of the channel.
    channel: u8,
    /// Where the latest level was, by motion alone \[m\].
    at: Vector3<f64>,
    /// Sum of it as a unit vector over a step of the way, its levels, and their way \[m\].
    step: [f64; 2],
    levels: u32,
    step_m: f64,
    /// Mean as a unit vector over so many steps.
    mean: [f64; 2],
    steps: u32,
    /// Variance of its error \[rad²\].
    variance_rad2: f64,
}

state_of_struct!(SensedTurn {
    channel,
    at,
    step,
    levels,
    step_m,
    mean,
    steps,
    variance_rad2
});

impl SensedTurn {
    /// Takes in a level of a compass; the surest of several counts. Answers the way since the one
    /// before \[m\] if it did.
    fn take(
        &mut self,
        channel: u8,
        model: &HeadingModel,
        turn_rad: f64,
        at: &Vector3<f64>,
    ) -> Option<f64> {
        let is_heard = (self.levels > 0 || self.steps > 0) && self.is_near(at);
        let is_other = self.channel != channel;
        if is_heard && is_other && model.variance_rad2() >= self.variance_rad2 {
            return None;
        }
        if !is_heard || is_other {
            *self = Self {
                channel,
                at: *at,
                ..Self::default()
            };
        }
        let way_m = (at - self.at).norm();
        self.at = *at;
        self.variance_rad2 = model.variance_rad2();
        self.step_m += way_m;
        if self.step_m >= tuning::STEP_M {
            self.end_step();
        }
        let (sin, cos) = turn_rad.sin_cos();
        self.step = [self.step[0] + cos, self.step[1] + sin];
        self.levels = self.levels.saturating_add(1);
        Some(way_m)
    }

    /// Levels of a step count as one: those of an agent at rest say the same again and again.
    fn end_step(&mut self) {
        self.mean = self.with_step();
        self.steps = self.steps.saturating_add(1);
        (self.step, self.levels, self.step_m) = ([0.0; 2], 0, 0.0);
    }

    /// The mean with the step that is under way.
    fn with_step(&self) -> [f64; 2] {
        if self.levels == 0 {
            return self.mean;
        }
        let rate = (1.0 / (1.0 + f64::from(self.steps))).max(tuning::LATELY);
        let count = f64::from(self.levels);
        let mixed = |mean: f64, sum: f64| mean + (sum / count - mean) * rate;
        [
            mixed(self.mean[0], self.step[0]),
            mixed(self.mean[1], self.step[1]),
        ]
    }

    fn is_near(&self, at: &Vector3<f64>) -> bool {
        (at - self.at).norm() <= tuning::HEARD_M
    }

    /// The turn, and its standard deviation \[rad\]; `None` without any level nearby.
    fn turn_rad(&self, at: &Vector3<f64>) -> Option<(f64, f64)> {
        let [cos, sin] = self.with_step();
        let told = (sin.atan2(cos), self.variance_rad2.sqrt());
        let is_told = (self.levels > 0 || self.steps > 0) && self.is_near(at);
        (is_told && told.0.is_finite() && told.1.is_normal()).then_some(told)
    }
}

#[cfg(test)]
mod tests;
