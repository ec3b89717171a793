//! Constants: unit, meaning and source of each.

/// What is learned of a channel.
pub(crate) mod channel {
    /// Distances at which levels are compared: the least \[m\], and the ratio of one to the next.
    pub(crate) const LAG_MIN_M: f64 = 0.05;
    /// See [`LAG_MIN_M`]. Source: the root of two; sixteen of them reach 13 m.
    pub(crate) const LAG_RATIO: f64 = std::f64::consts::SQRT_2;
    /// Number of distances.
    pub(crate) const LAGS: usize = 16;
    /// Pairs at a distance after which its mean is used.
    pub(crate) const PAIRS_MIN: f64 = 8.0;
    /// Pairs after which further ones replace what was long ago.
    pub(crate) const PAIRS_MAX: f64 = 20_000.0;
    /// Levels after which the model is fitted again.
    pub(crate) const REFIT: u64 = 32;
    /// Error of the mean of pairs at a distance, as a part of the variance, that is added to one in
    /// proportion to it: no field is quite like the model.
    pub(crate) const SPREAD_MIN: f64 = 0.01;
    /// Distances with enough pairs that a model needs.
    pub(crate) const LAGS_MIN: usize = 4;
    /// A level or a difference is one of the channel up to so many deviations of it: a sensor's
    /// sentinel is none.
    pub(crate) const FAR: f64 = 6.0;
    /// Levels from which on a channel tells what is usual: some forty metres of way, since robots
    /// that have hardly moved know little of what there is.
    pub(crate) const USUAL_MIN: u64 = 256;
    /// An unusual level counts as so many deviations off in those of the channel, so that some
    /// sentinels in a hundred widen them little, and a channel that changes is followed all the
    /// same.
    pub(crate) const COUNTED_MAX: f64 = 2.0;
    /// Levels after which one is bounded before it counts.
    pub(crate) const LEVELS_MIN: u64 = 16;
    /// Levels over which mean and deviation of a channel are taken, about.
    pub(crate) const LEVELS: f64 = 20_000.0;
    /// Shortest correlation length \[m\], number of lengths that are tried, and their ratio.
    pub(crate) const LENGTH_MIN_M: f64 = 0.15;
    /// See [`LENGTH_MIN_M`].
    pub(crate) const LENGTHS: u32 = 24;
    /// See [`LENGTH_MIN_M`]; the longest is 17 m.
    pub(crate) const LENGTH_RATIO: f64 = 1.23;
    /// Least part of the channel's variance that two levels at one place differ by: no sensor is
    /// exact, and none of the models is.
    pub(crate) const NUGGET_MIN: f64 = 1e-3;
    /// Variance of the field, in that of the noise, from which on a channel says something.
    pub(crate) const TELLS: f64 = 0.25;
}

/// What places remember.
pub(crate) mod trace {
    /// Variance of a position that nobody knows better \[m²\]: 3 cm.
    pub(crate) const POSITION_M2: f64 = 1e-3;
    /// Who is less sure of the position by this factor of the variance does not teach.
    pub(crate) const LESS_SURE: f64 = 4.0;
    /// Levels that a trace is a mean of, at most: fields change.
    pub(crate) const LEVELS: f64 = 30.0;
}

/// Nodes of a way.
pub(crate) mod window {
    /// Motion between two nodes, in correlation lengths of the channel with the shortest.
    pub(crate) const STEP: f64 = 0.2;
    /// The same at least, at most, and where no channel is known \[m\].
    pub(crate) const STEP_M: (f64, f64, f64) = (0.1, 0.5, 0.15);
    /// Most nodes.
    pub(crate) const NODES: usize = 40;
    /// Most channels of a node.
    pub(crate) const CHANNELS: usize = 8;
}

/// Prediction of a level.
pub(crate) mod predict {
    /// Most places that a level is predicted from.
    pub(crate) const SUPPORTS: usize = 20;
    /// They are apart by so many correlation lengths, and not farther than so many.
    pub(crate) const APART: f64 = 0.2;
    /// See [`APART`].
    pub(crate) const REACH: f64 = 1.5;
    /// A prediction that leaves more than this part of the field's variance open says nothing.
    pub(crate) const OPEN_MAX: f64 = 0.8;
}

/// Following an agent that is known about.
pub(crate) mod follow {
    /// Standard deviation of a position, in correlation lengths, up to which a level corrects it:
    /// beyond, the field is not straight enough.
    pub(crate) const NEAR: f64 = 0.5;
    /// Errors of interpolation are alike over so many correlation lengths.
    pub(crate) const ALIKE: f64 = 0.8;
    /// Part by which a level changes what is known of how well levels fit.
    pub(crate) const RATIO_SHARE: f64 = 0.05;
    /// One level counts for that up to this.
    pub(crate) const RATIO_MAX: f64 = 25.0;
    /// Evidence against a pose by one channel, at most, and by all together, from which on it is
    /// contradicted \[nats\]. Source: one false alarm in a million; no channel alone.
    pub(crate) const AGAINST: (f64, f64) = (10.0, 13.8);
    /// What a single level says, at most \[nats\].
    pub(crate) const ONE: f64 = 4.0;
}

/// Search of an agent that is not known about.
pub(crate) mod search {
    /// Nodes of the first round.
    pub(crate) const NODES_MIN: usize = 5;
    /// Nodes that are used.
    pub(crate) const NODES: usize = 16;
    /// Rounds without looking for places, at most, while there is a likely pose.
    pub(crate) const ROUNDS_PER_SCAN: u32 = 6;
    /// Work of a search with a record, in places that are looked at.
    pub(crate) const WORK: u32 = 4096;
    /// Places that are looked at in a step.
    pub(crate) const SCANNED: u32 = 512;
    /// Nodes at which places are looked for, and the way between two at least in correlation
    /// lengths.
    pub(crate) const CORNERS: usize = 4;
    /// See [`CORNERS`].
    pub(crate) const CORNERS_APART: f64 = 0.6;
    /// Places at which poses are seeded, for each.
    pub(crate) const ANCHORS: usize = 18;
    /// Work of such a place, and of a pose that is weighed.
    pub(crate) const TURN_WORK: u32 = 256;
    /// See [`TURN_WORK`].
    pub(crate) const WEIGH_WORK: u32 = 2048;
    /// Nodes by which a seed is judged.
    pub(crate) const CHECKS: usize = 4;
    /// They are neither nearer nor farther than so many correlation lengths.
    pub(crate) const CHECK_REACH: [f64; 2] = [0.1, 2.5];
    /// Distance by which they may be off, as a part of that of the agent from the anchor.
    pub(crate) const CHECK_BESIDE: f64 = 0.5;
    /// Probability that a level at a place says nothing of it.
    pub(crate) const WRONG_LEVEL: f64 = 0.05;
    /// Odds of the nodes below which a seed is given up: e⁻².
    pub(crate) const AGAINST_SEED: f64 = 0.135;
    /// Headings that are tried at each place.
    pub(crate) const HEADINGS: u32 = 16;
    /// Distance of the agent from the anchor, in correlation lengths.
    pub(crate) const BESIDE: f64 = 0.35;
    /// Seeds that are refined.
    pub(crate) const SEEDS: usize = 8;
    /// Log odds from which on a pose is worth another look \[nats\].
    pub(crate) const HOPELESS: f64 = -8.0;
    /// Poses that are kept.
    pub(crate) const KEPT: usize = 6;
    /// Steps of a refinement.
    pub(crate) const ROUNDS: usize = 3;
    /// Its longest step \[m\].
    pub(crate) const STEP_MAX_M: f64 = 1.0;
    /// Poses are the same up to so many correlation lengths, and radians.
    pub(crate) const SAME: (f64, f64) = (0.5, 0.5);
    /// Before a pose is believed, it is shifted so far along each axis, in correlation lengths,
    /// and turned so far \[rad\]: no other may explain about as much.
    pub(crate) const SHIFTS: [f64; 6] = [-3.0, -1.5, -0.8, 0.8, 1.5, 3.0];
    /// See [`SHIFTS`].
    pub(crate) const TURNS_RAD: [f64; 3] = [1.6, 3.1, -1.6];
    /// A refinement has come to its end with a step of this length \[m, rad\].
    pub(crate) const SETTLED: f64 = 0.1;
    /// A residual loses weight from so many deviations on (Huber 1964).
    pub(crate) const HUBER_SD: f64 = 2.0;
    /// Probability that a sensor of an agent lies.
    pub(crate) const LIES: f64 = 0.02;
    /// Largest standard deviation of the vertical \[rad\].
    pub(crate) const TILT_SD_MAX_RAD: f64 = 0.4;
    /// Growth of its variance with the way \[rad²/m\]. Source: a modest gyroscope, a third of a
    /// degree in a step of 0.1 m.
    pub(crate) const TILT_PER_M: f64 = 4e-4;
    /// Error of odometry, as a part of the way.
    pub(crate) const DRIFT: f64 = 0.04;
    /// What errors of slopes make up on average does not count as knowledge, so many times over: it
    /// scatters, as the square of a few numbers does.
    pub(crate) const DOUBT: f64 = 1.5;
    /// Part of the variance of a slope that those beside it leave open at least.
    pub(crate) const SLOPES_APART: f64 = 1e-3;
    /// Log odds at which a pose is believed: one wrong answer in a thousand \[nats\].
    pub(crate) const SURE: f64 = 6.9;
    /// Least factor of the covariance by the mean of the squared residuals.
    pub(crate) const MISFIT_MIN: f64 = 0.6;
    /// Largest mean of the squared residuals of a pose that is believed, in their variances.
    pub(crate) const MISFIT_MAX: f64 = 2.0;
    /// Most places about a way, where it is weighed and where it is an answer.
    pub(crate) const SUPPORTS: usize = 48;
    /// See [`SUPPORTS`].
    pub(crate) const SUPPORTS_OF_ANSWER: usize = 80;
    /// Points about a node whose nearest places are asked, and their distance in correlation
    /// lengths; a node begins so many of them after the next one.
    pub(crate) const STENCIL: [[f64; 3]; 20] = [
        [1.0, 0.0, 0.0],
        [0.0, -1.0, 0.0],
        [0.0, 0.0, 1.0],
        [-1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, -1.0],
        [1.2, 1.2, 1.2],
        [-1.2, -1.2, 1.2],
        [1.2, -1.2, -1.2],
        [-1.2, 1.2, -1.2],
        [-1.2, -1.2, -1.2],
        [1.2, 1.2, -1.2],
        [-1.2, 1.2, 1.2],
        [1.2, -1.2, 1.2],
        [2.2, 0.0, 0.0],
        [0.0, -2.2, 0.0],
        [0.0, 0.0, 2.2],
        [-2.2, 0.0, 0.0],
        [0.0, 2.2, 0.0],
        [0.0, 0.0, -2.2],
    ];
    /// See [`STENCIL`].
    pub(crate) const STENCIL_TURN: usize = 7;
    /// See [`STENCIL`].
    pub(crate) const BESIDE_WAY: f64 = 0.4;
    /// Largest deviation of the heading of an answer \[rad\].
    pub(crate) const HEADING_SD_MAX_RAD: f64 = 0.2;
}

/// Compasses.
pub(crate) mod compass {
    /// Way of a stretch, along which an agent turns and an error lasts \[m\]: iron in floors and
    /// walls misleads for some metres.
    pub(crate) const STRETCH_M: f64 = 8.0;
    /// Fewest levels of a stretch.
    pub(crate) const LEVELS_MIN: u32 = 8;
    /// Most channels that an agent teaches at a time.
    pub(crate) const CHANNELS_MAX: usize = 16;
    /// Factor by which what was learned fades with the first stretch of a session: the latest fifty
    /// sessions count.
    pub(crate) const KEPT: f64 = 0.98;
    /// Rayleigh's statistic from which on directions are not of all sides: chance exceeds it with a
    /// probability of e⁻¹², for each of four factors and some tests one after the other.
    pub(crate) const SURE: f64 = 12.0;
    /// Largest spread about the heading that is told, in that of the headings: beyond, levels and
    /// headings go together because agents mostly look the same way.
    pub(crate) const SPREAD: f64 = 0.25;
    /// Least spread of the headings, 1 less the length of the mean unit vector: that of a deviation
    /// of 0.3 rad. Agents that always look the same way tell no compass from a constant.
    pub(crate) const HEADINGS: f64 = 0.05;
    /// Least variance of the error that lasts, six degrees, and of the noise about it, one degree
    /// \[rad²\]. Source: what phones and robots in buildings err by, however well they agreed so
    /// far.
    pub(crate) const LASTING_MIN_RAD2: f64 = 0.01;
    pub(crate) const NOISE_MIN_RAD2: f64 = 3e-4;
    /// Way of a step, whose levels count as one \[m\].
    pub(crate) const STEP_M: f64 = 1.0;
    /// Way without a level of a compass after which what it told is no longer used \[m\].
    pub(crate) const HEARD_M: f64 = 16.0;
    /// Rate at which the turn of an agent's odometry follows with a step: that drifts, and noise
    /// does not last.
    pub(crate) const LATELY: f64 = 0.1;
}
