//! File descriptors: raises the limit, and shares out what there are, so that connections never use
//! up those of the store.

use crate::store;

/// For listeners, the runtimes, logs and whatever else the process has open.
const OTHERS: usize = 128;
/// Fewest connections of each kind, however low the limit is.
const LEAST: usize = 16;

/// How many descriptors each part may have open.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Shares {
    /// Connections of HTTP.
    pub(crate) http: usize,
    /// Sessions of Zenoh.
    pub(crate) sessions: usize,
    /// Connections that are not yet sessions of Zenoh.
    pub(crate) handshakes: usize,
}

/// Raises the soft limit of open files to the hard one; returns the limit that holds then.
pub(crate) fn raise_limit() -> usize {
    match rlimit::increase_nofile_limit(u64::MAX) {
        Ok(limit) => usize::try_from(limit).unwrap_or(usize::MAX),
        Err(error) => {
            tracing::warn!(%error, "raise the limit of open files");
            let known = rlimit::Resource::NOFILE.get_soft();
            known.map_or(1024, |limit| usize::try_from(limit).unwrap_or(usize::MAX))
        }
    }
}

/// Shares out what a limit leaves beside the store: each part gets what it wants, or as much as any
/// other that wants more than there is.
pub(crate) fn share_out(limit: usize, wanted: Shares) -> Shares {
    let mut left = limit.saturating_sub(store::OPEN_FILES_MAX + OTHERS);
    let mut shares = wanted;
    let mut parts = [
        &mut shares.handshakes,
        &mut shares.sessions,
        &mut shares.http,
    ];
    parts.sort_by_key(|part| **part);
    for (before, part) in parts.into_iter().enumerate() {
        *part = (*part).min(left / (3 - before)).max(LEAST);
        left = left.saturating_sub(*part);
    }
    shares
}

#[cfg(test)]
mod tests {
    use super::*;

    const WANTED: Shares = Shares {
        http: 4096,
        sessions: 1000,
        handshakes: 64,
    };

    #[test]
    fn a_high_limit_leaves_everything_as_it_was_asked_for() {
        assert_eq!(share_out(1 << 20, WANTED), WANTED);
    }

    #[test]
    fn a_low_limit_is_shared_and_the_store_keeps_its_part() {
        let shares = share_out(1024, WANTED);
        let all = shares.http + shares.sessions + shares.handshakes;
        assert!(all + store::OPEN_FILES_MAX + OTHERS <= 1024, "{shares:?}");
        assert_eq!(shares.handshakes, 64);
        assert!(shares.sessions >= 90 && shares.http >= 90, "{shares:?}");
    }
}
