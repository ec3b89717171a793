//! Where a store on object storage is, and whether that storage keeps its promises.

use std::sync::Arc;

use futures_util::StreamExt;
use futures_util::future::join_all;
use slatedb::object_store::local::LocalFileSystem;
use slatedb::object_store::path::Path;
use slatedb::object_store::{
    Error, ObjectStore, ObjectStoreExt, PutMode, PutOptions, PutPayload, PutResult, parse_url_opts,
};

use super::super::StoreError;

/// Those who try to create the same object in the probe.
const CLAIMANTS: u8 = 8;
/// What the variables of the environment begin with that configure a provider.
const PROVIDERS: [&str; 3] = ["aws_", "azure_", "google_"];

/// A bucket and a prefix in it.
#[derive(Clone)]
pub(super) struct Location {
    url: String,
    storage: Arc<dyn ObjectStore>,
    prefix: Path,
}

impl Location {
    /// The location that a URL names.
    pub(super) fn parse(url: &str) -> Result<Self, StoreError> {
        let refused = |reason: String| StoreError::Io(format!("{url}: {reason}"));
        let (storage, prefix): (Arc<dyn ObjectStore>, _) =
            if let Some(directory) = url.strip_prefix("file://") {
                if !directory.starts_with('/') {
                    return Err(refused("file:// takes an absolute path".to_owned()));
                }
                std::fs::create_dir_all(directory).map_err(|error| refused(error.to_string()))?;
                let storage = LocalFileSystem::new_with_prefix(directory);
                let storage = storage.map_err(|error| refused(error.to_string()))?;
                (Arc::new(storage.with_fsync(true)), Path::default())
            } else {
                let parsed = url.try_into();
                let parsed = parsed.map_err(|error| refused(format!("no URL: {error}")))?;
                let variables = std::env::vars().map(|(key, value)| (key.to_lowercase(), value));
                let variables = variables
                    .filter(|(key, _)| PROVIDERS.iter().any(|provider| key.starts_with(provider)));
                let found = parse_url_opts(&parsed, variables);
                let (storage, prefix) = found.map_err(|error| refused(error.to_string()))?;
                (Arc::from(storage), prefix)
            };
        Ok(Self {
            url: url.to_owned(),
            storage,
            prefix,
        })
    }

    /// The storage.
    pub(super) fn storage(&self) -> Arc<dyn ObjectStore> {
        Arc::clone(&self.storage)
    }

    /// The path of an object or of all below it, from parts that are names.
    pub(super) fn path<const N: usize>(&self, parts: [&str; N]) -> Path {
        { parts.into_iter() }.fold(self.prefix.clone(), Path::join)
    }

    /// The error of the storage.
    pub(super) fn away(&self, error: &dyn std::fmt::Display) -> StoreError {
        StoreError::Unreachable(format!("{self}: {error}"))
    }

    /// Whether nothing is there.
    pub(super) async fn is_empty(&self) -> Result<bool, StoreError> {
        let first = self.storage.list(Some(&self.prefix)).next().await;
        match first {
            None => Ok(true),
            Some(Ok(_)) => Ok(false),
            Some(Err(error)) => Err(self.away(&error)),
        }
    }

    /// Lets some create the same object at once. Where more than one may, two owners would
    /// overwrite each other's journal.
    pub(super) async fn probe(&self) -> Result<(), StoreError> {
        let now = std::time::SystemTime::UNIX_EPOCH
            .elapsed()
            .unwrap_or_default();
        let name = format!("probe-{}-{}", std::process::id(), now.as_nanos());
        let object = self.prefix.clone().join(name);
        let claims = (0..CLAIMANTS).map(|claimant| {
            let options = PutOptions::from(PutMode::Create);
            let payload = PutPayload::from(vec![claimant]);
            self.storage.put_opts(&object, payload, options)
        });
        let claims = join_all(claims).await;
        // It may not be there, and what is left of a probe disturbs nobody.
        let _ = self.storage.delete(&object).await;
        self.verdict(claims)
    }

    /// What the probe says of the storage.
    fn verdict(&self, claims: Vec<Result<PutResult, Error>>) -> Result<(), StoreError> {
        let won = claims.iter().filter(|claim| claim.is_ok()).count();
        let is_too_late = |error: &Error| {
            matches!(
                error,
                Error::AlreadyExists { .. } | Error::Precondition { .. }
            )
        };
        let mut failed = claims.into_iter().filter_map(Result::err);
        let failed = failed.find(|error| !is_too_late(error));
        match (won, failed) {
            (1, _) => Ok(()),
            (0, Some(error)) => Err(self.away(&error)),
            (won, _) => Err(StoreError::Io(format!(
                "{self}: {won} of {CLAIMANTS} could create the same object at once: this storage \
                 would let two services write one journal"
            ))),
        }
    }
}

impl std::fmt::Display for Location {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.url)
    }
}

impl std::fmt::Debug for Location {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:?}", self.url)
    }
}

#[cfg(test)]
mod tests {
    use slatedb::object_store::Extensions;

    use super::*;

    #[test]
    fn a_storage_that_lets_two_win_or_none_is_refused() {
        let directory = tempfile::tempdir().unwrap();
        let location = Location::parse(&format!("file://{}", directory.path().display())).unwrap();
        let won = || {
            Ok(PutResult {
                e_tag: None,
                version: None,
                extensions: Extensions::default(),
            })
        };
        let late = || {
            Err(Error::AlreadyExists {
                path: "probe".to_owned(),
                source: "it is there".into(),
            })
        };
        let away = || {
            Err(Error::Generic {
                store: "S3",
                source: "no route".into(),
            })
        };
        assert!(location.verdict(vec![late(), won(), late()]).is_ok());
        // Whoever got no answer may have been late.
        assert!(location.verdict(vec![won(), away(), late()]).is_ok());
        for careless in [vec![won(), won()], vec![late(), late()]] {
            let verdict = location.verdict(careless);
            assert!(matches!(&verdict, Err(StoreError::Io(text)) if text.contains("at once")));
        }
        let verdict = location.verdict(vec![away(), late(), away()]);
        assert!(
            matches!(&verdict, Err(StoreError::Unreachable(text)) if text.contains("no route"))
        );
    }
}
