//! What is done in an experiment, down to the last option.

use cognitive_map::{InvalidSettings, Recruitment, Settings, SettingsValues};

use super::environment::Environment;
use cogmap_worlds::OdometryNoise;

/// The paper's probability of a new place at a step (Sections 4.1, 4.2 and 5.1 C).
pub const PAPER_P_NEW: f64 = 0.05;
/// Most steps of a walk: three years at 10 Hz; stamps stay far from their limit.
const STEPS_MAX: u64 = 1_000_000_000;

/// How the agent walks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Walk {
    /// Each step in a direction of its own: a random walk in the strict sense.
    Pure,
    /// Each step nearly in the direction of the one before, as a vehicle drives.
    Persistent,
}

/// What the agent perceives beside its own motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Percept {
    /// Nothing.
    None,
    /// Views of the room ([`cogmap_worlds::Scenery`]). Places remember them, and each recalls a
    /// place; a stretch of views that are like those of an earlier stretch corrects the pose.
    Descriptor(ViewSettings),
    /// The centres of obstacles, as landmarks. The map learns where they are and corrects poses by
    /// them.
    Sightings(SightingSettings),
}

/// What corrects the pose of an agent, in a room that another one has explored by obstacles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Correct {
    /// Nothing.
    None,
    /// Levels on four channels, which places remember.
    Places,
    /// Obstacles.
    Landmarks,
    /// Both.
    All,
}

/// A room that is explored before the walk.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Explored {
    /// What corrects the pose of the agent that walks then.
    pub correct: Correct,
    /// Steps of the explorer.
    pub steps: u64,
    /// Correlation length of the fields \[m\].
    pub length_m: f64,
    /// Deviation of a level's noise; that of the fields is 1.
    pub noise: f64,
}

impl Correct {
    /// Its short name.
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Places => "places",
            Self::Landmarks => "landmarks",
            Self::All => "all",
        }
    }

    /// Whether levels are felt.
    pub(super) fn feels(self) -> bool {
        matches!(self, Self::Places | Self::All)
    }

    /// Whether obstacles are sighted.
    pub(super) fn sights(self) -> bool {
        matches!(self, Self::Landmarks | Self::All)
    }
}

/// How the room is seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewSettings {
    /// The room is seen at every step whose number divides by this, and at the start, which is step
    /// 0.
    pub every: u64,
    /// Length of a view's noise, as a share of the view's own.
    pub noise: f64,
}

/// How obstacles are sighted: from any side, and through each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SightingSettings {
    /// How far \[m\].
    pub range_max_m: f64,
    /// All obstacles within range are sighted at every step whose number divides by this, and at
    /// the start, which is step 0.
    pub every: u64,
    /// Standard deviation of the distance, as a share of it. Azimuth and elevation have one of a
    /// degree at 0.05, and more or less in proportion.
    pub noise: f64,
}

impl Default for SightingSettings {
    fn default() -> Self {
        Self {
            range_max_m: 8.0,
            every: 5,
            noise: 0.05,
        }
    }
}

/// One experiment, but for its seed.
#[derive(Clone, Debug, PartialEq)]
pub struct Protocol {
    /// The room.
    pub environment: Environment,
    /// Steps of 0.1 m.
    pub steps: u64,
    /// How the agent walks. The paper says "random walk".
    pub walk: Walk,
    /// Settings of the map, but for the seed, which is the run's. The paper's recruitment is
    /// Bernoulli with [`PAPER_P_NEW`].
    pub settings: SettingsValues,
    /// What the agent perceives.
    pub percept: Percept,
    /// How bad its odometry is; the paper's is perfect.
    pub odometry: OdometryNoise,
    /// Whether somebody explored the room before; nobody did in the paper.
    pub explored: Option<Explored>,
}

/// Why a protocol cannot be followed.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum InvalidProtocol {
    /// No steps, or too many.
    #[error("a walk has from 1 to {STEPS_MAX} steps")]
    Steps,
    /// The map cannot have these settings.
    #[error(transparent)]
    Settings(#[from] InvalidSettings),
    /// A noise is none.
    #[error("odometry noise must be from 0 to 1 (share of a step, radians a step)")]
    Odometry,
    /// Views that make no sense.
    #[error("views need an interval of at least one step and a noise from 0 to 1")]
    View,
    /// Sightings without anything to sight.
    #[error("there are no obstacles to sight in env1")]
    NothingToSight,
    /// Sightings that make no sense.
    #[error(
        "sightings need a range above 0 m, an interval of at least one step and a noise from 0 to 1"
    )]
    Sighting,
    /// An exploration that makes no sense.
    #[error(
        "an explorer makes at least one step, in fields of a length from 0.01 to 1000 m and with noise up to 10"
    )]
    Explored,
    /// No places, or too many.
    #[error("a code is measured on 1 to 5000000 places")]
    Places,
    /// No cues.
    #[error("a code is measured by one query at least")]
    Queries,
    /// A noise or jitter that is none.
    #[error("phase noise is above 0 and at most 1 turn, a jitter from 0 to 1000 m")]
    Damage,
}

impl Protocol {
    /// The paper's own: perfect odometry, a random walk of as many steps as the paper's, and a new
    /// place with a probability of 5 % at each.
    pub fn of_paper(environment: Environment) -> Self {
        Self {
            environment,
            steps: environment.steps(),
            walk: Walk::Pure,
            settings: SettingsValues {
                recruitment: Recruitment::Bernoulli {
                    probability: PAPER_P_NEW,
                },
                ..SettingsValues::default()
            },
            percept: Percept::None,
            odometry: OdometryNoise::none(),
            explored: None,
        }
    }

    /// # Errors
    /// Names the first option that makes no sense.
    pub fn check(&self) -> Result<(), InvalidProtocol> {
        if !(1..=STEPS_MAX).contains(&self.steps) {
            return Err(InvalidProtocol::Steps);
        }
        self.settings(0)?;
        if self.odometry.check().is_err() {
            return Err(InvalidProtocol::Odometry);
        }
        if let Some(explored) = &self.explored {
            let length = (0.01..=1000.0).contains(&explored.length_m);
            let noise = (0.0..=10.0).contains(&explored.noise);
            if !length || !noise || !(1..=STEPS_MAX).contains(&explored.steps) {
                return Err(InvalidProtocol::Explored);
            }
            if self.environment == Environment::GridAligned {
                return Err(InvalidProtocol::NothingToSight);
            }
        }
        if let Percept::Descriptor(views) = &self.percept
            && (!(0.0..=1.0).contains(&views.noise) || views.every == 0)
        {
            return Err(InvalidProtocol::View);
        }
        if let Percept::Sightings(sightings) = &self.percept {
            if self.environment == Environment::GridAligned {
                return Err(InvalidProtocol::NothingToSight);
            }
            let noise = (0.0..=1.0).contains(&sightings.noise);
            let range = sightings.range_max_m > 0.0;
            if !noise || !range || sightings.every == 0 {
                return Err(InvalidProtocol::Sighting);
            }
        }
        Ok(())
    }

    /// Settings of the map of a run.
    pub(super) fn settings(&self, seed: u64) -> Result<Settings, InvalidSettings> {
        Settings::new(SettingsValues {
            seed,
            ..self.settings.clone()
        })
    }
}
