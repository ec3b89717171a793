//! Lists whose items link to one another by their numbers in a slab.

use state::{NONE, Slab};

/// Takes an item out of a list; `follower` is the number after it. Only the item before it changes.
pub(super) fn unlink<T: Clone, const N: usize>(
    slab: &mut Slab<T, N>,
    head: &mut u32,
    gone: u32,
    follower: u32,
    revision: u64,
    next: impl Fn(&T) -> u32,
    set_next: impl Fn(&mut T, u32),
) {
    if *head == gone {
        *head = follower;
        return;
    }
    let mut number = *head;
    while number != NONE {
        let Some(after) = slab.get(number).map(&next) else {
            return;
        };
        if after == gone {
            if let Some(before) = slab.get_mut(number, revision) {
                set_next(before, follower);
            }
            return;
        }
        number = after;
    }
}
