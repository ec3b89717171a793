//! What waits, a lane for each agent, and whose turn it is.
//!
//! Lanes with something in them take turns, each with as many bytes a turn as any other (deficit round
//! robin, Shreedhar & Varghese 1995). A lane may hold as much as is free in the whole queue (dynamic
//! thresholds, Choudhury & Hahne 1998): one that fills up alone stops at half of the room, and whoever
//! comes next always finds some.

use std::collections::{HashMap, VecDeque};

use cogmap_proto::Codec;

use super::frames::{Frames, Head};
use super::{Load, NotQueued};
use crate::engine::message::Call;

/// Bytes of a turn: some 250 samples of motion.
const TURN_BYTES: usize = 16 << 10;
/// What a message counts beside its bytes, for the room of its head.
pub(super) const HEAD_BYTES: usize = 64;
/// Most lanes that are kept. Names come from the network: when so many have something in them, the
/// messages of further names share one lane.
const LANES_MAX: usize = 4096;
/// The lane of further names, and of calls that are of no agent.
const SHARED: usize = 0;
/// A lane whose buffer has grown beyond this gives it back when it is empty.
const KEPT_BYTES: usize = 4 << 10;

/// The lanes.
#[derive(Debug)]
pub(super) struct Lanes {
    lanes: Vec<Lane>,
    by_name: HashMap<Box<str>, usize>,
    /// Lanes with something in them, in the order of their turns.
    turns: VecDeque<usize>,
    /// Where an empty lane is looked for next.
    hand: usize,
    /// Most lanes; smaller in tests.
    lanes_max: usize,
}

#[derive(Debug, Default)]
struct Lane {
    name: Box<str>,
    items: VecDeque<Item>,
    /// Names and payloads of its encoded messages, one behind the other.
    bytes: VecDeque<u8>,
    load: Load,
    /// Bytes that it may still take in this turn and those before.
    credit: usize,
}

#[derive(Debug)]
enum Item {
    Encoded(Head),
    Call(Box<Call>, usize),
}

impl Default for Lanes {
    fn default() -> Self {
        Self {
            lanes: vec![Lane::default()],
            by_name: HashMap::new(),
            turns: VecDeque::new(),
            hand: 0,
            lanes_max: LANES_MAX,
        }
    }
}

impl Lanes {
    /// Whether nothing waits.
    pub(super) fn is_empty(&self) -> bool {
        self.turns.is_empty()
    }

    /// The lane of an agent, if it has room for one more message of so many bytes where `free` is left
    /// of the whole.
    pub(super) fn lane_for(
        &mut self,
        agent: &str,
        bytes: usize,
        free: Load,
    ) -> Result<usize, NotQueued> {
        let lane = self.lane_of(agent);
        let load = self.lanes[lane].load;
        if load.messages + 1 > free.messages || load.bytes + bytes > free.bytes {
            return Err(NotQueued::LaneFull);
        }
        Ok(lane)
    }

    /// Queues a message as it came.
    pub(super) fn push(&mut self, lane: usize, agent: &str, codec: Codec, payload: &[u8]) {
        let head = Head {
            codec,
            agent_len: agent.len(),
            payload_len: payload.len(),
        };
        let bytes = &mut self.lanes[lane].bytes;
        bytes.extend(agent.as_bytes());
        bytes.extend(payload);
        self.push_item(lane, Item::Encoded(head));
    }

    /// Queues a request of so many bytes.
    pub(super) fn push_call(&mut self, lane: usize, call: Call, bytes: usize) {
        self.push_item(lane, Item::Call(Box::new(call), bytes));
    }

    fn push_item(&mut self, lane: usize, item: Item) {
        let into = &mut self.lanes[lane];
        if into.items.is_empty() {
            self.turns.push_back(lane);
        }
        into.load.add(item.bytes());
        into.items.push_back(item);
    }

    /// Moves messages to `frames` and `calls`, lane by lane, until some `bytes` have been moved or
    /// nothing waits. The order of a lane stays, but calls come before what is in `frames`; so a turn
    /// ends at a call that follows a message.
    pub(super) fn take(&mut self, frames: &mut Frames, calls: &mut VecDeque<Call>, bytes: usize) {
        let mut taken = 0;
        while taken < bytes
            && let Some(&turn) = self.turns.front()
        {
            let lane = &mut self.lanes[turn];
            lane.credit += TURN_BYTES;
            let mut messages = 0;
            let mut blocked = false;
            while let Some(item) = lane.items.front() {
                let size = item.bytes();
                blocked = messages > 0 && matches!(item, Item::Call(..));
                if size > lane.credit || blocked {
                    break;
                }
                lane.credit -= size;
                taken += size;
                lane.load.remove(size);
                match lane.items.pop_front() {
                    Some(Item::Encoded(head)) => {
                        frames.move_from(&mut lane.bytes, head);
                        messages += 1;
                    }
                    Some(Item::Call(call, _)) => calls.push_back(*call),
                    None => {}
                }
            }
            self.turns.pop_front();
            if lane.items.is_empty() {
                lane.rest();
            } else {
                self.turns.push_back(turn);
            }
            if blocked {
                // Its messages have to be handled first.
                self.lanes[turn].credit = 0;
                break;
            }
        }
    }

    fn lane_of(&mut self, agent: &str) -> usize {
        if let Some(&lane) = self.by_name.get(agent) {
            return lane;
        }
        if agent.is_empty() {
            return SHARED;
        }
        let lane = if self.lanes.len() < self.lanes_max {
            self.lanes.push(Lane::default());
            self.lanes.len() - 1
        } else {
            match self.empty_lane() {
                Some(lane) => lane,
                None => return SHARED,
            }
        };
        self.by_name.remove(&*self.lanes[lane].name);
        self.lanes[lane].name = agent.into();
        self.by_name.insert(agent.into(), lane);
        lane
    }

    /// A lane with nothing in it, the hand's next one.
    fn empty_lane(&mut self) -> Option<usize> {
        let own = self.lanes.len() - 1;
        if self.turns.len() > own {
            return None;
        }
        for _ in 0..own {
            self.hand = self.hand % own + 1;
            if self.lanes[self.hand].items.is_empty() {
                return Some(self.hand);
            }
        }
        None
    }
}

impl Lane {
    /// What an empty lane keeps: its name, and a small buffer.
    fn rest(&mut self) {
        self.credit = 0;
        if self.bytes.capacity() > KEPT_BYTES {
            self.bytes = VecDeque::new();
            self.items = VecDeque::new();
        }
    }
}

impl Item {
    fn bytes(&self) -> usize {
        HEAD_BYTES
            + match self {
                Self::Encoded(head) => head.agent_len + head.payload_len,
                Self::Call(_, bytes) => *bytes,
            }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROOMY: Load = Load {
        messages: usize::MAX,
        bytes: usize::MAX,
    };

    fn push(lanes: &mut Lanes, agent: &str, payload: &[u8]) {
        let lane = lanes.lane_for(agent, payload.len(), ROOMY);
        lanes.push(lane.expect("there is room"), agent, Codec::Cbor, payload);
    }

    /// Agents of the messages that are taken, in order.
    fn take(lanes: &mut Lanes, bytes: usize) -> Vec<String> {
        let (mut frames, mut calls, mut agents) = (Frames::default(), VecDeque::new(), Vec::new());
        lanes.take(&mut frames, &mut calls, bytes);
        while let Some((agent, _, _)) = frames.next() {
            agents.push(agent.to_owned());
        }
        agents
    }

    #[test]
    fn who_sends_much_waits_for_who_sends_little() {
        let mut lanes = Lanes::default();
        for _ in 0..10_000 {
            push(&mut lanes, "flood", &[0; 100]);
        }
        push(&mut lanes, "honest", &[0; 100]);
        let taken = take(&mut lanes, 2 * TURN_BYTES);
        let before = taken.iter().position(|agent| agent == "honest");
        assert!(
            before.is_some_and(|before| before <= TURN_BYTES / 100),
            "{before:?}"
        );
    }

    #[test]
    fn turns_are_equal_in_bytes_whatever_the_size_of_messages() {
        let mut lanes = Lanes::default();
        for _ in 0..2000 {
            push(&mut lanes, "small", &[0; 100]);
        }
        for _ in 0..8 {
            push(&mut lanes, "large", &[0; 40_000]);
        }
        let taken = take(&mut lanes, 300_000);
        let of = |name: &str| taken.iter().filter(|agent| *agent == name).count();
        let (small, large) = (of("small") * (100 + HEAD_BYTES), of("large") * 40_000);
        assert!(small.abs_diff(large) < 3 * 40_000, "{small} {large}");
        assert!(large > 0);
    }

    #[test]
    fn names_of_the_network_take_bounded_room() {
        let mut lanes = Lanes {
            lanes_max: 8,
            ..Lanes::default()
        };
        for name in 0..1000 {
            push(&mut lanes, &format!("one-{name}"), b"x");
            take(&mut lanes, 1000);
        }
        assert!(lanes.lanes.len() <= 8 && lanes.by_name.len() <= 8);
        // With every lane in use, further names share one, and nothing is mixed up.
        for name in 0..20 {
            push(&mut lanes, &format!("busy-{name:02}"), b"x");
        }
        let mut taken = take(&mut lanes, 1 << 20);
        taken.sort();
        let sent: Vec<_> = (0..20).map(|name| format!("busy-{name:02}")).collect();
        assert_eq!(taken, sent);
        assert!(lanes.is_empty());
    }
}
