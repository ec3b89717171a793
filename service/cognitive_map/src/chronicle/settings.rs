//! How much of the past is kept.

/// Limits of a chronicle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ChronicleSettings {
    /// Anchors at most. An anchor with a motion takes about 400 bytes.
    pub anchors_max: u32,
    /// Sightings at most. One takes about 220 bytes.
    pub sightings_max: u32,
    /// Ties at most: start poses and matches. One takes about 250 bytes.
    pub ties_max: u32,
}

impl Default for ChronicleSettings {
    fn default() -> Self {
        Self {
            anchors_max: 65_536,
            sightings_max: 131_072,
            ties_max: 32_768,
        }
    }
}
