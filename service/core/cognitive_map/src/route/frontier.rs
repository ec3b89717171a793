//! The frontier of a search: the waypoints from which it may go on, the most promising first.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::collections::binary_heap::PeekMut;

/// Waypoints by the lower bounds of the routes through them, and equal ones by their numbers.
///
/// One is held beside the heap: where bounds are good the next waypoint is often a neighbour of the
/// last one, and the heap stays as it is.
#[derive(Debug, Default)]
pub(super) struct Frontier {
    held: Option<Key>,
    heap: BinaryHeap<Reverse<Key>>,
}

/// A lower bound in the upper 64 bits of 96, a waypoint's number below: one comparison orders both.
type Key = u128;

impl Frontier {
    /// Adds a waypoint and the lower bound of a route through it.
    pub(super) fn push(&mut self, least: u64, at: u32) {
        let key = u128::from(least) << 32 | u128::from(at);
        match self.held {
            None => self.held = Some(key),
            Some(held) if key < held => {
                self.heap.push(Reverse(held));
                self.held = Some(key);
            }
            Some(_) => self.heap.push(Reverse(key)),
        }
    }

    /// Takes the first one.
    pub(super) fn pop(&mut self) -> Option<(u64, u32)> {
        let first = match (self.held.take(), self.heap.peek_mut()) {
            (Some(held), Some(mut top)) if top.0 < held => std::mem::replace(&mut top.0, held),
            (Some(held), _) => held,
            (None, Some(top)) => PeekMut::pop(top).0,
            (None, None) => return None,
        };
        let at = first & u128::from(u32::MAX);
        #[expect(
            clippy::cast_possible_truncation,
            reason = "64 and 32 bits were put together"
        )]
        let parts = ((first >> 32) as u64, at as u32);
        Some(parts)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_taken_is_always_the_first() {
        // A simple generator of numbers, of which many are equal.
        let mut state = 7_u64;
        let mut next = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            state >> 33
        };
        let (mut frontier, mut known) = (Frontier::default(), Vec::<(u64, u32)>::new());
        for _ in 0..20_000 {
            if next() % 5 < 2 {
                known.sort_unstable_by(|a, b| b.cmp(a));
                assert_eq!(frontier.pop(), known.pop());
            } else {
                let least = [0, u64::MAX, next() % 100][(next() % 3) as usize];
                let at = [0, u32::MAX, 5][(next() % 3) as usize];
                frontier.push(least, at);
                known.push((least, at));
            }
            if next() % 1000 == 0 {
                while let Some(first) = frontier.pop() {
                    known.sort_unstable_by(|a, b| b.cmp(a));
                    assert_eq!(Some(first), known.pop());
                }
                assert!(known.is_empty(), "each is taken once");
            }
        }
    }
}
