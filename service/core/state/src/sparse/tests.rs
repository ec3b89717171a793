//! A vector with gaps against an ordered map.

use super::*;
use crate::Digest;
use proptest::prelude::*;
use std::collections::BTreeMap;

type Numbers = SparseVec<u64, 4>;

fn digest(numbers: &Numbers) -> Digest {
    let mut out = StateWriter::default();
    numbers.write_digests(&mut out);
    out.digest()
}

fn contents(numbers: &Numbers) -> BTreeMap<usize, u64> {
    numbers.iter().map(|(index, item)| (index, *item)).collect()
}

fn pages(numbers: &Numbers, since: u64) -> Vec<(usize, Vec<u8>)> {
    let pages = numbers.changed_pages(since);
    let written = pages.map(|(page, items)| {
        let mut out = StateWriter::default();
        items.write(&mut out);
        (page, out.into_bytes())
    });
    written.collect()
}

#[derive(Clone, Copy, Debug)]
enum Step {
    Push,
    Change(usize),
    Remove(usize),
    RemoveBelow(usize),
}

fn step() -> impl Strategy<Value = Step> {
    prop_oneof![
        6 => Just(Step::Push),
        2 => (0usize..600).prop_map(Step::Change),
        2 => (0usize..600).prop_map(Step::Remove),
        1 => (0usize..600).prop_map(Step::RemoveBelow),
    ]
}

proptest! {
    /// Against an ordered map. The snapshot taken on the way stays as it was, and what was stored
    /// page by page, put over one another, is always the whole.
    #[test]
    fn behaves_like_a_map(
        filled in prop::sample::select(vec![0u64, 3, 250, 520]),
        steps in prop::collection::vec(step(), 0..60),
        snapshot_at in 0u64..60,
    ) {
        let mut plain = BTreeMap::new();
        let mut sparse = Numbers::default();
        for number in 0..filled {
            plain.insert(sparse.push(number, 1), number);
        }
        let mut stored: BTreeMap<_, _> = pages(&sparse, 0).into_iter().collect();
        let mut snapshot = None;
        for (step, revision) in steps.into_iter().zip(2u64..) {
            if snapshot_at + 2 == revision {
                snapshot = Some((plain.clone(), sparse.clone(), digest(&sparse)));
            }
            match step {
                Step::Push => {
                    let index = sparse.next_index();
                    prop_assert_eq!(sparse.push(revision, revision), index);
                    prop_assert_eq!(plain.insert(index, revision), None);
                }
                Step::Change(index) => {
                    let item = sparse.get_mut(index, revision);
                    prop_assert_eq!(item.as_deref(), plain.get(&index));
                    if let Some(item) = item {
                        *item += 1000;
                        *plain.entry(index).or_default() += 1000;
                    }
                }
                Step::Remove(index) => {
                    prop_assert_eq!(sparse.remove(index, revision), plain.remove(&index));
                }
                Step::RemoveBelow(end) => {
                    for index in 0..end {
                        sparse.remove(index, revision);
                    }
                    plain.retain(|index, _| *index >= end);
                }
            }
            prop_assert_eq!(contents(&sparse), plain.clone());
            prop_assert_eq!(sparse.len(), plain.len());
            stored.extend(pages(&sparse, revision - 1));
        }
        for start in (0..sparse.next_index() + 5).step_by(3) {
            let rest: Vec<_> = sparse.iter_from(start).map(|(index, _)| index).collect();
            prop_assert_eq!(rest, plain.range(start..).map(|(i, _)| *i).collect::<Vec<_>>());
            prop_assert_eq!(sparse.get(start), plain.get(&start));
        }
        if let Some((plain, sparse, before)) = snapshot {
            prop_assert_eq!(contents(&sparse), plain);
            prop_assert_eq!(digest(&sparse), before);
        }
        let mut restored = Numbers::default();
        for (page, bytes) in stored.iter().filter(|(_, bytes)| !bytes.is_empty()) {
            restored.restore_page(*page, bytes, 99).unwrap();
        }
        prop_assert_eq!(contents(&restored), contents(&sparse));
        prop_assert_eq!(digest(&restored), digest(&sparse));
    }
}

#[test]
fn what_is_gone_takes_next_to_no_memory() {
    let mut numbers = SparseVec::<[u64; 16], 64>::default();
    for index in 0..1_000_000 {
        numbers.push([index; 16], index);
        if let Some(old) = usize::try_from(index).unwrap().checked_sub(500) {
            numbers.remove(old, index);
        }
    }
    assert_eq!(numbers.len(), 500);
    let bytes = numbers.bytes();
    assert!(bytes < 500 * 128 + 20_000, "{bytes}");
}

#[test]
fn damaged_pages_are_refused() {
    let restore = |bytes: &[u8]| Numbers::default().restore_page(0, bytes, 1);
    let page = |mask: u64| [&mask.to_le_bytes()[..], &[7; 8]].concat();
    assert_eq!(restore(&page(0b100)), Ok(()));
    assert_eq!(restore(&page(0)), Err(CorruptState::Invalid), "empty");
    assert_eq!(restore(&page(0b1_0000)), Err(CorruptState::Invalid));
    assert_eq!(restore(&page(0b11)), Err(CorruptState::Truncated));
    assert_eq!(restore(&[1, 0]), Err(CorruptState::Truncated));
}
