//! What people and programs say of ways, routes and trips. Each call answers when that is durable.

use cognitive_map::{AgentId, Blockage, BlockageId, Errand, Instruction, TripId};
use tokio::sync::oneshot;

use super::Space;
use crate::engine::message::{Call, IngestError, InstructionRequest};

impl Space {
    /// Says that something is blocked; answers the blockage with its number.
    ///
    /// # Errors
    /// See [`IngestError`].
    pub async fn block(&self, blockage: Blockage) -> Result<Blockage, IngestError> {
        let number = self.instruct(Instruction::Block(blockage)).await?;
        let id = BlockageId(number);
        Ok(Blockage { id, ..blockage })
    }

    /// Ends a blockage.
    ///
    /// # Errors
    /// See [`IngestError`].
    pub async fn unblock(&self, id: BlockageId) -> Result<(), IngestError> {
        self.instruct(Instruction::Unblock(id)).await.map(drop)
    }

    /// Lets an agent follow a route.
    ///
    /// # Errors
    /// See [`IngestError`].
    pub async fn lead(&self, agent: AgentId, errand: Errand) -> Result<(), IngestError> {
        let instruction = Instruction::Follow(agent, errand);
        self.instruct(instruction).await.map(drop)
    }

    /// Lets an agent follow no route.
    ///
    /// # Errors
    /// See [`IngestError`].
    pub async fn stop_leading(&self, agent: AgentId) -> Result<(), IngestError> {
        let instruction = Instruction::StopFollowing(agent);
        self.instruct(instruction).await.map(drop)
    }

    /// Says whether a trip is never to be forgotten.
    ///
    /// # Errors
    /// See [`IngestError`].
    pub async fn pin(&self, trip: TripId, is_pinned: bool) -> Result<(), IngestError> {
        let instruction = if is_pinned {
            Instruction::Pin(trip)
        } else {
            Instruction::Unpin(trip)
        };
        self.instruct(instruction).await.map(drop)
    }

    /// Takes an instruction; answers its number.
    async fn instruct(&self, instruction: Instruction) -> Result<u64, IngestError> {
        let (reply, answer) = oneshot::channel();
        let request = InstructionRequest { instruction, reply };
        self.call(Call::Instruction(request))?;
        answer.await.unwrap_or(Err(IngestError::Closed))
    }
}
