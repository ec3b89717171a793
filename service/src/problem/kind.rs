//! The table of problems: one kind, status and title for one mistake, whatever door it came
//! through.

/// Kinds of problems. Their names are part of the interface and stay as they are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// A name or number in the path or key cannot be one.
    InvalidPath,
    /// A query parameter is unknown, or its value cannot be read.
    InvalidParameter,
    /// The body is not such a message.
    MalformedBody,
    /// The token is missing or wrong.
    Unauthorized,
    /// A page of another host wants to change something.
    ForeignOrigin,
    /// There is nothing under this path.
    UnknownRoute,
    /// There is no such space.
    UnknownSpace,
    /// There is no such agent, or nothing is known of it yet.
    UnknownAgent,
    /// No place remembers anything of the channel.
    UnknownChannel,
    /// The agent has been removed.
    RemovedAgent,
    /// There is no such place, trip, landmark or object.
    UnknownMemory,
    /// The place or trip has been forgotten.
    ForgottenMemory,
    /// The path does not take this method.
    MethodNotAllowed,
    /// Samples before those of the request are missing.
    SequenceGap,
    /// A newer session has taken the agent over.
    StaleSession,
    /// The space exists with other settings.
    OtherSettings,
    /// The space has its full number of agents.
    TooManyAgents,
    /// The service has its full number of spaces.
    TooManySpaces,
    /// It is not known where the agent stands in the map.
    NotPlaced,
    /// A route is to begin or end where an agent is that is lost.
    AgentLost,
    /// No way leads from the start of a route to its goal.
    NoWay,
    /// The space has its full number of blockages.
    TooManyBlockages,
    /// Pinned trips would take more than half the budget of legs.
    TooManyPins,
    /// The body is too long.
    BodyTooLong,
    /// The codec that the message names is not one that is read here.
    UnsupportedMediaType,
    /// The request is for a host that the service is not known as.
    UnknownHost,
    /// The session's number lies in the future.
    SessionInFuture,
    /// Settings that break a rule.
    InvalidSettings,
    /// A trajectory does not reach to the stamp that is asked about.
    StampOutOfRange,
    /// No place is near where a route is to begin or end.
    NothingNear,
    /// A question or a batch that can be read, and breaks a rule.
    InvalidQuery,
    /// A fault of the service.
    Internal,
    /// The store does not work; the service must be looked after.
    StoreFailed,
    /// Too much is under way; come back.
    Busy,
    /// The space is still loading; come back.
    Recovering,
    /// No node of the cluster owns the space at the moment; come back.
    Moving,
    /// The node that owns the space did not answer: whether it did what was asked is not known.
    OwnerLost,
    /// The space's journal is damaged; an operator must look after it.
    SpaceStopped,
    /// The service or the space is closing.
    Closing,
    /// The service cannot do its work until it is looked after.
    NotReady,
    /// The answer took too long.
    Timeout,
    /// The store's disk is full.
    StoreFull,
}

impl Kind {
    /// All kinds, by status.
    pub const ALL: [Self; 42] = [
        Self::InvalidPath,
        Self::InvalidParameter,
        Self::MalformedBody,
        Self::Unauthorized,
        Self::ForeignOrigin,
        Self::UnknownRoute,
        Self::UnknownSpace,
        Self::UnknownAgent,
        Self::UnknownChannel,
        Self::UnknownMemory,
        Self::MethodNotAllowed,
        Self::SequenceGap,
        Self::StaleSession,
        Self::OtherSettings,
        Self::TooManyAgents,
        Self::TooManySpaces,
        Self::NotPlaced,
        Self::AgentLost,
        Self::NoWay,
        Self::TooManyBlockages,
        Self::TooManyPins,
        Self::RemovedAgent,
        Self::ForgottenMemory,
        Self::BodyTooLong,
        Self::UnsupportedMediaType,
        Self::UnknownHost,
        Self::SessionInFuture,
        Self::InvalidSettings,
        Self::StampOutOfRange,
        Self::NothingNear,
        Self::InvalidQuery,
        Self::Internal,
        Self::StoreFailed,
        Self::OwnerLost,
        Self::Busy,
        Self::Recovering,
        Self::Moving,
        Self::SpaceStopped,
        Self::Closing,
        Self::NotReady,
        Self::Timeout,
        Self::StoreFull,
    ];

    /// Name, status after RFC 9110 and title: the table itself.
    fn row(self) -> (&'static str, u16, &'static str) {
        match self {
            Self::InvalidPath => ("invalid-path", 400, "Invalid name in the path"),
            Self::InvalidParameter => ("invalid-parameter", 400, "Invalid query parameter"),
            Self::MalformedBody => ("malformed-body", 400, "Malformed body"),
            Self::Unauthorized => ("unauthorized", 401, "Missing or wrong token"),
            Self::ForeignOrigin => ("foreign-origin", 403, "A page of another host"),
            Self::UnknownRoute => ("unknown-route", 404, "Unknown path"),
            Self::UnknownSpace => ("unknown-space", 404, "Unknown space"),
            Self::UnknownAgent => ("unknown-agent", 404, "Unknown agent"),
            Self::UnknownChannel => ("unknown-channel", 404, "Unknown channel"),
            Self::UnknownMemory => ("unknown-memory", 404, "Unknown memory"),
            Self::MethodNotAllowed => ("method-not-allowed", 405, "Method not allowed"),
            Self::SequenceGap => ("sequence-gap", 409, "Earlier samples are missing"),
            Self::StaleSession => ("stale-session", 409, "A newer session has taken over"),
            Self::OtherSettings => ("other-settings", 409, "The space has other settings"),
            Self::TooManyAgents => ("too-many-agents", 409, "Too many agents"),
            Self::TooManySpaces => ("too-many-spaces", 409, "Too many spaces"),
            Self::NotPlaced => (
                "not-placed",
                409,
                "The agent's place in the map is not known",
            ),
            Self::AgentLost => ("agent-lost", 409, "The agent is lost"),
            Self::NoWay => ("no-way", 409, "No way leads there"),
            Self::TooManyBlockages => ("too-many-blockages", 409, "Too many blockages"),
            Self::TooManyPins => ("too-many-pins", 409, "Too many pinned trips"),
            Self::RemovedAgent => ("removed-agent", 410, "Removed agent"),
            Self::ForgottenMemory => ("forgotten-memory", 410, "Forgotten memory"),
            Self::BodyTooLong => ("body-too-long", 413, "Body too long"),
            Self::UnsupportedMediaType => ("unsupported-media-type", 415, "Unsupported encoding"),
            Self::UnknownHost => ("unknown-host", 421, "Unknown host"),
            Self::SessionInFuture => ("session-in-future", 422, "The session lies in the future"),
            Self::InvalidSettings => ("invalid-settings", 422, "Invalid settings"),
            Self::StampOutOfRange => ("stamp-out-of-range", 422, "Nothing is known of that time"),
            Self::NothingNear => ("nothing-near", 422, "No place is near"),
            Self::InvalidQuery => ("invalid-query", 422, "The request breaks a rule"),
            Self::Internal => ("internal", 500, "Fault of the service"),
            Self::StoreFailed => ("store-failed", 500, "The store has failed"),
            Self::Busy => ("busy", 503, "Too much is under way"),
            Self::Recovering => ("recovering", 503, "The space is loading"),
            Self::Moving => ("moving", 503, "The space is changing hands"),
            Self::OwnerLost => ("owner-lost", 502, "The owner of the space did not answer"),
            Self::SpaceStopped => ("space-stopped", 503, "The space is stopped"),
            Self::Closing => ("closing", 503, "The service is closing"),
            Self::NotReady => ("not-ready", 503, "The service is not ready"),
            Self::Timeout => ("timeout", 504, "The answer took too long"),
            Self::StoreFull => ("store-full", 507, "The store is full"),
        }
    }

    /// Its name; `/problems/` before it makes the problem's type.
    pub fn name(self) -> &'static str {
        self.row().0
    }

    /// Its status after RFC 9110.
    pub fn status(self) -> u16 {
        self.row().1
    }

    /// Its title, the same every time.
    pub fn title(self) -> &'static str {
        self.row().2
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::Kind;

    #[test]
    fn every_kind_has_a_name_and_a_title_of_its_own() {
        let names: BTreeSet<_> = Kind::ALL.map(Kind::name).into();
        let titles: BTreeSet<_> = Kind::ALL.map(Kind::title).into();
        assert_eq!(
            (names.len(), titles.len()),
            (Kind::ALL.len(), Kind::ALL.len())
        );
        assert!(Kind::ALL.is_sorted_by_key(|kind| kind.status()));
        let plain = |name: &str| name.chars().all(|c| c.is_ascii_lowercase() || c == '-');
        assert!(names.iter().all(|name| plain(name)), "{names:?}");
    }
    #[test]
    fn the_page_of_problems_has_the_same_table() {
        let page = include_str!("../../../docs/problems.md");
        let rows: Vec<_> = { page.lines() }
            .filter(|line| line.starts_with("| `/problems/"))
            .collect();
        assert_eq!(rows.len(), Kind::ALL.len());
        for kind in Kind::ALL {
            let row = format!("| `/problems/{}` | {} | ", kind.name(), kind.status());
            assert!(rows.iter().any(|line| line.starts_with(&row)), "{row}");
        }
    }
}
