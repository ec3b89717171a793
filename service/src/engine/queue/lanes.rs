//! What waits, a lane for each agent, and in which order it is taken.
//!
//! Messages are taken in the order in which they came, as long as each agent has only a few
//! waiting. What an agent sends beyond that waits in its lane, and comes into the order bit by bit,
//! as what it has there is taken: so those who send much take turns, and who sends little waits for
//! a turn of each of them at most. A lane may hold as much as is free in the whole queue (dynamic
//! thresholds, Choudhury & Hahne 1998): one that fills up alone stops at half of the room, and
//! whoever comes next always finds some.

use std::collections::{HashMap, VecDeque};

use cogmap_proto::Codec;

use super::frames::{Frames, Head};
use super::{Load, NotQueued};
use crate::engine::message::Call;

/// Bytes that an agent may have waiting before it has to take turns: some 4000 samples of motion.
const FEW_BYTES: usize = 256 << 10;
/// Bytes of a turn: some 250 samples of motion.
const TURN_BYTES: usize = 16 << 10;
/// What a message counts beside its bytes, for the room of its head.
pub(super) const HEAD_BYTES: usize = 64;
/// Most lanes that are kept. Names come from the network: when so many have something in them, the
/// messages of further names share one lane.
const LANES_MAX: usize = 4096;
/// The lane of further names, and of calls that are of no agent.
const SHARED: usize = 0;
/// A lane whose buffers have grown beyond this gives them back when it is empty.
const KEPT_BYTES: usize = 4 << 10;

/// The lanes.
#[derive(Debug)]
pub(super) struct Lanes {
    all: Vec<Lane>,
    by_name: HashMap<Box<str>, usize>,
    /// Whose first message is taken next: a lane for each message that has come into the order.
    order: VecDeque<usize>,
    /// Where an empty lane is looked for next.
    hand: usize,
    /// Most lanes; smaller in tests.
    most: usize,
}

#[derive(Debug, Default)]
struct Lane {
    name: Box<str>,
    items: VecDeque<Item>,
    /// Names and payloads of its encoded messages, one behind the other.
    bytes: VecDeque<u8>,
    load: Load,
    /// Those of its messages that are in the order, its first ones.
    ordered: Load,
}

#[derive(Debug)]
enum Item {
    Encoded(Head),
    Call(Box<Call>, usize),
}

impl Default for Lanes {
    fn default() -> Self {
        Self {
            all: vec![Lane::default()],
            by_name: HashMap::new(),
            order: VecDeque::new(),
            hand: 0,
            most: LANES_MAX,
        }
    }
}

impl Lanes {
    /// Whether nothing waits.
    pub(super) fn is_empty(&self) -> bool {
        self.order.is_empty()
    }

    /// The lane of an agent, if it has room for one more message of so many bytes where `free` is
    /// left of the whole.
    pub(super) fn lane_for(
        &mut self,
        agent: &str,
        bytes: usize,
        free: Load,
    ) -> Result<usize, NotQueued> {
        let lane = self.lane_of(agent);
        let load = self.all[lane].load;
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
        let bytes = &mut self.all[lane].bytes;
        bytes.extend(agent.as_bytes());
        bytes.extend(payload);
        self.push_item(lane, Item::Encoded(head));
    }

    /// Queues a request of so many bytes.
    pub(super) fn push_call(&mut self, lane: usize, call: Call, bytes: usize) {
        self.push_item(lane, Item::Call(Box::new(call), bytes));
    }

    fn push_item(&mut self, lane: usize, item: Item) {
        let into = &mut self.all[lane];
        let size = item.bytes();
        let takes_turns = into.ordered.messages < into.items.len();
        into.items.push_back(item);
        into.load.add(size);
        if !takes_turns && (into.ordered.bytes + size <= FEW_BYTES || into.items.len() == 1) {
            into.ordered.add(size);
            self.order.push_back(lane);
        }
    }

    /// Moves messages to `frames` and `calls` until some `bytes` have been moved or nothing waits.
    /// Calls are handled before what is in `frames`, so one that comes after such a message ends
    /// it.
    pub(super) fn take(&mut self, frames: &mut Frames, calls: &mut VecDeque<Call>, bytes: usize) {
        let mut taken = 0;
        while taken < bytes
            && let Some(&first) = self.order.front()
        {
            let lane = &mut self.all[first];
            let is_call = matches!(lane.items.front(), Some(Item::Call(..)));
            if is_call && !frames.is_empty() {
                break;
            }
            self.order.pop_front();
            let Some(item) = lane.items.pop_front() else {
                continue;
            };
            let size = item.bytes();
            lane.load.remove(size);
            lane.ordered.remove(size);
            taken += size;
            match item {
                Item::Encoded(head) => frames.move_from(&mut lane.bytes, head),
                Item::Call(call, _) => calls.push_back(*call),
            }
            while let Some(next) = lane.items.get(lane.ordered.messages) {
                let size = next.bytes();
                if lane.ordered.messages > 0 && lane.ordered.bytes + size > TURN_BYTES {
                    break;
                }
                lane.ordered.add(size);
                self.order.push_back(first);
            }
            lane.rest();
        }
    }

    fn lane_of(&mut self, agent: &str) -> usize {
        if let Some(&lane) = self.by_name.get(agent) {
            return lane;
        }
        if agent.is_empty() {
            return SHARED;
        }
        let lane = if self.all.len() < self.most {
            self.all.push(Lane::default());
            self.all.len() - 1
        } else {
            match self.empty_lane() {
                Some(lane) => lane,
                None => return SHARED,
            }
        };
        self.by_name.remove(&*self.all[lane].name);
        self.all[lane].name = agent.into();
        self.by_name.insert(agent.into(), lane);
        lane
    }

    /// A lane with nothing in it, the hand's next one.
    fn empty_lane(&mut self) -> Option<usize> {
        let own = self.all.len() - 1;
        for _ in 0..own {
            self.hand = self.hand % own + 1;
            if self.all[self.hand].items.is_empty() {
                return Some(self.hand);
            }
        }
        None
    }
}

impl Lane {
    /// Gives back what an empty lane does not need: it keeps its name and a small buffer.
    fn rest(&mut self) {
        let kept = self.bytes.capacity() + self.items.capacity() * size_of::<Item>();
        if self.items.is_empty() && kept > KEPT_BYTES {
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
        let taken = take(&mut lanes, 2 * FEW_BYTES);
        let before = |taken: &[String]| taken.iter().position(|agent| agent == "honest");
        assert!(before(&taken).is_some_and(|before| before <= FEW_BYTES / 100));
        // From then on the flood has a turn at a time.
        push(&mut lanes, "honest", &[0; 100]);
        let taken = take(&mut lanes, 2 * TURN_BYTES);
        assert!(before(&taken).is_some_and(|before| before <= TURN_BYTES / 100));
    }

    #[test]
    fn a_few_messages_of_many_agents_are_taken_as_they_came() {
        let mut lanes = Lanes::default();
        let sent: Vec<_> = (0..500)
            .map(|count| format!("agent-{}", count * 7 % 11))
            .collect();
        for agent in &sent {
            push(&mut lanes, agent, &[0; 100]);
        }
        let mut taken = Vec::new();
        while !lanes.is_empty() {
            taken.extend(take(&mut lanes, 1000));
        }
        assert_eq!(taken, sent);
    }

    #[test]
    fn those_who_send_much_take_turns() {
        let mut lanes = Lanes::default();
        for agent in ["first", "second"] {
            for _ in 0..10_000 {
                push(&mut lanes, agent, &[0; 100]);
            }
        }
        take(&mut lanes, 4 * FEW_BYTES);
        let taken = take(&mut lanes, 20 * TURN_BYTES);
        let first = taken.iter().filter(|agent| *agent == "first").count();
        let second = taken.len() - first;
        assert!(
            first.abs_diff(second) <= 2 * TURN_BYTES / 100,
            "{first} {second}"
        );
        // Messages larger than a turn are taken, too.
        let mut lanes = Lanes::default();
        for _ in 0..8 {
            push(&mut lanes, "large", &vec![0; FEW_BYTES]);
        }
        assert_eq!(take(&mut lanes, 8 * FEW_BYTES).len(), 8);
    }

    #[test]
    fn an_empty_lane_keeps_little_whatever_has_been_in_it() {
        let mut lanes = Lanes::default();
        for (agent, payload) in [("long", vec![0; 100]), ("a", Vec::new())] {
            for _ in 0..2000 {
                push(&mut lanes, agent, &payload);
            }
            take(&mut lanes, usize::MAX);
            let lane = &lanes.all[lanes.by_name[agent]];
            let kept = lane.bytes.capacity() + lane.items.capacity() * size_of::<Item>();
            assert!(kept <= KEPT_BYTES, "{agent}: {kept}");
        }
    }

    #[test]
    fn names_of_the_network_take_bounded_room() {
        let mut lanes = Lanes {
            most: 8,
            ..Lanes::default()
        };
        for name in 0..1000 {
            push(&mut lanes, &format!("one-{name}"), b"x");
            take(&mut lanes, 1000);
        }
        assert!(lanes.all.len() <= 8 && lanes.by_name.len() <= 8);
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
