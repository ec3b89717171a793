//! Repair: a damaged journal becomes one that folds, of all blocks that can be read.
//!
//! What follows a hole was written by an engine that knew the blocks in it, so it is fitted to a
//! fold that does not:
//!
//! - An agent whose sequence numbers jump gets a journaled skip of what is missing, as for samples
//!   that never came. In a session that began in the hole, that is everything before its first
//!   sample.
//! - Agents keep their numbers. One whose enrolment is lost is enrolled again where the hole was,
//!   under its name if the checkpoint knows it, else under a placeholder.
//! - A number that was enrolled again although its removal is lost is removed first.
//! - Lessons about objects are numbered anew, for the numbers count those before.
//! - Instructions keep their numbers, which are also those of blockages: each one that is lost is
//!   replaced by one that does nothing.

#[cfg(test)]
mod tests;

use std::borrow::Cow;
use std::path::PathBuf;

use cogmap_proto::{ObjectLesson, SkipReason, SpaceSettings};
use cognitive_map::CognitiveMap;
use serde::Serialize;

use crate::decode::core_settings;
use crate::journal::{BlockWriter, CorruptBlock, Entry, JournaledInstruction, entries};
use crate::store::{
    Damage, Derived, Flaw, LocalJournal, LocalStore, Replacement, StoreError, StoredSpace,
};

/// What placeholders for names begin with; the agent's number follows.
const NAME_PREFIX: &str = "unknown-";

/// What a repair has kept, and what not.
#[derive(Clone, Debug, Serialize)]
pub struct RepairReport {
    /// The space.
    pub space: String,
    /// Blocks of the new journal that were in the old one.
    pub blocks_kept: u64,
    /// Samples in them.
    pub samples_kept: u64,
    /// Blocks that cannot be read.
    pub damage: Vec<LostBlocks>,
    /// Acknowledged samples that are not in the new journal.
    pub samples_lost: u64,
    /// Agents of which something is known to be missing.
    pub agents: Vec<AgentLoss>,
    /// Where the old journal is kept.
    pub set_aside: PathBuf,
}

/// Blocks that cannot be read, one behind the other.
#[derive(Clone, Debug, Serialize)]
pub struct LostBlocks {
    /// The first one.
    pub first: u64,
    /// The next one that can be read; none where the damage reaches the end.
    pub next: Option<u64>,
    /// Why they cannot be read.
    pub reason: String,
}

/// What is missing of an agent.
#[derive(Clone, Debug, Default, Serialize)]
pub struct AgentLoss {
    /// Its number.
    pub agent: u32,
    /// Its name.
    pub name: String,
    /// Whether the name is a placeholder, because the enrolment is lost.
    pub name_lost: bool,
    /// Samples that are not in the new journal, by session.
    pub missing: Vec<MissingSamples>,
}

/// Samples of a session that are missing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct MissingSamples {
    /// Session.
    pub session: u64,
    /// First sequence number.
    pub from: u64,
    /// First beyond.
    pub to: u64,
    /// Whether nothing of the session follows them, so that they are not journaled as lost: whoever
    /// still has them may send them again.
    pub at_end: bool,
}

/// Replaces the damaged journal of a space by one of all blocks that can be read. The old one is
/// kept. `None` where nothing is damaged.
///
/// # Errors
/// The store cannot be read or written.
pub fn repair(store: &LocalStore, space: &StoredSpace) -> Result<Option<RepairReport>, StoreError> {
    if space.settings.is_none() {
        let name = &space.name;
        return Err(StoreError::Corrupt(format!(
            "name and settings of {name:?} are lost, and no journal folds without: restore a backup"
        )));
    }
    let journals = store.journals();
    let survey = journals.survey(space.number)?;
    if survey.is_sound() && !holds_malformed(journals, space)? {
        return Ok(None);
    }
    let mut repair = Repair {
        journal: journals.replace(space)?,
        checkpoint: agents_of_checkpoint(store, space),
        agents: Vec::new(),
        lessons: 0,
        instructions: 0,
        holes: false,
        blocks_kept: 0,
        samples_kept: 0,
        damage: Vec::new(),
        failure: None,
    };
    repair.read(journals, space)?;
    // Blocks that are missing at the end leave no trace in the files.
    let at_end = |damage: &&Damage| damage.flaw == Flaw::Missing && damage.next.is_none();
    if let Some(damage) = survey.damage.last().filter(at_end) {
        repair.note(damage);
    }
    repair.note_ends();
    let agents = repair.agents.into_iter().map(|agent| agent.loss);
    let agents = agents.filter(|loss| loss.name_lost || !loss.missing.is_empty());
    let agents = agents.collect();
    let (_, set_aside) = repair.journal.finish()?;
    Ok(Some(RepairReport {
        space: space.name.clone(),
        blocks_kept: repair.blocks_kept,
        samples_kept: repair.samples_kept,
        damage: repair.damage,
        samples_lost: survey.lost.samples,
        agents,
        set_aside,
    }))
}

/// Whether a journal whose bytes are whole holds a block that no start can fold.
fn holds_malformed(journals: &LocalJournal, space: &StoredSpace) -> Result<bool, StoreError> {
    let mut found = false;
    journals.read_all(space.number, |item| {
        let malformed = |bytes| matches!(entries(bytes), Err(CorruptBlock::Malformed(_)));
        found |= item.is_ok_and(|(_, _, bytes)| malformed(bytes));
    })?;
    Ok(found)
}

/// An agent as the latest checkpoint has it.
struct CheckpointAgent {
    name: String,
    session: u64,
    next_seq: u64,
}

/// The agents of the latest checkpoint, by number; none where that cannot be read either.
fn agents_of_checkpoint(store: &LocalStore, space: &StoredSpace) -> Vec<CheckpointAgent> {
    let settings = space.settings.as_deref().unwrap_or_default();
    let settings = serde_json::from_slice::<SpaceSettings>(settings).ok();
    let settings = settings.and_then(|settings| core_settings(&settings).ok());
    let checkpoint = store.checkpoint(space.number).ok().flatten();
    let (Some(settings), Some(checkpoint)) = (settings, checkpoint) else {
        return Vec::new();
    };
    let map = CognitiveMap::restore(settings, checkpoint.pages);
    map.map_or_else(
        |_| Vec::new(),
        |map| {
            let agents = map.agents_ever().map(|(_, agent)| CheckpointAgent {
                name: agent.name().as_str().to_owned(),
                session: agent.session(),
                next_seq: agent.next_seq(),
            });
            agents.collect()
        },
    )
}

/// A journal that is being repaired.
struct Repair<'a> {
    journal: Replacement<'a>,
    /// What a checkpoint knows of blocks that may be lost.
    checkpoint: Vec<CheckpointAgent>,
    agents: Vec<KnownAgent>,
    /// Lessons in the new journal.
    lessons: u64,
    /// Instructions in it.
    instructions: u64,
    /// Whether a hole has been met.
    holes: bool,
    blocks_kept: u64,
    samples_kept: u64,
    damage: Vec<LostBlocks>,
    failure: Option<StoreError>,
}

/// An agent of the new journal.
#[derive(Default)]
struct KnownAgent {
    /// Whether it is, and has not been removed.
    is_enrolled: bool,
    /// Its session and the next sequence number, once it has one.
    next: Option<(u64, u64)>,
    loss: AgentLoss,
}

impl Repair<'_> {
    fn read(&mut self, journals: &LocalJournal, space: &StoredSpace) -> Result<(), StoreError> {
        journals.read_all(space.number, |item| match item {
            _ if self.failure.is_some() => {}
            Err(damage) => self.note(&damage),
            Ok((number, samples, bytes)) => match entries(bytes) {
                Ok(read) => {
                    let kept = self.keep(samples, bytes, read);
                    self.failure = kept.err();
                }
                // Nothing is wrong with it: this build is too old.
                Err(error @ CorruptBlock::Version(_)) => {
                    let what = format!("block {number} of {:?}: {error}", space.name);
                    self.failure = Some(StoreError::Corrupt(what));
                }
                Err(error) => {
                    self.holes = true;
                    self.damage.push(LostBlocks {
                        first: number,
                        next: Some(number + 1),
                        reason: error.to_string(),
                    });
                }
            },
        })?;
        self.failure.take().map_or(Ok(()), Err)
    }

    /// Notes samples that the checkpoint has seen and that nothing in the journal follows.
    fn note_ends(&mut self) {
        for (known, seen) in self.agents.iter_mut().zip(&self.checkpoint) {
            let from = match known.next {
                Some((session, next)) if session == seen.session => next,
                Some((session, _)) if session > seen.session => continue,
                _ => 0,
            };
            if from < seen.next_seq {
                known.loss.missing.push(MissingSamples {
                    session: seen.session,
                    from,
                    to: seen.next_seq,
                    at_end: true,
                });
            }
        }
    }

    fn note(&mut self, damage: &Damage) {
        self.holes = true;
        self.damage.push(LostBlocks {
            first: damage.block,
            next: damage.next,
            reason: damage.flaw.to_string(),
        });
    }

    /// Takes a block over: as it is, unless it counts on something that is lost.
    fn keep(
        &mut self,
        samples: u64,
        bytes: &[u8],
        entries: Vec<Entry<'static>>,
    ) -> Result<(), StoreError> {
        let (mut before, mut fitted) = (BlockWriter::new(), BlockWriter::new());
        let mut changed = false;
        for entry in entries {
            let fits = self.fit(entry, &mut before, &mut fitted);
            changed |= !fits;
        }
        // Without a hole before it, a block has nothing to be fitted to.
        if self.holes && !before.is_empty() {
            self.journal.append(0, before.bytes())?;
        }
        let bytes = if self.holes && changed {
            fitted.bytes()
        } else {
            bytes
        };
        self.blocks_kept += 1;
        self.samples_kept += samples;
        self.journal.append(samples, bytes)
    }

    /// Writes an entry as it has to be now to `fitted`, and what must come earlier to `before`.
    /// Says whether the entry is as it was.
    fn fit(
        &mut self,
        entry: Entry<'static>,
        before: &mut BlockWriter,
        fitted: &mut BlockWriter,
    ) -> bool {
        let mut fits = true;
        let entry = match entry {
            Entry::Enrol { agent, name } => {
                self.enrol(agent, &name, before);
                Entry::Enrol { agent, name }
            }
            Entry::Samples { agent, batch } => {
                let count = batch.samples.len() as u64;
                self.advance(agent, batch.session, batch.first_seq, count, before);
                Entry::Samples { agent, batch }
            }
            Entry::Skip {
                agent,
                session,
                from,
                to,
                reason,
            } => {
                self.advance(agent, session, from, to.saturating_sub(from), before);
                Entry::Skip {
                    agent,
                    session,
                    from,
                    to,
                    reason,
                }
            }
            Entry::Teach {
                number,
                name,
                lesson,
            } => {
                fits = number == self.lessons;
                self.next_teaching(name, lesson)
            }
            Entry::Instruct {
                number,
                instruction,
            } => {
                self.instruct_to(number, before);
                fits = number == self.instructions;
                self.next_instruction(instruction)
            }
            Entry::Remember { remembrance } => Entry::Remember { remembrance },
            Entry::Remove { agent } => {
                self.enrol_to(agent.saturating_add(1), before);
                if let Some(known) = self.agents.get_mut(agent as usize) {
                    known.is_enrolled = false;
                }
                Entry::Remove { agent }
            }
            Entry::Forget { number, name } => {
                fits = number == self.lessons;
                let number = self.next_lesson();
                Entry::Forget { number, name }
            }
        };
        fitted.push(&entry);
        fits
    }

    /// Enrols an agent under a name, also one that takes the place of a removed one.
    fn enrol(&mut self, agent: u32, name: &str, before: &mut BlockWriter) {
        self.enrol_to(agent, before);
        match self.agents.get_mut(agent as usize) {
            Some(known) => {
                if known.is_enrolled && self.holes {
                    before.push(&Entry::Remove { agent });
                }
                known.enrol_again(name);
            }
            None => self.agents.push(KnownAgent::named(agent, name)),
        }
    }

    fn next_teaching(&mut self, name: Cow<'static, str>, lesson: ObjectLesson) -> Entry<'static> {
        let number = self.next_lesson();
        Entry::Teach {
            number,
            name,
            lesson,
        }
    }

    /// Replaces the instructions up to and without `number` that are lost. Otherwise a blockage to
    /// come would get the number of one that is kept.
    fn instruct_to(&mut self, number: u64, before: &mut BlockWriter) {
        if !self.holes {
            return;
        }
        for number in self.instructions..number {
            // Nothing goes by the number of a lost instruction.
            let instruction = JournaledInstruction::Unblock { id: number };
            before.push(&Entry::Instruct {
                number,
                instruction,
            });
        }
        self.instructions = self.instructions.max(number);
    }

    fn next_instruction(&mut self, instruction: JournaledInstruction) -> Entry<'static> {
        let number = self.instructions;
        self.instructions += 1;
        Entry::Instruct {
            number,
            instruction,
        }
    }

    fn next_lesson(&mut self) -> u64 {
        self.lessons += 1;
        self.lessons - 1
    }

    /// Enrols agents whose enrolment is lost, up to and without `agent`.
    fn enrol_to(&mut self, agent: u32, before: &mut BlockWriter) {
        for number in (0..agent).skip(self.agents.len()) {
            let known = self.checkpoint.get(number as usize);
            let known = known.map(|agent| agent.name.clone());
            let name = known
                .clone()
                .unwrap_or_else(|| format!("{NAME_PREFIX}{number}"));
            before.push(&Entry::Enrol {
                agent: number,
                name: Cow::Borrowed(&name),
            });
            let mut agent = KnownAgent::named(number, &name);
            agent.loss.name_lost = known.is_none();
            self.agents.push(agent);
        }
    }

    /// Notes `count` samples of an agent from `from` on, and skips those that are missing before
    /// them.
    fn advance(
        &mut self,
        agent: u32,
        session: u64,
        from: u64,
        count: u64,
        before: &mut BlockWriter,
    ) {
        self.enrol_to(agent.saturating_add(1), before);
        let Some(known) = self.agents.get_mut(agent as usize) else {
            return;
        };
        let end = from.saturating_add(count);
        let next = match known.next {
            Some((current, next)) if current == session => next,
            _ => 0,
        };
        if from > next && self.holes {
            let (from, to) = (next, from);
            before.push(&Entry::Skip {
                agent,
                session,
                from,
                to,
                reason: SkipReason::Lost,
            });
            known.loss.missing.push(MissingSamples {
                session,
                from,
                to,
                at_end: false,
            });
        }
        known.next = Some((session, end));
    }
}

impl KnownAgent {
    fn named(agent: u32, name: &str) -> Self {
        Self {
            is_enrolled: true,
            next: None,
            loss: AgentLoss {
                agent,
                name: name.to_owned(),
                ..AgentLoss::default()
            },
        }
    }

    /// The number is another agent's from here on.
    fn enrol_again(&mut self, name: &str) {
        self.is_enrolled = true;
        self.next = None;
        name.clone_into(&mut self.loss.name);
    }
}
