//! The database: keys, batches, syncs, and what its errors mean.

use std::sync::OnceLock;
use std::time::Duration;

use slatedb::config::{CompressionCodec, FlushOptions, FlushType, ScanOptions, Settings};
use slatedb::{CloseReason, Db, DbIterator, ErrorKind, IterationOrder, KeyValue, WriteBatch};

use super::super::StoreError;
use super::location::Location;
use super::runtime::Runtime;

/// Bytes that may wait for the storage before writers wait, too.
const UNFLUSHED_BYTES_MAX: usize = 256 << 20;
/// Bytes that a scan reads ahead, and reads under way. Source: 503 MB/s instead of 51 on loopback.
const READ_AHEAD_BYTES: usize = 8 << 20;
const READS_MAX: usize = 4;
/// Keys of a batch when a space is deleted.
const BATCH_KEYS: usize = 10_000;
/// Longest wait for the storage when the store is closed. All that was acknowledged is there.
const CLOSE_TIMEOUT: Duration = Duration::from_secs(10);

/// A database that this process owns until another one opens it.
pub(super) struct Database {
    location: Location,
    runtime: Runtime,
    db: Db,
    /// The first failed write.
    failure: OnceLock<StoreError>,
}

impl std::fmt::Debug for Database {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Database")
            .field("location", &self.location)
            .finish_non_exhaustive()
    }
}

impl Database {
    /// Tries the storage, and opens the database there. Where there is none it is created, if so
    /// wanted.
    pub(super) fn open(url: &str, creates: bool) -> Result<Self, StoreError> {
        let runtime = Runtime::start()?;
        let location = Location::parse(url)?;
        let opening = async {
            if !creates && location.is_empty().await? {
                return Err(StoreError::Io(format!("there is no store at {location}")));
            }
            location.probe().await?;
            let db = Db::builder(location.prefix().clone(), location.storage())
                .with_settings(settings())
                .build()
                .await;
            db.map_err(|error| fault(&location, &error))
        };
        let db = runtime.wait(opening)?;
        Ok(Self {
            location,
            runtime,
            db,
            failure: OnceLock::new(),
        })
    }

    /// The value of a key.
    pub(super) fn get(&self, key: impl AsRef<[u8]> + Send) -> Result<Option<Vec<u8>>, StoreError> {
        let found = self.runtime.wait(self.db.get(key));
        let found = found.map_err(|error| fault(&self.location, &error))?;
        Ok(found.map(|value| value.to_vec()))
    }

    /// Passes all keys with a prefix to `take`, in order, without the prefix.
    pub(super) fn scan(
        &self,
        prefix: &[u8],
        mut take: impl FnMut(&[u8], &[u8]) -> Result<(), StoreError>,
    ) -> Result<(), StoreError> {
        let mut items = self.items(prefix, 0)?;
        while let Some(item) = self.next(&mut items)? {
            take(&item.key[prefix.len()..], &item.value)?;
        }
        Ok(())
    }

    /// The keys with a prefix, from the one that goes on with `from`.
    pub(super) fn items(&self, prefix: &[u8], from: u64) -> Result<DbIterator, StoreError> {
        let from = if from == 0 {
            Vec::new()
        } else {
            from.to_be_bytes().to_vec()
        };
        let options = scan_options();
        let items = self.db.scan_prefix_with_options(prefix, from.., &options);
        let items = self.runtime.wait(items);
        items.map_err(|error| fault(&self.location, &error))
    }

    /// The next of some keys.
    pub(super) fn next(&self, items: &mut DbIterator) -> Result<Option<KeyValue>, StoreError> {
        let item = self.runtime.wait(items.next());
        item.map_err(|error| fault(&self.location, &error))
    }

    /// Puts a batch, durable with the next sync.
    pub(super) fn put(&self, batch: WriteBatch) -> Result<(), StoreError> {
        self.refuse_if_failed()?;
        let put = self.runtime.wait(self.db.write(batch));
        put.map(|_| ()).map_err(|error| self.failed(&error))
    }

    /// Puts a batch and makes it durable.
    pub(super) fn commit(&self, batch: WriteBatch) -> Result<(), StoreError> {
        self.put(batch)?;
        self.flush(FlushType::Wal)
    }

    /// Makes durable all that was put before, and with `MemTable` writes tables, too.
    pub(super) fn flush(&self, flush_type: FlushType) -> Result<(), StoreError> {
        self.refuse_if_failed()?;
        let flush = self.db.flush_with_options(FlushOptions { flush_type });
        let flushed = self.runtime.wait(flush);
        flushed.map_err(|error| self.failed(&error))
    }

    /// Notes a failed write: what of it is there is unknown, so it is the last one.
    fn failed(&self, error: &slatedb::Error) -> StoreError {
        let error = fault(&self.location, error);
        let first = match &error {
            StoreError::Fenced(location) => StoreError::Fenced(location.clone()),
            other => StoreError::Broken(other.to_string()),
        };
        self.failure.get_or_init(|| first);
        error
    }

    fn refuse_if_failed(&self) -> Result<(), StoreError> {
        match self.failure.get() {
            None => Ok(()),
            Some(StoreError::Fenced(location)) => Err(StoreError::Fenced(location.clone())),
            Some(first) => Err(StoreError::Broken(first.to_string())),
        }
    }

    /// Removes all keys with a prefix.
    pub(super) fn remove_below(&self, prefix: &[u8]) -> Result<(), StoreError> {
        let mut doomed = Vec::new();
        self.scan(prefix, |key, _| {
            doomed.push([prefix, key].concat());
            Ok(())
        })?;
        for doomed in doomed.chunks(BATCH_KEYS) {
            let mut batch = WriteBatch::new();
            for key in doomed {
                batch.delete(key);
            }
            self.put(batch)?;
        }
        Ok(())
    }

    /// The error that something in the store cannot be read.
    pub(super) fn corrupt(&self, what: &str) -> StoreError {
        StoreError::Corrupt(format!("{}: {what} cannot be read", self.location))
    }

    /// The last of the keys from `first` to `last`.
    pub(super) fn last_of(
        &self,
        first: Vec<u8>,
        last: Vec<u8>,
    ) -> Result<Option<KeyValue>, StoreError> {
        let backwards = ScanOptions {
            order: IterationOrder::Descending,
            ..ScanOptions::default()
        };
        let mut items = self.range(first, last, &backwards)?;
        self.next(&mut items)
    }

    /// The keys from `first` to `last`.
    pub(super) fn between(&self, first: Vec<u8>, last: Vec<u8>) -> Result<DbIterator, StoreError> {
        self.range(first, last, &scan_options())
    }

    fn range(
        &self,
        first: Vec<u8>,
        last: Vec<u8>,
        options: &ScanOptions,
    ) -> Result<DbIterator, StoreError> {
        let items = self
            .runtime
            .wait(self.db.scan_with_options(first..=last, options));
        items.map_err(|error| fault(&self.location, &error))
    }
}

impl Drop for Database {
    fn drop(&mut self) {
        let closing = async { tokio::time::timeout(CLOSE_TIMEOUT, self.db.close()).await };
        match self.runtime.wait(closing) {
            Ok(Ok(())) => {}
            Ok(Err(error)) => tracing::warn!(store = %self.location, %error, "close the store"),
            Err(_) => tracing::warn!(store = %self.location, "the storage does not answer"),
        }
    }
}

fn settings() -> Settings {
    Settings {
        // The committer says when.
        flush_interval: None,
        max_unflushed_bytes: UNFLUSHED_BYTES_MAX,
        compression_codec: Some(CompressionCodec::Lz4),
        ..Settings::default()
    }
}

fn scan_options() -> ScanOptions {
    ScanOptions {
        read_ahead_bytes: READ_AHEAD_BYTES,
        max_fetch_tasks: READS_MAX,
        ..ScanOptions::default()
    }
}

/// What an error of the database means to its caller.
fn fault(location: &Location, error: &slatedb::Error) -> StoreError {
    let text = || format!("{location}: {error}");
    match error.kind() {
        ErrorKind::Closed(CloseReason::Fenced) => StoreError::Fenced(location.to_string()),
        ErrorKind::Unavailable => StoreError::Unreachable(text()),
        ErrorKind::Data => StoreError::Corrupt(text()),
        _ => StoreError::Io(text()),
    }
}
