//! Every number of what lies between places that somebody chose, in the words of
//! [`crate::tuning`].

/// Nearest places among which links are sought. Budget.
pub(super) const LINK_NEIGHBOURS: usize = 16;
/// Radius of the ball about the middle of a link that holds no other place, per half its length:
/// below one, so that few faces of a surface are without a diagonal. A curve that turns by less
/// than 74° at a place has no link past it. Chosen.
pub(super) const LINK_BALL: f64 = 0.75;
/// Longest link of a chain that leads about a chord, per length of that: half, as of a hexagon.
/// Chosen.
pub(super) const CHORD_LINK: f64 = 0.55;
/// Longest such chain, per length of the chord: half a circle, and a little. Chosen.
pub(super) const CHORD_CHAIN: f64 = 1.7;
/// Share of the links in a plane that are chords, above which places lie about an outline. Where
/// they lie all over a plate it is 0.025 on average, and 0.11 at most by 20 or 30 places. Chosen.
pub(super) const CHORD_SHARE: f64 = 0.15;
/// Places that are tried for a chain. Budget.
pub(super) const CHORD_PLACES: usize = 256;
/// Longest link of an outline in a plane, per typical one: neighbours are about equally far. Of
/// random places all over a plate it is 2.9 and more in nine of ten, by 20 places. Chosen.
pub(super) const OUTLINE_LINK: f64 = 2.0;
/// Places of an outline among several, at least: fewer are in order by chance. Chosen.
pub(super) const OUTLINE_PLACES: usize = 8;
/// Distance of places from others that are not next to them along an outline, in typical links,
/// below which they lie side by side: as far as across a square of a raster, and no less than its
/// longest link. Chosen.
pub(super) const OUTLINE_BESIDE: f64 = 1.42;
/// Share of an outline's places that lie so, at most. On rasters it is three quarters and more, of
/// an ellipse of 5 to 1 by 20 places a fifth at most. Chosen.
pub(super) const OUTLINE_BESIDE_SHARE: f64 = 0.25;
/// Longest link, per typical one: beyond, nothing was explored. Gaps between places that are drawn
/// at random all over a surface are rarely longer. Chosen.
pub(super) const LINK_LENGTH_MAX: f64 = 4.0;
/// Angle between neighbouring links of a surface's place beyond which the surface may be open there
/// \[rad\]: 160°. Chosen.
pub(super) const OPEN_SURFACE_RAD: f64 = 2.8;
/// Distance from all that was felt beyond which nothing was explored, in typical links. Chosen.
pub(super) const EXPLORED_REACH: f64 = 3.0;
/// Places about a hole in a surface, at least: a smaller one hides nothing. Chosen.
pub(super) const RIM_MIN: usize = 5;
/// Links along a curve within which it leads on, or ends. Chosen.
pub(super) const END_LINKS: usize = 3;
/// Cosine of the angle between two directions along a curve below which one leads on where the
/// other came from: 104°. Chosen.
pub(super) const OPEN_CURVE_COS: f64 = -0.25;
/// Share of the variance of places across a plane below which they lie in it: a seventh of the
/// deviation. Chosen.
pub(super) const FLAT_SHARE: f64 = 0.02;
/// Least share of an object that counts as not explored. Chosen.
pub(super) const UNEXPLORED_MIN: f64 = 0.05;
/// Share of contacts between places that are not as predicted: a corner, an edge or the end of a
/// pattern may lie there. Chosen.
pub(super) const UNEXPECTED_SHARE: f64 = 0.5;
/// Prior probability that an object with an open edge was felt in part only: others have an edge of
/// their own. Chosen.
pub(super) const PARTIAL_PRIOR: f64 = 0.1;
/// Mean length of a part that is not as predicted, per that of what was felt. Chosen.
pub(super) const MISSING_PER_KNOWN: f64 = 0.5;
/// Length of a walk beyond what was felt after which half of them are back, per length of what is
/// missing. Chosen.
pub(super) const STAY_PER_MISSING: f64 = 0.5;
/// Distance from where it begins at which a walk may enter what was explored, in typical links.
/// Chosen.
pub(super) const ENTRY_REACH: f64 = 1.5;
/// Places by which it may be entered. Budget.
pub(super) const ENTRIES_MAX: usize = 64;
/// Places by which a curve or a surface is predicted. Budget.
pub(super) const KRIGING_CURVE: usize = 6;
/// See [`KRIGING_CURVE`].
pub(super) const KRIGING_SURFACE: usize = 12;
/// Places to either side of a point of a curve that are in a row with it, at most. Budget.
pub(super) const ROW_SIDE: usize = 4;
/// Places of a row, at least: of three none tells that a curve bends. Derived.
pub(super) const ROW_MIN: usize = 4;
/// Neighbours of a place of which two span a plane with it. Budget.
pub(super) const SIDE_PAIRS: usize = 8;
/// Such planes that are fitted to the places by them, the best. Budget.
pub(super) const SIDE_FITTED: usize = 4;
/// Fits of each. Budget.
pub(super) const SIDE_FITS: usize = 2;
/// Distance from a plane within which a neighbour lies by it, in typical links: a surface that
/// turns by 9° over a link leaves its tangent plane so far. Chosen.
pub(super) const SIDE_REACH: f64 = 0.08;
/// The same in deviations of a contact: it is as large as the larger of both. Chosen.
pub(super) const SIDE_NOISES: f64 = 3.0;
/// Weight of a neighbour straight above a plane that has as many below, in neighbours by it: a
/// plane through the body is no tangent plane. Chosen.
pub(super) const SIDE_THROUGH: f64 = 8.0;
/// Cosine of the angle between the normals of two places of one side: 45°. Chosen.
pub(super) const SIDE_COS: f64 = 0.707;
/// Sine of the angle between the tangent plane and the way to a place of the same side: half of
/// 45°, as on a circle. Derived.
pub(super) const SIDE_OFFSET: f64 = 0.383;
/// Places by which a field is learned: its variance is then good to a seventh. Budget.
pub(super) const FIELD_SAMPLES: usize = 96;
/// Lengths of a field that are tried, in typical links. Chosen.
pub(super) const FIELD_LENGTHS: [f64; 4] = [0.7, 1.5, 3.0, 6.0];
/// Noise of a field that is tried, per its variance. Chosen.
pub(super) const FIELD_NOISES: [f64; 4] = [1e-4, 1e-2, 0.1, 1.0];
/// Lengths of the process of an object's levels that are tried, in typical links. Chosen.
pub(super) const PROCESS_LENGTHS: [f64; 3] = [1.5, 3.0, 6.0];
/// Variances of what is rough besides, per that of the process. Chosen.
pub(super) const PROCESS_ROUGHNESS: [f64; 6] = [1e-3, 0.03, 0.1, 0.3, 1.0, 3.0];
/// The least of them that counts: twenty levels do not tell that none is rough. Chosen.
pub(super) const PROCESS_ROUGHNESS_MIN: f64 = 0.03;
/// Lengths of what is rough, in typical links. Chosen.
pub(super) const PROCESS_ROUGH_LENGTHS: [f64; 3] = [1.0, 0.3, 0.1];
/// Least variance of a level's noise, per that of the process. Chosen.
pub(super) const PROCESS_NUGGET: f64 = 1e-3;
/// Places by which such a process predicts. Budget.
pub(super) const PROCESS_PLACES: usize = 96;
/// Fewer places tell nothing of what lies between and beyond them: of twenty contacts some fall on
/// one place. Chosen.
pub(super) const BETWEEN_MIN: usize = 16;
/// Log-likelihood ratio of all levels of a model, each predicted by its neighbours, against levels
/// that have nothing to do with them: less says little of what lies beside a place \[nats\].
/// Chosen.
pub(super) const PREDICTED_NATS: f64 = 10.0;
/// Deviations by which the squares of levels that are the same all over may be above those of their
/// noise, together. Chosen.
pub(super) const SAME_SDS: f64 = 3.0;
/// Degrees of freedom of the errors of a field: few are far larger than the rest. Chosen.
pub(super) const TAILS: f64 = 4.0;
/// By how much a body through all places must be likelier than what the places around tell, each
/// place predicted by others \[nats\]. Chosen.
pub(super) const BODY_NATS: f64 = 5.0;
/// Deviation of the mean distance of random points to their nearest, for as many as one on a square
/// of side one (Clark and Evans 1954). Derived.
pub(super) const REGULARITY_SD: f64 = 0.261_36;
/// Most deviations by which distances are compared. Derived: their square stays finite.
pub(super) const REGULARITY_MAX: f64 = 1e6;
/// Share of random points that lie within a spacing of others, to the first order, beyond which
/// places tell little of how they were touched. Chosen.
pub(super) const CORE_MAX: f64 = 0.5;
/// Deviation of the mean distance of chosen places to their nearest ones, per that of random ones.
/// Chosen: the ratio is 2 of a square pattern, and nearly 0 of pairs.
pub(super) const CHOSEN_RATIO_SD: f64 = 0.5;
/// Places to which a body is fitted, evenly chosen of more. Budget.
pub(super) const BODY_PLACES: usize = 256;
/// Places by which the first steps to a body are made. Budget.
pub(super) const BODY_SAMPLES: usize = 128;
/// First steps from each start. Budget.
pub(super) const BODY_FIRST_STEPS: usize = 6;
/// Bodies of these that are kept. Budget.
pub(super) const BODY_KEPT: usize = 4;
/// Least probability of one beside the best that is looked at. Chosen.
pub(super) const BODY_PROBABILITY_MIN: f64 = 0.01;
/// Last steps of each. Budget.
pub(super) const BODY_LAST_STEPS: usize = 30;
/// Largest change of a turn \[rad\], of the logarithm of a size or an exponent, or of the taper in
/// a step. Chosen.
pub(super) const BODY_STEP_MAX: f64 = 0.5;
/// Parts of the places that are left out, one after the other. Budget.
pub(super) const BODY_FOLDS: usize = 12;
/// Steps without each. Budget.
pub(super) const BODY_FOLD_STEPS: usize = 8;
/// Deviations from a body beyond which a place is not as it predicts. Chosen.
pub(super) const BODY_MISSED_SDS: f64 = 4.0;
/// Logarithm of a body's exponents, as expected: 3.3, between an ellipsoid and a box. Chosen.
pub(super) const EXPONENT_LOG: f64 = 1.2;
/// Its standard deviation. Chosen.
pub(super) const EXPONENT_LOG_SD: f64 = 1.0;
/// Range of it: from a body with pinched edges to one whose edges are as sharp as can be felt.
/// Chosen.
pub(super) const EXPONENT_LOG_RANGE: [f64; 2] = [0.3, 3.7];
/// Standard deviation of the logarithm of a body's sizes. Chosen.
pub(super) const SIZE_LOG_SD: f64 = 1.0;
/// The same of how two objects of a hand's size differ: by a half. Chosen.
pub(super) const SIZE_APART_SD: f64 = 0.5;
/// Standard deviation of a body's taper. Chosen.
pub(super) const TAPER_SD: f64 = 0.3;
/// Largest taper: a body with a tip. Chosen.
pub(super) const TAPER_MAX: f64 = 0.95;
/// Points of a body of which nodes are chosen. Budget.
pub(super) const BODY_POINTS: u32 = 16_384;
/// Points of a body by which is told whether all of it was felt. Budget.
pub(super) const SIDE_SAMPLES: u32 = 4_096;
/// Least distance of these, per half its mean size. Budget.
pub(super) const SIDE_SAMPLES_APART: f64 = 0.15;
/// Cosine of the angle between the normals on one side of a body and its axis, at least: 37°, so
/// that edges are on no side. Chosen.
pub(super) const SIDE_NORMAL_COS: f64 = 0.8;
/// Least probability of so few places on one side of a body as there are. Chosen.
pub(super) const SIDE_PROBABILITY_MIN: f64 = 0.01;
/// Least distance of two nodes on a body, in steps. Chosen.
pub(super) const BODY_APART: f64 = 0.85;
/// Places whose errors scale the variance of a field around. Chosen.
pub(super) const ERROR_NEIGHBOURS: usize = 6;
/// Nodes and places of a model: a model with more places has no nodes. Budget.
pub(super) const NODES_MAX: usize = 1024;
/// Typical link of a surface, in spacings, up to which it needs no nodes: places that are kept
/// apart by a spacing lie so far from one another, across the diagonals of a square too. Chosen.
pub(super) const DENSE_LINK: f64 = 1.5;
/// A contact is in a gap of which nothing is predicted if it is farther from every place than half
/// a spacing and so many of its deviations. Chosen.
pub(super) const UNPREDICTED_DEVIATIONS: f64 = 2.0;
/// Error of what is predicted between the places, per distance of nodes, above which that distance
/// grows: a node's field along the surface is then half as wide as it errs across. Chosen.
pub(super) const NODE_ERROR: f64 = 0.6;
/// Factor by which this distance grows until the nodes fit. Chosen.
pub(super) const NODES_GROWTH: f64 = 1.25;
/// Least distance of two nodes, in steps. Chosen.
pub(super) const NODE_APART: f64 = 0.55;
/// Standard deviation of a contact about its node along the surface, in steps: that of a uniform
/// field of half a step to each side. Derived.
pub(super) const NODE_FIELD: f64 = 0.288_675;
