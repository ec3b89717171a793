//! Records: small files that say what a store and its spaces are, each kept twice.
//!
//! ```text
//! record  = magic "CGMR", version: u8, check: u64 of the rest, length: u32, the rest
//!
//! format      format of the store: u32
//! next_space  number that the next space gets: u32
//! space       number: u32, number that it replaces: u32 or 0xffffffff, length of the name: u32,
//!             name, settings
//! ```
//!
//! All numbers are little-endian. A damaged copy is made anew from the other one.

use std::io::ErrorKind;
use std::path::Path;

use xxhash_rust::xxh3::xxh3_64;

use super::super::{SpaceNumber, StoreError, StoredSpace};
use super::files;

/// File that makes a directory a store.
pub(in crate::store) const FORMAT: &str = "format";
/// File with the number of the next space.
pub(in crate::store) const NEXT_SPACE: &str = "next_space";
/// File with the name and settings of a space, in its directory.
pub(in crate::store) const SPACE: &str = "space";

/// Ending of the second copy.
const COPY: &str = ".copy";
const MAGIC: [u8; 4] = *b"CGMR";
const VERSION: u8 = 1;
/// Bytes before the contents: magic, version, check, length.
const HEAD_BYTES: usize = 17;
/// In the place of a number: none.
const NO_SPACE: u32 = u32::MAX;

/// What a record's file holds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(in crate::store) enum Found {
    /// The contents.
    Contents(Vec<u8>),
    /// There is no such file.
    Nothing,
    /// Neither copy can be read.
    Damaged,
}

/// Writes a record durably, in the place of another one or of none.
pub(in crate::store) fn write(
    directory: &Path,
    name: &str,
    contents: &[u8],
) -> Result<(), StoreError> {
    let bytes = encode(contents)?;
    for name in [format!("{name}{COPY}"), name.to_owned()] {
        let path = directory.join(name);
        files::replace(&path, &bytes).map_err(|error| StoreError::on_disk(&error, &path))?;
    }
    Ok(())
}

/// Reads a record. Changes nothing.
pub(in crate::store) fn read(directory: &Path, name: &str) -> Result<Found, StoreError> {
    let mut found = Found::Nothing;
    for name in [name.to_owned(), format!("{name}{COPY}")] {
        let path = directory.join(name);
        match files::read(&path) {
            Ok(bytes) => match decode(&bytes) {
                Some(contents) => return Ok(Found::Contents(contents)),
                None => found = Found::Damaged,
            },
            Err(error) if error.kind() == ErrorKind::NotFound => {}
            Err(error) if files::is_unreadable(&error) => found = Found::Damaged,
            Err(error) => return Err(StoreError::on_disk(&error, &path)),
        }
    }
    Ok(found)
}

/// Makes a damaged or missing copy anew; says whether there was one.
pub(in crate::store) fn heal(directory: &Path, name: &str) -> Result<bool, StoreError> {
    let copies = [name.to_owned(), format!("{name}{COPY}")].map(|name| {
        let bytes = files::read(&directory.join(name)).ok();
        bytes.and_then(|bytes| decode(&bytes))
    });
    match copies {
        [Some(contents), None] | [None, Some(contents)] => {
            write(directory, name, &contents)?;
            Ok(true)
        }
        _ => Ok(false),
    }
}

/// Contents that are one number.
pub(in crate::store) fn number(contents: &[u8]) -> Option<u32> {
    Some(u32::from_le_bytes(contents.try_into().ok()?))
}

/// What a space's record says.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(in crate::store) struct SpaceRecord {
    pub(in crate::store) space: StoredSpace,
    /// The space of the same name in whose place it stands, once that is moved away.
    pub(in crate::store) replaces: Option<SpaceNumber>,
}

impl SpaceRecord {
    /// Contents of the record.
    pub(in crate::store) fn encode(&self) -> Result<Vec<u8>, StoreError> {
        let StoredSpace {
            number,
            name,
            settings,
        } = &self.space;
        let too_long = |_| StoreError::Io("the name of the space is too long".to_owned());
        let name_len = u32::try_from(name.len()).map_err(too_long)?;
        let replaces = self.replaces.map_or(NO_SPACE, |space| space.0);
        let mut contents = Vec::new();
        for field in [number.0, replaces, name_len] {
            contents.extend(field.to_le_bytes());
        }
        contents.extend(name.as_bytes());
        contents.extend(settings.as_deref().unwrap_or_default());
        Ok(contents)
    }

    /// The record of these contents, if they make sense.
    pub(in crate::store) fn decode(contents: &[u8]) -> Option<Self> {
        let (number, rest) = contents.split_first_chunk()?;
        let (replaces, rest) = rest.split_first_chunk()?;
        let (name_len, rest) = rest.split_first_chunk()?;
        let (name, settings) = rest.split_at_checked(u32::from_le_bytes(*name_len) as usize)?;
        let replaces = Some(u32::from_le_bytes(*replaces)).filter(|number| *number != NO_SPACE);
        Some(Self {
            space: StoredSpace {
                number: SpaceNumber(u32::from_le_bytes(*number)),
                name: std::str::from_utf8(name).ok()?.to_owned(),
                settings: Some(settings.to_vec()),
            },
            replaces: replaces.map(SpaceNumber),
        })
    }
}

fn encode(contents: &[u8]) -> Result<Vec<u8>, StoreError> {
    let too_long = |_| StoreError::Io("a record is too long".to_owned());
    let length = u32::try_from(contents.len()).map_err(too_long)?;
    let mut bytes = Vec::with_capacity(HEAD_BYTES + contents.len());
    bytes.extend(MAGIC);
    bytes.push(VERSION);
    bytes.extend(xxh3_64(contents).to_le_bytes());
    bytes.extend(length.to_le_bytes());
    bytes.extend(contents);
    Ok(bytes)
}

fn decode(bytes: &[u8]) -> Option<Vec<u8>> {
    let (_, contents) = bytes.split_at_checked(HEAD_BYTES)?;
    // A record has one encoding, so comparing with it checks every field.
    let same = encode(contents).is_ok_and(|encoded| encoded == bytes);
    same.then(|| contents.to_vec())
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::super::disk_model::DiskModel;
    use super::*;

    #[test]
    fn a_copy_that_the_disk_does_not_read_is_made_anew_from_the_other_one() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path();
        for unreadable in ["space", "space.copy"] {
            write(path, SPACE, b"contents").unwrap();
            let model = DiskModel::of(path);
            model.make_unreadable(&path.join(unreadable), 0..1);
            let whole = Found::Contents(b"contents".to_vec());
            assert_eq!(read(path, SPACE).unwrap(), whole, "{unreadable}");
            assert!(heal(path, SPACE).unwrap());
            assert!(!heal(path, SPACE).unwrap());
            for name in ["space", "space.copy"] {
                model.make_unreadable(&path.join(name), 0..1);
            }
            assert_eq!(read(path, SPACE).unwrap(), Found::Damaged);
        }
    }

    #[test]
    fn one_damaged_copy_is_healed_and_two_are_told() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path();
        assert_eq!(read(path, FORMAT).unwrap(), Found::Nothing);
        write(path, FORMAT, b"contents").unwrap();
        let whole = Found::Contents(b"contents".to_vec());
        let damage = |name: &str, at: usize| {
            let mut bytes = fs::read(path.join(name)).unwrap();
            bytes[at] ^= 4;
            fs::write(path.join(name), bytes).unwrap();
        };
        for at in 0..HEAD_BYTES + 8 {
            for name in ["format", "format.copy"] {
                damage(name, at);
                assert_eq!(read(path, FORMAT).unwrap(), whole);
                assert!(heal(path, FORMAT).unwrap());
                assert!(!heal(path, FORMAT).unwrap());
            }
        }
        damage("format", 20);
        damage("format.copy", 3);
        assert_eq!(read(path, FORMAT).unwrap(), Found::Damaged);
        assert!(!heal(path, FORMAT).unwrap());
    }

    #[test]
    fn a_space_comes_back_whatever_its_name() {
        for name in ["", "a/b", "L\u{fc}beck", "deleted/0"] {
            let record = SpaceRecord {
                space: StoredSpace {
                    number: SpaceNumber(9),
                    name: name.to_owned(),
                    settings: Some(vec![1, 2]),
                },
                replaces: (name.is_empty()).then_some(SpaceNumber(3)),
            };
            let contents = record.encode().unwrap();
            assert_eq!(SpaceRecord::decode(&contents), Some(record));
        }
        for nonsense in [&[][..], &[1; 11], &[9; 12]] {
            assert_eq!(SpaceRecord::decode(nonsense), None);
        }
    }
}
