//! Memory: what agents have learned of the world, apart from where they are.

pub(crate) mod blockage;
pub(crate) mod ids;
pub(crate) mod landmark;
pub(crate) mod object;
pub(crate) mod percept;
pub(crate) mod place;
pub(crate) mod recall;
pub(crate) mod sequence;
pub(crate) mod strength;
pub(crate) mod trip;
pub(crate) mod way;
