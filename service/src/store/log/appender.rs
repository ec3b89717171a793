//! The end of a journal, where blocks are appended.

use std::fs::File;
use std::io::{self, IoSlice};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::super::SpaceNumber;
use super::super::local::files;
use super::frame::{Header, payload_check};
use super::mark::{Extent, Mark};
use super::segment::{file_name, first_block};
use super::survey::Survey;

/// Length at which a segment is closed and the next one begun \[bytes\]. A damage of the file
/// system takes one of them at most, and a backup copies whole ones.
const SEGMENT_BYTES: u64 = 64 << 20;

/// A journal that is open for writing. One thread appends; another one syncs beside it.
#[derive(Debug)]
pub(in crate::store) struct SpaceLog {
    space: SpaceNumber,
    directory: PathBuf,
    end: Mutex<End>,
    mark: Mutex<Mark>,
    /// Whether the mark has been written since it was last synced.
    mark_written: AtomicBool,
}

#[derive(Debug)]
struct End {
    segment: Option<(Arc<File>, u64)>,
    appended: Extent,
    durable: Extent,
    /// Files with blocks that no sync has covered, in the order of the blocks.
    unsynced: Vec<Arc<File>>,
    /// Whether a file was created since the directory was last synced.
    grown: bool,
}

/// What a sync has to make durable.
#[derive(Debug)]
pub(in crate::store) struct Pending {
    files: Vec<Arc<File>>,
    grown: bool,
    through: Extent,
}

impl SpaceLog {
    /// Opens a journal at the end that a survey has found, and cuts off its torn tail.
    pub(in crate::store) fn open(
        directory: &Path,
        space: SpaceNumber,
        survey: &Survey,
    ) -> io::Result<Self> {
        cut(directory, survey)?;
        let mut segment = None;
        if let Some((name, length)) = &survey.last {
            // What survived the process is the truth from here on, and has to survive a power cut
            // too. What was acknowledged does.
            for name in unsynced(directory, survey.acknowledged)? {
                files::sync_all(&File::open(directory.join(name))?)?;
            }
            files::sync_directory(directory)?;
            let file = files::open_to_append(&directory.join(name))?;
            segment = Some((Arc::new(file), *length));
        }
        let mut mark = Mark::open(directory, space)?;
        mark.write(survey.end)?;
        let end = End {
            segment,
            appended: survey.end,
            durable: survey.end,
            unsynced: Vec::new(),
            grown: false,
        };
        Ok(Self {
            space,
            directory: directory.to_owned(),
            end: Mutex::new(end),
            mark: Mutex::new(mark),
            mark_written: AtomicBool::new(true),
        })
    }

    /// What has been appended.
    pub(in crate::store) fn appended(&self) -> Extent {
        self.end().appended
    }

    /// Appends a block with its number of samples.
    pub(in crate::store) fn append(
        &self,
        block: u64,
        samples: u64,
        bytes: &[u8],
    ) -> io::Result<()> {
        let mut end = self.end();
        if block != end.appended.blocks {
            let expected = end.appended.blocks;
            let detail = format!("block {block} is appended where block {expected} is next");
            return Err(io::Error::other(detail));
        }
        let length = u32::try_from(bytes.len()).map_err(io::Error::other)?;
        let header = Header {
            length,
            block,
            samples,
            total: end.appended.samples + samples,
            durable: end.durable,
            payload_check: payload_check(block, bytes),
        };
        let frame_bytes = header.frame_bytes();
        let has_room = |(_, length): &(Arc<File>, u64)| length + frame_bytes <= SEGMENT_BYTES;
        if !end.segment.as_ref().is_some_and(has_room) {
            let path = self.directory.join(file_name(block));
            match files::open_to_append(&path) {
                Ok(file) => (end.segment, end.grown) = (Some((Arc::new(file), 0)), true),
                // A segment that grows longer is better than none, where descriptors have run out.
                Err(_) if end.segment.is_some() => {}
                Err(error) => return Err(error),
            }
        }
        let End {
            segment: Some((file, length)),
            appended,
            unsynced,
            ..
        } = &mut *end
        else {
            return Err(io::Error::other("the journal has no segment"));
        };
        let head = header.encode(self.space);
        files::write_all(file, &mut [IoSlice::new(&head), IoSlice::new(bytes)])?;
        *length += frame_bytes;
        appended.blocks += 1;
        appended.samples = header.total;
        if !unsynced.last().is_some_and(|last| Arc::ptr_eq(last, file)) {
            unsynced.push(Arc::clone(file));
        }
        Ok(())
    }

    /// What has been appended since the latest sync, if anything.
    pub(in crate::store) fn pending(&self) -> Option<Pending> {
        let mut end = self.end();
        if end.unsynced.is_empty() {
            return None;
        }
        Some(Pending {
            files: std::mem::take(&mut end.unsynced),
            grown: std::mem::take(&mut end.grown),
            through: end.appended,
        })
    }

    /// Makes durable what is pending, and then says so in the mark.
    pub(in crate::store) fn sync(&self, pending: &Pending) -> io::Result<()> {
        for file in &pending.files {
            files::sync_data(file)?;
        }
        if pending.grown {
            files::sync_directory(&self.directory)?;
        }
        self.end().durable = pending.through;
        self.mark().write(pending.through)?;
        self.mark_written.store(true, Ordering::Release);
        Ok(())
    }

    /// Syncs the mark itself, if it was written since.
    pub(in crate::store) fn sync_mark(&self) -> io::Result<()> {
        if !self.mark_written.swap(false, Ordering::AcqRel) {
            return Ok(());
        }
        // Not under the lock: the committer must not wait for this sync.
        let file = self.mark().file()?;
        files::sync_data(&file)
    }

    fn end(&self) -> MutexGuard<'_, End> {
        self.end.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn mark(&self) -> MutexGuard<'_, Mark> {
        self.mark.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Names of the segments that may hold blocks which no sync has covered: of those behind
/// `acknowledged`.
fn unsynced(directory: &Path, acknowledged: Extent) -> io::Result<Vec<String>> {
    let names = files::names(directory)?.into_iter();
    let segments = names.filter_map(|name| Some((first_block(&name)?, name)));
    let mut segments: Vec<_> = segments.collect();
    let later = segments.partition_point(|(first, _)| *first <= acknowledged.blocks);
    segments.drain(..later.saturating_sub(1));
    Ok(segments.into_iter().map(|(_, name)| name).collect())
}

/// Cuts off what stands after the last whole block: a torn tail, and a segment that was begun and
/// never written to, which would hide later blocks of the one before it.
fn cut(directory: &Path, survey: &Survey) -> io::Result<()> {
    let (last, length) = match &survey.last {
        Some((name, length)) => (Some(name.as_str()), *length),
        None => (None, 0),
    };
    for name in files::names(directory)? {
        if first_block(&name).is_some() && last.is_none_or(|last| &*name > last) {
            files::remove(&directory.join(name))?;
        }
    }
    if let Some(name) = last {
        let file = File::options().write(true).open(directory.join(name))?;
        if file.metadata()?.len() > length {
            file.set_len(length)?;
            files::sync_all(&file)?;
        }
    }
    files::sync_directory(directory)
}
