//! Encoded messages, one behind the other in one buffer.

use std::collections::VecDeque;

use cogmap_proto::Codec;

use super::Load;

/// A buffer that has grown beyond this is given back when little of it is used.
const KEPT_BYTES: usize = 1 << 20;

/// Messages that the writer has taken.
#[derive(Debug, Default)]
pub(super) struct Frames {
    heads: Vec<Head>,
    bytes: Vec<u8>,
    /// How many heads and bytes have been read.
    read: Load,
}

/// How a message lies in the buffer: its agent's name, then its payload.
#[derive(Clone, Copy, Debug)]
pub(super) struct Head {
    pub(super) codec: Codec,
    pub(super) agent_len: usize,
    pub(super) payload_len: usize,
}

impl Frames {
    /// Whether all has been read.
    pub(super) fn is_empty(&self) -> bool {
        self.read.messages == self.heads.len()
    }

    /// Moves a message here from the front of `bytes`.
    pub(super) fn move_from(&mut self, bytes: &mut VecDeque<u8>, head: Head) {
        let len = head.agent_len + head.payload_len;
        let (first, second) = bytes.as_slices();
        let in_first = len.min(first.len());
        self.bytes.extend_from_slice(&first[..in_first]);
        self.bytes.extend_from_slice(&second[..len - in_first]);
        bytes.drain(..len);
        self.heads.push(head);
    }

    /// The next message: its agent's name, not yet checked, its codec and its payload.
    pub(super) fn next(&mut self) -> Option<(&str, Codec, &[u8])> {
        let Head {
            codec,
            agent_len,
            payload_len,
        } = *self.heads.get(self.read.messages)?;
        let start = self.read.bytes;
        self.read.add(agent_len + payload_len);
        let (agent, payload) = self.bytes[start..self.read.bytes].split_at(agent_len);
        let agent = str::from_utf8(agent).expect("a name was pushed as a str");
        Some((agent, codec, payload))
    }

    /// Forgets what has been read.
    pub(super) fn clear(&mut self) {
        if self.bytes.capacity() > KEPT_BYTES && self.bytes.len() < self.bytes.capacity() / 4 {
            *self = Self::default();
        }
        self.heads.clear();
        self.bytes.clear();
        self.read = Load::default();
    }
}
