//! A model of the disk below a directory, for tests: it makes calls fail, and says what a power
//! cut would
//! leave.
//!
//! The model knows of each file the bytes, and of each directory the names, as they were at the
//! latest sync.
//! A power cut leaves that much, and of what came later anything: nothing, all, or some pages of
//! the bytes and
//! some of the names. Renaming is one step, as every file system with a journal has it.

use std::collections::{BTreeMap, BTreeSet};
use std::ffi::OsString;
use std::fs::{self, File};
use std::io::{self, ErrorKind, IoSlice, Write};
use std::ops::Range;
use std::os::fd::AsRawFd;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};

use tempfile::TempDir;

/// Bytes that reach a disk whole or not at all.
const SECTOR: usize = 512;

/// A file or directory, by its number in the file system.
type Inode = u64;

/// What a power cut does to what no sync has covered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Cut {
    /// All of it is lost.
    Lost,
    /// All of it is there, as after a kill.
    Kept,
    /// Each page and each name is lost or there, as the number has it.
    Torn(u64),
}

/// A call that fails.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Failing {
    /// A write, without any effect.
    Write(ErrorKind),
    /// A write that takes some of the bytes, and the rest never.
    ShortWrite,
    /// A sync of a file or a directory.
    Sync,
}

/// What a power cut has left.
#[derive(Debug)]
pub(crate) struct Image {
    /// The directory as it was.
    pub(crate) directory: TempDir,
    /// What had been promised by then.
    pub(crate) promised: u64,
    /// How it was cut, and before which sync.
    pub(crate) cut: (Cut, usize),
}

/// The disk below a directory.
#[derive(Debug)]
pub(crate) struct DiskModel(Arc<Mutex<State>>);

#[derive(Debug)]
struct State {
    root: PathBuf,
    files: BTreeMap<Inode, Vec<u8>>,
    directories: BTreeMap<Inode, Names>,
    /// A call that is to fail, after so many of its kind.
    failing: Option<(Failing, usize)>,
    unreadable: Vec<(Inode, Range<u64>)>,
    promised: u64,
    syncs: usize,
    /// How power cuts are tried before each sync.
    cuts: Vec<Cut>,
    images: Vec<Image>,
}

/// What is in a directory, by name, and whether it is a directory itself.
type Names = BTreeMap<OsString, (Inode, bool)>;

static MODELS: Mutex<Vec<Weak<Mutex<State>>>> = Mutex::new(Vec::new());

impl DiskModel {
    /// Models the disk below `root`, on which all is durable so far.
    pub(crate) fn of(root: &Path) -> Self {
        let root = fs::canonicalize(root).unwrap();
        let mut state = State {
            files: BTreeMap::new(),
            directories: BTreeMap::new(),
            failing: None,
            unreadable: Vec::new(),
            promised: 0,
            syncs: 0,
            cuts: Vec::new(),
            images: Vec::new(),
            root,
        };
        for (inode, path) in state.present() {
            state.note(inode, &path);
        }
        let state = Arc::new(Mutex::new(state));
        models().push(Arc::downgrade(&state));
        Self(state)
    }

    /// Tries a power cut before each sync from now on.
    pub(crate) fn cut_before_each_sync(&self, cuts: &[Cut]) {
        lock(&self.0).cuts = cuts.to_vec();
    }

    /// Notes that something has been promised to somebody.
    pub(crate) fn promise(&self, promised: u64) {
        lock(&self.0).promised = promised;
    }

    /// Lets a call fail, after `passed` of its kind.
    pub(crate) fn fail(&self, failing: Failing, passed: usize) {
        lock(&self.0).failing = Some((failing, passed));
    }

    /// Whether the call that was to fail has not come yet.
    pub(crate) fn is_failing(&self) -> bool {
        lock(&self.0).failing.is_some()
    }

    /// Lets reads of a stretch of a file fail.
    pub(crate) fn make_unreadable(&self, file: &Path, bytes: Range<u64>) {
        let inode = fs::metadata(file).unwrap().ino();
        lock(&self.0).unreadable.push((inode, bytes));
    }

    /// What a power cut leaves now.
    pub(crate) fn cut(&self, cut: Cut) -> TempDir {
        lock(&self.0).image(cut)
    }

    /// What the power cuts so far have left.
    pub(crate) fn take_images(&self) -> Vec<Image> {
        std::mem::take(&mut lock(&self.0).images)
    }
}

impl State {
    /// All that is there now.
    fn present(&self) -> BTreeMap<Inode, PathBuf> {
        let mut found = BTreeMap::new();
        let mut open = vec![self.root.clone()];
        while let Some(path) = open.pop() {
            let Ok(metadata) = fs::symlink_metadata(&path) else {
                continue; // it has gone meanwhile
            };
            if metadata.is_dir() {
                open.extend(listing(&path).into_keys().map(|name| path.join(name)));
            }
            found.insert(metadata.ino(), path);
        }
        found
    }

    /// Notes that a file or a directory is durable as it is.
    fn note(&mut self, inode: Inode, path: &Path) {
        if !path.is_dir() {
            self.files.insert(inode, fs::read(path).unwrap_or_default());
            return;
        }
        let names = listing(path);
        // What has come from another directory is not there any more.
        let came: BTreeSet<_> = names.values().map(|(inode, _)| *inode).collect();
        let present = self.present();
        for (other, durable) in &mut self.directories {
            let now = present.get(other).map(|path| listing(path));
            let now = now.unwrap_or_default();
            durable.retain(|name, (child, _)| {
                *other == inode || !came.contains(child) || now.contains_key(name)
            });
        }
        self.directories.insert(inode, names);
    }

    fn image(&self, cut: Cut) -> TempDir {
        let to = tempfile::tempdir().unwrap();
        let present = self.present();
        let root = fs::metadata(&self.root).unwrap().ino();
        self.build(root, to.path(), &present, cut);
        to
    }

    fn build(&self, inode: Inode, to: &Path, present: &BTreeMap<Inode, PathBuf>, cut: Cut) {
        let durable = self.directories.get(&inode).cloned().unwrap_or_default();
        let now = present.get(&inode).map(|path| listing(path));
        let now = now.unwrap_or_default();
        let names: BTreeSet<_> = durable.keys().chain(now.keys()).collect();
        for name in names {
            let (before, after) = (durable.get(name), now.get(name));
            // A step that moves something is done or not, in both places.
            let moved = after.or(before).map_or(0, |(inode, _)| *inode);
            let chosen = if is_kept(cut, moved) { after } else { before };
            let Some((inode, is_directory)) = chosen else {
                continue;
            };
            let to = to.join(name);
            if *is_directory {
                fs::create_dir(&to).unwrap();
                self.build(*inode, &to, present, cut);
            } else {
                let now = present.get(inode).and_then(|path| fs::read(path).ok());
                fs::write(to, self.bytes(*inode, now, cut)).unwrap();
            }
        }
    }

    /// Bytes of a file that holds `now` now, if it is still there.
    fn bytes(&self, inode: Inode, now: Option<Vec<u8>>, cut: Cut) -> Vec<u8> {
        let durable = self.files.get(&inode).cloned().unwrap_or_default();
        let Some(now) = now else { return durable };
        let number = match cut {
            Cut::Lost => return durable,
            Cut::Kept => return now,
            Cut::Torn(number) => number,
        };
        let mut random = inode.wrapping_add(number.wrapping_mul(0x9e37_79b9_7f4a_7c15));
        let mut bytes = durable.clone();
        let more = now.len().saturating_sub(durable.len());
        let grown = usize::try_from(next(&mut random)).unwrap() % (more + 1);
        // The file may have been made shorter, or longer without its bytes.
        let is_cut = now.len() < durable.len() && next(&mut random).is_multiple_of(2);
        bytes.resize(
            if is_cut {
                now.len()
            } else {
                durable.len() + grown
            },
            0,
        );
        for (at, page) in bytes.chunks_mut(SECTOR).enumerate() {
            let now = now.get(at * SECTOR..).unwrap_or_default();
            if next(&mut random).is_multiple_of(2) && !now.is_empty() {
                let length = page.len().min(now.len());
                page[..length].copy_from_slice(&now[..length]);
            }
        }
        bytes
    }

    /// Whether a call of a kind is the one that fails.
    fn fails(&mut self, is_kind: impl Fn(Failing) -> bool) -> Option<Failing> {
        let (failing, passed) = self.failing?;
        if !is_kind(failing) {
            return None;
        }
        self.failing = passed.checked_sub(1).map(|passed| (failing, passed));
        (passed == 0).then_some(failing)
    }
}

/// A file has been created, or opened.
pub(super) fn created(file: &File) {
    with(file, |state, inode, _| {
        // The number of a file that is gone may have come back.
        if file.metadata().unwrap().len() == 0 {
            state.files.insert(inode, Vec::new());
            state.unreadable.retain(|(of, _)| *of != inode);
        }
    });
}

/// Writes some of the slices.
pub(super) fn write(mut file: &File, slices: &[IoSlice<'_>]) -> io::Result<usize> {
    let is_write = |failing| failing != Failing::Sync;
    match with(file, |state, _, _| state.fails(is_write)).flatten() {
        None => file.write_vectored(slices),
        Some(Failing::ShortWrite) => {
            let all: Vec<u8> = slices
                .iter()
                .flat_map(|slice| slice.iter().copied())
                .collect();
            let written = file.write(&all[..all.len() / 2])?;
            let full = Failing::Write(ErrorKind::StorageFull);
            with(file, |state, _, _| state.failing = Some((full, 0)));
            Ok(written)
        }
        Some(Failing::Write(kind)) => Err(kind.into()),
        Some(Failing::Sync) => Err(io::Error::other("not a write")),
    }
}

/// A stretch of a file is about to be read.
pub(crate) fn before_read(file: &File, at: u64, count: u64) -> io::Result<()> {
    let is_bad = with(file, |state, inode, _| {
        let bad = state.unreadable.iter();
        bad.clone()
            .any(|(of, bytes)| *of == inode && bytes.start < at + count && at < bytes.end)
    });
    match is_bad {
        Some(true) => Err(io::Error::from_raw_os_error(5)),
        _ => Ok(()),
    }
}

/// A file or directory is about to be synced.
pub(super) fn before_sync(file: &File) -> io::Result<()> {
    let failed = with(file, |state, _, path| {
        state.syncs += 1;
        for cut in state.cuts.clone() {
            let image = Image {
                directory: state.image(cut),
                promised: state.promised,
                cut: (cut, state.syncs),
            };
            state.images.push(image);
        }
        // The mark is synced now and then, beside what a test does.
        let is_mark = path.ends_with("durable");
        state.fails(|failing| failing == Failing::Sync && !is_mark)
    });
    match failed.flatten() {
        Some(_) => Err(io::Error::from_raw_os_error(5)),
        None => Ok(()),
    }
}

/// A file or directory has been synced.
pub(super) fn synced(file: &File) {
    with(file, State::note);
}

/// Runs `run` on the model of the disk that a file is on, if there is one, with the file's number
/// and path.
fn with<T>(file: &File, run: impl FnOnce(&mut State, Inode, &Path) -> T) -> Option<T> {
    let known: Vec<_> = models().iter().filter_map(Weak::upgrade).collect();
    if known.is_empty() {
        return None;
    }
    let path = fs::read_link(format!("/proc/self/fd/{}", file.as_raw_fd())).ok()?;
    let inode = file.metadata().ok()?.ino();
    let model = known
        .into_iter()
        .find(|state| path.starts_with(&lock(state).root))?;
    let mut state = lock(&model);
    Some(run(&mut state, inode, &path))
}

fn listing(directory: &Path) -> Names {
    let entries = fs::read_dir(directory).into_iter().flatten().flatten();
    let named = entries.filter_map(|entry| {
        let metadata = fs::symlink_metadata(entry.path()).ok()?;
        Some((entry.file_name(), (metadata.ino(), metadata.is_dir())))
    });
    named.collect()
}

fn is_kept(cut: Cut, inode: Inode) -> bool {
    match cut {
        Cut::Lost => false,
        Cut::Kept => true,
        Cut::Torn(number) => {
            let mut random = inode.wrapping_mul(31).wrapping_add(number);
            next(&mut random).is_multiple_of(2)
        }
    }
}

/// The next of a sequence of numbers that look like chance.
fn next(state: &mut u64) -> u64 {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let mixed = (*state ^ (*state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb) >> 33
}

fn models() -> MutexGuard<'static, Vec<Weak<Mutex<State>>>> {
    let mut models = MODELS.lock().unwrap_or_else(PoisonError::into_inner);
    models.retain(|state| state.strong_count() > 0);
    models
}

fn lock(state: &Mutex<State>) -> MutexGuard<'_, State> {
    state.lock().unwrap_or_else(PoisonError::into_inner)
}
