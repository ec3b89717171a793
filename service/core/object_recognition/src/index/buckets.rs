//! Buckets: items by the number of their bucket, in one list.

/// Items in the order of their buckets.
#[derive(Clone, Debug)]
pub(crate) struct Buckets<T> {
    /// Start of each bucket's items; one more at the end.
    pub(crate) starts: Vec<u32>,
    pub(crate) items: Vec<T>,
}

impl<T: Copy + Default> Buckets<T> {
    /// Of items with the numbers of their buckets, which are below `count`. It passes over the
    /// items twice (counting sort); those of one bucket keep their order.
    pub(crate) fn new(count: usize, items: impl Iterator<Item = (usize, T)> + Clone) -> Self {
        let mut starts = vec![0; count + 1];
        for (bucket, _) in items.clone() {
            starts[bucket + 1] += 1;
        }
        for bucket in 0..count {
            starts[bucket + 1] += starts[bucket];
        }
        let mut ends = starts.clone();
        let mut sorted = vec![T::default(); starts[count] as usize];
        for (bucket, item) in items {
            let end = &mut ends[bucket];
            sorted[*end as usize] = item;
            *end += 1;
        }
        Self {
            starts,
            items: sorted,
        }
    }

    /// The items of a bucket.
    pub(crate) fn get(&self, bucket: usize) -> &[T] {
        &self.items[self.starts[bucket] as usize..self.starts[bucket + 1] as usize]
    }
}
