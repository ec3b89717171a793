//! Constants of the estimator: unit, meaning and source of each.
//!
//! What a space sets, the gate of sightings among it, is in [`Parameters`](super::Parameters). A
//! source is an equation, a physical reason, or what measures the constant:
//!
//! - *team*: `cogmap-lab replay mrclam DIR`, also with `--unknown-starts` and `--anonymous 3`
//! - *liars*: `make drills DRILLS="liars"`
//! - *hall*: `cargo nextest run -p cognitive_map --test estimator`
//!
//! A constant without a source is a judgement: no measurement of it alone is recorded.

// --- Bounds of memory and work -------------------------------------------------------------------

/// Agents that a frame estimates jointly. Source: a sighting costs the square of the components;
/// 32 agents of 11 and 96 landmarks of 3 are 640.
pub(super) const MEMBERS_MAX: usize = 32;
/// Landmarks that a frame estimates jointly. Source: as [`MEMBERS_MAX`].
pub(super) const LANDMARKS_MAX: usize = 96;
/// Of them, those that stay for the others. Source: a judgement; a quarter.
pub(super) const ANCHORS_MAX: usize = LANDMARKS_MAX / 4;
/// Anchors of an archived landmark. Source: three points of a body tell how it moves in space.
pub(super) const TIES_MAX: usize = 3;
/// Generations of archived anchors that come back with a landmark: its own, theirs, and so on.
/// Source: more than the six that the ring of `tests/estimator/large_hall.rs` has.
pub(super) const TIED_DEPTH_MAX: u32 = 16;
/// Joint landmarks from which on anchors do not come back with a landmark. Source: a sighting costs
/// the square.
pub(super) const RESTORED_MAX: usize = 2 * LANDMARKS_MAX;
/// Generations of them that are followed to read where a landmark is. Source: three anchors each
/// make forty in all.
pub(super) const TIES_FOLLOWED_MAX: u32 = 3;
/// How near to one another, or to a line, anchors say little of how they have turned \[m\]. Source:
/// the deviation of a landmark that is seen well.
pub(super) const TURN_ARM_M: f64 = 0.02;
/// Variances that are added to those of anchors, which may be known exactly: a share of each, and
/// \[m²\]. Source: more than rounding, less than sensors tell.
pub(super) const TIE_VARIANCE_SHARE: f64 = 1e-9;
pub(super) const TIE_VARIANCE_MIN_M2: f64 = 1e-12;
/// Parts of a landmark archive. A change after a snapshot copies one part.
pub(super) const ARCHIVE_PARTS: usize = 1024;
/// Landmarks of a part of an archive: 65,536 in all. Labels are spread evenly over the parts; of a
/// full one the landmark that was archived longest ago goes.
pub(super) const ARCHIVE_PART_MAX: usize = 64;
/// Observers of a landmark that are known by number; of more, it may have been anybody.
pub(super) const OBSERVERS_MAX: usize = 8;
/// Sightings of agents that wait for the motion of the other agent.
pub(super) const PENDING_MAX: usize = 64;
/// Sightings between agents of different frames that are kept.
pub(super) const CROSS_SIGHTINGS_MAX: usize = 64;
/// Pairs of frames of which a motion that was found is kept.
pub(super) const FRAME_MATCHES_MAX: usize = 64;
/// Frames that are compared with an agent's own after a sighting; the others come next.
pub(super) const FRAMES_COMPARED_MAX: usize = 16;
/// Frames among which the next one to register with is sought.
pub(super) const FRAMES_SCANNED_MAX: usize = 16;
/// Labels that are associated with another one. Beyond that no landmarks are associated.
pub(super) const ASSOCIATIONS_MAX: usize = 4096;
/// Targets of which a sensor keeps the latest sighting.
pub(super) const SENSOR_TARGETS_MAX: usize = 128;

// --- Motion --------------------------------------------------------------------------------------

/// Longest interval between two motions over which a bias counts \[s\].
pub(super) const MOTION_INTERVAL_S_MAX: f64 = 10.0;
/// Fastest that a body goes which may be standing \[m/s\]. Source: odometry of one that stands
/// drifts by millimetres a second.
pub(super) const STANDING_SPEED_MAX_M_S: f64 = 0.02;
/// Fastest that it turns in a second: in deviations of the bias, and whatever that is \[rad/s\].
/// Source: robots that turn on the spot turn by degrees a second.
pub(super) const STANDING_RATE_SD: f64 = 3.0;
pub(super) const STANDING_RATE_MAX_RAD_S: f64 = 0.02;
/// How many times faster it must be seen to go to have been standing, and the speed that counts at
/// least \[m/s\]: so a body that never goes a decimetre a second is not taken to stand.
pub(super) const STANDING_CONTRAST: f64 = 20.0;
pub(super) const STANDING_CREEP_M_S: f64 = 0.005;
/// Way without being seen to go so fast after which it is not known to have stood \[m\].
pub(super) const STANDING_WAY_MAX_M: f64 = 2.0;
/// Time of which the mean rate is looked at \[s\].
pub(super) const STANDING_WINDOW_S: f64 = 1.0;
/// Longest interval between two motions of a stand \[s\]: after a longer one some may be missing.
pub(super) const STANDING_INTERVAL_S_MAX: f64 = 1.5;
/// Time beyond which what was read at first counts for less \[s\].
pub(super) const STANDING_S_MAX: f64 = 100.0;
/// Noise density of a standing gyroscope \[rad/s/√Hz\]. Source: data sheets of small ones give
/// 0.0001 to 0.0005; wheels and engines shake.
pub(super) const STANDING_RATE_SD_RAD_SQRT_S: f64 = 1e-3;
/// Deviation of what a body turns by that seems to stand \[rad\]: it settles, or looks about.
pub(super) const STANDING_TURN_SD_RAD: f64 = 0.02;
/// Motions that are gathered before they are carried over to the covariance. Source: carrying it
/// with each would be most of a motion's work (`docs/decisions/0028-motion-noise-is-gathered.md`).
pub(super) const RUN_STEPS_MAX: u32 = 64;
/// Length of gathered motion \[m\]. Source: digits are lost with the lever from where it began.
pub(super) const RUN_LENGTH_MAX_M: f64 = 10.0;
/// Poses of odometry that are kept.
pub(super) const HISTORY_LEN: usize = 64;
/// Least interval between two kept poses \[ns\]: 64 of them span three seconds, more than
/// [`PENDING_NS_MAX`].
pub(super) const HISTORY_INTERVAL_NS: i64 = 50_000_000;
/// Standard deviation of a rotation of which nothing is known \[rad\]. Source: no rotation is off
/// by more than half a turn.
pub(super) const ANY_TURN_SD_RAD: f64 = 3.0;
/// Factor by which a variance of a rotation may exceed that of [`ANY_TURN_SD_RAD`] until it is
/// reduced.
pub(super) const ANY_TURN_SLACK: f64 = 1.001;
/// Standard deviation of a position from which on it says nothing \[m\]. Source: the largest
/// `lost_sd_m` that settings may state.
pub(super) const POSITION_SD_MAX_M: f64 = 1e6;
/// Largest lasting error of odometry that is accepted, in the deviations that the settings state.
/// Source: *liars* (`docs/decisions/0027-covariances-stay-positive.md`).
pub(super) const LASTING_DEVIATIONS_MAX: f64 = 8.0;
/// Deviation of the veer that is expected, in that of the lasting error of angles \[rad/m\].
/// Source: wheels whose diameters differ by a part in a hundred, a third of a metre apart, where
/// angles are known to a tenth.
pub(super) const VEER_PER_ANGLE_ERROR_RAD_M: f64 = 0.3;
/// Veer that is accepted in any case, either way \[rad/m\]: more only if the settings expect more.
/// Source: eight deviations of the prior of the pose graph.
pub(super) const VEER_ACCEPTED_RAD_M: f64 = 0.24;
/// Largest lasting error of lengths and of angles, as a ratio. Source: with more, readings would
/// say next to nothing, or the contrary.
pub(super) const LASTING_RATIO_MAX: f64 = 0.9;
/// Part of its variance that a lasting error renews on 100 m, in 100 rad, or in 1000 s.
pub(super) const CALIBRATION_RENEWAL: f64 = 0.01;
/// Largest deviation of a lasting error, in those that the settings state: it may wander, but not
/// for ever.
pub(super) const WANDERED_MAX: f64 = 2.0;
/// Least factor 1 − c by which a reading may have been corrected, where a motion is corrected anew.
/// Source: 1 − [`LASTING_RATIO_MAX`].
pub(super) const CALIBRATION_FACTOR_MIN: f64 = 0.1;

// --- Noise of odometry ---------------------------------------------------------------------------

/// Landmarks whose sightings are compared at a time. Source: memory; all pairs at a time tell about
/// the same motion.
pub(super) const NOISE_TARGETS_MAX: usize = 8;
/// Longest interval of a pair of sightings \[ns\]. Source: lasting errors of sensors change with
/// the aspect of what is seen, over some seconds.
pub(super) const NOISE_PAIR_NS_MAX: i64 = 10_000_000_000;
/// Sightings after which a landmark is compared with a newer one of its own.
pub(super) const NOISE_PAIRS_MAX: u32 = 64;
/// Least noise of odometry's lengths or angles, in that which a sensor states, for a pair to tell
/// about it.
pub(super) const NOISE_SHARE_MIN: f64 = 0.5;
/// Noise of odometry, in that of a pair of sightings, from which on a longer pair says no more.
pub(super) const NOISE_SATURATED: f64 = 4.0;
/// Length from which on motion is summed anew \[m\]. Source: digits are lost with the lever.
pub(super) const NOISE_SUM_LENGTH_MAX_M: f64 = 30.0;
/// Largest deviation of an angle that is compared \[rad\]. Source: the comparison is linear in it.
pub(super) const NOISE_ANGLE_SD_MAX_RAD: f64 = 1.0;
/// What a pair counts for, in its likelihood: its half. Source: pairs of landmarks that are seen
/// together share the error of the motion. A logarithm of a variance has half a score and half an
/// information of its square, which is the other half.
pub(super) const NOISE_PAIR_WEIGHT: f64 = 0.25;
/// Deviation c from which on an error counts no more, the mean of min(ν², c²) of Gaussian noise
/// with variance one, and how fast that grows with the logarithm of the variance: with the density
/// φ and the distribution Φ, 2Φ(c) − 1 − 2cφ(c) for the latter, and 2c²(1 − Φ(c)) more for the
/// mean.
pub(super) const NOISE_ROBUST: (f64, f64, f64) = (2.0, 0.920_54, 0.738_54);
/// Deviations from which on one of a pair was of something else. More than c, so that noise that is
/// far greater than thought shows in the pairs in between. Source: *hall*, with three of ten
/// sightings of something else; with 5 what is learned of odometry at times does not come back.
pub(super) const NOISE_FALSE_SD: f64 = 4.0;
/// Pairs over which the past fades.
pub(super) const NOISE_MEMORY: f64 = 500.0;
/// Largest step of the logarithm of a factor.
pub(super) const NOISE_LOG_STEP_MAX: f64 = 1.0;
/// Deviations of the logarithms of the factors before anything was seen. Source: kinds of odometry
/// differ by a factor of three in their deviations, either way; who states the noise of a sensor
/// knows it to a third.
pub(super) const NOISE_PRIOR_SD: [f64; 4] = [2.2, 2.2, 0.6, 0.6];
/// Largest logarithm of a factor, either way: a factor of twenty of deviations.
pub(super) const NOISE_LOG_SCALE_MAX: f64 = 6.0;
/// Deviations of its logarithm by which noise beside that which odometry states must be certain.
pub(super) const NOISE_SURELY_SD: f64 = 2.0;
/// Part of the logarithm of a factor below one that counts. Source: a pair sees the noise of some
/// seconds, while errors that change within minutes (slip on another floor) grow faster; *team*.
pub(super) const NOISE_CAUTION: f64 = 0.25;
/// Deviation of the logarithm of the factor of angles, by pairs of sightings, from which on the
/// assumed noise that is not there is taken back. Source: a deviation is known within a sixth then.
pub(super) const NOISE_TRIAL_SD: f64 = 0.3;
/// Longest time from the first sighting until then \[ns\].
pub(super) const NOISE_TRIAL_NS_MAX: i64 = 60_000_000_000;
/// Steps η of the logarithm of a sensor's factor, the first and the least, and the pairs of
/// sightings after which it is half of the first. Source: what is understated a hundredfold is
/// found out by some forty pairs, a few seconds of some landmarks; small steps later leave what is
/// stated right as it is.
pub(super) const UNDERSTATED_STEP: (f64, f64) = (1.0, 0.2);
pub(super) const UNDERSTATED_PAIRS: f64 = 100.0;
/// The quantile that a sensor's factor follows: of the largest square of one, two and three
/// Gaussian numbers of variance one, and the share p below it. Source: where a third of the
/// sightings are false, hardly half of the pairs are right.
pub(super) const UNDERSTATED_QUANTILE: ([f64; 3], f64) = ([0.148_47, 0.564_94, 0.946_68], 0.3);
/// Least deviation that counts before so many pairs of sightings have repeated \[m, rad\]. Source:
/// of cameras and lasers on robots hardly one is better.
pub(super) const UNDERSTATED_SD_FIRST: f64 = 0.01;
pub(super) const UNDERSTATED_PAIRS_FIRST: u32 = 30;
/// Largest logarithm of a sensor's factor: a thousand of deviations.
pub(super) const UNDERSTATED_LOG_MAX: f64 = 14.0;
/// Part of it that counts. Source: what a sensor states to within a half of the deviation counts as
/// it is stated.
pub(super) const UNDERSTATED_SHARE: f64 = 0.25;
/// Largest deviation that counts so, as a part of the distance, and of directions \[rad\]. Source:
/// a camera that sees three degrees wrong is a bad one; *liars*.
pub(super) const UNDERSTATED_SD_MAX: f64 = 0.05;
/// Parts of a covariance that are followed at a time, of eight agents, and the largest covariance
/// of which they are. Source: work; each takes twice as long as the covariance itself.
pub(super) const NOISE_SHARES_MAX: usize = 16;
pub(super) const NOISE_SHARE_DIM_MAX: usize = 192;

// --- Sightings -----------------------------------------------------------------------------------

/// Shortest distance at which a direction means something \[m\].
pub(super) const DIRECTION_DISTANCE_MIN_M: f64 = 0.02;
/// Least deviation of a component of a sighting \[m, rad\]: none is without error, also one that
/// states so.
pub(super) const SIGHTING_SD_MIN: f64 = 1e-3;
/// How long a sighting of an agent waits for that agent's motion, by the observer's clock \[ns\].
pub(super) const PENDING_NS_MAX: i64 = 2_000_000_000;
/// How long an error of distance lasts \[s\]: until the robot sees its target from another side.
/// Source: half of [`CORRELATION_INTERVAL_S_MAX`]; *team*.
pub(super) const LASTING_S: f64 = 2.0;
/// Shortest interval between two sightings of one target that is told from none \[s\].
pub(super) const SIGHTING_INTERVAL_S_MIN: f64 = 1e-3;
/// Sightings for which the assumption counts that errors of distance last, before any was seen.
pub(super) const PRIOR_LASTING_SIGHTINGS: f64 = 5.0;
/// Sightings for which the stated noise counts before any was seen.
pub(super) const PRIOR_SIGHTINGS: f64 = 15.0;
/// Sightings over which the past of a sensor fades.
pub(super) const MEMORY_SIGHTINGS: f64 = 1000.0;
/// Largest factor between a learned variance and the stated one.
pub(super) const SENSOR_SCALE_MAX: f64 = 25.0;
/// Largest error that a sensor learns from, in deviations.
pub(super) const LEARNED_ERROR_MAX: f64 = 3.0;
/// Largest lasting error of distances, in stated deviations.
pub(super) const LASTING_OVER_STATED_MAX: f64 = 3.0;
/// Longest interval between two sightings of one target that tell whether errors last \[s\].
pub(super) const CORRELATION_INTERVAL_S_MAX: f64 = 4.0;
/// Least sum of squares that a correlation is the quotient of.
pub(super) const CORRELATION_SQUARE_MIN: f64 = 1e-12;

/// Deviation of a bearing from which on a sighting counts as a distance alone \[rad\]. Source: of
/// an angle on the circle, one radian of noise leaves nine tenths of the information that it would
/// have on a line, and two leave a tenth; an arc of one radian is no tangent any more.
pub(super) const VAGUE_BEARING_SD_RAD: f64 = 1.0;

/// Largest variance of an angle that is told from a larger one \[rad²\]: it says nothing.
pub(super) const CIRCLE_VARIANCE_MAX: f64 = 30.0;

// --- Distances alone
// ---------------------------------------------------------------------------

/// Landmarks of which an agent knows distances alone. Source: memory; each has up to 1,728 places
/// of 112 bytes, and some dozens after a few distances.
pub(super) const RANGED_MAX: usize = 32;
/// Most places where one of them may be. Source: twice those by one distance, for the first ones
/// may have been those of reflections.
pub(super) const RANGE_POINTS_MAX: usize = {
    let rings = (RANGE_LAYERS * RANGE_RING_POINTS) as usize;
    let sphere = RANGE_SPHERE_POINTS as usize;
    2 * RANGE_NOISE_PARTS * if rings > sphere { rings } else { sphere }
};
/// Parts of the noise assumed of turns with which each place is held. Source: two deviations of
/// what is known of it ([`NOISE_PRIOR_SD`]), in steps of one.
pub(super) const RANGE_NOISE_PARTS: usize = 3;
/// Places on a ring about the antenna. Source: with spacing and deviation of an eighth of a radian,
/// an arc differs from its tangent by a hundredth of its radius.
pub(super) const RANGE_RING_POINTS: u32 = 48;
/// Places on a sphere about it, a fifth of a radian apart. Source: work.
pub(super) const RANGE_SPHERE_POINTS: u32 = 256;
/// Deviation of a place along the ring, in the spacing of two. Source: so that their sum is even.
pub(super) const RANGE_OVERLAP: f64 = 0.6;
/// Elevation of a ring above the one below it \[rad\], and the most rings. Source: half of it is
/// the deviation, as along a ring of which the points are as far apart twice; up to 75 degrees.
pub(super) const RANGE_LAYER_RAD: f64 = 0.26;
pub(super) const RANGE_LAYERS: u32 = 6;
/// Greatest height of a beacon above an antenna \[m\]. Source: rooms; tags on robots, on walls, and
/// below ceilings.
pub(super) const RANGE_HEIGHT_MAX_M: f64 = 3.0;
/// Degrees of freedom of the noise of distances (Student's t). Source: walls in between and
/// reflections; Lange, Little & Taylor 1989.
pub(super) const RANGE_DOF: f64 = 4.0;
/// Part of the distances that are supposed to be those of reflections where nothing is known yet,
/// and by how much they are too long at most \[m\]. Source: halls.
pub(super) const RANGE_REFLECTED: f64 = 0.1;
pub(super) const RANGE_REFLECTION_MAX_M: f64 = 20.0;
/// Most of a distance's variance, in its own, by which the ring at a place is round.
pub(super) const RANGE_CURVED_MAX: f64 = 3.0;
/// Weight below which a place is dropped.
pub(super) const RANGE_WEIGHT_MIN: f64 = 1e-5;
/// Weight of the places about the best one from which on it is the landmark's.
pub(super) const RANGE_JOIN_MASS: f64 = 0.99;
/// Distances in a row that must leave one place. Source: a single one may be that of a reflection
/// and fit by chance.
pub(super) const RANGE_DECIDED_MIN: u32 = 3;
/// Largest sag of an arc of its deviation, in deviations of a distance.
pub(super) const RANGE_JOIN_SAG: f64 = 0.1;
/// Largest deviation of the direction of a landmark that joins after a long way \[rad\]. Source:
/// its arc differs from its tangent by a hundredth of the distance.
pub(super) const RANGE_JOIN_ANGLE_RAD: f64 = 0.15;
/// Factor of the variances of a landmark that is learned by distances. Source: errors of distances
/// last, and Gaussians that are left out have tails.
pub(super) const RANGE_JOIN_WIDENING: f64 = 4.0;
/// Squared innovation beyond which a distance fits no place: three deviations.
pub(super) const RANGE_OUTLYING_SQUARE: f64 = 9.0;
/// Distances after which the places begin anew if most have fitted none of them.
pub(super) const RANGE_TRIAL_MIN: u32 = 8;
/// Squared innovation beyond which a distance that is too long is that of a reflection.
pub(super) const RANGE_TOO_LONG_SQUARE: f64 = 25.0;
/// Least part of a distance's information that counts, where it may be that of a reflection.
pub(super) const RANGE_INFORMATION_MIN: f64 = 0.05;
/// Distances in a row that are too long, from which on they contradict the estimate as any other
/// sighting does. Source: where half are reflected, that many are once in a hundred thousand times.
pub(super) const RANGES_TOO_LONG_MAX: u32 = 16;
/// Correlation of the errors of successive distances of one target, before any was seen, and the
/// largest one that counts.
pub(super) const RANGE_PRIOR_CORRELATION: f64 = 0.5;
pub(super) const RANGE_CORRELATION_MAX: f64 = 0.98;

// --- Outliers and contradictions -----------------------------------------------------------------

/// Refused sightings in a row after which an agent's pose becomes less certain, where what it saw
/// lately agrees on none that is farther off. Source: *hall*, an agent that slipped finds its way
/// back.
pub(super) const REFUSED_TO_WIDEN: u32 = 8;
/// Deviations that are added to the pose then \[m, rad\]. Source: *hall*.
pub(super) const WIDENED_SD: (f64, f64) = (1.0, 0.5);
/// Votes after which a landmark is forgotten: refused sightings that see it at one other position,
/// less those that see it elsewhere. Refused distances, which name no position, count in a row.
/// Source: *hall*, a post that is moved.
pub(super) const REFUSED_TO_FORGET: u32 = 8;
/// The same for a landmark that no sighting has confirmed. Source: two against the one that placed
/// it.
pub(super) const VOTES_AGAINST_UNCONFIRMED: u32 = 2;
/// Deviations of the distance of two sighted positions within which they agree. Source: the gate of
/// sightings.
pub(super) const VOTE_GATE: f64 = 4.0;
/// Refused sightings in a row after which a label is that of a landmark of its own again. Source:
/// less than [`REFUSED_TO_FORGET`], so that the landmark itself stays.
pub(super) const REFUSED_TO_DISSOCIATE: u32 = 6;
/// What a refused sighting adds to an agent's doubt, and one that fits takes away.
pub(super) const DOUBT_BY_SIGHTING: u32 = 2;
/// What a sighting adds that is taken in but does not fit. Source: where sightings are random, as
/// many are odd as are refused or fit; where they are merely noisier than stated, few are.
pub(super) const DOUBT_BY_OUTLIER: u32 = 1;
/// Deviations within which all components of a sighting that fits are, or more where the settings
/// let them lose weight only later. Source: of six true components one is beyond in a quarter of
/// all sightings, and doubt grows where two thirds are.
pub(super) const ODD_SD: f64 = 2.0;
/// Doubt from which on an agent corrects nobody but itself. Source: what it takes to search farther
/// around once; *liars*.
pub(super) const DOUBT_MIN: u32 = DOUBT_BY_SIGHTING * REFUSED_TO_WIDEN;
/// Doubt at which an agent is set aside. Source: an agent that slipped or was carried off a few
/// metres has found its way back before, by searching farther around eight times; *liars*.
pub(super) const DOUBT_MAX: u32 = DOUBT_BY_SIGHTING * 64;
/// Doubt from which on an agent searches around by sightings of unconfirmed landmarks, too. Source:
/// half of what sets it aside, so that it has time to.
pub(super) const DOUBT_TO_SEARCH: u32 = DOUBT_MAX / 2;
/// Doubt of an agent that was set aside and is back in the map: half as many sightings have to fit,
/// more than do not, before it counts as others do.
pub(super) const DOUBT_ON_RETURN: u32 = 2 * DOUBT_MIN;

/// Refused sightings in a row from which on it is asked whether what an agent saw agrees on another
/// pose; of a doubted agent, one. Source: *hall*, with three of ten sightings of something else.
pub(super) const REFUSED_TO_DOUBT_POSE: u32 = 3;
/// Sightings of known landmarks that an agent keeps, to judge its pose by. Source: work, which
/// grows with their square, in space with their cube.
pub(super) const RECENT_SIGHTINGS_MAX: usize = 16;
/// Log₁₀ of the expected number of poses on which as many agree by chance, for one to count.
/// Source: one in a thousand.
pub(super) const CONSENSUS_LOG10_FALSE_ALARMS_MAX: f64 = -3.0;
/// Landmarks whose sightings must agree on a pose. Source: more than the three posts of a shelf
/// that is moved.
pub(super) const CONSENSUS_MIN: usize = 4;
/// Latest sightings of which one must agree on a pose. Source: as many as are refused in a row
/// before anything is asked.
pub(super) const CONSENSUS_LATEST: u64 = 3;
/// Least distance of two sightings that say how a body is turned, in its own deviations. Source: a
/// turn known to within a fifth of a radian.
pub(super) const CONSENSUS_SPAN_SD: f64 = 5.0;
/// Rounds of fitting a pose and seeking what agrees on it again. Source: rounds of registration.
pub(super) const CONSENSUS_ROUNDS: usize = 3;

// --- Agents and landmarks that come back
// -----------------------------------------------------------

/// Factor of the deviations of an agent that comes back to a joint estimate.
///
/// Errors A and B of unknown correlation have at most the covariance A/w beside B/(1 − w), for any
/// w in (0, 1) (Julier & Uhlmann 1997). With w = 1/9 the agent's own estimate counts for a ninth,
/// and the others' variances would have to grow by an eighth each time. They stay as they are: what
/// they miss is small, and a growth with every return would not end.
pub(super) const RETURN_WIDENING: f64 = 3.0;
/// Steps of the search for the weight of a covariance intersection.
pub(super) const INTERSECTION_STEPS: u32 = 16;
/// Least information that a direction gains by an external pose, as a part of what is known of it.
pub(super) const INTERSECTION_GAIN_MIN: f64 = 0.02;
/// Most that it gains.
pub(super) const INTERSECTION_GAIN_MAX: f64 = 1e9;
/// Least variance of a component of an external pose, as a part of the estimate's own.
pub(super) const INTERSECTION_VARIANCE_MIN: f64 = 1e-9;

// --- Alignment of frames
// ---------------------------------------------------------------------------

/// Fewest points that align two planar frames, and two frames in space. Source: one more than a
/// rigid motion needs.
pub(super) const ALIGNMENT_POINTS_MIN: (usize, usize) = (3, 4);
/// Part of the points that must agree. Source: *team*, unknown starts.
pub(super) const ALIGNMENT_AGREEING_MIN: f64 = 0.7;
/// Largest deviation of the rotation \[rad\]. Source: the joint update is linear in it.
pub(super) const ALIGNMENT_ROTATION_SD_MAX_RAD: f64 = 0.12;
/// Rounds of weighing the points anew.
pub(super) const ALIGNMENT_ROUNDS: usize = 8;
/// Normalised distance from which on a point loses weight (Cauchy).
pub(super) const ALIGNMENT_SOFT: f64 = 2.0;
/// Factor of the deviations of the found motion. Source: the points' errors are correlated, and the
/// landmarks known in both frames correct the motion afterwards, so that it need only be wide.
pub(super) const ALIGNMENT_WIDENING: f64 = 5.0;
/// Least distance of the places where an agent was seen, for two sightings to count as two \[m\].
/// Source: sightings from one place share their error.
pub(super) const CROSS_SIGHTINGS_APART_M: f64 = 0.2;

// --- Landmarks under other names
// -------------------------------------------------------------------

/// Sightings of a frame between two attempts to associate its landmarks. A prime: where agents see
/// in turn, each has its turn.
pub(super) const ASSOCIATE_EVERY: u64 = 31;
/// Attempts in a row that must find one motion. Source: *team*, anonymous
/// (`docs/decisions/0030-landmark-names-are-checked.md`).
pub(super) const FRAME_MATCH_FOUND_MIN: u32 = 3;
/// Rounds of testing whether two correspondences fit better with their points swapped.
pub(super) const SWAP_ROUNDS: usize = 3;
/// Landmarks of the older frame that are registered, in the plane and in space, where a motion
/// takes three. Source: work.
pub(super) const REGISTERED_MAX: (usize, usize) = (64, 32);
/// Factor of the landmarks' variances. Source: sensors keep their errors for a while, so that the
/// estimate is too sure of itself.
pub(super) const LANDMARK_WIDENING: f64 = 4.0;
/// Variance of the distance between two estimates of one landmark, beside their own \[m²\]: 1 cm.
pub(super) const SAME_LANDMARK_VARIANCE_M2: f64 = 1e-4;
/// Least variance that a landmark is weighed with \[m²\]: 1 mm.
pub(super) const LANDMARK_VARIANCE_MIN_M2: f64 = 1e-6;
/// Log₁₀ of the probability by chance of as many associations, for them to be accepted. Source:
/// `docs/decisions/0030-landmark-names-are-checked.md`.
pub(super) const ASSOCIATION_LOG10_CHANCE_MAX: f64 = -4.0;
/// Largest probability that something lies by chance where a landmark would be associated with
/// another.
pub(super) const ASSOCIATION_CHANCE_MAX: f64 = 0.25;

// --- Numbers
// ---------------------------------------------------------------------------------------

/// Most that rounding takes away of a variance, as a part of those that it is made of.
pub(super) const ROUNDING: f64 = 1e-14;
/// Growth of variances with each update, as a part of what they were: more than what rounding takes
/// away.
pub(super) const COVARIANCE_ROUNDING: f64 = 1e-10;
/// Least variance of a component of a measurement that the estimate expects, as a part of the
/// variances of whose differences it is made. Source: below that it is rounding; a measurement then
/// adds at most 10⁴ times what was known (`docs/decisions/0027-covariances-stay-positive.md`).
pub(super) const CONDITION_MIN: f64 = 1e-8;
/// Deviations beyond which a level loses weight (Huber 1964). Source: that of sightings.
pub(super) const LEVEL_HUBER_SD: f64 = 2.0;
