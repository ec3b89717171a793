//! Routes: how one gets from here to there.

use serde::{Deserialize, Serialize};

use crate::query::PerceptCue;

/// Asks for a route over the ways that the team has gone.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
#[serde(deny_unknown_fields)]
pub struct RouteQuery {
    /// Where it begins.
    pub from: RouteEnd,
    /// Where it ends.
    pub to: RouteEnd,
    /// What is to be least; the length when absent.
    #[serde(default)]
    pub cost: RouteCost,
    /// Whether ways may be taken in a direction in which nobody has travelled them; they may when
    /// absent.
    #[serde(default)]
    pub reverse: RouteReverse,
    /// What the route is to keep clear of.
    #[serde(default)]
    pub avoid: RouteAvoid,
    /// Whether it may cut corners, by straight lines that lie wholly within the corridor that
    /// bodies have swept along the ways; it may not when absent.
    #[serde(default)]
    pub shortcuts: bool,
    /// Half the width of that corridor \[m\], 0.01 to 1; 0.15 when absent.
    #[serde(default)]
    pub body_radius_m: Option<f64>,
    /// Most other routes to answer, 0 to 4; none when absent. Each shares at most half its length
    /// with any before it.
    #[serde(default)]
    pub alternatives: u32,
    /// In which form; steps when absent.
    #[serde(default)]
    pub format: RouteFormat,
    /// Distance of the poses of a path \[m\], 0.01 to 1000; 0.25 when absent.
    #[serde(default)]
    pub spacing_m: Option<f64>,
}

/// Where a route begins or ends.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
#[serde(rename_all = "snake_case")]
pub enum RouteEnd {
    /// A place.
    Place(u64),
    /// A position in `map` \[m\], within two field radii of a place.
    PositionM([f64; 3]),
    /// Where an agent is, by name.
    Agent(String),
    /// The place nearest to a landmark, by label.
    Landmark(String),
    /// Where a trip began.
    Trip(u64),
    /// Where an agent's session began, by the agent's name.
    Home(String),
    /// The place that a percept recalls best.
    Percept(PerceptCue),
    /// Where an agent was in this session so long ago, or so far back along its path.
    Back(RouteBack),
    /// The end of a trip, by its own legs from the point on it that is nearest; only as a goal.
    Retrace(RouteRetrace),
}

/// Where an agent was: by time or by path, exactly one of them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
#[serde(deny_unknown_fields)]
pub struct RouteBack {
    /// The agent, by name.
    pub agent: String,
    /// So long ago \[s\].
    #[serde(default)]
    pub s: Option<f64>,
    /// So far back along its path \[m\].
    #[serde(default)]
    pub m: Option<f64>,
}

/// A trip that is travelled again.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
#[serde(deny_unknown_fields)]
pub struct RouteRetrace {
    /// Its number.
    pub trip: u64,
    /// In which direction; forward when absent.
    #[serde(default)]
    pub direction: RetraceDirection,
}

/// In which direction a trip is travelled again.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
#[serde(rename_all = "snake_case")]
pub enum RetraceDirection {
    /// To where it ended.
    #[default]
    Forward,
    /// To where it began.
    Backward,
}

/// What is to be least on a route.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
#[serde(rename_all = "snake_case")]
pub enum RouteCost {
    /// Length \[m\].
    #[default]
    Length,
    /// Mean duration \[s\].
    Time,
    /// Variance of the position at the end \[m²\], by what was measured along the ways.
    Uncertainty,
    /// Length \[m\], twice as much for each half-life of memories since a way was travelled.
    Recency,
}

/// Whether ways may be taken backwards.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
#[serde(rename_all = "snake_case")]
pub enum RouteReverse {
    /// They may.
    #[default]
    Allowed,
    /// They may not.
    Never,
}

/// What a route is to keep clear of.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
#[serde(deny_unknown_fields, default)]
pub struct RouteAvoid {
    /// Places that it does not lead through.
    pub places: Vec<u64>,
    /// Boxes that it does not lead into.
    pub boxes: Vec<RouteBox>,
}

/// A box along the axes of `map`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
#[serde(deny_unknown_fields)]
pub struct RouteBox {
    /// The corner with the least coordinates \[m\].
    pub min_m: [f64; 3],
    /// The corner opposite \[m\].
    pub max_m: [f64; 3],
}

/// The form of a route.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
#[serde(rename_all = "snake_case")]
pub enum RouteFormat {
    /// Steps from place to place.
    #[default]
    Steps,
    /// Steps, and poses at equal distances along them: a `nav_msgs/Path`, or the goals of
    /// `FollowWaypoints`.
    Path,
}

/// Answer to a [`RouteQuery`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct RouteAnswer {
    /// Space.
    pub space: String,
    /// Frame of the poses; always `map`.
    pub frame: String,
    /// Number of records that the map includes.
    pub map_revision: u64,
    /// What the cheapest route costs, in units of what was to be least. Approaches cost nothing.
    pub cost: f64,
    /// Its length, approaches included \[m\].
    pub length_m: f64,
    /// Its duration to be expected \[s\].
    pub duration_s: f64,
    /// Standard deviation of the position at its end, by motion along the ways \[m\].
    pub sd_m: f64,
    /// Where it leads, one step after the other; none where start and goal are the same.
    pub steps: Vec<RouteStep>,
    /// Poses along it at equal distances, the first at the start; absent unless asked for.
    pub path: Option<Vec<RoutePose>>,
    /// Other routes, the cheaper ones first.
    pub alternatives: Vec<Route>,
}

/// Another route.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct Route {
    /// What it costs, likewise.
    pub cost: f64,
    /// Length, approaches included \[m\].
    pub length_m: f64,
    /// Duration to be expected \[s\].
    pub duration_s: f64,
    /// Standard deviation of the position at the end, by motion along the ways \[m\].
    pub sd_m: f64,
    /// Where it leads, one step after the other; none where start and goal are the same.
    pub steps: Vec<RouteStep>,
    /// Poses along it at equal distances, the first at the start; absent unless asked for.
    pub path: Option<Vec<RoutePose>>,
}

/// A step of a route: where it leads, and the way there.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct RouteStep {
    /// The place, which may have been forgotten; absent where the route leaves the places for a
    /// goal beside them.
    pub place: Option<u64>,
    /// Where it is \[m\].
    pub translation_m: [f64; 3],
    /// Orientation along the way, a unit quaternion `[x, y, z, w]`.
    pub rotation_xyzw: [f64; 4],
    /// How far off one may be and still be there \[m\].
    pub tolerance_m: f64,
    /// Standard deviation of the position there \[m\].
    pub sd_m: f64,
    /// How the way there is known.
    pub way: RouteWay,
    /// Its length \[m\].
    pub length_m: f64,
    /// Its duration to be expected \[s\].
    pub duration_s: f64,
    /// Times that it was travelled in this direction.
    pub traversals: u64,
    /// Latest stamp at which somebody came to its end, in either direction \[ns\]; absent for an
    /// approach.
    pub last_stamp_ns: Option<i64>,
    /// The trip that led along it last, in this direction if any did; absent where that has been
    /// forgotten.
    pub trip: Option<u64>,
    /// The number of the leg in that trip, counted from 0.
    pub leg: Option<u64>,
}

/// How the way of a step is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
#[serde(rename_all = "snake_case")]
pub enum RouteWay {
    /// Somebody travelled it.
    Travelled,
    /// Somebody travelled it, but only the other way.
    Reversed,
    /// A straight line between two places, wholly within the corridor that bodies have swept.
    Shortcut,
    /// From beside the places to the first, or from the last to beside them, in a straight line.
    Approach,
}

/// A way: what all legs between two places add up to.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct Way {
    /// The place of the lower number, which may have been forgotten.
    pub from: u64,
    /// The other one, likewise.
    pub to: u64,
    /// Where the first is \[m\].
    pub from_m: [f64; 3],
    /// Where the other one is \[m\].
    pub to_m: [f64; 3],
    /// Orientation of the first in `map`, a unit quaternion `[x, y, z, w]`.
    pub from_rotation_xyzw: [f64; 4],
    /// Orientation of the other one.
    pub to_rotation_xyzw: [f64; 4],
    /// Length \[m\]: the shortest path that was travelled, but no less than the distance of the
    /// places.
    pub length_m: f64,
    /// How it was travelled to the second place.
    pub there: WayTraversals,
    /// How it was travelled to the first place.
    pub back: WayTraversals,
    /// Mean position of the second place in the frame of the first, as legs measured it \[m\].
    pub translation_m: [f64; 3],
    /// Orientation there, a unit quaternion `[x, y, z, w]`.
    pub rotation_xyzw: [f64; 4],
    /// Standard deviations of one such measurement, along the axes of the second place \[m\].
    pub translation_sd_m: [f64; 3],
    /// Those about its axes \[rad\].
    pub rotation_sd_rad: [f64; 3],
    /// Number of measurements in the mean.
    pub measurements: u32,
    /// Whether the measurements lie more than five standard deviations from where the places are:
    /// the past was relaxed, and the places count.
    pub disagrees: bool,
    /// Its strength: each traversal counts one when it happens, and half as much after every
    /// half-life.
    pub strength: f64,
}

/// How a way was travelled in one direction.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct WayTraversals {
    /// How often.
    pub times: u64,
    /// Shortest duration \[s\]; absent where it never was, as are all below.
    pub fastest_s: Option<f64>,
    /// Mean duration \[s\].
    pub mean_s: Option<f64>,
    /// Latest stamp of an end \[ns\].
    pub last_stamp_ns: Option<i64>,
}

/// A pose on a path.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct RoutePose {
    /// Position \[m\].
    pub translation_m: [f64; 3],
    /// Orientation along the way, a unit quaternion `[x, y, z, w]`.
    pub rotation_xyzw: [f64; 4],
}
