//! What the process takes of its machine: memory, descriptors, disk.

use std::fs;
use std::io;
use std::os::unix::fs::MetadataExt;
use std::path::Path;
use std::str::FromStr;

use metrics::gauge;

use super::{PROCESS_FDS, PROCESS_FDS_MAX, PROCESS_MEMORY, STORE_BYTES};

/// Unit in which the system counts the blocks of a file \[bytes\].
const BLOCK_BYTES: u64 = 512;
/// Label of what lies in the store's directory itself.
const TOP: &str = "top";

/// Records memory and descriptors, as the system's books have them now. Where the system keeps no
/// such books, nothing is recorded.
pub(super) fn record() {
    if let Some(bytes) = resident_bytes() {
        gauge!(PROCESS_MEMORY).set(bytes as f64);
    }
    if let Ok(open) = fs::read_dir("/proc/self/fd") {
        // One of them reads this list.
        gauge!(PROCESS_FDS).set(open.count().saturating_sub(1) as f64);
    }
    if let Ok(limits) = fs::read_to_string("/proc/self/limits")
        && let Some(limit) = field::<f64>(&limits, "Max open files")
    {
        gauge!(PROCESS_FDS_MAX).set(limit);
    }
}

/// Memory of the process that is in use \[bytes\], where the system keeps books of it.
pub fn resident_bytes() -> Option<u64> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let kibibytes: u64 = field(&status, "VmRSS:")?;
    Some(kibibytes * 1024)
}

/// Records what the store takes on its disk, each directory in it by itself.
pub(super) fn record_store(directory: &Path) {
    let Ok(entries) = fs::read_dir(directory) else {
        return; // whoever reads and writes there says so
    };
    let mut top = 0;
    for entry in entries.flatten() {
        let bytes = bytes_on_disk(&entry.path()).unwrap_or(0);
        if entry.path().is_dir() {
            let part = entry.file_name().to_string_lossy().into_owned();
            gauge!(STORE_BYTES, "part" => part).set(bytes as f64);
        } else {
            top += bytes;
        }
    }
    gauge!(STORE_BYTES, "part" => TOP).set(top as f64);
}

/// What a file, or a directory with all below it, takes on the disk. Files that go meanwhile take
/// nothing.
fn bytes_on_disk(path: &Path) -> io::Result<u64> {
    let metadata = fs::symlink_metadata(path)?;
    let mut bytes = metadata.blocks() * BLOCK_BYTES;
    if metadata.is_dir() {
        for entry in fs::read_dir(path)? {
            bytes += bytes_on_disk(&entry?.path()).unwrap_or(0);
        }
    }
    Ok(bytes)
}

/// The first number after a name at the beginning of a line.
fn field<T: FromStr>(text: &str, name: &str) -> Option<T> {
    let line = text.lines().find_map(|line| line.strip_prefix(name))?;
    line.split_whitespace().next()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_directory_takes_what_is_below_it() {
        let directory = tempfile::tempdir().expect("a temporary directory");
        let below = directory.path().join("journal/1");
        fs::create_dir_all(&below).expect("created");
        let before = bytes_on_disk(directory.path()).expect("readable");
        fs::write(below.join("segment"), vec![1; 100_000]).expect("written");
        let bytes = bytes_on_disk(directory.path()).expect("readable") - before;
        assert!((100_000..200_000).contains(&bytes), "{bytes}");
    }

    #[test]
    fn numbers_are_found_by_their_names() {
        let status = "Name:\tcogmap\nVmRSS:\t   1234 kB\n";
        assert_eq!(field(status, "VmRSS:"), Some(1234));
        let limits = "Max open files            1024                 524288               files\n";
        assert_eq!(field(limits, "Max open files"), Some(1024.0_f64));
        assert_eq!(field::<f64>(limits, "Max open files unlimited"), None);
    }
}
