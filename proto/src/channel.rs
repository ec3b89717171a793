//! What is known of the channels of percepts.

use serde::{Deserialize, Serialize};

/// What a channel carries.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
#[serde(rename_all = "snake_case")]
pub enum ChannelKind {
    /// Scalars.
    Level,
    /// Views: vectors of length 1.
    Descriptor,
}

/// A channel of percepts. Percepts of one name and of different kinds or lengths are different
/// channels.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct Channel {
    /// Its name.
    pub name: String,
    /// What it carries.
    pub kind: ChannelKind,
    /// How many numbers a view has; absent for levels.
    pub dimension: Option<u32>,
    /// How many views are logged, to be matched with one another; absent for levels.
    pub views: Option<u64>,
    /// What was learned of the channel when its views were last matched; absent for levels, while
    /// there are few views, and where they say nothing of where they were seen.
    pub learned: Option<LearnedChannel>,
    /// How its levels tell a heading; absent for views, and while levels are not known to.
    pub compass: Option<Compass>,
}

/// What was learned of a channel of views from them alone.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct LearnedChannel {
    /// How many views it was learned from.
    pub views: u64,
    /// Within this distance views are alike \[m\].
    pub range_m: f64,
    /// Mean log of the likelihood ratio of two neighbours along the way to be within the range of
    /// one another, against far ones \[nats\]. Of the later half of the views, by what the earlier
    /// half teaches; not above zero where views say nothing.
    pub information_nats: f64,
    /// Share of the evidence of a view that is its own, 0 to 1: neighbours say nearly the same.
    pub independence: f64,
    /// How alike views of one place are after the body has turned by 0°, 45°, 90°, 135° and 180°,
    /// as a part of how alike they are without a turn: all 1 of radio, which is always the same.
    pub turned: [f64; 5],
    /// Whether they are alike so far that a pair of views says less than odometry does: agents are
    /// found among cells by such views, and no loops are closed.
    pub coarse: bool,
}

/// How the levels of a channel tell the heading of an agent, as agents have taught that know
/// theirs: `heading = rad_per_unit · level − offset_rad`, but for whole turns, counted to the left
/// from the map's x axis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct Compass {
    /// Heading for each unit of the level \[rad\]: 1 or π/180, and below zero where levels grow to
    /// the right.
    pub rad_per_unit: f64,
    /// The level, as an angle, at a heading of zero \[rad\].
    pub offset_rad: f64,
    /// Standard deviation of the part of the error that lasts, as by what an agent carries \[rad\].
    pub lasting_sd_rad: f64,
    /// Standard deviation of the noise about that \[rad\].
    pub noise_sd_rad: f64,
    /// The agent that alone has taught it, and that alone it is true of; absent once several have.
    pub agent: Option<String>,
}

/// The channels of a space.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct ChannelList {
    /// In the order in which something was first remembered of them.
    pub channels: Vec<Channel>,
}
