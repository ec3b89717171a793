//! Which of a channel's memories is a place's.

use std::sync::Arc;

use crate::place::PlaceId;

/// Places per page.
const PAGE: usize = 256;
/// No slot has this number: a channel has fewer memories.
const NONE: u32 = u32::MAX;

/// A page: the slot of each of its places.
type Page = Arc<[u32; PAGE]>;

/// From places to slots; a page is there once one of its places has a slot. A clone shares all pages.
#[derive(Clone, Debug, Default)]
pub(super) struct Slots(Arc<Vec<Option<Page>>>);

impl Slots {
    /// The slot of a place.
    pub(super) fn get(&self, place: PlaceId) -> Option<usize> {
        let place = place.0 as usize;
        let page = self.0.get(place / PAGE)?.as_ref()?;
        let slot = page[place % PAGE];
        (slot != NONE).then_some(slot as usize)
    }

    /// Gives a place a slot.
    pub(super) fn set(&mut self, place: PlaceId, slot: u32) {
        let place = place.0 as usize;
        let pages = Arc::make_mut(&mut self.0);
        if pages.len() <= place / PAGE {
            pages.resize(place / PAGE + 1, None);
        }
        let page = pages[place / PAGE].get_or_insert_with(|| Arc::new([NONE; PAGE]));
        Arc::make_mut(page)[place % PAGE] = slot;
    }
}
