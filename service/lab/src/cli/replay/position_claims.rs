//! What covariances promised of live positions, and what came.

use cogmap_lab::coverage::{Coverage, PROMISED};
use serde::ser::SerializeStruct;
use serde::{Serialize, Serializer};

/// What agents knew of where they started.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Start {
    /// Their start pose.
    Told,
    /// Nothing: they woke up.
    Woken,
}

impl Start {
    /// As a cell of a table.
    pub(super) fn cell(self) -> &'static str {
        match self {
            Self::Told => "told",
            Self::Woken => "woken",
        }
    }
}

/// How many true positions lay within the ellipses of live poses in the map, a second apart.
#[derive(Clone, Copy, Debug)]
pub(super) struct PositionClaims {
    pub(super) start: Start,
    /// Agents of which there were such poses.
    pub(super) agents: usize,
    pub(super) coverage: Coverage,
}

impl PositionClaims {
    /// Of nobody yet.
    pub(super) fn new(start: Start) -> Self {
        Self {
            start,
            agents: 0,
            coverage: Coverage::default(),
        }
    }

    /// Takes in those of an agent.
    pub(super) fn add(&mut self, coverage: &Coverage) {
        self.agents += usize::from(coverage.count() > 0);
        self.coverage.add_all(coverage);
    }

    /// Takes in those of other agents that started alike.
    pub(super) fn add_all(&mut self, other: &Self) {
        self.agents += other.agents;
        self.coverage.add_all(&other.coverage);
    }
}

impl Serialize for PositionClaims {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut fields = serializer.serialize_struct("PositionClaims", 5)?;
        fields.serialize_field("start", &self.start)?;
        fields.serialize_field("agents", &self.agents)?;
        fields.serialize_field("poses", &self.coverage.count())?;
        fields.serialize_field("promised", &PROMISED)?;
        fields.serialize_field("came", &self.coverage.shares())?;
        fields.end()
    }
}
