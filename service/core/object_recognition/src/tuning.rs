//! Every number of the recogniser that somebody chose, with unit, meaning and source; those of what
//! lies between places are in [`interpolation::tuning`](crate::interpolation).
//!
//! The last word of each comment says where the value comes from:
//!
//! - *derived*: it follows from the equation or the paper that is named.
//! - *budget*: it bounds time or memory, and is not below what the figures need.
//! - *chosen*: it is a judgement. No measurement of it alone is recorded; the figures of
//!   `docs/recognition.md` are those of all together. Measure them anew after a change, with
//!   `cogmap-lab replay points DIR --told --trials 10 --looks 10,30,60 --seed 21`.

// Evidence.

/// Probability at which an answer is given, where a library states no other: one in 200 such
/// answers may be wrong. Chosen with the command above.
pub const ANSWER_PROBABILITY: f64 = 0.995;
/// Share of contacts that no model explains: misreadings, and touches of something else. Chosen.
pub(crate) const OUTLIER_SHARE: f64 = 0.02;
/// Prior probability that the object is none of the library. Chosen.
pub(crate) const UNKNOWN_PRIOR: f64 = 0.1;
/// Scale of the misfit of something never learned, per square root of contacts, in standard
/// deviations along depth and both angles: the Maxwell distribution of the unknown object. Chosen.
pub(crate) const UNKNOWN_MISFIT_SD: f64 = 1.2;
/// Probability that a further contact does not bring the right pose among the hypotheses. Chosen.
pub(crate) const MISS_PER_CONTACT: f64 = 0.5;
/// Contacts that an episode keeps. Budget.
pub(crate) const CONTACTS_MAX: usize = 128;
/// Radius of a walk's next contact, in median steps. Chosen.
pub(crate) const REACH_PER_STEP: f64 = 2.0;
/// Share of the mass that the hypotheses which are reported as live hold together. Chosen.
pub(crate) const LIVE_MASS: f64 = 0.99;
/// Probability from which an object is reported as live, and a further pose is listed. Chosen.
pub(crate) const LISTED_SHARE_MIN: f64 = 0.01;
/// Further poses in an answer. Budget.
pub(crate) const OTHER_POSES_MAX: usize = 24;
/// Places of the library by which the background model is evaluated: shares of a surface are then
/// good to a few hundredths. Budget.
pub(crate) const BACKGROUND_SAMPLES: usize = 256;
/// Least share of the weight that other objects' places must have before they say what lies beside
/// them. Chosen, against division by nothing.
pub(crate) const BACKGROUND_WEIGHT_MIN: f64 = 1e-9;

// Learning and percepts.

/// Cosine of the angle between normals of one place: 60°, beyond which they belong to two sides of
/// something thin or of an edge. Chosen.
pub(crate) const SAME_SIDE_COS: f64 = 0.5;
/// Standard deviation of a contact about its place, in widths of its uniform field: 1/√12. A field
/// is as wide as a spacing, and on a surface that was felt less densely as a link. Derived.
pub(crate) const FIELD_PER_SPACING: f64 = 0.288_675;
/// Distances at which the share of a model within them is tabled, per extent. Budget.
pub(crate) const SHARE_BINS: usize = 32;
/// Places from which these shares are counted: errors are then a few hundredths. Budget.
pub(crate) const SHARE_SAMPLES: usize = 128;
/// Share of percepts that come from nothing learned: a misreading, or a change. Chosen.
pub(crate) const WRONG_PERCEPT_SHARE: f64 = 0.05;
/// Scale of one less the cosine of two descriptors of one place: noise of a tenth costs 0.01 of it,
/// half another view 0.3. Chosen.
pub(crate) const DESCRIPTOR_SCALE: f64 = 0.05;
/// Levels beyond are taken for as far, so that squares are numbers. Chosen.
pub(crate) const LEVEL_MAX: f64 = 1e100;
/// Least variance of levels, per one and the square of their mean: rounding. Chosen.
pub(crate) const LEVEL_ROUNDING: f64 = 1e-12;
/// Distance of a level from the median of its object beyond which it is no level of its kind, in
/// median distances: no sensor resolves a thousandth of its range at most places and needs more
/// than the whole at others. Chosen.
pub(crate) const LEVEL_REACH: f64 = 1e3;
/// Largest share of an object's levels that are no levels of its kind. Chosen.
pub(crate) const UNUSUAL_SHARE_MAX: f64 = 0.1;
/// Part of the variance of levels like it that is added to that of each reading, so that exact
/// readings have a density. Chosen.
pub(crate) const LEVEL_VARIANCE_FLOOR: f64 = 1e-6;
/// Floor of the density of a level anywhere, per that at the mean: a value far off all others is a
/// misreading. Chosen.
pub(crate) const LEVEL_DENSITY_FLOOR: f64 = 1e-3;
/// Variance of the normal between neighbouring places, per axis \[rad²\]: a fifth of a radian is a
/// good part of what voxels and hands differ by. Chosen.
pub(crate) const NORMAL_VARIANCE: f64 = 0.04;
/// Share of normals that come from no place. Chosen.
pub(crate) const WRONG_NORMAL_SHARE: f64 = 0.1;
/// Fewer places than one in so many are evaluated one by one instead of all side by side; the
/// second number holds where a place's percepts need their lists. Chosen by running time.
pub(crate) const SPARSE_RATIOS: [usize; 2] = [16, 4];

// What lies between places.

/// Least correlation of the errors at two contacts by which the one tells of the other. Chosen.
pub(crate) const SHARED_MIN: f64 = 0.05;
/// Least density of a place, per that of the likeliest, that an earlier contact may make likely: of
/// what is within three deviations both of place and of level it is e⁻⁹. Derived.
pub(crate) const CONDITIONED_MIN: f64 = 1e-4;
/// Deviations from what is predicted beyond which a contact tells nothing of these errors: it is
/// with something else. Chosen.
pub(crate) const SHARED_DEVIATIONS: f64 = 3.0;
/// Contacts before another one by which a surface goes on, the nearest. Budget.
pub(crate) const CONTINUED_NEAREST: usize = 6;
/// The same at least: three span a plane. Derived.
pub(crate) const CONTINUED_MIN: usize = 3;
/// Distance within which the errors of what lies between places are common, in typical links: less
/// than half a gap, beyond which other places tell what is predicted. Chosen.
pub(crate) const ERROR_REACH: f64 = 0.35;
/// The same where they speak for an unknown object: about one gap, so that it is named late rather
/// than wrongly. Chosen.
pub(crate) const UNKNOWN_ERROR_REACH: f64 = 1.0;
/// Least variance of the difference of what is predicted at two places, per that of one. Chosen:
/// at one point both are the same.
pub(crate) const APART_MIN: f64 = 1e-3;
/// Contacts of an episode of which is told how likely they are together, evenly chosen. Budget.
pub(crate) const JOINT_CONTACTS: usize = 64;
/// Fewer of them tell nothing: one contact lies on any surface. Derived.
pub(crate) const JOINT_CONTACTS_MIN: usize = 2;
/// Contacts from which on they tell one known object from another together: by fewer, constants
/// that differ from model to model would. Chosen.
pub(crate) const JOINT_ODDS_CONTACTS: usize = 8;
/// Channels of a model whose levels are told so, the first ones. Budget.
pub(crate) const JOINT_CHANNELS: usize = 4;
/// Deviations from what is predicted beyond which a contact or a level is another's. Chosen.
pub(crate) const JOINT_SDS: f64 = 4.0;
/// Share of the variance of what is predicted across a surface that is common within a gap alone
/// ([`ERROR_REACH`]); the rest is common over a side. Chosen.
pub(crate) const LOCAL_ERROR_SHARE: f64 = 0.5;
/// By how much the surface of another object is elsewhere, per extent: objects of about one size
/// differ in theirs by a seventh. Chosen.
pub(crate) const SHAPE_SD: f64 = 0.07;
/// Distance over which that is common, per extent: a third of it. Chosen.
pub(crate) const SHAPE_REACH: f64 = 0.35;
/// Prior deviation of a pose about the likeliest one \[m\]. Chosen.
pub(crate) const POSE_PRIOR_M: f64 = 0.03;
/// Objects against each of which an unknown one has to be earned, the likeliest. Budget.
pub(crate) const EARNED_MAX: usize = 6;
/// Least probability that a contact is the first one on what was explored. Chosen.
pub(crate) const ENTER_MIN: f64 = 0.01;
/// Probability of an uncertain body from which on it is a variant of its object. Chosen.
pub(crate) const BODY_PRIOR_MIN: f64 = 0.05;
/// Probability that what was touched at random is touched at the same points again, at least.
/// Chosen.
pub(crate) const TOUCHED_AGAIN_MIN: f64 = 0.01;
/// Share of contacts that fall evenly over a surface, and not on its places alone, below which
/// nothing stands between these; so many may lie there all the same. Hands that feel a surface
/// anywhere have a share from a third to one, those that reach for the same points again less than
/// a tenth. Chosen.
pub(crate) const EVEN_SHARE_MIN: f64 = 0.25;
/// Prior probability that an object which was taught at the same points again is felt elsewhere
/// too. Chosen.
pub(crate) const ELSEWHERE_PRIOR: f64 = 0.1;
/// Odds of the unknown object over a known one, below which contacts in gaps do not take its lead:
/// it comes first still, but a space that asks for more is not answered. Chosen.
pub(crate) const UNPREDICTED_ODDS: f64 = 2.0;
/// Distance of nodes, in spacings. Chosen.
pub(crate) const NODE_STEP: f64 = 2.0;

// Translations: the Gaussian sum.

/// Hypotheses kept. Budget.
pub(crate) const TRANSLATIONS_MAX: usize = 2048;
/// A hypothesis so far below the best holds nothing worth its keep \[nats\]. Chosen.
pub(crate) const PRUNE_NATS: f64 = 20.0;
/// The same of a model of which contacts share errors and that has no body: few of them count in
/// full, so that what lies so far behind seldom catches up. Chosen.
pub(crate) const SHARED_PRUNE_NATS: f64 = 14.0;
/// A hypothesis splits where several places could be the one touched; each part has this share of
/// the contact's likelihood at least. Chosen.
pub(crate) const SPLIT_SHARE_MIN: f64 = 0.005;
/// Parts of a split. Budget.
pub(crate) const SPLIT_MAX: usize = 16;
/// Widest cell in which two hypotheses are one, in standard deviations; it is rounded down to a
/// power of two, so to half of this at least. The sum has the moments of both. Chosen.
pub(crate) const MERGE_CELL_SD: f64 = 1.6;
/// Squared distance, in variances, beyond which a place is not the one touched: e⁻¹⁶. Chosen.
pub(crate) const GATE_SQUARED: f64 = 32.0;

/// Distance from a search within which others share its list of places, per reach. Chosen by
/// running time.
pub(crate) const SHORTLIST_SLACK: f64 = 0.5;
/// Radius of a list of places, per reach of a search that shares it, at most: a narrow search would
/// look at too many places of a wide list. At least 1 + `SHORTLIST_SLACK`. Chosen.
pub(crate) const SHORTLIST_WIDEST: f64 = 2.5;

// Translations: the second search.

/// Contacts after which poses are looked for again. Budget.
pub(crate) const SEARCHED_AFTER: [usize; 3] = [24, 48, 96];
/// Contacts by which they are found, far apart from one another. Budget.
pub(crate) const SEARCHED_CONTACTS: usize = 24;
/// Places and rotations where they are sought, of the likeliest models. Budget.
pub(crate) const SEARCHED_SEEDS_MAX: usize = 1 << 14;
/// Poses that are looked at. Budget.
pub(crate) const SEARCHED_POSES: usize = 32;
/// Places of the first contact by which each is replayed. Budget.
pub(crate) const SEARCHED_SEEDS: usize = 2;
/// How much less likely they may be than the best of them \[nats\]. Chosen.
pub(crate) const SEARCHED_NATS: f64 = 12.0;
/// Deviations within which a pose is that of a hypothesis. Chosen.
pub(crate) const SEARCHED_SDS: f64 = 2.0;

// Translations: the prefilter.

/// Seeds of the prefilter. Of larger libraries every second place stands for two, or every third
/// for three. Budget.
pub(crate) const SEEDS_MAX: usize = 1 << 22;
/// Rotations that stand for all about the vertical: 2 degrees apart, so that at 0.1 m from the
/// first contact a rotation between two moves a contact by 1 mm (deviation), as exactly as hands
/// feel. Chosen.
pub(crate) const YAW_TURNS: u16 = 180;
/// Contacts that promoted seeds explain at a touch. Budget.
pub(crate) const PROMOTION_MAX: usize = 1024;
/// The same at least. Budget.
pub(crate) const PROMOTION_MIN: usize = 256;
/// Seeds whose prefilter costs as much as `PROMOTION_MAX` exact contacts. Measured as running time.
pub(crate) const PROMOTION_SEEDS: usize = 120_000;
/// Contacts after which promotion no longer waits until all seeds that matter fit its budget: until
/// then estimates tell them apart nearly as well. Chosen.
pub(crate) const WAITING_CONTACTS: usize = 12;
/// Share of all mass that seeds which wait may hold when the others are promoted. Chosen.
pub(crate) const WAITING_SHARE: f64 = 1e-3;
/// Share of all mass that seeds which are never promoted may hold. Chosen.
pub(crate) const NEGLIGIBLE_SHARE: f64 = 1e-6;
/// Contacts after which the prefilter is given up. Budget.
pub(crate) const PREFILTER_CONTACTS_MAX: usize = 32;
/// Factor from one at which weights are scaled back, so that `f32` holds them. Derived.
pub(crate) const RESCALE: f32 = 1_048_576.0;
/// Most by which the weights of an object fall at once for its size \[nats\], so that `f32` holds
/// them: three times what is pruned. Derived.
pub(crate) const RESIZE_NATS_MAX: f64 = 60.0;
/// Largest factor of a weight at one touch, so that numbers stay finite. Derived.
pub(crate) const GAIN_MAX: f32 = 1e30;
/// A list is made anew when fewer of its seeds than one in so many hold a mass. Chosen.
pub(crate) const LIVE_SEEDS_RATIO: usize = 2;
/// Masses of a histogram that are counted; of longer lists each stands for several. Budget.
pub(crate) const COUNTED_MAX: usize = 16_384;

// Indexes.

/// Standard deviations within which the nearest place is looked up. Chosen.
pub(crate) const NEAREST_SD: f64 = 3.5;
/// Allowance of the first scale over the reach of a touch like the learned ones. Chosen.
pub(crate) const NEAREST_MARGIN: f64 = 1.1;
/// Ratio of the reaches of successive scales of nearest-place grids. Chosen.
pub(crate) const NEAREST_GROWTH: f64 = 3.0;
/// Cells along the reach of a scale. Chosen.
pub(crate) const NEAREST_CELLS_PER_REACH: f64 = 4.0;
/// Cells of a nearest-place grid, so that it stays in a processor's caches. Budget.
pub(crate) const NEAREST_CELLS_MAX: f32 = 65_536.0;
/// Places per cell of the lattice index, over the box that holds the model: a surface fills few of
/// the box's cells, and those hold several times as many. Chosen.
pub(crate) const PLACES_PER_CELL: f64 = 0.3;
/// Cells of the lattice index along an axis. Budget.
pub(crate) const LATTICE_CELLS_MAX: f64 = 256.0;
/// Cells of the surfels' cell lists: a megabyte. Budget.
pub(crate) const LIST_CELLS_MAX: f64 = 262_144.0;
/// Width of these cells, in reaches of a surfel: lists then hold little beyond what is in reach.
/// Chosen.
pub(crate) const LIST_CELL_PER_REACH: f64 = 0.33;

// Surfels: fitting them to places.

/// Neighbours by which the density of places is estimated: their number scatters by a third.
/// Chosen.
pub(crate) const DENSITY_NEIGHBOURS: usize = 10;
/// Neighbours to which a surfel is fitted. Chosen.
pub(crate) const FIT_NEIGHBOURS: usize = 16;
/// Cosine of the angle between normals of one surfel: 45°, beyond which lies an edge. Chosen.
pub(crate) const SMOOTH_COS: f64 = 0.707;
/// Reach of a surfel along the surface, as a standard deviation, per spacing of places: the sum
/// over random places is then even to two fifths. Chosen.
pub(crate) const TANGENT_PER_SPACING: f64 = 0.55;
/// Sine of the angle by which a surfel bends within its reach: 53°. Chosen.
pub(crate) const BEND_SINE_MAX: f64 = 0.8;
/// Area of a surfel, in median areas: beyond, nothing is known. Chosen.
pub(crate) const AREA_MAX: f64 = 4.0;
/// Variance of a surfel, in median variances. Chosen.
pub(crate) const SCATTER_MAX: f64 = 16.0;
/// Weight of the median scatter in a surfel's own, in neighbours (shrinkage). Chosen.
pub(crate) const SHRINKAGE: f64 = 4.0;
/// Width of a fit, in variances of a place: a narrower one fits the noise. Chosen.
pub(crate) const FIT_WIDTH_MIN: f64 = 4.0;
/// Ridge on the curvature, in neighbours: a place without neighbours is flat. Chosen.
pub(crate) const CURVATURE_RIDGE: f64 = 0.1;
/// Weight of squared residuals in the second, robust pass: 1/(1 + r²/4). Chosen.
pub(crate) const ROBUST_PER_SQUARE: f64 = 0.25;
/// Least sum of surfels by which areas are divided when they are equalised. Chosen.
pub(crate) const COVERAGE_MIN: f64 = 0.25;

// Surfels: likelihood of a contact.

/// Share of contacts on the smooth surface; the others are about edges and seams. Chosen.
pub(crate) const SMOOTH_SHARE: f64 = 0.85;
/// Standard deviation of a normal about an edge or seam \[rad\]: 20°. Chosen.
pub(crate) const EDGE_NORMAL_RAD: f64 = 0.35;
/// Depth about an edge or seam, in standard deviations of the surfel's. Chosen.
pub(crate) const EDGE_DEPTH: f64 = 2.0;
/// Distance along the surface to which a surfel counts, as half a squared number of deviations: the
/// reach of 2.45 deviations, squared and halved. Derived.
pub(crate) const ALONG_MAX: f64 = 3.0;
/// Distance along the surface at which a surfel is listed, in deviations of its reach. Chosen.
pub(crate) const REACH_SD: f64 = 2.45;
/// Depth to which a surfel counts, as a squared number of deviations. Chosen.
pub(crate) const DEPTH_MAX: f64 = 100.0;
/// Part of the curvature of the coverage that damps a step of the pose. Chosen.
pub(crate) const EDGE_DAMPING: f64 = 0.25;
/// Places whose leave-one-out density says what a right pose explains. Budget.
pub(crate) const LEAVE_ONE_OUT_MAX: usize = 256;
/// Floor of a coarse score \[nats\], so that one outlier does not decide. Chosen.
pub(crate) const COARSE_MIN: f64 = -12.0;
/// Turn of one Gauss-Newton step \[rad\]: a farther one leaves the contacts' neighbourhood. Chosen.
pub(crate) const STEP_RAD_MAX: f64 = 0.3;

// Poses: the search.

/// Poses kept per model. Budget.
pub(crate) const POSES_MAX: usize = 16;
/// Surfels whose pairs are tabled: 57,600 pairs in a quarter of a megabyte. Budget.
pub(crate) const PAIR_SURFELS_MAX: usize = 240;
/// Bins of an angle of a pair: 12° each, as in Drost et al. 2010. Derived.
pub(crate) const PAIR_ANGLES: usize = 15;
/// Bins of a pair's distance over the model's extent. Chosen.
pub(crate) const PAIR_DISTANCES: usize = 16;
/// Least length of what the normals say across a pair: below it fixes no turn about it. Chosen.
pub(crate) const PAIR_ACROSS_MIN: f64 = 0.25;
/// Pairs of contacts considered at a touch. Budget.
pub(crate) const PAIRS_CONSIDERED: usize = 64;
/// Pairs of contacts looked up at a touch, rarest first. Budget.
pub(crate) const PAIRS_MAX: usize = 16;
/// Pairs of surfels that a lookup must find: with fewer, the right ones lie in the next bin more
/// often than not. Chosen.
pub(crate) const PAIR_MATCHES_MIN: usize = 4;
/// Poses tried at a touch. Budget.
pub(crate) const TRIED_MAX: usize = 600;
/// Of these, the ones scored on more contacts. Budget.
pub(crate) const SIFTED_MAX: usize = 120;
/// Of these, the ones of which refinement begins. Budget.
pub(crate) const BEGUN_MAX: usize = 14;
/// Of these, the ones that are refined. Budget.
pub(crate) const REFINED_MAX: usize = 6;
/// Contacts of the first and the second coarse score. Budget.
pub(crate) const SIEVE_CONTACTS: [usize; 2] = [4, 12];
/// Contacts by which a new pose is refined. Budget.
pub(crate) const REFINE_CONTACTS: usize = 20;
/// Factor of all variances in a coarse score: three times the deviations. Chosen.
pub(crate) const COARSE_WIDEN: f64 = 9.0;
/// Factors of all variances in the steps by which a new pose is refined. Chosen.
pub(crate) const REFINE_WIDEN: [f64; 5] = [9.0, 4.0, 2.0, 1.0, 1.0];
/// Contacts during which every touch is followed by a search. Budget.
pub(crate) const EARLY_CONTACTS: usize = 12;
/// Poses so far below the best are not refined at every touch \[nats\]. Budget.
pub(crate) const REFINE_NATS: f64 = 12.0;
/// Models so far below the best are searched at every eighth touch only \[nats\]. Budget.
pub(crate) const SEARCH_NATS: f64 = 20.0;
/// Every so many touches a model far below the best is searched. Budget.
pub(crate) const SEARCH_EVERY: usize = 8;
/// Every so many touches a light pose is refined, and a search repeated without a rival. Budget.
pub(crate) const REFINE_EVERY: usize = 4;
/// Poses of a model that are refined at every touch. Budget.
pub(crate) const REFINED_ALWAYS: usize = 3;
/// Loss of score for which a refined pose is still taken \[nats\]. Chosen.
pub(crate) const REFINE_LOSS_MAX: f64 = 0.5;
/// Squared Mahalanobis distance below which two poses are one: its mean over six numbers. Derived.
pub(crate) const SAME_POSE: f64 = 6.0;
/// Turn within which no further pose is begun \[rad\]. Chosen.
pub(crate) const NEAR_RAD: f64 = 0.12;
/// Distance within which no further pose is begun, per extent of the model. Chosen.
pub(crate) const NEAR_EXTENT: f64 = 0.05;

// Goodness of fit.

/// Variance of a log density by a contact's own noise: half a chi-squared number with three degrees
/// of freedom, depth and both angles. Derived.
pub(crate) const NOISE_LOG_VARIANCE: f64 = 1.5;
/// Probability of the surface above which a drawn contact counts in the coverage test. Chosen.
pub(crate) const COVERAGE_SHARE_MIN: f64 = 0.5;
/// Halvings of a surface in the coverage test: into 16 parts. Chosen.
pub(crate) const HALVINGS_MAX: usize = 4;
/// Places of a part, on average: fewer do not tell how much of the surface it is. Chosen.
pub(crate) const PART_PLACES_MIN: usize = 8;
/// Contacts that a coverage test needs. Chosen.
pub(crate) const COVERAGE_CONTACTS_MIN: usize = 4;

// Explanation.

/// Deviations within which the poses of both variants of an object are one. Chosen.
pub(crate) const SAME_POSE_SDS: f64 = 3.0;
/// Standard deviations of a contact's position, beside the spacing of the model, within which a
/// place counts as explored. Chosen.
pub(crate) const EXPLORED_SDS: f64 = 2.0;

// Next touch.

/// Hypotheses that a next touch is to tell apart. Budget.
pub(crate) const RIVALS_MAX: usize = 6;
/// Touches considered on each of them. Budget.
pub(crate) const SITES_MAX: usize = 32;
/// Log ratio by which one touch tells two hypotheses apart: it may be an outlier \[nats\]. Chosen.
pub(crate) const GAIN_NATS_MAX: f64 = 8.0;
/// Worth of telling two poses of one model apart, per that of telling two models. Chosen.
pub(crate) const POSE_WORTH: f64 = 0.2;
/// Lightest hypothesis about which is asked. Chosen.
pub(crate) const RIVAL_WEIGHT_MIN: f64 = 1e-4;
