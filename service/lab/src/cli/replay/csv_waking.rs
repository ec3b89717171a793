//! Agents that woke up at unknown places of a map that others have taught.

use std::fmt::{self, Display, Formatter};

use cogmap_lab::csv::{TableSet, Truth};
use cogmap_proto::StampedPose;
use nalgebra::Vector3;
use serde::Serialize;

use super::errors::median;

/// A view is covered when a taught one lies within this distance in the plane \[m\] …
const COVERED_M: f64 = 6.0;
/// … and on the same floor: within this height \[m\].
const FLOOR_M: f64 = 2.5;
/// A first claim that is farther off than this is a false one \[m\].
pub(super) const FALSE_CLAIM_M: f64 = 15.0;

/// An agent, what it saw where, and what the map claimed.
#[derive(Debug)]
pub(super) struct Sighted<'a> {
    pub(super) is_taught: bool,
    /// Where it was at its views \[m\].
    pub(super) seen_at: Vec<Vector3<f64>>,
    /// Its poses in the map, as they were known.
    pub(super) claims: &'a [StampedPose],
    pub(super) truth: &'a Truth,
}

/// What became of agents that woke up. An agent is covered when more than half of its views are:
/// only those can be placed, the others should be left alone.
#[derive(Clone, Copy, Debug, Serialize)]
pub(super) struct Waking {
    pub(super) woken: usize,
    pub(super) covered: usize,
    pub(super) covered_placed: usize,
    /// Median over covered agents of the median error in the plane \[m\].
    pub(super) median_error_m: Option<f64>,
    /// Agents that were placed.
    claims: usize,
    pub(super) claims_uncovered: usize,
    pub(super) first_claims_over_15_m: usize,
    /// Mean share of claims on a wrong floor.
    pub(super) wrong_floor: Option<f64>,
}

/// What the map claimed of an agent.
struct Claimed {
    is_covered: bool,
    median_m: f64,
    first_m: f64,
    wrong_floor: f64,
}

impl Waking {
    /// Of agents in the order in which they were sent.
    pub(super) fn of(agents: &[Sighted<'_>]) -> Self {
        let mut taught: Vec<Vector3<f64>> = Vec::new();
        let (mut woken, mut covered) = (0, 0);
        let mut claimed: Vec<Claimed> = Vec::new();
        for agent in agents {
            if agent.is_taught {
                taught.extend(&agent.seen_at);
                continue;
            }
            if agent.seen_at.is_empty() {
                continue;
            }
            let is_near = |at: &&Vector3<f64>| {
                let near = |other: &Vector3<f64>| {
                    (at.xy() - other.xy()).norm() < COVERED_M && (at.z - other.z).abs() < FLOOR_M
                };
                taught.iter().any(near)
            };
            let is_covered = 2 * agent.seen_at.iter().filter(is_near).count() > agent.seen_at.len();
            woken += 1;
            covered += usize::from(is_covered);
            claimed.extend(Claimed::of(agent, is_covered));
        }
        let of_covered = claimed.iter().filter(|claim| claim.is_covered);
        let errors_m: Vec<f64> = of_covered.map(|claim| claim.median_m).collect();
        let is_false = |claim: &&Claimed| claim.first_m > FALSE_CLAIM_M;
        let wrong_floor: f64 = claimed.iter().map(|claim| claim.wrong_floor).sum();
        Self {
            woken,
            covered,
            covered_placed: errors_m.len(),
            claims: claimed.len(),
            claims_uncovered: claimed.len() - errors_m.len(),
            median_error_m: median(errors_m),
            first_claims_over_15_m: claimed.iter().filter(is_false).count(),
            wrong_floor: (!claimed.is_empty()).then(|| wrong_floor / claimed.len() as f64),
        }
    }
}

impl Claimed {
    fn of(agent: &Sighted<'_>, is_covered: bool) -> Option<Self> {
        let begin_ns = TableSet::sent_ns(0);
        let off = agent.claims.iter().filter_map(|claim| {
            let truth = agent.truth.at(claim.stamp_ns.saturating_sub(begin_ns))?;
            Some(Vector3::from(claim.translation_m) - truth)
        });
        let off: Vec<Vector3<f64>> = off.collect();
        // A single pose is no trajectory.
        if off.len() < 2 {
            return None;
        }
        let wrong_floor = off.iter().filter(|off| off.z.abs() > FLOOR_M).count();
        Some(Self {
            is_covered,
            median_m: median(off.iter().map(|off| off.xy().norm()).collect())?,
            first_m: off[0].xy().norm(),
            wrong_floor: wrong_floor as f64 / off.len() as f64,
        })
    }
}

impl Display for Waking {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let metres = self
            .median_error_m
            .map_or("none".to_owned(), |m| format!("{m:.2} m"));
        write!(
            f,
            "{} woken, {} covered, {} of these placed, median error {metres}; {} claims of others, \
             {} first claims over {FALSE_CLAIM_M} m",
            self.woken,
            self.covered,
            self.covered_placed,
            self.claims_uncovered,
            self.first_claims_over_15_m,
        )
    }
}
