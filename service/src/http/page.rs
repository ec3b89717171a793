//! Pages of long lists.

use cogmap_proto::limits::{PAGE_ITEMS_DEFAULT, PAGE_ITEMS_MAX};

use super::problem::Problem;
use crate::decode::InvalidQuery;

/// Number of items that a query asks for.
pub(crate) fn limit(asked: Option<u32>) -> Result<usize, Problem> {
    let limit = asked.map_or(PAGE_ITEMS_DEFAULT, |limit| limit as usize);
    if (1..=PAGE_ITEMS_MAX).contains(&limit) {
        Ok(limit)
    } else {
        Err(InvalidQuery::Limit(limit).into())
    }
}

/// The number after `after`, where a page begins; none if nothing can come after it.
pub(crate) fn first(after: Option<u64>) -> Option<u32> {
    let first = after.map_or(Some(0), |after| after.checked_add(1))?;
    u32::try_from(first).ok()
}

/// Up to `limit` items, and the key of the last one if there are more.
pub(crate) fn cut<T, K>(
    items: impl Iterator<Item = T>,
    limit: usize,
    key: impl Fn(&T) -> K,
) -> (Vec<T>, Option<K>) {
    let mut page: Vec<T> = items.take(limit + 1).collect();
    let more = page.len() > limit;
    page.truncate(limit);
    let next = if more { page.last().map(key) } else { None };
    (page, next)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pages_join_to_the_whole_list() {
        for length in 0..8_u64 {
            let mut seen = Vec::new();
            let mut after = None;
            loop {
                let from = u64::from(first(after).expect("small"));
                let (page, next) = cut(from..length.max(from), 3, |item| *item);
                assert!(page.len() <= 3);
                seen.extend(page);
                after = next;
                if next.is_none() {
                    break;
                }
            }
            assert_eq!(seen, (0..length).collect::<Vec<_>>());
        }
    }

    #[test]
    fn nothing_comes_after_the_largest_number() {
        assert_eq!(first(Some(u64::MAX)), None);
        assert_eq!(first(Some(u64::from(u32::MAX))), None);
        assert_eq!(first(Some(u64::from(u32::MAX) - 1)), Some(u32::MAX));
    }

    #[test]
    fn limits_outside_the_range_are_refused() {
        assert!(limit(Some(0)).is_err());
        assert!(limit(Some(1001)).is_err());
        assert_eq!(
            limit(None).expect("the default is legal"),
            PAGE_ITEMS_DEFAULT
        );
        assert_eq!(limit(Some(1000)).expect("legal"), 1000);
    }
}
