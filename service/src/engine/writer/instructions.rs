//! Instructions: blockages, routes to follow, and pins.

use cognitive_map::{BlockageId, Instruction, Record};

use super::Writer;
use crate::encode;
use crate::engine::counters::Drop;
use crate::engine::message::{Change, InstructionRequest};
use crate::journal::Entry;

impl Writer {
    /// Journals an instruction. Whoever waits is answered when it is durable.
    pub(super) fn receive_instruction(&mut self, request: InstructionRequest) {
        let InstructionRequest {
            mut instruction,
            reply,
        } = request;
        if let Some(refusal) = self.shared.health.refusal() {
            self.counters.dropped(Drop::StoreFailed);
            // Whoever asked may have gone.
            let _ = reply.send(Err(refusal));
            return;
        }
        let number = self.next_instruction;
        self.next_instruction += 1;
        // A blockage goes by the number of the instruction that made it.
        if let Instruction::Block(blockage) = &mut instruction {
            blockage.id = BlockageId(number);
        }
        self.block.push(&Entry::Instruct {
            number,
            instruction: encode::journaled_instruction(&instruction),
        });
        self.records.push(Record::Instruct {
            number,
            instruction,
        });
        self.changes.push(Change::Instructed(reply, number));
    }
}
