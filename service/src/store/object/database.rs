//! The database: keys, batches, syncs, and what its errors mean.

use std::sync::{Arc, OnceLock};
use std::time::Duration;

use slatedb::config::{
    CompressionCodec, DbReaderOptions, FlushOptions, FlushType, ScanOptions, Settings,
};
use slatedb::object_store::path::Path;
use slatedb::{
    CloseReason, Db, DbIterator, DbReader, ErrorKind, IterationOrder, KeyValue, WriteBatch,
};

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

/// How often a reader looks for what has been written.
pub(super) const FOLLOW_INTERVAL: Duration = Duration::from_millis(100);

/// A database that this process owns until another one opens it, or that it only reads.
pub(super) struct Database {
    location: Location,
    runtime: Arc<Runtime>,
    handle: Handle,
    /// Epoch of its writer, which no other writer has.
    term: u64,
    /// The first failed write.
    failure: OnceLock<StoreError>,
}

enum Handle {
    Owner(Db),
    Reader(Box<DbReader>),
}

impl std::fmt::Debug for Database {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Database")
            .field("location", &self.location)
            .finish_non_exhaustive()
    }
}

impl Database {
    /// Opens the database below `path`, and creates it where there is none. With the term of the
    /// last owner that is known, it fails where there has been another one since.
    pub(super) fn open(
        location: &Location,
        runtime: &Arc<Runtime>,
        path: Path,
        last_term: Option<u64>,
    ) -> Result<Self, StoreError> {
        let mut builder = Db::builder(path, location.storage()).with_settings(settings());
        if let Some(last) = last_term {
            builder = builder.with_expected_epoch(last);
        }
        let db = runtime.wait(builder.build());
        let db = db.map_err(|error| fault(location, &error))?;
        // After a take-over the manifest has the epoch of the next writer. Whoever claims the place
        // of a known one has the epoch after its own.
        let term = last_term.map_or_else(|| db.manifest().writer_epoch(), |last| last + 1);
        Ok(Self {
            location: location.clone(),
            runtime: Arc::clone(runtime),
            handle: Handle::Owner(db),
            term,
            failure: OnceLock::new(),
        })
    }

    /// Reads the database below `path` as its owner writes it, and a moment later.
    pub(super) fn follow(
        location: &Location,
        runtime: &Arc<Runtime>,
        path: Path,
    ) -> Result<Self, StoreError> {
        let options = DbReaderOptions {
            manifest_poll_interval: FOLLOW_INTERVAL,
            ..DbReaderOptions::default()
        };
        let reader = DbReader::builder(path, location.storage()).with_options(options);
        let reader = runtime.wait(reader.build());
        let reader = reader.map_err(|error| fault(location, &error))?;
        let term = reader.manifest().writer_epoch();
        Ok(Self {
            location: location.clone(),
            runtime: Arc::clone(runtime),
            handle: Handle::Reader(Box::new(reader)),
            term,
            failure: OnceLock::new(),
        })
    }

    /// The database, to be written.
    fn owned(&self) -> Result<&Db, StoreError> {
        match &self.handle {
            Handle::Owner(db) => Ok(db),
            Handle::Reader(_) => {
                let what = format!("{} is only read here", self.location);
                Err(StoreError::Io(what))
            }
        }
    }

    /// Which owner of the database in a row this process is; of one that it reads, the owner that
    /// has written last.
    pub(super) fn term(&self) -> u64 {
        match &self.handle {
            Handle::Owner(_) => self.term,
            Handle::Reader(reader) => reader.manifest().writer_epoch(),
        }
    }

    /// Whether it may still be written, as far as it has noticed.
    pub(super) fn check_ownership(&self) -> Result<(), StoreError> {
        let Handle::Owner(db) = &self.handle else {
            return Ok(());
        };
        if db.status().close_reason == Some(CloseReason::Fenced) {
            return Err(self.noted(StoreError::Fenced(self.location.to_string())));
        }
        Ok(())
    }

    /// Number of the last durable write that a reader has seen; none of an owner.
    pub(super) fn followed_to(&self) -> Option<u64> {
        match &self.handle {
            Handle::Owner(_) => None,
            Handle::Reader(reader) => Some(reader.status().durable_seq),
        }
    }

    /// Closes the database: what is durable is there for the next owner. Once is enough.
    pub(super) fn close(&self) {
        let status = match &self.handle {
            Handle::Owner(db) => db.status(),
            Handle::Reader(reader) => reader.status(),
        };
        if status.close_reason.is_some() {
            return;
        }
        let closing = async {
            match &self.handle {
                Handle::Owner(db) => db.close().await,
                Handle::Reader(reader) => reader.close().await,
            }
        };
        let closing = async { tokio::time::timeout(CLOSE_TIMEOUT, closing).await };
        match self.runtime.wait(closing) {
            Ok(Ok(())) => {}
            Ok(Err(error)) => tracing::warn!(store = %self.location, %error, "close the store"),
            Err(_) => tracing::warn!(store = %self.location, "the storage does not answer"),
        }
    }

    /// The value of a key.
    pub(super) fn get(&self, key: impl AsRef<[u8]> + Send) -> Result<Option<Vec<u8>>, StoreError> {
        let found = self.runtime.wait(async {
            match &self.handle {
                Handle::Owner(db) => db.get(key).await,
                Handle::Reader(reader) => reader.get(key).await,
            }
        });
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
        let items = self.runtime.wait(async {
            match &self.handle {
                Handle::Owner(db) => db.scan_prefix_with_options(prefix, from.., &options).await,
                Handle::Reader(reader) => {
                    reader
                        .scan_prefix_with_options(prefix, from.., &options)
                        .await
                }
            }
        });
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
        let put = self.runtime.wait(self.owned()?.write(batch));
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
        let flush = self
            .owned()?
            .flush_with_options(FlushOptions { flush_type });
        let flushed = self.runtime.wait(flush);
        flushed.map_err(|error| self.failed(&error))
    }

    /// Notes a failed write: what of it is there is unknown, so it is the last one.
    fn failed(&self, error: &slatedb::Error) -> StoreError {
        self.noted(fault(&self.location, error))
    }

    fn noted(&self, error: StoreError) -> StoreError {
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
        let range = first..=last;
        let items = self.runtime.wait(async {
            match &self.handle {
                Handle::Owner(db) => db.scan_with_options(range, options).await,
                Handle::Reader(reader) => reader.scan_with_options(range, options).await,
            }
        });
        items.map_err(|error| fault(&self.location, &error))
    }
}

impl Drop for Database {
    fn drop(&mut self) {
        self.close();
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
