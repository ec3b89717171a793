//! Compasses: channels whose levels tell the heading of an agent.

use std::f64::consts::PI;

use nalgebra::Vector3;
use state::state_of_struct;

use crate::tuning::compass as tuning;

/// Factors by which a level may be an angle: in radians or degrees, growing to the left or to the
/// right. With the last one it is none, whatever it is.
const FACTORS: [f64; 5] = [1.0, -1.0, PI / 180.0, -PI / 180.0, 0.0];

/// What is learned of a channel as a compass, from agents that know their heading: how well its
/// levels and their headings turn together (Mardia & Jupp 2000, "Directional Statistics").
///
/// Two errors are told apart: one that lasts, as by what an agent carries, and noise about that.
/// For that, levels of one agent at a time are taken together along a stretch of its way.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Compass {
    /// Stretches lately.
    stretches: f64,
    /// Sums over them, for each factor: of the directions of their mean errors as unit vectors,
    /// and of the lengths of these means.
    lasting: [[f64; 2]; FACTORS.len()],
    about: [f64; FACTORS.len()],
    tells: Option<HeadingModel>,
}

state_of_struct!(Compass {
    stretches,
    lasting,
    about,
    tells
});

/// Levels of a channel along a stretch of an agent's way, beside its heading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stretch {
    channel: u8,
    /// Where it begins, by motion alone \[m\].
    from: Vector3<f64>,
    levels: u32,
    /// Sums of the errors as unit vectors, for each factor.
    errors: [[f64; 2]; FACTORS.len()],
}

state_of_struct!(Stretch {
    channel,
    from,
    levels,
    errors
});

impl Stretch {
    fn new(channel: u8, from: &Vector3<f64>) -> Self {
        Self {
            channel,
            from: *from,
            levels: 0,
            errors: Default::default(),
        }
    }

    fn take(&mut self, level: f64, heading_rad: f64) {
        self.levels = self.levels.saturating_add(1);
        for (error, factor) in self.errors.iter_mut().zip(FACTORS) {
            let (sin, cos) = (factor * level - heading_rad).sin_cos();
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
        self.factor * level - self.offset_rad
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
    /// How levels tell the heading; `None` while that is not known, or if they do not.
    pub fn tells(&self) -> Option<&HeadingModel> {
        self.tells.as_ref()
    }

    /// Learns from a stretch of an agent that knows its heading.
    pub fn learn(&mut self, stretch: &Stretch) {
        let kept = tuning::KEPT;
        self.stretches = self.stretches * kept + 1.0;
        let sums = self.lasting.iter_mut().zip(&mut self.about);
        for ((lasting, about), [cos, sin]) in sums.zip(stretch.errors) {
            let length = cos.hypot(sin).max(f64::MIN_POSITIVE);
            *lasting = [
                lasting[0] * kept + cos / length,
                lasting[1] * kept + sin / length,
            ];
            *about = *about * kept + length / f64::from(stretch.levels);
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
        let explains = spread <= tuning::SPREAD * (1.0 - same * same_about);
        let [cos, sin] = self.lasting[index];
        (is_sure && explains).then(|| HeadingModel {
            factor: FACTORS[index],
            offset_rad: sin.atan2(cos),
            lasting_rad2: variance(lasting),
            noise_rad2: variance(about),
        })
    }
}

/// Variance of a wrapped normal distribution whose mean unit vector has a length \[rad²\].
fn variance(length: f64) -> f64 {
    (-2.0 * length.max(f64::MIN_POSITIVE).ln()).max(tuning::VARIANCE_MIN)
}

/// What compasses have lately told an agent, and what it can tell about them.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct HeadingSenses {
    turn: SensedTurn,
    /// Stretches under way, a channel each.
    stretches: Vec<Stretch>,
}

state_of_struct!(HeadingSenses { turn, stretches });

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
                self.stretches.push(Stretch::new(channel, in_odom));
                self.stretches.len() - 1
            })
        })?;
        let stretch = &mut self.stretches[index];
        stretch.take(level, heading_rad);
        let is_long = (in_odom - stretch.from).norm() >= tuning::STRETCH_M;
        if !is_long || stretch.levels < tuning::LEVELS_MIN {
            return None;
        }
        let next = Stretch::new(channel, in_odom);
        Some(std::mem::replace(stretch, next))
    }

    /// Takes in a level of a compass, with the heading by motion alone \[rad\].
    pub(crate) fn take(
        &mut self,
        (channel, level): (u8, f64),
        model: &HeadingModel,
        in_odom_rad: f64,
    ) {
        let turn_rad = model.heading_rad(level) - in_odom_rad;
        self.turn.take(channel, model, turn_rad);
    }

    /// The turn of odometry in the map, and its standard deviation \[rad\].
    pub(crate) fn turn_rad(&self) -> Option<(f64, f64)> {
        self.turn.turn_rad()
    }
}

/// The turn of the frame of an agent's odometry in the map, as compasses tell it lately.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct SensedTurn {
    /// Number of the channel.
    channel: u8,
    /// Mean of it as a unit vector, over so many levels.
    mean: [f64; 2],
    levels: u32,
    /// Variance of its error \[rad²\].
    variance_rad2: f64,
}

state_of_struct!(SensedTurn {
    channel,
    mean,
    levels,
    variance_rad2
});

impl SensedTurn {
    /// Takes in a level of a compass; the surest of several counts.
    fn take(&mut self, channel: u8, model: &HeadingModel, turn_rad: f64) {
        let is_other = self.channel != channel;
        if self.levels > 0 && is_other && model.variance_rad2() >= self.variance_rad2 {
            return;
        }
        if is_other {
            *self = Self::default();
        }
        self.channel = channel;
        self.levels = self.levels.saturating_add(1);
        let rate = (1.0 / f64::from(self.levels)).max(tuning::LATELY);
        let (sin, cos) = turn_rad.sin_cos();
        self.mean[0] += (cos - self.mean[0]) * rate;
        self.mean[1] += (sin - self.mean[1]) * rate;
        self.variance_rad2 = model.variance_rad2();
    }

    /// The turn, and its standard deviation \[rad\]; `None` without any level.
    fn turn_rad(&self) -> Option<(f64, f64)> {
        let [cos, sin] = self.mean;
        (self.levels > 0).then(|| (sin.atan2(cos), self.variance_rad2.sqrt()))
    }
}

#[cfg(test)]
mod tests;
