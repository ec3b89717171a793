//! Copies of stores, from any end of the port to any other.

use xxhash_rust::xxh3::Xxh3;

use super::{Extent, Journal, SpaceNumber, StoreError, StoredSpace, WholeStore};

/// A space that was copied.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CopiedSpace {
    /// Its name.
    pub name: String,
    /// Its blocks, and the samples in them.
    pub extent: Extent,
    /// Of all its blocks, read on both ends. Equal blocks fold to equal maps.
    pub check: u64,
}

/// Copies the journals of all spaces of one store into another one, and reads there what has come.
/// `samples_in` counts the samples of a block. A copy that is cut short leaves whole spaces only.
///
/// # Errors
/// The name of a space is taken there or lost here, a block cannot be read, or it is another one
/// when it is read there.
pub fn copy(
    from: &WholeStore,
    to: &WholeStore,
    samples_in: fn(&[u8]) -> u64,
) -> Result<Vec<CopiedSpace>, StoreError> {
    // Before anything is written.
    for (_, shard) in from.iter() {
        for space in shard.spaces()? {
            let taken = to.of(&space.name).spaces()?;
            if taken.iter().any(|other| other.name == space.name) {
                return Err(StoreError::SpaceExists(space.name));
            }
        }
    }
    let mut copied = Vec::new();
    for (_, shard) in from.iter() {
        for space in shard.spaces()? {
            let to = to.of(&space.name);
            copied.push(copy_space(&**shard, to, space, samples_in)?);
        }
    }
    copied.sort_by(|a: &CopiedSpace, b| a.name.cmp(&b.name));
    Ok(copied)
}

/// Copies a space from the shard where it is to the one where it belongs.
fn copy_space<T: Journal + ?Sized>(
    from: &T,
    to: &T,
    space: StoredSpace,
    samples_in: fn(&[u8]) -> u64,
) -> Result<CopiedSpace, StoreError> {
    let name = space.name;
    let Some(settings) = space.settings else {
        let what = format!("the settings of space {name:?} are lost");
        return Err(StoreError::Corrupt(what));
    };
    // What a crash has cut off the end of the journal is not copied.
    from.open_journal(space.number)?;
    let mut draft = to.draft(&name, &settings)?;
    let (mut extent, mut check) = (Extent::default(), Xxh3::new());
    for block in from.journal(space.number, 0) {
        let (_, bytes) = block?;
        let samples = samples_in(&bytes);
        draft.append(samples, &bytes)?;
        extent.blocks += 1;
        extent.samples += samples;
        take(&mut check, &bytes);
    }
    let number = draft.finish()?;
    let check = check.digest();
    if check_of(to, number)? != check {
        let what = format!("the copy of space {name:?} is not what was written");
        return Err(StoreError::Corrupt(what));
    }
    Ok(CopiedSpace {
        name,
        extent,
        check,
    })
}

/// The check of all blocks of a space.
fn check_of<T: Journal + ?Sized>(journal: &T, space: SpaceNumber) -> Result<u64, StoreError> {
    journal.open_journal(space)?;
    let mut check = Xxh3::new();
    for block in journal.journal(space, 0) {
        take(&mut check, &block?.1);
    }
    Ok(check.digest())
}

/// Adds a block, so that no two sequences of blocks give the same bytes.
fn take(check: &mut Xxh3, block: &[u8]) {
    check.update(&(block.len() as u64).to_le_bytes());
    check.update(block);
}
