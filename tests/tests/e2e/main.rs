//! End to end, through the doors only: the process, Zenoh, HTTP, the command line.
//!
//! Two environment variables make the drills longer than the gate has time for:
//! `COGMAP_DRILL_KILLS` (how often the service is killed under load; 4 when absent, 30 for the
//! figure in the README) and `COGMAP_DRILL_PAUSE_S` (how long it is stopped; 3 s when absent).
//! `COGMAP_TEST_SEED` repeats a failure.
#![allow(clippy::unwrap_used)] // All of it is tests; clippy sees that only in test functions.

// What the outside does to the service.
mod bad_input; // what no client would send
mod crash; // kill -9, and what recovery makes of it
mod episodes; // what was recognised, when the robot and the service have ended
mod full_disk; // a disk that takes no more
mod leaps; // sequence numbers that somebody made up
mod names; // names that others claim, and agents that are removed
mod nobody_waits; // connections that say next to nothing
mod pause; // a process that stands still
mod readers; // readers and senders at once
mod secure; // the example of docs/security.md: who may say and hear what
mod store; // damage on the disk, repair and backups

// What the service does for the outside.
mod cli; // the commands
mod demo; // robots that are lost and found, and a cup that is recognised
mod eval; // the experiments
mod exports; // ways for other programs, and maps as they were
mod http; // samples in, answers out
mod http_guard; // who is let in, and how the service goes
mod http_ingest; // samples over HTTP alone
mod localize; // where samples of nobody were taken
mod percepts; // what was felt and seen, recalled and predicted
mod replay; // graphs and recordings through the experience map
mod replay_objects; // objects learned and recognised, from files
mod replay_real; // all recordings of a directory, by what they hold
mod routes; // from here to there
mod sequences; // what comes next, and where somebody was
mod uniform; // one mistake, one answer; one event, one id; JSON for who asks
mod zenoh; // estimates, watermarks, queries, events

mod feeding; // a robot that keeps sending; what the drills compare
