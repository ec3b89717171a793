//! What a search has reached, by waypoint.

/// Waypoints of a page. Source: two lines of the processor's cache.
const PAGE: usize = 16;

/// Pages for which there is room from the first. Source: 16 KiB.
const PAGES: usize = 128;

/// Costs by waypoint, in pages that are made once something in them is reached: a search takes
/// memory for what it looks at, and four bytes for each 16 waypoints of the map.
pub(super) struct Reached {
    /// For each page its number plus one, or 0.
    table: Vec<u32>,
    /// Of each waypoint twice the cost from the start, plus two, and plus one once it was gone on
    /// from; 0 where no way has been found yet.
    pages: Vec<[u64; PAGE]>,
}

impl Reached {
    /// Room for a number of waypoints, none of which is reached.
    pub(super) fn new(numbers: usize) -> Self {
        Self {
            table: vec![0; numbers.div_ceil(PAGE)],
            pages: Vec::with_capacity(PAGES),
        }
    }

    /// Cost to a waypoint, as far as it is known.
    pub(super) fn cost(&self, at: u32) -> Option<u64> {
        let page = self.table.get(at as usize / PAGE)?.checked_sub(1)?;
        (self.pages[page as usize][at as usize % PAGE] >> 1).checked_sub(1)
    }

    /// Notes that a waypoint is reached at a cost, where that is less than was known; answers
    /// whether it is.
    pub(super) fn reach(&mut self, at: u32, cost: u64) -> bool {
        let entry = self.entry(at);
        let new = (cost + 1) << 1;
        let is_cheaper = *entry == 0 || new < (*entry & !1);
        if is_cheaper {
            *entry = new;
        }
        is_cheaper
    }

    /// Goes on from a waypoint that was reached: its cost, unless one has gone on from it.
    pub(super) fn visit(&mut self, at: u32) -> Option<u64> {
        let entry = self.entry(at);
        if *entry & 1 == 1 {
            return None;
        }
        *entry |= 1;
        (*entry >> 1).checked_sub(1)
    }

    /// The waypoints that were reached, by number.
    pub(super) fn numbers(&self) -> impl Iterator<Item = u32> {
        let pages = (0..).step_by(PAGE).zip(&self.table);
        let numbers = pages.filter(|(_, page)| **page > 0);
        let numbers = numbers.flat_map(|(first, _): (u32, _)| (first..).take(PAGE));
        numbers.filter(|number| self.cost(*number).is_some())
    }

    fn entry(&mut self, at: u32) -> &mut u64 {
        let page = &mut self.table[at as usize / PAGE];
        if *page == 0 {
            self.pages.push([0; PAGE]);
            *page = u32::try_from(self.pages.len()).expect("waypoints have 32-bit numbers");
        }
        &mut self.pages[*page as usize - 1][at as usize % PAGE]
    }
}
