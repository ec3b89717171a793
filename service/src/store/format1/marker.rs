//! By what a store of format 1 is known.

use std::path::Path;

/// File by which fjall recognises its directory.
pub(super) const MARKER: &str = "version";
/// Directory of fjall's keyspaces.
pub(super) const KEYSPACES: &str = "keyspaces";

/// Whether the directory holds a store of format 1.
pub(in crate::store) fn is_store(directory: &Path) -> bool {
    directory.join(MARKER).is_file() && directory.join(KEYSPACES).is_dir()
}
